"""Amplitude over clearance for a design: from rest, from random starts, with what to build."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
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


@dataclass(frozen=True)
class DesignCurve:
    """What a design tried; lengths in mm.

    Attributes
    ----------
    b : clearances.
    rest : mean amplitude from rest, averaged over the shaker's phase.
    low, middle, high : 10th, 50th and 90th percentile over random starts of the mean amplitude.
    captured : share of the random starts that are captured.
    bare, absorber : amplitude of the bare oscillator and with Den Hartog's damper.
    build : clearances to build, by name.
    published, exact : b_c.
    """

    b: FloatArray
    rest: FloatArray
    low: FloatArray
    middle: FloatArray
    high: FloatArray
    captured: FloatArray
    bare: float
    absorber: float
    build: Mapping[str, float]
    published: float
    exact: float | None


def design_curve(curve: DesignCurve, *, height: float = 5.2) -> Figure:
    """Amplitude above, captured share below, over the clearance on a logarithmic axis.

    Parameters
    ----------
    curve : DesignCurve
    height : float
        Inches; the names of the clearances stay apart.
    """
    figure, (axis, share) = new_figure(2, 1, height=height, sharex=True, height_ratios=[3, 1])
    apart = 0.055 * 5.2 / height
    random, rest = SEQUENCE[1], SEQUENCE[0]
    axis.fill_between(curve.b, curve.low, curve.high, color=random, alpha=0.2, linewidth=0)
    axis.plot(curve.b, curve.middle, color=random)
    axis.plot(curve.b, curve.rest, color=rest)
    top = 1.25 * max(float(curve.high.max()), float(curve.rest.max()), curve.bare)
    axis.set_ylim(0.0, top)
    axis.set_xscale("log")
    for value, name, colour in (
        (curve.bare, "bare oscillator", COLOURS["bare"]),
        (curve.absorber, "tuned mass damper", SEQUENCE[3]),
    ):
        axis.axhline(value, color=colour, linestyle=":", linewidth=1.0)
        label(axis, name, (curve.b[0], value), colour=colour, shift=(3, 5))
    _marks(axis, share, curve, top, apart)
    axis.set_ylabel("amplitude (mm)")
    axis.plot([], [], color=rest, label="from rest, ball at a wall: mean over the shaker's phase")
    axis.fill_between(
        [], [], [], color=random, alpha=0.3, label="random starts: 10 to 90 %, median"
    )
    axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize=8)
    share.plot(curve.b, 100.0 * curve.captured, color=random)
    share.set_ylim(0.0, 105.0)
    share.set_ylabel("captured (%)")
    share.set_xlabel("clearance b (mm)")
    _plain_ticks(share, curve.b)
    return figure


def _marks(axis: Axes, share: Axes, curve: DesignCurve, top: float, apart: float) -> None:
    b_c = {_PUBLISHED: curve.published}
    if curve.exact is not None:
        b_c["$b_c$ exact"] = curve.exact
    lines = [
        *((group, SEQUENCE[6], "-") for group in _close(curve.build)),
        *((group, COLOURS["exact"], "--") for group in _close(b_c)),
    ]
    level = 0.99
    for group, colour, style in sorted(lines):
        shown = [(b, name) for b, name in group if curve.b[0] <= b <= curve.b[-1]]
        if not shown:
            continue
        for one in (axis, share):
            for b, name in shown:
                own = COLOURS["published"] if name == _PUBLISHED else colour
                one.axvline(b, color=own, linestyle=style, linewidth=0.9, zorder=0)
        b = shown[0][0]
        near = b > np.sqrt(curve.b[0] * curve.b[-1])
        words = ", ".join(f"{name} {b:.4g}" for b, name in shown)
        paper = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6}
        side, shift = ("right", (-3, 0)) if near else ("left", (3, 0))
        label(axis, words, (b, level * top), colour, shift, ha=side, va="top", bbox=paper)
        level -= apart


def _close(values: Mapping[str, float]) -> list[list[tuple[float, str]]]:
    """Clearances in groups whose names would stand in one another's way.

    Examples
    --------
    >>> _close({"robust": 20.0, "least mean": 33.0, "least largest": 32.8})
    [[(20.0, 'robust')], [(32.8, 'least largest'), (33.0, 'least mean')]]
    """
    groups: list[list[tuple[float, str]]] = []
    for b, name in sorted((b, name) for name, b in values.items()):
        if groups and b < _BESIDE * groups[-1][0][0]:
            groups[-1].append((b, name))
        else:
            groups.append([(b, name)])
    return groups


def _plain_ticks(axis: Axes, b: FloatArray) -> None:
    """1, 2 and 5 in every decade, written out."""
    from matplotlib.ticker import NullFormatter

    decades = 10.0 ** np.arange(np.floor(np.log10(b[0])), np.ceil(np.log10(b[-1])) + 1)
    ticks = np.outer(decades, [1.0, 2.0, 5.0]).ravel()
    ticks = ticks[(ticks >= b[0]) & (ticks <= b[-1])]
    axis.set_xlim(b[0], b[-1])
    axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.xaxis.set_minor_formatter(NullFormatter())
