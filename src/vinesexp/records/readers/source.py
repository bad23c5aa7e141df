"""What every instrument file is once opened: named columns of numbers, read by blocks of rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray
from vinesexp.errors import RecordError

#: Rows read at once: 2 MB a column, so that an hour at 10 kHz never stands in memory.
BLOCK_ROWS = 1 << 18


@dataclass(frozen=True)
class Column:
    """One column of a file.

    Parameters
    ----------
    name : str
        May be empty.
    unit : str or None
        As the header states it.
    interval, start : float or None
        Sample interval and time of the first sample, s, where the file states them for this
        column alone.
    """

    name: str
    unit: str | None = None
    interval: float | None = None
    start: float | None = None


class Source(Protocol):
    """An opened instrument file.

    Attributes
    ----------
    path : Path
        The file.
    format : str
        What it is, in words, for messages.
    columns : tuple of Column
        In the order of their numbers.
    sample_interval : float or None
        s, only where the file itself states it for all columns.
    start : float
        Time of the first row where the file states it, s; else 0.
    time_column : int or None
        The column that the format itself defines as times in seconds.
    stated_rows : int or None
        How many rows the file itself says it has.
    parts : tuple of str
        Names of the records of a file that holds several (`readers.parts`); empty for one.
    losses : tuple of str
        What the file says it holds and does not: a warning each.
    """

    path: Path
    format: str
    columns: tuple[Column, ...]
    sample_interval: float | None
    start: float
    time_column: int | None
    stated_rows: int | None
    parts: tuple[str, ...]
    losses: tuple[str, ...]

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[FloatArray]:
        """The given columns, in the given order, as (n, k) blocks; NaN where a cell is missing.

        Raises
        ------
        RecordError
            A cell that is no number, with its line and column.
        """
        ...

    def locate(self, row: int) -> str:
        """Where row `row` (from 0) stands, in the words of the format: ``"line 124"``."""
        ...


class TableSource:
    """Columns that a library has read whole: the `Source` of formats that come that way.

    Parameters
    ----------
    path, format
        As in `Source`.
    columns : sequence of Column
        In the order of `series`.
    series : sequence of array
        One a column, of any real type.
    sample_interval, start, time_column
        As in `Source`.
    first : int
        What the format calls its first sample: 0, or the line of a sheet.
    place : str
        What the format calls a sample: ``"sample"``, ``"row"``.
    """

    stated_rows: int | None = None
    parts: tuple[str, ...] = ()
    losses: tuple[str, ...] = ()

    def __init__(
        self,
        path: Path,
        format: str,
        columns: Sequence[Column],
        series: Sequence[NDArray[np.generic]],
        *,
        sample_interval: float | None = None,
        start: float = 0.0,
        time_column: int | None = None,
        first: int = 0,
        place: str = "sample",
    ) -> None:
        if not columns:
            raise RecordError(f"holds no columns of numbers ({format})", file=path)
        self.path = path
        self.format = format
        self.columns = tuple(columns)
        self.sample_interval = sample_interval
        self.start = start
        self.time_column = time_column
        self._series = list(series)
        self._first = first
        self._place = place

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[FloatArray]:
        """Blocks of the given columns; see `Source.blocks`."""
        series = [self._series[column] for column in columns]
        lengths = {self.columns[c].name: len(s) for c, s in zip(columns, series, strict=True)}
        require_equal_lengths(lengths, self.path)
        for begin in range(0, len(series[0]), rows):
            block = [one[begin : begin + rows].astype(np.float64) for one in series]
            yield np.stack(block, axis=1)

    def locate(self, row: int) -> str:
        """``"sample 12"`` or ``"row 12"``."""
        return f"{self._place} {row + self._first}"


def require_equal_lengths(lengths: dict[str, int], path: Path) -> None:
    """Refuse columns of different lengths: which sample belongs to which is then unknown."""
    if len(set(lengths.values())) > 1:
        reported = ", ".join(f"'{name}' {n}" for name, n in lengths.items())
        raise RecordError(
            f"columns of different lengths ({reported} samples); export them together", file=path
        )
