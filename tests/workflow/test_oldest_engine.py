"""A tiny campaign from start to end: what CI runs with the oldest Snakemake, too."""

import re
import tomllib
from pathlib import Path

import pytest

pytestmark = [pytest.mark.workflow, pytest.mark.long]
REPOSITORY = Path(__file__).resolve().parents[2]
TINY = ("--config", "campaign=data/tiny")


def test_a_campaign_runs_once_and_after_a_change_again(finished):
    assert "up to date" in finished.run(*TINY).stderr
    finished.edit("campaign.yaml", "title: Tiny", "title: Other")
    done = finished.run(*TINY)
    assert done.returncode == 0, done.stderr
    assert "Other" in (finished.folder / "results/tiny/report.html").read_text(encoding="utf-8")
    assert "up to date" in finished.run(*TINY).stderr


def test_ci_runs_the_oldest_that_is_promised():
    promised = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))
    (range_,) = [d for d in promised["project"]["dependencies"] if d.startswith("snakemake")]
    (oldest,) = re.findall(r">=([0-9.]+)", range_)
    ci = (REPOSITORY / ".ci/run").read_text(encoding="utf-8")
    assert re.search(rf"^oldest={re.escape(oldest)}\.0$", ci, re.MULTILINE)
