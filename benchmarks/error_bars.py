"""Do 95 % intervals hold the truth? Many simulated campaigns with fresh seeds, at three noise levels.

Each campaign is made and analysed from scene.yaml to identified.csv as the workflow would do it, with
nothing but the noise of its instruments differing. For every parameter: the share of campaigns
whose 95 % interval holds the truth, the bias and the scatter in units of the stated standard error.
Writes the table that the report shows (src/vinesexp/report/coverage.csv) and
docs/benchmarks/error_bars.md.

    python benchmarks/error_bars.py --campaigns 200
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

from vinesexp.errors import VinesexpError
from vinesexp.rehearsal import rehearse

PARAMETERS = ("f0", "zeta", "M", "c1", "k1", "r")
#: Noise of laser and accelerometer, in units of the nominal 6 um and 0.3 m/s^2.
LEVELS = {"a third of nominal": 1 / 3, "nominal": 1.0, "three times nominal": 3.0}
ROOT = Path(__file__).resolve().parents[1]
TABLE = ROOT / "src" / "vinesexp" / "report" / "coverage.csv"
PAGE = ROOT / "docs" / "benchmarks" / "error_bars.md"

SCENE = """\
title: Coverage
seed: {seed}
rig: {{mass: 4.7 kg, damping: 3.02 N s/m, stiffness: 1.147e4 N/m, nes_mass: 32 g, restitution: 0.6}}
sensors:
  base: {{sensitivity: 400 mV/mm, noise: {base:.9g} um, range: 2.5 mm}}
  displacement: {{sensitivity: 40 mV/mm, noise: {laser:.9g} um, drift: 0.05 mm, drift_time: 60 s,
                 bandwidth: 5 kHz, range: 25 mm}}
  acceleration: {{sensitivity: 20 mV/g, noise: {accelerometer:.9g} m/s^2, pulse: 0.4 ms, range: 50 g}}
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


def campaign(task: tuple[str, float, int]) -> tuple[str, int, dict[str, tuple[float, float]]]:
    """(value - truth)/standard error and standard error/truth of each parameter."""
    level, factor, seed = task
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.yaml"
        scene.write_text(
            SCENE.format(
                seed=seed, base=2 * factor, laser=6 * factor, accelerometer=0.3 * factor
            ),
            encoding="utf-8",
        )
        done = rehearse(scene)
    truth = done.scene.truth()
    found = {}
    for row in done.rows:
        if row.parameter in PARAMETERS:
            true = truth[row.parameter]
            name = row.parameter if row.method == "combined" else f"{row.parameter} {row.method}"
            found[name] = ((row.value - true) / row.std_error, row.std_error / true)
    return level, seed, found


def studied(
    campaigns: int, processes: int, first: int
) -> Iterator[tuple[str, int, dict[str, tuple[float, float]]]]:
    tasks = [
        (level, factor, first + seed) for seed in range(campaigns) for level, factor in LEVELS.items()
    ]
    began = time.perf_counter()
    with ProcessPoolExecutor(processes) as pool:
        for done, result in enumerate(pool.map(campaign, tasks, chunksize=3), start=1):
            left = (time.perf_counter() - began) / done * (len(tasks) - done)
            print(f"\r{done} of {len(tasks)}, {left:.0f} s left  ", end="", file=sys.stderr)
            yield result
    print(file=sys.stderr)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--campaigns", type=int, default=200, help="at each noise level")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    pulls: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for level, seed, found in studied(args.campaigns, args.processes, args.first_seed):
        for name, value in found.items():
            pulls.setdefault((level, name), []).append(value)
            if abs(value[0]) > 4 and " " not in name:
                print(level, seed, name, value)
    for (level, name), values in pulls.items():
        z, rel = np.array(values).T
        print(
            f"{level:20} {name:16} n={z.size:4d} cover {100 * np.mean(np.abs(z) < 1.959964):5.1f} % "
            f"mean {z.mean():6.2f} sd {z.std(ddof=1):5.2f} rel.err {np.median(rel):.2e}"
        )


if __name__ == "__main__":
    main()
