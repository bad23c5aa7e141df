"""Event loop of rigs that are not plain: friction, tilt, r by wall and speed, a spring or damper
that is not linear.

One turn is that of `events.py` with more events: a ball that slides comes to rest on its floor
(`next_stop`), a held ball slips (`next_slip`). A ball that slides has the constant acceleration A =
tilt + mu g d, d = `WAY` the sign of x' - y': the floor drags it along, and it drags the oscillator
back with m mu g d. No segment holds more than one direction of any force, so its gap is a power
series with another second coefficient than x, whose first root `search.py` finds: no impact is
missed. Before each segment `decide` settles who is held.

A ball at rest on the floor is held as long as the force that this takes lies within its bounds,
with p = x'' - tilt the force over m:

    on the floor |p| <= mu g;    at the wall of side S also S p > mu g: the wall pushes.

When several balls are at rest, or the oscillator is held to its base by Coulomb friction, what one
does changes x'' for the others. With every bound inserted, M x'' + sum m clip(p, low, high) = rest
of the forces; the left side grows with x'', so there is exactly one x'' (`acceleration`). Forces
that hold and forces that slide meet where p is at a bound: x'' is continuous there, a slip begins
with x'' - y'' = 0 and opens like the third power of time, and a ball that has just slipped cannot
be caught at once, because x''' keeps its sign (its value is multiplied by (M + m)/M).

It is compiled of its own, when it is first asked for: the plain rig pays nothing for it. Under a
harmonic base, flights in which every ball slides on in its direction are in closed form (`glide`):
a constant force moves the place of rest of the oscillator, and the rest is `flight.py`.

Chatter is carried to its accumulation point as in `contact.py`, but away from the wall and back to
it the ball has different accelerations relative to the wall, because friction turns about at the
top of every bounce: `out` and `back` = out - 2 mu g (1 + m/M). A bounce that leaves with speed w
rises w^2/(2 out) and returns with w sqrt(back/out), so that the speeds of impact fall by
q = r sqrt(back/out), and after an impact at speed c all further bounces take

    c (r/out + q/back)/(1 - q)

together. With back <= 0 the ball stays where it has come to rest, and there is no chatter. With
several balls that chatter at the same instant the directions of the others' friction are taken as
they are now: the beginning of a rest is then known to the remainder itself, 1e-8 rad.
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.solver.bent import START as BENT
from vinesexp.solver.bent import bend
from vinesexp.solver.compiled import apart, compiled, entry
from vinesexp.solver.contact import UNSEEN, closing_now
from vinesexp.solver.events import collide, end_of_step, is_held, move, next_hit
from vinesexp.solver.flight import cross, first_expected, second
from vinesexp.solver.lasting import go_through, lasts
from vinesexp.solver.nonlinear import expand_loaded, is_at_rest, moving_way, spring_force
from vinesexp.solver.response import ENTRIES, H_FREQUENCY, H_SPACING, H_W, after, base_at, phasor
from vinesexp.solver.search import EPS, first_root
from vinesexp.solver.series import (
    P_C,
    P_COULOMB,
    P_CUBIC,
    P_K,
    P_M,
    P_QUADRATIC,
    expand_base,
    from_power,
    own_rate,
    piece_at,
)
from vinesexp.solver.state import (
    ALLOWANCE,
    B_PLUS,
    CLEARANCE,
    EXPECTED,
    FREE,
    HIT,
    L_A,
    L_APART,
    L_FORCE,
    L_MASS,
    LEFT,
    MASS,
    PERIOD,
    R_MINUS,
    R_PLUS,
    R_SLOPE,
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
    IntArray,
    U,
    advance_clock,
    carry,
    write_event,
)

TURNED = 64.0 * EPS  # z' over the speeds it is the difference of, where it has just come to zero
REFRESH = 64  # flights after which the turned phasor, which gathers rounding, is taken afresh


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
def write(
    balls: FloatArray, i: int, what: int, state: FloatArray, numbers: FloatArray,
    labels: IntArray, row: int,
) -> int:  # fmt: skip
    """A row about ball i at this instant, all but what `complete` knows; number of rows."""
    side = balls[i, SIDE] if balls[i, D] <= 0.0 else 0.0
    v, vy = state[V_NOW], state[V_NOW] - balls[i, RHO]
    labels[row, 0] = what
    return write_event(numbers, labels, row, i, side, state[T_HIGH], state[X_NOW], v, v, vy, vy)


@apart
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


@compiled
def set_restitution(balls: FloatArray, i: int, speed: float) -> None:
    """Fill in RESTITUTION of ball i for an impact at the wall SIDE with a closing speed."""
    r = balls[i, R_PLUS] if balls[i, SIDE] > 0.0 else balls[i, R_MINUS]
    balls[i, RESTITUTION] = min(max(r + balls[i, R_SLOPE] * abs(speed), 0.0), 1.0)


@compiled
def remaining(
    balls: FloatArray, i: int, a: float, M: float, own_rate: float
) -> tuple[float, float]:
    """Time to the accumulation point of one ball's chatter, s, and the acceleration `back`.

    `a` is S (x'' - y'') as it is now. The time is no less than that in which the wall gains the
    speed of the next impact (see `contact.remaining_time`).
    """
    away, r = -balls[i, SIDE] * balls[i, RHO], balls[i, RESTITUTION]
    turned = 2.0 * balls[i, RUB] * (1.0 + balls[i, MASS] / M)
    out, back = (a, a - turned) if away > 0.0 else (a + turned, a)
    if back <= 0.0:
        return math.inf, back
    if away > 0.0:
        speed = math.sqrt(2.0 * back * (balls[i, D] + 0.5 * away * away / out))
        last = away / out + speed / back
    else:
        speed = math.sqrt(away * away + 2.0 * back * balls[i, D])
        last = (away + speed) / back
    if speed * own_rate <= UNSEEN * back:
        return last, back
    q = r * math.sqrt(back / out)
    if q >= 1.0:
        return math.inf, back
    longest: float = max(last + speed * (r / out + q / back) / (1.0 - q), speed / back)
    return longest, back


@compiled
def fading(balls: FloatArray, i: int, a: float) -> float:
    """Rate at which r changes over a chatter, 1/s.

    A change of r by R_SLOPE times the speed of an impact, at most a T, changes the geometric sum
    by 2 R_SLOPE a T/(1 - r)^2 of itself.
    """
    if balls[i, R_SLOPE] == 0.0 or balls[i, RESTITUTION] >= 1.0:
        return 0.0
    left: float = 1.0 - balls[i, RESTITUTION]
    rate: float = 2.0 * abs(balls[i, R_SLOPE]) * a / (left * left)
    return rate


@compiled
def may_pass(balls: FloatArray, x2: float, T: float) -> bool:
    """Whether no ball but the marked ones meets a wall, or stops on its floor, within T."""
    for i in range(balls.shape[0]):
        if balls[i, HIT] == 1.0 or balls[i, STATE] == RESTING or balls[i, STATE] == STUCK:
            continue
        gain = (abs(x2) + abs(balls[i, A])) * T
        reach = (abs(balls[i, RHO]) + gain) * T
        if balls[i, D] <= reach or 2.0 * balls[i, CLEARANCE] - balls[i, D] <= reach:
            return False
        if balls[i, RUB] > 0.0 and abs(balls[i, RHO]) <= gain:
            return False
    return True


@compiled
def close_rubbing_chatter(
    balls: FloatArray, mass: float, rate: float, x2: float, x3: float, v: float,
    remainder: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Carry every chatter at its end to rest at once: duration T, change of x, change of v.

    `mass` is that of the oscillator with the held balls, x2 and x3 are x'' and x'''.
    T = -1: there is none, or something else could happen before its end.
    """
    n = balls.shape[0]
    T, momentum, offset, push, total = -1.0, 0.0, 0.0, mass * x2, mass
    for i in range(n):
        balls[i, HIT] = 0.0
        if balls[i, STATE] == FREE and balls[i, TAU] == 0.0:
            set_restitution(balls, i, 0.0)
            a = balls[i, SIDE] * (x2 - balls[i, A])
            left, back = remaining(balls, i, a, mass, rate)
            if left * max(rate, abs(x3) / back, fading(balls, i, back)) <= remainder:
                balls[i, HIT] = 1.0
                T = max(T, left)
                momentum += balls[i, MASS] * balls[i, RHO]
                offset += balls[i, MASS] * balls[i, SIDE] * balls[i, D]
                push += balls[i, MASS] * balls[i, A]
                total += balls[i, MASS]
    if T < 0.0 or not may_pass(balls, x2, T):
        return -1.0, 0.0, 0.0
    # Friction within the group is internal: momentum fixes where it is and how fast after T.
    dv = (-momentum + push * T) / total
    shift = (-momentum * T + 0.5 * push * T * T + offset) / total
    for i in range(n):
        if balls[i, HIT] == 1.0:
            balls[i, STATE] = RESTING
            balls[i, RHO] = 0.0
            balls[i, D] = 0.0
        elif balls[i, STATE] != RESTING and balls[i, STATE] != STUCK:
            bend = shift - 0.5 * balls[i, A] * T * T
            balls[i, D] -= balls[i, SIDE] * (balls[i, RHO] * T + bend)
            balls[i, RHO] += dv - balls[i, A] * T
            balls[i, U] += balls[i, A] * T
            balls[i, STATE] = FREE
    return T, v * T + shift, dv


@compiled
def collide_rubbing(
    balls: FloatArray, M: float, x2: float, state: FloatArray, numbers: FloatArray,
    labels: IntArray, row: int, before: FloatArray,
) -> int:  # fmt: skip
    """`events.collide`: r of the wall and the speed; no friction holds a ball in an impact.

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
            row = write(balls, i, REST_END, state, numbers, labels, row)
            balls[i, STATE], balls[i, U] = FREE, state[V_NOW]
        elif balls[i, STATE] == RELEASED:
            balls[i, STATE] = FREE
    if not struck:
        return row
    return collide(balls, M, state, numbers, labels, row, before)


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
def any_lasts(balls: FloatArray) -> bool:
    """Whether contacts of any ball last."""
    lasts = False
    for i in range(balls.shape[0]):
        lasts = lasts or balls[i, TAU] > 0.0
    return lasts


@apart
def rub(
    par: FloatArray, kind: int, table: FloatArray, piece: int, duration: float, remainder: float,
    state: FloatArray, balls: FloatArray, numbers: FloatArray, labels: IntArray, first: int,
    work: FloatArray, before: FloatArray,
) -> int:  # fmt: skip
    """One turn of the loop: up to the next event, or as far as the series holds; rows written."""
    E, X, P, row = work[0], work[1], work[2], first
    since = (state[T_HIGH] - table[piece, 0]) + state[T_LOW]
    base_rate = expand_base(kind, table[piece], since, E)
    if closing_now(balls, state[V_NOW]) > 0:
        x2 = 0.0
        if any_lasts(balls):
            x2 = free_acceleration(par, balls, state[X_NOW], state[V_NOW], E, X)
        row = collide_rubbing(balls, par[P_M], x2, state, numbers, labels, row, before)
    row = decide(par, state, balls, E, X, numbers, labels, row)
    complete(balls, par[P_M], numbers, labels, first, row)
    first = row
    force, held = loads(balls)
    mass, x, v = par[P_M] + held, state[X_NOW], state[V_NOW]
    reach = expand_loaded(par, mass, force, base_rate, x, v, E, X, P)
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
    step, goal = end_of_step(table, piece, duration, state, reach)
    noise = 4.0 * EPS * (par[P_K] * (abs(E[0]) + abs(X[0])) + par[P_C] * (abs(E[1]) + abs(X[1])))
    soon = next_stop(balls, X, P, step)
    soon = min(soon, next_slip(balls, X, P, min(step, soon), noise / mass))
    bend, gain = from_power(X, step, 2)  # x - x0 - v0 s and v - v0, without subtraction
    soon = min(soon, next_hit(balls, X, P, min(step, soon), step, bend, gain))
    if soon < step:
        bend, gain = from_power(X, soon, 2)
    tie = move(balls, X, state, min(soon, step), bend, gain)
    if soon >= step and goal < math.inf:
        state[T_HIGH], state[T_LOW] = goal, 0.0
    row = slip(balls, state, tie, numbers, labels, row)
    row = go_through(balls, par[P_M], state, numbers, labels, row)
    complete(balls, par[P_M], numbers, labels, first, row)
    return row


@compiled
def next_turn(
    response: FloatArray, par: FloatArray, state: FloatArray, c: FloatArray, force: float,
    E: FloatArray, X: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Sign of z' by which friction acts (0: it holds), and a guess how long it keeps it, s."""
    E[0], E[1], a = base_at(response, c[0], c[1])
    E[2], X[0], X[1] = 0.5 * a, state[X_NOW], state[V_NOW]
    way, rests = moving_way(par, par[P_M], force, E, X)
    if abs(X[1] - E[1]) <= TURNED * (abs(X[1]) + abs(E[1])) and not rests:
        way, rests = math.copysign(1.0, force + spring_force(par, E, X) - par[P_M] * a), True
    u = 0.0 if rests else X[1] - E[1]
    pull = force - way * par[P_COULOMB] + spring_force(par, E, X) - par[P_C] * u
    # As if z' were a sine of the base's frequency.
    ahead = math.atan2(way * (pull / par[P_M] - a), way * u * response[H_W])
    return way, (ahead + 0.5 * math.pi) / response[H_W]


@compiled
def coast(
    response: FloatArray, state: FloatArray, balls: FloatArray, c: FloatArray, T: float,
    shift: float,
) -> None:  # fmt: skip
    """Carry everything, one ball in contact, to the next stage of its contact in T seconds."""
    w, x0, v0 = response[H_W], state[X_NOW], state[V_NOW]
    c[0], c[1], xh, vh = after(response, c[0], c[1], x0 - shift - c[0], v0 + w * c[1], T)
    advance_clock(state, T)
    state[X_NOW], state[V_NOW] = shift + (c[0] + xh), vh - w * c[1]
    bend, gain = state[X_NOW] - x0 - v0 * T, state[V_NOW] - v0
    balls[0, D] = carry(balls, 0, state[V_NOW], T, bend, gain)
    balls[0, LEFT] = 0.0


@apart
def cross_bent(
    response: FloatArray, par: FloatArray, state: FloatArray, balls: FloatArray, c: FloatArray,
    k: int, s: float, longest: float, shift: float, way: float, turns: float, work: FloatArray,
) -> tuple[bool, bool]:  # fmt: skip
    """`flight.cross` of an oscillator that is not linear: whether it is at the contact, or turned.

    `turns` is when it may turn before the contact.
    """
    xh, vh, bent = state[X_NOW] - shift - c[0], state[V_NOW] + response[H_W] * c[1], work[5]
    if not bend(response, par, c, xh, vh, shift, way, work):
        return False, False
    turned, ends = turns < s, min(longest, response[BENT])
    for _ in range(2):
        ball, soon = (-1, turns) if turned else (k, s)
        if cross(response, state, balls, c, ball, soon, ends, shift, way, bent)[0] > 0.0:
            return not turned, turned
        if not turned:
            break
        turned = False
    return False, False


@apart
def glide(
    response: FloatArray, par: FloatArray, state: FloatArray, balls: FloatArray, c: FloatArray,
    longest: float, numbers: FloatArray, labels: IntArray, row: int, work: FloatArray,
    before: FloatArray,
) -> tuple[bool, int]:  # fmt: skip
    """One flight in closed form, all balls sliding, and the impact after it.

    Or up to where the oscillator turns, if Coulomb friction acts on it. Whether it is proved (if
    not, nothing is changed), and rows written.
    """
    n, first, k = balls.shape[0], row, first_expected(balls, state[T_HIGH])
    if n == 1 and balls[0, STATE] >= TOUCHED and balls[0, LEFT] < longest:
        if par[P_COULOMB] != 0.0 or par[P_CUBIC] != 0.0 or par[P_QUADRATIC] != 0.0:
            return False, row
        force, _ = loads(balls)
        coast(response, state, balls, c, balls[0, LEFT], force / par[P_K])
        row = go_through(balls, par[P_M], state, numbers, labels, row)
        complete(balls, par[P_M], numbers, labels, first, row)
        return True, row
    if n == 0 or k < 0:
        return False, row
    for i in range(n):
        if may_hold(balls, i) or (balls[i, RUB] > 0.0 and balls[i, WAY] * balls[i, RHO] <= 0.0):
            return False, row
    if balls[k, TAU] > 0.0 and (par[P_CUBIC] != 0.0 or par[P_QUADRATIC] != 0.0):
        return False, row
    force, _ = loads(balls)
    soon, way, turns = (balls[k, EXPECTED] - state[T_HIGH]) - state[T_LOW], 0.0, math.inf
    if par[P_COULOMB] != 0.0 or par[P_QUADRATIC] != 0.0:
        way, turns = next_turn(response, par, state, c, force, work[0], work[1])
        if way == 0.0:
            return False, row
    shift = (force - way * par[P_COULOMB]) / par[P_K]
    if par[P_CUBIC] != 0.0 or par[P_QUADRATIC] != 0.0:
        landed, turned = cross_bent(
            response, par, state, balls, c, k, soon, longest, shift, way, turns, work
        )
        if not landed:
            return turned, row
    elif (
        turns < soon
        and cross(response, state, balls, c, -1, turns, longest, shift, way, None)[0] > 0.0
    ):
        return True, row
    elif cross(response, state, balls, c, k, soon, longest, shift, way, None)[0] == 0.0:
        return False, row
    for i in range(n):
        balls[i, HIT] = 1.0 if i == k else 0.0
    xh, vh = state[X_NOW] - shift - c[0], state[V_NOW] + response[H_W] * c[1]
    x2 = second(response, c[0], xh, vh)
    row = collide_rubbing(balls, par[P_M], x2, state, numbers, labels, row, before)
    for i in range(n):
        way = math.copysign(1.0, balls[i, RHO])
        if way != balls[i, WAY] and not may_hold(balls, i):
            balls[i, WAY] = way
            if balls[i, RUB] != 0.0:
                row = write(balls, i, SLIDE, state, numbers, labels, row)
    complete(balls, par[P_M], numbers, labels, first, row)
    return True, row


@entry
def run_rubbing(
    closed: bool, response: FloatArray, par: FloatArray, kind: int, table: FloatArray,
    duration: float, remainder: float, state: FloatArray, balls: FloatArray, numbers: FloatArray,
    labels: IntArray, work: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """Run to `duration`, until the log is full or ALLOWANCE is used: rows written, turns.

    Resume with the same arrays (`kernel.run`).
    """
    before, c = np.empty(balls.shape[0]), np.empty(2)
    return rub_on(
        closed, response, par, kind, table, duration, remainder, state, balls, numbers, labels,
        work, before, c,
    )  # fmt: skip


@apart
def rub_on(
    closed: bool, response: FloatArray, par: FloatArray, kind: int, table: FloatArray,
    duration: float, remainder: float, state: FloatArray, balls: FloatArray, numbers: FloatArray,
    labels: IntArray, work: FloatArray, before: FloatArray, c: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """`run_rubbing`, with its scratch space."""
    row, turns, piece = 0, 0, piece_at(table, state[T_HIGH])
    room, span = numbers.shape[0] - 6 * balls.shape[0] - 4, (ENTRIES - 2) * response[H_SPACING]
    for i in range(balls.shape[0]):
        balls[i, PERIOD] = 1.0 / response[H_FREQUENCY] if closed else 0.0
    while row < room and state[T_HIGH] < duration and turns < ALLOWANCE:
        if closed:
            c[0], c[1] = phasor(response, state[T_HIGH], state[T_LOW])
            flown = True
            while flown and row < room and turns % REFRESH < REFRESH - 1:
                left = (duration - state[T_HIGH]) - state[T_LOW]
                flown, row = glide(
                    response, par, state, balls, c, min(left, span), numbers, labels, row, work,
                    before,
                )  # fmt: skip
                turns += 1
        while piece + 1 < table.shape[0] and table[piece + 1, 0] <= state[T_HIGH]:
            piece += 1
        turns += 1
        if row < room:
            row = rub(
                par, kind, table, piece, duration, remainder, state, balls, numbers, labels, row,
                work, before,
            )  # fmt: skip
    return row, turns
