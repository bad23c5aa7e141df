"""What the checks found, in the parts of the page: problems, remarks, limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vinesexp.report.summaries import grouped

Row = Mapping[str, str]

#: Outcomes of checks, worst first.
SEVERITY = {"refused": 0, "excluded": 1, "warning": 2}


def problem_lists(checks: Sequence[Row]) -> dict[str, Any]:
    """Rows of checks.csv sorted into the lists that the page shows.

    Returns
    -------
    dict
        ``problems`` of records, worst first; ``limits``, problems of no single record; ``notes``,
        what is worth knowing and no problem; ``refused`` and ``excluded``, how many records.

    Examples
    --------
    >>> row = {"record": "a", "outcome": "refused", "check": "time", "detail": "stands"}
    >>> found = problem_lists([row, row | {"record": "", "outcome": "warning"}])
    >>> found["refused"], len(found["problems"]), len(found["limits"]), found["notes"]
    (1, 1, 1, [])
    """
    problems = [row for row in checks if row["outcome"] != "ok"]
    found = [row for row in checks if row["outcome"] == "ok"]
    of_records = [row for row in problems if row["record"]]
    return {
        "problems": grouped(sorted(of_records, key=lambda row: SEVERITY[row["outcome"]])),
        "limits": [row for row in problems if not row["record"]],
        "notes": [row for row in found if row["check"] != "ingest"],
        "refused": _records(problems, "refused"),
        "excluded": _records(problems, "excluded"),
    }


def _records(problems: Sequence[Row], outcome: str) -> int:
    return len({row["record"] for row in problems if row["outcome"] == outcome})
