"""Amplitude over clearance with the predicted optimum, and the optima over base amplitude."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vinesexp.figures.draw.style import COLOURS, FAINT, label, link, new_figure, regime_colour

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]
#: Value, low, high; mm. A measured one that is a bound has an end at infinity.
Interval = tuple[float, float, float]

_PANELS = 3  # in a row


@dataclass(frozen=True)
class Valley:
    """Periodic tests at one base amplitude, and what is predicted for it; mm.

    Attributes
    ----------
    name : ``G = 0.25 mm``.
    G : base amplitude.
    clearance, mean, largest : of each record.
    half : half of the 95 % interval of each mean, NaN where it is not known.
    cycles : over which each mean is taken.
    regime : of each record.
    curve : predicted amplitude over clearance (two arrays, empty where unknown).
    records : ids, to which the points lead.
    lowest, end : measured clearance of lowest amplitude and end of permanent impacts.
    published, exact : predicted b_c, the exact one with its interval.
    """

    name: str
    G: float
    clearance: Floats
    mean: Floats
    largest: Floats
    half: Floats
    cycles: tuple[int, ...]
    regime: tuple[str, ...]
    curve: tuple[Floats, Floats]
    records: tuple[str, ...] = ()
    lowest: Interval | None = None
    end: Interval | None = None
    published: float | None = None
    exact: Interval | None = None


def amplitude_over_clearance(valleys: Sequence[Valley]) -> Figure:
    """One panel a base amplitude: mean (points with 95 % bars) and largest (ticks) amplitude,
    coloured by regime.

    Parameters
    ----------
    valleys : sequence of Valley
    """
    columns = min(len(valleys), _PANELS)
    rows = -(-len(valleys) // columns)
    figure, axes = new_figure(rows, columns, height=0.7 + 3.1 * rows)
    for axis, valley in zip(axes, valleys, strict=False):
        _panel(axis, valley)
    for axis in axes[len(valleys) :]:
        axis.remove()
    for axis in axes[::columns]:
        axis.set_ylabel("amplitude of the mass (mm)")
    _key(figure, axes[0], [regime for valley in valleys for regime in valley.regime])
    return figure


def _panel(axis: Axes, valley: Valley) -> None:
    axis.plot(*valley.curve, color=COLOURS["exact"], linewidth=1.6, zorder=2)
    points = zip(
        *(valley.clearance, valley.mean, valley.half, valley.largest, valley.regime), strict=True
    )
    for i, (b, mean, half, largest, regime) in enumerate(points):
        colour = regime_colour(regime)
        axis.plot(b, largest, "_", color=colour, markersize=6, alpha=0.6, zorder=3)
        if np.isfinite(half):
            axis.errorbar(b, mean, half, color=colour, elinewidth=1.0, capsize=2.5, zorder=3)
        (point,) = axis.plot(b, mean, "o", color=colour, zorder=4)
        if valley.records:
            known = f" ± {half:.2g}" if np.isfinite(half) else ""
            words = (
                f"{valley.records[i]}: b = {b:g} mm, mean {mean:.4g}{known} mm over "
                f"{valley.cycles[i]} cycles, largest {largest:.3g} mm"
            )
            link(point, valley.records[i], f"{words}, {regime}")
    top = 1.3 * float(valley.largest.max())
    axis.set_ylim(0.0, top)
    axis.set_title(valley.name)
    axis.set_xlabel("clearance b (mm)")
    axis.margins(x=0.08)
    _predicted(axis, valley, top)
    _measured(axis, valley, top)


def _predicted(axis: Axes, valley: Valley, top: float) -> None:
    """Both b_c as lines; their names on either side, so that near ones do not overlap."""
    if valley.exact:
        value, low, high = valley.exact
        axis.axvspan(low, high, color=COLOURS["exact"], alpha=0.25, linewidth=0, zorder=0)
        axis.axvline(value, color=COLOURS["exact"], linewidth=1.0, zorder=0)
        label(
            *(axis, f"exact $b_c$\n{value:.1f}", (value, 0.99 * top)),
            colour=COLOURS["exact"],
            shift=(-3, 0),
            ha="right",
            va="top",
        )
    if valley.published is not None:
        axis.axvline(
            valley.published, color=COLOURS["published"], linewidth=1.0, linestyle="--", zorder=0
        )
        label(
            *(axis, f"published\n{valley.published:.1f}", (valley.published, 0.99 * top)),
            colour=COLOURS["published"],
            shift=(3, 0),
            va="top",
        )


def _measured(axis: Axes, valley: Valley, top: float) -> None:
    """Brackets of the two measured clearances, near the axis."""
    axis.set_xlim(axis.get_xlim())  # brackets do not widen it
    if valley.lowest:
        _bracket(axis, valley.lowest, 0.10 * top, "lowest", COLOURS["measured"])
    if valley.end:
        _bracket(axis, valley.end, 0.03 * top, "end", COLOURS["strongly modulated"])


def _bracket(axis: Axes, interval: Interval, height: float, name: str, colour: str) -> None:
    value, low, high = interval
    left, right = axis.get_xlim()
    ends = max(low, left), min(high, right)
    axis.plot(ends, [height] * 2, "-", color=colour, linewidth=1.4)
    for end, edge, mark in ((low, left, "<"), (high, right, ">")):
        # An arrow: it may lie beyond what was tried.
        axis.plot(edge if math.isinf(end) else end, height, mark if math.isinf(end) else "|",
                  color=colour, markersize=5 if math.isinf(end) else 7, clip_on=False)  # fmt: skip
    if math.isinf(high - low):
        text = f"{name} below {high:g}" if math.isinf(low) else f"{name} above {low:g}"
        label(axis, text, (0.5 * sum(ends), height), colour=colour, shift=(0, 7), ha="center")
        return
    axis.plot(value, height, "o", color=colour, markersize=3.5)
    text = f"{name} {value:.1f}"
    if low - left > 0.3 * (right - left):
        label(axis, text, (low, height), colour=colour, shift=(-5, 0), ha="right")
    else:  # beside the bracket it would lie over the axis
        label(axis, text, (0.5 * sum(ends), height), colour=colour, shift=(0, 7), ha="center")


def _key(figure: Figure, axis: Axes, regimes: Sequence[str]) -> None:
    known = [name for name in COLOURS if name in {r.split(" | ")[0] for r in regimes}]
    handles = [
        axis.plot([], [], "o", color=COLOURS[name], label=f"mean, {name}")[0] for name in known
    ]
    handles += [
        axis.plot([], [], "_", color=COLOURS["measured"], label="largest")[0],
        axis.plot([], [], color=COLOURS["exact"], label="predicted, two impacts per cycle")[0],
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8)


def optimum_over_level(valleys: Sequence[Valley]) -> Figure:
    """How far each measured clearance is from the exact b_c, over base amplitude.

    Parameters
    ----------
    valleys : sequence of Valley
        With an exact b_c each.
    """
    figure, (axis,) = new_figure(height=3.2)
    known = [valley for valley in valleys if valley.exact is not None]
    for valley in known:
        exact, low, high = valley.exact or (1.0, 1.0, 1.0)
        G = valley.G
        width = 0.02 * max(v.G for v in valleys)
        axis.fill_between(
            *([G - width, G + width], 100.0 * (low / exact - 1.0), 100.0 * (high / exact - 1.0)),
            color=COLOURS["exact"],
            alpha=0.3,
            linewidth=0,
        )
        if valley.published is not None:
            away = 100.0 * (valley.published / exact - 1.0)
            axis.plot([G - width, G + width], [away, away], "--", color=COLOURS["published"])
        _deviation(axis, valley, exact)
    axis.axhline(0.0, color=COLOURS["exact"], linewidth=1.0)
    handles = [
        axis.plot([], [], mark, color=COLOURS[colour], markersize=4.5, label=name)[0]
        for mark, colour, name in (
            ("-", "exact", "exact $b_c$, 95 % interval shaded"),
            ("--", "published", "published $b_c$"),
            ("s", "strongly modulated", "end of two impacts per cycle"),
            ("o", "measured", "lowest amplitude"),
        )
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=8)
    axis.set_xlabel("base amplitude G (mm)")
    axis.set_ylabel("clearance from the exact $b_c$ (%)")
    span = max(v.G for v in known) - min(v.G for v in known) or 1.0
    axis.set_xlim(known[0].G - 0.25 * span, known[-1].G + 0.25 * span)
    axis.margins(y=0.15)
    return figure


def _deviation(axis: Axes, valley: Valley, exact: float) -> None:
    """Both measured clearances of one base amplitude, with their brackets."""
    for kind, marker, colour in (
        (valley.lowest, "o", "measured"),
        (valley.end, "s", "strongly modulated"),
    ):
        if kind is None or math.isinf(kind[2] - kind[1]):
            continue  # a bound is no point
        value, low, high = (100.0 * (b / exact - 1.0) for b in kind)
        axis.errorbar(
            *(valley.G, value, [[value - low], [high - value]]),
            fmt=marker,
            color=COLOURS[colour],
            capsize=3,
            markersize=4.5,
        )
        label(axis, f"{kind[0]:.1f} mm", (valley.G, value), colour=COLOURS[colour], shift=(9, 0))


@dataclass(frozen=True)
class Reached:
    """Time from a release to one amplitude over clearance, mm and s; NaN where not reached."""

    target: float
    clearance: Floats
    time: Floats
    curve: tuple[Floats, Floats]
    records: tuple[str, ...] = ()
    best: Interval | None = None


def time_over_clearance(
    levels: Sequence[Reached], *, title: str, published: float | None, exact: float | None
) -> Figure:
    """Time to each amplitude over clearance, predicted and measured; both b_t as marks."""
    figure, (axis,) = new_figure(height=3.6)
    for level in levels:
        axis.plot(*level.curve, color=COLOURS["exact"], linewidth=1.2, zorder=1)
        _curve_minimum(axis, *level.curve)
        axis.plot(level.clearance, level.time, "-", color=FAINT, linewidth=0.8, zorder=0)
        for i, (b, time) in enumerate(zip(level.clearance, level.time, strict=True)):
            if not np.isfinite(time):
                continue  # never reached
            (point,) = axis.plot(b, time, "o", color=COLOURS["measured"], zorder=3)
            if level.records:
                words = f"{level.records[i]}: b = {b:g} mm, to {level.target:g} mm in {time:.3g} s"
                link(point, level.records[i], words)
        last = int(np.flatnonzero(np.isfinite(level.time))[-1])
        name = f"to {level.target:g} mm"
        label(axis, name, (level.clearance[last], level.time[last]), colour="#000000", shift=(8, 0))
        if level.best:
            best = level.best[0]
            reach = float(level.clearance[0]), float(level.clearance[-1])
            low, high = max(level.best[1], reach[0]), min(level.best[2], reach[1])
            time = float(level.time[np.argmin(np.abs(level.clearance - best))])
            axis.plot([low, high], [time, time], "|-", color=COLOURS["impact"], linewidth=1.4)
            axis.plot(best, time, "o", color=COLOURS["impact"], markersize=6, zorder=4)
    axis.set_ylim(bottom=0.0)
    top = 1.12 * axis.get_ylim()[1]
    axis.set_ylim(0.0, top)
    for name, value, style in (("published", published, "--"), ("exact", exact, "-")):
        if value is not None:
            axis.axvline(value, color=COLOURS[name], linestyle=style, linewidth=1.0, zorder=0)
            left = name == "exact"
            label(
                *(axis, f"{name} $b_t$ {value:.1f}", (value, 0.99 * top)),
                colour=COLOURS[name],
                shift=(-3 if left else 3, 0),
                ha="right" if left else "left",
                va="top",
            )
    axis.set_xlabel("clearance b (mm)")
    axis.set_ylabel("time to the amplitude (s)")
    axis.set_title(title)
    axis.margins(x=0.1)
    return figure


def _curve_minimum(axis: Axes, b: Floats, time: Floats) -> None:
    """The predicted fastest clearance, where it lies inside what was tried."""
    if b.size and 0 < (i := int(time.argmin())) < b.size - 1:
        axis.plot(b[i], time[i], "o", color=COLOURS["exact"], markerfacecolor="white", zorder=2)
        label(axis, f"{b[i]:.0f} mm", (b[i], time[i]), colour=COLOURS["exact"], shift=(0, 8),
              ha="center")  # fmt: skip
