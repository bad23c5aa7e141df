"""`Motion`: what a simulation found, known at every time between its events."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vinesexp.arrays import FloatArray
from vinesexp.errors import ParameterError
from vinesexp.excitation import Base, Release, WeakDamping
from vinesexp.rig import Rig
from vinesexp.solver.arrays import base_motion, drive_table, is_plain, parameters, scratch
from vinesexp.solver.effort import Effort
from vinesexp.solver.state import IMPACT, REST_END, REST_START, START, Records


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
        ``start``, ``end`` (s), ``nes``, ``side``: the spells in which a ball rests on a wall, or is
        held by friction somewhere between the walls (side 0). A spell that lasts to the
        end of the run ends at `duration`.
    """

    rig: Rig
    base_drive: Base | None
    duration: float
    damping: WeakDamping
    release: Release
    events: Records = field(repr=False)  # of `state.EVENT`

    @cached_property
    def impacts(self) -> dict[str, NDArray[np.float64] | NDArray[np.int64]]:
        """One entry per impact."""
        hit = self.events[self.events["kind"] == IMPACT]
        numbers = ("time", "x", "v_before", "v_after", "vy_before", "vy_after")
        found = {name: hit[name].astype(np.int64) for name in ("nes", "side")}
        return {name: hit[name].copy() for name in numbers} | found

    @cached_property
    def rests(self) -> dict[str, NDArray[np.float64] | NDArray[np.int64]]:
        """One entry per spell of rest, by start."""
        kind, nes, side, t = (self.events[name] for name in ("kind", "nes", "side", "time"))
        begins, ends = kind == REST_START, kind == REST_END
        spells: list[tuple[float, float, int, int]] = []
        for i in range(len(self.rig.nes)):
            starts, sides = t[begins & (nes == i)], side[begins & (nes == i)]
            until = np.append(t[ends & (nes == i)], self.duration)[: starts.size]
            spells += zip(starts, until, [i] * starts.size, sides, strict=True)
        start, end, ball, at = zip(*sorted(spells), strict=True) if spells else [()] * 4
        return {
            **{"start": np.array(start, dtype=np.float64), "end": np.array(end, dtype=np.float64)},
            **{"nes": np.array(ball, dtype=np.int64), "side": np.array(at, dtype=np.int64)},
        }

    def _evaluate(self, t: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        from vinesexp.solver.series import sample

        times = self._times(t)
        flat = times.ravel()
        order = None
        if flat.size > 1 and not bool(np.all(flat[1:] >= flat[:-1])):
            order = np.argsort(flat, kind="stable")
            flat = flat[order]
        out = np.empty((3, flat.size))
        kind, table = drive_table(self.base_drive)
        flat = np.ascontiguousarray(flat)
        par = parameters(self.rig, self.damping)
        effort = Effort(self.rig, self.base_drive, self.damping, self.duration)
        work = scratch(self.rig, self.base_drive, self.damping)
        weak = None if is_plain(self.rig, self.damping) else work[2]
        reached = sample(par, kind, table, self.events, flat, effort.pace, work, weak, *out)
        if reached < math.inf:
            raise effort.stalled(reached)
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

    def _repr_html_(self) -> str:
        """Shown at the end of a cell of a notebook: what moved, and the displacement as a curve."""
        hits = self.impacts["time"].size
        t = np.linspace(0.0, self.duration, 1200)
        x = self.at(t)[0]
        reach = float(np.abs(x).max()) or 1.0
        points = " ".join(f"{i / 2:.1f},{40 - 38 * v / reach:.1f}" for i, v in enumerate(x))
        return (
            f"<p>{self.duration:.5g} s, {hits} impacts, largest displacement {1e3 * reach:.4g} mm"
            '</p><svg width="600" height="80" role="img" aria-label="displacement over time">'
            f'<polyline points="{points}" fill="none" stroke="#0072B2" stroke-width="0.7"/></svg>'
            + self.rig._repr_html_()
        )

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
        x, v = self.at(times) if (self.events["kind"] == REST_START).any() else (times, times)
        for i in range(len(self.rig.nes)):
            rows = self.events[self.events["nes"] == i]
            kind, apart = rows["kind"], rows["apart"]
            # a start row holds y
            place = np.where(kind == START, rows["vy_before"], rows["x"] - apart)
            last = np.searchsorted(rows["time"], times, side="right") - 1
            since = times - rows["time"][last]
            a, u = rows["a"][last], rows["vy_after"][last]
            y[i] = place[last] + (u + 0.5 * a * since) * since
            vy[i] = u + a * since
            rests = kind[last] == REST_START
            y[i, rests] = x[rests] - apart[last][rests]
            vy[i, rests] = v[rests]
        return y, vy
