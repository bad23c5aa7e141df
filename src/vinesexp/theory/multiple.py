"""Several NESs in parallel: activation bands, their overlap, and a designer of clearances.

To order eps each ball sees only the oscillator's amplitude (separate activity) and the balls' pulls
add up (additivity), docs/theory.md (47-51). Everything here is in SI; balls may differ in mass,
clearance and restitution.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.errors import ParameterError
from vinesexp.rig import ABOVE_ZERO, NES, Oscillator, Rig, checked
from vinesexp.theory.manifold import A_1, A_2, upper_branch


@dataclass(frozen=True)
class ActivationBand:
    """Amplitudes x (m) at which one NES keeps two symmetric impacts: from T1 to T2."""

    low: float
    high: float


def bands(balls: Sequence[NES]) -> list[ActivationBand]:
    """Activation band [A_1 b_i, A_2 b_i] of each NES, m (docs/theory.md, 49).

    Examples
    --------
    >>> pair = [NES(m=0.032, b=0.023, r=0.6), NES(m=0.032, b=0.034, r=0.6)]
    >>> [(round(1e3 * band.low, 2), round(1e3 * band.high, 2)) for band in bands(pair)]
    [(3.62, 16.84), (5.34, 24.89)]
    """
    return [ActivationBand(float(A_1(n.r)) * n.b, float(A_2(n.r)) * n.b) for n in balls]


def gaps(balls: Sequence[NES]) -> list[ActivationBand]:
    """Amplitudes between the bands where no NES is captured; empty where neighbours overlap.

    The paper's ordering rule (49), A_11 < A_21 < ..., is applied by sorting.
    """
    found = []
    reach = -np.inf
    for band in sorted(bands(balls), key=lambda one: one.low):
        if band.low > reach > 0.0:
            found.append(ActivationBand(float(reach), band.low))
        reach = max(reach, band.high)
    return found


def base_amplitude_for(x: ArrayLike, rig: Rig, *, frequency: float | None = None) -> FloatArray:
    """Base amplitude G that holds the oscillator at amplitude x, balls above their fold active.

    G x = hypot(2 zeta x^2 + sum 16 Gamma eps_i C_i^2/pi^3, sum 8 eps_i C_i (b_i - C_i)/pi^2 -
    2 (Omega - 1) x^2), C_i in m on the right branch (docs/theory.md, 50).

    Parameters
    ----------
    x : array_like
        Amplitude, m, > 0.
    rig : Rig
        Oscillator and balls.
    frequency : float, optional
        Hz; the oscillator's own where None.

    Examples
    --------
    >>> rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), [NES(m=0.032, b=0.034, r=0.6)])
    >>> round(1e3 * float(base_amplitude_for(10e-3, rig)), 3)  # mm
    0.33
    """
    height = checked(x, "amplitude x", "m", ABOVE_ZERO)
    o = rig.oscillator
    detuning = 0.0 if frequency is None else frequency / o.f0 - 1.0
    across = 2.0 * o.zeta * height**2
    along = -2.0 * detuning * height**2
    for ball in rig.nes:
        fold = float(A_1(ball.r)) * ball.b
        active = height >= fold * (1.0 - 1e-12)
        C = ball.b * upper_branch(np.maximum(height / ball.b, float(A_1(ball.r))), r=ball.r)
        share = np.where(active, ball.m / o.M, 0.0)
        across = across + share * 16.0 * ball.Gamma * C**2 / np.pi**3
        along = along + share * 8.0 * C * (ball.b - C) / np.pi**2
    G: FloatArray = np.hypot(across, along) / height
    return G


def design_clearances(
    *,
    G_low: float,
    G_high: float,
    oscillator: Oscillator,
    masses: Sequence[float],
    r: Sequence[float],
) -> tuple[float, ...]:
    """One clearance a ball (m) for base amplitudes from G_low to G_high at resonance.

    Levels in geometric progression, the largest ball tuned to the strongest excitation (the
    paper's advice). Ball by ball from the smallest, the clearance puts the ball on its fold at its
    level while the smaller ones act (those not yet past their T2), docs/theory.md (51).

    Parameters
    ----------
    G_low, G_high : float
        Range of base amplitudes, m, 0 < G_low <= G_high.
    oscillator : Oscillator
    masses, r : sequences of float
        Of each ball, in the order of growing clearance; kg.

    Examples
    --------
    >>> o = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
    >>> one = design_clearances(G_low=1e-4, G_high=2.5e-4, oscillator=o, masses=[0.032], r=[0.6])
    >>> [round(1e3 * b, 3) for b in one]
    [33.746]
    """
    if any(float(A_1(one)) == 0.0 for one in r):
        raise ParameterError("restitution r = 1: the fold lies at zero, nothing to design for")
    n = len(masses)
    levels = np.geomspace(G_low, G_high, n) if n > 1 else np.array([G_high])
    balls: list[NES] = []
    for level, mass, own in zip(levels, masses, r, strict=True):
        b = _clearance_at(float(level), mass, balls, oscillator, own)
        balls.append(NES(m=mass, b=b, r=own))
    return tuple(ball.b for ball in balls)


def _clearance_at(
    G: float, mass: float, smaller: Sequence[NES], oscillator: Oscillator, r: float
) -> float:
    """b whose fold amplitude A_1 b is carried by exactly G; smaller balls help up to their T2."""

    def carried(b: float) -> float:
        x = float(A_1(r)) * b
        helping = [n for n in smaller if x <= float(A_2(n.r)) * n.b]
        rig = Rig(oscillator, [*helping, NES(m=mass, b=b, r=r)])
        return float(base_amplitude_for(x, rig))

    # its fold lies above the last one's; of equal balls: its clearance above the last one's
    low = float(A_1(smaller[-1].r)) * smaller[-1].b / float(A_1(r)) if smaller else 0.0
    high = max(low, G)
    while carried(high) < G:
        high *= 2.0
    while high - low > 1e-14 * high:
        middle = 0.5 * (low + high)
        if carried(middle) < G:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
