"""A tiny campaign to break, and whether its results are those of a run that nothing happened to."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import time
from pathlib import Path

from tests.workflow.conftest import Workflow

ARGUMENTS = ("--config", "campaign=data/tiny")
RESULTS = Path("results/tiny")
#: Not results: notes of times and places, and what was printed.
_ASIDE = (".campaign", "logs")
#: The report says when it was made, and from files of which time.
_TIME_OF_DAY = re.compile(rb"\d{4}-\d\d-\d\d \d\d:\d\d UTC")


def new_project(folder: Path) -> Workflow:
    """The workflow and the tiny campaign in a folder, nothing run."""
    folder.mkdir(parents=True, exist_ok=True)
    project = Workflow(folder)
    project.tiny_campaign()
    return project


def copy_of(project: Workflow, folder: Path) -> Workflow:
    """A project with all that it holds, elsewhere."""
    shutil.copytree(project.folder, folder, symlinks=True)
    return Workflow(folder)


def start(project: Workflow) -> subprocess.Popen[str]:
    """A run in a group of processes of its own; what it reports goes to ``run.txt``."""
    with (project.folder / "run.txt").open("w", encoding="utf-8") as reported:
        return subprocess.Popen(
            project.command(*ARGUMENTS),
            cwd=project.folder,
            stdout=reported,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )


def finish(project: Workflow) -> float:
    """Run to the end; seconds on a clock.

    Raises
    ------
    AssertionError
        The run fails; with the end of what it reported.
    """
    began = time.monotonic()
    code = start(project).wait(timeout=7200)
    assert code == 0, reported(project)[-3000:]
    return time.monotonic() - began


def reported(project: Workflow) -> str:
    """What the last run printed."""
    return (project.folder / "run.txt").read_text(encoding="utf-8", errors="replace")


def contents(project: Workflow) -> dict[str, str]:
    """Digest of every result by name; hidden files too, which a finished run leaves none of."""
    results = project.folder / RESULTS
    return {
        path.relative_to(results).as_posix(): hashlib.sha256(
            _TIME_OF_DAY.sub(b"", path.read_bytes())
        ).hexdigest()
        for path in sorted(results.rglob("*"))
        if path.is_file()
        and path.relative_to(results).parts[0] not in _ASIDE
        and not path.name.endswith("made.json")
    }


def differences(found: dict[str, str], wanted: dict[str, str]) -> list[str]:
    """Names of results that are missing, too many or of other bytes."""
    return sorted(name for name in found.keys() | wanted if found.get(name) != wanted.get(name))
