"""What was measured: for each kind of test, how many records and over which range."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vinesexp.records.campaign import Campaign

Row = Mapping[str, str]

#: Tests in the order of the page, each with its heading.
TESTS = {
    "ringdown": "Ring-downs",
    "sweep": "Sweeps",
    "periodic": "Periodic tests",
    "transient": "Releases",
    "drop": "Drop tests",
}

#: Settings of the tests that get a column where any test has them.
SETTINGS = {
    "clearances": "clearance (mm)",
    "base": "base amplitude (mm)",
    "frequency": "frequency (Hz)",
    "added": "added mass (g)",
    "release": "release (mm)",
}


def tests_table(campaign: Campaign, checks: Sequence[Row]) -> list[dict[str, Any]]:
    """One row a kind of test; `unused` counts its records that were refused or excluded."""
    rows = []
    unused = {row["record"] for row in checks if row["outcome"] in ("refused", "excluded")}
    for test, heading in TESTS.items():
        records = [r for r in campaign.records if r.test == test]
        if records:
            rows.append(
                {
                    "test": test,
                    "heading": heading,
                    "count": len(records),
                    "unused": sum(record.id in unused for record in records),
                    "clearances": _range([1e3 * b for r in records for b in r.clearance]),
                    "base": _range([1e3 * r.base_amplitude for r in records if r.base_amplitude]),
                    "frequency": _range([f for r in records for f in r.frequency or ()]),
                    "added": _range([1e3 * r.added_mass for r in records if r.added_mass]),
                    "release": _range([1e3 * r.release for r in records if r.release]),
                }
            )
    return rows


def settings_columns(tests: Sequence[Mapping[str, Any]]) -> list[dict[str, str]]:
    """Columns of the settings that any of the tests has."""
    return [
        {"key": key, "name": name}
        for key, name in SETTINGS.items()
        if any(row[key] != "–" for row in tests)
    ]


def _range(values: Sequence[float]) -> str:
    if not values:
        return "–"
    low, high = min(values), max(values)
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"
