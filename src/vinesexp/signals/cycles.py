"""Amplitude, cycle by cycle: half the swing of the displacement in each period."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def cycle_amplitudes(x: Floats, sample_rate: float, frequency: float) -> tuple[Floats, Floats]:
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
    length = sample_rate / frequency
    edges = np.round(np.arange(0.0, len(x) + 1e-9, length)).astype(int)
    edges = edges[edges <= len(x)]
    if len(edges) < 2:
        return np.empty(0), np.empty(0)
    whole = x[: edges[-1]]
    high = np.maximum.reduceat(whole, edges[:-1])
    low = np.minimum.reduceat(whole, edges[:-1])
    return 0.5 * (edges[:-1] + edges[1:]) / sample_rate, 0.5 * (high - low)


def time_to_level(time: Floats, amplitude: Floats, level: float) -> float:
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
