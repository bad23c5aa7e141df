"""What each step sees of a campaign: all that it uses, and so all that its result depends on.

A step gets the campaign with everything blank but the fields that it may use. So what a step uses
and what decides whether its result is still right are the same list, and neither can be forgotten.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from operator import attrgetter
from typing import Any

from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.whole_files import shortened

_ROW = tuple(field.name for field in fields(Record) if field.name not in ("id", "row"))
_MEASURED = tuple(name for name in _ROW if name != "settings")
_REPORTED = tuple(f.name for f in fields(Campaign) if f.name not in ("folder", "name", "records"))
#: Cells of a row that say what its test is.
_CELLS = ("test", "clearance", "base_amplitude", "added_mass", "release")
#: Published values and the title are for pages: no step of the analysis may see them.
_ALL = tuple(name for name in _REPORTED if name not in ("published", "title"))

#: Fields of the campaign and of a row that a step sees, parts of a field with a dot: of its
#: record's row, or of all rows. A step that is not named weighs all records: it sees everything.
_SEES: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "ingest": (("channels", "time", "sample_rate", "setups", "people"), _MEASURED),
    "condition": (("bandpass",), ("frequency", "settings.filter", "settings.channels")),
    "impacts": (("known.nes_mass",), ("test", "clearance", "release", "settings")),
    "estimate": (("known.nes_mass",), ("test", "clearance", "added_mass", "frequency")),
    "regimes": (("channels", "setups"), ("test", "clearance", "base_amplitude", "setup")),
    "checks": (("known.nes_mass",), (*_CELLS, "exclude", "note")),
    "score": ((), ()),
    "pages": (("title", "known"), _ROW),
    "report": (_REPORTED, _ROW),
    "bundle": ((), ()),
}


def campaign_seen_by(step: str, campaign: Campaign) -> Campaign:
    """The campaign with only what `step` uses; its records likewise."""
    records = tuple(record_seen_by(step, record) for record in campaign.records)
    seen = {"title": "", **_parts(campaign, _seen(step)[0])}
    return Campaign(campaign.folder, campaign.name, records=records, **seen)


def record_seen_by(step: str, record: Record) -> Record:
    """The row with only what `step` uses.

    Examples
    --------
    >>> from pathlib import Path
    >>> record_seen_by("condition", Record("a", Path("a.csv"), "sweep", (0.034,), row=3)).clearance
    ()
    """
    named = {"id": record.id, "file": record.file, "test": ""}
    return Record(**{**named, **_parts(record, _seen(step)[1])})


def _seen(step: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    return _SEES.get(step, (_ALL, _ROW))


def _parts(thing: Campaign | Record, names: tuple[str, ...]) -> dict[str, Any]:
    """Fields by name; of one of which a part is named, the other parts are as by default."""
    found: dict[str, Any] = {}
    for whole, _, part in (name.partition(".") for name in names):
        value = getattr(thing, whole)
        if part:
            value = replace(found.get(whole, type(value)()), **{part: getattr(value, part)})
        found[whole] = value
    return found


def campaign_text(step: str, campaign: Campaign) -> dict[str, str]:
    """What `step` uses of campaign.yaml, field by field; nothing in it names a folder."""
    return {f"{name} of campaign.yaml": repr(attrgetter(name)(campaign)) for name in _seen(step)[0]}


def row_text(campaign: Campaign, record: Record) -> dict[str, str]:
    """All that any step uses of a row, field by field; files as seen from the campaign folder."""
    found = {name: shortened(repr(of(record))) for name, of in _FIELDS.items()}
    found["file"] = campaign.inside(record.file)
    found["more_files"] = repr([campaign.inside(file) for file in record.more_files])
    return found


def rows_text(step: str, rows: Mapping[str, Mapping[str, str]], id: str = "") -> dict[str, str]:
    """What `step` uses of rows: of that of record `id`, field by field, or of all, as one text."""
    names = _seen(step)[1]
    seen = [(i, {name: rows[i][name] for name in names}) for i in ([id] if id else rows)]
    return seen[0][1] if id else {"records": repr(seen)}


_FIELDS = {name: attrgetter(name) for _, row in _SEES.values() for name in row}
