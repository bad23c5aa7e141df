"""Many motions one after the other: rigs with several balls, or a heavy one.

Each is that of the scalar loop (`kernel.py`), whose log is emptied into the statistics of the
amplitude whenever it is full: a motion kept as a whole takes longer to make than to compute.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.excitation import Harmonic, WeakDamping
from vinesexp.rig import NES, Oscillator, Rig
from vinesexp.solver.arrays import has_closed_form
from vinesexp.solver.compiled import apart, entry
from vinesexp.solver.contact import REMAINDER
from vinesexp.solver.effort import STALL, Effort
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
    B_PLUS,
    CLEARANCE,
    COLUMNS,
    LOG_COLUMNS,
    MASS,
    R_MINUS,
    R_PLUS,
    RESTITUTION,
    RHO,
    SIDE,
    T_HIGH,
    V_NOW,
    WORK,
    X_NOW,
    D,
    IntArray,
    U,
)

# Columns of a run,
R_M, R_C, R_K, R_G, R_F, R_PHASE, R_X0, R_V0, R_SETTLE, R_DURATION = range(10)
# and of each of its balls: half of the way from wall to wall; gap to the wall at the side; y'.
S_M, S_B, S_R, S_GAP, S_SIDE, S_U = range(6)
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
    state, node, sums, shares, spent = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4]
    for k in range(5):
        state[k] = node[k] = sums[k] = spent[k] = 0.0
    state[X_NOW], state[V_NOW], node[1], node[2] = run[R_X0], run[R_V0], run[R_X0], run[R_V0]
    for i in range(balls.shape[0]):
        for k in range(COLUMNS):
            balls[i, k] = 0.0
        shares[i] = start[i, S_M] / run[R_M]
        balls[i, MASS], balls[i, CLEARANCE], balls[i, B_PLUS] = (
            start[i, S_M], start[i, S_B], start[i, S_B],
        )  # fmt: skip
        balls[i, RESTITUTION] = balls[i, R_PLUS] = balls[i, R_MINUS] = start[i, S_R]
        balls[i, D], balls[i, SIDE], balls[i, U] = (
            start[i, S_GAP], start[i, S_SIDE], start[i, S_U],
        )  # fmt: skip
        balls[i, RHO] = run[R_V0] - start[i, S_U]


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
    starts : ndarray of shape (runs, balls, 6)
        m, b, r; gap to the wall on the side (+1, -1); y'. SI.
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
    >>> run = [4.7, 3.02, 1.147e4, 0.25e-3, 7.862, 0.0, 0.0, 0.0, 40.0, 60.0]
    >>> ball = [0.016, 0.03, 0.6, 0.0, -1.0, 0.0]
    >>> found = amplitudes_in_turn(np.array([run]), np.array([[ball, ball]]))
    >>> round(1e3 * float(found.mean[0]), 1)  # two balls of half the mass do what one does
    5.9
    """
    found = np.zeros((len(runs), RESULTS))
    M, c1, k1, G, f, *_ = runs.T
    w0 = np.sqrt(k1 / M)
    closed = has_closed_form(w0, 0.5 * c1 / (M * w0), 2.0 * math.pi * f, G > 0.0)
    heavy = (starts[:, :, S_M] > M[:, np.newaxis]).any(axis=1)
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
        raise _stalled(runs[k], starts[k])
    return amplitudes_from(found)


def _stalled(run: FloatArray, start: FloatArray) -> Exception:
    M, c1, k1, G, f, phase, *_, duration = (float(value) for value in run)
    nes = [NES(m=float(m), b=float(b), r=float(r)) for m, b, r, *_ in start]
    rig = Rig(Oscillator(M=M, c1=c1, k1=k1), nes)
    return Effort(rig, Harmonic(G, f, phase), WeakDamping(), duration).stalled(0.0)
