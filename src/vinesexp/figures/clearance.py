"""Amplitude over clearance with the predicted optimum, and the optima over base amplitude."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from vinesexp.figures.style import COLOURS, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Row = Mapping[str, str]


def amplitude_over_clearance(
    levels: Mapping[str, Sequence[Row]], comparisons: Mapping[str, Row]
) -> Figure:
    """One panel a base amplitude: mean (points) and largest (ticks) amplitude, coloured by regime.

    Parameters
    ----------
    levels : mapping
        Level name to rows with clearance_mm, amplitude_mean_m, amplitude_max_m, regime.
    comparisons : mapping
        Level name to its row of clearances.csv.
    """
    figure, axes = new_figure(1, len(levels), height=3.2)
    shown: set[str] = set()
    for axis, (level, rows) in zip(axes, levels.items(), strict=True):
        _valley(axis, rows, shown)
        _predicted_band(axis, comparisons.get(level, {}))
        axis.set_title(level)
        axis.set_xlabel("clearance b (mm)")
        axis.set_ylim(bottom=0.0)
    axes[0].set_ylabel("amplitude of the mass (mm)")
    if shown:
        figure.legend(
            handles=[
                axes[0].plot([], [], "o", color=COLOURS[name], label=name)[0]
                for name in COLOURS
                if name in shown
            ],
            loc="outside lower center",
            ncols=4,
            title="mean amplitude, by regime; the tick above is the largest",
            title_fontsize=8.5,
        )
    return figure


def _valley(axis: Axes, rows: Sequence[Row], shown: set[str]) -> None:
    points = sorted((float(row["clearance_mm"]), row) for row in rows)
    clearances = [b for b, _ in points]
    means = [1e3 * float(row["amplitude_mean_m"]) for _, row in points]
    axis.plot(clearances, means, color="#cccccc", linewidth=0.8, zorder=1)
    for b, row in points:
        colour = COLOURS.get(row["regime"], COLOURS["measured"])
        shown.add(row["regime"])
        mean, largest = (1e3 * float(row[f"amplitude_{kind}_m"]) for kind in ("mean", "max"))
        axis.plot([b, b], [mean, largest], color=colour, linewidth=0.8, alpha=0.6, zorder=2)
        axis.plot(b, largest, "_", color=colour, markersize=6, zorder=2)
        axis.plot(b, mean, "o", color=colour, zorder=3)


def _predicted_band(axis: Axes, row: Row) -> None:
    top = axis.get_ylim()[1]
    for kind, place in (("published", 0.99), ("exact", 0.90)):
        if row.get(f"{kind}_mm"):
            value = float(row[f"{kind}_mm"])
            axis.axvline(value, color=COLOURS[kind], linewidth=1.2, zorder=0)
            axis.text(
                *(value, place * top, f" {kind} {value:.1f}"),
                color=COLOURS[kind],
                fontsize=8,
                va="top",
            )
    if row.get("predicted_low_mm"):
        low, high = float(row["predicted_low_mm"]), float(row["predicted_high_mm"])
        axis.axvspan(low, high, color=COLOURS["exact"], alpha=0.15, linewidth=0, zorder=0)
    if row.get("measured_low_mm"):
        low, high = float(row["measured_low_mm"]), float(row["measured_high_mm"])
        axis.plot([low, high], [0.03 * top] * 2, "|-", color=COLOURS["measured"], markersize=8)
        axis.text(0.5 * (low + high), 0.045 * top, "measured", ha="center", fontsize=8)


def optimum_over_level(rows: Sequence[Row]) -> Figure:
    """Best clearance over base amplitude: measured with its bracket, predicted as lines."""
    figure, (axis,) = new_figure(height=3.0)
    levels = [float(row["level"].split("=")[1].split()[0]) for row in rows]
    for kind, style in (("published", "--"), ("exact", "-")):
        pairs = [
            (G, float(row[f"{kind}_mm"]))
            for G, row in zip(levels, rows, strict=True)
            if row.get(f"{kind}_mm")
        ]
        if pairs:
            x, y = zip(*[(0.0, 0.0), *pairs], strict=True)
            axis.plot(x, y, style, color=COLOURS[kind])
            shift = 10 if kind == "published" else -14
            axis.annotate(
                f"predicted, {kind}",
                (x[-1], y[-1]),
                xytext=(-90, shift),
                textcoords="offset points",
                color=COLOURS[kind],
            )
    for G, row in zip(levels, rows, strict=True):
        if row.get("measured_mm"):
            best, low, high = (float(row[f"measured{k}_mm"]) for k in ("", "_low", "_high"))
            axis.errorbar(
                *(G, best, [[best - low], [high - best]]),
                fmt="o",
                color=COLOURS["measured"],
                capsize=3,
            )
            axis.annotate(
                f"{best:g} mm", (G, best), xytext=(8, -10), textcoords="offset points", fontsize=8
            )
    axis.set_xlabel("base amplitude G (mm)")
    axis.set_ylabel("best clearance b (mm)")
    axis.set_xlim(0.0, 1.15 * max(levels))
    axis.set_ylim(bottom=0.0)
    return figure


def time_over_clearance(
    levels: Mapping[str, Sequence[tuple[float, float]]], row: Row, *, release_mm: float
) -> Figure:
    """Time from release to a level over clearance, one line a level, both b_t as marks."""
    figure, (axis,) = new_figure(height=3.2)
    for level, pairs in levels.items():
        clearances, times = zip(*sorted(pairs), strict=True)
        axis.plot(clearances, times, "-", color="#cccccc", linewidth=0.8)
        axis.plot(clearances, times, "o", color=COLOURS["measured"])
        best = min(range(len(times)), key=times.__getitem__)
        axis.plot(clearances[best], times[best], "o", color=COLOURS["impact"], markersize=6)
        axis.annotate(
            f"to {level}",
            (clearances[-1], times[-1]),
            xytext=(6, -3),
            textcoords="offset points",
            fontsize=8,
        )
    axis.set_ylim(bottom=0.0)
    top = axis.get_ylim()[1]
    for kind in ("published", "exact"):
        if row.get(f"{kind}_mm"):
            value = float(row[f"{kind}_mm"])
            axis.axvline(value, color=COLOURS[kind])
            axis.text(
                *(value, 0.99 * top, f" $b_t$ {kind} {value:.1f}"),
                color=COLOURS[kind],
                fontsize=8,
                va="top",
            )
    axis.set_xlabel("clearance b (mm)")
    axis.set_ylabel("time to the level (s)")
    axis.set_title(f"release from {release_mm:g} mm; the fastest clearance of each level in colour")
    axis.margins(x=0.12)
    return figure
