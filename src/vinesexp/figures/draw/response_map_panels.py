"""A map over two parameters: mean amplitude, largest amplitude, captured share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.figures.draw.style import label, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class MapPicture:
    """A map as shown.

    Attributes
    ----------
    x, y : values along the axes, with their names and units.
    mean, largest : amplitudes, mm; shape (y, x), NaN where not computed.
    captured : share of the starts, %.
    line : b_c along y in the unit of x, where there is one.
    """

    x: FloatArray
    y: FloatArray
    x_name: str
    y_name: str
    mean: FloatArray
    largest: FloatArray
    captured: FloatArray
    line: FloatArray | None


def response_map_panels(shown: MapPicture) -> Figure:
    """Three panels side by side, each with its colour bar above."""
    figure, axes = new_figure(1, 3, height=3.4, sharex=True, sharey=True)
    panels = (
        (shown.mean, "mean amplitude (mm)", "viridis"),
        (shown.largest, "largest amplitude (mm)", "viridis"),
        (shown.captured, "captured (% of starts)", "cividis"),
    )
    for axis, (values, name, colours) in zip(axes, panels, strict=True):
        limits = (0.0, 100.0) if name.startswith("captured") else (0.0, float(np.nanmax(values)))
        mesh = axis.pcolormesh(
            shown.x, shown.y, values, shading="nearest", cmap=colours, rasterized=True,
            vmin=limits[0], vmax=limits[1],
        )  # fmt: skip
        axis.grid(visible=False)
        figure.colorbar(mesh, ax=axis, location="top", label=name, aspect=16)
        axis.set_xlabel(shown.x_name)
        if shown.line is not None:
            inside = (shown.line >= shown.x[0]) & (shown.line <= shown.x[-1])
            axis.plot(shown.line[inside], shown.y[inside], color="white", lw=1.2)
            if inside.any():
                at = np.flatnonzero(inside)[int(0.6 * inside.sum())]
                label(
                    *(axis, "$b_c$ published", (shown.line[at], shown.y[at])),
                    colour="white",
                )
    axes[0].set_ylabel(shown.y_name)
    return figure
