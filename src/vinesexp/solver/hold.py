"""Who is held now: the decision before each segment of a rig that rubs, and its rows in the log."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vinesexp.solver.bookkeeping import write_event
from vinesexp.solver.compiled import compiled
from vinesexp.solver.nonlinear import is_at_rest, spring_force
from vinesexp.solver.search import EPS
from vinesexp.solver.series import P_C, P_COULOMB, P_K, P_M, P_QUADRATIC
from vinesexp.solver.state import (
    B_PLUS,
    CLEARANCE,
    FREE,
    L_A,
    L_APART,
    L_FORCE,
    L_MASS,
    MASS,
    REST_END,
    REST_START,
    RESTING,
    RHO,
    RUB,
    SIDE,
    SLIDE,
    STATE,
    STUCK,
    T_HIGH,
    TILT,
    UNSET,
    V_NOW,
    WAY,
    X_NOW,
    A,
    D,
    U,
)
from vinesexp.solver.stickslip import acceleration, bounds, is_held, loads, may_hold

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]


@compiled
def write(
    balls: FloatArray, i: int, what: int, state: FloatArray, numbers: FloatArray,
    labels: IntArray, row: int,
) -> int:  # fmt: skip
    """A row about ball i at this instant, all but what `complete` knows; number of rows."""
    side = balls[i, SIDE] if balls[i, D] <= 0.0 else 0.0
    v, vy = state[V_NOW], state[V_NOW] - balls[i, RHO]
    labels[row, 0] = what
    return write_event(numbers, labels, row, i, side, state[T_HIGH], state[X_NOW], v, v, vy, vy)


@compiled
def complete(
    balls: FloatArray, M: float, numbers: FloatArray, labels: IntArray, first: int, end: int
) -> None:
    """Fill in, in rows first to end, where their balls are and what acts after the event."""
    force, held = loads(balls)
    for row in range(first, end):
        i = labels[row, 1]
        minus = 2.0 * balls[i, CLEARANCE] - balls[i, B_PLUS]
        apart = balls[i, B_PLUS] - balls[i, D] if balls[i, SIDE] > 0.0 else balls[i, D] - minus
        numbers[row, L_APART], numbers[row, L_A] = apart, balls[i, A]
        numbers[row, L_FORCE], numbers[row, L_MASS] = force, M + held


@compiled
def free_acceleration(
    par: FloatArray, balls: FloatArray, x: float, v: float, E: FloatArray, X: FloatArray
) -> float:
    """x'' now, with all that may be held held or giving way."""
    X[0], X[1] = x, v
    z1, force = v - E[1], spring_force(par, E, X)
    force -= z1 * (par[P_C] + par[P_QUADRATIC] * abs(z1))
    for i in range(balls.shape[0]):
        if not may_hold(balls, i):
            force -= balls[i, MASS] * balls[i, RUB] * balls[i, WAY]
    if not is_at_rest(par, par[P_M], E, X):
        force -= math.copysign(par[P_COULOMB], z1) if par[P_COULOMB] != 0.0 else 0.0
        a: float = acceleration(balls, par[P_M], force)
        return a
    # Held to the base if friction suffices for that, else it slips to the side of the force.
    low: float = acceleration(balls, par[P_M], force - par[P_COULOMB])
    high: float = acceleration(balls, par[P_M], force + par[P_COULOMB])
    held: float = min(max(2.0 * E[2], low), high)
    return held


@compiled
def decide(
    par: FloatArray, state: FloatArray, balls: FloatArray, E: FloatArray, X: FloatArray,
    numbers: FloatArray, labels: IntArray, row: int,
) -> int:  # fmt: skip
    """Settle who is held and which way friction acts; what has changed is logged."""
    n, v, waiting = balls.shape[0], state[V_NOW], False
    for i in range(n):
        waiting = waiting or may_hold(balls, i)
        if balls[i, STATE] == FREE and (balls[i, RHO] != 0.0 or balls[i, WAY] == UNSET):
            way = math.copysign(1.0, balls[i, RHO])
            if way != balls[i, WAY] and not may_hold(balls, i):
                new = balls[i, WAY] == UNSET or balls[i, RUB] != 0.0
                balls[i, WAY] = way
                if new:
                    row = write(balls, i, SLIDE, state, numbers, labels, row)
    if not waiting:
        return row
    a = free_acceleration(par, balls, state[X_NOW], v, E, X)
    noise = par[P_K] * (abs(E[0]) + abs(state[X_NOW])) + par[P_C] * (abs(E[1]) + abs(v))
    for i in range(n):
        if not may_hold(balls, i):
            continue
        low, high = bounds(balls, i)
        p, was = a - balls[i, TILT], is_held(balls, i)
        slack = 4.0 * EPS * (noise / par[P_M] + abs(balls[i, TILT]) + balls[i, RUB])
        if low - slack <= p <= high + slack:
            balls[i, STATE] = RESTING if balls[i, D] <= 0.0 else STUCK
            balls[i, RHO], balls[i, WAY] = 0.0, 0.0
            if not was:
                row = write(balls, i, REST_START, state, numbers, labels, row)
        else:
            way = math.copysign(1.0, p)
            if was or way != balls[i, WAY]:
                kind = REST_END if was else SLIDE
                row = write(balls, i, kind, state, numbers, labels, row)
            balls[i, STATE], balls[i, U], balls[i, WAY] = FREE, v, way
    return row
