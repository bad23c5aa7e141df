"""Mean and largest amplitude of a motion from its log, in closed form between the events."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import compiled, entry
from vinesexp.solver.fused import fused
from vinesexp.solver.response import H_RATE, H_W, H_W0SQ, after, phasor
from vinesexp.solver.state import IMPACT, REST_END, REST_START

IntArray = NDArray[np.int32]

#: Samples of the amplitude a cycle. No even number: half a cycle, the flight of a ball with two
#: impacts a cycle, would be a whole number of them, and its contact would fall on a sample.
PER_CYCLE = 9
REBASE = PER_CYCLE  # pieces: at most two cycles of the base, within the table of the closed form


@compiled
def sum_amplitudes(
    response: FloatArray, numbers: FloatArray, labels: IntArray, rows: int, state: FloatArray,
    node: FloatArray, settle: float, sums: FloatArray,
) -> None:  # fmt: skip
    """Add a stretch of motion to `sums`: time, integral of A, largest A, impacts, the last one (s).

    A = hypot(x, x'/w0). `node` (t, x, v, balls at rest) is where the last stretch ended; the log
    rows and then `state` carry it on. From `settle` on, A is taken every `spacing_of` seconds after
    an event, and at the ends of the spells in which a ball rests (the closed form is that of the
    bare oscillator).
    """
    w0, w = math.sqrt(response[H_W0SQ]), response[H_W]
    h = spacing_of(response)
    # Turned from event to event: what rounding gathers over one log is far below any use of it.
    cr, ci, known = 0.0, 0.0, False
    old = amplitude(node[1], node[2], 1.0 / w0)
    for row in range(rows + 1):
        last = row == rows
        t1 = state[0] if last else numbers[row, 0]
        x1, v1 = (state[2], state[3]) if last else (numbers[row, 1], numbers[row, 2])
        if t1 > node[0]:
            pieces = 1 if node[3] > 0.0 else max(math.ceil((t1 - node[0]) / h), 1)
            counts = t1 > settle
            if pieces > 1 and counts and not known:
                cr, ci = phasor(response, node[0], 0.0)
            known = pieces > 1 and counts
            xh, vh, done = node[1] - cr, node[2] + w * ci, 0
            for i in range(1, pieces + 1):
                if not counts and i < pieces:
                    continue
                step = h if i < pieces else (t1 - node[0]) - (i - 1) * h
                new = amplitude(x1, v1, 1.0 / w0)
                if known:
                    # Each from the same place: they do not wait for one another.
                    re, im, x, v = after(response, cr, ci, xh, vh, (i - 1 - done) * h + step)
                    if i - done == REBASE or i == pieces:
                        cr, ci, xh, vh, done = re, im, x, v, i
                    if i < pieces:
                        new = amplitude(re + x, v - w * im, 1.0 / w0)
                if node[0] + (i - 1) * h >= settle:
                    sums[0] += step
                    sums[1] += 0.5 * step * (old + new)
                    sums[2] = max(sums[2], new)
                old = new
        if last:
            node[0], node[1], node[2] = t1, x1, v1
            break
        node[0], node[1], node[2] = t1, x1, numbers[row, 3]
        old = amplitude(x1, numbers[row, 3], 1.0 / w0)
        if labels[row, 0] == IMPACT and t1 >= settle:
            sums[3] += 1.0
            sums[4] = t1
        elif labels[row, 0] == REST_START:
            node[3] += 1.0
        elif labels[row, 0] == REST_END:
            node[3] -= 1.0


@entry
def add_amplitudes(
    response: FloatArray, numbers: FloatArray, labels: IntArray, rows: int, state: FloatArray,
    node: FloatArray, settle: float, sums: FloatArray,
) -> None:  # fmt: skip
    """`sum_amplitudes`, for Python."""
    sum_amplitudes(response, numbers, labels, rows, state, node, settle, sums)


@compiled
def spacing_of(response: FloatArray) -> float:
    """Between two samples of the amplitude, s: by the cycle of oscillator or base, the faster."""
    return float(2.0 * math.pi / (PER_CYCLE * response[H_RATE]))


@compiled
def amplitude(x: float, v: float, per_w0: float) -> float:
    """hypot(x, x'/w0), m."""
    return math.sqrt(fused(x, x, (v * per_w0) * (v * per_w0)))
