"""Mean and largest amplitude over 200 clearances by 200 excitation levels, 200 s each, all cores.

    python -m benchmarks.amplitude_map           # about a minute on two cores

writes docs/benchmarks/amplitude_map.md and amplitude_map.svg.
"""

from __future__ import annotations

import os
import resource
import sys
import time
from pathlib import Path

import numpy as np
from benchmarks.impact_problems import TABLE_2

from vinesexp import NES, Rig
from vinesexp.solver.map import AmplitudeMap, amplitude_map
from vinesexp.theory.optimal_clearance import b_c_published

ROOT = Path(__file__).resolve().parent.parent
MAP_PAGE = ROOT / "docs" / "benchmarks" / "amplitude_map.md"
MAP_HEAD = """# Amplitude over clearance and excitation level

Made by `python -m benchmarks.amplitude_map`: the rig of Table 2 at its resonance, 200 clearances
by 200 levels, the ball started 1 % short of a wall.

![Mean and largest amplitude](amplitude_map.svg)

"""


def main() -> None:
    """200 clearances by 200 levels, 200 s each."""
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=0.03, r=0.6)])
    begin = time.perf_counter()

    def bar(done: int, total: int) -> None:
        spent = time.perf_counter() - begin
        width = int(40 * done / total)
        print(f"\r[{'#' * width}{' ' * (40 - width)}] {done}/{total} cells, {spent:.0f} s, "
              f"{spent / done * (total - done):.0f} s left", end="", file=sys.stderr)  # fmt: skip

    grid = amplitude_map(
        rig, frequency=TABLE_2.f0, clearances=np.linspace(5e-3, 60e-3, 200),
        levels=np.linspace(0.05e-3, 0.40e-3, 200), duration=200.0, settle=50.0, progress=bar,
    )  # fmt: skip
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    said = (
        f"{grid.mean.size} cells of 200 s in {time.perf_counter() - begin:.0f} s on "
        f"{os.cpu_count()} cores, {grid.impacts.sum():.2e} impacts counted (from 50 s on), "
        f"peak memory {peak:.0f} MiB."
    )
    print(f"\n{said}")
    MAP_PAGE.write_text(MAP_HEAD + said + "\n", encoding="utf-8")
    draw_map(grid)


def draw_map(grid: AmplitudeMap) -> None:
    """Mean and largest amplitude over clearance and level."""
    import matplotlib

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    plt.rcParams["svg.hashsalt"] = "vinesexp"
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), constrained_layout=True, sharey=True)
    for axis, values, name in zip(
        axes, (grid.mean, grid.largest), ("mean", "largest"), strict=True
    ):
        mesh = axis.pcolormesh(
            1e3 * grid.clearances, 1e3 * grid.levels, 1e3 * values, rasterized=True, cmap="viridis"
        )
        figure.colorbar(mesh, ax=axis, label=f"{name} amplitude (mm)")
        rig = Rig(TABLE_2, nes=[NES(m=0.032, b=0.03, r=0.6)])
        b_c = 1e3 * b_c_published(G=grid.levels, eps=rig.eps, lam=rig.lam, r=rig.nes[0].r)
        axis.plot(b_c, 1e3 * grid.levels, color="white", lw=1.2)
        axis.text(b_c[-60], 1e3 * grid.levels[-50], "b_c (36)", color="white", fontsize=9)
        axis.set(xlabel="clearance b (mm)", xlim=(5, 60))
    axes[0].set_ylabel("base amplitude G (mm)")
    figure.savefig(MAP_PAGE.with_suffix(".svg"), metadata={"Date": None}, dpi=120)
    figure.savefig(os.environ.get("PREVIEW", os.devnull), format="png", dpi=80)


if __name__ == "__main__":
    main()
