"""Mean and largest amplitude over 200 clearances by 200 excitation levels, 200 s each, all cores.

    python -m benchmarks.amplitude_map           # about a minute on two cores

writes docs/benchmarks/amplitude_map.md and amplitude_map.svg.
"""

from __future__ import annotations

import os
import resource
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from benchmarks.impact_problems import TABLE_2

from vinesexp import NES, Harmonic, Release, Rig
from vinesexp.arrays import FloatArray
from vinesexp.solver.side_by_side import Amplitudes, amplitudes, row_of
from vinesexp.theory.optimal_clearance import b_c_published

ROOT = Path(__file__).resolve().parent.parent
MAP_PAGE = ROOT / "docs" / "benchmarks" / "amplitude_map.md"
CLEARANCES, LEVELS = np.linspace(5e-3, 60e-3, 200), np.linspace(0.05e-3, 0.40e-3, 200)
MAP_HEAD = """# Amplitude over clearance and excitation level

Made by `python -m benchmarks.amplitude_map`: the rig of Table 2 at its resonance, 200 clearances
by 200 levels, the ball started 1 % short of a wall.

![Mean and largest amplitude](amplitude_map.svg)

"""


def main() -> None:
    """200 clearances by 200 levels, 200 s each."""
    begin = time.perf_counter()

    def row(level: float) -> Amplitudes:
        return amplitudes(np.array([
            row_of(
                Rig(TABLE_2, nes=[NES(m=0.032, b=b, r=0.6)]), Harmonic(level, TABLE_2.f0),
                Release(y0=[0.99 * b]), settle=50.0, duration=200.0,
            )
            for b in CLEARANCES
        ]))  # fmt: skip

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = list(pool.map(row, LEVELS))
    mean, largest = np.array([one.mean for one in found]), np.array([one.largest for one in found])
    hits = sum(one.impacts.sum() for one in found)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    said = (
        f"{mean.size} cells of 200 s in {time.perf_counter() - begin:.0f} s on "
        f"{os.cpu_count()} cores, {hits:.2e} impacts counted (from 50 s on), "
        f"peak memory {peak:.0f} MiB."
    )
    print(f"\n{said}")
    MAP_PAGE.write_text(MAP_HEAD + said + "\n", encoding="utf-8")
    draw_map(mean, largest)


def draw_map(mean: FloatArray, largest: FloatArray) -> None:
    """Mean and largest amplitude over clearance and level."""
    import matplotlib

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    plt.rcParams["svg.hashsalt"] = "vinesexp"
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), constrained_layout=True, sharey=True)
    for axis, values, name in zip(axes, (mean, largest), ("mean", "largest"), strict=True):
        mesh = axis.pcolormesh(
            1e3 * CLEARANCES, 1e3 * LEVELS, 1e3 * values, rasterized=True, cmap="viridis"
        )
        figure.colorbar(mesh, ax=axis, label=f"{name} amplitude (mm)")
        rig = Rig(TABLE_2, nes=[NES(m=0.032, b=0.03, r=0.6)])
        b_c = 1e3 * b_c_published(G=LEVELS, eps=rig.eps, lam=rig.lam, r=rig.nes[0].r)
        axis.plot(b_c, 1e3 * LEVELS, color="white", lw=1.2)
        axis.text(b_c[-60], 1e3 * LEVELS[-50], "b_c (36)", color="white", fontsize=9)
        axis.set(xlabel="clearance b (mm)", xlim=(5, 60))
    axes[0].set_ylabel("base amplitude G (mm)")
    figure.savefig(MAP_PAGE.with_suffix(".svg"), metadata={"Date": None}, dpi=120)
    figure.savefig(os.environ.get("PREVIEW", os.devnull), format="png", dpi=80)


if __name__ == "__main__":
    main()
