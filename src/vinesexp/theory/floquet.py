"""Stability of the exact symmetric orbit: analytic Jacobian of the half-period impact map.

The map takes (t, x, x', y') just after an impact to the same just after the next one, with the
signs of x, x', y' changed, so that the symmetric orbit is its fixed point (docs/theory.md, 38-41).
A multiplier +1 is the saddle-node, -1 the symmetry breaking (pitchfork of the full-period
orbit), a complex pair on the unit circle the Neimark-Sacker bifurcation. `symmetric_orbits` has
those of one rig in SI.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import BoolArray, ComplexArray, FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.rig import ABOVE_ZERO, checked
from vinesexp.theory.orbits import Family, Reduced, amplitudes_at, family, saddle_node


def jacobian(orbit: Family) -> FloatArray:
    """Jacobian of the half-period map in (t, x, x', y') on the orbit, shape (..., 4, 4).

    Its determinant is r^2 exp(-zeta w0 T), a property the tests hold it to (docs/theory.md, 41).

    Examples
    --------
    >>> J = jacobian(family(1.0, Reduced.of(eps=0.0068, zeta=0.0065, r=0.6)))
    >>> bool(abs(np.linalg.eigvals(J)).max() < 1)
    True
    """
    p = orbit.p
    half = np.pi / p.Omega
    x_e, v_e = orbit.phase.imag, p.Omega * orbit.phase.real
    force = x_e + 2.0 * p.zeta * v_e
    start = force - orbit.x - 2.0 * p.zeta * orbit.v_after  # acceleration after this impact
    end = -(force - orbit.x - 2.0 * p.zeta * orbit.v_before)  # before the next (all signs changed)
    v_end, u = -orbit.v_before, orbit.u
    Phi = p.half_turn
    shape = np.broadcast(orbit.C, half).shape
    # oscillator and ball at the fixed time of the next impact
    flow = np.zeros((*shape, 2, 4))
    flow[..., 0] = -(Phi @ np.stack([orbit.v_after, start], axis=-1)[..., None])[..., 0]
    flow[..., 1:3] = Phi
    ball = np.zeros((*shape, 4))
    ball[..., 0], ball[..., 1], ball[..., 3] = -u, 1.0, half
    # the impact moves in time so that x - y stays -b
    shift = -(flow[..., 0, :] - ball) / (v_end - u)[..., None]
    dx = flow[..., 0, :] + v_end[..., None] * shift
    dv = flow[..., 1, :] + end[..., None] * shift
    du = np.broadcast_to([0.0, 0.0, 0.0, 1.0], dv.shape)
    jump = ((1.0 + p.r) / (1.0 + p.eps))[..., None] * (dv - du)
    return np.stack([shift, -dx, -(dv - p.eps[..., None] * jump), -(du + jump)], axis=-2)


def hurwitz(J: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients of the mapped characteristic polynomial and its third Hurwitz determinant.

    With mu = (1 + s)/(1 - s) the unit disc becomes the left half plane. The polynomial is that of
    J - 1, so that multipliers close to 1 (small mass ratio) keep their digits.

    Returns
    -------
    B : ndarray, shape (5, ...)
        B_0 = p(+1) vanishes at a saddle-node, B_4 = p(-1) at symmetry breaking.
    H : ndarray
        B_1 B_2 B_3 - B_4 B_1^2 - B_3^2 B_0, zero at a Neimark-Sacker bifurcation.
    """
    K = J - np.eye(4)
    # Faddeev-LeVerrier: e_k of p(nu) = nu^4 + e_1 nu^3 + ... + e_4
    N = K
    e1 = -np.trace(N, axis1=-2, axis2=-1)
    N = K @ (N + e1[..., None, None] * np.eye(4))
    e2 = -np.trace(N, axis1=-2, axis2=-1) / 2.0
    N = K @ (N + e2[..., None, None] * np.eye(4))
    e3 = -np.trace(N, axis1=-2, axis2=-1) / 3.0
    e4 = np.linalg.det(K)
    B = np.stack(
        [
            e4,
            2.0 * e3 - 4.0 * e4,
            4.0 * e2 - 6.0 * e3 + 6.0 * e4,
            8.0 * e1 - 8.0 * e2 + 6.0 * e3 - 4.0 * e4,
            16.0 - 8.0 * e1 + 4.0 * e2 - 2.0 * e3 + e4,
        ]
    )
    return B, B[1] * B[2] * B[3] - B[4] * B[1] ** 2 - B[3] ** 2 * B[0]


def routh_stable(J: FloatArray) -> BoolArray:
    """Whether all four multipliers lie inside the unit circle (Routh-Hurwitz, no eigenvalues)."""
    B, H = hurwitz(J)
    stable: BoolArray = np.all(B > 0.0, axis=0) & (H > 0.0)
    return stable


def steady_samples(orbit: Family, *, samples: int = 65) -> tuple[FloatArray, FloatArray]:
    """Oscillator and ball over the half period after an impact, ends included, w0 = 1 and G = 1.

    Returns
    -------
    x, y : ndarray, shape (..., samples)
    """
    p = orbit.p
    t = np.linspace(0.0, 1.0, samples) * (np.pi / p.Omega)[..., None]
    wd = np.sqrt((1.0 - p.zeta) * (1.0 + p.zeta))[..., None]
    zeta, Omega = p.zeta[..., None], p.Omega[..., None]
    # steady part from the transfer function, free part from what the impact left over
    gap = 1.0 - Omega**2 + 2j * zeta * Omega
    near = np.abs(gap) < 1e-7  # undamped resonance has no steady part: off by a hair (error 1e-7 t)
    gap = np.where(near, 1e-7, gap)
    steady = (1.0 + 2j * zeta * Omega) / gap * orbit.phase[..., None]
    h0 = orbit.x[..., None] - steady.imag
    hv = orbit.v_after[..., None] - Omega * steady.real
    decay = np.exp(-zeta * t)
    free = decay * (h0 * np.cos(wd * t) + (hv + zeta * h0) * np.sin(wd * t) / wd)
    x = (steady * np.exp(1j * Omega * t)).imag + free
    return x, (orbit.x - orbit.b)[..., None] + orbit.u[..., None] * t


def swing_of(orbit: Family) -> FloatArray:
    """Largest |x| on an orbit, w0 = 1 and G = 1, which is what the amplitude of a record is.

    Of 201 samples over half a period the largest misses the top by less than
    (pi/400)^2/2 = 3e-5 of the amplitude.
    """
    return np.asarray(np.abs(steady_samples(orbit, samples=201)[0]).max(axis=-1))


def stays_inside(orbit: Family) -> BoolArray:
    """Whether the ball keeps inside its cavity between impacts, so that the orbit is a motion.

    |x - y| < b is looked at on 65 instants of the half period; a graze between two of them
    by less than (pi/65)^2/8 of the amplitude passes.
    """
    x, y = steady_samples(orbit)
    inside = np.abs(x - y)[..., 1:-1] < orbit.b[..., None] * (1.0 + 1e-9)
    return np.asarray(inside.all(axis=-1))


@dataclass(frozen=True)
class SymmetricOrbit:
    """One symmetric orbit of a rig, in SI.

    Attributes
    ----------
    C : ball amplitude in clearances.
    x, v_before, v_after : oscillator at the impact on the side x - y = +b; m, m/s.
    u : ball speed, m/s.  phase : of the base at that impact, rad.
    amplitude : hypot(x, v_after/w0), m.
    multipliers : the four Floquet multipliers of the half-period map.
    stable, admissible : multipliers inside the unit circle; ball inside its cavity throughout.
    """

    C: float
    x: float
    v_before: float
    v_after: float
    u: float
    phase: float
    amplitude: float
    multipliers: ComplexArray
    stable: bool
    admissible: bool


def symmetric_orbits(
    *, G: float, b: float, frequency: float | None = None, **rig: float
) -> list[SymmetricOrbit]:
    """The symmetric orbits of a rig, larger ball speed first (none, one or two).

    Parameters
    ----------
    G, b : float
        Base amplitude and clearance, m, both > 0.
    frequency : float, optional
        Hz; the oscillator's own frequency where None.
    **rig : float
        M, c1, k1, m and r, SI.

    Raises
    ------
    AnalysisError
        No symmetric orbit at this clearance and frequency; the message says up to which b.

    Examples
    --------
    >>> rig = dict(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6)
    >>> best, other = symmetric_orbits(G=0.25e-3, b=0.033, **rig)
    >>> round(1e3 * best.amplitude, 3), best.stable, other.stable
    (5.128, True, False)
    """
    base = float(checked(G, "base amplitude G", "m", ABOVE_ZERO))
    clearance = float(checked(b, "clearance b", "m", ABOVE_ZERO))
    p = Reduced.of_rig(frequency=frequency, **rig)
    found = [float(C) for C in reversed(amplitudes_at(clearance / base, p)) if not np.isnan(C)]
    if not found:
        limit = 1e3 * base * float(saddle_node(p)[1])
        raise AnalysisError(
            f"no symmetric orbit with two impacts per cycle at b = {1e3 * clearance:.6g} mm; "
            f"at this base amplitude and frequency they end at b = {limit:.6g} mm"
        )
    w0 = float(np.sqrt(rig["k1"] / rig["M"]))
    orbits = []
    for C in found:
        point = family(C, p)
        J = jacobian(point)
        orbits.append(
            SymmetricOrbit(
                C=C,
                x=base * float(point.x),
                v_before=base * w0 * float(point.v_before),
                v_after=base * w0 * float(point.v_after),
                u=base * w0 * float(point.u),
                phase=float(np.angle(point.phase)),
                amplitude=base * float(point.amplitude),
                multipliers=np.linalg.eigvals(J).astype(np.complex128),
                stable=bool(routh_stable(J)),
                admissible=bool(stays_inside(point)),
            )
        )
    return orbits
