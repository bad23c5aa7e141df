"""Short flights back to the wall that was just left: the bounces of a chatter, in closed form.

The ball leaves the wall with the speed w > 0 while the wall follows it. With the Taylor series of x
at the bounce, X_n = x^(n)/n!, and z = +1 or -1 the side, the gap is s q(s),

    q(s) = w - z (X_2 s + X_3 s^2 + X_4 s^3 + ...),

and nothing large is subtracted, however short the flight. If z X_2 > 2 |X_3| s + 3 |X_4| s^2 + ...
at a root s, q falls all the way to it: it is the only one up to there, so any rule may find it
(Newton's here). The other wall is out of reach if w s < b, because the gap is at most w s. The
other balls are proved to meet no wall before (`walls.open_until`). If a proof fails nothing has
been done, and the general loop takes over.

Flights last up to SHORT radians; the series is cut at order TOP, its remainder is below
0.3^13/13! = 3e-17 of the amplitude.
"""

from __future__ import annotations

import math

from vinesexp.arrays import FloatArray
from vinesexp.solver.chatter import remaining_time
from vinesexp.solver.compiled import compiled
from vinesexp.solver.fused import fused
from vinesexp.solver.response import H_P, H_RATE, H_TWOALPHA, H_W, H_W0SQ, turned
from vinesexp.solver.series import PER
from vinesexp.solver.state import (
    CLEARANCE,
    FREE,
    RHO,
    SIDE,
    STATE,
    V_NOW,
    X_NOW,
    D,
    U,
    advance_clock,
)
from vinesexp.solver.walls import open_until

SHORT = 0.3  # rad: flights shorter than this are hops
TOP = 12
BRIEF, BRIEF_TOP = 0.01, 6  # rad: 0.01^7/7! = 2e-18
TRIES, SETTLED = 10, 1e-9  # of s: the error left by Newton's rule is the square of its last step


@compiled
def expand_motion(
    head: FloatArray, cr: float, ci: float, xh: float, vh: float, top: int, X: FloatArray
) -> None:
    """Taylor coefficients of x, of the phasor (cr, ci) and the free motion (xh, vh) together."""
    w, w0sq, two_alpha = head[H_W], head[H_W0SQ], head[H_TWOALPHA]
    xp, vp, w2, scale = cr, -w * ci, w * w, 1.0
    X[0], X[1] = xp + xh, vp + vh
    for n in range(2, top + 1):
        # One derivative up: (x, x') becomes (x', x'').
        xp, vp = vp, -w2 * xp
        xh, vh = vh, fused(-two_alpha, vh, -w0sq * xh)
        scale *= PER[n - 1]
        X[n] = scale * (vp + vh)


@compiled
def returning(balls: FloatArray, a: float, rate: float) -> int:
    """The ball that comes back first to the wall it is leaving, within SHORT; -1 if none does."""
    first, soonest = -1, SHORT
    for i in range(balls.shape[0]):
        if balls[i, STATE] != FREE:
            return -1
        away, push = -balls[i, SIDE] * balls[i, RHO], balls[i, SIDE] * a
        if balls[i, D] <= 0.0 and away > 0.0 and push > 0.0:
            back = 2.0 * away * rate / push
            if back < soonest:
                first, soonest = i, back
    return first


@compiled
def hop(
    head: FloatArray, state: FloatArray, balls: FloatArray, c: FloatArray, X: FloatArray,
    a: float, longest: float, slowest: float, remainder: float,
) -> bool:  # fmt: skip
    """Carry everything to the end of a short flight; False: nothing is changed.

    `c` is the phasor of the particular response, `a` is x'', X (TOP + 1 or longer) scratch space.
    A chatter whose rest of bounces is to be summed (`chatter.close_chatter`) is left alone;
    `slowest` is the least rate it is measured by.
    """
    w, w0sq, rate = head[H_W], head[H_W0SQ], head[H_RATE]
    k = returning(balls, a, rate)
    if k < 0:
        return False
    xh, vh = state[X_NOW] - c[0], state[V_NOW] + w * c[1]
    top = BRIEF_TOP if 2.0 * abs(balls[k, RHO]) * rate < BRIEF * abs(a) else TOP
    expand_motion(head, c[0], c[1], xh, vh, top, X)
    z, away = balls[k, SIDE], -balls[k, SIDE] * balls[k, RHO]
    own = math.sqrt(w0sq)
    measure = max(max(own, slowest), abs(3.0 * X[3] / X[2]))
    if remaining_time(balls[k], 2.0 * z * X[2], own) * measure <= 2.0 * remainder:
        return False
    s, step = away / (z * X[2]), math.inf
    for _ in range(TRIES):
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
    if away * s >= balls[k, CLEARANCE] or not others_stay_clear(head, balls, c, X, xh, vh, k, s):
        return False
    return_to_wall(state, balls, c, X, top, w, k, s)
    return True


@compiled
def others_stay_clear(
    head: FloatArray, balls: FloatArray, c: FloatArray, X: FloatArray, xh: float, vh: float,
    k: int, s: float,
) -> bool:  # fmt: skip
    """Whether no ball but k meets a wall within s seconds, or a moment after."""
    if balls.shape[0] == 1:
        return True
    w0sq = head[H_W0SQ]
    a, j = 2.0 * X[2], 6.0 * X[3]
    # The free motion's fourth derivative and its rate, which never grows together.
    ah = -head[H_TWOALPHA] * vh - w0sq * xh
    jh = -head[H_TWOALPHA] * ah - w0sq * vh
    fh = -head[H_TWOALPHA] * jh - w0sq * ah
    gh = -head[H_TWOALPHA] * fh - w0sq * jh
    S = head[H_W] ** 4 * head[H_P] + math.sqrt(fh * fh + gh * gh / w0sq)
    until = 1.001 * s  # impacts within the resolution of time are one event, for the general rule
    for i in range(balls.shape[0]):
        z, g, wide = balls[i, SIDE], balls[i, D], 2.0 * balls[i, CLEARANCE] - balls[i, D]
        r = balls[i, RHO]
        clear = open_until(g, -z * r, -z * a, -z * j, S, until)
        clear = clear and open_until(wide, z * r, z * a, z * j, S, until)
        if i != k and not clear:
            return False
    return True


@compiled
def return_to_wall(
    state: FloatArray, balls: FloatArray, c: FloatArray, X: FloatArray, top: int, w: float,
    k: int, s: float,
) -> None:  # fmt: skip
    """Set clock, oscillator, phasor and balls to s seconds on, ball k back at its wall."""
    bend, gain = X[top], top * X[top]  # x - x0 - v0 s over s^2, x' - v0 over s
    for n in range(top - 1, 1, -1):
        bend, gain = fused(bend, s, X[n]), fused(gain, s, n * X[n])
    bend, gain = bend * s * s, gain * s
    advance_clock(state, s)
    state[X_NOW] += state[V_NOW] * s + bend
    state[V_NOW] += gain
    if w * s < BRIEF:
        c[0], c[1] = turned(c[0], c[1], w * s)
    else:
        cosine, sine = math.cos(w * s), math.sin(w * s)
        c[0], c[1] = c[0] * cosine - c[1] * sine, c[0] * sine + c[1] * cosine
    for i in range(balls.shape[0]):
        gap = balls[i, D] - balls[i, SIDE] * (balls[i, RHO] * s + bend)
        # Where x' and y' differ by more than rounding, their difference carries no drift.
        apart = state[V_NOW] - balls[i, U]
        clear = abs(apart) > 0.25 * (abs(state[V_NOW]) + abs(balls[i, U]))
        balls[i, RHO] = apart if clear else balls[i, RHO] + gain
        if i == k:
            gap = 0.0
        elif gap > balls[i, CLEARANCE]:
            balls[i, SIDE] = -balls[i, SIDE]
            gap = 2.0 * balls[i, CLEARANCE] - gap
        balls[i, D] = max(gap, 0.0)
