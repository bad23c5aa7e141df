"""The slow flow itself, its end of the permanent response and its amplitude: what is compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.rig import ABOVE_ZERO, Rig, checked
from vinesexp.theory.manifold import A_1, C_1, C_2, amplitude, loss_parameter
from vinesexp.theory.multiple import bands, base_amplitude_for
from vinesexp.theory.slowflow import forcing, threshold


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
    checked(G, "base amplitude G", "m", ABOVE_ZERO)
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
