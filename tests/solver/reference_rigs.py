"""The generic reference problems, built from nothing but a rig.

A ball under gravity is a ball in a cavity whose wall is accelerated upwards: the oscillator is so
heavy that impacts do not move it, and its spring pulls at a constant force. An oscillator against
a fixed wall is one whose "ball" is so heavy that it stays where it is.
"""

from __future__ import annotations

import numpy as np

from vinesexp import NES, Harmonic, Motion, Oscillator, Release, Rig, simulate

HEAVY = 1e20


def falling_ball(
    *, height: float, speed: float, g: float, e: float, duration: float, gap: float = 1e3
) -> Motion:
    """Ball `height` above the floor of a cavity `gap` high, moving up at `speed`."""
    # A base held far away pulls on a soft spring with a force that is constant to rounding.
    w0 = 1e-9
    base = Harmonic(amplitude=g / w0**2, frequency=1e-30, phase=0.5 * np.pi)
    b = 0.5 * gap
    rig = Rig(Oscillator(M=HEAVY, c1=0.0, k1=HEAVY * w0**2), nes=[NES(m=1.0, b=b, r=e)])
    return simulate(rig, base, Release(y0=[height - b], vy0=[speed]), duration)


def against_wall(
    *, oscillator: Oscillator, x0: float, v0: float, wall: float, e: float, duration: float,
    b: float, below: bool = False, base: object = None,
) -> Motion:  # fmt: skip
    """Oscillator that meets a fixed wall at x = `wall`, from above if `below`.

    The cavity is 2 b wide; y holds the place of the wall to the rounding of b, so b is to be small.
    """
    y = wall + b if below else wall - b
    rig = Rig(oscillator, nes=[NES(m=HEAVY * oscillator.M, b=b, r=e)])
    return simulate(rig, base, Release(x0, v0, [y], [0.0]), duration)  # type: ignore[arg-type]
