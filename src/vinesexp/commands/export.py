"""`vinesexp export`: records, impacts and tables for other programs and for an archive."""

from __future__ import annotations

import argparse
import re
import shutil
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from vinesexp.commands.options import add_options, writing
from vinesexp.errors import RecordError, VinesexpError, nearest
from vinesexp.handover.crate import NAME, Described, write_crate
from vinesexp.handover.formats import WRITERS
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.stored.refusal import is_of_the_machine
from vinesexp.records.stored.result_columns import TABLES
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.results import open_results
from vinesexp.resultslock import campaign_of
from vinesexp.units import counted


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A results folder, where it goes, and in which form."""
    parser.add_argument(
        "results", type=Path, metavar="RESULTS", help="results folder, such as results/mytests"
    )
    parser.add_argument("out", type=Path, metavar="FOLDER", help="folder to write")
    parser.add_argument(
        "--format", choices=sorted(WRITERS), default="csv", help="format of the records (csv)"
    )
    width = "write the figures instead of the records, MM wide, such as a journal's 90 or 190"
    add_options(parser, ("--record ID", "only this record (may be repeated)"), action="append")
    add_options(parser, ("--conditioned", "write the bandpassed channels"))
    add_options(parser, ("--figures MM", width), type=float, action="append")


def run(args: argparse.Namespace) -> int:
    """Write the files; records that could not be used are left out, and named."""
    open_results(args.results)  # says in one line what is missing
    names, said = _asked(args.results, args.record), _said(args.results)
    if args.out.exists() and any(args.out.iterdir()):
        raise VinesexpError("holds files already; name an empty or a new folder", file=args.out)
    campaign = _campaign(args) if args.figures else None
    with writing(args.out / NAME):
        files = _tables(args.results, args.out)
        files += _records(args, names) if campaign is None else _figures(args, campaign)
        write_crate(args.out, files=files, **said)
    megabytes = sum(file.path.stat().st_size for file in files) / 1e6
    print(f"{args.out}: {counted(len(files), 'file')}, {megabytes:.1f} MB, described in {NAME}")
    return 0


def _said(results: Path) -> dict[str, Any]:
    """Title, authors and licence, as campaign.yaml has them."""
    title, people = results.resolve().name, dict[str, str]()
    with suppress(VinesexpError):  # results that were moved away from their campaign
        campaign = load_campaign(campaign_of(results))
        title, people = campaign.title, dict(campaign.people)
    license = people.get("license", "")
    if not re.fullmatch(r"[A-Za-z0-9.+-]*", license):
        raise VinesexpError(
            f"license: found '{license}', expected an SPDX identifier such as CC-BY-4.0 or CC0-1.0"
        )
    authors = [name.strip() for name in people.get("author", "").split(";") if name.strip()]
    return {"title": title, "authors": authors, "license": license}


def _asked(results: Path, wanted: Sequence[str] | None) -> list[str]:
    known = open_results(results).record_names  # not the folder, which may hold more
    for name in wanted or ():
        if name not in known:
            raise RecordError(f"has no record '{name}'; {nearest(name, known)}", file=results)
    return list(wanted or known)


def _tables(results: Path, out: Path) -> list[Described]:
    """The tables of the whole campaign, copied."""
    found = []
    for table in TABLES.values():
        source, target = results / table.file, out / table.file
        if source.is_file() and "/" not in table.file:
            shutil.copyfile(source, target)
            found.append(Described(target, table.answers, {}))
    return found


def _campaign(args: argparse.Namespace) -> Campaign:
    """The campaign whose figures are drawn; asked for before anything is written."""
    wrong = [width for width in args.figures if not 60.0 <= width <= 250.0]
    if wrong:
        raise VinesexpError(f"--figures {wrong[0]:g}: expected a width from 60 to 250 mm")
    return load_campaign(campaign_of(args.results))


def _figures(args: argparse.Namespace, campaign: Campaign) -> list[Described]:
    """Every figure in each width, in a folder a width."""
    from vinesexp.figures.gallery import draw_at_width

    found = []
    for width in dict.fromkeys(args.figures):
        folder = args.out / f"figures_{width:g}mm"
        for drawn in draw_at_width(campaign, args.results, folder, width=width):
            places = (folder / f"{drawn.name}.{ending}" for ending in ("svg", "pdf"))
            found += [Described(place, drawn.caption, {}) for place in places]
    return found


def _records(args: argparse.Namespace, names: Sequence[str]) -> list[Described]:
    paths, write = ResultPaths(args.results), WRITERS[args.format]
    found = []
    for name in names:
        try:
            with open_record(paths.record(name)) as measured:
                refused, about = measured.refused, dict(measured.attributes)
        except RecordError as error:  # one damaged file: the others are handed on
            refused = str(error)
        if refused is not None:
            print(f"{name}: left out: {refused}")
            continue
        behind = (str(about.get(name, "")).split(";") for name in ("source", "source_sha256"))
        sources = dict(zip(*behind, strict=False))
        path = paths.conditioned(name) if args.conditioned else paths.record(name)
        try:
            with open_record(path) as view, TemporaryDirectory(dir=args.out, prefix=".") as half:
                made = write(view, paths.impacts(name), Path(half), name)
                written = [file.replace(args.out / file.name) for file in made]
        except (RecordError, KeyError, RuntimeError, OSError) as error:
            if isinstance(error, OSError) and is_of_the_machine(error):
                raise
            said = " ".join(str(error).split())
            print(f"{name}: left out: {path} is damaged ({said}); remove it and run again")
            continue
        for file in written:
            kind = "impacts" if file.name.endswith(".impacts.csv") else "channels"
            found.append(Described(file, f"{kind} of record {name}, SI", sources))
    return found
