"""What to build, what it gives and what stands beside it, as tables a person reads."""

from __future__ import annotations

from vinesexp.design.advice import Advice, Judged
from vinesexp.design.numbers_text import mm, percent
from vinesexp.design.slow_sweep import Swept


def build_lines(advice: Advice) -> list[str]:
    """The three clearances, and one that was given, from rest and from random starts."""
    rows = [
        ("least mean", advice.least_mean),
        ("least largest", advice.least_max),
        ("robust", advice.robust),
    ]
    if advice.asked is not None:
        rows.append(("as given", advice.asked))
    heads = ("b (mm)", "b/b_c pub.", "b/b_c exact", "mean", "largest", "less", "captured")
    lines = [f"  {'from rest, ball at a wall':26}" + "".join(f"{h:>12}" for h in heads)]
    for name, one in rows:
        lines.append(f"  {name:26}" + "".join(f"{c:>12}" for c in _rest_cells(one, advice)))
    heads = ("b (mm)", "mean", "90 % below", "largest", "less", "captured", "mid-cavity")
    wide = (12, 12, 18, 12, 12, 12, 12)
    lines.append(f"  {'from random starts':26}" + _spread(heads, wide))
    for name, one in rows:
        lines.append(f"  {name:26}" + _spread(_random_cells(one, advice.hopeless), wide))
    if len(advice.task.ratios) > 1:
        for name, one in rows:
            each = ", ".join(mm(one.b * ratio) for ratio in advice.task.ratios)
            lines.append(f"  {name}: clearances of the balls {each} mm")
    lines += [
        "  amplitudes in mm, once settled; less: mean against the bare oscillator's",
        f"  {mm(advice.bare_mean)} mm, of random starts over the same draws; captured: two",
        "  impacts a cycle or more, not modulated;",
        "  mid-cavity: mean with the ball at rest in the middle; least mean and least largest",
        "  are averaged over the phase at which the shaker starts; robust: least 90th percentile;",
        f"  +-: two standard errors of {advice.judged} starts that had no part in the choice;",
        f"  every start has its own b within {100.0 * advice.task.tolerance:.2g} %",
    ]
    if len(set(advice.task.ratios)) > 1:
        lines.append("  b: of the largest cavity; the others keep their ratios to it")
    if advice.task.frequencies[0] < advice.task.frequencies[1]:
        lines.append(
            "  captured: of the whole band, also where the motion is too small for the ball"
        )
    return lines


def _spread(cells: tuple[str, ...], widths: tuple[int, ...]) -> str:
    return "".join(f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True))


def _over(value: float, reference: float | None) -> str:
    if reference is None:
        return "-"
    ratio = value / reference
    return f"{ratio:.3f}" if ratio >= 0.01 else f"{ratio:.2g}"


def _rest_cells(one: Judged, advice: Advice) -> tuple[str, ...]:
    return (
        mm(one.b),
        _over(one.b, advice.published),
        _over(one.b, advice.exact),
        mm(one.rest_mean),
        mm(one.rest_max),
        percent(1.0 - one.rest_mean / advice.bare_mean),
        "-" if advice.hopeless else percent(one.captured_rest),
    )


def _random_cells(one: Judged, hopeless: bool) -> tuple[str, ...]:
    return (
        mm(one.b),
        mm(one.random_mean),
        f"{mm(one.random_p90)} +- {2e3 * one.random_error:.3f}",
        mm(one.random_max),
        percent(1.0 - one.random_mean / one.random_bare),
        "-" if hopeless else percent(one.captured),
        mm(one.centre_mean),
    )


def change_lines(advice: Advice) -> list[str]:
    """The robust clearance with one value off, beside itself under the same starts."""
    changes = sorted({one.change for one in advice.changed})
    lines = [
        f"  {'mean from rest; 90 % below':26}" + "".join(f"{100 * c:>+17.0f} %" for c in changes)
    ]
    for name in ("b", "G", "f", "r"):
        by_change = {one.change: one for one in advice.changed if one.name == name}
        cells, bare = [], []
        for change in changes:
            one = by_change.get(change)
            text = f"{mm(one.rest_mean)}; {mm(one.random_p90)}" if one else "-"
            cells.append(f"{text:>19}")
            bare.append(f"{mm(one.bare) if one else '-':>19}")
        lines.append(f"  {name:26}" + "".join(cells))
        if name == "f":
            lines.append(f"  {'   bare oscillator there':26}" + "".join(bare))
    as_it_is = advice.unchanged
    return [
        *lines,
        f"  with nothing off {mm(as_it_is.rest_mean)}; {mm(as_it_is.random_p90)}. 90 % below: of "
        f"{advice.found.effort.starts} random starts, the same in every cell;",
        "  fewer than above, so compare within this table",
    ]


def beside_lines(advice: Advice) -> list[str]:
    """Bare oscillator, tuned mass dampers, slow sweeps, operating range."""
    lines = [f"  bare oscillator, largest              {mm(advice.bare):>9} mm"]
    for name, one in (("Den Hartog", advice.den_hartog), ("least worst", advice.optimal)):
        lines.append(
            f"  tuned mass damper, {name:19}{mm(one.amplitude):>9} mm"
            f"   5 % detuned {mm(one.detuned)} mm"
            f"   (f/f0 {one.tuning:.4f}, zeta {one.zeta:.4f}; mass of the balls)"
        )
    lines += _sweep_lines(advice.sweeps, "the robust one")
    if advice.asked_sweeps is not None:
        lines += _sweep_lines(advice.asked_sweeps, "that given")
    return lines + _range_lines(advice)


def _sweep_lines(sweeps: tuple[Swept, Swept], which: str) -> list[str]:
    return [
        f"  slow sweep {way:4} with {which:15}{mm(swept.largest):>10} mm"
        f"   at {swept.at:.4g} Hz; mean over 1/12 of it {mm(swept.running)} mm"
        f"   ({swept.begin:.4g} to {swept.end:.4g} Hz in {swept.duration:.3g} s)"
        for swept, way in zip(sweeps, ("up", "down"), strict=True)
    ]


def _range_lines(advice: Advice) -> list[str]:
    working, lines = advice.working, []
    if working.activation is not None:
        lines.append(
            f"  captured from rest from a level of    {mm(working.activation):>9} mm on, "
            "robust clearance"
        )
    if working.low is None or working.high is None:
        lines.append(
            "  more than 80 % of the bare amplitude is left with the robust clearance at the level "
            "designed for"
        )
        return lines
    low = f"{mm(working.low)} mm" + (" or less" if working.low_open else "")
    high = f"{mm(working.high)} mm" + (" or more" if working.high_open else "")
    lines.append(
        f"  at most 80 % of the bare amplitude   from {low} to {high} base amplitude, robust"
    )
    return lines
