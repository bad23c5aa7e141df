"""The parts of campaign.yaml that say how to find each channel: `channels`, `time`, `setups`.

Mistakes are noted with the section.
"""

from __future__ import annotations

from dataclasses import replace

from vinesexp.errors import ParameterError, nearest
from vinesexp.records.campaign.schema import ACCEPTABLE, ROLES, Channel, Setup, TimeColumn
from vinesexp.records.campaign.yamltree import Section
from vinesexp.units import (
    UNITS,
    measured_in,
    parse_quantity,
    parse_sensitivity,
    relative_error,
    unit_size,
)

CHANNEL_KEYS = (
    *("column", "quantity", "unit", "radius", "sensitivity", "offset", "file_unit"),
    *("optional", "accept"),
)

#: Keys of a microphone, of which only the times of hits are used: it needs no calibration.
SOUND_KEYS = ("column", "optional", "accept")
SETUP_KEYS = ("channels", "time", "sample_rate")


def read_setups(top: Section, standard: Setup) -> dict[str, Setup]:
    """Further sets of channels by name; what one leaves out is as in the campaign itself."""
    section = top.under("setups")
    found: dict[str, Setup] = {}
    for name in section.names():
        entry = section.under(name)
        if not entry:
            continue
        entry.refuse_unknown(SETUP_KEYS)
        channels = dict(standard.channels)
        if "channels" in entry.names():
            channels |= read_channels_section(entry)
        time, rate = standard.time, standard.sample_rate
        if "time" in entry.names():
            time, rate = read_time(entry), None
        elif "sample_rate" in entry.names():
            time, rate = None, entry.quantity("sample_rate", "frequency")
        found[name] = replace(standard, channels=channels, time=time, sample_rate=rate)
    return found


def read_channels_section(top: Section) -> dict[str, Channel]:
    section = top.under("channels")
    if not section.names():
        top.problems.add(
            "no channels; say under 'channels' how to find each of " + ", ".join(ROLES),
            where=top.where("channels") if "channels" in top.names() else None,
        )
        return {}
    section.refuse_unknown(ROLES)
    found: dict[str, Channel] = {}
    for role in ROLES:
        if role not in section.names():
            continue
        if section.value(role) is None:
            section.complain(role, "is empty; give column, quantity and unit or sensitivity")
        before = len(top.problems.found)
        if entry := section.under(role):
            entry.refuse_unknown(SOUND_KEYS if role == "sound" else CHANNEL_KEYS)
            channel = _sound(entry) if role == "sound" else read_channel_entry(role, entry)
            if channel is not None and len(top.problems.found) == before:
                found[role] = channel
    return found


def _sound(entry: Section) -> Channel | None:
    """A microphone, or any sensor that is not calibrated: only drop tests use it."""
    column = _column(entry)
    if column is None:
        return None
    return replace(
        of_unit("sound", column, "sound", "1", 1.0),
        file_size=1.0,  # whatever the header says
        optional=entry.answer("optional"),
        accept=_accept(entry),
    )


def read_channel_entry(role: str, entry: Section, quantity: str | None = None) -> Channel | None:
    """A column and what one unit of it means; None where there are mistakes, which are noted.

    `quantity` where the section does not state it.
    """
    column = _column(entry)
    quantity = _quantity(role, entry) if quantity is None else quantity
    unit, sensitivity = entry.value("unit"), entry.value("sensitivity")
    if (unit is None) == (sensitivity is None):
        entry.problems.add(
            f"{'no unit' if unit is None else 'both unit and sensitivity'}; give either 'unit' "
            "(the file is in physical units) or 'sensitivity' (instrument output per measured "
            "unit), exactly one",
            where=entry.place,
        )
        return None
    if column is None or quantity is None:
        return None
    with entry.at("unit" if sensitivity is None else "sensitivity"):
        channel = (
            of_unit(role, column, quantity, str(unit), _size(str(unit), quantity, entry))
            if sensitivity is None
            else of_sensitivity(role, column, quantity, str(sensitivity))
        )
        return replace(
            channel,
            offset=_output(entry, "offset", channel.unit, quantity) or 0.0,
            file_size=_output(entry, "file_unit", channel.unit, quantity),
            optional=entry.answer("optional"),
            accept=_accept(entry),
        )
    return None


def of_unit(role: str, column: str | int, quantity: str, unit: str, size: float) -> Channel:
    """A channel of which the file holds the quantity itself, in units of a size (SI)."""
    return Channel(role, column, quantity, size, unit=unit, sensitivity=False)


def of_sensitivity(role: str, column: str | int, quantity: str, stated: str) -> Channel:
    """A channel of which the file holds volts or coulombs; ParameterError if `stated` is none."""
    size, output = parse_sensitivity(stated, quantity)
    error = relative_error(stated)
    return Channel(role, column, quantity, 1.0 / size, unit=output, gain_error=error)


def _size(unit: str, quantity: str, entry: Section) -> float:
    """Size of one unit; of an angle or its rate the arc at its `radius`, m."""
    radius = entry.value("radius")
    turned = {"displacement": "angle", "velocity": "rate of turn"}.get(quantity)
    if turned is not None and unit in UNITS[turned]:
        if radius is None:
            word = "an angle" if turned == "angle" else "a rate of turn"
            raise ParameterError(
                f"'{unit}' is {word}; give the distance of the mass from the axis too, such as "
                "radius: 0.5 m (f0 and zeta do not depend on it)"
            )
        return UNITS[turned][unit] * parse_quantity(radius, "displacement").value
    if radius is not None:
        raise ParameterError(
            f"a radius belongs to an angle or its rate (rad, deg/s), the unit is '{unit}'"
        )
    return unit_size(unit, quantity)


def _quantity(role: str, entry: Section) -> str | None:
    quantity, allowed = entry.value("quantity"), ROLES[role]
    if quantity in allowed:
        return str(quantity)
    found = "no quantity" if quantity is None else f"found '{quantity}'"
    entry.lacks("quantity", f"{found}; {role} is given as quantity: {' or '.join(allowed)}")
    return None


def _column(entry: Section) -> str | int | None:
    column = entry.value("column")
    if isinstance(column, int) and column >= 0:
        return column
    if isinstance(column, str) and column.strip():
        return column.strip()
    found = "no column" if column is None else f"found '{column}'"
    words = "give the column's name, a pattern such as 'Laser*', or its number from 0"
    entry.lacks("column", f"{found}; {words}")
    return None


def _output(entry: Section, key: str, unit: str, quantity: str) -> float | None:
    """A value in units of the channel's output: volts, coulombs, or the physical unit itself.

    `file_unit` may be a bare unit (``mV``) or carry a number (``10 V``: a WAV's full scale).
    """
    measured = measured_in(unit, quantity)

    def size(given: object) -> float:
        text = str(given)
        bare = key == "file_unit" and text in UNITS[measured]
        value = parse_quantity(f"1 {text}" if bare else text, measured).value
        if key == "file_unit" and value <= 0.0:
            raise ParameterError(f"found '{text}', expected a unit of {measured}")
        return value / unit_size(unit, measured)

    return entry.read(key, size, None)


def _accept(entry: Section) -> tuple[str, ...]:
    words = entry.listed("accept")
    for word in words:
        if word not in ACCEPTABLE:
            entry.complain("accept", f"found '{word}'; {nearest(str(word), ACCEPTABLE)}")
    return tuple(str(word) for word in words)


def read_time(top: Section) -> TimeColumn | None:
    """The column of times and its unit; None where there is none, or a mistake in it."""
    section = top.under("time")
    if not section:
        return None
    section.refuse_unknown(("column", "unit"))
    column, unit = _column(section), section.text("unit")
    if unit is None:
        section.lacks("unit", "no unit; give the unit of the times, such as s")
        return None
    size = section.read("unit", lambda _: unit_size(unit, "time"), None)
    return None if column is None or size is None else TimeColumn(column, unit, size)
