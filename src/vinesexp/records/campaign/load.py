"""A campaign folder: campaign.yaml and records.csv, validated as one.

`load_campaign` is what every step starts from, so it reads nothing but the two small files;
instrument files that are missing are reported when their record is ingested.
"""

from __future__ import annotations

from collections.abc import MutableMapping
from dataclasses import replace
from pathlib import Path

from vinesexp.errors import CampaignError, VinesexpError
from vinesexp.records.campaign.description import Description, read_description
from vinesexp.records.campaign.problems import Problems
from vinesexp.records.campaign.records_csv import RowText, read_table
from vinesexp.records.campaign.schema import (
    ROLES,
    SHEETS,
    SI_UNITS,
    TESTS,
    Campaign,
    Channel,
    Known,
    Record,
    TimeColumn,
    sheet_of,
)

__all__ = [
    "ROLES",
    "SI_UNITS",
    "TESTS",
    "Campaign",
    "Channel",
    "Known",
    "Record",
    "TimeColumn",
    "campaign_problems",
    "load_campaign",
    "read_campaign",
]


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
    if problems:
        first = problems[0]
        more = f" (and {len(problems) - 1} more: vinesexp check {folder})"
        raise CampaignError(
            first.problem + (more if len(problems) > 1 else ""), file=first.file, where=first.where
        )
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
    problems = Problems(folder)
    description_problems = Problems(folder / "campaign.yaml")
    table_problems = Problems(sheet_of(folder))
    description = Description()
    records: tuple[Record, ...] = ()
    if not folder.is_dir():
        problems.add(
            "is not a folder; give the folder that holds campaign.yaml and records.csv"
            if folder.exists()
            else "no such folder; give the folder that holds campaign.yaml and records.csv"
        )
    else:
        if all((folder / name).exists() for name in SHEETS):
            problems.add("holds records.csv and records.xlsx; keep the one that counts")
        description = read_description(folder / "campaign.yaml", description_problems)
        records = read_table(
            sheet_of(folder),
            folder,
            allow_outside=description.allow_outside,
            n_masses=len(description.known.nes_mass),
            setups=tuple(description.setups),
            problems=table_problems,
            settings=description.settings,
            known=known,
        )
    name = folder.resolve().name
    campaign = Campaign(
        folder=folder,
        name=name,
        title=description.title or name,
        known=description.known,
        channels=description.channels,
        time=description.time,
        sample_rate=description.sample_rate,
        bandpass=description.bandpass,
        records=tuple(
            replace(record, people={**description.people, **record.people}) for record in records
        ),
        setups=description.setups,
        people=description.people,
        settings=description.settings,
        published=description.published,
    )
    return campaign, [*problems.found, *description_problems.found, *table_problems.found]
