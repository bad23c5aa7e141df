"""The clearance that the impacts of a record show, where nobody stated it.

Between two walls the ball flies freely, so the speeds before and after an impact are known but for
the clearance b (`identification.flights`), and r ties them:

    (v_after - u_after) + r (v_before - u_before) = 0,   u = a + c b.

With r known from other records this is one equation an impact for b alone. Steady symmetric
impacts are all alike and give b as well as r is known; modulated ones give both.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import least_squares

from vinesexp.identification.flights import flights_of
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.units import Quantity

#: What is assumed of r where no record has shown it.
UNKNOWN_R = Quantity(0.6, 0.15)
#: Fewer impacts with flights are too few.
_FEWEST = 12
#: A clearance with a larger relative standard error is asked for instead.
_SURE = 0.01
_OUTLYING = 4.0  # robust standard deviations


def clearance_of_flights(
    impacts: Impacts, *, r: Quantity, frequency: float, sure: float = _SURE
) -> Quantity | None:
    """Clearance of the one ball of a record with its standard error, m; None where it stays open.

    Parameters
    ----------
    impacts : Impacts
        Found with any clearance of one ball: it does not enter them.
    r : Quantity
        Restitution, as far as it is known (`UNKNOWN_R`).
    frequency : float
        Of the oscillation, Hz.
    sure : float
        Largest relative standard error of an answer.
    """
    at_0, at_1 = (flights_of(impacts, nes=1, b=b, period=1.0 / frequency) for b in (0.0, 1.0))
    if at_0.index.size < _FEWEST:
        return None
    v_before, v_after = at_0.v_before, at_0.v_after
    a_before, c_before = at_0.u_before, at_1.u_before - at_0.u_before
    a_after, c_after = at_0.u_after, at_1.u_after - at_0.u_after
    keep = np.ones(v_before.size, dtype=bool)
    scatter = 1.0

    def misfit(b: float, restitution: float) -> np.ndarray:
        found = (v_after - a_after - c_after * b) + restitution * (
            v_before - a_before - c_before * b
        )
        return np.asarray(found)

    slope = c_after + r.value * c_before
    known = (v_after - a_after) + r.value * (v_before - a_before)
    start = float(np.median(known / slope))
    answer = np.array([start, r.value])
    solved = None
    for _ in range(6):
        rest = misfit(answer[0], answer[1])
        scatter = 1.4826 * float(np.median(np.abs(rest - np.median(rest)))) + 1e-6
        keep = np.abs(rest) < _OUTLYING * scatter
        if keep.sum() < _FEWEST:
            return None

        def residuals(p: np.ndarray, keep: np.ndarray = keep, by: float = scatter) -> np.ndarray:
            prior = (p[1] - r.value) / max(r.std_error, 1e-4)
            return np.append(misfit(p[0], p[1])[keep] / by, prior)

        solved = least_squares(residuals, answer, x_scale=[0.01, 0.1])
        if np.allclose(solved.x, answer, rtol=1e-6):
            break
        answer = solved.x
    if solved is None:
        return None
    b = float(answer[0])
    covariance = np.linalg.pinv(solved.jac.T @ solved.jac)
    # Flights are shared by neighbouring impacts: half as many are independent.
    error = math.sqrt(2.0 * float(covariance[0, 0]))
    if not (0.0 < b < 1.0 and 0.0 < answer[1] < 1.0) or error > sure * b:
        return None
    return Quantity(b, error)
