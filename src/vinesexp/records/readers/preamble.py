"""What the lines above the data of a text file state: interval, start, names, units, rows.

Oscilloscopes and analysers write their settings there as `Sample Interval,1e-06,s`, as a row of
words over a row of values (`Start,Increment`), or beside the first rows of data (Tektronix).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from itertools import pairwise

from vinesexp.records.readers.labels import unit_of_label
from vinesexp.records.readers.layout import Layout
from vinesexp.units import UNITS

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
    if intervals:
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
        found = {match[1]: number(layout, match[2]) for match in words if match}
        if (found.get("tInc") or 0.0) > 0.0:
            return found["tInc"] or 0.0, found.get("t0") or 0.0
    for names, values in pairwise(lines):
        stated = dict(zip((name.lower() for name in names), values, strict=False))
        interval = number(layout, stated.get("increment", ""))
        if interval is not None and interval > 0.0:
            return interval, number(layout, stated.get("start", "")) or 0.0
    return None


def number(layout: Layout, cell: str) -> float | None:
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
        value = number(layout, match[1]) if match else None
        if match is None or value is None:
            continue
        own = unit_of_label(match[2]) if match[2] else None
        size = UNITS[quantity].get(own or unit or "", 1.0)
        if value > 0.0 or not positive:
            found.append(value * size)
    return found
