"""b_c where the oscillator's damping depends on its amplitude.

The damping that counts is the one at the amplitude where the clearance acts, x = A_1 b_c, which
depends on b_c itself: the two are solved together (docs/theory.md, 44).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vinesexp.errors import AnalysisError
from vinesexp.theory.manifold import A_1
from vinesexp.theory.optimal_clearance import b_c_exact, b_c_published


@dataclass(frozen=True)
class DampedClearance:
    """b_c with the amplitude (m) and the damping c1 (N s/m) at which it acts."""

    b_c: float
    amplitude: float
    c1: float


def _solve(
    clearance: Callable[[float], float], c1_at: Callable[[float], float], fold: float
) -> DampedClearance:
    """Root of b = clearance(c1(fold b)): bracketed by 0 and the undamped clearance, bisected."""

    def c1_for(b: float) -> float:
        c1 = float(c1_at(fold * b))
        if not (np.isfinite(c1) and c1 >= 0.0):
            raise AnalysisError(
                f"damping at {1e3 * fold * b:.6g} mm is {c1:.6g} N s/m: "
                "expected a finite number, zero or above"
            )
        return c1

    low, high = 0.0, clearance(0.0)
    while high - low > 4.0 * np.spacing(high):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if middle < clearance(c1_for(middle)):
            low = middle
        else:
            high = middle
    b = 0.5 * (low + high)
    return DampedClearance(b_c=b, amplitude=fold * b, c1=c1_for(b))


def b_c_published_damped(
    *, G: float, M: float, k1: float, m: float, r: float, c1_at: Callable[[float], float]
) -> DampedClearance:
    """Published b_c with c1 taken at the amplitude A_1 b_c.

    Parameters
    ----------
    G : float
        Base amplitude, m.
    M, k1, m, r : float
        Rig, SI.
    c1_at : callable
        Damping (N s/m) at an amplitude (m), such as an identified ring-down envelope gives.

    Examples
    --------
    >>> rig = dict(M=4.7, k1=1.147e4, m=0.032, r=0.6)
    >>> constant = b_c_published_damped(G=0.25e-3, c1_at=lambda x: 3.02, **rig)
    >>> round(1e3 * constant.b_c, 3)
    33.968
    >>> growing = b_c_published_damped(G=0.25e-3, c1_at=lambda x: 3.02 + 400 * x, **rig)
    >>> round(1e3 * growing.b_c, 2), round(1e3 * growing.amplitude, 2), round(growing.c1, 2)
    (29.08, 4.57, 4.85)
    """
    eps, w0 = m / M, float(np.sqrt(k1 / M))

    def clearance(c1: float) -> float:
        return float(b_c_published(G=G, eps=eps, lam=c1 / (m * w0), r=r))

    return _solve(clearance, c1_at, float(A_1(r)))


def b_c_exact_damped(
    *, G: float, M: float, k1: float, m: float, r: float, c1_at: Callable[[float], float]
) -> DampedClearance:
    """Exact b_c with c1 taken at the amplitude A_1 b_c (arguments of `b_c_published_damped`).

    Examples
    --------
    >>> rig = dict(M=4.7, k1=1.147e4, m=0.032, r=0.6)
    >>> round(1e3 * b_c_exact_damped(G=0.25e-3, c1_at=lambda x: 3.02, **rig).b_c, 3)
    33.923
    """

    def clearance(c1: float) -> float:
        return float(b_c_exact(G=G, M=M, c1=c1, k1=k1, m=m, r=r))

    return _solve(clearance, c1_at, float(A_1(r)))
