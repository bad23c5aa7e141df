"""What a reader of the answer would otherwise be misled by, a line each."""

from __future__ import annotations

import math

from vinesexp.design.advice import Advice
from vinesexp.design.answer import Answer
from vinesexp.design.bare import mean_of_cycle
from vinesexp.design.inputs import BEYOND, Given
from vinesexp.design.numbers_text import mm
from vinesexp.design.task import Task
from vinesexp.theory.multiple import gaps


def warnings_of(advice: Advice) -> list[str]:
    """What a reader of b_c would otherwise be misled by."""
    said = []
    best = advice.robust
    if advice.exact is None:
        said.append(
            "no orbit with two symmetric impacts per cycle is stable at any clearance: the "
            "published b_c does not apply"
        )
    else:
        said += apart(advice.published, advice.exact)
    alike = len(set(advice.task.ratios)) == 1  # the orbit is that of all balls as one
    if alike and advice.orbit is not None and advice.orbit[1] > 1.3 * advice.orbit[0]:
        said.append(
            f"just below the exact b_c the orbit has {1e3 * advice.orbit[0]:.3g} mm but is not "
            f"reached from rest, where the mean is {1e3 * advice.orbit[1]:.3g} mm"
        )
    if not best.centre_touched:
        said.append(
            "a ball at rest in the middle of the robust cavity is never touched (the bare "
            f"amplitude of {1e3 * advice.bare:.3g} mm does not reach its walls): start it at a wall"
        )
    others = (
        ("least-mean", advice.least_mean),
        ("least-largest", advice.least_max),
        ("given", advice.asked),
    )
    for name, one in others:
        if one is not None and not one.centre_touched and one.b != best.b:
            said.append(
                f"with the {name} clearance a ball at rest mid-cavity is never touched either"
                if not best.centre_touched
                else f"with the {name} clearance a ball at rest mid-cavity is never touched"
            )
    said += ends_of_search(advice)
    if advice.watched < 1.0:
        said.append(
            "damping this light takes more cycles to settle than can be run: runs were cut to "
            f"{100 * advice.watched:.2g} % of the time they would need, and amplitudes still "
            "contain a part of the start"
        )
    if not advice.task.plain:
        said.append(
            "friction and damping law enter the simulation; b_c and b_t know neither (friction "
            "moves b_c by 0.1 to 0.7 %, docs/benchmarks/robustness.md)"
        )
    for which, one in (("", best), ("with the clearances given ", advice.asked)):
        gaps = [] if one is None else gaps_of(advice.task, one.b)
        if gaps:
            words = ", ".join(f"{low:.3g} to {high:.3g} mm" for low, high in gaps)
            said.append(
                f"{which}no ball is captured at amplitudes of {words}: bring the clearances closer"
            )
    return said + beside_resonance(advice.task)


def apart(published: float, exact: float) -> list[str]:
    """Where the two b_c (m) differ by more than a tenth."""
    if abs(published / exact - 1.0) <= 0.1:
        return []
    return [
        f"the published b_c knows no frequency and stands at {1e3 * published:.4g} mm "
        f"beside {1e3 * exact:.4g} mm exact: do not build it off resonance"
    ]


def remarks_of(given: Given, answer: Answer) -> list[str]:
    """All that a reader of the answer should know, whatever was asked."""
    if answer.advice is not None:
        said = warnings_of(answer.advice)
    elif answer.theory.b_c is not None:
        said = apart(answer.theory.b_c.published, answer.theory.b_c.exact)
    else:
        said = []
    law = any(given.size(option.symbol) > 0.0 for option in BEYOND)
    if law and answer.falls is not None:
        said.append(
            "friction and damping law enter the simulated release; b*(level), bare times and b_t "
            "of theory know neither"
        )
    if law and answer.advice is None and answer.falls is None:
        said.append("b_c and b_t know neither friction nor damping law: nothing was simulated")
    if "m" in given and len(given["m"]) > 1:
        r = {q.value for q in given["r"]}
        word = f", with r = {given.one('r').value:g}, that of the first" if len(r) > 1 else ""
        said.append(
            "b_c, b_t, b*(level) and the sensitivities take all balls as one of "
            f"{1e3 * given.one('m').value:.4g} g in one cavity{word}"
        )
    return said


#: Amplitudes are means of hypot(x, x'/w0); from this share beside f0 on the difference is named.
BESIDE = 0.1


def beside_resonance(task: Task) -> list[str]:
    """What the amplitude means far from resonance, where x'/w0 is not as large as x."""
    f0, G = task.oscillator.f0, task.levels[1]
    off = max(task.frequencies, key=lambda f: abs(math.log(f / f0)))
    if abs(off / f0 - 1.0) < BESIDE:
        return []
    ratio = mean_of_cycle(off / f0)
    return [
        f"amplitudes are means of hypot(x, x'/w0): of a motion at {off:.4g} Hz {ratio:.3g} times "
        f"its amplitude in x (bare oscillator: {mm(task.bare(G, off) / ratio)} mm in x). Compare "
        "them with each other, not with a displacement sensor"
    ]


def ends_of_search(advice: Advice) -> list[str]:
    """Clearances that lie where the search ended: no minimum, a bound."""
    first, last = float(advice.found.grid[0]), float(advice.found.grid[-1])
    said = []
    for name, one in (
        ("least-mean", advice.least_mean),
        ("least-largest", advice.least_max),
        ("robust", advice.robust),
    ):
        if one.b > 0.97 * last or one.b < 1.03 * first:
            side = "wider" if one.b > 0.97 * last else "narrower"
            said.append(
                f"the {name} clearance lies at the end of those tried ({1e3 * first:.3g} to "
                f"{1e3 * last:.3g} mm): a {side} one may be better still"
            )
    return said


def gaps_of(task: Task, b: float) -> list[list[float]]:
    """Amplitudes between the activation bands of several balls (mm), by (49)."""
    if len(task.masses) < 2:
        return []
    return [[1e3 * gap.low, 1e3 * gap.high] for gap in gaps(task.rig(b).nes)]
