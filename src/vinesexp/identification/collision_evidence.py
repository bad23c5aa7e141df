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

from vinesexp.identification.collision_model import (
    EFFECTS,
    POSITIVE,
    Collisions,
    Fit,
    corrected,
    fit,
)

FloatArray = NDArray[np.float64]

#: Effects at once; more are not separated by the tests of a usual campaign.
_MOST = 3
#: The evidence, as a difference of the Bayesian information criterion, that an effect needs.
_BAR = 12.0
#: An effect is real if it is so many of its standard errors.
_SURE = 4.0
#: A set whose criterion is worse by less explains the records nearly as well.
_RIVAL = 6.0
#: No law of rubbing or of a contact is truer than this share of what it corrects.
_LAW = 0.03
#: Effects no rig in use has, in their units, and the largest correction of r.
LARGEST = {
    "r_wall_difference": 0.4,
    "r_speed_slope": 0.3,
    "friction": 2.0,
    "clearance_offset": 3e-3,
    "contact_time": 4e-3,
    "tilt": 1.0,
    "rolling": 0.45,
}
_FARTHEST_R, _FARTHEST_R_ROLLING = 0.06, 0.2
#: A ball takes 2/7 (solid) or 2/5 (hollow) of its floor's motion: what is less is something else.
_LEAST_ROLLING = 0.2
#: Effects that r and the mass of the ball can stand for.
_HIDDEN = ("friction", "contact_time")
#: Effects that change a flight and nothing of its ends.
_OF_FLIGHTS = ("clearance_offset", "tilt", "rolling")
#: Share of the shift that effective values leave: they are exact for one motion only.
_LEFT = 0.15
#: A pulse longer than this, s, is no instant; contact over pulse, where one is the other.
_LONG_PULSE, _AS_LONG = 6e-4, (0.4, 1.6)
_EXPECTED_SURE = 2.0
#: Effects too small to matter in a lab, in their units: left alone however sure.
MATTERS = {
    "r_wall_difference": 5e-4,
    "r_speed_slope": 1e-3,
    "friction": 5e-3,
    "clearance_offset": 3e-5,
    "contact_time": 5e-5,
    "tilt": 5e-3,
    "rolling": 0.02,
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
    effective : tuple of (value, error) pairs, or None
        r and ln(M/m) of a rig without rubbing and with instantaneous contacts that moves as this
        one does; None where it is the same.
    """

    plain: Fit
    best: Fit
    r: float
    r_error: float
    ln_ratio: float
    ln_ratio_error: float
    rivals: tuple[tuple[str, ...], ...]
    effective: tuple[tuple[float, float], tuple[float, float]] | None = None


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
    scores = _scores(fits, collisions)
    plain, best = fits[0], _or_contact(fits, scores, fits[_preferred(fits, collisions)], collisions)
    at = fits.index(best)
    if scores[0] - scores[at] < _BAR:
        lasting = _lasting(fits, scores, collisions)
        if lasting is not None:
            worse = scores - scores[fits.index(lasting)]
            return _evidence(collisions, plain, lasting, fits, worse)
        return _evidence(collisions, plain, plain, [plain], np.zeros(1))
    return _evidence(collisions, plain, best, fits, scores - scores[at])


def _lasting(fits: list[Fit], scores: FloatArray, collisions: Collisions) -> Fit | None:
    """A contact that lasts as long as its pulses needs little evidence: it was to be expected."""
    pulse = float(np.median(collisions.flights.pulse))
    for one, score in zip(fits, scores, strict=True):
        if one.effects == ("contact_time",) and pulse > _LONG_PULSE:
            value, error = one.of("contact_time")
            like = _AS_LONG[0] < value / pulse < _AS_LONG[1]
            if like and value > _EXPECTED_SURE * error and score < scores[0]:
                return one
    return None


def _or_contact(fits: list[Fit], scores: FloatArray, best: Fit, collisions: Collisions) -> Fit:
    """A contact that lasts, where the pulses last as long, before a clearance off the sheet.

    Both lengthen the flights; tests at few clearances hardly separate them.
    """
    if "clearance_offset" not in best.effects or "contact_time" in best.effects:
        return best
    swapped = {"contact_time", *best.effects} - {"clearance_offset"}
    pulse = float(np.median(collisions.flights.pulse))
    for one, score in zip(fits, scores, strict=True):
        if set(one.effects) == swapped and _matter(one):
            ratio = one.of("contact_time")[0] / pulse
            near = score - scores[fits.index(best)] < _RIVAL
            if near and pulse > _LONG_PULSE and _AS_LONG[0] < ratio < _AS_LONG[1]:
                return one
    return best


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
    return Evidence(
        plain, best, r, r_error, float(free.values[1]), ln_error, rivals,
        _effective(collisions, best, free.values),
    )  # fmt: skip


def _effective(
    collisions: Collisions, best: Fit, free: FloatArray
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """r and ln(M/m) with which the model without them has the flights of this rig.

    The model knows the mean speed of a flight only. What rubbing and a contact that lasts take from
    the ball is then in r, and what a contact takes from its way is in its momentum: exact for
    the periodic motion, whose end b_c is.
    """
    hidden = [name for name in best.effects if name in _HIDDEN]
    if not hidden:
        return None
    kept = tuple(name for name in best.effects if name not in _HIDDEN)
    values = {name: best.of(name)[0] for name in kept if name in _OF_FLIGHTS}
    u_before, u_after = corrected(collisions.flights, values)
    flights = replace(collisions.flights, u_before=u_before, u_after=u_after)
    others = tuple(name for name in kept if name not in _OF_FLIGHTS)
    seen = fit(replace(collisions, flights=flights), others)
    pairs = []
    for i, true in enumerate((best.values[0], free[1] if "contact_time" not in hidden else None)):
        value = float(seen.values[i])
        shift = 0.0 if true is None else value - float(true)
        error = math.sqrt(float(seen.covariance[i, i]))
        pairs.append((value, math.hypot(error, _LEFT * shift)))
    return pairs[0], pairs[1]


def _fits(collisions: Collisions, prior: tuple[float, float] | None) -> list[Fit]:
    """Every possible set of effects, the plain model first."""
    plain = fit(collisions, (), prior=prior)
    found = [
        fit(collisions, effects, prior=prior)
        for count in range(1, _MOST + 1)
        for effects in itertools.combinations(EFFECTS, count)
    ]
    pulse = float(np.median(collisions.flights.pulse))
    return [plain, *(one for one in found if _possible(one, plain) and not _undone(one, pulse))]


def _scores(fits: list[Fit], collisions: Collisions) -> FloatArray:
    """Bayesian information criterion of each."""
    price = math.log(2 * collisions.record.size)
    return np.array([one.chi2 + len(one.effects) * price for one in fits])


def _preferred(fits: list[Fit], collisions: Collisions) -> int:
    """The best of those of which every effect is sure and large enough to matter."""
    scores = _scores(fits, collisions)
    scores[[not _matter(one) for one in fits]] = np.inf
    return int(np.argmin(scores))


def _possible(found: Fit, plain: Fit) -> bool:
    """No negative rubbing, no negative contact, and nothing that no rig in use has.

    Impacts at wrong times or places ask for large effects that undo one another.
    """
    if "rolling" in found.effects and found.of("rolling")[0] < _LEAST_ROLLING:
        return False
    farthest = _FARTHEST_R_ROLLING if "rolling" in found.effects else _FARTHEST_R
    if abs(found.values[0] - plain.values[0]) > farthest:
        return False
    return all(
        abs(value) < LARGEST[name] and (value > 0.0 or name not in POSITIVE)
        for name, value in zip(found.effects, found.values[2:], strict=True)
    )


def _undone(found: Fit, pulse: float) -> bool:
    """Whether a contact that lasts and a cavity shorter than its sheet undo one another.

    One lengthens the flights, the other shortens them: together they fit errors of any kind. A
    pulse that lasts shows that the contact is there.
    """
    if not {"contact_time", "clearance_offset"} <= set(found.effects) or pulse > _LONG_PULSE:
        return False
    return found.of("clearance_offset")[0] < 0.0


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
