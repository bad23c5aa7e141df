"""Amplitude over clearance for a design: from rest, from random starts, with what to build."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.figures.style import COLOURS, SEQUENCE, label, new_figure

#: Clearances in this ratio share a label.
_BESIDE = 1.05
_PUBLISHED = "$b_c$ published"

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vinesexp.design.advice import Advice


def design_curve(advice: Advice, *, height: float = 5.2) -> Figure:
    """Amplitude above, captured share below, over the clearance on a logarithmic axis.

    Parameters
    ----------
    advice : Advice
        What its search tried.
    height : float
        Inches; the names of the clearances stay apart.
    """
    from matplotlib.ticker import LogLocator, NullFormatter

    found = advice.found
    b, from_rest = 1e3 * found.grid, 1e3 * found.rest.average(found.rest.mean)
    low, middle, high = 1e3 * _percentiles(found.random.mean, found.random.weight)
    bare, absorber = 1e3 * advice.bare, 1e3 * advice.den_hartog.amplitude
    figure, (axis, share) = new_figure(2, 1, height=height, sharex=True, height_ratios=[3, 1])
    apart = 0.055 * 5.2 / height
    random, rest = SEQUENCE[1], SEQUENCE[0]
    axis.fill_between(b, low, high, color=random, alpha=0.2, linewidth=0)
    axis.plot(b, middle, color=random)
    axis.plot(b, from_rest, color=rest)
    top = 1.25 * max(float(high.max()), float(from_rest.max()), bare)
    axis.set(xscale="log", ylim=(0.0, top))
    for value, name, colour in (
        (bare, "bare oscillator", COLOURS["bare"]),
        (absorber, "tuned mass damper", SEQUENCE[3]),
    ):
        if value < top:  # a label far above the axes would leave no room for them
            axis.axhline(value, color=colour, linestyle=":", linewidth=1.0)
            label(axis, name, (b[0], value), colour=colour, shift=(3, 5))
    _marks(axis, share, advice, top, apart)
    axis.set_ylabel("amplitude (mm)")
    axis.plot([], [], color=rest, label="from rest, ball at a wall: mean over the shaker's phase")
    axis.fill_between(
        [], [], [], color=random, alpha=0.3, label="random starts: 10 to 90 %, median"
    )
    axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize=8)
    share.plot(b, 100.0 * found.random.share, color=random)
    share.set(xlabel="clearance b (mm)", ylabel="captured (%)", ylim=(0.0, 105.0))
    share.set_xlim(b[0], b[-1])
    share.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    share.xaxis.set_major_formatter("{x:g}")
    share.xaxis.set_minor_formatter(NullFormatter())
    return figure


def _percentiles(values: FloatArray, weights: FloatArray) -> FloatArray:
    """10, 50 and 90 % of each row by what its values stand for, shape (3, rows)."""
    from vinesexp.design.best_clearance import weighted_percentile  # loads the simulator

    rows = list(zip(values[:, np.newaxis], weights[:, np.newaxis], strict=True))
    found = [[weighted_percentile(*row, percent)[0] for row in rows] for percent in (10, 50, 90)]
    return np.array(found)


def _marks(axis: Axes, share: Axes, advice: Advice, top: float, apart: float) -> None:
    first, last = 1e3 * advice.found.grid[0], 1e3 * advice.found.grid[-1]
    build = {
        "least mean": advice.least_mean.b,
        "least largest": advice.least_max.b,
        "robust": advice.robust.b,
        "given": None if advice.asked is None else advice.asked.b,
    }
    b_c = {_PUBLISHED: advice.published, "$b_c$ exact": advice.exact}
    lines = [
        *((group, SEQUENCE[6], "-") for group in _close(build)),
        *((group, COLOURS["exact"], "--") for group in _close(b_c)),
    ]
    level = 0.99
    for group, colour, style in sorted(lines):
        shown = [(b, name) for b, name in group if first <= b <= last]
        if not shown:
            continue
        for one in (axis, share):
            for b, name in shown:
                own = COLOURS["published"] if name == _PUBLISHED else colour
                one.axvline(b, color=own, linestyle=style, linewidth=0.9, zorder=0)
        b = shown[0][0]
        near = b > np.sqrt(first * last)
        words = ", ".join(f"{name} {b:.4g}" for b, name in shown)
        paper = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6}
        side, shift = ("right", (-3, 0)) if near else ("left", (3, 0))
        label(axis, words, (b, level * top), colour, shift, ha=side, va="top", bbox=paper)
        level -= apart


def _close(values: Mapping[str, float | None]) -> list[list[tuple[float, str]]]:
    """Clearances (m) in mm, in groups whose names would stand in one another's way.

    Examples
    --------
    >>> _close({"robust": 0.02, "least mean": 0.033, "least largest": 0.032, "given": None})
    [[(20.0, 'robust')], [(32.0, 'least largest'), (33.0, 'least mean')]]
    """
    groups: list[list[tuple[float, str]]] = []
    for b, name in sorted((1e3 * b, name) for name, b in values.items() if b is not None):
        if not groups or b >= _BESIDE * groups[-1][0][0]:
            groups.append([])
        groups[-1].append((b, name))
    return groups
