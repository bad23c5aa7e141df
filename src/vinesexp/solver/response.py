"""Closed form of the oscillator under a harmonic base, evaluated from a table without sin or exp.

x = x_p + x_h: a phasor (cr, ci) = P e^{i(wt + phase)} with x_p = cr, x_p' = -w ci that no impact
changes, and the free motion (xh, vh) that carries the impacts. Over s seconds the phasor turns by
e^{iws}, and the free motion obeys, with C and S its two solutions from (1, 0) and from (0, 1),

    x_h -> C x_h + S v_h,    v_h -> -w0^2 S x_h + (C - 2 alpha S) v_h.

The four functions are tabulated every `spacing` seconds (1/256 of a cycle); the rest, at most
0.0123 rad, is a polynomial cut below 1e-17. The spacing has few enough digits that a multiple of it
is exact.
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.solver.compiled import apart, compiled, entry, fused
from vinesexp.solver.state import (
    Record,
    Records,
)

ENTRIES = 640  # two and a half cycles
PER_CYCLE = 256
COSINE, SINE, FREE_C, FREE_S = range(4)  # the columns of the table
#: A closed form: what the loops need as plain numbers, and its table.
RESPONSE = np.dtype([
    ("spacing", float), ("per", float),  # of the table, s; entries a second
    ("w", float), ("w0sq", float), ("two_alpha", float),
    ("frequency", float), ("rate", float),  # of the base, Hz; the faster of w and w0
    ("p", float), ("phase", float),  # of the phasor
    ("base", float), ("base_c", float), ("base_s", float),  # x_e: amplitude; over the phasor
    ("misfit", float),  # (|w^2 - w0^2| + 2 alpha w0)/w (`search.py`)
    ("c", float, 5), ("s", float, 5),  # coefficients 2 to 6 of the series of C and S
    ("table", float, (ENTRIES, 4)),
], align=True)  # fmt: skip


@apart
def prepare_into(
    out: Record, M: float, c: float, k: float, amplitude: float, frequency: float, phase: float
) -> None:
    """Fill in a closed form; a table that holds already is kept.

    Only for an underdamped oscillator.
    """
    w0 = math.sqrt(k / M)
    alpha = 0.5 * c / M
    wd = math.sqrt((w0 - alpha) * (w0 + alpha))
    w = 2.0 * math.pi * frequency if amplitude != 0.0 else w0
    same = out.w == w and out.w0sq == w0 * w0 and out.two_alpha == 2.0 * alpha
    rate = max(w, w0)
    spacing = 2.0 * math.pi / (PER_CYCLE * rate)
    long = 134217729.0 * spacing
    spacing = long - (long - spacing)  # its upper half (Dekker)
    # x_p = Im(H amplitude e^{i(wt+phase)}) = Re(-i ...)
    below = (w0 - w) * (w0 + w)
    top, bottom = complex(w0 * w0, 2.0 * alpha * w), complex(below, 2.0 * alpha * w)
    H = top / bottom if amplitude != 0.0 else complex(0.0, 0.0)
    out.spacing, out.w, out.w0sq, out.two_alpha = spacing, w, w0 * w0, 2.0 * alpha
    out.p = amplitude * abs(H)
    out.phase = phase + math.atan2(H.imag, H.real) - 0.5 * math.pi
    out.rate = rate
    out.frequency = frequency
    out.misfit = (abs(below) + 2.0 * alpha * w0) / w
    out.per = 1.0 / spacing
    out.base, out.base_c, out.base_s = amplitude, 0.0, 0.0
    if amplitude != 0.0:
        lag = out.phase - phase
        out.base_c, out.base_s = -math.sin(lag) / abs(H), math.cos(lag) / abs(H)
    if same:
        return
    # S'' = -2 alpha S' - w0^2 S and C' = -w0^2 S, power by power.
    before, last = 0.0, 1.0
    for n in range(2, 7):
        before, last = last, (-2.0 * alpha * last - w0 * w0 * before / (n - 1)) / n
        out.s[n - 2], out.c[n - 2] = last, -w0 * w0 * before / n
    for i in range(ENTRIES):
        s = i * spacing
        decay = math.exp(-alpha * s)
        out.table[i, COSINE], out.table[i, SINE] = math.cos(w * s), math.sin(w * s)
        out.table[i, FREE_S] = decay * math.sin(wd * s) / wd
        out.table[i, FREE_C] = decay * math.cos(wd * s) + alpha * out.table[i, FREE_S]


@entry
def fill_in(
    out: Records, M: float, c: float, k: float, amplitude: float, frequency: float, phase: float
) -> None:
    """`prepare_into` the first of some, for Python."""
    prepare_into(out[0], M, c, k, amplitude, frequency, phase)


def prepare(
    M: float, c: float, k: float, amplitude: float, frequency: float, phase: float
) -> Records:
    """`prepare_into`, into one of its own."""
    out = np.zeros(1, RESPONSE)
    fill_in(out, M, c, k, amplitude, frequency, phase)
    return out


@compiled
def cycles(frequency: float, t: float, t_low: float) -> float:
    """Fraction of a cycle run after t + t_low, without the rounding of a large angle.

    The product is split exactly (Dekker), so that a million cycles cost no digit of the phase.
    """
    product = frequency * t
    split = 134217729.0
    f_high = split * frequency
    f_high -= f_high - frequency
    t_high = split * t
    t_high -= t_high - t
    f_rest, t_rest = frequency - f_high, t - t_high
    error = ((f_high * t_high - product) + f_high * t_rest + f_rest * t_high) + f_rest * t_rest
    return (product - math.floor(product)) + (error + frequency * t_low)


@compiled
def phasor(response: Record, t: float, t_low: float) -> tuple[float, float]:
    """P e^{i(wt + phase)}."""
    angle = 2.0 * math.pi * cycles(response.frequency, t, t_low) + response.phase
    return response.p * math.cos(angle), response.p * math.sin(angle)


@compiled
def base_at(response: Record, cr: float, ci: float) -> tuple[float, float, float]:
    """x_e, x_e' and x_e'' from the phasor (cr, ci) of the response."""
    w, c, s = response.w, response.base_c, response.base_s
    place = fused(c, cr, s * ci)
    return place, w * fused(s, cr, -c * ci), -w * w * place


@compiled
def free_derivatives(
    two_alpha: float, w0sq: float, x: float, v: float
) -> tuple[float, float, float, float]:
    """Second to fifth derivative of the free motion."""
    a = fused(-two_alpha, v, -w0sq * x)
    j = fused(-two_alpha, a, -w0sq * v)
    f = fused(-two_alpha, j, -w0sq * a)
    return a, j, f, fused(-two_alpha, f, -w0sq * j)


@compiled
def turned(cr: float, ci: float, angle: float) -> tuple[float, float]:
    """The phasor (cr, ci) turned by a small angle (0.02 rad: exact to rounding)."""
    q = angle * angle
    less = -q * fused(q, fused(q, 1.0 / 720.0, -1.0 / 24.0), 0.5)  # cos - 1
    sine = angle * fused(q, fused(q, fused(q, -1.0 / 5040.0, 1.0 / 120.0), -1.0 / 6.0), 1.0)
    return cr + fused(less, cr, -sine * ci), ci + fused(less, ci, sine * cr)


@compiled
def after(
    response: Record, cr: float, ci: float, xh: float, vh: float, s: float
) -> tuple[float, float, float, float]:
    """(cr, ci, xh, vh) `s` seconds later, 0 <= s < ENTRIES - 1 spacings.

    An index that could count from the end would cost more than the arithmetic.
    """
    steps = np.int64(fused(s, response.per, 0.5))
    r = fused(-float(steps), response.spacing, s)
    i, table = np.uint64(steps), response.table
    cosine, sine, C, S = table[i, COSINE], table[i, SINE], table[i, FREE_C], table[i, FREE_S]
    w0sq, two_alpha = response.w0sq, response.two_alpha
    re, im = fused(cr, cosine, -ci * sine), fused(cr, sine, ci * cosine)
    x, v = fused(C, xh, S * vh), fused(fused(-two_alpha, S, C), vh, -w0sq * S * xh)
    # The same over the rest r; C - 1 and S - r are what the series hold, so no digit is lost.
    c, s = response.c[4], response.s[4]
    for n in range(3, -1, -1):
        c, s = fused(c, r, response.c[n]), fused(s, r, response.s[n])
    c *= r * r
    s = fused(s, r * r, r)
    re, im = turned(re, im, response.w * r)
    dx, dv = fused(c, x, s * v), fused(fused(-two_alpha, s, c), v, -w0sq * s * x)
    return re, im, x + dx, v + dv
