"""campaign.yaml: what is known of rig and sensors, read strictly.

Every key is known or an error that suggests the nearest one; a unit is never guessed. All
mistakes of the file are collected, each with its line and key.

Editors complete and check the file with the JSON schema beside this module; the validation here is
stricter (units, columns, values that contradict one another).
"""

from __future__ import annotations

from pathlib import Path

from vinesexp.errors import ParameterError, nearest
from vinesexp.records.campaign.channel_section import (
    read_channels_section,
    read_setups,
    read_time,
)
from vinesexp.records.campaign.problems import Problems
from vinesexp.records.campaign.published_table import read_published
from vinesexp.records.campaign.schema import Campaign, Known, Setup
from vinesexp.records.campaign.uncertainties import Uncertainties, read_uncertainties
from vinesexp.records.campaign.yamltree import Section, read_yaml
from vinesexp.settings.stages import STAGES, Settings, changed
from vinesexp.units import Quantity, parse_quantity, refuse_impossible

#: Keys of campaign.yaml that the analysis reads.
KEYS = (
    *("title", "known", "channels", "time", "sample_rate", "bandpass", "settings"),
    *("uncertainties", "allow_outside", "setups", "published"),
)
KNOWN_KEYS = ("mass", "nes_mass")
BAND_KEYS = ("low", "high")

#: Keys for people: text, carried into the results and never used in them.
PEOPLE_KEYS = (
    "author", "license", "operator", "date", "instrument", "place", "temperature", "notes",
)  # fmt: skip

#: What editors check campaign.yaml with.
SCHEMA = Path(__file__).with_name("campaign.schema.json")


def read_description(folder: Path, problems: Problems) -> tuple[Campaign, bool]:
    """What campaign.yaml says, and whether files may lie outside; mistakes go to `problems`."""
    name = folder.resolve().name
    top = read_yaml(problems)
    if top is None:
        return Campaign(folder, name, name), False
    top.refuse_unknown((*KEYS, *PEOPLE_KEYS))
    if {"time", "sample_rate"} <= set(top.names()):
        top.complain(
            "sample_rate",
            "both 'time' and 'sample_rate' are given; keep 'time' where the files have a time "
            "column, else 'sample_rate'",
        )
    channels, time = read_channels_section(top), read_time(top)
    rate = top.quantity("sample_rate", "frequency")
    outside = top.answer("allow_outside")
    gains = {role: channel.gain_error for role, channel in channels.items()}
    campaign = Campaign(
        folder=folder,
        name=name,
        title=top.text("title") or name,
        known=_known(top, read_uncertainties(top, gains)),
        channels=channels,
        time=time,
        sample_rate=rate,
        bandpass=_bandpass(top),
        settings=read_settings(top),
        setups=read_setups(top, Setup(channels, time, rate)),
        people={key: str(top.value(key)) for key in PEOPLE_KEYS if top.value(key)},
        published=read_published(top, folder, allow_outside=outside),
    )
    return campaign, outside


def _known(top: Section, uncertainties: Uncertainties) -> Known:
    section = top.under("known")
    section.refuse_unknown(KNOWN_KEYS)
    mass = None
    if section.value("mass") is not None:
        with section.at("mass"):
            mass = _mass(section.value("mass"))
    balls: list[Quantity] = []
    for text in section.listed("nes_mass"):
        with section.at("nes_mass"):
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
    found = parse_quantity(text, "mass")
    if found.value <= 0.0:
        raise ParameterError(f"found '{text}', expected a mass above zero")
    refuse_impossible(text, found.value, "mass")
    return found


def _bandpass(top: Section) -> tuple[float, float] | None:
    section = top.under("bandpass")
    if not section:
        return None
    section.refuse_unknown(BAND_KEYS)
    for key in BAND_KEYS:
        if section.value(key) is None:
            top.complain("bandpass", f"'{key}' is missing; give both low and high")
    low, high = (section.quantity(key, "frequency") for key in BAND_KEYS)
    if low is None or high is None:
        return None
    if low >= high:
        top.complain("bandpass", f"low ({low:g} Hz) is not below high ({high:g} Hz)")
    return low, high


def read_settings(top: Section) -> Settings:
    """Settings of a campaign: under `settings` a section a stage, each number by its name."""
    found, more = Settings(), "; docs/settings.md lists them"
    section = top.under("settings", more=more)
    for stage in section.names():
        if stage not in STAGES:
            section.complain(stage, f"unknown stage '{stage}'; {nearest(stage, STAGES)}")
            continue
        numbers = section.under(stage, more=more)
        for name in numbers.names():
            with numbers.at(name):
                found = changed(found, stage, name, numbers.value(name))
    return found
