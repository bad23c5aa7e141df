"""Do the impacts of two per cycle keep their phase, or does it swing?

On a periodic orbit every impact comes half a period after the one before. Where the orbit has lost
its stability the phase swings, at first by little and with every impact still there: counting
impacts does not show it, and a record may end before the ball is lost again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray

#: Impacts that it takes: fewer than so many cycles are too short to swing.
FEWEST = 40
_ENDS = (5.0, 95.0)  # percentiles: a false impact or two do not count
_SETTLES = 0.6  # of the first half's swing: a second half below that is on its way to rest


@dataclass(frozen=True)
class Swing:
    """Half the range of the impacts' phase, in periods, in the first and the second half.

    NaN where there are too few impacts.
    """

    first: float = math.nan
    second: float = math.nan

    @property
    def settles(self) -> bool:
        """Whether it dies away: the motion is on its way to a periodic one."""
        return self.second < _SETTLES * self.first

    @property
    def lasting(self) -> float:
        """The swing that stays: of the second half where it settles, else the larger one."""
        return self.second if self.settles else max(self.first, self.second)


#: Of too few impacts.
UNKNOWN = Swing()


def swing_of(times: FloatArray, sides: np.ndarray, captured: BoolArray, *, period: float) -> Swing:
    """Swing of the phase of captured impacts around a uniform one.

    A phase that drifts in proportion to time or its square is the frequency of the shaker, and two
    sides with phases of their own are an asymmetric orbit: neither is a swing.

    Parameters
    ----------
    times, sides : arrays (n,)
        Of all impacts of one ball, s and +1 or -1.
    captured : bool array (n,)
        Those of cycles with one impact on either side.
    period : float
        Of the oscillation, s.

    Examples
    --------
    >>> n = np.arange(400)
    >>> sides, every = (-1) ** n, np.ones(400, dtype=bool)
    >>> steady = swing_of(0.5 * n, sides, every, period=1.0)
    >>> swings = swing_of(0.5 * n + 0.05 * np.sin(0.2 * n), sides, every, period=1.0)
    >>> steady.lasting < 1e-9, 0.045 < swings.lasting < 0.055, swings.settles
    (True, True, False)
    """
    if captured.sum() < FEWEST:
        return UNKNOWN
    half = 0.5 * period
    number = np.concatenate([[0.0], np.cumsum(np.round(np.diff(times) / half))])[captured]
    t, side = times[captured], sides[captured].astype(np.float64)
    along = (t - t[0]) / max(float(np.ptp(t)), period)
    basis = np.stack([np.ones_like(t), along, along * along, side], axis=1)
    late = t - half * number
    phase = (late - basis @ np.linalg.lstsq(basis, late, rcond=None)[0]) / period
    middle = 0.5 * (t[0] + t[-1])
    return Swing(*(_half_range(phase[part]) for part in (t <= middle, t > middle)))


def _half_range(phase: FloatArray) -> float:
    if not phase.size:
        return math.nan
    low, high = np.percentile(phase, _ENDS)
    return 0.5 * float(high - low)
