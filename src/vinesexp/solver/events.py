"""Event loop on power series: any base motion, any number of balls, friction, tilt, weak damping.

State between events: time as a sum of two floats (so that 1e7 flights add up without drift), x, v
and the table of balls (`state.py`). One turn of the loop expands the motion at the present state
(`series.py`), finds the first event on the segment (`search.py`), moves everything there and
carries out what happens: a ball meets a wall, a ball that slides comes to rest on its floor
(`next_stop`), a held ball slips (`next_slip`). A ball that slides has the constant acceleration a =
tilt + mu g d, d = `way` the sign of x' - y': the floor drags it along, and it drags the oscillator
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

Friction turns about at the top of every bounce, so that away from the wall and back
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
from vinesexp.solver.compiled import apart, compiled, fused
from vinesexp.solver.search import EPS, clear_between, first_root, most_of_fourth
from vinesexp.solver.series import (
    expand,
    expand_base,
    from_power,
    is_at_rest,
    own_rate,
    spring_force,
)
from vinesexp.solver.state import (
    FREE,
    IMPACT,
    LEAVING,
    RELEASED,
    REMEMBERED,
    REST_END,
    REST_START,
    RESTING,
    SLIDE,
    STUCK,
    TOUCHED,
    UNSET,
    Given,
    Parameters,
    Record,
    Records,
    advance_clock,
    carry,
    write_event,
    x_minus_y,
)

NEGLIGIBLE = 1e-17  # relative speed over speed: a tenth of what rounding leaves of the latter


@compiled
def closing_now(balls: Records, v: float) -> int:
    """Mark the balls that touch a wall and close on it; their number.

    Two balls at opposite walls can pass an impulse to and fro infinitely often in one instant, each
    time weaker. It ends where the relative speed is below the rounding of the speeds themselves:
    such a ball touches without speed.
    """
    count = 0
    for i in range(balls.shape[0]):
        balls[i].hit = 0.0
        held = balls[i].state == RESTING or balls[i].state >= TOUCHED
        if not held and balls[i].gap <= 0.0:
            if abs(balls[i].rho) <= NEGLIGIBLE * (abs(v) + abs(balls[i].u)) + 1e-300:
                balls[i].rho = 0.0
            elif balls[i].side * balls[i].rho > 0.0:
                balls[i].hit = 1.0
                count += 1
    return count


@compiled
def velocity_jump(balls: Records, M: float, scale: float) -> float:
    """Velocity jump of the oscillator for the marked balls, all r times `scale`."""
    momentum, mass = 0.0, M
    for i in range(balls.shape[0]):
        if balls[i].hit == 1.0:
            momentum += balls[i].mass * (1.0 + scale * balls[i].r) * balls[i].rho
            mass += balls[i].mass
    for i in range(balls.shape[0]):
        if balls[i].state == RESTING and -balls[i].side * momentum > 0.0:
            mass += balls[i].mass
    return -momentum / mass


@compiled
def energy_scale(balls: Records, M: float, dv: float) -> float:
    """Factor on all r that keeps the kinetic energy from rising (1 where it does not rise)."""
    mass, p, p_r, e, e_r = M, 0.0, 0.0, 0.0, 0.0
    for i in range(balls.shape[0]):
        if balls[i].hit == 1.0:
            m, rho, back = balls[i].mass, balls[i].rho, balls[i].r * balls[i].rho
            mass += m
            p += m * rho
            e += m * rho * rho
            p_r += m * back
            e_r += m * back * back
        elif balls[i].state == RESTING and balls[i].side * dv > 0.0:
            mass += balls[i].mass
    # Twice the kinetic energy in the frame of the common centre of mass.
    before, after = e - p * p / mass, e_r - p_r * p_r / mass
    if after > before:
        return math.sqrt(max(before, 0.0) / after)
    return 1.0


@compiled
def impact(balls: Records, M: float) -> float:
    """Carry out the impact of the marked balls; the velocity jump of the oscillator.

    Marks that are still set afterwards say which balls were pushed.
    """
    n = balls.shape[0]
    count = 0
    while True:
        dv = velocity_jump(balls, M, 1.0)
        count, pulled = 0, 0
        for i in range(n):
            if balls[i].hit == 1.0:
                count += 1
                bounce = (1.0 + balls[i].r) * balls[i].rho
                # A ball far heavier than the oscillator takes dv = -bounce: no pull but rounding.
                if balls[i].side * (dv + bounce) < -1e-14 * abs(bounce):
                    balls[i].hit = 0.0
                    pulled += 1
        if pulled == 0:
            break
    scale = 1.0
    if count > 1:
        scale = energy_scale(balls, M, dv)
        if scale < 1.0:
            dv = velocity_jump(balls, M, scale)
    for i in range(n):
        if balls[i].hit == 1.0:
            balls[i].rho *= -scale * balls[i].r
            balls[i].gap = 0.0
            balls[i].state = FREE
        elif balls[i].state != RESTING:
            balls[i].rho += dv
        elif balls[i].side * dv <= 0.0:  # the wall draws back from the ball
            balls[i].rho = dv
            balls[i].state = FREE
    return dv


@compiled
def resting_mass(balls: Records) -> float:
    """Mass of the balls that rest on a wall and move with the oscillator, kg."""
    mass = 0.0
    for i in range(balls.shape[0]):
        if balls[i].state == RESTING:
            mass += balls[i].mass
    return mass


REMAINDER = 1e-8
UNSEEN = 1e-15  # rad


@compiled
def set_restitution(balls: Records, i: int, speed: float) -> None:
    """Fill in `r` of ball i for an impact at the wall `side` with a closing speed."""
    r = balls[i].r_plus if balls[i].side > 0.0 else balls[i].r_minus
    balls[i].r = min(max(r + balls[i].r_slope * abs(speed), 0.0), 1.0)


@compiled
def scattered(r: float, scatter: float, seed: float, t: float) -> float:
    """An r of mean `r` that is another one at each time: normal, by a hash of the nanosecond.

    The same motion has the same impacts whenever it is simulated, and no stream of numbers is kept.
    """
    one = math.sin(12.9898 + seed + 1e9 * t) * 43758.5453
    two = math.sin(78.233 + seed + 1e9 * t) * 12543.8547
    far = math.sqrt(-2.0 * math.log(max(one - math.floor(one), 1e-12)))
    own: float = r * (1.0 + scatter * far * math.cos(2.0 * math.pi * two))
    return min(max(own, 0.0), 1.0)


@compiled
def remaining(balls: Records, i: int, a: float, M: float, own_rate: float) -> tuple[float, float]:
    """Time to the accumulation point of one ball's chatter, s, and the acceleration `back`.

    `a` is S (x'' - y'') as it is now. The time is no less than that in which the wall gains the
    speed of the next impact, so that an impact worth noting is never taken for the end of a chatter
    (with r = 0 it would be the only one). Bounces that last less than UNSEEN are rest for any r, 1
    included: no clock resolves them.
    """
    away, r = -balls[i].side * balls[i].rho, balls[i].r
    turned = 2.0 * balls[i].rub * (1.0 + balls[i].mass / M)
    out, back = (a, a - turned) if away > 0.0 else (a + turned, a)
    if back <= 0.0:
        return math.inf, back
    if away > 0.0:
        speed = math.sqrt(2.0 * back * (balls[i].gap + 0.5 * away * away / out))
        last = away / out + speed / back
    else:
        speed = math.sqrt(away * away + 2.0 * back * balls[i].gap)
        last = (away + speed) / back
    if speed * own_rate <= UNSEEN * back:
        return last, back
    q = r * math.sqrt(back / out)
    if q >= 1.0:
        return math.inf, back
    longest: float = max(last + speed * (r / out + q / back) / (1.0 - q), speed / back)
    return longest, back


@compiled
def fading(balls: Records, i: int, a: float) -> float:
    """Rate at which r changes over a chatter, 1/s.

    A change of r by `r_slope` times the speed of an impact, at most a T, changes the geometric sum
    by 2 `r_slope` a T/(1 - r)^2 of itself.
    """
    if balls[i].r_slope == 0.0 or balls[i].r >= 1.0:
        return 0.0
    left: float = 1.0 - balls[i].r
    rate: float = 2.0 * abs(balls[i].r_slope) * a / (left * left)
    return rate


@compiled
def may_pass(balls: Records, x2: float, T: float) -> bool:
    """Whether no ball but the marked ones meets a wall, or stops on its floor, within T."""
    for i in range(balls.shape[0]):
        if balls[i].hit == 1.0 or balls[i].state == RESTING or balls[i].state == STUCK:
            continue
        gain = (abs(x2) + abs(balls[i].a)) * T
        reach = (abs(balls[i].rho) + gain) * T
        if balls[i].gap <= reach or 2.0 * balls[i].half - balls[i].gap <= reach:
            return False
        if balls[i].rub > 0.0 and abs(balls[i].rho) <= gain:
            return False
    return True


@compiled
def close_chatter(
    balls: Records, mass: float, rate: float, x2: float, x3: float, v: float,
    remainder: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Carry every chatter at its end to rest at once: duration T, change of x, change of v.

    `mass` is that of the oscillator with the held balls, x2 and x3 are x'' and x'''.
    T = -1: there is none, or something else could happen before its end.
    """
    n = balls.shape[0]
    T, momentum, offset, push, total = -1.0, 0.0, 0.0, mass * x2, mass
    for i in range(n):
        balls[i].hit = 0.0
        if balls[i].state == FREE and balls[i].tau == 0.0:
            set_restitution(balls, i, 0.0)
            a = balls[i].side * (x2 - balls[i].a)
            left, back = remaining(balls, i, a, mass, rate)
            if left * max(rate, abs(x3) / back, fading(balls, i, back)) <= remainder:
                balls[i].hit = 1.0
                T = max(T, left)
                momentum += balls[i].mass * balls[i].rho
                offset += balls[i].mass * balls[i].side * balls[i].gap
                push += balls[i].mass * balls[i].a
                total += balls[i].mass
    if T < 0.0 or not may_pass(balls, x2, T):
        return -1.0, 0.0, 0.0
    # Friction within the group is internal: momentum fixes where it is and how fast after T.
    dv = (-momentum + push * T) / total
    shift = (-momentum * T + 0.5 * push * T * T + offset) / total
    for i in range(n):
        if balls[i].hit == 1.0:
            balls[i].state = RESTING
            balls[i].rho = 0.0
            balls[i].gap = 0.0
        elif balls[i].state != RESTING and balls[i].state != STUCK:
            bend = shift - 0.5 * balls[i].a * T * T
            balls[i].gap -= balls[i].side * (balls[i].rho * T + bend)
            balls[i].rho += dv - balls[i].a * T
            balls[i].u += balls[i].a * T
            balls[i].state = FREE
    return T, v * T + shift, dv


ALIKE = 0.1  # of a period, by which a contact may be off the time of one a period ago
STEADY = 0.005  # of a period: flights that differ by less count as alike
BRIEF = 0.05  # of a period: 0.3 rad, the reach of `kernel.hop`


@compiled
def expect(balls: Records, k: int, now: float) -> None:
    """Guess the next contact of ball k, which meets a wall now.

    What followed a period ago, when the ball met the same wall, follows again; without such a
    contact, or where flights are alike, the next goes across and lasts as long as the last. A
    return to the same wall within BRIEF is left to `hop`, which needs no guess.
    """
    period, side = balls[k].period, balls[k].side
    flight, heading = 0.0, -side
    if balls[k].sides[0] == -side:
        flight = now - balls[k].times[0]
    for j in range(1, REMEMBERED):
        past = balls[k].times[j]
        if balls[k].sides[j] == side and abs(now - past - period) < ALIKE * period:
            then, heading = balls[k].times[j - 1] - past, balls[k].sides[j - 1]
            if heading == side or abs(then - flight) > STEADY * period:
                flight = then
            break
    if heading == side and flight < BRIEF * period:
        flight = 0.0
    balls[k].expected, balls[k].heading = now + flight, heading
    for j in range(REMEMBERED - 1, 0, -1):
        balls[k].times[j], balls[k].sides[j] = balls[k].times[j - 1], balls[k].sides[j - 1]
    balls[k].times[0], balls[k].sides[0] = now, side


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
def lasts(balls: Records, i: int, x2: float, now: float) -> bool:
    """Solve the contact that ball i begins under x''; False: it stays at the wall (r = 0)."""
    side = balls[i].side
    duration, centre, jump = touch(
        side * balls[i].rho, side * (x2 - balls[i].tilt), balls[i].r, balls[i].tau
    )
    if duration == math.inf:
        balls[i].r = 0.0
        return False
    expect(balls, i, now)
    balls[i].state, balls[i].jump = TOUCHED, jump
    balls[i].left, balls[i].after = centre, duration - centre
    return True


@apart
def go_through(balls: Records, M: float, state: Record, log: Records) -> None:
    """Exchange the momentum of contacts that are in their middle, end those at their end."""
    for i in range(balls.shape[0]):
        if balls[i].state == TOUCHED and balls[i].left <= 0.0:
            exchange(balls, i, M, state, log)
            balls[i].state, balls[i].left = LEAVING, balls[i].after
        elif balls[i].state == LEAVING and balls[i].left <= 0.0:
            balls[i].state, balls[i].gap = FREE, 0.0


@compiled
def exchange(balls: Records, i: int, M: float, state: Record, log: Records) -> None:
    """Give ball i and the oscillator the momentum of their contact; balls at rest are let go."""
    v, u = state.v, balls[i].u
    dv = -balls[i].side * balls[i].jump * balls[i].mass / (balls[i].mass + M)
    now = v + dv
    state.v = now
    for j in range(balls.shape[0]):
        if j != i:
            balls[j].rho += dv
        if balls[j].state == RESTING:
            balls[j].state, balls[j].u = FREE, v
            write_event(state, log, REST_END, j, balls[j].side, v, now, v, v)
    balls[i].rho -= balls[i].side * balls[i].jump
    balls[i].u = now - balls[i].rho
    write_event(state, log, IMPACT, i, balls[i].side, v, now, u, balls[i].u)


@compiled
def is_held(balls: Records, i: int) -> bool:
    """Whether the ball moves with the oscillator."""
    held: bool = balls[i].state == RESTING or balls[i].state == STUCK
    return held


@compiled
def next_hit(
    balls: Records, X: FloatArray, P: FloatArray, limit: float, h: float, bend: float,
    gain: float,
) -> float:  # fmt: skip
    """First contact of any ball in (0, limit], or stage of one that lasts; `root`, `wall` of each.

    `bend` and `gain` are x - x0 - v0 h and v - v0 after h seconds, h >= `limit`.
    """
    first, S = math.inf, most_of_fourth(X, 0, h)
    for i in range(balls.shape[0]):
        if is_held(balls, i):
            continue
        balls[i].root = math.inf
        if balls[i].state >= TOUCHED:
            balls[i].root = balls[i].left
        else:
            search_walls(balls, i, X, P, limit, h, bend, gain, S)
        first = min(first, balls[i].root)
    return first


@compiled
def search_walls(
    balls: Records, i: int, X: FloatArray, P: FloatArray, limit: float, h: float, bend: float,
    gain: float, S: float,
) -> None:  # fmt: skip
    """First contact of ball i in (0, limit] with either wall, into `root` and `wall`.

    From both ends of the h seconds alone it mostly shows that a wall is out of reach.
    """
    side, d, r, full = balls[i].side, balls[i].gap, balls[i].rho, 2.0 * balls[i].half
    drift = balls[i].a * h
    g, rate = d - side * (r * h + (bend - 0.5 * drift * h)), side * (r + (gain - drift))
    for wall in (side, -side):
        z = wall * side
        if wall != side:
            d, g = full - d, full - g
        free = balls[i].state == FREE and g > 0.0
        if free and clear_between(d, -wall * r, g, -z * rate, h, S):
            continue
        for n in range(2, X.shape[0]):
            P[n] = -wall * X[n]
        P[0], P[1], lead = d, -wall * r, 0
        P[2] += 0.5 * wall * balls[i].a
        if balls[i].state == RELEASED:  # x' - y' and x'' - y'' are zero by definition
            P[1] = P[2] = 0.0
            lead = 3 if d <= 0.0 else 0
        root = first_root(P, lead, min(limit, balls[i].root))
        if root < balls[i].root:
            balls[i].root, balls[i].wall = root, wall


@compiled
def move(balls: Records, X: FloatArray, state: Record, s: float, bend: float, gain: float) -> float:
    """Carry clock, oscillator and balls s seconds on; until when what happens is one event."""
    advance_clock(state, s)
    state.x, state.v = X[0] + fused(X[1], s, bend), X[1] + gain
    tie: float = s + max(4.0 * EPS * s, 0.5 * EPS * state.t)
    for i in range(balls.shape[0]):
        if is_held(balls, i):
            continue
        if balls[i].state >= TOUCHED:
            balls[i].gap = carry(balls, i, state.v, s, bend, gain)
            balls[i].left = balls[i].left - s if balls[i].root > tie else 0.0
            continue
        if balls[i].state == RELEASED:
            balls[i].u += balls[i].a * s
            way, balls[i].rho = from_power(X, s, 3)
            gap = balls[i].gap - balls[i].side * way
        else:
            gap = carry(balls, i, state.v, s, bend, gain)
        if s > 0.0:
            balls[i].state = FREE
            # A ball that slides changes its direction through rest only.
            turned = balls[i].turn <= tie or balls[i].way * balls[i].rho <= 0.0
            if balls[i].rub > 0.0 and turned:
                balls[i].rho = 0.0
        left = gap if balls[i].wall == balls[i].side else 2.0 * balls[i].half - gap
        met = balls[i].root < math.inf and left <= 4.0 * EPS * balls[i].half
        if met or balls[i].root <= tie:
            balls[i].side, gap = balls[i].wall, 0.0
        balls[i].gap = max(gap, 0.0)
    return tie


@apart
def carry_out(balls: Records, M: float, state: Record, log: Records) -> None:
    """Carry out the impact of the marked balls and log it; rests that it ends are logged too.

    Rows of one instant hand the oscillator's velocity on from ball to ball (`Motion.impacts`).
    """
    n, v = balls.shape[0], state.v
    for i in range(n):
        balls[i].before = balls[i].rho if balls[i].state != RESTING else math.inf
    dv = impact(balls, M)
    state.v = v + dv
    now, moving, count, handed = state.t, M + resting_mass(balls), 0, v
    for i in range(n):
        count += int(balls[i].hit == 1.0)
    for i in range(n):
        if balls[i].hit == 1.0:
            expect(balls, i, now)
            if balls[i].mass > M and n == 1:
                # The lighter body takes the rounding: here the oscillator, of a wall-like ball.
                push = (1.0 + balls[i].r) * balls[i].before * (M / (M + balls[i].mass))
                balls[i].u += push
                state.v = balls[i].u + balls[i].rho
            else:
                balls[i].u = state.v - balls[i].rho
            count -= 1
            share = balls[i].mass * (balls[i].rho - balls[i].before - dv) / moving
            left = handed + share if count > 0 else state.v
            before = v - balls[i].before
            write_event(state, log, IMPACT, i, balls[i].side, handed, left, before, balls[i].u)
            handed = left
        elif balls[i].before == math.inf and balls[i].state != RESTING:
            balls[i].u = v
            write_event(state, log, REST_END, i, balls[i].side, v, state.v, v, v)


@compiled
def end_of_step(
    table: FloatArray, piece: int, duration: float, state: Record, reach: float
) -> tuple[float, float]:
    """Length of a step without an event, which ends with the series, the base's piece or the run;
    where it is not the series, the time that the clock then shows, else inf."""
    stop = duration
    if piece + 1 < table.shape[0]:
        stop = min(stop, table[piece + 1, 0])
    left = (stop - state.t) - state.t_low
    if left <= reach:
        return max(left, 0.0), stop
    return reach, math.inf


@compiled
def may_hold(balls: Records, i: int) -> bool:
    """Whether the ball is at rest on its floor or at a wall, so that it may be held there."""
    if is_held(balls, i):
        return True
    at_rest = balls[i].state == FREE and balls[i].rho == 0.0
    waits: bool = at_rest and (balls[i].gap <= 0.0 or balls[i].rub > 0.0)
    return waits


@compiled
def bounds(balls: Records, i: int) -> tuple[float, float]:
    """Least and largest p = x'' - tilt at which the ball is held."""
    low, high = -balls[i].rub, balls[i].rub
    if balls[i].gap <= 0.0:
        if balls[i].side > 0.0:
            high = math.inf
        else:
            low = -math.inf
    return low, high


@compiled
def holding_force(balls: Records, a: float) -> float:
    """Sum of m clip(p, low, high) over the balls that may be held, at x'' = a."""
    total = 0.0
    for i in range(balls.shape[0]):
        if may_hold(balls, i):
            low, high = bounds(balls, i)
            total += balls[i].mass * min(max(a - balls[i].tilt, low), high)
    return total


@apart
def acceleration(balls: Records, M: float, force: float) -> float:
    """x'' under a force, with every ball at rest held or giving way as its bounds say."""
    below, above = -math.inf, math.inf
    for i in range(balls.shape[0]):
        if may_hold(balls, i):
            low, high = bounds(balls, i)
            for bound in (low, high):
                a = balls[i].tilt + bound
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
            if balls[i].tilt + low >= above:
                rest -= balls[i].mass * low
            elif balls[i].tilt + high <= below:
                rest -= balls[i].mass * high
            else:
                mass += balls[i].mass
                rest += balls[i].mass * balls[i].tilt
    return rest / mass


@compiled
def loads(balls: Records) -> tuple[float, float]:
    """Force of the balls on the oscillator and mass of those held; fills in `a` of all others."""
    force, mass = 0.0, 0.0
    for i in range(balls.shape[0]):
        if is_held(balls, i):
            mass += balls[i].mass
            force += balls[i].mass * balls[i].tilt
            balls[i].a = 0.0
        else:
            drag = balls[i].rub * balls[i].way
            balls[i].a = balls[i].tilt + drag
            force -= balls[i].mass * drag
    return force, mass


@compiled
def next_stop(balls: Records, X: FloatArray, P: FloatArray, limit: float) -> float:
    """First time in (0, limit] at which a sliding ball comes to rest on its floor; fills `turn`."""
    first, top = math.inf, X.shape[0] - 1
    for i in range(balls.shape[0]):
        balls[i].turn = math.inf
        if is_held(balls, i) or balls[i].rub == 0.0:
            continue
        way = balls[i].way
        for n in range(1, top):
            P[n] = way * (n + 1) * X[n + 1]
        P[0], P[top] = way * balls[i].rho, 0.0
        P[1] -= way * balls[i].a
        lead = 0
        if balls[i].state == RELEASED:  # x' - y' and x'' - y'' are zero by definition
            P[0] = P[1] = 0.0
            lead = 2
        elif balls[i].rho == 0.0:
            lead = 1
        balls[i].turn = first_root(P, lead, limit)
        first = min(first, balls[i].turn)
    return first


@compiled
def next_slip(balls: Records, X: FloatArray, P: FloatArray, limit: float, noise: float) -> float:
    """First time in (0, limit] at which a held ball reaches a bound: `root`, `wall` (+-1).

    `noise` is the rounding error of x''. Where p is that close to a bound and moves away from it,
    the ball has just been caught.
    """
    first, top = math.inf, X.shape[0] - 1
    for i in range(balls.shape[0]):
        if not is_held(balls, i):
            continue
        balls[i].root = math.inf
        low, high = bounds(balls, i)
        for end in (-1.0, 1.0):
            bound = low if end < 0.0 else high
            if math.isinf(bound):
                continue
            for n in range(top - 1):
                P[n] = -end * (n + 1) * (n + 2) * X[n + 2]
            P[top - 1] = P[top] = 0.0
            P[0] += end * (bound + balls[i].tilt)
            if abs(P[0]) <= noise:
                P[0] = 0.0
            root = first_root(P, 0, limit)
            if root < balls[i].root:
                balls[i].root, balls[i].wall = root, end
        first = min(first, balls[i].root)
    return first


@apart
def write(balls: Records, i: int, what: int, state: Record, log: Records) -> None:
    """A row about ball i at this instant, all but what `complete` knows."""
    side = balls[i].side if balls[i].gap <= 0.0 else 0.0
    v, vy = state.v, state.v - balls[i].rho
    write_event(state, log, what, i, side, v, v, vy, vy)


@apart
def complete(balls: Records, M: float, state: Record, log: Records, first: int) -> None:
    """Fill in, in the rows from `first` on, where their balls are and what acts after the event."""
    force, held = loads(balls)
    for row in range(first, int(state.logged)):
        i = log[row].nes
        log[row].apart, log[row].a = x_minus_y(balls, i), balls[i].a
        log[row].force, log[row].mass = force, M + held


@compiled
def free_acceleration(
    par: Parameters, balls: Records, x: float, v: float, E: FloatArray, X: FloatArray
) -> float:
    """x'' now, with all that may be held held or giving way."""
    X[0], X[1] = x, v
    z1, force = v - E[1], spring_force(par, E, X)
    force -= z1 * (par.damping + par.quadratic * abs(z1))
    for i in range(balls.shape[0]):
        if not may_hold(balls, i):
            force -= balls[i].mass * balls[i].rub * balls[i].way
    if not is_at_rest(par, par.mass, E, X):
        force -= math.copysign(par.coulomb, z1) if par.coulomb != 0.0 else 0.0
        a: float = acceleration(balls, par.mass, force)
        return a
    # Held to the base if friction suffices for that, else it slips to the side of the force.
    low: float = acceleration(balls, par.mass, force - par.coulomb)
    high: float = acceleration(balls, par.mass, force + par.coulomb)
    held: float = min(max(2.0 * E[2], low), high)
    return held


@compiled
def decide(
    par: Parameters, state: Record, balls: Records, E: FloatArray, X: FloatArray, log: Records
) -> None:
    """Settle who is held and which way friction acts; what has changed is logged."""
    n, v, waiting = balls.shape[0], state.v, False
    for i in range(n):
        waiting = waiting or may_hold(balls, i)
        if balls[i].state == FREE and (balls[i].rho != 0.0 or balls[i].way == UNSET):
            way = math.copysign(1.0, balls[i].rho)
            if way != balls[i].way and not may_hold(balls, i):
                new = balls[i].way == UNSET or balls[i].rub != 0.0
                balls[i].way = way
                if new:
                    write(balls, i, SLIDE, state, log)
    if not waiting:
        return
    a = free_acceleration(par, balls, state.x, v, E, X)
    noise = par.stiffness * (abs(E[0]) + abs(state.x)) + par.damping * (abs(E[1]) + abs(v))
    for i in range(n):
        if not may_hold(balls, i):
            continue
        low, high = bounds(balls, i)
        p, was = a - balls[i].tilt, is_held(balls, i)
        slack = 4.0 * EPS * (noise / par.mass + abs(balls[i].tilt) + balls[i].rub)
        if low - slack <= p <= high + slack:
            balls[i].state = RESTING if balls[i].gap <= 0.0 else STUCK
            balls[i].rho, balls[i].way = 0.0, 0.0
            if not was:
                write(balls, i, REST_START, state, log)
        else:
            way = math.copysign(1.0, p)
            if was or way != balls[i].way:
                write(balls, i, REST_END if was else SLIDE, state, log)
            balls[i].state, balls[i].u, balls[i].way = FREE, v, way


@compiled
def collide(balls: Records, M: float, x2: float, state: Record, log: Records) -> None:
    """The impact of the marked balls, with r of the wall and the speed; friction holds none in it.

    A contact that lasts begins, under x'' = `x2`; only where the wall holds the ball it is one
    instant.
    """
    struck = False
    for i in range(balls.shape[0]):
        if balls[i].hit == 1.0:
            set_restitution(balls, i, balls[i].rho)
            if balls[i].r_scatter > 0.0:
                balls[i].r = scattered(balls[i].r, balls[i].r_scatter, balls[i].r_seed, state.t)
            if balls[i].tau > 0.0 and lasts(balls, i, x2, state.t):
                balls[i].hit = 0.0
            struck = struck or balls[i].hit == 1.0
        elif balls[i].state == STUCK:
            write(balls, i, REST_END, state, log)
            balls[i].state, balls[i].u = FREE, state.v
        elif balls[i].state == RELEASED:
            balls[i].state = FREE
    if struck:
        carry_out(balls, M, state, log)


@compiled
def slip(balls: Records, state: Record, tie: float, log: Records) -> None:
    """Let the held balls go that have reached a bound."""
    for i in range(balls.shape[0]):
        if is_held(balls, i) and balls[i].root <= tie:
            write(balls, i, REST_END, state, log)
            balls[i].state, balls[i].way = RELEASED, balls[i].wall
            balls[i].u = state.v


@apart
def turn(
    given: Given, piece: int, state: Record, balls: Records, log: Records, work: FloatArray,
    weak: FloatArray | None,
) -> None:  # fmt: skip
    """One turn of the loop: up to the next event, or as far as the series holds.

    `weak` is scratch space for what a plain rig has not; None leaves that out of what is compiled.
    """
    E, X, P, first, par = work[0], work[1], work[2], int(state.logged), given.par
    since = (state.t - given.table[piece, 0]) + state.t_low
    base_rate = expand_base(given.kind, given.table[piece], since, E)
    if closing_now(balls, state.v) > 0:
        x2 = 0.0
        for i in range(balls.shape[0]):
            if weak is not None and balls[i].tau > 0.0:
                x2 = free_acceleration(par, balls, state.x, state.v, E, X)
        collide(balls, par.mass, x2, state, log)
        if weak is None:  # ends at the impact, from where samples of the amplitude count
            complete(balls, par.mass, state, log, first)
            return
    decide(par, state, balls, E, X, log)
    complete(balls, par.mass, state, log, first)
    first = int(state.logged)
    force, held = loads(balls)
    mass, x, v = par.mass + held, state.x, state.v
    reach = expand(par, mass, force, base_rate, x, v, E, X, weak)
    state.v = X[1]
    rate = max(own_rate(mass, par.damping, par.stiffness), 1.0 / given.duration)
    T, dx, dv = close_chatter(balls, mass, rate, 2.0 * X[2], 6.0 * X[3], X[1], given.remainder)
    if T >= 0.0:  # it may be too short for the clock to show
        advance_clock(state, T)
        state.x += dx
        state.v += dv
        for i in range(balls.shape[0]):
            if balls[i].hit == 1.0:
                write(balls, i, REST_START, state, log)
                balls[i].way = 0.0
        complete(balls, par.mass, state, log, first)
        return
    step, goal = end_of_step(given.table, piece, given.duration, state, reach)
    noise = (
        4.0
        * EPS
        * (par.stiffness * (abs(E[0]) + abs(X[0])) + par.damping * (abs(E[1]) + abs(X[1])))
    )
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
        state.t, state.t_low = goal, 0.0
    slip(balls, state, tie, log)
    if weak is not None:
        go_through(balls, par.mass, state, log)
    complete(balls, par.mass, state, log, first)
