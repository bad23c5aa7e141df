"""What the converter could say: its resolution, and where the signal ran into its end."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.records.store import RecordView

_BLOCK = 1 << 20
_STUCK = 5e-3  # s at the end value: no contact, nor its ringing; the sensor says nothing
_LOOK = 1 << 16  # samples whose differences show the resolution
_PILED = 4.0  # times as many samples at the end value as one step before it


@dataclass(frozen=True)
class Range:
    """Step between neighbouring values, and the values at and beyond which it is clipped.

    `low` and `high` are infinite where nothing is clipped.
    """

    resolution: float
    low: float = -math.inf
    high: float = math.inf

    @property
    def clips(self) -> bool:
        return math.isfinite(self.low) or math.isfinite(self.high)

    def beyond(self, x: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which samples are clipped."""
        return np.asarray((x <= self.low) | (x >= self.high))


def resolution_of(x: np.ndarray) -> float:
    """Smallest step between values that occur; 0 for a constant or a continuous signal.

    Examples
    --------
    >>> resolution_of(np.array([0.1, 0.2, 0.2, 0.5]))
    0.1
    """
    values = np.unique(x[np.isfinite(x)])
    steps = np.diff(values)
    # Two float32 of the same code differ by less than this.
    steps = steps[steps > 1e-6 * max(abs(values[0]), abs(values[-1]))] if steps.size else steps
    return round(float(steps.min()), 15) if steps.size else 0.0


def converter_range(record: RecordView, role: str) -> Range:
    """Resolution of a channel, and its end values if samples pile up there.

    A signal that is not clipped has few samples at its largest value and as many one step
    below. Read by blocks.
    """
    blocks = range(0, record.n, _BLOCK)
    ends = [_ends(record.read(role, begin, begin + _BLOCK)) for begin in blocks]
    low, high = min(end[0] for end in ends), max(end[1] for end in ends)
    step = resolution_of(record.read(role, 0, _LOOK))
    if not low < high or step <= 0.0:
        return Range(step)
    counts = np.zeros((2, 9))
    for begin in blocks:
        x = record.read(role, begin, begin + _BLOCK)
        for row, distance in zip(counts, (x - low, high - x), strict=True):
            near = distance[distance < 8.5 * step]
            row += np.bincount(np.rint(near / step).astype(np.int64), minlength=9)[:9]
    piled = [row[0] >= 3 and row[0] > _PILED * (row[1:].mean() + 1.0) for row in counts]
    return Range(
        step,
        low + 0.5 * step if piled[0] else -math.inf,
        high - 0.5 * step if piled[1] else math.inf,
    )


def read_unstuck(
    record: RecordView, role: str, limits: Range, begin: int, end: int
) -> NDArray[np.float64]:
    """Samples of a channel, NaN where it is stuck at the end of its range."""
    raw = record.read(role, begin, end)
    if not limits.clips or not limits.beyond(raw).any():
        return raw
    long = max(3, round(_STUCK * record.sample_rate))
    low, high = max(0, begin - long), min(record.n, end + long)
    beyond = limits.beyond(record.read(role, low, high))
    edges = np.flatnonzero(np.diff(beyond.astype(np.int8), prepend=0, append=0))
    stuck = np.zeros(beyond.size, dtype=bool)
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        stuck[first:last] = last - first > long
    return np.where(stuck[begin - low : begin - low + raw.size], np.nan, raw)


def _ends(x: np.ndarray) -> tuple[float, float]:
    good = x[np.isfinite(x)]
    return (float(good.min()), float(good.max())) if good.size else (math.inf, -math.inf)
