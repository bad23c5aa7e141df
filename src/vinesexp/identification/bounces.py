"""r from a drop test: a bouncing ball's flights shrink by r each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError

FloatArray = NDArray[np.float64]

_FEWEST = 3
_ITERATIONS = 20


@dataclass(frozen=True)
class Bounces:
    """r with its standard error, the bounces used and the first flight, s."""

    r: float
    error: float
    count: int
    first_flight: float


def restitution_of_bounces(times: FloatArray, errors: FloatArray) -> Bounces:
    """Fit impact times t_k = t_1 + T (1 - r^(k-1))/(1 - r) to the longest run of bounces.

    A flight lasts 2 v/g and every bounce multiplies v by r; drag of the air is below the timing
    error at bench heights.

    Parameters
    ----------
    times, errors : arrays (n,)
        Impact times and their standard errors, s.

    Returns
    -------
    Bounces

    Raises
    ------
    AnalysisError
        Fewer than three impacts whose flights shrink.

    Examples
    --------
    >>> t = 0.1 + 0.2 * np.concatenate([[0.0], np.cumsum(0.6 ** np.arange(6))])
    >>> round(restitution_of_bounces(t, np.full(7, 1e-6)).r, 6)
    0.6
    """
    t, error = _longest_run(times, errors)
    if t.size < _FEWEST:
        raise AnalysisError(
            f"{t.size} bounces with shrinking flights, expected {_FEWEST} or more to give r"
        )
    flights = np.diff(t)
    r = float(np.exp(np.polyfit(np.arange(flights.size), np.log(flights), 1)[0]))
    k = np.arange(t.size)
    p = np.array([t[0], flights[0], min(r, 0.999)])
    for _ in range(_ITERATIONS):
        powers = p[2] ** k
        partial = np.concatenate([[0.0], np.cumsum(powers[:-1])])
        slopes = np.concatenate([[0.0], np.cumsum(k[:-1] * p[2] ** (k[:-1] - 1.0))])
        jacobian = np.stack([np.ones(t.size), partial, p[1] * slopes], 1) / error[:, np.newaxis]
        rest = (t - p[0] - p[1] * partial) / error
        step = np.linalg.lstsq(jacobian, rest, rcond=None)[0]
        p = p + step
        if np.abs(step[2]) < 1e-13:
            break
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    freedom = max(1, t.size - 3)
    scale = max(1.0, float(rest @ rest) / freedom)
    return Bounces(float(p[2]), float(np.sqrt(scale * covariance[2, 2])), t.size, float(p[1]))


def _longest_run(times: FloatArray, errors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The impacts from the first of the longest stretch in which every flight is shorter.

    Ratios must also be alike: a missed bounce makes one flight far too long.
    """
    if times.size < 2:
        return times, errors
    flights = np.diff(times)
    ratio = flights[1:] / flights[:-1]
    typical = float(np.median(ratio[ratio < 1.0])) if (ratio < 1.0).any() else 0.0
    good = (ratio < 1.0) & (np.abs(ratio - typical) < 0.25 * max(typical, 0.2))
    best, start = (0, 0), 0
    for i, fine in enumerate([*good.tolist(), False]):
        if not fine:
            if i - start > best[1] - best[0]:
                best = (start, i)
            start = i + 1
    if best[1] == best[0]:
        return times[:0], errors[:0]
    chosen = slice(best[0], best[1] + 2)
    return times[chosen], errors[chosen]
