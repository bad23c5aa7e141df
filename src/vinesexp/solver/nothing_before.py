"""The proof that nothing came before a contact that was landed on.

From both ends of a stretch of flight: with x and its derivatives known there, and a bound on the
fourth in between (`walls.py`), the gaps to both walls are bounded below by quartics that leave from
the start and, backwards in time, from the end. If these are positive up to the middle of the
stretch, there was no contact in it. A flight is one stretch, or several where one does not do.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vinesexp.solver.compiled import compiled
from vinesexp.solver.fused import fused
from vinesexp.solver.response import H_MISFIT, H_P, H_RATE, H_TWOALPHA, H_W, H_W0SQ, after
from vinesexp.solver.search import EPS
from vinesexp.solver.state import CLEARANCE, RHO, SIDE, T_HIGH, V_NOW, X_NOW, D
from vinesexp.solver.walls import open_until

FloatArray = NDArray[np.float64]

LONG = 4.0  # rad: longer flights are proved in two parts at once
PARTS = 8


@compiled
def bound(response: FloatArray, c0: float, c1: float, xh: float, vh: float, T: float) -> float:
    """S, no less than the fourth derivative within T seconds from there (module `walls`)."""
    w, w0sq, two_alpha = response[H_W], response[H_W0SQ], response[H_TWOALPHA]
    w4 = w * w * w * w
    ah = fused(-two_alpha, vh, -w0sq * xh)
    jh = fused(-two_alpha, ah, -w0sq * vh)
    fh = fused(-two_alpha, jh, -w0sq * ah)
    gh = fused(-two_alpha, fh, -w0sq * jh)
    f, df = fused(w4, c0, fh), gh / w - w4 * c1
    free = math.sqrt(fused(fh, fh, gh * gh / w0sq))
    return min(
        fused(T * free, response[H_MISFIT], math.sqrt(fused(f, f, df * df))),
        fused(w4, response[H_P], free),
    )


@compiled
def nothing_before(
    response: FloatArray, state: FloatArray, balls: FloatArray, c: FloatArray, x: float, v: float,
    cr: float, ci: float, T: float, S: float, k: int, to: float,
) -> bool:  # fmt: skip
    """Whether no ball meets a wall within the T seconds in which ball k goes to the wall `to`.

    The state is that of the start; x, v and the phasor (cr, ci) are those of the landing. A long
    flight is proved in parts, between points at which the motion is evaluated.
    """
    parts = 1
    if T * response[H_RATE] > LONG:
        parts = 2
    while parts <= PARTS:
        found = parts_are_clear(response, state, balls, c, x, v, cr, ci, T, S, k, to, parts)
        if found != 0:
            return found > 0
        parts *= 2
    return False


@compiled
def second_and_third(
    response: FloatArray, cr: float, ci: float, xh: float, vh: float
) -> tuple[float, float]:
    """Second and third derivative of x, of the phasor and the free motion together."""
    w, w0sq, two_alpha = response[H_W], response[H_W0SQ], response[H_TWOALPHA]
    ah = fused(-two_alpha, vh, -w0sq * xh)
    return fused(-w * w, cr, ah), fused(w * w * w, ci, fused(-two_alpha, ah, -w0sq * vh))


@compiled
def parts_are_clear(
    response: FloatArray, state: FloatArray, balls: FloatArray, c: FloatArray, x: float, v: float,
    cr: float, ci: float, T: float, S: float, k: int, to: float, parts: int,
) -> int:  # fmt: skip
    """1: no ball meets a wall before; -1: one is beyond a wall; 0: more parts are needed."""
    w, x0, v0 = response[H_W], state[X_NOW], state[V_NOW]
    xh0, vh0, h = x0 - c[0], v0 + w * c[1], T / parts
    half, s0, bend0, gain0 = 0.5 * h, 0.0, 0.0, 0.0
    a0, j0 = second_and_third(response, c[0], c[1], xh0, vh0)
    for part in range(1, parts + 1):
        s, last = part * h, part == parts
        re, im, xs, vs = cr, ci, x, v
        if last:
            s = T
        else:
            re, im, xs, vs = after(response, c[0], c[1], xh0, vh0, s)
            xs, vs = re + xs, vs - w * im
        a, j = second_and_third(response, re, im, xs - re, vs + w * im)
        bend, gain = xs - x0 - v0 * s, vs - v0
        for i in range(balls.shape[0]):
            z, d, r, full = balls[i, SIDE], balls[i, D], balls[i, RHO], 2.0 * balls[i, CLEARANCE]
            g0, g1 = d - z * (r * s0 + bend0), d - z * (r * s + bend)
            if last and i == k:  # exactly at the wall it was heading for
                g1 = 0.0 if to == z else full
            elif not 0.0 < g1 < full:
                return -1
            r0, r1 = r + gain0, r + gain
            proved = (
                (open_until(g0, -z * r0, -z * a0, -z * j0, S, half))
                & (open_until(full - g0, z * r0, z * a0, z * j0, S, half))
                & (open_until(g1, z * r1, -z * a, z * j, S, half))
                & (open_until(full - g1, -z * r1, z * a, -z * j, S, half))
            )
            # Contacts within the resolution of time are one event, for the general rule.
            tie = 4.0 * EPS * (state[T_HIGH] + T) * abs(r1)
            if not proved or (last and i != k and (g1 <= tie or full - g1 <= tie)):
                return 0
        s0, bend0, gain0, a0, j0 = s, bend, gain, a, j
    return 1
