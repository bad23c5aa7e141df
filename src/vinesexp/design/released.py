"""A release simulated over clearance: times to a level, capture, energy taken, pumping time.

The measures go by their names in the literature. *Pumping time*: how long targeted energy transfer
lasts, from the release until the ball leaves the resonance capture (Dekemele and others, Nonlinear
Dyn. 2018, 10.1007/s11071-018-4190-5). *Energy dissipated by the NES*: the share of the energy at
the release that its impacts have taken (Vakakis and others, Springer 2008).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any, Protocol, TypeVar

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray, each_array, joined_arrays
from vinesexp.design.ensemble import VISCOUS
from vinesexp.design.task import WORTH, OpenRig, golden
from vinesexp.excitation import Measured, Release, WeakDamping
from vinesexp.rig import Oscillator, Rig
from vinesexp.solver.motion import Motion
from vinesexp.solver.simulation import simulate
from vinesexp.theory.regime_definitions import activation_spells

#: Clearances tried at first, and between neighbours of the fastest of each level; ball positions
#: anywhere, and how many more are at the wall that will push, each a little farther off it.
CLEARANCES, CLOSER, STARTS, AT_WALL = 15, 3, 12, 4
#: Balls anywhere and at the wall, drawn anew, that judge the fastest clearances, and how many such
#: lots: what looks best of many is partly so by luck of the few starts that found it.
FRESH, FRESH_AT_WALL, LOTS = 36, 12, 3
#: Ends of the clearances tried, shares of the release amplitude.
ENDS = (0.25, 4.0)
#: Where starts at a wall are: from it up to this share of b off it.
OFF_WALL = 0.06
#: A start is captured when its largest ball makes this share of two impacts a cycle between these
#: cycles, or until the least level is reached: nothing is left then to keep a ball captured. A fall
#: of fewer than BRIEF cycles counts from its start.
CAPTURED, FROM, TO, BRIEF = 0.9, 2.0, 10.0, 4.0
#: A release is followed for this many times 1/(zeta w0), and at most for so many cycles.
FOLLOWED, LONGEST = 3.5, 600.0
#: The oscillator alone is followed further, for at most so many cycles: beyond, what c1 damps is
#: known in closed form.
LONGEST_BARE = 2e4
#: Share of the starts by whose time three of four balls are at a level, whatever other starts show.
#: Wider is faster and captures fewer: by three of four of its own starts the fastest clearance were
#: the widest that just captures so many, and other starts would show fewer.
SURE = 0.85
_PER_CYCLE = 8


@dataclass(frozen=True)
class Fall:
    """Releases at one clearance, one entry per ball position; s, shares.

    Attributes
    ----------
    b : clearance (the largest, of several balls), m.
    times : to fall for good below each level; infinite where it never does; shape (starts, levels).
    at_wall : which starts have their ball at a wall; the others have it anywhere.
    captured : whether the ball is captured from the start.
    dissipated : share of the energy at the release that impacts have taken at the end.
    pumping : pumping time; 0 where the ball was never captured.
    left : share of the energy that is left when the pumping ends; 1 where it never began.
    """

    b: float
    times: FloatArray
    at_wall: BoolArray
    captured: FloatArray
    dissipated: FloatArray
    pumping: FloatArray
    left: FloatArray

    def anywhere(self) -> Fall:
        """The starts with the ball anywhere alone."""
        return each_array(lambda values: values[~self.at_wall], self)

    @property
    def share(self) -> float:
        """Share of balls at rest anywhere that are captured."""
        return self.captured_share(at_wall=False)

    def captured_share(self, *, at_wall: bool) -> float:
        """Share of the balls anywhere, or of those at a wall, that are captured."""
        return float(self.captured[self.at_wall == at_wall].mean())

    def sure(self, level: int, *, at_wall: bool = False) -> float:
        """Time to a level (by its number) by which three of four balls are there, s."""
        times = np.sort(self.times[self.at_wall == at_wall, level])
        return float(times[math.ceil(SURE * len(times)) - 1])


@dataclass(frozen=True)
class Falls:
    """Releases over clearance.

    Attributes
    ----------
    levels : m.
    found : one entry per clearance tried; of the fastest, starts drawn anew.
    fastest, fastest_at_wall : for each level the fastest clearance for three of four balls at rest
        anywhere, and of those at a wall, as its index.
    bare : time to each level without a ball, s; infinite where it is not reached.
    tolerance : share of b within which each ball had a cavity of its own.
    followed : how long each release with balls was simulated, s: an infinite time of a ball is
        later than that.
    asked : index of a clearance that was asked for, if any.
    """

    levels: tuple[float, ...]
    found: list[Fall]
    fastest: tuple[int, ...]
    fastest_at_wall: tuple[int, ...]
    bare: tuple[float, ...]
    followed: float
    tolerance: float = 0.0
    asked: int | None = None

    def helps(self, level: int, *, at_wall: bool = False) -> bool:
        """Whether any clearance is faster to a level than no ball, by a twentieth or more."""
        best = self.found[(self.fastest_at_wall if at_wall else self.fastest)[level]]
        return best.sure(level, at_wall=at_wall) < (1.0 - WORTH) * self.bare[level]


def released(
    open_rig: OpenRig,
    *,
    x0: float,
    v0: float,
    levels: Sequence[float],
    marks: Sequence[float] = (),
    asked: float | None = None,
    seed: int = 1,
) -> Falls:
    """Simulate releases with balls at rest anywhere in their cavities, and at their walls.

    Parameters
    ----------
    open_rig : OpenRig
        Each ball is in a cavity of its own, within the tolerance.
    x0, v0 : float
        m, m/s.
    levels : sequence of float
        Amplitudes to be reached, m.
    marks : sequence of float
        Clearances that theory suggests, m: tried besides.
    asked : float, optional
        One of them that the answer has to show, m.
    seed : int
        Of the ball positions: the same at every clearance.
    """
    oscillator = open_rig.oscillator
    x_m = float(np.hypot(x0, v0 / oscillator.w0))
    rng = np.random.default_rng(seed)
    heading = float(np.sign(v0 if v0 != 0.0 else -x0))
    few, *lots = (
        _places(len(open_rig.masses), heading, rng, starts=starts, at_wall=at_wall)
        for starts, at_wall in ((STARTS, AT_WALL), *[(FRESH, FRESH_AT_WALL)] * LOTS)
    )
    decay = max(oscillator.zeta, 1e-9) * oscillator.w0
    duration = min(FOLLOWED / decay, LONGEST / oscillator.f0)

    def tried(b: float, starts: tuple[FloatArray, BoolArray] = few) -> Fall:
        places, at_wall = starts
        motions = motions_from(places, open_rig, b, None, duration, x0=x0, v0=v0)
        return _fall(b, motions, at_wall, levels)

    first = np.concatenate([x_m * np.geomspace(*ENDS, CLEARANCES), list(marks)])
    wanted = _wanted(len(levels))
    found = tried_closer(first, tried, wanted, CLOSER)
    best = judged(found, wanted, tried, lots)
    mine = None if asked is None else int(np.argmin([abs(one.b - asked) for one in found]))
    return Falls(
        levels=tuple(levels),
        found=found,
        fastest=tuple(best[: len(levels)]),
        fastest_at_wall=tuple(best[len(levels) :]),
        bare=_bare_times(oscillator, x0, v0, levels, open_rig.damping),
        followed=duration,
        tolerance=open_rig.tolerance,
        asked=mine,
    )


def motions_from(
    places: Iterable[FloatArray], open_rig: OpenRig, b: float, base: Measured | None,
    duration: float, *, x0: float = 0.0, v0: float = 0.0,
) -> Iterator[Motion]:  # fmt: skip
    """Motions of rigs as they are delivered for a clearance b (m): one for each place of the balls.

    They are at rest, x0 - y0 over their clearances from the middle.
    """
    places = list(places)
    for place, own in zip(places, open_rig.delivered(b, golden(len(places))), strict=True):
        rig = open_rig.rig(float(own))
        y0 = [x0 + float(u) * one.b for u, one in zip(place, rig.nes, strict=True)]
        yield simulate(rig, base, Release(x0, v0, y0), duration, damping=open_rig.damping)


class Tried(Protocol):
    """What was tried at a clearance."""

    @property
    def b(self) -> float:
        """The clearance, m."""


Clearance = TypeVar("Clearance", bound=Tried)


def tried_closer(
    first: FloatArray,
    tried: Callable[[float], Clearance],
    wanted: Sequence[Callable[[Clearance], float]],
    closer: int,
) -> list[Clearance]:
    """Clearances (m) tried, then `closer` more between neighbours of the least by each value."""
    found = [tried(float(b)) for b in np.unique(first)]
    near = {
        float(b)
        for at in (int(np.argmin([value(one) for one in found])) for value in wanted)
        for low, high in pairwise([one.b for one in found[max(at - 1, 0) : at + 2]])
        for b in np.geomspace(low, high, closer + 2)[1:-1]
    }
    return sorted([*found, *map(tried, near)], key=lambda one: one.b)


def judged(
    found: list[Any], wanted: Sequence[Callable[[Any], float]],
    tried: Callable[[float, Any], Any], lots: Sequence[Any],
) -> list[int]:  # fmt: skip
    """The least of what was tried by each of some values, as starts drawn anew show them.

    What looks best of many is partly so by luck. It is tried anew, in its place in `found`, and
    again what then looks best, until that is one that was tried with every lot of starts.

    Parameters
    ----------
    found : list
        What was tried; those that are tried anew are replaced.
    wanted : sequence of callables
        Values of one of them, each to be least.
    tried : callable
        What a clearance (m) does from a lot of starts.
    lots : sequence
        Lots of starts that none was found with.

    Returns
    -------
    list of int
        Index in `found` for each value.

    Examples
    --------
    >>> from dataclasses import make_dataclass
    >>> One = make_dataclass("One", ["b", "time"])
    >>> found = [One(b, np.array([time])) for b, time in ((1.0, 3.0), (2.0, 1.0), (3.0, 2.0))]
    >>> late = lambda b, lot: One(b, np.array([{2.0: 4.0, 3.0: 2.5}[b]]))  # 1 s was luck
    >>> judged(found, [lambda one: one.time.mean()], late, "ab")
    [2]
    """
    had = [0] * len(found)
    best = []
    for value in wanted:
        while had[i := int(np.argmin([value(one) for one in found]))] < len(lots):
            more = tried(found[i].b, lots[had[i]])
            found[i] = more if had[i] == 0 else joined_arrays(found[i], more)
            had[i] += 1
        best.append(i)
    return best


def _bare_times(
    oscillator: Oscillator, x0: float, v0: float, levels: Sequence[float], damping: WeakDamping
) -> tuple[float, ...]:
    """Time to each level of the oscillator alone, s."""
    x_m, zeta = float(np.hypot(x0, v0 / oscillator.w0)), oscillator.zeta
    slowest = zeta if zeta <= 1.0 else 1.0 / (zeta + np.sqrt(zeta * zeta - 1.0))  # of both decays
    fall = np.log(x_m / np.array(levels))
    with np.errstate(divide="ignore", invalid="ignore"):  # undamped: never
        by_c1 = np.where(fall > 0.0, fall / (slowest * oscillator.w0), 0.0)
    wanted, longest = 1.02 * float(by_c1.max()) + 2.0 / oscillator.f0, LONGEST_BARE / oscillator.f0
    start = Release(x0, v0)
    alone = simulate(Rig(oscillator), None, start, duration=min(wanted, longest), damping=damping)
    times = np.array(_measures(alone, levels)[0])
    if damping == VISCOUS and wanted > longest:
        times = np.where(np.isfinite(times), times, by_c1)
    return tuple(times.tolist())


def _places(
    balls: int, heading: float, rng: np.random.Generator, *, starts: int, at_wall: int
) -> tuple[FloatArray, BoolArray]:
    """Where each ball is at rest, over its clearance: evenly anywhere, and at the wall that pushes.

    That is the one behind a ball as the oscillator sets off, in the direction `heading`.
    """
    walls = [np.full(balls, -heading * (1.0 - off)) for off in np.linspace(0.0, OFF_WALL, at_wall)]
    places = np.concatenate([anywhere(balls, rng, starts), walls])
    return places, np.arange(starts + at_wall) >= starts


def anywhere(balls: int, rng: np.random.Generator, starts: int) -> FloatArray:
    """Random places of balls over their clearances, evenly spread for each; a row a start."""
    strata = (np.arange(starts)[:, None] + rng.uniform(size=(starts, balls))) / starts
    return np.asarray(2.0 * rng.permuted(strata, axis=0) - 1.0)


def _wanted(levels: int) -> list[Callable[[Fall], float]]:
    """Times to each level that a clearance should make least, balls anywhere and at the wall."""
    return [
        partial(Fall.sure, level=k, at_wall=at_wall)
        for at_wall in (False, True)
        for k in range(levels)
    ]


def _fall(b: float, motions: Iterable[Motion], at_wall: BoolArray, levels: Sequence[float]) -> Fall:
    rows = [_measures(motion, levels) for motion in motions]
    times, captured, dissipated, pumping, left = zip(*rows, strict=True)
    return Fall(
        b=b, times=np.array(times), at_wall=at_wall, captured=np.array(captured, dtype=np.float64),
        dissipated=np.array(dissipated), pumping=np.array(pumping), left=np.array(left),
    )  # fmt: skip


def _measures(
    motion: Motion, levels: Sequence[float]
) -> tuple[list[float], bool, float, float, float]:
    """Times to the levels, captured, energy dissipated by impacts, pumping time, energy left."""
    o, i = motion.rig.oscillator, motion.impacts
    t = np.arange(0.0, motion.duration, 1.0 / (_PER_CYCLE * o.f0))
    x, v = motion.at(t)
    amplitude = np.hypot(x, v / o.w0)
    above = [np.flatnonzero(amplitude > level) for level in levels]
    later = np.append(t, np.inf)
    times = [float(later[over[-1] + 1]) if over.size else 0.0 for over in above]
    mass = np.array([nes.m for nes in motion.rig.nes])[i["nes"]]
    reduced = mass * o.M / (mass + o.M)
    before, after = i["v_before"] - i["vy_before"], i["v_after"] - i["vy_after"]
    start = 0.5 * o.k1 * motion.release.x0**2 + 0.5 * o.M * motion.release.v0**2
    dissipated = float(np.sum(0.5 * reduced * (before**2 - after**2)) / start)
    if not motion.rig.nes:
        return times, False, 0.0, 0.0, 1.0
    own = i["nes"] == int(np.argmax([nes.b for nes in motion.rig.nes]))
    cycles = i["time"][own] * o.f0
    fallen = times[int(np.argmin(levels))] * o.f0
    last = min(fallen, TO) if fallen > 0.0 else TO
    first = FROM if last >= BRIEF else 0.0
    hits = ((cycles > first) & (cycles < last)).sum()
    captured = bool(hits >= CAPTURED * 2.0 * (last - first))
    spells = activation_spells(i["time"][own], i["side"][own], period=1.0 / o.f0)
    if not len(spells):
        return times, captured, dissipated, 0.0, 1.0
    end = float(spells[np.argmax(spells[:, 1] - spells[:, 0]), 1])
    left = float(np.interp(end, t, amplitude) / amplitude[0]) ** 2
    return times, captured, dissipated, end, left
