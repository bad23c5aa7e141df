"""Measured optimal clearances beside the predicted ones: clearances.csv.

Two rows a base amplitude: where the amplitude was lowest, and between which clearances permanent
impacts end, which is what b_c predicts. One row a release and amplitude to be reached, all of
them beside the same b_t: there is no single best clearance for a release (docs/theory.md, 29).
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, fields
from functools import partial
from pathlib import Path

from vinesexp.clearance.levels import Rows, Tested, periodic_levels, release_levels
from vinesexp.clearance.optimum import Optimum, end_of_permanent, fastest, lowest_amplitude
from vinesexp.clearance.predicted import (
    IdentifiedRig,
    Predicted,
    identified_rig,
    predicted_b_c,
    predicted_b_t,
)
from vinesexp.errors import AnalysisError
from vinesexp.records.campaign import Campaign
from vinesexp.records.checks import Check

#: What follows the name of a base amplitude in the row of the kink.
END = ", end of two impacts per cycle"

_HOW_TO_KNOW = {
    "M": "ring-downs with added masses, impacts, or `known: mass`",
    "c1": "M and a ring-down",
    "k1": "M and a ring-down",
    "r": "a drop test, or impacts with a known clearance",
    "m": "`known: nes_mass` in campaign.yaml",
}


@dataclass(frozen=True)
class Comparison:
    """One row of clearances.csv, mm; None where it cannot be known.

    `error_percent` is that of the exact prediction against the measured clearance.
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


def compare(
    campaign: Campaign, identified: Rows, regimes: Rows
) -> tuple[list[Comparison], list[Check]]:
    """Measured against predicted, level by level, and what cannot be compared and why.

    Parameters
    ----------
    campaign : Campaign
    identified, regimes : sequences of mappings
        Rows of identified.csv and regimes.csv.

    Returns
    -------
    rows, checks
        A level that cannot be measured keeps its row, with empty cells, and a check says why.
    """
    rig = identified_rig(identified, campaign.known)
    rows: list[Comparison] = []
    checks: list[Check] = []
    for level in periodic_levels(campaign, regimes):
        predicted = _told(
            checks, level.name, partial(predicted_b_c, rig, G=level.G, frequency=level.frequency)
        )
        for name, find in (
            (level.name, lowest_amplitude),
            (level.name + END, end_of_permanent),
        ):
            optimum = _measured(checks, "periodic", name, level.tests, find)
            rows.append(_row("periodic", name, optimum, predicted))
    # Without f0 the time between two samples of the amplitude is unknown: no ties.
    resolution = 0.5 / rig.f0.value if rig.f0 else 0.0
    for release in release_levels(campaign, regimes):
        predicted = _told(checks, release.name, partial(predicted_b_t, rig, x0=release.x0))
        optimum = _measured(
            *(checks, "transient", release.name, release.tests),
            partial(fastest, resolution=resolution),
        )
        rows.append(_row("transient", release.name, optimum, predicted))
    return rows, [*_absent(campaign, rig, rows), *dict.fromkeys(checks)]


def _told(checks: list[Check], level: str, predict: Callable[[], Predicted]) -> Predicted | None:
    """The prediction; where a value is missing `_absent` says so once for all levels."""
    try:
        return predict()
    except AnalysisError as error:
        if "without" not in str(error):
            checks.append(Check("", "prediction", "warning", f"{level}: {error}"))
        return None


def _measured(
    checks: list[Check],
    test: str,
    level: str,
    tests: Sequence[Tested],
    find: Callable[[Sequence[Tested]], Optimum],
) -> Optimum | None:
    try:
        optimum = find(tests)
    except AnalysisError as error:
        checks.append(Check("", "optimal clearance", "warning", f"{test}, {level}: {error}"))
        return None
    if optimum.at_edge:
        tried = [1e3 * item.clearance for item in tests]
        at = f"best at {1e3 * optimum.clearance:.4g} mm"
        if optimum.clearance not in (tests[0].clearance, tests[-1].clearance):
            at += ", and no worse"
        detail = (
            f"{test}, {level}: {at} at the end of what was tried ({tried[0]:.4g} to "
            f"{tried[-1]:.4g} mm); the optimum may lie beyond"
        )
        checks.append(Check("", "optimal clearance", "warning", detail))
    return optimum


def _row(test: str, level: str, optimum: Optimum | None, predicted: Predicted | None) -> Comparison:
    measured = (optimum.clearance, optimum.low, optimum.high) if optimum else (None,) * 3
    values = (
        (predicted.published, predicted.exact, predicted.low, predicted.high)
        if predicted
        else (None,) * 4
    )
    error = None
    if optimum and predicted:
        error = 100.0 * (predicted.exact / optimum.clearance - 1.0)
    lengths = [None if length is None else 1e3 * length for length in (*measured, *values)]
    return Comparison(test, level, *[*lengths, error])


def _absent(campaign: Campaign, rig: IdentifiedRig, rows: Sequence[Comparison]) -> list[Check]:
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
    needed = {
        "periodic": [n for n in rig.missing if any(row.test == "periodic" for row in rows)],
        "transient": [
            n for n in rig.missing if n == "r" and any(row.test == "transient" for row in rows)
        ],
    }
    for test, names in needed.items():
        if names:
            symbol = {"periodic": "b_c", "transient": "b_t"}[test]
            how = "; ".join(f"{name} needs {_HOW_TO_KNOW[name]}" for name in names)
            checks.append(
                Check("", "prediction", "warning", f"no {symbol} without {', '.join(names)}: {how}")
            )
    return checks


def write_clearances(path: Path, rows: Sequence[Comparison]) -> None:
    """clearances.csv: empty cells where a value cannot be known."""
    with Path(path).open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([field.name for field in fields(Comparison)])
        for row in rows:
            writer.writerow(
                "" if v is None else f"{v:.6g}" if isinstance(v, float) else v for v in astuple(row)
            )
