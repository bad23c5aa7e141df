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
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from vinesexp.errors import RecordError
from vinesexp.records.readers.labels import only_time, stated_unit, unit_in_name, unit_of_label
from vinesexp.records.readers.layout import (
    THE_FILE,
    Body,
    Layout,
    Lines,
    Stated,
    find_body,
    is_stamp,
)
from vinesexp.records.readers.source import Column
from vinesexp.units import UNITS

#: Names of what stands in no row of data, or not in every one.
_EXTRA = re.compile(r"comment|start|increment|t0\b|tinc\b", re.IGNORECASE)
_SOURCE = {"source", "channel", "channels", "trace"}
_SAYS = re.compile(r"[^\W\d_]|[%°]")  # what a name or a unit holds
_MARK = re.compile(r"\s*(#+|%+|//)")
#: What a header may state, by what makers call it (lower case, without units and strokes below).
_STATEMENTS = {
    kind: re.compile(words)
    for kind, words in {
        "interval": r"(sampl\w+|x( axis)?|horizontal|time) (interval|period|increment|time|delta)"
        r"|increment|tinc"
        r"|dt|clock|xincr\w*|delta (t|x|time)|resolution x|h ?resolution",
        "rate": r"(sampl\w+|data) ?(rate|freq\w*)( hz)?|fs|clock|abtast(rate|frequenz)"
        r"|frequence d'echantillonnage|samples(/s| per second)",
        "start": r"start( time)?|t0|x ?origin|xzero|first x|time of first sample|h ?offset"
        r"|x axis first value",
        "rows": r"record length|(number of )?(samples|points)|npoints|x axis size",
        "names": r"source|channels?|channel name|trace( ?name)?",
        "units": r"((vertical|y|v|signal) ?)?units?|y unit label",
        "time unit": r"(horizontal|x( axis)?|h) ?units?",
        "axis": r"x dimension",
    }.items()
}
_CLAUSE = re.compile(r"([^\W\d][^:=]*?)\s*[:=]\s*([^:=]+)$")  # `Config: data_rate = 2000 Hz`
_VALUE = re.compile(r"([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*([^\d\s]\S*)?")
_PER_SECOND = re.compile(r"([kKM]?)(?:(?:S|Sa|Sps|sps|[Ss]amples?)(?:/s(?:ec)?)?|HZ|hz)")
_BESIDE = 40  # rows beside whose numbers an oscilloscope may write its settings


def find_layout(path: Path, called: Lines = THE_FILE) -> Layout:
    """Find the layout of a text file, names and units of its columns included.

    Raises
    ------
    RecordError
        No row of numbers, or rows wider than their header.
    """
    layout, body = find_body(path)
    above = [i for i in range(body.first) if any(body.row(i))]
    first = body.first
    while above:
        if _kind(layout, body, above[-1]) != "mixed":
            if _SAYS.search(body.lines[above[-1]]) and not _is_remark(layout, body, above):
                break
            above.pop()  # a rule or a remark under the names, or numbers of none of the columns
            continue
        # A row with numbers under the names is data with a bad cell: read, and then reported.
        # `Sequence,Volt,-3e-07,5e-10`: units, and values of columns that hold no data.
        # `Z-axis:,,0`: a setting, which leaves cells of the columns empty.
        cells = _over(layout, body, above[-1])
        whole = all(cells[j : j + 1] > [""] for j in body.numeric)
        named = any(_kind(layout, body, i) == "words" for i in above)
        if _are_units(layout, cells) or not whole or not named:
            break
        first = above.pop()
    names, units, at = _names_and_units(layout, body, above)
    unpaired = ""
    if names:
        names, unpaired = _paired(layout, body, names, at, first, called)
    typical = _typical(layout, body, first)
    holding = sorted(body.numeric | body.stamps)
    above_data = map(_unmarked, body.lines[:first])
    lines = [layout.cells(line) if line.strip() else [] for line in above_data]
    beside = range(first, min(first + _BESIDE, len(body.lines)))
    lines += [body.row(i)[: holding[0]] for i in beside]
    stated = read_preamble(layout, lines)
    columns = [_column(j, names, units) for j in range(body.width)]
    columns = [replace(c, unit="s") if j in body.stamps else c for j, c in enumerate(columns)]
    # Row numbers may stand before the axis that the header tells of.
    before = int(stated.time_unit is not None and _counts_rows(layout, body, first, holding))
    known = [columns[j] for j in holding]
    known = known[:before] + completed(known[before:], stated)
    time = only_time(known)
    for j, column in zip(holding, known, strict=True):
        columns[j] = column
    return replace(
        layout,
        first=first,
        columns=tuple(columns),
        time_column=None if time is None else holding[time],
        stated=stated,
        stamps=tuple(sorted(body.stamps)),
        width=max(typical if layout.delimiter is not None else 0, len(names), body.width),
        unpaired=unpaired,
        held=len(holding),
    )


def _typical(layout: Layout, body: Body, first: int) -> int:
    """How many cells most rows of data have, empty ones included."""
    counts = Counter(len(layout.cells(line)) for line in body.lines[first:][:200] if line.strip())
    return counts.most_common(1)[0][0]


def _is_remark(layout: Layout, body: Body, above: list[int]) -> bool:
    """Whether the last of these lines is a comment that is no row of names, under one that is."""
    *others, last = above
    if not _MARK.match(body.lines[last]):
        return False
    full = {body.width, _typical(layout, body, body.first)}  # with columns that are empty or not
    named = [i for i in others if _kind(layout, body, i) == "words"]
    over = [len(_over(layout, body, i)) in full for i in (*named, last)]
    return any(over[:-1]) and not over[-1]


def _counts_rows(layout: Layout, body: Body, first: int, holding: list[int]) -> bool:
    """Whether the first column numbers the rows and the next one rises by even steps."""
    rows = [body.row(i) for i in range(first, min(first + _BESIDE, len(body.lines)))]
    pairs = [[layout.number(row[j]) for j in holding[:2]] for row in rows if len(row) > holding[-1]]
    numbers = [(float(a), float(b)) for a, *rest in pairs for b in rest if a and b]
    steps = [(c - a, d - b) for (a, b), (c, d) in pairwise(numbers)]
    even = max((b for _, b in steps), default=0.0) < 1.1 * min((b for _, b in steps), default=0.0)
    return even and all(a == 1.0 for a, _ in steps)


def _unmarked(line: str) -> str:
    """A line above the data without the mark of a comment."""
    mark = _MARK.match(line)
    return line[mark.end() :] if mark else line


def _over(layout: Layout, body: Body, i: int) -> list[str]:
    """The cells of a line above the data as they stand over its columns.

    A program may write names with commas over numbers with tabs or blanks between them: where
    another delimiter than that of the numbers gives as many cells as there are columns, it counts.
    """
    line = _unmarked(body.lines[i])
    cells, most = layout.cells(line), body.width
    blanks = layout.delimiter is None
    if len(cells) == most or (not blanks and (most < 2 or sum(map(bool, cells)) > 1)):
        return cells
    line = line.strip()
    split = [[cell.strip() for cell in line.split(sign)] for sign in ";,\t"]
    split += [re.split(r"\s{2,}|\t", line)]
    split += [re.split(r"\s+(?![(\[])", line)] if blanks else []
    return next((other for other in split if len(other) == most and all(other)), cells)


def _kind(layout: Layout, body: Body, i: int) -> str:
    """``words`` (a row of names or units), ``mixed`` (words and numbers), or ``other``."""
    cells = _over(layout, body, i)
    inside = [cells[j] for j in sorted(body.numeric) if j < len(cells) and cells[j]]
    if 2 * len(inside) < len(body.numeric) or len(inside) < min(2, len(body.numeric)):
        return "other"
    if all(map(is_stamp, inside)):  # when each channel began
        return "other"
    return "mixed" if any(layout.is_number(cell) for cell in inside) else "words"


def _names_and_units(
    layout: Layout, body: Body, above: list[int]
) -> tuple[list[str], list[str], int]:
    """The rows of names and of units, and the line of the names; empty where there are none."""
    if not above or _kind(layout, body, above[-1]) != "words":
        return [], [], 0
    last = _over(layout, body, above[-1])
    upper = _over(layout, body, above[-2]) if len(above) > 1 else []
    words = [cell for cell in upper if cell]
    full = len(words) == len(upper) == len(set(upper)) == len(last)
    if full:
        if len(set(last)) < len(last):  # `Double,Double` or `Voltage,Sec,Voltage` under others
            if _are_units(layout, upper):
                return _names_and_units(layout, body, above[:-1])
            return upper, [cell if _are_units(layout, [cell]) else "" for cell in last], above[-2]
        if _are_units(layout, upper) and not _are_units(layout, last):
            return last, upper, above[-1]
    # Under a name for each column, a row that is mostly units holds one that nobody listed, too.
    share = _share_of_units(layout, last)
    if upper and (share == 1.0 or (full and share > 0.5)):
        # Names may be numbers (`x-axis,1,2,3`), or lack the first (`,CH1`). The first cell of
        # `Source,CH1` over `Second,Volt` is no name.
        timed = words[0].lower() in _SOURCE and unit_of_label(last[0]) in UNITS["time"]
        return (["Time", *upper[1:]] if timed else upper), last, above[-2]
    return last, [], above[-1]


def _are_units(layout: Layout, cells: list[str]) -> bool:
    return _share_of_units(layout, cells) == 1.0


def _share_of_units(layout: Layout, cells: list[str]) -> float:
    """How many of the words are units, over how many there are."""
    words = [cell for cell in cells if cell.strip("-") and not layout.is_number(cell)]
    units = [w for w in words if re.fullmatch(r"[(\[].*[)\]]", w) or unit_of_label(w)]
    return len(units) / max(len(words), 1)


def _paired(
    layout: Layout, body: Body, names: list[str], at: int, first: int, called: Lines
) -> tuple[list[str], str]:
    """Names as they stand over the columns, or none and why not."""
    line, width = body.lines[at], body.width
    above, below = (f"{called.at(i + 1)} '{body.lines[i].strip()[:80]}'" for i in (at, first))
    apart = f"{above} has {len(names)} names, {below} {width} numbers"
    if layout.delimiter is None:
        return (names, "") if len(names) == width else ([], apart)
    if _MARK.match(line) and not names[0]:  # the mark has a cell of its own
        own = len(names) - (not names[-1])
        names = ["#", *names[1:]] if own == width else names[1:]
    cells = _typical(layout, body, first)
    if names[0].endswith(("=", ":")) and len(names) == cells + 1:  # `DEF=`, then the names
        names = names[1:]
    surplus = [name for name in names[cells:] if name and not _EXTRA.match(name)]
    if surplus:
        return [], apart
    last = max((j for j, name in enumerate(names) if name), default=-1)
    if width > last + 1:
        if layout.delimiter != ",":  # which of the columns has none, nobody can tell
            return [], apart
        wide = next(i for i in range(first, len(body.lines)) if len(body.row(i)) >= width)
        raise RecordError(
            f"{width} cells under {last + 1} names ('{body.lines[wide].strip()[:80]}' under "
            f"'{line.strip()[:80]}'); correct the line or the names, or, if the numbers have "
            "decimal commas, export with another delimiter",
            where=called.at(wide + 1),
        )
    return names, ""


def _column(j: int, names: list[str], units: list[str]) -> Column:
    name = names[j].strip('"') if j < len(names) else ""
    unit = units[j].strip('"') if j < len(units) else ""
    return Column(name, stated_unit(unit.strip("()[] ")) or unit_in_name(name))


def read_preamble(layout: Layout, lines: list[list[str]]) -> Stated:
    """What the cells above (or beside) the data state.

    Parameters
    ----------
    layout : Layout
        For the decimal sign.
    lines : list of list of str
        The cells of each line.
    """
    found: dict[str, list[list[str]]] = {kind: [] for kind in _STATEMENTS}
    for key, cells in _statements(layout, lines):
        for kind, words in _STATEMENTS.items():
            if words.fullmatch(key):
                found[kind].append(cells)

    def sizes(kind: str, quantity: str, *, positive: bool = True) -> list[float]:
        each = (_sizes(layout, cells, quantity, positive=positive) for cells in found[kind])
        return [size for some in each for size in some]

    def texts(kind: str) -> list[str]:
        each = ([c if not layout.is_number(c) else "" for c in cells] for cells in found[kind])
        return next((some for some in each if any(some)), [])

    intervals = sizes("interval", "time") + [1.0 / f for f in sizes("rate", "frequency")]
    one = bool(intervals) and max(intervals) <= min(intervals) * (1.0 + 1e-6)
    time_unit = next((unit_of_label(cell) for cell in texts("time unit") if cell), None)
    if "Frequency" in texts("axis"):  # LabVIEW, whose X_Value is a time else
        time_unit = "Hz"
    rows = [int(size) for size in _sizes(layout, (found["rows"] or [[]])[-1], "ratio")]
    units = texts("units")
    while units and not units[-1]:
        units.pop()
    return Stated(
        intervals[0] if one and time_unit not in UNITS["frequency"] else None,  # else a spectrum's
        next(iter(sizes("start", "time", positive=False)), 0.0),
        max((n for n in rows if n < 1e12), default=None),
        [word for word in texts("names") if word],
        units,
        time_unit,
    )


def completed(columns: Sequence[Column], stated: Stated) -> list[Column]:
    """Columns with what a preamble states of those whose own names or units say nothing.

    Units stand in the order of the columns, or of those behind the times.
    """
    names, units = [c.name for c in columns], [c.unit for c in columns]
    if stated.time_unit in UNITS["frequency"]:
        axis = ("X_Value",) if any(names) else ("X_Value", "")  # LabVIEW's; else the first column
        at = next((j for j, name in enumerate(names) if name in axis), len(names))
        units[at : at + 1] = [stated.time_unit] * len(units[at : at + 1])
    count = max(len(stated.names), len(stated.units))
    first = stated.time_unit or (None if any(names) else "s")
    first = first if 0 < count < len(columns) else None
    timed = (units[0] or first) in UNITS["time"]
    given = ["Time", *stated.names] if timed else stated.names
    if len(given) == len(names) and not any(names):
        names = given
    if timed:
        units[0] = units[0] or first
    behind = int(timed and len(stated.units) < len(units))
    if not any(units[behind:]) and (behind or len(stated.units) == len(units)):
        for k, unit in enumerate(stated.units[: len(units) - behind]):
            units[behind + k] = stated_unit(unit)
    return [replace(c, name=n, unit=u) for c, n, u in zip(columns, names, units, strict=True)]


def _statements(layout: Layout, lines: list[list[str]]) -> Iterator[tuple[str, list[str]]]:
    """Every key of a header and the cells that it may state.

    `Sample Interval,1e-06,s`; `Sampling rate: 2 kHz` in a cell or a line; a row of words over one
    of values, `Start,Increment` over `-3e-07,5e-10`.
    """
    for above, cells in pairwise([[], *lines]):
        if not cells:
            continue
        first, *rest = (cell.strip('" ') for cell in cells)
        if any(rest):
            yield _key(first, rest)
        for cell in dict.fromkeys((" ".join(filter(None, (first, *rest))), first, *rest)):
            if clause := _CLAUSE.search(cell):
                value = clause[2].strip()
                words = value.split(maxsplit=2)  # a number, its unit, a remark
                yield _key(clause[1], [" ".join(words[:2]), *words[2:]])
        for name, value in zip(above, cells, strict=False):
            if stated_number(layout, value) is not None:
                yield _key(name, [value])


def _key(name: str, cells: list[str]) -> tuple[str, list[str]]:
    """A key in lower case, and its cells; the unit in its brackets is one more."""
    unit = re.search(r"[(\[]([^()\[\]]+)[)\]]\s*[:=]?$", name)
    plain = re.sub(r"\s*[(\[][^()\[\]]*[)\]]", "", name).strip(' :="').lower()
    plain = re.sub(r"[_-]", " ", plain)
    return plain, [*cells, unit[1]] if unit else cells


def stated_number(layout: Layout, cell: str) -> float | None:
    """A cell of the header as a finite number, or None."""
    try:
        value = float(cell.replace(",", ".") if layout.decimal == "," else cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _sizes(
    layout: Layout, cells: list[str], quantity: str, *, positive: bool = True
) -> list[float]:
    """The numbers among cells in SI; the unit stands behind the number or in a cell of its own."""
    found: list[float] = []
    unit = next((u for cell in cells if (u := _unit_of(cell, quantity))), "")
    for cell in cells:
        match = _VALUE.fullmatch(cell.strip())
        value = stated_number(layout, match[1]) if match else None
        if match is None or value is None:
            continue
        behind = (match[2] or "").rstrip(".,;")
        own = _unit_of(behind, quantity) if behind else unit
        counted = quantity == "ratio"  # `2000 points`
        if (own is not None or counted) and (value > 0.0 or not positive):
            found.append(value * UNITS[quantity].get(own or "", 1.0))
    return found


def _unit_of(label: str, quantity: str) -> str | None:
    """The unit of a quantity that a header states, also as oscilloscopes write it: uS, MSa/s."""
    plain = label.strip("()[] ")
    found = unit_of_label(plain)
    if quantity == "time" and found not in UNITS["time"]:
        found = unit_of_label(plain.lower())
    if quantity == "frequency" and (match := _PER_SECOND.fullmatch(plain)):
        found = (match[1].replace("K", "k") or "") + "Hz"
    return found if found in UNITS[quantity] else None
