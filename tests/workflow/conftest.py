"""A tiny simulated campaign and a way to run snakemake on it, in a folder of its own."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]


class Workflow:
    """The workflow copied into a folder, so that runs, results and edits stay there."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("Snakefile", "workflow", "profiles"):
            source = REPOSITORY / name
            copy = shutil.copytree if source.is_dir() else shutil.copy
            copy(source, folder / name)

    def run(self, *arguments: str, environment: dict[str, str] | None = None):
        """Run snakemake here; the result carries `returncode`, `stdout` and `stderr`."""
        return subprocess.run(
            [sys.executable, "-m", "snakemake", *arguments],
            cwd=self.folder,
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
            env={**os.environ, "NO_COLOR": "1", **(environment or {})},
        )


@pytest.fixture()
def workflow(tmp_path):
    return Workflow(tmp_path)
