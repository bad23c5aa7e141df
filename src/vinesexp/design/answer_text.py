"""The answer of `design` as a table a person reads."""

from __future__ import annotations

import math
from textwrap import wrap

import numpy as np

from vinesexp.design.answer import Answer
from vinesexp.design.answer_warnings import remarks_of
from vinesexp.design.build_text import beside_lines, build_lines, change_lines
from vinesexp.design.falls_text import falls_lines
from vinesexp.design.given_task import bands_given
from vinesexp.design.headline import headline_of
from vinesexp.design.inputs import BEYOND, EXCITATION, RIG, Given
from vinesexp.design.numbers_text import mm
from vinesexp.design.predictions import (
    Theory,
    single_values,
    start_amplitude,
)
from vinesexp.design.recorded import UnderRecord
from vinesexp.rig import Oscillator
from vinesexp.theory.intervals import ClearancePrediction
from vinesexp.units import COVERAGE_95

#: How the values beyond the model are called in the table.
SYMBOLS = {
    "frequency": "f",
    "friction": "mu g",
    "quadratic": "quadratic damping",
    "coulomb": "dry friction",
}


def text_of(given: Given, answer: Answer) -> str:
    """Rig, what to build and what it gives, theory, sensitivities, warnings."""
    theory, advice = answer.theory, answer.advice
    lines = [*wrap(headline_of(answer), 96), "", "Rig", *_rig_lines(given, theory)]
    if advice is not None:
        lines += ["", "Clearances (one-sided b), by exact event simulation"]
        lines += [*build_lines(advice), "", "The robust clearance with one value off"]
        lines += [*change_lines(advice), "", "Beside it"]
        lines += beside_lines(advice)
    if answer.driven is not None:
        lines += [
            "",
            "Under the recorded base, by exact event simulation",
            *_driven_lines(answer.driven),
        ]
    lines += ["", "Clearances of theory (one-sided b)"]
    lines.append(f"  {'':18}{'published':>12}{'exact':>12}   95 % interval of the exact value")
    lines += _clearance_lines(given, theory)
    if answer.falls is not None:
        lines += ["", "The release by simulation: fastest clearance to each level"]
        lines += falls_lines(answer.falls, theory.releases)
    elif theory.releases:
        lines += [
            "",
            "Fastest clearance of the release, b*(level), if captured at once",
        ]
        lines += _release_lines(theory)
    lines += ["", "Sensitivities of the exact values", *_sensitivity_lines(given, theory)]
    remarks = remarks_of(given, answer)
    if theory.no_orbit:
        remarks = [theory.no_orbit, *remarks]
    if remarks:
        lines += ["", "Note", *(f"  ! {remark}" for remark in remarks)]
    return "\n".join(lines)


def _driven_lines(found: UnderRecord) -> list[str]:
    """Deflection and motion over clearance, median over the starts."""
    heads = ("b (mm)", "rms x - x_e", "peak x - x_e", "90 % below", "rms x", "peak x", "impacts")
    lines = ["  " + "".join(f"{head:>14}" for head in heads)]
    for number, one in enumerate([found.bare, *found.found]):
        cells = ["none" if number == 0 else mm(one.b)]
        cells += [mm(float(np.median(v))) for v in (one.rms, one.peak)]
        cells.append(mm(float(np.percentile(one.peak, 90.0))))
        cells += [mm(float(np.median(v))) for v in (one.rms_x, one.peak_x)]
        cells.append(f"{float(np.median(one.impacts)):.0f}")
        best = (number - 1 == found.least_rms, number - 1 == found.least_peak)
        marks = [
            word for word, is_best in zip(("least rms", "least peak"), best, strict=True) if is_best
        ]
        lines.append("  " + "".join(f"{c:>14}" for c in cells) + "   " + ", ".join(marks))
    return [
        *lines,
        "  mm; medians over balls at rest anywhere in their cavities and at the walls",
    ]


def _rig_lines(given: Given, theory: Theory) -> list[str]:
    lines = []
    for option in (*RIG, *EXCITATION, *BEYOND):
        if option.symbol in given:
            texts = []
            apart = " to " if option in EXCITATION else "; "
            unit, size = ("mm", 1e3) if option.unit == "m" else (option.unit, 1.0)
            for q in given[option.symbol]:
                error = f" +- {size * COVERAGE_95 * q.std_error:.3g}" if q.std_error else ""
                texts.append(f"{size * q.value:.6g}{error} {unit}".rstrip())
            lines.append(f"  {SYMBOLS.get(option.symbol, option.symbol):3} = {apart.join(texts)}")
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


def _clearance_lines(given: Given, theory: Theory) -> list[str]:
    lines = []

    def line(label: str, p: ClearancePrediction) -> str:
        interval = f"{mm(p.low)} to {mm(p.high)} mm" if p.std_error else "no error bars given"
        return f"  {label:18}{mm(p.published):>9} mm{mm(p.exact):>9} mm   {interval}"

    if "G" in given:
        label = f"b_c, G = {1e3 * given.one('G').value:.4g} mm"
        if theory.b_c is not None:
            lines.append(line(label, theory.b_c))
        elif theory.b_c_published is not None:
            lines.append(f"  {label:18}{mm(theory.b_c_published):>9} mm{'none':>12}")
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
    for k, (b, band) in enumerate(bands_given(given), start=1):
        lines.append(
            f"  ball {k}, b = {mm(b)} mm as given: two symmetric impacts per cycle from A_1 b = "
            f"{mm(band.low)} to A_2 b = {mm(band.high)} mm amplitude"
        )
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
