"""The tiny campaign on a cluster gives the bytes of a local run; where Slurm answers, else skipped.

A cluster of one machine serves: docs/cluster.md says how one is set up for a try.
"""

import importlib.util
import shutil
import subprocess
import time

import pytest
from tests.faults.project import contents, differences

pytestmark = [pytest.mark.workflow, pytest.mark.slow]


def slurm_answers() -> bool:
    if importlib.util.find_spec("snakemake_executor_plugin_slurm") is None:
        return False
    if shutil.which("sinfo") is None:
        return False
    told = subprocess.run(["sinfo", "-h", "-o", "%a"], capture_output=True, text=True, check=False)
    return told.returncode == 0 and "up" in told.stdout


on_a_cluster = pytest.mark.skipif(not slurm_answers(), reason="no Slurm here")
WHERE = (
    *("--config", "campaign=data/tiny", "--workflow-profile", "profiles/slurm"),
    *("--slurm-status-command", "squeue", "--slurm-no-account"),
)


@on_a_cluster
def test_a_run_on_a_cluster_gives_the_bytes_of_a_local_one(one_run, workflow):
    workflow.tiny_campaign()
    done = workflow.run(*WHERE)
    assert done.returncode == 0, done.stderr
    assert differences(contents(workflow), contents(one_run)) == []


@on_a_cluster
def test_a_job_that_is_lost_is_made_by_the_next_run(one_run, workflow):
    workflow.tiny_campaign()
    first = subprocess.Popen(
        workflow.command(*WHERE),
        cwd=workflow.folder,
        stderr=subprocess.PIPE,
        text=True,
    )
    lost = running_job(first)
    subprocess.run(["scancel", "--signal=KILL", "--full", lost], check=True)
    _, said = first.communicate(timeout=600)
    assert first.returncode, "the run did not notice that a job was lost"
    assert "Traceback" not in said
    again = workflow.run(*WHERE)
    assert again.returncode == 0, again.stderr
    assert differences(contents(workflow), contents(one_run)) == []


def running_job(run: "subprocess.Popen[str]") -> str:
    """The first job that the cluster runs for a workflow."""
    for _ in range(1200):
        assert run.poll() is None, "the run ended before a job was seen"
        told = subprocess.run(
            ["squeue", "-h", "-t", "running", "-o", "%i"],
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()
        if told:
            return told[0]
        time.sleep(0.1)
    raise AssertionError("no job runs on the cluster")
