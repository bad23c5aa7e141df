"""Many motions one after the other: rigs with several balls, or a heavy one.

Each is that of the scalar loop (`kernel.py`), whose log is emptied into the statistics of the
amplitude whenever it is full: a motion kept as a whole takes longer to make than to compute.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.solver.arrays import has_closed_form
from vinesexp.solver.compiled import apart, entry
from vinesexp.solver.contact import REMAINDER
from vinesexp.solver.effort import STALL, stalled_run
from vinesexp.solver.kernel import run_on
from vinesexp.solver.lanes import (
    O_SPENT,
    O_STALLED,
    RESULTS,
    Amplitudes,
    amplitudes_from,
    sum_amplitudes,
)
from vinesexp.solver.response import ENTRIES, H_RATE, HEADER, WIDTH, prepare_into
from vinesexp.solver.series import ORDER
from vinesexp.solver.state import (
    ALLOWANCE,
    CLEARANCE,
    COLUMNS,
    LOG_COLUMNS,
    MASS,
    RESTITUTION,
    T_HIGH,
    V_NOW,
    WORK,
    X_NOW,
    IntArray,
)

# Columns of a run.
R_M, R_C, R_K, R_G, R_F, R_PHASE, R_X0, R_V0, R_SETTLE, R_DURATION = range(10)
#: Rows of the log: with all else that the loop reads they stay near the processor.
LOG = 256


@apart
def begin(
    run: FloatArray, start: FloatArray, response: FloatArray, par: FloatArray, table: FloatArray,
    balls: FloatArray, scratch: FloatArray,
) -> None:  # fmt: skip
    """Put a run into the arrays of the loop."""
    prepare_into(response, run[R_M], run[R_C], run[R_K], run[R_G], run[R_F], run[R_PHASE])
    par[0], par[1], par[2] = run[R_M], run[R_C], run[R_K]
    table[0, 1], table[0, 2], table[0, 3] = run[R_G], run[R_PHASE], 2.0 * math.pi * run[R_F]
    for i in range(scratch.shape[0]):
        for k in range(scratch.shape[1]):
            scratch[i, k] = 0.0
    state, node, shares = scratch[0], scratch[1], scratch[3]
    state[X_NOW], state[V_NOW], node[1], node[2] = run[R_X0], run[R_V0], run[R_X0], run[R_V0]
    for i in range(balls.shape[0]):
        for k in range(balls.shape[1]):
            balls[i, k] = start[i, k]
        shares[i] = start[i, MASS] / run[R_M]


@entry
def go_through(
    runs: FloatArray, starts: FloatArray, closed: BoolArray, remainder: float, found: FloatArray,
    progress: IntArray, response: FloatArray, par: FloatArray, table: FloatArray,
    balls: FloatArray, numbers: FloatArray, labels: IntArray, work: FloatArray,
    scratch: FloatArray, weak: FloatArray | None,
) -> None:  # fmt: skip
    """Every row of `runs`, or as far as ALLOWANCE evaluations come.

    `progress` says how many are done, and whether the next one has begun; `found` (runs, RESULTS).
    The rest is scratch space.
    """
    state, node, sums, shares, spent = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4]
    all_spent = 0
    while progress[0] < runs.shape[0] and all_spent < ALLOWANCE:
        k = progress[0]
        run, duration = runs[k], runs[k, R_DURATION]
        if progress[1] == 0:
            begin(run, starts[k], response, par, table, balls, scratch)
            progress[1] = 1
        row, used = run_on(
            closed[k], response, par, 0, table, duration, remainder, state, balls, numbers, labels,
            work, weak,
        )  # fmt: skip
        sum_amplitudes(response, numbers, labels, row, state, node, shares, run[R_SETTLE], sums)
        all_spent += used
        spent[0] += used
        spent[2] += used
        if (state[T_HIGH] - spent[1]) * response[H_RATE] > 1.0:
            spent[0], spent[1] = 0.0, state[T_HIGH]
        stalled = spent[0] > STALL
        if stalled or state[T_HIGH] >= duration:
            for j in range(5):
                found[k, j] = sums[j]
            found[k, O_STALLED], found[k, O_SPENT] = 1.0 if stalled else 0.0, spent[2]
            progress[0], progress[1] = k + 1, 0


def amplitudes_in_turn(
    runs: FloatArray, starts: FloatArray, *, remainder: float | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> Amplitudes:  # fmt: skip
    """Mean and largest amplitude of every run of a plain rig, from its `settle` to its `duration`.

    Parameters
    ----------
    runs : ndarray of shape (runs, 10)
        M, c1, k1; amplitude, frequency, phase of the base; x0, v0; settle, duration. SI.
    starts : ndarray of shape (runs, balls, COLUMNS)
        The balls as they start (`arrays.balls_at`).
    remainder : float, optional
        rad from which on the rest of a chatter is summed (`simulate`).
    stop : callable, optional
        Asked now and then; when it is true what is known so far is returned.

    Raises
    ------
    AnalysisError
        A motion that stands still.

    Examples
    --------
    >>> from vinesexp.solver.arrays import balls_at
    >>> run = [4.7, 3.02, 1.147e4, 0.25e-3, 7.862, 0.0, 0.0, 0.0, 40.0, 60.0]
    >>> balls = balls_at(m=np.full((1, 2), 0.016), b=0.03, r=0.6, gap=0.0, side=-1.0, v=0.0)
    >>> found = amplitudes_in_turn(np.array([run]), balls)
    >>> round(1e3 * float(found.mean[0]), 1)  # two balls of half the mass do what one does
    5.9
    """
    found = np.zeros((len(runs), RESULTS))
    M, c1, k1, G, f, *_, duration = runs.T
    w0 = np.sqrt(k1 / M)
    closed = has_closed_form(w0, 0.5 * c1 / (M * w0), 2.0 * math.pi * f, G > 0.0)
    heavy = (starts[:, :, MASS] > M[:, np.newaxis]).any(axis=1)
    limit = REMAINDER if remainder is None else remainder
    for which in (heavy, ~heavy):
        some = np.flatnonzero(which)
        out, progress = np.zeros((some.size, RESULTS)), np.zeros(2, dtype=np.int32)
        n, work = starts.shape[1], np.zeros((WORK, ORDER + 1))
        room = LOG + 8 * n
        scratch = (
            np.zeros(HEADER + WIDTH * ENTRIES), np.zeros(6), np.zeros((1, 5)),
            np.zeros((n, COLUMNS)), np.zeros((room, LOG_COLUMNS)),
            np.zeros((room, 3), dtype=np.int32), work, np.zeros((5, max(n, 5))),
            work[2] if which is heavy else None,
        )  # fmt: skip
        while progress[0] < some.size and not stop():
            go_through(runs[some], starts[some], closed[some], limit, out, progress, *scratch)
        found[some] = out
    if found[:, O_STALLED].any():
        k = int(found[:, O_STALLED].argmax())
        raise stalled_run(runs[k, :6], starts[k][:, [MASS, CLEARANCE, RESTITUTION]], duration[k])
    return amplitudes_from(found)
