"""The one nonlinear least squares of the identification: Levenberg-Marquardt on few parameters.

scipy.optimize would do the same, but to import it costs 0.8 s, more than the estimates of a
record; every record is a process of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray

#: Misfits in standard deviations, and their derivatives (n, p); None where the model has no sense.
Problem = Callable[[FloatArray], tuple[FloatArray, FloatArray] | None]

_ITERATIONS = 30
_CONVERGED = 1e-4  # standard errors: a shorter step changes nothing that matters
_GAINED = 1e-7  # of chi^2 for one misfit: a smaller gain neither
_FIXED = 1e-13  # of the largest eigenvalue: a direction with less is rounding, not data
_TAKES_PART = 1e-4  # of a unit vector: the share that rounding turns into it is less
_FIRST_DAMPING, _MOST_DAMPING = 1e-3, 1e6  # of the scaled normal matrix, whose diagonal is 1


@dataclass(frozen=True)
class Solution:
    """Parameters where chi^2 is least, their covariance for misfits of unit noise, and chi^2."""

    values: FloatArray
    covariance: FloatArray
    chi2: float


def least_squares(problem: Problem, start: FloatArray) -> Solution:
    """Parameters that make the sum of squared misfits least.

    Gauss-Newton steps, damped only after one that did not help.

    Parameters
    ----------
    problem : callable
        Parameters to misfits (n,) in standard deviations and their derivatives (n, p); None
        where the model has no sense, which refuses the step.
    start : array (p,)

    Returns
    -------
    Solution

    Raises
    ------
    ValueError
        The model has no sense at the start.

    Examples
    --------
    >>> t = np.arange(5.0)
    >>> def decay(p):
    ...     model = p[0] * np.exp(-p[1] * t)
    ...     return model - 3.0 * np.exp(-0.5 * t), np.stack([model / p[0], -t * model], axis=1)
    >>> least_squares(decay, np.array([1.0, 0.1])).values.round(6)
    array([3. , 0.5])
    """
    values, damp = np.array(start, dtype=np.float64), 0.0
    here = problem(values)
    if here is None:
        raise ValueError("no start of a fit: the model has no sense there")
    misfit, jacobian = here
    chi2 = float(misfit @ misfit)
    for _ in range(_ITERATIONS):
        scale = _norms(jacobian)
        scaled = jacobian / scale
        normal = scaled.T @ scaled + (damp + 1e-12) * np.eye(values.size)
        step = np.linalg.solve(normal, -scaled.T @ misfit)
        there = problem(values + step / scale)
        new = float("inf") if there is None else float(there[0] @ there[0])
        if there is None or not new <= chi2 * (1.0 + 1e-12):
            damp = max(10.0 * damp, _FIRST_DAMPING)
            if damp > _MOST_DAMPING:
                break
            continue
        values, (misfit, jacobian) = values + step / scale, there
        gained, chi2, damp = chi2 - new, new, 0.2 * damp
        if np.abs(step).max() < _CONVERGED or gained < _GAINED * chi2 / misfit.size:
            break
    return Solution(values, covariance_of(jacobian), chi2)


def covariance_of(jacobian: FloatArray) -> FloatArray:
    """Covariance of fitted parameters; infinite where the data do not fix one.

    Parameters
    ----------
    jacobian : array (n, p)
        Derivatives of misfits of unit noise, or the columns of a linear fit over the errors.

    Returns
    -------
    array (p, p)
        A parameter that takes part in a direction along which no misfit changes has an infinite
        variance; its covariance with others is 0, so that these keep the errors they have.

    Examples
    --------
    >>> u = np.linspace(0.0, 1.0, 5)
    >>> columns = np.stack([np.ones(5), u, 2.0 * u], axis=1)
    >>> np.diag(covariance_of(columns)).round(3)
    array([0.6, inf, inf])
    """
    scale = _norms(jacobian)
    strengths, axes = np.linalg.eigh((jacobian / scale).T @ (jacobian / scale))
    fixed = strengths > _FIXED * max(float(strengths[-1]), 0.0)
    free = (np.abs(axes[:, ~fixed]) > _TAKES_PART).any(axis=1)
    known = axes[:, fixed]
    covariance = (known / strengths[fixed]) @ known.T / scale / scale[:, np.newaxis]
    covariance[free, :] = covariance[:, free] = 0.0
    covariance[free, free] = np.inf
    return np.asarray(covariance)


def variance_along(gradient: FloatArray, covariance: FloatArray) -> float:
    """Variance of a function of parameters; infinite if it changes with one that is not fixed.

    Examples
    --------
    >>> covariance = np.diag([4.0, np.inf])
    >>> variance_along(np.array([0.5, 0.0]), covariance)
    1.0
    >>> variance_along(np.array([0.5, 1e-9]), covariance)
    inf
    """
    moves = gradient != 0.0
    used = covariance[np.ix_(moves, moves)]
    if not np.isfinite(used).all():
        return float("inf")
    return max(float(gradient[moves] @ used @ gradient[moves]), 0.0)


def _norms(jacobian: FloatArray) -> FloatArray:
    norms = np.sqrt((jacobian**2).sum(axis=0))
    return np.where(norms > 0.0, norms, 1.0)
