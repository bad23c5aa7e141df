"""Event loop on power series: any base motion, any number of balls, friction, tilt, weak damping.

State between events: time as a sum of two floats (so that 1e7 flights add up without drift), x, v
and the table of balls (`state.py`). One turn of the loop expands the motion at the present state
(`series.py`), finds the first event on the segment (`search.py`), moves everything there and
carries out what happens (`contact.py`): a ball meets a wall, a ball that slides comes to rest on
its floor (`next_stop`), a held ball slips (`next_slip`). A ball that slides has the constant
acceleration A = tilt + mu g d, d = `WAY` the sign of x' - y': the floor drags it along, and it
drags the oscillator back with m mu g d. No segment holds more than one direction of any force, so
its gap is a power series with another second coefficient than x, whose first root `search.py`
finds: no impact is missed. Before each segment `decide` settles who is held.

A ball at rest on the floor is held as long as the force that this takes lies within its bounds,
with p = x'' - tilt the force over m:

    on the floor |p| <= mu g;    at the wall of side S also S p > mu g: the wall pushes.

When several balls are at rest, or the oscillator is held to its base by Coulomb friction, what one
does changes x'' for the others. With every bound inserted, M x'' + sum m clip(p, low, high) = rest
of the forces; the left side grows with x'', so there is exactly one x'' (`acceleration`). Forces
that hold and forces that slide meet where p is at a bound: x'' is continuous there, a slip begins
with x'' - y'' = 0 and opens like the third power of time, and a ball that has just slipped cannot
be caught at once, because x''' keeps its sign (its value is multiplied by (M + m)/M).
"""

from __future__ import annotations

import math

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import apart, compiled, fused
from vinesexp.solver.contact import (
    close_chatter,
    closing_now,
    expect,
    go_through,
    impact,
    lasts,
    resting_mass,
    set_restitution,
)
from vinesexp.solver.search import EPS, clear_between, first_root, most_of_fourth
from vinesexp.solver.series import (
    P_C,
    P_COULOMB,
    P_K,
    P_M,
    P_QUADRATIC,
    expand,
    expand_base,
    from_power,
    is_at_rest,
    own_rate,
    spring_force,
)
from vinesexp.solver.state import (
    BEFORE,
    CLEARANCE,
    FREE,
    HIT,
    IMPACT,
    L_A,
    L_APART,
    L_FORCE,
    L_MASS,
    LEFT,
    LOGGED,
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
    SLIDE,
    STATE,
    STUCK,
    T_HIGH,
    T_LOW,
    TAU,
    TILT,
    TOUCHED,
    TURN,
    UNSET,
    V_NOW,
    WALL,
    WAY,
    X_NOW,
    A,
    D,
    Given,
    Log,
    U,
    advance_clock,
    carry,
    write_event,
    x_minus_y,
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


@apart
def carry_out(balls: FloatArray, M: float, state: FloatArray, log: Log) -> None:
    """Carry out the impact of the marked balls and log it; rests that it ends are logged too.

    Rows of one instant hand the oscillator's velocity on from ball to ball (`Motion.impacts`).
    """
    n, v = balls.shape[0], state[V_NOW]
    for i in range(n):
        balls[i, BEFORE] = balls[i, RHO] if balls[i, STATE] != RESTING else math.inf
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
                push = (1.0 + balls[i, RESTITUTION]) * balls[i, BEFORE] * (M / (M + balls[i, MASS]))
                balls[i, U] += push
                state[V_NOW] = balls[i, U] + balls[i, RHO]
            else:
                balls[i, U] = state[V_NOW] - balls[i, RHO]
            count -= 1
            share = balls[i, MASS] * (balls[i, RHO] - balls[i, BEFORE] - dv) / moving
            left = handed + share if count > 0 else state[V_NOW]
            before = v - balls[i, BEFORE]
            write_event(state, log, IMPACT, i, balls[i, SIDE], handed, left, before, balls[i, U])
            handed = left
        elif balls[i, BEFORE] == math.inf and balls[i, STATE] != RESTING:
            balls[i, U] = v
            write_event(state, log, REST_END, i, balls[i, SIDE], v, state[V_NOW], v, v)


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


@compiled
def may_hold(balls: FloatArray, i: int) -> bool:
    """Whether the ball is at rest on its floor or at a wall, so that it may be held there."""
    if is_held(balls, i):
        return True
    at_rest = balls[i, STATE] == FREE and balls[i, RHO] == 0.0
    waits: bool = at_rest and (balls[i, D] <= 0.0 or balls[i, RUB] > 0.0)
    return waits


@compiled
def bounds(balls: FloatArray, i: int) -> tuple[float, float]:
    """Least and largest p = x'' - tilt at which the ball is held."""
    low, high = -balls[i, RUB], balls[i, RUB]
    if balls[i, D] <= 0.0:
        if balls[i, SIDE] > 0.0:
            high = math.inf
        else:
            low = -math.inf
    return low, high


@compiled
def holding_force(balls: FloatArray, a: float) -> float:
    """Sum of m clip(p, low, high) over the balls that may be held, at x'' = a."""
    total = 0.0
    for i in range(balls.shape[0]):
        if may_hold(balls, i):
            low, high = bounds(balls, i)
            total += balls[i, MASS] * min(max(a - balls[i, TILT], low), high)
    return total


@apart
def acceleration(balls: FloatArray, M: float, force: float) -> float:
    """x'' under a force, with every ball at rest held or giving way as its bounds say."""
    below, above = -math.inf, math.inf
    for i in range(balls.shape[0]):
        if may_hold(balls, i):
            low, high = bounds(balls, i)
            for bound in (low, high):
                a = balls[i, TILT] + bound
                if math.isinf(a):
                    continue
                if M * a + holding_force(balls, a) <= force:
                    below = max(below, a)
                else:
                    above = min(above, a)
    # Between these two breakpoints the same balls are held, and x'' follows from them.
    mass, rest = M, force
    for i in range(balls.shape[0]):
        if may_hold(balls, i):
            low, high = bounds(balls, i)
            if balls[i, TILT] + low >= above:
                rest -= balls[i, MASS] * low
            elif balls[i, TILT] + high <= below:
                rest -= balls[i, MASS] * high
            else:
                mass += balls[i, MASS]
                rest += balls[i, MASS] * balls[i, TILT]
    return rest / mass


@compiled
def loads(balls: FloatArray) -> tuple[float, float]:
    """Force of the balls on the oscillator and mass of those held; fills in A of all others."""
    force, mass = 0.0, 0.0
    for i in range(balls.shape[0]):
        if is_held(balls, i):
            mass += balls[i, MASS]
            force += balls[i, MASS] * balls[i, TILT]
            balls[i, A] = 0.0
        else:
            drag = balls[i, RUB] * balls[i, WAY]
            balls[i, A] = balls[i, TILT] + drag
            force -= balls[i, MASS] * drag
    return force, mass


@compiled
def next_stop(balls: FloatArray, X: FloatArray, P: FloatArray, limit: float) -> float:
    """First time in (0, limit] at which a sliding ball comes to rest on its floor; fills TURN."""
    first, top = math.inf, X.shape[0] - 1
    for i in range(balls.shape[0]):
        balls[i, TURN] = math.inf
        if is_held(balls, i) or balls[i, RUB] == 0.0:
            continue
        way = balls[i, WAY]
        for n in range(1, top):
            P[n] = way * (n + 1) * X[n + 1]
        P[0], P[top] = way * balls[i, RHO], 0.0
        P[1] -= way * balls[i, A]
        lead = 0
        if balls[i, STATE] == RELEASED:  # x' - y' and x'' - y'' are zero by definition
            P[0] = P[1] = 0.0
            lead = 2
        elif balls[i, RHO] == 0.0:
            lead = 1
        balls[i, TURN] = first_root(P, lead, limit)
        first = min(first, balls[i, TURN])
    return first


@compiled
def next_slip(balls: FloatArray, X: FloatArray, P: FloatArray, limit: float, noise: float) -> float:
    """First time in (0, limit] at which a held ball reaches a bound; fills ROOT, and WALL with +-1.

    `noise` is the rounding error of x''. Where p is that close to a bound and moves away from it,
    the ball has just been caught.
    """
    first, top = math.inf, X.shape[0] - 1
    for i in range(balls.shape[0]):
        if not is_held(balls, i):
            continue
        balls[i, ROOT] = math.inf
        low, high = bounds(balls, i)
        for end in (-1.0, 1.0):
            bound = low if end < 0.0 else high
            if math.isinf(bound):
                continue
            for n in range(top - 1):
                P[n] = -end * (n + 1) * (n + 2) * X[n + 2]
            P[top - 1] = P[top] = 0.0
            P[0] += end * (bound + balls[i, TILT])
            if abs(P[0]) <= noise:
                P[0] = 0.0
            root = first_root(P, 0, limit)
            if root < balls[i, ROOT]:
                balls[i, ROOT], balls[i, WALL] = root, end
        first = min(first, balls[i, ROOT])
    return first


@apart
def write(balls: FloatArray, i: int, what: int, state: FloatArray, log: Log) -> None:
    """A row about ball i at this instant, all but what `complete` knows."""
    side = balls[i, SIDE] if balls[i, D] <= 0.0 else 0.0
    v, vy = state[V_NOW], state[V_NOW] - balls[i, RHO]
    write_event(state, log, what, i, side, v, v, vy, vy)


@apart
def complete(balls: FloatArray, M: float, state: FloatArray, log: Log, first: int) -> None:
    """Fill in, in the rows from `first` on, where their balls are and what acts after the event."""
    numbers, (force, held) = log.numbers, loads(balls)
    for row in range(first, int(state[LOGGED])):
        i = log.labels[row, 1]
        numbers[row, L_APART], numbers[row, L_A] = x_minus_y(balls, i), balls[i, A]
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
    par: FloatArray, state: FloatArray, balls: FloatArray, E: FloatArray, X: FloatArray, log: Log
) -> None:
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
                    write(balls, i, SLIDE, state, log)
    if not waiting:
        return
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
                write(balls, i, REST_START, state, log)
        else:
            way = math.copysign(1.0, p)
            if was or way != balls[i, WAY]:
                write(balls, i, REST_END if was else SLIDE, state, log)
            balls[i, STATE], balls[i, U], balls[i, WAY] = FREE, v, way


@compiled
def collide(balls: FloatArray, M: float, x2: float, state: FloatArray, log: Log) -> None:
    """The impact of the marked balls, with r of the wall and the speed; friction holds none in it.

    A contact that lasts begins, under x'' = `x2`; only where the wall holds the ball it is one
    instant.
    """
    struck = False
    for i in range(balls.shape[0]):
        if balls[i, HIT] == 1.0:
            set_restitution(balls, i, balls[i, RHO])
            if balls[i, TAU] > 0.0 and lasts(balls, i, x2, state[T_HIGH]):
                balls[i, HIT] = 0.0
            struck = struck or balls[i, HIT] == 1.0
        elif balls[i, STATE] == STUCK:
            write(balls, i, REST_END, state, log)
            balls[i, STATE], balls[i, U] = FREE, state[V_NOW]
        elif balls[i, STATE] == RELEASED:
            balls[i, STATE] = FREE
    if struck:
        carry_out(balls, M, state, log)


@compiled
def slip(balls: FloatArray, state: FloatArray, tie: float, log: Log) -> None:
    """Let the held balls go that have reached a bound."""
    for i in range(balls.shape[0]):
        if is_held(balls, i) and balls[i, ROOT] <= tie:
            write(balls, i, REST_END, state, log)
            balls[i, STATE], balls[i, WAY] = RELEASED, balls[i, WALL]
            balls[i, U] = state[V_NOW]


@apart
def turn(
    given: Given, piece: int, state: FloatArray, balls: FloatArray, log: Log, work: FloatArray,
    weak: FloatArray | None,
) -> None:  # fmt: skip
    """One turn of the loop: up to the next event, or as far as the series holds.

    `weak` is scratch space for what a plain rig has not; None leaves that out of what is compiled.
    """
    E, X, P, first, par = work[0], work[1], work[2], int(state[LOGGED]), given.par
    since = (state[T_HIGH] - given.table[piece, 0]) + state[T_LOW]
    base_rate = expand_base(given.kind, given.table[piece], since, E)
    if closing_now(balls, state[V_NOW]) > 0:
        x2 = 0.0
        if weak is not None and balls[:, TAU].any():
            x2 = free_acceleration(par, balls, state[X_NOW], state[V_NOW], E, X)
        collide(balls, par[P_M], x2, state, log)
        if weak is None:  # ends at the impact, from where samples of the amplitude count
            complete(balls, par[P_M], state, log, first)
            return
    decide(par, state, balls, E, X, log)
    complete(balls, par[P_M], state, log, first)
    first = int(state[LOGGED])
    force, held = loads(balls)
    mass, x, v = par[P_M] + held, state[X_NOW], state[V_NOW]
    reach = expand(par, mass, force, base_rate, x, v, E, X, weak)
    state[V_NOW] = X[1]
    rate = max(own_rate(mass, par[P_C], par[P_K]), 1.0 / given.duration)
    T, dx, dv = close_chatter(balls, mass, rate, 2.0 * X[2], 6.0 * X[3], X[1], given.remainder)
    if T >= 0.0:  # it may be too short for the clock to show
        advance_clock(state, T)
        state[X_NOW] += dx
        state[V_NOW] += dv
        for i in range(balls.shape[0]):
            if balls[i, HIT] == 1.0:
                write(balls, i, REST_START, state, log)
                balls[i, WAY] = 0.0
        complete(balls, par[P_M], state, log, first)
        return
    step, goal = end_of_step(given.table, piece, given.duration, state, reach)
    noise = 4.0 * EPS * (par[P_K] * (abs(E[0]) + abs(X[0])) + par[P_C] * (abs(E[1]) + abs(X[1])))
    soon = math.inf
    if weak is not None:
        soon = next_stop(balls, X, P, step)
    soon = min(soon, next_slip(balls, X, P, min(step, soon), noise / mass))
    bend, gain = from_power(X, step, 2)  # x - x0 - v0 s and v - v0, without subtraction
    soon = min(soon, next_hit(balls, X, P, min(step, soon), step, bend, gain))
    if soon < step:
        bend, gain = from_power(X, soon, 2)
    tie = move(balls, X, state, min(soon, step), bend, gain)
    if soon >= step and goal < math.inf:
        state[T_HIGH], state[T_LOW] = goal, 0.0
    slip(balls, state, tie, log)
    if weak is not None:
        go_through(balls, par[P_M], state, log)
    complete(balls, par[P_M], state, log, first)
