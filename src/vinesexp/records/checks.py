"""What was found in the data: one row a finding, for checks.csv and the report."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Literal, get_args

from vinesexp.errors import CampaignError

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


_HEADER = [field.name for field in fields(Check)]


def write_checks(path: Path, checks: Iterable[Check]) -> None:
    """Write checks as CSV with a header line, also when there are none."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(_HEADER)
        writer.writerows(astuple(check) for check in checks)


def read_checks(path: Path) -> list[Check]:
    """Read what `write_checks` wrote; CampaignError for any other file."""
    with Path(path).open(encoding="utf-8", newline="") as stream:
        rows = list(csv.reader(stream))
    if not rows or rows[0] != _HEADER:
        raise CampaignError(f"expected the columns {','.join(_HEADER)}", file=path, where="line 1")
    return [_check(row, path, line) for line, row in enumerate(rows[1:], start=2)]


def _check(row: list[str], path: Path, line: int) -> Check:
    if len(row) != len(_HEADER) or row[2] not in OUTCOMES:
        raise CampaignError(
            f"found {row}, expected record, check, outcome ({', '.join(OUTCOMES)}), detail",
            file=path,
            where=f"line {line}",
        )
    return Check(row[0], row[1], row[2], row[3])  # type: ignore[arg-type]
