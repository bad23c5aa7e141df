"""Names and units of the columns of a text file, from the lines above its data.

Names and columns are paired by position. That is right only if their counts agree, once a mark of
comment (`#`, `%`, `//`) is taken off the line; else the names are not used, and whoever asks for
one is shown the two lines.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

from vinesexp.errors import RecordError
from vinesexp.records.readers.labels import unit_in_name, unit_of_label
from vinesexp.records.readers.layout import Body, Layout, find_body
from vinesexp.records.readers.source import Column
from vinesexp.units import UNITS

#: Names of what stands in no row of data, or not in every one.
_EXTRA = re.compile(r"comment|start|increment|t0\b|tinc\b", re.IGNORECASE)
_RARE = 4  # times as many rows as odd ones
_SOURCE = {"source", "channel", "channels", "trace"}
_MARK = re.compile(r"\s*(#+|%+|//)")


def find_layout(path: Path) -> Layout:
    """Find the layout of a text file, names and units of its columns included.

    Raises
    ------
    RecordError
        No line of numbers, or rows wider than their header.
    """
    layout, body = find_body(path)
    above = [i for i in range(body.first) if any(body.rows[i])]
    first = body.first
    while above and _kind(layout, body, above[-1]) == "mixed":
        # A row with numbers under the names is data with a bad cell: read, and then reported.
        if _is_names_over_units(layout, body, above) or not any(
            _kind(layout, body, i) == "words" for i in above
        ):
            break
        first = above.pop()
    names, units, at = _names_and_units(layout, body, above)
    unpaired = ""
    if names:
        names, unpaired = _paired(path, layout, body, names, at, first)
    columns = tuple(_column(j, names, units) for j in range(body.width))
    typical = _typical(layout, body, first)
    return replace(
        layout,
        first=first,
        columns=columns,
        preamble=tuple(tuple(_unmarked(layout, line)) for line in body.lines[:first]),
        stamps=tuple(sorted(body.stamps)),
        width=max(typical if layout.delimiter is not None else 0, len(names), body.width),
        unpaired=unpaired,
    )


def _typical(layout: Layout, body: Body, first: int) -> int:
    """How many cells most rows of data have, empty ones included."""
    counts = Counter(len(layout.cells(line)) for line in body.lines[first:][:200] if line.strip())
    return counts.most_common(1)[0][0]


def _unmarked(layout: Layout, line: str) -> list[str]:
    """The cells of a line above the data, without the mark of a comment."""
    if not line.strip():
        return []
    mark = _MARK.match(line)
    return layout.cells(line[mark.end() :] if mark else line)


def _kind(layout: Layout, body: Body, i: int) -> str:
    """``words`` (a row of names or units), ``mixed`` (words and numbers), or ``other``."""
    cells = _unmarked(layout, body.lines[i])
    inside = [cells[j] for j in sorted(body.numeric) if j < len(cells) and cells[j]]
    if 2 * len(inside) < len(body.numeric) or len(inside) < min(2, len(body.numeric)):
        return "other"
    return "mixed" if any(layout.is_number(cell) for cell in inside) else "words"


def _is_names_over_units(layout: Layout, body: Body, above: list[int]) -> bool:
    """Whether the last row above the data is of units although numbers stand in it.

    `Sequence,Volt,-3e-07,5e-10`: units, and values of columns that hold no data.
    """
    return _are_units(layout, _unmarked(layout, body.lines[above[-1]]))


def _names_and_units(
    layout: Layout, body: Body, above: list[int]
) -> tuple[list[str], list[str], int]:
    """The rows of names and of units, and the line of the names; empty where there are none."""
    if not above or _kind(layout, body, above[-1]) != "words":
        return [], [], 0
    last = _unmarked(layout, body.lines[above[-1]])
    if _are_units(layout, last) and len(above) > 1:
        upper = _unmarked(layout, body.lines[above[-2]])
        words = [cell for cell in upper if cell]
        # `x-axis,1,2,3`: names may be numbers, but for the first.
        numbered = len(words) == len([cell for cell in last if cell]) and not layout.is_number(
            words[0]
        )
        if _kind(layout, body, above[-2]) == "words" or numbered:
            # `Source,CH1` over `Second,Volt`: the first cell is no name.
            timed = words[0].lower() in _SOURCE and unit_of_label(last[0]) in UNITS["time"]
            return (["Time", *upper[1:]] if timed else upper), last, above[-2]
    return last, [], above[-1]


def _are_units(layout: Layout, cells: list[str]) -> bool:
    words = [cell for cell in cells if cell and not layout.is_number(cell)]
    bracketed = [re.fullmatch(r"[(\[].*[)\]]", word) is not None for word in words]
    return bool(words) and all(b or unit_of_label(w) for b, w in zip(bracketed, words, strict=True))


def _paired(
    path: Path, layout: Layout, body: Body, names: list[str], at: int, first: int
) -> tuple[list[str], str]:
    """Names as they stand over the columns, or none and why not."""
    line, width = body.lines[at], body.width
    if layout.delimiter is None:
        for candidate in (names, _joined(line, r"\s{2,}|\t"), _joined(line, r"\s+(?![(\[])")):
            if len(candidate) == width:
                return candidate, ""
        rows = f"line {at + 1} '{line.strip()[:80]}' has {len(names)} words"
        data = f"line {first + 1} '{body.lines[first].strip()[:80]}' {width} numbers"
        return [], f"{rows}, {data}"
    if _MARK.match(line) and not names[0]:  # the mark has a cell of its own
        own = len(names) - (not names[-1])
        names = ["#", *names[1:]] if own == width else names[1:]
    cells = _typical(layout, body, first)
    if names[0].endswith(("=", ":")) and len(names) == cells + 1:  # `DEF=`, then the names
        names = names[1:]
    surplus = [name for name in names[cells:] if name and not _EXTRA.match(name)]
    if surplus:
        rows = f"line {at + 1} '{line.strip()[:80]}' has {len(names)} names"
        return [], f"{rows}, line {first + 1} '{body.lines[first].strip()[:80]}' {cells} cells"
    last = max((j for j, name in enumerate(names) if name), default=-1)
    if width > last + 1:
        _refuse_odd_row(path, layout, body, last + 1, first)
        raise RecordError(
            f"{width} cells under {last + 1} names ('{body.lines[first].strip()[:80]}' under "
            f"'{line.strip()[:80]}'); correct the names, or, if the numbers have decimal commas, "
            "export with another delimiter",
            file=path,
            where=f"line {first + 1}",
        )
    return names, ""


def _refuse_odd_row(path: Path, layout: Layout, body: Body, names: int, first: int) -> None:
    """Name the row that has more cells than there are names, where it is one among many."""
    rows = [i for i in range(first, len(body.lines)) if body.rows[i]]
    odd = [i for i in rows if len(body.rows[i]) > names and any(body.rows[i][names:])]
    if odd and _RARE * len(odd) < len(rows):
        raise RecordError(
            f"{len(body.rows[odd[0]])} cells where the rows have {names} "
            f"('{body.lines[odd[0]].strip()[:60]}'); correct the line",
            file=path,
            where=f"line {odd[0] + 1}",
        )


def _joined(line: str, separator: str) -> list[str]:
    """The names of a line whose columns stand apart by `separator`."""
    mark = _MARK.match(line)
    return re.split(separator, (line[mark.end() :] if mark else line).strip())


def _column(j: int, names: list[str], units: list[str]) -> Column:
    name = names[j].strip('"') if j < len(names) else ""
    unit = units[j].strip('"') if j < len(units) else ""
    return Column(name, unit_of_label(unit) or unit.strip("()[] ") or unit_in_name(name))
