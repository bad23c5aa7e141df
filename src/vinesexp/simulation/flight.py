"""One ball from wall to wall: guess the contact, land on it, then prove that nothing came before.

In a regular response one flight lasts about as long as the last one, so its contact is found with
one evaluation of the closed form, in a chaotic one with two. That would be a gamble on its own. The
proof comes afterwards, from both ends: with x and its derivatives known at the start and at the
landing, and S >= |x''''| in between (`walls.py`), the gaps to both walls are bounded below by
quartics that leave from the start and, backwards in time, from the landing. If these are positive
up to the middle of the flight, there was no earlier contact. If the proof fails, nothing has been
done, and the caller takes the cautious way (`kernel.fly`).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vinesexp.simulation.compiled import compiled
from vinesexp.simulation.contact import (
    CLEARANCE,
    IMPACT,
    MASS,
    RESTITUTION,
    RHO,
    SIDE,
    D,
    U,
    write_event,
)
from vinesexp.simulation.response import (
    H_MISFIT,
    H_P,
    H_RATE,
    H_TWOALPHA,
    H_W,
    H_W0SQ,
    after,
)
from vinesexp.simulation.walls import open_until

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]

T_HIGH, T_LOW, X_NOW, V_NOW = 0, 1, 2, 3

CLOSE = 1e-3  # rad: from here the Taylor polynomial of degree 4 is exact (1e-3^5/120 = 1e-17)
TRIES = 4


@compiled
def cross(
    response: FloatArray, state: FloatArray, balls: FloatArray, c: FloatArray, last: float,
    longest: float,
) -> tuple[float, int]:  # fmt: skip
    """Carry ball 0 from the wall it has just left to the other: duration (0: not proved), tries.

    On success clock, oscillator, phasor `c` and ball are at the contact; else nothing is changed.
    """
    w, w0sq, two_alpha = response[0, H_W], response[0, H_W0SQ], response[0, H_TWOALPHA]
    rate, w2 = response[0, H_RATE], w * w
    side, rho, wide = balls[0, SIDE], balls[0, RHO], 2.0 * balls[0, CLEARANCE]
    x0, v0, c0, c1 = state[X_NOW], state[V_NOW], c[0], c[1]
    xh0, vh0 = x0 - c0, v0 + w * c1
    s, tries = last, 0
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
        # Gap to the far wall: 2 b - (gap to the near one); the gap to the near one starts at zero.
        g = wide + side * (rho * s + (x - x0 - v0 * s))
        g1 = side * (rho + (v - v0))
        if g1 >= 0.0:
            return 0.0, tries
        d = -g / g1
        for _ in range(2):
            slope = g1 + side * d * (a + d * (0.5 * j + d * f * (1.0 / 6.0)))
            value = g + d * (g1 + side * d * (0.5 * a + d * (j + 0.25 * d * f) * (1.0 / 6.0)))
            d -= value / slope
        if abs(d) * rate < CLOSE:
            break
        s += d
    # The state at the contact.
    T = s + d
    x += d * (v + d * (0.5 * a + d * (j + 0.25 * d * f) * (1.0 / 6.0)))
    v_hit = v + d * (a + d * (0.5 * j + d * f * (1.0 / 6.0)))
    turn = w * d
    q = turn * turn
    cosine, sine = 1.0 - q * (0.5 - q * (1.0 / 24.0)), turn * (1.0 - q * (1.0 / 6.0 - q / 120.0))
    cr, ci = cr * cosine - ci * sine, cr * sine + ci * cosine
    # Derivatives at both ends, and the bound between them.
    xh, vh = x - cr, v_hit + w * ci
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
    half, rho1 = 0.5 * T, rho + (v_hit - v0)
    away, toward = -side * rho, -side * rho1
    proved = (
        (open_until(0.0, away, -side * a0, -side * j0, S, half))
        & (open_until(wide, -away, side * a0, side * j0, S, half))
        & (open_until(wide, -toward, -side * a1, side * j1, S, half))
        & (open_until(0.0, toward, side * a1, -side * j1, S, half))
    )
    if not proved:
        return 0.0, tries
    low = T + state[T_LOW]
    total = state[T_HIGH] + low
    state[T_LOW], state[T_HIGH] = low - (total - state[T_HIGH]), total
    state[X_NOW], state[V_NOW] = x, v_hit
    c[0], c[1] = cr, ci
    balls[0, SIDE], balls[0, D] = -side, 0.0
    apart = v_hit - balls[0, U]
    clear = abs(apart) > 0.25 * (abs(v_hit) + abs(balls[0, U]))
    balls[0, RHO] = apart if clear else rho1
    return T, tries


@compiled
def bounce(
    state: FloatArray, balls: FloatArray, M: float, numbers: FloatArray, labels: IntArray, row: int
) -> int:
    """The impact of a single ball lighter than the oscillator (`contact.impact` for n = 1)."""
    m, r, rho, v = balls[0, MASS], balls[0, RESTITUTION], balls[0, RHO], state[V_NOW]
    after_v = v - m * (1.0 + r) * rho / (M + m)
    balls[0, RHO] = -r * rho
    balls[0, U] = after_v + r * rho
    state[V_NOW] = after_v
    return write_event(
        numbers, labels, row, IMPACT, 0, balls[0, SIDE], state[T_HIGH], state[X_NOW], v, after_v,
        v - rho, balls[0, U],
    )  # fmt: skip
