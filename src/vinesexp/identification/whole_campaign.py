"""All records together: identified.csv, inputs.csv and what is to be said, from one joint model."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vinesexp.arrays import median_of
from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.identification.average import DISAGREES, mean_of, weighted_mean
from vinesexp.identification.budget import Source
from vinesexp.identification.driven_motion import DRIVEN, DrivenMotion, driven_from
from vinesexp.identification.estimate import (
    COMBINED,
    INTEGRATED,
    LOST,
    NOTHING,
    Estimate,
    is_known,
)
from vinesexp.identification.joint.observations import COUNTED, begins_later, off_stated
from vinesexp.identification.joint.over_amplitude import (
    NO_LAW,
    Law,
    LevelValues,
    law_checks,
    law_found,
    law_rows,
    level_values,
    swing_of_levels,
)
from vinesexp.identification.joint.unknowns import KNOWN, Posterior
from vinesexp.identification.joint.whole import (
    HIDDEN,
    Answer,
    RigPosterior,
    RigState,
    answer_of,
    base_at,
    effective,
    of_records,
    partings,
    rig_posterior,
    rolling_from,
    tests_at,
)
from vinesexp.identification.joint.words import called, called_unknown, cause_checks
from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.result_columns import BASE_OF_ONE, Verdict, gain_of
from vinesexp.records.stored.tables import Value
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.theory.boundaries import StableRange, end_of_permanent_response
from vinesexp.theory.floquet import swing_of
from vinesexp.theory.orbits import Reduced, family
from vinesexp.units import COVERAGE_95, SIGNIFICANT, SURE, counted, first_of

_METHODS = ("log decrement", "likelihood", "envelope", "half power", "sweep")
_IMPACTS = "impacts"
_SHOWN = 0.9  # of a stated uncertainty, that has to be left of it to say anything


# Estimates that are none: of copies of a record, and values that no rig can have.
#: r of a contact without a bounce: an error below half of it says so.
_NO_BOUNCE = 0.1


# What single records say besides the parameters: channels at odds, misfits, beats.
#: Gain of one channel beside the other from which on it is none; smaller ones are in inputs.csv.
_OTHER_CHANNEL = 0.5
_SWITCHED = math.log(1.5)  # of one channel beside the other in one record and in the others
_SURE_GAIN = 0.2  # of the gain: its standard error
_HEIGHT_MATTERS = 0.1  # what a table that answers, or a spring that is not straight, may do
_LAG_MATTERS = 2e-5  # s
_FOLLOWS = 3e-3  # of the motion of the mass
#: What to do where a sweep does not show the width of its resonance.
_SWEEP_BETTER = "Check the channels, and sweep more slowly"
_FEWEST = 3  # records whose phase says something of the sensor that all of them share


def remarks(found: Sequence[Estimate]) -> list[Check]:
    """Rows of checks.csv on the estimates of single records."""
    return [
        *_channels(found), *_integrated(found), *_of_sweeps(found), *_misfits(found),
        *_drifts(found), *_beats(found), *_modes(found), *_follows(found), *_of_drops(found),
    ]  # fmt: skip


def _left(found: Sequence[Estimate], answer: Answer) -> list[Estimate]:
    """Estimates that the causes do not explain: the base and a coupling turn the phase."""
    phases = ("accelerometer_across", "accelerometer_corner")
    explained = any(one.cause.about in ("beside", "coupling") for one in answer.judged.found)
    return [e for e in found if not (explained and e.parameter in phases)]


def _integrated(found: Sequence[Estimate]) -> list[Check]:
    """Records whose displacement is the integral of the acceleration."""
    return [
        Check(e.records[0], "integrated", "ok", e.note) for e in found if e.parameter == INTEGRATED
    ]


def _of_sweeps(found: Sequence[Estimate]) -> list[Check]:
    """Sweeps whose resonance is as high as its width allows only with another sensitivity."""
    return [
        Check(
            e.records[0], "gain", "warning",
            f"the resonance of this sweep is {abs(e.value):.3g} times as high as its width allows: "
            "the sensitivity of the base channel or of the displacement is wrong by this "
            "factor; f0 and zeta do not depend on it",
        )
        for e in found
        if e.parameter == "base_gain"
        and abs(abs(e.value) - 1.0) > max(SURE * e.std_error, _HEIGHT_MATTERS)
    ]  # fmt: skip


def _channels(found: Sequence[Estimate]) -> list[Check]:
    """Sign and lag of the accelerometer beside the laser, where they are off."""
    gains = [e for e in found if e.parameter == "accelerometer_gain"]
    turned = [e.records[0] for e in gains if e.value < -SURE * e.std_error]
    checks = [
        Check(
            turned[0], "sign", "warning",
            f"acceleration and displacement have opposite signs{_in_more(turned)}; the sign of the "
            "displacement is used. Change the sign of one sensitivity",
        )
    ] if turned else []  # fmt: skip
    far = [e for e in gains if abs(abs(e.value) - 1.0) > max(SURE * e.std_error, _OTHER_CHANNEL)]
    checks += [
        Check(
            records[0], "gain", "warning",
            f"the acceleration is {gain:.2g} times the second derivative of the displacement"
            + _in_more(records)
            + (": the times are in ms and not in s, or " if 0.8e6 < gain < 1.25e6 else ": ")
            + "campaign.yaml names the wrong channels, or a sensitivity is far off",
        )
        for gain, records in _alike(far).items()
    ]  # fmt: skip
    corners = [e for e in found if e.parameter == "accelerometer_corner"]
    corner, error = _mean(corners)
    lags = [e for e in found if e.parameter == "channel_lag"]
    if coupled := corner > SURE * error:  # elsewhere the phase at one frequency is the corner's
        shown = {e.records[0] for e in corners if e.value > SURE * e.std_error}
        lags = [e for e in lags if e.records[0] in shown]
    # A sensor is AC-coupled in all records or in none: where it is, its phase is no other motion.
    across = [e for e in found if e.parameter == "accelerometer_across" and not coupled]
    if across:  # of a record without impacts nobody can tell
        shown = {e.records[0] for e in across}
        lags = [e for e in lags if e.records[0] in shown]
    ac = [_corner(corner, len(corners))] if coupled else []
    return [*checks, *ac, *_across(across), *_lags(lags)]


def _in_more(records: Sequence[str]) -> str:
    """That what is said of the first of some records is so in the others."""
    return f", and in {counted(len(records) - 1, 'more record')}" if len(records) > 1 else ""


def _alike(far: Sequence[Estimate]) -> dict[float, list[str]]:
    """Records by the gain that they show, to two digits: one mistake is said once."""
    found: dict[float, list[str]] = {}
    for e in far:
        found.setdefault(float(f"{abs(e.value):.2g}"), []).append(e.records[0])
    return found


def _mean(found: Sequence[Estimate]) -> tuple[float, float]:
    """What all records say of one thing; nothing where none does."""
    if not found:
        return 0.0, math.inf
    return weighted_mean([e.value for e in found], [e.std_error for e in found])


def _across(across: Sequence[Estimate]) -> list[Check]:
    """One line on an accelerometer whose phase is off at the oscillation alone."""
    if len(across) < _FEWEST:
        return []
    middle = sorted(e.value for e in across)[len(across) // 2]
    order = "behind" if middle > 0.0 else "ahead of"
    detail = (
        f"at the oscillation the acceleration is {abs(math.degrees(middle)):.2g} degrees {order} "
        f"the displacement (median of {len(across)} records), but not at the impacts: a delay "
        "cannot explain this, and none was removed. The accelerometer shows a motion across its "
        f"axis (cross-axis sensitivity of {abs(middle):.1%} or more), or a filter turns its phase "
        "at low frequency, or the displacement sensor moves a little with the base"
    )
    return [Check("", "cross-axis", "warning", detail)]


def _corner(corner: float, count: int) -> Check:
    """One line on an AC-coupled accelerometer."""
    detail = (
        f"the accelerometer is AC-coupled with a corner near {corner:.3g} Hz (mean of "
        f"{count} records): its phase at the oscillation is not a lag and was not treated as "
        "one; a DC-coupled sensor or a lower corner needs a smaller correction"
    )
    return Check("", "corner", "ok", detail)


def _lags(lags: Sequence[Estimate]) -> list[Check]:
    """One line on the lag of all records, and one for each that differs from the others."""
    known = [e for e in lags if e.std_error < _LAG_MATTERS]
    if not known:
        return []
    middle = sorted(e.value for e in known)[len(known) // 2]
    checks = []
    if abs(middle) > _LAG_MATTERS:
        order = "after" if middle > 0.0 else "before"
        detail = (
            f"the displacement comes {1e6 * abs(middle):.0f} us {order} the acceleration "
            f"(median of {len(known)} records); removed record by record"
        )
        checks.append(Check("", "lag", "ok", detail))
    for e in known:
        if abs(e.value - middle) > max(_LAG_MATTERS, DISAGREES * e.std_error):
            detail = (
                f"the displacement comes {1e6 * e.value:.0f} us after the acceleration, in the "
                f"other records {1e6 * middle:.0f} us; removed"
            )
            checks.append(Check(e.records[0], "lag", "warning", detail))
    return checks


def _of_drops(found: Sequence[Estimate]) -> list[Check]:
    """Drops whose r goes with the speed, and drops that cannot be of one ball on one surface."""
    drops = [e for e in found if e.parameter == "r" and e.method == "drop"]
    checks = [Check(e.records[0], "drop", "warning", e.note) for e in drops if e.note]
    usual = _mean(drops)[0]
    if any(abs(e.value - usual) > DISAGREES * e.std_error for e in drops):
        each = [f"{e.value:.3g} ({e.records[0]})" for e in sorted(drops, key=lambda e: e.value)]
        detail = (
            f"drops show different r: {first_of(each, _LISTED)}, and leave it as unsure as they "
            "differ: other balls, other surfaces or other speeds. Exclude those that are not of "
            "the ball and the walls of the tests"
        )
        checks.append(Check("", "drop", "warning", detail))
    return checks


def _misfits(found: Sequence[Estimate]) -> list[Check]:
    """Free decays on which the methods disagree or that no decay fits, sweeps of a bent spring."""
    return [
        Check(e.records[0], "sweep" if e.method == "sweep" else "ring-down", "warning", e.note)
        for e in found
        if e.parameter in ("f0", "f0_added") and e.note
    ]


def _drifts(found: Sequence[Estimate]) -> list[Check]:
    """One line on a spring that changes with time in free decays."""
    drifts = {e.records[0]: e.value for e in found if e.parameter == "f0_drift"}
    why = (
        "with time and not with amplitude: a spring that warms up or creeps. From one test to "
        "another f0 may differ as much; record each at the same time after the motion began"
    )
    return _in_the_course("spring", "f0", drifts, why)


def _base_drifts(driven: Mapping[str, DrivenMotion]) -> list[Check]:
    """One line on a base without a channel whose amplitude changes in the course of a test."""
    each = {record: 2.0 * one.drift for record, one in driven.items()}
    drifts = {record: share for record, share in each.items() if abs(share) > _BASE_DRIFTS}
    why = (
        "as the motion of the mass shows: a shaker that warms up, without a controller. Record "
        "the base"
    )
    return _in_the_course("base amplitude", "the base amplitude", drifts, why)


_BASE_DRIFTS = 0.01  # of the amplitude, in a test: less is not worth a line


def _in_the_course(quantity: str, name: str, drifts: Mapping[str, float], why: str) -> list[Check]:
    """One line on what changes within records, by the share of each; none where none does."""
    if not drifts:
        return []
    usual, first = median_of(list(drifts.values())), next(iter(drifts))
    detail = (
        f"{name} {'falls' if usual < 0.0 else 'rises'} by {100 * abs(usual):.2g} % in the course "
        f"of {first}{_in_more(list(drifts))}, {why}"
    )
    return [Check("", quantity, "warning", detail)]


def _beats(found: Sequence[Estimate]) -> list[Check]:
    """Free decays in which something else oscillates too."""
    share = {e.records[0]: e.value for e in found if e.parameter == "beat_share"}
    return [
        Check(
            e.records[0],
            "beats",
            "warning",
            f"a second oscillation at {e.value:.4g} Hz has {100 * share[e.records[0]]:.2g} % of "
            "the amplitude: another mode, or a mode of the table; the fit includes it",
        )
        for e in found
        if e.parameter == "beat"
    ]


def _follows(found: Sequence[Estimate]) -> list[Check]:
    """One line on a base that moves with the mass in free decays."""
    parts = ("base_follows", "base_follows_ahead")
    own, ahead = ([e.value for e in found if e.parameter == name] for name in parts)
    if not own or (share := float(np.median(np.hypot(own, ahead)))) < _FOLLOWS:
        return []
    feeds = float(np.median(ahead))
    if feeds > _FOLLOWS:
        detail = (
            f"while the mass rings down the base channel shows {100.0 * feeds:.2g} % of its motion "
            f"a quarter of a period ahead (median of {len(own)} records): a base that moved so "
            "would feed the decay, so this channel picks up another one. The values allow for it; "
            "record the base apart, or leave it out of campaign.yaml"
        )
    else:
        detail = (
            f"while the mass rings down the base channel moves {100.0 * share:.2g} % as far "
            f"(median of {len(own)} records): f0 and zeta are those of a base at rest, f0 by about "
            f"{50.0 * share:.2g} % from that of the records. If the base cannot move, its channel "
            "picks up another one: record it apart, or leave it out of campaign.yaml"
        )
    return [Check("", "base follows", "warning", detail)]


def _modes(found: Sequence[Estimate]) -> list[Check]:
    """Further modes in a free decay."""
    said: dict[str, list[str]] = {}
    own = [e for e in found if e.parameter in ("mode", "mode_zeta", "mode_share")]
    for f, zeta, share in zip(own[::3], own[1::3], own[2::3], strict=True):
        said.setdefault(f.records[0], []).append(
            f"{f.value:.4g} Hz (zeta {zeta.value:.2g} +- {zeta.std_error:.1g}, "
            f"{100 * share.value:.2g} % of the amplitude)"
        )
    return [
        Check(
            record,
            "modes",
            "ok",
            f"it rings at {', '.join(modes)} too; to use another frequency, write it under "
            "frequency_hz",
        )
        for record, modes in said.items()
    ]


def without_copies(
    found: Sequence[Estimate], campaign: Campaign
) -> tuple[list[Estimate], list[Check]]:
    """Estimates without those of records that hold the same samples as an earlier one.

    `content` is a digest of a record's channels, in its note.
    """
    first: dict[str, str] = {}
    copies: dict[str, str] = {}
    for e in found:
        if e.parameter == "content":
            original = first.setdefault(e.note, e.records[0])
            if original != e.records[0]:
                copies[e.records[0]] = original
    rows = {record.id: record for record in campaign.records}
    checks = []
    for name, original in copies.items():
        a, b = rows.get(name), rows.get(original)
        said_alike = a is not None and b is not None and (
            (a.test, a.clearance, a.base_amplitude, a.frequency, a.added_mass, a.release)
            == (b.test, b.clearance, b.base_amplitude, b.frequency, b.added_mass, b.release)
        )  # fmt: skip
        detail = f"holds the same samples as {original}; it is counted once"
        if not said_alike:
            detail += f", with the row of {original}: what records.csv says of the two differs"
        checks.append(Check(name, "copy", "warning", detail))
    kept = [e for e in found if e.parameter != "content" and not set(e.records) & set(copies)]
    return kept, checks


def possible(estimates: Sequence[Estimate]) -> tuple[list[Estimate], list[Check]]:
    """Estimates without those that no rig can have or that nobody knows, and why.

    Masses, stiffnesses, dampings and frequencies are above zero, restitutions from 0 to 1, and a
    value with an error of more than half of it is none. A resonance without a width is none, too.
    """
    kept, checks = [], []
    without_width = {
        (e.records, e.method) for e in estimates
        if e.parameter == "zeta" and e.method == "sweep"
        and not (e.value > 0.0 and is_known(e.value, e.std_error))
    }  # fmt: skip
    for e in estimates:
        restitution = e.parameter == "r" or (
            e.parameter.startswith("r_") and e.parameter[2:].isdigit()
        )
        positive = e.parameter.removesuffix("_added") in ("f0", "zeta", "M", "c1", "k1")
        if (positive and not e.value > 0.0) or (restitution and not 0.0 <= e.value <= 1.0):
            expected = "a number from 0 to 1" if restitution else "a number above zero"
            detail = (
                f"{e.parameter} = {e.value:.4g} {e.unit} ({e.method}) is impossible, expected "
                f"{expected}; it is left out. Check these tests in records.csv and campaign.yaml"
            )
        elif (positive and not is_known(e.value, e.std_error)) or (
            # A contact without a bounce has r near zero, which a small error of its own says.
            restitution and not is_known(max(e.value, _NO_BOUNCE), e.std_error)
        ):
            detail = (
                f"{e.parameter} ({e.method}) is not known: {e.value:.4g} +- "
                f"{COVERAGE_95 * e.std_error:.2g} {e.unit}, expected a standard error of half the "
                "value at most; it is left out"
            )
        elif e.parameter == "f0" and (e.records, e.method) in without_width:
            detail = (
                f"f0 ({e.method}) = {e.value:.4g} {e.unit} is left out: the width of its resonance "
                f"(zeta) is not known. {e.note or _SWEEP_BETTER}"
            )
        else:
            kept.append(e)
            continue
        record = e.records[0] if len(e.records) == 1 else ""
        checks.append(Check(record, "impossible", "warning", detail))
    return kept, checks


@dataclass(frozen=True)
class Identified:
    """What a campaign says of the rig.

    Attributes
    ----------
    rows : list of Estimate
        Of identified.csv: a row a method, the combined one, effects of ball and contact.
    checks : list of Check
    sources : list of Source
        The combined values and what their errors are made of (budget.csv).
    levels : tuple of LevelValues
        f0 and zeta at each base amplitude, where they depend on it (level_values.csv).
    inputs : list of dict
        Rows of inputs.csv.
    rig : RigPosterior or None
        What predictions take, with its covariance.
    """

    rows: list[Estimate]
    checks: list[Check]
    sources: list[Source]
    levels: tuple[LevelValues, ...] = ()
    inputs: tuple[dict[str, Value], ...] = ()
    rig: RigPosterior | None = None

    def source(self, parameter: str) -> Source | None:
        """The combined value of a parameter with the parts of its error."""
        return next((s for s in self.sources if s.estimate.parameter == parameter), None)


def identify_campaign(
    found: Sequence[Estimate], campaign: Campaign, impacts: Mapping[str, Impacts]
) -> Identified:
    """Estimate the rig, ball, contact and what was stated from all records at once.

    Parameters
    ----------
    found : sequence of Estimate
        Of all records (`identification.one_record.estimate_record`).
    campaign : Campaign
    impacts : mapping
        Record id to its impact table.

    Returns
    -------
    Identified
        Parameters that cannot be known are absent; a check says which and why.
    """
    used, left, checks = _usable(found, campaign)
    driven = {e.records[0]: driven_from(e.data) for e in used if e.parameter == DRIVEN and e.data}
    campaign, filled = as_shown(campaign, [*used, *_unseen_bases(used, driven)])
    checks += filled
    own = {name: table for name, table in impacts.items() if name not in left}
    answer = answer_of(used, campaign, own, driven)
    rows = _by_method(used, (_law_of(answer) if answer else None) or NO_LAW)
    if answer is None:
        return Identified(rows, [*checks, *_absent(rows), *remarks(used)], [])
    sources = _combined(answer)
    rows += _masses(answer, campaign)
    rows += _restitutions(answer)
    rows += [source.total for source in sources]
    rows += _effects(answer, campaign)
    rows += _ball(answer, campaign)
    rows += [*_bases(answer, campaign), *_frequencies(driven, campaign)]
    rows += _releases(answer, campaign)
    rig = replace(rig_posterior(answer, campaign), states=rig_states(answer, campaign))
    levels, of_law, said_of_law = _over_amplitude(answer, rig, used, campaign)
    rows += of_law
    checks += said_of_law
    stated = _inputs(answer, campaign)
    checks += cause_checks(answer.judged)
    checks += [*_contradicted(stated, answer), *_stretched(stated, answer), *_far_off(answer)]
    checks += _absent(rows, answer, campaign)
    checks += [*_trust_in_mass(sources, answer, campaign), *remarks(_left(used, answer))]
    checks += _base_drifts(driven)
    return Identified(rows, checks, sources, levels, tuple(row for row, _ in stated), rig)


def _usable(
    found: Sequence[Estimate], campaign: Campaign
) -> tuple[list[Estimate], set[str], list[Check]]:
    """Estimates that count, ids of the records whose impacts do not, and what is said of both."""
    excluded = {record.id for record in campaign.records if record.exclude}
    used, checks = without_copies([e for e in found if not excluded & set(e.records)], campaign)
    copies = {check.record for check in checks}
    checks += [*_silent(used, campaign), *_begun_later(used, campaign)]
    switched = list(_switched(used, campaign))
    other = {check.record for check in switched}
    # of another range: f0 and zeta are in no unit of the channel
    used = [
        replace(e, data=None) if e.records[0] in other else e
        for e in used
        if not other & set(e.records) or e.parameter.removesuffix("_added") in ("f0", "zeta")
    ]
    several = {record.id for record in campaign.records if len(record.clearance) > 1}
    lost = {e.records[0] for e in used if e.parameter == LOST} & several
    used, impossible = possible([e for e in used if e.parameter != NOTHING])
    used, mixed = _of_one_rig(used)
    impossible += mixed
    return used, excluded | copies | other | lost, [*checks, *switched, *impossible]


def _of_one_rig(found: list[Estimate]) -> tuple[list[Estimate], list[Check]]:
    """Estimates without those of free motions of which no more than half can be of one oscillator.

    Fewer are mistakes in single records, which the joint model weighs. It would explain these by
    some law over amplitude or mounting, and the values of a rig that nobody has.
    """
    free = {e.records[0]: e.value for e in found if e.parameter == "f0" and e.method in COUNTED}
    each = np.sort(list(free.values()))
    alike = max((int(np.sum((each >= f) & (each < _OTHER_RIG * f))) for f in each), default=0)
    if len(each) < 2 or 2 * alike > len(each):
        return found, []
    named = sorted(free, key=free.__getitem__)
    detail = (
        f"{first_of([f'{free[name]:.4g} Hz ({name})' for name in named], _LISTED)}: these free "
        "motions are of different rigs, or of loads that records.csv does not state, and no f0 or "
        "damping is taken from them. Put each rig into a campaign of its own, fill in "
        "added_mass_g, or exclude the others"
    )
    kept = [e for e in found if not free.keys() & set(e.records)]
    return kept, [Check("", "several rigs", "warning", detail)]


#: Times f0: no spring of one rig is four times as stiff in one test as in another.
_OTHER_RIG, _LISTED = 2.0, 8


def _law_of(answer: Answer) -> Law | None:
    """The law over amplitude that all records show; None where there is none."""
    known = {"ln_f0", "ln_zeta"} <= set(answer.posterior.names)
    law = answer.observed.law
    return law_found(answer.posterior, law) if law.free and known else None


def _over_amplitude(
    answer: Answer, rig: RigPosterior, used: Sequence[Estimate], campaign: Campaign
) -> tuple[tuple[LevelValues, ...], list[Estimate], list[Check]]:
    """Values of each level, the law as rows, and what is said of it; nothing without a law."""
    if (law := _law_of(answer)) is None:
        return (), [], []
    swings = swing_of_levels(used, campaign)
    swings |= {level: _at_the_end(rig, law, campaign, level, A) for level, A in swings.items()}
    bare = [e for e in used if e.data and e.parameter in ("f0", "f0_added")]
    top = max((e.amplitude or 0.0 for e in bare), default=law.amplitude)
    return (
        level_values(answer.posterior, law, swings),
        law_rows(answer.posterior, law, tuple(e.records[0] for e in bare)),
        law_checks(answer.posterior, law, top),
    )


def _at_the_end(
    rig: RigPosterior, law: Law, campaign: Campaign, level: float, swing: float
) -> float:
    """Amplitude of the mass on the exact orbit at b_c, m, where damping or spring depend on it.

    That of the tests, `swing`, where there is no such orbit: friction in the guide of the mass has
    tests stop at a larger amplitude than b_c has.
    """
    base, found = rig.of(base_at(level)), swing
    if base is None:
        return swing
    driven = _driven([r for r in campaign.records if r.base_amplitude == level])
    for _ in range(_ITERATED):
        f0, zeta = (math.exp(float(law.log(name, found))) for name in ("f0", "zeta"))
        if (end := _end(rig, driven, f0=f0, zeta=zeta)) is None:
            return swing
        found = base[0] * float(swing_of(family(end[1].C_low, end[0])))
    return found


_ITERATED = 8  # each leaves less than half of what is off


def _driven(records: Sequence[Record]) -> float | None:
    """Frequency at which some records were driven, Hz, by the test log."""
    each = [sum(r.frequency) / 2.0 for r in records if r.frequency and not r.exclude]
    return float(np.median(each)) if each else None


def _end(
    rig: RigPosterior, driven: float | None, *, f0: float = 1.0, zeta: float = 1.0
) -> tuple[Reduced, StableRange] | None:
    """The exact orbit of a rig at b_c, its f0 and zeta times these; None where there is none."""
    known = {name: value[0] for name in ("M", "f0", "zeta", "r", "m") if (value := rig.of(name))}
    if len(known) < 5:
        return None
    Omega = 1.0 if driven is None else driven / (f0 * known["f0"])
    eps, zeta = known["m"] / known["M"], zeta * known["zeta"]
    try:
        p = Reduced.of(eps=eps, zeta=zeta, r=known["r"], Omega=Omega)
        return p, end_of_permanent_response(p)
    except (AnalysisError, ParameterError):
        return None


_ONE_RIG = 0.02  # of b_c: as base amplitudes of one level may differ


def rig_states(answer: Answer, campaign: Campaign) -> tuple[RigState, ...]:
    """The rigs of which the tests are, where a change from one to another moves b_c.

    None where all tests are of one.
    """
    order, cuts, alone = answer.observed.order, set[str](), set[str]()
    driven = _driven([r for r in campaign.records if r.test == "periodic"])
    for cause in partings(answer):
        first, kind = cause.records[0], cause.kind
        at = order.index(first)
        it, others = (first,), (*order[:at], *order[at + 1 :])
        sides = (order[:at], order[at:]) if kind == "drift" else (it, others)
        own = [of_records(answer, side) for side in sides]
        ends = [_end(rig_posterior(answer, campaign, one), driven) for one in own]
        b_c = [float(end[1].b_high) for end in ends if end is not None]
        alike = len(b_c) == 2 and abs(math.log(b_c[0] / b_c[1])) < _ONE_RIG
        if all(own) and (kind == "unlike" or not alike):
            (cuts if kind == "drift" else alone).add(first)
    if not cuts and not alone:
        return ()
    begun, groups = sorted(cuts, key=order.index), dict[str, list[str]]()
    for id in order:
        since = [cut for cut in begun if order.index(cut) <= order.index(id)]
        named = [f"from {since[-1]}"] if since else []
        named += [f"before {cut}" for cut in begun[len(since) :][:1]]
        name = ", ".join(named) + (" on" if since and len(since) == len(begun) else "")
        groups.setdefault(f"{id} alone" if id in alone else name, []).append(id)
    return tuple(
        RigState(name, (*ids,), rig_posterior(answer, campaign, of_records(answer, ids)))
        for name, ids in groups.items()
    )


def _switched(found: Sequence[Estimate], campaign: Campaign) -> Iterator[Check]:
    """Records whose two channels of the mass are another factor apart than in the others.

    Which of the two was switched no one knows: taken for either, the values of others followed.
    """
    gains: dict[str, dict[str, float]] = {}
    for e in found:
        if e.parameter == "accelerometer_gain" and e.std_error < _SURE_GAIN * abs(e.value):
            setup = campaign.record(e.records[0]).setup
            gains.setdefault(setup, {})[e.records[0]] = math.log(abs(e.value))
    for of_setup in gains.values():
        usual = float(np.median(list(of_setup.values())))
        odd = {name: g - usual for name, g in of_setup.items() if abs(g - usual) > _SWITCHED}
        for name, off in odd.items() if 3 * len(odd) < len(of_setup) else ():
            yield Check(
                name,
                "gain",
                "warning",
                f"the acceleration is {math.exp(off):.4g} times as large beside the displacement "
                "as in the other records: one of the two was recorded in another range. Only "
                "f0 and zeta of this record are used; give it a setup of its own with its "
                "sensitivities",
            )


def _silent(found: Sequence[Estimate], campaign: Campaign) -> list[Check]:
    """Records that give nothing; no warning where impacts are few and others give r."""
    known = any(e.parameter == "r" or e.parameter.startswith("r_") for e in found)
    with_ball = {record.id for record in campaign.records if record.clearance}
    return [
        Check(
            e.records[0], "identification",
            "ok" if known and e.records[0] in with_ball else "warning", e.note,
        )
        for e in found
        if e.parameter == NOTHING
    ]  # fmt: skip


def _unseen_bases(
    found: Sequence[Estimate], driven: Mapping[str, DrivenMotion]
) -> Iterator[Estimate]:
    """Base amplitudes of tests without a base channel, as the mass answers them."""
    f0, zeta = (
        [e.value for e in found if e.parameter == name]
        or [motion.oscillator[name] for motion in driven.values()]
        for name in ("f0", "zeta")
    )
    for record, motion in driven.items():
        if not motion.recorded:
            value, error, _ = motion.base(f0=float(np.median(f0)), zeta=float(np.median(zeta)))
            yield Estimate("base_seen", value, error, "m", "motion of the mass", (record,))


def as_shown(campaign: Campaign, found: Sequence[Estimate]) -> tuple[Campaign, list[Check]]:
    """Base amplitudes and releases that records.csv leaves empty, as the records show them.

    Tests that moved alike are one level, with those of it whose length is stated.

    Parameters
    ----------
    campaign : Campaign
    found : sequence of Estimate
    """
    records = {record.id: record for record in campaign.records}
    checks = []
    for name, (parameter, test, shown_by) in _SHOWN_LENGTHS.items():
        seen = sorted(
            (abs(e.value), e.records[0], e.method) for e in found
            if e.parameter == parameter and records[e.records[0]].test == test
            and abs(e.value) > SURE * e.std_error
        )  # fmt: skip
        while seen:
            level = [one for one in seen if one[0] <= _ALIKE * seen[0][0]]
            seen = seen[len(level) :]
            empty = [id for _, id, _ in level if getattr(records[id], name) is None]
            if not empty:
                continue
            stated = sorted(abs(getattr(records[id], name) or 0.0) for _, id, _ in level)
            middle = float(f"{np.median([length for length, _, _ in level]):.3g}")
            length = stated[-1] or middle
            for id in empty:
                records[id] = _with_length(records[id], name, length, stated=stated[-1] > 0.0)
            more = f" and {len(empty) - 1} more" if len(empty) > 1 else ""
            detail = (
                f"{name}_mm of {empty[0]}{more} is empty in records.csv: {1e3 * length:.3g} mm by "
                f"the {shown_by or level[0][2]}"
            )
            checks.append(Check(empty[0] if len(empty) == 1 else "", "test log", "ok", detail))
    return replace(campaign, records=tuple(records.values())), checks


def _with_length(record: Record, name: str, length: float, *, stated: bool) -> Record:
    """The row with a base amplitude or a release, m, that is `stated` for other tests or is not."""
    shown = () if stated else (name,)
    if name == "release":
        return replace(record, release=length, shown=shown)
    return replace(record, base_amplitude=length, shown=shown)


#: Lengths of records.csv: the estimate that shows them, in which test, and what shows it, unless
#: it is the method of the estimate.
_SHOWN_LENGTHS = {
    "base_amplitude": ("base_seen", "periodic", ""),
    "release": ("release_seen", "transient", "displacement"),
}
_ALIKE = 1.05  # largest over smallest of one level


def _begun_later(found: Sequence[Estimate], campaign: Campaign) -> list[Check]:
    """Releases of which b_t is as unsure as the first swing and release_mm differ."""
    return [
        Check(
            e.records[0], "release", "warning",
            f"the record begins with a swing of {1e3 * abs(e.value):.4g} mm, release_mm says "
            f"{1e3 * abs(campaign.record(e.records[0]).release or 0.0):.4g}: the record begins "
            "later, or release_mm is wrong. The error of b_t includes both; start the record "
            "before the mass is let go",
        )
        for e in found
        if e.parameter == "release_seen" and begins_later(e, campaign)
    ]  # fmt: skip


def _by_method(found: Sequence[Estimate], law: Law) -> list[Estimate]:
    """f0 and zeta by each method alone, and r by drops: the cheaper ones for comparison."""
    rows = []
    for parameter, methods in (("f0", _METHODS), ("zeta", _METHODS), ("r", ("drop",))):
        for method in methods:
            own = [e for e in found if e.parameter == parameter and e.method == method]
            if own:
                rows.append(mean_of([law.moved(e) for e in own], method=method))
    return rows


#: Combined values as sums of unknowns, by name: what they are the logarithm of, and their unit.
_LOGARITHMS: Mapping[str, tuple[Mapping[str, float], float, str]] = {
    "f0": ({"ln_f0": 1.0}, 1.0, "Hz"),
    "zeta": ({"ln_zeta": 1.0}, 1.0, "1"),
    "M": ({"ln_M": 1.0}, 1.0, "kg"),
    "c1": ({"ln_M": 1.0, "ln_f0": 1.0, "ln_zeta": 1.0}, 4.0 * math.pi, "N s/m"),
    "k1": ({"ln_M": 1.0, "ln_f0": 2.0}, 4.0 * math.pi**2, "N/m"),
}
_UNKNOWN = 0.5  # relative error from which on a value is none


def _combined(answer: Answer) -> list[Source]:
    """M, c1, k1, f0, zeta and each r, with what their errors are made of."""
    posterior = answer.posterior
    found = []
    for name, (terms, factor, unit) in _LOGARITHMS.items():
        if (known := _sized(posterior, terms, factor)) is not None:
            found.append(_source(answer, name, known[0], unit, terms, known[0]))
    for name, value, _ in _each_r(posterior):
        found.append(_source(answer, name, value, "1", {name: 1.0}, 1.0))
    if not any(s.estimate.parameter == "r" for s in found):
        several = [s.total for s in found if s.estimate.parameter.startswith("r_")]
        if several:  # only tests with several balls: r is what they have in common, if they do
            common = replace(mean_of(several, method=COMBINED), parameter="r")
            if all(abs(e.value - common.value) <= DISAGREES * e.std_error for e in several):
                found.append(Source(common))
    return found


def _sized(
    posterior: Posterior, terms: Mapping[str, float], factor: float
) -> tuple[float, float] | None:
    """What a sum of unknowns is the logarithm of, times a factor; its error. None: not known."""
    if not all(term in posterior for term in terms):
        return None
    value, error = posterior.of(terms)
    size = factor * math.exp(value)
    return (size, size * error) if error < _UNKNOWN else None


def _each_r(posterior: Posterior) -> Iterator[tuple[str, float, float]]:
    """Name, value and error of every r that is known."""
    for name in posterior.names:
        if name == "r" or name.startswith("r_"):
            value, error = posterior.of({name: 1.0})
            if error < _UNKNOWN * value:
                yield name, value, error


def _source(
    answer: Answer, name: str, value: float, unit: str, terms: Mapping[str, float], scale: float
) -> Source:
    """A combined value with the part of each input in its error."""
    v = answer.posterior.vector(terms)
    parts = {
        label: scale * math.sqrt(max(float(part[0, 0]), 0.0))
        for label, part in answer.parts_of(v[np.newaxis]).items()
    }
    total_error = scale * math.sqrt(answer.posterior.covariance.of(v))
    inputs = math.hypot(*parts.values())
    if inputs > total_error > 0.0:  # inputs that hold one another: each counts for less
        parts = {label: part * total_error / inputs for label, part in parts.items()}
    parts = {label: part for label, part in parts.items() if part > 1e-3 * total_error}
    own = math.sqrt(max(total_error**2 - sum(p * p for p in parts.values()), 0.0))
    records = answer.records_of(terms)
    return Source(Estimate(name, value, own, unit, COMBINED, records), parts)


def _ways(answer: Answer, campaign: Campaign) -> dict[str, tuple[str, str]]:
    """Ways there are to M, and the kinds of block that each leaves out."""
    kinds = {block.kind for block in answer.observed.blocks}
    loads = {r.added_mass or 0.0 for r in campaign.records if r.test == "ringdown"}
    found = {}
    if answer.observed.loads and len(loads) > 1:
        found["added mass"] = "flights", "weighed"
    if "flights" in kinds and campaign.known.nes_mass:
        found[_IMPACTS] = "loaded", "weighed"
    return found


def _masses(answer: Answer, campaign: Campaign) -> list[Estimate]:
    """M, c1 and k1 by each way there is to M."""
    rows = []
    for method, others in _ways(answer, campaign).items():
        posterior = answer.without(*others)
        for name in ("M", "c1", "k1"):
            terms, factor, unit = _LOGARITHMS[name]
            if (known := _sized(posterior, terms, factor)) is not None:
                records = answer.records_of({"ln_M": 1.0})
                rows.append(Estimate(name, *known, unit, method, records))
    mass = campaign.known.mass
    if mass is not None:
        error = mass.std_error or campaign.known.uncertainties.mass.of(mass.value)
        rows.append(Estimate("M", mass.value, error, "kg", "weighed"))
    return rows


def _restitutions(answer: Answer) -> list[Estimate]:
    """r by impacts, without the drop tests."""
    kinds = {block.kind for block in answer.observed.blocks}
    if "flights" not in kinds:
        return []
    posterior = answer.without("drop") if "drop" in kinds else answer.posterior
    return [
        Estimate(name, value, error, "1", _IMPACTS, answer.records_of({name: 1.0}))
        for name, value, error in _each_r(posterior)
    ]


_ROWS = {"slope": ("r_speed_slope", "s/m"), "friction": ("friction", "m/s^2"),
         "tilt": ("tilt", "m/s^2"), "contact": ("contact_time", "s"),
         "pad": ("contact_difference", "s"), "rolling": ("rolling", "1"),
         "hollow": ("hollow", "1/s^2"), "drag": ("drag", "1/m"), "viscous": ("viscous", "1/s"),
         "even": ("displacement_even", "1/m"), "odd": ("displacement_odd", "1/m^2"),
         "course r": ("r_change", "1"), "course friction": ("friction_change", "m/s^2"),
         }  # fmt: skip


#: A slope of r is that at the usual speed; what changes goes from the first impact to the last.
_SUMS = {"slope": {"slope": 1.0, "fade": 1.0}, "course r": {"course r": 2.0},
         "course friction": {"course friction": 2.0}}  # fmt: skip


def _effects(answer: Answer, campaign: Campaign) -> list[Estimate]:
    """Rows on ball, walls and contact, of effects that the records ask for."""
    posterior = answer.posterior
    ids = tuple(dict.fromkeys(record for record, _ in answer.observed.collisions))
    rows = []
    for weighed in answer.judged.found:
        name = weighed.cause.about
        if weighed.cause.kind != "effect" or name not in posterior:
            continue
        laws = _SUMS.get(name, {name: 1.0})
        value, error = posterior.of(laws)
        if name == "wall" and "r" in posterior:
            for wall, sign in (("plus", 0.5), ("minus", -0.5)):
                r, r_error = posterior.of({"r": 1.0, "wall": sign})
                rows.append(Estimate(f"r_wall_{wall}", r, r_error, "1", _IMPACTS, ids))
        elif name in _ROWS:
            rows.append(Estimate(_ROWS[name][0], value, error, _ROWS[name][1], _IMPACTS, ids))
        if name == "slope":
            speed = next(iter(answer.observed.collisions.values())).speed
            rows.append(Estimate("r_speed", speed, 0.0, "m/s", _IMPACTS, ids))
    ball = answer.observed.balls.get(1, "ln_m")
    of_r, of_m = effective(answer, ball)
    named = [name for name in HIDDEN if answer.effect(name) is not None]
    if (rolls := rolling_from(answer)) is not None:
        rows.append(Estimate("rolls_from", *rolls, "m/s^2", _IMPACTS, ids))
    elif named and "r" in posterior:  # of several balls each has its own
        value, error = posterior.of(of_r)
        rows.append(Estimate("r_effective", value, error, "1", _IMPACTS, ids))
    if set(named) - {"friction"} and campaign.known.nes_mass and "r" in posterior:
        value, error = posterior.of(of_m)
        size = campaign.known.nes_mass[0].value * math.exp(value)
        rows.append(Estimate("nes_mass_effective", size, size * error, "kg", _IMPACTS, ids))
    return rows


def _ball(answer: Answer, campaign: Campaign) -> list[Estimate]:
    """Mass of the first ball as all records show it, weighed or not: predictions take it with M."""
    masses = campaign.known.nes_mass
    if (name := answer.observed.balls.get(1)) is None:
        return []
    known = _sized(answer.posterior, {name: 1.0}, masses[0].value if masses else 1.0)
    records = answer.records_of({name: 1.0})
    return [] if known is None else [Estimate("m", *known, "kg", COMBINED, records)]


def _bases(answer: Answer, campaign: Campaign) -> list[Estimate]:
    """Base amplitude of each level, and of a test of another amplitude, as all records show it."""
    rows = []
    for level, name in answer.observed.levels.items():
        ids = tests_at(level, campaign)
        others = {id: {name: 1.0, own: 1.0} for id, own in answer.at_another_base(ids).items()}
        shared, common = tuple(id for id in ids if id not in others), answer.base_of(level, ids)
        for own, terms in ((shared, common), *(((id,), t) for id, t in others.items())):
            value, error = answer.posterior.of(terms)
            size = level * math.exp(value)
            rows.append(
                Estimate("base_amplitude", size, size * error, "m", "motion of the mass", own)
            )
    return rows


def _frequencies(driven: Mapping[str, DrivenMotion], campaign: Campaign) -> list[Estimate]:
    """Frequency of a base that was not recorded, of each level: as its tests show it, if alike."""
    levels: dict[float, dict[str, DrivenMotion]] = {}
    for record in campaign.records:
        motion = driven.get(record.id)
        if motion is not None and not motion.recorded and record.base_amplitude:
            levels.setdefault(record.base_amplitude, {})[record.id] = motion
    rows = []
    clock = campaign.known.uncertainties.clock.of(1.0)
    for own in levels.values():
        each = [one.rate / (2.0 * math.pi) for one in own.values()]
        errors = [
            math.hypot(one.rate_error / (2.0 * math.pi), _FREQUENCY * f)
            for one, f in zip(own.values(), each, strict=True)
        ]
        f, error = weighted_mean(each, errors)
        unlike = (
            abs(one - f) > _SHARED * f + DISAGREES * e for one, e in zip(each, errors, strict=True)
        )
        if not any(unlike):
            error = math.hypot(clock * f, error)
            rows.append(Estimate("base_frequency", f, error, "Hz", "motion of the mass", (*own,)))
    return rows


_SHARED, _FREQUENCY = 1e-3, 2e-5  # of a frequency: tests that share one; error of that of one test


def _releases(answer: Answer, campaign: Campaign) -> list[Estimate]:
    """Displacement from which each release began, as test log and records show it."""
    rows = []
    for stated, name in answer.observed.releases.items():
        ids = _released(stated, campaign)
        value, error = answer.posterior.of(answer.observed.mean_of(name, "own release", ids))
        size = stated * math.exp(value)
        rows.append(Estimate("release", size, size * error, "m", "displacement", ids))
    return rows


def _released(stated: float, campaign: Campaign) -> tuple[str, ...]:
    return tuple(
        r.id for r in campaign.records if r.test == "transient" and abs(r.release or 0.0) == stated
    )


_NO_DECAY = (
    "no free decay, no sweep without NES, and no test with a ball and a laser that could be used"
)


#: M of any rig in a laboratory, kg.
_ORDINARY_M = (0.02, 500.0)


def _trust_in_mass(
    sources: Sequence[Source], answer: Answer, campaign: Campaign
) -> Iterator[Check]:
    """A mass that no rig in a laboratory has, and one that nothing else could contradict."""
    M = next((s.estimate.value for s in sources if s.estimate.parameter == "M"), None)
    if M is None or campaign.known.mass is not None:
        return
    low, high = _ORDINARY_M
    if not low <= M <= high:
        detail = (
            f"M = {M:.3g} kg is far from the mass of any rig in a laboratory ({low:g} to {high:g} "
            "kg): added_mass_g or known.nes_mass is in another unit. Correct it, or weigh the "
            "oscillator (known.mass)"
        )
        yield Check("", "identification", "warning", detail)
    if [*_ways(answer, campaign)] == ["added mass"] and len(answer.observed.loads) == 1:
        detail = (
            "M rests on a single added mass: no record would show a mistake in it. A ring-down "
            "with a second one would, or the weighed oscillator (known.mass)"
        )
        yield Check("", "identification", "ok", detail)


def _open_mass(answer: Answer) -> str:
    """Why the records leave M open, and what to do."""
    terms = {"ln_M": 1.0}
    value, error = answer.posterior.of(terms)
    loads = answer.observed.loads
    if loads and math.exp(value) < _NOTHING_OF * min(loads):
        return (
            "the frequencies go with added_mass_g as if the oscillator had no mass of its own: "
            "type what was screwed on alone, no total with the oscillator or a carrier, or weigh "
            "the oscillator (known.mass)"
        )
    causes = dict.fromkeys(map(called, answer.judged.leave_open(terms)))
    why = f". It may be {' or '.join([*causes][:4])}" if causes else ""
    return (
        f"what was stated and what the records show leave it open by {100.0 * error:.0f} %{why}; "
        "correct records.csv, or weigh the oscillator (known.mass)"
    )


_NOTHING_OF = 0.1  # of the lightest added mass: that of an oscillator in the totals


def _absent(
    rows: Sequence[Estimate], answer: Answer | None = None, campaign: Campaign | None = None
) -> list[Check]:
    """What is not in the table, and what it would take."""
    found = answer.posterior if answer else None
    reasons = {
        "f0": _NO_DECAY,
        "zeta": _NO_DECAY,
        "M": (
            "not weighed (known.mass), no pair of ring-downs with and without added mass, no "
            "impacts of a ball of known mass (known.nes_mass)"
        ),
        "r": "no drop test and no test whose displacement shows ten impacts of an NES or more",
    }
    for name, term in (("f0", "ln_f0"), ("zeta", "ln_zeta"), ("r", "r")):
        if answer is None or found is None or term not in found or not answer.records_of({term: 1}):
            continue
        value, error = found.of({term: 1.0})
        if term != name:
            value, error = math.exp(value), math.exp(value) * error
        reasons[name] = (
            f"the tests together show {value:.3g} +- {COVERAGE_95 * error:.2g}; leave out those in "
            "which it was another, or analyse them as a campaign of their own"
        )
    if answer is not None and campaign is not None and _ways(answer, campaign):
        reasons["M"] = _open_mass(answer)
    # by one way a value may seem known that all together leave open
    rows = [e for e in rows if e.method == COMBINED] if answer is not None else rows
    present = {"r" if e.parameter.startswith("r_") else e.parameter for e in rows}
    checks = [
        Check("", "identification", "warning", f"{name} is not known: {reason}")
        for name, reason in reasons.items()
        if name not in present
    ]
    if missing := [name for name in ("k1", "c1") if name not in present]:
        needed = ("M", "f0", "zeta") if "c1" in missing else ("M", "f0")
        lacking = [name for name in needed if name not in present]
        they = "they need" if len(missing) > 1 else "it needs"
        detail = (
            f"{' and '.join(missing)} {'are' if len(missing) > 1 else 'is'} not known: {they} "
            f"{', '.join(lacking) or ', '.join(needed) + ' with smaller errors'}"
        )
        checks.append(Check("", "identification", "warning", detail))
    return checks


#: A row of inputs.csv, and the unknowns that it is made of.
_Input = tuple[dict[str, Value], set[str]]


def _inputs(answer: Answer, campaign: Campaign) -> list[_Input]:
    """Rows of inputs.csv: each thing that was stated, and what the records say of it."""
    o = answer.observed
    rows = []
    for (record, number), (name, stated) in o.clearances.items():
        terms = off_stated(name, stated)
        item = "clearance" if number == 0 else f"clearance of ball {number}"
        rows.append(_input(answer, item, (record,), "mm", 1e3, stated, terms, log=False))
    for level, name in o.levels.items():
        ids = tuple(r.id for r in campaign.records if r.base_amplitude == level)
        terms = answer.base_of(level, ids)
        rows.append(_input(answer, "base_amplitude", ids, "mm", 1e3, level, terms, log=True))
        for id, own in answer.at_another_base(ids).items():
            terms = {name: 1.0, own: 1.0}
            rows.append(_input(answer, BASE_OF_ONE, (id,), "mm", 1e3, level, terms, log=True))
    for release, name in o.releases.items():
        ids = _released(release, campaign)
        terms = o.mean_of(name, "own release", ids)
        rows.append(_input(answer, "release", ids, "mm", 1e3, release, terms, log=True))
    for load, name in o.loads.items():
        ids = tuple(r.id for r in campaign.records if r.added_mass == load)
        scale = answer.posterior.of({"load scale": 1.0})[0]  # logarithm of a factor of all
        slope = load * math.exp(scale)
        terms, off = {name: 1.0, "load scale": slope}, load * math.expm1(scale) - slope * scale
        cells = answer.moved({o.cells[id][0]: id for id in ids if id in o.cells})
        groups = [(tuple(id for id in ids if id not in cells), terms)]
        groups += [((id,), {**terms, cell: 1.0}) for id, cell in cells.items()]
        rows += [
            _input(answer, "added_mass", alike, "g", 1e3, load, of, log=False, constant=off)
            for alike, of in groups if alike
        ]  # fmt: skip
    for place, mass in enumerate(campaign.known.nes_mass, start=1):
        if (name := o.balls.get(place, "")) in answer.posterior:
            several = len(campaign.known.nes_mass) > 1
            item = f"nes_mass of ball {place}" if several else "nes_mass"
            rows.append(_input(answer, item, (), "g", 1e3, mass.value, {name: 1.0}, log=True))
    if campaign.known.mass is not None:
        mass = campaign.known.mass
        terms, constant = {"ln_M": 1.0}, -math.log(mass.value)
        rows.append(
            _input(answer, "mass", (), "kg", 1.0, mass.value, terms, log=True, constant=constant)
        )
    for (role, setup), name in o.gains.items():
        item = gain_of(role, setup)
        rows.append(_input(answer, item, (), "1", 1.0, 1.0, {name: 1.0}, log=True))
    unstated = {(name, record.id) for record in campaign.records for name in record.shown}
    return [
        ({**row, **_NOT_STATED}, of) if (row["item"], str(row["record"]).split(";")[0]) in unstated
        else (row, of) for row, of in rows
    ]  # fmt: skip


_NOT_STATED = {"stated": None, "stated_error": None, "verdict": Verdict.NOT_STATED.value}


def _contradicted(inputs: Sequence[_Input], answer: Answer) -> list[Check]:
    """One line for each kind of input that the records contradict, where no cause moves it."""
    moved = {name for w in answer.judged.found if w.sure or w.rivals for name in w.cause.moves}
    groups: dict[str, list[Mapping[str, Value]]] = {}
    for row, unknowns in inputs:
        if row["verdict"] == Verdict.OFF.value and not unknowns & moved:
            groups.setdefault(str(row["item"]), []).append(row)
    checks = []
    for item, rows in groups.items():
        error = float(rows[0]["found_error"] or 0.0)
        first, more = rows[0], f" and of {len(rows) - 1} more" if len(rows) > 1 else ""
        detail = (
            f"{item} of {first['record'] or 'the campaign'}{more}: stated {first['stated']:.5g} "
            f"{first['unit']}, the records show {first['found']:.5g} +- {COVERAGE_95 * error:.2g}; "
            "the analysis uses what was found (inputs.csv)"
        )
        checks.append(Check("", "test log", "warning", detail.replace(" 1,", ",")))
    return checks


_FARTHEST = 5.0  # usual deviations; causes go as far as four


def _stretched(inputs: Sequence[_Input], answer: Answer) -> list[Check]:
    """One line for unknowns farther from what an ordinary lab has than any cause of them goes.

    They stand for something that is no cause of the list. What was stated is in inputs.csv.
    """
    told = {name for _, unknowns in inputs for name in unknowns}
    told |= {name for w in answer.judged.found for name in w.cause.moves}
    priors, found = answer.judged.beliefs.priors, answer.posterior
    far = []
    for name, value in zip(found.names, found.values, strict=True):
        apart, usual = abs(value - priors[name].value), priors[name].error
        stretched = usual > KNOWN and name not in told and apart > _FARTHEST * usual
        if stretched and apart > _FARTHEST * found.of({name: 1.0})[1]:
            far.append((float(apart / usual), name))
    if not far:
        return []
    widths, name = max(far)
    words = next(
        called_unknown(kind, of[name]) for kind, of in answer.observed.kinds.items() if name in of
    )
    more = f" (and {len(far) - 1} more)" if len(far) > 1 else ""
    detail = (
        f"not explained: the records fit only with {words}{more} {widths:.0f} times as far off as "
        "an ordinary lab leaves it, and no known effect or mistake goes as far: values may be "
        "wrong by more than their errors"
    )
    return [Check("", "plain model", "warning", detail)]


def _far_off(answer: Answer) -> list[Check]:
    """Records whose impacts are farther off than any scatter leaves them, by the model that fits.

    No cause is told by them: the errors of all values are as much larger.
    """
    left = {record: answer.data.left(record) for record in answer.data.records if record}
    far = sorted((record for record, one in left.items() if one > SURE**2), key=left.__getitem__)
    if not far:
        return []
    worst = math.sqrt(left[far[-1]])
    detail = (
        f"not explained: the impacts of {first_of(far[::-1], _LISTED)} are up to {worst:.2g} times "
        "as far from what the records together say as they scatter, and no known effect or mistake "
        "explains it; the errors of all values are larger for it"
    )
    return [Check("", "plain model", "warning", detail)]


def _input(
    answer: Answer, item: str, records: tuple[str, ...], unit: str, size: float, stated: float,
    terms: Mapping[str, float], *, log: bool, constant: float = 0.0,
) -> _Input:  # fmt: skip
    """One row: stated beside found; `terms` are its error, or the logarithm of a factor."""
    value, error = answer.posterior.of(terms, constant)
    priors = answer.observed.beliefs.priors
    own = math.hypot(*(f * priors[n].error for n, f in terms.items() if n in priors))
    if log:
        found, found_error = stated * math.exp(value), stated * math.exp(value) * error
        stated_error = stated * own
    else:
        found, found_error, stated_error = stated + value, error, own
        if not (found > 0.0 and is_known(found, found_error)):  # no length, no mass is this
            found, found_error = stated, stated_error
    verdict = Verdict.OK
    named = {
        n for w in answer.judged.found if w.sure and not w.rivals and w.cause.direction
        for n in w.cause.direction.terms
    }  # fmt: skip
    apart = abs(found - stated)
    far = apart > SIGNIFICANT * math.hypot(stated_error, found_error)
    if named & set(terms) and apart > SIGNIFICANT * found_error:
        verdict = Verdict.OFF
    elif far:  # unless something else may have made what was found
        unexplained = any(not (w.sure or w.slight or w.rivals) for w in answer.judged.found)
        verdict = Verdict.DOUBTFUL if unexplained else Verdict.OFF
    elif found_error > _SHOWN * stated_error:
        verdict = Verdict.NOT_TESTED
    row: dict[str, Value] = {
        "item": item, "record": ";".join(records), "unit": unit, "stated": size * stated,
        "stated_error": size * stated_error, "found": size * found,
        "found_error": size * found_error, "verdict": verdict.value,
    }  # fmt: skip
    return row, set(terms)
