"""The figures of what single records hold: traces, impacts, releases, sweeps, decays, replays."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.figures.numbers import plus_minus
from vinesexp.figures.record_words import settings_of, short, titled
from vinesexp.figures.style import COLOURS, SEQUENCE, Drawn, key, label, link, new_figure, panels
from vinesexp.identification.bounces import Bounces, bounces_of
from vinesexp.identification.decay_table import of_ringdown
from vinesexp.identification.estimate import Estimate, read_estimates
from vinesexp.records.campaign.schema import RELEASES, Campaign, Record
from vinesexp.records.stored.result_columns import DECAY, REPLAY_CYCLES
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import RecordView, open_record
from vinesexp.records.stored.tables import columns_of, read_rows
from vinesexp.results import CampaignResults
from vinesexp.signals.impacts.impact_table import Impacts, read_impacts
from vinesexp.signals.means import equal_parts, extremes_of_parts
from vinesexp.theory.regime_definitions import PERMANENT
from vinesexp.units import COVERAGE_95, counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Shown units of each channel: name with unit, factor from SI.
_SHOWN = {
    "displacement": ("displacement (mm)", 1e3),
    "base": ("base (mm)", 1e3),
    "acceleration": ("acceleration (m/s²)", 1.0),
    "sound": ("sound (uncalibrated)", 1.0),
}
_MOST_CURVES = 14  # in one figure
_NUMBERS = {1: "one", 2: "two", 3: "three", 4: "four"}
_MOST_POINTS = 1200  # of a drawn line

# Time histories: a long trace as what a screen can show of it; whole records; amplitudes.
#: Columns of a trace that is drawn as a band from its smallest to its largest value: one to 0.9
#: points of a figure 7 in wide.
COLUMNS = 560

# Figures of ring-downs: a decay beside what was identified from it, M from added masses.
Found = Mapping[str, Estimate]

#: Terms of a law of damping beyond the viscous one, named.
_LAW = {"damping_quadratic": "quadratic", "damping_coulomb": "Coulomb"}


def draw_replay(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """Up to five records: a permanent and a modulated response, a sweep, a release, a decay."""
    by_record = results.by_record("replay_cycles")
    records = [record for record in results.campaign.records if record.id in by_record]
    chosen = _chosen(records, results.regime_of)
    if not chosen:
        return
    title = (
        "Measured amplitude, cycle by cycle, and the same record simulated with the identified "
        "rig, the effects found and the measured base"
    )
    text = (
        "The band covers several starts, because the position of the ball was not measured. Where "
        "the motion is chaotic, only mean and range can agree, not the curve."
    )
    figure, axes, columns = panels(len(chosen), 2, above=0.5, each=2.0)
    for axis, name in zip(axes, (record.id for record in chosen), strict=True):
        time, *lengths = columns_of(by_record[name], REPLAY_CYCLES.names[1:])
        measured, replayed, low, high = (1e3 * length for length in lengths)
        axis.fill_between(time, low, high, color=COLOURS["exact"], alpha=0.25, linewidth=0)
        axis.plot(time, replayed, color=COLOURS["exact"], linewidth=1.4)
        axis.plot(time, measured, color=COLOURS["measured"], linewidth=0.7)
        link(axis.set_title(short(name)), name, f"page of {name}")
        axis.set(xmargin=0.01, ylim=(0.0, 1.1 * float(max(high.max(), measured.max()))))
    for axis in axes[-columns:]:
        axis.set_xlabel("time (s)")
    for axis in axes[::columns]:
        axis.set_ylabel("amplitude (mm)")
    entries = [("-", "measured", "measured"), ("-", "exact", "replayed: median and range")]
    key(figure, axes[0], entries)
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


@dataclass(frozen=True)
class DrawnDecay:
    """Amplitude of one ring-down, cycle by cycle, beside what was fitted to it.

    Attributes
    ----------
    name : of the record.
    time : middle of each cycle, s.
    amplitude : mm.
    fits : mm; the exponential, and last the law with damping that depends on amplitude, where one
        was found.
    law : what the last one is, ``viscous and quadratic damping``.
    """

    name: str
    time: FloatArray
    amplitude: FloatArray
    fits: tuple[FloatArray, ...]
    law: str


def ringdowns_and_fits(trace: Trace, decays: Sequence[DrawnDecay], *, title: str) -> Figure:
    """The first decay with its fitted envelope, and what is left of the amplitude of every decay.

    Parameters
    ----------
    trace : Trace
        Displacement of the first, mm.
    decays : sequence of DrawnDecay
    title : str
        With the fitted values.
    """
    figure, (above, below) = new_figure(
        2, 1, height=4.4, sharex=True, gridspec_kw={"height_ratios": [1.4, 1.0]}
    )
    draw_trace(above, trace)
    shown, envelope = decays[0], decays[0].fits[-1]
    for sign in (1.0, -1.0):
        above.plot(shown.time, sign * envelope, color=COLOURS["exact"], linewidth=1.4)
    middle = shown.time.size // 6
    label(above, shown.law, (shown.time[middle], envelope[middle]), "exact", (8, 8))
    above.set(title=title, ylabel="displacement (mm)", xmargin=0.01)
    inks = sequence(len(decays))
    for decay, ink in zip(decays, inks, strict=True):
        for fit in decay.fits:
            share, alpha = 100.0 * (decay.amplitude - fit) / fit[0], 0.3
            alpha = 1.0 if fit is decay.fits[-1] else alpha
            below.plot(decay.time, share, "o-", color=ink, markersize=2, linewidth=0.8, alpha=alpha)
    if len(decays) > 1:
        entries = [("o-", ink, short(one.name)) for one, ink in zip(decays, inks, strict=True)]
        said = "faint: exponential instead of the fit" if len(shown.fits) > 1 else ""
        columns = max(int(90 / (6 + max(len(name) for *_, name in entries))), 1)
        key(figure, below, entries, columns=columns, place="outside lower right", title=said)
    below.axhline(0.0, color=COLOURS["exact"], linewidth=1.0)
    below.set(xlabel="time (s)", ylabel="amplitude minus fit\n(% of the start)")
    figure.align_ylabels()
    return figure


def added_mass_line(
    points: Sequence[tuple[str, float, float, float]], *, M: float, title: str
) -> Figure:
    """Squared period over added mass, a straight line; and how far each point is off it, in grams.

    Parameters
    ----------
    points : sequence of (str, float, float, float)
        Of each record its id, its added mass, kg, 1/(2 pi f)^2, s^2, and half of the 95 % interval
        of what it is off the line, kg.
    M : float
        The identified mass, kg: the line is (M + load)/k1.
    title : str
        With the identified mass.
    """
    names = [point[0] for point in points]
    loads, periods, half = np.array([point[1:] for point in points]).T
    figure, (line, off) = new_figure(1, 2, height=2.7, gridspec_kw={"width_ratios": [1.0, 1.35]})
    k1 = float(np.mean((M + loads) / periods))
    away = k1 * periods - (M + loads)
    reach = np.array([-M, 1.05 * float(loads.max())])
    line.plot(reach, 1e4 * (M + reach) / k1, color=COLOURS["exact"])
    line.plot(loads, 1e4 * periods, "o", color=COLOURS["measured"])
    line.plot(-M, 0.0, "o", color=COLOURS["exact"], markerfacecolor="white")
    label(line, f"−M = −{M:.4g} kg", (-M, 0.0), "exact", (6, -1), va="top")
    line.set(title=title, xlabel="added mass (kg)", ylabel="1/(2πf)² (10⁻⁴ s²)")
    line.set_ylim(bottom=-0.2 * line.get_ylim()[1])  # room for the name of the intercept
    off.axhline(0.0, color=COLOURS["exact"])
    own = COLOURS["measured"]
    off.errorbar(  # all bars at once: a call for each takes as long as all else of the figure
        1e3 * loads, 1e3 * away, 1e3 * half, fmt="none", ecolor=own, capsize=3
    )
    for name, load, far in zip(names, loads, away, strict=True):
        (point,) = off.plot(1e3 * load, 1e3 * far, "o", color=own)
        link(point, name, f"{name}: {1e3 * load:g} g, {1e3 * far:+.2g} g off the line")
    off.set(title="distance from the line", xlabel="added mass (g)", ylabel="off the line (g)")
    off.margins(x=0.1, y=0.15)
    return figure


def draw_ringdowns(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """A decay with its exponential, and the line of added masses where there are some."""
    campaign, paths = results.campaign, ResultPaths(results.folder)
    found = {
        record.id: own
        for record in campaign.records
        if record.test == "ringdown" and not record.exclude
        if (own := of_ringdown(read_estimates(paths.estimates(record.id))))
    }
    bare = [r for r in campaign.records if r.id in found and not r.added_mass]
    decays = [_decay(record, found[record.id], paths) for record in bare[:6]]
    if decays := [decay for decay in decays if decay.time.size]:
        yield _decays_drawn(decays, results)
    yield from _line(results, found)


def _decay(record: Record, own: Found, paths: ResultPaths) -> DrawnDecay:
    """The decay of one record as the estimate step left it, mm."""
    time, amplitude, law, viscous = columns_of(
        read_rows(paths.decay(record.id), DECAY), DECAY.names
    )
    named = " and ".join(word for name, word in _LAW.items() if name in own)
    fits = (1e3 * viscous, 1e3 * law) if named else (1e3 * viscous,)
    said = f"viscous and {named} damping" if named else "exponential"
    return DrawnDecay(record.id, time, 1e3 * amplitude, fits, said)


def _decays_drawn(decays: Sequence[DrawnDecay], results: CampaignResults) -> tuple[Figure, Drawn]:
    record = decays[0].name
    with open_record(ResultPaths(results.folder).conditioned(record)) as view:
        trace = whole_trace(view, "displacement", frequency=view.oscillation or 0.0)
    values = [
        f"{symbol} = {plus_minus(row['value'], row['std_error'] or 0.0, row['unit'])}"
        for symbol, name in (("f₀", "f0"), ("ζ", "zeta"))
        if (row := results.values.get(name))
    ]
    title = short(record) + (f"\nall records: {', '.join(values)}" if values else "")
    head = f"Above: ring-down {record} (bandpassed) with the identified envelope"
    text = (
        "Below: amplitude of each ring-down minus its fit, cycle by cycle. Scatter around zero is "
        "noise; a bow means that the damping follows another law."
    )
    if len(decays[0].fits) > 1:
        text += (
            " The faint points are the differences from an exponential: damping depends on "
            "amplitude, and the ζ of the title holds at the amplitude where the records determine "
            "it best."
        )
    figure = ringdowns_and_fits(trace, decays, title=title)
    return figure, Drawn("ringdown_fit", "ringdown", head, text)


def _line(results: CampaignResults, found: Mapping[str, Found]) -> Iterator[tuple[Figure, Drawn]]:
    campaign = results.campaign
    records = [record for record in campaign.records if record.id in found]
    wanted = ("M", "added mass")
    rows = results.rows("identified")
    row = next((r for r in rows if (r["parameter"], r["method"]) == wanted), None)
    if row is None:
        return
    M = row["value"]
    points = [
        (r.id, r.added_mass or 0.0, (2.0 * np.pi * f0.value) ** -2.0, _half(campaign, r, f0, M))
        for r in records
        for f0 in [found[r.id]["f0"]]
    ]
    title = f"M = {plus_minus(M, row['std_error'] or 0.0, 'kg')}"
    figure = added_mass_line(points, M=M, title=title)
    text = (
        "Left: the squared period grows with the mass along a straight line, which meets zero at "
        "minus the mass of the oscillator. Right: distance of each ring-down from that line, as a "
        "mass. Bars are 95 % intervals from the frequency, from mounting the masses again and from "
        "weighing them. A point that is off by much more than its bar may have a wrong added mass."
    )
    yield figure, Drawn("ringdown_added_mass", "ringdown", "Ring-downs with added masses", text)


def _half(campaign: Campaign, record: Record, f0: Estimate, M: float) -> float:
    """Half of the 95 % interval of how far a ring-down is off the line, kg."""
    load = record.added_mass or 0.0
    stated = campaign.known.uncertainties
    frequency = np.hypot(f0.std_error, stated.remounting.of(f0.value) if load else 0.0) / f0.value
    weighed = stated.added_mass.of(load) if load else 0.0
    return float(COVERAGE_95 * np.hypot(2.0 * (M + load) * frequency, weighed))


@dataclass(frozen=True)
class Trace:
    """One channel to be drawn: times, s, and values in the unit to be shown.

    Where `high` is given, `values` are the smallest and `high` the largest of each part of a trace
    that has more samples than a screen has columns. `record` is the id to whose page it leads.
    """

    name: str
    time: FloatArray
    values: FloatArray
    high: FloatArray | None = None
    record: str = ""

    @property
    def colour(self) -> str:
        """That of its channel, the first word of its name."""
        return COLOURS[self.name.split()[0]]

    @property
    def label(self) -> str:
        """Its name beside an axis."""
        return self.name.replace(" ", "\n", 1)


#: Columns that a cycle takes at least where it is to be seen as one.
_A_CYCLE = 8


def columns_of_screen(cycles: float) -> int:
    """In how many parts a trace of so many cycles is drawn.

    Where a cycle has too few columns to be seen, a part is a cycle: in shorter ones the largest and
    smallest sample would beat with the oscillation, and a steady motion look modulated.

    Examples
    --------
    >>> [columns_of_screen(cycles) for cycles in (10.0, 400.0, 3000.0, 0.0)]
    [560, 400, 500, 560]
    """
    if cycles * _A_CYCLE <= COLUMNS:
        return COLUMNS
    whole = math.ceil(cycles / COLUMNS)  # cycles in a part
    return max(int(cycles / whole), 1)


def draw_trace(axis: Axes, trace: Trace) -> None:
    """Draw a trace as a line, or as a band where it is smallest and largest values."""
    if trace.high is None:
        axis.plot(trace.time, trace.values, color=trace.colour, linewidth=0.9)
    else:
        axis.fill_between(trace.time, trace.values, trace.high, color=trace.colour, linewidth=0.4)


def draw_amplitudes(traces: Sequence[Trace], *, xlabel: str, bare: int = 0) -> Figure:
    """Amplitudes of several records on one axis; the first `bare` of them, without NES, in grey."""
    figure, (axis,) = new_figure(height=3.6)
    colours = [COLOURS["bare"]] * bare + sequence(len(traces) - bare)
    for trace, colour in zip(traces, colours, strict=True):
        (line,) = axis.plot(trace.time, trace.values, color=colour, label=trace.name, linewidth=1.1)
        link(line, trace.record, f"{trace.record}: {trace.name}")
    axis.legend(loc="upper right", ncols=2 if len(traces) > 5 else 1, fontsize=8)
    axis.set(xlabel=xlabel, ylabel="amplitude (mm)", ylim=(0.0, None), xmargin=0.01)
    return figure


def sequence(n: int) -> list[str]:
    """`n` colours: the palette's, or from dark to light where it has too few."""
    if n <= len(SEQUENCE):
        return list(SEQUENCE[:n])
    import matplotlib as mpl
    from matplotlib.colors import to_hex

    return [to_hex(colour) for colour in mpl.colormaps["viridis"](np.linspace(0.0, 0.92, n))]


def impacts_on_acceleration(
    whole: Trace, zoom: Trace, impacts: Impacts, *, title: str, motion: Trace | None = None
) -> Figure:
    """Bandpassed acceleration, the jump of every impact, and a few cycles enlarged.

    Parameters
    ----------
    whole, zoom : Trace
        Acceleration, m/s^2: the whole record and the enlarged stretch.
    impacts : Impacts
    motion : Trace, optional
        Displacement in the enlarged stretch, mm.
    """
    jumps = bool(np.isfinite(impacts.velocity_jump_m_s).any())
    ratios = [1.0, 0.8, 1.5] if jumps else [1.0, 1.5]
    figure, (above, *middle, below) = new_figure(
        len(ratios), 1, height=5.6 if jumps else 4.4, gridspec_kw={"height_ratios": ratios}
    )
    draw_trace(above, whole)
    above.axvspan(zoom.time[0], zoom.time[-1], color=COLOURS["published"], alpha=0.35, linewidth=0)
    above.set(title=title, ylabel=whole.label, xmargin=0.01)
    for axis in middle:
        _jumps(axis, impacts)
        axis.set_xlim(above.get_xlim())
    (*middle, above)[0].set_xlabel("time (s)")
    _enlarged(below, zoom, impacts, motion)
    figure.align_ylabels()
    return figure


def _jumps(axis: Axes, impacts: Impacts) -> None:
    jump = np.abs(impacts.velocity_jump_m_s)
    step = max(-(-impacts.n // 1500), 1)
    for side, colour in ((1, "impact +1"), (-1, "impact -1"), (0, "impact")):
        chosen = np.flatnonzero(impacts.side == side)[::step]
        size = 2.2 if impacts.n > 100 else 3.5
        time, ink = impacts.time_s[chosen], COLOURS[colour]
        axis.plot(time, jump[chosen], "o", color=ink, markersize=size, markeredgewidth=0)
    largest = float(np.nanmax(jump, initial=0.0))
    top = 1.12 * largest if largest > 0.0 else None
    axis.set(ylabel="velocity jump\n(m/s)", ylim=(0.0, top))


def _enlarged(axis: Axes, zoom: Trace, impacts: Impacts, motion: Trace | None) -> None:
    draw_trace(axis, zoom)
    top = max(_top(zoom.values), 0.0 if zoom.high is None else _top(zoom.high))
    inside = (impacts.time_s >= zoom.time[0]) & (impacts.time_s <= zoom.time[-1])
    for side, place, marker in ((1, 1.15, "v"), (-1, -1.15, "^"), (0, 1.15, "v")):
        marks = impacts.time_s[inside & (impacts.side == side)]
        if not marks.size:
            continue
        colour = COLOURS[f"impact {side:+d}" if side else "impact"]
        axis.plot(marks, np.full(marks.size, place * top), marker, color=colour, markersize=5)
        name = f"wall {side:+d}" if side else "impact"
        label(axis, name, (marks[0], place * top), colour, (6, 0))
    limits = (-1.35 * top, 1.35 * top)
    axis.set(xlabel="time (s), enlarged", ylabel=zoom.label, xmargin=0.01, ylim=limits)
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


def draw_records(found: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """Every figure of the family, with its entry for the list."""
    results, usable = found.folder, list[Record]()
    for record in found.as_found.records:
        with open_record(ResultPaths(results).conditioned(record.id)) as view:
            usable += [record] if view.refused is None and not record.exclude else []
    for test in ("ringdown", "periodic", "transient", "drop"):
        for record in _representative([r for r in usable if r.test == test]):
            yield from draw_record(record, results, stated=found.campaign.record(record.id))
    yield from _sweeps([r for r in usable if r.test == "sweep"], found)
    yield from _releases([r for r in usable if r.test in RELEASES], found)


def draw_record(
    record: Record, results: Path, *, stated: Record | None = None
) -> Iterator[tuple[Figure, Drawn]]:
    """One record: its channels as measured, and its impacts where it has any.

    `stated` is the record as the test log has it.
    """
    title = titled(record, stated)
    yield _overview(record, results, title)
    if record.test == "drop":
        yield from _bounces(record, results, title)
    elif record.clearance:
        yield from _impacts(record, results, title)


def _representative(records: Sequence[Record]) -> Sequence[Record]:
    """The record in the middle of the tested clearances; the first where there are none."""
    single = sorted((r for r in records if len(r.clearance) == 1), key=lambda r: r.clearance)
    return [single[len(single) // 2]] if single else records[:1]


def extremes(
    view: RecordView, role: str, parts: int, begin: int = 0, end: int | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Middle time, smallest and largest sample (SI) in `parts` equal parts of [begin, end)."""
    n = (view.n if end is None else end) - begin
    edges = begin + equal_parts(n, parts)
    low, high = extremes_of_parts(partial(view.read, role), edges)
    middle = np.asarray(view.start + 0.5 * (edges[:-1] + edges[1:] - 1) / view.sample_rate)
    return middle, low, high


def whole_trace(
    view: RecordView, role: str, *, frequency: float = 0.0, begin: int = 0, end: int | None = None
) -> Trace:
    """A channel over the whole record, or from `begin` to `end`, in the unit that is shown.

    `frequency` of the oscillation, Hz; 0 where there is none, or each cycle has many columns.
    """
    name, factor = _SHOWN[role]
    n = (view.n if end is None else end) - begin
    if n <= 2 * COLUMNS:
        return Trace(name, view.time(begin, end), factor * view.read(role, begin, end))
    cycles = frequency * n / view.sample_rate
    time, low, high = extremes(view, role, columns_of_screen(cycles), begin, end)
    return Trace(name, time, factor * low, factor * high)


def amplitude_trace(view: RecordView, name: str, record: str = "") -> Trace:
    """Half the swing of the displacement in each cycle, mm."""
    frequency = view.oscillation or 0.0
    cycles = round(frequency * view.n / view.sample_rate)
    time, low, high = extremes(view, "displacement", max(cycles, 1) if frequency else 200)
    part = -(-time.size // _MOST_POINTS)
    count = time.size // part * part
    middle = time[:count].reshape(-1, part).mean(axis=1)
    swing = 0.5e3 * (high - low)[:count].reshape(-1, part).max(axis=1)
    return Trace(name, middle, swing, record=record)


def _overview(record: Record, results: Path, title: str) -> tuple[Figure, Drawn]:
    """Every channel over the whole length."""
    frequency = _oscillation(record, results)
    with open_record(ResultPaths(results).record(record.id)) as view:
        traces = [
            whole_trace(view, role, frequency=frequency) for role in _SHOWN if role in view.roles
        ]
    figure, axes = new_figure(len(traces), 1, height=0.6 + 1.1 * len(traces), sharex=True)
    for axis, trace in zip(axes, traces, strict=True):
        draw_trace(axis, trace)
        axis.set_ylabel(trace.label)
    axes[-1].set(xlabel="time (s)", xmargin=0.01)
    axes[0].set_title(title)
    figure.align_ylabels()
    head = f"Record {record.id} as measured: calibrated, nothing filtered"
    text = "Look for drift, clipping and gaps."
    return figure, Drawn(f"record_{record.test}", record.test, head, text)


def _oscillation(record: Record, results: Path) -> float:
    """Frequency that the record was conditioned with, Hz; 0 for a drop test."""
    with open_record(ResultPaths(results).conditioned(record.id)) as view:
        return 0.0 if record.test == "drop" else view.oscillation or 0.0


def _impacts(record: Record, results: Path, title: str) -> Iterator[tuple[Figure, Drawn]]:
    marks, role = read_impacts(ResultPaths(results).impacts(record.id)), "acceleration"
    with open_record(ResultPaths(results).conditioned(record.id)) as view:
        if role not in view.roles or not marks.n:
            return
        begin, end = _stretch(view, record, marks)
        zoom = whole_trace(view, role, begin=begin, end=end)
        motion = None
        if "displacement" in view.roles:
            x = 1e3 * view.read("displacement", begin, end)
            motion = Trace("displacement", view.time(begin, end), x)
        trace = whole_trace(view, role, frequency=_oscillation(record, results))
    title = f"{title}, {counted(marks.n, 'impact')}"
    figure = impacts_on_acceleration(trace, zoom, marks, title=title, motion=motion)
    middle = (
        "Middle: change of the mass's velocity at each impact, coloured by the wall that was hit. "
    )
    middle = middle if np.isfinite(marks.velocity_jump_m_s).any() else ""
    text = (
        "Above: bandpassed acceleration, every spike an impact; the shaded stretch is enlarged "
        f"below. {middle}Below: the stretch with every impact found marked. Each spike should have "
        "one mark, and each mark one spike."
    )
    yield figure, Drawn(f"impacts_{record.test}", record.test, f"Record {record.id}", text)


def _bounces(record: Record, results: Path, title: str) -> Iterator[tuple[Figure, Drawn]]:
    """A dropped ball: its hits, and r of each bounce over the speed at which it hit the wall."""
    hits = read_impacts(ResultPaths(results).impacts(record.id))
    hits = replace(hits, side=0 * hits.side)  # one wall alone
    with open_record(ResultPaths(results).conditioned(record.id)) as view:
        role = next((one for one in ("acceleration", "sound") if one in view.roles), None)
        if role is None or not hits.n:
            return
        ends = np.array([hits.time_s[0], hits.time_s[-1]])
        ends += np.array([-0.08, 0.08]) * np.ptp(ends) + np.array([-0.02, 0.02])
        first, last = np.clip(np.rint((ends - view.start) * view.sample_rate), 0, view.n)
        heard = whole_trace(view, role, begin=int(first), end=int(last))
    figure = hits_and_bounces(heard, hits, title=f"{title}, {counted(hits.n, 'impact')}")
    text = (
        f"Above: bandpassed {role}; each spike should have one mark, and each mark one spike. "
        "Below: r of each bounce, the flight after it over the flight before it, with its 95 % "
        "interval by the times of its hits. The line is r of the record with its 95 % interval."
    )
    if len(figure.axes) == 1:
        text = f"Bandpassed {role}; each spike should have one mark. These hits give no r."
    yield figure, Drawn("impacts_drop", "drop", f"Record {record.id}", text)


def hits_and_bounces(heard: Trace, hits: Impacts, *, title: str) -> Figure:
    """Hits of a dropped ball, marked, and r of each bounce over its speed with r of the drop."""
    found = None
    with suppress(AnalysisError):
        found = bounces_of(hits)
    rows, height = (2, 4.4) if found else (1, 2.2)
    figure, axes = new_figure(rows, 1, height=height)
    _enlarged(axes[0], heard, hits, None)
    axes[0].set(title=title, xlabel="time (s)")
    if found:
        _each_bounce(axes[1], found)
    return figure


def _each_bounce(axis: Axes, found: Bounces) -> None:
    axis.errorbar(
        found.speeds, found.ratios, COVERAGE_95 * found.ratio_errors,
        fmt="o", color=COLOURS["measured"], markersize=3.5, linewidth=0.8,
    )  # fmt: skip
    speeds = np.linspace(found.speeds.min(), found.speeds.max(), 100)
    middle = math.exp(float(np.log(found.speeds).mean()))
    line, half = found.r * (speeds / middle) ** found.power, COVERAGE_95 * found.error
    axis.plot(speeds, line, color=COLOURS["exact"], linewidth=1.4)
    axis.axhspan(found.r - half, found.r + half, color=COLOURS["exact"], alpha=0.2, linewidth=0)
    words = f"r = {plus_minus(found.r, found.error)}"
    axis.set_title(words, loc="right", color=COLOURS["exact"], fontsize=8.0)
    axis.set(xlabel="speed of the impact (m/s)", ylabel="r of each bounce")


def _stretch(view: RecordView, record: Record, marks: Impacts) -> tuple[int, int]:
    """Samples of a few cycles: from the first impact, or in the middle of a periodic test."""
    length = 3.5 / view.oscillation if view.oscillation else 0.5
    middle = marks.n // 2 if record.test == "periodic" else 0
    begin = max(round((marks.time_s[middle] - view.start - 0.08 * length) * view.sample_rate), 0)
    return begin, min(begin + max(round(1.16 * length * view.sample_rate), 2), view.n)


def _sweeps(records: Sequence[Record], found: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    for balls in _numbers_of_balls(records):
        chosen, said = _chosen_of(
            r for r in records if len(r.clearance) in (0, balls) and r.frequency
        )
        bare, traces = sum(not record.clearance for record in chosen), []
        for record, trace in _amplitudes(chosen, found):
            start, end = record.frequency or (0.0, 0.0)
            share = (trace.time - trace.time[0]) / (trace.time[-1] - trace.time[0])
            traces.append(replace(trace, time=start + (end - start) * share))
        if not traces:
            continue
        with_nes = f" with {_nes(balls)}" if bare < len(chosen) else ""
        head = f"Slow sine sweeps{with_nes}: amplitude of the mass over the base's frequency"
        text = (
            "The grey curve is the mass without NES. Where a coloured curve oscillates, the "
            f"response is strongly modulated.{said}"
        )
        figure = draw_amplitudes(traces, xlabel="frequency (Hz)", bare=bare)
        yield figure, Drawn(f"sweep_{_number(balls)}_nes", "sweep", head, text)


def _numbers_of_balls(records: Sequence[Record]) -> list[int]:
    """How many NESs these records have, each number once; one where all are without.

    Examples
    --------
    >>> none, pair = (Record("a", Path("a"), "sweep", clearance=b) for b in ((), (0.02, 0.03)))
    >>> _numbers_of_balls([none]), _numbers_of_balls([pair, none, pair])
    ([1], [2])
    """
    return sorted({len(record.clearance) for record in records} - {0}) or [1]


def _number(balls: int) -> str:
    return _NUMBERS.get(balls, str(balls))


def _nes(balls: int) -> str:
    """In words.

    Examples
    --------
    >>> _nes(1), _nes(3), _nes(9)
    ('one NES', 'three NESs', '9 NESs')
    """
    return f"{_number(balls)} NES{'s' if balls > 1 else ''}"


def evenly_chosen(records: Sequence[Record]) -> list[Record]:
    """The records that one figure can show: all, or even choices of very many."""
    if len(records) <= _MOST_CURVES:
        return list(records)
    places = np.round(np.linspace(0, len(records) - 1, _MOST_CURVES)).astype(int)
    return [records[place] for place in places]


def _chosen_of(records: Iterable[Record]) -> tuple[list[Record], str]:
    """Records that one figure can show, by clearance; and that it does not show all."""
    every = sorted(records, key=lambda record: record.clearance)
    shown = evenly_chosen(every)
    more = f" Shown are {len(shown)} of {len(every)} records." if len(shown) < len(every) else ""
    return shown, more


def _amplitudes(
    records: Iterable[Record], found: CampaignResults
) -> Iterator[tuple[Record, Trace]]:
    """Amplitude of each cycle, of the records that have a displacement."""
    for record in records:
        name = settings_of(record, found.campaign.record(record.id))[0][2]
        with open_record(ResultPaths(found.folder).conditioned(record.id)) as view:
            if "displacement" in view.roles:
                yield record, amplitude_trace(view, name, record.id)


def _releases(records: Sequence[Record], found: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    free = [r for r in records if r.test == "ringdown" and not r.added_mass][:1]
    for balls in _numbers_of_balls(records):
        chosen, said = _chosen_of(
            r for r in records if r.test == "transient" and len(r.clearance) == balls
        )
        traces = [trace for _, trace in _amplitudes([*free, *chosen], found)] if chosen else []
        if not traces:
            continue
        latest = max(trace.time[-1] for trace in traces[len(free) :])
        traces = [
            replace(t, time=t.time[t.time <= latest], values=t.values[t.time <= latest])
            for t in traces
        ]
        text = (
            "While the ball is captured, the amplitude falls along a nearly straight line. After "
            f"the ball is lost, at T1, the decay is slow.{said}"
        )
        head = f"Decay after release with {_nes(balls)}"
        figure = draw_amplitudes(traces, xlabel="time (s)", bare=len(free))
        yield figure, Drawn(f"transient_{_number(balls)}_nes", "transient", head, text)
