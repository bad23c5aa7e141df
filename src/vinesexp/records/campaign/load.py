"""A campaign folder: campaign.yaml and records.csv, validated as one.

`load_campaign` is what every step starts from, so it reads nothing but the two small files;
instrument files that are missing are reported when their record is ingested.

Of campaign.yaml every key is known or an error that suggests the nearest one; a unit is never
guessed. All mistakes of the file are collected, each with its line and key. Editors complete and
check the file with the JSON schema beside this module; the validation here is stricter (units,
columns, values that contradict one another).
"""

from __future__ import annotations

import shlex
from collections.abc import MutableMapping
from dataclasses import replace
from pathlib import Path

from vinesexp.errors import ParameterError, VinesexpError, nearest
from vinesexp.records.campaign.channel_section import read_channels_section, read_setups, read_time
from vinesexp.records.campaign.problems import Problems, raise_first
from vinesexp.records.campaign.published_table import read_published
from vinesexp.records.campaign.records_csv import RowText, read_table
from vinesexp.records.campaign.schema import SHEETS, Campaign, Known, Record, Setup, sheet_of
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


def load_campaign(folder: Path) -> Campaign:
    """Understand a campaign folder, or say in one line what is wrong with it.

    Parameters
    ----------
    folder : Path
        Holds campaign.yaml and records.csv (docs/campaign.md).

    Returns
    -------
    Campaign
        Everything in SI.

    Raises
    ------
    CampaignError
        The first mistake found, and how many more there are; `campaign_problems` has them all.
    """
    campaign, problems = read_campaign(Path(folder))
    raise_first(problems, f": vinesexp check {folder}")
    return campaign


def campaign_problems(folder: Path) -> list[VinesexpError]:
    """Every mistake in campaign.yaml and records.csv, in the order of the files."""
    return read_campaign(Path(folder))[1]


def read_campaign(
    folder: Path, *, known: MutableMapping[RowText, Record] | None = None
) -> tuple[Campaign, list[VinesexpError]]:
    """What can be understood of a campaign folder, and every mistake in it.

    Parameters
    ----------
    folder : Path
    known : mapping, optional
        Rows that were read before, as of `read_table`; of the same campaign.yaml.
    """
    whole, described, listed = map(Problems, (folder, folder / "campaign.yaml", sheet_of(folder)))
    if not folder.is_dir():
        found = "is not a folder" if folder.exists() else "no such folder"
        whole.add(f"{found}; give the folder that holds campaign.yaml and records.csv")
        return Campaign(folder, folder.name, folder.name), whole.found
    if not any((folder / name).exists() for name in ("campaign.yaml", *SHEETS)):
        whole.add(
            "holds neither campaign.yaml nor records.csv; put the instrument's files into it and "
            f"type: vinesexp init {shlex.quote(str(folder))}"
        )
        return Campaign(folder, folder.name, folder.name), whole.found
    if all((folder / name).exists() for name in SHEETS):
        whole.add("holds records.csv and records.xlsx; keep the one that counts")
    campaign, outside = read_description(folder, described)
    records = read_table(campaign, allow_outside=outside, problems=listed, known=known)
    of_people = (replace(r, people={**campaign.people, **r.people}) for r in records)
    campaign = replace(campaign, records=tuple(of_people))
    return campaign, [*whole.found, *described.found, *listed.found]


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
    mass = section.read("mass", _mass, None)
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
