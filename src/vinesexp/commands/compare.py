"""`vinesexp compare A B [...]`: what changed between two results folders; what repeats in more."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

from vinesexp import results_differences as differences
from vinesexp.commands.options import add_force, add_options, refuse_existing, writing
from vinesexp.records.stored.tables import write_rows
from vinesexp.report import command_pages as pages
from vinesexp.results import open_results


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Results folders, and where page and table go."""
    parser.add_argument("a", type=Path, metavar="A", help="results folder, such as results/spring")
    parser.add_argument("b", type=Path, metavar="B", help="another; differences are B minus A")
    further = "further ones: then each value is tested for repeatability in all"
    parser.add_argument("more", type=Path, nargs="*", metavar="C", help=further)
    add_options(
        parser,
        ("--html FILE", "write a page"),
        ("--csv FILE", "write every row as a table"),
        ("--all", "print the rows that did not change, too"),
    )
    add_force(parser)


def run(args: argparse.Namespace) -> int:
    """Print what differs; 0 whether or not anything does."""
    refuse_existing(args.html, args.csv, force=args.force)
    folders = (args.a, args.b, *args.more)
    for folder in folders:
        open_results(folder)  # says in one line what is missing
    if args.more:
        repeated = differences.repeatability_of(folders)
        lines, page = repeated_text(repeated), partial(pages.repeatability_page, repeated)
        table, rows = differences.REPEATABILITY, repeated.rows()
    else:
        found = differences.compare_results(args.a, args.b)
        lines = differences_text(found, everything=args.all)
        page = partial(pages.differences_page, found)
        table, rows = differences.DIFFERENCES, [row.as_row() for row in found.rows]
    print("\n".join(lines))
    if args.html is not None:
        with writing(args.html):
            args.html.write_text(page(), encoding="utf-8")
    if args.csv is not None:
        with writing(args.csv):
            write_rows(args.csv, table, rows)
    return 0


def repeated_text(found: differences.Repeatability) -> list[str]:
    """Lines for the console: the answer, then a line a value."""
    lines = [pages.repeatability_lead(found), *filter(None, [pages.about_errors(found)]), ""]
    width = max([len(one.what) for one in found.series], default=0)
    for one in found.series:
        said = f"{pages.mean_in_words(one)}; {pages.spread_in_words(one)}"
        lines.append(f"{one.what:<{width}}  {one.verdict}: {said}")
    return lines


def differences_text(found: differences.Differences, *, everything: bool = False) -> list[str]:
    """Lines for the console: the answer, the data, then values, clearances, and what changed."""
    lines = [f"A: {found.a}", f"B: {found.b}", found.about_data(), pages.lead(found), ""]
    shown = [
        row for row in found.rows if everything or row.matters or row.kind in ("value", "clearance")
    ]
    width = max([len(_name(row)) for row in shown], default=0)
    for row in shown:
        apart = row.errors_apart
        much = "" if apart is None else f" ({abs(apart):.1f} errors apart)"
        note = f"; {row.note}" if row.note else ""
        change = f"{row.a or '-'} -> {row.b or '-'}"
        lines.append(f"{_name(row):<{width}}  {row.verdict}{much}: {change}{note}")
    return lines


def _name(row: differences.Difference) -> str:
    return f"{row.what} ({row.unit})" if row.unit not in ("", "1") else row.what
