"""What stands against a verdict: causes that the checks name, and starts that lead elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vinesexp.clearance.levels import Periodic
from vinesexp.clearance.optimum import UNSEEN
from vinesexp.records.tables import number
from vinesexp.theory.regime_definitions import PERMANENT

Row = Mapping[str, str]

#: Checks that can be why a prediction misses, in words.
CAUSES = {
    "base amplitude": "the base amplitude differs from the test log",
    "base frequency": "the base frequency differs from the test log",
    "base motion": "the base was no steady sine",
    "mass": "ways to M disagree",
    "agreement": "records disagree",
    "jumps": "channels disagree on the impacts",
    "cross-axis": "the accelerometer shows motion across its axis",
    "settling": "tests may not have settled",
    "gain": "channels disagree on their gain",
    "sign": "a channel has the wrong sign",
    "collisions": "the collisions are not those of the model",
    "added mass": "an added mass is off",
    "damping": "damping depends on amplitude",
    "spring": "the spring is not straight",
    "replay": "the identified rig does not replay its records",
}


def likely_causes(checks: Sequence[Row]) -> str:
    """The causes that warnings name, as a clause; says so where they name none.

    Examples
    --------
    >>> likely_causes([{"record": "", "check": "mass", "outcome": "warning", "detail": "..."}])
    'likely causes by the checks: ways to M disagree'
    """
    named = {row["check"] for row in checks if row["outcome"] == "warning"}
    words = [text for name, text in CAUSES.items() if name in named]
    if not words:
        return "no check names a cause; a clearance or the ball's mass may be off"
    return f"likely causes by the checks: {', '.join(words)}"


def left_early(level: Periodic, end: Row, replay: Sequence[Row]) -> str:
    """Why tests may lose two impacts per cycle below b_c: they began elsewhere; empty if not so.

    Parameters
    ----------
    level : Periodic
    end : mapping
        Row of clearances.csv of the end of two impacts per cycle.
    replay : sequence of mappings
        Rows of replay.csv.
    """
    low, exact = number(end.get("measured_low_mm", "")), number(end.get("exact_mm", ""))
    if exact is None:
        return ""
    starts = {row["record"]: row for row in replay if row["quantity"] == "regime"}
    for test in level.tests:
        above = low is None or 1e3 * test.clearance > low
        row = starts.get(test.record)
        if not above or test.regime in PERMANENT or test.regime in ("", UNSEEN) or row is None:
            continue
        shown = {part.partition(":")[0] for part in (row["starts"] or row["replayed"]).split("; ")}
        if 1e3 * test.clearance < exact and shown & set(PERMANENT):
            return (
                f"at {1e3 * test.clearance:g} mm the identified rig keeps them from some starts "
                "and not from others, so that these tests do not show where the orbit itself ends"
            )
    return ""


def branch_note(level: Periodic, replay: Sequence[Row]) -> str:
    """Up to where replays from rest keep the orbit whose end b_c is; empty where all starts do.

    Parameters
    ----------
    level : Periodic
    replay : sequence of mappings
        Rows of replay.csv.
    """
    starts = {row["record"]: row for row in replay if row["quantity"] == "regime"}
    kept: list[float] = []
    lost: list[float] = []
    for test in level.tests:
        row = starts.get(test.record)
        if row is None:
            continue
        shown = {part.partition(":")[0] for part in (row["starts"] or row["replayed"]).split("; ")}
        if shown <= set(PERMANENT):
            kept.append(test.clearance)
        elif shown & set(PERMANENT):
            lost.append(test.clearance)
    if not lost:
        return ""
    below = [b for b in kept if b < min(lost)]
    reach = f"up to {1e3 * max(below):g} mm" if below else "at no clearance tried"
    return (
        f"replays from every start keep two impacts per cycle {reach}; at {1e3 * min(lost):g} mm "
        "some starts lead elsewhere"
    )
