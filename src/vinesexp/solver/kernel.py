"""The event loop, and its fast ways: harmonic base (or none), in closed form between events.

Flights between walls are covered in a few evaluations of the closed form (`response.py`), found by
a guess and then proved to pass no contact, the bounces of a chatter by a series each (`flight.py`).
Flights in which every ball slides on in its direction are so too (`glide`): a constant force moves
the place of rest of the oscillator, and what is not linear bends the flight (`bent.py`). What is
neither, that is the end of a chatter, rest, release, several balls at once, starts on a wall and
what cannot be proved, is one turn of the general loop (`events.py`), which holds those rules alone.
The general loop, which knows nothing of this one, is its test.
"""

from __future__ import annotations

import math

from vinesexp.arrays import FloatArray
from vinesexp.solver.bent import START as BENT
from vinesexp.solver.bent import TURN_OFF, bend
from vinesexp.solver.compiled import apart, compiled, entry
from vinesexp.solver.contact import closing_now, go_through
from vinesexp.solver.events import collide, complete, loads, may_hold, turn, write
from vinesexp.solver.flight import SHORT, bounce, cross, first_expected, hop, look_and_cross, second
from vinesexp.solver.response import (
    ENTRIES,
    H_FREQUENCY,
    H_RATE,
    H_SPACING,
    H_TWOALPHA,
    H_W,
    H_W0SQ,
    after,
    base_at,
    phasor,
)
from vinesexp.solver.search import EPS
from vinesexp.solver.series import (
    P_C,
    P_COULOMB,
    P_CUBIC,
    P_K,
    P_M,
    P_QUADRATIC,
    moving_way,
    piece_at,
    spring_force,
)
from vinesexp.solver.state import (
    ALIKE_ROWS,
    ALLOWANCE,
    EXPECTED,
    FREE,
    HEADING,
    HIT,
    LEFT,
    LOGGED,
    PERIOD,
    PHASOR,
    RHO,
    RUB,
    SIDE,
    SLIDE,
    STATE,
    T_HIGH,
    T_LOW,
    TAU,
    TOUCHED,
    V_NOW,
    WAY,
    X_NOW,
    D,
    Given,
    Log,
    advance_clock,
    carry,
)

TURNED = 64.0 * EPS  # z' over the speeds it is the difference of, where it has just come to zero
REFRESH = 64  # flights after which the turned phasor, which gathers rounding, is taken afresh


@compiled
def is_flight(balls: FloatArray, acceleration: float, rate: float, least: float) -> bool:
    """Whether every ball flies, and none is back at the wall it left within `least` over `rate`."""
    for i in range(balls.shape[0]):
        if balls[i, STATE] != FREE:
            return False
        a = balls[i, SIDE] * acceleration
        away = -balls[i, SIDE] * balls[i, RHO]
        if balls[i, D] <= 0.0 and away <= 0.0:
            return False
        if a > 0.0:
            back = away + math.sqrt(away * away + 2.0 * a * balls[i, D])
            if back * rate < least * a:
                return False
    return True


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
    xh, vh = state[X_NOW] - shift - c[0], state[V_NOW] + response[H_W] * c[1]
    like = ALIKE_ROWS + 8 * int(way + 1.0) + (4 if balls[k, HEADING] > 0.0 else 0)
    bent = work[like + 3]
    if not bend(response, par, c, xh, vh, shift, way, work, like):
        return False, False
    guess = turns * (1.0 + bent[TURN_OFF])
    turned, ends = guess < s, min(longest, response[BENT])
    for _ in range(2):
        ball, soon = (-1, guess) if turned else (k, s)
        T, _ = cross(response, state, balls, c, ball, soon, ends, shift, way, bent)
        if turned:
            bent[TURN_OFF] = T / turns - 1.0 if T > 0.0 else 0.0
        if T > 0.0:
            return not turned, turned
        if not turned:
            break
        turned = False
    return False, False


@apart
def glide(
    given: Given, state: FloatArray, balls: FloatArray, longest: float, log: Log, work: FloatArray
) -> bool:
    """One flight in closed form, all balls sliding, and the impact after it.

    Or up to where the oscillator turns, if Coulomb friction acts on it. Whether it is proved: if
    not, nothing is changed.
    """
    response, par, c = given.response, given.par, work[PHASOR]
    n, first, k = balls.shape[0], int(state[LOGGED]), first_expected(balls, state[T_HIGH])
    if n == 1 and balls[0, STATE] >= TOUCHED and balls[0, LEFT] < longest:
        if par[P_COULOMB] != 0.0 or par[P_CUBIC] != 0.0 or par[P_QUADRATIC] != 0.0:
            return False
        force, _ = loads(balls)
        coast(response, state, balls, c, balls[0, LEFT], force / par[P_K])
        go_through(balls, par[P_M], state, log)
        complete(balls, par[P_M], state, log, first)
        return True
    if n == 0 or k < 0:
        return False
    for i in range(n):
        if may_hold(balls, i) or (balls[i, RUB] > 0.0 and balls[i, WAY] * balls[i, RHO] <= 0.0):
            return False
    if balls[k, TAU] > 0.0 and (par[P_CUBIC] != 0.0 or par[P_QUADRATIC] != 0.0):
        return False
    force, _ = loads(balls)
    soon, way, turns = (balls[k, EXPECTED] - state[T_HIGH]) - state[T_LOW], 0.0, math.inf
    if par[P_COULOMB] != 0.0 or par[P_QUADRATIC] != 0.0:
        way, turns = next_turn(response, par, state, c, force, work[0], work[1])
        if way == 0.0:
            return False
    shift = (force - way * par[P_COULOMB]) / par[P_K]
    if par[P_CUBIC] != 0.0 or par[P_QUADRATIC] != 0.0:
        landed, turned = cross_bent(
            response, par, state, balls, c, k, soon, longest, shift, way, turns, work
        )
        if not landed:
            return turned
    elif (
        turns < soon
        and cross(response, state, balls, c, -1, turns, longest, shift, way, None)[0] > 0.0
    ):
        return True
    elif cross(response, state, balls, c, k, soon, longest, shift, way, None)[0] == 0.0:
        return False
    for i in range(n):
        balls[i, HIT] = 1.0 if i == k else 0.0
    xh, vh = state[X_NOW] - shift - c[0], state[V_NOW] + response[H_W] * c[1]
    x2 = second(response, c[0], xh, vh)
    collide(balls, par[P_M], x2, state, log)
    for i in range(n):
        way = math.copysign(1.0, balls[i, RHO])
        if way != balls[i, WAY] and not may_hold(balls, i):
            balls[i, WAY] = way
            if balls[i, RUB] != 0.0:
                write(balls, i, SLIDE, state, log)
    complete(balls, par[P_M], state, log, first)
    return True


@compiled
def plain_turn(
    given: Given, closed: bool, piece: int, state: FloatArray, balls: FloatArray, log: Log,
    work: FloatArray,
) -> int:  # fmt: skip
    """One flight and the impact after it, one bounce, or one turn of the general loop: evaluations.

    The phasor in work[PHASOR] is carried along.
    """
    head, duration, c = given.response, given.duration, work[PHASOR]
    left, span = (duration - state[T_HIGH]) - state[T_LOW], (ENTRIES - 2) * head[H_SPACING]
    if closed and closing_now(balls, state[V_NOW]) == 0:
        xh, vh = state[X_NOW] - c[0], state[V_NOW] + head[H_W] * c[1]
        a = -(head[H_W] ** 2) * c[0] - head[H_W0SQ] * xh - head[H_TWOALPHA] * vh
        flown = 0
        if is_flight(balls, a, head[H_RATE], SHORT):
            flown = look_and_cross(head, state, balls, c, min(left, span))
        elif hop(head, state, balls, c, work[1], a, left, 1.0 / duration, given.remainder):
            flown = 1
        if flown > 0:
            if state[T_HIGH] >= duration or left <= EPS * duration:
                state[T_HIGH], state[T_LOW] = duration, 0.0
            elif closing_now(balls, state[V_NOW]) == 1:
                bounce(state, balls, int(balls[:, HIT].argmax()), given.par[P_M], log)
            return flown
    turn(given, piece, state, balls, log, work, None)
    if closed:
        c[0], c[1] = phasor(head, state[T_HIGH], state[T_LOW])
    return 1


@compiled
def next_piece(table: FloatArray, piece: int, t: float) -> int:
    """The piece of the base that holds t, from an earlier one on."""
    while piece + 1 < table.shape[0] and table[piece + 1, 0] <= t:
        piece += 1
    return piece


@compiled
def fly_on(
    given: Given, closed: bool, state: FloatArray, balls: FloatArray, c: FloatArray, log: Log,
    room: int, age: int,
) -> tuple[int, int]:  # fmt: skip
    """The fast way, from contact to contact as long as its proofs hold: evaluations, age."""
    response = given.response
    evaluations, span = 0, (ENTRIES - 2) * response[H_SPACING]
    while closed and balls.shape[0] > 0 and state[LOGGED] < room:
        k = first_expected(balls, state[T_HIGH])
        if k < 0:
            break
        left = (given.duration - state[T_HIGH]) - state[T_LOW]
        soon = (balls[k, EXPECTED] - state[T_HIGH]) - state[T_LOW]
        T, tries = cross(response, state, balls, c, k, soon, min(left, span), 0.0, 0.0, None)
        evaluations += tries
        if T == 0.0:
            break
        bounce(state, balls, k, given.par[P_M], log)
        age += 1
        if age >= REFRESH:
            c[0], c[1] = phasor(response, state[T_HIGH], state[T_LOW])
            age = 0
    return evaluations, age


@entry
def run(
    given: Given, closed: bool, state: FloatArray, balls: FloatArray, log: Log, work: FloatArray,
    weak: FloatArray | None,
) -> int:  # fmt: skip
    """Run to the end, until the log is full or ALLOWANCE is used; evaluations.

    Resume with the same arrays: the log is filled from its first row on, state[LOGGED] is their
    number. `closed` says that there is a closed form of the motion; without it every turn is one of
    the general loop. The log and `work` (WORK, order + 1), which is scratch space, are zeros at the
    start. `weak` is a row of it; None for a plain rig with light balls, whose loop is compiled
    without all others.
    """
    response, table, duration = given.response, given.table, given.duration
    evaluations, age, piece = 0, 0, piece_at(table, state[T_HIGH])
    room = log.numbers.shape[0] - 6 * balls.shape[0] - 4
    c, span = work[PHASOR], (ENTRIES - 2) * response[H_SPACING]
    for i in range(balls.shape[0]):
        balls[i, PERIOD] = 1.0 / response[H_FREQUENCY] if closed else 0.0
    c[0], c[1] = phasor(response, state[T_HIGH], state[T_LOW])
    state[LOGGED] = 0.0
    while state[LOGGED] < room and state[T_HIGH] < duration and evaluations < ALLOWANCE:
        used, flown = 1, False
        if weak is None:
            tries, age = fly_on(given, closed, state, balls, c, log, room, age)
            evaluations += tries
            piece = next_piece(table, piece, state[T_HIGH])
            used = plain_turn(given, closed, piece, state, balls, log, work)
        else:
            if closed:
                left = (duration - state[T_HIGH]) - state[T_LOW]
                flown = glide(given, state, balls, min(left, span), log, work)
            if not flown:
                piece = next_piece(table, piece, state[T_HIGH])
                turn(given, piece, state, balls, log, work, weak)
                age = REFRESH
        evaluations += used
        age += 1
        if closed and age >= REFRESH:
            c[0], c[1] = phasor(response, state[T_HIGH], state[T_LOW])
            age = 0
    return evaluations
