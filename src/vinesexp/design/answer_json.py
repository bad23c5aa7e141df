"""The answer of `design` for programs, and the warnings that go with it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from vinesexp.design.absorber import Absorber
from vinesexp.design.advice import Advice, Judged
from vinesexp.design.released import Falls
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


def as_json(advice: Advice) -> Mapping[str, object]:
    """Everything for programs: contract keys first; lengths in mm."""
    robust, task = advice.robust, advice.task

    def mm(value: float | None) -> float | None:
        return None if value is None else 1e3 * value

    def judged(one: Judged) -> dict[str, object]:
        lengths = (
            "b", "rest_mean", "rest_max", "random_mean", "random_p90", "random_max", "centre_mean",
        )  # fmt: skip
        others = ("captured", "captured_rest", "centre_touched")
        found: dict[str, object] = {f"{n}_mm": mm(getattr(one, n)) for n in lengths}
        found |= {n: getattr(one, n) for n in others}
        found["reduction"] = 1.0 - one.rest_mean / advice.bare_mean
        found["over_b_c_published"] = one.b / advice.published
        found["over_b_c_exact"] = None if advice.exact is None else one.b / advice.exact
        return found

    def absorber(one: Absorber) -> dict[str, float]:
        return {
            "tuning": one.tuning,
            "zeta": one.zeta,
            "amplitude_mm": 1e3 * one.amplitude,
            "detuned_mm": 1e3 * one.detuned,
        }

    working = advice.working
    return {
        "least_mean_mm": mm(advice.least_mean.b),
        "least_max_mm": mm(advice.least_max.b),
        "robust_mm": mm(robust.b),
        "captured_share": robust.captured,
        "amplitude_mean_mm": mm(robust.random_mean),
        "amplitude_max_mm": mm(robust.random_max),
        "bare_amplitude_mm": mm(advice.bare),
        "tmd_amplitude_mm": mm(advice.den_hartog.amplitude),
        "bare_mean_mm": mm(advice.bare_mean),
        "clearance_ratios": list(task.ratios),
        "least_mean": judged(advice.least_mean),
        "least_max": judged(advice.least_max),
        "robust": judged(robust),
        "changed": [
            {
                "value": one.name,
                "change": one.change,
                "rest_mean_mm": mm(one.rest_mean),
                "random_p90_mm": mm(one.random_p90),
                "captured": one.captured,
            }
            for one in advice.changed
        ],
        "levels": None
        if working is None
        else {
            "activation_mm": mm(working.activation),
            "works_from_mm": mm(working.low),
            "works_to_mm": mm(working.high),
        },
        "slow_sweep": [
            {
                "from_hz": one.begin,
                "to_hz": one.end,
                "duration_s": one.duration,
                "largest_mm": mm(one.largest),
                "largest_at_hz": one.at,
                "largest_running_mean_mm": mm(one.running),
            }
            for one in advice.sweeps
        ],
        "tmd": {"den_hartog": absorber(advice.den_hartog), "optimal": absorber(advice.optimal)},
        "gaps_mm": gaps_of(task, robust.b),
        "model": "exact event simulation"
        + ("" if task.plain else " with friction or a damping law"),
        "settled_share": advice.watched,
        "seed": advice.seed,
        "warnings": warnings_of(advice),
    }


def falls_as_json(falls: Falls) -> dict[str, object]:
    """Releases by simulation: every clearance tried, and the fastest for each level."""

    def finite(value: float) -> float | None:
        return value if math.isfinite(value) else None

    rows = []
    for one in falls.found:
        times = np.median(one.times, axis=0)
        rows.append(
            {
                "b_mm": 1e3 * one.b,
                "captured_share": one.share,
                "median_time_s": [finite(float(t)) for t in times],
                "worst_time_s": [finite(float(t)) for t in one.times.max(axis=0)],
                "energy_dissipated_by_nes": float(np.median(one.dissipated)),
                "pumping_time_s": float(np.median(one.pumping)),
                "energy_left_after_pumping": float(np.median(one.left)),
            }
        )
    return {
        "levels_mm": [1e3 * level for level in falls.levels],
        "fastest_mm": [1e3 * falls.found[i].b for i in falls.fastest],
        "clearances": rows,
    }
