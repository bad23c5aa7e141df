"""Means of estimates that may exclude one another.

Where estimates agree within their errors, they are weighed by their variances. Where they do not,
something differs between them that no error knows: a random effect. Its variance tau^2 is the one
that makes chi^2 what it should be (Mandel and Paule 1982), the weights become 1/(error^2 + tau^2),
and the error is taken from the scatter itself, with Student's factor for few estimates (Hartung and
Knapp 2001). A precise outlier then has no more weight than the others.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.identification.estimate import Estimate
from vinesexp.units import COVERAGE_95

#: One estimate among several disagrees if it is off by so many standard errors ...
DISAGREES = 3.5
#: ... and by so much, relative: no lab repeats itself to the last digit.
MATTERS = 2e-3
#: Two estimates within this of a number's own rounding are the same.
_ROUNDING = 1e-12
#: Largest gap over the range from which on sorted estimates are two groups.
_GROUPS = 0.5
#: Student's two-sided 95 % point for 1, 2, ... degrees of freedom.
_STUDENT = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)


@dataclass(frozen=True)
class Mean:
    """Mean of several estimates.

    Attributes
    ----------
    value, error : float
    weights : array (n,)
        Sum 1.
    spread : float
        tau, the standard deviation of what differs between the estimates beyond their errors; 0
        where they agree.
    outlier : int or None
        Index of the estimate that disagrees with the others.
    pull : float
        By how many standard errors it does.
    """

    value: float
    error: float
    weights: FloatArray
    spread: float
    outlier: int | None
    pull: float


def weighted_mean(values: Sequence[float], errors: Sequence[float]) -> Mean:
    """Mean of estimates of one quantity, with an error that holds their disagreement.

    Parameters
    ----------
    values, errors : sequences of float
        Estimates with independent standard errors.

    Examples
    --------
    >>> weighted_mean([1.0, 3.0], [1.0, 1.0]).value
    2.0
    >>> apart = weighted_mean([4.70, 4.90], [1e-3, 1e-5])  # which of them is right nobody knows
    >>> round(apart.value, 3), round(apart.error, 3)
    (4.8, 0.1)
    >>> weighted_mean([7.862, 7.862, 7.9], [1e-3, 1e-3, 1e-3]).outlier
    2
    """
    v, e = np.asarray(values, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    e = np.maximum(e, _ROUNDING * np.abs(v) + 1e-300)
    value, error, weights = _weighed(v, e)
    if v.size == 1:
        return Mean(value, error, weights, 0.0, None, 0.0)
    freedom = v.size - 1
    chi2 = float((((v - value) / e) ** 2).sum())
    outlier, pull = _outlier(v, e)
    # By chance chi^2 exceeds this once in twenty times; then the errors are too small.
    if chi2 <= freedom + 1.64 * math.sqrt(2.0 * freedom) + 1.0:
        return Mean(value, error, weights, 0.0, outlier, pull)
    spread = _between(v, e)
    value, least, weights = _weighed(v, np.hypot(e, spread))
    error = max(least, _of_scatter(v, value, weights))
    return Mean(value, error, weights, spread, outlier, pull)


def _weighed(v: FloatArray, e: FloatArray) -> tuple[float, float, FloatArray]:
    weight = (e.min() / e) ** 2
    total = float(weight.sum())
    return float((weight * v).sum() / total), float(e.min() / math.sqrt(total)), weight / total


def _between(v: FloatArray, e: FloatArray) -> float:
    """tau of Mandel and Paule: chi^2 with errors hypot(e, tau) equals its degrees of freedom."""
    low, high = 0.0, float(np.ptp(v)) * 2.0
    for _ in range(60):
        tau = 0.5 * (low + high)
        each = np.hypot(e, tau)
        chi2 = float((((v - _weighed(v, each)[0]) / each) ** 2).sum())
        low, high = (tau, high) if chi2 > v.size - 1 else (low, tau)
    return 0.5 * (low + high)


def _of_scatter(v: FloatArray, value: float, weights: FloatArray) -> float:
    """Standard error from the scatter: Student's point over the normal one widens it for few.

    Two estimates, or two groups of them, do not say which of them is right: the interval holds
    both.
    """
    n = v.size
    scatter = math.sqrt(float((weights * (v - value) ** 2).sum()) / (n - 1))
    error = scatter if n == 2 else scatter * student_95(n - 1) / COVERAGE_95
    ordered = np.sort(v)
    gaps = np.diff(ordered)
    widest = int(np.argmax(gaps))
    few = min(widest + 1, n - widest - 1)
    if few > 1 and gaps[widest] > _GROUPS * float(ordered[-1] - ordered[0]):
        means = ordered[: widest + 1].mean(), ordered[widest + 1 :].mean()
        error = max(error, *(abs(float(mean) - value) / COVERAGE_95 * 1.1 for mean in means))
    return error


def student_95(freedom: int) -> float:
    """Student's two-sided 95 % point.

    Examples
    --------
    >>> student_95(2), round(student_95(30), 3)
    (4.303, 2.042)
    """
    if freedom <= len(_STUDENT):
        return _STUDENT[freedom - 1]
    z, n = COVERAGE_95, float(freedom)
    return z + (z**3 + z) / (4.0 * n) + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * n * n)


def _outlier(v: FloatArray, e: FloatArray) -> tuple[int | None, float]:
    """The estimate farthest from the mean of the others, if it matters."""
    best, top = None, 0.0
    for i in range(v.size):
        others = np.delete(np.arange(v.size), i)
        mean, error, _ = _weighed(v[others], e[others])
        pull = abs(v[i] - mean) / math.hypot(e[i], error)
        if pull > max(top, DISAGREES) and abs(v[i] - mean) > MATTERS * abs(mean):
            best, top = i, pull
    return best, top


def mean_of(estimates: Sequence[Estimate], *, method: str) -> tuple[Estimate, Mean]:
    """Estimates of one parameter as one, with all their records."""
    mean = weighted_mean([e.value for e in estimates], [e.std_error for e in estimates])
    records = tuple(dict.fromkeys(name for e in estimates for name in e.records))
    first = estimates[0]
    return (
        Estimate(first.parameter, mean.value, mean.error, first.unit, method, records),
        mean,
    )
