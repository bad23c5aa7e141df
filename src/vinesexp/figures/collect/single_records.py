"""The figures of what single records hold: traces, impacts, releases, sweeps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vinesexp.figures.draw.impact_shapes import Marks, impacts_on_acceleration
from vinesexp.figures.draw.traces import Trace, amplitudes, columns_of, overview
from vinesexp.figures.entry import Drawn
from vinesexp.records.campaign import Record
from vinesexp.records.store import RecordView, open_record
from vinesexp.results import CampaignResults
from vinesexp.signals.impacts.impact_table import read_impacts

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

#: Shown units of each channel: name with unit, factor from SI.
_SHOWN = {
    "displacement": ("displacement (mm)", 1e3),
    "base": ("base (mm)", 1e3),
    "acceleration": ("acceleration (m/s²)", 1.0),
    "sound": ("sound (uncalibrated)", 1.0),
}
_BLOCK = 1 << 20  # samples read at once
_ZOOM_CYCLES = 3.5
_MOST_CURVES = 14  # in one figure
_MOST_POINTS = 1200  # of a drawn line


def draw(found: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """Every figure of the family, with its entry for the list."""
    results = found.folder
    usable = [record for record in found.campaign.records if _usable(record, results)]
    for test in ("ringdown", "periodic", "transient", "drop"):
        record = _representative([r for r in usable if r.test == test])
        if record is None:
            continue
        yield _overview(record, results)
        if test != "ringdown":
            yield from _impacts(record, results)
    yield from _sweeps([r for r in usable if r.test == "sweep"], results)
    yield from _releases([r for r in usable if r.test in ("transient", "ringdown")], results)


def draw_record(record: Record, results: Path) -> Iterator[tuple[Figure, Drawn]]:
    """One record: its channels as measured, and its impacts where it has any."""
    yield _overview(record, results)
    if record.clearance or record.test == "drop":
        yield from _impacts(record, results)


def _usable(record: Record, results: Path) -> bool:
    with open_record(results / f"conditioned/{record.id}.nc") as view:
        return view.refused is None and not record.exclude


def _representative(records: Sequence[Record]) -> Record | None:
    """The record in the middle of the tested clearances; the first where there are none."""
    single = sorted((r for r in records if len(r.clearance) == 1), key=lambda r: r.clearance)
    return single[len(single) // 2] if single else next(iter(records), None)


def extremes(view: RecordView, role: str, parts: int) -> tuple[Floats, Floats, Floats]:
    """Middle time, smallest and largest sample (SI) in `parts` equal parts of a record.

    Read by blocks of whole parts: memory does not grow with the record.
    """
    edges = np.unique(np.linspace(0, view.n, min(parts, view.n) + 1).astype(np.int64))
    low, high = np.empty(edges.size - 1), np.empty(edges.size - 1)
    begin = 0
    while begin < low.size:
        end = max(int(np.searchsorted(edges, edges[begin] + _BLOCK, "right")) - 1, begin + 1)
        samples = view.read(role, int(edges[begin]), int(edges[end]))
        starts = edges[begin:end] - edges[begin]
        low[begin:end] = np.fmin.reduceat(samples, starts)
        high[begin:end] = np.fmax.reduceat(samples, starts)
        begin = end
    middle = np.asarray(view.start + 0.5 * (edges[:-1] + edges[1:] - 1) / view.sample_rate)
    return middle, low, high


def whole(view: RecordView, role: str, *, frequency: float) -> Trace:
    """A channel over the whole record, in the unit that is shown, as smallest and largest.

    `frequency` of the oscillation, Hz; 0 where there is none.
    """
    name, factor = _SHOWN[role]
    cycles = frequency * view.n / view.sample_rate
    time, low, high = extremes(view, role, columns_of(cycles))
    return Trace(name, time, factor * low, factor * high)


def amplitude(view: RecordView, name: str, record: str = "") -> Trace:
    """Half the swing of the displacement in each cycle, mm."""
    frequency = float(view.attributes.get("oscillation_hz") or 0.0)
    cycles = round(frequency * view.n / view.sample_rate)
    time, low, high = extremes(view, "displacement", max(cycles, 1) if frequency else 200)
    part = -(-time.size // _MOST_POINTS)
    count = time.size // part * part
    swing = 0.5e3 * (high - low)
    return Trace(
        *(name, time[:count].reshape(-1, part).mean(axis=1)),
        swing[:count].reshape(-1, part).max(axis=1),
        record=record,
    )


def _overview(record: Record, results: Path) -> tuple[Figure, Drawn]:
    frequency = _oscillation(record, results)
    with open_record(results / f"records/{record.id}.nc") as view:
        traces = [whole(view, role, frequency=frequency) for role in _SHOWN if role in view.roles]
    head = f"Record {record.id} as measured: calibrated, nothing filtered"
    text = "Look for drift, clipping and gaps."
    figure = overview(traces, title=f"{record.id}: {_set_up(record)}")
    return figure, Drawn(f"record_{record.test}", record.test, head, text)


def _oscillation(record: Record, results: Path) -> float:
    """Frequency that the record was conditioned with, Hz; 0 for a drop test."""
    if record.test == "drop":
        return 0.0
    with open_record(results / f"conditioned/{record.id}.nc") as view:
        return float(view.attributes.get("oscillation_hz") or 0.0)


def marks_of(record: Record, results: Path) -> Marks:
    """The impacts of a record as they are drawn."""
    impacts = read_impacts(results / f"impacts/{record.id}.csv")
    return Marks(time=impacts.time_s, side=impacts.side, jump=impacts.velocity_jump_m_s)


def _impacts(record: Record, results: Path) -> Iterator[tuple[Figure, Drawn]]:
    marks = marks_of(record, results)
    with open_record(results / f"conditioned/{record.id}.nc") as view:
        role = next((one for one in ("acceleration", "sound") if one in view.roles), None)
        if role is None or not marks.time.size:
            return
        begin, end = _stretch(view, record, marks)
        zoom = Trace(role, view.time(begin, end), view.read(role, begin, end))
        motion = None
        if "displacement" in view.roles and record.test != "drop":
            motion = Trace(
                *("displacement", view.time(begin, end)),
                1e3 * view.read("displacement", begin, end),
            )
        trace = whole(view, role, frequency=_oscillation(record, results))
    figure = impacts_on_acceleration(
        *(trace, zoom, marks),
        title=f"{record.id}: {_set_up(record)}, {marks.time.size} impacts",
        motion=motion,
    )
    middle = (
        "Middle: by how much each impact changed the velocity of the mass, coloured by the wall "
        "that was hit. "
    )
    text = (
        f"Above: bandpassed {role}, every spike an impact; the shaded "
        f"stretch is enlarged below. {middle if np.isfinite(marks.jump).any() else ''}"
        "Below: the stretch with every impact found marked. Each spike should carry one mark, "
        "and a mark should sit on a spike."
    )
    yield figure, Drawn(f"impacts_{record.test}", record.test, f"Record {record.id}", text)


def _stretch(view: RecordView, record: Record, marks: Marks) -> tuple[int, int]:
    """Samples of a few cycles: from the first impact, or in the middle of a periodic test."""
    if record.test == "drop":
        # All bounces: they come ever faster.
        length = 1.1 * float(marks.time[-1] - marks.time[0]) + 0.02
    else:
        frequency = view.attributes.get("oscillation_hz")
        length = _ZOOM_CYCLES / float(frequency) if frequency else 0.5
    middle = marks.time.size // 2 if record.test == "periodic" else 0
    begin = max(round((marks.time[middle] - view.start - 0.08 * length) * view.sample_rate), 0)
    return begin, min(begin + max(round(1.16 * length * view.sample_rate), 2), view.n)


def _set_up(record: Record) -> str:
    parts = []
    if record.clearance:
        parts.append("b = " + " + ".join(f"{1e3 * b:g}" for b in record.clearance) + " mm")
    elif record.test != "drop":
        parts.append("without NES")
    if record.base_amplitude:
        parts.append(f"G = {1e3 * record.base_amplitude:g} mm")
    if record.release:
        parts.append(f"released at {1e3 * record.release:g} mm")
    if record.added_mass:
        parts.append(f"{1e3 * record.added_mass:g} g added")
    return ", ".join(parts) or record.test


def _sweeps(records: Sequence[Record], results: Path) -> Iterator[tuple[Figure, Drawn]]:
    for balls, word in ((1, "one"), (2, "two")):
        chosen = [r for r in records if len(r.clearance) in (0, balls) and r.frequency]
        chosen = sorted(chosen, key=lambda r: r.clearance)
        every, chosen = len(chosen), spread(chosen)
        bare = [r for r in chosen if not r.clearance]
        if balls > 1 and len(bare) == len(chosen):
            continue
        traces = []
        for record in chosen:
            with open_record(results / f"conditioned/{record.id}.nc") as view:
                if "displacement" not in view.roles:
                    continue
                trace = amplitude(view, _balls(record), record.id)
            start, end = record.frequency or (0.0, 0.0)
            share = (trace.time - trace.time[0]) / (trace.time[-1] - trace.time[0])
            at = start + (end - start) * share
            traces.append(Trace(trace.name, at, trace.values, record=record.id))
        if not traces:
            continue
        figure = amplitudes(
            traces, xlabel="frequency (Hz)", ylabel="amplitude (mm)", bare=len(bare)
        )
        with_nes = f" with {word} NES{'s' if balls > 1 else ''}" if len(bare) < len(chosen) else ""
        head = f"Slow sine sweeps{with_nes}: amplitude of the mass over the base's frequency"
        text = (
            "The grey curve is the mass alone; where a coloured one swings to and fro, the "
            "response is strongly modulated."
        ) + _of(chosen, every)
        yield figure, Drawn(f"sweep_{word}_nes", "sweep", head, text)


def spread(records: Sequence[Record]) -> list[Record]:
    """The records that one figure can show: all, or even choices of very many."""
    if len(records) <= _MOST_CURVES:
        return list(records)
    places = np.round(np.linspace(0, len(records) - 1, _MOST_CURVES)).astype(int)
    return [records[place] for place in places]


def _of(shown: Sequence[Record], every: int) -> str:
    """What the caption adds where not every record is shown."""
    return f" Shown are {len(shown)} of {every} records." if len(shown) < every else ""


def _balls(record: Record) -> str:
    if not record.clearance:
        return "without NES"
    return "b = " + " + ".join(f"{1e3 * b:g}" for b in record.clearance) + " mm"


def _releases(records: Sequence[Record], results: Path) -> Iterator[tuple[Figure, Drawn]]:
    free = [r for r in records if r.test == "ringdown" and not r.added_mass][:1]
    for balls, word in ((1, "one NES"), (2, "two NESs")):
        chosen = sorted(
            (r for r in records if r.test == "transient" and len(r.clearance) == balls),
            key=lambda r: r.clearance,
        )
        every, chosen = len(chosen), spread(chosen)
        traces = []
        for record in [*free, *chosen] if chosen else []:
            with open_record(results / f"conditioned/{record.id}.nc") as view:
                if "displacement" in view.roles:
                    traces.append(amplitude(view, _balls(record), record.id))
        if not traces:
            continue
        latest = max(trace.time[-1] for trace in traces[len(free) :])
        traces = [
            replace(t, time=t.time[t.time <= latest], values=t.values[t.time <= latest])
            for t in traces
        ]
        figure = amplitudes(traces, xlabel="time (s)", ylabel="amplitude (mm)", bare=len(free))
        text = (
            "A ball in step with the mass takes energy out along "
            "a nearly straight line until it loses step at T1; after that the decay is slow."
        ) + _of(chosen, every)
        head, name = f"Decay after release with {word}", ("one", "two")[balls - 1]
        yield figure, Drawn(f"transient_{name}_nes", "transient", head, text)
