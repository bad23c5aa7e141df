"""Time histories: a long trace as what a screen can show of it; whole records; amplitudes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.figures.style import COLOURS, SEQUENCE, link, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


#: Columns of a trace that is drawn as a band from its smallest to its largest value: one to 0.9
#: points of a figure 7 in wide.
COLUMNS = 560


@dataclass(frozen=True)
class Trace:
    """One channel to be drawn: times, s, and values in the unit to be shown.

    Where `high` is given, `values` are the smallest and `high` the largest in each part of a
    trace that was too long to be read at once. `columns` is in how many parts a long trace is
    drawn (`columns_of`). `record` is the id to whose page the trace leads.
    """

    name: str
    time: FloatArray
    values: FloatArray
    high: FloatArray | None = None
    columns: int = COLUMNS
    record: str = ""


#: Columns that a cycle takes at least where it is to be seen as one.
_A_CYCLE = 8


def columns_of(cycles: float) -> int:
    """In how many parts a trace of so many cycles is drawn.

    Where a cycle has too few columns to be seen, a part is a cycle: in shorter ones the largest and
    smallest sample would beat with the oscillation, and a steady motion look modulated.

    Examples
    --------
    >>> columns_of(10.0), columns_of(400.0), columns_of(3000.0), columns_of(0.0)
    (560, 400, 500, 560)
    """
    if cycles * _A_CYCLE <= COLUMNS:
        return COLUMNS
    whole = math.ceil(cycles / COLUMNS)  # cycles in a part
    return max(int(cycles / whole), 1)


def band(
    time: FloatArray, values: FloatArray, *, columns: int = COLUMNS
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, smallest and largest values of `columns` equal parts: what a screen shows of a trace.

    Examples
    --------
    >>> t, low, high = band(np.arange(6.0), np.array([0, 1, 2, 3, 2, 1.0]), columns=2)
    >>> t, low, high
    (array([1., 4.]), array([0., 1.]), array([2., 3.]))
    """
    edges = np.unique(np.linspace(0, len(values), min(columns, len(values)) + 1).astype(np.int64))
    start = edges[:-1]
    middle = 0.5 * (time[start] + time[edges[1:] - 1])
    return middle, np.fmin.reduceat(values, start), np.fmax.reduceat(values, start)


def draw_trace(axis: Axes, trace: Trace, *, colour: str) -> None:
    """Draw a trace as a line, or as a band where it has more samples than the screen columns."""
    if trace.high is None and len(trace.values) <= 2 * COLUMNS:
        axis.plot(trace.time, trace.values, color=colour, linewidth=0.9)
        return
    if trace.high is None:
        time, low, high = band(trace.time, trace.values, columns=trace.columns)
    else:
        time, low, high = trace.time, trace.values, trace.high
    axis.fill_between(time, low, high, color=colour, linewidth=0.4)


def overview(traces: Sequence[Trace], *, title: str) -> Figure:
    """Every channel of one record over its whole length.

    Parameters
    ----------
    traces : sequence of Trace
        Named ``displacement (mm)``: the first word chooses the colour.
    """
    figure, axes = new_figure(len(traces), 1, height=0.6 + 1.1 * len(traces), sharex=True)
    for axis, trace in zip(axes, traces, strict=True):
        draw_trace(axis, trace, colour=COLOURS[trace.name.split()[0]])
        axis.set_ylabel(trace.name.replace(" ", "\n", 1))
    axes[-1].set_xlabel("time (s)")
    axes[-1].margins(x=0.01)
    axes[0].set_title(title)
    figure.align_ylabels()
    return figure


def amplitudes(
    traces: Sequence[Trace], *, xlabel: str, ylabel: str, bare: int = 0, title: str = ""
) -> Figure:
    """Amplitudes of several records on one axis; the first `bare` of them, without NES, in grey."""
    figure, (axis,) = new_figure(height=3.6)
    colours = [COLOURS["bare"]] * bare + sequence(len(traces) - bare)
    for trace, colour in zip(traces, colours, strict=True):
        (line,) = axis.plot(trace.time, trace.values, color=colour, label=trace.name, linewidth=1.1)
        if trace.record:
            link(line, trace.record, f"{trace.record}: {trace.name}")
    axis.legend(loc="upper right", ncols=2 if len(traces) > 5 else 1, fontsize=8)
    axis.set_xlabel(xlabel)
    axis.set_ylabel(ylabel)
    axis.set_title(title)
    axis.set_ylim(bottom=0.0)
    axis.margins(x=0.01)
    return figure


def sequence(n: int) -> list[str]:
    """`n` colours: the palette's, or from dark to light where it has too few."""
    if n <= len(SEQUENCE):
        return list(SEQUENCE[:n])
    import matplotlib as mpl
    from matplotlib.colors import to_hex

    return [to_hex(colour) for colour in mpl.colormaps["viridis"](np.linspace(0.0, 0.92, n))]
