"""The published b_c along a map's other axis: the line to look for in its picture."""

from __future__ import annotations

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.maps.map_plan import MapPlan
from vinesexp.rig import Oscillator
from vinesexp.theory.optimal_clearance import b_c_published

#: Share of f0 by which the base may be off: the published formula is for resonance.
AT_RESONANCE = 2e-3


def published_line(plan: MapPlan) -> FloatArray | None:
    """b_c (m) for every value along y; None where x is not b, or the base is off resonance."""
    if plan.x != "b" or plan.y == "frequency":
        return None
    f0 = Oscillator(M=plan.values["M"], c1=plan.values["c1"], k1=plan.values["k1"]).f0
    if abs(plan.values["frequency"] - f0) > AT_RESONANCE * f0:
        return None
    found = []
    for y in plan.y_values:
        here = {**plan.values, plan.y: y}
        oscillator = Oscillator(M=here["M"], c1=here["c1"], k1=here["k1"])
        eps = here["m"] / here["M"]
        lam = 2.0 * oscillator.zeta / eps
        b_c = b_c_published(G=here["G"], eps=eps, lam=lam, r=here["r"])
        found.append(float(b_c))
    return np.array(found)
