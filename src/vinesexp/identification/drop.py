"""Restitution from a dropped ball: each flight is r times as long as the one before.

    t_i = t_0 + d (1 - r^i)/(1 - r),    i = 0, 1, 2, ...

All bounce times are fitted at once, since two flights share the bounce between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError
from vinesexp.identification.least_squares import gauss_newton

Floats = NDArray[np.float64]

_FEWEST_BOUNCES = 4
#: A flight that differs from the fit by more than this share of itself ends the series.
_LAST_FLIGHT = 0.2


@dataclass(frozen=True)
class Drop:
    """Restitution from one drop.

    Attributes
    ----------
    r, r_error : restitution and its standard error.
    bounces : used.
    time_error : rms misfit of the bounce times, s.
    """

    r: float
    r_error: float
    bounces: int
    time_error: float


def restitution_from_bounces(times: Floats) -> Drop:
    """Fit the restitution to bounce times, s.

    Flights shrink; the series ends where one does not (the ball lies, or something else hit).

    Raises
    ------
    AnalysisError
        Fewer than four bounces in a series.

    Examples
    --------
    >>> times = np.cumsum([0.1, *0.3 * 0.6 ** np.arange(6)])
    >>> found = restitution_from_bounces(times)
    >>> round(found.r, 6), found.bounces
    (0.6, 7)
    """
    series = _series(np.sort(np.asarray(times, dtype=np.float64)))
    if series.size < _FEWEST_BOUNCES:
        raise AnalysisError(
            f"{series.size} bounces of shrinking distance, expected {_FEWEST_BOUNCES} or more"
        )
    flights = np.diff(series)
    r = float(flights[1] / flights[0])
    start = np.array([series[0], flights[0], min(r, 0.999)])
    found, covariance, residual = gauss_newton(
        lambda p: _bounce_times(p, series.size), series, start
    )
    variance = float(residual @ residual) / (series.size - 3)
    return Drop(
        r=float(found[2]),
        r_error=float(np.sqrt(variance * covariance[2, 2])),
        bounces=series.size,
        time_error=float(np.sqrt(np.mean(residual**2))),
    )


def _series(times: Floats) -> Floats:
    """The first run of bounces whose flights keep shrinking in about the same ratio."""
    flights = np.diff(times)
    if flights.size < 2 or flights[0] <= 0.0:
        return times[:0]
    ratio = flights[1] / flights[0]
    last = 1
    for i in range(1, flights.size):
        if not 0.0 < flights[i] < flights[i - 1]:
            break
        if abs(flights[i] / flights[i - 1] / ratio - 1.0) > _LAST_FLIGHT:
            break
        last = i + 1
    return times[: last + 1]


def _bounce_times(p: Floats, bounces: int) -> tuple[Floats, Floats]:
    t0, d, r = p
    powers = r ** np.arange(bounces - 1)
    sums = np.concatenate([[0.0], np.cumsum(powers)])
    slopes = np.arange(bounces - 1) * r ** np.maximum(np.arange(bounces - 1) - 1, 0)
    by_r = d * np.concatenate([[0.0], np.cumsum(slopes)])
    return t0 + d * sums, np.stack([np.ones(bounces), sums, by_r], axis=1)
