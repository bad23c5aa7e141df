"""inputs.csv as a figure: what the records say of clearances, masses, base amplitudes and gains."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vinesexp.figures.numbers import difference
from vinesexp.figures.style import COLOURS, FAINT, Drawn, label, link, new_figure
from vinesexp.records.stored.tables import Row, ids_of
from vinesexp.results import Results
from vinesexp.units import COVERAGE_95

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

#: Lines of the figure: those that are contradicted first.
_MOST = 40
_ORDER = {"off": 0, "ok": 1, "not tested": 2}

#: Beyond so many standard uncertainties the axis is logarithmic.
_LINEAR = 30.0
#: Verdict to its words and colour.
_MARKS = {
    "off": ("contradicted", COLOURS["impact"]),
    "ok": ("agrees", COLOURS["displacement"]),
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
    verdict : ``ok`` or ``off``.
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
        _, colour = _MARKS[value.verdict]
        drawn = axis.errorbar(
            value.away, row, xerr=COVERAGE_95 * value.error, fmt="o", color=colour, capsize=2,
            elinewidth=1.0, markersize=4,
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
        axis.plot([], [], "o", color=ink, markersize=4, label=name)[0]
        for verdict, (name, ink) in _MARKS.items()
        if verdict in shown
    ]
    handles.append(
        axis.fill_between([], [], color=FAINT, alpha=0.45, label="95 % of what was stated")
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8)
    return figure


def input_rows(results: Results) -> list[Row]:
    """Rows of inputs.csv, contradicted ones first; none where the campaign has no such table."""
    rows = [r for r in results.rows("inputs") if None not in (r["found"], r["stated"])]
    return sorted(rows, key=lambda row: _ORDER[row["verdict"]])


def draw_inputs(rows: Sequence[Row]) -> Iterator[tuple[Figure, Drawn]]:
    """Found against stated, an input a line."""
    tested = [row for row in rows if row["verdict"] != "not tested"]
    known = [row for row in tested if (row["stated_error"] or 0.0) > 0.0]
    if not known:
        return
    figure = found_minus_stated([_value(row) for row in known[:_MOST]])
    text = (
        "Found minus stated, "
        "with the 95 % interval of what was found, as a multiple of the standard uncertainty of "
        "what was stated (the band is its 95 % interval), and in the unit of each at the right. "
        "Found means: by all records together, the stated value included."
    )
    if untested := len(rows) - len(tested):
        text += f" Left out: {untested} that the records do not test."
    if len(known) > _MOST:
        text += f" The first {_MOST} of {len(known)}; inputs.csv has all."
    title = "What the records say of the values in campaign.yaml and records.csv"
    yield figure, Drawn("stated_values", "inputs", title, text)


def _value(row: Row) -> StatedValue:
    away, error, size = row["found"] - row["stated"], row["found_error"] or 0.0, row["stated_error"]
    ids = ids_of(row["record"])
    return StatedValue(
        name=named(row),
        away=away / size,
        error=error / size,
        words=difference(away, error, row["unit"]),
        verdict=row["verdict"],
        record=ids[0] if len(ids) == 1 else "",
    )


def named(row: Row) -> str:
    """What was stated, and for which record.

    Examples
    --------
    >>> named({"item": "base_amplitude", "record": "a;b;c"}), named({"item": "mass", "record": ""})
    ('base amplitude, a and 2 more', 'mass')
    """
    ids = ids_of(row["record"])
    more = f" and {len(ids) - 1} more" if len(ids) > 1 else ""
    item = row["item"].replace("nes_mass", "ball mass").replace("_", " ")
    return f"{item}, {ids[0]}{more}" if ids else item
