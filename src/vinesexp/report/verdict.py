"""The verdict: which clearance was best, which is predicted, and how sure either is, in words.

It says no more than the records bear: a best clearance at the edge of what was tried is a bound,
and a prediction is compared with a bound only where it contradicts it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vinesexp.clearance.comparison import END
from vinesexp.clearance.curves import predicted_lowest
from vinesexp.clearance.levels import Periodic
from vinesexp.clearance.predicted import IdentifiedRig, at_level
from vinesexp.figures.numbers import millimetres, with_interval
from vinesexp.records.tables import number
from vinesexp.report.caveats import branch_note, likely_causes

Row = Mapping[str, str]
_NO_ROW: Row = {}


@dataclass(frozen=True)
class PeriodicVerdict:
    """What periodic tests at one base amplitude say; texts in mm, empty where unknown.

    Attributes
    ----------
    level : ``G = 0.25 mm``.
    lowest, lowest_within : clearance of lowest amplitude, and where it lies for sure (`within`).
    lowest_bound : ``at most`` and the like where it is the edge of what was tried.
    branch : which starts lead to another motion than the one whose end b_c is.
    end_within : where permanent two impacts per cycle end.
    exact, published : predicted b_c.
    exact_lowest : predicted clearance of lowest amplitude.
    sentence : how b_c and the measurement agree.
    agrees : the same as a truth value; None where one of them is missing or only a bound.
    """

    level: str
    lowest: str
    lowest_within: str
    end_within: str
    exact: str
    published: str
    exact_lowest: str
    sentence: str
    agrees: bool | None
    lowest_bound: str = ""
    branch: str = ""


def periodic_verdicts(
    levels: Sequence[Periodic],
    clearances: Sequence[Row],
    rig: IdentifiedRig,
    replay: Sequence[Row] = (),
    amplitudes: Sequence[Row] = (),
) -> list[PeriodicVerdict]:
    """One verdict a base amplitude, from clearances.csv, replay.csv and level_values.csv."""
    rows = {row["level"]: row for row in clearances if row["test"] == "periodic"}
    verdicts = []
    for level in levels:
        row, end = rows.get(level.name, _NO_ROW), rows.get(level.name + END, _NO_ROW)
        own = at_level(rig, amplitudes, G=level.nominal)
        least = predicted_lowest(own, G=level.G, frequency=level.frequency)
        sentence, agrees = agreement(row, end)
        verdicts.append(
            PeriodicVerdict(
                level=level.name,
                lowest=millimetres(row["measured_mm"]) if row.get("measured_mm") else "",
                lowest_within=within(row),
                end_within=within(end),
                exact=_predicted(row),
                published=millimetres(row["published_mm"]) if row.get("published_mm") else "",
                exact_lowest=f"{1e3 * least:.1f}" if least is not None else "",
                sentence=sentence,
                agrees=agrees,
                lowest_bound=row.get("bound", ""),
                branch=branch_note(level, replay),
            )
        )
    return verdicts


def within(row: Row) -> str:
    """Where a measured clearance lies for sure, from the tried ones around it; empty if unknown.

    Examples
    --------
    >>> within({"measured_mm": "27", "measured_low_mm": "26", "measured_high_mm": "28"})
    'between 26 and 28 mm'
    >>> within({"measured_mm": "27", "measured_low_mm": "", "measured_high_mm": "28"})
    'below 28 mm'
    """
    if not row.get("measured_mm"):
        return ""
    low, high = number(row["measured_low_mm"]), number(row["measured_high_mm"])
    if low is not None and high is not None:
        return f"between {low:g} and {high:g} mm"
    if low is not None:
        return f"above {low:g} mm"
    return f"below {high:g} mm" if high is not None else "not bracketed by what was tried"


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
    >>> predicted = {"exact_mm": "33.91", "predicted_low_mm": "33.89", "predicted_high_mm": "33.94"}
    >>> end = {"measured_mm": "34.25", "measured_low_mm": "34", "measured_high_mm": "34.5"}
    >>> agreement({}, {**end, **predicted})
    ('b_c is 0.3 % below the clearances between which two impacts per cycle end', True)
    >>> agreement({}, {**end, **predicted, "measured_low_mm": "31", "measured_high_mm": ""})
    ('two impacts per cycle end above 31 mm: b_c is not tested further', None)
    """
    if end.get("measured_mm"):
        row, what = end, "two impacts per cycle end"
    else:
        row, what = lowest, "amplitude is lowest"
        if lowest.get("bound"):
            return "nothing to compare: the lowest amplitude is at the edge of what was tried", None
    if not row.get("measured_mm") or not row.get("exact_mm"):
        return "nothing to compare", None
    low = number(row["measured_low_mm"])
    high = number(row["measured_high_mm"])
    bound = low is None or high is None
    low, high = low if low is not None else 0.0, high if high is not None else math.inf
    reach = float(row["predicted_low_mm"]), float(row["predicted_high_mm"])
    exact = float(row["exact_mm"])
    if reach[0] <= high and reach[1] >= low:
        if bound:
            return f"{what} {within(row)}: b_c is not tested further", None
        return f"b_c lies in the gap in which {what}", True
    apart = exact / low - 1.0 if exact < low else exact / high - 1.0
    side = "below" if apart < 0.0 else "above"
    share = f"b_c is {100.0 * abs(apart):.1f} % {side}"
    if bound:
        tried = low if apart < 0.0 else high
        text = f"{share} {tried:g} mm, but {what} {within(row)}"
        return text, None if abs(apart) < NEAR else False
    return f"{share} the clearances between which {what}", abs(apart) < NEAR


@dataclass(frozen=True)
class ReleaseVerdict:
    """The fastest clearance of one release to one amplitude, and b_t of that release.

    Attributes
    ----------
    level : ``20 mm to 3 mm``.
    best, within : measured, mm, and where it lies for sure; empty where not measured.
    bound : ``at most`` and the like where it is the edge of what was tried.
    published, exact : b_t, mm.
    """

    level: str
    best: str
    within: str
    published: str
    exact: str
    bound: str = ""


def release_verdicts(clearances: Sequence[Row]) -> list[ReleaseVerdict]:
    """One verdict for each release and amplitude to be reached."""
    return [
        ReleaseVerdict(
            level=row["level"],
            best=millimetres(row.get("measured_mm")),
            within=within(row),
            published=millimetres(row.get("published_mm")),
            exact=millimetres(row.get("exact_mm")),
            bound=row.get("bound", ""),
        )
        for row in clearances
        if row["test"] == "transient"
    ]


def headline(
    periodic: Sequence[PeriodicVerdict],
    releases: Sequence[ReleaseVerdict],
    parameters: Mapping[str, str],
    checks: Sequence[Row] = (),
) -> str:
    """The campaign in a few sentences.

    Parameters
    ----------
    periodic, releases : sequences
        Verdicts; the last periodic one with a measured optimum is reported, a bracketed one first.
    parameters : mapping
        Combined values as text, by name.
    checks : sequence of mappings
        Rows of checks.csv: where prediction and measurement disagree they may say why.
    """
    measured = [verdict for verdict in periodic if verdict.lowest]
    bracketed = [verdict for verdict in measured if not verdict.lowest_bound]
    if measured:
        last = (bracketed or measured)[-1]
        text = f"At {last.level} the mass moved least with {_least(last)}"
        if last.end_within:
            text += f" Permanent two impacts per cycle end {last.end_within}"
            text += f"; b_c is predicted at {last.exact} mm." if last.exact else "."
        elif last.exact:
            text += f" b_c is predicted at {last.exact} mm."
        return text + _disagreements(periodic, checks)
    reached = [verdict for verdict in releases if verdict.within]
    bracketed_releases = [verdict for verdict in reached if not verdict.bound]
    if reached:
        first = (bracketed_releases or reached)[0]
        edge = f", {_EDGE[first.bound]}" if first.bound else ""
        return (
            f"From {first.level} the amplitude fell fastest with a clearance of {first.best} mm"
            f"{edge} (the best one: {first.within}); other amplitudes have other fastest "
            "clearances."
        )
    found = ", ".join(
        f"{name} = {parameters[key]}"
        for key, name in (("f0", "f₀"), ("zeta", "ζ"), ("M", "M"), ("r", "r"))
        if key in parameters
    )
    reason = (
        "too few clearances were tried to find the best one"
        if periodic or releases
        else "there is no usable periodic test and no usable release with one NES"
    )
    return f"No best clearance can be reported: {reason}. " + (
        f"The records give {found}." if found else "The records give no parameter either."
    )


def _disagreements(periodic: Sequence[PeriodicVerdict], checks: Sequence[Row]) -> str:
    """Where prediction and measurement exclude one another, and what may be why."""
    apart = [f"{v.level} ({v.sentence})" for v in periodic if v.agrees is False]
    if not apart:
        return ""
    return f" Prediction and measurement disagree at {'; '.join(apart)}; {likely_causes(checks)}."


_EDGE = {
    "at most": "the smallest that was tried or as good as it",
    "at least": "the largest that was tried or as good as it",
    "open": "no better than both ends of what was tried",
}


def _least(verdict: PeriodicVerdict) -> str:
    """The end of the sentence on the lowest amplitude."""
    if not verdict.lowest_bound:
        return f"a clearance of {verdict.lowest} mm ({verdict.lowest_within})."
    edge = {"at most": "smallest", "at least": "largest"}[verdict.lowest_bound]
    return (
        f"the {edge} clearance that was tried, {verdict.lowest} mm: the best one lies "
        f"{verdict.lowest_within} and may be {edge.removesuffix('st')}r than any tried."
    )


def _predicted(row: Row) -> str:
    if not row.get("exact_mm"):
        return ""
    values = (float(row[key]) for key in ("exact_mm", "predicted_low_mm", "predicted_high_mm"))
    return with_interval(*values)
