"""Mean and largest amplitude over clearance and level by the compiled loop alone, on all cores.

The peer of the maps: every cell is an exact simulation from one start. Its log is consumed while
it is filled, so that memory does not grow with duration.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from vinesexp import Rig
from vinesexp.arrays import FloatArray, IntArray
from vinesexp.errors import ParameterError
from vinesexp.excitation import Harmonic, Release, WeakDamping
from vinesexp.rig import checked
from vinesexp.solver.arrays import ball_table, closed_form, drive_table, is_plain, parameters
from vinesexp.solver.contact import REMAINDER
from vinesexp.solver.effort import Effort
from vinesexp.solver.kernel import run
from vinesexp.solver.lanes import add_amplitudes
from vinesexp.solver.series import ORDER


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
        state, node, sums = np.zeros(4), np.zeros(4), np.zeros(5)
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
