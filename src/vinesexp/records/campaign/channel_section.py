"""The parts of campaign.yaml that say how to find each channel: `channels`, `time`, `setups`.

Reading one key of campaign.yaml: sections, answers, quantities. Mistakes are noted.
"""

from __future__ import annotations

from dataclasses import replace

from vinesexp.errors import ParameterError, nearest
from vinesexp.records.campaign.problems import Problems
from vinesexp.records.campaign.schema import ACCEPTABLE, ROLES, Channel, Setup, TimeColumn
from vinesexp.records.campaign.yamltree import Section
from vinesexp.units import (
    UNITS,
    Quantity,
    measured_in,
    parse_quantity,
    parse_sensitivity,
    relative_error,
    unit_size,
)

CHANNEL_KEYS = (
    "column",
    "quantity",
    "unit",
    "radius",
    "sensitivity",
    "offset",
    "file_unit",
    "optional",
    "accept",
)

#: Keys of a microphone, of which only the times of hits are used: it needs no calibration.
SOUND_KEYS = ("column", "optional", "accept")
SETUP_KEYS = ("channels", "time", "sample_rate")
_YES = {"yes": True, "true": True, "on": True, "no": False, "false": False, "off": False}


def refuse_unknown(section: Section, known: tuple[str, ...], problems: Problems) -> None:
    """Note every key that is not among the known ones, with the nearest of them."""
    for key in section.values:
        if key not in known:
            problems.add(f"unknown key '{key}'; {nearest(key, known)}", where=section.where(key))


def subsection(parent: Section, key: str, problems: Problems) -> Section | None:
    """The mapping under `key`, or None where it is absent or something else."""
    value = parent.values.get(key)
    if value is None or isinstance(value, Section):
        return value
    problems.add(f"found '{value}', expected 'name: value' pairs", where=parent.where(key))
    return None


def yes_or_no(section: Section, key: str, problems: Problems) -> bool:
    """The answer under `key`; no where it is absent."""
    value = section.values.get(key)
    if value is None:
        return False
    answer = _YES.get(str(value).lower())
    if answer is None:
        problems.add(f"found '{value}', expected yes or no", where=section.where(key))
    return bool(answer)


def positive(section: Section, key: str, quantity: str, problems: Problems) -> float | None:
    """A value above zero in SI, or None where it is absent or wrong."""
    if section.values.get(key) is None:
        return None
    with problems.at(section.where(key)):
        return above_zero(section.values[key], quantity).value
    return None


def above_zero(text: object, quantity: str) -> Quantity:
    """Read a quantity; ParameterError where it is not above zero."""
    found = parse_quantity(text, quantity)
    if found.value <= 0.0:
        raise ParameterError(f"found '{text}', expected a {quantity} above zero")
    return found


def read_setups(top: Section, standard: Setup, problems: Problems) -> dict[str, Setup]:
    """Further sets of channels by name; what one leaves out is as in the campaign itself."""
    section = subsection(top, "setups", problems)
    if section is None:
        return {}
    found: dict[str, Setup] = {}
    for name in section.values:
        entry = subsection(section, name, problems)
        if entry is None:
            continue
        refuse_unknown(entry, SETUP_KEYS, problems)
        channels = dict(standard.channels)
        if "channels" in entry.values:
            channels |= read_channels_section(entry, problems)
        time, rate = standard.time, standard.sample_rate
        if "time" in entry.values:
            time, rate = read_time(entry, problems), None
        elif "sample_rate" in entry.values:
            time, rate = None, positive(entry, "sample_rate", "frequency", problems)
        found[name] = replace(standard, channels=channels, time=time, sample_rate=rate)
    return found


def read_channels_section(top: Section, problems: Problems) -> dict[str, Channel]:
    section = subsection(top, "channels", problems)
    if section is None or not section.values:
        problems.add(
            "no channels; say under 'channels' how to find each of " + ", ".join(ROLES),
            where=top.where("channels") if "channels" in top.values else None,
        )
        return {}
    refuse_unknown(section, tuple(ROLES), problems)
    found: dict[str, Channel] = {}
    for role in ROLES:
        if role in section.values:
            entry = subsection(section, role, problems)
            if entry is None:
                if section.values[role] is None:
                    problems.add(
                        "is empty; give column, quantity and unit or sensitivity",
                        where=section.where(role),
                    )
                continue
            before = len(problems.found)
            channel = _channel(role, entry, section.where(role), problems)
            if channel is not None and len(problems.found) == before:
                found[role] = channel
    return found


def _sound(entry: Section, where: str, problems: Problems) -> Channel | None:
    """A microphone, or any sensor that is not calibrated: only drop tests use it."""
    refuse_unknown(entry, SOUND_KEYS, problems)
    column = _column(entry, where, problems)
    if column is None:
        return None
    return Channel(
        role="sound",
        column=column,
        quantity="sound",
        scale=1.0,
        unit="1",
        file_size=1.0,  # whatever the header says
        optional=yes_or_no(entry, "optional", problems),
        accept=_accept(entry, problems),
    )


def _channel(role: str, entry: Section, where: str, problems: Problems) -> Channel | None:
    if role == "sound":
        return _sound(entry, where, problems)
    refuse_unknown(entry, CHANNEL_KEYS, problems)
    column = _column(entry, where, problems)
    quantity = _quantity(role, entry, where, problems)
    unit, sensitivity = entry.values.get("unit"), entry.values.get("sensitivity")
    if (unit is None) == (sensitivity is None):
        problems.add(
            f"{'no unit' if unit is None else 'both unit and sensitivity'}; give either 'unit' "
            "(the file is in physical units) or 'sensitivity' (instrument output per measured "
            "unit), exactly one",
            where=where,
        )
        return None
    if column is None or quantity is None:
        return None
    gain_error = None
    with problems.at(entry.where("unit" if sensitivity is None else "sensitivity")):
        if sensitivity is None:
            output, scale = str(unit), _size(str(unit), quantity, entry)
        else:
            scale = 1.0 / parse_sensitivity(sensitivity, quantity)
            gain_error = relative_error(sensitivity)
            measured = str(sensitivity).partition("/")[0].split()[-1:]
            output = "C" if measured and measured[0] in UNITS["charge"] else "V"
        return Channel(
            role=role,
            column=column,
            quantity=quantity,
            scale=scale,
            offset=_output(entry, "offset", output, quantity, problems) or 0.0,
            unit=output,
            sensitivity=sensitivity is not None,
            file_size=_output(entry, "file_unit", output, quantity, problems),
            optional=yes_or_no(entry, "optional", problems),
            accept=_accept(entry, problems),
            gain_error=gain_error,
        )
    return None


def _size(unit: str, quantity: str, entry: Section) -> float:
    """Size of one unit; of an angle or its rate the arc at its `radius`, m."""
    radius = entry.values.get("radius")
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


def _quantity(role: str, entry: Section, where: str, problems: Problems) -> str | None:
    quantity = entry.values.get("quantity")
    allowed = ROLES[role]
    if quantity in allowed:
        return str(quantity)
    found = "no quantity" if quantity is None else f"found '{quantity}'"
    problems.add(
        f"{found}; {role} is given as quantity: {' or '.join(allowed)}",
        where=where if quantity is None else entry.where("quantity"),
    )
    return None


def _column(entry: Section, where: str, problems: Problems) -> str | int | None:
    column = entry.values.get("column")
    if isinstance(column, int) and column >= 0:
        return column
    if isinstance(column, str) and column.strip():
        return column.strip()
    found = "no column" if column is None else f"found '{column}'"
    problems.add(
        f"{found}; give the column's name, a pattern such as 'Laser*', or its number from 0",
        where=where if column is None else entry.where("column"),
    )
    return None


def _output(entry: Section, key: str, unit: str, quantity: str, problems: Problems) -> float | None:
    """A value in units of the channel's output: volts, coulombs, or the physical unit itself.

    `file_unit` may be a bare unit (``mV``) or carry a number (``10 V``: a WAV's full scale).
    """
    text = entry.values.get(key)
    if text is None:
        return None
    measured = measured_in(unit, quantity)
    with problems.at(entry.where(key)):
        bare = key == "file_unit" and str(text) in UNITS[measured]
        value = parse_quantity(f"1 {text}" if bare else text, measured).value
        if key == "file_unit" and value <= 0.0:
            raise ParameterError(f"found '{text}', expected a unit of {measured}")
        return value / unit_size(unit, measured)
    return None


def _accept(entry: Section, problems: Problems) -> tuple[str, ...]:
    given = entry.values.get("accept")
    words = given if isinstance(given, list) else [] if given is None else [given]
    for word in words:
        if word not in ACCEPTABLE:
            problems.add(
                f"found '{word}'; {nearest(str(word), ACCEPTABLE)}", where=entry.where("accept")
            )
    return tuple(str(word) for word in words)


def read_time(top: Section, problems: Problems) -> TimeColumn | None:
    section = subsection(top, "time", problems)
    if section is None:
        return None
    refuse_unknown(section, ("column", "unit"), problems)
    column = _column(section, top.where("time"), problems)
    unit = section.values.get("unit")
    if unit is None:
        problems.add("no unit; give the unit of the times, such as s", where=top.where("time"))
        return None
    with problems.at(section.where("unit")):
        size = unit_size(str(unit), "time")
        return None if column is None else TimeColumn(column, str(unit), size)
    return None
