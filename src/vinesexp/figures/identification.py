"""Identified values: every method beside the combined value, each with its 95 % interval."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from vinesexp.figures.style import COLOURS, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Row = Mapping[str, str]

#: Names and units for the axis of each parameter.
LABELS = {
    "f0": "f₀ (Hz)",
    "zeta": "ζ",
    "M": "M (kg)",
    "c1": "c₁ (N s/m)",
    "k1": "k₁ (N/m)",
    "r": "r",
}


def estimates_by_method(rows: Sequence[Row]) -> Figure:
    """One panel a parameter that has several methods: points with 95 % intervals.

    Parameters
    ----------
    rows : sequence
        Rows of identified.csv.
    """
    parameters = list(dict.fromkeys(row["parameter"] for row in rows))
    columns = 2 if len(parameters) > 1 else 1
    panels = -(-len(parameters) // columns)
    figure, axes = new_figure(panels, columns, height=0.5 + 1.35 * panels)
    for axis, parameter in zip(axes, parameters, strict=False):
        _panel(axis, parameter, [row for row in rows if row["parameter"] == parameter])
    for axis in axes[len(parameters) :]:
        axis.remove()
    return figure


def _panel(axis: Axes, parameter: str, rows: Sequence[Row]) -> None:
    ordered = sorted(rows, key=lambda row: row["method"] == "combined")
    for place, row in enumerate(ordered):
        value = float(row["value"])
        low = float(row["ci95_low"] or value)
        high = float(row["ci95_high"] or value)
        combined = row["method"] == "combined"
        colour = COLOURS["exact"] if combined else COLOURS["measured"]
        if combined:
            axis.axvspan(low, high, color=colour, alpha=0.15, linewidth=0)
        axis.plot([low, high], [place, place], color=colour, linewidth=1.5)
        axis.plot(value, place, "o", color=colour)
    axis.set_yticks(range(len(ordered)), [row["method"] for row in ordered], fontsize=7.5)
    axis.set_ylim(-0.6, len(ordered) - 0.4)
    axis.grid(axis="y", visible=False)
    axis.ticklabel_format(axis="x", useOffset=False)
    axis.locator_params(axis="x", nbins=4)
    axis.set_title(LABELS.get(parameter, parameter.replace("_", " ")))
