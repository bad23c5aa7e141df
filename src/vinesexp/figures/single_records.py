"""The figures of what single records hold: traces, impacts, releases, sweeps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray, IntArray
from vinesexp.figures.numbers import clearances
from vinesexp.figures.style import COLOURS, Drawn, label, new_figure
from vinesexp.figures.traces import Trace, amplitudes, columns_of, draw_trace, overview
from vinesexp.records.campaign.load import Record
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import RecordView, open_record
from vinesexp.results import CampaignResults
from vinesexp.signals.impacts.impact_table import read_impacts

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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


if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_AXES = {"acceleration": "acceleration\n(m/s²)", "sound": "sound\n(uncalibrated)"}
#: Impacts drawn one by one; of more, this many evenly chosen ones.
_IMPACT_SHAPES_MOST_POINTS = 1500


@dataclass(frozen=True)
class Marks:
    """Impacts to be drawn: time, s; side +1, -1 or 0; velocity jump, m/s."""

    time: FloatArray
    side: IntArray
    jump: FloatArray


def impacts_on_acceleration(
    whole: Trace, zoom: Trace, impacts: Marks, *, title: str, motion: Trace | None = None
) -> Figure:
    """Bandpassed acceleration or sound, the jump of every impact, and a few cycles enlarged.

    Parameters
    ----------
    whole, zoom : Trace
        Acceleration, m/s^2, or sound without a scale: the whole record and the enlarged stretch,
        which is named by its role.
    impacts : Marks
    motion : Trace, optional
        Displacement in the enlarged stretch, mm.
    """
    jumps = bool(np.isfinite(impacts.jump).any())  # of a bouncing ball only times are known
    ratios = [1.0, 0.8, 1.5] if jumps else [1.0, 1.5]
    figure, (above, *middle, below) = new_figure(
        len(ratios), 1, height=5.6 if jumps else 4.4, gridspec_kw={"height_ratios": ratios}
    )
    draw_trace(above, whole, colour=COLOURS[zoom.name])
    above.axvspan(zoom.time[0], zoom.time[-1], color=COLOURS["published"], alpha=0.35, linewidth=0)
    above.set_title(title)
    above.set_ylabel(_AXES[zoom.name])
    above.margins(x=0.01)
    for axis in middle:
        _jumps(axis, impacts)
        axis.set_xlim(above.get_xlim())
    (*middle, above)[0].set_xlabel("time (s)")
    _enlarged(below, zoom, impacts, motion)
    figure.align_ylabels()
    return figure


def _jumps(axis: Axes, impacts: Marks) -> None:
    step = max(-(-impacts.time.size // _IMPACT_SHAPES_MOST_POINTS), 1)
    for side, colour in ((1, "impact +1"), (-1, "impact -1"), (0, "impact")):
        chosen = np.flatnonzero(impacts.side == side)[::step]
        size = 2.2 if impacts.time.size > 100 else 3.5
        axis.plot(
            *(impacts.time[chosen], np.abs(impacts.jump[chosen]), "o"),
            color=COLOURS[colour],
            markersize=size,
            markeredgewidth=0,
        )
    largest = float(np.nanmax(np.abs(impacts.jump), initial=0.0))
    axis.set_ylim(0.0, 1.12 * largest if largest > 0.0 else None)
    axis.set_ylabel("velocity jump\n(m/s)")


def _enlarged(axis: Axes, zoom: Trace, impacts: Marks, motion: Trace | None) -> None:
    draw_trace(axis, zoom, colour=COLOURS[zoom.name])
    top = _top(zoom.values)
    inside = (impacts.time >= zoom.time[0]) & (impacts.time <= zoom.time[-1])
    for side, place, marker in ((1, 1.15, "v"), (-1, -1.15, "^"), (0, 1.15, "v")):
        marks = impacts.time[inside & (impacts.side == side)]
        if not marks.size:
            continue
        colour = COLOURS[f"impact {side:+d}" if side else "impact"]
        axis.plot(marks, np.full(marks.size, place * top), marker, color=colour, markersize=5)
        name = f"wall {side:+d}" if side else "impact"
        label(axis, name, (marks[0], place * top), colour=colour, shift=(6, 0))
    axis.set_ylim(-1.35 * top, 1.35 * top)
    axis.set_ylabel(_AXES[zoom.name])
    axis.set_xlabel("time (s), enlarged")
    axis.margins(x=0.01)
    if motion is not None and motion.values.size:
        twin = axis.twinx()
        twin.plot(motion.time, motion.values, color=COLOURS["displacement"], alpha=0.7)
        reach = 1.35 * _top(motion.values)
        twin.set_ylim(-reach, reach)
        twin.set_ylabel("displacement (mm)", color=COLOURS["displacement"])
        twin.tick_params(axis="y", colors=COLOURS["displacement"])
        twin.grid(visible=False)
        twin.margins(x=0.01)


def _top(values: FloatArray) -> float:
    """Largest magnitude, gaps left out; 1 where there is none."""
    return float(np.fmax.reduce(np.abs(values), initial=0.0)) or 1.0


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
    with open_record(ResultPaths(results).conditioned(record.id)) as view:
        return view.refused is None and not record.exclude


def _representative(records: Sequence[Record]) -> Record | None:
    """The record in the middle of the tested clearances; the first where there are none."""
    single = sorted((r for r in records if len(r.clearance) == 1), key=lambda r: r.clearance)
    return single[len(single) // 2] if single else next(iter(records), None)


def extremes(view: RecordView, role: str, parts: int) -> tuple[FloatArray, FloatArray, FloatArray]:
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
    with open_record(ResultPaths(results).record(record.id)) as view:
        traces = [whole(view, role, frequency=frequency) for role in _SHOWN if role in view.roles]
    head = f"Record {record.id} as measured: calibrated, nothing filtered"
    text = "Look for drift, clipping and gaps."
    figure = overview(traces, title=f"{record.id}: {_set_up(record)}")
    return figure, Drawn(f"record_{record.test}", record.test, head, text)


def _oscillation(record: Record, results: Path) -> float:
    """Frequency that the record was conditioned with, Hz; 0 for a drop test."""
    if record.test == "drop":
        return 0.0
    with open_record(ResultPaths(results).conditioned(record.id)) as view:
        return float(view.attributes.get("oscillation_hz") or 0.0)


def marks_of(record: Record, results: Path) -> Marks:
    """The impacts of a record as they are drawn."""
    impacts = read_impacts(ResultPaths(results).impacts(record.id))
    return Marks(time=impacts.time_s, side=impacts.side, jump=impacts.velocity_jump_m_s)


def _impacts(record: Record, results: Path) -> Iterator[tuple[Figure, Drawn]]:
    marks = marks_of(record, results)
    with open_record(ResultPaths(results).conditioned(record.id)) as view:
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
        parts.append(_balls(record))
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
            with open_record(ResultPaths(results).conditioned(record.id)) as view:
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
    return f"b = {clearances(record.clearance)} mm"


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
            with open_record(ResultPaths(results).conditioned(record.id)) as view:
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
