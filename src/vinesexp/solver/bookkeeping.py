"""The clock of a run and the rows of its log (`state.py`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vinesexp.solver.compiled import compiled
from vinesexp.solver.state import T_HIGH, T_LOW

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]


@compiled
def advance_clock(state: FloatArray, s: float) -> None:
    """Add s to the time, keeping what rounding would drop."""
    s += state[T_LOW]
    total = state[T_HIGH] + s
    state[T_LOW] = s - (total - state[T_HIGH])
    state[T_HIGH] = total


@compiled
def write_event(
    numbers: FloatArray, labels: IntArray, row: int, nes: int, side: float, t: float,
    x: float, v: float, v_after: float, vy: float, vy_after: float,
) -> int:  # fmt: skip
    """Put one row in the log, all but its kind; the number of rows."""
    labels[row, 1] = nes
    labels[row, 2] = int(side)
    numbers[row, 0] = t
    numbers[row, 1] = x
    numbers[row, 2] = v
    numbers[row, 3] = v_after
    numbers[row, 4] = vy
    numbers[row, 5] = vy_after
    return row + 1
