"""Steps as forks of one process: each ends alone, and another takes the place of a killed one."""

import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import forkserver
from pathlib import Path

import psutil
import pytest

from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.steps import Study, all_modules
from vinesexp.supervised import run_apart

pytestmark = [pytest.mark.workflow, pytest.mark.long]


@pytest.fixture
def run(finished, monkeypatch):
    """Run a step of the finished project on some records, or those that need it; the exit code."""
    monkeypatch.chdir(finished.folder)

    def run(step, loads=("h5py", "pandas"), *, ids=()):
        study = Study(load_campaign(Path("data/tiny")), ResultPaths(Path("results/tiny")))
        for id in ids:
            study.notes(step, id).doubt(step)
        return run_apart(study, step, ids or list(study.records), loads=loads)

    forkserver._forkserver._stop()
    yield run
    forkserver._forkserver._stop()


def server():
    return psutil.Process(forkserver._forkserver._forkserver_pid)


def kill(process):
    process.kill()
    while process.status() != psutil.STATUS_ZOMBIE:  # whose end its parent has to see
        time.sleep(0.01)


def test_a_step_is_done_and_a_mistake_is_none_of_the_next_ones(run, finished, capfd):
    records, raw = finished.folder / "results/tiny/records", finished.folder / "data/tiny/raw"
    shutil.rmtree(records)
    assert run("ingest") == 0
    assert {path.name for path in records.iterdir()} == {"added.nc", "bare.nc"}
    (records / "bare.nc").unlink()
    (raw / "bare.csv").rename(raw / "elsewhere.csv")
    assert run("ingest") == 0, "a record without its file is refused"
    assert (
        "bare.csv" in (finished.folder / "results/tiny/steps/records/bare/ingest.csv").read_text()
    )
    shutil.rmtree(finished.folder / "results/tiny/conditioned")
    (finished.folder / "results/tiny/conditioned").touch()
    assert run("condition")
    assert "conditioned" in capfd.readouterr().err
    (finished.folder / "results/tiny/conditioned").unlink()
    assert run("condition") == 0


def test_libraries_are_loaded_once_for_all_steps(run):
    assert run("ingest", all_modules(), ids=["bare"]) == 0
    loaded = {part for one in server().memory_maps() for part in Path(one.path).parts}
    assert {"numpy", "h5py", "pandas", "numba"} <= loaded, "what it and later ones ask for"


def test_a_process_that_is_killed_is_missed_by_no_one_and_another_takes_its_place(run):
    """The step under way ends by itself; one that has not begun fails; the next ones are done."""
    assert run("ingest", ids=["bare"]) == 0
    for _ in range(2):
        kill(server())
        assert run("condition", ids=["bare"]) == 0
    held = server()
    held.suspend()  # asked, and killed before it answers
    answer = ThreadPoolExecutor().submit(run, "condition", ids=["bare"])
    time.sleep(0.2)
    kill(held)
    assert answer.result(timeout=20)
    assert run("condition", ids=["bare"]) == 0
