"""Measured optima: the valley's floor, its jump, and the fastest release."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.clearance.levels import Tested
from vinesexp.clearance.optimum import (
    SCATTER,
    end_of_permanent,
    fastest,
    lowest_amplitude,
    scatter_of,
)
from vinesexp.errors import AnalysisError
from vinesexp.theory.regime_definitions import Swing

TWO, MODULATED = "two symmetric", "strongly modulated"


def valley(clearances: list[float], floor: float, jump: float) -> list[Tested]:
    """A parabola with its vertex at `floor`, and a jump up beyond `jump`."""
    return [
        Tested(b, 5.0 + 3e4 * (b - floor) ** 2 + (2.0 if b > jump else 0.0),
               MODULATED if b > jump else TWO)
        for b in clearances
    ]  # fmt: skip


@settings(deadline=None, max_examples=60)
@given(
    floor=st.floats(0.021, 0.039),
    beyond=st.floats(0.0, 0.004),
    step=st.floats(0.0007, 0.003),
    shift=st.floats(0.0, 1.0),
)
def test_the_floor_of_a_smooth_valley_is_found_and_bracketed(floor, beyond, step, shift):
    tried = [float(b) for b in np.arange(0.01 + shift * step, 0.05, step)]
    jump = floor + beyond
    best = lowest_amplitude(valley(tried, floor, jump))
    assert best.low <= floor <= best.high
    assert best.low <= best.clearance <= best.high
    last_permanent = max(b for b in tried if b <= jump)
    assert best.clearance <= last_permanent + 1e-15  # never across the jump
    assert best.clearance == pytest.approx(min(floor, last_permanent), abs=1e-9)


@settings(deadline=None, max_examples=40)
@given(scatter=st.lists(st.floats(1.0, 9.0), min_size=3, max_size=12), seed=st.integers(0, 99))
def test_whatever_was_measured_the_estimate_stays_in_its_bracket(scatter, seed):
    rng = np.random.default_rng(seed)
    tests = [
        Tested(0.01 + 0.002 * i, a, TWO if rng.random() < 0.6 else MODULATED)
        for i, a in enumerate(scatter)
    ]
    best = lowest_amplitude(tests)
    assert (best.low or 0.0) <= best.clearance <= (best.high or 1.0)
    lowest = min(tests, key=lambda test: test.value)
    assert (best.low or 0.0) <= lowest.clearance <= (best.high or 1.0)


@pytest.mark.parametrize("scatter", [0.002, 0.01, 0.04])
@pytest.mark.parametrize("step", [5e-4, 1e-3, 4e-3])
def test_the_bracket_holds_the_floor_however_close_the_clearances_and_rough_the_tests(
    scatter, step
):
    """The amplitude falls with 1/b and rises with b, as that of two impacts per cycle does."""
    held, rng = [], np.random.default_rng(7)
    for _ in range(200):
        tried = np.arange(0.022 + step * rng.random(), 0.044, step)
        rough = 1.0 + scatter * rng.standard_normal(tried.size)
        tests = [
            Tested(float(b), float((0.033 / b + b / 0.033) ** 2 * k), TWO)
            for b, k in zip(tried, rough, strict=True)
        ]
        best = lowest_amplitude(tests)
        held.append((best.low or 0.0) < 0.033 < (best.high or 1.0))
    assert np.mean(held) > 0.95


def test_the_scatter_is_that_of_repeated_tests_and_of_neighbours():
    rng = np.random.default_rng(3)
    rough = [
        Tested(float(b), float((0.033 / b + b / 0.033) * (1.0 + 0.02 * rng.standard_normal())), TWO)
        for b in np.repeat(np.arange(0.028, 0.038, 0.0005), 3)
    ]
    assert lowest_amplitude(rough).scatter == pytest.approx(0.02, rel=0.25)
    few = [Tested(b, 0.033 / b + b / 0.033, TWO) for b in (0.030, 0.033, 0.036)]
    assert lowest_amplitude(few).scatter == SCATTER


@pytest.mark.parametrize("values", [(0.0,) * 4, (0.0, 1.0, 2.0, 3.0), (2.0, 1.0, 0.0, 3.0)])
@pytest.mark.parametrize("regime", ["no impact", TWO, MODULATED])
def test_a_mass_that_did_not_move_is_lowest_and_shows_no_scatter(values, regime):
    tests = [Tested(0.030 + 0.001 * k, value, regime) for k, value in enumerate(values)]
    best = lowest_amplitude([*tests, Tested(0.040, 9.0, TWO)])
    assert best.alike == tuple(test.clearance for test in tests if not test.value)


def test_an_optimum_at_the_end_is_a_bound():
    falling = [Tested(b, 0.1 / b, TWO) for b in (0.01, 0.02, 0.03)]
    best = lowest_amplitude(falling)
    assert best.bound == "at least"
    assert (best.clearance, best.low, best.high) == (0.03, 0.02, None)
    rising = lowest_amplitude([Tested(b, b, TWO) for b in (0.01, 0.02, 0.03)])
    assert rising.bound == "at most"
    assert (rising.clearance, rising.low, rising.high) == (0.01, None, 0.02)


def test_repeated_clearances_are_averaged():
    tests = [*valley([0.03, 0.032, 0.034], 0.032, 0.05), Tested(0.032, 9.0, TWO)]
    assert lowest_amplitude(tests).clearance != pytest.approx(0.032, abs=1e-4)


@pytest.mark.parametrize("find", [lowest_amplitude, end_of_permanent])
def test_two_clearances_are_too_few(find):
    with pytest.raises(AnalysisError, match="2 clearances tried, expected 3 or more"):
        find([Tested(0.01, 1.0, TWO), Tested(0.02, 2.0, MODULATED), Tested(0.02, 2.1, MODULATED)])


def test_the_end_lies_between_the_last_permanent_and_the_first_modulated():
    tests = valley([0.030, 0.033, 0.034, 0.0345, 0.036], 0.033, 0.034)
    end = end_of_permanent(tests)
    assert (end.low, end.high) == (0.034, 0.0345)
    assert end.clearance == pytest.approx(0.03425)


def test_a_test_that_began_beside_the_orbit_says_nothing_of_its_end():
    """Swept up the ball keeps two impacts per cycle to 34 mm; swept down it catches them at 33."""
    up = valley([0.030, 0.033, 0.034, 0.035, 0.036], 0.034, 0.0345)
    down = [Tested(b, 7.0, MODULATED) for b in (0.034, 0.035)] + [Tested(0.033, up[1].value, TWO)]
    end = end_of_permanent([*up, *down])
    assert (end.low, end.high) == (0.034, 0.035)
    best = lowest_amplitude([*up, *down])  # at 34 mm it is not the mean of both motions
    assert (best.clearance, best.low, best.high) == (0.034, 0.033, 0.035)


@pytest.mark.parametrize("often", ["three or more per cycle", "chatter"])
def test_more_impacts_in_a_narrow_cavity_are_no_end(often):
    tests = [Tested(0.004, 9.0, often), Tested(0.010, 8.0, often)]
    assert end_of_permanent([*tests, *valley([0.030, 0.034, 0.036], 0.033, 0.035)]).low == 0.034
    end = end_of_permanent([*tests, Tested(0.036, 7.0, MODULATED)])
    assert (end.low, end.high, end.bound) == (None, 0.036, "at most")
    with pytest.raises(AnalysisError, match="more often than twice a cycle: try larger ones"):
        end_of_permanent([*tests, Tested(0.012, 7.0, often)])


def test_where_all_are_lost_the_valley_lies_below():
    lost = [Tested(b, a, MODULATED) for b, a in ((0.034, 2.0), (0.036, 1.8), (0.040, 2.1))]
    best = lowest_amplitude(lost)
    assert (best.clearance, best.low, best.high, best.bound) == (0.036, None, 0.040, "at most")


def test_a_test_that_lost_an_orbit_that_is_there_bounds_nothing():
    tests = [Tested(0.028, 6.0, TWO), Tested(0.030, 5.0, TWO), Tested(0.032, 9.0, MODULATED)]
    for beyond, high in ([], None), ([Tested(0.036, 9.0, MODULATED)], 0.036):
        best = lowest_amplitude([*tests, *beyond], b_c=0.0339)
        assert (best.clearance, best.low, best.high) == (0.030, 0.028, high)
    assert lowest_amplitude(tests).high == 0.032  # nobody knows where the orbit ends


@pytest.mark.parametrize(
    ("regimes", "bound", "low", "high"),
    [
        ((TWO, TWO, TWO), "at least", 0.03, None),
        ((TWO, MODULATED, TWO), "at least", 0.03, None),
        ((MODULATED, MODULATED, MODULATED), "at most", None, 0.01),
        ((MODULATED, TWO, MODULATED), "", 0.02, 0.03),
        ((MODULATED, TWO, TWO), "at least", 0.03, None),
    ],
)
def test_an_end_that_is_not_between_two_tests_is_a_bound(regimes, bound, low, high):
    tests = [Tested(round(0.01 * (i + 1), 2), 5.0, regime) for i, regime in enumerate(regimes)]
    end = end_of_permanent(tests)
    assert (end.bound, end.low, end.high) == (bound, low, high)
    assert end.clearance == pytest.approx(0.5 * ((low or high) + (high or low)))


@pytest.mark.parametrize("regime", ["", "no impact"])
def test_impacts_that_were_not_seen_say_nothing_of_the_end(regime):
    tests = [Tested(0.01 * (i + 1), 5.0, regime) for i in range(4)]
    with pytest.raises(AnalysisError, match=r"impacts were not seen .* is unknown"):
        end_of_permanent(tests)
    seen = valley([0.030, 0.033, 0.034, 0.0345], 0.033, 0.034)
    end = end_of_permanent([Tested(0.0342, 5.0, regime), *seen])
    assert (end.low, end.high) == (0.034, 0.0345)  # as if it had not been tried


def test_ties_widen_the_bracket_of_the_fastest():
    times = {0.020: 3.3, 0.027: 2.83, 0.030: 2.80, 0.036: 2.84, 0.042: 3.2, 0.048: 3.5}
    tests = [Tested(b, t) for b, t in times.items()]
    sharp, blurred = fastest(tests, resolution=0.0), fastest(tests, resolution=0.06)
    assert (sharp.low, sharp.clearance, sharp.high) == (0.027, 0.030, 0.036)
    assert (blurred.low, blurred.clearance, blurred.high) == (0.020, 0.030, 0.042)
    assert blurred.bound == ""


def test_a_release_that_never_gets_there_is_no_optimum_but_bounds_it():
    tests = [Tested(0.02, 3.0), Tested(0.03, 2.5), Tested(0.04, 2.6), Tested(0.05, None)]
    best = fastest(tests, resolution=0.2)
    assert (best.low, best.clearance, best.high) == (0.02, 0.03, 0.05)
    assert best.bound == ""


def test_the_floor_before_the_last_permanent_clearance_is_found_beside_the_jump():
    tests = [Tested(b, 5.0 + 3e5 * (b - 0.0335) ** 2, TWO) for b in (0.030, 0.032, 0.034)] + [
        Tested(0.036, 9.0, MODULATED),
        Tested(0.038, 9.5, MODULATED),
    ]
    best = lowest_amplitude(tests)
    assert best.clearance == pytest.approx(0.0335, abs=1e-9)
    assert (best.low, best.high) == (0.032, 0.036)


def test_repeats_count_by_their_mean():
    tests = [Tested(0.03, 4.0), Tested(0.03, 6.0), Tested(0.02, 5.5), Tested(0.04, 5.5)]
    assert lowest_amplitude(tests).clearance == 0.03


def swinging(b: float, first: float, second: float) -> Tested:
    return Tested(b, 5.0, TWO, f"b{b}", Swing(first, second))


@pytest.mark.parametrize(
    ("first", "second", "low"),
    [
        (0.016, 0.016, 0.033),  # neither lost nor steady: says nothing
        (0.016, 0.005, 0.034),  # dies away: the orbit is stable there
        (0.2, 0.027, 0.033),  # the ball was lost and caught: it may be lost again
        (0.002, 0.002, 0.034),  # too little to be told from a shaker's wander
    ],
)
def test_a_swing_that_stays_leaves_the_end_open(first, second, low):
    tests = [swinging(b, 1e-4, 1e-4) for b in (0.030, 0.032, 0.033)]
    tests += [swinging(0.034, first, second), Tested(0.035, 7.0, MODULATED)]
    end = end_of_permanent(tests)
    assert (end.low, end.high) == (low, 0.035)


def test_a_wander_that_all_tests_share_is_the_shakers():
    tests = [swinging(b, 0.01, 0.01) for b in (0.030, 0.032, 0.033)]
    assert end_of_permanent([*tests, Tested(0.035, 7.0, MODULATED)]).low == 0.033


NONE = "no impact"


def test_a_ball_that_never_moved_shows_no_best_clearance():
    """Four tests of a mass that moved as without ball had a lowest amplitude."""
    still = [Tested(b, 19.2 + 0.01 * k, NONE) for k, b in enumerate((0.028, 0.031, 0.033, 0.035))]
    with pytest.raises(AnalysisError, match="none of these tests shows an impact"):
        lowest_amplitude(still, b_c=0.034)


def test_a_ball_that_never_moved_bounds_no_valley():
    tests = [Tested(0.025, 6.1, TWO), Tested(0.031, 19.2, NONE), Tested(0.033, 5.2, TWO),
             Tested(0.035, 6.9, MODULATED)]  # fmt: skip
    assert lowest_amplitude(tests, b_c=0.034).low == 0.025
    assert lowest_amplitude(tests[1:], b_c=0.034).bound == "at most"


def test_tests_repeated_alike_show_their_scatter_once_from_clearance_to_clearance():
    """Means of four tests are known twice as well: that they differ as much says twice as much."""

    def tests(each):
        return [
            Tested(0.03 + k * 1e-3, 5.0 + 0.1 * (-1) ** k, "two symmetric")
            for k in range(9) for _ in range(each)
        ]  # fmt: skip

    apart, repeated = 6, 9 * 3  # fours of neighbours; repetitions, which differ by nothing
    shown = scatter_of(tests(1)) ** 2 * (1 + apart) - SCATTER**2
    expected = (SCATTER**2 + 4.0 * shown) / (1 + apart + repeated)
    assert scatter_of(tests(4)) ** 2 == pytest.approx(expected)
