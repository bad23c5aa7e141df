"""`vinesexp check`: look a campaign over without running it.

Every record is read as ingest would read it, into a folder that is thrown away, so that what
passes here passes there.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from vinesexp.records.campaign import Campaign, campaign_problems, load_campaign
from vinesexp.records.checks import Check
from vinesexp.records.ingest import ingest_or_refuse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The campaign folder."""
    parser.add_argument(
        "path", type=Path, help="campaign folder, which holds campaign.yaml and records.csv"
    )


def run(args: argparse.Namespace) -> int:
    """Print a line per problem and a summary; 1 where anything cannot be used, else 0."""
    problems = campaign_problems(args.path)
    if problems:
        for problem in problems:
            print(problem)
        print(f"{_count(len(problems), 'problem')}; the records were not looked at")
        return 1
    campaign = load_campaign(args.path)
    outcomes: Counter[str] = Counter()
    for check in _checks(campaign):
        outcomes[check.outcome] += 1
        if check.outcome != "ok":
            print(f"{check.record}: {check.outcome}: {check.detail}", flush=True)
    print(_summary(campaign, outcomes))
    return 1 if outcomes["refused"] else 0


def _checks(campaign: Campaign) -> Iterator[Check]:
    simulated = (campaign.folder / "scene.yaml").is_file()
    with tempfile.TemporaryDirectory(prefix="vinesexp-check-") as folder:
        out = Path(folder) / "record.nc"
        for record in campaign.records:
            if simulated and not record.exclude and not record.file.exists():
                detail = f"{record.file} is not there yet; the run makes it from scene.yaml"
                yield Check(record.id, "simulate", "warning", detail)
                continue
            yield from ingest_or_refuse(campaign, record, out)


def _summary(campaign: Campaign, outcomes: Counter[str]) -> str:
    told = f"{_count(len(campaign.records), 'record')}: {outcomes['ok']} good"
    told += f", {outcomes['refused']} refused, {outcomes['excluded']} excluded"
    return f"{told}; {_count(outcomes['warning'], 'warning')}"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
