"""What every instrument file is once opened: named columns of numbers, read by blocks of rows.

One record of a file that holds several is ``scope.trc#3``, ``book.xlsx#Run 2``, ``log.lvm#2``: the
part stands behind the file's name, after `#`: a number from 1 (segments, frames, blocks of
rows), or the name of a sheet. A file whose own name holds `#` is that file.

Text that a reader lays aside to read it as a file leaves nothing behind, however it ends. Readers
in a child process are ended by force, and so nothing of theirs can be relied on to remove a file
later. The file therefore has no name in any folder; it is opened by its number.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray
from vinesexp.errors import RecordError


def file_of(path: Path) -> Path:
    """The file that a path names, without the part.

    Examples
    --------
    >>> file_of(Path("raw/scope.trc#3")).name, part_of(Path("raw/scope.trc#3"))
    ('scope.trc', '3')
    """
    name, mark, _ = path.name.rpartition("#")
    return path.with_name(name) if mark and name and not path.exists() else path


def part_of(path: Path) -> str:
    """The part that a path names; empty where it names the whole file."""
    file = file_of(path)
    return path.name[len(file.name) + 1 :] if file != path else ""


def number_of_part(path: Path, count: int, what: str) -> int:
    """The part of a path as an index from 0; the first where it names none.

    Raises
    ------
    RecordError
        There is no such part.
    """
    part = part_of(path)
    if not part:
        return 0
    if part.isdecimal() and 1 <= int(part) <= count:
        return int(part) - 1
    raise RecordError(f"no part '{part}': it holds {count} {what}, from 1")


def numbered(count: int) -> tuple[str, ...]:
    """Names of the parts of a file that counts them; none where it holds one record."""
    return tuple(str(k + 1) for k in range(count)) if count > 1 else ()


def require_one(source: Source) -> None:
    """Refuse a file of several records of which none is named."""
    parts, name = source.parts, source.path.name
    if not parts or part_of(source.path):
        return
    shown = ", ".join(f"{name}#{part}" for part in parts[:2])
    more = f" to {name}#{parts[-1]}" if len(parts) > 2 else ""
    raise RecordError(
        f"holds {len(parts)} records; say which one in the column file: {shown}{more}"
    )


def file_aside() -> tuple[IO[bytes], Path]:
    """An empty file to write to, and the path under which this process can open it again.

    It is gone when the file is closed, or when the process and its forks have ended.

    Examples
    --------
    >>> file, path = file_aside()
    >>> _ = file.write(b"0,1")
    >>> file.flush()
    >>> path.read_text()
    '0,1'
    """
    if Path("/proc/self/fd").is_dir():
        file: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115
        return file, Path(f"/proc/self/fd/{file.fileno()}")
    named = tempfile.NamedTemporaryFile()  # noqa: SIM115
    return named, Path(named.name)  # macOS: gone when it is closed


#: Columns of a matrix; one with more is no record of an instrument.
WIDEST = 2000
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


def meant_by_single(interval: float) -> float:
    """An interval that went through single precision: the short decimal number that it means.

    Examples
    --------
    >>> meant_by_single(float(np.float32(8e-8))), meant_by_single(2.5e-9 / 3.0)
    (8e-08, 8.333333333333334e-10)
    """
    if float(np.float32(interval)) != interval:
        return interval
    return float(np.format_float_scientific(np.float32(interval)))


@dataclass(eq=False)
class Source:
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
        Names of the records of a file that holds several; empty for one.
    losses : tuple of str
        What the file says it holds and does not: a warning each.
    unpaired : str
        Why names cannot be paired with the columns; empty where they are.
    """

    path: Path
    format: str
    _: KW_ONLY
    columns: tuple[Column, ...] = ()
    sample_interval: float | None = None
    start: float = 0.0
    time_column: int | None = None
    stated_rows: int | None = None
    parts: tuple[str, ...] = ()
    losses: tuple[str, ...] = ()
    unpaired: str = ""

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[FloatArray]:
        """The given columns, in the given order, as (n, k) blocks; NaN where a cell is missing.

        Raises
        ------
        RecordError
            A cell that is no number, with its line and column.
        """
        raise NotImplementedError

    def locate(self, row: int) -> str:
        """Where row `row` (from 0) stands, in the words of the format: ``"line 124"``."""
        return f"sample {row}"


@dataclass(frozen=True)
class Lazy:
    """Samples of one column that are read and converted as they are asked for.

    Parameters
    ----------
    length : int
    read : callable
        The samples of a slice, whose ends are numbers.
    """

    length: int
    read: Callable[[slice], NDArray[Any]]

    def __len__(self) -> int:
        return self.length

    def __getitem__(self, rows: slice) -> NDArray[Any]:
        return self.read(rows)


#: Samples of one column.
Series = NDArray[Any] | Lazy


@dataclass(eq=False)
class TableSource(Source):
    """Columns that can be sliced, which a library has read whole or reads as they are asked for.

    Parameters
    ----------
    path, format, sample_interval, start, time_column, stated_rows, parts, losses
        As in `Source`.
    table : sequence of pairs
        Each column with its samples, of any real type.
    first : int
        What the format calls its first sample: 0, or the line of a sheet.
    place : str
        What the format calls a sample: ``"sample"``, ``"row"``.
    """

    table: Sequence[tuple[Column, Series]]
    _: KW_ONLY
    first: int = 0
    place: str = "sample"

    def __post_init__(self) -> None:
        self.columns = tuple(column for column, _ in self.table)
        if not self.columns:
            raise RecordError(f"holds no columns of numbers ({self.format})")
        # Not a number: a column of which several are stated; who asks for it is told.
        stated = [c.interval for c in self.columns if not math.isnan(c.interval or 0.0)]
        for interval in (self.sample_interval, *stated):
            if interval is not None and not 0.0 < interval < math.inf:
                raise RecordError(f"states an interval of {interval:g} s; save the record again")

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[FloatArray]:
        """Blocks of the given columns; see `Source.blocks`."""
        series = [self.table[column][1] for column in columns]
        length = len(series[0])
        if any(len(one) != length for one in series):  # which sample belongs to which is unknown
            lengths = ((self.columns[c].name, len(self.table[c][1])) for c in columns)
            reported = ", ".join(f"'{name}' {n}" for name, n in lengths)
            raise RecordError(
                f"columns of different lengths ({reported} samples); export them together"
            )
        for begin in range(0, length, rows):
            part = slice(begin, min(begin + rows, length))
            yield np.stack([one[part].astype(np.float64) for one in series], axis=1)

    def locate(self, row: int) -> str:
        """``"sample 12"`` or ``"row 12"``."""
        return f"{self.place} {row + self.first}"


def columns_of(name: str, values: NDArray[Any]) -> Iterator[tuple[str, NDArray[Any]]]:
    """A vector by its name, a matrix as several columns along its longer axis.

    Examples
    --------
    >>> [name for name, _ in columns_of("data", np.zeros((2, 9)))]
    ['data/0', 'data/1']
    """
    if values.ndim == 1 or min(values.shape) == 1:
        yield name, values.reshape(-1)
    elif min(values.shape) <= WIDEST:
        table = values if values.shape[0] >= values.shape[1] else values.T
        for k in range(table.shape[1]):
            yield f"{name}/{k}" if name else str(k), table[:, k]


def bytes_behind(path_size: int, end: int, least: int = 1) -> tuple[str, ...]:
    """What is said of bytes after the samples that a file states, from `least` on."""
    behind = path_size - end
    return (f"{behind} bytes after the samples that it states are not read",) * (behind >= least)
