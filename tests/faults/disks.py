"""Disks that are full, or that nobody may write any more, after a run was killed."""

from __future__ import annotations

import contextlib
import random
import subprocess
from collections.abc import Iterator
from pathlib import Path

from tests.workflow.conftest import Workflow

from . import injections
from .project import RESULTS, reported, start

_MOST_LINES = 60  # of what a failed run prints: a page


@contextlib.contextmanager
def disk(project: Workflow, *, size: int) -> Iterator[Path]:
    """A disk of `size` bytes for the results of a project; needs the rights of root.

    Raises
    ------
    PermissionError
        Nothing may be mounted here.
    """
    place = project.folder / RESULTS
    place.mkdir(parents=True)
    if _mount("-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)):
        raise PermissionError("no disk can be mounted here")
    try:
        yield place
    finally:
        subprocess.run(["umount", "--lazy", place], check=True)


def can_mount(folder: Path) -> bool:
    """Whether disks can be made here."""
    try:
        with disk(Workflow(folder), size=65536):
            return True
    except (PermissionError, FileNotFoundError):
        return False


def filled(project: Workflow, place: Path, *, size: int) -> str:
    """Run on a disk that is too small; then give it `size` bytes. What the run said of it."""
    code = start(project).wait(timeout=7200)
    said = _refusal(project, code, "No space left on device")
    assert not _mount("-o", f"remount,size={size}", str(place))
    return said


def write_protected(project: Workflow, place: Path, rng: random.Random, *, longest: float) -> str:
    """A run is killed, and its disk comes back protected against writing; then it no longer is."""
    injections.killed(project, rng, longest=longest)
    injections.end_all(project)
    assert not _mount("-o", "remount,ro", str(place))
    code = start(project).wait(timeout=7200)
    said = _refusal(project, code, "Read-only file system")
    assert not _mount("-o", "remount,rw", str(place))
    return said


def _refusal(project: Workflow, code: int, words: str) -> str:
    text = reported(project)
    lines = text.splitlines()
    assert code, f"the run ended as if nothing had been:\n{text[-3000:]}"
    assert "Traceback" not in text, text[-3000:]
    assert len(lines) <= _MOST_LINES, f"{len(lines)} lines:\n{text[-3000:]}"
    naming = [line.strip() for line in lines if words in line]
    assert naming, f"no line says '{words}':\n{text[-3000:]}"
    return naming[0]


def _mount(*arguments: str) -> int:
    return subprocess.run(["mount", *arguments], capture_output=True, check=False).returncode
