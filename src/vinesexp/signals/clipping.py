"""What the converter could say: its resolution, and where the signal ran into its end."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray, runs_of
from vinesexp.records.stored.store import RecordView

#: Of a range what stands among the attributes of a file, and its name there.
_STORED = {"resolution": "resolution", "low": "range_low", "high": "range_high"}
_LOOK = 1 << 16  # samples that show the steps of a converter
_MOVES = 3.0  # steps of the converter by which a signal goes on where it repeats no value by chance


@dataclass(frozen=True)
class Range:
    """Step between neighbouring values, and the values at and beyond which it is clipped.

    `low` and `high` are infinite where nothing is clipped.
    """

    resolution: float = 0.0
    low: float = -math.inf
    high: float = math.inf

    @property
    def clips(self) -> bool:
        return math.isfinite(self.low) or math.isfinite(self.high)

    def beyond(self, x: FloatArray) -> BoolArray:
        """Which samples are clipped."""
        return np.asarray((x <= self.low) | (x >= self.high))

    def as_attributes(self, role: str) -> dict[str, object]:
        """For the attributes of a file; `range_in` reads them."""
        return {f"{role}_{name}": getattr(self, own) for own, name in _STORED.items()}


def range_in(attributes: Mapping[str, Any], role: str) -> Range:
    """The range of a channel that was written into a file's attributes; unknown: not clipped."""
    stored = {own: attributes.get(f"{role}_{name}") for own, name in _STORED.items()}
    return Range(**{own: float(value) for own, value in stored.items() if value is not None})


def resolution_of(x: np.ndarray) -> float:
    """Smallest step between values that occur at the beginning; 0: a constant, a continuous signal.

    Examples
    --------
    >>> resolution_of(np.array([0.1, 0.2, 0.2, 0.5]))
    0.1
    """
    x = x[:_LOOK]
    values = np.unique(x[np.isfinite(x)])
    steps = np.diff(values)
    # Two float32 of the same code differ by less than this.
    steps = steps[steps > 1e-6 * max(abs(values[0]), abs(values[-1]))] if steps.size else steps
    return round(float(steps.min()), 15) if steps.size else 0.0


def resolution_in(record: RecordView, role: str) -> float:
    """`resolution_of` a channel."""
    return resolution_of(record.read(role, 0, _LOOK))


def repeated(x: FloatArray) -> BoolArray:
    """Which samples repeat the one before although the signal moves: frames that came too late.

    A camera or a phone that has no new value gives its last one. Where a signal goes on by more
    than three of its own steps before and after, equal neighbours are no chance.

    Examples
    --------
    >>> repeated(np.array([0.0, 0.31, 0.31, 0.9, 1.0, 0.95])).tolist()
    [False, False, True, False, False, False]
    """
    first = np.flatnonzero(np.append(x.size > 0, x[1:] != x[:-1]))
    length = np.diff(np.append(first, x.size))
    step = np.abs(np.diff(x[first]))
    least = np.minimum(np.append(np.inf, step), np.append(step, np.inf))
    late = (length > 1) & (least > _MOVES * resolution_of(x)) & np.isfinite(least)
    marked = np.repeat(late, length)
    marked[first] = False
    return np.asarray(marked)


def converter_range(record: RecordView, role: str, *, piled: float = 4.0) -> Range:
    """Resolution of a channel, and its end values if samples pile up there.

    Parameters
    ----------
    record, role
        The channel.
    piled : float
        Clipped if so many times as many samples lie in the last step as in those before it.

    A signal that is not clipped has few samples at its largest value and as many one step
    below. Read by blocks.
    """
    ends = [_ends(x) for _, x in record.blocks(role)]
    low, high = min(end[0] for end in ends), max(end[1] for end in ends)
    step = resolution_in(record, role)
    if not low < high or step <= 0.0:
        return Range(step)
    counts = np.zeros((2, 9))
    for _, x in record.blocks(role):
        for row, distance in zip(counts, (x - low, high - x), strict=True):
            near = distance[distance < 8.5 * step]
            row += np.bincount(np.rint(near / step).astype(np.int64), minlength=9)[:9]
    over = [row[0] >= 3 and row[0] > piled * (row[1:].mean() + 1.0) for row in counts]
    return Range(
        step,
        low + 0.5 * step if over[0] else -math.inf,
        high - 0.5 * step if over[1] else math.inf,
    )


def read_unstuck(
    record: RecordView, role: str, limits: Range, begin: int, end: int, *, stuck: float = 5e-3
) -> FloatArray:
    """Samples of a channel, NaN where it is stuck at the end of its range for `stuck` s or more."""
    raw = record.read(role, begin, end)
    if not limits.clips or not limits.beyond(raw).any():
        return raw
    long = max(3, round(stuck * record.sample_rate))
    low, high = max(0, begin - long), min(record.n, end + long)
    beyond = limits.beyond(record.read(role, low, high))
    held = np.zeros(beyond.size, dtype=bool)
    for first, last in runs_of(beyond):
        held[first:last] = last - first > long
    return np.where(held[begin - low : begin - low + raw.size], np.nan, raw)


def _ends(x: np.ndarray) -> tuple[float, float]:
    good = x[np.isfinite(x)]
    return (float(good.min()), float(good.max())) if good.size else (math.inf, -math.inf)
