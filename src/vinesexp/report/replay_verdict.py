"""The replay in words and as a table: does the identified rig move as the records do?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vinesexp.clearance.optimum import PERMANENT
from vinesexp.figures.numbers import significant

Row = Mapping[str, str]

_SHOWN = {
    "amplitude": ("amplitude (mm)", 1e3),
    "largest amplitude": ("largest amplitude (mm)", 1e3),
    "decay time": ("decay time (s)", 1.0),
}


@dataclass(frozen=True)
class ReplayVerdict:
    """What the replay says of the identified rig.

    Attributes
    ----------
    sentence : for the section.
    warning : for the verdict; empty where every record is replayed.
    rows : one a record and number, as shown.
    """

    sentence: str
    warning: str
    rows: tuple[dict[str, str], ...]


def replay_verdict(rows: Sequence[Row], checks: Sequence[Row]) -> ReplayVerdict | None:
    """From the rows of replay.csv and checks.csv; None where nothing was replayed.

    Examples
    --------
    >>> row = {"record": "a", "quantity": "amplitude", "measured": "0.005", "replayed": "0.00501",
    ...        "low": "0.005", "high": "0.00502", "deviation": "-0.002", "outcome": "ok",
    ...        "starts": ""}
    >>> replay_verdict([row], []).sentence
    'The identified rig moves as the record does: mean amplitude of other motions within 0.2 %.'
    """
    if not rows:
        return None
    records = list(dict.fromkeys(row["record"] for row in rows))
    failed = list(dict.fromkeys(row["record"] for row in checks if row["check"] == "replay"))
    # Those that differ come first: of many records only the first rows are shown.
    shown = tuple(_shown(row) for row in sorted(rows, key=lambda row: row["outcome"] != "differs"))
    if failed:
        warning = (
            f"The identified rig does not move as {_count(len(failed), len(records))} "
            f"({', '.join(failed[:5])}{', ...' if len(failed) > 5 else ''}): predictions for such "
            "tests may not hold."
        )
        return ReplayVerdict(warning, warning, shown)
    whose = "the record does" if len(records) == 1 else f"all {len(records)} records do"
    return ReplayVerdict(f"The identified rig moves as {whose}: {_within(rows)}.", "", shown)


def _count(n: int, total: int) -> str:
    return "its only record" if total == 1 else f"{n} of {total} records"


def _within(rows: Sequence[Row]) -> str:
    """How far the worst of each quantity is off."""
    steady = {
        row["record"]
        for row in rows
        if row["quantity"] == "regime" and row["measured"] in PERMANENT
    }
    kinds = (
        ("amplitude", True, "amplitude of permanent two impacts per cycle"),
        ("amplitude", False, "mean amplitude of other motions"),
        ("decay time", False, "decay time"),
        ("decay time", True, "decay time"),
    )
    parts: dict[str, float] = {}
    for row in rows:
        if not row["deviation"]:
            continue
        for quantity, permanent, words in kinds:
            if (row["quantity"], row["record"] in steady) == (quantity, permanent):
                parts[words] = max(parts.get(words, 0.0), abs(float(row["deviation"])))
    shown = [f"{words} within {100.0 * off:.1g} %" for words, off in parts.items()]
    return ", ".join(shown) or "as far as they can be compared"


def _shown(row: Row) -> dict[str, str]:
    """One row as text, in the units of the report."""
    name, factor = _SHOWN.get(row["quantity"], (row["quantity"], 1.0))
    if row["quantity"] == "regime":
        return {
            "record": row["record"],
            "quantity": name,
            "measured": row["measured"] or "–",
            "replayed": row["starts"] or row["replayed"],
            "deviation": "",
            "outcome": row["outcome"],
        }
    low, high = (significant(row[end], factor=factor) for end in ("low", "high"))
    replayed = significant(row["replayed"], factor=factor)
    return {
        "record": row["record"],
        "quantity": name,
        "measured": significant(row["measured"], factor=factor),
        "replayed": replayed if low == high else f"{replayed} ({low} to {high})",
        "deviation": f"{100.0 * float(row['deviation']):+.1f} %" if row["deviation"] else "–",
        "outcome": row["outcome"],
    }
