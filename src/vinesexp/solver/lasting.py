"""Event loop of rigs whose contacts last: a bounded-error scheme.

A contact is solved in closed form for constant approach (`touch`). Its momentum goes over
at one instant, the middle of the force: before and after, oscillator and ball move as if the force
had been spread, and only within the contact their paths are cut short. The error left is that of
the forces that change during a contact; docs/benchmarks/simulation.md has it measured. A ball that
the wall's push would not let go stays on the wall.

Between events everything is exact, as in `rubbing.py`. It is compiled of its own, when it is first
asked for: the plain rig pays nothing for it.

One contact is a linear spring and dashpot in the wall. While ball and wall touch, the overlap z
and its rate obey

    z'' = g - 2 a z' - (wd^2 + a^2) z,        z(0) = 0, z'(0) = rho

with wd = pi/tau and a = -ln(r)/tau, so that a contact without g lasts tau and turns rho into
-r rho. g is the acceleration with which ball and wall approach otherwise, taken as constant over
the contact. The momentum exchanged, and the moment about which it acts, are all that
the motion before and after needs to know.
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.rig import Rig
from vinesexp.solver.compiled import compiled, entry
from vinesexp.solver.nonlinear import expand_loaded
from vinesexp.solver.search import first_root
from vinesexp.solver.series import P_M, expand_base, from_power, piece_at, place_at
from vinesexp.solver.state import (
    ALLOWANCE,
    B_PLUS,
    CLEARANCE,
    IMPACT,
    L_A,
    L_APART,
    L_FORCE,
    L_MASS,
    REST_END,
    REST_START,
    T_HIGH,
    V_NOW,
    X_NOW,
    IntArray,
    U,
    write_event,
)

#: Least restitution: a contact without any rebound would last for ever.
LEAST_R = 1e-3
_HALVINGS = 60


@compiled
def overlap(t: float, rho: float, g: float, a: float, wd: float) -> float:
    """z of the module's equation."""
    still = g / (wd * wd + a * a)
    swing = -still * math.cos(wd * t) + (rho - a * still) / wd * math.sin(wd * t)
    return still + math.exp(-a * t) * swing


@compiled
def overlap_rate(t: float, rho: float, g: float, a: float, wd: float) -> float:
    """z' of the module's equation."""
    swing = rho * math.cos(wd * t) + (g - a * rho) / wd * math.sin(wd * t)
    return math.exp(-a * t) * swing


@compiled
def touch(rho: float, g: float, r: float, tau: float) -> tuple[float, float, float]:
    """How a contact ends.

    Returns
    -------
    duration, centre : float
        s; until the ball leaves, and until the middle of the momentum exchanged. The duration is
        infinite where the wall's push holds the ball: it stays.
    jump : float
        Relative velocity that the contact takes, m/s: momentum over the reduced mass.
    """
    wd, a = math.pi / tau, -math.log(max(r, LEAST_R)) / tau
    first = math.atan2(rho, -(g - a * rho) / wd) / wd  # largest overlap
    low, high = first, first + tau  # the smallest after it
    if overlap(high, rho, g, a, wd) >= 0.0:
        return math.inf, 0.0, rho
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if overlap(middle, rho, g, a, wd) > 0.0:
            low = middle
        else:
            high = middle
    jump = rho + g * high - overlap_rate(high, rho, g, a, wd)
    return high, high - (rho + 0.5 * g * high) * high / jump, jump


# Columns of the table of balls: mass, half width, middle of the cavity, r of either wall and its
# slope, tilt, duration of a contact; place x - y from the middle, its rate; what it does, at which
# wall; times at which a contact's momentum goes over and it ends, and the jump.
M, HALF, MIDDLE, R_UP, R_DOWN, SLOPE, TILT, TAU = range(8)
PLACE, RATE, PHASE, SIDE, CENTRE, END, JUMP = range(8, 15)
COLUMNS = 15
_LEAVES = 1e-9  # m/s
FLYING, TOUCHED, LEAVING, RESTING = 0.0, 1.0, 2.0, 3.0


def lasting_table(
    rig: Rig, balls: FloatArray, *, x0: float, y0: FloatArray, v0: float
) -> FloatArray:
    """Balls of this loop from those of `arrays.ball_table`."""
    table = np.zeros((len(rig.nes), COLUMNS))
    for i, nes in enumerate(rig.nes):
        half, middle = balls[i, CLEARANCE], balls[i, B_PLUS] - balls[i, CLEARANCE]
        table[i, :TAU + 1] = (
            nes.m, half, middle, nes.r, nes.restitution(-1), nes.r_slope, nes.tilt,
            nes.contact_time,
        )  # fmt: skip
        place = x0 - y0[i] - middle
        table[i, PLACE] = min(max(place, -half), half)
        table[i, RATE] = v0 - balls[i, U]
    return table


@compiled
def time_of_next(balls: FloatArray, i: int, X: FloatArray, P: FloatArray, t: float, limit: float
                 ) -> float:  # fmt: skip
    """Time until ball i meets a wall, exchanges its momentum, leaves or is let go; inf: later."""
    top, phase = X.shape[0] - 1, balls[i, PHASE]
    if phase == TOUCHED:
        return float(balls[i, CENTRE] - t)
    if phase == LEAVING:
        return float(balls[i, END] - t)
    if phase == RESTING:
        for n in range(top - 1):
            P[n] = balls[i, SIDE] * (n + 1) * (n + 2) * X[n + 2]
        P[0] -= balls[i, SIDE] * balls[i, TILT]
        P[top - 1] = P[top] = 0.0
        return first_root(P, 0, limit)
    first = math.inf
    for side in (1.0, -1.0):
        for n in range(2, top + 1):
            P[n] = -side * X[n]
        P[0], P[1] = balls[i, HALF] - side * balls[i, PLACE], -side * balls[i, RATE]
        P[2] += 0.5 * side * balls[i, TILT]
        root = first_root(P, 0, limit)
        if root < first:
            first, balls[i, SIDE] = root, side
    return first


@compiled
def carry(balls: FloatArray, X: FloatArray, s: float) -> None:
    """Move all balls s seconds on, beside the oscillator's series."""
    bend, gain = from_power(X, s, 2)
    for i in range(balls.shape[0]):
        if balls[i, PHASE] != RESTING:
            tilt = balls[i, TILT]
            balls[i, PLACE] += balls[i, RATE] * s + bend - 0.5 * tilt * s * s
            balls[i, RATE] += gain - tilt * s


@compiled
def record(
    balls: FloatArray, i: int, kind: int, mass: float, state: FloatArray, v: float, u: float,
    numbers: FloatArray, labels: IntArray, row: int,
) -> int:  # fmt: skip
    """One row of the log: oscillator's velocity `v` and ball's `u` before, now after."""
    held, force = 0.0, 0.0
    for j in range(balls.shape[0]):
        if balls[j, PHASE] == RESTING:
            held += balls[j, M]
            force += balls[j, M] * balls[j, TILT]
    now = state[V_NOW]
    labels[row, 0] = kind
    numbers[row, L_APART] = balls[i, PLACE] + balls[i, MIDDLE]
    numbers[row, L_A] = balls[i, TILT]
    numbers[row, L_FORCE], numbers[row, L_MASS] = force, mass + held
    u_after = now - balls[i, RATE]
    return write_event(
        numbers, labels, row, i, balls[i, SIDE], state[T_HIGH], state[X_NOW], v, now, u, u_after
    )


@compiled
def exchange(
    balls: FloatArray, i: int, mass: float, state: FloatArray, numbers: FloatArray,
    labels: IntArray, row: int,
) -> int:  # fmt: skip
    """Give ball i and the oscillator the momentum of their contact; balls at rest are let go."""
    v, u, m = state[V_NOW], state[V_NOW] - balls[i, RATE], balls[i, M]
    dv = -balls[i, SIDE] * balls[i, JUMP] * m / (m + mass)
    state[V_NOW] = v + dv
    balls[i, RATE] -= balls[i, SIDE] * balls[i, JUMP]
    for j in range(balls.shape[0]):
        if j != i:
            resting = balls[j, PHASE] == RESTING
            balls[j, RATE] = dv if resting else balls[j, RATE] + dv
            if resting:
                balls[j, PHASE] = FLYING
                row = record(balls, j, REST_END, mass, state, v, v, numbers, labels, row)
    return record(balls, i, IMPACT, mass, state, v, u, numbers, labels, row)


@compiled
def begin(
    balls: FloatArray, i: int, mass: float, bend: float, state: FloatArray, numbers: FloatArray,
    labels: IntArray, row: int,
) -> int:  # fmt: skip
    """Ball i has met its wall: solve the contact, or let it stay."""
    side = balls[i, SIDE]
    rho = max(side * balls[i, RATE], 0.0)
    r = (balls[i, R_UP] if side > 0.0 else balls[i, R_DOWN]) + balls[i, SLOPE] * rho
    push = side * (bend - balls[i, TILT])
    duration, centre, jump = touch(rho, push, min(max(r, 0.0), 1.0), balls[i, TAU])
    balls[i, PLACE], balls[i, JUMP] = side * balls[i, HALF], jump
    if duration < math.inf:
        balls[i, CENTRE], balls[i, END] = state[T_HIGH] + centre, state[T_HIGH] + duration
        balls[i, PHASE] = TOUCHED
        return row
    if rho > 0.0:
        row = exchange(balls, i, mass, state, numbers, labels, row)
    balls[i, RATE], balls[i, PHASE] = 0.0, RESTING
    v = state[V_NOW]
    return record(balls, i, REST_START, mass, state, v, v, numbers, labels, row)


@compiled
def turn_in_contact(
    par: FloatArray, kind: int, table: FloatArray, duration: float, state: FloatArray,
    balls: FloatArray, numbers: FloatArray, labels: IntArray, row: int, work: FloatArray,
) -> int:  # fmt: skip
    """One turn of the loop: up to the next event, or as far as the series holds; rows written."""
    E, X, P = work[0], work[1], work[2]
    t, mass, force = state[T_HIGH], par[P_M], 0.0
    for i in range(balls.shape[0]):
        if balls[i, PHASE] == RESTING:
            mass += balls[i, M]
            force += balls[i, M] * balls[i, TILT]
    piece = piece_at(table, t)
    since = t - table[piece, 0]
    rate = expand_base(kind, table[piece], since, E)
    step = expand_loaded(par, mass, force, rate, state[X_NOW], state[V_NOW], E, X, P, work[3])
    stop = duration
    if piece + 1 < table.shape[0]:
        stop = min(stop, table[piece + 1, 0])
    ends = stop - t <= step
    step, which = min(step, stop - t), -1
    for i in range(balls.shape[0]):
        own = time_of_next(balls, i, X, P, t, step)
        if own < step or (own == step and which < 0):
            step, which = max(own, 0.0), i
    carry(balls, X, step)
    state[X_NOW], state[V_NOW], bend = place_at(X, step)
    state[T_HIGH] = stop if ends and which < 0 else t + step
    if which < 0:
        return row
    v = state[V_NOW]
    if balls[which, PHASE] == FLYING:
        return begin(balls, which, par[P_M], bend, state, numbers, labels, row)
    if balls[which, PHASE] == TOUCHED:
        balls[which, PHASE] = LEAVING
        return exchange(balls, which, par[P_M], state, numbers, labels, row)
    balls[which, PLACE] = balls[which, SIDE] * balls[which, HALF]
    if balls[which, PHASE] == RESTING:
        # It leaves by a nanometre a second, so that it is not met again at once.
        balls[which, RATE], balls[which, PHASE] = -balls[which, SIDE] * _LEAVES, FLYING
        return record(balls, which, REST_END, par[P_M], state, v, v, numbers, labels, row)
    balls[which, PHASE] = FLYING
    return row


@entry
def run_lasting(
    par: FloatArray, kind: int, table: FloatArray, duration: float, state: FloatArray,
    balls: FloatArray, numbers: FloatArray, labels: IntArray, work: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """Run to `duration`, until the log is full or ALLOWANCE is used: rows written, turns."""
    return go_on(par, kind, table, duration, state, balls, numbers, labels, work)


@compiled
def go_on(
    par: FloatArray, kind: int, table: FloatArray, duration: float, state: FloatArray,
    balls: FloatArray, numbers: FloatArray, labels: IntArray, work: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """`run_lasting`, without the counting of references that an entry has."""
    row, turns, room = 0, 0, numbers.shape[0] - 4 * balls.shape[0] - 4
    while state[T_HIGH] < duration and row < room and turns < ALLOWANCE:
        row = turn_in_contact(par, kind, table, duration, state, balls, numbers, labels, row, work)
        turns += 1
    return row, turns
