"""The one nonlinear least squares of the identification, and covariances that may be infinite."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import optimize

from vinesexp.arrays import FloatArray

#: Misfits in standard deviations, and their derivatives (n, p); None where the model has no sense.
Problem = Callable[[FloatArray], tuple[FloatArray, FloatArray] | None]

_CONVERGED = 1e-8  # relative: a shorter step changes nothing that matters
_GAINED = 1e-7  # of chi^2 for one misfit: a smaller gain neither
_MOST = 30  # evaluations: what takes more is no decay
_REFUSED = 1e150  # a misfit where the model has no sense
_FIXED = 1e-13  # of the largest eigenvalue: a direction with less is rounding, not data
_TAKES_PART = 1e-4  # of a unit vector: the share that rounding turns into it is less


@dataclass(frozen=True)
class Solution:
    """Parameters where chi^2 is least, their covariance for misfits of unit noise, and chi^2."""

    values: FloatArray
    covariance: FloatArray
    chi2: float


def least_squares(problem: Problem, start: FloatArray) -> Solution:
    """Parameters that make the sum of squared misfits least.

    Levenberg and Marquardt's steps, by MINPACK.

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
    begin = np.array(start, dtype=np.float64)
    first = problem(begin)
    if first is None:
        raise ValueError("no start of a fit: the model has no sense there")
    refused = np.full(first[0].size, _REFUSED), first[1]

    @lru_cache(maxsize=2)  # misfits and derivatives are asked for one after the other
    def at(point: bytes) -> tuple[FloatArray, FloatArray]:
        return problem(np.frombuffer(point)) or refused

    solved = optimize.least_squares(
        lambda p: at(p.tobytes())[0], begin, lambda p: at(p.tobytes())[1],
        method="lm", x_scale="jac", ftol=_GAINED / first[0].size, xtol=_CONVERGED, max_nfev=_MOST,
    )  # fmt: skip
    return Solution(solved.x, covariance_of(at(solved.x.tobytes())[1]), 2.0 * float(solved.cost))


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
