"""The slow flow itself, its end of the permanent response and its amplitude: what is compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.rig import Rig, checked
from vinesexp.theory.manifold import A_1, C_1, C_2, amplitude, loss_parameter
from vinesexp.theory.multiple import bands, base_amplitude_for
from vinesexp.theory.slowflow import threshold


def rates(
    C: ArrayLike, rho: ArrayLike, *, F: ArrayLike, sigma: ArrayLike, lam: ArrayLike, r: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """dA/dtau1 and drho/dtau1 at a point of the SIM (docs/theory.md, 17, 18).

    Parameters
    ----------
    C, rho : array_like
        Ball amplitude (names the branch, where A would not) and phase sigma tau1 - theta.
    F, sigma, lam, r : array_like
        Forcing G/(eps b), detuning (w/w0 - 1)/eps, damping, restitution.
    """
    ball = np.asarray(C, dtype=np.float64)
    A = amplitude(ball, r=r)
    loss = 8.0 * loss_parameter(r) * ball**2 / (np.pi**3 * A)
    dA = 0.5 * np.asarray(F) * np.sin(rho) - loss - 0.5 * np.asarray(lam) * A
    turning = 4.0 * ball * (1.0 - ball) / (np.pi * A) ** 2
    drho = np.asarray(sigma) + np.asarray(F) * np.cos(rho) / (2.0 * A) - turning
    return dA, drho


def is_stable(C: ArrayLike, *, r: ArrayLike) -> BoolArray:
    """Whether the SIM attracts at C: C_1 < C < C_2, and impacts take energy (docs/theory.md, 11).

    Both eigenvalues of the half-period impact map are inside the unit circle there.

    Examples
    --------
    >>> is_stable([0.9, 1.2, 1.7], r=0.6).tolist()
    [False, True, False]
    """
    ball = checked(C, "ball amplitude C", "a number above zero")
    return np.asarray((C_1(r) < ball) & (ball < C_2()) & (np.asarray(r) < 1.0))


def forcing(
    C: ArrayLike, *, sigma: ArrayLike, lam: ArrayLike, r: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """F and rho of the fixed point at C: the closed parametric form (docs/theory.md, 19)."""
    ball = checked(C, "ball amplitude C", "a number, zero or above")
    A = amplitude(ball, r=r)
    sine = np.asarray(lam) * A + 16.0 * loss_parameter(r) * ball**2 / (np.pi**3 * A)
    cosine = 8.0 * ball * (1.0 - ball) / (np.pi**2 * A) - 2.0 * np.asarray(sigma) * A
    return np.hypot(sine, cosine), np.arctan2(sine, cosine)


@dataclass(frozen=True)
class FixedPoint:
    """A fixed point of the slow flow: a periodic motion at order eps.

    Attributes
    ----------
    C, A, rho : ball and oscillator amplitude (in clearances) and phase.
    branch : "left" (below C_1), "stable" (T1 to T2) or "right" (past T2).
    stable : attracts both along the SIM and towards it.
    """

    C: float
    A: float
    rho: float
    branch: str
    stable: bool


def flow_jacobian(point_C: float, rho: float, *, F: float, lam: float, r: float) -> FloatArray:
    """2 x 2 Jacobian of (dA, drho) by (A, rho) on the right branch (docs/theory.md, 20).

    dC/dA = A/(S C/pi^2 - 1) is infinite at the fold, where the flow is not defined.
    """
    Gamma = float(loss_parameter(r))
    A = float(amplitude(point_C, r=r))
    slope = A / (point_C / float(C_1(r)) - 1.0)
    k = 8.0 * Gamma / np.pi**3
    dA_dA = -0.5 * lam - k * (2.0 * point_C * slope / A - point_C**2 / A**2)
    bend = 4.0 / np.pi**2 * ((1.0 - 2.0 * point_C) * slope - 2.0 * point_C * (1.0 - point_C) / A)
    drho_dA = -F * np.cos(rho) / (2.0 * A**2) - bend / A**2
    return np.array(
        [[dA_dA, 0.5 * F * np.cos(rho)], [drho_dA, -0.5 * F * np.sin(rho) / A]], dtype=np.float64
    )


def fixed_points(*, F: float, sigma: float, lam: float, r: float) -> list[FixedPoint]:
    """Every fixed point for a forcing and a detuning, smallest C first; an empty list where none.

    Parameters
    ----------
    F : float
        G/(eps b), >= 0.
    sigma, lam, r : float
        Detuning, damping, restitution.

    Examples
    --------
    >>> [(p.branch, round(p.C, 4), p.stable) for p in fixed_points(F=1.8, sigma=0, lam=1.91, r=0.6)]
    [('left', 0.0582, False), ('stable', 1.4338, True)]
    """
    checked(F, "forcing F", "a number, zero or above")
    checked(lam, "reduced damping lambda", "a number, zero or above")
    Gamma = float(loss_parameter(r))
    square = np.array([1.0 + 4.0 * Gamma**2 / np.pi**2, -2.0, 1.0])  # A^2 as polynomial in C
    sine = lam * square + np.array([16.0 * Gamma / np.pi**3, 0.0, 0.0])
    cosine = np.array([-8.0, 8.0, 0.0]) / np.pi**2 - 2.0 * sigma * square
    quartic = np.polyadd(np.polymul(sine, sine), np.polymul(cosine, cosine))
    quartic = np.polysub(quartic, F * F * square)
    scale = float(np.max(np.abs(quartic)))
    found = []
    for root in np.sort_complex(np.roots(quartic)):
        C = float(root.real)
        # a double root (saddle-node) leaves an imaginary part of sqrt(rounding)
        if C <= 0.0 or abs(root.imag) > 1e-7 * max(abs(root), 1e-3) or scale == 0.0:
            continue
        A = float(amplitude(C, r=r))
        if A < 1e-12:  # r = 1 at C = 1: the degenerate fold at A = 0
            continue
        rho = float(forcing(C, sigma=sigma, lam=lam, r=r)[1])
        found.append(_classified(C, A, rho, F=F, lam=lam, r=r))
    return found


def _classified(C: float, A: float, rho: float, *, F: float, lam: float, r: float) -> FixedPoint:
    if float(C_1(r)) >= C:
        return FixedPoint(C, A, rho, "left", False)
    along = flow_jacobian(C, rho, F=F, lam=lam, r=r)
    inward = bool(np.trace(along) < 0.0 and np.linalg.det(along) > 0.0)
    towards = bool(is_stable(C, r=r))
    return FixedPoint(C, A, rho, "stable" if towards else "right", inward and towards)


def fold_forcing(*, lam: ArrayLike, r: ArrayLike, sigma: ArrayLike = 0.0) -> FloatArray:
    """Forcing that puts a fixed point exactly on the fold T1 (docs/theory.md, 23).

    hypot(F_c, 16 Gamma/S^(3/2) - 2 sigma A_1): never below F_c, equal to it at one detuning only.
    G/(eps fold_forcing) is where the stable fixed point reaches the fold, which is the limit of the
    exact Neimark-Sacker clearance for a vanishing mass ratio; G/(eps F_c) is not.

    Examples
    --------
    >>> round(float(fold_forcing(lam=1.910, r=0.6) / threshold(lam=1.910, r=0.6)), 5)
    1.00659
    """
    Gamma = loss_parameter(r)
    S = np.pi**2 + 4.0 * Gamma**2
    turning = 16.0 * Gamma / (S * np.sqrt(S)) - 2.0 * np.asarray(sigma) * A_1(r)
    return np.hypot(threshold(lam=lam, r=r), turning)


@dataclass(frozen=True)
class SlowEnd:
    """Where permanent two impacts per cycle end as the forcing falls (slow flow).

    Attributes
    ----------
    F : least forcing with a stable fixed point.
    C : ball amplitude there.
    kind : "fold" (the fixed point reaches T1) or "saddle-node" (it merges before).
    """

    F: float
    C: float
    kind: str


def slow_end(*, lam: float, r: float, sigma: float = 0.0) -> SlowEnd:
    """Least forcing with a stable fixed point: slow-flow counterpart of the exact boundary.

    G/(eps F) is the slow-flow b_c. Near resonance the end is `fold_forcing`; far above it, or below
    it with little damping, the fixed points merge before the fold (docs/theory.md, 23).

    Raises
    ------
    AnalysisError
        No fixed point between T1 and T2 is stable at any forcing.

    Examples
    --------
    >>> end = slow_end(lam=1.91, r=0.6)
    >>> round(end.F, 4), end.kind
    (1.088, 'fold')
    """
    first, last = float(C_1(r)), float(C_2())
    C = first + (last - first) * np.linspace(0.0, 1.0, 1002)[1:-1] ** 2
    C = np.concatenate([[first * (1.0 + 1e-9)], C])
    F, _ = forcing(C, sigma=sigma, lam=lam, r=r)
    # on this branch the trace of (20) is negative and its determinant has the sign of dF/dC
    stable = np.gradient(F, C) > 0.0
    if not stable.any():
        raise AnalysisError(
            f"no stable fixed point at any forcing (lambda = {lam:.6g}, r = {r:.6g}, "
            f"sigma = {sigma:.6g})"
        )
    i = int(np.where(stable, F, np.inf).argmin())
    return SlowEnd(F=float(F[i]), C=float(C[i]), kind="fold" if i == 0 else "saddle-node")


def response_amplitude(
    G: float, rig: Rig, *, frequency: float | None = None, points: int = 4001
) -> float:
    """Smallest amplitude (m) that balances base motion G with the balls active above their fold.

    Past the fold of a ball the balance jumps: an amplitude at a jump means that ball comes and
    goes there (strongly modulated response around its fold), and the fold is returned.

    Raises
    ------
    AnalysisError
        No balance below ten times the largest band (no damping at all).
    """
    checked(G, "base amplitude G", "m, above zero")
    spread = bands(rig.nes)
    top = 10.0 * max((one.high for one in spread), default=1.0)
    bare = G / (2.0 * rig.oscillator.zeta) if rig.oscillator.zeta > 0.0 else top
    top = max(top, 1.1 * bare)
    x = np.geomspace(1e-6 * top, top, points)
    x = np.sort(np.concatenate([x, *([one.low * (1.0 - 1e-9), one.low] for one in spread)]))
    carried = base_amplitude_for(x, rig, frequency=frequency)
    above = carried >= G
    if not above.any():
        raise AnalysisError(f"no amplitude below {1e3 * top:.6g} mm carries G = {1e3 * G:.6g} mm")
    i = int(above.argmax())
    if i == 0:
        return float(x[0])
    low, high = carried[i - 1], carried[i]
    return float(x[i - 1] + (x[i] - x[i - 1]) * (G - low) / (high - low))
