"""Where two impacts per cycle end of a ball that no formula covers, by simulating one cycle.

Friction, a floor that slopes, walls that differ, a restitution that depends on speed, a contact
that lasts, a nonlinear spring or damper: the motion over one cycle of the base is simulated
exactly. The orbit is what this map repeats, and it is stable while all eigenvalues of the map's
derivative are inside the unit circle (docs/theory.md, 59). Of a plain rig its end is `b_c_exact`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.excitation import Harmonic, Release, WeakDamping
from vinesexp.rig import NES, Rig
from vinesexp.solver.motion import Motion
from vinesexp.solver.simulation import simulate
from vinesexp.theory.floquet import SymmetricOrbit, symmetric_orbits
from vinesexp.theory.optimal_clearance import b_c_exact

_BEGIN = (0.97, 0.85, 0.7)  # of the end without effects: where the orbit is first looked for
_STEP = 0.01  # of the clearance, until the end lies between two
_REACH = 2.0  # times farther, either way, than the end without effects: no search goes beyond
_DIFFERENCE = 1e-6  # of the motion's size: rounding and curvature both leave 1e-6 of a derivative
_NEWTON, _CLOSED = 12, 1e-7  # steps; of the motion's size
_END = 1e-5  # of the clearance
_SMALLEST = 1.0 / 16.0  # of the effects that are added at once


@dataclass(frozen=True)
class _Cycle:
    """One cycle of the base, from a quarter after an impact of the plain orbit."""

    rig: Rig
    base: Harmonic
    damping: WeakDamping
    scale: FloatArray  # of x, v, y and its velocity

    def with_ball(self, ball: NES) -> _Cycle:
        return replace(self, rig=replace(self.rig, nes=[ball]))

    def after(self, state: FloatArray) -> FloatArray:
        """x, v, y and its velocity a cycle later; of a motion with one impact at each wall."""
        x, v, y, u = map(float, state)
        period = 1.0 / self.base.frequency
        start = Release(x, v, (y,), (u,))
        try:
            motion = simulate(self.rig, self.base, start, duration=period, damping=self.damping)
        except ParameterError:  # a step of the search beyond the walls
            raise AnalysisError("the ball leaves its cavity") from None
        if sorted(motion.impacts["side"]) != [-1, 1]:
            raise AnalysisError("there is no motion with two impacts per cycle")
        return _state(motion, period)

    def orbit(self, state: FloatArray) -> tuple[FloatArray, float]:
        """The state that a cycle repeats, and the logarithm of its largest multiplier.

        Raises
        ------
        AnalysisError
            There is none near this state.
        """
        for _ in range(_NEWTON):
            J = np.empty((4, 4))
            for i, size in enumerate(_DIFFERENCE * self.scale):
                step = np.zeros(4)
                step[i] = size
                J[:, i] = (self.after(state + step) - self.after(state - step)) / (2.0 * size)
            change = np.linalg.solve(np.eye(4) - J, self.after(state) - state)
            state = state + change
            if np.max(np.abs(change) / self.scale) < _CLOSED:
                return state, math.log(np.abs(np.linalg.eigvals(J)).max())
        raise AnalysisError("no motion that repeats after a cycle was found")


def _state(motion: Motion, time: float) -> FloatArray:
    """x, v, y and its velocity of a motion with one ball."""
    return np.concatenate([*motion.at([time]), *(row[0] for row in motion.ball([time]))])


def simulated_end(
    rig: Rig, *, G: float, frequency: float, damping: WeakDamping | None = None
) -> float:
    """Largest clearance at which two impacts per cycle of a rig with one ball are stable, m.

    By the simulation of one cycle (docs/theory.md, 59).

    Parameters
    ----------
    rig : Rig
        One ball, with what it has beyond a plain one; its clearance is not used.
    G : float
        Base amplitude, m, > 0.
    frequency : float
        Of the base, Hz.
    damping : WeakDamping, optional
        Of the oscillator, beyond c1.

    Raises
    ------
    AnalysisError
        The plain rig has no such orbit, or it cannot be followed to the ball as it is.

    Examples
    --------
    >>> from vinesexp import NES, Oscillator, Rig
    >>> oscillator = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
    >>> for friction in (0.0, 0.3):
    ...     rig = Rig(oscillator, nes=[NES(m=0.032, b=0.03, r=0.6, friction=friction)])
    ...     print(round(1e3 * simulated_end(rig, G=0.25e-3, frequency=7.862), 2))
    33.92
    33.6
    """
    for share in _BEGIN:
        try:
            return _end_from(share, rig, G, frequency, damping or WeakDamping())
        except AnalysisError as found:
            why = found
    raise why


def _end_from(share: float, rig: Rig, G: float, frequency: float, damping: WeakDamping) -> float:
    """By the orbit at a share of the clearance at which that of a plain ball ends."""
    one, (wanted,) = rig.oscillator, rig.nes
    values = {"G": G, "frequency": frequency, "M": one.M, "c1": one.c1, "k1": one.k1, "m": wanted.m}
    speed = 0.0
    for _ in range(2):  # r at the speed of the orbit that it gives
        r = 0.5 * (wanted.restitution(1, speed) + wanted.restitution(-1, speed))
        b = share * float(b_c_exact(r=r, **values))
        orbit = symmetric_orbits(b=b, r=r, **values)[0]
        speed = orbit.v_before + orbit.u
    cycle, state = _quarter_after_impact(
        rig, NES(wanted.m, b, r), orbit, G=G, frequency=frequency, damping=damping
    )
    state, rate = _with_effects(cycle, wanted, state)
    return _end(cycle, wanted, state, rate, b)


def _quarter_after_impact(
    rig: Rig, ball: NES, orbit: SymmetricOrbit, *, G: float, frequency: float, damping: WeakDamping
) -> tuple[_Cycle, FloatArray]:
    """The plain rig between two impacts of its orbit, far from both walls."""
    base = Harmonic(G, frequency, orbit.phase)
    plain = replace(rig, nes=[ball], oscillator=replace(rig.oscillator, k3=0.0))
    start = Release(orbit.x, orbit.v_after, (orbit.x - ball.b,), (orbit.u,))
    quarter = 0.25 / frequency
    motion = simulate(plain, base, start, duration=quarter)
    state = _state(motion, quarter)
    w = 2.0 * math.pi * frequency
    scale = orbit.amplitude * np.array([1.0, w, 1.0, w])
    later = Harmonic(G, frequency, orbit.phase + 0.5 * math.pi)
    return _Cycle(replace(rig, nes=[ball]), later, damping, scale), state


def _with_effects(cycle: _Cycle, wanted: NES, state: FloatArray) -> tuple[FloatArray, float]:
    """The orbit of the ball as it is, its effects added in steps; and its rate."""
    plain, share, step, rate = cycle.rig.nes[0], 0.0, 1.0, 0.0
    while share < 1.0:
        ball = _between(plain, wanted, share + step)
        try:
            state, rate = cycle.with_ball(ball).orbit(state)
        except (AnalysisError, np.linalg.LinAlgError):
            step *= 0.5
            if step < _SMALLEST:
                raise AnalysisError("two impacts per cycle end as effects are added") from None
        else:
            share += step
    return state, rate


def _between(plain: NES, wanted: NES, share: float) -> NES:
    """A ball with a share of the effects."""

    def at(side: int) -> float:
        return (1.0 - share) * plain.r + share * wanted.restitution(side)

    return NES(
        m=plain.m, b=plain.b, r=at(1), r_minus=at(-1), r_slope=share * wanted.r_slope,
        friction=share * wanted.friction, tilt=share * wanted.tilt,
        contact_time=share * wanted.contact_time,
    )  # fmt: skip


def _end(cycle: _Cycle, wanted: NES, state: FloatArray, rate: float, b: float) -> float:
    """Clearance at which the largest multiplier is 1, from a state at clearance b on."""
    ball = _between(cycle.rig.nes[0], wanted, 1.0)
    near = state

    def at(clearance: float) -> float:
        nonlocal near
        try:
            near, found = cycle.with_ball(replace(ball, b=clearance)).orbit(near)
        except (AnalysisError, np.linalg.LinAlgError):
            return 1.0  # past a saddle-node: no orbit
        return found

    first, step = b, _STEP if rate < 0.0 else -_STEP
    while b / _REACH < first < b * _REACH:
        last = first * (1.0 + step)
        if (at(last) < 0.0) != (rate < 0.0):
            near = state
            return float(brentq(at, first, last, xtol=_END * b))
        state, first = near, last
    raise AnalysisError("two impacts per cycle do not end near the clearance of a plain ball")
