"""The figure of the replay: a few records beside what the identified rig does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.figures.draw.replayed import Beside, replayed_amplitudes
from vinesexp.figures.entry import Drawn
from vinesexp.records.campaign import Record
from vinesexp.records.result_columns import REPLAY_CYCLES
from vinesexp.records.tables import Row
from vinesexp.results import CampaignResults
from vinesexp.theory.regime_definitions import PERMANENT

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_replay(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """Up to five records: a permanent and a modulated response, a sweep, a release, a decay."""
    by_record = results.by_record("replay_cycles")
    records = [record for record in results.campaign.records if record.id in by_record]
    chosen = _chosen(records, results.regime_of)
    if not chosen:
        return
    title = (
        "Measured amplitude, cycle by cycle, beside the same record simulated with the identified "
        "rig, the effects that were found and the base as measured"
    )
    text = (
        "The band reaches over several "
        "starts, since nobody measured where the ball was; where motion is chaotic, only mean and "
        "range can agree, not the curve."
    )
    figure = replayed_amplitudes([_beside(record, by_record[record.id]) for record in chosen])
    yield figure, Drawn("replay", "replay", title, text)


def _chosen(records: Sequence[Record], regime: Mapping[str, str]) -> list[Record]:
    """The middle record of each kind that shows something different."""
    kinds = (
        [r for r in records if r.test == "periodic" and regime.get(r.id, "") in PERMANENT],
        [r for r in records if regime.get(r.id) == "strongly modulated" and r.test == "periodic"],
        [r for r in records if r.test == "sweep" and len(r.clearance) == 1],
        [r for r in records if r.test == "transient" and len(r.clearance) == 1],
        [r for r in records if r.test == "ringdown"],
    )
    return [own[len(own) // 2] for own in kinds if own]


def _beside(record: Record, rows: Sequence[Row]) -> Beside:
    time, *lengths = (
        np.array([row[name] for row in rows], dtype=float) for name in REPLAY_CYCLES.names[1:]
    )
    measured, replayed, low, high = (1e3 * length for length in lengths)
    return Beside(record.id, time, measured, replayed, low, high)
