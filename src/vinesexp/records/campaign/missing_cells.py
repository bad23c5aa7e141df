"""Cells of records.csv that are empty although an answer needs them, and which answer that is.

An empty cell is no mistake in itself: without a clearance a test is one without NES, without an
added mass a ring-down is that of the bare oscillator. What contradicts it is what the record
shows (impacts, a frequency of its own) or a note that still says FILL IN, as `vinesexp init`
leaves it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.stored.checks import Check
from vinesexp.units import first_of

#: Name of these checks in checks.csv.
MISSING = "missing"
#: In a note: cells that only a person can fill in.
FILL_IN = "FILL IN"
_ASKED = re.compile(rf"{FILL_IN}[^:;]*:((?:\s+[a-z_]+)+)")

#: Fewer impacts than these may be false ones, and say nothing of the ball.
_IMPACTS = 10
#: Ring-downs of one mounted mass differ by less in their frequency, as a share.
_SAME_MASS = 0.01
_LISTED = 6  # records named one by one

#: Tests that a ball can take part in.
WITH_BALL = ("periodic", "transient", "sweep")
#: Columns that a channel shows, too, and which.
SHOWN_BY = {"base_amplitude_mm": "base", "release_mm": "displacement"}
#: Column to what it is of a record, the tests that need it, and what stays unknown without.
_NEEDED = {
    "clearance_mm": (
        "clearance",
        WITH_BALL,
        "the test counts as one without NES: its regime, r, and its place on the curve of "
        "amplitude over clearance stay unknown",
    ),
    "base_amplitude_mm": (
        "base_amplitude",
        ("periodic",),
        "the test belongs to no level: the best clearance and b_c stay unknown",
    ),
    "release_mm": (
        "release",
        ("transient",),
        "the test belongs to no release: the fastest clearance and b_t stay unknown",
    ),
    "added_mass_g": ("added_mass", ("ringdown",), "M cannot be known by added mass"),
}


@dataclass(frozen=True)
class Evidence:
    """What a record shows of its own cells.

    Attributes
    ----------
    impacts : int
        Impacts in a record whose row has no clearance.
    frequency : float or None
        Of its oscillation, Hz.
    base : float or None
        Amplitude of its base channel, m.
    release : float or None
        How far out its mass was let go, m.
    """

    impacts: int = 0
    frequency: float | None = None
    base: float | None = None
    release: float | None = None

    def of(self, column: str) -> float | None:
        """What the record shows of a column, m."""
        return {"base_amplitude_mm": self.base, "release_mm": self.release}.get(column)


def read_evidence(path: Path) -> Evidence:
    """From the rows that the step on impacts left of a record."""
    rows = json.loads(path.read_text(encoding="utf-8"))
    base = rows["base"][0]["amplitude_m"] if rows["base"] else None
    release = abs(rows["release"][0]["x"]) if rows["release"] else None
    return Evidence(**rows.get("evidence", {}), base=base, release=release)


def missing_cells(campaign: Campaign, evidence: Mapping[str, Evidence]) -> list[Check]:
    """One check a column that lacks cells; none where every empty cell may be meant.

    Parameters
    ----------
    campaign : Campaign
    evidence : mapping
        By record id; records without it (refused, excluded) are left out.
    """
    records = [r for r in campaign.records if r.id in evidence and not r.exclude]
    loaded = any(record.added_mass for record in records)
    found = []
    for column, (_, _, unknown) in _NEEDED.items():
        lacking = [r for r in records if _lacks(r, column, evidence[r.id])]
        if column == "added_mass_g" and (sentence := _other_masses(records, evidence)):
            found.append(Check("", MISSING, "warning", f"{column} {sentence}"))
        elif lacking and not (column == "added_mass_g" and loaded):  # then the others have none
            why = _reason(lacking, column, evidence)
            if all(evidence[r.id].of(column) for r in lacking):
                unknown = "the analysis uses that"
            detail = f"{column} is empty in {_names(lacking)}{why}; {unknown}"
            if any(column in asked_in(record) for record in lacking):
                detail += "; if it does not apply, remove FILL IN from the note"
            only = lacking[0].id if len(lacking) == 1 else ""
            found.append(Check(only, MISSING, "warning", detail))
    with_ball = [r for r in records if r.clearance or evidence[r.id].impacts >= _IMPACTS]
    if with_ball and not campaign.known.nes_mass:
        detail = "known.nes_mass is not in campaign.yaml; weigh the ball: without it, only added"
        detail += " masses or the weighed mass, and impacts, give b_c"
        found.append(Check("", MISSING, "warning", detail))
    return found


def asked_in(record: Record) -> set[str]:
    """Columns that the note of a record still says to fill in.

    Examples
    --------
    >>> note = "it decays; FILL IN, if it applies: release_mm added_mass_g"
    >>> sorted(asked_in(Record("a", Path("a.csv"), "ringdown", note=note)))
    ['added_mass_g', 'release_mm']
    """
    return {name for names in _ASKED.findall(record.note) for name in names.split()}


def _lacks(record: Record, column: str, shown: Evidence) -> bool:
    """Whether a cell is empty that the record, or the note, says should not be."""
    attribute, tests, _ = _NEEDED[column]
    if record.test not in tests or getattr(record, attribute) not in (None, ()):
        return False
    with_ball = bool(record.clearance) or shown.impacts >= _IMPACTS
    unknown = column != "added_mass_g" and not shown.of(column)
    return column in asked_in(record) or (unknown and with_ball)


def _reason(lacking: Iterable[Record], column: str, evidence: Mapping[str, Evidence]) -> str:
    """What the records show instead, as a clause."""
    shown = [evidence[record.id] for record in lacking]
    impacts = sum(one.impacts for one in shown)
    if column == "clearance_mm" and impacts >= _IMPACTS:
        return f", although {impacts} impacts were found there"
    lengths = sorted(1e3 * length for one in shown if (length := one.of(column)))
    if lengths:
        low, high = f"{lengths[0]:.3g}", f"{lengths[-1]:.3g}"
        channel = {"base": "base channel"}.get(SHOWN_BY[column], SHOWN_BY[column])
        return f" (the {channel} shows {low if low == high else f'{low} to {high}'} mm)"
    return ""


def _other_masses(records: Iterable[Record], evidence: Mapping[str, Evidence]) -> str:
    """That ring-downs with the same mass mounted, by their rows, have different frequencies."""
    by_mass: dict[float, list[tuple[float, Record]]] = {}
    for record in records:
        frequency = evidence[record.id].frequency
        if record.test == "ringdown" and not record.clearance and frequency:
            by_mass.setdefault(record.added_mass or 0.0, []).append((frequency, record))
    for mass, group in by_mass.items():
        low, high = min(f for f, _ in group), max(f for f, _ in group)
        if high < (1.0 + _SAME_MASS) * low:
            continue
        middle = (low * high) ** 0.5
        slow = [record for f, record in group if f < middle]
        fast = [record for f, record in group if f >= middle]
        said = f"is {1e3 * mass:g}" if mass else "is empty"
        return (
            f"{said} in {_names(slow)} as in {_names(fast)}, but they oscillate at {low:.4g} and "
            f"{high:.4g} Hz: as with different masses mounted, on different rigs, or with a spring "
            "that is far from straight; f0, zeta and M of different rigs mix them, or are left out"
        )
    return ""


def _names(records: Iterable[Record]) -> str:
    """The records, the first ones by name.

    Examples
    --------
    >>> _names([Record(f"r{k}", Path("a"), "drop") for k in range(9)])
    'r0, r1, r2, r3, r4, r5 and 3 more'
    """
    ids = [record.id for record in records]
    return first_of(ids, _LISTED + (len(ids) == _LISTED + 1))
