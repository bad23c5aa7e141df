"""Least squares for the parameters of a decay: Gauss-Newton, damped where a step fails."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vinesexp.identification.damping_law import NAMES, nudged

FloatArray = NDArray[np.float64]

_ITERATIONS = 12
_CONVERGED = 1e-4  # standard errors


def gauss_newton(
    vector: FloatArray, free: tuple[str, ...], misfit: Callable[[FloatArray], FloatArray], *,
    span: float,
) -> tuple[FloatArray, FloatArray, float]:  # fmt: skip
    """Least squares over the named parameters; vector, covariance of unit noise, chi^2.

    `misfit` takes several parameter sets at once, so that a step costs one integration.
    """
    at = [NAMES.index(name) for name in free]
    damp = 0.0
    rows, changes = nudged(vector, free, span=span)
    values = misfit(rows)
    chi2 = float(values[0] @ values[0])
    for _ in range(_ITERATIONS):
        jacobian = (values[1:] - values[0]).T / changes
        scale = np.sqrt((jacobian**2).sum(axis=0)) + 1e-300
        scaled = jacobian / scale
        normal = scaled.T @ scaled
        step = np.linalg.solve(normal + (damp + 1e-12) * np.eye(len(free)), -scaled.T @ values[0])
        trial = vector.copy()
        trial[at] += step / scale
        new_rows, new_changes = nudged(trial, free, span=span)
        new_values = misfit(new_rows)
        new_chi2 = float(new_values[0] @ new_values[0])
        if new_chi2 <= chi2 * (1.0 + 1e-12):
            vector, rows, changes, values = trial, new_rows, new_changes, new_values
            gained, chi2, damp = chi2 - new_chi2, new_chi2, damp * 0.2
            if gained < 1e-6 * chi2 / max(1, values.shape[1]) or np.abs(step).max() < _CONVERGED:
                break
        else:
            damp = max(10.0 * damp, 1e-3)
            if damp > 1e6:
                break
    jacobian = (values[1:] - values[0]).T / changes
    scale = np.sqrt((jacobian**2).sum(axis=0)) + 1e-300
    normal = (jacobian / scale).T @ (jacobian / scale)
    covariance = np.linalg.pinv(normal, rcond=1e-13) / np.outer(scale, scale)
    return vector, covariance, chi2
