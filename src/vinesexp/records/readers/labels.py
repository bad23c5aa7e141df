"""Words as instruments write them: units (`CH1 (V)`, `Volt`, `[m/s²]`), and marks of overload."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vinesexp.records.readers.source import Column
from vinesexp.units import UNITS, plain_unit

_WORDS = {
    "volt": "V", "s": "s", "sec": "s", "second": "s", "minute": "min", "meter": "m", "metre": "m",
    "micron": "um", "inch": "in", "inche": "in", "foot": "ft", "newton": "N", "pound": "lbf",
    "gs": "g", "degree": "deg", "radian": "rad", "sequence": "Sequence",
    "pascal": "Pa", "hertz": "Hz", "day": "day", "ampere": "A", "watt": "W",
    "x_value": "s",  # LabVIEW's times
}  # fmt: skip
_PREFIXES = {"": "", "milli": "m", "micro": "u", "nano": "n", "kilo": "k", "centi": "c"}
_PREFIXES |= {"m": "m", "u": "u", "n": "n"}  # only before "sec"
_KNOWN = {unit for table in UNITS.values() for unit in table if unit and unit != "1"}
_BRACKETS = re.compile(r"[(\[]([^()\[\]]*)[)\]]")
#: `s / mm`, `C1 in V`, `CH1V`, `acc g`, `millis`; behind a blank or a stroke below stand units only
_TAIL = re.compile(
    r"(?:\s/\s?|(?:^|\s)in\s+|^CH\d+(?=V$)|[\s_](?=(?:s|m|mm|[uµ]m|g|m?V)$)"
    r"|(?:^|[\s_])(?=(?:[nuµm]s|millis|micros)$)"
    r"|^(?:[Zz]eit|[Tt]ime|[Tt]emps|[Tt]i?empo|t)/(?=[nuµm]?s$))(\S+)$"
)

#: Units written out: seconds_elapsed, volt2; no abbreviation, and no ordinal (second run).
_SPELLED = re.compile(
    r"^x_value$|^(?:milli)?volts?(?=\d*$)|(?<![a-z])(?:(?:milli|micro|nano)?second|(?:milli)?volt)s(?![a-z])",
    re.IGNORECASE,
)

#: As a name without strokes has a rate: velocity_m_s, acc_mps2, gyro_deg_per_s, a_ms-2; and
#: Velocity_ms, which is no time. time_in_s holds no inches.
_RATE = re.compile(
    r"^(?!t(?:ime)?[\s_]).*?(?:^|[\s_])(?P<of>[mcu]?m|ft|deg|d(?=ps)|rad|in(?=_per_|ps))"
    r"(?:[\s_]?per[\s_]|[\s_]|p|(?=s(?:2|\^2|-2|\^-2)$))s(?P<power>2|\^2|-2|\^-2)?$"
)
_SPEED = re.compile(r"(?:veloc|speed).*[\s_](?P<of>m)s$", re.IGNORECASE)

#: The unit of a column that only counts its rows.
SEQUENCE = "Sequence"
#: The unit of a column of whole numbers of the converter, and what GW Instek calls such a column.
CODES, CODED = "codes", "Waveform Data"

_OVERLOAD = re.compile(
    r"[+-]?\s*(?:over(?:flow|load|range|[\s_-]range|[\s_-]load)?|ovf|ovrflw|ovld?|ol|o\.l\.?|∞"
    r"|clip(?:ped)?|under(?:flow|[\s_-]?range)|unf|infinity|\d\.?#inf0*)",
    re.IGNORECASE,
)
_NEGATIVE = re.compile(r"-|under|unf", re.IGNORECASE)

#: No measurement is larger: instruments write 9.9E+37 (SCPI) or the largest floats for a sample out
#: of range, and 9.91E+37 for no number.
_BEYOND, _NO_NUMBER = 9e37, 9.91e37


def unit_of_label(label: str) -> str | None:
    """The unit a header cell states, as `vinesexp.units` writes it; None where it is none.

    Examples
    --------
    >>> unit_of_label("Volts"), unit_of_label("[mm]"), unit_of_label("Trigger")
    ('V', 'mm', None)
    >>> unit_of_label("millimetres"), unit_of_label("usec"), unit_of_label("mg")
    ('mm', 'us', 'mg')
    """
    plain = label.strip()
    inside = _BRACKETS.fullmatch(plain)
    if inside:
        plain = inside[1].strip()
    plain = plain_unit(plain)
    if plain in _KNOWN:
        return plain
    word = plain.lower()
    for prefix, sign in _PREFIXES.items():
        rest = word.removeprefix(prefix)
        unit = _WORDS.get(rest) or _WORDS.get(rest.removesuffix("s"))
        if unit and word.startswith(prefix) and (len(prefix) != 1 or rest.startswith("sec")):
            return sign + unit
    return None


def stated_unit(label: str) -> str | None:
    """The unit that a file states, known or not; None where it states none, or several.

    Examples
    --------
    >>> stated_unit("CH1:V"), stated_unit("bit"), stated_unit("s, m/s^2"), stated_unit("-")
    ('V', 'bit', None, None)
    """
    label = re.sub(r"^CH\d+:", "", label).strip("-")  # `CH1:V`, and `-` for none
    return unit_of_label(label) or (None if "," in label else label or None)


def unit_in_name(name: str) -> str | None:
    """The unit in a column's name, if there is one: in brackets, after a stroke, `in`, or `_`.

    Examples
    --------
    >>> unit_in_name("Position (m) Run #1"), unit_in_name("Response (Trigger)")
    ('m', None)
    >>> unit_in_name("s_A1 / mm"), unit_in_name("CH1 in V"), unit_in_name("signal in out")
    ('mm', 'V', None)
    >>> unit_in_name("time_us"), unit_in_name("acc_x_g"), unit_in_name("acc_min")
    ('us', 'g', None)
    >>> unit_in_name("Zeit/ms"), unit_in_name("scope/s")  # a group of HDF5 and its channel
    ('ms', None)
    >>> unit_in_name("seconds_elapsed"), unit_in_name("volt2"), unit_in_name("second run")
    ('s', 'V', None)
    >>> unit_in_name("velocity_m_s"), unit_in_name("acc_mps2"), unit_in_name("time_in_s")
    ('m/s', 'm/s2', 's')
    """
    if rate := _RATE.search(name) or _SPEED.search(name):
        of = "deg" if rate["of"] == "d" else rate["of"]
        of_rate = f"{of}/s" + ("2" if rate.groupdict().get("power") else "")
        if of_rate in _KNOWN:
            return of_rate
    found = (unit_of_label(inside) for inside in _BRACKETS.findall(name))
    unit = next((unit for unit in found if unit is not None), None)
    if unit is None and (tail := _TAIL.search(name)):
        unit = unit_of_label(tail[1])
    if unit is None and (word := _SPELLED.search(name)):
        unit = unit_of_label(word[0])
    return unit


def only_time(columns: Sequence[Column]) -> int | None:
    """The column whose unit is one of time, if there is just one."""
    times = [j for j, column in enumerate(columns) if column.unit in UNITS["time"]]
    return times[0] if len(times) == 1 else None


def is_overload(cell: str) -> bool:
    """Whether a cell is the word that an instrument writes for a sample out of its range.

    Examples
    --------
    >>> is_overload("OVERFLOW"), is_overload("-OL"), is_overload("fine")
    (True, True, False)
    """
    return bool(cell) and not cell[0].isdigit() and _OVERLOAD.fullmatch(cell) is not None


def overload_value(cell: str) -> float:
    """Infinity with the sign of an overload word."""
    return float("-inf") if _NEGATIVE.match(cell) else float("inf")


def marks_to_infinity(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Numbers that stand for "out of range" as infinities, SCPI's mark of "no number" as NaN.

    Examples
    --------
    >>> marks_to_infinity(np.array([1.0, 9.9e37, -9.9e37, 9.91e37]))
    array([  1.,  inf, -inf,  nan])
    """
    size = np.abs(values)
    if not (size > _BEYOND).any():
        return values
    out = np.where(size > _BEYOND, np.copysign(np.inf, values), values)
    out[np.isclose(size, _NO_NUMBER, rtol=1e-6)] = np.nan
    return out
