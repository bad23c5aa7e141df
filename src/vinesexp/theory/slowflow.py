"""The slow flow on the SIM: fixed points and their stability, threshold F_c.

Amplitude A and phase rho follow docs/theory.md (17, 18), the paper's (23) with its slip corrected
(lambda A/2, not lambda C/2). Fixed points for a given F and sigma are the roots of a quartic in
C, so all of them are found. Units: lengths in clearances b, time tau1 = eps w0 t.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.rig import ZERO_OR_ABOVE, checked
from vinesexp.theory.manifold import C_1, amplitude, is_stable, loss_parameter


def threshold(*, lam: ArrayLike, r: ArrayLike) -> FloatArray:
    """F_c, the least forcing with a folded singularity, whatever the detuning (docs/theory.md, 22).

    2 (Gamma lambda S + 4 pi)/S^(3/2), the paper's (34). Below it every motion that reaches the
    fold leaves the SIM there: strongly modulated response.

    Examples
    --------
    >>> round(float(threshold(lam=1.910, r=0.6)), 5)
    1.08093
    """
    damping = checked(lam, "reduced damping lambda", "", ZERO_OR_ABOVE)
    Gamma = loss_parameter(r)
    S = np.pi**2 + 4.0 * Gamma**2
    F_c: FloatArray = 2.0 * (Gamma * damping * S + 4.0 * np.pi) / (S * np.sqrt(S))
    return F_c


def forcing(
    C: ArrayLike, *, sigma: ArrayLike, lam: ArrayLike, r: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """F and rho of the fixed point at C: the closed parametric form (docs/theory.md, 19)."""
    ball = checked(C, "ball amplitude C", "", ZERO_OR_ABOVE)
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
    checked(F, "forcing F", "", ZERO_OR_ABOVE)
    checked(lam, "reduced damping lambda", "", ZERO_OR_ABOVE)
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
