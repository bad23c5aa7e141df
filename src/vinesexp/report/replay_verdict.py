"""The replay in words and as a table: does the identified rig move as the records do?"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from vinesexp.figures.numbers import significant
from vinesexp.theory.regime_definitions import PERMANENT

Row = Mapping[str, str]

#: What a record is judged by, the first that it has: its name with the unit, units per SI unit.
_SHOWN = {
    "amplitude": ("amplitude (mm)", 1e3),
    "decay time": ("decay time (s)", 1.0),
}
_STARTS = re.compile(r"(.+): (\d+) of (\d+) starts")


@dataclass(frozen=True)
class ReplayVerdict:
    """What the replay says of the identified rig.

    Attributes
    ----------
    sentence : for the section.
    warning : for the verdict; empty where every record is replayed.
    rows : one a record, as shown; those that differ first.
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
    # Those that differ come first: of many records only the first are shown.
    shown = tuple(sorted(_records(rows), key=lambda row: not row["differs"]))
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
    shown = [f"{words} within {100.0 * off:.2g} %" for words, off in parts.items()]
    return ", ".join(shown) or "as far as they can be compared"


def _records(rows: Sequence[Row]) -> Iterator[dict[str, str]]:
    """One row a record: what it is judged by, impacts per cycle, and the regime of its replays."""
    for record in dict.fromkeys(row["record"] for row in rows):
        own = {row["quantity"]: row for row in rows if row["record"] == record}
        main = next((name for name in _SHOWN if name in own), "")
        regime = own.get("regime", {})
        yield {
            "record": record,
            **(_compared(own[main]) if main else dict.fromkeys(_COMPARED, "–")),
            "impacts": _impacts(own.get("impacts per cycle")),
            "regime": regime.get("measured") or "–",
            "starts": starts_in_brief(regime.get("starts") or regime.get("replayed") or "–"),
            "differs": ", ".join(name for name, row in own.items() if row["outcome"] == "differs"),
        }


_COMPARED = ("quantity", "measured", "replayed", "deviation")


def _compared(row: Row) -> dict[str, str]:
    """The cells of one quantity, in the units of the report."""
    name, factor = _SHOWN[row["quantity"]]
    low, high = (significant(row[end], factor=factor) for end in ("low", "high"))
    replayed = significant(row["replayed"], factor=factor)
    return {
        "quantity": name,
        "measured": significant(row["measured"], factor=factor),
        "replayed": replayed if low == high else f"{replayed} ({low} to {high})",
        "deviation": f"{100.0 * float(row['deviation']):+.1f} %" if row["deviation"] else "–",
    }


def _impacts(row: Row | None) -> str:
    if row is None:
        return "–"
    return f"{significant(row['measured'])}, {significant(row['replayed'])}"


def starts_in_brief(text: str) -> str:
    """Regimes of the replays with how many starts lead there, the most first.

    Examples
    --------
    >>> starts_in_brief("no impact: 1 of 12 starts; two symmetric: 11 of 12 starts")
    'two symmetric 11, no impact 1 of 12'
    >>> starts_in_brief("two symmetric")
    'two symmetric'
    """
    found = [_STARTS.fullmatch(part) for part in text.split("; ")]
    known = [(one[1], int(one[2]), one[3]) for one in found if one]
    if len(known) < len(found):
        return text
    known.sort(key=lambda one: -one[1])
    return ", ".join(f"{regime} {count}" for regime, count, _ in known) + f" of {known[0][2]}"
