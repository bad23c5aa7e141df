"""Maps over two parameters, and motions that coexist at one clearance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.figures.style import COLOURS, label, new_figure, regime_colour
from vinesexp.maps.basins import Attractor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vinesexp.maps.response_map import MapGrid, Values

#: Area of the dot of a motion to which all starts lead, points squared.
WHOLE = 60.0


#: Of an axis of a map: times its SI value, and the unit behind its name.
_SHOWN = {"m": (1e3, " (mm)"), "kg": (1e3, " (g)"), "1": (1.0, ""), "Hz": (1.0, " (Hz)")}


def coexisting_motions(found: Sequence[Attractor], *, bare: float) -> Figure:
    """Mean amplitude as a dot, up to the largest a line; below, the shares of the starts.

    Parameters
    ----------
    found : sequence of Attractor
        By clearance.
    bare : float
        Amplitude of the oscillator alone, m.
    """
    figure, (axis, share) = new_figure(2, 1, height=5.0, sharex=True, height_ratios=[3, 1])
    b = np.unique([one.b for one in found])
    width = 1e3 * float(np.diff(b).min()) if b.size > 1 else 1.0
    stacked = dict.fromkeys(b.tolist(), 0.0)
    regimes = list(dict.fromkeys(one.regime for one in found))
    for regime in regimes:
        own = [one for one in found if one.regime == regime]
        colour = regime_colour(regime)
        x = [1e3 * one.b for one in own]
        axis.vlines(
            x, [1e3 * one.mean for one in own], [1e3 * one.largest for one in own],
            color=colour, linewidth=0.8, alpha=0.7,
        )  # fmt: skip
        axis.scatter(
            x, [1e3 * one.mean for one in own], s=[WHOLE * one.share for one in own],
            color=colour, edgecolor="white", linewidth=0.3, zorder=3,
        )  # fmt: skip
        axis.scatter([], [], s=0.5 * WHOLE, color=colour, label=regime)
        for one in own:
            share.bar(
                1e3 * one.b, 100.0 * one.share, width, bottom=100.0 * stacked[one.b], color=colour
            )
            stacked[one.b] += one.share
    axis.axhline(1e3 * bare, color=COLOURS["bare"], linestyle=":", linewidth=1.0)
    label(axis, "bare oscillator", (1e3 * b[0], 1e3 * bare), colour=COLOURS["bare"], shift=(0, 6))
    axis.set(ylabel="amplitude of the mass (mm)", ylim=(0.0, None))
    title = "dot: mean amplitude, its area the share of starts; line: up to the largest"
    axis.legend(
        loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=8, title=title,
        title_fontsize=8,
    )  # fmt: skip
    share.set(xlabel="clearance b (mm)", ylabel="starts (%)", ylim=(0.0, 100.0))
    return figure


def response_map_panels(grid: MapGrid, found: Values) -> Figure:
    """Three panels side by side, each with its colour bar above."""
    from vinesexp.maps.response_map import AXES, published_line

    figure, axes = new_figure(1, 3, height=3.4, sharex=True, sharey=True)
    (x_scale, x_unit), (y_scale, y_unit) = (_SHOWN[AXES[s][0]] for s in (grid.x, grid.y))
    x, y = x_scale * np.array(grid.x_values), y_scale * np.array(grid.y_values)
    line = published_line(grid)
    panels = (
        (1e3 * found["mean_amplitude"], "mean amplitude (mm)", "viridis"),
        (1e3 * found["largest_amplitude"], "largest amplitude (mm)", "viridis"),
        (100.0 * found["captured_share"], "captured (% of starts)", "cividis"),
    )
    for axis, (values, name, colours) in zip(axes, panels, strict=True):
        limits = (0.0, 100.0) if name.startswith("captured") else (0.0, float(np.nanmax(values)))
        mesh = axis.pcolormesh(
            x, y, values, shading="nearest", cmap=colours, rasterized=True,
            vmin=limits[0], vmax=limits[1],
        )  # fmt: skip
        axis.grid(visible=False)
        figure.colorbar(mesh, ax=axis, location="top", label=name, aspect=16)
        axis.set_xlabel(f"{AXES[grid.x][1]} {grid.x[0]}{x_unit}")
        if line is not None:
            b_c = 1e3 * line
            inside = (b_c >= x[0]) & (b_c <= x[-1])
            axis.plot(b_c[inside], y[inside], color="white", lw=1.2)
            if inside.any():
                at = np.flatnonzero(inside)[int(0.6 * inside.sum())]
                label(axis, "$b_c$ published", (b_c[at], y[at]), "white")
    axes[0].set_ylabel(f"{AXES[grid.y][1]} {grid.y[0]}{y_unit}")
    return figure
