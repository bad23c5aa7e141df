"""Contacts that last: a bounded-error scheme, part of the loop of `rubbing.py`.

A contact is solved in closed form for constant approach (`touch`). Its momentum goes over
at one instant, the middle of the force: before and after, oscillator and ball move as if the force
had been spread, and only within the contact their paths are cut short. The error left is that of
the forces that change during a contact; docs/benchmarks/simulation.md has it measured. A ball that
the wall's push would not let go stays on the wall.

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

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import apart, compiled
from vinesexp.solver.flight import expect
from vinesexp.solver.state import (
    AFTER,
    FREE,
    IMPACT,
    JUMP,
    LEAVING,
    LEFT,
    MASS,
    REST_END,
    RESTING,
    RESTITUTION,
    RHO,
    SIDE,
    STATE,
    T_HIGH,
    TAU,
    TILT,
    TOUCHED,
    V_NOW,
    X_NOW,
    D,
    IntArray,
    U,
    write_event,
)

#: Least restitution: a contact without any rebound would last for ever.
LEAST_R = 1e-3
MOST = 60  # steps to the end of a contact, which take about three
LAST = 1e-8  # of its duration, the last one: the error of Newton's rule is its square


@compiled
def overlap(t: float, rho: float, g: float, a: float, wd: float) -> tuple[float, float]:
    """z and z' of the module's equation."""
    still, decay, c, s = g / (wd * wd + a * a), math.exp(-a * t), math.cos(wd * t), math.sin(wd * t)
    return (
        still + decay * ((rho - a * still) / wd * s - still * c),
        decay * (rho * c + (g - a * rho) / wd * s),
    )


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
    if g > 0.0 and overlap(high, rho, g, a, wd)[0] >= 0.0:
        return math.inf, 0.0, rho
    # As it ends without g, and what g adds at the speed of that end.
    t = tau + g * (1.0 + r) / ((wd * wd + a * a) * max(r, LEAST_R) * rho)
    t, rate = min(max(t, 0.5 * (low + high)), high), 0.0
    for _ in range(MOST):
        z, rate = overlap(t, rho, g, a, wd)
        low, high = (t, high) if z > 0.0 else (low, t)
        step = t - z / rate
        if abs(step - t) <= LAST * t:
            rate += (step - t) * (g - 2.0 * a * rate - (wd * wd + a * a) * z)
            t = step
            break
        t = step if low < step < high else 0.5 * (low + high)
    jump = rho + g * t - rate
    return t, t - (rho + 0.5 * g * t) * t / jump, jump


@apart
def lasts(balls: FloatArray, i: int, x2: float, now: float) -> bool:
    """Solve the contact that ball i begins under x''; False: it stays at the wall (r = 0)."""
    side = balls[i, SIDE]
    duration, centre, jump = touch(
        side * balls[i, RHO], side * (x2 - balls[i, TILT]), balls[i, RESTITUTION], balls[i, TAU]
    )
    if duration == math.inf:
        balls[i, RESTITUTION] = 0.0
        return False
    expect(balls, i, now)
    balls[i, STATE], balls[i, JUMP] = TOUCHED, jump
    balls[i, LEFT], balls[i, AFTER] = centre, duration - centre
    return True


@apart
def go_through(
    balls: FloatArray, M: float, state: FloatArray, numbers: FloatArray, labels: IntArray, row: int
) -> int:
    """Exchange the momentum of contacts that are in their middle, end those at their end."""
    for i in range(balls.shape[0]):
        if balls[i, STATE] == TOUCHED and balls[i, LEFT] <= 0.0:
            row = exchange(balls, i, M, state, numbers, labels, row)
            balls[i, STATE], balls[i, LEFT] = LEAVING, balls[i, AFTER]
        elif balls[i, STATE] == LEAVING and balls[i, LEFT] <= 0.0:
            balls[i, STATE], balls[i, D] = FREE, 0.0
    return row


@compiled
def exchange(
    balls: FloatArray, i: int, M: float, state: FloatArray, numbers: FloatArray, labels: IntArray,
    row: int,
) -> int:  # fmt: skip
    """Give ball i and the oscillator the momentum of their contact; balls at rest are let go."""
    v, u, x, t = state[V_NOW], balls[i, U], state[X_NOW], state[T_HIGH]
    dv = -balls[i, SIDE] * balls[i, JUMP] * balls[i, MASS] / (balls[i, MASS] + M)
    now = v + dv
    state[V_NOW] = now
    for j in range(balls.shape[0]):
        if j != i:
            balls[j, RHO] += dv
        if balls[j, STATE] == RESTING:
            balls[j, STATE], balls[j, U] = FREE, v
            labels[row, 0] = REST_END
            row = write_event(numbers, labels, row, j, balls[j, SIDE], t, x, v, now, v, v)
    balls[i, RHO] -= balls[i, SIDE] * balls[i, JUMP]
    balls[i, U] = now - balls[i, RHO]
    labels[row, 0] = IMPACT
    return write_event(numbers, labels, row, i, balls[i, SIDE], t, x, v, now, u, balls[i, U])
