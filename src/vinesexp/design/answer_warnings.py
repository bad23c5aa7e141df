"""What a reader of the answer would otherwise be misled by, a line each."""

from __future__ import annotations

from vinesexp.design.advice import Advice
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
    elif abs(advice.published / advice.exact - 1.0) > 0.1:
        said.append(
            f"the published b_c knows no frequency and stands at {1e3 * advice.published:.4g} mm "
            f"beside {1e3 * advice.exact:.4g} mm exact: do not build it off resonance"
        )
    if advice.orbit is not None and advice.orbit[1] > 1.3 * advice.orbit[0]:
        said.append(
            f"just below the exact b_c the orbit has {1e3 * advice.orbit[0]:.3g} mm but is not "
            f"reached from rest, where the mean is {1e3 * advice.orbit[1]:.3g} mm"
        )
    if not best.centre_touched:
        said.append(
            "a ball at rest in the middle of the robust cavity is never touched (the bare "
            f"amplitude of {1e3 * advice.bare:.3g} mm does not reach its walls): start it at a wall"
        )
    for name, one in (("least-mean", advice.least_mean), ("least-largest", advice.least_max)):
        if not one.centre_touched and one.b != best.b:
            said.append(
                f"with the {name} clearance a ball at rest mid-cavity is never touched either"
                if not best.centre_touched
                else f"with the {name} clearance a ball at rest mid-cavity is never touched"
            )
    if advice.least_mean.rest_mean > 0.95 * advice.bare_mean:
        said.append("no clearance takes more than 5 % off the bare amplitude: the ball hardly acts")
    if advice.watched < 1.0:
        said.append(
            "damping this light takes more cycles to settle than can be run: runs were cut to "
            f"{100 * advice.watched:.2g} % of the time they would need, and amplitudes still "
            "contain a part of the start"
        )
    if not advice.task.plain:
        said.append("friction and damping law enter the simulation; b_c and b_t know neither")
    gaps = gaps_of(advice.task, best.b)
    if gaps:
        words = ", ".join(f"{low:.3g} to {high:.3g} mm" for low, high in gaps)
        said.append(f"no ball is captured at amplitudes of {words}: bring the clearances closer")
    return said


def gaps_of(task: Task, b: float) -> list[list[float]]:
    """Amplitudes between the activation bands of several balls (mm), by (49)."""
    if len(task.masses) < 2:
        return []
    return [[1e3 * gap.low, 1e3 * gap.high] for gap in gaps(task.rig(b).nes)]
