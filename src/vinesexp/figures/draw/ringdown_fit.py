"""A free decay, the exponential fitted to it, and what the exponential leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vinesexp.figures.draw.style import COLOURS, label, link, new_figure
from vinesexp.figures.draw.traces import Trace, draw_trace, sequence

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Decay:
    """Amplitude of one ring-down, cycle by cycle, beside the exponential fitted to it.

    Attributes
    ----------
    name : of the record.
    time : middle of each cycle, s.
    amplitude, fitted : mm.
    law : mm; the same with damping that depends on amplitude, empty where none was found.
    law_name : ``quadratic``.
    """

    name: str
    time: Floats
    amplitude: Floats
    fitted: Floats
    law: Floats
    law_name: str = ""


def ringdown_and_fit(trace: Trace, shown: Decay, others: Sequence[Decay], *, title: str) -> Figure:
    """One decay with its fitted envelope, and what is left of the amplitude of every decay.

    Parameters
    ----------
    trace : Trace
        Displacement, mm.
    shown : Decay
        Of the same record.
    others : sequence of Decay
        All decays whose misfit is to be compared, the one shown among them.
    title : str
        With the fitted values.
    """
    figure, (above, below) = new_figure(
        2, 1, height=4.4, sharex=True, gridspec_kw={"height_ratios": [1.4, 1.0]}
    )
    draw_trace(above, trace, colour=COLOURS["displacement"])
    envelope = shown.law if shown.law.size else shown.fitted
    for sign in (1.0, -1.0):
        above.plot(shown.time, sign * envelope, color=COLOURS["exact"], linewidth=1.4)
    middle = shown.time.size // 6
    name = f"viscous and {shown.law_name} damping" if shown.law.size else "exponential"
    label(
        *(above, name, (shown.time[middle], envelope[middle])),
        colour=COLOURS["exact"],
        shift=(8, 8),
    )
    above.set_ylabel("displacement (mm)")
    above.set_title(title)
    above.margins(x=0.01)
    for decay, colour in zip(others, sequence(len(others)), strict=True):
        _misfit(below, decay, decay.fitted, colour, faint=decay.law.size > 0)
        if decay.law.size:
            _misfit(below, decay, decay.law, colour, faint=False)
    if len(others) > 1:
        handles = [
            below.plot([], [], "o-", color=colour, markersize=3, label=decay.name)[0]
            for decay, colour in zip(others, sequence(len(others)), strict=True)
        ]
        figure.legend(
            handles=handles,
            loc="outside lower right",
            ncols=6,
            fontsize=8,
            title="faint: what an exponential leaves" if shown.law.size else None,
            title_fontsize=8,
        )
    below.axhline(0.0, color=COLOURS["exact"], linewidth=1.0)
    below.set_ylabel("amplitude minus fit\n(% of the start)")
    below.set_xlabel("time (s)")
    figure.align_ylabels()
    return figure


def _share(decay: Decay, fit: Floats) -> Floats:
    share: Floats = 100.0 * (decay.amplitude - fit) / fit[0]
    return share


def _misfit(axis: Axes, decay: Decay, fit: Floats, colour: str, *, faint: bool) -> None:
    alpha = 0.3 if faint else 1.0
    share = _share(decay, fit)
    axis.plot(decay.time, share, "o-", color=colour, markersize=2, linewidth=0.8, alpha=alpha)


@dataclass(frozen=True)
class Loaded:
    """Ring-downs with added masses, and the line through them.

    Attributes
    ----------
    names : of the records.
    loads : added masses, kg.
    periods : 1/(2 pi f)^2, s^2.
    half : half of the 95 % interval of what each is off the line, kg.
    M, k1 : the line is (M + load)/k1.
    """

    names: Sequence[str]
    loads: Floats
    periods: Floats
    half: Floats
    M: float
    k1: float

    @property
    def off(self) -> Floats:
        """How much more mass each frequency shows than the line has, kg."""
        found: Floats = self.k1 * self.periods - (self.M + self.loads)
        return found


def added_mass_line(loaded: Loaded, *, title: str) -> Figure:
    """Squared period over added mass, a straight line; and how far each point is off it, in grams.

    Parameters
    ----------
    loaded : Loaded
    title : str
        With the identified mass.
    """
    figure, (line, off) = new_figure(1, 2, height=2.7, gridspec_kw={"width_ratios": [1.0, 1.35]})
    M, k1, loads = loaded.M, loaded.k1, loaded.loads
    reach = np.array([-M, 1.05 * float(loads.max())])
    line.plot(reach, 1e4 * (M + reach) / k1, color=COLOURS["exact"])
    line.plot(loads, 1e4 * loaded.periods, "o", color=COLOURS["measured"])
    line.plot(-M, 0.0, "o", color=COLOURS["exact"], markerfacecolor="white")
    label(line, f"−M = −{M:.4g} kg", (-M, 0.0), colour=COLOURS["exact"], shift=(6, -1), va="top")
    line.set_xlabel("added mass (kg)")
    line.set_ylabel("1/(2πf)² (10⁻⁴ s²)")
    line.set_title(title)
    line.set_ylim(bottom=-0.2 * line.get_ylim()[1])  # room for the name of the intercept
    off.axhline(0.0, color=COLOURS["exact"])
    points = zip(loaded.names, loads, loaded.off, loaded.half, strict=True)
    for name, load, away, half in points:
        drawn = off.errorbar(
            1e3 * load, 1e3 * away, 1e3 * half, fmt="o", color=COLOURS["measured"], capsize=3
        )
        link(drawn.lines[0], name, f"{name}: {1e3 * load:g} g, {1e3 * away:+.2g} g off the line")
    off.set_xlabel("added mass (g)")
    off.set_ylabel("off the line (g)")
    off.set_title("what is left")
    off.margins(x=0.1, y=0.15)
    return figure
