"""Event loop on power series: a linear oscillator, any base motion, any number of balls.

State between events: time as a sum of two floats (so that 1e7 flights add up without drift), x, v
and the table of balls (`state.py`). One turn of the loop expands the motion at the present state
(`series.py`), finds the first contact or release on the segment (`search.py`), moves everything
there and carries out what happens (`contact.py`).
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import apart, compiled, entry, fused
from vinesexp.solver.contact import (
    close_chatter,
    closing_now,
    impact,
    release,
    resting_mass,
    settle,
)
from vinesexp.solver.flight import expect
from vinesexp.solver.search import EPS, clear_between, first_root, most_of_fourth
from vinesexp.solver.series import (
    P_C,
    P_K,
    P_M,
    expand,
    from_power,
    own_rate,
    piece_at,
    place_at,
)
from vinesexp.solver.state import (
    ALLOWANCE,
    CLEARANCE,
    FREE,
    HIT,
    IMPACT,
    LEFT,
    MASS,
    RELEASED,
    REST_END,
    REST_START,
    RESTING,
    RESTITUTION,
    RHO,
    ROOT,
    RUB,
    SIDE,
    STATE,
    STUCK,
    T_HIGH,
    T_LOW,
    TOUCHED,
    TURN,
    V_NOW,
    WALL,
    WAY,
    X_NOW,
    A,
    D,
    IntArray,
    U,
    advance_clock,
    carry,
    write_event,
)


@compiled
def is_held(balls: FloatArray, i: int) -> bool:
    """Whether the ball moves with the oscillator."""
    held: bool = balls[i, STATE] == RESTING or balls[i, STATE] == STUCK
    return held


@compiled
def next_hit(
    balls: FloatArray, X: FloatArray, P: FloatArray, limit: float, h: float, bend: float,
    gain: float,
) -> float:  # fmt: skip
    """First contact of any ball in (0, limit], or stage of one that lasts; ROOT and WALL of each.

    `bend` and `gain` are x - x0 - v0 h and v - v0 after h seconds, h >= `limit`.
    """
    first, S = math.inf, most_of_fourth(X, 0, h)
    for i in range(balls.shape[0]):
        if is_held(balls, i):
            continue
        balls[i, ROOT] = math.inf
        if balls[i, STATE] >= TOUCHED:
            balls[i, ROOT] = balls[i, LEFT]
        else:
            search_walls(balls, i, X, P, limit, h, bend, gain, S)
        first = min(first, balls[i, ROOT])
    return first


@compiled
def search_walls(
    balls: FloatArray, i: int, X: FloatArray, P: FloatArray, limit: float, h: float, bend: float,
    gain: float, S: float,
) -> None:  # fmt: skip
    """First contact of ball i in (0, limit] with either wall, into ROOT and WALL.

    From both ends of the h seconds alone it mostly shows that a wall is out of reach.
    """
    side, d, r, full = balls[i, SIDE], balls[i, D], balls[i, RHO], 2.0 * balls[i, CLEARANCE]
    drift = balls[i, A] * h
    g, rate = d - side * (r * h + (bend - 0.5 * drift * h)), side * (r + (gain - drift))
    for wall in (side, -side):
        z = wall * side
        if wall != side:
            d, g = full - d, full - g
        free = balls[i, STATE] == FREE and g > 0.0
        if free and clear_between(d, -wall * r, g, -z * rate, h, S):
            continue
        for n in range(2, X.shape[0]):
            P[n] = -wall * X[n]
        P[0], P[1], lead = d, -wall * r, 0
        P[2] += 0.5 * wall * balls[i, A]
        if balls[i, STATE] == RELEASED:  # x' - y' and x'' - y'' are zero by definition
            P[1] = P[2] = 0.0
            lead = 3 if d <= 0.0 else 0
        root = first_root(P, lead, min(limit, balls[i, ROOT]))
        if root < balls[i, ROOT]:
            balls[i, ROOT], balls[i, WALL] = root, wall


@compiled
def next_release(
    balls: FloatArray, X: FloatArray, P: FloatArray, limit: float, noise: float
) -> float:
    """Time until the walls stop pushing the resting balls, inf if beyond `limit`.

    `noise` is the rounding error of x''. Where x'' is no more than that and rises, the push begins.
    """
    side, top = 0.0, X.shape[0] - 1
    for i in range(balls.shape[0]):
        if balls[i, STATE] == RESTING:
            side = balls[i, SIDE]
    if side == 0.0:
        return math.inf
    for n in range(top - 1):
        P[n] = side * (n + 1) * (n + 2) * X[n + 2]
    P[top - 1] = P[top] = 0.0
    if abs(P[0]) <= noise and P[1] >= 0.0:
        P[0] = 0.0
    first: float = first_root(P, 0, limit)
    return first


@compiled
def move(
    balls: FloatArray, X: FloatArray, state: FloatArray, s: float, bend: float, gain: float
) -> float:
    """Carry clock, oscillator and balls s seconds on; until when what happens is one event."""
    advance_clock(state, s)
    state[X_NOW], state[V_NOW] = X[0] + fused(X[1], s, bend), X[1] + gain
    tie: float = s + max(4.0 * EPS * s, 0.5 * EPS * state[T_HIGH])
    for i in range(balls.shape[0]):
        if is_held(balls, i):
            continue
        if balls[i, STATE] >= TOUCHED:
            balls[i, D] = carry(balls, i, state[V_NOW], s, bend, gain)
            balls[i, LEFT] = balls[i, LEFT] - s if balls[i, ROOT] > tie else 0.0
            continue
        if balls[i, STATE] == RELEASED:
            balls[i, U] += balls[i, A] * s
            way, balls[i, RHO] = from_power(X, s, 3)
            gap = balls[i, D] - balls[i, SIDE] * way
        else:
            gap = carry(balls, i, state[V_NOW], s, bend, gain)
        if s > 0.0:
            balls[i, STATE] = FREE
            # A ball that slides changes its direction through rest only.
            turned = balls[i, TURN] <= tie or balls[i, WAY] * balls[i, RHO] <= 0.0
            if balls[i, RUB] > 0.0 and turned:
                balls[i, RHO] = 0.0
        left = gap if balls[i, WALL] == balls[i, SIDE] else 2.0 * balls[i, CLEARANCE] - gap
        met = balls[i, ROOT] < math.inf and left <= 4.0 * EPS * balls[i, CLEARANCE]
        if met or balls[i, ROOT] <= tie:
            balls[i, SIDE], gap = balls[i, WALL], 0.0
        balls[i, D] = max(gap, 0.0)
    return tie


@compiled
def log_marked(
    balls: FloatArray, numbers: FloatArray, labels: IntArray, row: int, kind: int, state: FloatArray
) -> int:
    """One row for every marked ball, starting or ending a rest."""
    for i in range(balls.shape[0]):
        if balls[i, HIT] == 1.0:
            v = state[V_NOW]
            labels[row, 0] = kind
            row = write_event(
                numbers, labels, row, i, balls[i, SIDE], state[T_HIGH], state[X_NOW], v, v, v, v
            )
    return row


@apart
def collide(
    balls: FloatArray, M: float, state: FloatArray, numbers: FloatArray, labels: IntArray, row: int,
    before: FloatArray,
) -> int:  # fmt: skip
    """Carry out the impact of the marked balls and log it; rests that it ends are logged too.

    Rows of one instant hand the oscillator's velocity on from ball to ball (`Motion.impacts`).
    """
    n, v = balls.shape[0], state[V_NOW]
    for i in range(n):
        before[i] = balls[i, RHO] if balls[i, STATE] != RESTING else math.inf
    dv = impact(balls, M)
    state[V_NOW] = v + dv
    now, moving, count, handed = state[T_HIGH], M + resting_mass(balls), 0, v
    for i in range(n):
        count += int(balls[i, HIT] == 1.0)
    for i in range(n):
        if balls[i, HIT] == 1.0:
            expect(balls, i, now)
            if balls[i, MASS] > M and n == 1:
                # The lighter body takes the rounding: here the oscillator, of a wall-like ball.
                push = (1.0 + balls[i, RESTITUTION]) * before[i] * (M / (M + balls[i, MASS]))
                balls[i, U] += push
                state[V_NOW] = balls[i, U] + balls[i, RHO]
            else:
                balls[i, U] = state[V_NOW] - balls[i, RHO]
            count -= 1
            share = balls[i, MASS] * (balls[i, RHO] - before[i] - dv) / moving
            left = handed + share if count > 0 else state[V_NOW]
            labels[row, 0] = IMPACT
            row = write_event(
                numbers, labels, row, i, balls[i, SIDE], now, state[X_NOW],
                handed, left, v - before[i], balls[i, U],
            )  # fmt: skip
            handed = left
        elif before[i] == math.inf and balls[i, STATE] != RESTING:
            balls[i, U] = v
            labels[row, 0] = REST_END
            row = write_event(
                numbers, labels, row, i, balls[i, SIDE], state[T_HIGH], state[X_NOW],
                v, state[V_NOW], v, v,
            )  # fmt: skip
    return row


@apart
def turn(
    par: FloatArray, kind: int, table: FloatArray, piece: int, duration: float, remainder: float,
    state: FloatArray, balls: FloatArray, numbers: FloatArray, labels: IntArray, row: int,
    work: FloatArray, before: FloatArray,
) -> int:  # fmt: skip
    """One turn of the loop: up to the next event, or as far as the series holds; rows written."""
    E, X, P = work[0], work[1], work[2]
    if closing_now(balls, state[V_NOW]) > 0:
        return collide(balls, par[P_M], state, numbers, labels, row, before)
    mass = par[P_M] + resting_mass(balls)
    since = (state[T_HIGH] - table[piece, 0]) + state[T_LOW]
    reach = expand(par, mass, kind, table, piece, since, state[X_NOW], state[V_NOW], E, X)
    state[V_NOW] = X[1]
    if settle(balls, X) > 0:
        return log_marked(balls, numbers, labels, row, REST_START, state)
    rate = max(own_rate(mass, par[P_C], par[P_K]), 1.0 / duration)
    T, dx, dv = close_chatter(balls, mass, rate, 2.0 * X[2], 6.0 * X[3], state[V_NOW], remainder)
    if T >= 0.0:  # it may be too short for the clock to show
        advance_clock(state, T)
        state[X_NOW] += dx
        state[V_NOW] += dv
        return log_marked(balls, numbers, labels, row, REST_START, state)
    step, goal = end_of_step(table, piece, duration, state, reach)
    bend, gain = from_power(X, step, 2)  # x - x0 - v0 s and v - v0, without subtraction
    contact = next_hit(balls, X, P, step, step, bend, gain)
    noise = 4.0 * EPS * (par[P_K] * (abs(E[0]) + abs(X[0])) + par[P_C] * (abs(E[1]) + abs(X[1])))
    let_go = next_release(balls, X, P, min(step, contact), noise / mass)
    first = min(contact, let_go)
    if first < step:
        bend, gain = from_power(X, first, 2)
    move(balls, X, state, min(first, step), bend, gain)
    if first >= step and goal < math.inf:
        state[T_HIGH], state[T_LOW] = goal, 0.0
    if let_go < contact and let_go <= step:
        jumped = let_go == 0.0 and 2.0 * abs(X[2]) > noise / mass
        release(balls, state[V_NOW], FREE if jumped else RELEASED)
        row = log_marked(balls, numbers, labels, row, REST_END, state)
    return row


@compiled
def end_of_step(
    table: FloatArray, piece: int, duration: float, state: FloatArray, reach: float
) -> tuple[float, float]:
    """Length of a step without an event, which ends with the series, the base's piece or the run;
    where it is not the series, the time that the clock then shows, else inf."""
    stop = duration
    if piece + 1 < table.shape[0]:
        stop = min(stop, table[piece + 1, 0])
    left = (stop - state[T_HIGH]) - state[T_LOW]
    if left <= reach:
        return max(left, 0.0), stop
    return reach, math.inf


@entry
def sample(
    par: FloatArray, kind: int, table: FloatArray, nodes: FloatArray, times: FloatArray,
    pace: float, work: FloatArray, x: FloatArray, v: FloatArray, a: FloatArray,
) -> float:  # fmt: skip
    """x, x', x'' at sorted times. `nodes`: rows (time, x, v, mass) after each event.

    Returns inf, or the time at which ALLOWANCE segments lay within `pace` seconds.
    """
    E, X = work[0], work[1]
    node, last, spent, since = 0, nodes.shape[0] - 1, 0, nodes[0, 0]
    t, mass, reach = nodes[0, 0], nodes[0, 3], 0.0
    piece = piece_at(table, t)
    X[0], X[1] = nodes[0, 1], nodes[0, 2]
    reach = expand(par, mass, kind, table, piece, t - table[piece, 0], X[0], X[1], E, X)
    for i in range(times.shape[0]):
        while True:
            stop = nodes[node + 1, 0] if node < last else math.inf
            knot = table[piece + 1, 0] if piece + 1 < table.shape[0] else math.inf
            end = min(t + reach, stop, knot)
            if times[i] < end:
                break
            if end == stop:
                node += 1
                while node < last and nodes[node + 1, 0] == nodes[node, 0]:
                    node += 1
                here, speed, mass = nodes[node, 1], nodes[node, 2], nodes[node, 3]
            else:
                here, speed, _ = place_at(X, end - t)
            t = end if end > t else np.nextafter(t, math.inf)
            while piece + 1 < table.shape[0] and table[piece + 1, 0] <= t:
                piece += 1
            reach = expand(par, mass, kind, table, piece, t - table[piece, 0], here, speed, E, X)
            spent += 1
            if t > since + pace:
                spent, since = 0, t
            elif spent > ALLOWANCE:
                return float(t)
        x[i], v[i], a[i] = place_at(X, times[i] - t)
    return math.inf
