"""What an impact does: one rule for one ball or several at once.

The rule for simultaneous impacts is equations (3), (4) of docs/theory.md for all balls of the set
at once: every ball that closes on its wall leaves it with -r times its relative velocity, and
momentum is kept,

    dv = -sum m_i (1 + r_i) rho_i / (M + sum m_i).

Walls only push: a ball that would have to be pulled is not part of the set, and balls resting on
a wall are part of it exactly if dv presses the wall on them. With unequal r and balls as heavy as
the oscillator this rule (Newton's) could raise the kinetic energy; then all r of the set are scaled
by the one factor that keeps it. Sums only: the order of the balls does not enter.
"""

from __future__ import annotations

import math

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import compiled
from vinesexp.solver.state import FREE, HIT, MASS, RESTING, RESTITUTION, RHO, SIDE, STATE, D, U

NEGLIGIBLE = 1e-17  # relative speed over speed: a tenth of what rounding leaves of the latter


@compiled
def closing_now(balls: FloatArray, v: float) -> int:
    """Mark the balls that touch a wall and close on it; their number.

    Two balls at opposite walls can pass an impulse to and fro infinitely often in one instant, each
    time weaker. It ends where the relative speed is below the rounding of the speeds themselves:
    such a ball touches without speed.
    """
    count = 0
    for i in range(balls.shape[0]):
        balls[i, HIT] = 0.0
        if balls[i, STATE] != RESTING and balls[i, D] <= 0.0:
            if abs(balls[i, RHO]) <= NEGLIGIBLE * (abs(v) + abs(balls[i, U])) + 1e-300:
                balls[i, RHO] = 0.0
            elif balls[i, SIDE] * balls[i, RHO] > 0.0:
                balls[i, HIT] = 1.0
                count += 1
    return count


@compiled
def velocity_jump(balls: FloatArray, M: float, scale: float) -> float:
    """Velocity jump of the oscillator for the marked balls, all r times `scale`."""
    momentum, mass = 0.0, M
    for i in range(balls.shape[0]):
        if balls[i, HIT] == 1.0:
            momentum += balls[i, MASS] * (1.0 + scale * balls[i, RESTITUTION]) * balls[i, RHO]
            mass += balls[i, MASS]
    for i in range(balls.shape[0]):
        if balls[i, STATE] == RESTING and -balls[i, SIDE] * momentum > 0.0:
            mass += balls[i, MASS]
    return -momentum / mass


@compiled
def energy_scale(balls: FloatArray, M: float, dv: float) -> float:
    """Factor on all r that keeps the kinetic energy from rising (1 where it does not rise)."""
    mass, p, p_r, e, e_r = M, 0.0, 0.0, 0.0, 0.0
    for i in range(balls.shape[0]):
        if balls[i, HIT] == 1.0:
            m, rho, back = balls[i, MASS], balls[i, RHO], balls[i, RESTITUTION] * balls[i, RHO]
            mass += m
            p += m * rho
            e += m * rho * rho
            p_r += m * back
            e_r += m * back * back
        elif balls[i, STATE] == RESTING and balls[i, SIDE] * dv > 0.0:
            mass += balls[i, MASS]
    # Twice the kinetic energy in the frame of the common centre of mass.
    before, after = e - p * p / mass, e_r - p_r * p_r / mass
    if after > before:
        return math.sqrt(max(before, 0.0) / after)
    return 1.0


@compiled
def impact(balls: FloatArray, M: float) -> float:
    """Carry out the impact of the marked balls; the velocity jump of the oscillator.

    Marks that are still set afterwards say which balls were pushed.
    """
    n = balls.shape[0]
    count = 0
    while True:
        dv = velocity_jump(balls, M, 1.0)
        count, pulled = 0, 0
        for i in range(n):
            if balls[i, HIT] == 1.0:
                count += 1
                bounce = (1.0 + balls[i, RESTITUTION]) * balls[i, RHO]
                # A ball far heavier than the oscillator takes dv = -bounce: no pull but rounding.
                if balls[i, SIDE] * (dv + bounce) < -1e-14 * abs(bounce):
                    balls[i, HIT] = 0.0
                    pulled += 1
        if pulled == 0:
            break
    scale = 1.0
    if count > 1:
        scale = energy_scale(balls, M, dv)
        if scale < 1.0:
            dv = velocity_jump(balls, M, scale)
    for i in range(n):
        if balls[i, HIT] == 1.0:
            balls[i, RHO] *= -scale * balls[i, RESTITUTION]
            balls[i, D] = 0.0
            balls[i, STATE] = FREE
        elif balls[i, STATE] != RESTING:
            balls[i, RHO] += dv
        elif balls[i, SIDE] * dv <= 0.0:  # the wall draws back from the ball
            balls[i, RHO] = dv
            balls[i, STATE] = FREE
    return dv


@compiled
def resting_mass(balls: FloatArray) -> float:
    """Mass of the balls that rest on a wall and move with the oscillator, kg."""
    mass = 0.0
    for i in range(balls.shape[0]):
        if balls[i, STATE] == RESTING:
            mass += balls[i, MASS]
    return mass
