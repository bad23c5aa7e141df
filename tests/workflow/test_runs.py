"""What a person relies on when running the workflow: complete, incremental, resumable, apart."""

import csv
import os
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest

from vinesexp.records.stored.store import open_record
from vinesexp.whole_files import partial_path

pytestmark = pytest.mark.workflow


def table(path: Path):
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.long
def test_a_finished_run_holds_every_result(one_run):
    results = one_run.folder / "results/tiny"
    for name in ("identified", "regimes", "clearances", "checks"):
        assert table(results / f"{name}.csv") is not None
    for record in ("bare", "added"):
        assert (results / f"records/{record}.nc").is_file()
        assert (results / f"conditioned/{record}.nc").is_file()
        assert (results / f"impacts/{record}.csv").is_file()
    assert (results / "report.html").read_text(encoding="utf-8").rstrip().endswith("</html>")
    assert (results / "records.html").is_file()
    assert {path.stem for path in (results / "pages/traces").iterdir()} == {"bare", "added"}
    combined = {
        row["parameter"]: float(row["value"])
        for row in table(results / "identified.csv")
        if row["method"] == "combined"
    }
    assert combined["f0"] == pytest.approx(7.862, rel=1e-3)
    assert combined["M"] == pytest.approx(4.7, rel=1e-2)


@pytest.mark.long
def test_the_results_in_one_zip_on_request(finished):
    done = finished.run("bundle", "--config", "campaign=data/tiny")
    assert done.returncode == 0, done.stderr
    with zipfile.ZipFile(finished.folder / "results/tiny/tiny.zip") as bundle:
        names = set(bundle.namelist())
    assert {"tiny/report.html", "tiny/records.html", "tiny/identified.csv"} <= names
    assert {"tiny/pages/traces/bare.js", "tiny/records/bare.nc", "tiny/impacts/bare.csv"} <= names
    assert not any("/steps/" in name or "/." in name for name in names)


@pytest.mark.long
def test_a_changed_table_runs_what_is_new_and_takes_away_what_left_and_nothing_of_a_user(finished):
    """One record renamed, one new, one broken; files that a user put beside the results stay.

    The campaign was moved meanwhile, and new names are ones that Snakemake or a file system could
    mistake: braces in names and titles, a campaign called 2024, a record called like a table.
    """
    workflow, campaign = finished, finished.folder / "2024"
    results = workflow.folder / "results/2024"
    workflow.edit("campaign.yaml", "title: Tiny", "title: '{Ti}ny: {x}'")
    (workflow.folder / "data/tiny").rename(campaign)
    (workflow.folder / "results/tiny").rename(results)
    (results / ".campaign").write_text("")  # the project it was copied from is still there
    (campaign / "raw/added.csv").rename(campaign / "raw/b{record}.csv")
    workflow.write_ringdown(campaign / "raw/more.csv", f0=7.862, seed=2)
    good = (campaign / "raw/more.csv").read_text(encoding="utf-8").splitlines()
    broken = [*good[:700], "1.396,oops", *good[701:]]
    (campaign / "raw/broken.csv").write_text("\n".join(broken), encoding="utf-8")
    rows = (campaign / "records.csv").read_text(encoding="utf-8")
    rows = rows.replace("added,raw/added.csv", "identify.csv,raw/b{record}.csv")
    rows += "more,raw/more.csv,ringdown,,,,,,a {note}\nbroken,raw/broken.csv,ringdown\n"
    (campaign / "records.csv").write_text(rows, encoding="utf-8")
    mine = {
        "pages/index.html", "pages/traces/mine.js", "records/mine.nc", "impacts/added.txt",
        "figures/mine.svg", ".notes.new", "steps/records/added/mine.txt",
    }  # fmt: skip
    for name in mine:
        (results / name).write_text("mine", encoding="utf-8")
    done = workflow.run("--config", "campaign=2024")
    assert done.returncode == 0, done.stderr

    touched = {what for _, what in workflow.steps(done)}
    assert not {"bare", "added"} & touched
    assert {"more", "broken", "identify.csv"} <= touched
    refused = [row for row in table(results / "checks.csv") if row["outcome"] == "refused"]
    assert [row["record"] for row in refused] == ["broken"]
    assert "line 701" in refused[0]["detail"]
    assert "oops" in refused[0]["detail"]
    page = (results / "report.html").read_text(encoding="utf-8")
    assert "oops" in page
    assert "{Ti}ny: {x}" in page

    for name in mine:
        assert (results / name).read_text(encoding="utf-8") == "mine", name
    left = {path.relative_to(results).as_posix() for path in results.rglob("added*")}
    aside = {name for name in left if name.startswith("logs/")}
    assert left - aside == {"impacts/added.txt", "steps/records/added"}
    for name in (
        "records/identify.csv.nc",
        "pages/traces/identify.csv.js",
        "pages/facts/identify.csv.js",
    ):
        assert (results / name).is_file()
    assert not workflow.planned(campaign="2024")


@pytest.mark.long
def test_a_mistake_in_the_description_is_one_line_and_writes_nothing(workflow):
    campaign = workflow.tiny_campaign()
    text = (campaign / "campaign.yaml").read_text(encoding="utf-8")
    text = text.replace("quantity: displacement, unit: mm", "quantity: displacement, unit: V")
    (campaign / "campaign.yaml").write_text(text, encoding="utf-8")
    result = workflow.run("--config", "campaign=data/tiny")
    assert result.returncode != 0
    reported = [line for line in result.stderr.splitlines() if line.startswith("vinesexp:")]
    assert len(reported) == 1
    assert "campaign.yaml" in reported[0]
    assert "'V'" in reported[0]
    assert "Traceback" not in result.stderr
    assert not (workflow.folder / "results").exists()


@pytest.mark.long
def test_a_killed_run_resumes_beside_another_and_ends_with_the_same_bytes(one_run, finished):
    """Two jobs of one record are enough to be killed in; the other run writes elsewhere."""
    records = finished.folder / "results/tiny/records"
    (records / "bare.nc").unlink()
    log = finished.folder / "results/tiny/logs/ingest/bare.log"
    log.unlink()
    wanted = "results/tiny/conditioned/bare.nc"
    killed = finished.start("--config", "campaign=data/tiny", "--", wanted)
    for _ in range(600):
        if log.exists():  # its first job is at work
            break
        time.sleep(0.05)
    killed.kill()
    partial_path(records / "bare.nc").write_bytes(b"what a killed step leaves")

    elsewhere = "results/elsewhere/records/bare.nc"
    config = ("--config", "campaign=data/tiny", "results=results/elsewhere")
    side = finished.start(*config, "--", elsewhere, name="side")
    resumed = finished.run("--config", "campaign=data/tiny", "--", wanted)
    beside = side.ended()
    assert resumed.returncode == 0, resumed.stderr
    assert beside.returncode == 0, beside.stderr
    for name in ("records/bare.nc", "conditioned/bare.nc"):
        fresh = (one_run.folder / "results/tiny" / name).read_bytes()
        assert (finished.folder / "results/tiny" / name).read_bytes() == fresh, name
    assert not list(records.glob(".*"))
    assert (finished.folder / elsewhere).read_bytes() == (records / "bare.nc").read_bytes()


@pytest.mark.long
def test_editing_code_runs_what_uses_it_and_no_more(finished):
    """A module, a table beside a module: each by its content."""
    package = finished.folder / "src"
    ignore = shutil.ignore_patterns("__pycache__")
    shutil.copytree(finished.repository / "src", package, ignore=ignore)

    def planned():
        found = subprocess.run(
            [sys.executable, "-c", WHAT_RUNS],
            cwd=finished.folder,
            env={**os.environ, "PYTHONPATH": str(package)},
            capture_output=True,
            text=True,
            check=True,
        )
        return set(found.stdout.split())

    with (package / "vinesexp/report/calibration.csv").open("a") as stream:
        stream.write("\n")
    assert planned() == {"pages", "report", "bundle"}  # pages come from templates of report/ too
    with (package / "vinesexp/identification/ringdown.py").open("a") as stream:
        stream.write("\n# edited\n")
    edited = planned()
    assert {"estimate", "identify", "report"} <= edited
    assert not {"ingest", "condition", "impacts"} & edited


WHAT_RUNS = """\
from pathlib import Path
from types import SimpleNamespace
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.steps import Study
from vinesexp.workflow import Planner

look = SimpleNamespace(
    executor_plugin=None,
    dag_settings=None,
    is_main_process=True,
    dag=SimpleNamespace(forcefiles=set()),
)
study = Study(load_campaign(Path("data/tiny")), ResultPaths(Path("results/tiny")))
print(*(step for step, why in Planner(look, study, ["1@1"]).outdated.items() if why))
"""


@pytest.mark.long
def test_a_simulated_campaign_is_made_group_by_group_as_far_as_is_asked_for(workflow):
    campaign = workflow.folder / "data/made"
    campaign.mkdir(parents=True)
    for name, text in SIMULATED.items():
        (campaign / name).write_text(text, encoding="utf-8")
    run = workflow.run("--config", "campaign=data/made", "--until", "ingest")
    assert run.returncode == 0, run.stderr
    results = workflow.folder / "results/made"
    assert {open_record(results / f"records/{id}.nc").n for id in ("bare", "light")} == {8000}
    assert not (results / "conditioned").exists()
    assert {path.stem for path in (campaign / "raw").iterdir()} == {"bare", "light"}, "every group"


SIMULATED = {
    "campaign.yaml": """\
title: Made
channels:
  displacement: {column: "CH*", quantity: displacement, sensitivity: 40 mV/mm}
time: {column: Time, unit: s}
bandpass: {low: 2 Hz, high: 40 Hz}
""",
    "records.csv": "record,file,test,release_mm\nbare,raw/bare.csv,ringdown,20\n"
    "light,raw/light.csv,ringdown,10\n",
    "scene.yaml": """\
title: Made
seed: 1
rig: {mass: 4.7 kg, damping: 3.02 N s/m, stiffness: 1.147e4 N/m, nes_mass: 32 g, restitution: 0.6}
sensors:
  displacement: {sensitivity: 40 mV/mm, noise: 6 um, range: 25 mm}
oscilloscope: {sample_rate: 1 kHz, bits: 14, full_scale: 1 V}
groups:
  decays:
    test: ringdown
    duration: 8 s
    oscilloscope: {format: oscilloscope-csv}
    records:
      bare: {release: 20 mm}
  lighter:
    test: ringdown
    duration: 8 s
    oscilloscope: {format: oscilloscope-csv}
    records:
      light: {release: 10 mm}
""",
}
