"""The event loop of two source trees, side by side: ns of the processor an impact.

    python -m benchmarks.loop_side_by_side OLD/src NEW/src      # a minute and a half

Each tree runs in processes of its own, in turn, with a cache of its own; the best of all its runs
counts. Times of a shared machine compare only like this. `map` is a map of 14 clearances by 14
levels with its statistics, 200 s a cell, one thread.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile

ROUNDS = 2
MEASURE = """
import json, math, time
import numpy as np
from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.excitation import WeakDamping
from vinesexp.solver.arrays import ball_table, closed_form, parameters
from vinesexp.solver.contact import REMAINDER
from vinesexp.solver.arrays import drive_table
from vinesexp.solver.kernel import run
from vinesexp.solver.lanes import amplitudes, row_of
from vinesexp.solver.series import ORDER

try:
    from vinesexp.solver import rubbing  # the older tree
    more = ()
except ImportError:
    more = (None,)
o = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
def over_map(cells, duration):
    levels, clearances = np.linspace(0.05e-3, 0.40e-3, cells), np.linspace(5e-3, 60e-3, cells)
    return amplitudes(np.array([
        row_of(Rig(o, nes=[NES(m=0.032, b=b, r=0.6)]), Harmonic(G, o.f0),
               Release(y0=[0.99 * b]), settle=0.0, duration=duration)
        for G in levels for b in clearances
    ])).impacts.sum()

base, found = Harmonic(amplitude=0.25e-3, frequency=o.f0), {}
for b in ([0.030], [0.034], [0.036], [0.040], [0.060], [0.034, 0.034]):
    rig = Rig(o, nes=[NES(m=0.032 / len(b), b=one, r=0.6) for one in b])
    response, (kind, table) = closed_form(rig, base, WeakDamping()), drive_table(base)
    par, log = parameters(rig, WeakDamping()), np.zeros((40000, 10))
    labels, work = np.zeros((40000, 3), dtype=np.int32), np.zeros((25, ORDER + 1))
    best = math.inf
    for _ in range(7):
        start = Release(y0=[0.99 * one * (-1) ** i for i, one in enumerate(b)])
        balls, state = ball_table(rig, start)[0], np.zeros(4)
        work[:] = 0.0
        begin = time.process_time_ns()
        rows, used = run(
            True, response, par, kind, table, 1000.0, REMAINDER, state, balls, log, labels, work,
            *more
        )
        spent = time.process_time_ns() - begin
        hits = int((labels[:rows, 0] == 1).sum())
        best = min(best, spent / hits)
    found[" + ".join(f"{1e3 * one:g}" for one in b)] = best, used / hits

best = math.inf
for cells in (2, 14, 14, 14):
    begin = time.process_time_ns()
    hits = over_map(cells, 200.0)
    if cells > 2:
        best = min(best, (time.process_time_ns() - begin) / hits)
found["map"] = best, math.nan
for b, r in ((0.030, 0.6), (0.036, 0.6), (0.040, 0.6), (0.060, 0.6), (0.002, 0.22)):
    starts = [Release(y0=[b * (0.99 - 0.01 * k)]) for k in range(64)]
    best = math.inf
    for _ in range(3):
        begin = time.process_time_ns()
        rows = [row_of(Rig(o, nes=[NES(m=0.032, b=b, r=r)]), base, start, settle=0.0,
                       duration=200.0) for start in starts]
        hits = amplitudes(np.array(rows)).impacts.sum()
        best = min(best, (time.process_time_ns() - begin) / hits)
    found[f"64 starts at {1e3 * b:g}"] = best, math.nan
departures = {
    "plain, simulate": {}, "friction": {"friction": 0.05}, "tilt": {"tilt": 0.05},
    "r by wall": {"r_minus": 0.55},
}
for name, more in departures.items():
    rig = Rig(o, nes=[NES(m=0.032, b=0.03, r=0.6, **more)])
    best = math.inf
    for _ in range(3):
        begin = time.process_time_ns()
        motion = simulate(rig, base, Release(y0=[0.0297]), 200.0)
        spent = time.process_time_ns() - begin
        best = min(best, spent / motion.impacts["time"].size)
    found[name] = best, math.nan
print(json.dumps(found))
"""


def measured(tree: str, cache: str) -> dict[str, list[float]]:
    """ns and evaluations of the motion per impact, by case."""
    environment = {**os.environ, "PYTHONPATH": tree, "NUMBA_CACHE_DIR": cache}
    said = subprocess.run(
        [sys.executable, "-c", MEASURE], env=environment, capture_output=True, text=True, check=True
    ).stdout
    found: dict[str, list[float]] = json.loads(said)
    return found


def main() -> None:
    trees = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        caches = [f"{folder}/{i}" for i in range(len(trees))]
        runs: list[list[dict[str, list[float]]]] = [[] for _ in trees]
        for _ in range(ROUNDS):
            for own, tree, cache in zip(runs, trees, caches, strict=True):
                own.append(measured(tree, cache))
    heads = " | ".join(f"{tree} (ns) | evaluations" for tree in trees)
    print(f"| clearances (mm) | {heads} |\n|---|{'---|---|' * len(trees)}")
    for case in runs[0][0]:
        cells = " | ".join(
            f"{min(run[case][0] for run in own):.0f} | {own[0][case][1]:.2f}" for own in runs
        )
        print(f"| {case} | {cells} |")


if __name__ == "__main__":
    main()
