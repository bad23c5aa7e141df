"""What machines and people do to a run and to its results."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import psutil
from tests.workflow.conftest import Workflow

from .project import RESULTS, contents, reported, start

WAYS = ("all", "main", "all", "main", "all", "main", "job")


def killed(project: Workflow, rng: random.Random, *, longest: float) -> str:
    """Start a run and ``kill -9`` it after a while: the way; empty where it had ended before.

    ``all``: every process, as a power failure does. ``main``: Snakemake alone, whose jobs go on
    while the next run begins. ``job``: one job, as the system does when memory is short; the run
    goes on without it.
    """
    run = start(project)
    way = rng.choice(WAYS)
    try:
        run.wait(timeout=rng.uniform(0.2, longest))
        return ""
    except subprocess.TimeoutExpired:
        pass
    if way == "job":
        jobs = psutil.Process(run.pid).children(recursive=True)
        if jobs:
            rng.choice(jobs).kill()
            run.wait(timeout=7200)
            assert "Traceback" not in reported(project), reported(project)[-3000:]
            return way
        way = "all"
    if way == "all":
        os.killpg(run.pid, signal.SIGKILL)
    else:
        run.kill()
    run.wait()
    return way


def end_all(project: Workflow) -> None:
    """Wait until no job of a killed run is left in the project's folder."""
    for _ in range(600):
        left = [p for p in psutil.process_iter(["cwd"]) if p.info["cwd"] == str(project.folder)]
        if not left:
            return
        time.sleep(0.1)
    raise AssertionError(f"{left} never end")


def _truncated(path: Path, rng: random.Random, _: list[Path]) -> None:
    raw = path.read_bytes()
    path.write_bytes(raw[: rng.randrange(len(raw) or 1)])


def _deleted(path: Path, _: random.Random, __: list[Path]) -> None:
    path.unlink()


def _flipped(path: Path, rng: random.Random, _: list[Path]) -> None:
    raw = bytearray(path.read_bytes())
    raw[rng.randrange(len(raw))] ^= 1 << rng.randrange(8)
    path.write_bytes(raw)


def _emptied(path: Path, _: random.Random, __: list[Path]) -> None:
    path.write_bytes(b"")


def _older(path: Path, rng: random.Random, others: list[Path]) -> None:
    """Other content under a time that lies before that of every result."""
    other = rng.choice(others)
    content = other.read_bytes() if other != path else b"other"
    path.write_bytes(content)
    os.utime(path, (1e9, 1e9))


def _flipped_at_its_time(path: Path, rng: random.Random, others: list[Path]) -> None:
    """A byte changed, with size and time of last change as they were."""
    status = path.stat()
    _flipped(path, rng, others)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


DAMAGES: dict[str, Callable[[Path, random.Random, list[Path]], None]] = {
    "truncated": _truncated,
    "deleted": _deleted,
    "a bit flipped": _flipped,
    "emptied": _emptied,
    "swapped, older": _older,
    "a bit flipped, same times": _flipped_at_its_time,
}


def damage(project: Workflow, rng: random.Random, kind: str) -> str:
    """Damage one result, any; its name."""
    results = project.folder / RESULTS
    notes = [path.relative_to(results).as_posix() for path in results.rglob("*made.json")]
    names = sorted(contents(project)) + sorted(notes)
    name = rng.choice([name for name in names if (results / name).stat().st_size])
    DAMAGES[kind](results / name, rng, [results / other for other in names])
    return name
