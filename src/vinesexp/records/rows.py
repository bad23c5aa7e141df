"""Rows of a source as blocks of complete ones: trimmed at the ends, whole in between, in range.

Missing cells before the first or after the last complete row are trimmed, which is what loggers
write when channels start or stop apart; a hole in the middle would shift everything behind it, so
the record is refused. Samples marked as out of the instrument's range stand at its end instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from vinesexp.errors import RecordError
from vinesexp.records.readers import Floats, Source
from vinesexp.records.readers.labels import marks_to_infinity


@dataclass
class Rows:
    """The complete rows of some columns of a source.

    Parameters
    ----------
    source : Source
        The opened file.
    indexes : sequence of int
        Columns, of which the first `measured` are channels; a column of times may follow.

    Attributes
    ----------
    trimmed : tuple of int
        Rows before the first and after the last complete one; known after the last block.
    found : int
        Rows of the file, likewise.
    overloads : dict
        Number of a column to how many of its samples are out of range, and the row of the first.
    """

    source: Source
    indexes: Sequence[int]
    measured: int
    trimmed: tuple[int, int] = (0, 0)
    found: int = 0
    overloads: dict[int, tuple[int, int]] = field(default_factory=dict)
    _limits: dict[int, tuple[float, float]] = field(default_factory=dict)

    def blocks(self) -> Iterator[tuple[int, Floats]]:
        """Complete rows with the number of their first; what is missing at the ends is trimmed."""
        begun, before, hole, done = False, 0, None, 0
        for raw in self.source.blocks(self.indexes):
            if not len(raw):
                continue
            row, done = done, done + len(raw)
            block = self._within_range(raw, row)
            missing = np.asarray(np.isnan(block).any(axis=1))
            if missing.any():
                whole = np.flatnonzero(~missing)
                if not len(whole):
                    before, hole = (
                        (before, hole if hole is not None else row) if begun else (done, None)
                    )
                    continue
                if begun and (hole is not None or whole[0] > 0):
                    self._refuse_hole(row if hole is None else hole)
                first, last = int(whole[0]), int(whole[-1]) + 1
                if missing[first:last].any():
                    self._refuse_hole(row + first + int(np.argmax(missing[first:last])))
                before = before if begun else row + first
                hole = row + last if last < len(block) else None
                begun, row, block = True, row + first, block[first:last]
            elif hole is not None:
                self._refuse_hole(hole)
            begun = True
            yield row, block
        self.trimmed = (before, done - hole if hole is not None else 0)
        self.found = done

    def _within_range(self, raw: Floats, row: int) -> Floats:
        """Samples marked as out of the instrument's range, at the end of the range instead."""
        block = marks_to_infinity(raw)
        for k, index in enumerate(self.indexes):
            beyond = np.isinf(block[:, k])
            if not beyond.any():
                continue
            first = row + int(np.argmax(beyond))
            if k >= self.measured:
                raise RecordError(
                    "infinite time", file=self.source.path, where=self.source.locate(first)
                )
            low, high = self._range_of(index, first)
            block = block.copy() if block is raw else block
            block[beyond, k] = np.where(block[beyond, k] > 0.0, high, low)
            count, at = self.overloads.get(index, (0, first))
            self.overloads[index] = (count + int(np.count_nonzero(beyond)), at)
        return block

    def _range_of(self, index: int, row: int) -> tuple[float, float]:
        """Least and largest finite sample of a column, from one pass over the file."""
        if index not in self._limits:
            low, high = np.inf, -np.inf
            for raw in self.source.blocks([index]):
                finite = raw[np.abs(raw) < 9e37]
                if len(finite):
                    low, high = min(low, float(finite.min())), max(high, float(finite.max()))
            if low > high:
                raise RecordError(
                    "no sample within the instrument's range; measure with a wider range",
                    file=self.source.path,
                    where=self.name(index),
                )
            self._limits[index] = (low, high)
        return self._limits[index]

    def _refuse_hole(self, row: int) -> None:
        """Name the first missing cell of row `row`."""
        seen = 0
        for raw in self.source.blocks(self.indexes):
            block = marks_to_infinity(raw)
            if seen + len(block) > row:
                column = self.indexes[int(np.argmax(np.isnan(block[row - seen])))]
                raise RecordError(
                    "empty or NaN among the samples; fill the gap, or cut the record before it",
                    file=self.source.path,
                    where=f"{self.source.locate(row)}, {self.name(column)}",
                )
            seen += len(block)

    def emptiest(self) -> str:
        """Which column has no values, as a clause; empty where each has some."""
        for index in self.indexes:
            if not any(np.isfinite(block).any() for block in self.source.blocks([index])):
                return f": {self.name(index)} is empty"
        return ""

    def name(self, index: int) -> str:
        """``"column CH1"``, or its number where it has no name."""
        return f"column {self.source.columns[index].name or index}"
