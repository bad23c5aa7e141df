"""Regime names from impacts made by hand: each definition met, and missed by a little."""

from __future__ import annotations

import numpy as np
import pytest

from vinesexp.errors import ParameterError
from vinesexp.theory.regime_definitions import REGIMES, Regime, activation_spells, regime_of


def judge(times: np.ndarray, sides: np.ndarray, end: float = 100.0) -> Regime:
    return regime_of(times, sides, period=1.0, start=0.0, end=end).regime


def alternating(gap: float = 0.5, cycles: int = 100) -> tuple[np.ndarray, np.ndarray]:
    first = np.arange(cycles) + 0.01
    times = np.sort(np.concatenate([first, first + gap]))
    return times, np.tile([1, -1], cycles)


def test_every_regime_has_a_definition() -> None:
    assert {r.value for r in Regime} == set(REGIMES)


def test_no_impact() -> None:
    assert judge(np.array([]), np.array([])) is Regime.NO_IMPACT
    assert judge(np.array([150.0]), np.array([1])) is Regime.NO_IMPACT


def test_two_symmetric_and_two_asymmetric() -> None:
    assert judge(*alternating(0.5)) is Regime.TWO_SYMMETRIC
    assert judge(*alternating(0.505)) is Regime.TWO_SYMMETRIC
    assert judge(*alternating(0.53)) is Regime.TWO_ASYMMETRIC


def test_modulated_has_spells() -> None:
    t, s = alternating()
    spell = (t % 20.0) < 8.0
    assert judge(t[spell], s[spell]) is Regime.MODULATED


def test_chaos_is_irregular() -> None:
    rng = np.random.default_rng(2)
    t = np.sort(rng.uniform(0.0, 100.0, 70))
    assert judge(t, rng.choice([-1, 1], 70)) is Regime.CHAOS


def test_three_per_cycle() -> None:
    n = np.arange(100)
    t = np.sort(np.concatenate([n + 0.0, n + 0.2, n + 0.5]))
    assert judge(t, np.tile([1, 1, -1], 100)) is Regime.MORE


def test_chatter_is_a_run_on_one_wall() -> None:
    run = np.cumsum(0.1 * 0.6 ** np.arange(30))
    t = np.concatenate([k + 0.1 + run for k in range(0, 100, 5)])
    assert judge(t, np.ones(t.size)) is Regime.CHATTER


def test_too_short_a_stretch_is_refused() -> None:
    with pytest.raises(ParameterError, match="expected a period"):
        regime_of([0.1], [1], period=1.0, start=0.0, end=0.5)


def test_spells_of_two_impacts_per_cycle() -> None:
    times, sides = alternating(cycles=10)
    stray = np.array([14.2, 14.9, 15.1])
    late = times + 20.0
    all_times = np.concatenate([times, stray, late])
    all_sides = np.concatenate([sides, [1, 1, 1], sides])
    spells = activation_spells(all_times, all_sides, period=1.0)
    np.testing.assert_allclose(spells, [[times[0], times[-1]], [late[0], late[-1]]])


def test_one_odd_cycle_does_not_end_a_spell() -> None:
    times, sides = alternating(cycles=20)
    keep = np.ones(times.size, dtype=bool)
    keep[19] = False
    assert len(activation_spells(times[keep], sides[keep], period=1.0)) == 1
    assert activation_spells(times[:2], sides[:2], period=1.0).shape == (0, 2)


def test_interruptions_that_recur_are_modulation_however_short() -> None:
    times, sides = alternating(cycles=100)
    lost = np.zeros(times.size, dtype=bool)
    for middle in (40, 90, 140):  # three cycles without impact, three times
        lost[middle : middle + 6] = True
    assert judge(times[~lost], sides[~lost]) is Regime.MODULATED
    lost[:130] = False  # once: a disturbance
    assert judge(times[~lost], sides[~lost]) is Regime.TWO_SYMMETRIC


def first_cycles(captured: int, cycles: int = 12) -> Regime:
    times, sides = alternating(cycles=captured)
    return regime_of(times, sides, period=1.0, start=0.0, end=float(cycles), decaying=True).regime


@pytest.mark.parametrize("captured", range(1, 13))
def test_a_release_is_never_strongly_modulated(captured: int) -> None:
    expected = Regime.TWO_SYMMETRIC if captured >= 6 else Regime.CHAOS
    assert first_cycles(captured) is expected


def test_a_release_whose_capture_starts_late_is_captured_all_the_same() -> None:
    """42 mm from 20 mm: 0.875 of its first cycles have one impact on either side."""
    times, sides = alternating(cycles=12)
    late = times > 2.3
    assert judge(times[late], sides[late], end=12.0) is Regime.MODULATED, "of a steady excitation"
    found = regime_of(times[late], sides[late], period=1.0, start=0.0, end=12.0, decaying=True)
    assert found.regime is Regime.TWO_SYMMETRIC


def swinging(amplitude: float, decay: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Every impact is there, and their phase swings."""
    t, s = alternating()
    return t + amplitude * np.exp(-decay * t) * np.sin(0.7 * t), s


def test_impacts_whose_phase_swings_are_not_permanent() -> None:
    assert judge(*swinging(0.002)) is Regime.TWO_SYMMETRIC
    assert judge(*swinging(0.06)) is Regime.MODULATED
    assert judge(*swinging(0.06, decay=0.04)) is Regime.TWO_SYMMETRIC  # on its way to the orbit


def test_a_frequency_that_drifts_and_a_false_impact_are_no_swing() -> None:
    t, s = alternating()
    assert judge(t * (1.0 + 1e-4 * t), s, end=101.0) is Regime.TWO_SYMMETRIC
    more = np.append(t, [20.2, 63.3])
    order = np.argsort(more)
    assert judge(more[order], np.append(s, [1, -1])[order]) is Regime.TWO_SYMMETRIC


def test_a_loss_of_the_ball_in_a_short_record_is_no_permanent_motion() -> None:
    """One slip of half a period in 78 cycles: nine cycles of ten are there nevertheless."""
    t, s = alternating(cycles=78)
    phase = np.where(t < 40.0, 0.15 * (t / 40.0) ** 2, 0.15 * np.exp(-0.1 * (t - 40.0)))
    keep = np.abs(t - 41.0) > 2.0
    count = regime_of((t + phase)[keep], s[keep], period=1.0, start=0.0, end=78.0)
    assert count.captured > 0.9
    assert count.regime is Regime.MODULATED
