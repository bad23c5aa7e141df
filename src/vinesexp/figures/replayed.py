"""The figure of the replay: measured amplitude beside that of the identified rig."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.figures.style import COLOURS, Drawn, link, new_figure
from vinesexp.records.campaign.load import Record
from vinesexp.records.stored.result_columns import REPLAY_CYCLES
from vinesexp.records.stored.tables import Row
from vinesexp.results import CampaignResults
from vinesexp.theory.regime_definitions import PERMANENT

if TYPE_CHECKING:
    from matplotlib.figure import Figure


if TYPE_CHECKING:
    from matplotlib.figure import Figure


_COLUMNS = 2


@dataclass(frozen=True)
class Beside:
    """One record and its replays: s and mm.

    Attributes
    ----------
    name : of the record.
    time, measured : of each cycle.
    replayed, low, high : mean, smallest and largest over the replays.
    """

    name: str
    time: FloatArray
    measured: FloatArray
    replayed: FloatArray
    low: FloatArray
    high: FloatArray


def replayed_amplitudes(records: Sequence[Beside]) -> Figure:
    """One panel a record: measured amplitude, and the band of its replays."""
    columns = min(len(records), _COLUMNS)
    rows = -(-len(records) // columns)
    figure, axes = new_figure(rows, columns, height=0.5 + 2.0 * rows)
    for axis, one in zip(axes, records, strict=False):
        axis.fill_between(
            one.time, one.low, one.high, color=COLOURS["exact"], alpha=0.25, linewidth=0
        )
        axis.plot(one.time, one.replayed, color=COLOURS["exact"], linewidth=1.4)
        axis.plot(one.time, one.measured, color=COLOURS["measured"], linewidth=0.7)
        link(axis.set_title(one.name), one.name, f"page of {one.name}")
        axis.set_ylim(0.0, 1.1 * float(max(one.high.max(), one.measured.max())))
        axis.margins(x=0.01)
    for axis in axes[len(records) :]:
        axis.remove()
    for axis in axes[max(len(records) - columns, 0) : len(records)]:
        axis.set_xlabel("time (s)")
    for axis in axes[: len(records) : columns]:
        axis.set_ylabel("amplitude (mm)")
    handles = [
        axes[0].plot([], [], color=COLOURS["measured"], linewidth=0.9, label="measured")[0],
        axes[0].plot([], [], color=COLOURS["exact"], label="replayed: median and range")[0],
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=8)
    return figure


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
