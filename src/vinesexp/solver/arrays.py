"""A rig, a base and a release as the arrays that the compiled loops work on."""

from __future__ import annotations

import math

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import ParameterError
from vinesexp.excitation import Base, Harmonic, Release, WeakDamping
from vinesexp.rig import Rig
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
    for name, values in (("y0", release.y0), ("vy0", release.vy0)):
        if values and len(values) != n:
            raise ParameterError(
                f"{name} has {len(values)} values, expected {n}: one per NES (or none at all)"
            )
    centre = [release.x0 - 0.5 * (nes.b - nes.clearance(-1)) for nes in rig.nes]
    y0 = np.array(release.y0 or centre, dtype=np.float64)
    vy0 = np.array(release.vy0 or [0.0] * n, dtype=np.float64)
    table = np.zeros((n, COLUMNS))
    for i, nes in enumerate(rig.nes):
        w = release.x0 - y0[i]
        side = 1 if w >= 0.5 * (nes.b - nes.clearance(-1)) else -1
        b = nes.clearance(side)
        gap = b - side * w
        rounding = 4.0 * np.finfo(np.float64).eps * (abs(release.x0) + abs(y0[i]) + b)
        if gap < -rounding:
            raise ParameterError(
                f"ball {i} starts at x - y = {w:.9g} m, outside its cavity: "
                f"expected from {-nes.clearance(-1):.9g} to {nes.b:.9g} m, its clearances"
            )
        # Within rounding of the wall means on it: 0.034 - 0.0 and b need not agree in the last bit.
        gap = 0.0 if gap <= rounding else gap
        half, r = 0.5 * (nes.b + nes.clearance(-1)), (nes.r, nes.restitution(-1), nes.r_slope)
        row = table[i]
        row[MASS], row[CLEARANCE], row[RESTITUTION], row[B_PLUS] = (
            nes.m, half, nes.restitution(side), nes.b,
        )  # fmt: skip
        row[R_PLUS], row[R_MINUS], row[R_SLOPE], row[RUB], row[TILT] = *r, nes.friction, nes.tilt
        row[D], row[SIDE], row[RHO], row[U] = gap, side, release.v0 - vy0[i], vy0[i]
        row[STATE], row[WAY] = FREE, UNSET
    return table, y0


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
