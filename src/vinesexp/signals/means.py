"""Means over groups of samples: all that a slow motion needs, however long the record."""

from __future__ import annotations

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.store import RecordView

_BLOCK = 1 << 20  # samples read at once


def fill_gaps(x: FloatArray) -> FloatArray:
    """The array with NaN and infinite samples replaced by a straight line across each gap.

    Examples
    --------
    >>> fill_gaps(np.array([0.0, np.nan, 2.0]))
    array([0., 1., 2.])
    """
    good = np.isfinite(x)
    if good.all() or not good.any():
        return x if good.all() else np.zeros_like(x)
    index = np.arange(x.size)
    return np.asarray(np.interp(index, index[good], x[good]))


def block_means(x: FloatArray, k: int) -> FloatArray:
    """Means over consecutive groups of k samples; the last incomplete group is left out.

    Examples
    --------
    >>> block_means(np.array([1.0, 3.0, 5.0, 7.0, 9.0]), 2)
    array([2., 6.])
    """
    whole = x.size // k * k
    return np.asarray(x[:whole].reshape(-1, k).mean(axis=1))


def channel_means(record: RecordView, role: str, k: int) -> FloatArray:
    """Means over groups of k samples of a whole channel, read by blocks; gaps are filled."""
    size = max(1, _BLOCK // k) * k
    return np.concatenate(
        [
            block_means(fill_gaps(record.read(role, begin, begin + size)), k)
            for begin in range(0, record.n, size)
        ]
    )
