"""Text files of oscilloscopes, analysers and data loggers: CSV of any kind, plain columns."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np

from vinesexp.errors import ParameterError, RecordError
from vinesexp.records.readers import labview
from vinesexp.records.readers.aside import file_aside
from vinesexp.records.readers.blocks import Block, find_blocks, lines_of_block
from vinesexp.records.readers.header import find_layout
from vinesexp.records.readers.labels import (
    is_overload,
    only_time,
    overload_value,
    unit_of_label,
)
from vinesexp.records.readers.layout import Layout
from vinesexp.records.readers.parts import file_of, number_of_part, part_of
from vinesexp.records.readers.preamble import Stated, read_preamble, words_over_values
from vinesexp.records.readers.rowcount import require_whole_rows
from vinesexp.records.readers.source import BLOCK_ROWS, Column, Floats
from vinesexp.records.readers.stamps import seconds_since
from vinesexp.units import UNITS

NAME = "text (CSV, TXT, LabVIEW LVM)"

#: What stands for a missing sample; every other word in a cell is a mistake.
_MISSING = ["", "NaN", "nan", "NAN", "-NaN", "-nan"]


def recognises(head: bytes, suffix: str) -> bool:
    """Text has no zero bytes, unless it is UTF-16, which begins with its mark."""
    return head[:2] in (b"\xff\xfe", b"\xfe\xff") or b"\0" not in head.rstrip(b"\0")


def open_file(path: Path) -> TextSource:
    """Open a text file, or one of its blocks; RecordError where it holds no columns of numbers."""
    file = file_of(path)
    layout = find_layout(file)
    found = find_blocks(file, layout)
    if found:
        return BlockSource(path, layout, found)
    if part_of(path):
        raise RecordError("holds one block of rows; leave away what follows #", file=path)
    return TextSource(file, layout)


class TextSource:
    """A text file: one row a sample. The interface is `readers.source.Source`."""

    format: str = "text"
    parts: tuple[str, ...] = ()
    losses: tuple[str, ...] = ()

    def __init__(self, path: Path, layout: Layout | None = None) -> None:
        self.path = path  # for messages
        self._read_from = path
        self.layout: Layout = layout or find_layout(path)
        self.columns: tuple[Column, ...] = self.layout.columns
        self.sample_interval: float | None = None
        self.start = 0.0
        self.time_column: int | None = None
        self.stated_rows: int | None = None
        self._rows_found: int | None = None
        if self.layout.behind:
            count = len(self.layout.behind)
            shown = self.layout.behind[0][:60]
            self.losses = (
                f"{count} line{'s' * (count > 1)} behind the last row hold no data ('{shown}')",
            )
        self._first_stamps: dict[int, str] = {}
        lines = [list(cells) for cells in self.layout.preamble]
        if labview.recognises(lines):
            self.columns, self.time_column, self.sample_interval = labview.columns_and_sampling(
                self.layout, lines
            )
            self.stated_rows = labview.stated_rows(self.layout, lines)
        else:
            self._complete(lines)

    @property
    def unpaired(self) -> str:
        """Why the names of the file cannot be paired with its columns; empty where they are."""
        return self.layout.unpaired

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[Floats]:
        """Blocks of the given columns; see `Source.blocks`."""
        if self._rows_found is None:
            self._rows_found = require_whole_rows(self._read_from, self.layout)
        wanted = sorted(set(columns))
        order = [wanted.index(column) for column in columns]
        done = 0
        for block in self._fast(wanted, rows):
            if block is None:
                break
            done += len(block)
            yield block[:, order]
        else:
            if done != self._rows_found:
                raise RecordError(
                    f"{self._rows_found} rows, of which {done} could be read; export the record "
                    "again without quotes",
                    file=self.path,
                )
            return
        for block in self._patient(wanted, done, rows):
            yield block[:, order]

    def locate(self, row: int) -> str:
        """``"line 12"``, counted as an editor counts; blank lines between rows are no rows."""
        found = next(islice(self._rows(), row, None), None)
        return f"line {found[0]}" if found else f"row {row}"

    def _fast(self, wanted: list[int], rows: int) -> Iterator[Floats | None]:
        """Blocks as the compiled reader gives them; None where it finds a word among numbers."""
        import pandas as pd

        layout = self.layout
        if set(wanted) & set(layout.stamps):
            yield None
            return
        try:
            with pd.read_csv(
                self._read_from,
                sep=r"\s+" if layout.delimiter is None else layout.delimiter,
                decimal=layout.decimal,
                encoding=layout.encoding,
                encoding_errors="replace",
                compression=None,  # what the name ends with says nothing
                header=None,
                names=[f"c{column}" for column in wanted],  # numbers would mean positions
                usecols=wanted,
                nrows=self._rows_found,
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
                    yield chunk.to_numpy(dtype=np.float64)
        except (ValueError, TypeError, OverflowError, pd.errors.ParserError):
            yield None

    def _patient(self, wanted: list[int], done: int, rows: int) -> Iterator[Floats]:
        """Blocks from row `done` on, cell by cell: words of overload, dates and times of day."""
        lines: list[tuple[int, list[str]]] = []
        for number, line in islice(self._rows(), done, self._rows_found):
            lines.append((number, self.layout.cells(line)))
            if len(lines) == rows:
                yield self._values(wanted, lines)
                lines = []
        if lines:
            yield self._values(wanted, lines)

    def _values(self, wanted: list[int], lines: list[tuple[int, list[str]]]) -> Floats:
        block = np.empty((len(lines), len(wanted)))
        for k, column in enumerate(wanted):
            cells = [row[column] if column < len(row) else "" for _, row in lines]
            if column in self.layout.stamps:
                first = self._first_stamps.setdefault(
                    column, next((cell for cell in cells if cell), "")
                )
                try:
                    block[:, k] = seconds_since(cells, first)
                except ParameterError as error:
                    where = f"{self.locate(0)} or below, column {self._name(column)}"
                    raise RecordError(error.problem, file=self.path, where=where) from None
                continue
            for i, cell in enumerate(cells):
                block[i, k] = self._value(cell, lines[i][0], column)
        return block

    def _value(self, cell: str, line: int, column: int) -> float:
        if cell in _MISSING:
            return float("nan")
        if self.layout.is_number(cell):
            return float(cell.replace(",", ".") if self.layout.decimal == "," else cell)
        if is_overload(cell):
            return overload_value(cell)
        sign = "comma" if self.layout.decimal == "," else "point"
        raise RecordError(
            f"found '{cell[:40]}', expected a number with decimal {sign}; correct the cell or cut "
            "the record",
            file=self.path,
            where=f"line {line}, column {self._name(column)}",
        )

    def _name(self, column: int) -> str:
        return self.columns[column].name or str(column)

    def _rows(self) -> Iterator[tuple[int, str]]:
        """Line number (from 1) and text of every row of data."""
        blank = " " if self.layout.delimiter == "\t" else " \t"
        with self._read_from.open(encoding=self.layout.encoding, errors="replace") as stream:
            for number, line in enumerate(stream, start=1):
                line = line.rstrip("\n")
                if number > self.layout.first and line.strip(blank):
                    yield number, line

    def _complete(self, lines: list[list[str]]) -> None:
        """Interval, start, names and units from what stands above the data or beside it."""
        stated = self._beside() or read_preamble(self.layout, lines)
        counted = words_over_values(self.layout, lines)
        if counted is not None:
            self.sample_interval, self.start = counted
        elif not stated.contradictory:
            self.sample_interval, self.start = stated.interval, stated.start or 0.0
        self.stated_rows = stated.rows
        for j in self.layout.stamps:
            self._rename(j, self.columns[j].name, "s")
        self.time_column = only_time(self.columns)
        self._name_from(stated)

    def _beside(self) -> Stated | None:
        """Settings in the columns before the data, as Tektronix writes them: `Source,CH1,,t,v`."""
        filled = [j for j, column in enumerate(self.columns) if column.name]
        if filled or self.layout.delimiter is None:
            return None
        rows = islice(self._rows(), 40)
        cells = [self.layout.cells(line)[:3] for _, line in rows]
        words = [row for row in cells if row and row[0] and not self.layout.is_number(row[0])]
        if not words:
            return None
        stated = read_preamble(self.layout, words)
        data = self._data_columns()
        if len(data) == 2:
            self._rename(data[0], "Time", stated.time_unit or "s")
            self._rename(data[1], (stated.names or ["CH1"])[0], (stated.units or [""])[0])
        return stated

    def _data_columns(self) -> list[int]:
        row = next(self._rows(), (0, ""))[1]
        return [j for j, cell in enumerate(self.layout.cells(row)) if self._is_data(j, cell)]

    def _is_data(self, j: int, cell: str) -> bool:
        return 2 <= j < len(self.columns) and self.layout.is_value(cell)

    def _name_from(self, stated: Stated) -> None:
        """Names that are only units, `Second,Volt`, give way to those that the preamble states."""
        words = [unit_of_label(column.name) for column in self.columns]
        if not words or None in words or self.time_column is not None:
            return
        names = ["Time", *stated.names] if words[0] in UNITS["time"] else stated.names
        for j, unit in enumerate(words):
            name = names[j] if len(names) == len(words) else self.columns[j].name
            self._rename(j, name, unit or "")
        if words[0] in UNITS["time"] and words.count(words[0]) == 1:
            self.time_column = 0

    def _rename(self, j: int, name: str, unit: str) -> None:
        columns = list(self.columns)
        columns[j] = replace(columns[j], name=name, unit=unit_of_label(unit) or unit or None)
        self.columns = tuple(columns)


class BlockSource(TextSource):
    """One of several blocks of a text file, the first where none is named."""

    def __init__(self, path: Path, layout: Layout, blocks: Sequence[Block]) -> None:
        file = file_of(path)
        block = blocks[number_of_part(path, len(blocks), "blocks of rows")]
        self._text, text = file_aside()
        self._text.writelines(line.encode() for line in lines_of_block(file, layout, block))
        self._text.flush()
        self._whole = path
        self._shift = 0
        try:
            super().__init__(text)
        except RecordError as error:
            raise self._meant(error) from None
        self._shift = block.first - self.layout.first
        self._read_from, self.path = self.path, path
        self.parts = tuple(str(k + 1) for k in range(len(blocks)))

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[Floats]:
        """Blocks of the given columns; see `Source.blocks`."""
        try:
            yield from super().blocks(columns, rows)
        except RecordError as error:
            raise self._meant(error) from None

    def locate(self, row: int) -> str:
        """``"line 120"`` of the whole file."""
        return self._shifted(super().locate(row))

    def _shifted(self, where: str) -> str:
        return re.sub(r"(?<=line )\d+", lambda found: str(int(found[0]) + self._shift), where)

    def _meant(self, error: RecordError) -> RecordError:
        where = self._shifted(error.where) if error.where else None
        return RecordError(error.problem, file=self._whole, where=where)
