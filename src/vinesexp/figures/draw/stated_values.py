"""Stated values beside what the records say of them: one line an input."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vinesexp.figures.draw.style import COLOURS, FAINT, label, link, new_figure
from vinesexp.units import COVERAGE_95

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

#: Beyond so many standard uncertainties the axis is logarithmic.
_LINEAR = 30.0
#: Verdict to its words, colour, and that of the inside of its points.
_MARKS = {
    "off": ("contradicted", COLOURS["impact"], COLOURS["impact"]),
    "ok": ("agrees", COLOURS["displacement"], COLOURS["displacement"]),
    "not tested": ("not tested", "#6b6b6b", "#ffffff"),
}


@dataclass(frozen=True)
class StatedValue:
    """One input that was stated.

    Attributes
    ----------
    name : ``clearance, b34``.
    away, error : found minus stated and its standard error, in standard uncertainties of what was
        stated.
    words : the same in its unit.
    verdict : ``ok``, ``off`` or ``not tested``.
    record : id to which the point leads; empty for none.
    """

    name: str
    away: float
    error: float
    words: str
    verdict: str
    record: str = ""


def found_minus_stated(values: Sequence[StatedValue]) -> Figure:
    """A row an input: found minus stated with its 95 % interval, beside that of what was stated.

    Parameters
    ----------
    values : sequence of StatedValue
        The first at the top.
    """
    figure, (axis,) = new_figure(height=1.3 + 0.21 * len(values))
    axis.axvspan(-COVERAGE_95, COVERAGE_95, color=FAINT, alpha=0.45, linewidth=0, zorder=0)
    axis.axvline(0.0, color=FAINT, linewidth=1.0, zorder=0)
    for row, value in enumerate(values):
        _, colour, inside = _MARKS[value.verdict]
        drawn = axis.errorbar(
            value.away, row, xerr=COVERAGE_95 * value.error, fmt="o", color=colour, capsize=2,
            elinewidth=1.0, markersize=4, markerfacecolor=inside,
        )  # fmt: skip
        if value.record:
            link(drawn.lines[0], value.record, f"{value.name}: {value.words}")
    axis.set_yticks(range(len(values)), [value.name for value in values])
    axis.set_ylim(len(values) - 0.4, -0.6)
    most = max([abs(v.away) + COVERAGE_95 * v.error for v in values], default=1.0)
    reach = 1.15 * max(most, 2.2)
    if reach > _LINEAR:
        axis.set_xscale("symlog", linthresh=_LINEAR / 2.0)
    axis.set_xlim(-reach, reach)
    axis.set_xlabel("found minus stated (in standard uncertainties of what was stated)")
    for row, value in enumerate(values):
        colour = _MARKS[value.verdict][1]
        label(axis, value.words, (reach, row), colour=colour, shift=(6, 0), fontsize=7.5)
    shown = {value.verdict for value in values}
    handles: list[Artist] = [
        axis.plot([], [], "o", color=ink, markersize=4, markerfacecolor=inside, label=name)[0]
        for verdict, (name, ink, inside) in _MARKS.items()
        if verdict in shown
    ]
    handles.append(
        axis.fill_between([], [], color=FAINT, alpha=0.45, label="95 % of what was stated")
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8)
    return figure
