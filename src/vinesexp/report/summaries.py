"""Long tables made short: a campaign of a thousand records still has a report one can read."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Row = Mapping[str, str]

#: Rows of a table of records that are shown; the others are on the page of all records.
MOST_ROWS = 100
#: Ids in one cell, and problems that are listed one by one.
_MOST_IDS = 24
_MOST_PROBLEMS = 100
_EXAMPLES = 5


@dataclass(frozen=True)
class Problem:
    """Rows of checks.csv that say one thing: of one record, or of many where there are many.

    Attributes
    ----------
    outcome, check, detail : as in the table; of many, the detail of the first.
    records : ids, the first few.
    more : how many further ones.
    """

    outcome: str
    check: str
    detail: str
    records: tuple[str, ...]
    more: int


def grouped(problems: Sequence[Row]) -> list[Problem]:
    """Problems one by one, or by outcome and check where there are too many to read.

    Examples
    --------
    >>> row = {"record": "a", "outcome": "warning", "check": "gain", "detail": "3 %"}
    >>> [(p.records, p.more) for p in grouped([row])]
    [(('a',), 0)]
    >>> [(p.records, p.more) for p in grouped([row | {"record": f"r{i}"} for i in range(200)])]
    [(('r0', 'r1', 'r2', 'r3', 'r4'), 195)]
    """
    if len(problems) <= _MOST_PROBLEMS:
        return [
            Problem(row["outcome"], row["check"], row["detail"], (row["record"],), 0)
            for row in problems
        ]
    kinds: dict[tuple[str, str], list[Row]] = {}
    for row in problems:
        kinds.setdefault((row["outcome"], row["check"]), []).append(row)
    found = []
    for (outcome, check), rows in kinds.items():
        ids = list(dict.fromkeys(row["record"] for row in rows))
        detail = rows[0]["detail"] if len(rows) == 1 else f"such as {rows[0]['detail']}"
        shown = tuple(ids[:_EXAMPLES])
        found.append(Problem(outcome, check, detail, shown, len(ids) - len(shown)))
    return found


def ids_of(cell: str) -> tuple[list[str], int]:
    """Ids of a cell of identified.csv as far as they are shown, and how many there are besides.

    Examples
    --------
    >>> ids_of("a;b")
    (['a', 'b'], 0)
    """
    ids = [id for id in cell.split(";") if id]
    return ids[:_MOST_IDS], max(len(ids) - _MOST_IDS, 0)


def sections_of_tests(
    headings: Mapping[str, str],
    tests: Sequence[Mapping[str, Any]],
    figures: Sequence[Mapping[str, Any]],
    regimes: Mapping[str, Any],
) -> list[dict[str, Any]]:
    """The parts of the page on kinds of tests; one without anything to show says why, or is none.

    Parameters
    ----------
    headings : mapping
        Test to its heading.
    tests : sequence of mappings
        With `test`, `count` and `unused`.
    figures : sequence of mappings
        Those that stand nowhere else.
    regimes : mapping
        Test to its table.
    """
    found = []
    for row in tests:
        test = row["test"]
        own = [figure for figure in figures if figure["section"] == test]
        said = ""
        if row["unused"] == row["count"]:
            said = f"None of the {row['count']} records was used"
            said = "The only record was not used" if row["count"] == 1 else said
        if own or test in regimes or said:
            found.append({"test": test, "heading": headings[test], "figures": own, "said": said})
    return found


def files_beside(results: Path, known: Collection[str]) -> list[str]:
    """Tables in the results folder, by name."""
    return sorted(path.name for path in results.glob("*.csv") if path.stem in known)
