"""The answer of `design` as a table a person reads."""

from __future__ import annotations

import math

from vinesexp.design.advice import Advice, Judged
from vinesexp.design.answer import Answer
from vinesexp.design.answer_warnings import warnings_of
from vinesexp.design.falls_text import falls_lines
from vinesexp.design.inputs import BEYOND, RIG, Given
from vinesexp.design.predictions import Theory, single_values, start_amplitude
from vinesexp.rig import Oscillator
from vinesexp.theory.intervals import ClearancePrediction

#: How the values beyond the model are called in the table.
SYMBOLS = {"friction": "mu g", "quadratic": "quadratic damping", "coulomb": "dry friction"}


def text_of(given: Given, answer: Answer) -> str:
    """Rig, what to build and what it gives, theory, sensitivities, warnings."""
    theory, advice = answer.theory, answer.advice
    lines = ["Rig", *_rig_lines(given, theory)]
    if advice is not None:
        lines += ["", "What to build (one-sided b), by exact event simulation"]
        lines += [*_build_lines(advice), "", "The robust clearance with one value off"]
        lines += [*_change_lines(advice), "", "Beside it"]
        lines += _beside_lines(advice)
    lines += ["", "Clearances of theory (one-sided b)"]
    lines.append(f"  {'':18}{'published':>12}{'exact':>12}   95 % interval of the exact value")
    lines += _clearance_lines(given, theory)
    if theory.releases:
        lines += ["", "Fastest clearance of the release, b*(level), by slow decay and its passage"]
        lines += _release_lines(theory)
    if answer.falls is not None:
        lines += ["", "The release by simulation, balls at rest anywhere in their cavities"]
        lines += falls_lines(answer.falls)
    lines += ["", "Sensitivities of the exact values", *_sensitivity_lines(given, theory)]
    remarks = warnings_of(advice) if advice is not None else []
    if theory.no_orbit:
        remarks = [theory.no_orbit, *remarks]
    if remarks:
        lines += ["", "Note", *(f"  ! {remark}" for remark in remarks)]
    return "\n".join(lines)


def _rig_lines(given: Given, theory: Theory) -> list[str]:
    lines = []
    for option in (*RIG, *BEYOND):
        if option.symbol in given:
            texts = []
            for q in given[option.symbol]:
                error = f" +- {q.std_error:.3g}" if q.std_error else ""
                texts.append(f"{q.value:.6g}{error} {option.unit}".rstrip())
            lines.append(f"  {SYMBOLS.get(option.symbol, option.symbol):3} = {'; '.join(texts)}")
    if theory.F_c is not None:
        rig = {name: given.one(name).value for name in ("M", "c1", "k1", "m")}
        o = Oscillator(M=rig["M"], c1=rig["c1"], k1=rig["k1"])
        eps = rig["m"] / o.M
        lines.append(
            f"  f0 = {o.f0:.4f} Hz, zeta = {o.zeta:.3g}, eps = {eps:.4g}, "
            f"lambda = {2.0 * o.zeta / eps:.4g}"
        )
    F_c = "" if theory.F_c is None else f", F_c = {theory.F_c:.5f}"
    lines.append(f"  A_1 = {theory.A_1:.5f} (T1), A_2 = {theory.A_2:.5f} (T2; paper: 0.6){F_c}")
    return lines


def _over(value: float, reference: float | None) -> str:
    return "-" if reference is None else f"{value / reference:.3f}"


def _build_lines(advice: Advice) -> list[str]:
    rows = (
        ("least mean", advice.least_mean),
        ("least largest", advice.least_max),
        ("robust", advice.robust),
    )
    heads = ("b (mm)", "b/b_c pub.", "b/b_c exact", "mean", "largest", "less", "captured")
    lines = [f"  {'from rest, ball at a wall':26}" + "".join(f"{h:>12}" for h in heads)]
    for name, one in rows:
        cells = (
            f"{1e3 * one.b:.3f}",
            _over(one.b, advice.published),
            _over(one.b, advice.exact),
            f"{1e3 * one.rest_mean:.3f}",
            f"{1e3 * one.rest_max:.3f}",
            f"{100 * (1 - one.rest_mean / advice.bare_mean):.0f} %",
            f"{100 * one.captured_rest:.0f} %",
        )
        lines.append(f"  {name:26}" + "".join(f"{c:>12}" for c in cells))
    heads = ("b (mm)", "mean", "90 % below", "largest", "less", "captured", "mid-cavity")
    lines.append(f"  {'from random starts':26}" + "".join(f"{h:>12}" for h in heads))
    for name, one in rows:
        lines.append(f"  {name:26}" + "".join(f"{c:>12}" for c in _random_cells(one)))
    if len(advice.task.ratios) > 1:
        for name, one in rows:
            each = ", ".join(f"{1e3 * one.b * ratio:.3f}" for ratio in advice.task.ratios)
            lines.append(f"  {name}: clearances of the balls {each} mm")
    lines += [
        "  amplitudes in mm, once settled; less: mean against the bare oscillator's",
        f"  {1e3 * advice.bare_mean:.3f} mm, of random starts over the same draws; captured: two",
        "  impacts a cycle or more, not modulated;",
        "  mid-cavity: mean with the ball at rest in the middle; least mean and least largest",
        "  are averaged over the phase at which the shaker starts; robust: least 90th percentile",
    ]
    if advice.task.frequencies[0] < advice.task.frequencies[1]:
        lines.append(
            "  captured: of the whole band, also where the motion is too small for the ball"
        )
    return lines


def _random_cells(one: Judged) -> tuple[str, ...]:
    return (
        f"{1e3 * one.b:.3f}",
        f"{1e3 * one.random_mean:.3f}",
        f"{1e3 * one.random_p90:.3f}",
        f"{1e3 * one.random_max:.3f}",
        f"{100 * (1 - one.random_mean / one.random_bare):.0f} %",
        f"{100 * one.captured:.0f} %",
        f"{1e3 * one.centre_mean:.3f}",
    )


def _change_lines(advice: Advice) -> list[str]:
    changes = sorted({one.change for one in advice.changed})
    lines = [
        f"  {'mean from rest; 90 % below':26}" + "".join(f"{100 * c:>+15.0f} %" for c in changes)
    ]
    for name in ("b", "G", "f", "r"):
        by_change = {one.change: one for one in advice.changed if one.name == name}
        cells = []
        for change in changes:
            one = by_change.get(change)
            text = f"{1e3 * one.rest_mean:.3f}; {1e3 * one.random_p90:.3f}" if one else "-"
            cells.append(f"{text:>17}")
        lines.append(f"  {name:26}" + "".join(cells))
    return lines


def _beside_lines(advice: Advice) -> list[str]:
    lines = [f"  bare oscillator, largest              {1e3 * advice.bare:9.3f} mm"]
    for name, one in (("Den Hartog", advice.den_hartog), ("least worst", advice.optimal)):
        lines.append(
            f"  tuned mass damper, {name:19}{1e3 * one.amplitude:9.3f} mm"
            f"   5 % detuned {1e3 * one.detuned:.3f} mm"
            f"   (f/f0 {one.tuning:.4f}, zeta {one.zeta:.4f}; mass of the balls)"
        )
    for swept, way in zip(advice.sweeps, ("up", "down"), strict=True):
        lines.append(
            f"  slow sweep {way:4} with the robust one  {1e3 * swept.largest:10.3f} mm"
            f"   at {swept.at:.4g} Hz; mean over 1/12 of it {1e3 * swept.running:.3f} mm"
            f"   ({swept.begin:.4g} to {swept.end:.4g} Hz in {swept.duration:.3g} s)"
        )
    working = advice.working
    if working is not None and working.activation is not None:
        lines.append(
            f"  captured from rest from a level of   {1e3 * working.activation:9.3f} mm on, "
            "robust clearance"
        )
    if working is not None and working.low is not None and working.high is not None:
        lines.append(
            f"  at most 80 % of the bare amplitude   {1e3 * working.low:9.3f} mm"
            f" to {1e3 * working.high:.3f} mm base amplitude, robust clearance"
        )
    return lines


def _clearance_lines(given: Given, theory: Theory) -> list[str]:
    lines = []

    def line(label: str, p: ClearancePrediction) -> str:
        interval = (
            f"{1e3 * p.low:.3f} to {1e3 * p.high:.3f} mm" if p.std_error else "no error bars given"
        )
        return f"  {label:18}{1e3 * p.published:9.3f} mm{1e3 * p.exact:9.3f} mm   {interval}"

    if "G" in given:
        label = f"b_c, G = {1e3 * given.one('G').value:.4g} mm"
        if theory.b_c is not None:
            lines.append(line(label, theory.b_c))
        elif theory.b_c_published is not None:
            lines.append(f"  {label:18}{1e3 * theory.b_c_published:9.3f} mm{'none':>12}")
    if theory.b_t is not None:
        lines.append(line(f"b_t, x_m = {1e3 * start_amplitude(given):.4g} mm", theory.b_t))
    if "G" in given:
        lines.append("  b_c: formula (36); exact: end of the stable orbit (Floquet multipliers)")
    else:
        lines.append("  b_c: give --base-amplitude")
    if theory.b_t is not None:
        lines.append("  b_t: x_m/0.6, formula (37); exact: x_m/A_2(r), T2 in closed form")
    else:
        lines.append("  b_t: give --release")
    return lines


def _release_lines(theory: Theory) -> list[str]:
    lines = [
        f"  {'level (mm)':>12}{'b* (mm)':>12}{'95 % interval':>20}{'time (s)':>12}"
        f"{'bare (s)':>12}{'met at most':>14}"
    ]
    for one in theory.releases:
        interval = "-"
        if one.low is not None and one.high is not None:
            interval = f"{1e3 * one.low:.2f} to {1e3 * one.high:.2f}"
        bare = f"{one.bare_time:.2f}" if math.isfinite(one.bare_time) else "never"
        lines.append(
            f"  {1e3 * one.level:12.3f}{1e3 * one.b:12.3f}{interval:>20}{one.time:12.2f}"
            f"{bare:>12}{f'{100 * one.capture:.0f} %':>14}"
        )
    return [
        *lines,
        "  met at most: share of balls at rest anywhere in the cavity that a wall reaches",
    ]


def _sensitivity_lines(given: Given, theory: Theory) -> list[str]:
    predictions = {
        name: p for name, p in (("b_c", theory.b_c), ("b_t", theory.b_t)) if p is not None
    }
    heads = "".join(f"{f'd {n}/d value':>20}{'for +1 %':>12}" for n in predictions)
    lines = [f"  {'value':8}{heads}"]
    values = single_values(given)
    for option in RIG:
        if option.symbol not in values:
            continue
        cells = ""
        for p in predictions.values():
            slope = 1e3 * p.gradient[option.symbol] + 0.0  # no minus zero
            unit = f"mm/({option.unit})" if option.unit else "mm"
            unit = unit.replace("(kg)", "kg")
            change = 0.01 * slope * values[option.symbol].value
            change = 0.0 if math.isclose(change, 0.0, abs_tol=1e-12) else change
            cells += f"{f'{slope:.5g} {unit}':>20}{f'{change:+.3f} mm':>12}"
        lines.append(f"  {option.symbol:8}{cells}")
    return lines
