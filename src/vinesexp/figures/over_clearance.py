"""Amplitude over clearance of periodic tests, time over clearance of releases, and the optima."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.clearance.comparison import END
from vinesexp.clearance.levels import PeriodicLevel, ReleaseLevel, of_state
from vinesexp.clearance.predicted import amplitude_curve, decay_curves
from vinesexp.figures.style import (
    COLOURS,
    FAINT,
    Drawn,
    key,
    label,
    link,
    new_figure,
    panels,
    regime_colour,
)
from vinesexp.records.stored.tables import Row
from vinesexp.results import CampaignResults
from vinesexp.theory.regime_definitions import each_ball
from vinesexp.units import COVERAGE_95

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Value, low, high; mm. A measured one that is a bound has an end at infinity.
Interval = tuple[float, float, float]

#: Clearance, mm, and what is predicted there; empty where nothing is.
Curve = tuple[FloatArray, FloatArray]


@dataclass(frozen=True)
class DrawnLevel:
    """Periodic tests at one base amplitude, and what is predicted for it.

    Attributes
    ----------
    level : PeriodicLevel
    rows : of regimes.csv, in the order of its tests.
    curve : predicted amplitude, mm.
    lowest, end : rows of clearances.csv, empty without one: clearance of lowest amplitude, and end
        of permanent impacts.
    """

    level: PeriodicLevel
    rows: Sequence[Row]
    curve: Curve
    lowest: Row
    end: Row

    @property
    def G(self) -> float:
        """Base amplitude, mm."""
        return 1e3 * self.level.nominal


def amplitude_over_clearance(valleys: Sequence[DrawnLevel]) -> Figure:
    """One panel a base amplitude: mean (points with 95 % bars) and largest (ticks) amplitude,
    coloured by regime.

    Parameters
    ----------
    valleys : sequence of DrawnLevel
    """
    figure, axes, columns = panels(len(valleys), 3, above=0.7, each=3.1)
    for axis, valley in zip(axes, valleys, strict=True):
        _panel(axis, valley)
        axis.set_title("\n".join(wrap(valley.level.name, _LETTERS // columns)))
    for axis in axes[::columns]:
        axis.set_ylabel("amplitude of the mass (mm)")
    _key(figure, axes[0], valleys)
    return figure


_LETTERS = 90  # of a title that a row of panels has room for


def _panel(axis: Axes, valley: DrawnLevel) -> None:
    axis.plot(*valley.curve, color=COLOURS["exact"], linewidth=1.6, zorder=2)
    for test, row in zip(valley.level.tests, valley.rows, strict=True):
        b, mean = 1e3 * test.clearance, 1e3 * (test.value or 0.0)
        largest = 1e3 * row["amplitude_max_m"]
        half = 1e3 * COVERAGE_95 * (row.get("amplitude_error_m") or np.nan)
        colour, known = regime_colour(test.regime), ""
        axis.plot(b, largest, "_", color=colour, markersize=6, alpha=0.6, zorder=3)
        if np.isfinite(half):
            axis.errorbar(b, mean, half, color=colour, elinewidth=1.0, capsize=2.5, zorder=3)
            known = f" ± {half:.2g}"
        (point,) = axis.plot(b, mean, "o", color=colour, zorder=4)
        words = (
            f"{test.record}: b = {b:g} mm, mean {mean:.4g}{known} mm over "
            f"{int(row.get('cycles') or 0)} cycles, largest {largest:.3g} mm"
        )
        link(point, test.record, f"{words}, {test.regime}")
    top = 1.3e3 * max(row["amplitude_max_m"] for row in valley.rows)
    axis.set(xlabel="clearance b (mm)", xmargin=0.08, ylim=(0.0, top))
    _predicted(axis, valley.lowest, top)
    axis.set_xlim(axis.get_xlim())  # brackets do not widen it
    for row, share, name, colour in (
        (valley.lowest, 0.10, "lowest", "measured"),
        (valley.end, 0.03, "end", "strongly modulated"),
    ):
        if interval := _interval(row, "measured"):
            _bracket(axis, interval, share * top, name, colour)


def _predicted(axis: Axes, row: Row, top: float) -> None:
    """Both b_c as lines; their names on either side, so that near ones do not overlap."""
    known = {name: row[f"{name}_mm"] for name in ("exact", "published") if row.get(f"{name}_mm")}
    if exact := _interval(row, "predicted", "exact_mm"):
        axis.axvspan(*exact[1:], color=COLOURS["exact"], alpha=0.25, linewidth=0, zorder=0)
    lesser = min(known, key=known.__getitem__) if "exact" in known else ""
    for name, value in known.items():
        style, words = ("-", "exact $b_c$") if name == "exact" else ("--", name)
        axis.axvline(value, color=COLOURS[name], linewidth=1.0, linestyle=style, zorder=0)
        shift, side = (-3, "right") if name == lesser else (3, "left")
        at = value, 0.99 * top
        label(axis, f"{words}\n{value:.1f}", at, name, (shift, 0), ha=side, va="top")


def _bracket(axis: Axes, interval: Interval, height: float, name: str, colour: str) -> None:
    (value, low, high), ink = interval, COLOURS[colour]
    left, right = axis.get_xlim()
    ends = max(low, left), min(high, right)
    axis.plot(ends, [height] * 2, "-", color=ink, linewidth=1.4)
    for end, edge, mark in ((low, left, "<"), (high, right, ">")):
        # An arrow: it may lie beyond what was tried.
        at, kind, size = (edge, mark, 5) if math.isinf(end) else (end, "|", 7)
        axis.plot(at, height, kind, color=ink, markersize=size, clip_on=False)
    if math.isinf(high - low):
        text = f"{name} below {high:g}" if math.isinf(low) else f"{name} above {low:g}"
        label(axis, text, (0.5 * sum(ends), height), colour, (0, 7), ha="center")
        return
    axis.plot(value, height, "o", color=ink, markersize=3.5)
    text = f"{name} {value:.1f}"
    if low - left > 0.36 * (right - left):
        label(axis, text, (low, height), colour, (-5, 0), ha="right")
    else:  # beside the bracket it would lie over the axis
        label(axis, text, (0.5 * sum(ends), height), colour, (0, 7), ha="center")


def _key(figure: Figure, axis: Axes, valleys: Sequence[DrawnLevel]) -> None:
    """What is drawn in any panel, and nothing else."""
    tests = [test for valley in valleys for test in valley.level.tests]
    regimes = {each_ball(test.regime)[0] for test in tests}
    entries = [("o", name, f"mean, {name}") for name in COLOURS if name in regimes]
    entries.append(("_", "measured", "largest"))
    if any(_interval(valley.lowest, "measured") for valley in valleys):
        entries.append(("|-", "measured", "lowest: clearance of the lowest mean"))
    if any(_interval(valley.end, "measured") for valley in valleys):
        entries.append(("|-", "strongly modulated", "end: of two impacts per cycle"))
    if any(valley.curve[0].size for valley in valleys):
        entries.append(("-", "exact", "predicted for two impacts per cycle"))
    key(figure, axis, entries, columns=3)


def optimum_over_level(valleys: Sequence[DrawnLevel]) -> Figure:
    """How far each measured clearance is from the exact b_c, over base amplitude.

    Parameters
    ----------
    valleys : sequence of DrawnLevel
        With an exact b_c each.
    """
    figure, (axis,) = new_figure(height=3.2)
    beyond = 0.25 * (valleys[-1].G - valleys[0].G or 1.0)
    width = 0.02 * max(valley.G for valley in valleys)
    for valley in valleys:
        row = valley.lowest
        span, exact = [valley.G - width, valley.G + width], row["exact_mm"]
        _, low, high = _interval(row, "predicted", "exact_mm") or (1.0, 1.0, 1.0)
        low, high = (100.0 * (end / exact - 1.0) for end in (low, high))
        axis.fill_between(span, low, high, color=COLOURS["exact"], alpha=0.3, linewidth=0)
        if row["published_mm"] is not None:
            away = 100.0 * (row["published_mm"] / exact - 1.0)
            axis.plot(span, [away, away], "--", color=COLOURS["published"])
        _deviation(axis, valley, exact, 0.08 * beyond)
    axis.axhline(0.0, color=COLOURS["exact"], linewidth=1.0)
    entries = [
        ("-", "exact", "exact $b_c$, 95 % interval shaded"),
        ("--", "published", "published $b_c$"),
        ("s", "strongly modulated", "end of two impacts per cycle"),
        ("o", "measured", "lowest amplitude"),
    ]
    key(figure, axis, entries)
    axis.set(xlabel="base amplitude G (mm)", ylabel="clearance from the exact $b_c$ (%)")
    axis.set_xlim(valleys[0].G - beyond, valleys[-1].G + beyond)
    axis.margins(y=0.15)
    return figure


def _deviation(axis: Axes, valley: DrawnLevel, exact: float, beside: float) -> None:
    """Both measured clearances of one base amplitude, with their brackets."""
    for row, marker, colour, place, side in (
        (valley.lowest, "o", "measured", 1.0, "left"),
        (valley.end, "s", "strongly modulated", -1.0, "right"),
    ):
        kind = _interval(row, "measured")
        if kind is None or math.isinf(kind[2] - kind[1]):
            continue  # a bound is no point
        value, low, high = (100.0 * (b / exact - 1.0) for b in kind)
        at = (valley.G + place * beside, value)  # else one bracket would cover the other
        reach, ink = [[value - low], [high - value]], COLOURS[colour]
        axis.errorbar(*at, reach, fmt=marker, color=ink, capsize=3, markersize=4.5)
        words = f"{kind[0]:.1f} mm"
        label(axis, words, at, colour, (9.0 * place, 0), ha=side)


def time_over_clearance(
    levels: Sequence[tuple[ReleaseLevel, Curve, Interval | None]],
    *, title: str, published: float | None, exact: float | None,
) -> Figure:  # fmt: skip
    """Time to each amplitude over clearance, predicted and measured; both b_t as marks.

    Each level with its predicted curve (mm, s) and the best clearance measured, mm.
    """
    figure, (axis,) = new_figure(height=3.6)
    for level, curve, best in levels:
        axis.plot(*curve, color=COLOURS["exact"], linewidth=1.2, zorder=1)
        (b, time), i = curve, int(curve[1].argmin()) if curve[1].size else 0
        if 0 < i < b.size - 1:  # the predicted fastest one lies inside what was tried
            axis.plot(b[i], time[i], "o", color=COLOURS["exact"], markerfacecolor="white", zorder=2)
            label(axis, f"{b[i]:.0f} mm", (b[i], time[i]), "exact", (0, 8), ha="center")
        _measured_times(axis, level, best)
    axis.set_ylim(bottom=0.0)
    top = 1.12 * axis.get_ylim()[1]
    axis.set_ylim(0.0, top)
    axis.margins(x=0.1)
    for name, value, style in (("published", published, "--"), ("exact", exact, "-")):
        if value is not None:
            axis.axvline(value, color=COLOURS[name], linestyle=style, linewidth=1.0, zorder=0)
            low, high = axis.get_xlim()
            at_edge = name == "exact" and value - low < 0.2 * (high - low)
            left = name == "exact" and not at_edge
            shift = -3 if left else 3, -10 if at_edge else 0  # below the name of the other
            words, at = f"{name} $b_t$ {value:.1f}", (value, 0.99 * top)
            label(axis, words, at, name, shift, ha="right" if left else "left", va="top")
    axis.set(title=title, xlabel="clearance b (mm)", ylabel="time to the amplitude (s)")
    return figure


def _measured_times(axis: Axes, level: ReleaseLevel, best: Interval | None) -> None:
    """Times to one amplitude; NaN where a test never reached it."""
    clearance = 1e3 * np.array([test.clearance for test in level.tests])
    times = np.array([np.nan if test.value is None else test.value for test in level.tests])
    axis.plot(clearance, times, "-", color=FAINT, linewidth=0.8, zorder=0)
    for test, b, time in zip(level.tests, clearance, times, strict=True):
        if np.isfinite(time):
            (point,) = axis.plot(b, time, "o", color=COLOURS["measured"], zorder=3)
            to = f"to {1e3 * level.target:g} mm in {time:.3g} s"
            link(point, test.record, f"{test.record}: b = {b:g} mm, {to}")
    last = int(np.flatnonzero(np.isfinite(times))[-1])
    name = f"to {1e3 * level.target:g} mm"
    label(axis, name, (clearance[last], times[last]), "measured", (8, 0))
    if best:
        low, high = max(best[1], clearance[0]), min(best[2], clearance[-1])
        time = float(times[np.argmin(np.abs(clearance - best[0]))])
        axis.plot([low, high], [time, time], "|-", color=COLOURS["impact"], linewidth=1.4)
        axis.plot(best[0], time, "o", color=COLOURS["impact"], markersize=6, zorder=4)


def draw_clearances(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """Amplitude over clearance of the periodic tests, and time over clearance of the releases."""
    yield from _periodic(results)
    yield from _releases(results)


def _periodic(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    valleys = [_valley(level, results) for level in results.periodic]
    if not valleys:
        return
    line = (
        " The green line is the amplitude that the exact periodic orbit has with the identified "
        "values, up to b_c, where it ends."
        if any(valley.curve[0].size for valley in valleys)
        else ""
    )
    text = (
        "Points are mean amplitudes, coloured by regime, with bars of their 95 % intervals from "
        "cycle to cycle. The bars leave out the error of the sensor's sensitivity, which shifts "
        "all points by the same share. The tick above each is the largest amplitude. The amplitude "
        "falls with clearance as long as there are two impacts per cycle, and jumps where they "
        "end. A bracket reaches to the clearances tried on either side: the upper one of the "
        "lowest amplitude, the lower one of the end of two impacts per cycle." + line
    )
    title = "Amplitude of the mass over clearance"
    drawn = Drawn("clearance_periodic", "clearance", title, text)
    yield amplitude_over_clearance(valleys), drawn
    predicted = [valley for valley in valleys if valley.lowest.get("exact_mm") is not None]
    # of two rigs at one base amplitude the points would lie over each other
    if len(predicted) > 1 and len({valley.G for valley in predicted}) == len(predicted):
        title = (
            "How far the measured clearances are from the exact b_c, over base amplitude; bars "
            "reach to the clearances tried on either side"
        )
        text = (
            "b_c predicts the end of two impacts per "
            "cycle; the lowest amplitude lies a little below it."
        )
        drawn = Drawn("clearance_optimum", "clearance", title, text)
        yield optimum_over_level(predicted), drawn


def _valley(level: PeriodicLevel, results: CampaignResults) -> DrawnLevel:
    tests, compared = level.tests, results.compared
    first, last = tests[0].clearance, tests[-1].clearance
    # A little beyond the tests on the left, to show where the slope comes from.
    b, amplitude = amplitude_curve(
        results.rig_at(level),
        G=level.G,
        frequency=level.frequency,
        low=max(first - 0.03 * (last - first), 0.5 * first),
        high=last,
    )
    return DrawnLevel(
        level,
        rows=[results.of_record("regimes", test.record)[0] for test in tests],
        curve=(1e3 * b, 1e3 * amplitude),
        lowest=compared.get(("periodic", level.name), {}),
        end=compared.get(("periodic", level.name + END), {}),
    )


def _releases(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    levels, compared = results.releases, results.compared
    for x0, state in sorted({(level.x0, level.state) for level in levels}):
        own = [one for one in levels if (one.x0, one.state) == (x0, state) and len(one.tests) > 1]
        if not own:
            continue
        rig, of = results.rig_at(own[0]), of_state(state)
        b = np.linspace(own[0].tests[0].clearance, own[0].tests[-1].clearance, 80)
        times = decay_curves(rig, x0=x0, targets=[level.target for level in own], clearances=b)
        none = [(np.empty(0), np.empty(0))] * len(own)
        curves = none if times is None else [(1e3 * b, row) for row in times]
        rows = [compared.get(("transient", level.name), {}) for level in own]
        best = [_interval(of_level, "measured") for of_level in rows]
        text = (
            "Each amplitude has its own fastest clearance (orange, with the clearances that tie "
            "with it or bracket it); there is no single best one. Both predictions of b_t are "
            "marked. Green lines are predictions for a ball that is captured at once; a ring marks "
            "the lowest point. Measured times below T1 scatter, because the motion is chaotic "
            "there."
        )
        figure = time_over_clearance(
            list(zip(own, curves, best, strict=True)),
            title=f"release from {1e3 * x0:g} mm{of}",
            published=rows[0].get("published_mm"),
            exact=rows[0].get("exact_mm"),
        )
        title = "Time from the release until the amplitude stays below a given one, over clearance"
        name = f"clearance_release_{1e3 * x0:g}mm{of}".replace(", ", "_").replace(" ", "_")
        yield figure, Drawn(name, "clearance", title, text)


def _interval(row: Row, prefix: str, value: str | None = None) -> Interval | None:
    centre = row.get(value or f"{prefix}_mm")
    if centre is None:
        return None
    low, high = (row.get(f"{prefix}_{end}_mm") for end in ("low", "high"))
    return centre, -math.inf if low is None else low, math.inf if high is None else high
