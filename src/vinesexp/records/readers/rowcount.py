"""Whether every row of a text file holds the cells it should, before its numbers are trusted.

A row with a cell too many (`0.1,1,5,2` for three columns), a quote that is never closed, or zero
bytes left by a logger that lost its power would be read as something else, without a word. Two
passes of plain counting over the bytes find them: 2 ns a byte.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import RecordError
from vinesexp.records.readers.layout import Layout

_CHUNK = 1 << 22
_LONGEST = 1 << 20  # bytes of one line; more is no row of numbers
_NEWLINE, _QUOTE, _BLANK = 10, 34, 32


def require_whole_rows(path: Path, layout: Layout) -> int:
    """Count the rows of data, refusing the first that is not what its neighbours are.

    Raises
    ------
    RecordError
        A row with more cells than columns, an unbalanced quote, zero bytes; with the line.
    """
    if layout.quoted or layout.encoding == "utf-16":
        return _slowly(path, layout)
    count = 0
    line = 0
    for chunk in whole_lines(path, layout.end):
        codes, ends = codes_and_ends(chunk)
        cells, filled, odd = _count(codes, ends, layout)
        lines = np.arange(line, line + len(ends))
        line += len(ends)
        data = lines >= layout.first
        wrong = data & (odd | (cells > layout.width))
        for k in np.flatnonzero(wrong):
            begin = int(ends[k - 1]) + 1 if k else 0
            _judge(path, layout, chunk[begin : int(ends[k])], int(lines[k]) + 1)
        count += int(np.count_nonzero(data & filled))
    return count


def whole_lines(path: Path, end: int = 0) -> Iterator[bytes]:
    """The file in pieces that end with a line; lone carriage returns become line feeds.

    Up to byte `end`, where that is not 0.
    """
    rest = b""
    lone: bool | None = None
    left = end or path.stat().st_size
    with path.open("rb") as stream:
        while chunk := stream.read(min(_CHUNK, left)):
            left -= len(chunk)
            if lone is None:
                lone = b"\n" not in chunk and b"\r" in chunk
            chunk = rest + (chunk.replace(b"\r", b"\n") if lone else chunk)
            cut = chunk.rfind(b"\n") + 1
            rest = chunk[cut:]
            if len(rest) > _LONGEST:
                raise RecordError(
                    "a line of more than a megabyte; export the record as columns of numbers",
                    file=path,
                )
            if cut:
                yield chunk[:cut]
    if rest:
        yield rest


def codes_and_ends(chunk: bytes) -> tuple[NDArray[np.uint8], NDArray[np.intp]]:
    """Bytes of a piece of a file as numbers, and where each of its lines ends."""
    codes = np.frombuffer(chunk, np.uint8)
    ends = np.flatnonzero(codes == _NEWLINE)
    if not len(ends) or ends[-1] != len(codes) - 1:
        ends = np.append(ends, len(codes))
    return codes, ends


def _count(
    codes: NDArray[np.uint8], ends: NDArray[np.int64], layout: Layout
) -> tuple[NDArray[np.int64], NDArray[np.bool_], NDArray[np.bool_]]:
    """For every line: its cells, whether it holds any, and whether odd bytes stand in it."""
    solid = codes > _BLANK
    if layout.delimiter is None:
        starts = solid.copy()
        starts[1:] &= ~solid[:-1]
        cells = _per_line(starts, ends)
        filled = cells > 0
    else:
        code = ord(layout.delimiter)
        cells = _per_line(codes == code, ends) + 1
        # The fast reader counts a line of separators as a row; a line of blanks is none.
        filled = _per_line(solid | (codes == code), ends) > 0
    odd = _per_line((codes == 0) | (codes == _QUOTE), ends) > 0
    return cells, filled, odd


def _per_line(marked: NDArray[np.bool_], ends: NDArray[np.int64]) -> NDArray[np.int64]:
    at = np.searchsorted(np.flatnonzero(marked), ends)
    return np.diff(at, prepend=0)


def _slowly(path: Path, layout: Layout) -> int:
    count = 0
    last = _lines_of_data(path, layout)
    with path.open(encoding=layout.encoding, errors="replace") as stream:
        for number, line in enumerate(islice(stream, last), start=1):
            if number > layout.first and line.strip():
                count += 1
                odd = "\0" in line or line.count('"') % 2
                if odd or len(layout.cells(line)) > layout.width:
                    _judge(path, layout, line.encode(), number)
    return count


def _lines_of_data(path: Path, layout: Layout) -> int | None:
    """Lines up to the last row; None where nothing stands behind it."""
    if not layout.end:
        return None
    if layout.encoding == "utf-16":
        with path.open("rb") as stream:
            return stream.read(layout.end).decode("utf-16", "replace").count("\n")
    return sum(len(codes_and_ends(chunk)[1]) for chunk in whole_lines(path, layout.end))


def _judge(path: Path, layout: Layout, raw: bytes, line: int) -> None:
    """Refuse a suspicious row, unless only remarks or empty cells are too many."""
    where = f"line {line}"
    if b"\0" in raw:
        raise RecordError(
            "zero bytes among the text, as a logger leaves them that lost its power; cut the file "
            "before this line",
            file=path,
            where=where,
        )
    text = raw.decode(layout.encoding, "replace")
    if text.count('"') % 2:
        raise RecordError("a quote that is not closed; correct the line", file=path, where=where)
    cells = layout.cells(text)
    surplus = [cell for cell in cells[layout.width :] if cell]
    if any(layout.is_number(cell) for cell in surplus):
        raise RecordError(
            f"{len(cells)} cells where the rows have {layout.width} ('{text.strip()[:60]}'); "
            "correct the line, or, if the numbers have decimal commas, export with another "
            "delimiter",
            file=path,
            where=where,
        )
