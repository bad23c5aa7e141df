"""What the joint model found, in words for checks.csv: causes, rivals, what is not explained."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from vinesexp.identification.joint.causes import (
    FACTORS,
    WITH_CLEARANCE,
    Cause,
    Judged,
    Weighed,
)
from vinesexp.records.stored.checks import Check, Outcome
from vinesexp.units import COVERAGE_95, STANDARD_GRAVITY, with_error

#: Where each thing that is stated stands.
_PLACES = {
    "clearance": "clearance_mm",
    "base amplitude": "base_amplitude_mm",
    "release": "release_mm",
    "ball mass": "known.nes_mass",
    "mass": "known.mass",
    "added mass": "added_mass_g",
    "clock": "the clock of the recorder",
    "generator": "frequency_hz",
}
#: How a cause is called beside another that explains the records as well.
_NAMES = {
    "wall": "walls of different r",
    "slope": "r that depends on impact speed",
    "bend": "r that follows a curve over impact speed",
    "friction": "friction of the ball on its floor",
    "tilt": "a cavity that slopes",
    "contact": "a contact that lasts",
    "pad": "contacts that last longer at one wall",
    "course r": "r that changes in the course of each record",
    "course friction": "friction that changes in the course of each record",
    "rolling": "a ball that rolls",
    "hollow": "a concave floor, or a magnet",
    "drag": "drag of the air on the ball",
    "viscous": "viscous friction of the ball (a film of oil)",
    "even": (
        "a displacement sensor that is not linear (it reads more on one side than on the other)"
    ),
    "odd": "a displacement sensor that is not linear (its gain changes toward both ends)",
    "aboard": "ring-downs in which the mass carries more or less than in the tests with a ball",
    "drop": "drop tests on another surface than the walls",
    "beside": (
        "a displacement that is not measured in space (a sensor on the table, a table that turns)"
    ),
    "coupling": "a displacement that is AC-coupled",
    "base late": "a base channel that comes late or early beside the displacement",
    "pulse area": "an accelerometer whose pulses have the wrong area (a contact that rings)",
    "jumps": "velocity jumps that both sensors show too large or too small (a local mode)",
    "base felt": "a mass that is driven by more or less than the base that is measured",
    "second clock": "recorders of the two channels whose clocks differ",
}
#: Every contact lasts, and how r goes with speed is no line.
_ORDINARY = ("contact", "bend")
_SCATTERED = {
    "own r": "r differs from record to record",
    "own momentum": (
        "the ratio of the mass's velocity jumps to the momentum of the ball differs from record to "
        "record"
    ),
    "clearance": "the clearances scatter by more than their stated uncertainty",
    "base": "the base amplitudes differ from those stated, each by another factor",
    "own base": "the motion of the mass implies another base motion in each record",
    "own base late": "the base comes late beside the displacement by another time in each record",
    "own f0": "f0 differs from record to record by more than separate mountings explain",
    "own zeta": "zeta differs from record to record by more than separate mountings explain",
    "own f0 of tests with a ball": "f0 of the tests with a ball differs from record to record",
    "own zeta of tests with a ball": "zeta of the tests with a ball differs from record to record",
    "own friction": "friction of the ball differs from record to record",
    "own tilt": "the slope of the cavity differs from record to record",
    "own displacement gain": "the displacement is read with another gain in each record",
    "own acceleration gain": "the acceleration is read with another gain in each record",
}
#: What unknowns are that stand neither in the test log nor in a cause, by their kind.
_UNKNOWNS = {
    "jump reading": "the velocity jumps that the displacement shows",
    "own reading": "the velocity jumps that the displacement shows",
    "share": "the velocities of the mass beside its impacts",
    "own pulse": "the area of the acceleration's pulses",
    "pulse power": "the area of pulses of fast impacts beside that of slow ones",
    "own pulse power": "the area of pulses of fast impacts beside that of slow ones",
    "pulse wall": "the area of pulses at one wall beside that at the other",
    "late wall": "the times of impacts at one wall beside those at the other",
    "late": "the lag of the displacement behind the acceleration",
    "own late": "the lag of the displacement behind the acceleration",
    "bends": "the lag that the displacement shows at its impacts beside that of its phase",
    "centre": "the times of impacts beside the middle of their pulses",
    "drift": "the drift of one channel's clock beside the other's",
    "generator": "the frequencies of the test log beside those of the record",
    "own push": "what pulls the mass besides spring, damper and base",
    "bent": "what drives the mass beside the motion of its base",
    "bent phase": "what drives the mass beside the motion of its base",
    "driven f0": "f0 of the tests with a ball beside that of the free motions",
    "driven zeta": "zeta of the tests with a ball beside that of the free motions",
}


def called_unknown(kind: str, record: str) -> str:
    """An unknown in a few words, by its kind and the record that it belongs to, if it does.

    Examples
    --------
    >>> called_unknown("own late", "b34")
    'the lag of the displacement behind the acceleration in b34'
    """
    return f"{_UNKNOWNS.get(kind, kind)}{f' in {record}' if record else ''}"


#: What mountings do to f0 and zeta: in a few words, and as a sentence.
_MOUNTED = {
    about: words
    for name, key in (("f0", "remounting"), ("zeta", "damping"))
    for about, words in {
        name: (
            f"{name} of ring-downs with a separate mounting each",
            f"{name} of ring-downs with the same load differs as it does after separate mountings. "
            "Each ring-down counts as its own mounting, and the errors include this scatter",
        ),
        f"{name} of mountings": (
            f"{name} that differs from one mounting to the next by more than stated",
            f"{name} differs from one mounting to the next by more than `uncertainties: {key}` "
            "states; the errors include this scatter",
        ),
    }.items()
}


def cause_checks(judged: Judged) -> list[Check]:
    """One row for each cause that is named, for rivals, and for what nothing explains."""
    checks = []
    for weighed in judged.found:
        cause = weighed.cause
        record = cause.records[0] if len(cause.records) == 1 else ""
        offered = (cause, *weighed.rivals)
        names = " or ".join(dict.fromkeys(called(c) for c in offered[:4]))
        outcome: Outcome = "warning"
        mounted = next((c.about for c in offered if c.kind == "remounting"), None)
        if mounted is not None:  # nothing that contradicts the test log
            kind, outcome, record = "remounting", "ok", ""
            others = [called(c) for c in offered[:4] if c.kind != "remounting"]
            detail = _MOUNTED[mounted][1] + "".join(f"; or it is {one}" for one in others)
        elif weighed.slight:
            kind, outcome = "slight", "ok"
            detail = (
                f"the records differ a little from the plain model, as {names} would make them. "
                "The difference is too small to be sure; the values and their errors include it"
            )
        elif cause.kind == "unlike":
            kind = "plain model"
            respects = " and in ".join(cause.stated)
            detail = (
                f"not explained: this record differs from the others in {respects}: something was "
                "otherwise in this test, or the record is damaged. It has no weight in the values"
            )
        elif cause.direction is None:
            kind, detail, record = "plain model", _unexplained(weighed), ""
        elif weighed.sure and not weighed.rivals:
            kind, detail = "cause", said(weighed)
            if cause.about in _ORDINARY:
                outcome = "ok"
        elif weighed.rivals:
            kind, record = "either", ""
            detail = (
                f"the records contradict what was stated. Each of these explains them: {names}. "
                "The values and their errors include all of them"
            )
        else:
            kind, record = "plain model", ""
            detail = (
                f"not explained: the records differ from the plain model as {called(cause)} would "
                "make them, but this does not predict left-out records better, or leaves more "
                "than it explains; the errors include the difference"
            )
        checks.append(Check(record, kind, outcome, detail))
    if judged.beside is not None:
        detail = (
            f"there may be {called(judged.beside)} too: the records show no more of it than what "
            "the laws of the causes that are named may be wrong by. The values and their errors "
            "include both"
        )
        checks.append(Check("", "slight", "ok", detail))
    return checks


def _unexplained(weighed: Weighed) -> str:
    return (
        f"not explained: {_SCATTERED[weighed.cause.about]}, and no known effect or mistake "
        "explains it; the errors include this scatter"
    )


def called(cause: Cause) -> str:
    """A cause in a few words.

    Examples
    --------
    >>> called(Cause("effect tilt", "effect", "tilt", None))
    'a cavity that slopes'
    """
    if cause.about in _NAMES and cause.kind in ("effect", "mistake"):
        return _NAMES[cause.about]
    if cause.kind == "unlike":
        return f"{cause.records[0]} that is unlike the other records"
    if cause.kind == "remounting":
        return _MOUNTED[cause.about][0]
    if cause.kind == "scatter":
        return f"an unexplained cause ({_SCATTERED[cause.about]})"
    place = _PLACES.get(cause.about, f"the {cause.about}")
    if cause.kind == "drift":
        if WITH_CLEARANCE in cause.key:
            return f"{cause.about} that changes{WITH_CLEARANCE}"
        after = f" from {cause.records[0]} on" if cause.records else " along the campaign"
        return f"{cause.about} that changes{after}"
    if cause.kind == "one test":
        return f"{cause.about} that is another in {cause.records[0]}"
    whose = cause.records or cause.stated
    if cause.key.startswith("exchanged"):
        return f"{place} of {', '.join(whose[:-1])} and {whose[-1]} exchanged"
    if cause.key == "increments":
        return f"{place} that is what came on top of the masses of the rows above"
    if cause.factor is not None:
        of = f" of {', '.join(whose)}" if whose else ""
        return f"{place}{of} that is {cause.factor:.4g} times the true value"
    if cause.records:
        return f"{place} of {', '.join(cause.records)} that is wrong"
    if cause.stated:
        return f"{place} that is wrong ({', '.join(cause.stated)})"
    if "offset" in cause.key:
        return f"{place} that is off by the same amount in all records"
    return f"{place} that is off by the same factor in all records"


def said(weighed: Weighed) -> str:
    """A cause that is named, with its size +- half of its 95 % interval, and what to do."""
    cause, value, error = weighed.cause, weighed.value, COVERAGE_95 * weighed.error
    if cause.about in _EFFECTS and cause.kind in ("effect", "mistake"):
        return _EFFECTS[cause.about](value, error)
    if cause.kind == "drift":
        return _drift(cause, value, error)
    if cause.kind == "one test":
        return _one_test(cause, value, error)
    place = _PLACES.get(
        cause.about, f"the sensitivity of the {cause.about.replace(' gain', ' channel')}"
    )
    whose = cause.records or cause.stated
    if cause.key.startswith("exchanged"):
        return (
            f"{place} of {', '.join(whose[:-1])} and {whose[-1]} are exchanged: each record shows "
            "the value of another; the analysis exchanges them. Correct records.csv"
        )
    if cause.key == "increments":
        return (
            f"{place} is what came on top of the masses of the rows above: the frequencies show "
            "their sums; the analysis uses these. Type all that was screwed on"
        )
    if cause.factor is not None:
        why = FACTORS[cause.factor]
        where = ", ".join(whose) or "all records"
        return (
            f"{place} is {cause.factor:.4g} times the true value in {where} ({why}): the "
            "flights and the motion of the mass show it; the analysis uses the values found. "
            f"Correct {place}"
        )
    if "offset" in cause.key or cause.key.startswith("one "):
        unit, size = ("mm", 1e3) if cause.about == "clearance" else ("g", 1e3)
        if cause.about in ("base amplitude", "release"):
            return _by_share(place, value, error, cause)
        where = f"in {', '.join(whose)}" if whose else "in all records"
        remedy = "Measure it again and correct it"
        if cause.key == "load offset any":
            remedy = "Type what was screwed on alone, no total with the oscillator or a carrier"
        return (
            f"the true value of {place} {where} differs from the stated one by "
            f"{_signed(size * value, size * error)} {unit}; the analysis uses the values found. "
            f"{remedy}"
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
    if "scale" in cause.key and cause.about == "clearance":
        times = 1.0 + value
    else:
        times = math.exp(value)
        error *= times
    if cause.records:
        place = f"{place} in {', '.join(cause.records)}"
    elif cause.stated:
        place = f"{place} = {', '.join(cause.stated)}"
    what = "shows" if cause.about.endswith("gain") or " gain of" in cause.about else "is truly"
    shown = " (traces of single records are as it reads)" if "displacement" in cause.about else ""
    return (
        f"{place}: it {what} {with_error(times, error)} times what is stated; the analysis "
        f"uses the value found{shown}. Check it and correct it"
    )


#: Unit of what changes along a campaign, and how many of it are one in SI; all others are
#: logarithms, and said in per cent.
_UNITS = {"r": ("", 1.0), "friction": (" m/s^2", 1.0), "slope of the cavity": (" m/s^2", 1.0),
          "clearance": (" mm", 1e3)}  # fmt: skip


def _size(name: str, value: float, error: float) -> str:
    if name in _UNITS:
        unit, size = _UNITS[name]
        return f"{_signed(size * value, size * error)}{unit}"
    share = 100.0 * math.exp(value)  # of a logarithm
    return f"{_signed(share - 100.0, share * error)} %"


def _one_test(cause: Cause, value: float, error: float) -> str:
    return (
        f"{cause.about} of {cause.records[0]} differs by {_size(cause.about, value, error)} from "
        "that of all other records: something was otherwise in this test, or the record is "
        "damaged; the values hold for the others"
    )


def _drift(cause: Cause, value: float, error: float) -> str:
    name = cause.about
    size = _size(name, value, error)
    if cause.records:
        return (
            f"{name} changes by {size} with record {cause.records[0]} and stays there, in the "
            "order of records.csv: something was changed, came loose or warmed up. The errors of "
            "the values include both states. For values of either make two campaigns, of the "
            "records before it and of those from it on"
        )
    if WITH_CLEARANCE in cause.key:
        return (
            f"{name} changes by {size} from the smallest clearance to the largest: look for what "
            "is set with it (spacers, another part of the floor); the values hold for the middle "
            "of the tests with a ball, and their errors include the change over these"
        )
    why = "wear, or dirt" if name in _UNITS else "temperature, or something that comes loose"
    return (
        f"{name} drifts by {size} from the first record that shows it, {cause.stated[0]}, to the "
        f"last, {cause.stated[-1]}, in the order of records.csv ({why}); the values hold for the "
        "middle of the tests with a ball, and their errors include the change over these"
    )


_EFFECTS: Mapping[str, Callable[[float, float], str]] = {
    "wall": lambda v, e: (
        "the two walls differ: r at the wall where x - y = +b is larger than at the other by "
        f"{with_error(v, e)}; r is their mean, and b_c is simulated with both values"
    ),
    "slope": lambda v, e: (
        f"r depends on impact speed: it changes by {with_error(v, e)} for every m/s; r holds at "
        "the usual speed of these tests, and b_c is simulated with the change"
    ),
    "bend": lambda v, e: (
        "r follows a curve over impact speed, between a straight line and a logarithm: r and its "
        "slope hold at the usual speed of these tests"
    ),
    "friction": lambda v, e: (
        f"friction on its floor slows the ball by mu g = {with_error(v, e)} m/s^2 between the "
        "walls as long as it slides; r is corrected for it"
    ),
    "tilt": lambda v, e: (
        f"the ball is pulled to one side of its cavity by {with_error(v, e)} m/s^2: a tilt of "
        f"{abs(v) / STANDARD_GRAVITY * 57.2958:.2g} degrees, or a magnet near one wall; r is "
        "corrected for it"
    ),
    "pad": lambda v, e: (
        f"a contact lasts {with_error(1e3 * abs(v), 1e3 * e)} ms longer at the wall where x - y = "
        f"{'+' if v > 0.0 else '-'}b than at the other: another material, a pad or a loose plate; "
        "r is corrected for it"
    ),
    "course r": lambda v, e: (
        f"r changes by {_signed(2.0 * v, 2.0 * e)} from the first impact of a record to its last: "
        "the ball or its walls warm up, or get dirty; r holds at the middle of a record"
    ),
    "course friction": lambda v, e: (
        f"friction of the ball changes by {_signed(2.0 * v, 2.0 * e)} m/s^2 from the first impact "
        "of a record to its last: the floor gets dusty, or warms up; it is that of the middle"
    ),
    "contact": lambda v, e: (
        f"a contact lasts {with_error(1e3 * v, 1e3 * e)} ms, during which the ball stays at the "
        "wall; r is corrected for it, and b_c is simulated with such contacts"
    ),
    "rolling": lambda v, e: (
        f"the ball rolls: the floor drags it along with {with_error(v, e)} of the floor's own "
        "motion (2/7 for a solid ball that never slips); b_c is predicted for such a ball"
    ),
    "hollow": lambda v, e: (
        f"the ball is pulled to the middle of its cavity by {with_error(v, e)} m/s^2 per m of "
        f"distance (a concave floor of radius {STANDARD_GRAVITY / abs(v):.2g} m, or a magnet; a "
        "negative value is a convex floor, which pulls it to the walls); r is corrected for it, "
        "and b_c is predicted with r_effective and nes_mass_effective"
    ),
    "drag": lambda v, e: (
        f"the air in the cavity slows the ball by {with_error(v, e)} m/s^2 at 1 m/s (it grows with "
        "the square of the speed); r is corrected for it, and b_c is predicted with r_effective "
        "and nes_mass_effective"
    ),
    "viscous": lambda v, e: (
        f"viscous friction slows the ball by {with_error(v, e)} m/s^2 at 1 m/s (a film of oil on "
        "its floor or its walls); r is corrected for it, and b_c is predicted with r_effective and "
        "nes_mass_effective"
    ),
    "even": lambda v, e: (
        f"the displacement sensor is not linear: it reads x + ({with_error(1e-3 * v, 1e-3 * e)}) "
        "x^2 (mm), more on one side of the rest position than on the other; the values are "
        "corrected for it, the amplitudes are not. Check the linearity of the sensor and its angle"
    ),
    "odd": lambda v, e: (
        f"the displacement sensor is not linear: it reads x + ({with_error(1e-6 * v, 1e-6 * e)}) "
        "x^3 (mm); the values are corrected for it, the amplitudes are not. Check the range and "
        "the linearity of the sensor"
    ),
    "aboard": lambda v, e: (
        f"in the ring-downs the mass carries {_signed(1e3 * v, 1e3 * e)} g beside that of the "
        "tests with a ball: the ball lay in its cavity, or a part was on or off; M is that of the "
        "tests"
    ),
    "drop": lambda v, e: (
        f"r of the drop tests differs from that of the walls by {_signed(v, e)}: they were made on "
        "another surface, or the walls changed; r is taken from the flights between the walls"
    ),
    "beside": lambda v, e: (
        "the displacement is not that of the mass in space: it lacks "
        f"{with_error(v, e)} of the motion of the base, which was added where the values need it. "
        "1 is a sensor on the table; else the table turns, or the stand of the sensor moves"
    ),
    "coupling": lambda v, e: (
        "in the driven tests the displacement lacks what is slower than about "
        f"{with_error(v / (2.0 * math.pi), e / (2.0 * math.pi))} Hz (an input that "
        "is AC-coupled): f0, zeta and r are corrected for it. Record DC-coupled"
    ),
    "base late": lambda v, e: (
        f"the base channel comes {with_error(1e3 * abs(v), 1e3 * e)} ms "
        f"{'after' if v > 0.0 else 'before'} the displacement in all tests: one of them is "
        "filtered, or the channel shows something else than how the base moves (the voltage of "
        "the shaker). f0, zeta and base amplitude are corrected for it"
    ),
    "jumps": lambda v, e: (
        f"the velocity jumps that both sensors show are {with_error(math.exp(-v), e)} times those "
        "that the ball's momentum makes: a local mode, or a part that vibrates after each impact; "
        "M by impacts is corrected for it"
    ),
    "second clock": lambda v, e: (
        "displacement and acceleration come from recorders whose clocks differ by "
        f"{_signed(100.0 * v, 100.0 * e)} %, as the flights of all tests show; the values allow "
        "for it. Record both with one recorder"
    ),
    "base felt": lambda v, e: (
        f"the mass moves as if the base moved {with_error(math.exp(v), e)} times as far as its "
        "channel and the test log say: the base also turns or bends, or the displacement is not "
        "read where the mass is; b_c is predicted for the base that is measured"
    ),
    "pulse area": lambda v, e: (
        f"the velocity jumps that the accelerometer shows are {with_error(math.exp(v), e)} times "
        "those of the displacement, while both show the same oscillation: the area of its pulses "
        "is wrong (a contact that rings, its mount, or a local mode); the momentum of the ball is "
        "used instead"
    ),
}
