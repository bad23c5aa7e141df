"""Jumps of the accelerometer against those of the laser: one common factor, and whose it is.

The area of a pulse and the change of slope are the same jump of velocity, seen by two sensors.
Ringing of the mount, a local mode, a template that misses part of the pulse, or a wrong
sensitivity make them differ by a common factor that hundreds of impacts show well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.identification.flights import Flights

#: The two disagree beyond this many standard errors, and by more than this.
_SURE, _MATTERS = 5.0, 0.01
_FEWEST = 10


@dataclass(frozen=True)
class JumpRatio:
    """Accelerometer's over displacement's jumps.

    Attributes
    ----------
    ratio, error : float
        1 where they agree; the error holds the scatter from record to record.
    """

    ratio: float
    error: float

    @property
    def disagrees(self) -> bool:
        """Beyond errors, and enough to matter."""
        return abs(self.ratio - 1.0) > max(_SURE * self.error, _MATTERS)


def ratio_of(flights: Flights) -> JumpRatio | None:
    """Of one record; None where either channel says nothing.

    The displacement's jumps are regressed on the accelerometer's, whose errors are the smaller.
    """
    a, d = flights.jump_acceleration, flights.jump_displacement
    known = np.isfinite(a) & np.isfinite(d)
    if known.sum() < _FEWEST:
        return None
    a, d = a[known] * np.sign(np.sum(a[known] * d[known])), d[known]
    slope = float((a * d).sum() / (a * a).sum())
    rest = d - slope * a
    keep = np.abs(rest) < 5.0 * 1.4826 * np.median(np.abs(rest)) + 1e-12
    a, d = a[keep], d[keep]
    slope = float((a * d).sum() / (a * a).sum())
    scatter = math.sqrt(float(((d - slope * a) ** 2).sum()) / max(1, a.size - 1))
    error = scatter / math.sqrt(float((a * a).sum()))
    if slope <= 0.0:
        return None
    return JumpRatio(1.0 / slope, error / slope**2)


def common_ratio(ratios: Sequence[JumpRatio]) -> JumpRatio | None:
    """Mean over records with the spread between them (DerSimonian and Laird).

    Examples
    --------
    >>> common_ratio([JumpRatio(1.30, 0.01), JumpRatio(1.34, 0.01)]).ratio
    1.32
    """
    if not ratios:
        return None
    value = np.array([one.ratio for one in ratios])
    variance = np.array([one.error for one in ratios]) ** 2
    weight = 1.0 / variance
    mean = float(weight @ value / weight.sum())
    if value.size > 1:
        chi2 = float(weight @ (value - mean) ** 2)
        room = float(weight.sum() - (weight**2).sum() / weight.sum())
        between = max(0.0, (chi2 - (value.size - 1)) / room)
        weight = 1.0 / (variance + between)
        mean = float(weight @ value / weight.sum())
    return JumpRatio(mean, float(1.0 / math.sqrt(weight.sum())))
