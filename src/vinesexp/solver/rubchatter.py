"""Chatter of a ball that rubs, or whose r is not constant, carried to its accumulation point.

As in `chatter.py`, but away from the wall and back to it the ball has different accelerations
relative to the wall, because friction turns about at the top of every bounce: `out` and `back` =
out - 2 mu g (1 + m/M). A bounce that leaves with speed w rises w^2/(2 out) and returns with
w sqrt(back/out), so that the speeds of impact fall by q = r sqrt(back/out), and after an impact at
speed c all further bounces take

    c (r/out + q/back)/(1 - q)

together. With back <= 0 the ball stays where it has come to rest, and there is no chatter. With
several balls that chatter at the same instant the directions of the others' friction are taken as
they are now: the beginning of a rest is then known to the remainder itself, 1e-8 rad.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vinesexp.solver.chatter import UNSEEN
from vinesexp.solver.compiled import compiled
from vinesexp.solver.state import (
    CLEARANCE,
    FREE,
    HIT,
    MASS,
    R_MINUS,
    R_PLUS,
    R_SLOPE,
    RESTING,
    RESTITUTION,
    RHO,
    RUB,
    SIDE,
    STATE,
    STUCK,
    A,
    D,
    U,
)

FloatArray = NDArray[np.float64]


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
    speed of the next impact (see `chatter.remaining_time`).
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
        if balls[i, STATE] == FREE:
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
