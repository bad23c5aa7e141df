"""The report: one HTML page that opens anywhere, with its figures inside."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from vinesexp.figures.gallery import Drawn, listed
from vinesexp.records.campaign import Campaign
from vinesexp.report.numbers import millimetres, significant, with_error
from vinesexp.report.provenance import provenance
from vinesexp.report.verdict import verdicts

Row = Mapping[str, str]

#: Parameters in the order of the table, each with what it is.
PARAMETERS = {
    "f0": "natural frequency",
    "zeta": "damping ratio",
    "M": "mass of the oscillator",
    "c1": "damping",
    "k1": "stiffness",
    "r": "restitution",
}

#: Tests in the order of the page, each with its heading.
TESTS = {
    "ringdown": "Ring-downs",
    "sweep": "Sweeps",
    "periodic": "Periodic tests",
    "transient": "Releases",
    "drop": "Drop tests",
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
    environment.filters.update(mm=millimetres, significant=significant)
    html = environment.get_template("report.html.j2").render(**page_content(campaign, results))
    partial = out.with_name(f".{out.name}.part")
    partial.write_text(html, encoding="utf-8")
    os.replace(partial, out)
    return out


def page_content(campaign: Campaign, results: Path) -> dict[str, Any]:
    """Everything the template shows, finished."""
    tables = {
        name: _rows(results / f"{name}.csv")
        for name in ("identified", "regimes", "clearances", "checks")
    }
    figures = [{**vars(drawn), "svg": inline_svg(results, drawn)} for drawn in listed(results)]
    records = [record.file for record in campaign.records]
    description = [campaign.folder / name for name in ("campaign.yaml", "records.csv")]
    return {
        "campaign": campaign,
        "verdicts": {
            test: verdicts([row for row in tables["clearances"] if row["test"] == test])
            for test in ("periodic", "transient")
        },
        "clearances": tables["clearances"],
        "parameters": identified_table(tables["identified"]),
        "unknown": [name for name in PARAMETERS if name not in _combined(tables["identified"])],
        "identified": tables["identified"],
        "regimes": tables["regimes"],
        "tests": tests_table(campaign),
        "problems": [row for row in tables["checks"] if row["outcome"] != "ok"],
        "figures": figures,
        "headings": TESTS,
        "provenance": provenance([*description, *records], folder=campaign.folder),
    }


def _combined(identified: Sequence[Row]) -> dict[str, Row]:
    return {row["parameter"]: row for row in identified if row["method"] == "combined"}


def identified_table(identified: Sequence[Row]) -> list[dict[str, Any]]:
    """Combined values in reading order, each with the rows of its methods."""
    combined = _combined(identified)
    order = [*PARAMETERS, *sorted(name for name in combined if name not in PARAMETERS)]
    return [
        {
            "name": name,
            "meaning": PARAMETERS.get(name, _meaning(name)),
            "value": _value(combined[name]),
            "methods": [
                {"method": row["method"], "value": _value(row), "records": row["records"]}
                for row in identified
                if row["parameter"] == name and row["method"] != "combined"
            ],
        }
        for name in order
        if name in combined
    ]


def _meaning(name: str) -> str:
    return f"restitution of NES {name[2:]}" if name.startswith("r_") else ""


def _value(row: Row) -> str:
    return with_error(float(row["value"]), float(row["std_error"] or 0.0), row["unit"])


def tests_table(campaign: Campaign) -> list[dict[str, Any]]:
    """What was measured: for each kind of test, how many records and over which range."""
    rows = []
    for test, heading in TESTS.items():
        records = [r for r in campaign.records if r.test == test]
        if records:
            rows.append(
                {
                    "heading": heading,
                    "count": len(records),
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


def inline_svg(results: Path, drawn: Drawn) -> str:
    """The figure as markup for a page with other figures: its ids carry its name."""
    text = (results / "figures" / f"{drawn.name}.svg").read_text(encoding="utf-8")
    text = text[text.index("<svg") :]
    text = re.sub(r'\bid="', f'id="{drawn.name}-', text)
    text = text.replace('href="#', f'href="#{drawn.name}-').replace("url(#", f"url(#{drawn.name}-")
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    return re.sub(r'(<svg[^>]*?) height="[^"]*"([^>]*?) width="[^"]*"', r"\1\2", text, count=1)


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))
