"""The slow invariant manifold (SIM): which amplitude C of the ball goes with which amplitude A.

At 1:1 resonance and order eps^0 the ball sees a box shaken by A sin(tau). Two impacts per cycle
tie A and C together (docs/theory.md, equation 8); the fold T1 and the symmetry breaking T2 are
where an eigenvalue of the half-period impact map is +1 or -1. Lengths are in units of the
clearance b.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.rig import ABOVE_ZERO, UP_TO_1, ZERO_OR_ABOVE, checked


# Project a motion onto the SIM: one point (C, A) an impact, from measured or simulated impacts.
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
    length = checked(b, "clearance b", "m", ABOVE_ZERO)
    rate = checked(w0, "angular frequency w0", "rad/s", ABOVE_ZERO)
    place = np.asarray(x, dtype=np.float64) + eps * np.asarray(y)
    speed = np.asarray(v, dtype=np.float64) + eps * np.asarray(vy)
    A: FloatArray = np.hypot(place, speed / rate) / length
    C: FloatArray = 0.5 * np.pi * np.abs(vy) / (rate * length)
    return C, A


def loss_parameter(r: ArrayLike) -> FloatArray:
    """Gamma = (1 - r)/(1 + r), from 0 (elastic) to 1 (plastic); r refused outside [0, 1].

    Examples
    --------
    >>> round(float(loss_parameter(0.6)), 12)
    0.25
    """
    restitution = checked(r, "restitution r", "", UP_TO_1)
    return (1.0 - restitution) / (1.0 + restitution)


def C_1(r: ArrayLike) -> FloatArray:
    """Ball amplitude at the fold T1: pi^2/S, S = pi^2 + 4 Gamma^2 (docs/theory.md, 9)."""
    return np.pi**2 / (np.pi**2 + 4.0 * loss_parameter(r) ** 2)


def A_1(r: ArrayLike) -> FloatArray:
    """Amplitude at the fold T1, the least that keeps two impacts per cycle (docs/theory.md, 9).

    Parameters
    ----------
    r : array_like
        Restitution, in [0, 1].

    Returns
    -------
    ndarray
        2 Gamma/sqrt(S), in units of b (0 at r = 1).

    Examples
    --------
    >>> round(float(A_1(0.6)), 8)
    0.15717673
    """
    Gamma = loss_parameter(r)
    fold: FloatArray = 2.0 * Gamma / np.sqrt(np.pi**2 + 4.0 * Gamma**2)
    return fold


def C_2() -> float:
    """Ball amplitude at T2: pi^2/(pi^2 - 4), whatever the restitution (docs/theory.md, 13)."""
    return np.pi**2 / (np.pi**2 - 4.0)


def A_2(r: ArrayLike) -> FloatArray:
    """Amplitude at T2, where two symmetric impacts per cycle turn asymmetric.

    2 sqrt(4 + pi^2 Gamma^2)/(pi^2 - 4) (docs/theory.md, 14). The paper reads 0.6 off its figure 2;
    that value is not reached by any r: 4/(pi^2 - 4) = 0.681 at r = 1, and more below.

    Examples
    --------
    >>> round(float(A_2(0.6)), 8), round(float(A_2(1.0)), 8)
    (0.73213987, 0.68147693)
    """
    Gamma = loss_parameter(r)
    return 2.0 * np.hypot(2.0, np.pi * Gamma) / (np.pi**2 - 4.0)


def amplitude(C: ArrayLike, *, r: ArrayLike) -> FloatArray:
    """A on the SIM for a ball amplitude C >= 0: hypot(1 - C, 2 C Gamma/pi) (docs/theory.md, 8).

    Examples
    --------
    >>> round(float(amplitude(C_1(0.6), r=0.6)), 8)
    0.15717673
    """
    ball = checked(C, "ball amplitude C", "", ZERO_OR_ABOVE)
    return np.hypot(1.0 - ball, 2.0 * ball * loss_parameter(r) / np.pi)


def upper_branch(A: ArrayLike, *, r: ArrayLike) -> FloatArray:
    """C on the right branch, the one with a stable part (docs/theory.md, 10)."""
    height = checked(A, "amplitude A", "", ZERO_OR_ABOVE)
    Gamma = loss_parameter(r)
    scale = np.pi**2 / (np.pi**2 + 4.0 * Gamma * Gamma)  # pi^2/S, C_1
    fold = (2.0 / np.pi) * Gamma * np.sqrt(scale)
    square = (height - fold) * (height + fold)
    # A few rounding units of slack: A = A_1 computed elsewhere is the fold, not an error.
    if np.any(square < -1e-15 * fold * fold):
        lost = np.flatnonzero(np.ravel(square < -1e-15 * fold * fold))[0]
        wrong, floor = (np.broadcast_to(v, square.shape).ravel()[lost] for v in (height, fold))
        raise AnalysisError(
            f"amplitude {wrong:.6g} is below the fold A_1 = {floor:.6g} (in clearances): "
            "no two impacts per cycle exist there"
        )
    branch: FloatArray = scale + np.sqrt(scale * np.maximum(square, 0.0))
    return branch


def is_stable(C: ArrayLike, *, r: ArrayLike) -> BoolArray:
    """Whether the SIM attracts at C: C_1 < C < C_2, and impacts take energy (docs/theory.md, 11).

    Both eigenvalues of the half-period impact map are inside the unit circle there.

    Examples
    --------
    >>> is_stable([0.9, 1.2, 1.7], r=0.6).tolist()
    [False, True, False]
    """
    ball = checked(C, "ball amplitude C", "", ABOVE_ZERO)
    return np.asarray((C_1(r) < ball) & (ball < C_2()) & (np.asarray(r) < 1.0))
