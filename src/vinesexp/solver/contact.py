"""What happens at a wall: impacts of one ball or several at once, chatter, contacts that last.

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

Friction (`events.py`) turns about at the top of every bounce, so that away from the wall and back
to it the ball has different accelerations relative to the wall: `out` and `back` = out - 2 mu g
(1 + m/M). A bounce that leaves with speed w rises w^2/(2 out) and returns with w sqrt(back/out), so
that the speeds of impact fall by q = r sqrt(back/out), and after an impact at speed c all further
bounces take

    c (r/out + q/back)/(1 - q)

together. With back <= 0 the ball stays where it has come to rest, and there is no chatter. With
several balls that chatter at the same instant the directions of the others' friction are taken as
they are now: the beginning of a rest is then known to the remainder itself, 1e-8 rad.

After that the ball is part of the oscillator (mass M + m) while the wall pushes it, S x'' > 0, and
leaves at the zero of x'', with a gap that opens like the third power of time.

A contact that lasts is a bounded-error scheme. It is solved in closed form for constant approach
(`touch`). Its momentum goes over at one instant, the middle of the force: before and after,
oscillator and ball move as if the force had been spread, and only within the contact their paths
are cut short. The error left is that of the forces that change during a contact;
docs/benchmarks/simulation.md has it measured. A ball that the wall's push would not let go stays on
the wall. One contact is a linear spring and dashpot in the wall. While ball and wall touch, the
overlap z and its rate obey

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
from vinesexp.solver.state import (
    AFTER,
    CLEARANCE,
    EXPECTED,
    FREE,
    HEADING,
    HIT,
    IMPACT,
    JUMP,
    LEAVING,
    LEFT,
    MASS,
    PERIOD,
    R_MINUS,
    R_PLUS,
    R_SLOPE,
    REMEMBERED,
    REST_END,
    RESTING,
    RESTITUTION,
    RHO,
    RUB,
    SIDE,
    SIDES,
    STATE,
    STUCK,
    TAU,
    TILT,
    TIMES,
    TOUCHED,
    V_NOW,
    A,
    D,
    Log,
    U,
    write_event,
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
    speed of the next impact, so that an impact worth noting is never taken for the end of a chatter
    (with r = 0 it would be the only one). Bounces that last less than UNSEEN are rest for any r, 1
    included: no clock resolves them.
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
def close_chatter(
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


ALIKE = 0.1  # of a period, by which a contact may be off the time of one a period ago
STEADY = 0.005  # of a period: flights that differ by less count as alike
BRIEF = 0.05  # of a period: 0.3 rad, the reach of `kernel.hop`


@compiled
def expect(balls: FloatArray, k: int, now: float) -> None:
    """Guess the next contact of ball k, which meets a wall now.

    What followed a period ago, when the ball met the same wall, follows again; without such a
    contact, or where flights are alike, the next goes across and lasts as long as the last. A
    return to the same wall within BRIEF is left to `hop`, which needs no guess.
    """
    period, side = balls[k, PERIOD], balls[k, SIDE]
    flight, heading = 0.0, -side
    if balls[k, SIDES] == -side:
        flight = now - balls[k, TIMES]
    for j in range(1, REMEMBERED):
        past = balls[k, TIMES + j]
        if balls[k, SIDES + j] == side and abs(now - past - period) < ALIKE * period:
            then, heading = balls[k, TIMES + j - 1] - past, balls[k, SIDES + j - 1]
            if heading == side or abs(then - flight) > STEADY * period:
                flight = then
            break
    if heading == side and flight < BRIEF * period:
        flight = 0.0
    balls[k, EXPECTED], balls[k, HEADING] = now + flight, heading
    for j in range(REMEMBERED - 1, 0, -1):
        balls[k, TIMES + j], balls[k, SIDES + j] = balls[k, TIMES + j - 1], balls[k, SIDES + j - 1]
    balls[k, TIMES], balls[k, SIDES] = now, side


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
def go_through(balls: FloatArray, M: float, state: FloatArray, log: Log) -> None:
    """Exchange the momentum of contacts that are in their middle, end those at their end."""
    for i in range(balls.shape[0]):
        if balls[i, STATE] == TOUCHED and balls[i, LEFT] <= 0.0:
            exchange(balls, i, M, state, log)
            balls[i, STATE], balls[i, LEFT] = LEAVING, balls[i, AFTER]
        elif balls[i, STATE] == LEAVING and balls[i, LEFT] <= 0.0:
            balls[i, STATE], balls[i, D] = FREE, 0.0


@compiled
def exchange(balls: FloatArray, i: int, M: float, state: FloatArray, log: Log) -> None:
    """Give ball i and the oscillator the momentum of their contact; balls at rest are let go."""
    v, u = state[V_NOW], balls[i, U]
    dv = -balls[i, SIDE] * balls[i, JUMP] * balls[i, MASS] / (balls[i, MASS] + M)
    now = v + dv
    state[V_NOW] = now
    for j in range(balls.shape[0]):
        if j != i:
            balls[j, RHO] += dv
        if balls[j, STATE] == RESTING:
            balls[j, STATE], balls[j, U] = FREE, v
            write_event(state, log, REST_END, j, balls[j, SIDE], v, now, v, v)
    balls[i, RHO] -= balls[i, SIDE] * balls[i, JUMP]
    balls[i, U] = now - balls[i, RHO]
    write_event(state, log, IMPACT, i, balls[i, SIDE], v, now, u, balls[i, U])
