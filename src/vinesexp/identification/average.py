"""Means of estimates of one quantity by one method, with an error that holds their disagreement."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq

from vinesexp.arrays import FloatArray
from vinesexp.identification.estimate import Estimate
from vinesexp.signals.steady_part import students_factor

#: One estimate among several disagrees if it is off by so many standard errors.
DISAGREES = 3.5
#: Two estimates within this of a number's own rounding are the same.
_ROUNDING = 1e-12


def weighted_mean(values: Sequence[float], errors: Sequence[float]) -> tuple[float, float]:
    """Mean of estimates of one quantity, and its standard error (`with_scatter`).

    Parameters
    ----------
    values, errors : sequences of float
        Estimates with independent standard errors.

    Examples
    --------
    >>> weighted_mean([1.0, 3.0], [1.0, 1.0])[0]
    2.0
    >>> value, error = weighted_mean([4.70, 4.90], [1e-3, 1e-5])  # which is right nobody knows
    >>> round(value, 3), error > 0.1
    (4.8, True)
    """
    return _mean(np.asarray(values, dtype=np.float64), with_scatter(values, errors))[:2]


def with_scatter(values: Sequence[float], errors: Sequence[float]) -> FloatArray:
    """Errors of estimates of one quantity that hold their disagreement, shape (n,).

    Where they scatter by more than their errors allow once in twenty times, each gets the same
    further error, with which chi^2 is what it should be (Mandel and Paule), and all are wider by
    Student's factor for few.
    """
    v = np.asarray(values, dtype=np.float64)
    e = np.maximum(np.asarray(errors, dtype=np.float64), _ROUNDING * np.abs(v) + 1e-300)
    freedom = v.size - 1
    if freedom < 1 or _mean(v, e)[2] <= freedom + 1.64 * math.sqrt(2.0 * freedom) + 1.0:
        return e
    more = float(
        brentq(lambda tau: _mean(v, np.hypot(e, tau))[2] - freedom, 0.0, 2.0 * float(np.ptp(v)))
    )
    return np.hypot(e, more) * students_factor(freedom)


def _mean(v: FloatArray, e: FloatArray) -> tuple[float, float, float]:
    """Weighted mean, its error, and chi^2."""
    w = (e.min() / e) ** 2
    value = float(w @ v / w.sum())
    return value, float(e.min() / math.sqrt(w.sum())), float((((v - value) / e) ** 2).sum())


def mean_of(estimates: Sequence[Estimate], *, method: str) -> Estimate:
    """Estimates of one parameter as one, with all their records."""
    value, error = weighted_mean([e.value for e in estimates], [e.std_error for e in estimates])
    records = tuple(dict.fromkeys(name for e in estimates for name in e.records))
    first = estimates[0]
    return Estimate(first.parameter, value, error, first.unit, method, records)
