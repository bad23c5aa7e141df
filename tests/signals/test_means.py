"""Amplitudes cycle by cycle: read by blocks, however long the record."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.signals import means
from vinesexp.signals.means import (
    cycle_amplitudes,
    cycles_from,
    equal_parts,
    extremes_of_parts,
    free_cycles,
    time_to_level,
)


@pytest.mark.parametrize("frequency", [7.862, 1.0, 333.0])
def test_blocks_of_cycles_give_the_same_and_no_more_is_held(
    frequency: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    rate, n = 1000.0, 50_000
    x = np.cumsum(np.random.default_rng(0).standard_normal(n))
    whole = cycle_amplitudes(x, rate, frequency)
    monkeypatch.setattr(means, "BLOCK", 2048)
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


@pytest.mark.parametrize(("zeta", "friction"), [(0.001, 0.0), (0.02, 0.0), (0.003, 0.03)])
def test_no_damper_and_no_friction_stops_a_mass_as_a_hand_does(zeta, friction):
    """Of a mass that was stopped, decay times said how soon the hand came."""
    n = np.arange(80)
    decay = np.maximum(np.exp(-2 * np.pi * zeta * n) - friction * n, 1e-4)
    assert free_cycles(decay) == n.size
    hand = np.where(n < 9, decay, 1e-4)
    assert free_cycles(hand) in (7, 8, 9)
    assert np.isnan(time_to_level(n[: free_cycles(hand)], hand[: free_cycles(hand)], 0.005))


def test_a_mass_that_swings_again_was_not_stopped():
    """A heavy ball may take nearly all and give it back."""
    n = np.arange(60)
    decay = np.exp(-0.01 * n)
    assert free_cycles(np.where(n == 20, 0.05 * decay, decay)) == n.size
    assert free_cycles(np.exp(-0.5 * n)) == n.size  # and a strong damper takes most of it
