"""campaign.yaml: what is known of rig and sensors, read strictly.

Every key is known or an error that suggests the nearest one; a unit is never guessed. All
mistakes of the file are collected, each with its line and key.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from vinesexp.errors import ParameterError, nearest
from vinesexp.records.problems import Problems
from vinesexp.records.schema import ACCEPTABLE, ROLES, Channel, Known, TimeColumn
from vinesexp.records.settings_section import read_settings
from vinesexp.records.uncertainties import Uncertainties, read_uncertainties
from vinesexp.records.yamltree import Section, read_yaml
from vinesexp.settings.stages import Settings
from vinesexp.units import (
    UNITS,
    Quantity,
    parse_quantity,
    parse_sensitivity,
    relative_error,
    unit_size,
)

KEYS = (
    "title",
    "known",
    "channels",
    "time",
    "sample_rate",
    "bandpass",
    "settings",
    "uncertainties",
    "allow_outside",
)
CHANNEL_KEYS = (
    "column",
    "quantity",
    "unit",
    "sensitivity",
    "offset",
    "file_unit",
    "optional",
    "accept",
)
_YES = {"yes": True, "true": True, "on": True, "no": False, "false": False, "off": False}


@dataclass(frozen=True)
class Description:
    """campaign.yaml, understood."""

    title: str | None = None
    known: Known = field(default_factory=Known)
    channels: dict[str, Channel] = field(default_factory=dict)
    time: TimeColumn | None = None
    sample_rate: float | None = None
    bandpass: tuple[float, float] | None = None
    settings: Settings = field(default_factory=Settings)
    allow_outside: bool = False


def read_description(file: Path, problems: Problems) -> Description:
    """Read campaign.yaml; what is wrong goes to `problems`, what is right is returned."""
    top = read_yaml(file, problems)
    if top is None:
        return Description()
    _refuse_unknown(top, KEYS, problems)
    if "time" in top.values and "sample_rate" in top.values:
        problems.add(
            "both 'time' and 'sample_rate' are given; keep 'time' where the files have a time "
            "column, else 'sample_rate'",
            where=top.where("sample_rate"),
        )
    title = top.values.get("title")
    channels = _channels(top, problems)
    gains = {role: channel.gain_error for role, channel in channels.items()}
    return Description(
        title=None if title is None else str(title),
        known=_known(top, read_uncertainties(top, gains, problems), problems),
        channels=channels,
        time=_time(top, problems),
        sample_rate=_positive(top, "sample_rate", "frequency", problems),
        bandpass=_bandpass(top, problems),
        settings=read_settings(top, problems),
        allow_outside=_yes(top, "allow_outside", problems),
    )


def _refuse_unknown(section: Section, known: tuple[str, ...], problems: Problems) -> None:
    for key in section.values:
        if key not in known:
            problems.add(f"unknown key '{key}'; {nearest(key, known)}", where=section.where(key))


def _section(parent: Section, key: str, problems: Problems) -> Section | None:
    """The mapping under `key`, or None where it is absent or something else."""
    value = parent.values.get(key)
    if value is None or isinstance(value, Section):
        return value
    problems.add(f"found '{value}', expected 'name: value' pairs", where=parent.where(key))
    return None


def _yes(section: Section, key: str, problems: Problems) -> bool:
    value = section.values.get(key)
    if value is None:
        return False
    answer = _YES.get(str(value).lower())
    if answer is None:
        problems.add(f"found '{value}', expected yes or no", where=section.where(key))
    return bool(answer)


def _positive(section: Section, key: str, quantity: str, problems: Problems) -> float | None:
    if section.values.get(key) is None:
        return None
    with problems.at(section.where(key)):
        return _above_zero(section.values[key], quantity).value
    return None


def _above_zero(text: object, quantity: str) -> Quantity:
    found = parse_quantity(text, quantity)
    if found.value <= 0.0:
        raise ParameterError(f"found '{text}', expected a {quantity} above zero")
    return found


def _known(top: Section, uncertainties: Uncertainties, problems: Problems) -> Known:
    section = _section(top, "known", problems)
    if section is None:
        return Known(uncertainties=uncertainties)
    _refuse_unknown(section, ("mass", "nes_mass"), problems)
    mass = None
    if section.values.get("mass") is not None:
        with problems.at(section.where("mass")):
            mass = _above_zero(section.values["mass"], "mass")
    given = section.values.get("nes_mass")
    balls: list[Quantity] = []
    for text in given if isinstance(given, list) else [] if given is None else [given]:
        with problems.at(section.where("nes_mass")):
            ball = _above_zero(text, "mass")
            error = ball.std_error or uncertainties.nes_mass.of(ball.value)
            balls.append(Quantity(ball.value, error))
    return Known(mass, tuple(balls), uncertainties)


def _channels(top: Section, problems: Problems) -> dict[str, Channel]:
    section = _section(top, "channels", problems)
    if section is None or not section.values:
        problems.add(
            "no channels; say under 'channels' how to find each of " + ", ".join(ROLES),
            where=top.where("channels") if "channels" in top.values else None,
        )
        return {}
    _refuse_unknown(section, tuple(ROLES), problems)
    found: dict[str, Channel] = {}
    for role in ROLES:
        if role in section.values:
            entry = _section(section, role, problems)
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


def _channel(role: str, entry: Section, where: str, problems: Problems) -> Channel | None:
    _refuse_unknown(entry, CHANNEL_KEYS, problems)
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
            output, scale = str(unit), unit_size(str(unit), quantity)
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
            optional=_yes(entry, "optional", problems),
            accept=_accept(entry, problems),
            gain_error=gain_error,
        )
    return None


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
    measured = {"V": "voltage", "C": "charge"}.get(unit, quantity)
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


def _time(top: Section, problems: Problems) -> TimeColumn | None:
    section = _section(top, "time", problems)
    if section is None:
        return None
    _refuse_unknown(section, ("column", "unit"), problems)
    column = _column(section, top.where("time"), problems)
    unit = section.values.get("unit")
    if unit is None:
        problems.add("no unit; give the unit of the times, such as s", where=top.where("time"))
        return None
    with problems.at(section.where("unit")):
        size = unit_size(str(unit), "time")
        return None if column is None else TimeColumn(column, str(unit), size)
    return None


def _bandpass(top: Section, problems: Problems) -> tuple[float, float] | None:
    section = _section(top, "bandpass", problems)
    if section is None:
        return None
    _refuse_unknown(section, ("low", "high"), problems)
    for key in ("low", "high"):
        if section.values.get(key) is None:
            problems.add(f"'{key}' is missing; give both low and high", where=top.where("bandpass"))
    low = _positive(section, "low", "frequency", problems)
    high = _positive(section, "high", "frequency", problems)
    if low is None or high is None:
        return None
    if low >= high:
        problems.add(
            f"low ({low:g} Hz) is not below high ({high:g} Hz)", where=top.where("bandpass")
        )
    return low, high
