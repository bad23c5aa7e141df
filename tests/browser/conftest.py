"""Report and record pages of a made-up campaign, and a headless Chromium that looks at them."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.browser.chromium import Browser
from tests.design.made_up import made_up_advice
from tests.report.made_up import Made, full_report

from vinesexp.design.shown import Table
from vinesexp.figures.design_curve import design_curve
from vinesexp.record_pages.build import build_pages
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.report.command_pages import differences_page
from vinesexp.report.rendering import figure_markup, rendered
from vinesexp.results_differences import compare_results

#: Runs a script of several statements; what it returns comes back.
_ASK = """(async () => {
  const wait = ms => new Promise(done => setTimeout(done, ms));
  return JSON.stringify(await (async () => { %s })()) ?? null;
})()"""

Ask = Callable[..., Any]


@pytest.fixture(scope="session")
def site(once) -> Path:
    """A results folder with report and pages."""
    full = once("full", full_report)
    return once("site", lambda folder: _site(full, folder / "results"))


def _site(full: Made, results: Path) -> Path:
    shutil.copytree(full.results, results)
    build_pages(full.campaign, paths=ResultPaths(results), code="of the test")
    _design_sheet(results / "sheet.html")
    found = compare_results(results, results)
    (results / "differences.html").write_text(differences_page(found), encoding="utf-8")
    return results


def _design_sheet(page: Path) -> None:
    """Every part of the sheet, with made-up numbers."""
    names = ("name", "meaning", "b", "mean", "largest", "less", "captured", "over")
    card = dict.fromkeys(names, "30")
    content = {
        "version": "1", "headline": "Build a clearance of 30 mm.",
        "inputs": [("mass M", "4.7 kg")], "cards": [card] * 4,
        "tables": [
            Table("For comparison", (), [("bare oscillator", "19 mm")]),
            Table("One value off", ("-5 %", "+5 %"), [("b", "5; 7", "5; 7")], "Mean; 90 % below."),
            Table("Release", ("b\n(mm)",) * 9, [("to 3 mm", *["27"] * 9)]),
        ],
        "remarks": ["A remark."], "svg": figure_markup(design_curve(made_up_advice()), "design"),
    }  # fmt: skip
    page.write_text(rendered("vinesexp.report", "design_sheet.html.j2", content), encoding="utf-8")


@pytest.fixture(scope="session")
def tab(tmp_path_factory) -> Iterator[Browser]:
    """One tab for all pages: to start a browser takes longer than to look at a page."""
    browser = Browser(tmp_path_factory.mktemp("profile"))
    yield browser
    browser.close()


@pytest.fixture
def ask(site, tab) -> Ask:
    """Open a page and run a script in it; what the script returns comes back."""

    def run(page: str, script: str, *, at: str = "", width: int = 1000, dark: bool = False) -> Any:
        tab.look(width=width, dark=dark)
        tab.open((site / page).as_uri() + at)
        found = tab.ask(_ASK % script)
        return None if found is None else json.loads(found)

    return run
