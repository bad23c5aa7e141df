"""Many faults, one after the other, each followed by a run that has to mend it.

    python -m tests.faults --kills 50 --damage 20 --disks 10 [--seed 1] [--folder DIR]

A campaign is killed a few times on its way to the end, and then run to it; results are damaged and
run again; the disk is too small, or is protected against writing, and then not
any more. Bytes of all results are then those of a run that nothing happened to.
"""

from __future__ import annotations

import argparse
import random
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests.workflow.conftest import Workflow

from . import disks, injections
from .project import RESULTS, contents, copy_of, differences, finish, new_project

EACH = 10  # kills on the way to one end


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--damage", type=int, default=20)
    parser.add_argument("--disks", type=int, default=10, help="needs the rights of root")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, help="where to work; default: temporary")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=given.folder, prefix="vinesexp-faults-") as name:
        folder = Path(name)
        fresh = new_project(folder / "fresh")
        seconds = finish(fresh)
        print(f"a run that nothing happens to: {seconds:.0f} s, {len(contents(fresh))} results")
        wrong = kills(fresh, folder, given.kills, given.seed, seconds)
        wrong += damages(fresh, folder, given.damage, given.seed)
        wrong += bad_disks(fresh, folder, given.disks, given.seed, seconds)
    print(f"{wrong} ended otherwise")
    return 1 if wrong else 0


def kills(fresh: Workflow, folder: Path, wanted: int, seed: int, seconds: float) -> int:
    """Runs killed `wanted` times in all; how many ended with other bytes."""
    ways: Counter[str] = Counter()
    ends = wrong = 0
    while sum(ways.values()) < wanted:
        rng = random.Random(f"kills {seed} {ends}")
        project = new_project(folder / "killed")
        for _ in range(min(EACH, wanted - sum(ways.values()))):
            way = injections.killed(project, rng, longest=0.25 * seconds)
            if not way:
                break
            ways[way] += 1
        finish(project)
        injections.end_all(project)
        other = differences(contents(project), contents(fresh))
        ends, wrong = ends + 1, wrong + bool(other)
        print(f"killed so far {dict(ways)}: {other or 'the same bytes'}", flush=True)
        shutil.rmtree(project.folder)
    print(f"{sum(ways.values())} kills {dict(ways)} in {ends} runs, {wrong} with other bytes")
    return wrong


def damages(fresh: Workflow, folder: Path, wanted: int, seed: int) -> int:
    """Results damaged, one at a time; after how many a run did not mend it."""
    wrong = 0
    project = copy_of(fresh, folder / "damaged")
    for number in range(wanted):
        rng = random.Random(f"damage {seed} {number}")
        kind = list(injections.DAMAGES)[number % len(injections.DAMAGES)]
        name = injections.damage(project, rng, kind)
        finish(project)
        other = differences(contents(project), contents(fresh))
        wrong += bool(other)
        print(f"{name} {kind}: {other or 'the same bytes'}", flush=True)
    print(f"{wanted} damaged results, {wrong} with other bytes")
    return wrong


def bad_disks(fresh: Workflow, folder: Path, wanted: int, seed: int, seconds: float) -> int:
    """Runs on full and on write-protected disks; how many ended with other bytes."""
    wrong = 0
    needed = sum(path.stat().st_size for path in (fresh.folder / RESULTS).rglob("*"))
    for number in range(wanted):
        rng = random.Random(f"disks {seed} {number}")
        project = new_project(folder / "disk")
        full = number % 2 == 0
        size = round(0.9 * needed * 0.01 ** rng.random()) if full else 2 * needed
        with disks.disk(project, size=size) as place:
            if full:
                said = disks.filled(project, place, size=2 * needed)
            else:
                said = disks.write_protected(project, place, rng, longest=0.5 * seconds)
            finish(project)
            other = differences(contents(project), contents(fresh))
        wrong += bool(other)
        print(f"disk {number}: {said}; {other or 'the same bytes'}", flush=True)
        shutil.rmtree(project.folder)
    print(f"{wanted} bad disks, {wrong} with other bytes")
    return wrong


if __name__ == "__main__":
    sys.exit(main())
