"""Base motions as tables of pieces, and x_e at any time.

Two forms serve all of them (`series.py`): sines whose frequency is constant or grows linearly, and
polynomials. A row of the table is one piece and holds until the next one starts.
"""

from __future__ import annotations

import math
from fractions import Fraction
from weakref import WeakKeyDictionary

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.excitation import Base, Harmonic, Measured, SteppedSweep, Sweep

CHIRP, POLYNOMIAL = 0, 1
TAU = 2.0 * math.pi

#: Splines of the measured records in use: every evaluation needs them.
_SPLINES: WeakKeyDictionary[Measured, FloatArray] = WeakKeyDictionary()


def drive_table(base: Base | None) -> tuple[int, FloatArray]:
    """Kind of the pieces and their table: rows (start, amplitude, phase, omega, chirp rate) or
    (start, coefficients of x_e in the time since the start).

    Examples
    --------
    >>> kind, table = drive_table(Harmonic(amplitude=1e-3, frequency=1.0))
    >>> kind, table.shape
    (0, (1, 5))
    """
    if base is None:
        return CHIRP, np.zeros((1, 5))
    if isinstance(base, Harmonic):
        return CHIRP, np.array([[0.0, base.amplitude, base.phase, TAU * base.frequency, 0.0]])
    if isinstance(base, Sweep):
        chirp = TAU * (base.f_end - base.f_start) / base.duration
        mean = (Fraction(base.f_start) + Fraction(base.f_end)) / 2
        turned = base.phase + TAU * float(mean * Fraction(base.duration) % 1)
        return CHIRP, np.array(
            [
                [0.0, base.amplitude, base.phase, TAU * base.f_start, chirp],
                [base.duration, base.amplitude, turned, TAU * base.f_end, 0.0],
            ]
        )
    if isinstance(base, SteppedSweep):
        omega = TAU * np.asarray(base.frequencies, dtype=np.float64)
        fixed = np.full(omega.size, base.amplitude)
        phase = base.phase + TAU * np.array(_cycles_before(base))
        return CHIRP, np.column_stack([base.starts, fixed, phase, omega, 0.0 * omega])
    table = _SPLINES.get(base)
    if table is None:
        table = _SPLINES[base] = _spline_table(base)
    return POLYNOMIAL, table


def _cycles_before(base: SteppedSweep) -> list[float]:
    """Fraction of a cycle run when each step begins, in exact arithmetic: phase continuous."""
    run, found = Fraction(0), [0.0]
    for f, begin, end in zip(base.frequencies, base.starts, base.starts[1:], strict=False):
        run = (run + Fraction(f) * (Fraction(end) - Fraction(begin))) % 1
        found.append(float(run))
    return found


def _spline_table(base: Measured) -> FloatArray:
    """Quintic spline of the samples, one row a piece."""
    from scipy.interpolate import PPoly, make_interp_spline

    samples = np.asarray(base.samples)
    t = np.arange(samples.size) / base.sample_rate
    pieces = PPoly.from_spline(make_interp_spline(t, samples, k=5))
    keep = np.diff(pieces.x) > 0.0
    return np.column_stack([pieces.x[:-1][keep], pieces.c[::-1, keep].T])


def base_motion(base: Base | None, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """x_e and x_e' at times t (s, >= 0); m, m/s."""
    kind, table = drive_table(base)
    piece = np.clip(np.searchsorted(table[:, 0], t, side="right") - 1, 0, len(table) - 1)
    row = table[piece]
    since = t - row[..., 0]
    if kind == POLYNOMIAL:
        x_e, v_e = np.zeros_like(since), np.zeros_like(since)
        for n in range(table.shape[1] - 1, 0, -1):
            v_e = v_e * since + x_e
            x_e = x_e * since + row[..., n]
        return x_e, v_e
    amplitude, phase, omega, chirp = (row[..., n] for n in range(1, 5))
    angle = phase + (omega + 0.5 * chirp * since) * since
    return amplitude * np.sin(angle), amplitude * (omega + chirp * since) * np.cos(angle)
