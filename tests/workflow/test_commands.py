"""Snakemake's standard commands work on this workflow, whatever else goes on."""

import csv
import re
import shutil
import zipfile

import pytest

from vinesexp.errors import VinesexpError
from vinesexp.resultslock import hold_results
from vinesexp.workflow import read_config

pytestmark = [pytest.mark.workflow, pytest.mark.long]

TINY = ("--config", "campaign=data/tiny")
LOOKS = {
    "dry run": ("-n", "Nothing to be done"),
    "summary": ("--summary", "results/tiny/report.html"),
    "drawing": ("--dag", "digraph snakemake_dag"),
    "lint": ("--lint", "good condition"),
}


def test_a_look_works_while_another_run_holds_the_results_and_on_a_copy(finished):
    """All looks at one copied project whose results are locked."""
    with hold_results(finished.folder / "results/tiny", campaign=finished.folder / "data/tiny"):
        before = {p: p.stat().st_mtime_ns for p in (finished.folder / "results").rglob("*")}
        for name, (option, words) in LOOKS.items():
            look = finished.run(option, *TINY)
            assert look.returncode == 0, (name, look.stderr)
            assert words in look.stdout + look.stderr, name
        refused = finished.run(*TINY)
    assert refused.returncode == 1
    reported = [line for line in refused.stderr.splitlines() if line.startswith("vinesexp:")]
    assert len(reported) == 1
    assert "another run is writing here" in reported[0]
    assert "Traceback" not in refused.stderr
    assert before == {p: p.stat().st_mtime_ns for p in (finished.folder / "results").rglob("*")}


def test_the_report_of_snakemake_holds_the_results(one_run, tmp_path):
    out = tmp_path / "out.zip"
    made = one_run.run("--report", str(out), *TINY)
    assert made.returncode == 0, made.stderr
    names = {name.rpartition("/")[2] for name in zipfile.ZipFile(out).namelist()}
    assert {"report.html", "identified.csv", "clearances.csv", "regimes.csv", "checks.csv"} <= names


def test_a_dry_run_says_in_a_dozen_lines_what_would_run_and_why(finished):
    finished.edit("campaign.yaml", "nes_mass: 32 g", "nes_mass: 33 g")
    short = finished.run("-n", *TINY).stderr
    lines = short.splitlines()
    assert len(lines) <= 13
    assert any(
        "impacts" in line and "known.nes_mass of campaign.yaml changed" in line for line in lines
    )
    assert any("identify" in line and "known of campaign.yaml changed" in line for line in lines)
    assert not any("ingest" in line for line in lines)
    long = finished.run("-n", "-p", *TINY).stderr
    assert len(long.splitlines()) > 3 * len(lines)
    assert "rule impacts" in long or "Job stats" in long


@pytest.mark.parametrize(
    ("config", "words"),
    [
        ({"campain": "data/tiny"}, "did you mean 'campaign'?"),
        ({"results": "a{b}c"}, "results=a{b}c: expected a folder without braces"),
        ({"batches": 0}, "expected a whole number of 1 or more"),
        ({"keep": "tables"}, "keep=tables: expected all, or final, which removes"),
        ({"results": "site"}, "holds files that are no results (pages and 1 more)"),
        ({"results": "data/tiny"}, "holds files that are no results (campaign.yaml and 2 more)"),
    ],
)
def test_a_mistake_in_config_is_said(workflow, config, words, monkeypatch):
    workflow.tiny_campaign()
    (workflow.folder / "site/pages").mkdir(parents=True)
    (workflow.folder / "site/report.html").write_text("mine")
    monkeypatch.chdir(workflow.folder)
    given = {"campaign": "data/tiny"} | config
    with pytest.raises(VinesexpError, match=re.escape(words)):
        read_config(given)


def test_a_mistake_in_config_is_one_line_at_the_console(workflow):
    """As Snakemake reads the value: 1e3 is no folder's name any more."""
    result = workflow.run("-n", "--config", "campaign=1e3", "--workflow-profile", "none")
    assert result.returncode == 1
    reported = [line for line in result.stderr.splitlines() if line.startswith("vinesexp:")]
    assert len(reported) == 1
    assert "1000.0: no such folder" in reported[0]
    assert "Traceback" not in result.stderr


MODULE = """\
module rig:
    snakefile: "{folder}/workflow/Snakefile"
    config: {{"campaign": "{folder}/data/tiny", "results": "{folder}/results/tiny"}}

use rule * from rig as rig_*

rule further:
    default_target: True
    input: "{folder}/results/tiny/identified.csv"
    output: "further.csv"
    shell: "cp {{input}} {{output}}"
"""


def test_a_target_that_no_rule_makes_is_named(finished):
    look = finished.run("results/tiny/nonsense.csv", "-n", *TINY)
    assert look.returncode != 0
    assert "nonsense.csv" in look.stderr


def test_another_workflow_uses_this_one_as_a_module(finished, tmp_path):
    own = tmp_path / "own"
    own.mkdir()
    (own / "Snakefile").write_text(MODULE.format(folder=finished.folder), encoding="utf-8")
    (finished.folder / "results/tiny/clearances.csv").unlink()
    shutil.rmtree(finished.folder / "results/tiny/impacts")
    result = finished.run("--snakefile", str(own / "Snakefile"), "--directory", str(own))
    assert result.returncode == 0, result.stderr
    assert "Traceback" not in result.stderr
    assert "impacts    1/1 bare" in result.stderr
    with (own / "further.csv").open(encoding="utf-8", newline="") as stream:
        assert "M" in {row["parameter"] for row in csv.DictReader(stream)}
    assert (finished.folder / "results/tiny/impacts/bare.csv").is_file()
