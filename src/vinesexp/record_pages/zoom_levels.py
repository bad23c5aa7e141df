"""A trace as smallest and largest values of equal parts: what a view of much of it shows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.store import RecordView

#: Parts of a trace: at least so many, and with many cycles up to so many.
_FEWEST, _MOST = 8192, 65536
#: Parts of a cycle that show its shape; below the second number it would look modulated.
_A_CYCLE, _LEAST = 16, 8
#: Records of fewer samples are stored as they are.
SHORT = 2 * _FEWEST
_BLOCK = 1 << 20  # samples read at once


@dataclass(frozen=True)
class Level:
    """A trace in equal parts: smallest and largest value of each; one of them where a part is one
    sample, and NaN where a part is a gap."""

    size: int
    low: FloatArray
    high: FloatArray


def part_size(n: int, sample_rate: float, frequency: float) -> int:
    """Samples of a part.

    Where parts are too long to show a cycle they are whole cycles: shorter ones would beat with
    the oscillation, and a steady motion look modulated.

    Parameters
    ----------
    n : int
        Samples of the record.
    sample_rate, frequency : float
        Hz; frequency of the oscillation, 0 where there is none.

    Examples
    --------
    >>> part_size(9_000, 1e4, 8.0), part_size(500_000, 1e4, 8.0)
    (1, 62)

    An hour at 100 kHz: no longer 16 parts a cycle, but a cycle a part.

    >>> part_size(360_000_000, 1e5, 8.0)
    12500
    """
    if n <= SHORT:
        return 1
    period = sample_rate / frequency if frequency > 0.0 else math.inf
    cycles = n / period
    size = math.ceil(n / min(max(_A_CYCLE * cycles, _FEWEST), _MOST))
    if size * _LEAST <= period:
        return max(size, 1)
    return math.ceil(math.ceil(size / period) * period)


def read_channel(view: RecordView, role: str, size: int) -> Level:
    """A channel in parts of `size` samples, SI.

    Read once, by blocks of whole parts: memory does not grow with the record.
    """
    if size == 1:
        samples = view.read(role)
        return Level(1, samples, samples)
    count = -(-view.n // size)
    low, high = np.empty(count), np.empty(count)
    together = max(_BLOCK // size, 1)
    for first in range(0, count, together):
        last = min(first + together, count)
        samples = view.read(role, first * size, last * size)
        starts = np.arange(0, samples.size, size)
        low[first:last] = np.fmin.reduceat(samples, starts)
        high[first:last] = np.fmax.reduceat(samples, starts)
    return Level(size, low, high)
