"""The half-period impact map of a ball in a shaken box: its eigenvalues say where T1, T2 are."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import ComplexArray, FloatArray
from vinesexp.theory.manifold import loss_parameter


def impact_phase(C: ArrayLike, *, r: ArrayLike) -> FloatArray:
    """Phase phi of the impact in the motion A sin: A sin(phi) = 1 - C, A cos(phi) = 2 Gamma C/pi.

    The paper's angle is eta - theta = pi/2 - phi (docs/theory.md, 7).
    """
    ball = np.asarray(C, dtype=np.float64)
    return np.arctan2(1.0 - ball, 2.0 * ball * loss_parameter(r) / np.pi)


def impact_map(C: ArrayLike, *, r: ArrayLike) -> FloatArray:
    """Jacobian of the half-period impact map in (phase, ball speed) at a point of the SIM.

    Determinant r^2, trace 2 r + (pi/2)(1 - r^2) tan(phi) (docs/theory.md, 11).

    Parameters
    ----------
    C : array_like
        Ball amplitude, > 0, in units of b.
    r : array_like
        Restitution.

    Returns
    -------
    ndarray, shape (..., 2, 2)
    """
    ball = np.asarray(C, dtype=np.float64)
    ball, r = np.broadcast_arrays(ball, np.asarray(r, dtype=np.float64))
    u = 2.0 * ball / np.pi
    J = np.empty((*ball.shape, 2, 2))
    J[..., 0, 0] = r
    J[..., 0, 1] = -np.pi * (1.0 + r) / (2.0 * u)
    J[..., 1, 0] = -(1.0 + r) * (1.0 - ball) * r
    J[..., 1, 1] = r - (1.0 + r) * (1.0 - ball) * J[..., 0, 1]
    return J


def multipliers(C: ArrayLike, *, r: ArrayLike) -> ComplexArray:
    """Eigenvalues of `impact_map`, shape (..., 2): +1 at T1, -1 at T2, modulus r where complex."""
    return np.linalg.eigvals(impact_map(C, r=r)).astype(np.complex128)
