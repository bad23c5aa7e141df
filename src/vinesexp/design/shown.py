"""What is shown of an answer: its headline, its tables and its notes, each number written once.

Text and design sheet lay out the same cells; ``--json`` has the numbers behind them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from textwrap import wrap

import numpy as np

from vinesexp.design.advice import Advice, Judged
from vinesexp.design.around import Changed
from vinesexp.design.ensemble import longest_watch
from vinesexp.design.headline import (
    Answer,
    headline_of,
    mm,
    percent,
    percentile_in_words,
    remarks_of,
    seconds,
)
from vinesexp.design.inputs import OPTIONS, RIG, Given
from vinesexp.design.predictions import Theory, bands_given, single_values, start_amplitude
from vinesexp.design.recorded import UnderRecord
from vinesexp.design.released import Falls
from vinesexp.design.task import wall_starts
from vinesexp.theory.intervals import ClearancePrediction
from vinesexp.units import COVERAGE_95, with_error

#: Symbols that are not those of the options, and the units a person writes a value in, per SI unit.
SYMBOLS = {"frequency": "f", "friction": "mu g", "quadratic": "", "coulomb": "", "tolerance": ""}
#: Titles of the tables that a sheet of one page leaves out.
BY_CLEARANCE = "The release by clearance"
SENSITIVITIES = "Sensitivities of the exact values"
UNITS = {"m": ("g", 1e3), "tolerance": ("%", 100.0)}


@dataclass(frozen=True)
class Table:
    """A table of finished cells.

    Attributes
    ----------
    title, below : what stands above and below it.
    heads : of its columns, the first of them without one; empty: every row is a name and its value.
    rows : the first cell says what the row is of.
    """

    title: str
    heads: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    below: str = ""


def text_of(answer: Answer) -> str:
    """The answer as a person reads it in a terminal."""
    lines = wrap(headline_of(answer), 96)
    for table in tables_of(answer):
        lines += ["", table.title, *table_lines(table)]
    notes = notes_of(answer)
    return "\n".join([*lines, *(["", "Note"] if notes else []), *(f"  ! {one}" for one in notes)])


def table_lines(table: Table) -> list[str]:
    """A table in columns, or its names and values.

    Examples
    --------
    >>> print("\\n".join(table_lines(Table("", ("mean (mm)",), [("least mean", "5.273")], "once"))))
                  mean (mm)
      least mean      5.273
      once
    """
    below = [f"  {line}" for line in wrap(table.below, 94)]
    first = max((len(row[0]) for row in table.rows), default=0)
    if not table.heads:
        return [*(f"  {name:{first}} = {value}" for name, value in table.rows), *below]
    heads = [("", *(head.split("\n")[-1] for head in table.heads))]
    if any("\n" in head for head in table.heads):
        heads.insert(0, ("", *(head.rpartition("\n")[0] for head in table.heads)))
    every = [*heads, *table.rows]
    wide = [max(len(row[k]) for row in every) for k in range(1, len(table.heads) + 1)]
    lines = [
        f"  {row[0]:{first}}" + "".join(f"{c:>{w + 3}}" for c, w in zip(row[1:], wide, strict=True))
        for row in every
    ]
    return [*(line.rstrip() for line in lines), *below]


def notes_of(answer: Answer) -> list[str]:
    """What a reader would otherwise be misled by, first of all why there is no exact b_c."""
    no_orbit = [answer.theory.no_orbit] if answer.theory.no_orbit else []
    return [*no_orbit, *remarks_of(answer)]


def tables_of(answer: Answer) -> list[Table]:
    """All that is shown, in order: the rig, what to build, what lies beside it, theory."""
    given, theory, advice = answer.given, answer.theory, answer.advice
    tables = [Table("Rig", (), rig_rows(given, theory))]
    if advice is not None:
        tables += [from_rest(advice), from_random(advice), one_value_off(advice)]
        tables.append(Table("For comparison", (), beside_rows(advice)))
    if answer.driven is not None:
        tables.append(recorded(answer.driven))
    tables.append(of_theory(given, theory))
    if answer.falls is not None:
        tables += [fastest(answer.falls, theory), by_clearance(answer.falls)]
    elif theory.releases:
        tables.append(releases(theory))
    if theory.b_c is not None or theory.b_t is not None:
        tables.append(sensitivities(given, theory))
    return tables


def rig_rows(given: Given, theory: Theory) -> list[tuple[str, ...]]:
    """Every value given, with its 95 % interval, and what follows from them."""
    rows: list[tuple[str, ...]] = []
    for option in OPTIONS:
        if option.symbol not in given:
            continue
        unit, size = UNITS.get(
            option.symbol, ("mm", 1e3) if option.unit == "m" else (option.unit, 1.0)
        )
        texts = []
        for q in given[option.symbol]:
            text = f"{with_error(size * q.value, size * COVERAGE_95 * q.std_error)} {unit}".rstrip()
            texts.append(f"{text} (95 %)" if q.std_error else text)
        apart = " to " if option.symbol in ("G", "frequency") else "; "
        name = f"{option.flag[2:].replace('-', ' ')} {SYMBOLS.get(option.symbol, option.symbol)}"
        rows.append((name.rstrip(), apart.join(texts)))
    if theory.F_c is not None:
        o = given.oscillator
        eps = given.one("m").value / o.M
        rows.append(("natural frequency f0", f"{o.f0:.4f} Hz"))
        rows.append(("zeta, eps", f"{o.zeta:.3g}, {eps:.4g}"))
        rows.append(("lambda, F_c", f"{2.0 * o.zeta / eps:.4g}, {theory.F_c:.5f}"))
    rows.append(("A_1 (T1), A_2 (T2; paper: 0.6)", f"{theory.A_1:.5f}, {theory.A_2:.5f}"))
    return rows


def judged_rows(advice: Advice) -> list[tuple[str, Judged]]:
    """The clearances that are judged, by name; the one to build first."""
    asked = [] if advice.asked is None else [("as given", advice.asked)]
    return [
        ("robust", advice.robust), ("least mean", advice.least_mean),
        ("least largest", advice.least_max), *asked,
    ]  # fmt: skip


def each_ball(advice: Advice, b: float) -> str:
    """A clearance (m) of every ball, mm; one value where they are alike."""
    ratios = advice.task.ratios
    return "; ".join(mm(b * ratio) for ratio in (ratios if len(set(ratios)) > 1 else ratios[:1]))


def from_rest(advice: Advice) -> Table:
    """The clearances, oscillator at rest and balls at their walls."""
    rows = [
        (
            name, each_ball(advice, one.b), _over(one.b, advice.published),
            _over(one.b, advice.exact), mm(one.rest_mean), mm(one.rest_max),
            percent(1.0 - one.rest_mean / advice.bare_mean),
            "-" if advice.hopeless else percent(one.captured_rest), mm(one.centre_mean),
        )
        for name, one in judged_rows(advice)
    ]  # fmt: skip
    task = advice.task
    frequency = 0.5 * sum(task.frequencies)
    middle = replace(task, frequencies=(frequency, frequency))
    longest = longest_watch(wall_starts(middle, advice.robust.b, range(1)))
    over = " and over levels and frequencies; largest is that of the worst" if task.ranged else ""
    below = (
        f"Exact event simulation; settled amplitudes in mm (after at most {longest:.2g} s where "
        "starts differ in capture or amplitude); b is one-sided. The oscillator starts at rest; "
        f"values are averaged over the phase at which the shaker starts{over}. Less: reduction "
        f"of the mean from the bare oscillator's {mm(advice.bare_mean)} mm. Captured: two impacts "
        "per cycle or more, not modulated. Mid-cavity: mean with the ball at rest in the middle."
    )
    if advice.task.frequencies[0] < advice.task.frequencies[1]:
        below += (
            " Captured is the share of the whole band, including frequencies at which the motion "
            "is too small for the ball."
        )
    heads = (
        "b (mm)", "b/b_c\npublished", "b/b_c\nexact", "mean", "largest", "less", "captured",
        "mid-cavity",
    )  # fmt: skip
    return Table("Clearances from rest, ball at a wall", heads, rows, below)


def from_random(advice: Advice) -> Table:
    """The same under random starts."""
    rows = [
        (
            name, each_ball(advice, one.b), mm(one.random_mean),
            percentile_in_words(one, mm), mm(one.random_max),
            percent(1.0 - one.random_mean / one.random_bare),
            "-" if advice.hopeless else percent(one.captured),
        )
        for name, one in judged_rows(advice)
    ]  # fmt: skip
    below = (
        "Robust: least 90th percentile. The oscillator starts anywhere within its bare response, "
        "balls at rest anywhere, values within their errors, each start with its own b within "
        f"{100.0 * advice.task.tolerance:.2g} %. +-: two standard errors of {advice.judged.random} "
        "starts that were not used in the choice. Less: reduction from the bare oscillator over "
        "the same draws."
    )
    heads = ("b (mm)", "mean", "90 % below", "largest", "less", "captured")
    return Table("Clearances from random starts", heads, rows, below)


def _over(value: float, reference: float | None) -> str:
    if reference is None:
        return "-"
    ratio = value / reference
    return f"{ratio:.3f}" if ratio >= 0.01 else f"{ratio:.2g}"


def one_value_off(advice: Advice) -> Table:
    """The robust clearance with one value off, beside itself under the same starts."""
    changes = sorted({one.change for one in advice.changed})
    rows: list[tuple[str, ...]] = []
    for name in ("b", "G", "f", "r"):
        own = [
            next((one for one in advice.changed if (one.name, one.change) == (name, change)), None)
            for change in changes
        ]
        rows.append((name, *("-" if one is None else _pair(one) for one in own)))
        if name == "f":
            bare = ("-" if one is None else mm(one.bare) for one in own)
            rows.append(("bare oscillator at f", *bare))
    below = (
        "Each cell: mean from rest; 90 % below. With the values as given: "
        f"{_pair(advice.unchanged)}. 90 % below is of {advice.beside.random} random starts, the "
        "same in every cell and fewer than above; compare within this table."
    )
    heads = tuple(f"{100 * change:+.0f} %" for change in changes)
    return Table("The robust clearance with one value off", heads, rows, below)


def _pair(one: Changed) -> str:
    return f"{mm(one.rest_mean)}; {mm(one.random_p90)}"


def beside_rows(advice: Advice) -> list[tuple[str, ...]]:
    """Bare oscillator, tuned mass dampers, slow sweeps, levels at which the clearance works."""
    rows: list[tuple[str, ...]] = [("bare oscillator, largest", f"{mm(advice.bare)} mm")]
    for name, damper in (("Den Hartog", advice.den_hartog), ("least worst", advice.optimal)):
        rows.append(
            (
                f"tuned mass damper, {name}",
                f"{mm(damper.amplitude)} mm; 5 % detuned {mm(damper.detuned)} mm "
                f"(f/f0 {damper.tuning:.4f}, zeta {damper.zeta:.4f})",
            )
        )
    for which, sweeps in (("robust", advice.sweeps), ("given", advice.asked_sweeps or ())):
        for one in sweeps:
            rows.append(
                (
                    f"slow sweep, {which} b, {one.begin:.4g} to {one.end:.4g} Hz",
                    f"{mm(one.largest)} mm at {one.at:.4g} Hz; mean over 1/12 of it "
                    f"{mm(one.running)} mm ({one.duration:.3g} s)",
                )
            )
    working = advice.working
    if working.activation is not None:
        rows.append(("captured from rest from a level of", f"{mm(working.activation)} mm on"))
    said = "not at the level designed for"
    if working.low is not None and working.high is not None:
        low = f"{mm(working.low)} mm" + (" or less" if working.low_open else "")
        said = f"{low} to {mm(working.high)} mm" + (" or more" if working.high_open else "")
    rows.append(("leaves 80 % of the bare amplitude or less", said))
    return rows


def recorded(found: UnderRecord) -> Table:
    """Deflection and motion over clearance under a recorded base, median over the starts."""
    rows = []
    for number, one in enumerate([found.bare, *found.found]):
        best = [
            word
            for word, index in (("least rms", found.least_rms), ("least peak", found.least_peak))
            if number - 1 == index
        ]
        lengths = (*(np.median(v) for v in (one.rms, one.peak)), np.percentile(one.peak, 90.0))
        lengths = (*lengths, *(np.median(v) for v in (one.rms_x, one.peak_x)))
        rows.append(
            (
                "no ball" if number == 0 else f"b = {mm(one.b)}",
                *(mm(float(value)) for value in lengths),
                f"{float(np.median(one.impacts)):.0f}",
                ", ".join(best),
            )
        )
    heads = ("rms x - x_e", "peak x - x_e", "90 % below", "rms x", "peak x", "impacts", "")
    below = "In mm: medians over balls at rest anywhere in their cavities and at the walls."
    below += _own(found.tolerance)
    return Table("Under the recorded base, by exact event simulation", heads, rows, below)


def _own(tolerance: float) -> str:
    """How the tolerance enters a table of starts."""
    if tolerance == 0.0:
        return ""
    return f" Every start has its own clearance within {100.0 * tolerance:.2g} % of b."


def of_theory(given: Given, theory: Theory) -> Table:
    """b_c and b_t, published and exact, and the bands of clearances that were given."""

    def row(label: str, p: ClearancePrediction) -> tuple[str, ...]:
        interval = f"{mm(p.low)} to {mm(p.high)}" if p.std_error else "no error bars given"
        return label, mm(p.published), mm(p.exact), interval

    rows: list[tuple[str, ...]] = []
    below = []
    if "G" in given:
        label = f"b_c, G = {1e3 * given.one('G').value:.4g} mm"
        if theory.b_c is not None:
            rows.append(row(label, theory.b_c))
        elif theory.b_c_published is not None:
            rows.append((label, mm(theory.b_c_published), "none", ""))
        below.append("b_c: formula (36); exact: end of the stable orbit (Floquet multipliers).")
    else:
        below.append("b_c: give --base-amplitude.")
    if theory.b_t is not None:
        rows.append(row(f"b_t, x_m = {1e3 * start_amplitude(given):.4g} mm", theory.b_t))
        below.append("b_t: x_m/0.6, formula (37); exact: x_m/A_2(r), T2 in closed form.")
    else:
        below.append("b_t: give --release.")
    below += [
        f"Ball {k}, b = {mm(b)} mm as given: two symmetric impacts per cycle from A_1 b = "
        f"{mm(band.low)} to A_2 b = {mm(band.high)} mm amplitude."
        for k, (b, band) in enumerate(bands_given(given), start=1)
    ]
    heads = ("published", "exact", "95 % interval of the exact value")
    return Table("Clearances of theory (one-sided b, mm)", heads, rows, " ".join(below))


def fastest(falls: Falls, theory: Theory) -> Table:
    """Fastest clearance to each level, of balls anywhere and of balls at a wall."""
    own = {round(one.level, 12): one for one in theory.releases}
    rows = []
    for k, level in enumerate(falls.levels):
        cells = [f"to {mm(level)} mm", seconds(falls.bare[k])]
        for at_wall, index in ((False, falls.fastest[k]), (True, falls.fastest_at_wall[k])):
            best = falls.found[index]
            if falls.helps(k, at_wall=at_wall):
                time = seconds(best.sure(k, at_wall=at_wall))
                cells += [mm(best.b), time, percent(best.captured_share(at_wall=at_wall))]
            else:
                cells += ["none faster", "", ""]
        one = own.get(round(level, 12))
        cells += ["", ""] if one is None else [mm(one.b), seconds(one.time)]
        rows.append(tuple(cells))
    heads = (
        "without\nball (s)", "ball anywhere:\nb (mm)", "3 of 4 (s)", "captured",
        "at the pushing wall:\nb (mm)", "3 of 4 (s)", "captured", "theory, if\ncaptured: b* (mm)",
        "(s)",
    )  # fmt: skip
    below = (
        "3 of 4: time at which three of four balls, at rest anywhere or at the pushing wall, have "
        "reached the level. Captured: share of the captured balls. Theory: b*(level) of a ball "
        f"captured at once, if a wall meets it wherever it is at rest.{_own(falls.tolerance)}"
    )
    return Table("The release by simulation: fastest clearance to each level", heads, rows, below)


def by_clearance(falls: Falls) -> Table:
    """What the clearances of `fastest`, and one that was given, do besides."""
    shown = {*falls.fastest, *falls.fastest_at_wall} | (
        set() if falls.asked is None else {falls.asked}
    )
    rows = []
    for i in sorted(shown):
        one = falls.found[i].anywhere()
        rows.append(
            (
                f"b = {mm(one.b)} mm" + (", as given" if i == falls.asked else ""),
                "; ".join(seconds(one.sure(k), falls.followed) for k in range(len(falls.levels))),
                percent(one.share),
                seconds(float(np.median(one.pumping))),
                *(percent(float(np.median(v))) for v in (one.dissipated, one.left)),
            )
        )
    heads = (
        "to the levels (s)", "captured", "pumping time (s)", "energy by NES", "energy left then",
    )  # fmt: skip
    below = (
        "Balls at rest anywhere: time at which three of four have reached the levels, share "
        "captured, and medians. Pumping time: until the ball leaves two impacts per cycle; 0 if "
        "fewer than half are captured. Energy by NES: share of the energy that the impacts "
        "dissipate. Left: share left at the end of the pumping time. Of several balls: those of "
        "the largest cavity."
    )
    return Table(BY_CLEARANCE, heads, rows, below)


def releases(theory: Theory) -> Table:
    """b*(level) by theory alone."""
    rows = [
        (
            f"to {mm(one.level)} mm", mm(one.b),
            "-" if one.low is None or one.high is None else f"{mm(one.low)} to {mm(one.high)}",
            seconds(one.time), seconds(one.bare_time), percent(one.capture),
        )
        for one in theory.releases
    ]  # fmt: skip
    heads = ("b* (mm)", "95 % interval", "time (s)", "bare (s)", "met at most")
    below = "met at most: share of the balls at rest anywhere in the cavity that a wall reaches."
    title = "Fastest clearance of the release, b*(level), if captured at once"
    return Table(title, heads, rows, below)


def sensitivities(given: Given, theory: Theory) -> Table:
    """Derivatives of the exact clearances with respect to the rig's values."""
    found = {name: p for name, p in (("b_c", theory.b_c), ("b_t", theory.b_t)) if p is not None}
    values = single_values(given)
    rows = []
    for option in (option for option in RIG if option.symbol in values):
        cells: Sequence[str] = ()
        for p in found.values():
            slope = 1e3 * p.gradient[option.symbol] + 0.0  # no minus zero
            unit = f"mm/({option.unit})" if " " in option.unit or "/" in option.unit else "mm"
            unit = f"mm/{option.unit}" if option.unit == "kg" else unit
            change = 0.01 * slope * values[option.symbol].value
            change = 0.0 if math.isclose(change, 0.0, abs_tol=1e-12) else change
            cells = (*cells, f"{slope:.5g} {unit}", f"{change:+.3f} mm")
        rows.append((option.symbol, *cells))
    heads = tuple(head for n in found for head in (f"d {n}/d value", "for +1 %"))
    return Table(SENSITIVITIES, heads, rows)
