"""Does another branch explain a regime that b_c does not? Asked only where the two differ.

Up to b_c a stable orbit of two impacts per cycle exists; that does not say that a rig runs on it.
Where a record shows something else (or shows it beyond b_c), the identified rig is started many
times at that clearance, and the motions it settles to are held beside the record.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vinesexp.clearance.levels import Periodic, Tested
from vinesexp.clearance.optimum import UNSEEN
from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.errors import VinesexpError
from vinesexp.maps.basins import STARTS, Attractor, coexisting
from vinesexp.records.tables import number
from vinesexp.rig import NES, RIG_VALUES, Oscillator, Rig
from vinesexp.theory.regime_definitions import PERMANENT

Row = Mapping[str, str]

#: Share by which the amplitude of a record may miss that of a motion that explains it.
ALIKE = 0.1
#: Records that are looked at; more say no more.
MOST = 12


def other_branches(
    levels: Sequence[Periodic], clearances: Sequence[Row], rig: IdentifiedRig
) -> list[dict[str, str]]:
    """One row for each record whose regime is not the one that b_c predicts.

    Parameters
    ----------
    levels : sequence of Periodic
    clearances : sequence of mappings
        Rows of clearances.csv.
    rig : IdentifiedRig

    Returns
    -------
    list of dict
        ``record``, ``clearance`` (mm), ``measured``, ``predicted``, ``found`` (the motions that
        coexist) and ``explained`` (a sentence); empty where all agree or values are missing.
    """
    if not set(RIG_VALUES) <= set(rig.values):
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
    low, high = (
        number(row.get(f"predicted_{end}_mm") or row["exact_mm"]) for end in ("low", "high")
    )
    if low is None or high is None or not test.regime or test.regime == UNSEEN:
        return False
    b = 1e3 * test.clearance
    permanent = test.regime in PERMANENT
    return (b < low and not permanent) or (b > high and permanent)


def _row(level: Periodic, test: Tested, rig: IdentifiedRig) -> dict[str, str] | None:
    value = {name: quantity.value for name, quantity in rig.values.items()}
    try:
        oscillator = Oscillator(M=value["M"], c1=value["c1"], k1=value["k1"])
        ball = NES(m=value["m"], b=test.clearance, r=value["r"])
        found = coexisting(
            Rig(oscillator, nes=[ball]),
            level=level.G,
            frequency=level.frequency or oscillator.f0,
            clearances=[test.clearance],
        )
    except VinesexpError:
        return None
    permanent = test.regime in PERMANENT
    return {
        "record": test.record,
        "clearance": f"{1e3 * test.clearance:g}",
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
    alike = [one for one in found if _of_the_record(test, one)]
    if not alike:
        return f"no other motion explains it: none of {STARTS} starts leads there"
    best = max(alike, key=lambda one: one.share)
    if best.share == 1.0:
        return "all starts lead to the motion of the record, none to the one that b_c is about"
    return f"another motion explains it: {_in_words(best)}"


def _of_the_record(test: Tested, one: Attractor) -> bool:
    same = one.regime == test.regime or {one.regime, test.regime} <= set(PERMANENT)
    value = test.value or 0.0
    return same and (1.0 - ALIKE) * one.low <= value <= (1.0 + ALIKE) * one.high


def _in_words(one: Attractor) -> str:
    return f"{one.regime}, {1e3 * one.mean:.3g} mm, from {100.0 * one.share:.0f} % of the starts"
