"""Made-up campaigns with results, figures and report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.report.synthetic import FULL, VALUES, make_campaign, make_results

from vinesexp.figures.gallery import draw_all
from vinesexp.figures.style import Drawn
from vinesexp.records.campaign.schema import Campaign
from vinesexp.report.page import build_report


@dataclass(frozen=True)
class Made:
    """A campaign with results, figures and report."""

    campaign: Campaign
    results: Path
    drawn: list[Drawn]
    html: str


def with_results(
    folder: Path,
    lines: Sequence[str] = FULL,
    parameters: Iterable[str] = VALUES,
    **more: str,
) -> tuple[Campaign, Path]:
    """A campaign of some rows of records.csv, and its results folder without figures."""
    campaign = make_campaign(folder / "rig", list(lines), **more)
    make_results(campaign, folder / "results", parameters=tuple(parameters))
    return campaign, folder / "results"


def reported(
    folder: Path,
    lines: Sequence[str] = FULL,
    parameters: Iterable[str] = VALUES,
    **more: str,
) -> Made:
    """The same with figures and report."""
    campaign, results = with_results(folder, lines, parameters, **more)
    drawn = draw_all(campaign, results)
    page = build_report(campaign, results, results / "report.html")
    return Made(campaign, results, drawn, page.read_text(encoding="utf-8"))


def full_report(folder: Path) -> Made:
    """Every kind of test; a title with markup in it, and an id that means something in an address.

    Tests of the report and of the pages in a browser share what is made once.
    """
    lines = [line.replace("p_33", "p+3.3_x") for line in FULL]
    return reported(folder, lines, title="Rig <A> & ball")
