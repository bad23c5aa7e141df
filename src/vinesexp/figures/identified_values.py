"""Identified values: by every method, as they shrink over a campaign, over several campaigns; and
what the records say of the values that were stated (inputs.csv)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from vinesexp.figures.numbers import difference, plus_minus
from vinesexp.figures.record_words import short
from vinesexp.figures.style import COLOURS, FAINT, SEQUENCE, Drawn, key, label, link, new_figure
from vinesexp.records.stored.tables import Row, ids_of
from vinesexp.results import CampaignResults, Results
from vinesexp.results_differences import Repeated
from vinesexp.units import COVERAGE_95, first_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def value_over_folders(one: Repeated) -> Figure:
    """A row a folder, the first at the top: the value with its 95 % interval, beside the mean's."""
    names, mean = one.folders, one.mean
    figure, (axis,) = new_figure(height=0.95 + 0.24 * len(names))
    low, high = (mean + side * COVERAGE_95 * one.mean_error for side in (-1.0, 1.0))
    axis.axvspan(low, high, color=COLOURS["exact"], alpha=0.18, linewidth=0)
    axis.axvline(mean, color=COLOURS["exact"])
    places = range(len(names))[::-1]
    half, ink = COVERAGE_95 * one.errors, COLOURS["measured"]
    axis.errorbar(one.values, places, xerr=half, fmt="o", color=ink, capsize=2.5, linewidth=1.2)
    axis.set_yticks(list(places), [short(name) for name in names])
    axis.set_ylim(-0.6, len(names) - 0.4)
    axis.grid(axis="y", visible=False)
    axis.ticklabel_format(axis="x", useOffset=False)
    axis.set_xlabel("value" if one.unit in ("", "1") else one.unit)
    above = {"va": "bottom", "xycoords": axis.get_xaxis_transform()}
    label(axis, "mean", (mean, 1.0), "exact", (0, 3), ha="center", **above)
    return figure


#: How each parameter is written.
SYMBOLS = {"f0": "f₀", "zeta": "ζ", "M": "M", "c1": "c₁", "k1": "k₁", "r": "r"}


#: Parameters whose intervals are drawn as they shrink.
_SHRINKING = ("M", "c1", "k1", "r")

#: Units of a relative deviation, smallest first, with their sizes.
_SHARES = (("ppm", 1e-6), ("%", 1e-2))


def draw_identified(results: CampaignResults) -> Iterator[tuple[Figure, Drawn]]:
    """What each method found, where more than one found a value."""
    values = {
        name: plus_minus(row["value"], row["std_error"], row["unit"])
        for name, row in results.values.items()
    }
    figure = estimates_by_method(results.rows("identified"), values)
    if figure is not None:
        title = (
            "Identified values that more than one method found, as deviation from the combined "
            "value (green, its 95 % interval shaded), which the predictions use"
        )
        text = (
            "Bars are 95 % intervals. Methods whose bars do not meet disagree; for M the usual "
            "cause is a wrong clearance, ball mass or added mass. c1 and k1 follow from M, f0 "
            "and ζ."
        )
        yield figure, Drawn("identified", "identified", title, text)


def estimates_by_method(rows: Sequence[Row], values: Mapping[str, str]) -> Figure | None:
    """One panel a parameter that several methods found: how far each is from the combined value.

    Parameters
    ----------
    rows : sequence
        Rows of identified.csv.
    values : mapping
        Parameter to its combined value as text, for the titles.

    Returns
    -------
    Figure or None
        None where no parameter was found by more than one method.
    """
    methods = {
        name: [row for row in rows if row["parameter"] == name and row["method"] != "combined"]
        for name in values
    }
    # c1 and k1 are made from M, f0 and zeta: their panels would repeat that of M.
    shown = [name for name, own in methods.items() if len(own) > 1 and name not in ("c1", "k1")]
    if not shown:
        return None
    lines = [len(methods[name]) for name in shown]
    figure, axes = new_figure(
        *(len(shown), 1),
        height=0.3 + sum(0.24 * n + 0.72 for n in lines),
        gridspec_kw={"height_ratios": [n + 2.2 for n in lines]},
    )
    combined = {row["parameter"]: row for row in rows if row["method"] == "combined"}
    for axis, name in zip(axes, shown, strict=True):
        _panel(axis, methods[name], combined[name])
        axis.set_title(f"{SYMBOLS.get(name, name.replace('_', ' '))} = {values[name]}")
    above = {"ha": "right", "va": "bottom", "xycoords": "axes fraction"}
    label(axes[0], "combined", (1.0, 1.0), "exact", (0, 4), **above)
    return figure


def intervals_over_records(history: Sequence[Mapping[str, Any]]) -> Figure:
    """How the 95 % intervals shrink while a campaign is measured.

    Parameters
    ----------
    history : sequence
        From the oldest on: `records`, their number, and `values`, parameter to value and standard
        error.
    """
    from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

    figure, [axis] = new_figure(height=2.3)
    ends: list[tuple[list[str], tuple[float, float], str]] = []
    for name, colour in zip(_SHRINKING, SEQUENCE, strict=False):
        own = [
            (one["records"], 100.0 * COVERAGE_95 * one["values"][name][1] / one["values"][name][0])
            for one in history
            if one["values"].get(name, (0.0, 0.0))[1]
        ]
        if own:
            records, widths = zip(*own, strict=True)
            axis.plot(records, widths, "o-", color=colour, markersize=3)
            # Of widths in a smaller ratio the names would cover one another.
            near = [end for end in ends if abs(math.log(end[1][1] / widths[-1])) < 0.2]
            if not near:
                ends += (near := [([], own[-1], colour)])
            near[0][0].append(SYMBOLS[name])  # one name beside the other
    for names, place, colour in ends:
        label(axis, ", ".join(names), place, colour)
    axis.set_yscale("log")
    axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.yaxis.set_major_formatter("{x:g}")
    axis.yaxis.set_minor_formatter(NullFormatter())
    axis.set(xlabel="records", ylabel="± % of the value")
    axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


def _panel(axis: Axes, rows: Sequence[Row], combined: Row) -> None:
    centre = combined["value"] or 1.0

    def deviations(row: Row) -> list[float]:
        values = (row[name] for name in ("value", "ci95_low", "ci95_high"))
        return [(row["value"] if v is None else v) / centre - 1.0 for v in values]

    reach = max(abs(d) for row in (*rows, combined) for d in deviations(row))
    unit, size = next((s for s in _SHARES if reach < 1e3 * s[1]), _SHARES[-1])
    _, low, high = (d / size for d in deviations(combined))
    axis.axvspan(low, high, color=COLOURS["exact"], alpha=0.18, linewidth=0)
    axis.axvline(0.0, color=COLOURS["exact"])
    for place, row in enumerate(reversed(rows)):
        value, low, high = (d / size for d in deviations(row))
        axis.plot([low, high], [place, place], "|-", color=COLOURS["measured"], markersize=5)
        axis.plot(value, place, "o", color=COLOURS["measured"])
    axis.set_yticks(range(len(rows)), [row["method"] for row in reversed(rows)])
    axis.set_ylim(-0.7, len(rows) - 0.3)
    axis.grid(axis="y", visible=False)
    axis.margins(x=0.12)
    axis.ticklabel_format(axis="x", useOffset=False)
    axis.set_xlabel(f"from the combined value ({unit})", fontsize=8, labelpad=1)


#: Lines of the figure: those that are contradicted first.
_MOST = 40
_ORDER = {"off": 0, "doubtful": 1, "ok": 2, "not tested": 3}

#: Beyond so many standard uncertainties the axis is logarithmic.
_LINEAR = 30.0
#: Verdict to its words and colour.
_MARKS = {
    "off": ("contradicted", COLOURS["impact"]),
    "doubtful": ("differs, not explained", COLOURS["published"]),
    "ok": ("agrees", COLOURS["displacement"]),
}


def found_minus_stated(rows: Sequence[Row]) -> Figure:
    """A row an input: found minus stated with its 95 % interval, beside that of what was stated.

    Parameters
    ----------
    rows : sequence of mappings
        Of inputs.csv, tested ones with an error of what was stated; the first at the top.
    """
    figure, (axis,) = new_figure(height=1.3 + 0.21 * len(rows))
    axis.axvspan(-COVERAGE_95, COVERAGE_95, color=FAINT, alpha=0.45, linewidth=0, zorder=0)
    axis.axvline(0.0, color=FAINT, linewidth=1.0, zorder=0)
    reach, names = 2.2, [named(row, short) for row in rows]
    words = [difference(_away(row), row["found_error"] or 0.0, row["unit"]) for row in rows]
    for place, row in enumerate(rows):
        away = _away(row) / row["stated_error"]
        half = COVERAGE_95 * (row["found_error"] or 0.0) / row["stated_error"]
        reach, ink = max(reach, abs(away) + half), _MARKS[row["verdict"]][1]
        drawn = axis.errorbar(away, place, xerr=half, fmt="o", color=ink, capsize=2, markersize=4)
        ids = ids_of(row["record"])
        if len(ids) == 1:
            link(drawn.lines[0], ids[0], f"{names[place]}: {words[place]}")
    axis.set_yticks(range(len(rows)), names)
    axis.set_ylim(len(rows) - 0.4, -0.6)
    reach *= 1.15
    if reach > _LINEAR:
        axis.set_xscale("symlog", linthresh=_LINEAR / 10.0)
    name = "found minus stated\n(in stated standard uncertainties)"
    axis.set(xlabel=name, xlim=(-reach, reach))
    for place, row in enumerate(rows):
        at, ink = (reach, place), _MARKS[row["verdict"]][1]
        label(axis, words[place], at, ink, (6, 0), fontsize=7.5)
    shown = {row["verdict"] for row in rows}
    entries = [("o", ink, name) for verdict, (name, ink) in _MARKS.items() if verdict in shown]
    key(figure, axis, [*entries, ("#", FAINT, "95 % of what was stated")], columns=4)
    return figure


def _away(row: Row) -> float:
    """Found minus stated, in the unit of the row."""
    away: float = row["found"] - row["stated"]
    return away


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
    far = sorted(known, key=_distance)[:_MOST]
    figure = found_minus_stated([row for row in known if row in far])
    text = (
        "Found minus stated, "
        "with the 95 % interval of what was found, as a multiple of the standard uncertainty of "
        "what was stated (the band is its 95 % interval), and in the unit of each at the right. "
        "Found means: by all records together, the stated value included."
    )
    if untested := len(rows) - len(tested):
        text += f" Left out: {untested} that the records do not test."
    if len(known) > _MOST:
        shown = f"Shown are the {_MOST} of {len(known)} that are farthest from what was stated"
        text += f" {shown}; inputs.csv has all."
    title = "Values in campaign.yaml and records.csv, tested by the records"
    yield figure, Drawn("stated_values", "inputs", title, text)


def _distance(row: Row) -> tuple[int, float]:
    """Contradicted values first, then those farthest from what was stated."""
    return _ORDER[row["verdict"]], -abs(_away(row)) / row["stated_error"]


def named(row: Row, written: Callable[[str], str] = str) -> str:
    """What was stated, and for which record, as it is written.

    Examples
    --------
    >>> named({"item": "base_amplitude", "record": "a;b;c"}), named({"item": "mass", "record": ""})
    ('base amplitude, a and 2 more', 'mass')
    """
    ids = [written(id) for id in ids_of(row["record"])]
    item = row["item"].replace("nes_mass", "ball mass").replace("_", " ")
    return f"{item}, {first_of(ids, 1)}" if ids else item
