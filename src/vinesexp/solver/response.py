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

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import apart, compiled, entry, fused

ENTRIES = 640  # two and a half cycles
PER_CYCLE = 256
COSINE, SINE, FREE_C, FREE_S = range(4)  # the columns of the table
WIDTH = 4

# Header of a response: what the loops need as plain numbers.
H_SPACING, H_W, H_W0SQ, H_TWOALPHA, H_P, H_PHASE, H_RATE, H_MISFIT, H_FREQUENCY, H_PER = range(10)
H_C, H_S = 10, 15  # coefficients 2 to 6 of the series of C and S
H_BASE_C, H_BASE_S, H_BASE = 20, 21, 22  # x_e over the phasor (cr, ci); its amplitude
HEADER = 24


@apart
def prepare_into(
    out: FloatArray, M: float, c: float, k: float, amplitude: float, frequency: float, phase: float
) -> None:
    """Fill header and, from HEADER on, the table, row by row; what holds already is kept.

    Only for an underdamped oscillator.
    """
    w0 = math.sqrt(k / M)
    alpha = 0.5 * c / M
    wd = math.sqrt((w0 - alpha) * (w0 + alpha))
    w = 2.0 * math.pi * frequency if amplitude != 0.0 else w0
    same = out[H_W] == w and out[H_W0SQ] == w0 * w0 and out[H_TWOALPHA] == 2.0 * alpha
    rate = max(w, w0)
    spacing = 2.0 * math.pi / (PER_CYCLE * rate)
    long = 134217729.0 * spacing
    spacing = long - (long - spacing)  # its upper half (Dekker)
    # x_p = Im(H amplitude e^{i(wt+phase)}) = Re(-i ...)
    below = (w0 - w) * (w0 + w)
    top, bottom = complex(w0 * w0, 2.0 * alpha * w), complex(below, 2.0 * alpha * w)
    H = top / bottom if amplitude != 0.0 else complex(0.0, 0.0)
    out[H_SPACING], out[H_W], out[H_W0SQ], out[H_TWOALPHA] = spacing, w, w0 * w0, 2.0 * alpha
    out[H_P] = amplitude * abs(H)
    out[H_PHASE] = phase + math.atan2(H.imag, H.real) - 0.5 * math.pi
    out[H_RATE] = rate
    out[H_FREQUENCY] = frequency
    out[H_MISFIT] = (abs(below) + 2.0 * alpha * w0) / w
    out[H_PER] = 1.0 / spacing
    out[H_BASE], out[H_BASE_C], out[H_BASE_S] = amplitude, 0.0, 0.0
    if amplitude != 0.0:
        lag = out[H_PHASE] - phase
        out[H_BASE_C], out[H_BASE_S] = -math.sin(lag) / abs(H), math.cos(lag) / abs(H)
    if same:
        return
    # S'' = -2 alpha S' - w0^2 S and C' = -w0^2 S, power by power.
    before, last = 0.0, 1.0
    for n in range(2, 7):
        before, last = last, (-2.0 * alpha * last - w0 * w0 * before / (n - 1)) / n
        out[H_S + n - 2], out[H_C + n - 2] = last, -w0 * w0 * before / n
    for i in range(ENTRIES):
        s, row = i * spacing, HEADER + WIDTH * i
        decay = math.exp(-alpha * s)
        out[row + COSINE], out[row + SINE] = math.cos(w * s), math.sin(w * s)
        out[row + FREE_S] = decay * math.sin(wd * s) / wd
        out[row + FREE_C] = decay * math.cos(wd * s) + alpha * out[row + FREE_S]


@entry
def fill_in(
    out: FloatArray, M: float, c: float, k: float, amplitude: float, frequency: float, phase: float
) -> None:
    """`prepare_into`, for Python."""
    prepare_into(out, M, c, k, amplitude, frequency, phase)


def prepare(
    M: float, c: float, k: float, amplitude: float, frequency: float, phase: float
) -> FloatArray:
    """`prepare_into`, into an array of its own."""
    out = np.zeros(HEADER + WIDTH * ENTRIES)
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
def phasor(head: FloatArray, t: float, t_low: float) -> tuple[float, float]:
    """P e^{i(wt + phase)}."""
    angle = 2.0 * math.pi * cycles(head[H_FREQUENCY], t, t_low) + head[H_PHASE]
    return head[H_P] * math.cos(angle), head[H_P] * math.sin(angle)


@compiled
def base_at(head: FloatArray, cr: float, ci: float) -> tuple[float, float, float]:
    """x_e, x_e' and x_e'' from the phasor (cr, ci) of the response."""
    w, c, s = head[H_W], head[H_BASE_C], head[H_BASE_S]
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
    response: FloatArray, cr: float, ci: float, xh: float, vh: float, s: float
) -> tuple[float, float, float, float]:
    """(cr, ci, xh, vh) `s` seconds later, 0 <= s < ENTRIES - 1 spacings.

    The table is indexed element by element: a row view would cost more than the arithmetic, and
    so would an index that could count from the end.
    """
    steps = np.int64(fused(s, response[H_PER], 0.5))
    r = fused(-float(steps), response[H_SPACING], s)
    i = np.uint64(HEADER) + np.uint64(WIDTH) * np.uint64(steps)
    cosine, sine = response[i + np.uint64(COSINE)], response[i + np.uint64(SINE)]
    C, S = response[i + np.uint64(FREE_C)], response[i + np.uint64(FREE_S)]
    w0sq, two_alpha = response[H_W0SQ], response[H_TWOALPHA]
    re, im = fused(cr, cosine, -ci * sine), fused(cr, sine, ci * cosine)
    x, v = fused(C, xh, S * vh), fused(fused(-two_alpha, S, C), vh, -w0sq * S * xh)
    # The same over the rest r; C - 1 and S - r are what the series hold, so no digit is lost.
    c, s = response[H_C + 4], response[H_S + 4]
    for n in range(3, -1, -1):
        c, s = fused(c, r, response[H_C + n]), fused(s, r, response[H_S + n])
    c *= r * r
    s = fused(s, r * r, r)
    re, im = turned(re, im, response[H_W] * r)
    dx, dv = fused(c, x, s * v), fused(fused(-two_alpha, s, c), v, -w0sq * s * x)
    return re, im, x + dx, v + dv
