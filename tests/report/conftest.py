"""Made-up campaigns with finished results: everything, ring-downs only, nothing usable."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from pathlib import Path

import pytest

from vinesexp.figures.entry import Drawn
from vinesexp.figures.gallery import draw_all
from vinesexp.records.campaign import Campaign
from vinesexp.report.page import build_report

_SPEC = importlib.util.spec_from_file_location("synthetic", Path(__file__).parent / "synthetic.py")
assert _SPEC is not None
assert _SPEC.loader is not None
synthetic = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(synthetic)


@dataclass(frozen=True)
class Made:
    """A campaign with results, figures and report."""

    campaign: Campaign
    results: Path
    drawn: list[Drawn]
    html: str


def _made(folder: Path, lines: list[str], parameters: tuple[str, ...], **more: str) -> Made:
    campaign = synthetic.make_campaign(folder / "rig", lines, **more)
    results = folder / "results"
    synthetic.make_results(campaign, results, parameters=parameters)
    drawn = draw_all(campaign, results)
    page = build_report(campaign, results, results / "report.html")
    return Made(campaign, results, drawn, page.read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def full(tmp_path_factory) -> Made:
    """Every kind of test, one refused record, one excluded, a title with markup in it."""
    folder = tmp_path_factory.mktemp("full")
    return _made(folder, synthetic.FULL, tuple(synthetic.VALUES), title="Rig <A> & ball")


@pytest.fixture(scope="session")
def bare(tmp_path_factory) -> Made:
    """Two ring-downs: no scale, no ball."""
    return _made(tmp_path_factory.mktemp("bare"), synthetic.RINGDOWNS, ("f0", "zeta"))


@pytest.fixture(scope="session")
def nothing(tmp_path_factory) -> Made:
    """One record, refused."""
    return _made(tmp_path_factory.mktemp("nothing"), [synthetic.FULL[-1]], ())
