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


@pytest.fixture(scope="session")
def drops(tmp_path_factory) -> Made:
    """Drop tests only: r and nothing else."""
    lines = [f"drop_{i},raw/drop_{i}.csv,drop,,,,,,," for i in (1, 2)]
    return _made(tmp_path_factory.mktemp("drops"), lines, ("r",))


@pytest.fixture(scope="session")
def two_levels(tmp_path_factory) -> Made:
    """Long names, clearances that lie close, a release beside periodic tests; one ring-down."""
    lines = [
        synthetic.RINGDOWNS[0],
        *(f"a_long_name_of_a_record_{b},raw/x_{b}.csv,periodic,{b},0.25,8,,,,"
          for b in (33, 33.5, 34, 34.5)),
        *(f"p_{b},raw/y_{b}.csv,periodic,{b},0.26,8,,,," for b in (33, 34)),
        "t_1,raw/t_1.csv,transient,27,,,,20,,",
    ]  # fmt: skip
    return _made(tmp_path_factory.mktemp("two_levels"), lines, tuple(synthetic.VALUES))
