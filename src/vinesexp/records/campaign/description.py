"""campaign.yaml: what is known of rig and sensors, read strictly.

Every key is known or an error that suggests the nearest one; a unit is never guessed. All
mistakes of the file are collected, each with its line and key.

The JSON schema of campaign.yaml is made from the names that its validation knows. Editors complete
and check the file with it; the package's own validation is stricter (units, columns, values that
contradict one another).
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from vinesexp.errors import ParameterError, nearest
from vinesexp.records.campaign.channel_section import (
    CHANNEL_KEYS,
    SETUP_KEYS,
    SOUND_KEYS,
    above_zero,
    positive,
    read_channels_section,
    read_setups,
    read_time,
    refuse_unknown,
    subsection,
    yes_or_no,
)
from vinesexp.records.campaign.problems import Problems
from vinesexp.records.campaign.published_table import PublishedValue, read_published
from vinesexp.records.campaign.schema import ACCEPTABLE, ROLES, Channel, Known, Setup, TimeColumn
from vinesexp.records.campaign.uncertainties import Uncertainties, read_uncertainties
from vinesexp.records.campaign.yamltree import Section, read_yaml
from vinesexp.settings.overrides import STAGES, changed, numbers_of
from vinesexp.settings.stages import Settings
from vinesexp.units import Quantity, refuse_impossible

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
    "setups",
    "published",
)

KNOWN_KEYS = ("mass", "nes_mass")
BAND_KEYS = ("low", "high")

#: Keys for people: text, carried into the results and never used in them.
PEOPLE_KEYS = (
    "author", "license", "operator", "date", "instrument", "place", "temperature", "notes",
)  # fmt: skip


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
    setups: dict[str, Setup] = field(default_factory=dict)
    people: dict[str, str] = field(default_factory=dict)
    published: tuple[PublishedValue, ...] = ()


def read_description(file: Path, problems: Problems) -> Description:
    """Read campaign.yaml; what is wrong goes to `problems`, what is right is returned."""
    top = read_yaml(file, problems)
    if top is None:
        return Description()
    refuse_unknown(top, (*KEYS, *PEOPLE_KEYS), problems)
    if "time" in top.values and "sample_rate" in top.values:
        problems.add(
            "both 'time' and 'sample_rate' are given; keep 'time' where the files have a time "
            "column, else 'sample_rate'",
            where=top.where("sample_rate"),
        )
    title = top.values.get("title")
    channels = read_channels_section(top, problems)
    time = read_time(top, problems)
    rate = positive(top, "sample_rate", "frequency", problems)
    outside = yes_or_no(top, "allow_outside", problems)
    gains = {role: channel.gain_error for role, channel in channels.items()}
    return Description(
        title=None if title is None else str(title),
        known=_known(top, read_uncertainties(top, gains, problems), problems),
        channels=channels,
        time=time,
        sample_rate=rate,
        bandpass=_bandpass(top, problems),
        settings=read_settings(top, problems),
        allow_outside=outside,
        setups=read_setups(top, Setup(channels, time, rate), problems),
        people={key: str(top.values[key]) for key in PEOPLE_KEYS if top.values.get(key)},
        published=read_published(top, file.parent, problems, allow_outside=outside),
    )


def _known(top: Section, uncertainties: Uncertainties, problems: Problems) -> Known:
    section = subsection(top, "known", problems)
    if section is None:
        return Known(uncertainties=uncertainties)
    refuse_unknown(section, KNOWN_KEYS, problems)
    mass = None
    if section.values.get("mass") is not None:
        with problems.at(section.where("mass")):
            mass = _mass(section.values["mass"])
    given = section.values.get("nes_mass")
    balls: list[Quantity] = []
    for text in given if isinstance(given, list) else [] if given is None else [given]:
        with problems.at(section.where("nes_mass")):
            ball = _mass(text)
            error = ball.std_error or uncertainties.nes_mass.of(ball.value)
            if mass is not None and ball.value > mass.value:
                raise ParameterError(
                    f"found '{text}', more than the mass {mass.value:g} kg that the ball is to "
                    "calm; write grams as 'g'"
                )
            balls.append(Quantity(ball.value, error))
    return Known(mass, tuple(balls), uncertainties)


def _mass(text: object) -> Quantity:
    found = above_zero(text, "mass")
    refuse_impossible(text, found.value, "mass")
    return found


def _bandpass(top: Section, problems: Problems) -> tuple[float, float] | None:
    section = subsection(top, "bandpass", problems)
    if section is None:
        return None
    refuse_unknown(section, BAND_KEYS, problems)
    for key in ("low", "high"):
        if section.values.get(key) is None:
            problems.add(f"'{key}' is missing; give both low and high", where=top.where("bandpass"))
    low = positive(section, "low", "frequency", problems)
    high = positive(section, "high", "frequency", problems)
    if low is None or high is None:
        return None
    if low >= high:
        problems.add(
            f"low ({low:g} Hz) is not below high ({high:g} Hz)", where=top.where("bandpass")
        )
    return low, high


def read_settings(top: Section, problems: Problems) -> Settings:
    """Settings of a campaign: under `settings` a section a stage, each number by its name."""
    found = Settings()
    section = top.values.get("settings")
    if section is None:
        return found
    if not isinstance(section, Section):
        problems.add(_not_a_section(section), where=top.where("settings"))
        return found
    for stage, numbers in section.values.items():
        if stage not in STAGES:
            problems.add(
                f"unknown stage '{stage}'; {nearest(stage, STAGES)}", where=section.where(stage)
            )
        elif isinstance(numbers, Section):
            for name, text in numbers.values.items():
                with problems.at(numbers.where(name)):
                    found = changed(found, stage, name, text)
        elif numbers is not None:
            problems.add(_not_a_section(numbers), where=section.where(stage))
    return found


def _not_a_section(value: object) -> str:
    return f"found '{value}', expected 'name: value' pairs; docs/settings.md lists them"


NAME = "campaign.schema.json"

_TEXT: dict[str, Any] = {"type": ["string", "number"]}
_ANSWER: dict[str, Any] = {"enum": ["yes", "no", True, False]}
_COLUMN: dict[str, Any] = {
    "type": ["string", "integer"],
    "description": "name, pattern such as Laser*, or number from 0",
}
_CHANNEL: dict[str, dict[str, Any]] = {
    "column": _COLUMN,
    "unit": {"type": "string", "description": "the file is in this unit"},
    "radius": {
        **_TEXT,
        "description": "of an angle or its rate: the distance from the axis, 0.5 m",
    },
    "sensitivity": {"type": "string", "description": "output per measured unit: 100 mV/g"},
    "offset": {**_TEXT, "description": "output at zero: 2.5 V"},
    "file_unit": {"type": "string", "description": "what one number of the file is: mV"},
    "optional": _ANSWER,
    "accept": {"description": "defects that are warnings: " + ", ".join(ACCEPTABLE)},
}


def campaign_schema() -> dict[str, Any]:
    """The schema as a dictionary (JSON schema, draft 7)."""
    parts: dict[str, dict[str, Any]] = {
        "known": _section({key: {} for key in KNOWN_KEYS}),
        "channels": _channels(),
        "time": _time(),
        "sample_rate": {"type": "string", "description": "10 kHz; not together with time"},
        "bandpass": _section({key: {"type": "string"} for key in BAND_KEYS}),
        "settings": _section(
            {s: _section({n.name: {} for n in numbers_of(s)}) for s in STAGES}, nullable=True
        ),
        "uncertainties": _section({one.name: {} for one in fields(Uncertainties)}),
        "allow_outside": _ANSWER,
        "setups": {
            "type": "object",
            "additionalProperties": _section(
                {key: {"type": "string"} for key in SETUP_KEYS}
                | {"channels": _channels(), "time": _time()}
            ),
        },
    }
    properties = {key: parts.get(key, _TEXT) for key in (*KEYS, *PEOPLE_KEYS)}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "campaign.yaml of vinesexp",
        **_section(properties),
        "required": ["channels"],
    }


def schema_text() -> str:
    """The schema as JSON text.

    Examples
    --------
    >>> '"displacement"' in schema_text()
    True
    """
    return json.dumps(campaign_schema(), indent=1, sort_keys=True) + "\n"


def _section(properties: dict[str, Any], *, nullable: bool = False) -> dict[str, Any]:
    kind: Any = ["object", "null"] if nullable else "object"
    return {"type": kind, "properties": properties, "additionalProperties": False}


def _channels() -> dict[str, Any]:
    found = {}
    for role, quantities in ROLES.items():
        if role == "sound":
            keys = {key: _CHANNEL.get(key, {}) for key in SOUND_KEYS}
            found[role] = {**_section(keys), "required": ["column"]}
            continue
        keys = {key: _CHANNEL.get(key, {}) for key in CHANNEL_KEYS}
        keys["quantity"] = {"enum": list(quantities)}
        found[role] = {**_section(keys), "required": ["column", "quantity"]}
        found[role]["oneOf"] = [{"required": ["unit"]}, {"required": ["sensitivity"]}]
    return _section(found)


def _time() -> dict[str, Any]:
    return {**_section({"column": _COLUMN, "unit": {"type": "string"}}), "required": ["unit"]}
