"""Report and record pages of a made-up campaign, and a headless Chromium that looks at them."""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vinesexp.figures.draw.design_curve import DesignCurve
from vinesexp.record_pages.build import build_pages
from vinesexp.records.result_paths import ResultPaths
from vinesexp.report.design_sheet import curve_markup
from vinesexp.report.differences_page import differences_page
from vinesexp.report.rendering import rendered
from vinesexp.results_differences import compare_results

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")

_HOME = Path(__file__).parents[1] / "report" / "conftest.py"
_SPEC = importlib.util.spec_from_file_location("made_up_campaigns", _HOME)
assert _SPEC is not None
assert _SPEC.loader is not None
made_up = sys.modules["made_up_campaigns"] = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(made_up)

#: Runs `body` once the page is ready, and leaves what it returns in the page.
_ASK = """<script>(async () => {
  const wait = ms => new Promise(done => setTimeout(done, ms));
  let found;
  try { found = await (async () => { %s })(); } catch (error) { found = {error: String(error)}; }
  const holder = document.createElement("pre");
  holder.id = "outcome";
  holder.textContent = JSON.stringify(found);
  document.body.append(holder);
})()</script></body>"""

Ask = Callable[..., Any]


@pytest.fixture(scope="session")
def site(tmp_path_factory) -> Path:
    """A results folder with report and pages; one id means something in an address."""
    folder = tmp_path_factory.mktemp("site")
    lines = [line.replace("p_33", "p+3.3_x") for line in made_up.synthetic.FULL]
    made = made_up._made(folder, lines, tuple(made_up.synthetic.VALUES), title="Rig <A> & ball")
    paths = ResultPaths(made.results)
    build_pages(made.campaign, paths=paths, code="of the test")
    _design_sheet(made.results / "sheet.html")
    found = compare_results(made.results, made.results)
    (made.results / "differences.html").write_text(differences_page(found), encoding="utf-8")
    return made.results


def _design_sheet(page: Path) -> None:
    """Every part of the sheet, with made-up numbers."""
    b, ones = np.linspace(10.0, 60.0, 30), np.ones(30)
    curve = DesignCurve(
        b=b, rest=5.0 * ones, low=4.0 * ones, middle=5.0 * ones, high=7.0 * ones,
        captured=0.5 * ones, bare=19.0, absorber=12.0, build={"robust": 30.0, "least mean": 33.0},
        published=34.0, exact=33.9,
    )  # fmt: skip
    names = ("name", "meaning", "b", "mean", "largest", "less", "captured", "over")
    card = dict.fromkeys(names, "30")
    content = {
        "version": "1", "headline": "Build a clearance of 30 mm.",
        "inputs": [("mass", "4.7 kg")], "theory": [("b_c", "34", "33.9", "–")],
        "cards": [card] * 4, "changed": [("b", ["5"] * 4)], "beside": [("bare", "19 mm")],
        "releases": [("3", "4", "27", "2.1", "80 %", "25", "2", "100 %", "30; 2 s")],
        "remarks": ["A remark."],
        "svg": curve_markup(curve), "few": 24, "unchanged": "5; 7",
    }  # fmt: skip
    page.write_text(rendered("vinesexp.report", "design_sheet.html.j2", content), encoding="utf-8")


@pytest.fixture(scope="session")
def ask(site, tmp_path_factory) -> Ask:
    """Open a page and run a script in it; what the script returns comes back."""
    if CHROMIUM is None:
        pytest.skip("needs Chromium")

    def run(page: str, script: str, *, at: str = "", width: int = 1000, dark: bool = False) -> Any:
        source = (site / page).read_text(encoding="utf-8")
        asked = site / f"asked_{page}"
        asked.write_text(source.replace("</body>", _ASK % script), encoding="utf-8")
        command = [
            CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
            f"--user-data-dir={tmp_path_factory.mktemp('profile')}",
            f"--window-size={width},1200", "--virtual-time-budget=20000", "--dump-dom",
            *(["--blink-settings=preferredColorScheme=0"] if dark else []),
            asked.as_uri() + at,
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
        asked.unlink()
        outcome = re.search(r'<pre id="outcome">(.*?)</pre>', done.stdout, re.DOTALL)
        assert outcome is not None, done.stderr[-2000:]
        found = json.loads(unescape(outcome[1]))
        assert not (isinstance(found, dict) and "error" in found), found
        return found

    return run
