"""The report: one HTML page that opens anywhere, with its figures inside."""

from __future__ import annotations

import platform
import re
import subprocess
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from vinesexp.figures.gallery import listed
from vinesexp.figures.identified_values import input_rows, named
from vinesexp.figures.numbers import significant
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.readers.source import file_of
from vinesexp.records.stored.result_columns import TABLES
from vinesexp.records.stored.store import RecordView, open_record
from vinesexp.records.stored.tables import Row
from vinesexp.report import tables_shown, verdict
from vinesexp.report.published_beside import published_rows
from vinesexp.report.rendering import inline_svg, rendered
from vinesexp.results import CampaignResults
from vinesexp.settings.stages import differences
from vinesexp.signals.impacts.impact_table import read_impacts
from vinesexp.theory.regime_definitions import REGIMES
from vinesexp.whole_files import digest_of_file, write_whole

# Where a report comes from: code, inputs, software, date.
#: Packages whose versions a number can depend on.
SOFTWARE = ("numpy", "scipy", "pandas", "h5py", "xarray", "matplotlib", "numba", "snakemake")


def git_revision(folder: Path) -> str:
    """Revision of the code in `folder`, marked `-dirty` where it was changed since."""
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=12"],
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return "not under git"
    return done.stdout.strip()


def provenance(files: Mapping[Path, str], *, folder: Path) -> dict[str, Any]:
    """Everything that is needed to make the same report again.

    Parameters
    ----------
    files : mapping
        Inputs to their digests as they were read; empty: it is taken now. Those that exist are
        listed.
    folder : Path
        Names are relative to it.
    """
    home, inputs = folder.resolve(), []
    for path, digest in files.items():
        if path.is_file():
            status, full = path.stat(), path.resolve()
            inside = full.is_relative_to(home)
            inputs.append({
                "name": full.relative_to(home).as_posix() if inside else str(path),
                "size": status.st_size,
                "changed": _minute(datetime.fromtimestamp(status.st_mtime, tz=UTC)),
                "sha256": digest or digest_of_file(path),
            })  # fmt: skip
    return {
        "made": _minute(datetime.now(tz=UTC)),
        "package": version("vinesexp"),
        "revision": git_revision(Path(__file__).resolve().parent),
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "software": {name: version(name) for name in SOFTWARE},
        "inputs": inputs,
    }


def _minute(time: datetime) -> str:
    return time.strftime("%Y-%m-%d %H:%M UTC")


def processed_records(campaign: Campaign, results: Path) -> list[dict[str, Any]]:
    """Every usable record, from the attributes that the steps have left in its files.

    Returns
    -------
    list of dict
        ``record``; ``length`` and ``sample_rate``; ``oscillation`` that the bands follow, Hz;
        ``motion_band`` and ``impact_band``, what displacement and acceleration keep, Hz;
        ``impacts``, how many; ``sha256`` of the instrument file when it was read, empty where
        none was kept.
    """
    found = []
    for record in campaign.records:
        with open_record(results / f"records/{record.id}.nc") as view:
            sha256 = str(view.attributes.get("source_sha256", ""))
        with open_record(results / f"conditioned/{record.id}.nc") as view:
            if view.refused is not None or not view.n:
                continue
            drop = record.test == "drop"
            found.append(
                {
                    "record": record.id,
                    "length": f"{view.n / view.sample_rate:.4g} s",
                    "sample_rate": f"{1e-3 * view.sample_rate:.4g} kHz",
                    # What a drop test's bands follow is the ringing of its impacts.
                    "oscillation": "–" if drop else significant(view.oscillation, digits=4),
                    "motion_band": band_kept(view, "displacement") if not drop else "–",
                    "impact_band": band_kept(view, "acceleration"),
                    "impacts": read_impacts(results / f"impacts/{record.id}.csv").n,
                    "sha256": sha256,
                }
            )
    return found


def changed_settings(campaign: Campaign) -> list[tuple[str, str]]:
    """Settings that the campaign or a record changes: what they apply to, and their values."""
    every = campaign.settings
    found = [("all records", text) for text in differences(every)]
    return found + [
        (one.id, text) for one in campaign.records for text in differences(one.settings, every)
    ]


def band_kept(view: RecordView, role: str) -> str:
    """Edges of what a channel keeps, those that its sampling can hold; a dash without it."""
    if role not in view.roles:
        return "–"
    low, high = (view.attributes.get(f"{role}_{end}_hz") for end in ("low", "high"))
    if high is not None and float(high) >= 0.5 * view.sample_rate:
        high = None
    if low is None and high is None:
        return "all"
    least, most = (significant(end, digits=4) for end in (low, high))
    if high is None:
        return f"above {least}"
    return f"below {most}" if low is None else f"{least} to {most}"


#: Rows of a table of records that are shown; the others are on the page of all records.
MOST_ROWS = 100


def grouped(problems: Sequence[Row]) -> list[dict[str, Any]]:
    """Problems, those that say the same of several records together.

    They say the same where their words are, whatever the numbers; where that leaves too many to
    read, where it is one check. Each has ``outcome``, ``check`` and ``detail`` as in the table (of
    several, the detail of the first), ``records``, the first few ids, and ``more``, how many
    further ones there are.

    Examples
    --------
    >>> row = {"record": "a", "outcome": "warning", "check": "gain", "detail": "3 %"}
    >>> other = row | {"record": "b", "detail": "4 %"}, row | {"record": "b", "detail": "no gain"}
    >>> [(p["records"], p["detail"]) for p in grouped([row, *other])]
    [(['a', 'b'], 'such as 3 %'), (['b'], 'no gain')]
    >>> many = grouped([row | {"record": f"r{i}"} for i in range(200)])
    >>> [(p["records"], p["more"], p["detail"]) for p in many]
    [(['r0', 'r1', 'r2', 'r3', 'r4'], 195, '3 %')]
    """
    for words in (_words, lambda _: ""):
        kinds: dict[tuple[str, str, str], list[Row]] = {}
        for row in problems:
            kinds.setdefault((row["outcome"], row["check"], words(row["detail"])), []).append(row)
        # Problems that are listed one by one.
        if len(kinds) <= 100:
            break
    found = []
    for rows in kinds.values():
        ids = list(dict.fromkeys(row["record"] for row in rows))
        details = {row["detail"] for row in rows}
        detail = rows[0]["detail"] if len(details) == 1 else f"such as {rows[0]['detail']}"
        shown = ids[:5]
        found.append({**rows[0], "detail": detail, "records": shown, "more": len(ids) - len(shown)})
    return found


def _words(detail: str) -> str:
    """A detail without its numbers."""
    return re.sub(r"\d[\d.e+-]*", "0", detail)


def sections_of_tests(
    headings: Mapping[str, str],
    tests: Sequence[Mapping[str, Any]],
    figures: Sequence[Mapping[str, Any]],
    regimes: Mapping[str, Any],
) -> list[dict[str, Any]]:
    """The parts of the page on kinds of tests; one without anything to show says why, or is none.

    Parameters
    ----------
    headings : mapping
        Test to its heading.
    tests : sequence of mappings
        With `test`, `count` and `unused`.
    figures : sequence of mappings
        Those that stand nowhere else.
    regimes : mapping
        Test to its table.
    """
    found = []
    for row in tests:
        test = row["test"]
        own = [figure for figure in figures if figure["section"] == test]
        none = "The only record was not used"
        none = f"None of the {row['count']} records was used" if row["count"] > 1 else none
        said = none if row["unused"] == row["count"] else ""
        if own or test in regimes or said:
            found.append({"test": test, "heading": headings[test], "figures": own, "said": said})
    return found


#: Outcomes of checks, worst first.
SEVERITY = {"refused": 0, "excluded": 1, "warning": 2}


def problem_lists(checks: Sequence[Row]) -> dict[str, Any]:
    """Rows of checks.csv sorted into the lists that the page shows.

    Returns
    -------
    dict
        ``problems`` of records, worst first; ``limits``, problems of no single record; ``notes``,
        what is worth knowing and no problem, those of no single record first; ``refused`` and
        ``excluded``, how many records.

    Examples
    --------
    >>> row = {"record": "a", "outcome": "refused", "check": "time", "detail": "stands"}
    >>> found = problem_lists([row, row | {"record": "", "outcome": "warning"}])
    >>> found["refused"], len(found["problems"]), len(found["limits"]), found["notes"]
    (1, 1, 1, [])
    >>> remarks = [row | {"record": name, "outcome": "ok"} for name in ("a", "b", "")]
    >>> [one["records"] for one in problem_lists(remarks)["notes"]]
    [[], ['a', 'b']]
    """
    problems = [row for row in checks if row["outcome"] != "ok"]
    found = [row for row in checks if row["outcome"] == "ok" and row["check"] != "ingest"]
    of_records = [row for row in problems if row["record"]]
    return {
        "problems": grouped(sorted(of_records, key=lambda row: SEVERITY[row["outcome"]])),
        "limits": [row for row in problems if not row["record"]],
        "notes": [
            *({**row, "records": [], "more": 0} for row in found if not row["record"]),
            *grouped([row for row in found if row["record"]]),
        ],
        **{
            outcome: len({row["record"] for row in problems if row["outcome"] == outcome})
            for outcome in ("refused", "excluded")
        },
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
    found = CampaignResults(results, campaign)
    inputs = input_rows(found)
    parameters = tables_shown.identified_table(found.rows("identified"))
    known = {row["name"]: row["value"] for row in parameters}
    return {
        "campaign": campaign,
        **_answer(found, known),
        "parameters": parameters,
        "effects": tables_shown.effects_table(found.rows("identified")),
        "unknown": {
            name: what
            for name, what in tables_shown.PARAMETERS.items()
            if name not in known and f"{name}_1" not in known  # r of balls that differ
        },
        "levels": found.rows("level_values"),
        "coverage": tables_shown.coverage_table(),
        "budget": found.rows("budget"),
        **_of_tests(found),
        "definitions": REGIMES,
        "replay": verdict.replay_verdict(found.rows("replay"), found.rows("checks")),
        "published": published_rows(found),
        **problem_lists(found.rows("checks")),
        "stated": tables_shown.stated_rows(inputs),
        "stated_sentence": tables_shown.stated_sentence(inputs),
        "contradicted": [named(row) for row in inputs if row["verdict"] == "off"],
        **_inputs(campaign, results),
        "files": sorted(path.name for path in results.glob("*.csv") if path.stem in TABLES),
        "most": MOST_ROWS,
    }


def _answer(results: CampaignResults, parameters: Mapping[str, str]) -> dict[str, Any]:
    """The verdict on the clearances, and other motions that may explain what misses it."""
    periodic = verdict.periodic_verdicts(results)
    releases = verdict.release_rows(results.rows("clearances"))
    return {
        "periodic": periodic,
        "releases": releases,
        "headline": verdict.headline(periodic, releases, parameters, results.rows("checks")),
        "within": verdict.within,
        "span": verdict.span,
        "predicted": verdict.predicted,
        "branches": verdict.other_branches(
            [(level, results.rig_at(level)) for level in results.periodic],
            results.rows("clearances"),
        ),
    }


def _of_tests(results: CampaignResults) -> dict[str, Any]:
    """The parts on kinds of tests, and the figures: the first one stands beside the verdict."""
    folder = results.folder
    figures = [
        {**vars(drawn), "caption": drawn.caption, "svg": inline_svg(folder, drawn)}
        for drawn in listed(folder)
    ]
    first = min(figures, key=_early, default=None)
    regimes = tables_shown.regimes_by_test(results)
    tests = tables_shown.tests_table(results.as_found, results.rows("checks"))
    others = [figure for figure in figures if figure is not first]
    return {
        "tests": tests,
        "regimes": regimes,
        "figures": figures,
        "first": first,
        "sections": sections_of_tests(tables_shown.TESTS, tests, others, regimes),
    }


def _early(figure: Mapping[str, Any]) -> int:
    """Which figure stands beside the verdict: clearances, else the fit of a ring-down."""
    return 0 if figure["section"] == "clearance" else 1 if figure["name"] == "ringdown_fit" else 2


def _inputs(campaign: Campaign, results: Path) -> dict[str, Any]:
    """What went in: how each record was processed, changed settings, digests of all files."""
    processed = processed_records(campaign, results)
    every = [file_of(file) for record in campaign.records for file in record.files]
    files = dict.fromkeys([campaign.folder / "campaign.yaml", campaign.sheet, *every], "")
    for row in processed:
        own = campaign.record(row["record"]).files
        files |= zip(map(file_of, own), row["sha256"].split(";"), strict=False)
    return {
        "processed": processed,
        "changed_settings": changed_settings(campaign),
        "provenance": provenance(files, folder=campaign.folder),
    }
