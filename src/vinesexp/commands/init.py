"""`vinesexp init`: campaign.yaml and records.csv or .xlsx proposed from a folder of instruments.

Everything uncertain is marked for a person to look at; what no file states is left open, and the
run refuses it until it is filled in. Nothing that is there is overwritten.
"""

from __future__ import annotations

import argparse
import json
import shlex
from collections import Counter
from pathlib import Path

from vinesexp.commands.options import Filters, add_options, text_of
from vinesexp.errors import CampaignError, RecordError, shown
from vinesexp.proposal.campaign_proposal import (
    SKIPPED,
    Proposal,
    ProposedChannel,
    propose,
)
from vinesexp.proposal.kind_of_test import OPEN
from vinesexp.proposal.survey import FileView, view_file
from vinesexp.records.campaign.load import SCHEMA
from vinesexp.records.campaign.records_csv import sheet_text
from vinesexp.records.campaign.records_xlsx import new_workbook
from vinesexp.records.campaign.schema import SHEETS
from vinesexp.units import UNITS, counted
from vinesexp.whole_files import write_whole

_OUTPUT = {
    "displacement": ("V/mm", "0.5 V/mm"),
    "velocity": ("V/(mm/s)", "0.1 V/(mm/s)"),
    "acceleration": ("mV/g", "100 mV/g"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The folder of files."""
    parser.add_argument("folder", type=Path, help="folder with instrument files, in it or below")
    add_options(parser, ("--xlsx", "write records.xlsx instead of records.csv"))


def run(args: argparse.Namespace) -> int:
    """Write the two files into the folder; 1 where nothing in it could be read."""
    folder: Path = args.folder
    if not folder.is_dir():
        raise CampaignError("is not a folder; name the one with the instrument files", file=folder)
    for name in ("campaign.yaml", *SHEETS):
        if (folder / name).exists():
            raise CampaignError("is there already and stays as it is", file=folder / name)
    views, others = _views(folder)
    if not views:
        for line in others:
            print(line)
        raise CampaignError(
            "holds no instrument file that can be read; copy what the instrument wrote into it",
            file=folder,
        )
    proposal = propose(folder, views)
    sheet = SHEETS[1] if args.xlsx else SHEETS[0]
    rows = [record.row() for record in proposal.records]
    proposed = [{"test", *record.cells} for record in proposal.records]
    contents = {
        "campaign.yaml": proposed_campaign_text(folder, proposal).encode(),
        sheet: new_workbook(rows, proposed=proposed) if args.xlsx else sheet_text(rows).encode(),
    }
    if not (folder / SCHEMA.name).exists():
        contents[SCHEMA.name] = SCHEMA.read_bytes()
    written: list[Path] = []
    try:
        for name, content in contents.items():
            write_whole(folder / name, content)
            written.append(folder / name)
    except OSError as error:
        for path in written:  # half of a proposal would stop the next one
            path.unlink(missing_ok=True)
        reason = error.strerror or str(error)
        raise CampaignError(
            f"cannot be written to ({reason}); copy the files into a folder of your own",
            file=folder,
        ) from None
    _report(folder, proposal, others, sheet)
    return 0


def proposed_campaign_text(folder: Path, proposal: Proposal) -> str:
    """campaign.yaml, with a reason beside every line that is not certain."""
    content = {"setups": proposal.setups, "open": OPEN, "schema": SCHEMA.name}
    title = shown(folder.resolve().name)
    filters: Filters = {"column": _column, "described": _described}
    return text_of("campaign.yaml.j2", filters, title=title, **content) + "\n"


def _column(column: str | int) -> str:
    """A column as it is written: a number as it is, text in quotes, as YAML reads it back.

    Examples
    --------
    >>> print(_column("2"), _column(2), _column('Laser "raw" C:'))
    "2" 2 "Laser \\"raw\\" C:"
    """
    return json.dumps(column, ensure_ascii=False)


def _described(channel: ProposedChannel) -> tuple[str, str]:
    """What a person has to do about a channel, and what of its entry follows its column."""
    if channel.quantity is None:
        return "check: ", ""
    if channel.unit is not None:
        value, mark = f'unit: "{channel.unit}"', "" if channel.sure else "check: "
        if channel.unit in UNITS["angle"] or channel.unit in UNITS["rate of turn"]:
            value += f', radius: "{OPEN} m"'
            mark = "FILL IN the distance of the mass from the axis, such as 0.5 m; "
    else:
        unit, example = _OUTPUT[channel.quantity]
        value, mark = f'sensitivity: "{OPEN} {unit}"', f"FILL IN, such as {example}; "
    return mark, f", quantity: {channel.quantity}, {value}"


def _views(folder: Path) -> tuple[list[FileView], list[str]]:
    views: list[FileView] = []
    others: list[str] = []
    paths = sorted(p for p in folder.rglob("*") if p.is_file() and not p.name.startswith("."))
    for path in paths:
        if path.suffix.lower() in SKIPPED:
            continue
        if reason := _unusable(path.relative_to(folder)):
            others.append(f"left out: {shown(str(path))}: {reason}")
            continue
        try:
            view = view_file(path)
        except RecordError as error:
            others.append(f"left out: {error}")
            continue
        if view.parts:
            print(f"{path.relative_to(folder)}: {counted(len(view.parts), 'record')}")
            for part in view.parts:
                try:
                    views.append(view_file(path.with_name(f"{path.name}#{part}")))
                except RecordError as error:
                    others.append(f"left out: {error}")
            continue
        views.append(view)
        rate = "rate unknown" if view.rate is None else f"{view.rate:g} Hz"
        signals = counted(len(view.signals), "signal")
        print(f"{path.relative_to(folder)}: {view.format}, {rate}, {signals}")
    return views, others


def _unusable(path: Path) -> str:
    """Why a path cannot stand in records.csv; empty where it can."""
    text = str(path)
    try:
        text.encode()
    except UnicodeEncodeError:
        return "its name is not UTF-8; rename it"
    if ";" in text or text != text.strip() or not text.isprintable():
        return "its name has a ';' or an unusual blank in it; rename it"
    return ""


def _report(folder: Path, proposal: Proposal, others: list[str], sheet: str) -> None:
    for line in others:
        print(line)
    for setup, channel in ((one.name, c) for one in proposal.setups for c in one.channels):
        of = f"{setup}, " if setup else ""
        print(f"{of}{channel.role}: column '{channel.column}', because {channel.why}")
    for record in proposal.records:
        if record.readings:
            print(f"{record.file}: {', '.join(map(str, record.readings))}")
    kinds = Counter(record.test for record in proposal.records)
    tests = ", ".join(f"{count} {'unclear' if t == OPEN else t}" for t, count in kinds.items())
    print(f"{counted(len(proposal.records), 'record')}: {tests}")
    print(f"written: {folder / 'campaign.yaml'}, {folder / sheet}; fill in what is marked,")
    print(f"then: vinesexp check {shlex.quote(str(folder))}")
