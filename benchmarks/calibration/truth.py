"""What a scene truly is: values as a linear model of the rig should have them, and where b_c lies.

Each truth is a range (low, high), mostly of no width: a rig that wears or warms has no single r or
f0, and one of which the damping depends on amplitude no single zeta. An interval is compared with
the nearest value of the range.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from benchmarks.calibration.folder import Moved
from benchmarks.calibration.scene import Scene
from benchmarks.robustness.end_of_orbit import end_by_rates
from benchmarks.robustness.rig import WORKING_SPEED, Body, Drive

from vinesexp.errors import AnalysisError
from vinesexp.theory.optimal_clearance import b_c_exact, b_t_exact

Range = tuple[float, float]

KEPT = Path(__file__).resolve().parents[2] / "results" / "calibration" / "ends"
#: Relative error of an end that was found by simulation.
END_KNOWN = 1e-3
_AROUND = 0.1  # of the working amplitude: where a law over amplitude may be read
_MOTION = ("r_minus", "r_slope", "friction", "tilt", "contact", "quadratic", "coulomb", "cubic",
           "roll", "pull")  # fmt: skip


def truth(scene: Scene, moved: Mapping[str, Moved]) -> dict[str, Range]:
    """f0, zeta, M, c1, k1, r, and b_c and b_t where they exist (SI)."""
    bodies = [test.body for test in scene.tests]
    found = {"M": (scene.body.M, scene.body.M)}
    amplitudes = _working(scene, moved)
    if scene.body.quadratic or scene.body.coulomb or scene.body.cubic:
        amplitudes = [share * A for A in amplitudes for share in (1 - _AROUND, 1 + _AROUND)]
    spring = [k1_at(scene.body, A) for A in amplitudes]
    if _drifts(bodies, "k1"):
        spring = [share * k for k in spring for share in _shares(bodies, scene.body)]
    damping = [c1_at(scene.body, A) for A in amplitudes]
    found["k1"] = min(spring), max(spring)
    found["c1"] = min(damping), max(damping)
    f0 = [math.sqrt(k / scene.body.M) / (2.0 * math.pi) for k in spring]
    found["f0"] = min(f0), max(f0)
    zeta = [c / (2.0 * math.sqrt(k * scene.body.M)) for c in damping for k in spring]
    found["zeta"] = min(zeta), max(zeta)
    balls = [t for t in scene.tests if t.b and not t.stuck]
    speed = _median_speed(scene, moved)
    r = [restitution(t.body, speed) for t in balls]
    if r:
        found["r"] = min(r), max(r)
    for number, G in enumerate(levels(scene)):
        if number and _moves_otherwise(scene):
            break  # what holds for one level holds for the other, and an end costs half a minute
        end = _end(scene, G, r)
        if end is not None:
            found[f"b_c_{number}"] = end
    plain = not any(getattr(scene.body, name) for name in _MOTION)
    releases = [t.release for t in scene.tests if t.kind == "transient"]
    if releases and plain and r:
        level = float(np.mean(releases))  # that of the level, as b_t is one of the level
        b_t = [float(b_t_exact(x_m=level, r=one)) for one in (min(r), max(r))]
        found["b_t"] = min(b_t), max(b_t)
    return found


def levels(scene: Scene) -> list[float]:
    """True base amplitudes of the periodic tests, m, largest first."""
    return sorted({t.drive.amplitude for t in scene.periodic()}, reverse=True)


def _moves_otherwise(scene: Scene) -> bool:
    """Whether the rig or its base is not that of the theory."""
    second = any(t.drive.second_share for t in scene.periodic())
    return second or any(getattr(scene.body, name) for name in _MOTION)


def restitution(body: Body, speed: float) -> float:
    """Mean of both walls at a relative speed, m/s."""
    other = body.r if body.r_minus is None else body.r_minus
    return 0.5 * (body.r + other) + body.r_slope * (speed - WORKING_SPEED)


def c1_at(body: Body, amplitude: float) -> float:
    """Damping of one harmonic of this amplitude."""
    w = math.sqrt(body.k1 / body.M)
    c1 = body.c1 + 8.0 / (3.0 * math.pi) * body.quadratic * w * amplitude
    return c1 + 4.0 * body.coulomb / (math.pi * w * amplitude)


def k1_at(body: Body, amplitude: float) -> float:
    """Stiffness of one harmonic of this amplitude."""
    return body.k1 + 0.75 * body.cubic * amplitude**2


def _working(scene: Scene, moved: Mapping[str, Moved]) -> list[float]:
    """Least amplitude of the periodic tests of each level, and the middle of these."""
    least: dict[float, float] = {}
    for test in scene.periodic():
        G, A = test.drive.amplitude, moved[test.name].amplitude
        least[G] = min(A, least.get(G, math.inf))
    return [float(np.mean(list(least.values())))] if least else [0.01]


def _drifts(bodies: list[Body], name: str) -> bool:
    values = [getattr(body, name) for body in bodies]
    # Mountings move k1 by a few 1e-4; a drift by more, in one direction.
    return (max(values) - min(values)) / abs(values[0]) > 1.5e-3


def _shares(bodies: list[Body], rig: Body) -> Range:
    values = [body.k1 / rig.k1 for body in bodies]
    return min(values), max(values)


def _median_speed(scene: Scene, moved: Mapping[str, Moved]) -> float:
    own = [moved[t.name].speeds for t in scene.tests if t.b and t.kind != "drop"]
    speeds = np.concatenate(own) if own else np.empty(0)
    return float(np.median(speeds)) if speeds.size else WORKING_SPEED


def _end(scene: Scene, G: float, r: list[float]) -> Range | None:
    """Where two impacts per cycle end at a true base amplitude, m."""
    tests = [t for t in scene.periodic() if t.drive.amplitude == G]
    drive, body, found = tests[0].drive, scene.body, []
    balls = sorted({t.body.m for t in tests})  # of one that was replaced
    if _moves_otherwise(scene) and r:
        ends = [simulated_end(replace(body, m=m), drive, guess=scene.guess) for m in balls]
        known = [end for end in ends if end is not None]
        if len(known) < len(ends):
            return None
        return (1 - END_KNOWN) * min(known), (1 + END_KNOWN) * max(known)
    for one, m in ((one, m) for one in sorted({min(r), max(r)}) for m in balls) if r else ():
        try:
            found.append(
                float(b_c_exact(G=G, frequency=drive.frequency, M=body.M, c1=body.c1, k1=body.k1,
                                r=one, m=m))
            )  # fmt: skip
        except AnalysisError:
            return None
    if _drifts([t.body for t in scene.tests], "k1"):
        for share in _shares([t.body for t in scene.tests], body):
            changed = replace(body, k1=share * body.k1)
            found.append(
                float(b_c_exact(G=G, frequency=drive.frequency, M=body.M, c1=body.c1,
                                k1=changed.k1, r=scene.body.r, m=body.m))
            )  # fmt: skip
    return (min(found), max(found)) if found else None


def simulated_end(body: Body, drive: Drive, *, guess: float) -> float | None:
    """The end of the orbit, kept: it costs more than the analysis of a campaign."""
    name = hashlib.sha256(repr((body, drive, round(guess, 6))).encode()).hexdigest()[:16]
    path = KEPT / f"{name}.json"
    if path.is_file():
        kept: float | None = json.loads(path.read_text(encoding="utf-8"))
        return kept
    end = end_by_rates(body, drive, guess)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(end), encoding="utf-8")
    return end
