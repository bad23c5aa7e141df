"""A tiny campaign, and ways to run and to plan the workflow on it in a folder of its own."""

import contextlib
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(REPOSITORY))  # for tests.faults, wherever pytest was started

from tests.workflow import forked  # noqa: E402

CAMPAIGN = """\
title: Tiny
known: {mass: 4.7 kg, nes_mass: 32 g}
channels:
  displacement: {column: Laser, quantity: displacement, unit: mm}
time: {column: Time, unit: s}
bandpass: {low: 2 Hz, high: 40 Hz}
"""

RECORDS = """\
record,file,test,clearance_mm,frequency_hz,added_mass_g,release_mm,exclude,note
bare,raw/bare.csv,ringdown,,,,20,,
added,raw/added.csv,ringdown,,,500,20,,
"""


def write_ringdown(path: Path, *, f0: float, zeta: float = 0.01, seed: int = 0) -> None:
    """Seven seconds of a free decay from 20 mm at 500 Hz, with 6 um of noise."""
    t = np.arange(3500) / 500.0
    x = 20.0 * np.exp(-zeta * 2 * np.pi * f0 * t) * np.cos(2 * np.pi * f0 * t)
    x += np.random.default_rng(seed).normal(0.0, 0.006, t.size)
    rows = "\n".join(f"{a:.3f},{b:.4f}" for a, b in zip(t, x, strict=True))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"Time,Laser\ns,mm\n{rows}\n", encoding="utf-8")


#: Which step on all records makes a file of results/tiny.
MAKERS = {
    "regimes.csv": "regimes",
    "identified.csv": "identify",
    "clearances.csv": "compare",
    "replay_cycles.csv": "replay",
    "checks.csv": "checks",
    "report.html": "report",
    "records.html": "pages",
    "results.json": "figures results",
    "records.json": "figures records",
}


STEPS = re.compile(r"^  (\w+) +\d+/\d+ (\S+?),?( .*)?$", re.MULTILINE)


class Workflow:
    """The workflow copied into a folder, so that runs, results and edits stay there."""

    repository = REPOSITORY
    write_ringdown = staticmethod(write_ringdown)

    @staticmethod
    def steps(result: subprocess.CompletedProcess[str]) -> list[tuple[str, str]]:
        """The (step, record) pairs that a run reports at the console, a line each."""
        return [found[:2] for found in STEPS.findall(result.stderr)]

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.considered: set[str] = set()
        if not (folder / "workflow").exists():
            shutil.copy(REPOSITORY / "Snakefile", folder)
            for name in ("workflow", "profiles"):
                shutil.copytree(REPOSITORY / name, folder / name)

    def command(self, *arguments: str) -> list[str]:
        return [sys.executable, "-m", "snakemake", "--cores", "2", *arguments]

    def start(self, *arguments: str, name: str = "run") -> forked.Run:
        """Start snakemake here, as a fork of a process that has loaded it."""
        return forked.start(("--cores", "2", *arguments), self.folder, name=name)

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run snakemake here; the result carries `returncode`, `stdout` and `stderr`."""
        return self.start(*arguments).ended()

    def planned(self, *, cores: int | None = 1, **config: object) -> set[str]:
        """Steps that would run, as `step record`: a dry run in this process, which is quicker.

        Without `cores` it is that of a cluster, which has none of its own.
        """
        from snakemake.api import SnakemakeApi
        from snakemake.settings.enums import Quietness, RerunTrigger
        from snakemake.settings.types import (
            ConfigSettings,
            DAGSettings,
            OutputSettings,
            ResourceSettings,
        )

        from vinesexp import workflow

        with (
            contextlib.chdir(self.folder),
            SnakemakeApi(OutputSettings(dryrun=True, quiet={Quietness.ALL})) as api,
        ):
            made = api.workflow(
                resource_settings=ResourceSettings(cores=cores, nodes=None if cores else 2),
                config_settings=ConfigSettings(config={"campaign": "data/tiny", **config}),
                snakefile=self.folder / "workflow/Snakefile",
            )
            dag = made.dag(DAGSettings(rerun_triggers={RerunTrigger.SOFTWARE_ENV}))
            files: list[str] = []
            dag.execute_workflow(executor="dryrun", updated_files=files)
            found = set()
            for file in map(Path, files):
                if file.parent.name == "batches":
                    step, _, batch = file.name.partition(".")
                    ids = workflow.CURRENT.pending(step, batch)
                    found |= {f"{step} {id}" for id in ids}
                elif file.name in MAKERS:
                    found.add(MAKERS[file.name])
        return found

    def tiny_campaign(self, name: str = "tiny") -> Path:
        """Two ring-downs, one with 0.5 kg added to a mass of 4.7 kg."""
        folder = self.folder / "data" / name
        write_ringdown(folder / "raw/bare.csv", f0=7.862)
        write_ringdown(folder / "raw/added.csv", f0=7.862 * (4.7 / 5.2) ** 0.5, seed=1)
        (folder / "campaign.yaml").write_text(CAMPAIGN, encoding="utf-8")
        (folder / "records.csv").write_text(RECORDS, encoding="utf-8")
        return folder

    def edit(self, file: str, old: str, new: str) -> None:
        """Replace text that is there in a file of the tiny campaign."""
        path = self.folder / "data/tiny" / file
        text = path.read_text(encoding="utf-8")
        assert old in text
        path.write_text(text.replace(old, new), encoding="utf-8")


@pytest.fixture
def workflow(tmp_path):
    return Workflow(tmp_path)


@pytest.fixture(scope="session")
def one_run(once):
    """The tiny campaign, run once for all tests that only look, or that work on a copy."""

    def make(folder):
        workflow = Workflow(folder)
        workflow.tiny_campaign()
        result = workflow.run("--config", "campaign=data/tiny")
        assert result.returncode == 0, result.stderr
        return folder

    return Workflow(once("finished", make))


@pytest.fixture
def finished(one_run, tmp_path):
    """A copy of the project after its run, with new times of all files."""
    folder = tmp_path / "project"
    shutil.copytree(one_run.folder, folder, copy_function=shutil.copyfile)
    return Workflow(folder)
