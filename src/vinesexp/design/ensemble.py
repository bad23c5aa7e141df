"""Many steady responses at once: mean and largest amplitude of every start, exactly simulated.

A `Run` is one rig under one harmonic base from one start. Plain rigs with one ball run side by side
in the lanes of one loop (`solver/lanes.py`), others one by one; the compiled loops release the
interpreter's lock, so the runs of an ensemble share all cores. Each keeps its own random draw and
no lane looks at another, so the result does not depend on how they are shared out.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.errors import AnalysisError
from vinesexp.excitation import Harmonic, Release, WeakDamping
from vinesexp.rig import Oscillator, Rig
from vinesexp.solver.arrays import ball_table, drive_table, is_plain, parameters
from vinesexp.solver.contact import REMAINDER
from vinesexp.solver.effort import Effort
from vinesexp.solver.kernel import run
from vinesexp.solver.lanes import add_amplitudes, amplitudes, fits_lanes, row_of
from vinesexp.solver.response import H_PHASE, prepare
from vinesexp.solver.series import ORDER
from vinesexp.solver.simulation import simulate

#: Slow times (see `slow_time`) that a start is given to settle, and over which it is then judged.
SETTLE, WINDOW = 6.0, 8.0
#: Times SETTLE slow times that a start is watched at most where some starts are captured and some
#: not yet: where the bare transient takes longer to die out, capture has been given that already.
LONGEST_WATCH = 16.0
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
#: and over the window, and its largest amplitude stays below STEADY times the mean one.
IMPACTS_PER_CYCLE = 1.9
STEADY = 1.5
#: s of one core an impact, for what is said beforehand (docs/benchmarks/simulation.md).
PER_IMPACT = 0.3e-6
#: s of one core: a run, a cycle, an impact of the two in a cycle and one beyond, in lanes; a cycle
#: and an impact of several balls; the same by power series (friction, a damping law). By these a
#: search shares out its time; counted, not measured, so that an answer is the same anywhere.
WORK_RUN, WORK_LANES, WORK_BALLS, WORK_SERIES = (
    2e-5, (6.5e-8, 1e-7, 3.5e-7), (2e-7, 6e-7, 6e-7), (1e-5, 4e-6, 4e-6),
)  # fmt: skip
#: Bytes of a `Run` in memory.
RUN_SIZE = 2000.0
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


@dataclass(frozen=True)
class Responses:
    """What each run of an ensemble settles to; arrays of one entry per run.

    Attributes
    ----------
    mean, largest : amplitude hypot(x, x'/w0) over the window, m.
    impacts_per_cycle : of all balls together, per cycle of the base.
    work : about what the run took of a processor, s.
    balls : how many balls the rig of that run has.
    """

    mean: FloatArray
    largest: FloatArray
    impacts_per_cycle: FloatArray
    work: FloatArray
    balls: int

    @property
    def captured(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Whether the balls keep two impacts a cycle or more each, on the average, unmodulated."""
        steady = self.largest <= STEADY * self.mean
        return steady & (self.impacts_per_cycle >= IMPACTS_PER_CYCLE * max(self.balls, 1))

    def each(self, change: Callable[..., FloatArray], *others: Responses) -> Responses:
        """The same change of every array; with those of others, if any."""
        mean, largest, impacts, work = (
            change(*(getattr(one, name) for one in (self, *others)))
            for name in ("mean", "largest", "impacts_per_cycle", "work")
        )
        return Responses(mean, largest, impacts, work, self.balls)

    def joined(self, more: Responses) -> Responses:
        """These runs and more of them, along the last axis."""
        return self.each(lambda *both: np.concatenate(both, axis=-1), more)

    def reshape(self, *shape: int) -> Responses:
        """The same runs in another shape."""
        return self.each(lambda values: values.reshape(shape))


def slow_time(rig: Rig) -> float:
    """Time (s) in which the amplitude changes while a ball acts: 1/(w0 (zeta + 0.3 eps)).

    zeta is the bare oscillator's rate, 0.3 eps about what a captured ball adds (docs/theory.md, 25:
    8 Gamma C^2/(pi^3 A^2), far from the fold).
    """
    return _slow_time(rig.oscillator, sum(nes.m for nes in rig.nes))


def _slow_time(o: Oscillator, mass: float) -> float:
    rate = o.zeta + 0.3 * mass / o.M
    if not rate > 0.0:
        raise AnalysisError("without damping and without a ball the motion never settles")
    return 1.0 / (o.w0 * rate)


def duration_of(rig: Rig, frequency: float) -> tuple[float, float]:
    """(settle, whole duration) of a run, s."""
    return _duration(rig.oscillator, sum(nes.m for nes in rig.nes), frequency)[:2]


def cut_short(rig: Rig, frequency: float) -> float:
    """Share of the time that a run would need to settle and to be judged; below 1 where cut.

    Far from resonance a light damping takes more cycles to settle than can be run.
    """
    return _duration(rig.oscillator, sum(nes.m for nes in rig.nes), frequency)[2]


def _duration(o: Oscillator, mass: float, frequency: float) -> tuple[float, float, float]:
    """(settle, whole duration, share) of runs with so much mass of balls."""
    period, slow = 1.0 / frequency, _slow_time(o, mass)
    settle = max(SETTLE * slow, SHORTEST * period)
    if o.zeta > 0.0:  # where the ball is seldom struck the bare transient has to die out
        settle = max(settle, BARE / (o.zeta * o.w0))
    whole = settle + max(WINDOW * slow, SHORTEST * period, WATCHED * settle)
    longest = LONGEST if 1.0 / FAR <= frequency / o.f0 <= FAR else LONGEST_FAR
    share = min(1.0, longest / (whole * max(frequency, o.f0)))
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


def watched(runs: Sequence[Run], *, starts: int) -> Responses:
    """Responses of clearances with `starts` runs each, watched until capture is settled.

    Beside the end of the captured response capture can take many times the slow time. Where some
    starts are captured and some are not, those lost are run again for twice the time to settle,
    and again while that captures one more, as long as `longest_watch` says; then the others as
    long, since a capture can be lost again.
    """
    found, watch = responses(runs), 2.0
    most = _most_watch(runs[0].rig, runs[0].base.frequency)
    first: BoolArray = np.asarray(found.captured.reshape(-1, starts))
    captured: BoolArray = first
    mixed: BoolArray = np.asarray(first.any(axis=1) & ~first.all(axis=1))
    longest = np.ones(len(mixed))
    while watch <= most and mixed.any():
        longest[mixed] = watch
        _again(found, runs, np.flatnonzero((mixed[:, np.newaxis] & ~captured).ravel()), watch)
        now: BoolArray = np.asarray(found.captured.reshape(-1, starts))
        mixed = np.asarray((now.sum(axis=1) > captured.sum(axis=1)) & ~now.all(axis=1))
        captured, watch = now, 2.0 * watch
    gained = captured.sum(axis=1) > first.sum(axis=1)
    for watch in np.unique(longest[gained]):
        own = gained & (longest == watch)
        _again(found, runs, np.flatnonzero((own[:, np.newaxis] & first).ravel()), float(watch))
    return found


def _again(found: Responses, runs: Sequence[Run], which: IntArray, watch: float) -> None:
    """Some runs watched longer, in the place of what they were."""
    later = responses([runs[k] for k in which], watch=watch)
    found.mean[which], found.largest[which] = later.mean, later.largest
    found.impacts_per_cycle[which] = later.impacts_per_cycle
    found.work[which] += later.work


def longest_watch(rig: Rig, frequency: float) -> float:
    """Time (s) after which a start that is not captured is given up, where others are."""
    return _most_watch(rig, frequency) * duration_of(rig, frequency)[0]


def _most_watch(rig: Rig, frequency: float) -> float:
    """Times as long as its time to settle that a start is watched: 1, 2, 4, 8 or 16."""
    share = SETTLE * slow_time(rig) / duration_of(rig, frequency)[0]
    return 2.0 ** math.floor(math.log2(max(LONGEST_WATCH * min(share, 1.0), 1.0)))


def _spans(one: Run, haste: float, watch: float) -> tuple[float, float]:
    settle, duration = duration_of(one.rig, one.base.frequency)
    later = (watch - 1.0) * settle
    return (settle + later) / haste, (duration + later) / haste


def responses(
    runs: Sequence[Run], *, haste: float = 1.0, watch: float = 1.0, workers: int | None = None
) -> Responses:
    """Settled amplitudes of every run, on all cores.

    Parameters
    ----------
    runs : sequence of Run
        All with the same number of balls.
    haste : float
        A run is shortened by this factor, for a first look.
    workers : int, optional
        Threads; by default one per core.

    Raises
    ------
    AnalysisError
        An oscillator at or past critical damping, or an undamped one exactly at resonance.

    Examples
    --------
    >>> from vinesexp import NES, Oscillator
    >>> rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.03, r=0.6)])
    >>> one = Run(rig, Harmonic(amplitude=0.25e-3, frequency=7.862), Release(y0=[0.0299]))
    >>> round(1e3 * float(responses([one]).mean[0]), 1)
    5.9
    """
    out = np.empty((3, len(runs)))
    fits = [fits_lanes(run.rig, run.damping) for run in runs]
    spans = np.array([_spans(run, haste, watch) for run in runs]).reshape(-1, 2)
    side_by_side, alone = (
        [k for k, fit in enumerate(fits) if fit is lanes] for lanes in (True, False)
    )
    stop = threading.Event()

    def share(first: int, step: int) -> None:
        own = side_by_side[first::step]
        if own:
            out[:, own] = _together([runs[k] for k in own], spans[own], stop)
        room = Room()
        for k in alone[first::step]:
            if stop.is_set():
                return
            out[:, k] = _one(runs[k], room, *spans[k].tolist())

    full = len(alone) + -(-len(side_by_side) // FULL)
    threads = min(workers or os.cpu_count() or 1, full)
    if threads <= 1:
        share(0, 1)
    else:
        with ThreadPoolExecutor(threads) as pool:
            try:
                for task in [pool.submit(share, i, threads) for i in range(threads)]:
                    task.result()
            finally:  # an interrupt ends the other threads too
                stop.set()
    work = _work(runs, np.array(fits), spans[:, 1], out[2])
    return Responses(out[0], out[1], out[2], work, len(runs[0].rig.nes) if runs else 0)


def _work(
    runs: Sequence[Run], fits: BoolArray, duration: FloatArray, hits: FloatArray
) -> FloatArray:
    """About what runs with so many impacts a cycle take of a processor, s."""
    f = np.array([run.base.frequency for run in runs])
    pace = np.array([max(run.base.frequency, run.rig.oscillator.f0) for run in runs])
    per = np.array([
        WORK_LANES if fit else WORK_BALLS if is_plain(run.rig, run.damping) else WORK_SERIES
        for run, fit in zip(runs, fits, strict=True)
    ]).reshape(-1, 3).T  # fmt: skip
    cycles, impacts = duration * pace, duration * f * hits
    beyond = np.maximum(impacts - 2.0 * cycles, 0.0)
    return np.asarray(WORK_RUN + per[0] * cycles + per[1] * (impacts - beyond) + per[2] * beyond)


@dataclass
class Room:
    """What one thread keeps from run to run: the log, scratch space, closed forms."""

    log: FloatArray = field(default_factory=lambda: np.empty((2048, 6)))
    labels: NDArray[np.int32] = field(default_factory=lambda: np.empty((2048, 3), dtype=np.int32))
    work: FloatArray = field(default_factory=lambda: np.zeros((4, ORDER + 1)))
    tables: dict[tuple[float, float, float, float, float], FloatArray] = field(default_factory=dict)


def _together(runs: Sequence[Run], spans: FloatArray, stop: threading.Event) -> FloatArray:
    """(mean, largest, impacts per cycle) of runs with one ball each, in the lanes of one loop."""
    rows, cycles = [], []
    for one, (settle, duration) in zip(runs, spans.tolist(), strict=True):
        _check(one)
        rows.append(row_of(one.rig, one.base, one.release, settle=settle, duration=duration))
        cycles.append((duration - settle) * one.base.frequency)
    found = amplitudes(np.array(rows), stop=stop.is_set)
    return np.array([found.mean, found.largest, found.impacts / np.array(cycles)])


def _one(one: Run, room: Room, settle: float, duration: float) -> tuple[float, float, float]:
    """(mean, largest, impacts per cycle) of one run."""
    o, base = one.rig.oscillator, one.base
    if one.damping != VISCOUS or not is_plain(one.rig):
        return _simulated(one, settle, duration)
    key = (o.M, o.c1, o.k1, base.amplitude, base.frequency)
    if key not in room.tables:
        _check(one)
        room.tables[key] = prepare(*key, 0.0)
    response = room.tables[key].copy()
    response[H_PHASE] += base.phase
    kind, table = drive_table(base)
    par = parameters(one.rig, WeakDamping())
    balls, _ = ball_table(one.rig, one.release)
    log, labels, work = room.log, room.labels, room.work
    work[:] = 0.0
    state, node, sums = np.zeros(4), np.zeros(4), np.zeros(5)
    effort = Effort(one.rig, base, VISCOUS, duration)
    state[2:] = one.release.x0, one.release.v0
    node[1:3] = one.release.x0, one.release.v0
    while state[0] < duration:
        rows, used = run(
            True, response, par, kind, table, duration, REMAINDER, state, balls, log, labels, work
        )
        effort.add(state, used)
        add_amplitudes(response, log, labels, rows, state, node, settle, sums)
    cycles = (duration - settle) * base.frequency
    return sums[1] / sums[0], sums[2], sums[3] / cycles


def _simulated(one: Run, settle: float, duration: float) -> tuple[float, float, float]:
    """The same for a rig without a closed form: friction, a damping law."""
    o, base = one.rig.oscillator, one.base
    if not o.zeta < 0.9:
        _check(one)
    motion = simulate(one.rig, base, one.release, duration=duration, damping=one.damping)
    pace = max(base.frequency, o.f0)
    x, v = motion.at(np.linspace(settle, duration, max(int(8 * pace * (duration - settle)), 64)))
    amplitude = np.hypot(x, v / o.w0)
    hits = float((motion.impacts["time"] >= settle).sum())
    cycles = (duration - settle) * base.frequency
    return float(amplitude.mean()), float(amplitude.max()), hits / cycles


def _check(one: Run) -> None:
    o, base = one.rig.oscillator, one.base
    if not o.zeta < 0.9:
        raise AnalysisError(f"damping ratio {o.zeta:.3g}: expected below 0.9 for a simulation")
    w = 2.0 * math.pi * base.frequency
    if abs(o.w0 - w) + o.zeta * o.w0 < 1e-9 * o.w0:
        raise AnalysisError(
            "an undamped oscillator exactly at resonance has no finite bare response to compare "
            "with; give a damping or another frequency"
        )
