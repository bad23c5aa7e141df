"""What each step sees of a campaign: the fields it may use, and their text.

A step gets the campaign with everything else blank. So what a step uses and what decides whether
its result is still right are the same list, and neither can be forgotten.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, replace
from operator import attrgetter
from pathlib import Path
from typing import Any

from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.records.stored.freshness import shortened

_ROW = tuple(field.name for field in fields(Record) if field.name not in ("id", "row"))
_MEASURED = tuple(name for name in _ROW if name != "settings")
_REPORTED = tuple(f.name for f in fields(Campaign) if f.name not in ("folder", "records"))
#: Cells of a row that say what its test is.
_CELLS = ("test", "clearance", "base_amplitude", "added_mass", "release")
#: Published values and the title are for pages: no step of the analysis may see them.
_ALL = tuple(name for name in _REPORTED if name not in ("published", "title"))

#: Fields of the campaign that a step sees, parts of a field with a dot. A step that weighs all
#: records sees everything.
CAMPAIGN_FIELDS: Mapping[str, tuple[str, ...]] = {
    "ingest": ("channels", "time", "sample_rate", "setups", "people"),
    "condition": ("bandpass",),
    "impacts": ("known.nes_mass",),
    "estimate": ("known.nes_mass",),
    "regimes": (),
    "identify": _ALL,
    "compare": _ALL,
    "replay": _ALL,
    "checks": ("known.nes_mass",),
    "score": (),
    "figures_results": _ALL,
    "figures_records": _ALL,
    "pages": ("title", "known"),
    "report": _REPORTED,
    "bundle": (),
}

#: Fields of a row of records.csv that a step sees: its record's row, or all rows.
RECORD_FIELDS: Mapping[str, tuple[str, ...]] = {
    "ingest": _MEASURED,
    "condition": ("frequency", "settings.filter", "settings.channels"),
    "impacts": ("test", "clearance", "release", "settings"),
    "estimate": ("test", "clearance", "added_mass", "frequency"),
    "regimes": ("test", "clearance", "base_amplitude"),
    "identify": _ROW,
    "compare": _ROW,
    "replay": _ROW,
    "checks": (*_CELLS, "exclude", "note"),
    "score": (),
    "figures_results": _ROW,
    "figures_records": _ROW,
    "pages": _ROW,
    "report": _ROW,
    "bundle": (),
}

_BLANK: Mapping[str, Any] = {
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
    return replace(campaign, records=records, **_hidden(campaign, CAMPAIGN_FIELDS[step]))


def record_seen_by(step: str, record: Record) -> Record:
    """The row with only what `step` uses.

    Examples
    --------
    >>> from pathlib import Path
    >>> record_seen_by("condition", Record("a", Path("a.csv"), "sweep", (0.034,), row=3)).clearance
    ()
    """
    return replace(record, **_hidden(record, RECORD_FIELDS[step]))


def campaign_text(step: str, campaign: Campaign) -> dict[str, str]:
    """What `step` uses of campaign.yaml, field by field; nothing in it names a folder."""
    return {
        f"{name} of campaign.yaml": shortened(repr(attrgetter(name)(campaign)))
        for name in CAMPAIGN_FIELDS[step]
    }


def row_text(campaign: Campaign, record: Record) -> dict[str, str]:
    """All that any step uses of a row, field by field; files as seen from the campaign folder."""
    found = {name: shortened(repr(of(record))) for name, of in _FIELDS.items()}
    found["file"] = _place(record.file, campaign)
    found["more_files"] = repr([_place(file, campaign) for file in record.more_files])
    return found


def rows_text(
    step: str, rows: Mapping[str, Mapping[str, str]], id: str | None = None
) -> dict[str, str]:
    """What `step` uses of rows: of that of record `id`, field by field, or of all, as one text."""
    names = RECORD_FIELDS[step]
    if id is not None:
        return {name: rows[id][name] for name in names}
    seen = [(i, {name: row[name] for name in names}) for i, row in rows.items()]
    return {"records": shortened(repr(seen))}


_FIELDS = {name: attrgetter(name) for name in dict.fromkeys(sum(RECORD_FIELDS.values(), ()))}


def _place(file: Path, campaign: Campaign) -> str:
    """A file as seen from the campaign folder, where it is inside."""
    inside = file.is_relative_to(campaign.folder)
    return (file.relative_to(campaign.folder) if inside else file).as_posix()


def _hidden(thing: Campaign | Record, seen: tuple[str, ...]) -> dict[str, Any]:
    """Blanks for all fields but those seen, and but what names things."""
    kept = ("folder", "name", "records", "id", "file", *seen)
    hidden = {field.name: _blank(field) for field in fields(thing) if field.name not in kept}
    for whole, dot, part in (name.partition(".") for name in seen):
        if dot:
            value = attrgetter(f"{whole}.{part}")(thing)
            hidden[whole] = replace(hidden[whole], **{part: value})
    return hidden


def _blank(field: Field[Any]) -> Any:
    if field.name in _BLANK:
        return _BLANK[field.name]
    return field.default_factory() if field.default_factory is not MISSING else field.default
