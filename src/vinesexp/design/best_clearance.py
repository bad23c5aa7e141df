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
from vinesexp.design.compared import ASIDE, PERCENTILE, Race, SameStarts, race
from vinesexp.design.ensemble import Responses, Run, duration_of, responses
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
#: next round of them around what the last has found, while a round gains more than GAINED.
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
    found = responses([run for block in blocks for run in block], haste=haste)
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
    for beside in BESIDE:
        before = [float(curve.value.min()) for curve in judged]
        least_of = [float(one.b[one.value.argmin()]) for one in judged]
        b = np.unique([share * best for best in least_of for share in beside])
        more, _ = sampled(b, fresh, criteria, 1.0)
        judged = [one.joined(other) for one, other in zip(judged, more, strict=True)]
        gains = [old - float(one.value.min()) for old, one in zip(before, judged, strict=True)]
        if all(gain <= GAINED * old for gain, old in zip(gains, before, strict=True)):
            break
    return Least([float(one.b[one.value.argmin()]) for one in judged], curves, scan)


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
    safer = [float(lowest[0]) * share for share in SAFER]
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
