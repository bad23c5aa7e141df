"""Closed form of the oscillator under a harmonic base, evaluated from a table without sin or exp.

x = x_p + x_h: a phasor (cr, ci) = P e^{i(wt + phase)} with x_p = cr, x_p' = -w ci that no impact
changes, and the free motion (xh, vh) that carries the impacts. Over s seconds the phasor turns by
e^{iws} and the free motion is multiplied by its 2x2 transition matrix. Both are tabulated every
`spacing` seconds (1/256 of a cycle); the rest, at most 0.0123 rad, is a polynomial cut below 1e-17.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vinesexp.solver.compiled import compiled, entry

FloatArray = NDArray[np.float64]

ENTRIES = 640  # two and a half cycles
PER_CYCLE = 256

# Header of a response: what the loops need as plain numbers.
H_SPACING, H_W, H_W0SQ, H_TWOALPHA, H_P, H_PHASE, H_RATE, H_MISFIT, H_FREQUENCY = range(9)


@entry
def prepare(
    M: float, c: float, k: float, amplitude: float, frequency: float, phase: float
) -> FloatArray:
    """Header (row 0) and, from row 3, the table: one 2D array.

    Only for an underdamped oscillator.
    """
    w0 = math.sqrt(k / M)
    alpha = 0.5 * c / M
    wd = math.sqrt((w0 - alpha) * (w0 + alpha))
    w = 2.0 * math.pi * frequency if amplitude != 0.0 else w0
    out = np.zeros((ENTRIES + 3, 9))
    rate = max(w, w0)
    spacing = 2.0 * math.pi / (PER_CYCLE * rate)
    # x_p = Im(H amplitude e^{i(wt+phase)}) = Re(-i ...)
    below = (w0 - w) * (w0 + w)
    top, bottom = complex(w0 * w0, 2.0 * alpha * w), complex(below, 2.0 * alpha * w)
    H = top / bottom if amplitude != 0.0 else complex(0.0, 0.0)
    head = out[0]
    head[H_SPACING], head[H_W], head[H_W0SQ], head[H_TWOALPHA] = spacing, w, w0 * w0, 2.0 * alpha
    head[H_P] = amplitude * abs(H)
    head[H_PHASE] = phase + math.atan2(H.imag, H.real) - 0.5 * math.pi
    head[H_RATE] = rate
    head[H_FREQUENCY] = frequency
    head[H_MISFIT] = (abs(below) + 2.0 * alpha * w0) / w
    for i in range(ENTRIES):
        s = i * spacing
        decay = math.exp(-alpha * s)
        cosine, sine = decay * math.cos(wd * s), decay * math.sin(wd * s) / wd
        row = out[3 + i]
        row[0], row[1] = math.cos(w * s), math.sin(w * s)
        row[2], row[3] = cosine + alpha * sine, sine
        row[4], row[5] = -w0 * w0 * sine, cosine - alpha * sine
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
def after(
    response: FloatArray, cr: float, ci: float, xh: float, vh: float, s: float
) -> tuple[float, float, float, float]:
    """(cr, ci, xh, vh) `s` seconds later, 0 <= s < ENTRIES - 1 spacings.

    The table is indexed element by element: a row view would cost more than the arithmetic.
    """
    spacing, w = response[0, H_SPACING], response[0, H_W]
    i = np.uint64(s / spacing + 0.5)
    rest = s - i * spacing
    i += np.uint64(3)
    a = w * rest
    q = a * a
    cosine = 1.0 - q * (0.5 - q * (1.0 / 24.0 - q * (1.0 / 720.0)))
    sine = a * (1.0 - q * (1.0 / 6.0 - q * (1.0 / 120.0 - q * (1.0 / 5040.0))))
    re, im = cr * response[i, 0] - ci * response[i, 1], cr * response[i, 1] + ci * response[i, 0]
    x = response[i, 2] * xh + response[i, 3] * vh
    v = response[i, 4] * xh + response[i, 5] * vh
    # Taylor series of the free motion over the rest: derivatives follow one from the other.
    p1, p0 = response[0, H_TWOALPHA], response[0, H_W0SQ]
    d2 = -p1 * v - p0 * x
    d3 = -p1 * d2 - p0 * v
    d4 = -p1 * d3 - p0 * d2
    d5 = -p1 * d4 - p0 * d3
    d6 = -p1 * d5 - p0 * d4
    d7 = -p1 * d6 - p0 * d5
    r = rest
    xs = x + r * (
        v
        + r
        * (
            0.5 * d2
            + r
            * (
                d3 * (1.0 / 6.0)
                + r * (d4 * (1.0 / 24.0) + r * (d5 * (1.0 / 120.0) + r * d6 * (1.0 / 720.0)))
            )
        )
    )
    vs = v + r * (
        d2
        + r
        * (
            0.5 * d3
            + r
            * (
                d4 * (1.0 / 6.0)
                + r * (d5 * (1.0 / 24.0) + r * (d6 * (1.0 / 120.0) + r * d7 * (1.0 / 720.0)))
            )
        )
    )
    return re * cosine - im * sine, re * sine + im * cosine, xs, vs
