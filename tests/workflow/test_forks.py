"""Steps as forks of one process: each ends alone, and the process when nobody can ask any more."""

import os
import time

import psutil
import pytest

from vinesexp.steps import Forks

pytestmark = pytest.mark.workflow


@pytest.fixture
def forks():
    found = Forks()
    yield found
    found.end()


def words(workflow, step, *more):
    workflow.tiny_campaign()
    here = workflow.folder
    out = ["--log", str(here / "log"), "--output", str(here / "done")]
    return [step, str(here / "data/tiny"), str(here / "results"), *more, *out]


def test_a_step_is_done_and_a_mistake_is_none_of_the_next_ones(forks, workflow, capfd):
    assert forks.run(words(workflow, "ingest", "--batch", "1of1")) == 0
    assert sorted(path.name for path in (workflow.folder / "results/records").iterdir()) == [
        "added.nc", "bare.nc",
    ]  # fmt: skip
    assert (workflow.folder / "done").is_file()
    missing = ["condition", "nowhere", *words(workflow, "condition", "--batch", "1of1")[2:]]
    assert forks.run(missing) == 1
    assert "vinesexp: nowhere: no such folder" in capfd.readouterr().err
    assert forks.run(["condition", "--nonsense"]) != 0
    assert forks.run(words(workflow, "condition", "--batch", "1of1")) == 0


def test_libraries_are_loaded_once_and_the_process_ends_with_who_asks(workflow):
    forks = Forks()
    assert forks.run(words(workflow, "ingest", "--batch", "1of1")) == 0
    (child,) = psutil.Process(os.getpid()).children()
    loaded = {os.path.basename(one.path).partition(".")[0] for one in child.memory_maps()}
    assert "_multiarray_umath" in loaded, "numpy"
    forks.end()
    until = time.monotonic() + 20.0
    while child.is_running() and time.monotonic() < until:
        time.sleep(0.02)
    assert not child.is_running()
