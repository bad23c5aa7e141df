"""The figure of regimes: impacts cycle by cycle in every periodic test, one strip a record."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.figures.record_words import clearance_of
from vinesexp.figures.style import COLOURS, Drawn, label, link, new_figure, regime_colour
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.results import CampaignResults
from vinesexp.signals.impacts.impact_table import read_impacts

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.path import Path as Outline


#: Colours of the numbers of impacts in a cycle, and the means at which one follows the other.
_COLOURS = {
    "none": "#ffffff",
    "one": "#f3c6a5",
    "two": COLOURS["two symmetric"],
    "three or more": COLOURS["three or more per cycle"],
}
_BOUNDS = (0.25, 1.5, 2.25)


@dataclass(frozen=True)
class Strip:
    """Impacts in each cycle of one record: one row of a regime chart."""

    name: str
    regime: str
    per_cycle: FloatArray
    record: str = ""


def regime_strips(groups: Sequence[tuple[str, Sequence[Strip]]]) -> Figure:
    """One strip a record, coloured by the number of impacts in each cycle, over time in cycles.

    Parameters
    ----------
    groups : sequence of (title, strips)
        One panel a group; strips from small to large clearance.
    """
    from matplotlib.patches import PathPatch

    sizes = [len(strips) for _, strips in groups]
    figure, axes = new_figure(
        *(len(groups), 1),
        height=0.9 + sum(0.155 * size + 0.42 for size in sizes),
        gridspec_kw={"height_ratios": [size + 1.2 for size in sizes]},
        sharex=True,
    )
    longest = max(strip.per_cycle.size for _, strips in groups for strip in strips)
    for axis, (title, strips) in zip(axes, groups, strict=True):
        for place, strip in enumerate(strips):
            # A strip has no more columns than a screen shows.
            counts = _columns(strip.per_cycle, max(1, -(-longest // 500)))
            for colour, path in _stretches(counts, strip.per_cycle.size / counts.size, place):
                axis.add_patch(PathPatch(path, facecolor=colour, linewidth=0))
            ink, at = regime_colour(strip.regime), (float(longest), place)
            name = label(axis, strip.regime, at, ink, fontsize=7.5)
            if strip.record:
                link(name, strip.record, f"{strip.record}: {strip.name}, {strip.regime}")
        axis.set_yticks(range(len(strips)), [strip.name for strip in strips], fontsize=7.5)
        axis.set(title=title, xlim=(0.0, float(longest)), ylim=(-0.6, len(strips) - 0.4))
        axis.grid(visible=False)
        axis.tick_params(length=0, axis="y")
    axes[-1].set_xlabel("cycles of the oscillator")
    _key(figure)
    return figure


def _stretches(counts: FloatArray, width: float, place: float) -> Iterator[tuple[str, Outline]]:
    """Stretches of cycles with alike impacts as rectangles, those of one colour as one path.

    As paths they take the colours of a dark page as the legend does, which an image does not.
    Stretches without an impact stay empty.
    """
    from matplotlib.path import Path as Outline

    kinds = np.digitize(counts, _BOUNDS)
    edges = np.flatnonzero(np.diff(kinds, prepend=-1, append=-1))
    for kind, colour in enumerate(tuple(_COLOURS.values())[1:], start=1):
        own = np.flatnonzero(kinds[edges[:-1]] == kind)
        low, high = (width * edges[own + shift] for shift in (0, 1))
        if own.size:
            x = np.stack([low, high, high, low, low], axis=1)
            y = np.broadcast_to(place + 0.4 * np.array([-1.0, -1.0, 1.0, 1.0, -1.0]), x.shape)
            codes = [Outline.MOVETO, *[Outline.LINETO] * 3, Outline.CLOSEPOLY] * own.size
            yield colour, Outline(np.stack([x.ravel(), y.ravel()], axis=1), codes)


def _key(figure: Figure) -> None:
    from matplotlib.patches import Patch

    figure.legend(
        handles=[
            Patch(facecolor=colour, edgecolor="#bbbbbb", linewidth=0.5, label=name)
            for name, colour in _COLOURS.items()
        ],
        loc="outside upper right",
        ncols=4,
        fontsize=8,
        title="impacts per cycle",
        title_fontsize=8,
        alignment="right",
    )


def _columns(values: FloatArray, part: int) -> FloatArray:
    """Means over `part` cycles, so that a long record has no more columns than a screen."""
    whole = values.size // part * part
    return values[:whole].reshape(-1, part).mean(axis=1) if whole else values


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


#: Strips in one figure: of more records, those of the smallest base amplitudes.
_MOST = 60


def draw_regimes(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """One strip a periodic test with a regime in regimes.csv."""
    regime_of = {id: regime for id, regime in results.regime_of.items() if regime}
    records = [r for r in results.as_found.records if r.test == "periodic" and r.id in regime_of]
    records.sort(key=lambda r: (len(r.clearance), r.base_amplitude or 0.0, r.clearance))
    groups, paths = dict[str, list[Strip]](), ResultPaths(results.folder)
    for record in records[:_MOST]:
        title = f"G = {1e3 * (record.base_amplitude or 0.0):g} mm"
        title += f", {len(record.clearance)} NESs" if len(record.clearance) > 1 else ""
        name = f"{clearance_of(record, results.campaign.record(record.id))} mm"
        with open_record(paths.conditioned(record.id)) as view:
            frequency, start = view.oscillation or 0.0, view.start
            length = view.n / view.sample_rate if view.n else 0.0
        times = read_impacts(paths.impacts(record.id)).time_s
        counts = impacts_per_cycle(times, frequency=frequency, start=start, length=length)
        if counts.size:
            strip = Strip(name, regime_of[record.id], counts, record.id)
            groups.setdefault(title, []).append(strip)
    if not groups:
        return
    title = "Impacts in each cycle of every periodic test, one strip a clearance"
    text = (
        "A solid blue strip is a permanent response with two impacts per cycle; blue spells that "
        "come and go are strongly modulated response; where a strip is empty, the ball does not "
        "reach the walls."
    )
    if len(records) > _MOST:
        text += f" Shown are the first {_MOST} of {len(records)} records."
    drawn = Drawn("regimes_periodic", "periodic", title, text)
    yield regime_strips(list(groups.items())), drawn
