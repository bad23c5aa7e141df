"""Impacts on the acceleration trace, and how hard each of them was."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vinesexp.figures.draw.style import COLOURS, label, new_figure
from vinesexp.figures.draw.traces import Trace, draw_trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

_AXES = {"acceleration": "acceleration\n(m/s²)", "sound": "sound\n(uncalibrated)"}
#: Impacts drawn one by one; of more, this many evenly chosen ones.
_MOST_POINTS = 1500


@dataclass(frozen=True)
class Marks:
    """Impacts to be drawn: time, s; side +1, -1 or 0; velocity jump, m/s."""

    time: Floats
    side: NDArray[np.int64]
    jump: Floats


def impacts_on_acceleration(
    whole: Trace, zoom: Trace, impacts: Marks, *, title: str, motion: Trace | None = None
) -> Figure:
    """Bandpassed acceleration or sound, the jump of every impact, and a few cycles enlarged.

    Parameters
    ----------
    whole, zoom : Trace
        Acceleration, m/s^2, or sound without a scale: the whole record and the enlarged stretch,
        which is named by its role.
    impacts : Marks
    motion : Trace, optional
        Displacement in the enlarged stretch, mm.
    """
    jumps = bool(np.isfinite(impacts.jump).any())  # of a bouncing ball only times are known
    ratios = [1.0, 0.8, 1.5] if jumps else [1.0, 1.5]
    figure, (above, *middle, below) = new_figure(
        len(ratios), 1, height=5.6 if jumps else 4.4, gridspec_kw={"height_ratios": ratios}
    )
    draw_trace(above, whole, colour=COLOURS[zoom.name])
    above.axvspan(zoom.time[0], zoom.time[-1], color=COLOURS["published"], alpha=0.35, linewidth=0)
    above.set_title(title)
    above.set_ylabel(_AXES[zoom.name])
    above.margins(x=0.01)
    for axis in middle:
        _jumps(axis, impacts)
        axis.set_xlim(above.get_xlim())
    (*middle, above)[0].set_xlabel("time (s)")
    _enlarged(below, zoom, impacts, motion)
    figure.align_ylabels()
    return figure


def _jumps(axis: Axes, impacts: Marks) -> None:
    step = max(-(-impacts.time.size // _MOST_POINTS), 1)
    for side, colour in ((1, "impact +1"), (-1, "impact -1"), (0, "impact")):
        chosen = np.flatnonzero(impacts.side == side)[::step]
        size = 2.2 if impacts.time.size > 100 else 3.5
        axis.plot(
            *(impacts.time[chosen], np.abs(impacts.jump[chosen]), "o"),
            color=COLOURS[colour],
            markersize=size,
            markeredgewidth=0,
        )
    largest = float(np.nanmax(np.abs(impacts.jump), initial=0.0))
    axis.set_ylim(0.0, 1.12 * largest if largest > 0.0 else None)
    axis.set_ylabel("velocity jump\n(m/s)")


def _enlarged(axis: Axes, zoom: Trace, impacts: Marks, motion: Trace | None) -> None:
    draw_trace(axis, zoom, colour=COLOURS[zoom.name])
    top = _top(zoom.values)
    inside = (impacts.time >= zoom.time[0]) & (impacts.time <= zoom.time[-1])
    for side, place, marker in ((1, 1.15, "v"), (-1, -1.15, "^"), (0, 1.15, "v")):
        marks = impacts.time[inside & (impacts.side == side)]
        if not marks.size:
            continue
        colour = COLOURS[f"impact {side:+d}" if side else "impact"]
        axis.plot(marks, np.full(marks.size, place * top), marker, color=colour, markersize=5)
        name = f"wall {side:+d}" if side else "impact"
        label(axis, name, (marks[0], place * top), colour=colour, shift=(6, 0))
    axis.set_ylim(-1.35 * top, 1.35 * top)
    axis.set_ylabel(_AXES[zoom.name])
    axis.set_xlabel("time (s), enlarged")
    axis.margins(x=0.01)
    if motion is not None and motion.values.size:
        twin = axis.twinx()
        twin.plot(motion.time, motion.values, color=COLOURS["displacement"], alpha=0.7)
        reach = 1.35 * _top(motion.values)
        twin.set_ylim(-reach, reach)
        twin.set_ylabel("displacement (mm)", color=COLOURS["displacement"])
        twin.tick_params(axis="y", colors=COLOURS["displacement"])
        twin.grid(visible=False)
        twin.margins(x=0.01)


def _top(values: Floats) -> float:
    """Largest magnitude, gaps left out; 1 where there is none."""
    return float(np.fmax.reduce(np.abs(values), initial=0.0)) or 1.0
