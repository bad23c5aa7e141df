"""One contact that lasts: a linear spring and dashpot in the wall, in closed form.

While ball and wall touch, the overlap z and its rate obey

    z'' = g - 2 a z' - (wd^2 + a^2) z,        z(0) = 0, z'(0) = rho

with wd = pi/tau and a = -ln(r)/tau, so that a contact without g lasts tau and turns rho into
-r rho. g is the acceleration with which ball and wall approach otherwise, taken as constant over
the contact. The momentum exchanged, and the moment about which it acts, are all that
the motion before and after needs to know.
"""

from __future__ import annotations

import math

from vinesexp.solver.compiled import compiled

#: Least restitution: a contact without any rebound would last for ever.
LEAST_R = 1e-3
_HALVINGS = 60


@compiled
def overlap(t: float, rho: float, g: float, a: float, wd: float) -> float:
    """z of the module's equation."""
    still = g / (wd * wd + a * a)
    swing = -still * math.cos(wd * t) + (rho - a * still) / wd * math.sin(wd * t)
    return still + math.exp(-a * t) * swing


@compiled
def overlap_rate(t: float, rho: float, g: float, a: float, wd: float) -> float:
    """z' of the module's equation."""
    swing = rho * math.cos(wd * t) + (g - a * rho) / wd * math.sin(wd * t)
    return math.exp(-a * t) * swing


@compiled
def touch(rho: float, g: float, r: float, tau: float) -> tuple[float, float, float]:
    """How a contact ends.

    Returns
    -------
    duration, centre : float
        s; until the ball leaves, and until the middle of the momentum exchanged. The duration is
        infinite where the wall's push holds the ball: it stays.
    jump : float
        Relative velocity that the contact takes, m/s: momentum over the reduced mass.
    """
    wd, a = math.pi / tau, -math.log(max(r, LEAST_R)) / tau
    first = math.atan2(rho, -(g - a * rho) / wd) / wd  # largest overlap
    low, high = first, first + tau  # the smallest after it
    if overlap(high, rho, g, a, wd) >= 0.0:
        return math.inf, 0.0, rho
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if overlap(middle, rho, g, a, wd) > 0.0:
            low = middle
        else:
            high = middle
    jump = rho + g * high - overlap_rate(high, rho, g, a, wd)
    return high, high - (rho + 0.5 * g * high) * high / jump, jump
