"""Step 3 of a record: its impacts, and the regime, base and decay times that they show, written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from vinesexp.records.campaign import Record
from vinesexp.records.refusal import refused_where_it_fails, require_conditioned
from vinesexp.records.result_paths import ResultPaths
from vinesexp.signals.base_motion import base_rows
from vinesexp.signals.impacts.find import impacts_of_record
from vinesexp.signals.impacts.impact_table import Impacts, no_impacts, write_impacts
from vinesexp.signals.regimes import decay_times, shown_by_record, unknown_regime


def write_impacts_and_regime(
    record: Record, *, paths: ResultPaths, nes_mass: list[float], strict: bool
) -> tuple[Impacts, dict[str, str | float | None]]:
    """Impact table and regime of a record, and their files.

    Parameters
    ----------
    record : Record
    paths : ResultPaths
    nes_mass : list of float
        Masses of the balls, kg, as far as they are known.
    strict : bool
        Raise where the record cannot be digested, instead of leaving it without impacts.

    Raises
    ------
    RecordError
        With `strict`: the record cannot be used, and why.
    """
    measured, conditioned = paths.record(record.id), paths.conditioned(record.id)
    impacts, regime = no_impacts(), unknown_regime(record)
    step: dict[str, Any] = {key: [] for key in ("bands", "transitions", "base", "times")}

    def leave(reason: str) -> None:
        write_impacts(paths.impacts(record.id), impacts)
        step["refused"] = reason

    with refused_where_it_fails("impacts", record.id, leave, strict=strict):
        require_conditioned(measured, conditioned)
        impacts = impacts_of_record(
            measured,
            conditioned,
            paths.impacts(record.id),
            clearance=record.clearance,
            nes_mass=nes_mass,
            test=record.test,
            settings=record.settings,
        )
        both = {"measured": measured, "conditioned": conditioned}
        shown = shown_by_record(record, impacts=impacts, **both)
        regime, step["bands"], step["transitions"] = shown.regime, shown.bands, shown.transitions
        step["base"] = base_rows(record, **both)
        step["times"] = decay_times(record, conditioned=conditioned)
    step["regime"] = [regime]
    path = paths.regime(record.id)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(step, indent=1) + "\n", encoding="utf-8")
    return impacts, regime


def read_shown(path: Path) -> dict[str, Any]:
    """What `write_impacts_and_regime` left beside the impacts: rows by table, or why not."""
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found
