"""Means of estimates by their variances, and the question whether they agree."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.identification.estimate import Estimate

#: One estimate among several disagrees if it is off by so many standard errors ...
DISAGREES = 3.5
#: ... and by so much, relative: no lab repeats itself to the last digit.
MATTERS = 2e-3


@dataclass(frozen=True)
class Mean:
    """Weighted mean.

    Attributes
    ----------
    value, error : float
        The error is widened where the estimates scatter more than their errors say.
    ratio : float
        sqrt(chi^2 / degrees of freedom); 1 for a single estimate.
    outlier : int or None
        Index of the estimate that disagrees with the others.
    pull : float
        By how many standard errors it does.
    """

    value: float
    error: float
    ratio: float
    outlier: int | None
    pull: float


def weighted_mean(values: Sequence[float], errors: Sequence[float]) -> Mean:
    """Mean with weights 1/error^2.

    Parameters
    ----------
    values, errors : sequences of float
        Independent estimates of one quantity.

    Examples
    --------
    >>> weighted_mean([1.0, 3.0], [1.0, 1.0]).value
    2.0
    >>> weighted_mean([7.862, 7.862, 7.9], [1e-3, 1e-3, 1e-3]).outlier
    2
    """
    v, e = np.asarray(values, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    e = np.maximum(e, 1e-12 * np.abs(v) + 1e-300)
    weight = (e.min() / e) ** 2
    value = float((weight * v).sum() / weight.sum())
    error = float(e.min() / math.sqrt(weight.sum()))
    if v.size == 1:
        return Mean(value, error, 1.0, None, 0.0)
    chi2 = float((((v - value) / e) ** 2).sum())
    freedom = v.size - 1
    ratio = math.sqrt(chi2 / freedom)
    # By chance chi^2 exceeds this once in twenty times; then the errors are too small.
    if chi2 > freedom + 1.64 * math.sqrt(2.0 * freedom) + 1.0:
        error *= ratio
    outlier, pull = _outlier(v, e)
    return Mean(value, error, ratio, outlier, pull)


def _outlier(v: np.ndarray, e: np.ndarray) -> tuple[int | None, float]:
    """The estimate farthest from the mean of the others, if it matters."""
    best, top = None, 0.0
    for i in range(v.size):
        others = np.delete(np.arange(v.size), i)
        w = 1.0 / e[others] ** 2
        mean = float((w * v[others]).sum() / w.sum())
        pull = abs(v[i] - mean) / math.hypot(e[i], 1.0 / math.sqrt(w.sum()))
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
