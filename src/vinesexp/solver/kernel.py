"""The event loop, and its fast way: harmonic base (or none) and linear damping, in closed form.

Flights between walls are covered in a few evaluations of the closed form (`response.py`) by steps
that are certain to pass no contact (`search.py`), the bounces of a chatter by a series each
(`flight.hop`). What is neither, that is the end of a chatter, rest, release, several balls at once
and starts on a wall, is one turn of the general loop (`events.py`), which holds those rules alone.
The general loop, which knows nothing of this one, is its test.
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import apart, compiled, entry
from vinesexp.solver.contact import closing_now
from vinesexp.solver.events import turn
from vinesexp.solver.flight import SHORT, bounce, cross, first_expected, hop
from vinesexp.solver.response import (
    ENTRIES,
    H_FREQUENCY,
    H_MISFIT,
    H_P,
    H_RATE,
    H_SPACING,
    H_TWOALPHA,
    H_W,
    H_W0SQ,
    after,
    phasor,
)
from vinesexp.solver.search import EPS, certain_step, guess, landing, open_until
from vinesexp.solver.series import piece_at
from vinesexp.solver.state import (
    ALLOWANCE,
    CLEARANCE,
    EXPECTED,
    FREE,
    GAP,
    HIT,
    MASS,
    PERIOD,
    RATE,
    RHO,
    ROOT,
    SIDE,
    STATE,
    T_HIGH,
    T_LOW,
    V_NOW,
    WALL,
    X_NOW,
    D,
    IntArray,
    advance_clock,
    carry,
)

LANDED = 1e-8  # rad: from here one Newton step is exact to rounding (its error is the square)
LONGEST = 3.0  # rad: no longer step is tried, the bound would only get worse
NEAR = 0.06  # rad: from here the fifth-order guess lands within LANDED
MOST = 1000  # steps of one flight, which may end early
REFRESH = 64  # flights after which the turned phasor, which gathers rounding, is taken afresh
DRAWN_BACK = 0.999  # so that a guessed step can be proved


@compiled
def is_flight(balls: FloatArray, acceleration: float, rate: float) -> bool:
    """Whether every ball flies, and none comes straight back to the wall it left."""
    for i in range(balls.shape[0]):
        if balls[i, STATE] != FREE:
            return False
        a = balls[i, SIDE] * acceleration
        away = -balls[i, SIDE] * balls[i, RHO]
        if balls[i, D] <= 0.0 and away <= 0.0:
            return False
        if a > 0.0:
            back = away + math.sqrt(away * away + 2.0 * a * balls[i, D])
            if back * rate < SHORT * a:
                return False
    return True


@compiled
def only_hit(balls: FloatArray) -> int:
    """The one ball that is marked."""
    for i in range(balls.shape[0]):
        if balls[i, HIT] == 1.0:
            return i
    return -1


@compiled
def landed(balls: FloatArray, s: float, rate: float, bend: float, gain: float) -> float:
    """Fill GAP and RATE; time of the contact that is at most LANDED rad away, inf if none."""
    hit = math.inf
    for i in range(balls.shape[0]):
        side = balls[i, SIDE]
        g = balls[i, D] - side * (balls[i, RHO] * s + bend)
        g1 = -side * (balls[i, RHO] + gain)
        balls[i, GAP], balls[i, RATE], balls[i, ROOT] = g, g1, math.inf
        if s == 0.0:
            continue
        wall = side
        if g1 > 0.0:
            g, g1, wall = 2.0 * balls[i, CLEARANCE] - g, -g1, -side
        if g1 < 0.0 and g * rate <= -LANDED * g1:
            root = s - g / g1
            balls[i, ROOT], balls[i, WALL] = root, wall
            hit = min(hit, root)
    return hit


@apart
def choose_step(
    balls: FloatArray, rate: float, a: float, j: float, f: float, S: float, reach: float
) -> float:
    """A step that passes no contact, or that lands on the first one (module `walls`)."""
    n = balls.shape[0]
    step, lands = reach, -1
    for i in range(n):
        g, g1, toward = balls[i, GAP], balls[i, RATE], balls[i, SIDE]
        if g1 > 0.0:
            g, g1, toward = 2.0 * balls[i, CLEARANCE] - g, -g1, -toward
        d = guess(g, g1, -toward * a, -toward * j, S, step)
        if d >= step:
            continue
        exact = 0.0
        if d * rate < NEAR:
            exact = landing(g, g1, -toward * a, -toward * j, -toward * f, S, d, reach)
        if exact > 0.0:
            if exact < step:
                step, lands = exact, i
        else:
            step, lands = DRAWN_BACK * d, -1
    proved = step > 0.0
    for i in range(n):
        g, g1, side = balls[i, GAP], balls[i, RATE], balls[i, SIDE]
        if i != lands or g1 > 0.0:
            proved = proved and open_until(max(g, 0.0), g1, -side * a, -side * j, S, step)
        if i != lands or g1 <= 0.0:
            wide = 2.0 * balls[i, CLEARANCE]
            proved = proved and open_until(wide - g, -g1, side * a, side * j, S, step)
    if proved:
        return step
    step = reach
    for i in range(n):
        g, g1, side = max(balls[i, GAP], 0.0), balls[i, RATE], balls[i, SIDE]
        step = certain_step(g, g1, -side * a, -side * j, S, step)
        wide = 2.0 * balls[i, CLEARANCE] - balls[i, GAP]
        step = certain_step(max(wide, 0.0), -g1, side * a, side * j, S, step)
    return step


@compiled
def fly_to(state: FloatArray, balls: FloatArray, x: float, v: float, s: float) -> None:
    """Set clock, oscillator and balls to `s` seconds on; ROOT says who is at a wall."""
    bend, gain = x - state[X_NOW] - state[V_NOW] * s, v - state[V_NOW]
    advance_clock(state, s)
    state[X_NOW], state[V_NOW] = x, v
    tie = s + max(4.0 * EPS * s, 0.5 * EPS * state[T_HIGH])
    for i in range(balls.shape[0]):
        gap = carry(balls, i, v, s, bend, gain)
        if balls[i, ROOT] <= tie:
            balls[i, SIDE], gap = balls[i, WALL], 0.0
        elif gap > balls[i, CLEARANCE]:
            # Measured from the nearer wall, so that a landing there loses no digits.
            balls[i, SIDE] = -balls[i, SIDE]
            gap = 2.0 * balls[i, CLEARANCE] - gap
        balls[i, D] = max(gap, 0.0)


@compiled
def fly(
    response: FloatArray, state: FloatArray, balls: FloatArray, c: FloatArray, longest: float
) -> int:
    """Fly to the first contact, or `longest` seconds, whichever is first; evaluations used.

    `c` is the phasor of the particular response at the present time.
    """
    head = response
    w, w0sq, two_alpha, rate = head[H_W], head[H_W0SQ], head[H_TWOALPHA], head[H_RATE]
    w2, misfit = w * w, head[H_MISFIT]
    w4P = w2 * w2 * head[H_P]
    x0, v0 = state[X_NOW], state[V_NOW]
    xh0, vh0 = x0 - c[0], v0 + w * c[1]
    cr, ci, xh, vh = c[0], c[1], xh0, vh0
    s, count = 0.0, 0
    while True:
        ah = -two_alpha * vh - w0sq * xh
        jh = -two_alpha * ah - w0sq * vh
        a, j = ah - w2 * cr, jh + w2 * w * ci
        hit = landed(balls, s, rate, (cr + xh) - x0 - v0 * s, (vh - w * ci) - v0)
        if count >= MOST:
            longest = s
        if hit < math.inf or s >= longest:
            break
        fh = -two_alpha * jh - w0sq * ah
        gh = -two_alpha * fh - w0sq * jh
        f, df = fh + w2 * w2 * cr, gh / w - w2 * w2 * ci
        free = math.sqrt(fh * fh + gh * gh / w0sq)
        reach = min(LONGEST / rate, longest - s)
        S = min(math.sqrt(f * f + df * df) + reach * free * misfit, w4P + free)
        step = choose_step(balls, rate, a, j, f, S, reach)
        # A gap and a rate that are both zero to rounding must not hold the search up.
        s = min(s + max(step, 4.0 * EPS * (s + 1.0 / rate)), longest)
        count += 1
        cr, ci, xh, vh = after(response, c[0], c[1], xh0, vh0, s)
    # Land: at most LANDED rad away, so three terms carry the state there to rounding.
    d = min(hit, longest) - s
    turned = w * d
    c[0], c[1] = cr - turned * (ci + 0.5 * turned * cr), ci + turned * (cr - 0.5 * turned * ci)
    x, v = cr + xh, vh - w * ci
    fly_to(state, balls, x + d * (v + 0.5 * d * a), v + d * (a + 0.5 * d * j), s + d)
    return count


@compiled
def one_turn(
    closed: bool, light: bool, response: FloatArray, par: FloatArray, kind: int,
    table: FloatArray, piece: int, duration: float, remainder: float, state: FloatArray,
    balls: FloatArray, numbers: FloatArray, labels: IntArray, row: int, work: FloatArray,
    before: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """One flight and the impact after it, one bounce, or one turn of the general loop.

    Rows written so far, and evaluations; the phasor in `work[3]` is carried along.
    """
    head, c = response, work[3]
    left, span = (duration - state[T_HIGH]) - state[T_LOW], (ENTRIES - 2) * head[H_SPACING]
    if closed and closing_now(balls, state[V_NOW]) == 0:
        xh, vh = state[X_NOW] - c[0], state[V_NOW] + head[H_W] * c[1]
        a = -(head[H_W] ** 2) * c[0] - head[H_W0SQ] * xh - head[H_TWOALPHA] * vh
        flown = 0
        if is_flight(balls, a, head[H_RATE]):
            flown = fly(response, state, balls, c, min(left, span))
        elif light and hop(head, state, balls, c, work[1], a, left, 1.0 / duration, remainder):
            flown = 1
        if flown > 0:
            if state[T_HIGH] >= duration or left <= EPS * duration:
                state[T_HIGH], state[T_LOW] = duration, 0.0
            elif light and closing_now(balls, state[V_NOW]) == 1:
                row = bounce(state, balls, only_hit(balls), par[0], numbers, labels, row)
            return row, flown
    row = turn(
        par, kind, table, piece, duration, remainder, state, balls, numbers, labels, row,
        work, before,
    )  # fmt: skip
    if closed:
        c[0], c[1] = phasor(head, state[T_HIGH], state[T_LOW])
    return row, 1


@entry
def run(
    closed: bool, response: FloatArray, par: FloatArray, kind: int, table: FloatArray,
    duration: float, remainder: float, state: FloatArray, balls: FloatArray, numbers: FloatArray,
    labels: IntArray, work: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """Run to `duration`, until the log is full or ALLOWANCE is used: rows written, evaluations.

    Resume with the same arrays. `closed` says that `response` holds the closed form of the motion;
    without it every turn is one of the general loop. `work` (4, ORDER + 1) is scratch space,
    zeros at the start.
    """
    before = np.empty(balls.shape[0])
    return run_on(
        closed, response, par, kind, table, duration, remainder, state, balls, numbers, labels,
        work, before,
    )  # fmt: skip


@apart
def run_on(
    closed: bool, response: FloatArray, par: FloatArray, kind: int, table: FloatArray,
    duration: float, remainder: float, state: FloatArray, balls: FloatArray, numbers: FloatArray,
    labels: IntArray, work: FloatArray, before: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """`run`, with its scratch space."""
    row = int(np.int64(0))  # a literal 0 would be a type of its own, with machine code of its own
    evaluations, age, piece = 0, 0, piece_at(table, state[T_HIGH])
    room = numbers.shape[0] - 2 * balls.shape[0] - 2
    head, c = response, work[3]
    light, span = closed and balls.shape[0] > 0, (ENTRIES - 2) * head[H_SPACING]
    for i in range(balls.shape[0]):
        light = light and balls[i, MASS] <= par[0]
        balls[i, PERIOD] = 1.0 / head[H_FREQUENCY] if closed else 0.0
    c[0], c[1] = phasor(head, state[T_HIGH], state[T_LOW])
    while row < room and state[T_HIGH] < duration and evaluations < ALLOWANCE:
        # The fast way, as long as its proofs hold.
        while light and row < room:
            k = first_expected(balls, state[T_HIGH])
            if k < 0:
                break
            left = (duration - state[T_HIGH]) - state[T_LOW]
            soon = (balls[k, EXPECTED] - state[T_HIGH]) - state[T_LOW]
            T, tries = cross(response, state, balls, c, k, soon, min(left, span), 0.0, 0.0)
            evaluations += tries
            if T == 0.0:
                break
            row = bounce(state, balls, k, par[0], numbers, labels, row)
            age += 1
            if age >= REFRESH:
                c[0], c[1] = phasor(head, state[T_HIGH], state[T_LOW])
                age = 0
        while piece + 1 < table.shape[0] and table[piece + 1, 0] <= state[T_HIGH]:
            piece += 1
        row, used = one_turn(
            closed, light, response, par, kind, table, piece, duration, remainder, state, balls,
            numbers, labels, row, work, before,
        )  # fmt: skip
        evaluations += used
        age += 1
        if closed and age >= REFRESH:
            c[0], c[1] = phasor(head, state[T_HIGH], state[T_LOW])
            age = 0
    return row, evaluations
