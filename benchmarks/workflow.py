"""What the workflow costs beside the same science in one process, in one run; and what jobs took.

    python -m benchmarks.workflow [--campaign data/twin] [--ringdowns 60] [--cores 2]

Each campaign is run by `snakemake` from an empty folder, and by one process that calls the same
functions; both with an empty cache of compiled code. Then `snakemake` has nothing to do, and then
one record more. Processor seconds of everything that was started, so that a busy machine changes
them less than the time on the wall. Steps are listed by their logs, for the first run and for one
record more.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).resolve().parents[1]
_BECOME_PARENT_OF_ORPHANS = 36  # PR_SET_CHILD_SUBREAPER
TOOK = re.compile(r"^done in ([\d.]+) s of processor time, peak memory (\d+) MiB", re.MULTILINE)
DESCRIPTION = """\
title: Ring-downs
known: {mass: 4.7 kg, nes_mass: 32 g}
channels: {displacement: {column: 1, quantity: displacement, unit: mm}}
sample_rate: 1 kHz
"""
ONE_PROCESS = """\
import sys
from pathlib import Path
from vinesexp import showing
from vinesexp.pipeline import analyse_campaign
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths

folder, paths = Path(sys.argv[1]), ResultPaths(Path(sys.argv[2]))
scene = (folder / "scene.yaml").is_file()
campaign = load_campaign(folder)
for record in campaign.records if scene else ():
    showing.simulate(campaign, record, paths=paths)
analyse_campaign(campaign, paths=paths)
steps = [showing.figures_of_records, showing.figures_of_results, showing.pages, showing.report]
for step in [showing.score, *steps] if scene else steps:
    step(campaign, paths=paths)
"""


def write_ringdowns(folder: Path, count: int) -> None:
    """The usual small campaign: ring-downs of 6,000 samples, half of them with a mass added."""
    (folder / "raw").mkdir(parents=True)
    (folder / "campaign.yaml").write_text(DESCRIPTION, encoding="utf-8")
    (folder / "records.csv").write_text("record,file,test,added_mass_g\n", encoding="utf-8")
    for number in range(count):
        add_ringdown(folder, number)


def add_ringdown(folder: Path, number: int) -> None:
    added = 0.5 * (number % 2)
    w, t = 2.0 * np.pi * 7.862 * (4.7 / (4.7 + added)) ** 0.5, np.arange(6000) / 1000.0
    x = 20.0 * np.exp(-0.01 * w * t) * np.cos(w * t)
    x += np.random.default_rng(number).normal(0.0, 0.006, t.size)
    rows = "".join(f"{a:.3f},{b:.4f}\n" for a, b in zip(t, x, strict=True))
    (folder / f"raw/r{number:03d}.csv").write_text(f"t,x\n{rows}", encoding="utf-8")
    with (folder / "records.csv").open("a", encoding="utf-8") as table:
        mass = f"{1e3 * added:g}" if added else ""
        table.write(f"r{number:03d},raw/r{number:03d}.csv,ringdown,{mass}\n")


def copy_description(campaign: Path, folder: Path) -> None:
    """A campaign without what its scene makes."""
    generated = shutil.ignore_patterns("raw", "truth")
    simulated = (campaign / "scene.yaml").is_file()
    shutil.copytree(campaign, folder, ignore=generated if simulated else None)


def used(command: list[str], cache: Path) -> float:
    """Processor seconds of a command and of all that it starts, which may end after it (Linux)."""
    ctypes.CDLL(None).prctl(_BECOME_PARENT_OF_ORPHANS, 1)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # each process would compile the package anew
    done = subprocess.run(
        command,
        cwd=REPOSITORY,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    with contextlib.suppress(ChildProcessError):
        while True:
            os.wait()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        sys.exit(done.stderr[-3000:])
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def workflow(campaign: Path, results: Path, cores: int) -> list[str]:
    return [
        *(sys.executable, "-m", "snakemake", "--cores", str(cores)),
        *("--config", f"campaign={campaign}", f"results={results}"),
    ]


def jobs(results: Path, *, since: float) -> list[str]:
    """What each step took, by the logs written since a time: a table."""
    found: dict[str, list[tuple[float, int]]] = {}
    for log in sorted(results.glob("logs/**/*.log")):
        if log.stat().st_mtime >= since:
            step = log.relative_to(results / "logs").parts[0].partition(".")[0]
            took = TOOK.findall(log.read_text(encoding="utf-8"))
            found.setdefault(step, []).extend((float(s), int(peak)) for s, peak in took)
    return [
        "| step | records | processor s | largest MiB |\n|---|---|---|---|",
        *(
            f"| {step} | {len(rows)} | {sum(s for s, _ in rows):.1f} | {max(p for _, p in rows)} |"
            for step, rows in found.items()
            if rows
        ),
    ]


def measure(name: str, folder: Path, arguments: argparse.Namespace) -> None:
    """One row of the table, and what its jobs took."""
    here, alone = folder / "workflow" / name, folder / "alone" / name
    for place in (here, alone):
        if name == "ringdowns":
            write_ringdowns(place, arguments.ringdowns)
        else:
            copy_description(arguments.campaign, place)
    results, began = folder / "results", time.time()
    command = workflow(here, results, arguments.cores)
    cold = used(command, folder / "cache-1")
    tables = {"steps": jobs(results, since=began)}  # before the next run writes its own logs
    science = used(
        [sys.executable, "-c", ONE_PROCESS, str(alone), str(folder / "one")], folder / "cache-2"
    )
    nothing = used(command, folder / "cache-1")
    cells = [f"{cold:.1f}", f"{science:.1f}", f"{cold / science:.2f}", f"{nothing:.1f}"]
    if name == "ringdowns":
        add_ringdown(here, arguments.ringdowns)
        began = time.time()
        cells.append(f"{used(command, folder / 'cache-1'):.1f}")
        tables["steps with one added"] = jobs(results, since=began)
    else:
        cells.append("")
    print(f"| {name} | {' | '.join(cells)} |")
    for head, lines in tables.items():
        print(f"\n{name}, {head}\n", *lines, sep="\n")
    print(flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--campaign", type=Path, help="such as data/twin; default: none")
    parser.add_argument("--ringdowns", type=int, default=60)
    parser.add_argument("--cores", type=int, default=2)
    arguments = parser.parse_args()
    names = ["ringdowns"] if arguments.ringdowns else []
    names += [arguments.campaign.resolve().name] if arguments.campaign else []
    for name in names:
        print("| campaign | workflow | one process | ratio | nothing to do | one added |")
        print("|---|---|---|---|---|---|")
        with tempfile.TemporaryDirectory() as temporary:
            measure(name, Path(temporary), arguments)


if __name__ == "__main__":
    main()
