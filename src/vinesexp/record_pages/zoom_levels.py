"""What a browser needs to show a trace at any zoom: smallest and largest values of equal parts of
the whole record, and every sample around impacts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.store import RecordView

#: Parts of a trace: at least so many, and with many cycles up to so many.
_FEWEST, _MOST = 8192, 65536
#: Parts of a cycle that show its shape; below the second number it would look modulated.
_A_CYCLE, _LEAST = 16, 8
#: Records of fewer samples are stored as they are.
_SHORT = 2 * _FEWEST
_BLOCK = 1 << 20  # samples read at once

#: Around an impact, s and at least so many samples: a contact and its ringing.
_BEFORE, _AFTER = 0.002, 0.004
_LEAST_BEFORE, _LEAST_AFTER = 24, 48
#: Samples in the windows of one record, and impacts with a window.
_MOST_SAMPLES, _MOST_WINDOWS = 36_000, 600

Window = tuple[int, int]


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
    if n <= _SHORT:
        return 1
    period = sample_rate / frequency if frequency > 0.0 else math.inf
    cycles = n / period
    size = math.ceil(n / min(max(_A_CYCLE * cycles, _FEWEST), _MOST))
    if size * _LEAST <= period:
        return max(size, 1)
    return math.ceil(math.ceil(size / period) * period)


def read_channel(
    view: RecordView, role: str, size: int, windows: Sequence[Window] = ()
) -> tuple[Level, FloatArray]:
    """A channel in parts of `size` samples, and all samples of the windows one after the other, SI.

    Read once, by blocks of whole parts: memory does not grow with the record.
    """
    if size == 1:
        samples = view.read(role)
        return Level(1, samples, samples), np.empty(0)
    inside = np.concatenate([np.arange(0), *(np.arange(*window) for window in windows)])
    count = -(-view.n // size)
    low, high, found = np.empty(count), np.empty(count), np.empty(inside.size)
    together = max(_BLOCK // size, 1)
    for first in range(0, count, together):
        last = min(first + together, count)
        samples = view.read(role, first * size, last * size)
        starts = np.arange(0, samples.size, size)
        low[first:last] = np.fmin.reduceat(samples, starts)
        high[first:last] = np.fmax.reduceat(samples, starts)
        begin, end = np.searchsorted(inside, (first * size, last * size))
        found[begin:end] = samples[inside[begin:end] - first * size]
    return Level(size, low, high), found


def windows_around(times: FloatArray, *, n: int, sample_rate: float, start: float) -> list[Window]:
    """Samples [begin, end) around impacts, ordered and apart; of too many impacts, even choices.

    Examples
    --------
    >>> windows_around(np.array([0.5, 0.501]), n=100_000, sample_rate=1e4, start=0.0)
    [(4976, 5058)]
    """
    before = max(round(_BEFORE * sample_rate), _LEAST_BEFORE)
    after = max(round(_AFTER * sample_rate), _LEAST_AFTER)
    known = np.sort(times[np.isfinite(times)])
    most = min(_MOST_WINDOWS, max(_MOST_SAMPLES // (before + after), 1))
    if known.size > most:
        known = known[np.round(np.linspace(0, known.size - 1, most)).astype(int)]
    found: list[Window] = []
    for centre in np.round((known - start) * sample_rate).astype(int).tolist():
        begin, end = max(centre - before, 0), min(centre + after, n)
        if begin >= end:
            continue
        if found and begin <= found[-1][1]:
            found[-1] = (found[-1][0], max(end, found[-1][1]))
        else:
            found.append((begin, end))
    return found
