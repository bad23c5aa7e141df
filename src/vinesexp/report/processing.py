"""How each record was processed: length, sampling, bands, impacts; for checking a number."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vinesexp.records.campaign import Campaign
from vinesexp.records.store import RecordView, open_record
from vinesexp.settings.overrides import differences


@dataclass(frozen=True)
class Processed:
    """One record that could be used, in the words of the report.

    Attributes
    ----------
    record : id.
    length, sample_rate : ``50 s``, ``10 kHz``.
    oscillation : frequency that the bands follow, Hz.
    motion_band, impact_band : what displacement and acceleration keep, Hz.
    impacts : how many were found.
    sha256 : digest of the instrument file when it was read; empty where none was kept.
    """

    record: str
    length: str
    sample_rate: str
    oscillation: str
    motion_band: str
    impact_band: str
    impacts: int
    sha256: str


def processed_records(campaign: Campaign, results: Path) -> list[Processed]:
    """Every usable record, from the attributes that the steps have left in its files."""
    found = []
    for record in campaign.records:
        with open_record(results / f"records/{record.id}.nc") as view:
            sha256 = str(view.attributes.get("source_sha256", ""))
        with open_record(results / f"conditioned/{record.id}.nc") as view:
            if view.refused is not None or not view.n:
                continue
            found_in, drop = view.attributes, record.test == "drop"
            found.append(
                Processed(
                    record=record.id,
                    length=f"{view.n / view.sample_rate:.4g} s",
                    sample_rate=f"{1e-3 * view.sample_rate:.4g} kHz",
                    # What a drop test's bands follow is the ringing of its impacts.
                    oscillation="–" if drop else _hertz(found_in.get("oscillation_hz")),
                    motion_band=_band(view, "displacement") if not drop else "–",
                    impact_band=_band(view, "acceleration"),
                    impacts=_count(results / f"impacts/{record.id}.csv"),
                    sha256=sha256,
                )
            )
    return found


def changed_settings(campaign: Campaign) -> list[tuple[str, str]]:
    """Settings that the campaign or a record changes: what they apply to, and their values."""
    found = [("all records", text) for text in differences(campaign.settings)]
    for record in campaign.records:
        own = differences(record.settings, campaign.settings)
        found += [(record.id, text) for text in own]
    return found


def _hertz(value: Any) -> str:
    return f"{float(value):.4g}" if value is not None else "–"


def _band(view: RecordView, role: str) -> str:
    """Edges of what a channel keeps, those that its sampling can hold; a dash without it."""
    if role not in view.roles:
        return "–"
    low, high = (view.attributes.get(f"{role}_{end}_hz") for end in ("low", "high"))
    if high is not None and float(high) >= 0.5 * view.sample_rate:
        high = None
    if low is None and high is None:
        return "all"
    if high is None:
        return f"above {_hertz(low)}"
    return f"below {_hertz(high)}" if low is None else f"{_hertz(low)} to {_hertz(high)}"


def _count(table: Path) -> int:
    with table.open("rb") as stream:
        return max(sum(1 for _ in stream) - 1, 0)
