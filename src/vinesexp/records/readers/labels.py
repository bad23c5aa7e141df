"""Units as instruments write them in headers: `CH1 (V)`, `Volt`, `[m/s²]`, `Pounds`."""

from __future__ import annotations

import re

from vinesexp.units import UNITS

_WORDS = {
    "volt": "V",
    "volts": "V",
    "millivolt": "mV",
    "millivolts": "mV",
    "second": "s",
    "seconds": "s",
    "sec": "s",
    "milliseconds": "ms",
    "meter": "m",
    "meters": "m",
    "metre": "m",
    "millimeter": "mm",
    "millimeters": "mm",
    "newton": "N",
    "newtons": "N",
    "pound": "lbf",
    "pounds": "lbf",
    "m/s**2": "m/s^2",
    "m/sec^2": "m/s^2",
    "μm": "um",
    "μs": "us",
    "μv": "uV",
    "sequence": "Sequence",
}
_KNOWN = {unit for table in UNITS.values() for unit in table if unit and unit != "1"}
_BRACKETS = re.compile(r"[(\[]([^()\[\]]*)[)\]]")

#: The unit of a column that only counts its rows.
SEQUENCE = "Sequence"


def unit_of_label(label: str) -> str | None:
    """The unit a header cell states, as `vinesexp.units` writes it; None where it is none.

    Examples
    --------
    >>> unit_of_label("Volts"), unit_of_label("[mm]"), unit_of_label("Trigger")
    ('V', 'mm', None)
    """
    plain = label.strip()
    inside = _BRACKETS.fullmatch(plain)
    if inside:
        plain = inside[1].strip()
    if plain in _KNOWN:
        return plain
    return _WORDS.get(plain.lower())


def unit_in_name(name: str) -> str | None:
    """The unit in the brackets of a column's name, if there is one.

    Examples
    --------
    >>> unit_in_name("Position (m) Run #1"), unit_in_name("Response (Trigger)")
    ('m', None)
    """
    found = (unit_of_label(inside) for inside in _BRACKETS.findall(name))
    return next((unit for unit in found if unit is not None), None)
