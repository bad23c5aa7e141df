"""What lies around the recommended clearance: cliffs, one value off, other levels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.design.best_clearance import (
    WORSE,
    Found,
    anywhere,
    from_rest,
    mean_of,
    mean_over,
    weighted_percentile,
)
from vinesexp.design.ensemble import Responses, responses, together
from vinesexp.design.task import (
    Task,
    random_starts,
    wall_starts,
)

#: Shares of the clearance by which it is changed, either way.
STEPS = (0.006, 0.012, 0.018, 0.025, 0.035, 0.05, 0.075, 0.1)
#: A cliff stands where the amplitude is this much of that at the clearance.
JUMP = 1.25
#: Starts with which it is looked for, in those of the first look: the more where the fewer leave in
#: doubt whether the amplitude is higher or lower than that.
MORE = (1, 4, 16)


@dataclass(frozen=True)
class Starts:
    """How many starts a clearance is given: phases from rest, and random ones."""

    phases: int
    random: int


@dataclass(frozen=True)
class Side:
    """One side of a clearance.

    Attributes
    ----------
    clear : share by which the clearance can be changed without a jump; where it ends before the
        last of STEPS and there is no `jump`, the starts that there was time for do not tell more.
    jump : share at which there is one, None where none is known.
    before, amplitude : what the clearance itself and what the one beyond the jump gives, m: mean
        from rest or mean of random starts, whichever jumps higher.
    """

    clear: float
    jump: float | None = None
    before: float | None = None
    amplitude: float | None = None


@dataclass(frozen=True)
class Cliffs:
    """Both sides of a clearance."""

    narrower: Side
    wider: Side


def cliffs_of(task: Task, b: float, starts: Starts, *, seed: int, most: float) -> Cliffs:
    """Look at clearances beside b, each exactly as wide as it says, under the same starts.

    In runs of full length: just beyond the end of an orbit it takes long to be lost. `starts` are
    those of a first look; more are run, for about `most` seconds of work, where they do not tell.
    """
    exact = replace(task, tolerance=0.0)
    walls, drawn = from_rest(exact, watch=False), anywhere(exact, seed, watch=False)
    every = [b, *(b * (1.0 + way * step) for way in (-1.0, 1.0) for step in STEPS)]
    walls.ask(every, starts.phases)
    drawn.ask(every, starts.random)

    def seen(at: float, more: int) -> list[tuple[FloatArray, FloatArray]] | None:
        every_start = (walls, more * starts.phases), (drawn, more * starts.random)
        if more > 1 and walls.spent + drawn.spent > most:
            return None
        for tried, n in every_start:
            tried.ask((b, at), n)
        return [(_parts(tried.of(b, n)), _parts(tried.of(at, n))) for tried, n in every_start]

    return Cliffs(_side(seen, b, -1.0), _side(seen, b, 1.0))


def _parts(found: Responses) -> FloatArray:
    """What each start adds to the mean amplitude, times their number, m."""
    weight = found.weight.mean(axis=0)
    return np.asarray(mean_of(found)[0] * weight / weight.mean())


Seen = Callable[[float, int], list[tuple[FloatArray, FloatArray]] | None]


def _side(seen: Seen, b: float, way: float) -> Side:
    """One side of a clearance, as far as the starts tell: the amplitudes at b and at another."""
    clear, told = 0.0, True
    for step in STEPS:
        for more in MORE:
            found = seen(b * (1.0 + way * step), more)
            if found is None:  # no more time: not told
                told = False
                break
            jumps = _jumps(found)
            if jumps is not None or more == MORE[-1]:
                rises = [there.mean() / before.mean() for before, there in found]
                before, there = found[int(np.argmax(rises))]
                if jumps or (jumps is None and max(rises) > JUMP):
                    return Side(clear, step, float(before.mean()), float(there.mean()))
                clear = step if told else clear
                break
    return Side(clear)


def _jumps(found: Sequence[tuple[FloatArray, FloatArray]]) -> bool | None:
    """Whether one of the amplitudes is a quarter higher or more; None: these starts do not tell."""
    excess = [there - JUMP * before for before, there in found]
    if any(certain(one) and one.mean() > 0.0 for one in excess):
        return True
    return False if all(certain(one) for one in excess) else None


def certain(excess: FloatArray) -> bool:
    """Whether the mean over the starts is more than twice its error from zero.

    Examples
    --------
    >>> certain(np.array([0.3, 0.4, 0.3])), certain(np.array([-0.1, -0.1, 1.1]))
    (True, False)
    >>> certain(np.array([0.3]))  # of one start there is no error
    False
    """
    if excess.size < 2:
        return False
    doubt = float(excess.std(ddof=1)) / np.sqrt(excess.size)
    return bool(abs(excess.mean()) > WORSE * doubt)


#: Their runs are shorter than those that judge, by this factor.
HASTE = 1.5
#: Changes of b, G, f and r that the robust clearance is tried under.
CHANGES = (-0.10, -0.05, 0.05, 0.10)


@dataclass(frozen=True)
class Changed:
    """A clearance with one value off: from rest and from random starts, m.

    Attributes
    ----------
    name, change : which value, and by what share; "" and 0 where nothing is off.
    rest_mean : mean amplitude from rest.
    random_p90 : 90th percentile over random starts of the mean amplitude.
    captured : share of random starts.
    bare : mean amplitude of the oscillator alone under the same.
    """

    name: str
    change: float
    rest_mean: float
    random_p90: float
    captured: float
    bare: float


def changes(task: Task, b: float, starts: Starts, *, seed: int) -> tuple[Changed, list[Changed]]:
    """The clearance b as it is, and with b, G, f or r off by 5 and 10 %; by the same starts."""
    cases = [("", 0.0, task, b)]
    for name in ("b", "G", "f", "r"):
        for change in CHANGES:
            case, clearance = _moved(task, b, name, 1.0 + change)
            if all(r <= 1.0 for r in case.r):
                cases.append((name, change, case, clearance))
    walls = [wall_starts(case, at, range(starts.phases)) for _, _, case, at in cases]
    places = [random_starts(case, at, starts=starts.random, seed=seed) for _, _, case, at in cases]
    rest, drawn = (  # another frequency may have other conditions of a band
        responses(together(runs), haste=HASTE).split([len(one) for one in runs])
        for runs in (walls, places)
    )
    found = [
        Changed(
            name=name,
            change=change,
            rest_mean=mean_over(at_walls),
            random_p90=float(
                weighted_percentile(*np.array([[anywhere.mean], [anywhere.weight]]))[0]
            ),
            captured=float(anywhere.share),
            bare=case.mean_bare(),
        )
        for (name, change, case, _), at_walls, anywhere in zip(cases, rest, drawn, strict=True)
    ]
    return found[0], found[1:]


def _moved(task: Task, b: float, name: str, factor: float) -> tuple[Task, float]:
    def scaled(pair: tuple[float, float]) -> tuple[float, float]:
        return pair[0] * factor, pair[1] * factor

    if name == "b":
        return task, b * factor
    if name == "G":
        return replace(task, levels=scaled(task.levels)), b
    if name == "f":
        return replace(task, frequencies=scaled(task.frequencies)), b
    return replace(task, r=tuple(r * factor for r in task.r)), b


#: A clearance works where it leaves at most this share of the bare amplitude.
WORKS = 0.8
#: With friction, a damping law, or over a range: levels tried, from a share of the least to a
#: multiple of the greatest designed for.
LEVELS, ENDS = 9, (0.25, 4.0)


@dataclass(frozen=True)
class Range:
    """Levels (m) around those designed for at which a clearance works from rest.

    Attributes
    ----------
    activation : least level at which half of the starts from rest are captured; None: at none, or
        designed for a band, in most of which none is.
    low, high : ends of the levels at which it works; None where it does not.
    low_open, high_open : that end is where the levels tried end: it works beyond.
    """

    activation: float | None
    low: float | None
    high: float | None
    low_open: bool = False
    high_open: bool = False


def operating_range(task: Task, found: Found, *, phases: int) -> Range:
    """Where the robust clearance works, over the level; mean over the band, if there is one.

    Parameters
    ----------
    task : Task
    found : Found
        Its search.
    phases : int
        Starts at a level, where the scan of the search does not tell.
    """
    alike = task.plain and not task.ranged
    levels, left, captured = (
        _scaled(task, found) if alike else _tried(task, found.robust, phases=phases)
    )
    return _range(task, levels, left, captured)


def _scaled(task: Task, found: Found) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Levels (m), share of the bare amplitude left, share captured, from the scan.

    Lengths scale together where nothing but c1 damps: clearance b under level G s does what b/s
    does under G, s times as large. So the scan over clearances is one over levels too.
    """
    rest, level = found.rest, task.levels[0]
    levels = found.robust / found.grid[::-1] * level
    return levels, (rest.average(rest.mean) / task.mean_bare())[::-1], rest.share[::-1]


def _tried(task: Task, b: float, *, phases: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same by simulation: friction and damping laws have lengths of their own."""
    levels = np.geomspace(ENDS[0] * task.levels[0], ENDS[1] * task.levels[1], LEVELS)
    rows = []
    for level in levels:
        at = replace(task, levels=(float(level),) * 2)
        runs = wall_starts(at, b, range(phases))
        rest = responses(runs)
        left = mean_over(rest) / np.average(at.bare_of(runs), weights=runs.weight)
        rows.append((float(left), float(rest.share)))
    left, captured = np.array(rows, dtype=np.float64).T
    return levels, left, captured


def _range(task: Task, levels: FloatArray, left: FloatArray, captured: FloatArray) -> Range:
    single = task.frequencies[0] == task.frequencies[1]
    active = np.flatnonzero(captured >= 0.5) if single else np.empty(0, dtype=np.intp)
    works = left <= WORKS
    at = int(np.abs(np.log(levels / np.sqrt(task.levels[0] * task.levels[1]))).argmin())
    low = high = at
    while low > 0 and works[low - 1]:
        low -= 1
    while high < works.size - 1 and works[high + 1]:
        high += 1
    ends = float(levels[low]), float(levels[high])
    if task.levels[0] == task.levels[1]:  # that level lies between two of those looked at
        ends = min(ends[0], task.levels[0]), max(ends[1], task.levels[0])
    return Range(
        activation=float(levels[active[0]]) if active.size else None,
        low=ends[0] if works[at] else None,
        high=ends[1] if works[at] else None,
        low_open=bool(works[at]) and low == 0,
        high_open=bool(works[at]) and high == works.size - 1,
    )
