"""The figure of regimes: impacts cycle by cycle in every periodic test."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray
from vinesexp.figures.collect.single_records import marks_of
from vinesexp.figures.draw.regime_strips import Strip, regime_strips
from vinesexp.figures.entry import Drawn
from vinesexp.records.campaign import Record
from vinesexp.records.store import open_record
from vinesexp.results import CampaignResults

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def impacts_per_cycle(
    times: FloatArray, *, frequency: float, start: float, length: float
) -> FloatArray:
    """Number of impacts in each cycle.

    Parameters
    ----------
    times : ndarray
        Of the impacts, s.
    frequency : float
        Of the oscillation, Hz; 0: there are no cycles.
    start, length : float
        Of the record, s.

    Examples
    --------
    >>> impacts_per_cycle(np.arange(0.1, 4.0, 0.5), frequency=1.0, start=0.0, length=3.0)
    array([2., 2., 2.])
    """
    edges = cycle_edges(times, frequency or 1.0, start=start, cycles=int(length * frequency))
    return np.histogram(times, edges)[0].astype(float) if edges.size > 1 else np.empty(0)


def cycle_edges(times: FloatArray, frequency: float, *, start: float, cycles: int) -> FloatArray:
    """Edges of the cycles, where impacts are rarest: one on an edge would count in either cycle."""
    turns = np.exp(4j * np.pi * frequency * (times - start))  # two impacts a cycle: half turns
    middle = float(np.angle(turns.mean())) / (4.0 * np.pi * frequency) if times.size else 0.0
    return np.asarray(start + (np.arange(cycles + 1) + 0.25) / frequency + middle)


Floats = NDArray[np.float64]

#: Strips in one figure: of more records, those of the smallest base amplitudes.
_MOST = 60


def draw_regimes(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """One strip a periodic test with a regime in regimes.csv."""
    regime_of = {id: regime for id, regime in results.regime_of.items() if regime}
    records = [r for r in results.campaign.records if r.test == "periodic" and r.id in regime_of]
    records.sort(key=lambda r: (len(r.clearance), r.base_amplitude or 0.0, r.clearance))
    groups: dict[str, list[Strip]] = {}
    for record in records[:_MOST]:
        title = f"G = {1e3 * (record.base_amplitude or 0.0):g} mm"
        title += f", {len(record.clearance)} NESs" if len(record.clearance) > 1 else ""
        name = " + ".join(f"{1e3 * b:g}" for b in record.clearance) + " mm"
        counts = _impacts_per_cycle(record, results.folder)
        if counts.size:
            groups.setdefault(title, []).append(
                Strip(name, regime_of[record.id], counts, record.id)
            )
    if not groups:
        return
    title = "Impacts in each cycle of every periodic test, one strip a clearance"
    text = (
        "A solid blue strip "
        "is a permanent response with two impacts per cycle; blue spells that come and go are "
        "strongly modulated response; where a strip is empty, the ball misses the walls."
    )
    if len(records) > _MOST:
        text += f" Shown are the first {_MOST} of {len(records)} records."
    drawn = Drawn("regimes_periodic", "periodic", title, text)
    yield regime_strips(list(groups.items())), drawn


def _impacts_per_cycle(record: Record, results: Path) -> Floats:
    with open_record(results / f"conditioned/{record.id}.nc") as view:
        frequency = float(view.attributes.get("oscillation_hz") or 0.0)
        length, start = view.n / view.sample_rate if view.n else 0.0, view.start
    times = marks_of(record, results).time
    return impacts_per_cycle(times, frequency=frequency, start=start, length=length)
