"""From contact to contact: guess the contact, land on it, then prove that nothing came before.

In a regular response one flight lasts about as long as the last one, so its contact is found with
one evaluation of the closed form, in a chaotic one with two. That would be a gamble on its own. The
proof comes afterwards, from both ends: with x and its derivatives known at the start and at the
landing, and S >= |x''''| in between (`walls.py`), the gaps to both walls are bounded below by
quartics that leave from the start and, backwards in time, from the landing. If these are positive
up to the middle of the flight, there was no earlier contact. If the proof fails, nothing has been
done, and the caller takes the cautious way (`kernel.fly`); so it is where Newton's rule stops at a
point that is no root.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vinesexp.solver.bookkeeping import advance_clock, write_event
from vinesexp.solver.compiled import compiled
from vinesexp.solver.response import (
    H_MISFIT,
    H_P,
    H_RATE,
    H_TWOALPHA,
    H_W,
    H_W0SQ,
    after,
)
from vinesexp.solver.search import EPS
from vinesexp.solver.state import (
    CLEARANCE,
    EXPECTED,
    FREE,
    IMPACT,
    LAST,
    MASS,
    MET,
    RESTITUTION,
    RHO,
    SIDE,
    STATE,
    T_HIGH,
    T_LOW,
    V_NOW,
    X_NOW,
    D,
    U,
)
from vinesexp.solver.walls import open_until

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]

CLOSE = 1e-3  # rad: from here the Taylor polynomial of degree 4 is exact (1e-3^5/120 = 1e-17)
TRIES = 4


@compiled
def first_expected(balls: FloatArray, now: float) -> int:
    """The ball whose contact is expected first after `now`; -1 if one is overdue or unknown."""
    first = 0
    for i in range(balls.shape[0]):
        if balls[i, EXPECTED] <= now or balls[i, STATE] != FREE:
            return -1
        if balls[i, EXPECTED] < balls[first, EXPECTED]:
            first = i
    return first


@compiled
def cross(
    response: FloatArray, state: FloatArray, balls: FloatArray, c: FloatArray, k: int,
    longest: float,
) -> tuple[float, int]:  # fmt: skip
    """Carry everything to the next contact, thought to be of ball k.

    Returns its duration (0: not proved, and nothing is changed) and the evaluations used. On
    success clock, oscillator, phasor `c` and balls are at the contact.
    """
    w, w0sq, two_alpha = response[0, H_W], response[0, H_W0SQ], response[0, H_TWOALPHA]
    rate, w2, n = response[0, H_RATE], w * w, balls.shape[0]
    side, rho, wide = balls[k, SIDE], balls[k, RHO], 2.0 * balls[k, CLEARANCE]
    # Where the ball is heading: `far` is the gap to that wall, in the direction `to`.
    to = 1.0 if rho > 0.0 else -1.0
    far = balls[k, D] if to == side else wide - balls[k, D]
    x0, v0, c0, c1 = state[X_NOW], state[V_NOW], c[0], c[1]
    xh0, vh0 = x0 - c0, v0 + w * c1
    s, tries = (balls[k, EXPECTED] - state[T_HIGH]) - state[T_LOW], 0
    while True:
        if not (0.0 < s < longest) or tries == TRIES:
            return 0.0, tries
        tries += 1
        cr, ci, xh, vh = after(response, c0, c1, xh0, vh0, s)
        x, v = cr + xh, vh - w * ci
        ah = -two_alpha * vh - w0sq * xh
        jh = -two_alpha * ah - w0sq * vh
        fh = -two_alpha * jh - w0sq * ah
        a, j, f = ah - w2 * cr, jh + w2 * w * ci, fh + w2 * w2 * cr
        g = far - to * (rho * s + (x - x0 - v0 * s))
        g1 = -to * (rho + (v - v0))
        if g1 >= 0.0:
            return 0.0, tries
        d = -g / g1
        for _ in range(2):
            slope = g1 - to * d * (a + d * (0.5 * j + d * f * (1.0 / 6.0)))
            value = g + d * (g1 - to * d * (0.5 * a + d * (j + 0.25 * d * f) * (1.0 / 6.0)))
            d -= value / slope
        if abs(d) * rate < CLOSE:
            # Where the gap has no root near by, Newton's rule can stop at nothing: look.
            slope = g1 - to * d * (a + d * (0.5 * j + d * f * (1.0 / 6.0)))
            value = g + d * (g1 - to * d * (0.5 * a + d * (j + 0.25 * d * f) * (1.0 / 6.0)))
            rounding = 8.0 * EPS * (far + abs(rho) * s + abs(x) + abs(x0))
            if not (slope < 0.0 and abs(value) <= rounding):
                return 0.0, tries
            break
        s += d
    # The state at the contact.
    T = s + d
    if T <= 0.0:
        return 0.0, tries
    x += d * (v + d * (0.5 * a + d * (j + 0.25 * d * f) * (1.0 / 6.0)))
    v += d * (a + d * (0.5 * j + d * f * (1.0 / 6.0)))
    turn = w * d
    q = turn * turn
    cosine, sine = 1.0 - q * (0.5 - q * (1.0 / 24.0)), turn * (1.0 - q * (1.0 / 6.0 - q / 120.0))
    cr, ci = cr * cosine - ci * sine, cr * sine + ci * cosine
    # Derivatives at both ends, and the bound between them.
    xh, vh = x - cr, v + w * ci
    ah = -two_alpha * vh - w0sq * xh
    a1, j1 = ah - w2 * cr, -two_alpha * ah - w0sq * vh + w2 * w * ci
    ah = -two_alpha * vh0 - w0sq * xh0
    jh = -two_alpha * ah - w0sq * vh0
    fh = -two_alpha * jh - w0sq * ah
    gh = -two_alpha * fh - w0sq * jh
    a0, j0 = ah - w2 * c0, jh + w2 * w * c1
    f0, df0 = fh + w2 * w2 * c0, gh / w - w2 * w2 * c1
    free = math.sqrt(fh * fh + gh * gh / w0sq)
    S = min(
        math.sqrt(f0 * f0 + df0 * df0) + T * free * response[0, H_MISFIT],
        w2 * w2 * response[0, H_P] + free,
    )
    half, bend, gain = 0.5 * T, x - x0 - v0 * T, v - v0
    for i in range(n):
        z, g0, full = balls[i, SIDE], balls[i, D], 2.0 * balls[i, CLEARANCE]
        r0, r1 = balls[i, RHO], balls[i, RHO] + gain
        # Gaps at the landing; ball k is exactly at the wall it was heading for.
        near = g0 - z * (r0 * T + bend)
        other = full - near
        if i == k:
            near, other = (0.0, full) if to == z else (full, 0.0)
        proved = (
            (open_until(g0, -z * r0, -z * a0, -z * j0, S, half))
            & (open_until(full - g0, z * r0, z * a0, z * j0, S, half))
            & (open_until(near, z * r1, -z * a1, z * j1, S, half))
            & (open_until(other, -z * r1, z * a1, -z * j1, S, half))
        )
        # Contacts within the resolution of time are one event, for the general rule.
        tie = 4.0 * EPS * (state[T_HIGH] + T) * abs(r1)
        if not proved or (i != k and (near <= tie or other <= tie)):
            return 0.0, tries
    arrive(state, balls, x, v, T, k, to)
    c[0], c[1] = cr, ci
    return T, tries


@compiled
def arrive(
    state: FloatArray, balls: FloatArray, x: float, v: float, T: float, k: int, to: float
) -> None:
    """Set clock, oscillator and balls to T seconds on, ball k at the wall `to`."""
    bend, gain = x - state[X_NOW] - state[V_NOW] * T, v - state[V_NOW]
    advance_clock(state, T)
    state[X_NOW], state[V_NOW] = x, v
    for i in range(balls.shape[0]):
        gap = balls[i, D] - balls[i, SIDE] * (balls[i, RHO] * T + bend)
        apart = v - balls[i, U]
        clear = abs(apart) > 0.25 * (abs(v) + abs(balls[i, U]))
        balls[i, RHO] = apart if clear else balls[i, RHO] + gain
        if i == k:
            balls[i, SIDE], gap = to, 0.0
        elif gap > balls[i, CLEARANCE]:
            balls[i, SIDE] = -balls[i, SIDE]
            gap = 2.0 * balls[i, CLEARANCE] - gap
        balls[i, D] = max(gap, 0.0)


@compiled
def expect(balls: FloatArray, k: int, now: float) -> None:
    """Guess the next contact of ball k, which meets a wall now.

    Across the cavity the next flight is expected to last as long as the last one. A ball that came
    back to the same wall is in a chatter; no guess there, `hop.py` needs none.
    """
    flight = now - balls[k, LAST] if balls[k, SIDE] != balls[k, MET] else 0.0
    balls[k, EXPECTED] = now + flight
    balls[k, LAST], balls[k, MET] = now, balls[k, SIDE]


@compiled
def bounce(
    state: FloatArray, balls: FloatArray, k: int, M: float, numbers: FloatArray, labels: IntArray,
    row: int,
) -> int:  # fmt: skip
    """The impact of ball k alone, lighter than the oscillator, none resting (`contact.impact`)."""
    m, r, rho, v = balls[k, MASS], balls[k, RESTITUTION], balls[k, RHO], state[V_NOW]
    dv = -m * (1.0 + r) * rho / (M + m)
    for i in range(balls.shape[0]):
        balls[i, RHO] += dv
    balls[k, RHO] = -r * rho
    state[V_NOW] = v + dv
    balls[k, U] = state[V_NOW] + r * rho
    now = state[T_HIGH]
    expect(balls, k, now)
    labels[row, 0] = IMPACT
    return write_event(
        numbers, labels, row, k, balls[k, SIDE], now, state[X_NOW], v, state[V_NOW],
        v - rho, balls[k, U],
    )  # fmt: skip
