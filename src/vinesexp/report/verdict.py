"""The verdict: which clearance was best, which is predicted, and how sure either is, in words.

It says no more than the records bear: a best clearance at the edge of what was tried is a bound,
and a prediction is compared with a bound only where it contradicts it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vinesexp.clearance.comparison import END
from vinesexp.clearance.curves import predicted_lowest
from vinesexp.clearance.levels import Periodic
from vinesexp.clearance.predicted import IdentifiedRig, at_level
from vinesexp.figures.numbers import millimetres, with_interval
from vinesexp.records.missing_cells import MISSING
from vinesexp.records.tables import number
from vinesexp.report.agreement import agreement, within
from vinesexp.report.caveats import branch_note, left_early, likely_causes

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
    end_within : between which tests two impacts per cycle cease to be permanent.
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
        if agrees is False and (why := left_early(level, end, replay)):
            sentence, agrees = f"{sentence}; {why}", None
        verdicts.append(
            PeriodicVerdict(
                level=level.name,
                lowest=millimetres(row["measured_mm"]) if row.get("measured_mm") else "",
                lowest_within=within(row),
                end_within=within(end),
                exact=_predicted(row),
                published=millimetres(row["published_mm"]) if row.get("published_mm") else "",
                exact_lowest=millimetres(f"{1e3 * least}") if least is not None else "",
                sentence=sentence,
                agrees=agrees,
                lowest_bound=row.get("bound", ""),
                branch=branch_note(level, replay),
            )
        )
    return verdicts


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
            exact=_predicted(row) or "–",
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
            text += f" In these tests permanent two impacts per cycle end {last.end_within}"
            text += f"; b_c is predicted at {last.exact} mm." if last.exact else "."
        elif last.exact:
            text += f" b_c is predicted at {last.exact} mm."
        return text + (_disagreements(periodic, checks) or _agreement(periodic))
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
    missing = [row["detail"] for row in checks if row["check"] == MISSING]
    reason = (
        missing[0]
        if missing
        else "too few clearances were tried to find the best one"
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


def _agreement(periodic: Sequence[PeriodicVerdict]) -> str:
    """That prediction and measurement agree, and where they could be compared."""
    agreeing = [verdict.level for verdict in periodic if verdict.agrees]
    if not agreeing:
        return ""
    if len(agreeing) < len(periodic):
        where = ", ".join(agreeing)
        return f" Prediction and measurement agree at {where}; elsewhere the tests do not say."
    every = " at every base amplitude" if len(periodic) > 1 else ""
    return f" Prediction and measurement agree{every}."


def release_lines(releases: Sequence[ReleaseVerdict]) -> list[dict[str, str]]:
    """One line a release height: b_t, and the fastest clearance that was bracketed to each level.

    Examples
    --------
    >>> found = ReleaseVerdict("20 mm to 3 mm", "30.0", "between 24 and 33.1 mm", "33.3", "27.3")
    >>> release_lines([found])[0]["fastest"]
    'to 3 mm with 30.0 mm'
    """
    heights: dict[str, list[ReleaseVerdict]] = {}
    for verdict in releases:
        heights.setdefault(verdict.level.partition(" to ")[0], []).append(verdict)
    lines = []
    for height, own in heights.items():
        fastest = [
            f"to {verdict.level.partition(' to ')[2]} with {verdict.best} mm"
            for verdict in own
            if verdict.within and not verdict.bound
        ]
        lines.append(
            {
                "height": height,
                "exact": own[0].exact,
                "published": own[0].published,
                "fastest": ", ".join(fastest),
            }
        )
    return lines


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
    exact = float(row["exact_mm"])
    low, high = (number(row.get(f"predicted_{end}_mm", "")) for end in ("low", "high"))
    return with_interval(exact, exact if low is None else low, exact if high is None else high)
