"""Does the identified rig move as the records do? The replay in words and as a table; and where a
record shows another regime than b_c predicts, the motions that coexist at its clearance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from vinesexp.clearance.levels import PeriodicLevel, Tested
from vinesexp.clearance.optimum import UNSEEN
from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.errors import VinesexpError
from vinesexp.maps.basins import STARTS, Attractor, coexisting
from vinesexp.records.stored.tables import Row
from vinesexp.theory.regime_definitions import PERMANENT
from vinesexp.units import first_of

#: Share by which the amplitude of a record may miss that of a motion that explains it.
ALIKE = 0.1
#: Records that are looked at; more say no more.
MOST = 12


@dataclass(frozen=True)
class ReplayVerdict:
    """What the replay says of the identified rig.

    Attributes
    ----------
    sentence : for the section.
    warning : for the verdict; empty where every record is replayed.
    rows : one a record, those that differ first: ``record``, ``differs``, the names of its
        quantities that do, and ``own``, its rows of replay.csv by quantity.
    """

    sentence: str
    warning: str
    rows: tuple[dict[str, Any], ...]


def replay_verdict(rows: Sequence[Row], checks: Sequence[Row]) -> ReplayVerdict | None:
    """From the rows of replay.csv and checks.csv; None where nothing was replayed.

    Examples
    --------
    >>> row = {"record": "a", "quantity": "amplitude", "measured": 0.005, "replayed": 0.00501,
    ...        "low": 0.005, "high": 0.00502, "deviation": -0.002, "outcome": "ok",
    ...        "starts": ""}
    >>> replay_verdict([row], []).sentence
    'The identified rig moves as the record does: mean amplitude within 0.2 %.'
    """
    if not rows:
        return None
    records = list(dict.fromkeys(row["record"] for row in rows))
    failed = list(dict.fromkeys(row["record"] for row in checks if row["check"] == "replay"))
    # Those that differ come first: of many records only the first are shown.
    shown = tuple(sorted(_records(rows), key=lambda row: not row["differs"]))
    if failed:
        whose = f"{len(failed)} of {len(records)} records" if records[1:] else "its only record"
        warning = (
            f"The identified rig does not reproduce {whose} "
            f"({', '.join(failed[:5])}{', ...' if len(failed) > 5 else ''}): predictions for such "
            "tests may not hold."
        )
        return ReplayVerdict(warning, warning, shown)
    whose = "the record does" if len(records) == 1 else f"all {len(records)} records do"
    worst, within = _within(rows)
    sentence = f"The identified rig moves as {whose}: {within}."
    if worst > COARSE:
        sentence = f"No record contradicts the identified rig, but they test it coarsely: {within}."
    if aside := [f"{row['record']} ({row['differs']})" for row in shown if row["differs"]]:
        sentence += f" Other quantities differ in {first_of(aside, 5)}."
    return ReplayVerdict(sentence, "", shown)


#: Largest deviation up to which a replay says that the rig moves as a record.
COARSE = 0.2


def _within(rows: Sequence[Row]) -> tuple[float, str]:
    """How far the worst of each quantity is off, and this in words."""
    steady = {
        row["record"]
        for row in rows
        if row["quantity"] == "regime" and row["measured"] in PERMANENT
    }
    other = "mean amplitude" + (" of other motions" if steady else "")
    parts: dict[str, float] = {}
    for row in rows:
        words, off = row["quantity"], row["deviation"]
        if words == "amplitude":
            permanent = "amplitude of permanent two impacts per cycle"
            words = permanent if row["record"] in steady else other
        if off is not None and row["quantity"] in ("amplitude", "decay time"):
            parts[words] = max(parts.get(words, 0.0), abs(off))
    shown = [f"{words} within {max(100.0 * off, 0.1):.2g} %" for words, off in parts.items()]
    worst = max(parts.values(), default=0.0)
    return worst, ", ".join(shown) or "as far as they can be compared"


def _records(rows: Sequence[Row]) -> Iterator[dict[str, Any]]:
    for record in dict.fromkeys(row["record"] for row in rows):
        own = {row["quantity"]: row for row in rows if row["record"] == record}
        differs = ", ".join(name for name, row in own.items() if row["outcome"] == "differs")
        yield {"record": record, "differs": differs, "own": own}


def other_branches(
    levels: Sequence[PeriodicLevel], clearances: Sequence[Row], rig: IdentifiedRig
) -> list[dict[str, str]]:
    """One row for each record whose regime is not the one that b_c predicts.

    Parameters
    ----------
    levels : sequence of PeriodicLevel
    clearances : sequence of mappings
        Rows of clearances.csv.
    rig : IdentifiedRig

    Returns
    -------
    list of dict
        ``record``, ``clearance`` (mm), ``measured``, ``predicted``, ``found`` (the motions that
        coexist) and ``explained`` (a sentence); empty where all agree or values are missing.
    """
    if rig.missing:
        return []
    rows = {row["level"]: row for row in clearances if row["test"] == "periodic"}
    differing = [
        (level, test)
        for level in levels
        if level.name in rows
        for test in level.tests
        if _differs(test, rows[level.name])
    ]
    return [row for level, test in differing[:MOST] if (row := _row(level, test, rig))]


def _differs(test: Tested, row: Row) -> bool:
    """Whether the regime is another than b_c predicts; within its interval nothing is predicted."""
    low, high = (row.get(f"predicted_{end}_mm") or row["exact_mm"] for end in ("low", "high"))
    if low is None or high is None or not test.regime or test.regime == UNSEEN:
        return False
    b = 1e3 * test.clearance
    permanent = test.regime in PERMANENT
    return (b < low and not permanent) or (b > high and permanent)


def _row(level: PeriodicLevel, test: Tested, rig: IdentifiedRig) -> dict[str, str] | None:
    try:
        plain = rig.plain(test.clearance)
        found = coexisting(
            plain,
            level=level.G,
            frequency=level.frequency or plain.oscillator.f0,
            clearances=[test.clearance],
        )
    except VinesexpError:
        return None
    permanent = test.regime in PERMANENT
    return {
        "record": test.record,
        "clearance": f"{1e3 * test.clearance:.4g}",
        "measured": f"{test.regime}, {1e3 * (test.value or 0.0):.3g} mm",
        "predicted": "no two impacts per cycle" if permanent else "two impacts per cycle",
        "found": "; ".join(_in_words(one) for one in found),
        "explained": explanation(test, found),
    }


def explanation(test: Tested, found: Sequence[Attractor]) -> str:
    """Whether one of the motions that coexist is that of the record.

    Examples
    --------
    >>> low = Attractor(0.03, "two symmetric", 0.75, 30, 1.3e-3, 1.3e-3, 1.3e-3, 1.4e-3, 2.0)
    >>> high = Attractor(0.03, "strongly modulated", 0.25, 10, 6e-3, 5.9e-3, 6.1e-3, 9e-3, 1.6)
    >>> explanation(Tested(0.03, 6.2e-3, "strongly modulated"), [low, high])
    'another motion explains it: strongly modulated, 6 mm, from 25 % of the starts'
    """
    value, regimes = test.value or 0.0, {test.regime}
    regimes |= set(PERMANENT) if test.regime in PERMANENT else set()
    alike = [
        one
        for one in found
        if one.regime in regimes and (1.0 - ALIKE) * one.low <= value <= (1.0 + ALIKE) * one.high
    ]
    if not alike:
        return f"not explained: none of {STARTS} starts leads to the measured motion"
    best = max(alike, key=lambda one: one.share)
    if best.share == 1.0:
        return "all starts lead to the motion of the record, none to the orbit that b_c belongs to"
    return f"another motion explains it: {_in_words(best)}"


def _in_words(one: Attractor) -> str:
    return f"{one.regime}, {1e3 * one.mean:.3g} mm, from {100.0 * one.share:.0f} % of the starts"
