"""The verdict: which clearance was best, which is predicted, and how sure either is, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vinesexp.report.numbers import millimetres

Row = Mapping[str, str]


@dataclass(frozen=True)
class Verdict:
    """One sentence with its number in front.

    Attributes
    ----------
    level : what it is about: ``G = 0.25 mm``.
    best : measured best clearance with its bracket.
    predicted : exact prediction with its interval, and the published one.
    agreement : whether the two brackets meet.
    agrees : the same as a truth value; None where one of them is missing.
    """

    level: str
    best: str
    predicted: str
    agreement: str
    agrees: bool | None


def verdicts(clearances: Sequence[Row]) -> list[Verdict]:
    """One verdict for each level of periodic excitation and each level of release.

    Examples
    --------
    >>> row = {"test": "periodic", "level": "G = 0.25 mm", "measured_mm": "34",
    ...        "measured_low_mm": "33", "measured_high_mm": "35", "published_mm": "33.97",
    ...        "exact_mm": "33.92", "predicted_low_mm": "33.5", "predicted_high_mm": "34.3",
    ...        "error_percent": "-0.2"}
    >>> verdicts([row])[0].agreement
    'the prediction lies within the measured bracket'
    """
    return [_verdict(row) for row in clearances]


def _verdict(row: Row) -> Verdict:
    measured, exact = row.get("measured_mm"), row.get("exact_mm")
    best = "not measured"
    if measured:
        low, high = (millimetres(row[f"measured_{end}_mm"]) for end in ("low", "high"))
        best = f"{millimetres(measured)} mm (between {low} and {high})"
    predicted = "not known"
    if exact:
        low, high = (millimetres(row[f"predicted_{end}_mm"]) for end in ("low", "high"))
        predicted = (
            f"{millimetres(exact)} mm ({low} to {high}, 95 %); "
            f"published formula {millimetres(row['published_mm'])} mm"
        )
    agreement, agrees = _agreement(row)
    return Verdict(row["level"], best, predicted, agreement, agrees)


def _agreement(row: Row) -> tuple[str, bool | None]:
    if not row.get("measured_mm") or not row.get("exact_mm"):
        return "nothing to compare", None
    low, high = float(row["measured_low_mm"]), float(row["measured_high_mm"])
    exact = float(row["exact_mm"])
    reach = float(row["predicted_low_mm"]), float(row["predicted_high_mm"])
    if low <= exact <= high:
        return "the prediction lies within the measured bracket", True
    if reach[0] <= high and reach[1] >= low:
        return "the interval of the prediction meets the measured bracket", True
    apart = 100.0 * (exact / float(row["measured_mm"]) - 1.0)
    return f"the prediction lies outside the measured bracket ({apart:+.0f} %)", False
