"""What is planned is what has changed: by content, whatever the times of files say."""

import os
import re
import shutil

import pytest

from vinesexp.pipeline import analyse_campaign, collect_checks
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.steps import Study

pytestmark = [pytest.mark.workflow, pytest.mark.long]

EVERYTHING = {
    *(f"{step} {record}" for step in ("ingest", "condition", "impacts", "estimate")
      for record in ("bare", "added")),
    *("regimes", "identify", "compare", "replay", "checks", "pages", "report"),
    *("figures results", "figures records"),
}  # fmt: skip


def after(planned):
    """The jobs of single records, which say where a change was seen first."""
    return {job for job in planned if " " in job and not job.startswith("figures")}


def test_a_copied_project_and_touched_files_plan_nothing(finished):
    assert finished.planned() == set()
    for file in (*finished.folder.rglob("workflow/**/*"), *finished.folder.rglob("data/**/*")):
        os.utime(file)
    assert finished.planned() == set()


def test_a_fresh_clone_over_old_results_plans_nothing(one_run, tmp_path):
    clone = type(one_run)(tmp_path)
    for name in ("data", "results"):
        shutil.copytree(one_run.folder / name, tmp_path / name)
    os.utime(tmp_path / "data/tiny/raw/bare.csv")
    assert clone.planned() == set()


@pytest.mark.parametrize(
    ("file", "old", "new", "seen"),
    [
        ("campaign.yaml", "title: Tiny", "title: Other", set()),
        ("campaign.yaml", "mass: 4.7 kg", "mass: 4.8 kg", set()),
        ("campaign.yaml", "nes_mass: 32 g", "nes_mass: 33 g", {"impacts", "estimate"}),
        ("campaign.yaml", "unit: mm", "unit: um", {"ingest", "condition", "impacts", "estimate"}),
        ("campaign.yaml", "unit: s", "unit: ms", {"ingest", "condition", "impacts", "estimate"}),
        ("campaign.yaml", "low: 2 Hz", "low: 1 Hz", {"condition", "impacts", "estimate"}),
    ],
)
def test_a_key_of_the_campaign(finished, file, old, new, seen):
    finished.edit(file, old, new)
    planned = finished.planned()
    assert {job.split()[0] for job in after(planned)} == seen
    assert "report" in planned


def test_a_cell_of_the_table_concerns_its_record(finished):
    finished.edit("records.csv", "bare.csv,ringdown,,,,20,,", "bare.csv,ringdown,,,,20,,odd")
    planned = finished.planned()
    assert after(planned) == {job for job in after(EVERYTHING) if job.endswith(" bare")}
    assert {"identify", "checks", "report"} <= planned


def test_a_removed_record_and_a_moved_row_run_no_step_on_records(finished):
    finished.edit("records.csv", "added,raw/added.csv,ringdown,,,500,20,,\n", "")
    planned = finished.planned()
    assert after(planned) == set()
    assert {"regimes", "identify", "checks", "report"} <= planned


def test_an_instrument_file_swapped_for_an_older_one(finished):
    raw = finished.folder / "data/tiny/raw"
    shutil.copyfile(raw / "added.csv", raw / "bare.csv")
    os.utime(raw / "bare.csv", (1e9, 1e9))
    assert after(finished.planned()) == {job for job in after(EVERYTHING) if job.endswith(" bare")}


def test_a_sensitivity_changed_after_the_notes_of_snakemake_were_removed(finished):
    shutil.rmtree(finished.folder / ".snakemake")
    finished.edit("campaign.yaml", "unit: mm", "unit: um")
    assert finished.planned() == EVERYTHING


@pytest.mark.parametrize(
    ("damaged", "made_by"),
    [
        ("records", "ingest"),
        ("identified.csv", "identify"),
        ("regimes.csv", "regimes"),
        ("figures/identified.svg", "figures results"),
        ("steps/records/bare/estimates.json", "estimate bare"),
        ("steps/records/bare/made.json", "ingest bare"),
        ("report.html", "report"),
        ("records.html", "pages"),
        ("pages/traces/bare.js", "pages"),
        ("pages/library/bokeh.min.js", "pages"),
    ],
)
def test_a_damaged_or_removed_result_is_made_again(finished, damaged, made_by):
    path = finished.folder / "results/tiny" / damaged

    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.write_text("")
    planned = finished.planned()
    assert any(job.startswith(made_by) for job in planned)
    assert planned == {"pages"} or "report" in planned


def test_channels_that_were_not_kept_are_made_again_only_where_they_are_needed(finished):
    results = finished.folder / "results/tiny"
    for folder in ("records", "conditioned"):
        shutil.rmtree(results / folder)
    assert finished.planned(keep="final") == set()
    assert finished.planned() == EVERYTHING
    (results / "report.html").unlink()  # it states what the channels' files say
    assert {"ingest bare", "condition bare", "report"} <= finished.planned(keep="final")


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("campaign.yaml", "high: 40 Hz", "high: 30 Hz"),
        ("campaign.yaml", "mass: 4.7 kg", "mass: 4.9 kg"),
        ("records.csv", "500,20", "600,20"),
        ("records.csv", "500,20,,", "500,20,yes,"),
        ("records.csv", "added.csv,ringdown,", "added.csv,transient,34"),
    ],
)
def test_whatever_comes_out_different_is_planned(finished, file, old, new, tmp_path, recomputed):
    """The steps run in this process before and after a change: no result may change unplanned."""
    finished.edit(file, old, new)
    planned = finished.planned()
    campaign = load_campaign(finished.folder / "data/tiny")
    paths = ResultPaths(tmp_path / "new")
    analyse_campaign(campaign, paths=paths)
    makers = {"identify": paths.identified, "regimes": paths.regimes, "checks": paths.checks,
              "compare": paths.clearances}  # fmt: skip
    for step, place in (("ingest", paths.record), ("condition", paths.conditioned),
                        ("impacts", paths.regime), ("estimate", paths.estimates)):  # fmt: skip
        makers |= {f"{step} {record.id}": place(record.id) for record in campaign.records}
    changed = {
        job
        for job, path in makers.items()
        if path.read_bytes() != (recomputed / path.relative_to(paths.folder)).read_bytes()
    }
    assert changed
    assert changed <= planned


@pytest.fixture(scope="module")
def recomputed(one_run, tmp_path_factory):
    """Results of the unchanged campaign, by the same functions in one process."""
    folder = tmp_path_factory.mktemp("recomputed")
    analyse_campaign(load_campaign(one_run.folder / "data/tiny"), paths=ResultPaths(folder))
    return folder


def test_the_steps_as_jobs_and_in_one_process_give_the_same_bytes(one_run, recomputed):
    for path in sorted(recomputed.rglob("*")):
        if path.is_file():
            name = path.relative_to(recomputed)
            assert path.read_bytes() == (one_run.folder / "results/tiny" / name).read_bytes(), name


def test_an_emptied_result_concerns_its_record_and_what_follows(finished):
    (finished.folder / "results/tiny/impacts/bare.csv").write_text("")
    planned = finished.planned()
    assert after(planned) == {"impacts bare", "estimate bare"}
    assert {"regimes", "identify", "report"} <= planned


@pytest.mark.long
def test_all_records_are_jobs_where_all_is_asked_for(finished):
    config = ("--config", "campaign=data/tiny")
    for wanted, step in ((("--forceall",), "ingest"), (("--forcerun", "estimate"), "estimate")):
        plan = finished.run("-n", *wanted, *config).stderr
        assert re.search(rf"{step} +2 records \([a-z, ]+\): asked for", plan), plan
    assert "ingest" in finished.run("--forceall", "--dag", *config).stdout


@pytest.mark.long
def test_a_single_result_is_brought_by_its_name_with_what_it_needs_and_no_more(one_run, finished):
    results, raw = finished.folder / "results/tiny", finished.folder / "data/tiny/raw"
    asked = ("results/tiny/impacts/bare.csv", "--config", "campaign=data/tiny")
    assert "up to date" in finished.run(*asked).stderr
    kept = (raw / "bare.csv").read_bytes()
    shutil.copyfile(raw / "added.csv", raw / "bare.csv")
    plan = finished.run("-n", *asked).stderr
    assert "3 jobs would run" in plan
    assert re.search(r"ingest +1 record \(bare\): .*bare.csv changed", plan)
    (raw / "bare.csv").write_bytes(kept)
    shutil.rmtree(results)
    run = finished.run(*asked)
    assert run.returncode == 0, run.stderr
    assert finished.steps(run) == [(step, "bare") for step in ("ingest", "condition", "impacts")]
    for name in ("records/bare.nc", "conditioned/bare.nc", "impacts/bare.csv"):
        same = (one_run.folder / "results/tiny" / name).read_bytes()
        assert (results / name).read_bytes() == same, name
    assert not list(results.rglob("added.*"))
    assert not (results / "identified.csv").exists()
    unknown = finished.run("results/tiny/impacts/bear.csv", "-n", "--config", "campaign=data/tiny")
    assert "no record 'bear'; did you mean 'bare'?" in unknown.stderr


def test_a_record_that_kills_a_step_is_refused_from_then_on(finished):
    """As one whose file cannot be read: the table of checks says it, and nothing is tried again."""
    folder, results = finished.folder / "data/tiny", finished.folder / "results/tiny"
    study = Study(load_campaign(folder), ResultPaths(results))
    study.refuse("impacts", "bare", "impacts: its process was killed")
    with open_record(study.paths.conditioned("bare")) as record:
        assert record.refused is not None
    study.run("estimate", "bare")
    checks = collect_checks(study.campaign, paths=study.paths)
    (refused,) = [check for check in checks if check.outcome == "refused"]
    assert (refused.record, refused.detail) == ("bare", "impacts: its process was killed")
    planned = finished.planned()
    assert not after(planned)
    assert {"identify", "report", "pages"} <= planned


@pytest.mark.parametrize("batches", [1, 2])
def test_what_is_planned_does_not_depend_on_the_batches(finished, batches):
    assert finished.planned(batches=batches) == set()
    finished.edit("records.csv", "bare.csv,ringdown,,,,20,,", "bare.csv,ringdown,,,,20,,odd")
    bare = {job for job in after(EVERYTHING) if job.endswith(" bare")}
    assert after(finished.planned(batches=batches)) == bare


def test_a_changed_title_redraws_pages_alone(finished):
    finished.edit("campaign.yaml", "title: Tiny", "title: Other")
    assert finished.planned() == {"report", "pages"}


def test_a_report_is_redrawn_when_the_score_of_a_simulation_changes(finished):
    study = Study(
        load_campaign(finished.folder / "data/tiny"), ResultPaths(finished.folder / "results/tiny")
    )
    assert study.why("report") == []
    study.paths.truth.write_text("a score", encoding="utf-8")
    with study._noted("score"):
        pass
    assert study.why("report") == ["result of score changed"]
