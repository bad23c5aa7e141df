"""Do 95 % intervals hold the truth? Simulated campaigns with fresh seeds at three noise levels.

    python -m benchmarks.error_bars --campaigns 200        # about 20 minutes, two cores

Each campaign is made and analysed from scene.yaml to the rows of identified.csv as the workflow
does it; nothing but the noise of its instruments differs. For every parameter: the share of
campaigns whose 95 % interval holds the truth, the bias over the scatter, and the scatter over the
stated standard error. Writes docs/benchmarks/error_bars.md and the table that every report shows,
src/vinesexp/report/error_bars.csv.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from benchmarks.rehearsal import rehearse

from vinesexp.identification.estimate import BEST, COMBINED
from vinesexp.units import COVERAGE_95

ROOT = Path(__file__).resolve().parent.parent
TABLE = ROOT / "src" / "vinesexp" / "report" / "error_bars.csv"
PAGE = ROOT / "docs" / "benchmarks" / "error_bars.md"

PARAMETERS = ("f0", "zeta", "M", "c1", "k1", "r")
#: Noise of lasers and accelerometer, in units of the nominal 6 um (base 2 um) and 0.3 m/s^2.
LEVELS = {"a third of nominal": 1 / 3, "nominal": 1.0, "three times nominal": 3.0}
COLUMNS = (
    "noise", "parameter", "campaigns", "covered", "bias", "scatter", "std_error_relative"
)  # fmt: skip

SCENE = """\
title: Error bars
seed: {seed}
rig: {{mass: 4.7 kg, damping: 3.02 N s/m, stiffness: 1.147e4 N/m, nes_mass: 32 g,
      restitution: 0.6}}
sensors:
  base: {{sensitivity: 400 mV/mm, noise: {base:.9g} um, range: 2.5 mm}}
  displacement: {{sensitivity: 40 mV/mm, noise: {laser:.9g} um, drift: 0.05 mm, drift_time: 60 s,
                 bandwidth: 5 kHz, range: 25 mm}}
  acceleration: {{sensitivity: 20 mV/g, noise: {acceleration:.9g} m/s^2, pulse: 0.4 ms,
                 range: 50 g}}
oscilloscope: {{sample_rate: 10 kHz, bits: 14, full_scale: 1 V, format: hdf5}}
groups:
  all:
    test: ringdown
    duration: 15 s
    records:
      bare_1: {{release: 20 mm}}
      bare_2: {{release: 15 mm}}
      added_300g: {{release: 20 mm, added_mass: 300 g}}
      added_600g: {{release: 18 mm, added_mass: 600 g}}
      sweep: {{test: sweep, duration: 60 s, base_amplitude: 0.25 mm, frequency: [7.2 Hz, 8.4 Hz]}}
      drop_1: {{test: drop, duration: 1.5 s, height: 80 mm}}
      drop_2: {{test: drop, duration: 1.5 s, height: 50 mm}}
      two_impacts: {{test: periodic, duration: 15 s, settle: 20 s, base_amplitude: 0.25 mm,
                    frequency: 7.862 Hz, clearance: 30 mm, ball_start: wall -1}}
      modulated: {{test: periodic, duration: 15 s, settle: 20 s, base_amplitude: 0.25 mm,
                  frequency: 7.862 Hz, clearance: 40 mm, ball_start: wall -1}}
      released: {{test: transient, duration: 10 s, release: 20 mm, clearance: 27 mm,
                 ball_start: wall -1}}
"""

Found = dict[str, tuple[float, float]]


def campaign(task: tuple[str, int]) -> tuple[str, int, Found]:
    """Error in stated standard errors, and standard error over truth, of each parameter."""
    level, seed = task
    noise = LEVELS[level]
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.yaml"
        text = SCENE.format(seed=seed, base=2 * noise, laser=6 * noise, acceleration=0.3 * noise)
        scene.write_text(text, encoding="utf-8")
        done = rehearse(scene)
    truth = done.scene.truth()
    found = {}
    for row in done.rows:
        if row.parameter in PARAMETERS and row.method in (*BEST, "added mass", COMBINED):
            true = truth[row.parameter]
            name = row.parameter if row.method == COMBINED else f"{row.parameter} {row.method}"
            found[name] = ((row.value - true) / row.std_error, row.std_error / true)
    return level, seed, found


def studied(campaigns: int, processes: int, first: int) -> Iterator[tuple[str, int, Found]]:
    """Every campaign of every level, each with a seed of its own."""
    seeds = range(first, first + campaigns)
    tasks = [(level, len(LEVELS) * seed + i) for seed in seeds for i, level in enumerate(LEVELS)]
    began = time.perf_counter()
    with ProcessPoolExecutor(processes) as pool:
        for done, result in enumerate(pool.map(campaign, tasks, chunksize=3), start=1):
            left = (time.perf_counter() - began) / done * (len(tasks) - done)
            print(f"\r{done} of {len(tasks)}, {left:.0f} s left  ", end="", file=sys.stderr)
            yield result
    print(file=sys.stderr)


def summarised(pulls: dict[tuple[str, str], list[tuple[float, float]]]) -> list[dict[str, str]]:
    """Rows of the table."""
    rows = []
    for (level, name), values in pulls.items():
        z, relative = np.array(values).T
        scatter = float(z.std(ddof=1))
        cells = (
            level, name, str(z.size), f"{np.mean(np.abs(z) < COVERAGE_95):.4f}",
            f"{z.mean() / scatter:.3f}", f"{scatter:.3f}", f"{np.median(relative):.3g}",
        )  # fmt: skip
        rows.append(dict(zip(COLUMNS, cells, strict=True)))
    return rows


def page(rows: list[dict[str, str]], campaigns: int, seconds: float) -> str:
    """The table for people."""
    lines = [
        "| noise | value | 95 % intervals with the truth | bias / scatter | "
        "scatter / stated error | stated error, relative |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        share = float(row["covered"])
        lines.append(
            f"| {row['noise']} | {row['parameter']} | {100 * share:.1f} % | {row['bias']} | "
            f"{row['scatter']} | {row['std_error_relative']} |"
        )
    chance = 100 * COVERAGE_95 * math.sqrt(0.95 * 0.05 / campaigns)
    body = "\n".join(lines)
    return f"""# Do the error bars hold what they state?

`python -m benchmarks.error_bars --campaigns {campaigns}`: {campaigns} simulated campaigns of ten
records at each of three noise levels, every one with its own seed, analysed from raw file to the
rows of `identified.csv` ({seconds / 60:.0f} minutes, two shared cores). With {campaigns} campaigns
the share of an honest 95 % interval itself scatters by {chance:.1f} % (95 % of the time). Rows with
one word are the combined values; the others are the methods that enter them.

{body}
"""


def main() -> None:
    parser = argparse.ArgumentParser(description="do 95 % intervals hold the truth?")
    parser.add_argument("--campaigns", type=int, default=200, help="at each noise level")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--dry", action="store_true", help="print, write nothing")
    args = parser.parse_args()
    began = time.perf_counter()
    pulls: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for level, _, found in studied(args.campaigns, args.processes, args.first_seed):
        for name, value in found.items():
            pulls.setdefault((level, name), []).append(value)
    order = {name: i for i, name in enumerate(PARAMETERS)}
    rows = sorted(
        summarised(pulls),
        key=lambda row: (
            list(LEVELS).index(row["noise"]),
            " " in row["parameter"],
            order[row["parameter"].split()[0]],
        ),
    )
    text = page(rows, args.campaigns, time.perf_counter() - began)
    print(text)
    if args.dry:
        return
    PAGE.write_text(text, encoding="utf-8")
    with TABLE.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(row for row in rows if " " not in row["parameter"])


if __name__ == "__main__":
    main()
