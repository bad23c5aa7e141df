"""What a person relies on when running the workflow: complete, incremental, resumable, apart."""

import csv
import os
import re
import shutil
import signal
import subprocess
import time
import zipfile
from pathlib import Path

import pytest
from tests.faults.project import contents, differences

from vinesexp.errors import RecordError
from vinesexp.records.stored.store import open_record
from vinesexp.results import open_results
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
    killed = subprocess.Popen(
        finished.command("--config", "campaign=data/tiny", "--", wanted),
        cwd=finished.folder,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    for _ in range(600):
        if log.exists():  # its first job is at work
            break
        time.sleep(0.05)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.wait()
    partial_path(records / "bare.nc").write_bytes(b"what a killed step leaves")

    elsewhere = "results/elsewhere/records/bare.nc"
    side = subprocess.Popen(
        finished.command(
            "--config", "campaign=data/tiny", "results=results/elsewhere", "--", elsewhere
        ),
        cwd=finished.folder,
        stderr=subprocess.PIPE,
        text=True,
    )
    resumed = finished.run("--config", "campaign=data/tiny", "--", wanted)
    _, errors = side.communicate(timeout=300)
    assert resumed.returncode == 0, resumed.stderr
    assert side.returncode == 0, errors
    for name in ("records/bare.nc", "conditioned/bare.nc"):
        fresh = (one_run.folder / "results/tiny" / name).read_bytes()
        assert (finished.folder / "results/tiny" / name).read_bytes() == fresh, name
    assert not list(records.glob(".*"))
    assert (finished.folder / elsewhere).read_bytes() == (records / "bare.nc").read_bytes()


@pytest.mark.long
def test_channels_go_when_nothing_needs_them_any_more_and_the_rest_is_the_same(one_run, finished):
    results = finished.folder / "results/tiny"
    for name in ("records/bare.nc", "conditioned/bare.nc", "impacts/bare.csv"):
        (results / name).unlink()
    config = ("--config", "campaign=data/tiny", "keep=final")
    done = finished.run(*config)
    assert done.returncode == 0, done.stderr
    assert not list(results.glob("*/bare.nc"))
    other = differences(contents(finished), contents(one_run))
    assert all(name.endswith(".nc") for name in other), other
    again = finished.run(*config)
    assert "up to date" in again.stderr
    with pytest.raises(RecordError, match="keep=final"):
        open_results(results).record("bare")


@pytest.mark.long
def test_editing_code_runs_what_uses_it_and_no_more(finished):
    """A module, a table beside a module: each by its content."""
    package = finished.folder / "src"
    ignore = shutil.ignore_patterns("__pycache__")
    shutil.copytree(finished.repository / "src", package, ignore=ignore)

    def planned():
        look = finished.run(
            "-n", "--config", "campaign=data/tiny", environment={"PYTHONPATH": str(package)}
        )
        assert look.returncode == 0, look.stderr
        return set(re.findall(r"^  (\w+)[ :]", look.stderr, re.MULTILINE))

    with (package / "vinesexp/report/error_bars.csv").open("a") as stream:
        stream.write("\n")
    assert planned() == {"pages", "report"}  # record pages come from the templates of report/ too
    with (package / "vinesexp/identification/ringdown.py").open("a") as stream:
        stream.write("\n# edited\n")
    edited = planned()
    assert {"estimate", "identify", "report"} <= edited
    assert not {"ingest", "condition", "impacts"} & edited


@pytest.mark.long
def test_two_runs_at_once_simulate_once_and_come_to_the_same_results(workflow):
    """Up to the step that reads what was simulated."""
    campaign = workflow.folder / "data/made"
    campaign.mkdir(parents=True)
    for name, text in SIMULATED.items():
        (campaign / name).write_text(text, encoding="utf-8")
    made = ("--config", "campaign=data/made")
    runs = [
        subprocess.Popen(
            workflow.command(*made, f"results={results}", "--until", "ingest"),
            cwd=workflow.folder,
            stderr=subprocess.PIPE,
            text=True,
        )
        for results in ("one", "other")
    ]
    said = [run.communicate(timeout=1200)[1] for run in runs]
    assert [run.returncode for run in runs] == [0, 0], said
    one, other = (workflow.folder / name for name in ("one", "other"))
    for id in ("bare", "light"):
        name = f"records/{id}.nc"
        assert (one / name).read_bytes() == (other / name).read_bytes()
        assert open_record(one / name).n == 8000
    assert not (one / "conditioned").exists()
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
