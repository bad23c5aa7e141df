"""Amplitude over clearance: what its points and bars stand for."""

import numpy as np
import pytest

from vinesexp.figures.over_clearance import DrawnLevel, amplitude_over_clearance


def test_each_point_has_the_bar_of_its_error():
    half = np.array([0.02, 0.3, np.nan])
    level = DrawnLevel(
        name="G = 0.25 mm", G=0.25, clearance=np.array([30.0, 33.0, 36.0]),
        mean=np.array([5.2, 5.0, 7.5]), largest=np.array([5.3, 5.1, 9.0]), half=half,
        cycles=(300, 310, 5), regime=("two symmetric", "two symmetric", "strongly modulated"),
        curve=(np.empty(0), np.empty(0)), records=("a", "b", "c"),
    )  # fmt: skip
    (axis,) = amplitude_over_clearance([level]).axes
    bars = [one.lines[2][0].get_segments()[0] for one in axis.containers]
    assert [bar[0][0] for bar in bars] == [30.0, 33.0]  # five cycles have no known error
    for bar, mean, reach in zip(bars, level.mean, half, strict=False):
        np.testing.assert_allclose(bar[:, 1], [mean - reach, mean + reach])


@pytest.mark.parametrize("predicted", [True, False])
def test_the_legend_names_what_is_drawn_and_nothing_else(predicted):
    b = np.array([30.0, 33.0])
    level = DrawnLevel(
        name="G", G=0.25, clearance=b, mean=b / 6, largest=b / 6, half=b / 100, cycles=(300, 300),
        regime=("two symmetric",) * 2, curve=(b, b / 6) if predicted else (np.empty(0),) * 2,
    )  # fmt: skip
    (legend,) = amplitude_over_clearance([level]).legends
    named = [text.get_text() for text in legend.get_texts()]
    line = ["predicted for two impacts per cycle"] * predicted
    assert named == ["mean, two symmetric", "largest", *line]
