"""The list of all records, one line each: what the page filters and searches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.figures.numbers import significant
from vinesexp.records.campaign import Campaign
from vinesexp.theory.manifold import C_1, C_2, amplitude, upper_branch

Row = Mapping[str, str]

#: Outcomes of checks, worst first; a record's is its worst.
_WORST = ("refused", "excluded", "warning", "ok")


def list_of_records(
    campaign: Campaign, *, regimes: Mapping[str, Row], checks: Mapping[str, Sequence[Row]]
) -> list[list[Any]]:
    """Id, test, clearance, base amplitude, regime, impacts per cycle, mean and largest amplitude,
    outcome and the checks that warn; one list a record, in the order of records.csv."""
    found = []
    for record in campaign.records:
        row = regimes.get(record.id, {})
        own = checks.get(record.id, ())
        odd = [check for check in own if check["outcome"] != "ok"]
        outcome = min((c["outcome"] for c in odd), key=_WORST.index, default="ok")
        found.append(
            [
                record.id,
                record.test,
                " + ".join(f"{1e3 * b:g}" for b in record.clearance),
                f"{1e3 * record.base_amplitude:g}" if record.base_amplitude else "",
                row.get("regime", ""),
                _number(row.get("impacts_per_cycle")),
                _number(row.get("amplitude_mean_m"), 1e3),
                _number(row.get("amplitude_max_m"), 1e3),
                outcome,
                ", ".join(dict.fromkeys(check["check"] for check in odd)),
            ]
        )
    return found


def _number(text: str | None, factor: float = 1.0) -> str:
    return significant(text, factor=factor) if text else ""


def manifold_curve(rig: IdentifiedRig) -> dict[str, Any] | None:
    """The slow invariant manifold of the identified restitution, in clearances."""
    if "r" not in rig.values:
        return None
    r = rig.values["r"].value
    first, second = float(C_1(r)), float(C_2())
    highest = max(float(upper_branch(1.5, r=r)), 1.2 * second)
    parts = [
        (name, np.linspace(low, high, 120))
        for name, low, high in (
            ("unstable", 1e-3, first),
            ("stable", first, second),
            ("unstable", second, highest),
        )
    ]
    return {
        "r": r,
        "T1": [first, float(amplitude(first, r=r))],
        "T2": [second, float(amplitude(second, r=r))],
        "parts": [
            {
                "kind": name,
                "C": np.round(C, 4).tolist(),
                "A": np.round(amplitude(C, r=r), 5).tolist(),
            }
            for name, C in parts
        ],
    }
