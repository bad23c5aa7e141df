"""Measured optimal clearances beside the predicted ones: clearances.csv.

One row a level: a base amplitude of periodic tests, or a level that a release decays to.
Predicted from the `combined` values of identified.csv, by the published formulas and exactly.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path

from vinesexp.clearance.optimum import Optimum, Tested, bracketed_minimum, kinked_valley
from vinesexp.errors import AnalysisError
from vinesexp.records.campaign import Campaign, Known, Record
from vinesexp.records.checks import Check
from vinesexp.units import Quantity

Rows = Sequence[Mapping[str, str]]

#: Column of regimes.csv that says when a release has decayed to a level.
TIME_TO = re.compile(r"time_to_([\d.]+)mm_s")


@dataclass(frozen=True)
class Comparison:
    """One row of clearances.csv, mm; None where it cannot be known.

    `error_percent` is that of the exact prediction against the measured optimum.
    """

    test: str
    level: str
    measured_mm: float | None = None
    measured_low_mm: float | None = None
    measured_high_mm: float | None = None
    published_mm: float | None = None
    exact_mm: float | None = None
    predicted_low_mm: float | None = None
    predicted_high_mm: float | None = None
    error_percent: float | None = None


def identified_values(identified: Rows, known: Known) -> dict[str, Quantity]:
    """The combined M, c1, k1, r and the weighed ball m, with standard errors; SI."""
    values = {
        row["parameter"]: Quantity(float(row["value"]), float(row["std_error"]))
        for row in identified
        if row["method"] == "combined" and row["parameter"] in ("M", "c1", "k1", "r")
    }
    if known.nes_mass:
        values["m"] = known.nes_mass[0]
    return values


def periodic_levels(campaign: Campaign, regimes: Rows) -> dict[float, list[Tested]]:
    """Tests of one NES by base amplitude, m: mean amplitude over clearance."""
    levels: dict[float, list[Tested]] = {}
    for record, row in _usable(campaign, regimes, "periodic"):
        if record.base_amplitude is not None and row.get("amplitude_mean_m"):
            tested = Tested(
                record.clearance[0], float(row["amplitude_mean_m"]), row["regime"], record.id
            )
            levels.setdefault(record.base_amplitude, []).append(tested)
    return dict(sorted(levels.items()))


def transient_levels(campaign: Campaign, regimes: Rows) -> dict[tuple[float, float], list[Tested]]:
    """Releases of one NES by (release m, level m): time to the level over clearance, s."""
    levels: dict[tuple[float, float], list[Tested]] = {}
    for record, row in _usable(campaign, regimes, "transient"):
        for column, text in row.items():
            match = TIME_TO.fullmatch(column)
            if match and text and record.release:
                key = (record.release, float(match[1]) * 1e-3)
                tested = Tested(record.clearance[0], float(text), row["regime"], record.id)
                levels.setdefault(key, []).append(tested)
    return {key: levels[key] for key in sorted(levels, key=lambda k: (k[0], -k[1]))}


def compare(
    campaign: Campaign, identified: Rows, regimes: Rows
) -> tuple[list[Comparison], list[Check]]:
    """Measured against predicted, level by level, and what cannot be compared and why.

    Parameters
    ----------
    campaign : Campaign
    identified, regimes : sequences of mappings
        Rows of identified.csv and regimes.csv.
    """
    values = identified_values(identified, campaign.known)
    missing = [name for name in ("M", "c1", "k1", "r", "m") if name not in values]
    rows, checks = [], []
    periodic, transient = periodic_levels(campaign, regimes), transient_levels(campaign, regimes)
    for G, tests in periodic.items():
        row, told = _row("periodic", f"G = {1e3 * G:g} mm", tests, values, G=G)
        rows.append(row)
        checks += told
    for (x0, level), tests in transient.items():
        name = f"{1e3 * x0:g} mm to {1e3 * level:g} mm"
        row, told = _row("transient", name, tests, values, x0=x0)
        rows.append(row)
        checks += told
    if (periodic or transient) and missing:
        names = ", ".join(missing)
        checks.append(Check("", "prediction", "warning", f"not identified: {names}"))
    if not periodic and not transient:
        detail = "no periodic or transient test with one NES: no measured optimal clearance"
        checks.append(Check("", "optimal clearance", "warning", detail))
    return rows, checks


def _row(
    test: str, level: str, tests: Sequence[Tested], values: Mapping[str, Quantity], **drive: float
) -> tuple[Comparison, list[Check]]:
    optimum, checks = _measured(test, level, tests)
    predicted = _predicted(values, **drive)
    error = None
    if optimum and predicted["exact_mm"] is not None:
        error = 100.0 * (predicted["exact_mm"] / (1e3 * optimum.clearance) - 1.0)
    measured = {
        "measured_mm": 1e3 * optimum.clearance if optimum else None,
        "measured_low_mm": 1e3 * optimum.low if optimum else None,
        "measured_high_mm": 1e3 * optimum.high if optimum else None,
    }
    return Comparison(test, level, **measured, **predicted, error_percent=error), checks


def _measured(test: str, level: str, tests: Sequence[Tested]) -> tuple[Optimum | None, list[Check]]:
    find = kinked_valley if test == "periodic" else bracketed_minimum
    try:
        optimum = find(tests)
    except AnalysisError as error:
        return None, [Check("", "optimal clearance", "warning", f"{test}, {level}: {error}")]
    if optimum.at_edge:
        detail = (
            f"{test}, {level}: best at {1e3 * optimum.clearance:g} mm, the end of what was "
            "tested; the optimum may lie beyond"
        )
        return optimum, [Check("", "optimal clearance", "warning", detail)]
    return optimum, []


def _predicted(
    values: Mapping[str, Quantity], *, G: float | None = None, x0: float | None = None
) -> dict[str, float | None]:
    from vinesexp.theory.clearance import predict_periodic, predict_transient

    names = ("published_mm", "exact_mm", "predicted_low_mm", "predicted_high_mm")
    needed = ("M", "c1", "k1", "r", "m") if G is not None else ("r",)
    if any(name not in values for name in needed):
        return dict.fromkeys(names)
    try:
        if G is not None:
            found = predict_periodic(G=G, values=values)
        else:
            found = predict_transient(x0=x0 or 0.0, values=values)
    except AnalysisError:
        return dict.fromkeys(names)
    return dict(
        zip(
            names,
            (1e3 * found.published, 1e3 * found.exact, 1e3 * found.low, 1e3 * found.high),
            strict=True,
        )
    )


def _usable(
    campaign: Campaign, regimes: Rows, test: str
) -> Iterable[tuple[Record, Mapping[str, str]]]:
    """Records of one test with exactly one NES, with their rows of regimes.csv."""
    by_id = {record.id: record for record in campaign.records}
    for row in regimes:
        record = by_id.get(row["record"])
        if record and record.test == test and len(record.clearance) == 1 and not record.exclude:
            yield record, row


def write_clearances(path: Path, rows: Sequence[Comparison]) -> None:
    """clearances.csv: empty cells where a value cannot be known."""
    with Path(path).open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([field.name for field in fields(Comparison)])
        for row in rows:
            writer.writerow(
                "" if v is None else f"{v:.6g}" if isinstance(v, float) else v for v in astuple(row)
            )
