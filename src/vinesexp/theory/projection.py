"""Project a motion onto the SIM: one point (C, A) an impact, from measured or simulated impacts."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.rig import checked


def project(
    *,
    x: ArrayLike,
    v: ArrayLike,
    y: ArrayLike,
    vy: ArrayLike,
    w0: float,
    b: float,
    eps: float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Ball and oscillator amplitude (C, A) just after each impact, in clearances.

    The ball's part of the order-zero motion is (2/pi) C Pi(tau + eta), a saw tooth of speed
    (2/pi) C: so C = (pi/2)|y'|/(w0 b). A is the amplitude of the centre of mass V = X + eps Y,
    which no impact changes (docs/theory.md, 15).

    Parameters
    ----------
    x, v, y, vy : array_like
        Oscillator and ball just after each impact; m, m/s.
    w0 : float
        Angular frequency, rad/s.
    b : float
        Clearance, m.
    eps : float
        Mass ratio.

    Examples
    --------
    >>> C, A = project(x=0.0, v=0.25, y=-1.0, vy=1.0, w0=1.0, b=1.0)
    >>> round(float(C), 4), round(float(A), 4)
    (1.5708, 0.25)
    """
    length = checked(b, "clearance b", "m, above zero", closed=False)
    rate = checked(w0, "angular frequency w0", "rad/s, above zero", closed=False)
    place = np.asarray(x, dtype=np.float64) + eps * np.asarray(y)
    speed = np.asarray(v, dtype=np.float64) + eps * np.asarray(vy)
    A: FloatArray = np.hypot(place, speed / rate) / length
    C: FloatArray = 0.5 * np.pi * np.abs(vy) / (rate * length)
    return C, A
