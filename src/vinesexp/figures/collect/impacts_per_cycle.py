"""Impacts in each cycle of a record, as strips of regimes show them."""

from __future__ import annotations

import numpy as np

from vinesexp.arrays import FloatArray


def impacts_per_cycle(
    times: FloatArray, *, frequency: float, start: float, length: float
) -> FloatArray:
    """Number of impacts in each cycle.

    Parameters
    ----------
    times : ndarray
        Of the impacts, s.
    frequency : float
        Of the oscillation, Hz; 0: there are no cycles.
    start, length : float
        Of the record, s.

    Examples
    --------
    >>> impacts_per_cycle(np.arange(0.1, 4.0, 0.5), frequency=1.0, start=0.0, length=3.0)
    array([2., 2., 2.])
    """
    edges = cycle_edges(times, frequency or 1.0, start=start, cycles=int(length * frequency))
    return np.histogram(times, edges)[0].astype(float) if edges.size > 1 else np.empty(0)


def cycle_edges(times: FloatArray, frequency: float, *, start: float, cycles: int) -> FloatArray:
    """Edges of the cycles, where impacts are rarest: one on an edge would count in either cycle."""
    turns = np.exp(4j * np.pi * frequency * (times - start))  # two impacts a cycle: half turns
    middle = float(np.angle(turns.mean())) / (4.0 * np.pi * frequency) if times.size else 0.0
    return np.asarray(start + (np.arange(cycles + 1) + 0.25) / frequency + middle)
