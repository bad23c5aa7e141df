"""What holds on one machine holds on a cluster: the profiles differ in where jobs run alone."""

from pathlib import Path

import pytest
import yaml

PROFILES = Path(__file__).resolve().parents[2] / "profiles"


def profile(name):
    return yaml.safe_load((PROFILES / name / "profile.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("key", sorted(profile("default").keys() - {"cores"}))
def test_a_cluster_has_what_the_default_has(key):
    assert profile("slurm")[key] == profile("default")[key]


@pytest.mark.workflow
def test_a_run_that_has_no_cores_of_its_own_is_planned(workflow):
    """Where jobs go to a cluster, Snakemake is not told of cores."""
    workflow.tiny_campaign()
    assert {"ingest bare", "ingest added"} <= workflow.planned(cores=None)
