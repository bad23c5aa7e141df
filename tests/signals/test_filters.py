"""Zero-phase filters: no shift, no seam between blocks, refusals in one line."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.errors import ParameterError
from vinesexp.signals.filters import (
    butterworth,
    settling_samples,
    zero_phase,
    zero_phase_blocks,
)


@settings(deadline=None, max_examples=25)
@given(
    cuts=st.lists(st.integers(1, 19_999), max_size=6, unique=True),
    low=st.floats(5.0, 40.0),
    seed=st.integers(0, 100),
)
def test_blocks_leave_no_seam(cuts: list[int], low: float, seed: int) -> None:
    x = np.cumsum(np.random.default_rng(seed).standard_normal(20_000))
    band = butterworth(1e3, low=low, high=None)
    assert band is not None
    before, after = np.full(50, x[0]), np.full(50, x[-1])
    whole, split = (
        np.concatenate(list(zero_phase_blocks(pieces, band, before=before, after=after)))
        for pieces in ([x], np.split(x, sorted(cuts)))
    )
    assert split.shape == x.shape
    assert np.abs(split - whole).max() < 1e-8 * np.abs(x).max()


@pytest.mark.parametrize("frequency", [3.0, 8.0, 30.0])
def test_no_phase_and_the_gain_of_two_passes(frequency: float) -> None:
    t = np.arange(20_000) / 1e3
    x = np.cos(2 * np.pi * frequency * t)
    y = zero_phase(x, butterworth(1e3, low=4.0, high=None))
    middle = slice(5000, 15_000)
    gain = 1.0 / (1.0 + (4.0 / frequency) ** 4)
    assert np.abs(y - gain * x)[middle].max() < 2e-3 * gain


def test_settled_means_settled() -> None:
    band = butterworth(1e4, low=2.0, high=40.0)
    assert band is not None
    n = settling_samples(band, remains=1e-6)
    size = 8 * n
    answer = np.abs(np.fft.irfft(band.gain(size), size))  # of both directions to an impulse
    assert answer[n : size // 2].max() < 1e-6 * answer.max() * 10


@pytest.mark.parametrize(("low", "high"), [(600.0, None), (50.0, 20.0), (-1.0, None)])
def test_impossible_band_is_refused_in_one_line(low: float, high: float | None) -> None:
    with pytest.raises(ParameterError, match=r"lower corner .* expected above 0 and below"):
        butterworth(1e3, low=low, high=high)


def test_open_band_needs_no_filter() -> None:
    assert butterworth(100.0, low=None, high=49.0) is None
    x = np.arange(5.0)
    assert (zero_phase(x, None) == x).all()
