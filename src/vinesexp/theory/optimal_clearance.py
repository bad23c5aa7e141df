"""Optimal clearances: b_c for periodic excitation, b_t for a release, published and exact.

`b_c` ends permanent two impacts per cycle; `b_t` starts a decay at the symmetry breaking T2. The
published formulas are the paper's (36) and (37); the exact values are the Neimark-Sacker end of
the periodic orbit and T2 in closed form. Their intervals are in `intervals`.
"""

from __future__ import annotations

from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.rig import ABOVE_ZERO, OF_RIG, ZERO_OR_ABOVE, RigValues, checked
from vinesexp.theory.boundaries import end_of_permanent_response
from vinesexp.theory.manifold import A_2, loss_parameter
from vinesexp.theory.orbits import Reduced

#: The amplitude at T2 that the paper reads off its figure 2; the exact one is `manifold.A_2(r)`.
PUBLISHED_A_2 = 0.6


def b_c_published(*, G: ArrayLike, eps: ArrayLike, lam: ArrayLike, r: ArrayLike) -> FloatArray:
    """Published optimal clearance under base motion of amplitude G: equation (36) of the paper.

    b_c = G S^(3/2)/(2 (eps lambda Gamma S + 4 pi eps)), S = pi^2 + 4 Gamma^2
    (docs/theory.md, 42). Whole arrays at once; no approximation of its own.

    Parameters
    ----------
    G : array_like
        Base amplitude, m (the result has its unit), >= 0.
    eps : array_like
        Mass ratio m/M, > 0.
    lam : array_like
        Reduced damping c1/(eps M w0), >= 0.
    r : array_like
        Restitution, in [0, 1].

    Raises
    ------
    ParameterError
        A value without meaning.

    Examples
    --------
    >>> eps, lam = 0.032 / 4.7, 3.02 / (0.032 * (1.147e4 / 4.7) ** 0.5)
    >>> round(float(1e3 * b_c_published(G=0.25e-3, eps=eps, lam=lam, r=0.6)), 3)
    33.968
    """
    base = checked(G, "base amplitude G", "m", ZERO_OR_ABOVE)
    ratio = checked(eps, "mass ratio eps", "", ABOVE_ZERO)
    damping = checked(lam, "reduced damping lambda", "", ZERO_OR_ABOVE)
    Gamma = loss_parameter(r)
    S = np.pi**2 + 4.0 * Gamma * Gamma
    return np.asarray(0.5 * base * S * np.sqrt(S) / (ratio * (damping * Gamma * S + 4.0 * np.pi)))


def b_c_exact(
    *, G: ArrayLike, frequency: ArrayLike | None = None, **rig: Unpack[RigValues]
) -> FloatArray:
    """Exact end of permanent two impacts per cycle: the largest clearance with a stable orbit.

    A Neimark-Sacker point of the exact symmetric orbit (a saddle-node where the damping is
    large), found from the Floquet multipliers of the full system (docs/theory.md, 38-41).

    Parameters
    ----------
    G : array_like
        Base amplitude, m, >= 0.
    frequency : array_like, optional
        Hz; the oscillator's own frequency where None.
    **rig : array_like
        M, c1, k1, m and r, SI.

    Returns
    -------
    ndarray
        Clearance, m.

    Raises
    ------
    ParameterError, AnalysisError
        A value without meaning; no stable orbit at any clearance.

    Examples
    --------
    >>> round(float(1e3 * b_c_exact(G=0.25e-3, M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6)), 3)
    33.923
    """
    base = checked(G, "base amplitude G", "m", ZERO_OR_ABOVE)
    p = Reduced.of_rig(frequency=frequency, **rig)
    return base * end_of_permanent_response(p).b_high


def b_t_published(*, x_m: ArrayLike) -> FloatArray:
    """Published optimal clearance for a release: x_m/0.6, equation (37) of the paper.

    Examples
    --------
    >>> round(float(1e3 * b_t_published(x_m=0.03)), 2)
    50.0
    """
    return checked(x_m, "release amplitude x_m", "m", ZERO_OR_ABOVE) / PUBLISHED_A_2


def b_t_exact(*, x_m: ArrayLike, r: ArrayLike) -> FloatArray:
    """Clearance at which a release of amplitude x_m starts exactly at T2: x_m/A_2(r).

    A_2 in closed form from the impact map's eigenvalue -1 (docs/theory.md, 14, 43).

    Examples
    --------
    >>> round(float(1e3 * b_t_exact(x_m=0.03, r=0.6)), 2)
    40.98
    """
    clearance: FloatArray = checked(x_m, "release amplitude x_m", "m", ZERO_OR_ABOVE) / A_2(r)
    return clearance


def release_amplitude(
    *, x0: ArrayLike, v0: ArrayLike = 0.0, M: ArrayLike = 1.0, k1: ArrayLike = 1.0
) -> FloatArray:
    """x_m = hypot(x0, v0/w0), the amplitude that a release stores (docs/theory.md, 43); m, m/s."""
    mass, stiffness = checked(M, *OF_RIG["M"]), checked(k1, *OF_RIG["k1"])
    x_m: FloatArray = np.hypot(x0, np.asarray(v0) * np.sqrt(mass / stiffness))
    return checked(x_m, "release amplitude x_m", "m", ZERO_OR_ABOVE)
