"""Dates and times of day in the cells of data loggers, as seconds since the first of them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import ParameterError

_CLOCK = r"(?P<h>\d{1,2}):(?P<m>\d{2})(?::(?P<s>\d{2})(?:[.,:](?P<f>\d{1,9}))?)?"
_ZONE = r"(?:\s*(?:Z|UTC|[+-]\d{2}:?\d{2}))?"
_HALF = r"(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?"
_DATES = (
    r"(?P<Y>\d{4})[-/.](?P<M>\d{1,2})[-/.](?P<D>\d{1,2})",
    r"(?P<a>\d{1,2})[-/.](?P<b>\d{1,2})[-/.](?P<Y>\d{4}|\d{2})",
)
_STAMPS = tuple(
    re.compile(rf"(?:{date}[T\s]+)?{_CLOCK}{_HALF}{_ZONE}", re.ASCII) for date in _DATES
)


def is_stamp(cell: str) -> bool:
    """Whether a cell is a time of day, with a date or without.

    Examples
    --------
    >>> is_stamp("2024-03-05 12:00:00.001"), is_stamp("12:00:00,5"), is_stamp("2024")
    (True, True, False)
    """
    return ":" in cell and any(form.fullmatch(cell) for form in _STAMPS)


def seconds_since(cells: Sequence[str], first: str) -> NDArray[np.float64]:
    """Seconds from the stamp `first` to each of `cells`; NaN where a cell is empty.

    Raises
    ------
    ParameterError
        A cell that is no stamp.

    Examples
    --------
    >>> seconds_since(["05.03.2024 00:00:00,25"], "04.03.2024 23:59:59,75")
    array([0.5])
    """
    day_first = _day_first([first, *cells[-1:]])
    origin_day, origin = _parts(first, day_first)
    out = np.empty(len(cells))
    for k, cell in enumerate(cells):
        text = cell.strip()
        if not text:
            out[k] = np.nan
            continue
        day, second = _parts(text, day_first)
        out[k] = (day - origin_day) * 86400.0 + (second - origin)
    return out


def _day_first(cells: Sequence[str]) -> bool:
    """Whether ``05/03/2024`` is the fifth of March: a first part above 12 decides, else a point."""
    for cell in cells:
        match = _STAMPS[1].fullmatch(cell.strip())
        if match and match["a"] and (int(match["a"]) > 12 or int(match["b"]) > 12):
            return int(match["a"]) > 12
    return bool(cells) and "/" not in cells[0]


def _parts(cell: str, day_first: bool) -> tuple[int, float]:
    """Number of the day (0 without a date) and second of the day."""
    match = next((m for form in _STAMPS if (m := form.fullmatch(cell))), None)
    if match is None:
        raise ParameterError(f"found '{cell[:40]}', expected a date and time as in the first row")
    found = match.groupdict()
    hour = int(found["h"])
    if found["half"]:
        hour = hour % 12 + (12 if found["half"] in "pP" else 0)
    second = hour * 3600 + int(found["m"]) * 60 + int(found["s"] or 0)
    fraction = float(f"0.{found['f']}") if found["f"] else 0.0
    if not found.get("Y"):
        return 0, second + fraction
    if "a" in found:
        month, day = (found["b"], found["a"]) if day_first else (found["a"], found["b"])
    else:
        month, day = found["M"], found["D"]
    year = int(found["Y"]) + (2000 if len(found["Y"]) == 2 else 0)
    try:
        return datetime(year, int(month), int(day)).toordinal(), second + fraction
    except ValueError:
        raise ParameterError(f"found '{cell[:40]}', which is no date") from None
