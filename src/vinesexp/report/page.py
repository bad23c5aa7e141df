"""The report: one HTML page that opens anywhere, with its figures inside."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from vinesexp.clearance.levels import Periodic, periodic_levels
from vinesexp.clearance.predicted import identified_rig
from vinesexp.figures.gallery import listed
from vinesexp.figures.numbers import significant
from vinesexp.identification.untested import UNTESTED
from vinesexp.records.campaign import Campaign
from vinesexp.records.readers.parts import file_of
from vinesexp.records.result_columns import (
    BANDS,
    BASE,
    BUDGET,
    CHECKS,
    CLEARANCES,
    DECAY_TIMES,
    IDENTIFIED,
    LEVEL_VALUES,
    RECORD_REGIMES,
    REPLAY,
    TABLES,
    TRANSITIONS,
)
from vinesexp.records.tables import Table, read_rows
from vinesexp.report.budget_rows import budget_table
from vinesexp.report.errorbars import coverage_table
from vinesexp.report.inline_figures import inline_svg
from vinesexp.report.level_rows import levels_table
from vinesexp.report.other_branches import other_branches
from vinesexp.report.parameter_rows import PARAMETERS, SYMBOLS, identified_table
from vinesexp.report.processing import changed_settings, processed_records
from vinesexp.report.provenance import provenance
from vinesexp.report.published import published_rows
from vinesexp.report.regime_rows import regimes_by_test
from vinesexp.report.replay_verdict import replay_verdict
from vinesexp.report.summaries import (
    MOST_ROWS,
    files_beside,
    grouped,
    sections_of_tests,
)
from vinesexp.report.verdict import headline, periodic_verdicts, release_verdicts
from vinesexp.theory.regime_definitions import REGIMES

Row = Mapping[str, str]

#: Outcomes of checks, worst first.
SEVERITY = {"refused": 0, "excluded": 1, "warning": 2}

#: Tests in the order of the page, each with its heading.
TESTS = {
    "ringdown": "Ring-downs",
    "sweep": "Sweeps",
    "periodic": "Periodic tests",
    "transient": "Releases",
    "drop": "Drop tests",
}

#: Settings of the tests that get a column where any test has them.
SETTINGS = {
    "clearances": "clearance (mm)",
    "base": "base amplitude (mm)",
    "frequency": "frequency (Hz)",
    "added": "added mass (g)",
    "release": "release (mm)",
}


def build_report(campaign: Campaign, results: Path, out: Path) -> Path:
    """Assemble report.html from the finished tables and figures.

    Parameters
    ----------
    campaign : Campaign
    results : Path
        Folder with identified.csv, regimes.csv, clearances.csv, checks.csv and figures/.
    out : Path
        The page; it appears only when complete.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("vinesexp.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(significant=significant, symbols=symbols)
    html = environment.get_template("report.html.j2").render(**page_content(campaign, results))
    partial = out.with_name(f".{out.name}.part")
    partial.write_text(html, encoding="utf-8")
    os.replace(partial, out)
    return out


def page_content(campaign: Campaign, results: Path) -> dict[str, Any]:
    """Everything the template shows, finished."""
    tables = {
        table.name: read_rows(results / f"{table.name}.csv", table)
        for table in (
            IDENTIFIED,
            LEVEL_VALUES,
            RECORD_REGIMES,
            BASE,
            CLEARANCES,
            REPLAY,
            CHECKS,
        )
    }
    records = [file_of(file) for record in campaign.records for file in record.files]
    records = list(dict.fromkeys(records))  # a file may hold several records
    description = [campaign.folder / name for name in ("campaign.yaml", "records.csv")]
    processed = processed_records(campaign, results)
    parameters = identified_table(tables["identified"])
    known = {row["name"] for row in parameters}
    tests = tests_table(campaign, tables["checks"])
    problems = [row for row in tables["checks"] if row["outcome"] != "ok"]
    found = [row for row in tables["checks"] if row["outcome"] == "ok"]
    figures = [{**vars(drawn), "svg": inline_svg(results, drawn)} for drawn in listed(results)]
    first = min(figures, key=_early, default=None)
    bands, transitions = _read(results, BANDS), _read(results, TRANSITIONS)
    regimes = regimes_by_test(campaign, tables["regimes"], bands=bands, transitions=transitions)
    return {
        "campaign": campaign,
        **_verdict(campaign, tables, {row["name"]: row["value"] for row in parameters}),
        "parameters": parameters,
        "levels": levels_table(tables["level_values"]),
        "unknown": {name: what for name, what in PARAMETERS.items() if name not in known},
        "regimes": regimes,
        "definitions": REGIMES,
        "tests": tests,
        "columns": [
            {"key": key, "name": name}
            for key, name in SETTINGS.items()
            if any(row[key] != "–" for row in tests)
        ],
        "problems": grouped(
            sorted(
                (row for row in problems if row["record"]), key=lambda row: SEVERITY[row["outcome"]]
            )
        ),
        "notes": [row for row in found if row["check"] not in ("ingest", UNTESTED)],
        "untested": [row for row in found if row["check"] == UNTESTED],
        "limits": [row for row in problems if not row["record"]],
        "refused": len({row["record"] for row in problems if row["outcome"] == "refused"}),
        "excluded": len({row["record"] for row in problems if row["outcome"] == "excluded"}),
        "figures": figures,
        "first": first,
        "sections": sections_of_tests(
            TESTS, tests, [figure for figure in figures if figure is not first], regimes
        ),
        "most": MOST_ROWS,
        "files": files_beside(results, [table.name for table in TABLES]),
        "coverage": coverage_table(),
        "budget": budget_table(_read(results, BUDGET)),
        "published": published_rows(
            campaign,
            tables | {t.name: _read(results, t) for t in (DECAY_TIMES, TRANSITIONS)},
        ),
        "branches": other_branches(
            _levels(campaign, tables),
            tables["clearances"],
            identified_rig(tables["identified"], campaign.known),
        ),
        "replay": replay_verdict(tables["replay"], tables["checks"]),
        "written": SYMBOLS,
        "processed": processed,
        "changed_settings": changed_settings(campaign),
        "provenance": provenance(
            [*description, *records],
            folder=campaign.folder,
            digests={
                file_of(file): digest
                for row in processed
                for file, digest in zip(
                    campaign.record(row.record).files, row.sha256.split(";"), strict=False
                )
            },
        ),
    }


def _read(results: Path, table: Table) -> list[dict[str, str]]:
    """Rows of a table; none where it is not there."""
    file = results / f"{table.name}.csv"
    return read_rows(file, table) if file.is_file() else []


def _early(figure: Mapping[str, Any]) -> int:
    """Which figure stands beside the verdict: clearances, else the fit of a ring-down."""
    return 0 if figure["section"] == "clearance" else 1 if figure["name"] == "ringdown_fit" else 2


def _levels(campaign: Campaign, tables: Mapping[str, list[dict[str, str]]]) -> list[Periodic]:
    return periodic_levels(campaign, tables["regimes"], tables["base"], tables["identified"])


def _verdict(
    campaign: Campaign, tables: Mapping[str, list[dict[str, str]]], parameters: Mapping[str, str]
) -> dict[str, Any]:
    levels = _levels(campaign, tables)
    rig = identified_rig(tables["identified"], campaign.known)
    periodic = periodic_verdicts(
        levels, tables["clearances"], rig, tables["replay"], tables["level_values"]
    )
    releases = release_verdicts(tables["clearances"])
    return {
        "periodic": periodic,
        "releases": releases,
        "headline": headline(periodic, releases, parameters, tables["checks"]),
    }


def tests_table(campaign: Campaign, checks: Sequence[Row]) -> list[dict[str, Any]]:
    """What was measured: for each kind of test, how many records and over which range."""
    rows = []
    unused = {row["record"] for row in checks if row["outcome"] in ("refused", "excluded")}
    for test, heading in TESTS.items():
        records = [r for r in campaign.records if r.test == test]
        if records:
            rows.append(
                {
                    "test": test,
                    "heading": heading,
                    "count": len(records),
                    "unused": sum(record.id in unused for record in records),
                    "clearances": _range([1e3 * b for r in records for b in r.clearance]),
                    "base": _range([1e3 * r.base_amplitude for r in records if r.base_amplitude]),
                    "frequency": _range([f for r in records for f in r.frequency or ()]),
                    "added": _range([1e3 * r.added_mass for r in records if r.added_mass]),
                    "release": _range([1e3 * r.release for r in records if r.release]),
                }
            )
    return rows


def _range(values: Sequence[float]) -> str:
    if not values:
        return "–"
    low, high = min(values), max(values)
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def symbols(text: str) -> Any:
    """Text as markup, with b_c and b_t as they are written on paper.

    Examples
    --------
    >>> str(symbols("b_c < b_t"))
    'b<sub>c</sub> &lt; b<sub>t</sub>'
    """
    from markupsafe import Markup, escape

    return Markup(re.sub(r"\bb_([ct])\b", r"b<sub>\1</sub>", str(escape(text))))
