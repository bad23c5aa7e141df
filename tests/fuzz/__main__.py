"""Many cases, one after the other or in several processes; what is found is kept.

    python -m tests.fuzz --minutes 30 [--cases 200000] [--targets text,binary] [--first 0]
    python -m tests.fuzz --case text:1234          # one case again, with its traceback

A worker process runs a few hundred cases; where it dies or stands still, the case it was at is
what was found. Input and traceback go to --keep, with a table of all cases (`table.md`) after every
round.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import select
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from . import seeds
from .cases import Outcome, run_case
from .in_process import limit_memory
from .tally import Tally
from .targets import TARGETS

CHUNK = 200
STILL = 180.0  # s on a clock without a case done: a machine may be busy

#: Cases of each target in one round: by what they cost, and by what they can break.
ROUND = {
    "text": 200, "binary": 600, "campaign": 600, "records": 600, "scene": 150, "signal": 12,
    "motion": 600, "command": 60, "length": 300, "indirect": 300, "folder": 200,
}  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--cases", type=int, help="stop after so many, if that is sooner")
    parser.add_argument("--targets", default=",".join(TARGETS))
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--keep", type=Path, default=Path("fuzz-findings"))
    parser.add_argument("--case", help="run this one case here")
    arguments = parser.parse_args()
    if arguments.case:
        with tempfile.TemporaryDirectory() as folder:
            outcome = run_case(arguments.case, Path(folder) / "case")
            print(outcome.word, f"{outcome.seconds:.2f} s", outcome.detail, sep="\n")
            _keep(outcome, Path(folder) / "case", arguments.keep)
        return outcome.word == "FOUND"
    ends = time.monotonic() + 60.0 * arguments.minutes
    workers = []
    for number in range(arguments.processes):
        pid = os.fork()
        if pid == 0:
            os._exit(_run(arguments, ends, number))
        workers.append(pid)
    codes = [os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) for pid in workers]
    return 1 if any(codes) else 0


def _run(arguments: argparse.Namespace, ends: float, number: int) -> int:
    targets = arguments.targets.split(",")
    tally = Tally()
    at = dict.fromkeys(targets, arguments.first + number)
    most = (arguments.cases or sys.maxsize) / arguments.processes
    _import_all()
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(
        prefix="vinesexp-fuzz-", dir=memory if memory.is_dir() else None
    ) as folder:
        while time.monotonic() < ends and tally.cases < most:
            for target in targets:
                step = arguments.processes
                cases = [f"{target}:{at[target] + step * k}" for k in range(ROUND[target])]
                at[target] += step * ROUND[target]
                for outcome in _outcomes(cases, Path(folder), ends):
                    tally.add(outcome)
                    if outcome.word == "FOUND":
                        print(outcome.case, outcome.detail.strip().splitlines()[-1:], flush=True)
                        _keep(outcome, Path(folder) / "case", arguments.keep)
            arguments.keep.mkdir(parents=True, exist_ok=True)
            table = arguments.keep / (f"table_{number}.md" if number else "table.md")
            table.write_text(tally.table(), encoding="utf-8")
    print(tally.table(), flush=True)
    return 1 if tally.found else 0


def _import_all() -> None:
    """What the workers, copies of this process, would import each for itself."""
    for kind in ("text", "binary"):
        seeds.files(kind)
    for name in ("pandas", "scipy.signal", "scipy.optimize", "xlrd"):
        with suppress(ImportError):
            import_module(name)


def _outcomes(
    cases: list[str], folder: Path, ends: float, *, child: bool = False
) -> Iterator[Outcome]:
    """Run cases in workers that may die; where one did, try the case as the program reads it."""
    while cases and time.monotonic() < ends:
        chunk, cases = cases[:CHUNK], cases[CHUNK:]
        from_worker, to_here = os.pipe()
        pid = os.fork()
        if pid == 0:
            _work(chunk, folder, from_worker, to_here, child)
        os.close(to_here)
        done = 0
        for outcome in _answers(from_worker):
            done += 1
            yield outcome
        if done < len(chunk):
            os.kill(pid, signal.SIGKILL)
        status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        os.close(from_worker)
        if done < len(chunk):
            if child:
                reported = f"the worker died or stood still (status {status})"
                yield Outcome(chunk[done], "FOUND", reported, 0.0)
            else:
                yield from _outcomes(chunk[done : done + 1], folder, math.inf, child=True)
            cases = chunk[done + 1 :] + cases


def _work(chunk: list[str], folder: Path, unused: int, pipe: int, child: bool) -> None:
    os.close(unused)
    if not child:
        limit_memory()
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    try:
        with os.fdopen(pipe, "w", encoding="utf-8") as stream:
            for case in chunk:
                outcome = run_case(case, folder / "case", child=child)
                stream.write(json.dumps(vars(outcome)) + "\n")
                stream.flush()
                if outcome.word == "FOUND" and case.partition(":")[0]:
                    time.sleep(0.3)  # for the input to be copied
    finally:
        os._exit(0)


def _answers(pipe: int) -> Iterator[Outcome]:
    pending = b""
    while select.select([pipe], [], [], STILL)[0]:
        part = os.read(pipe, 1 << 16)
        if not part:
            return
        *lines, pending = (pending + part).split(b"\n")
        for line in lines:
            yield Outcome(**json.loads(line))


def _keep(outcome: Outcome, folder: Path, keep: Path) -> None:
    if outcome.word != "FOUND":
        return
    place = keep / outcome.case.replace(":", "_")
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    (place / "found.txt").write_text(outcome.detail, encoding="utf-8")
    for path in folder.iterdir() if folder.is_dir() else ():
        if path.is_file() and path.stat().st_size < 1_000_000:
            shutil.copy(path, place)


if __name__ == "__main__":
    sys.exit(main())
