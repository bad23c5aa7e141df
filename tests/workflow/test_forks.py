"""Steps as forks of one process: each ends alone, and the process when nobody can ask any more."""

import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import psutil
import pytest

from vinesexp.supervised import Forks

pytestmark = [pytest.mark.workflow, pytest.mark.long]


@pytest.fixture
def forks():
    found = Forks()
    yield found
    found.end()


def asked(project, step, **other):
    folder = project.folder
    files = {"campaign": "data/tiny", "results": "results/tiny", "log": "log"}
    places = {name: str(folder / file) for name, file in files.items()}
    return {"step": step, "batch": "1of1", **places, "output": [str(folder / "done")], **other}


def test_a_step_is_done_and_a_mistake_is_none_of_the_next_ones(forks, finished, capfd):
    records = finished.folder / "results/tiny/records"
    shutil.rmtree(records)
    assert forks.run(asked(finished, "ingest")) == 0
    assert {path.name for path in records.iterdir()} == {"added.nc", "bare.nc"}
    assert (finished.folder / "done").is_file()
    assert forks.run(asked(finished, "condition", campaign="nowhere")) == 1
    assert "vinesexp: nowhere: no such folder" in capfd.readouterr().err
    assert forks.run(asked(finished, "nonsense")) != 0
    assert forks.run(asked(finished, "condition")) == 0


def test_libraries_are_loaded_once_and_the_process_ends_with_who_asks(finished):
    forks = Forks()
    assert forks.run(asked(finished, "ingest")) == 0
    child = psutil.Process(forks._process.pid)
    loaded = {part for one in child.memory_maps() for part in Path(one.path).parts}
    assert {"numpy", "h5py", "pandas"} <= loaded, "what the step names and what it asks for later"
    forks.end()
    assert not child.is_running()


def test_a_process_that_is_killed_is_missed_by_no_one_and_another_takes_its_place(forks, finished):
    """The step under way ends by itself; one that has not begun fails; the next ones are done."""
    assert forks.run(asked(finished, "ingest")) == 0
    for _ in range(2):
        child = psutil.Process(forks._process.pid)
        child.kill()
        child.wait()
        assert forks.run(asked(finished, "condition")) == 0
    child = psutil.Process(forks._process.pid)
    child.suspend()  # asked, and killed before it answers
    answer = ThreadPoolExecutor().submit(forks.run, asked(finished, "condition"))
    time.sleep(0.2)
    child.kill()
    assert answer.result(timeout=20) == 1
    assert forks.run(asked(finished, "condition")) == 0
