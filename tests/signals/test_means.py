"""Amplitudes cycle by cycle: read by blocks, however long the record."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.signals import means
from vinesexp.signals.means import cycle_amplitudes, cycles_from, equal_parts, extremes_of_parts


@pytest.mark.parametrize("frequency", [7.862, 1.0, 333.0])
def test_blocks_of_cycles_give_the_same_and_no_more_is_held(
    frequency: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    rate, n = 1000.0, 50_000
    x = np.cumsum(np.random.default_rng(0).standard_normal(n))
    whole = cycle_amplitudes(x, rate, frequency)
    monkeypatch.setattr(means, "_BLOCK", 2048)
    reads = []

    def read(begin: int, end: int) -> np.ndarray:
        reads.append((begin, end))
        return x[begin:end]

    pieces = cycles_from(read, n, rate, frequency)
    for one, other in zip(whole, pieces, strict=True):
        np.testing.assert_array_equal(one, other)
    assert max(end - begin for begin, end in reads) <= 2048
    assert reads[-1][1] > n - 2 * rate / frequency  # nothing of the end is left out


@settings(deadline=None, max_examples=60)
@given(n=st.integers(1, 3000), parts=st.integers(1, 900), seed=st.integers(0, 9))
def test_parts_show_every_extreme_and_are_no_more_than_asked(n: int, parts: int, seed: int) -> None:
    x = np.random.default_rng(seed).standard_normal(n)
    edges = equal_parts(n, parts)
    low, high = extremes_of_parts(lambda begin, end: x[begin:end], edges)
    assert low.size == high.size <= parts
    for part, least, most in zip(np.split(x, edges[1:-1]), low, high, strict=True):
        assert (least, most) == (part.min(), part.max())
