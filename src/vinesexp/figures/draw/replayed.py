"""Measured amplitude beside that of the identified rig, cycle by cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vinesexp.figures.draw.style import COLOURS, link, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

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
    time: Floats
    measured: Floats
    replayed: Floats
    low: Floats
    high: Floats


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
