"""Amplitude over clearance: what its points and bars stand for."""

from dataclasses import replace

import numpy as np
import pytest
from tests.report.test_overlaps import overlapping, texts

from vinesexp.clearance.levels import LevelBase, PeriodicLevel, Tested
from vinesexp.figures.over_clearance import DrawnLevel, amplitude_over_clearance
from vinesexp.units import COVERAGE_95, Quantity

NO_CURVE = np.empty(0), np.empty(0)


def drawn(tests, *, errors, curve=NO_CURVE):
    """Tests at 0.25 mm; the largest amplitude of each is 2 % above its mean."""
    rows = [
        {"amplitude_max_m": 1.02 * test.value, "amplitude_error_m": error, "cycles": 300}
        for test, error in zip(tests, errors, strict=True)
    ]
    level = PeriodicLevel(0.25e-3, LevelBase(Quantity(0.25e-3), None), tests)
    return DrawnLevel(level, rows, curve, lowest={}, end={})


def test_each_point_has_the_bar_of_its_error():
    means, errors = (5.2e-3, 5.0e-3, 7.5e-3), (1e-5, 1.5e-4, None)
    tests = [
        Tested(b, mean, "two symmetric", f"b{b}")
        for b, mean in zip((0.030, 0.033, 0.036), means, strict=True)
    ]
    (axis,) = amplitude_over_clearance([drawn(tests, errors=errors)]).axes
    bars = [one.lines[2][0].get_segments()[0] for one in axis.containers]
    assert [bar[0][0] for bar in bars] == [30.0, 33.0]  # few cycles have no known error
    for bar, mean, error in zip(bars, means, errors, strict=False):
        ends = mean - COVERAGE_95 * error, mean + COVERAGE_95 * error
        np.testing.assert_allclose(bar[:, 1], 1e3 * np.array(ends))


@pytest.mark.parametrize("predicted", [True, False])
def test_the_legend_names_what_is_drawn_and_nothing_else(predicted):
    b = np.array([30.0, 33.0])
    tests = [Tested(1e-3 * one, 1e-3 * one / 6, "two symmetric", "a") for one in b]
    level = drawn(tests, errors=(1e-5, 1e-5), curve=(b, b / 6) if predicted else NO_CURVE)
    (legend,) = amplitude_over_clearance([level]).legends
    named = [text.get_text() for text in legend.get_texts()]
    line = ["predicted for two impacts per cycle"] * predicted
    assert named == ["mean, two symmetric", "largest", *line]


@pytest.mark.long
@pytest.mark.parametrize("published", [19.4, 21.5])
def test_names_of_long_records_and_of_both_predictions_lie_beside_one_another(published):
    """Titles of two panels lay over each other, and both b_c where the published one is less."""
    tests = [Tested(1e-3 * b, 5e-3, "two symmetric", "a") for b in (10.0, 17.0, 20.0, 29.0)]
    level = drawn(tests, errors=(1e-5,) * 4)
    lowest = {"exact_mm": 21.25, "predicted_low_mm": 21.1, "predicted_high_mm": 21.4,
              "published_mm": published}  # fmt: skip
    states = "before essai2_sinus_12Hz_G_1mm_jeu_10_3", "from essai2_sinus_12Hz_G_1mm_jeu_10_3 on"
    figure = amplitude_over_clearance(
        [replace(level, level=replace(level.level, state=s), lowest=lowest) for s in states]
    )
    found = texts(figure)
    assert overlapping(found) == []
    assert max(end for _, _, _, end, _ in found) < 72.0 * figure.get_size_inches()[0]
