"""Time histories: a long trace as what a screen can show of it, impacts on the acceleration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vinesexp.figures.style import COLOURS, SEQUENCE, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

#: Columns of a trace that is drawn as a band from its smallest to its largest value.
_COLUMNS = 900


@dataclass(frozen=True)
class Trace:
    """One channel to be drawn: times, s, and values in the unit to be shown."""

    name: str
    time: Floats
    values: Floats


def band(time: Floats, values: Floats, *, columns: int = _COLUMNS) -> tuple[Floats, Floats, Floats]:
    """Times, smallest and largest values of `columns` equal parts: what a screen shows of a trace.

    Examples
    --------
    >>> t, low, high = band(np.arange(6.0), np.array([0, 1, 2, 3, 2, 1.0]), columns=2)
    >>> t, low, high
    (array([1., 4.]), array([0., 1.]), array([2., 3.]))
    """
    part = max(len(values) // columns, 1)
    whole = len(values) // part * part
    shaped = values[:whole].reshape(-1, part)
    return time[:whole].reshape(-1, part).mean(axis=1), shaped.min(axis=1), shaped.max(axis=1)


def draw_trace(axis: Axes, time: Floats, values: Floats, *, colour: str) -> None:
    """Draw a trace as a line, or as a band where it has more samples than the screen columns."""
    if len(values) <= 2 * _COLUMNS:
        axis.plot(time, values, color=colour, linewidth=0.9)
    else:
        t, low, high = band(time, values)
        axis.fill_between(t, low, high, color=colour, linewidth=0.3)


def overview(traces: Sequence[Trace], *, title: str) -> Figure:
    """Every channel of one record over its whole length."""
    figure, axes = new_figure(len(traces), 1, height=0.6 + 1.3 * len(traces))
    for axis, trace in zip(axes, traces, strict=True):
        draw_trace(axis, trace.time, trace.values, colour=COLOURS[trace.name.split()[0]])
        axis.set_ylabel(trace.name.replace(" ", "\n", 1))
    for axis in axes[:-1]:
        axis.tick_params(labelbottom=False)
    axes[-1].set_xlabel("time (s)")
    axes[0].set_title(title)
    return figure


def impacts_on_acceleration(
    trace: Trace,
    zoom: Trace,
    *,
    times: Floats,
    sides: NDArray[np.int64],
    title: str,
    displacement: Trace | None = None,
) -> Figure:
    """The bandpassed acceleration with every impact marked, and a few cycles of it enlarged.

    Parameters
    ----------
    trace, zoom : Trace
        Acceleration, m/s^2: the whole record and the enlarged stretch.
    times, sides : ndarray
        Impacts: s; +1, -1 or 0 where unknown.
    displacement : Trace, optional
        The motion in the enlarged stretch, mm.
    """
    figure, (above, below) = new_figure(2, 1, height=4.4)
    draw_trace(above, trace.time, trace.values, colour=COLOURS["acceleration"])
    above.set_title(title)
    above.set_ylabel("acceleration (m/s²)")
    below.plot(zoom.time, zoom.values, color=COLOURS["acceleration"], linewidth=0.8)
    inside = (times >= zoom.time[0]) & (times <= zoom.time[-1])
    top = float(np.max(np.abs(zoom.values))) or 1.0
    for side, place in ((1, 1.12), (-1, -1.12), (0, 1.12)):
        marks = times[inside & (sides == side)]
        name = f"impact {side:+d}" if side else "impact"
        if marks.size:
            marker = "v" if place > 0 else "^"
            below.plot(marks, np.full(marks.size, place * top), marker, color=COLOURS[name])
            below.annotate(
                f"{name.replace('impact', 'side')}" if side else "impact",
                (marks[0], place * top),
                xytext=(6, -3),
                textcoords="offset points",
                color=COLOURS[name],
                fontsize=8,
            )
    if displacement is not None and displacement.values.size:
        scale = 0.8 * top / max(float(np.max(np.abs(displacement.values))), 1e-12)
        below.plot(
            displacement.time, scale * displacement.values, color=COLOURS["displacement"], alpha=0.6
        )
        below.annotate(
            "displacement, scaled",
            (displacement.time[-1], scale * displacement.values[-1]),
            xytext=(-110, 8),
            textcoords="offset points",
            color=COLOURS["displacement"],
            fontsize=8,
        )
    below.set_ylabel("acceleration (m/s²)")
    below.set_xlabel("time (s)")
    return figure


def envelopes(traces: Sequence[Trace], *, xlabel: str, ylabel: str, title: str = "") -> Figure:
    """Amplitudes of several records on one axis, each labelled at its end or its largest value."""
    figure, (axis,) = new_figure(height=3.6)
    for trace, colour in zip(traces, _colours(traces), strict=True):
        axis.plot(trace.time, trace.values, color=colour, label=trace.name, linewidth=1.0)
    axis.legend(loc="upper right", ncols=2 if len(traces) > 5 else 1, fontsize=8)
    axis.set_xlabel(xlabel)
    axis.set_ylabel(ylabel)
    axis.set_title(title)
    axis.set_ylim(bottom=0.0)
    return figure


def _colours(traces: Sequence[Trace]) -> list[str]:
    """One colour a trace; from blue to red where there are more than the palette has."""
    if len(traces) <= len(SEQUENCE):
        return list(SEQUENCE[: len(traces)])
    import matplotlib as mpl
    from matplotlib.colors import to_hex

    places = np.linspace(0.0, 0.92, len(traces))
    return [to_hex(colour) for colour in mpl.colormaps["viridis"](places)]
