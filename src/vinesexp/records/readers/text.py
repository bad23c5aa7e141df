"""Text files of oscilloscopes and data loggers: CSV of any kind, LabVIEW .lvm, plain columns."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path

import numpy as np

from vinesexp.errors import RecordError
from vinesexp.records.readers.labels import unit_of_label
from vinesexp.records.readers.layout import Layout, find_layout
from vinesexp.records.readers.source import BLOCK_ROWS, Column, Floats

NAME = "text (CSV, TXT, LabVIEW LVM)"

#: What stands for a missing sample; every other word in a cell is a mistake.
_MISSING = ["", "NaN", "nan", "NAN", "-NaN", "-nan"]


def recognises(head: bytes, suffix: str) -> bool:
    """Text has no zero bytes, unless it is UTF-16, which begins with its mark."""
    return head[:2] in (b"\xff\xfe", b"\xfe\xff") or b"\0" not in head


def open_file(path: Path) -> TextSource:
    """Open a text file; RecordError where it holds no columns of numbers."""
    return TextSource(path)


class TextSource:
    """A text file: one row a sample. The interface is `readers.source.Source`."""

    format = "text"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.layout: Layout = find_layout(path)
        self.columns = self.layout.columns
        self.sample_interval: float | None = None
        self.start = 0.0
        self.time_column: int | None = None
        preamble = {cells[0]: cells for cells in self.layout.preamble if cells}
        if "LabVIEW Measurement" in preamble:
            self._labview(preamble)
        else:
            self._increment()

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[Floats]:
        """Blocks of the given columns; see `Source.blocks`."""
        import pandas as pd

        layout = self.layout
        wanted = sorted(set(columns))
        order = [wanted.index(column) for column in columns]
        done = 0
        try:
            with pd.read_csv(
                self.path,
                sep=r"\s+" if layout.delimiter is None else layout.delimiter,
                decimal=layout.decimal,
                encoding=layout.encoding,
                encoding_errors="replace",
                header=None,
                names=[f"c{column}" for column in wanted],  # numbers would mean positions
                usecols=wanted,
                index_col=False,
                skiprows=layout.first,
                skipinitialspace=True,
                na_values=_MISSING,
                keep_default_na=False,
                dtype=np.float64,
                engine="c",
                chunksize=rows,
            ) as reader:
                for chunk in reader:
                    yield chunk.to_numpy()[:, order]
                    done += len(chunk)
        except (ValueError, pd.errors.ParserError) as error:
            raise self._bad_cell(wanted, done, error) from None

    def locate(self, row: int) -> str:
        """``"line 12"``, counted as an editor counts; blank lines between rows are no rows."""
        found = next(islice(self._rows(), row, None), None)
        return f"line {found[0]}" if found else f"row {row}"

    def _rows(self) -> Iterator[tuple[int, str]]:
        """Line number (from 1) and text of every row of data."""
        blank = " " if self.layout.delimiter == "\t" else " \t"
        with self.path.open(encoding=self.layout.encoding, errors="replace") as stream:
            for number, line in enumerate(stream, start=1):
                line = line.rstrip("\n")
                if number > self.layout.first and line.strip(blank):
                    yield number, line

    def _bad_cell(self, wanted: list[int], done: int, error: Exception) -> RecordError:
        """The first cell, from row `done` on, that made the fast reader give up."""
        sign = "comma" if self.layout.decimal == "," else "point"
        for number, line in islice(self._rows(), done, None):
            cells = self.layout.cells(line)
            for column in wanted:
                cell = cells[column] if column < len(cells) else ""
                if cell not in _MISSING and not self.layout.is_number(cell):
                    name = self.columns[column].name or str(column)
                    return RecordError(
                        f"found '{cell[:40]}', expected a number with decimal {sign}; correct the "
                        "cell or cut the record",
                        file=self.path,
                        where=f"line {number}, column {name}",
                    )
        return RecordError(f"cannot be read as columns of numbers ({error})", file=self.path)

    def _increment(self) -> None:
        """Oscilloscopes that count rows instead of timing them: `X,CH1,Start,Increment`."""
        for names, values in zip(self.layout.preamble, self.layout.preamble[1:], strict=False):
            stated = dict(zip((name.lower() for name in names), values, strict=False))
            interval = self._number(stated.get("increment", ""))
            if interval is not None and interval > 0.0:
                self.sample_interval = interval
                self.start = self._number(stated.get("start", "")) or 0.0

    def _labview(self, preamble: dict[str, tuple[str, ...]]) -> None:
        """LabVIEW measurement files: units, and the interval where there is no time column."""
        units = preamble.get("Y_Unit_Label", ())
        columns = list(self.columns)
        for j, column in enumerate(columns):
            label = units[j] if 0 < j < len(units) else ""
            if column.name == "X_Value":
                label = "s"
            columns[j] = Column(column.name, unit_of_label(label) or label or column.unit)
        self.columns = tuple(columns)
        has_times = preamble.get("X_Columns", ("", "No"))[1] != "No"
        times = [j for j, column in enumerate(columns) if column.name == "X_Value"]
        if has_times and times:
            self.time_column = times[0]
        intervals = {self._number(cell) for cell in preamble.get("Delta_X", ())[1:] if cell}
        if len(intervals) == 1:
            self.sample_interval = intervals.pop()

    def _number(self, cell: str) -> float | None:
        """A cell of the header as a number, or None."""
        try:
            value = float(cell.replace(",", ".") if self.layout.decimal == "," else cell)
        except ValueError:
            return None
        return value if math.isfinite(value) else None
