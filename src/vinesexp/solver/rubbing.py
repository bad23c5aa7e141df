"""Event loop of rigs that are not plain: friction, tilt, r by wall and speed, a spring or damper
that is not linear.

One turn is that of `events.py` with more events: a ball that slides comes to rest on its floor
(`stickslip.next_stop`), a held ball slips (`next_slip`). A segment lasts to the first of them, so
every ball has one constant acceleration in it, and its gap is a power series whose first root is
found by steps that cannot pass it (`search.py`): no impact is missed. Before each segment
`decide` settles who is held.

It is compiled of its own, when it is first asked for: the plain rig pays nothing for it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vinesexp.solver.bookkeeping import advance_clock
from vinesexp.solver.compiled import compiled, entry
from vinesexp.solver.contact import closing_now
from vinesexp.solver.events import collide
from vinesexp.solver.hold import complete, decide, write
from vinesexp.solver.nonlinear import expand_loaded
from vinesexp.solver.rubchatter import close_rubbing_chatter, set_restitution
from vinesexp.solver.search import EPS, first_root
from vinesexp.solver.series import (
    P_C,
    P_K,
    P_M,
    expand_base,
    own_rate,
    piece_at,
    slope,
    value,
)
from vinesexp.solver.state import (
    ALLOWANCE,
    CLEARANCE,
    FREE,
    HIT,
    RELEASED,
    REST_END,
    REST_START,
    RHO,
    ROOT,
    RUB,
    SIDE,
    STATE,
    STUCK,
    T_HIGH,
    T_LOW,
    TURN,
    V_NOW,
    WALL,
    WAY,
    X_NOW,
    A,
    D,
    U,
)
from vinesexp.solver.stickslip import is_held, loads, next_slip, next_stop

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]


@compiled
def collide_rubbing(
    balls: FloatArray, M: float, state: FloatArray, numbers: FloatArray, labels: IntArray, row: int,
    before: FloatArray,
) -> int:  # fmt: skip
    """`events.collide`: r of the wall and the speed; no friction holds a ball in an impact."""
    for i in range(balls.shape[0]):
        if balls[i, HIT] == 1.0:
            set_restitution(balls, i, balls[i, RHO])
        elif balls[i, STATE] == STUCK:
            row = write(balls, i, REST_END, state, numbers, labels, row)
            balls[i, STATE], balls[i, U] = FREE, state[V_NOW]
        elif balls[i, STATE] == RELEASED:
            balls[i, STATE] = FREE
    return collide(balls, M, state, numbers, labels, row, before)


@compiled
def next_hit(balls: FloatArray, X: FloatArray, P: FloatArray, limit: float) -> float:
    """First contact of any ball in (0, limit]; ROOT and WALL of each ball that has one."""
    first, top = math.inf, X.shape[0] - 1
    for i in range(balls.shape[0]):
        if is_held(balls, i):
            continue
        side = balls[i, SIDE]
        for n in range(2, top + 1):
            P[n] = -side * X[n]
        P[0], P[1] = balls[i, D], -side * balls[i, RHO]
        P[2] += 0.5 * side * balls[i, A]
        lead = 0
        if balls[i, STATE] == RELEASED:  # x' - y' and x'' - y'' are zero by definition
            P[1] = P[2] = 0.0
            lead = 3 if balls[i, D] <= 0.0 else 0
        root, wall = first_root(P, lead, limit), side
        for n in range(top + 1):
            P[n] = -P[n]
        P[0] += 2.0 * balls[i, CLEARANCE]
        other = first_root(P, 0, min(root, limit))
        if other < root:
            root, wall = other, -side
        balls[i, ROOT], balls[i, WALL] = root, wall
        first = min(first, root)
    return first


@compiled
def move_rubbing(balls: FloatArray, X: FloatArray, state: FloatArray, s: float) -> float:
    """Carry clock, oscillator and balls s seconds on; until when what happens is one event."""
    advance_clock(state, s)
    state[X_NOW], state[V_NOW] = value(X, s, 0), slope(X, s, 1)
    bend, gain = value(X, s, 2), slope(X, s, 2)  # x - x0 - v0 s and v - v0, without subtraction
    tie: float = s + max(4.0 * EPS * s, 0.5 * EPS * state[T_HIGH])
    for i in range(balls.shape[0]):
        if is_held(balls, i):
            continue
        drift = balls[i, A] * s
        balls[i, U] += drift
        if balls[i, STATE] == RELEASED:
            gap = balls[i, D] - balls[i, SIDE] * value(X, s, 3)
            balls[i, RHO] = slope(X, s, 3)
        else:
            way = balls[i, RHO] * s + bend - 0.5 * drift * s
            gap = balls[i, D] - balls[i, SIDE] * way
            # Where x' and y' differ by more than rounding, their difference carries no drift.
            apart = state[V_NOW] - balls[i, U]
            clear = abs(apart) > 0.25 * (abs(state[V_NOW]) + abs(balls[i, U]))
            balls[i, RHO] = apart if clear else balls[i, RHO] + (gain - drift)
        if s > 0.0:
            balls[i, STATE] = FREE
            # A ball that slides changes its direction through rest only.
            turned = balls[i, TURN] <= tie or balls[i, WAY] * balls[i, RHO] <= 0.0
            if balls[i, RUB] > 0.0 and turned:
                balls[i, RHO] = 0.0
        if balls[i, ROOT] <= tie:
            balls[i, SIDE], gap = balls[i, WALL], 0.0
        balls[i, D] = max(gap, 0.0)
    return tie


@compiled
def slip(
    balls: FloatArray, state: FloatArray, tie: float, numbers: FloatArray, labels: IntArray,
    row: int,
) -> int:  # fmt: skip
    """Let the held balls go that have reached a bound."""
    for i in range(balls.shape[0]):
        if is_held(balls, i) and balls[i, ROOT] <= tie:
            row = write(balls, i, REST_END, state, numbers, labels, row)
            balls[i, STATE], balls[i, WAY] = RELEASED, balls[i, WALL]
            balls[i, U] = state[V_NOW]
    return row


@compiled
def rub(
    par: FloatArray, kind: int, table: FloatArray, piece: int, duration: float, remainder: float,
    state: FloatArray, balls: FloatArray, numbers: FloatArray, labels: IntArray, first: int,
    work: FloatArray, before: FloatArray,
) -> int:  # fmt: skip
    """One turn of the loop: up to the next event, or as far as the series holds; rows written."""
    E, X, P, row = work[0], work[1], work[2], first
    if closing_now(balls, state[V_NOW]) > 0:
        row = collide_rubbing(balls, par[P_M], state, numbers, labels, row, before)
    since = (state[T_HIGH] - table[piece, 0]) + state[T_LOW]
    expand_base(kind, table[piece], since, E)
    row = decide(par, state, balls, E, X, numbers, labels, row)
    if row > first:
        complete(balls, par[P_M], numbers, labels, first, row)
        return row
    force, held = loads(balls)
    mass, x, v = par[P_M] + held, state[X_NOW], state[V_NOW]
    reach = expand_loaded(par, mass, force, kind, table, piece, since, x, v, E, X, P)
    state[V_NOW] = X[1]
    rate = max(own_rate(mass, par[P_C], par[P_K]), 1.0 / duration)
    T, dx, dv = close_rubbing_chatter(balls, mass, rate, 2.0 * X[2], 6.0 * X[3], X[1], remainder)
    if T >= 0.0:  # it may be too short for the clock to show
        advance_clock(state, T)
        state[X_NOW] += dx
        state[V_NOW] += dv
        for i in range(balls.shape[0]):
            if balls[i, HIT] == 1.0:
                row = write(balls, i, REST_START, state, numbers, labels, row)
                balls[i, WAY] = 0.0
        complete(balls, par[P_M], numbers, labels, first, row)
        return row
    # The step ends at the end of the series, of the base's piece or of the run, or at an event.
    step, goal, stop = reach, math.inf, duration
    if piece + 1 < table.shape[0]:
        stop = min(stop, table[piece + 1, 0])
    if (stop - state[T_HIGH]) - state[T_LOW] <= step:
        step, goal = max((stop - state[T_HIGH]) - state[T_LOW], 0.0), stop
    noise = 4.0 * EPS * (par[P_K] * (abs(E[0]) + abs(X[0])) + par[P_C] * (abs(E[1]) + abs(X[1])))
    soon = next_stop(balls, X, P, step)
    soon = min(soon, next_slip(balls, X, P, min(step, soon), noise / mass))
    soon = min(soon, next_hit(balls, X, P, min(step, soon)))
    tie = move_rubbing(balls, X, state, min(soon, step))
    if soon >= step and goal < math.inf:
        state[T_HIGH], state[T_LOW] = goal, 0.0
    row = slip(balls, state, tie, numbers, labels, row)
    complete(balls, par[P_M], numbers, labels, first, row)
    return row


@entry
def run_rubbing(
    par: FloatArray, kind: int, table: FloatArray, duration: float, remainder: float,
    state: FloatArray, balls: FloatArray, numbers: FloatArray, labels: IntArray, work: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """Run to `duration`, until the log is full or ALLOWANCE is used: rows written, turns.

    Resume with the same arrays (`kernel.run`).
    """
    before = np.empty(balls.shape[0])
    return rub_on(
        par, kind, table, duration, remainder, state, balls, numbers, labels, work, before
    )


@compiled
def rub_on(
    par: FloatArray, kind: int, table: FloatArray, duration: float, remainder: float,
    state: FloatArray, balls: FloatArray, numbers: FloatArray, labels: IntArray, work: FloatArray,
    before: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """`run_rubbing`, with its scratch space."""
    row, turns, piece = 0, 0, piece_at(table, state[T_HIGH])
    room = numbers.shape[0] - 4 * balls.shape[0] - 4
    while row < room and state[T_HIGH] < duration and turns < ALLOWANCE:
        while piece + 1 < table.shape[0] and table[piece + 1, 0] <= state[T_HIGH]:
            piece += 1
        turns += 1
        row = rub(
            par, kind, table, piece, duration, remainder, state, balls, numbers, labels, row,
            work, before,
        )  # fmt: skip
    return row, turns
