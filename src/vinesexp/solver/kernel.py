"""The event loop, and its fast way: harmonic base (or none) and linear damping, in closed form.

Flights between walls are covered in a few evaluations of the closed form (`response.py`), found by
a guess and then proved to pass no contact, the bounces of a chatter by a series each (`flight.py`).
What is neither, that is the end of a chatter, rest, release, several balls at once, starts on a
wall and what cannot be proved, is one turn of the general loop (`events.py`), which holds those
rules alone. The general loop, which knows nothing of this one, is its test.
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import apart, compiled, entry
from vinesexp.solver.contact import closing_now
from vinesexp.solver.events import turn
from vinesexp.solver.flight import SHORT, bounce, cross, first_expected, hop, look_and_cross
from vinesexp.solver.response import (
    ENTRIES,
    H_FREQUENCY,
    H_RATE,
    H_SPACING,
    H_TWOALPHA,
    H_W,
    H_W0SQ,
    phasor,
)
from vinesexp.solver.search import EPS
from vinesexp.solver.series import piece_at
from vinesexp.solver.state import (
    ALLOWANCE,
    EXPECTED,
    FREE,
    HIT,
    MASS,
    PERIOD,
    RHO,
    SIDE,
    STATE,
    T_HIGH,
    T_LOW,
    V_NOW,
    X_NOW,
    D,
    IntArray,
)

REFRESH = 64  # flights after which the turned phasor, which gathers rounding, is taken afresh


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
            flown = look_and_cross(response, state, balls, c, min(left, span))
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
            T, tries = cross(response, state, balls, c, k, soon, min(left, span), 0.0, 0.0, None)
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
