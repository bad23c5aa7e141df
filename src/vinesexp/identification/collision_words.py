"""What the impacts show besides r and M, in words for checks.csv."""

from __future__ import annotations

from vinesexp.identification.collision_evidence import Evidence
from vinesexp.identification.jump_ratio import JumpRatio
from vinesexp.identification.sensor_fault import Fault
from vinesexp.records.checks import Check

#: What each effect is called where two of them explain the records as well.
NAMES = {
    "r_wall_difference": "walls of different r",
    "r_speed_slope": "r that depends on impact speed",
    "friction": "a ball that rubs on its floor (friction)",
    "clearance_offset": "a wrong clearance_mm",
    "contact_time": "a contact that lasts",
    "tilt": "a cavity that slopes (tilt)",
    "rolling": "a ball that rolls",
}


def effect_checks(evidence: Evidence) -> list[Check]:
    """One row for each effect that the collisions show, and one where others would do as well."""
    checks = []
    for name in evidence.best.effects:
        value, error = evidence.best.of(name)
        detail = _detail(name, value, error, evidence)
        checks.append(Check("", "collisions", "warning", detail))
    if evidence.rivals:
        others = "; ".join(
            " with ".join(NAMES[name] for name in rival) for rival in evidence.rivals[:3]
        )
        detail = (
            f"the impacts fit nearly as well with {others}; the error of r holds the difference. "
            "Tests at further clearances, or a drop test, would show which"
        )
        checks.append(Check("", "collisions", "warning", detail))
    return checks


def _detail(name: str, value: float, error: float, evidence: Evidence) -> str:
    r, apparent = evidence.r, float(evidence.plain.values[0])
    both = (
        f"r = {r:.4g} +- {evidence.r_error:.2g} allows for it, without it r would be {apparent:.4g}"
    )
    if name == "r_wall_difference":
        high, low = r + 0.5 * value, r - 0.5 * value
        return (
            f"the two walls differ: r = {high:.4g} at the wall where x - y = +b and {low:.4g} at "
            f"the other (difference {value:.3g} +- {error:.2g}); r = {r:.4g} is their mean, which "
            "is what b_c takes"
        )
    if name == "r_speed_slope":
        return (
            f"r depends on impact speed: it changes by {value:.3g} +- {error:.2g} for every m/s; "
            f"r = {r:.4g} holds at the usual speed of these tests, and b_c with it; at other "
            "base amplitudes r is another"
        )
    if name == "friction":
        return (
            f"the ball rubs on its floor: friction slows it by mu g = {value:.3g} +- {error:.2g} "
            f"m/s^2 between the walls; {both}. b_c is predicted with r_effective, in which the "
            "rubbing is"
        )
    if name == "clearance_offset":
        return (
            f"the flights are those of clearances {1e3 * value:+.3g} +- {1e3 * error:.2g} mm off "
            f"clearance_mm in records.csv; {both}. Measure the clearance again; measured optimal "
            "clearances move by as much"
        )
    if name == "rolling":
        return (
            f"the ball rolls: its floor takes it along by {value:.3g} +- {error:.2g} of the "
            f"floor's own motion (2/7 of a solid ball that never slips); {both}. b_c is predicted "
            "for a ball that does so"
        )
    if name == "contact_time":
        return (
            f"a contact lasts {1e3 * value:.3g} +- {1e3 * error:.2g} ms in which the ball gets no "
            f"further; {both}. b_c is predicted with r_effective and nes_mass_effective, in which "
            "this is"
        )
    return (
        f"the cavity slopes: the ball is pulled along it by {value:.3g} +- {error:.2g} m/s^2 "
        f"(tilt of {abs(value) / 9.80665 * 57.2958:.2g} degrees); {both}"
    )


def ratio_check(ratio: JumpRatio | None, fault: Fault | None) -> list[Check]:
    """Jumps of the two sensors where they disagree."""
    if ratio is None or fault is None or fault.cause not in ("pulse area", "unknown"):
        return []
    reported = (
        f"the jumps of velocity that the accelerometer shows are {ratio.ratio:.3f} +- "
        f"{ratio.error:.2g} times those of the displacement, while both show the same oscillation: "
    )
    if fault.cause == "pulse area":
        reported += (
            "M by added masses agrees with the displacement, so the area of the accelerometer's "
            "pulse is off (a contact that rings, or a mount); its jumps were divided by this factor"
        )
    else:
        reported += (
            "a local mode or a part that answers each impact, in one sensor or both. M by impacts "
            "has an error as large as that; look at the first 20 ms after an impact"
        )
    return [Check("", "jumps", "warning", reported)]


def sensor_check(fault: Fault | None) -> list[Check]:
    """A sensitivity that is wrong."""
    if fault is None or fault.cause not in ("laser gain", "accelerometer gain", "unknown gain"):
        return []
    off = 100.0 * abs(fault.ratio - 1.0)
    if fault.cause == "laser gain":
        detail = (
            f"the displacement is {off:.2g} % too {'large' if fault.ratio < 1.0 else 'small'}: "
            "M by added masses agrees with the accelerometer. r and M by impacts are computed "
            "with the displacement corrected; correct its sensitivity: amplitudes are off too"
        )
    elif fault.cause == "accelerometer gain":
        detail = (
            f"the accelerometer's gain is off by {off:.2g} %: M by added masses agrees with the "
            "displacement; its jumps were corrected"
        )
    else:
        detail = (
            f"accelerometer and displacement differ by {off:.2g} % in gain and nothing shows which "
            "sensitivity is wrong; the errors of r and M hold both"
        )
    return [Check("", "gain", "warning", detail)]
