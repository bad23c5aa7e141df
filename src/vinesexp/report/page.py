"""The report: one HTML page that opens anywhere, with its figures inside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from vinesexp.clearance.levels import periodic_levels
from vinesexp.clearance.predicted import identified_rig
from vinesexp.figures.collect.stated_inputs import input_rows
from vinesexp.figures.gallery import listed
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
from vinesexp.records.tables import read_rows
from vinesexp.report.budget_rows import budget_table
from vinesexp.report.errorbars import coverage_table
from vinesexp.report.inline_figures import inline_svg
from vinesexp.report.level_rows import levels_table
from vinesexp.report.measured_rows import TESTS, settings_columns, tests_table
from vinesexp.report.other_branches import other_branches
from vinesexp.report.parameter_rows import PARAMETERS, SYMBOLS, identified_table
from vinesexp.report.problem_lists import problem_lists
from vinesexp.report.processing import Processed, changed_settings, processed_records
from vinesexp.report.provenance import provenance
from vinesexp.report.published import published_rows
from vinesexp.report.regime_rows import regimes_by_test
from vinesexp.report.rendering import rendered
from vinesexp.report.replay_verdict import replay_verdict
from vinesexp.report.stated_rows import stated_rows, stated_sentence
from vinesexp.report.summaries import MOST_ROWS, files_beside, sections_of_tests
from vinesexp.report.verdict import (
    headline,
    periodic_verdicts,
    release_lines,
    release_verdicts,
)
from vinesexp.theory.regime_definitions import REGIMES
from vinesexp.whole_files import write_whole

Tables = Mapping[str, list[dict[str, str]]]

#: Tables without which there is no report, and those that a campaign may lack.
_NEEDED = (IDENTIFIED, LEVEL_VALUES, RECORD_REGIMES, BASE, CLEARANCES, REPLAY, CHECKS)
_OPTIONAL = (BANDS, TRANSITIONS, BUDGET, DECAY_TIMES)


def build_report(campaign: Campaign, results: Path, out: Path) -> Path:
    """Assemble report.html from the finished tables and figures.

    Parameters
    ----------
    campaign : Campaign
    results : Path
        Folder with identified.csv, regimes.csv, clearances.csv, checks.csv and figures/.
    out : Path
        The page; it appears only when complete.

    Raises
    ------
    TableError
        A table is missing or is not what the step that writes it would write.
    """
    content = page_content(campaign, results)
    write_whole(out, rendered("vinesexp.report", "report.html.j2", content))
    return out


def page_content(campaign: Campaign, results: Path) -> dict[str, Any]:
    """Everything the template shows, finished."""
    tables = _tables(results)
    inputs = input_rows(results)
    parameters = identified_table(tables["identified"])
    known = {row["name"]: row["value"] for row in parameters}
    return {
        "campaign": campaign,
        **_answer(campaign, tables, known),
        "parameters": parameters,
        "unknown": {name: what for name, what in PARAMETERS.items() if name not in known},
        "levels": levels_table(tables["level_values"]),
        "coverage": coverage_table(),
        "budget": budget_table(tables["budget"]),
        "written": SYMBOLS,
        **_of_tests(campaign, results, tables),
        "definitions": REGIMES,
        "replay": replay_verdict(tables["replay"], tables["checks"]),
        "published": published_rows(campaign, tables),
        **problem_lists(tables["checks"]),
        "stated": stated_rows(inputs),
        "stated_sentence": stated_sentence(inputs),
        **_inputs(campaign, results),
        "files": files_beside(results, [table.name for table in TABLES]),
        "most": MOST_ROWS,
    }


def _tables(results: Path) -> Tables:
    """Rows of every table by its name; none where an optional one is not there."""
    files = {table: results / f"{table.name}.csv" for table in (*_NEEDED, *_OPTIONAL)}
    return {
        table.name: read_rows(file, table) if table in _NEEDED or file.is_file() else []
        for table, file in files.items()
    }


def _answer(campaign: Campaign, tables: Tables, parameters: Mapping[str, str]) -> dict[str, Any]:
    """The verdict on the clearances, and other motions that may explain what misses it."""
    levels = periodic_levels(campaign, tables["regimes"], tables["base"], tables["identified"])
    rig = identified_rig(tables["identified"], campaign.known)
    periodic = periodic_verdicts(
        levels, tables["clearances"], rig, tables["replay"], tables["level_values"]
    )
    releases = release_verdicts(tables["clearances"])
    return {
        "periodic": periodic,
        "releases": releases,
        "heights": release_lines(releases),
        "headline": headline(periodic, releases, parameters, tables["checks"]),
        "branches": other_branches(levels, tables["clearances"], rig),
    }


def _of_tests(campaign: Campaign, results: Path, tables: Tables) -> dict[str, Any]:
    """The parts on kinds of tests, and the figures: the first one stands beside the verdict."""
    figures = [{**vars(drawn), "svg": inline_svg(results, drawn)} for drawn in listed(results)]
    first = min(figures, key=_early, default=None)
    regimes = regimes_by_test(
        campaign, tables["regimes"], bands=tables["bands"], transitions=tables["transitions"]
    )
    tests = tests_table(campaign, tables["checks"])
    others = [figure for figure in figures if figure is not first]
    return {
        "tests": tests,
        "columns": settings_columns(tests),
        "regimes": regimes,
        "figures": figures,
        "first": first,
        "sections": sections_of_tests(TESTS, tests, others, regimes),
    }


def _early(figure: Mapping[str, Any]) -> int:
    """Which figure stands beside the verdict: clearances, else the fit of a ring-down."""
    return 0 if figure["section"] == "clearance" else 1 if figure["name"] == "ringdown_fit" else 2


def _inputs(campaign: Campaign, results: Path) -> dict[str, Any]:
    """What went in: how each record was processed, changed settings, digests of all files."""
    processed = processed_records(campaign, results)
    description = [campaign.folder / "campaign.yaml", campaign.sheet]
    records = [file_of(file) for record in campaign.records for file in record.files]
    records = list(dict.fromkeys(records))  # a file may hold several records
    return {
        "processed": processed,
        "changed_settings": changed_settings(campaign),
        "provenance": provenance(
            [*description, *records],
            folder=campaign.folder,
            digests=_digests(campaign, processed),
        ),
    }


def _digests(campaign: Campaign, processed: Sequence[Processed]) -> dict[Path, str]:
    """SHA-256 of each raw file as it was read."""
    return {
        file_of(file): digest
        for row in processed
        for file, digest in zip(
            campaign.record(row.record).files, row.sha256.split(";"), strict=False
        )
    }
