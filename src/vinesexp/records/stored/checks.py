"""What was found in the data: one row a finding, for checks.csv and the report."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal, get_args

from vinesexp.errors import TableError
from vinesexp.records.stored.result_columns import CHECKS
from vinesexp.records.stored.tables import read_rows, write_rows

Outcome = Literal["ok", "warning", "refused", "excluded"]
OUTCOMES: tuple[str, ...] = get_args(Outcome)


@dataclass(frozen=True)
class Check:
    """One finding about one record.

    Parameters
    ----------
    record : str
        Id of the record; empty for a finding about the whole campaign.
    check : str
        What was looked at: ``time``, ``saturated``, ``units``.
    outcome : str
        ``ok``, ``warning`` (used, but look), ``refused`` (cannot be used), ``excluded`` (by the
        user).
    detail : str
        One line: what was found, where, and what to do.

    Examples
    --------
    >>> Check("a_1", "time", "refused", "raw/a.csv, line 7: time goes backward").outcome
    'refused'
    """

    record: str
    check: str
    outcome: Outcome
    detail: str = ""


def write_checks(path: Path, checks: Iterable[Check]) -> None:
    """Write checks as CSV with a header line, also when there are none."""
    write_rows(path, CHECKS, (asdict(check) for check in checks))


def read_checks(path: Path) -> list[Check]:
    """Read what `write_checks` wrote; TableError for any other file."""
    checks = []
    for row in read_rows(path, CHECKS):
        if row["outcome"] not in OUTCOMES:
            raise TableError(
                f"found outcome '{row['outcome']}', expected {', '.join(OUTCOMES)}; "
                "run the steps before it again",
                file=path,
            )
        checks.append(Check(**{name: row[name] for name in CHECKS.names}))
    return checks


def checks_of_regime(record: str, path: Path) -> list[Check]:
    """What the impacts step found in a record, from the rows that it left: why it refused it, how
    the test began."""
    rows = json.loads(path.read_text(encoding="utf-8"))
    refused = [("impacts", "refused", rows["refused"])] if "refused" in rows else []
    return [Check(record, *found) for found in [*refused, *rows.get("checks", [])]]
