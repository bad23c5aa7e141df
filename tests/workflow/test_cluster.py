"""The tiny campaign on a cluster gives the bytes of a local run; where Slurm answers, else skipped.

A cluster of one machine serves: docs/cluster.md says how one is set up for a try.
"""

import importlib.util
import shutil
import subprocess

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


@pytest.mark.skipif(not slurm_answers(), reason="no Slurm here")
def test_a_run_on_a_cluster_gives_the_bytes_of_a_local_one(one_run, workflow):
    workflow.tiny_campaign()
    where = ("--workflow-profile", "profiles/slurm", "--slurm-status-command", "squeue")
    done = workflow.run("--config", "campaign=data/tiny", *where, "--slurm-no-account")
    assert done.returncode == 0, done.stderr
    assert differences(contents(workflow), contents(one_run)) == []
