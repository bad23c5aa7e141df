"""What the joint model found, in words for checks.csv: causes, rivals, what is not explained."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from vinesexp.identification.joint.causes import FACTORS, Cause, Judged, Weighed
from vinesexp.records.stored.checks import Check, Outcome
from vinesexp.units import COVERAGE_95, with_error

#: Where each thing that is stated stands.
_PLACES = {
    "clearance": "clearance_mm",
    "base amplitude": "base_amplitude_mm",
    "release": "release_mm",
    "ball mass": "known.nes_mass",
    "added mass": "added_mass_g",
}
#: How a cause is called beside another that explains the records as well.
_NAMES = {
    "wall": "walls of different r",
    "slope": "r that depends on impact speed",
    "friction": "friction of the ball on its floor",
    "tilt": "a cavity that slopes",
    "contact": "a contact that lasts",
    "rolling": "a ball that rolls",
    "hollow": "a floor that is hollow, or a magnet",
    "even": "a displacement that is not straight (more on one side than on the other)",
    "odd": "a displacement that is not straight (a gain that changes toward both ends)",
    "drop": "drop tests on another surface than the walls",
    "pulse area": "a pulse of the accelerometer whose area is off (a contact that rings)",
    "jumps": "jumps of velocity that both sensors show wrong (a local mode)",
}
_SCATTERED = {
    "own r": "r differs from record to record",
    "own momentum": "the jumps of the mass differ from record to record from what the ball loses",
    "clearance": "the clearances scatter by more than their stated uncertainty",
    "own base": "the motion of the mass asks for another base in each record",
    "own f0": "f0 differs from record to record by more than mounting does",
    "own zeta": "zeta differs from record to record by more than mounting does",
    "own friction": "friction of the ball differs from record to record",
    "own tilt": "the slope of the cavity differs from record to record",
}


def cause_checks(judged: Judged) -> list[Check]:
    """One row for each cause that is named, for rivals, and for what nothing explains."""
    checks = []
    for weighed in judged.found:
        cause = weighed.cause
        record = cause.records[0] if len(cause.records) == 1 else ""
        names = " or ".join(dict.fromkeys(called(c) for c in (cause, *weighed.rivals[:3])))
        outcome: Outcome = "warning"
        if cause.kind == "remounting":
            kind, outcome = "remounting", "ok"
            detail = (
                "f0 and zeta of ring-downs with the same load differ as separate mountings do, and "
                "each counts as one; the errors hold it"
            )
        elif weighed.slight:
            kind, outcome = "slight", "ok"
            detail = (
                f"the records differ a little from the plain model, as {names} would make them: "
                "too little to say so. The values and their errors hold it"
            )
        elif cause.direction is None:
            kind, detail, record = "plain model", _unexplained(weighed), ""
        elif weighed.sure and not weighed.rivals:
            kind, detail = "cause", said(weighed)
        elif weighed.rivals:
            kind, record = "either", ""
            detail = (
                f"the records contradict what was stated; either explains them: {names}. The "
                "values and their errors hold all of these"
            )
        else:
            kind, record = "plain model", ""
            detail = (
                f"not explained: the records differ from the plain model as {called(cause)}"
                " would make them, but records left out are not predicted better so; the errors "
                "hold it"
            )
        checks.append(Check(record, kind, outcome, detail))
    return checks


def odd_checks(odd: Mapping[str, float]) -> list[Check]:
    """One row for each record whose flights fit far worse than those of the others."""
    return [
        Check(
            record, "plain model", "warning",
            "not explained: the flights of this record miss what all others show by "
            f"{math.sqrt(factor):.0f} times the usual; they hardly count. Lost samples, a channel "
            "with another clock, a ball that lies still or impacts found twice do that",
        )
        for record, factor in sorted(odd.items())
    ]  # fmt: skip


def _unexplained(weighed: Weighed) -> str:
    return (
        f"not explained: {_SCATTERED[weighed.cause.about]}, and no effect and no mistake that is "
        "known explains it; the errors hold this scatter"
    )


def called(cause: Cause) -> str:
    """A cause in a few words.

    Examples
    --------
    >>> called(Cause("effect tilt", "effect", "tilt", None))
    'a cavity that slopes'
    """
    if cause.kind == "effect":
        return _NAMES[cause.about]
    if cause.kind == "remounting":
        return "ring-downs that were each mounted anew"
    if cause.kind == "scatter":
        return f"an unexplained cause ({_SCATTERED[cause.about]})"
    place = _PLACES.get(cause.about, f"the {cause.about}")
    if cause.kind == "drift":
        after = f" from {cause.records[0]} on" if cause.records else " along the campaign"
        return f"{cause.about} that changes{after}"
    whose = cause.records or cause.stated
    if cause.key.startswith("exchanged"):
        return f"{place} of {whose[0]} and {whose[1]} exchanged"
    if cause.records:
        return f"{place} of {', '.join(cause.records)} that is wrong"
    if cause.factor is not None:
        return f"{place} that is {cause.factor:.4g} times the true value"
    if cause.stated:
        return f"{place} that is wrong ({', '.join(cause.stated)})"
    if "offset" in cause.key:
        return f"{place} that is off by one length or mass throughout"
    return f"{place} that is off by one factor throughout"


def said(weighed: Weighed) -> str:
    """A cause that is named, with its size +- half of its 95 % interval, and what to do."""
    cause, value, error = weighed.cause, weighed.value, COVERAGE_95 * weighed.error
    if cause.kind == "effect":
        return _EFFECTS[cause.about](value, error)
    if cause.kind == "drift":
        return _drift(cause, value, error)
    place = _PLACES.get(cause.about, f"the sensitivity of the {cause.about.removesuffix(' gain')}")
    whose = cause.records or cause.stated
    if cause.key.startswith("exchanged"):
        return (
            f"{place} of {whose[0]} and {whose[1]} are exchanged: each record shows the value of "
            "the other; the analysis has them turned round. Correct records.csv"
        )
    if cause.factor is not None:
        why = FACTORS[cause.factor]
        return (
            f"{place} is {cause.factor:.4g} times the true value in all records ({why}): the "
            "flights and the motion of the mass show it; the analysis takes the values found. "
            f"Correct {place}"
        )
    if "offset" in cause.key or cause.key.startswith("one "):
        unit, size = ("mm", 1e3) if cause.about == "clearance" else ("g", 1e3)
        if cause.about in ("base amplitude", "release"):
            return _by_share(place, value, error, cause)
        where = f"in {', '.join(whose)}" if whose else "in all records"
        return (
            f"the true value of {place} {where} is {_signed(size * value, size * error)} "
            f"{unit} from what is stated; the analysis takes the values found. Measure it again "
            "and correct it"
        )
    return _by_share(place, value, error, cause)


def _signed(value: float, half: float) -> str:
    """As `with_error`, for a difference: its sign is written.

    Examples
    --------
    >>> _signed(0.0123, 0.004), _signed(-0.2, 0.05)
    ('+0.0123 +- 0.0040', '-0.200 +- 0.050')
    """
    return f"{'+' if value > 0.0 else ''}{with_error(value, half)}"


def _by_share(place: str, value: float, error: float, cause: Cause) -> str:
    share = value if "scale" in cause.key and cause.about == "clearance" else math.expm1(value)
    if cause.records:
        place = f"{place} in {', '.join(cause.records)}"
    what = "shows" if cause.about.endswith("gain") or " gain of" in cause.about else "is truly"
    return (
        f"{place}: it {what} {with_error(1.0 + share, error)} times what is stated; the analysis "
        "takes the value found. Check it and correct it"
    )


#: Of what changes along a campaign: size and unit; of all others per cent.
_UNITS = {"r": (1.0, ""), "friction": (1.0, " m/s^2"), "slope of the cavity": (1.0, " m/s^2")}


def _drift(cause: Cause, value: float, error: float) -> str:
    name = cause.about
    scale, unit = _UNITS.get(name, (100.0, " %"))
    size = f"{_signed(scale * value, scale * error)}{unit}"
    if cause.records:
        return (
            f"{name} changes by {size} with record {cause.records[0]} and stays so, in the order "
            "of records.csv: something was changed, worked loose or warmed up; values hold both"
        )
    why = "wear, or dirt" if name in _UNITS else "temperature, or something that works loose"
    return (
        f"{name} drifts by {size} from the first record to the last, in the order of records.csv "
        f"({why}); values are those of the middle"
    )


_EFFECTS: Mapping[str, Callable[[float, float], str]] = {
    "wall": lambda v, e: (
        f"the two walls differ: r at the wall where x - y = +b is larger than at the other by "
        f"{with_error(v, e)}; r is their mean, and b_c is simulated with both"
    ),
    "slope": lambda v, e: (
        f"r depends on impact speed: it changes by {with_error(v, e)} for every m/s; r holds at "
        "the usual speed of these tests, and b_c is simulated with the change"
    ),
    "friction": lambda v, e: (
        f"friction on its floor slows the ball by mu g = {with_error(v, e)} m/s^2 between "
        "the walls; r allows for it, and b_c is that of a ball with friction, simulated"
    ),
    "tilt": lambda v, e: (
        f"the cavity slopes: the ball is pulled along it by {with_error(v, e)} m/s^2 (tilt of "
        f"{abs(v) / 9.80665 * 57.2958:.2g} degrees); r allows for it"
    ),
    "contact": lambda v, e: (
        f"a contact lasts {with_error(1e3 * v, 1e3 * e)} ms in which the ball gets no further; r "
        "allows for it, and b_c is that of such contacts, simulated"
    ),
    "rolling": lambda v, e: (
        f"the ball rolls: its floor takes it along by {with_error(v, e)} of the floor's own motion "
        "(2/7 of a solid ball that never slips); b_c is predicted for a ball that does so"
    ),
    "hollow": lambda v, e: (
        f"the ball is drawn to the middle of its cavity by {with_error(v, e)} m/s^2 for every m (a "
        f"floor that is hollow with a radius of {9.80665 / abs(v):.2g} m, or a magnet; a floor "
        "that bulges draws it to the walls, with a minus); r allows for it, and b_c is predicted "
        "with r_effective and nes_mass_effective"
    ),
    "even": lambda v, e: (
        f"the displacement is not straight: {with_error(1e-3 * v, 1e-3 * e)} x^2 more than x (mm), "
        "more on one side of the rest position than on the other; values allow for it, amplitudes "
        "do not. Look at the linearity of the sensor and at its angle"
    ),
    "odd": lambda v, e: (
        f"the displacement is not straight: {with_error(1e-6 * v, 1e-6 * e)} x^3 more than x (mm); "
        "values allow for it, amplitudes do not. Look at the range and the linearity of the sensor"
    ),
    "drop": lambda v, e: (
        f"r of the drop tests differs from that of the walls by {_signed(v, e)}: they were "
        "made on another surface, or the walls changed; the flights between the walls count"
    ),
    "jumps": lambda v, e: (
        f"the jumps of velocity that both sensors show are {with_error(math.exp(-v), e)} times "
        "those that the ball's momentum makes: a local mode, or a part that answers each impact; "
        "M by impacts allows for it"
    ),
    "pulse area": lambda v, e: (
        f"the jumps of velocity that the accelerometer shows are {with_error(math.exp(v), e)} "
        "times those of the displacement, while both show the same oscillation: the area of its "
        "pulse is off (a contact that rings, its mount, or a local mode); the momentum of the ball "
        "counts"
    ),
}
