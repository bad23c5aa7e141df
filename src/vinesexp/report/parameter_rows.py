"""The identified values as rows of the page: combined, and by every method."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from vinesexp.figures.numbers import plus_minus, plus_minus_brief
from vinesexp.report.summaries import ids_of

Row = Mapping[str, str]

#: Parameters in the order of the table, each with what it is.
PARAMETERS = {
    "f0": "natural frequency",
    "zeta": "damping ratio",
    "M": "mass of the oscillator",
    "c1": "damping",
    "k1": "stiffness",
    "r": "restitution",
}

#: How each parameter is written, as markup.
SYMBOLS = {"f0": "f<sub>0</sub>", "zeta": "ζ", "c1": "c<sub>1</sub>", "k1": "k<sub>1</sub>"}


#: What is asked first of a rig, in the line of the verdict.
_ASKED = ("M", "c1", "k1", "r")


def _combined(identified: Sequence[Row]) -> dict[str, Row]:
    return {row["parameter"]: row for row in identified if row["method"] == "combined"}


def identified_table(identified: Sequence[Row]) -> list[dict[str, Any]]:
    """Combined values in reading order, each with its methods; `brief` is for the verdict."""
    combined = _combined(identified)
    order = [*PARAMETERS, *sorted(name for name in combined if name not in PARAMETERS)]
    return [
        {
            "name": name,
            "order": (*_ASKED, *order).index(name),
            "symbol": SYMBOLS.get(name, re.sub(r"^r_(\d+)$", r"r<sub>\1</sub>", name)),
            "meaning": PARAMETERS.get(name, _meaning(name)),
            "value": _value(combined[name]),
            "brief": plus_minus_brief(*_numbers(combined[name])),
            "methods": [
                {"method": row["method"], "value": _value(row), "ids": ids_of(row["records"])}
                for row in identified
                if row["parameter"] == name and row["method"] != "combined"
            ],
        }
        for name in order
        if name in combined
    ]


def _meaning(name: str) -> str:
    """Of r_1, r_2: balls are numbered in the order of clearance_mm, in tests with several."""
    if name == "m":
        return "mass of the ball"
    if not name.startswith("r_"):
        return ""
    return f"restitution, tests with several balls: ball {name[2:]} in the order of clearance_mm"


def _value(row: Row) -> str:
    return plus_minus(*_numbers(row))


def _numbers(row: Row) -> tuple[float, float, str]:
    return float(row["value"]), float(row["std_error"] or 0.0), row["unit"]
