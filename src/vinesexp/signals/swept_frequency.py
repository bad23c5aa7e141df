"""Frequency of a sweep over time, counted in cycles of the base."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.store import RecordView

_BLOCK = 1 << 20  # samples read at once
_SPAN = 16  # cycles that a frequency is the mean of
_APART = 0.5  # of a period: crossings closer than this are noise


@dataclass(frozen=True)
class Swept:
    """Cycles of the base, each at its time.

    Attributes
    ----------
    time : upward zero crossings, s on the record's axis: one a cycle.
    """

    time: FloatArray

    @property
    def cycles(self) -> int:
        """How many whole cycles there are."""
        return max(self.time.size - 1, 0)

    def count(self, time: FloatArray) -> FloatArray:
        """Cycles of the base since its first crossing, at each time."""
        return np.interp(time, self.time, np.arange(self.time.size, dtype=np.float64))

    def at(self, cycle: FloatArray) -> FloatArray:
        """Time of each cycle, s."""
        return np.interp(cycle, np.arange(self.time.size, dtype=np.float64), self.time)

    def frequency(self, cycle: FloatArray) -> FloatArray:
        """Frequency (Hz) at each cycle, a mean over 16 of them.

        Examples
        --------
        >>> t = np.arange(200) / 8.0
        >>> Swept(t).frequency(np.array([50.0, 120.0]))
        array([8., 8.])
        """
        span = min(_SPAN, max(self.cycles, 1))
        middle = np.arange(self.time.size - span) + 0.5 * span
        mean = span / (self.time[span:] - self.time[:-span])
        return np.interp(cycle, middle, mean)


def swept(view: RecordView, frequency: float) -> Swept | None:
    """Cycles of a conditioned sweep, from its base or, without one, from the mass.

    Returns
    -------
    Swept or None
        None where fewer than 32 cycles are seen.
    """
    role = "base" if "base" in view.roles else "displacement"
    times: list[FloatArray] = []
    for begin in range(0, view.n - 1, _BLOCK):
        x = view.read(role, begin, min(begin + _BLOCK + 1, view.n))
        up = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
        times.append((begin + up + x[up] / (x[up] - x[up + 1])) / view.sample_rate)
    found = view.start + np.concatenate(times) if times else np.empty(0)
    if found.size > 1:
        found = found[np.concatenate([[True], np.diff(found) > _APART / frequency])]
    return Swept(found) if found.size > 2 * _SPAN else None
