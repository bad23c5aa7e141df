"""Rows of one record for the tables of all records: regimes, transitions, base, decay times."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from vinesexp.records.campaign.missing_cells import WITH_BALL
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.refusal import refused_where_it_fails, require_conditioned
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.signals.base_motion import base_rows
from vinesexp.signals.impacts.find import count_impacts
from vinesexp.signals.impacts.impact_table import Impacts, no_impacts, write_impacts
from vinesexp.signals.regimes import decay_times, shown_by_record, unknown_regime

Find = Callable[[], Impacts]


def rows_or_refuse(
    record: Record, find: Find, *, paths: ResultPaths, strict: bool = False,
    said: Sequence[tuple[str, str, str]] = (),
) -> tuple[Impacts, dict[str, Any]]:  # fmt: skip
    """Find the impacts of a record and write what it shows; the reason where it cannot be done.

    Parameters
    ----------
    record : Record
    find : callable
        Finds the impacts and writes them.
    paths : ResultPaths
    strict : bool
        Raise a `RecordError` instead.
    said : sequence of (check, outcome, detail)
        What `find` says of the record; read when it has run.
    """
    measured, conditioned = paths.record(record.id), paths.conditioned(record.id)
    impacts, rows = no_impacts(), {}

    def leave(reason: str) -> None:
        write_impacts(paths.impacts(record.id), impacts)
        rows.update(rows_of_refused(record, reason))

    with refused_where_it_fails("impacts", record.id, leave, strict=strict):
        require_conditioned(measured, conditioned)
        impacts = find()
        rows.update(
            rows_of_record(record, measured=measured, conditioned=conditioned, impacts=impacts)
        )
        rows["checks"] += [list(one) for one in said]
    out = paths.regime(record.id)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return impacts, rows


def rows_of_record(
    record: Record, *, measured: Path, conditioned: Path, impacts: Impacts
) -> dict[str, Any]:
    """What a record shows, by table: a list of rows each."""
    shown = shown_by_record(record, measured=measured, conditioned=conditioned, impacts=impacts)
    return {
        "regime": [shown.regime],
        "bands": shown.bands,
        "transitions": shown.transitions,
        "base": base_rows(record, measured=measured, conditioned=conditioned),
        "times": decay_times(record, conditioned=conditioned),
        "evidence": _evidence(record, measured=measured, conditioned=conditioned),
        "checks": [list(found) for found in shown.checks],
    }


def _evidence(record: Record, *, measured: Path, conditioned: Path) -> dict[str, Any]:
    """What the record shows of cells that its row leaves empty (`missing_cells.py`)."""
    with open_record(measured) as raw, open_record(conditioned) as view:
        frequency = view.attributes.get("oscillation_hz")
        shown: dict[str, Any] = {"frequency": float(frequency) if frequency else None}
        if not record.clearance and record.test in WITH_BALL and raw.refused is None:
            shown["impacts"] = count_impacts(raw, view, settings=record.settings)
    return shown


def rows_of_refused(record: Record, reason: str) -> dict[str, Any]:
    """The same for a record that a step could not digest, with the reason."""
    empty: dict[str, Any] = {name: [] for name in ("bands", "transitions", "base", "times")}
    return {"regime": [unknown_regime(record)], **empty, "refused": reason}
