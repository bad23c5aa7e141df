"""What each step sees of a campaign: the fields it may use, and their text.

A step gets the campaign with everything else blank. So what a step uses and what decides whether
its result is still right are the same list, and neither can be forgotten.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, replace
from operator import attrgetter
from typing import Any

from vinesexp.records.schema import Campaign, Known, Record

_ROW = tuple(field.name for field in fields(Record) if field.name not in ("id", "row"))
_ALL = ("name", "title", "known", "channels", "time", "sample_rate", "bandpass")

#: Fields of the campaign that a step sees.
CAMPAIGN_FIELDS: Mapping[str, tuple[str, ...]] = {
    "ingest": ("channels", "time", "sample_rate"),
    "condition": ("bandpass",),
    "impacts": ("known.nes_mass",),
    "estimate": ("known.nes_mass",),
    "regimes": (),
    "identify": ("known",),
    "compare": ("known",),
    "checks": (),
    "score": (),
    "figures": _ALL,
    "report": _ALL,
}

#: Fields of a row of records.csv that a step sees: its record's row, or all rows.
RECORD_FIELDS: Mapping[str, tuple[str, ...]] = {
    "ingest": _ROW,
    "condition": ("frequency",),
    "impacts": ("test", "clearance", "release"),
    "estimate": ("test", "clearance", "added_mass", "frequency"),
    "regimes": (),
    "identify": ("test", "clearance", "added_mass", "exclude"),
    "compare": ("test", "clearance", "base_amplitude", "frequency", "release", "exclude"),
    "checks": (),
    "score": (),
    "figures": _ROW,
    "report": _ROW,
}

_BLANK = {
    "title": "",
    "known": Known(),
    "channels": {},
    "time": None,
    "sample_rate": None,
    "bandpass": None,
    "test": "",
}


def campaign_seen_by(step: str, campaign: Campaign) -> Campaign:
    """The campaign with only what `step` uses; its records likewise."""
    records = tuple(record_seen_by(step, record) for record in campaign.records)
    hidden = _hidden(campaign, CAMPAIGN_FIELDS[step])
    if "known.nes_mass" in CAMPAIGN_FIELDS[step]:
        hidden["known"] = Known(nes_mass=campaign.known.nes_mass)
    return replace(campaign, records=records, **hidden)


def record_seen_by(step: str, record: Record) -> Record:
    """The row with only what `step` uses.

    Examples
    --------
    >>> from pathlib import Path
    >>> record_seen_by("condition", Record("a", Path("a.csv"), "sweep", (0.034,), row=3)).clearance
    ()
    """
    return replace(record, **_hidden(record, RECORD_FIELDS[step]))


def step_text(step: str, campaign: Campaign, record: Record | None = None) -> dict[str, str]:
    """All that `step` uses, field by field as text; a change of any makes its result outdated.

    Parameters
    ----------
    step : str
        A key of `CAMPAIGN_FIELDS`.
    campaign : Campaign
    record : Record, optional
        For a step on one record; without it, all rows count, as one text.

    Returns
    -------
    dict
        Nothing in it names a folder, so that a campaign can be moved.
    """
    found = {name: repr(attrgetter(name)(campaign)) for name in CAMPAIGN_FIELDS[step]}
    if record is not None:
        return found | _row_text(step, campaign, record)
    rows = [(each.id, _row_text(step, campaign, each)) for each in campaign.records]
    return found | {"records": repr(rows)}


def _row_text(step: str, campaign: Campaign, record: Record) -> dict[str, str]:
    found = {name: repr(getattr(record, name)) for name in RECORD_FIELDS[step]}
    if "file" in found:
        inside = record.file.is_relative_to(campaign.folder)
        file = record.file.relative_to(campaign.folder) if inside else record.file
        found["file"] = file.as_posix()
    return found


def _hidden(thing: Campaign | Record, seen: tuple[str, ...]) -> dict[str, Any]:
    kept = ("folder", "name", "records", "id", "file", *seen)
    return {field.name: _blank(field) for field in fields(thing) if field.name not in kept}


def _blank(field: Field[Any]) -> Any:
    if field.name in _BLANK:
        return _BLANK[field.name]
    return field.default_factory() if field.default_factory is not MISSING else field.default
