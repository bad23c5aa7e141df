"""Mean and largest amplitude over 200 clearances by 200 excitation levels, 200 s each, all cores.

    python -m benchmarks.amplitude_map           # about a minute on two cores

writes docs/benchmarks/amplitude_map.md and amplitude_map.svg.
"""

from __future__ import annotations

import os
import resource
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from benchmarks.impact_problems import TABLE_2
from numpy.typing import ArrayLike

from vinesexp import NES, Rig
from vinesexp.arrays import FloatArray, IntArray
from vinesexp.errors import ParameterError
from vinesexp.excitation import Harmonic, Release, WeakDamping
from vinesexp.rig import checked
from vinesexp.solver.arrays import ball_table, closed_form, is_plain, parameters
from vinesexp.solver.chatter import REMAINDER
from vinesexp.solver.drive import drive_table
from vinesexp.solver.effort import Effort
from vinesexp.solver.kernel import run
from vinesexp.solver.series import ORDER
from vinesexp.solver.statistics import add_amplitudes
from vinesexp.theory.optimal_clearance import b_c_published

ROOT = Path(__file__).resolve().parent.parent
MAP_PAGE = ROOT / "docs" / "benchmarks" / "amplitude_map.md"
MAP_HEAD = """# Amplitude over clearance and excitation level

Made by `python -m benchmarks.amplitude_map`: the rig of Table 2 at its resonance, 200 clearances
by 200 levels, the ball started 1 % short of a wall.

![Mean and largest amplitude](amplitude_map.svg)

"""


@dataclass(frozen=True)
class AmplitudeMap:
    """Amplitudes hypot(x, x'/w0), m; arrays of shape (levels, clearances)."""

    clearances: FloatArray
    levels: FloatArray
    mean: FloatArray
    largest: FloatArray
    impacts: IntArray


def amplitude_map(
    rig: Rig,
    *,
    frequency: float,
    clearances: ArrayLike,
    levels: ArrayLike,
    duration: float,
    settle: float = 0.0,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> AmplitudeMap:
    """Mean and largest amplitude for every clearance b (m) and base amplitude G (m).

    Each ball starts at rest, 1 % of b short of a wall; amplitudes count from `settle` (s) on.

    Parameters
    ----------
    rig : Rig
        With one NES; its clearance is replaced.
    frequency : float
        Of the base, Hz.
    clearances, levels : array_like
        b (m, > 0) and G (m, > 0).
    duration, settle : float
        s; settle < duration.
    workers : int, optional
        Threads; by default one per core.
    progress : callable, optional
        Called as progress(cells done, cells in all).

    Raises
    ------
    ParameterError
        Not one NES, values out of range, damping or resonance without a closed form.

    Examples
    --------
    >>> from vinesexp import Oscillator
    >>> rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.03, r=0.6)])
    >>> grid = amplitude_map(rig, frequency=7.862, clearances=[0.02, 0.03], levels=[0.25e-3],
    ...                      duration=60.0, settle=40.0)
    >>> (grid.mean * 1e3).round(1)
    array([[10.2,  5.9]])
    """
    b = checked(clearances, "clearance b", "m, above zero", closed=False)
    G = checked(levels, "base amplitude", "m, above zero", closed=False)
    if len(rig.nes) != 1:
        raise ParameterError(f"the rig has {len(rig.nes)} NESs: expected one for an amplitude map")
    if not is_plain(rig) or rig.nes[0].b_minus is not None:
        raise ParameterError(
            "the NES has friction, tilt or walls that differ, or its spring is cubic: an amplitude "
            "map is of a plain rig; simulate its cells one by one"
        )
    if not 0.0 <= settle < duration:
        raise ParameterError(f"settle = {settle}: expected from 0 to below the duration {duration}")
    out = np.empty((3, G.size, b.size))

    def fill(level: int) -> int:
        out[:, level] = _row(rig, frequency, float(G[level]), b, float(duration), float(settle))
        return b.size

    done = 0
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        for task in as_completed([pool.submit(fill, level) for level in range(G.size)]):
            done += task.result()
            if progress is not None:
                progress(done, G.size * b.size)
    return AmplitudeMap(b, G, out[0], out[1], out[2].astype(np.int64))


def _row(
    rig: Rig, frequency: float, level: float, b: FloatArray, duration: float, settle: float
) -> FloatArray:
    """(mean, largest, impacts) for every clearance at one level."""
    base = Harmonic(amplitude=level, frequency=frequency)
    response = closed_form(rig, base, WeakDamping())
    if response is None:
        raise ParameterError("an amplitude map needs an underdamped oscillator off sharp resonance")
    kind, table = drive_table(base)
    par = parameters(rig, WeakDamping())
    log, labels = np.empty((2048, 6)), np.empty((2048, 3), dtype=np.int32)
    out = np.empty((3, b.size))
    for k, clearance in enumerate(b):
        cell = Rig(rig.oscillator, nes=[replace(rig.nes[0], b=float(clearance))])
        balls, _ = ball_table(cell, Release(y0=[0.99 * float(clearance)]))
        work = np.zeros((4, ORDER + 1))
        state, node, sums = np.zeros(4), np.zeros(4), np.zeros(4)
        effort = Effort(cell, base, WeakDamping(), duration)
        while state[0] < duration:
            rows, used = run(
                True, response, par, kind, table, duration, REMAINDER, state, balls, log, labels,
                work,
            )  # fmt: skip
            effort.add(state, used)
            add_amplitudes(response, log, labels, rows, state, node, settle, sums)
        out[:, k] = sums[1] / sums[0], sums[2], sums[3]
    return out


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
