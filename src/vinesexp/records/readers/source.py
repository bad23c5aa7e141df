"""What every instrument file is once opened: named columns of numbers, read by blocks of rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Rows read at once: 2 MB a column, so that an hour at 10 kHz never stands in memory.
BLOCK_ROWS = 1 << 18


@dataclass(frozen=True)
class Column:
    """One column of a file: its name (may be empty) and the unit its header states, if any."""

    name: str
    unit: str | None = None


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
        s, only where the file itself states it.
    start : float
        Time of the first row where the file states it, s; else 0.
    time_column : int or None
        The column that the format itself defines as times in seconds.
    """

    path: Path
    format: str
    columns: tuple[Column, ...]
    sample_interval: float | None
    start: float
    time_column: int | None

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[Floats]:
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
