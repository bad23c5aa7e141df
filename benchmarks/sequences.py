"""Periodic orbits with any sequence of impacts: asymmetric ones past T2, three and more per cycle.

A sequence is the list of walls met in one period, such as (+1, -1) or (+1, +1, -1). Newton's method
closes it; the Floquet multipliers are those of the product of the analytic impact-to-impact
Jacobians (docs/theory.md, 55, 56). One impact a cycle has no orbit but the graze: a free ball that
comes back to the same wall a period later does not move at all.

Units: w0 = 1 and G = 1, as in `vinesexp.theory.orbits`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.theory.boundaries import end_of_permanent_response
from vinesexp.theory.floquet import jacobian
from vinesexp.theory.manifold import FloatArray
from vinesexp.theory.orbits import Reduced, amplitudes_at, family, transition

_TOLERANCE = 1e-11  # residual relative to the clearance: rounding times the condition of Newton


@dataclass(frozen=True)
class SequenceOrbit:
    """A closed sequence of impacts.

    Attributes
    ----------
    sides : walls met, one period.
    flights : times between impacts, shape (k,).
    states : (phase, x, x', y') just after each impact, shape (k, 4).
    multipliers : Floquet multipliers over the whole period.
    cycles : forcing periods that the sequence takes.
    """

    sides: tuple[int, ...]
    flights: FloatArray
    states: FloatArray
    multipliers: NDArray[np.complex128]
    cycles: int

    @property
    def stable(self) -> bool:
        """All multipliers inside the unit circle."""
        return bool(np.all(np.abs(self.multipliers) < 1.0))

    @property
    def asymmetry(self) -> float:
        """Largest departure of a flight from the mean one, over the mean one."""
        mean = float(self.flights.mean())
        return float(np.max(np.abs(self.flights - mean))) / mean


def free_flight(z: FloatArray, tau: float, p: Reduced) -> tuple[float, float]:
    """Oscillator x, x' after a free flight, exact also at an undamped resonance."""
    zeta, Omega = float(p.zeta), float(p.Omega)
    wd = np.sqrt((1.0 - zeta) * (1.0 + zeta))
    pole = -zeta + 1j * wd
    phase, x, v = z[0], z[1], z[2]
    decay = np.exp(pole * tau)
    near = (pole - 1j * Omega) * tau
    ratio = np.expm1(near) / near if abs(near) > 1e-8 else 1.0 + 0.5 * near
    g = (1.0 + 2j * zeta * Omega) * np.exp(1j * phase)
    driven = g * np.exp(1j * Omega * tau) * tau * ratio
    driven += np.conj(g) * (np.exp(-1j * Omega * tau) - decay) / (1j * Omega + pole)
    s = decay * (v + zeta * x + 1j * wd * x) + driven / 2j
    x_end = float(s.imag) / wd
    return x_end, float(s.real) - zeta * x_end


def _step(
    z: FloatArray, tau: float, side: int, following: int, b: float, p: Reduced
) -> tuple[FloatArray, float]:
    """State just after the next impact, and how far from that wall the ball is (0 on an orbit)."""
    x, v = free_flight(z, tau, p)
    y = z[1] - side * b + z[3] * tau
    eps, r = float(p.eps), float(p.r)
    jump = (1.0 + r) / (1.0 + eps) * (v - z[3])
    after = np.array([z[0] + float(p.Omega) * tau, x, v - eps * jump, z[3] + jump])
    return after, float(x - y - following * b)


def _step_jacobian(z: FloatArray, tau: float, p: Reduced) -> FloatArray:
    """d(t, x, x', y') after the next impact by the same after this one, shape (4, 4)."""
    eps, r, zeta, Omega = (float(q) for q in (p.eps, p.r, p.zeta, p.Omega))
    x1, v1 = free_flight(z, tau, p)

    def force(phase: float) -> float:
        return float(np.sin(phase) + 2.0 * zeta * Omega * np.cos(phase))

    start = force(z[0]) - z[1] - 2.0 * zeta * z[2]
    end = force(z[0] + Omega * tau) - x1 - 2.0 * zeta * v1
    Phi = transition(np.asarray(zeta), np.asarray(tau))
    flow = np.zeros((2, 4))
    flow[:, 0] = -Phi @ np.array([z[2], start])
    flow[:, 1:3] = Phi
    ball = np.array([-z[3], 1.0, 0.0, tau])
    shift = -(flow[0] - ball) / (v1 - z[3])
    dx, dv = flow[0] + v1 * shift, flow[1] + end * shift
    du = np.array([0.0, 0.0, 0.0, 1.0])
    jump = (1.0 + r) / (1.0 + eps) * (dv - du)
    return np.stack([shift, dx, dv - eps * jump, du + jump])


def close_sequence(
    *,
    sides: Sequence[int],
    flights: ArrayLike,
    state: ArrayLike,
    b: float,
    p: Reduced,
    cycles: int = 1,
    iterations: int = 40,
) -> SequenceOrbit:
    """Close a sequence of impacts by Newton's method from a guess.

    Parameters
    ----------
    sides : sequence of +1 and -1
        Walls met in one period.
    flights : array_like, shape (k,)
        Guess of the times between impacts (w0 = 1).
    state : array_like, shape (4,)
        Guess of (phase, x, x', y') just after the first impact (w0 = 1, G = 1).
    b : float
        Clearance in units of G.
    p : Reduced
        One rig (arrays of shape ()).
    cycles : int
        Forcing periods.

    Raises
    ------
    AnalysisError
        Newton's method does not close the sequence, or closes it with an impossible flight.
    """
    walls = tuple(int(s) for s in sides)
    if len(walls) < 2 or any(s not in (-1, 1) for s in walls):
        raise ParameterError(f"impact sequence {walls}: expected two or more of +1 and -1")
    k = len(walls)
    period = 2.0 * np.pi * cycles / float(p.Omega)

    def residual(q: FloatArray) -> FloatArray:
        z, gap = q[:4], np.empty(k)
        for i in range(k):
            z, gap[i] = _step(z, q[4 + i], walls[i], walls[(i + 1) % k], b, p)
        return np.concatenate([gap, z[1:] - q[1:4], [q[4:].sum() - period]])

    q = np.concatenate([np.asarray(state, dtype=np.float64), np.asarray(flights, np.float64)])
    scale = np.array([1.0, b, b, b, *np.ones(k)])
    error = np.inf
    for _ in range(iterations):
        value = residual(q)
        error = float(np.max(np.abs(value))) / b
        if error < _TOLERANCE:
            break
        slope = np.empty((k + 4, k + 4))
        for j in range(k + 4):
            h = 1e-6 * scale[j]
            e = np.eye(k + 4)[j] * h
            slope[:, j] = (residual(q + e) - residual(q - e)) / (2.0 * h)
        move = np.linalg.lstsq(slope, value, rcond=None)[0]
        q = q - move * min(1.0, 0.3 / max(float(np.max(np.abs(move / scale))), 1e-300))
    if not error < _TOLERANCE or np.any(q[4:] <= 0.0):
        raise AnalysisError(
            f"no orbit with the impact sequence {walls} found near the given start "
            f"(residual {error:.2g} of the clearance)"
        )
    return _closed(q, walls, b, p, cycles)


def _closed(
    q: FloatArray, walls: tuple[int, ...], b: float, p: Reduced, cycles: int
) -> SequenceOrbit:
    k = len(walls)
    states, total, z = [], np.eye(4), q[:4]
    for i in range(k):
        states.append(z)
        total = _step_jacobian(z, float(q[4 + i]), p) @ total
        z, _ = _step(z, float(q[4 + i]), walls[i], walls[(i + 1) % k], b, p)
    return SequenceOrbit(
        sides=walls,
        flights=q[4:],
        states=np.array(states),
        multipliers=np.linalg.eigvals(total).astype(np.complex128),
        cycles=cycles,
    )


def asymmetric_orbit(*, b: float, p: Reduced) -> SequenceOrbit:
    """The orbit with two unequal impacts per cycle that branches off at symmetry breaking.

    Started just below symmetry breaking from the symmetric orbit, pushed along the direction of its
    multiplier below -1, and followed down to `b` in steps that shrink where Newton's method fails.

    Parameters
    ----------
    b : float
        Clearance in units of G, below that of symmetry breaking.
    p : Reduced
        One rig.

    Raises
    ------
    AnalysisError
        No such branch: symmetry is not broken at this clearance; the symmetric orbit ends
        otherwise (a graze, a Neimark-Sacker bifurcation); the branch leaves towards larger
        clearances and is unstable (a subcritical breaking); or it ends above `b`.
    """
    ends = end_of_permanent_response(p)
    breaking = float(ends.b_low)
    if str(ends.kind_low) != "symmetry breaking":
        raise AnalysisError(
            f"two symmetric impacts end by a {ends.kind_low} at b = {breaking:.6g} base "
            "amplitudes, not by symmetry breaking: no asymmetric orbit branches off"
        )
    if not 0.0 < b < breaking:
        raise AnalysisError(
            f"two symmetric impacts have not lost their symmetry at b = {b:.6g} base amplitudes; "
            f"they do below {breaking:.6g}"
        )
    at = max(b, breaking * (1.0 - 2e-3))
    orbit = _first_asymmetric(at, p)
    if orbit is None:
        if _first_asymmetric(breaking * (1.0 + 2e-3), p) is not None:
            raise AnalysisError(
                f"symmetry breaks subcritically at b = {breaking:.6g} base amplitudes: the "
                "asymmetric orbits lie above it and are unstable"
            )
        raise AnalysisError(f"no asymmetric orbit found at b = {at:.6g} base amplitudes")
    step = 0.02 * breaking
    while at > b:
        following = max(at - step, b)
        try:
            orbit = close_sequence(
                sides=orbit.sides,
                flights=orbit.flights,
                state=orbit.states[0] * np.array([1.0, *np.full(3, following / at)]),
                b=following,
                p=p,
            )
        except AnalysisError:
            step *= 0.5
            if step < 1e-4 * breaking:
                raise AnalysisError(
                    f"the asymmetric orbit ends above b = {b:.6g} base amplitudes, near {at:.6g}"
                ) from None
            continue
        at = following
    return orbit


def _first_asymmetric(b: float, p: Reduced) -> SequenceOrbit | None:
    """Asymmetric orbit near symmetry breaking, from the symmetric one pushed out of symmetry."""
    point = family(amplitudes_at(b, p)[1], p)
    values, vectors = np.linalg.eig(jacobian(point))
    direction = np.real(vectors[:, int(np.argmin(values.real))])
    direction = direction / direction[0]
    half, Omega = float(np.pi / p.Omega), float(p.Omega)
    base = [float(np.angle(point.phase)), float(point.x), float(point.v_after), float(point.u)]
    for push in (0.005, 0.02, 0.05, 0.1, 0.2, 0.3):
        # this impact later by `push` and the next one earlier: two unequal flights
        guess = np.array(base) + push * direction * np.array([Omega, 1.0, 1.0, 1.0])
        flights = np.array([half - 2.0 * push, half + 2.0 * push])
        try:
            orbit = close_sequence(sides=(1, -1), flights=flights, state=guess, b=b, p=p)
        except AnalysisError:
            continue
        if orbit.asymmetry > 1e-5:
            return orbit
    return None
