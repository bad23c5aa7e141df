"""Clearances that compete: same starts, more of them where they are needed, ties that are named."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest

from vinesexp import Oscillator
from vinesexp.design.advice import advise
from vinesexp.design.best_clearance import (
    HOPE,
    PERCENTILE,
    Allowance,
    Contest,
    Criterion,
    Race,
    Tried,
    cautious,
    mean_of,
    means_of,
    scanned,
    weighted_percentile,
    wide_enough,
)
from vinesexp.design.ensemble import B_B, V_PHASE, Responses, Runs, responses
from vinesexp.design.headline import nothing_helps
from vinesexp.design.task import Task, evenly_spread, random_starts, wall_starts

ROBUST = Criterion(mean_of, weighted_percentile, cautious)
MEAN = Criterion(mean_of, lambda values, weights: means_of(values, weights)[:, 0])


def written(means: np.ndarray) -> Responses:
    """Runs of these mean amplitudes, each a second's work."""
    one = np.ones((1, means.size))
    return Responses(means[np.newaxis], 1.1 * means[np.newaxis], 2.0 * one, one, 0.0 * one, one, 1)


class Drawn(Tried):
    """The mean amplitudes of every start, written down."""

    def __init__(self, means: dict[float, np.ndarray]) -> None:
        def none(b: float, numbers: range) -> Runs:
            raise AssertionError

        super().__init__(none)
        self.found = {b: written(values) for b, values in means.items()}
        self.asked = dict.fromkeys(means, 0)

    def ask(self, clearances: Iterable[float], n: int) -> float:
        some = [b for b in clearances if self.asked[b] < n]
        work = sum(n - self.asked[b] for b in some)
        self.asked |= dict.fromkeys(some, n)
        return float(work)

    def work(self, b: float) -> float:
        return 1.0


def raced(starts: Drawn, *, first: int, most: float, criterion: Criterion = ROBUST) -> Race:
    return Contest(starts, criterion, most).race(list(starts.found), first)


def amplitudes(seed: int, captured: float, low: float, high: float, n: int = 2000) -> np.ndarray:
    """A share of the starts is captured at a low amplitude, the others stay at a high one."""
    rng = np.random.default_rng(seed)
    return np.where(rng.uniform(size=n) < captured, low, high) * rng.normal(1.0, 0.002, n)


def test_starts_go_where_clearances_compete() -> None:
    starts = Drawn(
        {
            0.010: amplitudes(11, 0.94, 3.0, 12.0),
            0.011: amplitudes(12, 0.94, 2.8, 12.0),
            0.030: amplitudes(3, 0.2, 2.0, 12.0),
        }
    )
    won = raced(starts, first=40, most=3000)
    assert starts.asked[0.030] == 40, "beaten beyond doubt: no more starts for it"
    assert starts.asked[won.b] == won.starts > 40
    assert won.b == 0.011
    assert 0.030 not in won.tied


def test_a_loss_that_few_starts_have_not_met_is_reckoned_with() -> None:
    """3 % of the starts are lost at the wider clearance, which looks 2.5 % better until then."""
    worse = amplitudes(5, 0.97, 1.95, 6.0)
    worse[:12] = 1.95
    beyond = amplitudes(6, 0.5, 1.9, 6.0)
    starts = Drawn({0.010: amplitudes(4, 1.0, 2.0, 6.0), 0.011: worse, 0.012: beyond})
    won = raced(starts, first=12, most=8000, criterion=MEAN)
    assert won.starts > 100
    assert won.b == 0.010


def test_where_a_tenth_is_nearly_lost_the_surer_clearance_wins() -> None:
    """9 % lost at one, 3 % at the other: few starts do not tell 9 from 11 %."""
    starts = Drawn({0.010: amplitudes(7, 0.97, 2.0, 9.0), 0.011: amplitudes(8, 0.91, 1.97, 9.0)})
    assert raced(starts, first=64, most=500).b == 0.010


def test_of_clearances_that_few_starts_all_doubt_the_one_that_loses_least_wins() -> None:
    """5 % lost at one, 25 % at the others: the share of starts two errors higher is lost at all."""
    means = {b: np.full(96, 6.0) for b in (0.010, 0.020, 0.030)}
    for b, lost in ((0.010, 24), (0.020, 5), (0.030, 30)):
        means[b][::3][:lost] = 9.0
    assert raced(Drawn(means), first=96, most=0.0).b == 0.020
    means = {b: values[:8] for b, values in means.items()}
    for b, lost in ((0.010, 3), (0.020, 4), (0.030, 2)):
        means[b][:] = np.repeat([6.0, 9.0], [8 - lost, lost])
    assert raced(Drawn(means), first=8, most=0.0).b == 0.030, "more than a tenth at every one"


def test_what_the_starts_cannot_tell_apart_is_a_tie_and_the_least_mean_wins() -> None:
    """One distribution under many names, but for a few starts, of which a percentile is silent."""
    rng = np.random.default_rng(3)
    means = {b: 5.0 * rng.normal(1.0, 0.002, 400) for b in (0.010, 0.012, 0.014)}
    for b in (0.010, 0.014):
        means[b][means[b].argsort()[-10:]] = 9.0
    starts = Drawn(means)
    won = Contest(starts, ROBUST, 0.0).race(list(starts.found), 400)
    assert len(won.tied) == 3
    assert won.b == 0.012
    assert won.within < 0.02
    assert won.starts == 400, "nothing that matters is left to be told apart"


def test_what_is_preferred_is_among_those_that_are_called_equal() -> None:
    """Worse by half a per cent beyond doubt, and preferred for its mean: equal within that."""
    means = {0.010: np.full(400, 2.0), 0.011: np.full(400, 2.01)}
    means[0.010][:8] = 9.0
    won = raced(Drawn(means), first=400, most=0.0)
    assert won.b == 0.011
    assert won.tied == (0.010, 0.011)
    assert won.within == pytest.approx(0.005)


def test_the_error_is_that_of_other_samples() -> None:
    """Stated: the resampled error of one sample. Seen: the scatter over a hundred samples."""
    many = [np.percentile(amplitudes(seed, 0.5, 2.0, 6.0, 100), PERCENTILE) for seed in range(100)]
    won = raced(Drawn({0.01: amplitudes(7, 0.5, 2.0, 6.0, 100)}), first=100, most=0.0)
    assert won.error == pytest.approx(np.std(many), rel=0.5)


def test_evenly_spread_starts_tell_as_much_as_twice_as_many_independent_ones() -> None:
    """A corner of the starts is lost; the error that a contest reckons with is that of others."""
    for corner in (0.1, 0.4):
        shares, stated = [], []
        for seed in range(60):
            shift = np.random.default_rng(seed).uniform(size=5)
            u = evenly_spread(range(96), shift)
            starts = Drawn(
                {0.01: np.where((u[:, :3] > 1.0 - corner ** (1 / 3)).all(axis=1), 2.0, 1.0)}
            )
            shares.append(starts.of(0.01, 96).mean.mean())
            stated.append(raced(starts, first=96, most=0.0, criterion=MEAN).error)
        assert 0.7 < np.mean(stated) / np.std(shares) < 1.6


def test_random_starts_go_on_where_they_were_and_move_with_the_seed() -> None:
    task = Task(
        Oscillator(M=1.0, c1=0.02, k1=1.0), (0.01,), (0.6,), (1e-3,) * 2, (0.159,) * 2,
        std_errors={"M": 0.01, "r": 0.02}, tolerance=0.01,
    )  # fmt: skip
    whole = random_starts(task, 0.02, starts=12, seed=3)
    parts = [random_starts(task, 0.02, starts=6, seed=3, first=k) for k in (0, 6)]
    assert list(whole) == [*parts[0], *parts[1]]
    assert whole[0] != random_starts(task, 0.02, starts=1, seed=4)[0]
    masses = np.array(
        [run.rig.oscillator.M for run in random_starts(task, 0.02, starts=400, seed=3)]
    )
    assert abs(masses.mean() - 1.0) < 0.1 * 0.01
    assert masses.std() == pytest.approx(0.01, rel=0.1)


def jumping(made: np.ndarray, luck: np.ndarray) -> np.ndarray:
    """Falls as the cavity is made wider; ever more starts are lost where it is wider than 20 mm."""
    lost = luck < 0.05 + (made / 0.02 - 1.0) * 5.0
    return np.where(lost, 9.0, (0.02 / made) ** 2)


class Made(Tried):
    """`jumping`, of starts that are made within 1 % of each clearance."""

    def __init__(self, seed: int) -> None:
        def none(b: float, numbers: range) -> Runs:
            raise AssertionError

        super().__init__(none, tolerance=0.01)
        self.rng = np.random.default_rng(seed)

    def ask(self, clearances: Iterable[float], n: int) -> float:
        for b in clearances:
            off, luck = self.rng.uniform(size=(2, n))
            self.made[b] = b * (1.0 + 0.01 * (2.0 * off - 1.0))
            self.found[b] = written(jumping(self.made[b], luck))
        return 0.0


@pytest.mark.parametrize("percent", [10.0, 90.0])
def test_the_percentile_of_many_starts_is_the_start_where_that_share_of_the_weight_is_reached(
    percent: float,
) -> None:
    """Only starts near the percentile of one draw are looked at: every other draw has it there."""
    rng = np.random.default_rng(3)
    values, weights = rng.uniform(size=(1, 2000)), rng.lognormal(0.0, 1.0, 2000)
    draws = weights * (1.0 + rng.choice([-0.7, 0.7], (100, 2000)))
    order = np.argsort(values[0])
    shares = np.cumsum(draws[:, order], axis=1) / draws.sum(axis=1, keepdims=True)
    reached = [np.flatnonzero(row >= percent / 100.0)[0] for row in shares]
    found = weighted_percentile(values, draws, percent)
    assert len(set(found.tolist())) > 10
    assert (found == values[0, order[reached]]).all()


def test_starts_of_neighbours_tell_of_a_clearance_what_its_own_would() -> None:
    """Weighted, starts of unlike numbers on either side are spread as those that are delivered."""
    b, near = 0.02, (0.0197, 0.0199, 0.0202, 0.0203)
    own, pooled = [], []
    for seed in range(60):
        starts = Made(seed)
        starts.ask([b], 64)
        own.append(starts.of(b, 64).mean.mean())
        for k, other in enumerate(near):
            starts.ask([other], 64 * (k + 1))
        found, weights = starts.pool(b, 64, 1)
        pooled.append(means_of(found.mean, weights[:1])[0, 0])
    off, luck = np.random.default_rng(1).uniform(size=(2, 1_000_000))
    expected = jumping(b * (1.0 + 0.01 * (2.0 * off - 1.0)), luck).mean()
    assert np.mean(pooled) == pytest.approx(expected, abs=3.0 * np.std(pooled) / 60**0.5)
    assert np.std(pooled) < 0.7 * np.std(own)


def test_a_jump_is_met_closer_where_the_starts_of_neighbours_count() -> None:
    """One just beyond it looks best by 24 starts of its own, which often do not show a loss."""
    lost, closer = {0.0: 0, 0.01: 0}, 0.0202
    for seed in range(40):
        for tolerance in lost:
            starts = Made(seed)
            starts.ask([0.0196, 0.0198, 0.02, closer, 0.0204], 24)
            starts.tolerance = tolerance
            b = Contest(starts, MEAN, 0.0).race(list(starts.found), 24).b
            lost[tolerance] += b > 0.02
    assert lost[0.01] < 0.5 * lost[0.0]


def test_a_jump_is_found_as_close_as_it_matters() -> None:
    """The amplitude falls four times as fast as b grows, and doubles beyond 20.5 mm."""

    class Beside(Tried):
        def ask(self, clearances: Iterable[float], n: int) -> float:
            for b in clearances:
                there = (0.0205 / b) ** 4 * (1.0 if b < 0.0205 else 2.0)
                self.found[b] = written(np.full(n, there))
            return 0.0

    def none(b: float, numbers: range) -> Runs:
        raise AssertionError

    won = Contest(Beside(none), MEAN, 1e3).won([0.0185, 0.0215], (8, 8))
    assert 0.0205 * 0.996 < won.b < 0.0205


def test_without_a_tolerance_a_start_is_the_same_at_every_clearance_and_run_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[int] = []

    def simulated(runs: Runs, *, starts: int) -> Responses:
        asked.append(len(runs))
        b, phase = runs.balls[:, 0, B_B], runs.values[:, V_PHASE]
        return Responses(b, phase, b, b, b, runs.weight, 1)

    monkeypatch.setattr("vinesexp.design.best_clearance.watched", simulated)
    task = Task(Oscillator(M=1.0, c1=0.02, k1=1.0), (0.01,), (0.6,), (1e-3, 2e-3), (0.159, 0.159))

    def draw(b: float, numbers: range) -> Runs:
        return wall_starts(task, b, numbers, nodes=True)

    conditions = len(task.grid())
    starts = Tried(draw, conditions)
    starts.ask([0.01, 0.02], 4)
    starts.ask([0.02, 0.01], 8)
    starts.ask([0.01], 6)
    assert asked == [2 * 4 * conditions, 2 * 4 * conditions]
    one, other = starts.of(0.01, 8), starts.of(0.02, 8)
    assert (one.mean == 0.01).all()
    assert (other.mean == 0.02).all()
    assert (one.largest == other.largest).all()
    moved = (one.largest - one.largest[0]) % (2.0 * np.pi)
    assert np.allclose(moved, moved[:, :1]), "the same phases, moved under every condition"
    assert np.unique(one.largest[0]).size == 8


@pytest.mark.long
def test_where_any_ball_amplifies_the_search_goes_on_to_where_it_rests() -> None:
    """This ball tunes the rig to its base: 6 to 18 times the bare amplitude, up to b = 7 mm."""
    o = Oscillator(M=1.0, c1=2.0 * 1.374e-4, k1=1.0)
    f = 0.9555 / (2.0 * np.pi)
    task = Task(o, (0.0781,), (0.9144,), levels=(1e-4, 1e-4), frequencies=(f, f), tolerance=0.01)
    advice = advise(task, budget=0.35)
    assert advice.hopeless
    assert advice.robust.random_p90 < 1.5 * advice.bare
    assert advice.least_mean.rest_mean < 1.5 * advice.bare
    assert "the best one raises the bare amplitude" in nothing_helps(advice)[0]


@pytest.mark.long
def test_a_valley_that_few_starts_make_too_much_of_a_loss_in_is_compared() -> None:
    """Two balls: of 20 starts one is lost, and the valley was left for one 4 % worse."""
    host = Oscillator.from_modal(M=2000.0, f0=0.4, zeta=0.02149)
    G, f = 4.2329e-5, 0.408886
    task = Task(host, (9.14188,) * 2, (0.4645,) * 2, (G, G), (f, f), ratios=(1.0, 1.0))
    chosen = advise(task, seed=13).robust.b
    runs = random_starts(task, chosen, starts=400, seed=99)
    assert (
        float(np.percentile(responses(runs).mean, PERCENTILE)) < 0.555e-3
    )  # 0.539 is the least, 0.561 it was


@pytest.mark.long
def test_a_wider_valley_in_which_one_of_seven_starts_is_lost_is_compared() -> None:
    """1.13 mm was to be built, which gives 1.17 mm; with 1.84 mm nine of ten are below 1.09 mm."""
    host = Oscillator(M=0.208184, c1=0.29752, k1=1040.127)
    three = Task(
        host, (0.741705e-3, 0.497309e-3, 1.756686e-3), (0.6568, 0.7659, 0.8518),
        ratios=(1.0,) * 3, tolerance=0.03, levels=(9.4293e-5, 1.18123e-4),
        frequencies=(11.6563,) * 2,
    )  # fmt: skip
    robust = advise(three, seed=30).robust
    assert robust.b > 1.5e-3
    assert robust.random_p90 < 1.12e-3


def test_one_lost_start_of_few_does_not_hide_a_valley() -> None:
    few, worse = np.array([[1.0] * 6 + [1.6]]), np.full((1, 7), 1.1)
    alike = np.ones((1, 7))
    hoped = [cautious(one, alike, safety=-HOPE)[0] for one in (few, worse)]
    assert hoped[0] < hoped[1]
    assert cautious(few, alike)[0] > cautious(worse, alike)[0]


def test_a_dead_mass_is_tried_once_and_none_is_narrower() -> None:
    """Of three balls in narrow cavities a start takes a second, of others a thousandth of it."""
    asked: dict[float, int] = {}

    def draw(b: float, numbers: range) -> Runs:
        asked[b] = asked.get(b, 0) + len(numbers)
        return random_starts(three, b, starts=len(numbers), seed=1, first=numbers.start)

    host = Oscillator.from_modal(M=1.0, f0=5.0, zeta=0.0045)
    G, f = 1e-4, 0.938 * host.f0
    three = Task(host, (0.023,) * 3, (0.3, 0.54, 0.72), (G, G), (f, f), ratios=(1.0,) * 3)
    bare, starts = three.largest_bare(), Tried(draw)
    grid = wide_enough(np.geomspace(0.05 * bare, 8.0 * bare, 40), starts)
    assert 0.05 * bare < grid[0] < 0.65 * bare
    scanned(grid, starts, [ROBUST], ends=(4, 20), most=0.2)
    assert asked[float(grid[0])] == 1
    assert min(asked[b] for b in grid[grid > bare].tolist()) >= 4


def test_what_one_part_of_a_search_takes_beyond_its_share_the_others_have_not() -> None:
    starts = Tried(lambda b, numbers: NotImplemented)
    purse = Allowance(8.0, [1.0, 1.0, 2.0], [starts])
    assert purse.next() == 2.0
    starts.spent = 5.0
    assert purse.next() == 1.0
    starts.spent = 9.0
    assert purse.next() == 0.0
