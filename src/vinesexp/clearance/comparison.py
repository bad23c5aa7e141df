"""Measured optimal clearances beside the predicted ones: clearances.csv.

Two rows a base amplitude: where the amplitude was lowest, and between which clearances permanent
impacts end, which is what b_c predicts. One row a release and amplitude to be reached, all of
them beside the same b_t: there is no single best clearance for a release (docs/theory.md, 29).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

from vinesexp.clearance.levels import (
    PeriodicLevel,
    ReleaseLevel,
    Rows,
    Tested,
    base_checks,
    of_state,
)
from vinesexp.clearance.optimum import (
    UNSEEN,
    Optimum,
    end_of_permanent,
    fastest,
    lowest_amplitude,
    widened,
)
from vinesexp.clearance.predicted import (
    ROLLS_IN_PART,
    IdentifiedRig,
    Predicted,
    UnpredictedError,
    expected_amplitude,
    predicted_b_c,
    predicted_b_t,
    swing_beside_orbit,
)
from vinesexp.errors import AnalysisError
from vinesexp.identification.budget import rows_of
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.result_columns import CLEARANCES
from vinesexp.records.stored.tables import Value
from vinesexp.rig import RIG_VALUES
from vinesexp.theory.regime_definitions import PERMANENT
from vinesexp.units import COVERAGE_95

#: A level and the rig of its tests, at the amplitude at which it works.
RigAtLevel = tuple[PeriodicLevel, IdentifiedRig]
ReleaseAndRig = tuple[ReleaseLevel, IdentifiedRig]

#: What follows the name of a base amplitude in the row of the end of permanent impacts.
END = ", end of two impacts per cycle"

#: Kinds of rows.
LOWEST, PERMANENT_END, FASTEST = (
    "lowest amplitude",
    "end of two impacts per cycle",
    "fastest decay",
)

#: What each kind of row measures.
_IN_WORDS = {
    LOWEST: "the clearance of the lowest amplitude",
    PERMANENT_END: "the clearance at which two impacts per cycle end",
    FASTEST: "the fastest clearance",
}
_HOW_TO_KNOW = {
    "M": "ring-downs with added masses, impacts, or `known: mass`",
    "c1": "M and a ring-down",
    "k1": "M and a ring-down",
    "r": "a drop test, or impacts with a known clearance",
    "m": "`known: nes_mass` in campaign.yaml, or impacts and a known M",
}


# Tests that ended before the oscillator had forgotten how they began.
#
# A lightly damped mass takes minutes to settle. A record that is shorter, without two impacts per
# cycle that last, may show the way there, at whatever clearance: which tests count must not depend
# on what is predicted.


def may_not_have_settled(tests: Sequence[Tested], rig: IdentifiedRig) -> list[Tested]:
    """Tests without permanent two impacts per cycle that are too short to have settled.

    Parameters
    ----------
    tests : sequence of Tested
    rig : IdentifiedRig
        With f0 and zeta.
    """
    forgets = _decay_time(rig)
    return [
        test
        for test in tests
        if test.length < forgets and test.regime not in (*PERMANENT, UNSEEN, "")
    ]


def settled_tests(tests: Sequence[Tested], rig: IdentifiedRig) -> list[Tested]:
    """The tests whose mean amplitude is that of the settled motion: the lowest is among them."""
    begun, forgets = may_not_have_settled(tests, rig), _decay_time(rig)
    return [
        test
        for test in tests
        if test not in begun and start_in_mean(test, forgets) <= _START_COUNTS
    ]


def settling_checks(
    level: PeriodicLevel, begun: Sequence[Tested], rig: IdentifiedRig
) -> list[Check]:
    """What to say of tests of a level that may not have settled."""
    if not begun:
        return []
    shortest = min(test.length for test in begun)
    names = ", ".join(test.record for test in begun)
    detail = (
        f"{level.name}: {names}: no permanent two impacts per cycle in records of "
        f"{shortest:.3g} s; the free amplitude of this mass falls to 1/e in {_decay_time(rig):.3g} "
        "s: the tests may not have settled, and do not count for the best clearance; record "
        "longer, or state in the column settings how long the base had moved before, such as "
        "regimes.waited = 60 s"
    )
    return [Check("", "settling", "warning", detail)]


#: Decay times of the oscillator after which a start from rest no longer shows. Of simulated records
#: from rest whose mean was off by more than its interval, 178 of 180 waited less.
_WAITED = 2.0


def start_lasts(*, f0: float, zeta: float) -> float:
    """Time after which a start from rest no longer shows, s."""
    return _WAITED / (2.0 * math.pi * f0 * zeta)


#: A mean amplitude that holds more than this share of its start is none of the response.
_START_COUNTS = 0.25


def start_in_mean(test: Tested, forgets: float) -> float:
    """Share of the start from rest that is left in the mean amplitude of a test.

    It falls by exp(-t/forgets); 0 of a test that begins in motion, or where that is not known.

    Examples
    --------
    >>> test = Tested(0.03, 5e-3, length=14.0, waited=2.6)
    >>> round(start_in_mean(test, 3.0), 2), round(start_in_mean(test, 15.0), 2)
    (0.11, 0.59)
    """
    counted = test.length - test.waited
    if not math.isfinite(test.waited) or not forgets or counted <= 0.0:
        return 0.0
    ends = math.exp(-test.waited / forgets), math.exp(-test.length / forgets)
    return (ends[0] - ends[1]) * forgets / counted


def start_checks(level: PeriodicLevel, rig: IdentifiedRig) -> list[Check]:
    """What to say of tests whose counted cycles come too soon after a start from rest."""
    lasts = _WAITED * _decay_time(rig)
    soon = [t for t in level.tests if t.waited < lasts]
    if not soon:
        return []
    names = ", ".join(test.record for test in soon)
    detail = (
        f"{level.name}: {names}: recorded from rest; the counted cycles begin "
        f"{min(test.waited for test in soon):.3g} s after the start, and the start of this mass "
        f"lasts {lasts:.3g} s: the mean amplitudes may include a part of it; wait longer before "
        "recording, or record longer"
    )
    return [Check("", "settling", "warning", detail)]


def _large_motion(level: PeriodicLevel, rig: IdentifiedRig) -> list[Check]:
    """What to say where b_c is of one motion of two."""
    found = swing_beside_orbit(rig, G=level.G, frequency=level.frequency)
    if found is None:
        return []
    detail = (
        f"{level.name}: the spring stiffens or softens, and below b_c the identified rig may "
        f"swing by {1e3 * found[1]:.3g} mm instead of {1e3 * found[0]:.3g} mm, by how it is "
        "started: b_c is the end of the small motion; two impacts per cycle of the large one end "
        "at another clearance. Test a clearance below b_c from rest and from a pull"
    )
    return [Check("", "spring", "warning", detail)]


def _decay_time(rig: IdentifiedRig) -> float:
    """Time in which a free amplitude falls to 1/e, s; 0, which no record is below, if not known."""
    if rig.f0 is None or rig.zeta is None or rig.zeta.value <= 0.0:
        return 0.0
    return 1.0 / (2.0 * math.pi * rig.f0.value * rig.zeta.value)


def compare(
    campaign: Campaign,
    rig: IdentifiedRig,
    periodic: Sequence[RigAtLevel],
    releases: Sequence[ReleaseAndRig],
    base: Rows = (),
) -> tuple[list[dict[str, Value]], list[Check], list[dict[str, Value]]]:
    """Measured against predicted, level by level, and what cannot be compared and why.

    Parameters
    ----------
    campaign : Campaign
    rig : IdentifiedRig
    periodic, releases : sequences of (PeriodicLevel or ReleaseLevel, IdentifiedRig)
        Each level with the rig of its tests, at the amplitude at which it works.
    base : sequence of mappings
        Rows of base.csv.

    Returns
    -------
    rows, checks, budget
        A level that cannot be measured keeps its row, with empty cells, and a check says why. The
        budget says what the interval of each b_c and b_t is made of, m, as in budget.csv.
    """

    def reach(b: float, scatter: float = 0.0) -> float:
        return COVERAGE_95 * math.hypot(campaign.known.uncertainties.clearance.of(b), scatter * b)

    rows: list[dict[str, Value]] = []
    checks: list[Check] = []
    predictions: dict[str, Predicted | None] = {}
    for level, own in periodic:
        checks += _base_checks(campaign, level, base)
        predicted = _predicted(
            checks, level.name, partial(predicted_b_c, own, base=level.base, level=level.nominal)
        )
        predictions[f"b_c, {level.name}"] = predicted
        checks += start_checks(level, own)
        checks += _large_motion(level, own)
        begun = may_not_have_settled(level.tests, own)
        checks += settling_checks(level, begun, own)
        tests = [test for test in level.tests if test not in begun]
        settled = settled_tests(level.tests, own)
        b_c = None if predicted is None else predicted.low
        lowest = partial(lowest_amplitude, b_c=b_c, expected=expected_amplitude(own, level))
        within = partial(reach, scatter=level.base.scatter)
        for suffix, kind, find, counted in (
            ("", LOWEST, lowest, settled),
            (END, PERMANENT_END, end_of_permanent, tests),
        ):
            left_out = len(level.tests) - len(counted)
            optimum = _measured(checks, kind, level.name, counted, find, within, left_out)
            row = _row("periodic", level.name + suffix, kind, optimum, predicted)
            rows.append(_in_mm(row, base_amplitude=level.G, stated_base=level.nominal))
    for release, own in releases:
        predicted = _predicted(
            checks, release.name, partial(predicted_b_t, own, release=release.release)
        )
        predictions[f"b_t, {1e3 * release.x0:.6g} mm{of_state(release.state)}"] = predicted
        optimum = _measured(
            *(checks, FASTEST, f"release from {release.name}", release.tests),
            partial(fastest, resolution=own.half_period),
            reach,
        )
        row = _row("transient", release.name, FASTEST, optimum, predicted)
        rows.append(_in_mm(row, release=release.x0, target=release.target))
    budget = [
        row
        for name, found in predictions.items()
        if found is not None
        for row in rows_of(name, found.parts, unit=1e-3, name_of_unit=" mm")
    ]
    return rows, [*_absent(campaign, rig, rows), *dict.fromkeys(checks)], budget


def _base_checks(campaign: Campaign, level: PeriodicLevel, base: Rows) -> list[Check]:
    ids = {test.record for test in level.tests}
    records = [record for record in campaign.records if record.id in ids]
    rows = [row for row in base if row["record"] in ids]
    frequencies = {record.frequency[0] for record in records if record.frequency}
    recorded = {
        record.id for record in records
        if (channel := campaign.setup_of(record).channels.get("base")) and not channel.optional
    }  # fmt: skip
    silent = [
        Check(
            id, "base channel", "warning",
            "the base channel shows no steady motion over 20 cycles: it was off, or the record is "
            "short; the base of this test is that of its level",
        )
        for id in sorted(recorded - {row["record"] for row in rows})
    ]  # fmt: skip
    return silent + base_checks(level.name, frequencies, level.base, rows)


def _predicted(
    checks: list[Check], level: str, predict: Callable[[], Predicted]
) -> Predicted | None:
    """The prediction; what concerns all levels is said by `_absent`."""
    try:
        return predict()
    except UnpredictedError:
        return None
    except AnalysisError as error:
        checks.append(Check("", "prediction", "warning", f"{level}: {error}"))
        return None


def _measured(
    checks: list[Check],
    kind: str,
    level: str,
    tests: Sequence[Tested],
    find: Callable[[Sequence[Tested]], Optimum],
    reach: Callable[[float], float],
    left_out: int = 0,
) -> Optimum | None:
    """The optimum that was tried for; what was not tried is for a plan and no fault of records."""
    what = f"{level}: {_IN_WORDS[kind]} is"
    try:
        optimum = find(tests)
    except AnalysisError as error:
        young = f" (not of {left_out} that had not settled)" if left_out else ""
        checks.append(Check("", "optimal clearance", "ok", f"{what} not known: {error}{young}"))
        return None
    if optimum.bound:
        detail = f"{what} {bound_in_words(optimum, tests)}"
        checks.append(Check("", "optimal clearance", "ok", detail))
    if len(optimum.alike) > 1:
        first, last = (f"{1e3 * b:.4g}" for b in (optimum.alike[0], optimum.alike[-1]))
        detail = (
            f"{what} not known closer: from {first} to {last} mm the amplitudes differ by no more "
            f"than tests scatter ({100 * optimum.scatter:.2g} %)"
        )
        checks.append(Check("", "optimal clearance", "ok", detail))
    return widened(optimum, reach)


def bound_in_words(optimum: Optimum, tests: Sequence[Tested]) -> str:
    """What an optimum at the edge of what was tried says, and what to try.

    Examples
    --------
    >>> tests = [Tested(b, 1.0) for b in (0.02, 0.03, 0.04)]
    >>> bound_in_words(Optimum(0.02, None, 0.03), tests)
    'below 30 mm, maybe smaller than any tried (20 to 40 mm); try smaller ones'
    >>> bound_in_words(Optimum(0.03, 0.03, None), tests)
    'above 30 mm; the larger ones tried (40 mm) do not show where; try others'
    """
    tried = sorted(1e3 * test.clearance for test in tests)
    span = f"({tried[0]:.4g} to {tried[-1]:.4g} mm)"
    low, high = optimum.low, optimum.high
    if low is None and high is None:
        return f"not bracketed by the clearances tried {span}; try smaller and larger ones"
    (side, at, more) = ("above", low, "larger") if high is None else ("below", high, "smaller")
    at = 1e3 * (at or 0.0)
    beyond = [f"{b:.4g}" for b in dict.fromkeys(tried) if (b > at if high is None else b < at)]
    if beyond and 1e3 * optimum.clearance == at:
        own = ", ".join(beyond)
        return f"{side} {at:.4g} mm; the {more} ones tried ({own} mm) do not show where; try others"
    return f"{side} {at:.4g} mm, maybe {more} than any tried {span}; try {more} ones"


def _row(
    test: str, level: str, kind: str, optimum: Optimum | None, predicted: Predicted | None
) -> dict[str, Value]:
    """One row of clearances.csv.

    Measured: the clearance and the tried ones around it, by their own uncertainty farther away; one
    of those is empty where nothing was tried beyond, and `bound` says so. There is no error for a
    bound, nor for a release, whose fastest clearance b_t does not predict.
    """
    row: dict[str, Value] = dict.fromkeys(CLEARANCES.names)
    row |= {"test": test, "level": level, "kind": kind, "bound": "", "records": ""}
    if optimum:
        row |= {"bound": optimum.bound, "records": ";".join(optimum.records)}
        low, high = optimum.low, optimum.high
        _in_mm(row, measured=optimum.clearance, measured_low=low, measured_high=high)
    if predicted:
        _in_mm(row, published=predicted.published, exact=predicted.exact)
        _in_mm(row, predicted_low=predicted.low, predicted_high=predicted.high)
    if optimum and predicted and not optimum.bound and kind != FASTEST:
        row["error_percent"] = 100.0 * (predicted.exact / optimum.clearance - 1.0)
    return row


def _in_mm(row: dict[str, Value], **lengths: float | None) -> dict[str, Value]:
    """The row with lengths (m) in its columns in mm."""
    row |= {f"{name}_mm": None if b is None else 1e3 * b for name, b in lengths.items()}
    return row


def _absent(campaign: Campaign, rig: IdentifiedRig, rows: Rows) -> list[Check]:
    """Why there is no measured optimum or no prediction, as far as it concerns all levels."""
    checks = []
    if not rows:
        several = any(len(r.clearance) > 1 for r in campaign.records)
        detail = (
            "no usable periodic test (with base_amplitude_mm) and no usable release (with "
            "release_mm) with one NES: no measured optimal clearance"
            + ("; tests with several NESs do not enter" if several else "")
        )
        checks.append(Check("", "optimal clearance", "warning", detail))
    if rows and not rig.slides:
        checks.append(Check("", "prediction", "warning", ROLLS_IN_PART))
    for test, symbol, needed in (("periodic", "b_c", RIG_VALUES), ("transient", "b_t", ("r",))):
        names = [name for name in needed if name in rig.missing]
        if names and any(row["test"] == test for row in rows):
            how = "; ".join(f"{name} needs {_HOW_TO_KNOW[name]}" for name in names)
            detail = f"no {symbol} without {', '.join(names)}: {how}"
            checks.append(Check("", "prediction", "warning", detail))
    return checks
