"""What holds on one machine holds on a cluster: the profiles differ in where jobs run alone."""

from pathlib import Path

import pytest
import yaml

PROFILES = Path(__file__).resolve().parents[2] / "profiles"
STEPS = {"ingest", "condition", "impacts", "estimate"}


def profile(name):
    return yaml.safe_load((PROFILES / name / "profile.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("key", sorted(profile("default").keys() - {"cores"}))
def test_a_cluster_has_what_the_default_has(key):
    assert profile("slurm")[key] == profile("default")[key]


def test_the_steps_of_a_record_are_one_job_of_the_cluster_and_several_records_too():
    slurm = profile("slurm")
    groups = dict(entry.split("=") for entry in slurm["groups"])
    assert set(groups) == STEPS
    assert len(set(groups.values())) == 1
    (components,) = slurm["group-components"]
    assert int(components.split("=")[1]) > 1
