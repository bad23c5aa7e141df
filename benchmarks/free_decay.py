"""Free decay on the stable branch in closed form: the time between any two amplitudes.

With no forcing the slow flow is dA/dtau1 = -lambda A/2 - 8 Gamma C^2/(pi^3 A). Written in C it is a
rational function, so the quadrature of docs/theory.md (25) is a logarithm and an arctangent.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.rig import ZERO_OR_ABOVE, checked
from vinesexp.theory.manifold import loss_parameter, upper_branch


def decay_time(start: ArrayLike, end: ArrayLike, *, lam: ArrayLike, r: ArrayLike) -> FloatArray:
    """Time tau1 = eps w0 t from amplitude `start` to `end`, both on the right branch (25).

    Parameters
    ----------
    start, end : array_like
        Amplitudes in clearances, start >= end >= A_1(r). Past A_2 the formula goes on along the
        unstable symmetric branch, an estimate there.
    lam, r : array_like
        Reduced damping, restitution.

    Raises
    ------
    AnalysisError
        An amplitude below the fold, or a decay that would have to grow; r = 1 with lam = 0,
        which never decays.

    Examples
    --------
    >>> eps, w0 = 0.032 / 4.7, (1.147e4 / 4.7) ** 0.5
    >>> lam = 3.02 / (0.032 * w0)
    >>> round(float(decay_time(30 / 50, 15 / 50, lam=lam, r=0.6) / (eps * w0)), 3)  # s
    1.264
    """
    if np.any(np.asarray(start) < np.asarray(end)):
        raise AnalysisError("free decay: the start amplitude is below the one to be reached")
    Gamma = loss_parameter(r)
    damping = checked(lam, "reduced damping lambda", "", ZERO_OR_ABOVE)
    if np.any((Gamma == 0.0) & (damping == 0.0)):
        raise AnalysisError("free decay: a ball of r = 1 without damping never loses energy")
    high, low = upper_branch(start, r=r), upper_branch(end, r=r)
    # integrand (s C - 1)/(a C^2 - lam C + lam/2), s = S/pi^2
    s = 1.0 + (4.0 / np.pi**2) * Gamma * Gamma
    a = 0.5 * damping * s + (8.0 / np.pi**3) * Gamma
    square = damping * Gamma * (4.0 / np.pi**2) * (damping * Gamma + 4.0 / np.pi)
    root = np.sqrt(square)
    ratio = (a * high * high + damping * (0.5 - high)) / (a * low * low + damping * (0.5 - low))
    # atan(p) - atan(q) as one arctangent; over the root it stays finite as the damping vanishes
    product = square + (2.0 * a * high - damping) * (2.0 * a * low - damping)
    step = 2.0 * a * (high - low)
    small = root < 1e-12
    arc = np.arctan2(step * root, product) / np.where(small, 1.0, root)
    if np.any(small):
        arc = np.where(small, step / product, arc)
    time: FloatArray = 0.5 * s / a * np.log(ratio) + (damping * s / a - 2.0) * arc
    return time
