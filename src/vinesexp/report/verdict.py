"""The verdict: which clearance was best, which is predicted, and how sure either is, in words.

It says no more than the records bear: a best clearance at the edge of what was tried is a bound,
and a prediction is compared with a bound only where it contradicts it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from vinesexp.clearance.comparison import END, RigAtLevel
from vinesexp.clearance.levels import PeriodicLevel, Tested
from vinesexp.clearance.optimum import UNSEEN
from vinesexp.clearance.predicted import IdentifiedRig, predicted_lowest
from vinesexp.errors import VinesexpError
from vinesexp.figures.numbers import millimetres, outwards, percent, with_interval
from vinesexp.maps.basins import STARTS, Attractor, coexisting
from vinesexp.records.campaign.missing_cells import MISSING
from vinesexp.records.stored.tables import Row
from vinesexp.replay.replay_table import regimes_of
from vinesexp.results import CampaignResults
from vinesexp.theory.regime_definitions import PERMANENT
from vinesexp.units import first_of

#: Width of the interval of b_c, over b_c, up to which it can agree or disagree with anything.
DECIDES = 0.1


def within(row: Row) -> str:
    """Where a measured clearance lies for sure, from the tried ones around it; empty if unknown.

    Examples
    --------
    >>> within({"measured_mm": 27.0, "measured_low_mm": 26.0, "measured_high_mm": 28.0})
    'between 26 and 28 mm'
    >>> within({"measured_mm": 27.0, "measured_low_mm": None, "measured_high_mm": 28.0})
    'below 28 mm'
    """
    return _where(row, "between {} and {} mm")


def span(row: Row) -> str:
    """The same in brief: `26 to 28 mm`."""
    return _where(row, "{} to {} mm")


def _where(row: Row, both: str) -> str:
    if not row.get("measured_mm"):
        return ""
    least, most = outwards(row["measured_low_mm"], row["measured_high_mm"])
    if least and most:
        return both.format(least, most)
    if least:
        return f"above {least} mm"
    return f"below {most} mm" if most else "not bracketed by the clearances tried"


#: A prediction that misses the bracket by less than this share is reported as agreeing: clearances
#: are set to a few tenths of a millimetre.
NEAR = 0.01


def agreement(lowest: Row, end: Row) -> tuple[str, bool | None]:
    """Whether b_c lies where it should: at the end of permanent impacts, else at the optimum.

    Returns
    -------
    sentence : str
    agrees : bool or None
        None where there is nothing to compare, or a bound that b_c does not contradict.

    Examples
    --------
    >>> predicted = {"exact_mm": 33.91, "predicted_low_mm": 33.89, "predicted_high_mm": 33.94}
    >>> end = {"measured_mm": 34.25, "measured_low_mm": 34.0, "measured_high_mm": 34.5}
    >>> agreement({}, {**end, **predicted})
    ('b_c is 0.3 % below the clearances between which two impacts per cycle end', True)
    >>> agreement({}, {**end, **predicted, "measured_low_mm": 31.0, "measured_high_mm": None})
    ('two impacts per cycle end above 31 mm: b_c is not tested further', None)
    """
    if end.get("measured_mm"):
        row, what = end, "two impacts per cycle end"
    else:
        row, what = lowest, "the amplitude is lowest"
        if lowest.get("bound"):
            return "nothing to compare: the lowest amplitude is at the edge of what was tried", None
    if not row.get("measured_mm") or not row.get("exact_mm"):
        return "nothing to compare", None
    low, high = row["measured_low_mm"], row["measured_high_mm"]
    bound, low, high = None in (low, high), low or 0.0, math.inf if high is None else high
    reach, exact = (row["predicted_low_mm"], row["predicted_high_mm"]), row["exact_mm"]
    width = (reach[1] - reach[0]) / exact
    if width > DECIDES:
        return (
            f"cannot decide: the 95 % interval of b_c is {100.0 * width:.0f} % wide; the error "
            "budget shows what would narrow it most",
            None,
        )
    if reach[0] <= high and reach[1] >= low:
        if bound:
            return f"{what} {within(row)}: b_c is not tested further", None
        if high - low > 2.0 * DECIDES * exact:
            return (
                f"b_c lies where {what}, but that is {within(row)}: the clearances tried are too "
                "far apart to test it; try some near b_c",
                None,
            )
        return f"b_c lies where {what}", True
    apart = exact / low - 1.0 if exact < low else exact / high - 1.0
    side = "below" if apart < 0.0 else "above"
    share = f"b_c is {percent(abs(apart), sign='-')} {side}"
    if bound:
        tried = low if apart < 0.0 else high
        agrees = None if abs(apart) < NEAR else False
        return f"{share} {tried:.4g} mm, but {what} {within(row)}", agrees
    return f"{share} the clearances between which {what}", abs(apart) < NEAR


#: Checks that can be why a prediction misses, in words.
CAUSES = {
    "base frequency": "the base frequency differs from the test log",
    "base motion": "the base did not move as a steady sine",
    "cross-axis": "the accelerometer shows motion across its axis",
    "settling": "some tests may not have settled",
    "gain": "the channels disagree on their gain",
    "sign": "a channel has the wrong sign",
    "damping": "damping depends on amplitude",
    "spring": "the stiffness depends on amplitude",
    "plain model": "the plain model does not explain the records",
    "replay": "the identified rig does not reproduce its records",
}


def likely_causes(checks: Sequence[Row]) -> str:
    """The causes that warnings name, as a clause; says so where they name none.

    Examples
    --------
    >>> likely_causes([{"record": "", "check": "sign", "outcome": "warning", "detail": "..."}])
    'likely causes by the checks: a channel has the wrong sign'
    """
    named = {row["check"] for row in checks if row["outcome"] == "warning"}
    words = [text for name, text in CAUSES.items() if name in named]
    if not words:
        return "no check names a cause; a clearance or the ball's mass may be off"
    return f"likely causes by the checks: {', '.join(words)}"


def left_early(level: PeriodicLevel, end: Row, replay: Sequence[Row]) -> str:
    """Why tests may lose two impacts per cycle below b_c: they began elsewhere; empty if not so.

    Parameters
    ----------
    level : PeriodicLevel
    end : mapping
        Row of clearances.csv of the end of two impacts per cycle.
    replay : sequence of mappings
        Rows of replay.csv.
    """
    low, exact = end.get("measured_low_mm") or 0.0, end.get("exact_mm") or 0.0
    replayed = {row["record"]: row for row in replay if row["quantity"] == "regime"}
    for test in level.tests:
        b, lost = 1e3 * test.clearance, test.regime not in (*PERMANENT, "", UNSEEN)
        shown = regimes_of(replayed[test.record]) if test.record in replayed else set()
        if lost and low < b < exact and shown & set(PERMANENT):
            return (
                f"at {b:.4g} mm the identified rig keeps two impacts per cycle from some starts "
                "only, so these tests do not show where that orbit ends"
            )
    return ""


@dataclass(frozen=True)
class PeriodicVerdict:
    """What periodic tests at one base amplitude say.

    Attributes
    ----------
    level : ``G = 0.25 mm``.
    lowest, end : rows of clearances.csv: clearance of lowest amplitude, and where two impacts per
        cycle cease to be permanent; empty where there is none.
    sentence : how b_c and the measurement agree.
    agrees : the same as a truth value; None where one of them is missing or only a bound.
    exact_lowest : predicted clearance of lowest amplitude, mm; None where unknown.
    unpredicted : why the rig has no prediction; empty where it has.
    """

    level: str
    lowest: Row
    end: Row = field(default_factory=dict)
    sentence: str = ""
    agrees: bool | None = None
    exact_lowest: float | None = None
    unpredicted: str = ""


def periodic_verdicts(results: CampaignResults) -> list[PeriodicVerdict]:
    """One verdict a base amplitude, from clearances.csv, replay.csv and level_values.csv."""
    rows, replay = results.compared, results.rows("replay")
    verdicts = []
    for level in results.periodic:
        lowest, end = (rows.get(("periodic", level.name + of), {}) for of in ("", END))
        rig = results.rig_at(level)
        least = predicted_lowest(rig, G=level.G, frequency=level.frequency)
        sentence, agrees = agreement(lowest, end)
        if agrees is False and (why := left_early(level, end, replay)):
            sentence, agrees = f"{sentence}; {why}", None
        least = None if least is None else 1e3 * least
        verdicts.append(
            PeriodicVerdict(level.name, lowest, end, sentence, agrees, least, rig.unpredicted)
        )
    return verdicts


def release_rows(clearances: Sequence[Row]) -> list[Row]:
    """Rows of clearances.csv on releases: the fastest clearance to one amplitude, and b_t."""
    return [row for row in clearances if row["test"] == "transient"]


def headline(
    periodic: Sequence[PeriodicVerdict],
    releases: Sequence[Row],
    known: Collection[str],
    checks: Sequence[Row] = (),
) -> str:
    """The campaign in a few sentences.

    Parameters
    ----------
    periodic : sequence of PeriodicVerdict
        The last one with a measured optimum is reported, a bracketed one first.
    releases : sequence of mappings
        Rows of `release_rows`.
    known : collection of str
        Parameters that have a value.
    checks : sequence of mappings
        Rows of checks.csv: where prediction and measurement disagree they may say why.
    """
    measured = [verdict for verdict in periodic if verdict.lowest.get("measured_mm")]
    bracketed = [verdict for verdict in measured if not verdict.lowest.get("bound")]
    if measured:
        last = (bracketed or measured)[-1]
        text = f"At {_setting(last)} the mass moved least with {_best(last.lowest)}."
        b_c = f"b_c is predicted at {exact} mm." if (exact := predicted(last.lowest)) else ""
        if ends := within(last.end):
            text += f" In these tests two impacts per cycle cease to be permanent {ends}"
            text += f"; {b_c}" if b_c else "."
        elif b_c:
            text += f" {b_c}"
        if last.unpredicted:
            text += f" b_c is not predicted: {last.unpredicted}."
        return text + (_disagreements(periodic, checks) or _agreement(periodic))
    reached = [row for row in releases if within(row)]
    if reached:
        first = ([row for row in reached if not row["bound"]] or reached)[0]
        best = {row["measured_mm"] for row in reached}
        others = " To another amplitude another clearance is fastest." if len(best) > 1 else ""
        return f"From {first['level']} the amplitude fell fastest with {_best(first)}.{others}"
    missing = [row["detail"] for row in checks if row["check"] == MISSING]
    unknown = [row["detail"] for row in checks if row["check"] == "optimal clearance"]
    reason = (
        (unknown or ["too few clearances were tried to find the best one"])[0]
        if periodic or releases
        else missing[0]
        if missing
        else "there is no usable periodic test and no usable release with one NES"
    )
    nothing = "" if known else " The records determine no parameter either."
    return f"No best clearance can be reported: {reason}.{nothing}"


def _setting(verdict: PeriodicVerdict) -> str:
    """The level, and the base amplitude that predictions use where it is another."""
    stated, used = (verdict.lowest.get(f"{of}_mm") for of in ("stated_base", "base_amplitude"))
    # From this share on the base amplitude that was found is said beside the stated one.
    if not stated or not used or abs(used / stated - 1.0) < 0.02:
        return verdict.level
    return f"{verdict.level} (as stated; the base moved by {used:.4g} mm)"


def _disagreements(periodic: Sequence[PeriodicVerdict], checks: Sequence[Row]) -> str:
    """Where prediction and measurement exclude one another, and what may be why."""
    apart = [f"{v.level} ({v.sentence})" for v in periodic if v.agrees is False]
    if not apart:
        return ""
    return f" Prediction and measurement disagree at {'; '.join(apart)}; {likely_causes(checks)}."


def _agreement(periodic: Sequence[PeriodicVerdict]) -> str:
    """That prediction and measurement agree, and where they could be compared."""
    agreeing = [verdict.level for verdict in periodic if verdict.agrees]
    if not agreeing:
        return ""
    if len(agreeing) < len(periodic):
        where = ", ".join(agreeing)
        return f" Prediction and measurement agree at {where}; elsewhere the tests do not decide."
    every = " at every base amplitude" if len(periodic) > 1 else ""
    return f" Prediction and measurement agree{every}."


_EDGE = {
    "at most": "and smaller ones may be better",
    "at least": "and larger ones may be better",
    "open": "and smaller and larger ones may be better",
}


def _best(row: Row) -> str:
    """The clearance that was best, whether it is at the edge, and where the best one lies."""
    edge = f", {_EDGE[row['bound']]}" if row.get("bound") else ""
    return (
        f"a clearance of {millimetres(row['measured_mm'])} mm{edge} (the best one lies "
        f"{within(row)})"
    )


def predicted(row: Row) -> str:
    """The exact prediction of a row with half of its 95 % interval, mm; empty where unknown."""
    if (exact := row.get("exact_mm")) is None:
        return ""
    return with_interval(exact, row["predicted_low_mm"], row["predicted_high_mm"])


# Does the identified rig move as the records do? And where a record shows another regime than b_c
# predicts, the motions that coexist at its clearance.
#: Share by which the amplitude of a record may miss that of a motion that explains it.
ALIKE = 0.1
#: Records that are looked at; more say no more.
MOST = 12


@dataclass(frozen=True)
class ReplayVerdict:
    """What the replay says of the identified rig.

    Attributes
    ----------
    sentence : for the section.
    warning : for the verdict; empty where every record is replayed.
    rows : one a record, those that differ first: ``record``, ``differs``, the names of its
        quantities that do, and ``own``, its rows of replay.csv by quantity.
    """

    sentence: str
    warning: str
    rows: tuple[dict[str, Any], ...]


def replay_verdict(rows: Sequence[Row], checks: Sequence[Row]) -> ReplayVerdict | None:
    """From the rows of replay.csv and checks.csv; None where nothing was replayed.

    Examples
    --------
    >>> row = {"record": "a", "quantity": "amplitude", "measured": 0.005, "replayed": 0.00501,
    ...        "low": 0.005, "high": 0.00502, "deviation": -0.002, "outcome": "ok",
    ...        "starts": ""}
    >>> replay_verdict([row], []).sentence
    'The identified rig moves as the record does: mean amplitude within 0.2 %.'
    """
    if not rows:
        return None
    records = list(dict.fromkeys(row["record"] for row in rows))
    failed = list(dict.fromkeys(row["record"] for row in checks if row["check"] == "replay"))
    # Those that differ come first: of many records only the first are shown.
    shown = tuple(sorted(_records(rows), key=lambda row: not row["differs"]))
    if failed:
        whose = f"{len(failed)} of {len(records)} records" if records[1:] else "its only record"
        warning = (
            f"The identified rig does not reproduce {whose} "
            f"({', '.join(failed[:5])}{', ...' if len(failed) > 5 else ''}): predictions for such "
            "tests may not hold."
        )
        return ReplayVerdict(warning, warning, shown)
    whose = "the record does" if len(records) == 1 else f"all {len(records)} records do"
    worst, within = _within(rows)
    sentence = f"The identified rig moves as {whose}: {within}."
    if worst > COARSE:
        sentence = f"No record contradicts the identified rig, but they test it coarsely: {within}."
    if aside := [f"{row['record']} ({row['differs']})" for row in shown if row["differs"]]:
        sentence += f" Other quantities differ in {first_of(aside, 5)}."
    return ReplayVerdict(sentence, "", shown)


#: Largest deviation up to which a replay says that the rig moves as a record.
COARSE = 0.2


def _within(rows: Sequence[Row]) -> tuple[float, str]:
    """How far the worst of each quantity is off, and this in words."""
    steady = {
        row["record"]
        for row in rows
        if row["quantity"] == "regime" and row["measured"] in PERMANENT
    }
    other = "mean amplitude" + (" of other motions" if steady else "")
    parts: dict[str, float] = {}
    for row in rows:
        words, off = row["quantity"], row["deviation"]
        if words == "amplitude":
            permanent = "amplitude of permanent two impacts per cycle"
            words = permanent if row["record"] in steady else other
        if off is not None and row["quantity"] in ("amplitude", "decay time"):
            parts[words] = max(parts.get(words, 0.0), abs(off))
    shown = [f"{words} within {max(100.0 * off, 0.1):.2g} %" for words, off in parts.items()]
    worst = max(parts.values(), default=0.0)
    return worst, ", ".join(shown) or "as far as they can be compared"


def _records(rows: Sequence[Row]) -> Iterator[dict[str, Any]]:
    for record in dict.fromkeys(row["record"] for row in rows):
        own = {row["quantity"]: row for row in rows if row["record"] == record}
        differs = ", ".join(name for name, row in own.items() if row["outcome"] == "differs")
        yield {"record": record, "differs": differs, "own": own}


def other_branches(levels: Sequence[RigAtLevel], clearances: Sequence[Row]) -> list[dict[str, str]]:
    """One row for each record whose regime is not the one that b_c predicts.

    Parameters
    ----------
    levels : sequence of (PeriodicLevel, IdentifiedRig)
    clearances : sequence of mappings
        Rows of clearances.csv.

    Returns
    -------
    list of dict
        ``record``, ``clearance`` (mm), ``measured``, ``predicted``, ``found`` (the motions that
        coexist) and ``explained`` (a sentence); empty where all agree or values are missing.
    """
    rows = {row["level"]: row for row in clearances if row["test"] == "periodic"}
    differing = [
        (level, test, rig)
        for level, rig in levels
        if level.name in rows and not rig.missing
        for test in level.tests
        if _differs(test, rows[level.name])
    ]
    return [row for one in differing[:MOST] if (row := _row(*one))]


def _differs(test: Tested, row: Row) -> bool:
    """Whether the regime is another than b_c predicts; within its interval nothing is predicted."""
    low, high = row["predicted_low_mm"], row["predicted_high_mm"]
    if low is None or not test.regime or test.regime == UNSEEN:
        return False
    b = 1e3 * test.clearance
    permanent = test.regime in PERMANENT
    return (b < low and not permanent) or (b > high and permanent)


def _row(level: PeriodicLevel, test: Tested, rig: IdentifiedRig) -> dict[str, str] | None:
    try:
        plain = rig.plain(test.clearance)
        found = coexisting(
            plain,
            level=level.G,
            frequency=level.frequency or plain.oscillator.f0,
            clearances=[test.clearance],
        )
    except VinesexpError:
        return None
    permanent = test.regime in PERMANENT
    return {
        "record": test.record,
        "clearance": f"{1e3 * test.clearance:.4g}",
        "measured": f"{test.regime}, {1e3 * (test.value or 0.0):.3g} mm",
        "predicted": "no two impacts per cycle" if permanent else "two impacts per cycle",
        "found": "; ".join(_in_words(one) for one in found),
        "explained": explanation(test, found),
    }


def explanation(test: Tested, found: Sequence[Attractor]) -> str:
    """Whether one of the motions that coexist is that of the record.

    Examples
    --------
    >>> low = Attractor(0.03, "two symmetric", 0.75, 30, 1.3e-3, 1.3e-3, 1.3e-3, 1.4e-3, 2.0)
    >>> high = Attractor(0.03, "strongly modulated", 0.25, 10, 6e-3, 5.9e-3, 6.1e-3, 9e-3, 1.6)
    >>> explanation(Tested(0.03, 6.2e-3, "strongly modulated"), [low, high])
    'another motion explains it: strongly modulated, 6 mm, from 25 % of the starts'
    """
    value, regimes = test.value or 0.0, {test.regime}
    regimes |= set(PERMANENT) if test.regime in PERMANENT else set()
    alike = [
        one
        for one in found
        if one.regime in regimes and (1.0 - ALIKE) * one.low <= value <= (1.0 + ALIKE) * one.high
    ]
    if not alike:
        return f"not explained: none of {STARTS} starts leads to the measured motion"
    best = max(alike, key=lambda one: one.share)
    if best.share == 1.0:
        return "all starts lead to the motion of the record, none to the orbit that b_c belongs to"
    return f"another motion explains it: {_in_words(best)}"


def _in_words(one: Attractor) -> str:
    return f"{one.regime}, {1e3 * one.mean:.3g} mm, from {100.0 * one.share:.0f} % of the starts"
