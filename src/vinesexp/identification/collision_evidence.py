"""Which effects of ball and contact the collisions show, cheapest first, by evidence.

Every set of up to three effects is fitted. A set is preferred to the plain model only where the
records leave no question, so that a plain rig stays plain. Where several sets explain the records
about as well, r and M are averaged over them and their errors hold the difference.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vinesexp.identification.collision_model import EFFECTS, POSITIVE, Collisions, Fit, fit

FloatArray = NDArray[np.float64]

#: Effects at once; more are not told apart by the tests of a usual campaign.
_MOST = 3
#: The evidence, as a difference of the Bayesian information criterion, that an effect needs.
_BAR = 12.0
#: An effect is real if it is so many of its standard errors.
_SURE = 4.0
#: A set whose criterion is worse by less explains the records nearly as well.
_RIVAL = 6.0
#: No law of rubbing or of a contact is truer than this share of what it corrects.
_LAW = 0.03
#: Effects too small to matter in a lab, in their units: left alone however sure.
MATTERS = {
    "r_wall_difference": 5e-4,
    "r_speed_slope": 1e-3,
    "friction": 5e-3,
    "clearance_offset": 3e-5,
    "contact_time": 5e-5,
    "tilt": 5e-3,
}


@dataclass(frozen=True)
class Evidence:
    """What the collisions of a campaign show.

    Attributes
    ----------
    plain, best : Fit
        Without effects, and with those chosen (the same where none is).
    r, r_error : float
        Of the walls at the working speed, averaged over the models that the records allow.
    ln_ratio, ln_ratio_error : float
        ln(M/m), from the collisions alone.
    rivals : tuple of tuples of str
        Other sets of effects that explain the records almost as well.
    """

    plain: Fit
    best: Fit
    r: float
    r_error: float
    ln_ratio: float
    ln_ratio_error: float
    rivals: tuple[tuple[str, ...], ...]


def weigh(collisions: Collisions, *, prior: tuple[float, float] | None) -> Evidence:
    """Choose effects by evidence.

    Parameters
    ----------
    collisions : Collisions
    prior : tuple (value, error), optional
        ln(M/m) from added masses: without it a longer contact and a smaller ball look alike.
    """
    # Records may scatter more than their impacts let expect: as much as around the richest model.
    scale = fit(collisions, tuple(EFFECTS), prior=prior).scale
    collisions = replace(
        collisions,
        sigma_r=collisions.sigma_r * math.sqrt(scale),
        sigma_jump=collisions.sigma_jump * math.sqrt(scale),
    )
    fits = _fits(collisions, prior)
    plain, best = fits[0], fits[_preferred(fits, collisions)]
    scores = _scores(fits, collisions)
    at = fits.index(best)
    if scores[0] - scores[at] < _BAR:
        return _evidence(collisions, plain, plain, [plain], np.zeros(1))
    return _evidence(collisions, plain, best, fits, scores - scores[at])


def _evidence(
    collisions: Collisions, plain: Fit, best: Fit, fits: list[Fit], worse: FloatArray
) -> Evidence:
    """The chosen model, with the others weighed by how much worse they are."""
    weights = np.minimum(np.exp(-0.5 * worse), 1.0)
    weights /= weights.sum()
    r, r_error = _averaged(fits, weights, 0)
    r_error = math.hypot(r_error, _LAW * (r - float(plain.values[0])))
    if "r_speed_slope" in best.effects:
        # At which speed r is wanted is not known better than the speeds of these tests.
        speed = np.abs(collisions.flights.v_before - collisions.flights.u_before)
        low, high = np.percentile(speed, [25.0, 75.0])
        r_error = math.hypot(r_error, 0.5 * float(high - low) * best.of("r_speed_slope")[0])
    free = fit(collisions, best.effects)
    ln_error = math.sqrt(float(free.covariance[1, 1]))
    rivals = tuple(
        one.effects
        for one, behind in zip(fits, worse, strict=True)
        if behind < _RIVAL and not set(best.effects) <= set(one.effects)
    )
    return Evidence(plain, best, r, r_error, float(free.values[1]), ln_error, rivals)


def _fits(collisions: Collisions, prior: tuple[float, float] | None) -> list[Fit]:
    """Every possible set of effects, the plain model first."""
    found = [
        fit(collisions, effects, prior=prior)
        for count in range(_MOST + 1)
        for effects in itertools.combinations(EFFECTS, count)
    ]
    return [one for one in found if _possible(one)]


def _scores(fits: list[Fit], collisions: Collisions) -> FloatArray:
    """Bayesian information criterion of each."""
    price = math.log(2 * collisions.record.size)
    return np.array([one.chi2 + len(one.effects) * price for one in fits])


def _preferred(fits: list[Fit], collisions: Collisions) -> int:
    """The best of those of which every effect is sure and large enough to matter."""
    scores = _scores(fits, collisions)
    scores[[not _matter(one) for one in fits]] = np.inf
    return int(np.argmin(scores))


def _possible(found: Fit) -> bool:
    """No negative rubbing, no negative contact."""
    return all(found.of(name)[0] > 0.0 for name in found.effects if name in POSITIVE)


def _matter(found: Fit) -> bool:
    """Each effect sure, and large enough to be one."""
    for name in found.effects:
        value, error = found.of(name)
        if abs(value) < max(_SURE * error, MATTERS[name]):
            return False
    return True


def _averaged(fits: list[Fit], weights: FloatArray, i: int) -> tuple[float, float]:
    """Mean of a value over models, and its error with their differences."""
    values = np.array([one.values[i] for one in fits])
    variances = np.array([max(one.covariance[i, i], 0.0) for one in fits])
    mean = float(weights @ values)
    return mean, math.sqrt(float(weights @ (variances + (values - mean) ** 2)))
