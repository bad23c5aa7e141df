"""The figure of regimes: impacts cycle by cycle in every periodic test."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vinesexp.figures.collect.impacts_per_cycle import impacts_per_cycle
from vinesexp.figures.collect.single_records import marks_of
from vinesexp.figures.draw.regime_strips import Strip, regime_strips
from vinesexp.figures.entry import Drawn
from vinesexp.records.campaign import Campaign, Record
from vinesexp.records.store import open_record

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

#: Strips in one figure: of more records, those of the smallest base amplitudes.
_MOST = 60


def draw_regimes(
    campaign: Campaign, results: Path, regimes: Sequence[Mapping[str, str]]
) -> Iterator[tuple[Figure, Drawn]]:
    """One strip a periodic test with a regime in regimes.csv."""
    regime_of = {row["record"]: row["regime"] for row in regimes if row["regime"]}
    records = [r for r in campaign.records if r.test == "periodic" and r.id in regime_of]
    records.sort(key=lambda r: (len(r.clearance), r.base_amplitude or 0.0, r.clearance))
    groups: dict[str, list[Strip]] = {}
    for record in records[:_MOST]:
        title = f"G = {1e3 * (record.base_amplitude or 0.0):g} mm"
        title += f", {len(record.clearance)} NESs" if len(record.clearance) > 1 else ""
        name = " + ".join(f"{1e3 * b:g}" for b in record.clearance) + " mm"
        counts = _impacts_per_cycle(record, results)
        if counts.size:
            groups.setdefault(title, []).append(
                Strip(name, regime_of[record.id], counts, record.id)
            )
    if not groups:
        return
    caption = (
        "Impacts in each cycle of every periodic test, one strip a clearance. A solid blue strip "
        "is a permanent response with two impacts per cycle; blue spells that come and go are "
        "strongly modulated response; white is a ball that misses the walls."
    )
    if len(records) > _MOST:
        caption += f" Shown are the first {_MOST} of {len(records)} records."
    yield regime_strips(list(groups.items())), Drawn("regimes_periodic", "periodic", caption)


def _impacts_per_cycle(record: Record, results: Path) -> Floats:
    with open_record(results / f"conditioned/{record.id}.nc") as view:
        frequency = float(view.attributes.get("oscillation_hz") or 0.0)
        length, start = view.n / view.sample_rate if view.n else 0.0, view.start
    times = marks_of(record, results).time
    return impacts_per_cycle(times, frequency=frequency, start=start, length=length)
