"""A campaign folder: campaign.yaml and records.csv, validated as one.

`load_campaign` is what every step starts from, so it reads nothing but the two small files;
instrument files that are missing are reported when their record is ingested.
"""

from __future__ import annotations

import shlex
from collections.abc import MutableMapping
from dataclasses import replace
from pathlib import Path

from vinesexp.errors import VinesexpError
from vinesexp.records.campaign.description import read_description
from vinesexp.records.campaign.problems import Problems, raise_first
from vinesexp.records.campaign.records_csv import RowText, read_table
from vinesexp.records.campaign.schema import SHEETS, Campaign, Record, sheet_of


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
