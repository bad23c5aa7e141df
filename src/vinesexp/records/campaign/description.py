"""campaign.yaml: what is known of rig and sensors, read strictly.

Every key is known or an error that suggests the nearest one; a unit is never guessed. All
mistakes of the file are collected, each with its line and key.

The part of campaign.yaml that changes numbers which steer the stages.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from vinesexp.errors import ParameterError, nearest
from vinesexp.records.campaign.channel_section import (
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
from vinesexp.records.campaign.schema import Channel, Known, Setup, TimeColumn
from vinesexp.records.campaign.uncertainties import Uncertainties, read_uncertainties
from vinesexp.records.campaign.yamltree import Section, read_yaml
from vinesexp.settings.overrides import STAGES, changed
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
