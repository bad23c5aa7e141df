"""Gauss-Newton for small smooth fits: a few parameters, a good start, many samples.

A general optimiser would cost more to import than the fit to run.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError

Floats = NDArray[np.float64]

#: The step, in standard errors of each parameter, below which the fit has converged.
_CONVERGED = 1e-6
_HALVINGS = 30
_STEPS = 60


def gauss_newton(
    model: Callable[[Floats], tuple[Floats, Floats]], data: Floats, start: Floats
) -> tuple[Floats, Floats, Floats]:
    """Least-squares fit of ``data = model(parameters)``.

    Parameters
    ----------
    model : callable
        Parameters to (prediction, Jacobian of shape (data, parameters)).
    data : ndarray
    start : ndarray
        First guess.

    Returns
    -------
    parameters, unscaled_covariance, residual : ndarray
        (J'J)^-1 is to be multiplied by the variance of one datum.

    Raises
    ------
    AnalysisError
        No convergence, or parameters that the data do not determine.

    Examples
    --------
    >>> t = np.linspace(0.0, 1.0, 20)
    >>> def decay(p): return p[0] * np.exp(-p[1] * t), np.stack(
    ...     [np.exp(-p[1] * t), -p[0] * t * np.exp(-p[1] * t)], axis=1)
    >>> found, _, _ = gauss_newton(decay, 3.0 * np.exp(-2.0 * t), np.array([2.0, 1.0]))
    >>> found.round(9)
    array([3., 2.])
    """
    parameters = np.array(start, dtype=np.float64)
    prediction, jacobian = model(parameters)
    residual = data - prediction
    cost = float(residual @ residual)
    for _ in range(_STEPS):
        scale = np.linalg.norm(jacobian, axis=0)
        if not np.all(np.isfinite(scale)) or np.any(scale == 0.0):
            raise AnalysisError("the data do not determine every parameter of the fit")
        step = np.linalg.lstsq(jacobian / scale, residual, rcond=None)[0] / scale
        spread = np.sqrt(max(cost, np.finfo(float).tiny) / data.size) / scale
        if np.all(np.abs(step) <= _CONVERGED * spread + 4e-16 * np.abs(parameters)):
            return parameters, _covariance(jacobian, scale), residual
        for _ in range(_HALVINGS):
            trial, trial_jacobian = model(parameters + step)
            trial_residual = data - trial
            trial_cost = float(trial_residual @ trial_residual)
            if trial_cost <= cost * (1.0 + 1e-12):
                break
            step = 0.5 * step
        else:  # no descent left: at the minimum to rounding
            return parameters, _covariance(jacobian, scale), residual
        parameters, jacobian = parameters + step, trial_jacobian
        residual, cost = trial_residual, trial_cost
    raise AnalysisError("the fit does not converge")


def _covariance(jacobian: Floats, scale: Floats) -> Floats:
    normal = (jacobian / scale).T @ (jacobian / scale)
    try:
        inverse = np.linalg.inv(normal)
    except np.linalg.LinAlgError:
        raise AnalysisError("the data do not determine every parameter of the fit") from None
    return np.asarray(inverse / np.outer(scale, scale))
