"""What happens at a wall: impacts of one ball or several at once, chatter, rest.

The rule for simultaneous impacts is equations (3), (4) of docs/theory.md for all balls of the set
at once: every ball that closes on its wall leaves it with -r times its relative velocity, and
momentum is kept,

    dv = -sum m_i (1 + r_i) rho_i / (M + sum m_i).

Walls only push: a ball that would have to be pulled is not part of the set, and balls resting on
a wall are part of it exactly if dv presses the wall on them. With unequal r and balls as heavy as
the oscillator this rule (Newton's) could raise the kinetic energy; then all r of the set are scaled
by the one factor that keeps it. Sums only: the order of the balls does not enter.

A chatter is carried to its accumulation point, where the rest on a wall starts.

While the wall pushes (S x'' = a > 0, S the side) a ball with r < 1 bounces infinitely often in
finite time: with a constant over the remaining bounces, the next impact comes after

    tau = (w + sqrt(w^2 + 2 a d))/a      w: speed away from the wall, d: gap

at speed c = sqrt(w^2 + 2 a d), and all that follow take 2 r c/(a (1 - r)) together, a geometric
series. Bounces are computed one by one, with their own exact flights, until the remaining time T is
so short that the sum is exact in double precision: a changes over T by the relative amount T
x'''/x'', so the error of T is T times that, and the error of the state after T is of second order
in T as well, because momentum fixes the common velocity. With T rate <= REMAINDER = 1e-8 both are
below 1e-16 of the system's own time and velocity: rounding. REMAINDER is no cut-off of the physics;
the tests show that results stop depending on it long before this value.

After that the ball is part of the oscillator (mass M + m) while the wall pushes it, S x'' > 0, and
leaves at the zero of x'', with a gap that opens like the third power of time.
"""

from __future__ import annotations

import math

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import compiled
from vinesexp.solver.state import (
    CLEARANCE,
    FREE,
    HIT,
    MASS,
    RESTING,
    RESTITUTION,
    RHO,
    SIDE,
    STATE,
    TOUCHED,
    D,
    U,
)

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
        held = balls[i, STATE] == RESTING or balls[i, STATE] >= TOUCHED
        if not held and balls[i, D] <= 0.0:
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


REMAINDER = 1e-8
UNSEEN = 1e-15  # rad


@compiled
def remaining_time(ball: FloatArray, a: float, own_rate: float) -> float:
    """Time to the accumulation point of one ball's chatter under constant acceleration, s.

    No less than the time in which the wall gains the speed of the next impact, so that an impact
    worth noting is never taken for the end of a chatter (with r = 0 it would be the only one).
    Bounces that last less than UNSEEN are rest for any r, 1 included: no clock resolves them.
    """
    if a <= 0.0:
        return math.inf
    away, r = -ball[SIDE] * ball[RHO], ball[RESTITUTION]
    speed = math.sqrt(away * away + 2.0 * a * ball[D])
    last: float = (away + speed) / a
    if speed * own_rate <= UNSEEN * a:
        return last
    if r >= 1.0:
        return math.inf
    longest: float = max(away + speed + 2.0 * r * speed / (1.0 - r), speed)
    return longest / a


@compiled
def close_chatter(
    balls: FloatArray, mass: float, rate: float, x2: float, x3: float, v: float, remainder: float
) -> tuple[float, float, float]:
    """Carry every chatter at its end to rest at once: duration T, change of x, change of v.

    `x2`, `x3` are second and third derivative of x, `mass` that of the oscillator with the resting
    balls. T = -1: there is none, or another ball could meet a wall before its end. HIT marks those
    that were closed.
    """
    n = balls.shape[0]
    T, momentum, offset, total = -1.0, 0.0, 0.0, mass
    if x2 == 0.0:
        return -1.0, 0.0, 0.0
    own_rate, rate = rate, max(rate, abs(x3 / x2))
    for i in range(n):
        balls[i, HIT] = 0.0
        if balls[i, STATE] == FREE:
            left = remaining_time(balls[i], balls[i, SIDE] * x2, own_rate)
            if left * rate <= remainder:
                balls[i, HIT] = 1.0
                T = max(T, left)
                momentum += balls[i, MASS] * balls[i, RHO]
                offset += balls[i, MASS] * balls[i, SIDE] * balls[i, D]
                total += balls[i, MASS]
    if T < 0.0:
        return -1.0, 0.0, 0.0
    for i in range(n):
        if balls[i, STATE] != RESTING and balls[i, HIT] == 0.0:
            reach = abs(balls[i, RHO]) * T + abs(x2) * T * T
            if balls[i, D] <= reach or 2.0 * balls[i, CLEARANCE] - balls[i, D] <= reach:
                return -1.0, 0.0, 0.0
    dv = (-momentum + mass * x2 * T) / total
    # The walls' push on the group over T moves x by `shift` more than uniform motion would.
    shift = (-momentum * T + 0.5 * mass * x2 * T * T + offset) / total
    for i in range(n):
        if balls[i, HIT] == 1.0:
            balls[i, STATE] = RESTING
            balls[i, RHO] = 0.0
            balls[i, D] = 0.0
        elif balls[i, STATE] != RESTING:
            balls[i, D] -= balls[i, SIDE] * (balls[i, RHO] * T + shift)
            balls[i, RHO] += dv
            balls[i, STATE] = FREE
    return T, v * T + shift, dv


@compiled
def settle(balls: FloatArray, X: FloatArray) -> int:
    """Mark (HIT) and put to rest the balls that touch a wall without speed while it pushes them.

    The first derivative of x from the second on that is not zero decides; none (nothing moves):
    rest.
    """
    count = 0
    for i in range(balls.shape[0]):
        balls[i, HIT] = 0.0
        if balls[i, STATE] != RESTING and balls[i, D] <= 0.0 and balls[i, RHO] == 0.0:
            n = 2 if balls[i, STATE] == FREE else 3  # at a release x'' is zero by definition
            while n < X.shape[0] - 1 and X[n] == 0.0:
                n += 1
            if balls[i, SIDE] * X[n] >= 0.0:
                balls[i, STATE] = RESTING
                balls[i, HIT] = 1.0
                count += 1
    return count


@compiled
def release(balls: FloatArray, v: float, state: float) -> int:
    """Let go every resting ball (all rest on the same side: that on which the wall pushes).

    `state` is RELEASED where x'' has come to zero, FREE where a force that jumped (the damper's at
    the impact of another ball) has ended the push at once.
    """
    count = 0
    for i in range(balls.shape[0]):
        balls[i, HIT] = 0.0
        if balls[i, STATE] == RESTING:
            balls[i, STATE] = state
            balls[i, D] = 0.0
            balls[i, RHO] = 0.0
            balls[i, U] = v
            balls[i, HIT] = 1.0
            count += 1
    return count
