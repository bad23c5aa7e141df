"""Where the time of a whole run goes: work, start, Snakemake; and the largest memory of a job.

    python benchmarks/workflow.py [--campaign data/twin] [--cores 2]

Copies the campaign's description into a temporary folder, runs it from cold, then once more with
nothing to do, and prints a table. Processor seconds, so that a busy machine changes them little;
the wall time is beside them.
"""

from __future__ import annotations

import argparse
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
PROCESS = re.compile(
    r"^process: ([\d.]+) s of processor time, ([\d.]+) before the step, peak memory (\d+) MiB",
    re.MULTILINE,
)


def run(folder: Path, campaign: Path, cores: int) -> tuple[float, float]:
    """Wall seconds and processor seconds of everything, of one run."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    started = time.perf_counter()
    result = subprocess.run(
        [
            *(sys.executable, "-m", "snakemake", "--cores", str(cores)),
            *("--config", f"campaign={campaign}", f"results={folder / 'results'}"),
        ],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=False,
    )
    wall = time.perf_counter() - started
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if result.returncode:
        sys.exit(result.stderr[-3000:])
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall, used


def job_figures(results: Path) -> list[tuple[str, float, float, int]]:
    """Step, processor seconds, those before the step, and peak MiB of every job, from its log."""
    figures = []
    for log in sorted(results.glob("logs/**/*.log")):
        match = PROCESS.search(log.read_text(encoding="utf-8"))
        if match:
            stage = log.relative_to(results / "logs").parts[0].removesuffix(".log")
            figures.append((stage, float(match[1]), float(match[2]), int(match[3])))
    return figures


def size_mb(folder: Path) -> float:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--campaign", type=Path, default=REPOSITORY / "data/twin")
    parser.add_argument("--cores", type=int, default=2)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        campaign = folder / arguments.campaign.resolve().name
        generated = shutil.ignore_patterns("raw", "truth")
        simulated = (arguments.campaign / "scene.yaml").is_file()
        shutil.copytree(arguments.campaign, campaign, ignore=generated if simulated else None)
        wall, used = run(folder, campaign, arguments.cores)
        jobs = job_figures(folder / "results")
        nothing, _ = run(folder, campaign, arguments.cores)
        raw, results = size_mb(campaign / "raw"), size_mb(folder / "results")
    started = sum(before for _, _, before, _ in jobs)
    in_jobs = sum(seconds for _, seconds, _, _ in jobs)
    print(f"cold run: {wall:.1f} s on {arguments.cores} cores, {len(jobs)} jobs")
    print(f"nothing to do: {nothing:.1f} s")
    print(f"raw {raw:.0f} MB, results {results:.0f} MB\n")
    print("| where | processor s | share |\n|---|---|---|")
    for name, seconds in (
        ("work in jobs", in_jobs - started),
        ("start of jobs, imports", started),
        ("Snakemake, and what starts jobs", used - in_jobs),
    ):
        print(f"| {name} | {seconds:.1f} | {seconds / used:.0%} |")
    print("\n| step | jobs | processor s | largest MiB |\n|---|---|---|---|")
    for stage in dict.fromkeys(stage for stage, *_ in jobs):
        rows = [(seconds, peak) for name, seconds, _, peak in jobs if name == stage]
        total, peak = sum(s for s, _ in rows), max(p for _, p in rows)
        print(f"| {stage} | {len(rows)} | {total:.1f} | {peak} |")


if __name__ == "__main__":
    main()
