"""A rig, a base and a release as the arrays that the compiled loops work on."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import ParameterError
from vinesexp.excitation import Base, Harmonic, Release, WeakDamping
from vinesexp.rig import NES, Rig
from vinesexp.solver.state import (
    B_PLUS,
    CLEARANCE,
    COLUMNS,
    FREE,
    MASS,
    R_MINUS,
    R_PLUS,
    R_SLOPE,
    RESTITUTION,
    RHO,
    RUB,
    SIDE,
    STATE,
    TILT,
    UNSET,
    WAY,
    D,
    U,
)

LINEAR = WeakDamping()


def is_plain(rig: Rig, damping: WeakDamping = LINEAR) -> bool:
    """Whether the loop of `kernel.py` serves: free flights, constant r, a linear oscillator.

    Clearances that differ between the two walls are plain: only the width of a cavity matters.
    """
    return rig.oscillator.k3 == 0.0 and damping == LINEAR and all(
        not nes.rubs and nes.r_slope == 0.0 and nes.restitution(-1) == nes.r
        and nes.contact_time == 0.0
        for nes in rig.nes
    )  # fmt: skip


def parameters(rig: Rig, damping: WeakDamping) -> FloatArray:
    """Mass, damping, stiffness, quadratic and Coulomb damping, cubic stiffness (`series.py`)."""
    o = rig.oscillator
    return np.array([o.M, o.c1, o.k1, damping.quadratic, damping.coulomb, o.k3])


def ball_table(rig: Rig, release: Release) -> tuple[FloatArray, FloatArray]:
    """Table of balls at the start (`state.py`) and their places y0, refused where outside."""
    n = len(rig.nes)
    y0, vy0 = starts_of(rig, release)
    table = np.zeros((n, COLUMNS))
    for i, nes in enumerate(rig.nes):
        gap, side = gap_of(nes, i, release.x0, y0[i])
        half, r = 0.5 * (nes.b + nes.clearance(-1)), (nes.r, nes.restitution(-1), nes.r_slope)
        row = table[i]
        row[MASS], row[CLEARANCE], row[RESTITUTION], row[B_PLUS] = (
            nes.m, half, nes.restitution(side), nes.b,
        )  # fmt: skip
        row[R_PLUS], row[R_MINUS], row[R_SLOPE], row[RUB], row[TILT] = *r, nes.friction, nes.tilt
        row[D], row[SIDE], row[RHO], row[U] = gap, side, release.v0 - vy0[i], vy0[i]
        row[STATE], row[WAY] = FREE, UNSET
    return table, np.array(y0, dtype=np.float64)


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


def closed_form(rig: Rig, base: Base | None, damping: WeakDamping) -> FloatArray | None:
    """Table of the closed form where there is a good one, else None: power series then.

    Not for weakly nonlinear damping or stiffness, a base that is not harmonic, an oscillator near
    or beyond critical damping, or a resonance so sharp that the particular response would dwarf
    the motion.
    """
    from vinesexp.solver.response import prepare

    o = rig.oscillator
    if not isinstance(base, Harmonic | None) or damping != WeakDamping() or o.k3 != 0.0:
        return None
    amplitude, frequency, phase = 0.0, o.f0, 0.0
    if isinstance(base, Harmonic) and base.amplitude > 0.0:
        amplitude, frequency, phase = base.amplitude, base.frequency, base.phase
    w = 2.0 * math.pi * frequency
    gap = math.hypot((o.w0 - w) * (o.w0 + w), 2.0 * o.zeta * o.w0 * w)
    sharp = amplitude > 0.0 and gap < 1e-3 * o.w0 * o.w0
    if o.zeta > 0.9 or sharp or not 1e-2 < w / o.w0 < 1e2:
        return None
    table: FloatArray = prepare(o.M, o.c1, o.k1, amplitude, frequency, phase)
    return table
