"""Which impacts are judged together: those of one ball, or of all where they are not told apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.signals.impacts.impact_table import Impacts

#: Clearances that differ by less than this share are alike.
_ALIKE = 0.01
#: Of two balls with like clearances, one with fewer impacts than this share of the other's
#: hits together with it: two impacts at one time are found as one.
_TOGETHER = 0.2


@dataclass(frozen=True)
class Series:
    """Impacts that are judged together.

    Attributes
    ----------
    ball : from 1; 0: all balls, which are not told apart.
    clearance : of the ball, m; the largest of all balls where they are not told apart.
    time, side : of its impacts; s on the record's axis.
    """

    ball: int
    clearance: float
    time: FloatArray
    side: FloatArray


def by_ball(impacts: Impacts, clearance: Sequence[float], *, unowned_share: float) -> list[Series]:
    """One series a ball, or one of all impacts.

    Two balls stay together where more than `unowned_share` of the impacts have no owner, and where
    like balls move as one: their impacts then coincide, and all of them go to either.

    Parameters
    ----------
    impacts : Impacts
    clearance : sequence of float
        One-sided, m, one per ball.
    unowned_share : float
        Impacts without an owner that are left out, as a share of all.
    """
    n = len(clearance)
    side = impacts.side.astype(np.float64)
    if n == 1:
        return [Series(1, clearance[0], impacts.time_s, side)]
    own = [impacts.nes == ball for ball in range(1, n + 1)]
    unowned = 1.0 - sum(int(mine.sum()) for mine in own) / max(impacts.n, 1)
    if unowned > unowned_share or _as_one([int(mine.sum()) for mine in own], clearance):
        return [Series(0, max(clearance), impacts.time_s, side)]
    return [
        Series(ball, b, impacts.time_s[mine], side[mine])
        for ball, (b, mine) in enumerate(zip(clearance, own, strict=True), start=1)
    ]


def _as_one(counts: Sequence[int], clearance: Sequence[float]) -> bool:
    """Whether one of two like balls has next to no impacts of its own."""
    return any(
        abs(b - other) <= _ALIKE * other and few < _TOGETHER * many
        for few, b in zip(counts, clearance, strict=True)
        for many, other in zip(counts, clearance, strict=True)
    )
