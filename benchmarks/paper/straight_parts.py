"""Figures 13(a) and 14(a): whether a decay consists of straight parts that meet at transitions."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vinesexp.arrays import FloatArray

#: A part is straight where its points lie this much nearer to a line than to an exponential.
NEARER = 0.67


@dataclass(frozen=True)
class Part:
    """One stretch of a decay curve between two amplitudes (m).

    Attributes
    ----------
    line, exponential : largest distance of its points from either fitted curve, over its fall.
    rate : of the exponential, 1/s.
    """

    high: float
    low: float
    line: float
    exponential: float
    rate: float

    @property
    def straight(self) -> bool:
        return self.line < NEARER * self.exponential

    def __str__(self) -> str:
        return (
            f"{1e3 * self.high:.1f} to {1e3 * self.low:.1f} mm: off a line by "
            f"{100 * self.line:.0f} %, off an exponential by {100 * self.exponential:.0f} % of "
            f"the fall ({self.rate:.2f} 1/s)"
        )


def parts_of(time: FloatArray, peaks: FloatArray, edges: list[float]) -> list[Part]:
    """The stretches between neighbouring amplitudes of `edges` (m, falling)."""
    found = []
    for high, low in pairwise(edges):
        first, last = (int(np.flatnonzero(peaks > edge)[-1]) for edge in (high, low))
        t, y = time[first : last + 1], peaks[first : last + 1]
        line = np.polyval(np.polyfit(t, y, 1), t)
        slope, height = np.polyfit(t, np.log(y), 1)
        curve = np.exp(slope * t + height)
        off = [float(np.abs(y - one).max() / np.ptp(y)) for one in (line, curve)]
        found.append(Part(high, low, off[0], off[1], -float(slope)))
    return found
