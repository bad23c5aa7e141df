"""The search for the best clearance: a coarse scan, closer looks at the lowest, a fresh judgement.

The criteria jump where captured starts turn into lost ones and are rough where the response is
modulated, so no derivative is used. A candidate is judged at the end by starts it was not chosen
with: of many noisy values the lowest is too low.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.design.ensemble import Responses, Run, duration_of, responses, watched
from vinesexp.design.task import Task, random_starts, wall_starts

#: Clearances of the scan.
COARSE = 32
#: Its ends: shares of the least, and multiples of the largest, of b_c and bare amplitude. Below,
#: the ball rattles many times a cycle and acts as a dead mass; above, it is seldom struck.
BOTTOM, TOP = 0.12, 2.5
#: Clearances in a closer look, and how many minima are looked at in each round.
CLOSER, MINIMA = 7, (2, 1)
#: Candidates of each criterion that are judged afresh, at full length.
FINALISTS = 6
#: Where a criterion jumps, two of them are a little narrower than the lowest: shares of it.
SAFER = (0.95, 0.9)
#: Beside the best of those judged, where the least often stands against a jump: shares of it, the
#: next round of them around what the last has found, while a round gains more than GAINED and at
#: most ROUNDS times; then shares closer to it.
ROUNDS = 3
BESIDE = ((0.98, 0.99, 1.01, 1.02, 1.035), (0.985, 0.993, 1.007, 1.015))
GAINED = 0.005
#: Cycles that one comparison in a race between robust clearances may take.
RACE_CYCLES = 1.6e6
#: The search runs are shorter than those that judge, by this factor.
HASTE = 1.5
#: Rigs whose run takes so many cycles or fewer get 8 phases and 20 starts a clearance in the
#: search, others fewer in proportion, between these bounds. Cycles are those of base or
#: oscillator, whichever is faster, and dearer with several balls: what a run costs (`cost_of`).
CYCLES, FEWEST, MOST = 1500.0, 0.2, 1.0
#: What a cycle costs by power series (friction, a damping law), in cycles by closed form.
SERIES = 25.0
#: Where a run is longer still, fewer clearances are scanned and looked at closer.
LONG, COARSE_LONG, CLOSER_LONG = 6000.0, 22, 5
#: Standard errors of the share of starts by which a higher percentile is asked for in the search:
#: it jumps where that share is captured, and the lowest of several noisy values is too low.
MARGIN = 1.0


# Clearances that compete, under the same random starts, until one is better beyond doubt.
#
# A 90th percentile of thirty starts is uncertain by tens of percent where some starts are captured
# and some are not. So no clearance is called better than another by less than twice the error of
# their difference: more starts are spent, the same ones on all that are still in the race, until
# the rest differ by nothing that matters or the runs are used up. What is left is a tie.

#: Percentile of the mean amplitude over random starts that the robust clearance makes least.
PERCENTILE = 90.0
#: Draws of the starts with which the error of a percentile is found.
RESAMPLED = 200
#: Standard errors of the difference by which a clearance has to be worse to be out.
WORSE = 2.0
#: Clearances that differ by less than this share, doubt included, are as good as each other.
MATTERS = 0.02
#: A tie is settled by the mean amplitude at these shares of the clearance, the larger of both:
#: where a tenth of the starts is lost at every clearance the percentile says nothing of the others.
ASIDE = (0.96, 1.04)
#: At most so many of those that tie, those of least mean, are asked for their margin.
ASKED = 4


def percentile(means: FloatArray) -> float:
    """The percentile that the robust clearance makes least, m."""
    return float(np.percentile(means, PERCENTILE))


def resampled(means: FloatArray, seed: int) -> FloatArray:
    """The percentile under `RESAMPLED` draws of the starts; rows of `means` share the draws.

    Parameters
    ----------
    means : ndarray of shape (clearances, starts)
    """
    n = means.shape[-1]
    drawn = np.random.default_rng(seed).integers(0, n, (RESAMPLED, n))
    return np.asarray(np.percentile(means[..., drawn], PERCENTILE, axis=-1))


class SameStarts:
    """Responses to the same random starts at any clearance; what is known is not run again."""

    def __init__(self, task: Task, *, seed: int, batch: int) -> None:
        self._task, self._seed, self._batch = task, seed, batch
        self._found: dict[float, Responses] = {}

    def of(self, b: float, n: int) -> Responses:
        """Responses to at least n starts at clearance b, whole batches."""
        whole, known = -(-n // self._batch), self._found.get(b)
        have = 0 if known is None else known.mean.size // self._batch
        if have < whole:
            runs = [run for k in range(have, whole) for run in self._one(b, k)]
            more = watched(runs, starts=len(runs))
            known = self._found[b] = more if known is None else known.joined(more)
        assert known is not None
        return known

    def means(self, b: float, n: int) -> FloatArray:
        """Mean amplitudes of exactly the first n starts, m."""
        return self.of(b, n).mean[:n]

    def _one(self, b: float, k: int) -> list[Run]:
        return random_starts(self._task, b, starts=self._batch, seed=self._seed + 7919 * k)


@dataclass(frozen=True)
class Race:
    """How clearances compared.

    Attributes
    ----------
    b : the clearance preferred, m.
    value, error : its percentile and the standard error of that, m.
    tied : clearances that are no worse beyond doubt, the preferred one included; sorted, m.
    within : share by which the worst of those may be worse than the best, doubt included.
    starts : random starts that each of them was given.
    """

    b: float
    value: float
    error: float
    tied: tuple[float, ...]
    within: float
    starts: int


def race(
    clearances: Iterable[float],
    starts: SameStarts,
    *,
    first: int,
    most: int,
    margin: Callable[[float], float] | None = None,
    seed: int = 1,
) -> Race:
    """The clearance of least percentile, as far as the starts can tell.

    Parameters
    ----------
    clearances : iterable of float
        m.
    starts : SameStarts
    first : int
        Starts of the first comparison; doubled from one to the next.
    most : int
        Runs that a comparison may take, of all clearances together.
    margin : callable, optional
        Of those that tie, the few of least mean, the one with the least of this is preferred; else
        the lowest percentile.
    seed : int
        Of the resampling.
    """
    left, n = sorted(set(clearances)), first
    while True:
        means = np.array([starts.means(b, n) for b in left])
        value, draws = np.percentile(means, PERCENTILE, axis=1), resampled(means, seed)
        best = int(value.argmin())
        doubt = (draws - draws[best]).std(axis=1)
        alike = value - value[best] <= WORSE * doubt
        alike[best] = True
        left = [b for b, same in zip(left, alike, strict=True) if same]
        within = float((value + WORSE * doubt)[alike].max() / value[best] - 1.0)
        value, draws, means = value[alike], draws[alike], means[alike]
        if within <= MATTERS or 2 * n * len(left) > most:
            break
        n *= 2
    chosen = int(value.argmin())
    if len(left) > 1 and margin is not None:
        few = np.argsort(means.mean(axis=1))[:ASKED]
        chosen = int(few[np.argmin([margin(left[i]) for i in few])])
    error = float(draws[chosen].std())
    return Race(left[chosen], float(value[chosen]), error, tuple(left), within, n)


@dataclass(frozen=True)
class Effort:
    """How many starts a clearance is given in scan and judgement, and how many clearances.

    Attributes
    ----------
    phases, starts : of the search, a clearance: from rest, and random ones.
    judged, fresh : the same of a clearance that is judged; `race` runs may compare it with others.
    coarse, closer : clearances of the scan, and of a closer look.
    """

    phases: int
    starts: int
    judged: int
    fresh: int
    race: int
    coarse: int
    closer: int

    @classmethod
    def of(cls, task: Task, b: float) -> Effort:
        """From the length of a run: the time of an answer stays about the same."""
        conditions = len(task.grid())
        f = 0.5 * sum(task.frequencies)
        cost = cost_of(task, b, f)
        share = min(max(CYCLES / cost, FEWEST), MOST)
        return cls(
            phases=max(round(8 * share / conditions), 2), starts=max(round(20 * share), 8),
            judged=max(round(48 * share / conditions), 4), fresh=max(round(56 * share), 20),
            race=round(RACE_CYCLES / cost),
            coarse=COARSE_LONG if cost > LONG else COARSE,
            closer=CLOSER_LONG if cost > LONG else CLOSER,
        )  # fmt: skip


def cost_of(task: Task, b: float, frequency: float) -> float:
    """Cycles that a run takes, and more for several balls or where no closed form helps."""
    pace = max(frequency, task.oscillator.f0)
    dearer = 1.0 if task.plain else SERIES
    dearer *= math.pow(len(task.masses), 1.5)
    return duration_of(task.rig(b), frequency)[1] * pace * dearer


def robust_criterion(found: Responses) -> FloatArray:
    """90th percentile over starts of the mean amplitude, with a margin for their number (m).

    Runs of shape (clearances, starts).
    """
    share = PERCENTILE / 100.0
    margin = 100.0 * MARGIN * float(np.sqrt(share * (1.0 - share) / found.mean.shape[1]))
    q = min(PERCENTILE + margin, 99.0)
    return np.asarray(np.percentile(found.mean, q, axis=1))


#: A value for each clearance, from its runs: shape (clearances, runs) to (clearances,).
Criterion = Callable[[Responses], FloatArray]
Starts = Callable[[float], list[Run]]


@dataclass(frozen=True)
class Curve:
    """Clearances tried and what a criterion said of each (m); sorted by clearance."""

    b: FloatArray
    value: FloatArray

    def joined(self, other: Curve) -> Curve:
        """Both, sorted."""
        b = np.concatenate([self.b, other.b])
        order = np.argsort(b)
        return Curve(b[order], np.concatenate([self.value, other.value])[order])

    def minima(self, n: int) -> list[int]:
        """Indices of the lowest local minima, at most n."""
        v = np.concatenate([[np.inf], self.value, [np.inf]])
        local = np.flatnonzero((v[1:-1] <= v[:-2]) & (v[1:-1] <= v[2:]))
        return [int(i) for i in local[np.argsort(self.value[local])][:n]]


def sampled(
    b: Iterable[float], starts: Starts, criteria: Sequence[Criterion], haste: float
) -> tuple[list[Curve], Responses]:
    """Every criterion at every clearance, from one ensemble; the responses, one row a clearance."""
    clearances = np.unique(np.asarray(list(b), dtype=np.float64))
    blocks = [starts(float(one)) for one in clearances]
    runs = [run for block in blocks for run in block]
    found = watched(runs, starts=len(blocks[0])) if haste == 1.0 else responses(runs, haste=haste)
    found = found.reshape(clearances.size, len(blocks[0]))
    return [Curve(clearances, rule(found)) for rule in criteria], found


def closer(curve: Curve, minima: int, n: int) -> FloatArray:
    """n clearances between the neighbours of each of the lowest minima."""
    places = []
    for i in curve.minima(minima):
        low = curve.b[max(i - 1, 0)]
        high = curve.b[min(i + 1, curve.b.size - 1)]
        places.append(np.geomspace(low, high, n + 2)[1:-1])
    return np.concatenate(places)


@dataclass(frozen=True)
class Least:
    """The clearance (m) that makes each criterion least, and all that was tried on the way."""

    b: list[float]
    curves: list[Curve]
    scan: Responses


def least(
    grid: FloatArray,
    starts: Starts,
    fresh: Starts,
    criteria: Sequence[Criterion],
    looks: int,
) -> Least:
    """Scan, closer looks, fresh judgement and what lies beside it, for criteria that share starts.

    Parameters
    ----------
    grid : ndarray
        Clearances of the scan, m.
    starts, fresh : callable
        Clearance to its runs: those to search with, and those to judge the finalists by.
    criteria : sequence of callable
        What to make least.
    looks : int
        Clearances in a closer look at one minimum.
    """
    curves, scan = scanned(grid, starts, criteria, looks)
    lowest = [curve.b[np.argsort(curve.value)[:FINALISTS]] for curve in curves]
    judged, _ = sampled(np.concatenate(lowest), fresh, criteria, 1.0)
    for shares in BESIDE:
        rounds, gained = 0, True
        while gained and rounds < ROUNDS:
            judged, gained = _beside(judged, shares, fresh, criteria)
            rounds += 1
        if rounds == 1 and not gained:
            break
    return Least([float(one.b[one.value.argmin()]) for one in judged], curves, scan)


def _beside(
    judged: Sequence[Curve], shares: Sequence[float], fresh: Starts, criteria: Sequence[Criterion]
) -> tuple[list[Curve], bool]:
    """Clearances beside the least of each criterion too; whether one of them gained by it."""
    before = [float(curve.value.min()) for curve in judged]
    least_of = [float(one.b[one.value.argmin()]) for one in judged]
    b = np.unique([share * best for best in least_of for share in shares])
    more, _ = sampled(b, fresh, criteria, 1.0)
    joined = [one.joined(other) for one, other in zip(judged, more, strict=True)]
    gains = [old - float(one.value.min()) for old, one in zip(before, joined, strict=True)]
    return joined, any(gain > GAINED * old for gain, old in zip(gains, before, strict=True))


def scanned(
    grid: FloatArray, starts: Starts, criteria: Sequence[Criterion], looks: int
) -> tuple[list[Curve], Responses]:
    """What each criterion says of the grid and of closer looks at its minima; the grid's runs."""
    curves, scan = sampled(grid, starts, criteria, HASTE)
    for minima in MINIMA:
        b = np.concatenate([closer(curve, minima, looks) for curve in curves])
        looked, _ = sampled(b, starts, criteria, HASTE)
        curves = [c.joined(more) for c, more in zip(curves, looked, strict=True)]
    return curves, scan


@dataclass(frozen=True)
class Found:
    """The three clearances (m) and what they were read from; `race` is that of the robust one."""

    least_mean: float
    least_max: float
    robust: float
    rest: Least
    random: Least
    race: Race
    starts: SameStarts
    grid: FloatArray
    effort: Effort


def scan_ends(*, bare: float, published: float, exact: float | None) -> tuple[float, float]:
    """Least and largest clearance worth a look (m), from bare amplitude and b_c."""
    end = published if exact is None else exact
    low = BOTTOM * min(bare, published, end)
    return low, TOP * max(end, min(bare, 3.0 * published))


def search(
    task: Task, *, ends: tuple[float, float], marks: Iterable[float] = (), seed: int = 1
) -> Found:
    """Least mean, least largest and robust clearance of a task.

    Parameters
    ----------
    task : Task
    ends : (float, float)
        Clearances between which to look, m (`scan_ends`).
    marks : iterable of float
        Clearances that theory suggests (m): looked at in the scan.
    seed : int
        Of the random starts; the final judgement draws from `seed` + 1.
    """
    effort = Effort.of(task, ends[1])
    grid = np.geomspace(*ends, effort.coarse)
    grid = np.unique(np.concatenate([grid, [m for m in marks if ends[0] < m < ends[1]]]))
    rest = least(
        grid,
        lambda b: wall_starts(task, b, phases=effort.phases),
        lambda b: wall_starts(task, b, phases=effort.judged, shift=0.25),
        [lambda found: task.average(found.mean), lambda found: task.worst(found.largest)],
        effort.closer,
    )
    curves, scan = scanned(
        grid, lambda b: random_starts(task, b, starts=effort.starts, seed=seed),
        [robust_criterion], effort.closer,
    )  # fmt: skip
    [curve] = curves
    lowest = curve.b[np.argsort(curve.value)[:FINALISTS]]
    compared = SameStarts(task, seed=seed + 1, batch=effort.fresh)
    # the others are in the race too: none of the three is called robust beside a better one
    safer = [float(b) * share for b in (lowest[0], *rest.b) for share in SAFER]
    won = run_race([*lowest, *safer, *rest.b], compared, effort)
    random = Least([won.b], curves, scan)
    return Found(rest.b[0], rest.b[1], won.b, rest, random, won, compared, grid, effort)


def run_race(clearances: Iterable[float], starts: SameStarts, effort: Effort) -> Race:
    """The robust clearance of those that compete, and of what lies beside the first winner."""

    def margin(b: float) -> float:
        return max(float(starts.means(share * b, effort.fresh).mean()) for share in ASIDE)

    every = [float(b) for b in clearances]
    first = race(every, starts, first=effort.fresh, most=0)
    every = [*first.tied, *(first.b * share for share in BESIDE[0])]
    return race(every, starts, first=effort.fresh, most=effort.race, margin=margin)
