"""Many motions one after the other: rigs with several balls, or a heavy one.

Each is that of the scalar loop (`kernel.py`), whose log is emptied into the statistics of the
amplitude whenever it is full: a motion kept as a whole takes longer to make than to compute. A loop
over runs that is compiled as well would hold the scalar loop once more, in both of its forms.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.solver.arrays import has_closed_form
from vinesexp.solver.compiled import entry
from vinesexp.solver.contact import REMAINDER
from vinesexp.solver.effort import STALL, stalled_run
from vinesexp.solver.kernel import run
from vinesexp.solver.lanes import O_SPENT, RESULTS, Amplitudes, amplitudes_from, sum_amplitudes
from vinesexp.solver.response import ENTRIES, H_RATE, HEADER, WIDTH, fill_in
from vinesexp.solver.series import ORDER
from vinesexp.solver.state import CHIRP, MASS, T_HIGH, WORK, Given, Log, empty_log

#: Rows of the log: with all else that the loop reads they stay near the processor.
LOG = 256


@entry
def add_amplitudes(
    response: FloatArray, log: Log, state: FloatArray, node: FloatArray, shares: FloatArray,
    settle: float, sums: FloatArray,
) -> None:  # fmt: skip
    """`lanes.sum_amplitudes`, for Python."""
    sum_amplitudes(response, log, state, node, shares, settle, sums)


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
    found, n = np.zeros((len(runs), RESULTS)), starts.shape[1]
    mass, damping, stiffness, level, frequency, *_ = runs.T
    w0 = np.sqrt(stiffness / mass)
    zeta, rate = 0.5 * damping / (mass * w0), 2.0 * math.pi * frequency
    closed = has_closed_form(w0, zeta, rate, level > 0.0)
    heavy = (starts[:, :, MASS] > mass[:, np.newaxis]).any(axis=1)
    response, par, table = np.zeros(HEADER + WIDTH * ENTRIES), np.zeros(6), np.zeros((1, 5))
    log = empty_log(LOG + 8 * n)
    limit, work = REMAINDER if remainder is None else remainder, np.zeros((WORK, ORDER + 1))
    for k, (M, c1, k1, G, f, phase, x0, v0, settle, duration) in enumerate(runs.tolist()):
        fill_in(response, M, c1, k1, G, f, phase)
        par[:3], table[0, 1:4] = (M, c1, k1), (G, phase, math.tau * f)
        given = Given(response, par, CHIRP, table, duration, limit)
        weak = work[2] if heavy[k] else None
        state, node = np.array([0.0, 0.0, x0, v0, 0.0]), np.array([0.0, x0, v0, 0.0])
        sums = np.zeros(5)
        balls, shares = starts[k].copy(), starts[k, :, MASS] / M
        spent, all_spent, since = 0, 0, 0.0
        while state[T_HIGH] < duration:
            if stop():
                return amplitudes_from(found)
            used = run(given, bool(closed[k]), state, balls, log, work, weak)
            add_amplitudes(response, log, state, node, shares, settle, sums)
            spent, all_spent = spent + used, all_spent + used
            if (state[T_HIGH] - since) * response[H_RATE] > 1.0:
                spent, since = 0, state[T_HIGH]
            if spent > STALL:
                raise stalled_run(runs[k], starts[k])
        found[k, : sums.size], found[k, O_SPENT] = sums, all_spent
    return amplitudes_from(found)
