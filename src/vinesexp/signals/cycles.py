"""Amplitude, cycle by cycle: half the swing of the displacement in each period."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vinesexp.arrays import FloatArray

_BLOCK = 1 << 20  # samples read at once


def cycle_amplitudes(
    x: FloatArray, sample_rate: float, frequency: float
) -> tuple[FloatArray, FloatArray]:
    """Middle time (s from the first sample) and half swing of each cycle.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Displacement in any unit; an offset does no harm.
    sample_rate, frequency : float
        Hz.

    Examples
    --------
    >>> t = np.arange(1000) / 1000.0
    >>> _, a = cycle_amplitudes(np.sin(2 * np.pi * 10.0 * t), 1000.0, 10.0)
    >>> bool(np.all(np.abs(a - 1.0) < 1e-3)), len(a)
    (True, 10)
    """
    return cycles_from(lambda begin, end: x[begin:end], len(x), sample_rate, frequency)


def cycles_from(
    read: Callable[[int, int], FloatArray], n: int, sample_rate: float, frequency: float
) -> tuple[FloatArray, FloatArray]:
    """`cycle_amplitudes` of a displacement of n samples that is read by blocks of cycles."""
    length = sample_rate / frequency
    edges = np.round(np.arange(0.0, n + 1e-9, length)).astype(np.int64)
    edges = edges[edges <= n]
    if len(edges) < 2:
        return np.empty(0), np.empty(0)
    together = max(1, int(_BLOCK / length))  # cycles
    swings = []
    for first in range(0, len(edges) - 1, together):
        own = edges[first : first + together + 1]
        x = read(int(own[0]), int(own[-1]))
        begin = own[:-1] - own[0]
        swings.append(np.maximum.reduceat(x, begin) - np.minimum.reduceat(x, begin))
    middle = np.asarray(0.5 * (edges[:-1] + edges[1:]) / sample_rate, dtype=np.float64)
    return middle, 0.5 * np.concatenate(swings)


def time_to_level(time: FloatArray, amplitude: FloatArray, level: float) -> float:
    """When the amplitude falls below `level` for good, interpolated; NaN if it does not.

    Examples
    --------
    >>> time_to_level(np.array([0.0, 1.0, 2.0]), np.array([3.0, 2.0, 1.0]), 1.5)
    1.5
    """
    above = np.flatnonzero(amplitude > level)
    if above.size == 0 or above[-1] + 1 >= amplitude.size:
        return float("nan")
    i = int(above[-1])
    share = (amplitude[i] - level) / (amplitude[i] - amplitude[i + 1])
    return float(time[i] + share * (time[i + 1] - time[i]))
