"""`simulate`: the exact motion of a rig, and `Motion`, which knows it at every time.

Nothing is integrated by steps that could be too long: between impacts the motion is known, and only
the impact times are searched for (`search.py` says why none can be missed).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.excitation import Base, Harmonic, Measured, Release, WeakDamping
from vinesexp.rig import Rig, require
from vinesexp.solver.drive import base_motion, drive_table

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

CHUNK = 4096  # rows of the log that are filled at a time


@dataclass(frozen=True)
class Motion:
    """The motion of a rig from t = 0 to `duration`, exact at every time in between.

    Attributes
    ----------
    impacts : dict of arrays
        ``time`` (s), ``nes`` (from 0), ``side`` (+1 where x - y = +b), ``x`` (m), ``v_before``,
        ``v_after``, ``vy_before``, ``vy_after`` (m/s), one entry per impact. Balls that hit at the
        same time have one entry each, in the order of their numbers, and hand the oscillator's
        velocity on: v_after - v_before of an entry is the impulse of its own ball over the mass of
        the oscillator (with the balls that rest on it), the first v_before and the last v_after are
        those of the instant. The impact law (3) holds between these two. The infinitely many
        impacts by which a chatter ends (all within 1e-8 of a radian) are not listed; a rest starts
        where they accumulate.
    rests : dict of arrays
        ``start``, ``end`` (s), ``nes``, ``side``: the spells in which a ball rests on a wall. A
        spell that lasts to the end of the run ends at `duration`.
    """

    rig: Rig
    base_drive: Base | None
    duration: float
    damping: WeakDamping
    release: Release
    events: FloatArray = field(repr=False)  # time, x, v_before, v_after, vy_before, vy_after
    labels: IntArray = field(repr=False)  # kind, nes, side

    @cached_property
    def impacts(self) -> dict[str, NDArray[np.float64] | NDArray[np.int64]]:
        """One entry per impact."""
        hit = np.flatnonzero(self.labels[:, 0] == 1)
        columns, labels = self.events.T.take(hit, axis=1), self.labels.T.take(hit, axis=1)
        names = ("x", "v_before", "v_after", "vy_before", "vy_after")
        return {
            "time": columns[0],
            "nes": labels[1],
            "side": labels[2],
            **dict(zip(names, columns[1:], strict=True)),
        }

    @cached_property
    def rests(self) -> dict[str, NDArray[np.float64] | NDArray[np.int64]]:
        """One entry per spell of rest, by start."""
        spells: list[tuple[float, float, int, int]] = []
        for i in range(len(self.rig.nes)):
            mine = self.labels[:, 1] == i
            begin = mine & (self.labels[:, 0] == 2)
            end = self.events[mine & (self.labels[:, 0] == 3), 0].tolist()
            starts = self.events[begin, 0].tolist()
            end += [self.duration] * (len(starts) - len(end))
            sides = self.labels[begin, 2].tolist()
            spells += [(s, e, i, side) for s, e, side in zip(starts, end, sides, strict=True)]
        spells.sort()
        columns = list(zip(*spells, strict=True)) or [(), (), (), ()]
        return {
            "start": np.array(columns[0], dtype=np.float64),
            "end": np.array(columns[1], dtype=np.float64),
            "nes": np.array(columns[2], dtype=np.int64),
            "side": np.array(columns[3], dtype=np.int64),
        }

    @cached_property
    def _nodes(self) -> FloatArray:
        """After each event: time, x, v, mass that moves with the oscillator."""
        m = np.array([nes.m for nes in self.rig.nes] + [0.0])
        kind, nes = self.labels[:, 0], self.labels[:, 1]
        change = np.where(kind == 2, m[nes], 0.0) - np.where(kind == 3, m[nes], 0.0)
        mass = self.rig.oscillator.M + np.cumsum(change)
        # Rests come and go in full, so the sum is exact up to rounding; none resting is M itself.
        resting = np.cumsum((kind == 2).astype(np.int64) - (kind == 3))
        mass[resting == 0] = self.rig.oscillator.M
        return np.column_stack([self.events[:, 0], self.events[:, 1], self.events[:, 3], mass])

    def _evaluate(self, t: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        from vinesexp.solver.events import sample

        times = self._times(t)
        flat = times.ravel()
        order = None
        if flat.size > 1 and not bool(np.all(flat[1:] >= flat[:-1])):
            order = np.argsort(flat, kind="stable")
            flat = flat[order]
        out = np.empty((3, flat.size))
        kind, table = drive_table(self.base_drive)
        flat = np.ascontiguousarray(flat)
        sample(parameters(self.rig, self.damping), kind, table, self._nodes, flat, *out)
        if order is not None:
            back = np.empty_like(out)
            back[:, order] = out
            out = back
        x, v, a = (column.reshape(times.shape) for column in out)
        return x, v, a

    def _times(self, t: ArrayLike) -> FloatArray:
        times = np.asarray(t, dtype=np.float64)
        if times.size and not (times.min() >= 0.0 and times.max() <= self.duration):
            wrong = times[~((times >= 0.0) & (times <= self.duration))].flat[0]
            raise ParameterError(f"t = {wrong}: expected times from 0 to {self.duration} s")
        return times

    def at(self, t: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """x (m) and x' (m/s) of the oscillator at times t (s); at an impact: after it.

        Raises
        ------
        ParameterError
            A time outside [0, duration].
        """
        x, v, _ = self._evaluate(t)
        return x, v

    def acceleration(self, t: ArrayLike) -> FloatArray:
        """x'' (m/s^2) at times t (s), without the impacts' impulses."""
        return self._evaluate(t)[2]

    def base(self, t: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """x_e (m) and x_e' (m/s) at times t (s)."""
        return base_motion(self.base_drive, self._times(t))

    def ball(self, t: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """y (m) and y' (m/s) of every ball at times t (s); arrays of shape (n, len(t))."""
        times = np.atleast_1d(self._times(t))
        y, vy = np.empty((2, len(self.rig.nes), times.size))
        x, v = self.at(times) if (self.labels[:, 0] == 2).any() else (times, times)
        for i, nes in enumerate(self.rig.nes):
            mine = self.labels[:, 1] == i
            kind, side = self.labels[mine, 0], self.labels[mine, 2]
            rows = self.events[mine]
            at_wall = rows[:, 1] - side * nes.b
            place = np.where(kind == 0, rows[:, 4], at_wall)  # a start row holds y itself
            last = np.searchsorted(rows[:, 0], times, side="right") - 1
            y[i] = place[last] + rows[last, 5] * (times - rows[last, 0])
            vy[i] = rows[last, 5]
            rests = kind[last] == 2
            y[i, rests] = x[rests] - side[last][rests] * nes.b
            vy[i, rests] = v[rests]
        return y, vy


def parameters(rig: Rig, damping: WeakDamping) -> FloatArray:
    o = rig.oscillator
    return np.array([o.M, o.c1, o.k1, damping.quadratic, damping.coulomb])


def ball_table(rig: Rig, release: Release) -> tuple[FloatArray, FloatArray]:
    """Table of balls at the start (`contact.py`) and their places y0, refused where outside."""
    n = len(rig.nes)
    for name, values in (("y0", release.y0), ("vy0", release.vy0)):
        if values and len(values) != n:
            raise ParameterError(
                f"{name} has {len(values)} values, expected {n}: one per NES (or none at all)"
            )
    y0 = np.array(release.y0 or [release.x0] * n, dtype=np.float64)
    vy0 = np.array(release.vy0 or [0.0] * n, dtype=np.float64)
    table = np.zeros((n, 16))
    for i, nes in enumerate(rig.nes):
        w = release.x0 - y0[i]
        side = 1.0 if w >= 0.0 else -1.0
        gap = nes.b - abs(w)
        rounding = 4.0 * np.finfo(np.float64).eps * (abs(release.x0) + abs(y0[i]) + nes.b)
        if gap < -rounding:
            raise ParameterError(
                f"ball {i} starts at x - y = {w:.9g} m, outside its cavity: "
                f"expected at most the clearance b = {nes.b:.9g} m to either side"
            )
        # Within rounding of the wall means on it: 0.034 - 0.0 and b need not agree in the last bit.
        gap = 0.0 if gap <= rounding else gap
        table[i, :7] = nes.m, nes.b, nes.r, gap, side, release.v0 - vy0[i], 0.0
        table[i, 10] = vy0[i]
    return table, y0


def simulate(
    rig: Rig,
    base: Base | None = None,
    release: Release | None = None,
    duration: float = 0.0,
    *,
    damping: WeakDamping | None = None,
    remainder: float | None = None,
    general: bool = False,
) -> Motion:
    """Exact motion of a rig from its release: every impact, every rest, any time between.

    Parameters
    ----------
    rig : Rig
        Oscillator and its n >= 0 NESs.
    base : Harmonic, Sweep, SteppedSweep, Measured or None
        Motion of the base; None is a base at rest.
    release : Release, optional
        State at t = 0; by default everything at rest in the centre.
    duration : float
        s, > 0; within the record where the base is `Measured`.
    damping : WeakDamping, optional
        Quadratic and Coulomb damping of the oscillator, where a scene asks for it.
    remainder : float, optional
        Only for studies of convergence: what is left of a chatter (in radians of the system's
        fastest motion) when its geometric tail is summed; the default 1e-8 makes that exact to
        rounding.
    general : bool
        Use the power series even where there is a closed form: each is the test of the other.

    Raises
    ------
    ParameterError
        A ball that starts outside its cavity, a wrong number of starting values, a duration that
        is not positive or beyond the base record.
    AnalysisError
        Time comes to a stop: several balls, one of them elastic, on a wall that pushes them.

    Notes
    -----
    Equations (1)-(4) of docs/theory.md. No tolerance, no step.

    Examples
    --------
    >>> from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
    >>> rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.030, r=0.6)])
    >>> motion = simulate(rig, Harmonic(amplitude=0.25e-3, frequency=7.862),
    ...                   Release(y0=[0.0299]), duration=40.0)
    >>> x, v = motion.at([39.0, 39.5])
    >>> late = motion.impacts["time"] > 30.0
    >>> round(float(late.sum()) / (10.0 * 7.862), 1)   # two impacts per cycle
    2.0
    """
    release = release or Release()
    duration = float(duration)  # one compiled version serves all
    damping = damping or WeakDamping()
    require(math.isfinite(duration) and duration > 0, "duration", duration, "s, above zero")
    if isinstance(base, Measured) and duration > base.duration * (1.0 + 1e-12):
        raise ParameterError(
            f"duration = {duration}: the base record lasts {base.duration:.9g} s; "
            "shorten the run or give a longer record"
        )
    balls, y0 = ball_table(rig, release)
    events, labels = _run(rig, base, damping, release, duration, remainder, balls, y0, general)
    return Motion(rig, base, duration, damping, release, events, labels)


def _run(
    rig: Rig, base: Base | None, damping: WeakDamping, release: Release, duration: float,
    remainder: float | None, balls: FloatArray, y0: FloatArray, general: bool,
) -> tuple[FloatArray, IntArray]:  # fmt: skip
    """Run to the end in chunks of the log; all its rows, the start rows first."""
    from vinesexp.solver.chatter import REMAINDER
    from vinesexp.solver.kernel import run
    from vinesexp.solver.series import ORDER

    n = len(rig.nes)
    kind, table = drive_table(base)
    par = parameters(rig, damping)
    limit = REMAINDER if remainder is None else remainder
    response = None if general else closed_form(rig, base, damping)
    closed, work = response is not None, np.zeros((4, ORDER + 1))
    if response is None:
        response = np.ones((4, 9))
    state = np.array([0.0, 0.0, release.x0, release.v0])
    rows = max(n, 1)
    start, start_labels = np.zeros((rows, 6)), np.zeros((rows, 3), dtype=np.int32)
    start[:, 1], start[:, 2:4] = release.x0, release.v0
    start[:n, 4], start[:n, 5] = y0, balls[:, 10]
    start_labels[:, 1] = np.arange(rows)
    numbers, labels = [start], [start_labels]
    while state[0] < duration:
        size = CHUNK + 4 * n
        log, log_labels = np.empty((size, 6)), np.empty((size, 3), dtype=np.int32)
        count, used = run(
            closed, response, par, kind, table, duration, limit, state, balls, log, log_labels, work
        )
        if used < 0:
            raise AnalysisError(
                f"the motion comes to a stop at t = {state[0]:.9g} s: balls with r = 1 or close to "
                "it bounce faster than any clock can tell; give them a lower restitution"
            )
        numbers.append(log[:count])
        labels.append(log_labels[:count])
    return np.concatenate(numbers), np.concatenate(labels).astype(np.int64)


def closed_form(rig: Rig, base: Base | None, damping: WeakDamping) -> FloatArray | None:
    """Table of the closed form where there is a good one, else None: power series then.

    Not for weakly nonlinear damping, a base that is not harmonic, an oscillator near or beyond
    critical damping, or a resonance so sharp that the particular response would dwarf the motion.
    """
    from vinesexp.solver.response import prepare

    if not isinstance(base, Harmonic | None) or damping != WeakDamping():
        return None
    o = rig.oscillator
    amplitude, frequency, phase = 0.0, o.f0, 0.0
    if isinstance(base, Harmonic) and base.amplitude > 0.0:
        amplitude, frequency, phase = base.amplitude, base.frequency, base.phase
    w = 2.0 * math.pi * frequency
    gap = math.hypot((o.w0 - w) * (o.w0 + w), 2.0 * o.zeta * o.w0 * w)
    sharp = amplitude > 0.0 and gap < 1e-3 * o.w0 * o.w0
    if o.zeta > 0.9 or sharp or not 1e-2 < w / o.w0 < 1e2:
        return None
    table: FloatArray = prepare(o.M, o.c1, o.k1, amplitude, frequency, phase)
    return table
