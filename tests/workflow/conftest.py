"""A tiny campaign and a way to run snakemake on it, in a folder of its own."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

REPOSITORY = Path(__file__).resolve().parents[2]

CAMPAIGN = """\
title: Tiny
channels:
  displacement: {column: Laser, quantity: displacement, unit: mm}
time: {column: Time, unit: s}
"""


def write_ringdown(path: Path, *, f0: float, zeta: float = 0.01, seed: int = 0) -> None:
    """Seven seconds of a free decay from 20 mm at 500 Hz, with 6 um of noise."""
    t = np.arange(3500) / 500.0
    x = 20.0 * np.exp(-zeta * 2 * np.pi * f0 * t) * np.cos(2 * np.pi * f0 * t)
    x += np.random.default_rng(seed).normal(0.0, 0.006, t.size)
    rows = "\n".join(f"{a:.3f},{b:.4f}" for a, b in zip(t, x, strict=True))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"Time,Laser\ns,mm\n{rows}\n", encoding="utf-8")


class Workflow:
    """The workflow copied into a folder, so that runs, results and edits stay there."""

    repository = REPOSITORY
    write_ringdown = staticmethod(write_ringdown)

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("Snakefile", "workflow", "profiles"):
            source = REPOSITORY / name
            (shutil.copytree if source.is_dir() else shutil.copy)(source, folder / name)

    def command(self, *arguments: str) -> list[str]:
        return [sys.executable, "-m", "snakemake", "--cores", "2", *arguments]

    def run(
        self, *arguments: str, environment: dict[str, str] | None = None
    ) -> subprocess.CompletedProcess[str]:
        """Run snakemake here; the result carries `returncode`, `stdout` and `stderr`."""
        return subprocess.run(
            self.command(*arguments),
            cwd=self.folder,
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
            env={**os.environ, **(environment or {})},
        )

    def tiny_campaign(self, name: str = "tiny") -> Path:
        """Two ring-downs, one with 0.5 kg added to a mass of 4.7 kg."""
        folder = self.folder / "data" / name
        write_ringdown(folder / "raw/bare.csv", f0=7.862)
        write_ringdown(folder / "raw/added.csv", f0=7.862 * (4.7 / 5.2) ** 0.5, seed=1)
        (folder / "campaign.yaml").write_text(CAMPAIGN, encoding="utf-8")
        (folder / "records.csv").write_text(
            "record,file,test,added_mass_g\n"
            "bare,raw/bare.csv,ringdown,\n"
            "added,raw/added.csv,ringdown,500\n",
            encoding="utf-8",
        )
        return folder


@pytest.fixture
def workflow(tmp_path):
    return Workflow(tmp_path)
