"""Names and units of the columns of a text file, from the lines above its data.

Names and columns are paired by position. That is right only if their counts agree, once a mark of
comment (`#`, `%`, `//`) is taken off the line; else the names are not used, and whoever asks for
one is shown the two lines.

What the lines above the data of a text file state: interval, start, names, units, rows.

Oscilloscopes and analysers write their settings there as `Sample Interval,1e-06,s`, as a row of
words over a row of values (`Start,Increment`), or beside the first rows of data (Tektronix).
"""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

from vinesexp.errors import RecordError
from vinesexp.records.readers.labels import unit_in_name, unit_of_label
from vinesexp.records.readers.layout import Body, Layout, find_body
from vinesexp.records.readers.source import Column
from vinesexp.units import UNITS

#: Names of what stands in no row of data, or not in every one.
_EXTRA = re.compile(r"comment|start|increment|t0\b|tinc\b", re.IGNORECASE)
_LABVIEW_TIMES = "X_Value"  # what LabVIEW calls its times
_RARE = 4  # times as many rows as odd ones
_SOURCE = {"source", "channel", "channels", "trace"}
_MARK = re.compile(r"\s*(#+|%+|//)")

_INTERVALS = {
    "sample interval", "sampling interval", "sample period", "sampling period", "x increment",
    "xincrement", "xincr", "increment", "horizontal interval", "time interval", "delta t", "dt",
    "delta time", "time increment", "delta x", "delta_x", "sample time", "resolution x",
}  # fmt: skip

_RATES = {
    "sample rate", "sampling rate", "sample frequency", "sampling frequency", "samplerate",
    "samplingrate", "samplefrequency", "sampling freq", "fs", "sample_rate", "sample rate hz",
    "frequence d'echantillonnage", "abtastrate", "abtastfrequenz", "samples/s",
    "samples per second",
}  # fmt: skip

_STARTS = {"start", "x origin", "xorigin", "xzero", "start time", "first x", "time of first sample"}
_ROWS = {"record length", "samples", "number of samples", "number of points", "points", "npoints"}
_NAMES = {"source", "channel", "channels", "channel name", "trace"}
_UNITS = {"vertical units", "unit", "units", "y_unit_label", "y units", "vertical unit"}
_TIME_UNITS = {"horizontal units", "horizontal unit", "x units", "x unit"}
_VALUE = re.compile(r"([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*([^\d\s]\S*)?")


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
        # `Sequence,Volt,-3e-07,5e-10`: units, and values of columns that hold no data.
        units_too = _are_units(layout, _over(layout, body, above[-1]))
        if units_too or not any(_kind(layout, body, i) == "words" for i in above):
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


def _over(layout: Layout, body: Body, i: int) -> list[str]:
    """The cells of a line above the data as they stand over its columns.

    A program may write names with commas over numbers with tabs or blanks between them: where
    another delimiter than that of the numbers gives as many cells as there are columns, it counts.
    """
    cells = _unmarked(layout, body.lines[i])
    most = body.width
    if most < 2 or (layout.delimiter is not None and sum(map(bool, cells)) > 1):
        return cells
    mark = _MARK.match(body.lines[i])
    line = body.lines[i][mark.end() if mark else 0 :].strip()
    split = [[cell.strip() for cell in line.split(sign)] for sign in ";,\t"]
    split += [re.split(r"\s{2,}", line)]
    split += [line.split()] if layout.delimiter == "\t" else []  # else a remark of some words
    return next((other for other in split if len(other) == most and all(other)), cells)


def _kind(layout: Layout, body: Body, i: int) -> str:
    """``words`` (a row of names or units), ``mixed`` (words and numbers), or ``other``."""
    cells = _over(layout, body, i)
    inside = [cells[j] for j in sorted(body.numeric) if j < len(cells) and cells[j]]
    if 2 * len(inside) < len(body.numeric) or len(inside) < min(2, len(body.numeric)):
        return "other"
    return "mixed" if any(layout.is_number(cell) for cell in inside) else "words"


def _names_and_units(
    layout: Layout, body: Body, above: list[int]
) -> tuple[list[str], list[str], int]:
    """The rows of names and of units, and the line of the names; empty where there are none."""
    if not above or _kind(layout, body, above[-1]) != "words":
        return [], [], 0
    last = _over(layout, body, above[-1])
    if _are_units(layout, last) and len(above) > 1:
        upper = _over(layout, body, above[-2])
        words = [cell for cell in upper if cell]
        # `x-axis,1,2,3`: names may be numbers, but for the first.
        numbered = len(words) == len([cell for cell in last if cell]) and not layout.is_number(
            words[0]
        )
        unnamed_first = [bool(cell) for cell in upper[:2]] == [False, True]  # `,CH1`
        if unnamed_first or _kind(layout, body, above[-2]) == "words" or numbered:
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
        _refuse_odd_row(path, body, last + 1, first)
        wide = next(i for i in range(first, len(body.lines)) if len(body.rows[i]) >= width)
        raise RecordError(
            f"{width} cells under {last + 1} names ('{body.lines[wide].strip()[:80]}' under "
            f"'{line.strip()[:80]}'); correct the names, or, if the numbers have decimal commas, "
            "export with another delimiter",
            file=path,
            where=f"line {wide + 1}",
        )
    return names, ""


def _refuse_odd_row(path: Path, body: Body, names: int, first: int) -> None:
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


@dataclass
class Stated:
    """What a preamble states; None and empty where it does not.

    `beside` are names and units of columns whose settings stand in the columns before them.
    """

    interval: float | None = None
    start: float | None = None
    rows: int | None = None
    names: list[str] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    time_unit: str | None = None
    contradictory: bool = False


def read_preamble(layout: Layout, lines: list[list[str]]) -> Stated:
    """What the cells above (or beside) the data state.

    Parameters
    ----------
    layout : Layout
        For the decimal sign.
    lines : list of list of str
        The cells of each line.
    """
    stated = Stated()
    intervals: list[float] = []
    for cells in lines:
        key, rest = _key_and_rest(cells)
        if key in _INTERVALS:
            intervals += _sizes(layout, rest, "time")
        elif key in _RATES:
            intervals += [1.0 / rate for rate in _sizes(layout, rest, "frequency")]
        elif key in _STARTS and stated.start is None:
            stated.start = next(iter(_sizes(layout, rest, "time", positive=False)), None)
        elif key in _ROWS:
            stated.rows = next((int(n) for n in _sizes(layout, rest, "ratio")), stated.rows)
        elif key in _NAMES and not stated.names:
            stated.names = [cell for cell in rest if cell and not layout.is_number(cell)]
        elif key in _UNITS and not stated.units:
            stated.units = [cell for cell in rest if cell and not layout.is_number(cell)]
        elif key in _TIME_UNITS:
            stated.time_unit = next((unit_of_label(cell) for cell in rest if cell), None)
    if intervals and stated.time_unit not in UNITS["frequency"]:  # else steps of a spectrum
        if max(intervals) <= min(intervals) * (1.0 + 1e-6):
            stated.interval = intervals[0]
        else:
            stated.contradictory = True
    return stated


def words_over_values(layout: Layout, lines: list[list[str]]) -> tuple[float, float] | None:
    """Interval and start of `X,CH1,Start,Increment` over `Sequence,Volt,-3e-07,5e-10`.

    Or of `CH1V,t0 = -2.5e-03, tInc = 2.0e-03`.
    """
    for cells in lines:
        words = (re.fullmatch(r"(t0|tInc)\s*=\s*(\S+?)s?", cell) for cell in cells)
        found = {match[1]: stated_number(layout, match[2]) for match in words if match}
        if (found.get("tInc") or 0.0) > 0.0:
            return found["tInc"] or 0.0, found.get("t0") or 0.0
    for names, values in pairwise(lines):
        stated = dict(zip((name.lower() for name in names), values, strict=False))
        interval = stated_number(layout, stated.get("increment", ""))
        if interval is not None and interval > 0.0:
            return interval, stated_number(layout, stated.get("start", "")) or 0.0
    return None


def stated_number(layout: Layout, cell: str) -> float | None:
    """A cell of the header as a finite number, or None."""
    try:
        value = float(cell.replace(",", ".") if layout.decimal == "," else cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _key_and_rest(cells: list[str]) -> tuple[str, list[str]]:
    """The first cell as a key, lower case, and what follows it; `Rate: 10 kHz` is both."""
    if not cells:
        return "", []
    first, rest = cells[0].strip('" '), [cell.strip('" ') for cell in cells[1:]]
    if not any(rest):
        key, found, value = _split(first)
        if found:
            first, rest = key, [value]
    else:
        joined = " ".join(cell for cell in (first, *rest) if cell)
        key, found, value = _split(joined)
        if found and key.lower().strip() in _INTERVALS | _RATES | _ROWS | _STARTS:
            first, rest = key, value.split()
    unit = re.search(r"[(\[]([^()\[\]]+)[)\]]\s*:?$", first)
    key = re.sub(r"\s*[(\[][^()\[\]]*[)\]]", "", first).strip(" :=").lower()
    return key, [*rest, unit[1]] if unit else rest


def _split(text: str) -> tuple[str, str, str]:
    match = re.match(r"([^:=]+?)\s*[:=]\s*(\S.*)$", text)
    return (match[1], ":", match[2]) if match else (text, "", "")


def _sizes(
    layout: Layout, cells: list[str], quantity: str, *, positive: bool = True
) -> list[float]:
    """The numbers among cells in SI; the unit stands behind the number or in a cell of its own."""
    found: list[float] = []
    unit = next((u for cell in cells if (u := unit_of_label(cell)) in UNITS[quantity]), None)
    for cell in cells:
        match = _VALUE.fullmatch(cell.strip())
        value = stated_number(layout, match[1]) if match else None
        if match is None or value is None:
            continue
        own = unit_of_label(match[2]) if match[2] else None
        size = UNITS[quantity].get(own or unit or "", 1.0)
        if value > 0.0 or not positive:
            found.append(value * size)
    return found


def is_labview(lines: list[list[str]]) -> bool:
    """The first line says it."""
    return any(cells and cells[0] == "LabVIEW Measurement" for cells in lines[:3])


def labview_columns(
    layout: Layout, lines: list[list[str]]
) -> tuple[tuple[Column, ...], int | None, float | None]:
    """Columns with their units, the column of times, the interval where it is one for all."""
    stated = {cells[0]: cells for cells in lines if cells}
    labels = stated.get("Y_Unit_Label", [])
    columns = list(layout.columns)
    for j, column in enumerate(columns):
        label = "s" if column.name == _LABVIEW_TIMES else labels[j] if 0 < j < len(labels) else ""
        columns[j] = replace(column, unit=unit_of_label(label) or label or column.unit)
    has_times = [*stated.get("X_Columns", []), "", "No"][1] != "No"
    times = [j for j, column in enumerate(columns) if column.name == _LABVIEW_TIMES]
    intervals = {stated_number(layout, cell) for cell in stated.get("Delta_X", [])[1:] if cell}
    return (
        tuple(columns),
        times[0] if has_times and times else None,
        intervals.pop() if len(intervals) == 1 else None,
    )


def labview_rows(layout: Layout, lines: list[list[str]]) -> int | None:
    """How many rows the longest of the channels has."""
    stated = {cells[0]: cells for cells in lines if cells}
    counts = [stated_number(layout, cell) for cell in stated.get("Samples", [])[1:] if cell]
    known = [int(count) for count in counts if count is not None and 0.0 < count < 1e12]
    return max(known, default=None)
