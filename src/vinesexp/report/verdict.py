"""The verdict: which clearance was best, which is predicted, and how sure either is, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vinesexp.clearance.comparison import END
from vinesexp.clearance.levels import Periodic
from vinesexp.clearance.predicted import IdentifiedRig, predicted_lowest
from vinesexp.figures.numbers import millimetres, with_interval

Row = Mapping[str, str]
_NO_ROW: Row = {}


@dataclass(frozen=True)
class PeriodicVerdict:
    """What periodic tests at one base amplitude say; texts in mm, empty where unknown.

    Attributes
    ----------
    level : ``G = 0.25 mm``.
    lowest, lowest_between : clearance of lowest amplitude, and the tried ones around it.
    end_between : tried clearances between which permanent two impacts per cycle end.
    exact, published : predicted b_c.
    exact_lowest : predicted clearance of lowest amplitude.
    sentence : how b_c and the measurement agree.
    agrees : the same as a truth value; None where one of them is missing.
    """

    level: str
    lowest: str
    lowest_between: str
    end_between: str
    exact: str
    published: str
    exact_lowest: str
    sentence: str
    agrees: bool | None


def periodic_verdicts(
    levels: Sequence[Periodic], clearances: Sequence[Row], rig: IdentifiedRig
) -> list[PeriodicVerdict]:
    """One verdict a base amplitude, from the rows of clearances.csv."""
    rows = {row["level"]: row for row in clearances if row["test"] == "periodic"}
    verdicts = []
    for level in levels:
        row, end = rows.get(level.name, _NO_ROW), rows.get(level.name + END, _NO_ROW)
        least = predicted_lowest(rig, G=level.G, frequency=level.frequency)
        sentence, agrees = agreement(row, end)
        verdicts.append(
            PeriodicVerdict(
                level=level.name,
                lowest=millimetres(row["measured_mm"]) if row.get("measured_mm") else "",
                lowest_between=_between(row),
                end_between=_between(end),
                exact=_predicted(row),
                published=millimetres(row["published_mm"]) if row.get("published_mm") else "",
                exact_lowest=f"{1e3 * least:.1f}" if least is not None else "",
                sentence=sentence,
                agrees=agrees,
            )
        )
    return verdicts


def agreement(lowest: Row, end: Row) -> tuple[str, bool | None]:
    """Whether b_c lies where it should: at the end of permanent impacts, else at the optimum.

    Examples
    --------
    >>> predicted = {"exact_mm": "33.91", "predicted_low_mm": "33.89", "predicted_high_mm": "33.94"}
    >>> end = {"measured_mm": "34.25", "measured_low_mm": "34", "measured_high_mm": "34.5"}
    >>> agreement({}, {**end, **predicted})
    ('b_c is 0.3 % below the clearances between which two impacts per cycle end', True)
    """
    row, what = (end, "two impacts per cycle end") if end.get("measured_mm") else (lowest, "")
    what = what or "amplitude is lowest"
    if not row.get("measured_mm") or not row.get("exact_mm"):
        return "nothing to compare", None
    low, high = float(row["measured_low_mm"]), float(row["measured_high_mm"])
    reach = float(row["predicted_low_mm"]), float(row["predicted_high_mm"])
    if reach[0] <= high and reach[1] >= low:
        return f"b_c lies in the gap in which {what}", True
    exact = float(row["exact_mm"])
    apart = exact / low - 1.0 if exact < low else exact / high - 1.0
    side = "below" if apart < 0.0 else "above"
    text = f"b_c is {100.0 * abs(apart):.1f} % {side} the clearances between which {what}"
    return text, abs(apart) < NEAR


#: A prediction that misses the bracket by less is told as agreeing: clearances are set to a few
#: tenths of a millimetre.
NEAR = 0.01


@dataclass(frozen=True)
class ReleaseVerdict:
    """The fastest clearance of one release to one amplitude, and b_t of that release.

    Attributes
    ----------
    level : ``20 mm to 3 mm``.
    best, between : measured, and the tried clearances that tie with it or bracket it; mm.
    published, exact : b_t, mm.
    """

    level: str
    best: str
    between: str
    published: str
    exact: str


def release_verdicts(clearances: Sequence[Row]) -> list[ReleaseVerdict]:
    """One verdict for each release and amplitude to be reached."""
    return [
        ReleaseVerdict(
            level=row["level"],
            best=millimetres(row.get("measured_mm")),
            between=_between(row),
            published=millimetres(row.get("published_mm")),
            exact=millimetres(row.get("exact_mm")),
        )
        for row in clearances
        if row["test"] == "transient"
    ]


def headline(
    periodic: Sequence[PeriodicVerdict],
    releases: Sequence[ReleaseVerdict],
    parameters: Mapping[str, str],
) -> str:
    """The campaign in one or two sentences.

    Parameters
    ----------
    periodic, releases : sequences
        Verdicts; the last periodic one with a measured optimum is told.
    parameters : mapping
        Combined values as text, by name.
    """
    measured = [verdict for verdict in periodic if verdict.lowest]
    if measured:
        last = measured[-1]
        text = (
            f"At {last.level} the mass moved least with a clearance of {last.lowest} mm "
            f"(between {last.lowest_between} mm)."
        )
        if last.end_between:
            text += f" Permanent two impacts per cycle end between {last.end_between} mm"
            text += f", where b_c is predicted at {last.exact} mm." if last.exact else "."
        elif last.exact:
            text += f" b_c is predicted at {last.exact} mm."
        return text
    reached = [verdict for verdict in releases if verdict.between]
    if reached:
        first = reached[0]
        return (
            f"From {first.level} the amplitude fell fastest with a clearance of {first.best} mm "
            f"(between {first.between} mm); other amplitudes have other fastest clearances."
        )
    found = ", ".join(
        f"{name} = {parameters[key]}"
        for key, name in (("f0", "f₀"), ("zeta", "ζ"), ("M", "M"), ("r", "r"))
        if key in parameters
    )
    reason = (
        "too few clearances were tried to tell the best one"
        if periodic or releases
        else "there is no usable periodic test and no usable release with one NES"
    )
    return f"No best clearance can be told: {reason}. " + (
        f"The records give {found}." if found else "The records give no parameter either."
    )


def _between(row: Row) -> str:
    if not row.get("measured_low_mm"):
        return ""
    low, high = (f"{float(row[f'measured_{end}_mm']):g}" for end in ("low", "high"))
    return f"{low} and {high}"


def _predicted(row: Row) -> str:
    if not row.get("exact_mm"):
        return ""
    values = (float(row[key]) for key in ("exact_mm", "predicted_low_mm", "predicted_high_mm"))
    return with_interval(*values)
