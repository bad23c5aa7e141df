"""Which regime when: impacts in each cycle, one strip a record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vinesexp.figures.draw.style import COLOURS, label, link, new_figure, regime_colour

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Strip:
    """Impacts in each cycle of one record: one row of a regime chart."""

    name: str
    regime: str
    per_cycle: Floats
    record: str = ""


def regime_strips(groups: Sequence[tuple[str, Sequence[Strip]]], *, columns: int = 500) -> Figure:
    """One strip a record, coloured by the number of impacts in each cycle, over time in cycles.

    Parameters
    ----------
    groups : sequence of (title, strips)
        One panel a group; strips from small to large clearance.
    """
    from matplotlib.colors import BoundaryNorm, ListedColormap

    sizes = [len(strips) for _, strips in groups]
    figure, axes = new_figure(
        *(len(groups), 1),
        height=0.9 + sum(0.155 * size + 0.42 for size in sizes),
        gridspec_kw={"height_ratios": [size + 1.2 for size in sizes]},
        sharex=True,
    )
    colours = ["#ffffff", "#f3c6a5", COLOURS["two symmetric"], COLOURS["three or more per cycle"]]
    palette, norm = ListedColormap(colours), BoundaryNorm([-0.5, 0.25, 1.5, 2.25, 1e9], 4)
    longest = max(strip.per_cycle.size for _, strips in groups for strip in strips)
    for axis, (title, strips) in zip(axes, groups, strict=True):
        for place, strip in enumerate(strips):
            values = _columns(strip.per_cycle, max(1, -(-longest // columns)))
            extent = (0.0, float(strip.per_cycle.size), place - 0.4, place + 0.4)
            axis.imshow(
                values[None, :],
                cmap=palette,
                norm=norm,
                aspect="auto",
                extent=extent,
                interpolation="nearest",
            )
            name = label(
                axis,
                strip.regime,
                (float(longest), place),
                colour=regime_colour(strip.regime),
                fontsize=7.5,
            )
            if strip.record:
                link(name, strip.record, f"{strip.record}: {strip.name}, {strip.regime}")
        axis.set_yticks(range(len(strips)), [strip.name for strip in strips], fontsize=7.5)
        axis.set_ylim(-0.6, len(strips) - 0.4)
        axis.set_xlim(0.0, float(longest))
        axis.set_title(title)
        axis.grid(visible=False)
        axis.tick_params(length=0, axis="y")
    axes[-1].set_xlabel("cycles of the oscillator")
    _key(figure, colours)
    return figure


def _key(figure: Figure, colours: Sequence[str]) -> None:
    from matplotlib.patches import Patch

    names = ("none", "one", "two", "three or more")
    figure.legend(
        handles=[
            Patch(facecolor=colour, edgecolor="#bbbbbb", linewidth=0.5, label=name)
            for colour, name in zip(colours, names, strict=True)
        ],
        loc="outside upper right",
        ncols=4,
        fontsize=8,
        title="impacts per cycle",
        title_fontsize=8,
        alignment="right",
    )


def _columns(values: Floats, part: int) -> Floats:
    """Means over `part` cycles, so that a long record has no more columns than a screen."""
    whole = values.size // part * part
    return values[:whole].reshape(-1, part).mean(axis=1) if whole else values
