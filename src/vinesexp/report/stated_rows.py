"""inputs.csv as rows of the page: what was stated, what the records say, the verdict in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vinesexp.figures.collect.stated_inputs import named
from vinesexp.figures.numbers import difference, plus_minus

Row = Mapping[str, str]

_WORDS = {
    "ok": "agrees",
    "off": "contradicted: the analysis takes what was found",
    "not tested": "not tested: the records add nothing to what was stated",
}


def stated_rows(rows: Sequence[Row]) -> list[dict[str, str]]:
    """One row an input, in the order of `rows`.

    Examples
    --------
    >>> row = {"item": "clearance", "record": "b34", "unit": "mm", "stated": "34",
    ...        "stated_error": "0.05", "found": "34.4", "found_error": "0.02", "verdict": "off"}
    >>> [shown] = stated_rows([row])
    >>> shown["stated"], shown["found"], shown["away"], shown["errors"]
    ('34.000 ± 0.098 mm', '34.400 ± 0.039 mm', '+0.400 ± 0.039 mm', '+8.0')
    """
    return [
        {
            "name": named(row),
            "stated": _with_unit(row, "stated"),
            "found": _with_unit(row, "found"),
            "away": difference(_away(row), float(row["found_error"] or 0.0), row["unit"]),
            "errors": _in_errors(row),
            "kind": {"ok": "agree", "off": "differ"}.get(row["verdict"], "open"),
            "verdict": _WORDS[row["verdict"]],
        }
        for row in rows
    ]


def stated_sentence(rows: Sequence[Row]) -> str:
    """How many inputs agree, are contradicted, are not tested."""
    counts = [sum(row["verdict"] == verdict for row in rows) for verdict in ("off", "ok")]
    off, agree = counts
    return (
        f"Of {len(rows)} values that campaign.yaml and records.csv state, the records contradict "
        f"{off or 'none'}, agree with {agree}, and do not test {len(rows) - off - agree}."
    )


def _away(row: Row) -> float:
    return float(row["found"]) - float(row["stated"])


def _in_errors(row: Row) -> str:
    size = float(row["stated_error"] or 0.0)
    return f"{_away(row) / size:+.1f}" if size else "–"


def _with_unit(row: Row, name: str) -> str:
    return plus_minus(float(row[name]), float(row[f"{name}_error"] or 0.0), row["unit"])
