"""Amplitudes of many plain rigs with one ball, exactly simulated side by side (`lanes.py`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.excitation import Harmonic, Release, WeakDamping
from vinesexp.rig import Rig
from vinesexp.solver.arrays import ball_table, is_plain
from vinesexp.solver.effort import Effort
from vinesexp.solver.state import RHO, SIDE, D, U

FloatArray = NDArray[np.float64]

PASSES = 100_000  # steps after which an interrupt is heard


@dataclass(frozen=True)
class Amplitudes:
    """What runs did from `settle` on; arrays of one entry a run.

    Attributes
    ----------
    mean, largest : amplitude hypot(x, x'/w0), m.
    impacts : their number.
    latest : time of the last impact, s; 0 where there is none.
    """

    mean: FloatArray
    largest: FloatArray
    impacts: FloatArray
    latest: FloatArray


def fits_lanes(rig: Rig, damping: WeakDamping) -> bool:
    """Whether a rig runs in a lane: one ball, lighter than the oscillator, and nothing special."""
    one = len(rig.nes) == 1 and rig.nes[0].m <= rig.oscillator.M
    return one and is_plain(rig, damping)


def row_of(
    rig: Rig, base: Harmonic, release: Release, *, settle: float, duration: float
) -> FloatArray:
    """One run as a row for `amplitudes`: SI values, the ball as it starts, the times (s)."""
    o, balls = rig.oscillator, ball_table(rig, release)[0]
    half = 0.5 * (rig.nes[0].b + rig.nes[0].clearance(-1))
    return np.array([
        o.M, o.c1, o.k1, base.amplitude, base.frequency, base.phase, rig.nes[0].m, half,
        rig.nes[0].r, release.x0, release.v0, *balls[0, [D, SIDE, RHO, U]], settle, duration,
    ])  # fmt: skip


def amplitudes(rows: FloatArray, *, stop: Callable[[], bool] = lambda: False) -> Amplitudes:
    """Mean and largest amplitude of every run, each from its `settle` to its `duration`.

    Parameters
    ----------
    rows : ndarray of shape (runs, 17)
        One row a run, as `row_of` makes it.
    stop : callable, optional
        Asked now and then; when it is true what is known so far is returned.

    Raises
    ------
    AnalysisError
        A motion that stands still.

    Examples
    --------
    >>> from vinesexp import NES, Oscillator
    >>> rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.03, r=0.6)])
    >>> base = Harmonic(amplitude=0.25e-3, frequency=7.862)
    >>> found = amplitudes(np.array([
    ...     row_of(rig, base, Release(y0=[y0]), settle=40.0, duration=60.0)
    ...     for y0 in (0.0299, 0.0)
    ... ]))
    >>> (1e3 * found.mean).round(1)  # a ball mid-cavity is never touched
    array([ 5.9, 19.2])
    """
    from vinesexp.solver.lanes import (
        LANES,
        MOST,
        O_HITS,
        O_LARGEST,
        O_LATEST,
        O_STALLED,
        O_SUM,
        O_TIME,
        RESULTS,
        ROWS,
        run_lanes,
    )
    from vinesexp.solver.response import ENTRIES, HEADER, WIDTH
    from vinesexp.solver.series import ORDER

    found, progress = np.zeros((len(rows), RESULTS)), np.zeros(3, dtype=np.int32)
    lanes, work = np.zeros((2, ROWS * LANES)), np.zeros((4, ORDER + 1))
    tables = np.zeros((min(MOST, len(rows)), HEADER + WIDTH * ENTRIES))
    while progress[1] < len(rows) and not stop():
        run_lanes(rows, lanes, tables, found, progress, work, PASSES)
    if found[:, O_STALLED].any():
        raise _stalled(rows[int(found[:, O_STALLED].argmax())])
    with np.errstate(invalid="ignore"):
        mean = found[:, O_SUM] / found[:, O_TIME]
    return Amplitudes(mean, found[:, O_LARGEST], found[:, O_HITS], found[:, O_LATEST])


def _stalled(row: FloatArray) -> Exception:
    from vinesexp.rig import NES, Oscillator

    M, c1, k1, G, f, phase, m, b, r = (float(value) for value in row[:9])
    rig = Rig(Oscillator(M=M, c1=c1, k1=k1), nes=[NES(m=m, b=b, r=r)])
    return Effort(rig, Harmonic(G, f, phase), WeakDamping(), float(row[-1])).stalled(0.0)
