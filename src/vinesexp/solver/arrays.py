"""A rig, a base and a release as the arrays that the compiled loops work on.

Base motions are tables of pieces. Two forms serve all of them (`series.py`): sines whose frequency
is constant or grows linearly, and polynomials. A row is one piece and holds until the next starts.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from fractions import Fraction
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.errors import ParameterError
from vinesexp.excitation import Base, Harmonic, Measured, Release, SteppedSweep, Sweep, WeakDamping
from vinesexp.rig import NES, Rig
from vinesexp.solver.state import (
    BALL,
    CHIRP,
    POLYNOMIAL,
    UNSET,
    WORK,
    Parameters,
    Records,
)

LINEAR = WeakDamping()
#: Of a ball: what a start fills in, all but its state.
PLACED = [
    *("mass", "half", "b_plus", "r", "r_plus", "r_minus", "r_slope", "r_scatter", "r_seed"),
    *("rub", "tilt", "tau", "gap", "side", "rho", "u", "way"),
]


def is_plain(rig: Rig, damping: WeakDamping = LINEAR) -> bool:
    """Whether balls fly freely and bounce with one r, the oscillator being linear.

    Clearances that differ between the two walls are plain: only the width of a cavity matters.
    """
    return rig.oscillator.k3 == 0.0 and damping == LINEAR and all(
        not nes.rubs and nes.r_slope == 0.0 and nes.restitution(-1) == nes.r
        and nes.contact_time == 0.0 and nes.r_scatter == 0.0
        for nes in rig.nes
    )  # fmt: skip


def parameters(rig: Rig, damping: WeakDamping) -> Parameters:
    """What the loops know of the oscillator."""
    o = rig.oscillator
    return Parameters(o.M, o.c1, o.k1, damping.quadratic, damping.coulomb, o.k3)


def ball_table(rig: Rig, release: Release) -> tuple[Records, FloatArray]:
    """Balls at the start (`state.BALL`) and their places y0, refused where outside."""
    y0, vy0 = starts_of(rig, release)
    table = np.zeros(len(rig.nes), BALL)
    for i, nes in enumerate(rig.nes):
        gap, side = gap_of(nes, i, release.x0, y0[i])
        table[PLACED][i] = (
            nes.m, 0.5 * (nes.b + nes.clearance(-1)), nes.b, nes.restitution(side), nes.r,
            nes.restitution(-1), nes.r_slope, nes.r_scatter, nes.r_seed, nes.friction, nes.tilt,
            nes.contact_time, gap, side,
            release.v0 - vy0[i], vy0[i], UNSET if nes.rubs else 0.0,
        )  # fmt: skip
    return table, np.array(y0, dtype=np.float64)


def balls_at(
    *, m: ArrayLike, b: ArrayLike, r: ArrayLike, gap: ArrayLike, side: ArrayLike, v: ArrayLike
) -> Records:
    """Balls of plain rigs at rest (`state.BALL`): m, b, r; gap to a wall, its side; x'."""
    table = np.zeros(np.broadcast(m, b, r, gap, side, v).shape, BALL)
    table["mass"], table["gap"], table["side"], table["rho"] = m, gap, side, v
    table["half"] = table["b_plus"] = b
    table["r"] = table["r_plus"] = table["r_minus"] = r
    return table


def starts_of(rig: Rig, release: Release) -> tuple[Sequence[float], Sequence[float]]:
    """y0 and y0' of every ball; by default at rest mid-cavity."""
    n = len(rig.nes)
    for name, values in (("y0", release.y0), ("vy0", release.vy0)):
        if values and len(values) != n:
            raise ParameterError(
                f"{name} has {len(values)} values, expected {n}: one per NES (or none at all)"
            )
    centre = [release.x0 - 0.5 * (nes.b - nes.clearance(-1)) for nes in rig.nes]
    return release.y0 or centre, release.vy0 or [0.0] * n


def gap_of(nes: NES, i: int, x0: float, y0: float) -> tuple[float, int]:
    """Gap (m) of ball i to the nearer wall, and that wall; refused outside its cavity."""
    w, minus = x0 - y0, nes.clearance(-1)
    side = 1 if w >= 0.5 * (nes.b - minus) else -1
    b = nes.b if side > 0 else minus
    gap = b - side * w
    rounding = 4.0 * sys.float_info.epsilon * (abs(x0) + abs(y0) + b)
    if gap < -rounding:
        raise ParameterError(
            f"ball {i} starts at x - y = {w:.9g} m, outside its cavity: "
            f"expected from {-minus:.9g} to {nes.b:.9g} m, its clearances"
        )
    # Within rounding of the wall means on it: 0.034 - 0.0 and b need not agree in the last bit.
    return (0.0 if gap <= rounding else gap), side


def has_closed_form(
    w0: FloatArray, zeta: FloatArray, w: FloatArray, driven: BoolArray
) -> BoolArray:
    """Where `closed_form` is a good one: natural and base rate (rad/s), whether the base moves."""
    gap = np.hypot((w0 - w) * (w0 + w), 2.0 * zeta * w0 * w)
    sharp = driven & (gap < 1e-3 * w0 * w0)
    return np.asarray((zeta <= 0.9) & ~sharp & (w > 1e-2 * w0) & (w < 1e2 * w0))


def closed_form(rig: Rig, base: Base | None) -> Records | None:
    """The closed form where there is a good one, else None: power series then.

    Not for a base that is not harmonic, an oscillator near or beyond critical damping, or a
    resonance so sharp that the particular response would dwarf the motion.
    """
    from vinesexp.solver.response import prepare

    o = rig.oscillator
    if not isinstance(base, Harmonic | None):
        return None
    amplitude, frequency, phase = 0.0, o.f0, 0.0
    if isinstance(base, Harmonic) and base.amplitude > 0.0:
        amplitude, frequency, phase = base.amplitude, base.frequency, base.phase
    rates = (np.array(one) for one in (o.w0, o.zeta, 2.0 * math.pi * frequency, amplitude > 0.0))
    if not has_closed_form(*rates):
        return None
    return prepare(o.M, o.c1, o.k1, amplitude, frequency, phase)


def scratch(rig: Rig, base: Base | None, damping: WeakDamping) -> FloatArray:
    """Scratch space of the loops: series as long as the segments of this motion need them."""
    from vinesexp.solver.series import HIGH, LOW, ORDER, THETA

    order = HIGH if damping.quadratic or rig.oscillator.k3 else ORDER
    if isinstance(base, Measured) and rig.oscillator.w0 < THETA[LOW + 1] * base.sample_rate:
        order = LOW  # no segment is longer than a sample
    return np.zeros((WORK, order + 1))


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
        return CHIRP, np.array([[0.0, base.amplitude, base.phase, math.tau * base.frequency, 0.0]])
    if isinstance(base, Sweep):
        chirp = math.tau * (base.f_end - base.f_start) / base.duration
        mean = (Fraction(base.f_start) + Fraction(base.f_end)) / 2
        turned = base.phase + math.tau * float(mean * Fraction(base.duration) % 1)
        return CHIRP, np.array(
            [
                [0.0, base.amplitude, base.phase, math.tau * base.f_start, chirp],
                [base.duration, base.amplitude, turned, math.tau * base.f_end, 0.0],
            ]
        )
    if isinstance(base, SteppedSweep):
        omega = math.tau * np.asarray(base.frequencies, dtype=np.float64)
        fixed = np.full(omega.size, base.amplitude)
        phase = base.phase + math.tau * np.array(_cycles_before(base))
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
