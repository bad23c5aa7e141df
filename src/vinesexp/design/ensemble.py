"""Many steady responses at once: mean and largest amplitude of every start, exactly simulated.

A `Run` is one rig under one harmonic base from one start, `Runs` are many as arrays. Plain rigs
with one ball run side by side in the lanes of one loop (`solver/lanes.py`), others one by one; the
compiled loops release the interpreter's lock, so the runs of an ensemble share all cores. Each
keeps its own random draw and no lane looks at another, so the result does not depend on how they
are shared out.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import overload

import numpy as np
from scipy.special import ellipe

from vinesexp.arrays import BoolArray, FloatArray, IntArray, each_array, joined_arrays
from vinesexp.errors import AnalysisError
from vinesexp.excitation import Harmonic, Release, WeakDamping
from vinesexp.rig import NES, Oscillator, Rig
from vinesexp.solver.arrays import balls_at, gap_of
from vinesexp.solver.lanes import Amplitudes, amplitudes, amplitudes_in_turn
from vinesexp.solver.simulation import simulate
from vinesexp.solver.state import Records

#: Slow times (see `slow_time`) that a start is given to settle, and over which it is then judged.
SETTLE, WINDOW = 6.0, 8.0
#: Times SETTLE slow times that a start is watched at most where some starts are captured and some
#: not yet: where the bare transient takes longer to die out, capture has been given that already.
LONGEST_WATCH = 16.0
#: s of work that its cycles may take: where these are dear, more starts tell more than longer ones.
WATCHING = 0.02
#: Times 1/(zeta w0) that a start is given to settle: what is left of a bare transient is e^-3,
#: which moves a mean amplitude by 0.06 %.
BARE = 3.0
#: A run is judged for this share of the time it has to settle at the least: a modulated motion is
#: then known as well as it costs.
WATCHED = 0.25
#: No run is shorter than this many cycles of the base to settle and to be judged (of each).
SHORTEST = 60.0
#: No run is longer than this many cycles in all, of base or oscillator, whichever is faster: near
#: resonance, and farther from it than a factor of `FAR`, where the ball hardly matters.
LONGEST, LONGEST_FAR, FAR = 6_000.0, 4_000.0, 2.0
#: A start is captured when its balls make at least this many impacts a cycle each, taken together
#: and over the window, and its largest amplitude stays below STEADY times the mean one and the step
#: that impacts of a steady motion make (`Responses.step`).
IMPACTS_PER_CYCLE = 1.9
STEADY = 1.5
#: s of one core an impact, for what is said beforehand (docs/benchmarks/simulation.md).
PER_IMPACT = 0.3e-6
#: s of one core: a run, a cycle, an impact, more for one beyond two a cycle of each ball, an
#: evaluation of the scalar loop and ball where these are counted. In lanes; one by one in closed
#: form (several balls, a heavy one); with friction of the balls; with a damping law. TABLE: what is
#: tabulated for another oscillator or frequency than that of the run before. By these a search
#: shares out its time; counted, not measured, so that an answer is the same anywhere.
WORK_LANES, WORK_ALONE, WORK_FRICTION, WORK_LAW = (
    (1e-5, 4e-8, 4.5e-8, 0.0, 3.8e-7), (1e-4, 1.2e-7, 0.0, 3e-7, 7e-8),
    (5.7e-4, 3.2e-6, 0.0, 2.4e-6, 0.0), (6.5e-4, 8e-6, 1.4e-6, 6e-7, 0.0),
)  # fmt: skip
TABLE = 2.8e-5
#: So many starts that are next to each other in frequency say whether one of them may be captured.
NEIGHBOURS = 10
#: Bytes of a run in memory, with what is found of it.
RUN_SIZE = 600.0
#: A loop of fewer lanes takes hardly less: not so few runs are shared out over several cores.
FULL = 16
#: No damping beyond c1.
VISCOUS = WeakDamping()


@dataclass(frozen=True)
class Run:
    """One start of one rig under one base motion.

    Attributes
    ----------
    rig : Rig
    base : Harmonic
        Amplitude (m), frequency (Hz), phase (rad) at which the shaker starts.
    release : Release
        State at t = 0, SI.
    damping : WeakDamping
        Of the oscillator, beyond c1.
    """

    rig: Rig
    base: Harmonic
    release: Release
    damping: WeakDamping = VISCOUS


#: Columns of `Runs.values` and, of every ball, of `Runs.balls`; SI.
V_M, V_C, V_K, V_G, V_F, V_PHASE, V_X0, V_V0 = range(8)
B_M, B_B, B_R, B_Y0 = range(4)


def bare_gains(M: FloatArray, c1: FloatArray, k1: FloatArray, frequency: FloatArray) -> FloatArray:
    """`bare_gain` of many oscillators."""
    w0 = np.sqrt(k1 / M)
    w = 2.0 * np.pi * frequency / w0
    z = c1 / (M * w0) * w
    with np.errstate(divide="ignore"):  # undamped at resonance: infinite
        gain = np.hypot(1.0, z) / np.hypot((1.0 - w) * (1.0 + w), z)
    return np.asarray(gain * mean_of_cycle(w))


def mean_of_cycle(w: FloatArray) -> FloatArray:
    """Mean of hypot(sin, w cos) over a cycle: amplitude of x to mean amplitude, w = f/f0.

    A complete elliptic integral of the second kind.

    Examples
    --------
    >>> mean_of_cycle(np.array([0.0, 1.0, 2.0])).round(4)  # of |sin|: 2/pi
    array([0.6366, 1.    , 1.542 ])
    """
    return np.asarray((2.0 / np.pi) * ellipe((1.0 - w) * (1.0 + w)))


@dataclass(frozen=True, eq=False)
class Runs(Sequence[Run]):
    """Many runs as arrays: a `Run` takes longer to make than its motion in a lane.

    Attributes
    ----------
    values : (runs, 8): M, c1, k1; amplitude, frequency, phase of the base; x0, v0.
    balls : (runs, balls, 4): m, b, r, y0; each starts at rest.
    weight : what each run stands for in a mean over all of them.
    friction, damping : of all runs alike, as in `Task`.
    remainder : rad from which on the rest of a chatter is summed, where runs go one by one
        (`simulate`).
    """

    values: FloatArray
    balls: FloatArray
    weight: FloatArray
    friction: float = 0.0
    damping: WeakDamping = VISCOUS
    remainder: float | None = None

    def __len__(self) -> int:
        return len(self.values)

    @overload
    def __getitem__(self, which: int) -> Run: ...

    @overload
    def __getitem__(self, which: slice | IntArray) -> Runs: ...

    def __getitem__(self, which: int | slice | IntArray) -> Run | Runs:
        if not isinstance(which, int | np.integer):
            return each_array(lambda values: values[which], self)
        M, c1, k1, G, f, phase, x0, v0 = self.values[which].tolist()
        balls = self.balls[which].tolist()
        nes = [NES(m=m, b=b, r=r, friction=self.friction) for m, b, r, _ in balls]
        rig = Rig(Oscillator(M=M, c1=c1, k1=k1), nes)
        start = Release(x0, v0, [y0 for *_, y0 in balls], [0.0] * len(balls))
        return Run(rig, Harmonic(G, f, phase), start, self.damping)

    @property
    def in_lanes(self) -> BoolArray:
        """Which of them run in lanes: one ball, no heavier than M, and nothing special."""
        alike = self.balls.shape[1] == 1 and self.plain
        light = self.balls[:, :, B_M].sum(axis=1) <= self.values[:, V_M]
        return np.asarray(light & alike)

    @property
    def plain(self) -> bool:
        """Whether there is a closed form between impacts."""
        return self.friction == 0.0 and self.damping == VISCOUS

    @property
    def law(self) -> FloatArray:
        """What each takes of a processor, s: a run, a cycle, and the rest of WORK_LANES."""
        alone = WORK_ALONE if self.plain else WORK_FRICTION
        alone = alone if self.damping == VISCOUS else WORK_LAW
        return np.where(self.in_lanes[:, np.newaxis], WORK_LANES, alone)

    @property
    def bare(self) -> FloatArray:
        """Mean amplitude of the oscillator alone where c1 is its only damping, m."""
        M, c1, k1, G, f, *_ = self.values.T
        return np.asarray(G * bare_gains(M, c1, k1, f))

    @property
    def pace(self) -> FloatArray:
        """Frequency of base or oscillator, whichever is faster, Hz."""
        own = np.sqrt(self.values[:, V_K] / self.values[:, V_M]) / (2.0 * math.pi)
        return np.asarray(np.maximum(self.values[:, V_F], own))


def together(blocks: Sequence[Runs]) -> Runs:
    """Blocks of runs under one damping and friction, one after the other."""
    return joined_arrays(*blocks)


@dataclass(frozen=True)
class Responses:
    """What each run of an ensemble settles to; arrays of one entry per run.

    Attributes
    ----------
    mean, largest : amplitude hypot(x, x'/w0) over the window, m.
    impacts_per_cycle : of all balls together, per cycle of the base.
    work : about what the run took of a processor, s.
    step : half the step that the amplitude takes at an impact when the balls cross their cavities
        twice a cycle, m: 2/pi b eps f/f0 each. Of a heavy ball it is as large as the amplitude.
    weight : what the run stands for (`Runs`).
    balls : how many balls the rig of that run has.
    """

    mean: FloatArray
    largest: FloatArray
    impacts_per_cycle: FloatArray
    work: FloatArray
    step: FloatArray
    weight: FloatArray
    balls: int

    @property
    def captured(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Whether the balls keep two impacts a cycle or more each, on the average, unmodulated."""
        steady = self.largest <= STEADY * self.mean + self.step
        return steady & (self.impacts_per_cycle >= IMPACTS_PER_CYCLE * max(self.balls, 1))

    def average(self, values: FloatArray) -> FloatArray:
        """Mean of some values of each run, by what the run stands for; over the last axis."""
        return np.asarray(np.average(values, axis=-1, weights=self.weight))

    @property
    def share(self) -> FloatArray:
        """Share that is captured, over the last axis."""
        return self.average(self.captured.astype(np.float64))

    def split(self, counts: Sequence[int]) -> list[Responses]:
        """The runs of each of several blocks that were simulated together."""
        ends = np.cumsum(counts)
        return [
            each_array(lambda values, a=end - count, b=end: values[a:b], self)
            for count, end in zip(counts, ends, strict=True)
        ]

    def reshape(self, *shape: int) -> Responses:
        """The same runs in another shape."""
        return each_array(lambda values: values.reshape(shape), self)


def slow_time(rig: Rig) -> float:
    """Time (s) in which the amplitude changes while a ball acts: 1/(w0 (zeta + 0.3 eps)).

    zeta is the bare oscillator's rate, 0.3 eps about what a captured ball adds (docs/theory.md, 25:
    8 Gamma C^2/(pi^3 A^2), far from the fold).
    """
    o = rig.oscillator
    return float(_slow_time(np.array(o.w0), np.array(o.zeta), np.array(rig.eps)))


def _slow_time(w0: FloatArray, zeta: FloatArray, eps: FloatArray) -> FloatArray:
    rate = zeta + 0.3 * eps
    if not np.all(rate > 0.0):
        raise AnalysisError("without damping and without a ball the motion never settles")
    return np.asarray(1.0 / (w0 * rate))


def duration_of(rig: Rig, frequency: float) -> tuple[float, float, float]:
    """(settle, whole duration) of a run, s, and the share of the time needed that this is.

    Far from resonance a light damping takes more cycles to settle than can be run: below 1.
    """
    o = rig.oscillator
    mass = sum(nes.m for nes in rig.nes)
    found = _durations(*(np.array(one) for one in (o.M, o.c1, o.k1, mass, frequency)))
    settle, whole, share = (float(one) for one in found)
    return settle, whole, share


def _durations(
    M: FloatArray, c1: FloatArray, k1: FloatArray, mass: FloatArray, frequency: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(settle, whole duration, share) of runs with so much mass of balls."""
    w0, period = np.sqrt(k1 / M), 1.0 / frequency
    zeta, f0 = 0.5 * c1 / (M * w0), w0 / (2.0 * math.pi)
    slow = _slow_time(w0, zeta, mass / M)
    # where the ball is seldom struck the bare transient has to die out
    bare = np.divide(BARE, zeta * w0, out=np.zeros_like(w0), where=zeta > 0.0)
    settle = np.maximum(np.maximum(SETTLE * slow, SHORTEST * period), bare)
    whole = settle + np.maximum(np.maximum(WINDOW * slow, SHORTEST * period), WATCHED * settle)
    near = (frequency / f0 >= 1.0 / FAR) & (frequency / f0 <= FAR)
    longest = np.where(near, LONGEST, LONGEST_FAR)
    share = np.minimum(1.0, longest / (whole * np.maximum(frequency, f0)))
    return share * settle, share * whole, share


@dataclass(frozen=True)
class Workload:
    """What an ensemble will cost, as far as its rigs say beforehand: runs and impacts."""

    runs: int
    impacts: float

    @property
    def seconds(self) -> float:
        """About how long it takes on all cores, s."""
        return self.impacts * PER_IMPACT / (os.cpu_count() or 1)

    def __str__(self) -> str:
        return f"{self.runs:,} runs, about {self.impacts:.2g} impacts: {_in_words(self.seconds)}"


def workload_of(rig: Rig, frequency: float, runs: int) -> Workload:
    """Two impacts a cycle and ball, over the time that each run is given."""
    cycles = duration_of(rig, frequency)[1] * frequency
    return Workload(runs, 2.0 * runs * cycles * max(len(rig.nes), 1))


def _in_words(seconds: float) -> str:
    """About how long, in the unit that a person would say it in.

    Examples
    --------
    >>> [_in_words(s) for s in (0.2, 45.0, 600.0, 9000.0, 1e8)]
    ['a few seconds', 'about 45 s', 'about 10 min', 'about 2.5 h', 'about 1157 days']
    """
    if seconds < 10.0:
        return "a few seconds"
    units = ((86400.0, "days"), (3600.0, "h"), (60.0, "min"), (1.0, "s"))
    number, unit = next((seconds / size, unit) for size, unit in units if seconds >= 2.0 * size)
    return f"about {number:.2g} {unit}" if number < 10.0 else f"about {number:.0f} {unit}"


def watched(runs: Runs, *, starts: int) -> Responses:
    """Responses of clearances with `starts` runs each, watched until capture is settled.

    Beside the end of the captured response capture can take many times the slow time. Where some
    starts of a clearance are captured, or the amplitude of some is, beside the bare one, more than
    `STEADY` times the least, those not captured and those of large amplitude are run again for as
    long as `longest_watch` says; and the others as long if that captured one more, since a capture
    can be lost again. So all starts of a clearance are judged at one time: of a modulated motion
    that is now beyond `STEADY` and now not, no start has several chances. A start that is lost is
    lost after the same time at any clearance, however many others are. Over a band that holds for
    the starts which are near each other in frequency: what is captured elsewhere tells nothing.
    """
    found = responses(runs)
    most = _most_watch(runs)
    of = _beside_each_other(runs, starts)
    captured, left = found.captured, found.mean / runs.bare
    least = np.full(of.max() + 1, np.inf)
    np.minimum.at(least, of, left)
    large = left > STEADY * least[of]
    late = (~captured | large) & np.isin(of, of[captured | large])
    if most > 1.0 and late.any():
        _again(found, runs, np.flatnonzero(late), most)
        more = np.isin(of, of[found.captured & late])
        _again(found, runs, np.flatnonzero(~late & more), most)
    return found


def _beside_each_other(runs: Runs, starts: int) -> IntArray:
    """Which lot of starts each run is in: of one clearance, and over a band near in frequency."""
    f = runs.values[:, V_F].reshape(-1, starts)
    lots = np.zeros(f.shape, dtype=np.intp)
    if np.ptp(f) > 0.0:
        lots[:] = np.argsort(np.argsort(f, axis=1), axis=1) // NEIGHBOURS
    return np.asarray(np.ravel(lots + np.arange(len(f))[:, np.newaxis] * starts))


def _again(found: Responses, runs: Runs, which: IntArray, watch: float) -> None:
    """Some runs watched longer, in the place of what they were."""
    if which.size == 0:
        return
    later = responses(runs[which], watch=watch)
    found.mean[which], found.largest[which] = later.mean, later.largest
    found.impacts_per_cycle[which] = later.impacts_per_cycle
    found.work[which] += later.work


def longest_watch(runs: Runs) -> float:
    """Time (s) after which a start that is not captured is given up, where others are."""
    return _most_watch(runs) * duration_of(runs[0].rig, runs[0].base.frequency)[0]


def _most_watch(runs: Runs) -> float:
    """Times as long as its time to settle that a start is watched: 1, 2, 4, 8 or 16."""
    rig, frequency = runs[0].rig, runs[0].base.frequency
    settle = duration_of(rig, frequency)[0]
    share = SETTLE * slow_time(rig) / settle
    paid = WATCHING / (runs.law[0, 1] * settle * runs.pace[0])
    return 2.0 ** math.floor(math.log2(max(min(LONGEST_WATCH * min(share, 1.0), paid), 1.0)))


def responses(
    runs: Runs, *, haste: float = 1.0, watch: float = 1.0, workers: int | None = None
) -> Responses:
    """Settled amplitudes of every run, on all cores.

    Parameters
    ----------
    runs : Runs
    haste : float
        A run is shortened by this factor, for a first look.
    watch : float
        Each is given so many times its time to settle.
    workers : int, optional
        Threads; by default one per core.

    Raises
    ------
    AnalysisError
        An oscillator at or past critical damping, or an undamped one exactly at resonance.

    Examples
    --------
    >>> one = Runs(np.array([[4.7, 3.02, 1.147e4, 0.25e-3, 7.862, 0.0, 0.0, 0.0]]),
    ...            np.array([[[0.032, 0.03, 0.6, 0.0299]]]), np.ones(1))
    >>> round(1e3 * float(responses(one).mean[0]), 1)
    5.9
    """
    refuse_what_never_settles(runs)
    M, c1, k1, _, f, *_ = runs.values.T
    settle, duration, _ = _durations(M, c1, k1, runs.balls[:, :, B_M].sum(axis=1), f)
    spans = (np.array([settle, duration]) + (watch - 1.0) * settle).T / haste
    # like oscillators and frequencies follow each other: what is tabulated for one serves all
    rigs = runs.values[:, [V_M, V_C, V_K, V_F]]
    order = np.lexsort(rigs.T)
    out = _on_all_cores(runs, spans, order, workers)
    tables = np.empty(len(runs))
    tables[order] = np.append(True, (np.diff(rigs[order], axis=0) != 0.0).any(axis=1)) & runs.plain
    work = TABLE * tables + _work(runs, spans[:, 1], out[2], out[3])
    crossed = (runs.balls[..., B_M] * runs.balls[..., B_B]).sum(axis=1) / M
    step = 4.0 * crossed * f / np.sqrt(runs.values[:, V_K] / M)
    return Responses(out[0], out[1], out[2], work, step, runs.weight, runs.balls.shape[1])


def _on_all_cores(
    runs: Runs, spans: FloatArray, order: IntArray, workers: int | None
) -> FloatArray:
    """Mean, largest, impacts per cycle and evaluations of every run, taken in that order."""
    lanes, out, f = runs.in_lanes, np.zeros((4, len(runs))), runs.values[:, V_F]
    starts = _starts_of(runs) if runs.plain else np.empty(0)
    side_by_side, alone = order[lanes[order]], order[~lanes[order]]
    stop = threading.Event()

    def share(first: int, step: int) -> None:
        for which in (side_by_side[first::step], alone[first::step]):
            if which.size == 0:
                continue
            if runs.plain:
                found = _settled(runs[which], starts[which], spans[which], stop.is_set)
                cycles = (spans[which, 1] - spans[which, 0]) * f[which]
                out[:, which] = found.mean, found.largest, found.impacts / cycles, found.spent
                continue
            for k in which.tolist():
                if stop.is_set():
                    return
                out[:3, k] = _one(runs[k], *spans[k].tolist())

    full = alone.size + -(-side_by_side.size // FULL)
    threads = max(min(workers or os.cpu_count() or 1, full), 1)
    with ThreadPoolExecutor(max(threads - 1, 1)) as pool:  # none is started before it has work
        try:
            others = [pool.submit(share, i, threads) for i in range(1, threads)]
            share(0, threads)
            for task in others:
                task.result()
        finally:  # an interrupt ends the other threads too
            stop.set()
    return out


def _starts_of(runs: Runs) -> Records:
    """Every ball as the loops have it (`arrays.balls_at`); refused where it starts outside."""
    m, b, r, y0 = np.moveaxis(runs.balls, 2, 0)
    x0 = runs.values[:, V_X0, np.newaxis]
    apart = x0 - y0
    side = np.where(apart >= 0.0, 1.0, -1.0)
    gap = b - side * apart
    # Within rounding of the wall means on it, as in `arrays.gap_of`, which says what is wrong.
    rounding = 4.0 * np.finfo(np.float64).eps * (np.abs(x0) + np.abs(y0) + b)
    for k, i in np.argwhere(gap < -rounding)[:1].tolist():
        gap_of(runs[k].rig.nes[i], i, float(x0[k, 0]), float(y0[k, i]))
    gap = np.where(gap <= rounding, 0.0, gap)
    return balls_at(m=m, b=b, r=r, gap=gap, side=side, v=runs.values[:, V_V0, np.newaxis])


def _settled(
    runs: Runs, starts: Records, spans: FloatArray, stop: Callable[[], bool]
) -> Amplitudes:
    """What plain runs, all in lanes or none, settle to."""
    whole = np.column_stack([runs.values, spans])
    if runs.in_lanes.all():
        return amplitudes(whole, starts, stop=stop)
    return amplitudes_in_turn(whole, starts, remainder=runs.remainder, stop=stop)


def _work(runs: Runs, duration: FloatArray, hits: FloatArray, spent: FloatArray) -> FloatArray:
    """About what runs with so many impacts a cycle and evaluations take of a processor, s."""
    cycles, impacts = duration * runs.pace, duration * runs.values[:, V_F] * hits
    beyond = np.maximum(impacts - 2.0 * cycles * runs.balls.shape[1], 0.0)
    counts = np.array([np.ones(len(runs)), cycles, impacts, beyond, spent * runs.balls.shape[1]])
    return np.asarray((runs.law.T * counts).sum(axis=0))


def _one(one: Run, settle: float, duration: float) -> tuple[float, float, float]:
    """(mean, largest, impacts per cycle) of one run that is not plain."""
    o, base = one.rig.oscillator, one.base
    motion = simulate(one.rig, base, one.release, duration=duration, damping=one.damping)
    pace = max(base.frequency, o.f0)
    x, v = motion.at(np.linspace(settle, duration, max(int(8 * pace * (duration - settle)), 64)))
    amplitude = np.hypot(x, v / o.w0)
    hits = float((motion.impacts["time"] >= settle).sum())
    return (
        float(amplitude.mean()),
        float(amplitude.max()),
        hits / ((duration - settle) * base.frequency),
    )


def refuse_what_never_settles(runs: Runs) -> None:
    """Refuse rigs whose damping leaves no vibration, or whose vibration grows without end.

    Raises
    ------
    AnalysisError
        A damping ratio of 0.9 or more; no damping exactly at resonance.
    """
    M, c1, k1, _, f, *_ = runs.values.T
    w0, w = np.sqrt(k1 / M), 2.0 * math.pi * f
    alpha = 0.5 * c1 / M
    if not np.all(alpha < 0.9 * w0):
        zeta = float((alpha / w0).max())
        raise AnalysisError(f"damping ratio {zeta:.3g}: expected below 0.9 for a simulation")
    if np.any(np.abs(w0 - w) + alpha < 1e-9 * w0):
        raise AnalysisError(
            "an undamped oscillator exactly at resonance has no finite bare response to compare "
            "with; give a damping or another frequency"
        )
