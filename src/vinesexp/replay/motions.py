"""A record simulated again from several starts.

Nobody measures where the ball was when a test began, and some motions depend on it. So a record
is replayed from several starts, each with its name, on the base that it was driven by. One of them
is how the record itself begins, where its impacts show how each ball flies (`begun`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray, IntArray
from vinesexp.clearance.levels import LevelBase
from vinesexp.errors import AnalysisError
from vinesexp.excitation import Base, Harmonic, Measured, Release, Sweep, WeakDamping
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.store import RecordView
from vinesexp.rig import Rig
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.signals.means import channel_means, group_size

if TYPE_CHECKING:
    from vinesexp.solver.motion import Motion

#: Tests that are replayed.
TESTS = ("periodic", "transient", "ringdown", "sweep")
ON_ORBIT = "on the orbit"
AS_RECORDED = "as the record begins"
#: Starts of the ball in a test whose base moves: place in clearances from the middle, speed in
#: clearances a radian of the oscillator.
BALL_STARTS = {
    "ball at wall +1": (0.999, 0.0),
    "ball at wall -1": (-0.999, 0.0),
    "ball moving up": (0.1, 0.6),
    "ball moving down": (-0.3, -1.1),
}
#: More of them where the base is taken as measured, whose record cannot go on: chaotic motion needs
#: several draws.
MORE_STARTS = {
    f"ball moving, {n}": (math.sin(2.4 * n), 1.2 * math.cos(1.7 * n)) for n in range(1, 9)
}
#: The ball may lie in the middle while the mass swings under it: with friction; without, where the
#: record shows no impact. Of a record with impacts a motion without any says nothing.
AT_REST = {"ball in the middle": (0.0, 0.0)}
#: In a release the ball rests anywhere in its cavity.
_PLACES = 12
RELEASE_STARTS = {
    f"ball at {place:+.2f} b": (place, 0.0)
    for place in (0.999 * (2 * i / (_PLACES - 1) - 1) for i in range(_PLACES))
}


# What drives a replay: the base as it was measured, else as the test log says.
#
# A steady sine stands for a base that was one; a base that wanders, has another component or
# sweeps is taken sample by sample. Nobody saw how a test was started, so a periodic replay runs
# until its own start is forgotten, on a sine that goes over into the measured base.
_SETTLES = 5.0  # decay times of the oscillator before a periodic replay is judged
_FEWEST_CYCLES = 40
_POINTS = 48  # a cycle, of a base that is taken sample by sample
_OVER = 4.0  # cycles in which the sine goes over into the measured base
#: Amplitude of what is no sine, over that of the sine, from which on the base is taken as measured.
NO_SINE = 0.01
_SAME = 1e-3  # of an amplitude: what two ways of reading one channel differ by
#: A periodic replay goes on for this many lengths of the record: where motion is chaotic, a record
#: is one draw of many.
WINDOWS = 3


@dataclass(frozen=True)
class BaseSamples:
    """Displacement of the base, m, from its own channel: rate in Hz, its mean taken off.

    Its samples are means: the first belongs to the time `first`, s.
    """

    x: FloatArray
    rate: float
    first: float = 0.0


@dataclass(frozen=True)
class Drive:
    """Motion of the base, and when stretches as long as the record begin, s.

    Attributes
    ----------
    sine : Harmonic or None
        The steady base, where there is one: the predicted orbit is of it.
    samples : BaseSamples or None
        What the base's channel shows of a periodic test.
    """

    base: Base | None
    begins: tuple[float, ...]
    length: float
    sine: Harmonic | None = None
    samples: BaseSamples | None = None


@dataclass(frozen=True)
class Begun:
    """Mass and balls at a moment at which a record shows them all: s, m, m/s."""

    time: float
    x: float
    v: float
    y: tuple[float, ...]
    u: tuple[float, ...]


_EARLY = 0.2  # of a record: by then each ball that moves has to have met a wall
_INSIDE = 0.999  # of the clearance, where errors of reading put a ball beyond its wall
_PHASES = 8  # of a base that no channel shows


def begun(
    impacts: Impacts, clearance: Sequence[float], *, between: tuple[float, float] = (0.0, _EARLY)
) -> Begun | None:
    """How a record begins, or goes on, by its impacts; None where they do not show it.

    Between two impacts a ball flies from wall to wall, and both are known: x - y = side b. One that
    meets no wall lies still in the middle.

    Parameters
    ----------
    impacts : Impacts
        Of the whole record.
    clearance : sequence of float
        Of each ball, m.
    between : tuple of float
        Shares of the record between which the first such moment counts.
    """
    time, number = impacts.time_s, impacts.nes
    if len(clearance) == 1:
        number = np.ones_like(number)
    own = [np.flatnonzero(number == i + 1) for i in range(len(clearance))]
    own = [rows if rows.size > 1 else rows[:0] for rows in own]
    firsts = [int(rows[0]) for rows in own if rows.size]
    if not firsts:
        return None
    first, last = np.searchsorted(time, np.array(between) * time[-1]).tolist()
    late = range(max(*firsts, first), last)
    states = (_state(impacts, now, own, clearance) for now in late)
    return next((one for one in states if one is not None), None)


def released(
    impacts: Impacts, clearance: Sequence[float], *, x0: float, v0: float = 0.0
) -> Begun | None:
    """How a record begins whose balls lie at rest where a wall first meets them.

    None where the record shows no impact of a ball.

    Parameters
    ----------
    impacts : Impacts
    clearance : sequence of float
        Of each ball, m.
    x0, v0 : float
        Of the mass, m and m/s.
    """
    number = np.ones_like(impacts.nes) if len(clearance) == 1 else impacts.nes
    y = []
    for i, b in enumerate(clearance):
        own = np.flatnonzero((number == i + 1) & np.isfinite(impacts.x_m))
        if not own.size:
            return None
        y.append(float(impacts.x_m[own[0]] - b * impacts.side[own[0]]))
    return Begun(0.0, x0, v0, tuple(y), (0.0,) * len(y))


def _state(
    impacts: Impacts, now: int, own: Sequence[IntArray], clearance: Sequence[float]
) -> Begun | None:
    """Mass and balls just after one impact; None where a reading is missing."""
    time, x = impacts.time_s, impacts.x_m
    v = impacts.v_before_m_s[now] + impacts.velocity_jump_m_s[now]
    y, u = [], []
    for b, rows in zip(clearance, own, strict=True):
        place, speed = x[now], 0.0
        if rows.size and (after := rows[rows > now]).size:
            last, following = rows[rows <= now][-1], after[0]
            ends = x[[last, following]] - b * impacts.side[[last, following]]
            speed = (ends[1] - ends[0]) / (time[following] - time[last])
            place = ends[0] + speed * (time[now] - time[last])
        y.append(float(place))
        u.append(float(speed))
    if not np.all(np.isfinite([x[now], v, *y, *u])):
        return None
    return Begun(float(time[now]), float(x[now]), float(v), tuple(y), tuple(u))


def base_samples(view: RecordView, *, frequency: float) -> BaseSamples | None:
    """The base channel of a record, thinned; None where it does not measure displacement.

    Parameters
    ----------
    view : RecordView
        What was measured.
    frequency : float
        About that of the oscillation, Hz.
    """
    if view.refused is not None or "base" not in view.roles:
        return None
    if view.quantity("base") != "displacement":
        return None
    k = group_size(view.sample_rate, frequency, points=_POINTS)
    x = channel_means(view, "base", k)
    left = float(np.sinc(frequency * k / view.sample_rate))  # of a sine, by means over k samples
    first = 0.5 * (k - 1) / view.sample_rate
    return BaseSamples((x - x.mean()) / left, view.sample_rate / k, first)


def drive_of(
    record: Record, rig: Rig, *, base: LevelBase | None, samples: BaseSamples | None, length: float
) -> Drive:
    """The drive of a record.

    Parameters
    ----------
    base : LevelBase or None
        Amplitude and frequency of a periodic test.
    samples : BaseSamples or None
        Where the base channel measures displacement.
    length : float
        Of the record, s.

    Raises
    ------
    AnalysisError
        Neither sheet nor channel says how the base moved.
    """
    if record.test == "sweep":
        return _swept(record, samples, length)
    if record.test != "periodic":
        return Drive(None, (0.0,), length)
    if base is None or base.frequency is None:
        raise AnalysisError("no replay without amplitude and frequency of the base")
    decay = 1.0 / (rig.oscillator.zeta * 2.0 * math.pi * rig.oscillator.f0)
    settle = max(_SETTLES * decay, _FEWEST_CYCLES / base.frequency.value)
    sine = Harmonic(base.G.value, base.frequency.value)
    if samples is not None:
        fitted, rest = _sine_and_rest(samples, sine.frequency)
        if rest > fitted.amplitude:  # a channel that shows nothing of this base
            samples = None
    if samples is not None:
        if abs(base.G.value / fitted.amplitude - 1.0) > _SAME:
            # the shape is the channel's, the amplitude that of all records
            samples = replace(samples, x=samples.x * (base.G.value / fitted.amplitude))
        fitted, rest = _sine_and_rest(samples, sine.frequency)
        if rest > NO_SINE * sine.amplitude:
            moved, begin = _led_in(samples, fitted, settle)
            length = min(length, moved.duration - begin)
            return Drive(moved, (begin,), length, samples=samples)
    begins = tuple(settle + i * length for i in range(WINDOWS))
    return Drive(sine, begins, length, sine, samples)


def _swept(record: Record, samples: BaseSamples | None, length: float) -> Drive:
    if samples is not None:
        moved = Measured(samples.x, samples.rate)
        return Drive(moved, (0.0,), min(length, moved.duration))
    if not record.base_amplitude or record.frequency is None:
        raise AnalysisError("no replay without amplitude and frequencies of the base")
    return Drive(Sweep(record.base_amplitude, *record.frequency, length), (0.0,), length)


def _sine_and_rest(samples: BaseSamples, frequency: float) -> tuple[Harmonic, float]:
    """The sine of a frequency that fits best, and the amplitude of what it leaves."""
    t = np.arange(samples.x.size) / samples.rate
    w = 2.0 * math.pi * frequency
    columns = np.stack([np.sin(w * t), np.cos(w * t), np.ones_like(t), t], axis=1)
    solved = np.linalg.lstsq(columns, samples.x, rcond=None)[0]
    rest = samples.x - columns @ solved
    own = Harmonic(math.hypot(*solved[:2]), frequency, math.atan2(solved[1], solved[0]))
    return own, math.sqrt(2.0) * float(rest.std())


def _led_in(samples: BaseSamples, sine: Harmonic, settle: float) -> tuple[Measured, float]:
    """The measured base after `settle` s of the sine that fits it, and when it begins, s."""
    before = math.ceil(settle * samples.rate)
    t = np.arange(-before, samples.x.size) / samples.rate
    steady = sine.amplitude * np.sin(2.0 * math.pi * sine.frequency * t + sine.phase)
    share = np.clip(t * sine.frequency / _OVER, 0.0, 1.0)
    share = share * share * (3.0 - 2.0 * share)
    x = np.concatenate([np.zeros(before), samples.x])
    return Measured(share * x + (1.0 - share) * steady, samples.rate), before / samples.rate


@dataclass(frozen=True)
class Replayed:
    """A stretch of one replay as long as the record: how the motion started, and where it is, s.

    `since` is the time of the record at which such a stretch begins, s.
    """

    start: str
    motion: Motion
    begin: float
    length: float
    since: float = 0.0


def replays(
    rig: Rig,
    drive: Drive,
    *,
    plain: Rig,
    x0: float = 0.0,
    v0: float = 0.0,
    damping: WeakDamping | None = None,
    states: Sequence[Begun] = (),
    still: bool = False,
) -> list[Replayed]:
    """Simulate a record from every start.

    Parameters
    ----------
    rig : Rig
    drive : Drive
    plain : Rig
        The nearest one without effects, whose orbit of two impacts per cycle is known.
    x0, v0 : float
        Of the mass where the replay begins: m, m/s.
    damping : WeakDamping, optional
        Of the oscillator, beside c1.
    states : sequence of Begun
        How the record begins, where it shows it.
    still : bool
        Whether the record shows no impact.
    """
    from vinesexp.solver.simulation import simulate

    w0 = 2.0 * math.pi * rig.oscillator.f0
    found = []
    for name, (place, speed) in _starts(rig, drive, still).items():
        # Two balls start apart, so that they do not move as one.
        signs = [(-1) ** i for i in range(len(rig.nes))]
        start = Release(
            x0,
            v0,
            [x0 + sign * place * ball.b for sign, ball in zip(signs, rig.nes, strict=True)],
            [v0 + sign * speed * w0 * ball.b for sign, ball in zip(signs, rig.nes, strict=True)],
        )
        duration = drive.begins[-1] + drive.length
        motion = simulate(rig, drive.base, start, duration=duration, damping=damping)
        found += [Replayed(name, motion, begin, drive.length) for begin in drive.begins]
    if drive.sine is not None and len(rig.nes) == 1:
        found += _on_orbit(rig, plain, drive.sine, drive.length, damping)
    for state in states:
        start = _inside(state, rig)
        for base, length in _from_there(drive, state):
            motion = simulate(rig, base, start, duration=length, damping=damping)
            found.append(Replayed(AS_RECORDED, motion, 0.0, length, state.time))
    return found


def _from_there(drive: Drive, state: Begun) -> Iterator[tuple[Base | None, float]]:
    """The base from the moment of a state on, and how long it is known, s.

    Where no channel shows its phase, in phases all around. The state of a release or sweep is that
    of its beginning.
    """
    length, samples, sine = drive.length - state.time, drive.samples, drive.sine
    if samples is None and sine is None:
        yield drive.base, length
    if samples is None and sine is not None:
        for i in range(_PHASES):
            yield replace(sine, phase=2.0 * math.pi * i / _PHASES), length
    if samples is None:
        return
    since = state.time - samples.first
    if sine is not None:
        shown, _ = _sine_and_rest(samples, sine.frequency)
        turned = 2.0 * math.pi * sine.frequency * since
        yield replace(sine, phase=shown.phase + turned), length
    else:
        moved = Measured(samples.x[max(round(since * samples.rate), 0) :], samples.rate)
        yield moved, min(length, moved.duration)


def _inside(state: Begun, rig: Rig) -> Release:
    """A state with each ball within its cavity, as the clearances of this rig are."""
    y = [
        min(max(y, state.x - _INSIDE * ball.b), state.x + _INSIDE * ball.b)
        for y, ball in zip(state.y, rig.nes, strict=True)
    ]
    return Release(state.x, state.v, y, state.u)


def _starts(rig: Rig, drive: Drive, still: bool) -> Mapping[str, tuple[float, float]]:
    if not rig.nes:
        return {"released": (0.0, 0.0)}
    if drive.base is None:
        return RELEASE_STARTS
    starts = dict(BALL_STARTS)
    if still or any(ball.rubs for ball in rig.nes):
        starts |= AT_REST
    if len(drive.begins) == 1 and drive.begins[0] > 0.0:
        starts |= MORE_STARTS
    return starts


def _on_orbit(
    rig: Rig, plain: Rig, sine: Harmonic, length: float, damping: WeakDamping | None
) -> list[Replayed]:
    """A replay that starts on the stable orbit of two impacts per cycle, where there is one."""
    from vinesexp.solver.simulation import simulate
    from vinesexp.theory.floquet import symmetric_orbits

    oscillator, ball = plain.oscillator, plain.nes[0]
    try:
        orbits = symmetric_orbits(
            G=sine.amplitude, b=ball.b, M=oscillator.M, c1=oscillator.c1, k1=oscillator.k1,
            m=ball.m, r=ball.r, frequency=sine.frequency,
        )  # fmt: skip
    except AnalysisError:
        return []
    for orbit in orbits:
        if orbit.stable and orbit.admissible:
            y = orbit.x - min(ball.b, rig.nes[0].b)  # at the wall, and within the cavity
            state = Release(orbit.x, orbit.v_after, [y], [orbit.u])
            moved = Harmonic(sine.amplitude, sine.frequency, orbit.phase)
            motion = simulate(rig, moved, state, duration=length, damping=damping)
            return [Replayed(ON_ORBIT, motion, 0.0, length)]
    return []
