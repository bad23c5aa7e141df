"""Text files with several blocks of rows one after another, each under lines of its own.

LabVIEW writes a file of several segments so, and programs that append record to record. What
stands above the first block belongs to all of them, but for what a block states itself.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from vinesexp.records.readers.layout import Layout
from vinesexp.records.readers.rowcount import codes_and_ends, whole_lines

_FEWEST = 3  # rows of a block; what follows fewer is a remark
_MOST = 0.2  # stretches of words for each row: more are rows with text in them
_WORDS = np.zeros(256, dtype=bool)
_WORDS[[*range(65, 91), *range(97, 123), *b'#*%"[']] = True


@dataclass(frozen=True)
class Block:
    """Lines of one block, from 0: its own header, its first row, and the line after its last."""

    header: int
    first: int
    end: int


def find_blocks(path: Path, layout: Layout) -> list[Block]:
    """The blocks of rows of a text file; one where the file is as most are.

    Lines between rows divide them if they hold words alone, and either are several, or follow a
    blank line, or repeat what stands above the first block, be it counted (``Track 2``): one bad
    row is none of these.
    """
    if layout.encoding == "utf-16":
        return []
    worded, blank, total = _lines_without_numbers(path)
    after = [i for i in worded if i >= layout.first]
    gaps = list(_runs(sorted({*after, *(i for i in blank if i > layout.first)})))
    if not after or len(gaps) > _MOST * (total - layout.first):
        return []
    texts = _texts(path, layout, set(after) | {layout.first - 1})
    names = texts.get(layout.first - 1, "")
    starts: list[tuple[int, int]] = []
    for begin, end in gaps:
        words = [texts[i] for i in range(begin, end) if i in texts]
        cells = [[cell for cell in layout.cells(text) if cell] for text in words]
        plain = any(row and not any(layout.is_value(cell) for cell in row) for row in cells)
        again = bool(_uncounted(names)) and [_uncounted(text) for text in words] == [
            _uncounted(names)
        ]
        if (again or (plain and end - begin > 1)) and end < total:
            starts.append((begin, end))
    bounds = [(layout.first, layout.first), *starts, (total, total)]
    found = [
        Block(bounds[k][0], bounds[k][1], bounds[k + 1][0])
        for k in range(len(bounds) - 1)
        if bounds[k + 1][0] - bounds[k][1] >= _FEWEST
    ]
    return found if len(found) > 1 else []


def lines_of_block(path: Path, layout: Layout, block: Block) -> Iterator[str]:
    """A block as a text file of its own: what holds for all, its header, its rows."""
    with path.open(encoding=layout.encoding, errors="replace", newline=None) as stream:
        common = list(islice(stream, layout.first))
        own = list(islice(stream, block.header - layout.first, block.first - layout.first))
        own = [line for line in own if line.strip()]
        if block.header > layout.first:
            yield from _merged(layout, common, own)
        else:
            yield from common
        yield from islice(stream, block.end - block.first)


def _merged(layout: Layout, common: list[str], own: list[str]) -> list[str]:
    """Lines above the first block that another one does not state anew, and its own."""
    width = len([cell for cell in layout.cells(common[-1]) if cell]) if common else 0
    named = bool(own) and len([cell for cell in layout.cells(own[-1]) if cell]) >= width
    stated = {layout.cells(line)[0] for line in own}
    kept = [line for line in common if not line.strip() or layout.cells(line)[0] not in stated]
    return [*kept, *own] if named else [*own, *kept]


def _uncounted(line: str) -> str:
    """A heading without the number that counts it."""
    return re.sub(r"\d+", "", line).strip()


def _lines_without_numbers(path: Path) -> tuple[list[int], list[int], int]:
    """Lines that begin with a letter or a mark, blank lines, and how many lines there are."""
    worded: list[int] = []
    blank: list[int] = []
    total = 0
    for chunk in whole_lines(path):
        codes, ends = codes_and_ends(chunk)
        begins = np.concatenate(([0], ends[:-1] + 1))
        first = codes[np.minimum(begins, len(codes) - 1)]
        worded += (total + np.flatnonzero(_WORDS[first] & (ends > begins))).tolist()
        brief = np.flatnonzero((ends - begins <= 4) & (first <= 32))
        blank += [total + int(k) for k in brief if not chunk[int(begins[k]) : int(ends[k])].strip()]
        total += len(ends)
    return worded, blank, total


def _texts(path: Path, layout: Layout, wanted: set[int]) -> dict[int, str]:
    with path.open(encoding=layout.encoding, errors="replace") as stream:
        return {i: line for i, line in enumerate(stream) if i in wanted}


def _runs(lines: list[int]) -> Iterator[tuple[int, int]]:
    """Stretches of successive lines: the first, and the one after the last."""
    if not lines:
        return
    begin = previous = lines[0]
    for line in lines[1:]:
        if line != previous + 1:
            yield begin, previous + 1
            begin = line
        previous = line
    yield begin, previous + 1
