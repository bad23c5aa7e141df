"""From contact to contact in closed form, and the event loop around it.

Under a harmonic base (or none) the motion between walls is known in closed form (`response.py`): a
constant force moves the place of rest of the oscillator, and what is not linear bends the flight
(`bent.py`). In a regular response one flight lasts about as long as the last one, so its contact is
found with one evaluation of the closed form, in a chaotic one with two. That would be a gamble on
its own. The proof comes afterwards (`nothing_before`). If it fails, nothing has been done, and the
motion is looked at a radian apart (`look_and_cross`); so it is where Newton's rule stops at no
root. The bounces of a chatter are a series each (`hop`). What is neither, that is the end of a
chatter, rest, release, several balls at once, starts on a wall and what cannot be proved, is one
turn of the general loop (`events.py`), which holds those rules alone. The general loop, which knows
nothing of this one, is its test.

The proof that nothing came before looks at both ends of a stretch of flight: with the gaps and
their rates known there, and a bound on the fourth derivative in between, a cubic says whether a
gap stays open (`search.clear_between`). A flight is one stretch, or several where one does not do.

A constant force on the oscillator moves its place of rest by `shift`, and a ball may have a
constant acceleration a: so balls that rub and floors that are not level (`events.py`) fly by the
same rules (`glide`). A ball that rubs keeps its direction if its rate relative to the floor, whose
fourth derivative is that of x's rate, stays clear of zero in the same way. So does an oscillator
with Coulomb friction: z' = x' - x_e' keeps its sign `way` (0: there is no such friction), or the
flight ends where z' comes to zero.

`hop`: short flights back to the wall that was just left, the bounces of a chatter.

The ball leaves the wall with the speed w > 0 while the wall follows it. With the Taylor series of x
at the bounce, X_n = x^(n)/n!, and z = +1 or -1 the side, the gap is s q(s),

    q(s) = w - z (X_2 s + X_3 s^2 + X_4 s^3 + ...),

and nothing large is subtracted, however short the flight. If z X_2 > 2 |X_3| s + 3 |X_4| s^2 + ...
at a root s, q falls all the way to it: it is the only one up to there, so any rule may find it
(Newton's here). The other wall is out of reach if w s < b, because the gap is at most w s. The
other balls are proved to meet no wall before (`search.open_until`). If a proof fails nothing has
been done, and the general loop takes over.

Flights last up to SHORT radians; the series is cut at order TOP, its remainder is below
0.3^13/13! = 3e-17 of the amplitude.
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.solver.bent import FIFTH, FOURTH, SECOND, TURN_OFF, bend, bent_at
from vinesexp.solver.compiled import apart, compiled, entry, fused
from vinesexp.solver.events import (
    closing_now,
    collide,
    complete,
    expect,
    go_through,
    loads,
    may_hold,
    remaining,
    turn,
    write,
)
from vinesexp.solver.response import ENTRIES, after, base_at, free_derivatives, phasor, turned
from vinesexp.solver.search import EPS, clear_between, open_until, root_of_cubic
from vinesexp.solver.series import PER, moving_way, piece_at, spring_force
from vinesexp.solver.state import (
    ALIKE_ROWS,
    ALLOWANCE,
    FREE,
    IMPACT,
    PHASOR,
    SLIDE,
    TOUCHED,
    Given,
    Parameters,
    Record,
    Records,
    advance_clock,
    carry,
    write_event,
    x_minus_y,
)

LONG = 4.0  # rad: longer flights are proved in two parts at once
PARTS = 8


@compiled
def bound(response: Record, c0: float, c1: float, xh: float, vh: float, T: float) -> float:
    """S, no less than the fourth derivative within T seconds from there (`search.py`)."""
    w, w0sq, two_alpha = response.w, response.w0sq, response.two_alpha
    w4 = w * w * w * w
    _, _, fh, gh = free_derivatives(two_alpha, w0sq, xh, vh)
    f, df = fused(w4, c0, fh), gh / w - w4 * c1
    free = math.sqrt(fused(fh, fh, gh * gh / w0sq))
    return min(
        fused(T * free, response.misfit, math.sqrt(fused(f, f, df * df))),
        fused(w4, response.p, free),
    )


@compiled
def nothing_before(
    response: Record, state: Record, balls: Records, c: FloatArray, x: float, v: float,
    cr: float, ci: float, T: float, S: float, k: int, to: float, shift: float, way: float,
    bent: FloatArray | None,
) -> bool:  # fmt: skip
    """Whether no ball meets a wall within the T seconds in which ball k goes to the wall `to`.

    k = -1: in which z' goes to zero. The state is that of the start; x, v and the phasor (cr, ci)
    are those of the landing. A long flight is proved in parts, between points at which the motion
    is evaluated.
    """
    parts = 1
    if T * response.rate > LONG:
        parts = 2
    while parts <= PARTS:
        found = parts_are_clear(
            response, state, balls, c, x, v, cr, ci, T, S, k, to, shift, way, parts, bent
        )
        if found != 0:
            return found > 0
        parts *= 2
    return False


@compiled
def second(response: Record, cr: float, xh: float, vh: float) -> float:
    """Second derivative of x, of the phasor and the free motion together."""
    w = response.w
    free = fused(-response.two_alpha, vh, -response.w0sq * xh)
    a: float = fused(-w * w, cr, free)
    return a


@compiled
def parts_are_clear(
    response: Record, state: Record, balls: Records, c: FloatArray, x: float, v: float,
    cr: float, ci: float, T: float, S: float, k: int, to: float, shift: float, way: float,
    parts: int, bent: FloatArray | None,
) -> int:  # fmt: skip
    """1: no ball meets a wall before; -1: one is beyond a wall; 0: more parts are needed."""
    w, x0, v0 = response.w, state.x, state.v
    xh0, vh0, h = x0 - shift - c[0], v0 + w * c[1], T / parts
    s0, bend0, gain0, a0 = 0.0, 0.0, 0.0, second(response, c[0], xh0, vh0)
    if bent is not None:
        a0 += bent[SECOND]
    _, base_v, base_a = base_at(response, c[0], c[1])
    # Friction acts by `way`: what is below zero at the start is rounding.
    u0, b0 = max(way * (v0 - base_v), 0.0), way * (a0 - base_a)
    for part in range(1, parts + 1):
        s, last = part * h, part == parts
        re, im, xs, vs = cr, ci, x, v
        if last:
            s = T
        else:
            re, im, xs, vs = after(response, c[0], c[1], xh0, vh0, s)
            xs, vs = shift + (re + xs), vs - w * im
        if bent is None:
            a = second(response, re, xs - shift - re, vs + w * im)
        else:
            u, du, ddu, _, _, _, _ = bent_at(bent, s)
            if not last:
                xs, vs = xs + u, vs + du
            a = second(response, re, xs - u - shift - re, vs - du + w * im) + ddu
        bend, gain = xs - x0 - v0 * s, vs - v0
        if way != 0.0:
            _, base_v, base_a = base_at(response, re, im)
            u1, b1 = way * (vs - base_v), way * (a - base_a)
            if last and k < 0:
                u1 = 0.0
            elif not u1 > 0.0:
                return -1
            S1 = response.rate * (S + w * w * w * w * response.base)
            S1 += 0.0 if bent is None else bent[FIFTH]
            if not clear_between(u0, b0, u1, b1, h, S1):
                return 0
            u0, b0 = u1, b1
        rate = S * response.rate + (0.0 if bent is None else bent[FIFTH])
        for i in range(balls.shape[0]):
            landed, now = last and i == k, state.t + T if last else -1.0
            clear = ball_is_clear(
                balls, i, s0, bend0, gain0, a0, s, bend, gain, a, S, rate, landed, to, now
            )
            if clear <= 0:
                return clear
        s0, bend0, gain0, a0 = s, bend, gain, a
    return 1


@compiled
def ball_is_clear(
    balls: Records, i: int, s0: float, bend0: float, gain0: float, a0: float, s: float,
    bend: float, gain: float, a: float, S: float, rate: float, landed: bool, to: float, now: float,
) -> int:  # fmt: skip
    """`parts_are_clear` for one ball, from s0 to s.

    `rate` is a bound on the fifth derivative of x; `landed`: it is at the wall `to` in the end;
    `now` is the time there, below zero where the flight goes on.
    """
    z, d, r, full = balls[i].side, balls[i].gap, balls[i].rho, 2.0 * balls[i].half
    own, h = balls[i].a, s - s0
    g0 = d - z * (r * s0 + (bend0 - 0.5 * own * s0 * s0))
    g1 = d - z * (r * s + (bend - 0.5 * own * s * s))
    if landed:  # exactly at the wall it was heading for
        g1 = 0.0 if to == z else full
    elif not 0.0 < g1 < full:
        return -1
    r0, r1 = r + (gain0 - own * s0), r + (gain - own * s)
    proved = clear_between(g0, -z * r0, g1, -z * r1, h, S) & clear_between(
        full - g0, z * r0, full - g1, z * r1, h, S
    )
    if balls[i].rub > 0.0:
        z = balls[i].way
        slides = (z * r0 > 0.0) & (z * r1 > 0.0)
        proved = (
            proved
            and slides
            and clear_between(z * r0, z * (a0 - own), z * r1, z * (a - own), h, rate)
        )
    # Contacts within the resolution of time and lengths may be one, for the general rule.
    tie = 4.0 * EPS * (now * abs(r1) + full)
    if not proved or (now >= 0.0 and not landed and (g1 <= tie or full - g1 <= tie)):
        return 0
    return 1


CLOSE = 0.01  # rad: from here the Taylor polynomial of degree 6 is exact (0.01^7/5040 = 2e-18)
TRIES = 4
STEPS = 5  # of Newton's rule at most
ROUNDED = 0.01 * EPS  # share of the lengths that a gap counts as zero by: well below its rounding


@compiled
def first_expected(balls: Records, now: float) -> int:
    """The ball whose contact is expected first after `now`; -1 if one is overdue or unknown."""
    first = 0
    for i in range(balls.shape[0]):
        if balls[i].expected <= now or balls[i].state != FREE:
            return -1
        if balls[i].expected < balls[first].expected:
            first = i
    return first


@compiled
def forced_derivatives(
    response: Record, cr: float, ci: float, xh: float, vh: float
) -> tuple[float, float, float, float, float]:
    """Second to sixth derivative of x, of the phasor and the free motion together."""
    w, w0sq, two_alpha = response.w, response.w0sq, response.two_alpha
    w2 = w * w
    ah, jh, fh, gh = free_derivatives(two_alpha, w0sq, xh, vh)
    hh = fused(-two_alpha, gh, -w0sq * fh)
    up, down = w2 * cr, w2 * w * ci
    return ah - up, jh + down, fused(w2, up, fh), fused(-w2, down, gh), fused(-w2 * w2, up, hh)


@compiled
def until_it_turns(
    response: Record, cr: float, ci: float, xh: float, vh: float, s: float, v: float,
    way: float, bent: FloatArray | None,
) -> tuple[float, float, float, float, float, float, float]:  # fmt: skip
    """z' in the direction `way` and its derivatives to the fifth; the speeds it is between."""
    base_v = base_at(response, cr, ci)[1]
    less, lag = 1.0 - response.base_c, response.base_s
    a, j, f, p, q = forced_derivatives(response, less * cr - lag * ci, less * ci + lag * cr, xh, vh)
    if bent is not None:
        _, _, u2, u3, u4, u5, u6 = bent_at(bent, s)
        a, j, f, p, q = a + u2, j + u3, f + u4, p + u5, q + u6
    size = abs(v) + abs(base_v)
    return way * (v - base_v), way * a, way * j, way * f, way * p, way * q, size


@compiled
def a_little_later(
    d: float, x: float, v: float, a: float, j: float, f: float, p: float, q: float
) -> tuple[float, float]:
    """x and x' after d seconds, from the derivatives up to the sixth."""
    rise = fused(d, fused(d, q * (1.0 / 720.0), p * (1.0 / 120.0)), f * (1.0 / 24.0))
    x += d * fused(d, fused(d, fused(d, rise, j * (1.0 / 6.0)), 0.5 * a), v)
    rise = fused(d, fused(d, q * (1.0 / 120.0), p * (1.0 / 24.0)), f * (1.0 / 6.0))
    return x, v + d * fused(d, fused(d, rise, 0.5 * j), a)


@compiled
def cross(
    response: Record, state: Record, balls: Records, c: FloatArray, k: int, s: float,
    longest: float, shift: float, way: float, bent: FloatArray | None,
) -> tuple[float, int]:  # fmt: skip
    """Carry everything to the next contact, thought to be of ball k in s seconds.

    k = -1: to the place where the oscillator, which moves the way `way` against its base, turns.
    `bent` (`bent.py`) is what an oscillator that is not linear adds.
    Returns the duration (0: not proved, and nothing is changed) and the evaluations used. On
    success clock, oscillator, phasor `c` and balls are there.
    """
    w, rate, one = response.w, response.rate, max(k, 0)
    near = CLOSE if k >= 0 else 0.25 * CLOSE  # a derivative less is known
    rho, to, own = balls[one].rho, balls[one].heading, balls[one].a
    # The gap to the wall for which the ball is heading, in the direction `to`.
    far = balls[one].gap
    if to != balls[one].side:
        far = 2.0 * balls[one].half - far
    x0, v0, c0, c1 = state.x, state.v, c[0], c[1]
    xh0, vh0, tries = x0 - shift - c0, v0 + w * c1, 0
    while True:
        if not (0.0 < s < longest) or tries == TRIES:
            return 0.0, tries
        tries += 1
        cr, ci, xh, vh = after(response, c0, c1, xh0, vh0, s)
        x, v = shift + (cr + xh), vh - w * ci
        a, j, f, p, q = forced_derivatives(response, cr, ci, xh, vh)
        if bent is not None:
            u, u1, u2, u3, u4, u5, u6 = bent_at(bent, s)
            x, v, a, j, f, p, q = x + u, v + u1, a + u2, j + u3, f + u4, p + u5, q + u6
        if k >= 0:
            g = far - to * (rho * s + ((x - x0 - v0 * s) - 0.5 * own * s * s))
            g1, g2 = -to * (rho + ((v - v0) - own * s)), -to * (a - own)
            g3, g4, g5, g6 = -to * j, -to * f, -to * p, -to * q
            size = far + abs(rho) * s + abs(x) + abs(x0)
        else:
            g, g1, g2, g3, g4, g5, size = until_it_turns(response, cr, ci, xh, vh, s, v, way, bent)
            g6, size = 0.0, size + abs(v0)
        if g1 >= 0.0:
            return 0.0, tries
        d, left, slope = nearest_root(g, g1, g2, g3, g4, g5, g6, ROUNDED * size)
        if abs(d) * rate < near:
            # Where the gap has no root near by, Newton's rule can stop at nothing: what its last
            # step leaves of the gap has to be rounding.
            if not (slope < 0.0 and left <= 8.0 * EPS * size):
                return 0.0, tries
            break
        s += d
    # The state at the contact.
    T = s + d
    if T <= 0.0:
        return 0.0, tries
    x, v = a_little_later(d, x, v, a, j, f, p, q)
    cr, ci = turned(cr, ci, w * d)
    S = bound(response, c0, c1, xh0, vh0, T)
    if bent is not None:
        S += bent[FOURTH]
    if not nothing_before(response, state, balls, c, x, v, cr, ci, T, S, k, to, shift, way, bent):
        return 0.0, tries
    if k < 0:
        v = base_at(response, cr, ci)[1]
    arrive(state, balls, x, v, T, x - x0 - v0 * T, v - v0, k, to)
    c[0], c[1] = cr, ci
    return T, tries


LOOK = 1.0  # rad: so far apart is looked at a motion that resembles no other


@apart
def look_and_cross(
    response: Record, state: Record, balls: Records, c: FloatArray, longest: float
) -> int:
    """Carry everything to the first contact, or `longest` seconds on; 0: nothing is changed.

    The contact is looked for at points a radian apart; then it is found, and proved, as others.
    """
    w, w0sq, h = response.w, response.w0sq, LOOK / response.rate
    x0, v0, n = state.x, state.v, balls.shape[0]
    xh0, vh0, s, count = x0 - c[0], v0 + w * c[1], 0.0, 0
    free = math.sqrt(xh0 * xh0 + vh0 * vh0 / w0sq)
    near = math.sqrt(x0 * x0 + v0 * v0 / (w * w)) + longest * free * response.misfit
    most = min(response.p + free, near)
    for i in range(n):
        balls[i].last_gap, balls[i].last_rate = balls[i].gap, -balls[i].side * balls[i].rho
    while True:
        skip = longest
        for i in range(n):
            skip = min(skip, out_of_reach(balls, i, x0, most, s))
        last, s, k, soon = s, min(s + max(skip, h), longest), -1, math.inf
        re, im, xh, vh = after(response, c[0], c[1], xh0, vh0, s)
        x, v = re + xh, vh - w * im
        count += 1
        for i in range(n):
            when, heading = seen(balls, i, last, s, (x - x0) - v0 * s, v - v0, skip <= h)
            if when < soon:
                k, soon, balls[i].heading = i, when, heading
        if k >= 0:
            T, tries = cross(response, state, balls, c, k, soon, longest, 0.0, 0.0, None)
            return count + tries if T > 0.0 else 0
        if s >= longest:
            break
    S = bound(response, c[0], c[1], xh0, vh0, s)
    if not nothing_before(response, state, balls, c, x, v, re, im, s, S, -1, 0.0, 0.0, 0.0, None):
        return 0
    arrive(state, balls, x, v, s, x - x0 - v0 * s, v - v0, -1, 0.0)
    c[0], c[1] = re, im
    return count


@compiled
def seen(
    balls: Records, i: int, last: float, s: float, bend: float, gain: float, close: bool
) -> tuple[float, float]:
    """About when ball i meets a wall before s (inf: not), and which; fills in the last gap, rate.

    `bend` is x - x0 - v0 s and `gain` v - v0; these are those at `last`. `close`: so near
    that a gap that opens again is seen in the cubic between.
    """
    z, wide, g0, r0 = balls[i].side, 2.0 * balls[i].half, balls[i].last_gap, balls[i].last_rate
    g, r = balls[i].gap - z * (balls[i].rho * s + bend), -z * (balls[i].rho + gain)
    balls[i].last_gap, balls[i].last_rate, h = g, r, s - last
    if g <= 0.0:
        return last + closing(g0, r0, g, r, h), z
    if g >= wide:
        return last + closing(wide - g0, -r0, wide - g, -r, h), -z
    middle = 0.5 * (g + g0) + 0.125 * h * (r0 - r)
    if close and not 0.0 < middle < wide:
        return last + 0.5 * h, z if middle <= 0.0 else -z
    return math.inf, z


@compiled
def closing(g0: float, r0: float, g1: float, r1: float, h: float) -> float:
    """About when a gap closes that is open, or opens, at first and not h seconds later."""
    fall = (g1 - g0) / h
    c2, c3 = (3.0 * fall - 2.0 * r0 - r1) / h, (r0 + r1 - 2.0 * fall) / (h * h)
    if g0 > 0.0:
        return root_of_cubic(g0, r0, c2, c3, h)
    square = c2 * c2 - 4.0 * c3 * r0
    return 2.0 * r0 / (math.sqrt(max(square, 0.0)) - c2)


@compiled
def out_of_reach(balls: Records, i: int, x0: float, most: float, s: float) -> float:
    """How long from s on no wall can reach ball i, with |x| <= `most`, s."""
    ahead = balls[i].half - most
    place = x0 - balls[i].side * (balls[i].half - balls[i].gap) + balls[i].u * s
    if abs(place) >= ahead:
        return 0.0
    left: float = (ahead - math.copysign(1.0, balls[i].u) * place) / abs(balls[i].u)
    return left


@compiled
def nearest_root(
    g: float, g1: float, g2: float, g3: float, g4: float, g5: float, g6: float, enough: float
) -> tuple[float, float, float]:
    """Root of the gap near by from its derivatives, gap left there, rate there: no proof yet.

    A slow contact needs more steps of Newton's rule than a fast one: until less than `enough` of
    the gap is left.
    """
    c2, c3, c4 = 0.5 * g2, g3 * (1.0 / 6.0), g4 * (1.0 / 24.0)
    c5, c6 = g5 * (1.0 / 120.0), g6 * (1.0 / 720.0)
    inverse = 1.0 / g1
    d = -g * inverse
    d = d * fused(-d, c2 * inverse, 1.0)  # the quadratic to second order
    left, slope = 0.0, g1
    for _ in range(STEPS):
        value = fused(d, fused(d, fused(d, fused(d, fused(d, c6, c5), c4), c3), c2), g1)
        slope = fused(d, fused(d, fused(d, 6.0 * c6, 5.0 * c5), 4.0 * c4), 3.0 * c3)
        slope = fused(d, fused(d, slope, 2.0 * c2), g1)
        step = fused(d, value, g) / slope
        d -= step
        left = step * step * (abs(c2) + abs(3.0 * c3 * d))
        if left <= enough:
            break
    return d, left, slope


@compiled
def arrive(
    state: Record, balls: Records, x: float, v: float, T: float, bend: float, gain: float,
    k: int, to: float,
) -> None:  # fmt: skip
    """Set clock, oscillator and balls to T seconds on, ball k at the wall `to`.

    `bend` is x - x0 - v0 T, `gain` is v - v0.
    """
    advance_clock(state, T)
    state.x, state.v = x, v
    for i in range(balls.shape[0]):
        gap = carry(balls, i, v, T, bend, gain)
        if i == k:
            balls[i].side, gap = to, 0.0
        elif gap > balls[i].half:
            balls[i].side = -balls[i].side
            gap = 2.0 * balls[i].half - gap
        balls[i].gap = max(gap, 0.0)


@compiled
def bounce(state: Record, balls: Records, k: int, M: float, log: Records) -> None:
    """The impact of ball k alone, lighter than the oscillator, none resting (`events.impact`)."""
    m, r, rho, v = balls[k].mass, balls[k].r, balls[k].rho, state.v
    dv = -m * (1.0 + r) * rho / (M + m)
    for i in range(balls.shape[0]):
        balls[i].rho += dv
    balls[k].rho = -r * rho
    state.v = v + dv
    balls[k].u = state.v + r * rho
    expect(balls, k, state.t)
    row = log[np.uint64(state.logged)]
    row.apart, row.mass = x_minus_y(balls, k), M
    write_event(state, log, IMPACT, k, balls[k].side, v, state.v, v - rho, balls[k].u)


SHORT = 0.3  # rad: flights shorter than this are hops
TOP = 12
HOP_BRIEF, HOP_BRIEF_TOP = 0.01, 6  # rad: 0.01^7/7! = 2e-18
#: Steps of Newton's rule; of s, its last step, whose square is the error left.
HOP_TRIES, SETTLED = 10, 1e-9


@compiled
def expand_motion(
    response: Record, cr: float, ci: float, xh: float, vh: float, top: int, X: FloatArray
) -> None:
    """Taylor coefficients of x, of the phasor (cr, ci) and the free motion (xh, vh) together."""
    w, w0sq, two_alpha = response.w, response.w0sq, response.two_alpha
    xp, vp, w2, scale = cr, -w * ci, w * w, 1.0
    X[0], X[1] = xp + xh, vp + vh
    for n in range(2, top + 1):
        # One derivative up: (x, x') becomes (x', x'').
        xp, vp = vp, -w2 * xp
        xh, vh = vh, fused(-two_alpha, vh, -w0sq * xh)
        scale *= PER[n - 1]
        X[n] = scale * (vp + vh)


@compiled
def returning(balls: Records, a: float, rate: float) -> int:
    """The ball that comes back first to the wall it is leaving, within SHORT; -1 if none does."""
    first, soonest = -1, SHORT
    for i in range(balls.shape[0]):
        if balls[i].state != FREE:
            return -1
        away, push = -balls[i].side * balls[i].rho, balls[i].side * a
        if balls[i].gap <= 0.0 and away > 0.0 and push > 0.0:
            back = 2.0 * away * rate / push
            if back < soonest:
                first, soonest = i, back
    return first


@apart
def hop(
    response: Record, state: Record, balls: Records, c: FloatArray, X: FloatArray,
    a: float, longest: float, slowest: float, remainder: float,
) -> bool:  # fmt: skip
    """Carry everything to the end of a short flight; False: nothing is changed.

    `c` is the phasor of the particular response, `a` is x'', X (TOP + 1 or longer) scratch space.
    A chatter whose rest of bounces is to be summed (`events.close_chatter`) is left alone;
    `slowest` is the least rate it is measured by.
    """
    w, w0sq, rate = response.w, response.w0sq, response.rate
    k = returning(balls, a, rate)
    if k < 0:
        return False
    xh, vh = state.x - c[0], state.v + w * c[1]
    top = HOP_BRIEF_TOP if 2.0 * abs(balls[k].rho) * rate < HOP_BRIEF * abs(a) else TOP
    expand_motion(response, c[0], c[1], xh, vh, top, X)
    z, away = balls[k].side, -balls[k].side * balls[k].rho
    own = math.sqrt(w0sq)
    measure = max(max(own, slowest), abs(3.0 * X[3] / X[2]))
    if remaining(balls, k, 2.0 * z * X[2], 1.0, own)[0] * measure <= 2.0 * remainder:
        return False
    s, step = away / (z * X[2]), math.inf
    for _ in range(HOP_TRIES):
        value, slope = X[top], 0.0
        for n in range(top - 1, 1, -1):
            slope, value = fused(slope, s, value), fused(value, s, X[n])
        step = (away - z * value * s) / (z * fused(slope, s, value))
        s += step
        if not abs(step) > SETTLED * s:
            break
    if not abs(step) <= SETTLED * s:
        return False
    fall = 0.0
    for n in range(top, 2, -1):
        fall = fused(n - 1, abs(X[n]), fall) * s
    if not (0.0 < s < longest and s * rate < 1.2 * SHORT and fall < 0.999 * z * X[2]):
        return False
    if away * s >= balls[k].half or not others_stay_clear(response, balls, c, X, xh, vh, k, s):
        return False
    return_to_wall(state, balls, c, X, top, w, k, s)
    return True


@compiled
def others_stay_clear(
    response: Record, balls: Records, c: FloatArray, X: FloatArray, xh: float, vh: float,
    k: int, s: float,
) -> bool:  # fmt: skip
    """Whether no ball but k meets a wall within s seconds, or a moment after."""
    if balls.shape[0] == 1:
        return True
    w0sq = response.w0sq
    a, j = 2.0 * X[2], 6.0 * X[3]
    # The free motion's fourth derivative and its rate, which never grows together.
    _, _, fh, gh = free_derivatives(response.two_alpha, w0sq, xh, vh)
    S = response.w**4 * response.p + math.sqrt(fh * fh + gh * gh / w0sq)
    until = 1.001 * s  # impacts within the resolution of time are one event, for the general rule
    for i in range(balls.shape[0]):
        z, g, wide = balls[i].side, balls[i].gap, 2.0 * balls[i].half - balls[i].gap
        r = balls[i].rho
        clear = open_until(g, -z * r, -z * a, -z * j, S, until)
        clear = clear and open_until(wide, z * r, z * a, z * j, S, until)
        if i != k and not clear:
            return False
    return True


@compiled
def return_to_wall(
    state: Record, balls: Records, c: FloatArray, X: FloatArray, top: int, w: float,
    k: int, s: float,
) -> None:  # fmt: skip
    """Set clock, oscillator, phasor and balls to s seconds on, ball k back at its wall."""
    bend, gain = X[top], top * X[top]  # x - x0 - v0 s over s^2, x' - v0 over s
    for n in range(top - 1, 1, -1):
        bend, gain = fused(bend, s, X[n]), fused(gain, s, n * X[n])
    bend, gain = bend * s * s, gain * s
    x, v = state.x + (state.v * s + bend), state.v + gain
    if w * s < HOP_BRIEF:
        c[0], c[1] = turned(c[0], c[1], w * s)
    else:
        cosine, sine = math.cos(w * s), math.sin(w * s)
        c[0], c[1] = c[0] * cosine - c[1] * sine, c[0] * sine + c[1] * cosine
    arrive(state, balls, x, v, s, bend, gain, k, balls[k].side)


TURNED = 64.0 * EPS  # z' over the speeds it is the difference of, where it has just come to zero
REFRESH = 64  # flights after which the turned phasor, which gathers rounding, is taken afresh


@compiled
def is_flight(balls: Records, acceleration: float, rate: float, least: float) -> bool:
    """Whether every ball flies, and none is back at the wall it left within `least` over `rate`."""
    for i in range(balls.shape[0]):
        if balls[i].state != FREE:
            return False
        a = balls[i].side * acceleration
        away = -balls[i].side * balls[i].rho
        if balls[i].gap <= 0.0 and away <= 0.0:
            return False
        if a > 0.0:
            back = away + math.sqrt(away * away + 2.0 * a * balls[i].gap)
            if back * rate < least * a:
                return False
    return True


@compiled
def next_turn(
    response: Record, par: Parameters, state: Record, c: FloatArray, force: float,
    E: FloatArray, X: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Sign of z' by which friction acts (0: it holds), and a guess how long it keeps it, s."""
    E[0], E[1], a = base_at(response, c[0], c[1])
    E[2], X[0], X[1] = 0.5 * a, state.x, state.v
    way, rests = moving_way(par, par.mass, force, E, X)
    if abs(X[1] - E[1]) <= TURNED * (abs(X[1]) + abs(E[1])) and not rests:
        way, rests = math.copysign(1.0, force + spring_force(par, E, X) - par.mass * a), True
    u = 0.0 if rests else X[1] - E[1]
    pull = force - way * par.coulomb + spring_force(par, E, X) - par.damping * u
    # As if z' were a sine of the base's frequency.
    ahead = math.atan2(way * (pull / par.mass - a), way * u * response.w)
    return way, (ahead + 0.5 * math.pi) / response.w


@compiled
def coast(
    response: Record, state: Record, balls: Records, c: FloatArray, T: float,
    shift: float,
) -> None:  # fmt: skip
    """Carry everything, one ball in contact, to the next stage of its contact in T seconds."""
    w, x0, v0 = response.w, state.x, state.v
    c[0], c[1], xh, vh = after(response, c[0], c[1], x0 - shift - c[0], v0 + w * c[1], T)
    advance_clock(state, T)
    state.x, state.v = shift + (c[0] + xh), vh - w * c[1]
    bend, gain = state.x - x0 - v0 * T, state.v - v0
    balls[0].gap = carry(balls, 0, state.v, T, bend, gain)
    balls[0].left = 0.0


@apart
def cross_bent(
    given: Given, state: Record, balls: Records, c: FloatArray, k: int, s: float, longest: float,
    shift: float, way: float, turns: float, work: FloatArray,
) -> tuple[bool, bool]:  # fmt: skip
    """`cross` of an oscillator that is not linear: whether it is at the contact, or turned.

    `turns` is when it may turn before the contact.
    """
    response = given.response[0]
    xh, vh = state.x - shift - c[0], state.v + response.w * c[1]
    like = ALIKE_ROWS + 8 * int(way + 1.0) + (4 if balls[k].heading > 0.0 else 0)
    bent = work[like + 3]
    if not bend(response, given.bent, given.par, c, xh, vh, shift, way, work, like):
        return False, False
    guess = turns * (1.0 + bent[TURN_OFF])
    turned, ends = guess < s, min(longest, given.bent[0])
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
    given: Given, state: Record, balls: Records, longest: float, log: Records, work: FloatArray
) -> bool:
    """One flight in closed form, all balls sliding, and the impact after it.

    Or up to where the oscillator turns, if Coulomb friction acts on it. Whether it is proved: if
    not, nothing is changed.
    """
    response, par, c = given.response[0], given.par, work[PHASOR]
    n, first, k = balls.shape[0], int(state.logged), first_expected(balls, state.t)
    if n == 1 and balls[0].state >= TOUCHED and balls[0].left < longest:
        if par.coulomb != 0.0 or par.cubic != 0.0 or par.quadratic != 0.0:
            return False
        force, _ = loads(balls)
        coast(response, state, balls, c, balls[0].left, force / par.stiffness)
        go_through(balls, par.mass, state, log)
        complete(balls, par.mass, state, log, first)
        return True
    if n == 0 or k < 0:
        return False
    for i in range(n):
        if may_hold(balls, i) or (balls[i].rub > 0.0 and balls[i].way * balls[i].rho <= 0.0):
            return False
    if balls[k].tau > 0.0 and (par.cubic != 0.0 or par.quadratic != 0.0):
        return False
    force, _ = loads(balls)
    soon, way, turns = (balls[k].expected - state.t) - state.t_low, 0.0, math.inf
    if par.coulomb != 0.0 or par.quadratic != 0.0:
        way, turns = next_turn(response, par, state, c, force, work[0], work[1])
        if way == 0.0:
            return False
    shift = (force - way * par.coulomb) / par.stiffness
    if par.cubic != 0.0 or par.quadratic != 0.0:
        landed, turned = cross_bent(
            given, state, balls, c, k, soon, longest, shift, way, turns, work
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
        balls[i].hit = 1.0 if i == k else 0.0
    xh, vh = state.x - shift - c[0], state.v + response.w * c[1]
    x2 = second(response, c[0], xh, vh)
    collide(balls, par.mass, x2, state, log)
    for i in range(n):
        way = math.copysign(1.0, balls[i].rho)
        if way != balls[i].way and not may_hold(balls, i):
            balls[i].way = way
            if balls[i].rub != 0.0:
                write(balls, i, SLIDE, state, log)
    complete(balls, par.mass, state, log, first)
    return True


@compiled
def plain_turn(
    given: Given, closed: bool, piece: int, state: Record, balls: Records, log: Records,
    work: FloatArray,
) -> int:  # fmt: skip
    """One flight and the impact after it, one bounce, or one turn of the general loop: evaluations.

    The phasor in work[PHASOR] is carried along.
    """
    response, duration, c = given.response[0], given.duration, work[PHASOR]
    left, span = (duration - state.t) - state.t_low, (ENTRIES - 2) * response.spacing
    if closed and closing_now(balls, state.v) == 0:
        xh, vh = state.x - c[0], state.v + response.w * c[1]
        a = -(response.w**2) * c[0] - response.w0sq * xh - response.two_alpha * vh
        flown = 0
        if is_flight(balls, a, response.rate, SHORT):
            flown = look_and_cross(response, state, balls, c, min(left, span))
        elif hop(response, state, balls, c, work[1], a, left, 1.0 / duration, given.remainder):
            flown = 1
        if flown > 0:
            if state.t >= duration or left <= EPS * duration:
                state.t, state.t_low = duration, 0.0
            elif closing_now(balls, state.v) == 1:
                for k in range(balls.shape[0]):
                    if balls[k].hit == 1.0:
                        bounce(state, balls, k, given.par.mass, log)
            return flown
    turn(given, piece, state, balls, log, work, None)
    if closed:
        c[0], c[1] = phasor(response, state.t, state.t_low)
    return 1


@compiled
def next_piece(table: FloatArray, piece: int, t: float) -> int:
    """The piece of the base that holds t, from an earlier one on."""
    while piece + 1 < table.shape[0] and table[piece + 1, 0] <= t:
        piece += 1
    return piece


@compiled
def fly_on(
    given: Given, closed: bool, state: Record, balls: Records, c: FloatArray, log: Records,
    room: int, age: int,
) -> tuple[int, int]:  # fmt: skip
    """The fast way, from contact to contact as long as its proofs hold: evaluations, age."""
    response = given.response[0]
    evaluations, span = 0, (ENTRIES - 2) * response.spacing
    while closed and balls.shape[0] > 0 and state.logged < room:
        k = first_expected(balls, state.t)
        if k < 0:
            break
        left = (given.duration - state.t) - state.t_low
        soon = (balls[k].expected - state.t) - state.t_low
        T, tries = cross(response, state, balls, c, k, soon, min(left, span), 0.0, 0.0, None)
        evaluations += tries
        if T == 0.0:
            break
        bounce(state, balls, k, given.par.mass, log)
        age += 1
        if age >= REFRESH:
            c[0], c[1] = phasor(response, state.t, state.t_low)
            age = 0
    return evaluations, age


@entry
def run(
    given: Given, closed: bool, states: Records, balls: Records, log: Records, work: FloatArray,
    weak: FloatArray | None,
) -> int:  # fmt: skip
    """Run to the end, until the log is full or ALLOWANCE is used; evaluations.

    Resume with the same arrays: the log is filled from its first row on, `logged` of the state is
    their number. `closed` says that there is a closed form of the motion; without it every turn is
    one of the general loop. The log and `work` (WORK, order + 1), which is scratch space, are zeros
    at the start. `weak` is a row of it; None for a plain rig with light balls, whose loop is
    compiled without all others.
    """
    response, state = given.response[0], states[0]
    table, duration = given.table, given.duration
    evaluations, age, piece = 0, 0, piece_at(table, state.t)
    room = log.shape[0] - 6 * balls.shape[0] - 4
    c, span = work[PHASOR], (ENTRIES - 2) * response.spacing
    for i in range(balls.shape[0]):
        balls[i].period = 1.0 / response.frequency if closed else 0.0
    c[0], c[1] = phasor(response, state.t, state.t_low)
    state.logged = 0.0
    while state.logged < room and state.t < duration and evaluations < ALLOWANCE:
        used, flown = 1, False
        if weak is None:
            tries, age = fly_on(given, closed, state, balls, c, log, room, age)
            evaluations += tries
            piece = next_piece(table, piece, state.t)
            used = plain_turn(given, closed, piece, state, balls, log, work)
        else:
            if closed:
                left = (duration - state.t) - state.t_low
                flown = glide(given, state, balls, min(left, span), log, work)
            if not flown:
                piece = next_piece(table, piece, state.t)
                turn(given, piece, state, balls, log, work, weak)
                age = REFRESH
        evaluations += used
        age += 1
        if closed and age >= REFRESH:
            c[0], c[1] = phasor(response, state.t, state.t_low)
            age = 0
    return evaluations
