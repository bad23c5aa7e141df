"""ns of the processor an impact: the event loop, whole maps in lanes, effects beyond the plain rig.

    python -m benchmarks.impact_cost        # prints the cases as JSON; a minute

The rig of Table 2 at resonance. A run lasts some milliseconds, and the best of hundreds counts: on
a machine with other work few of them meet a quiet moment. Pages show the figures
(`benchmarks.simulation`, `benchmarks.map_cost`); `benchmarks.loop_side_by_side` compares trees.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from benchmarks.impact_problems import TABLE_2, G

from vinesexp import NES, Harmonic, Measured, Release, Rig, simulate
from vinesexp.excitation import WeakDamping
from vinesexp.solver.arrays import ball_table, closed_form, drive_table, parameters
from vinesexp.solver.events import REMAINDER
from vinesexp.solver.kernel import run
from vinesexp.solver.lanes import amplitudes
from vinesexp.solver.series import ORDER
from vinesexp.solver.state import BALL, EVENT, IMPACT, STATE, WORK, Given

CELLS = 14
BASE = Harmonic(amplitude=G, frequency=TABLE_2.f0)
#: Clearances of the event loop, mm; several balls share the mass of one.
LOOPS: tuple[tuple[float, ...], ...] = (
    (20,), (30,), (34,), (36,), (40,), (60,), (34, 34), (20, 30), (20, 25, 30, 28),
)  # fmt: skip
#: Clearance (mm) and restitution of 64 starts side by side; the last has 26 impacts a cycle.
STARTS = ((30, 0.6), (36, 0.6), (40, 0.6), (60, 0.6), (2, 0.22))
#: Clearance (mm), of the ball, of the spring, of the damping; the plain rig of a clearance first.
DEPARTURES: tuple[tuple[str, float, dict[str, float], float, WeakDamping | None], ...] = (
    ("plain", 30.0, {}, 0.0, None),
    ("r = 0.6 and 0.55", 30.0, {"r_minus": 0.55}, 0.0, None),
    ("r falling by 0.1 s/m", 30.0, {"r_slope": -0.1}, 0.0, None),
    ("friction 0.05 m/s^2", 30.0, {"friction": 0.05}, 0.0, None),
    ("friction 0.3 m/s^2", 30.0, {"friction": 0.3}, 0.0, None),
    ("tilt 0.05 m/s^2", 30.0, {"tilt": 0.05}, 0.0, None),
    ("Coulomb friction 0.05 N on the oscillator", 30.0, {}, 0.0, WeakDamping(coulomb=0.05)),
    ("quadratic damping 0.5 kg/m", 30.0, {}, 0.0, WeakDamping(quadratic=0.5)),
    ("k3 = 3e5 N/m^3", 30.0, {}, 3e5, None),
    ("plain, b = 10 mm", 10.0, {}, 0.0, None),
    ("friction 0.05 m/s^2, b = 10 mm", 10.0, {"friction": 0.05}, 0.0, None),
    ("plain, b = 60 mm", 60.0, {}, 0.0, None),
    ("friction 0.05 m/s^2, b = 60 mm", 60.0, {"friction": 0.05}, 0.0, None),
)


def compiled_loop(clearances: tuple[float, ...]) -> tuple[float, float]:
    """ns and evaluations of the motion per impact, 1000 s, compiled loop with its log only."""
    b = [1e-3 * one for one in clearances]
    rig = Rig(TABLE_2, nes=[NES(m=0.032 / len(b), b=one, r=0.6) for one in b])
    response, (kind, table) = closed_form(rig, BASE), drive_table(BASE)
    log, work = np.zeros(200000, EVENT), np.zeros((WORK, ORDER + 1))
    par = parameters(rig, WeakDamping())
    given = Given(response, work[0], par, kind, table, 1000.0, REMAINDER)
    best, used, hits = math.inf, 0, 1
    for _ in range(400):
        start = Release(y0=[0.99 * one * (-1) ** i for i, one in enumerate(b)])
        balls, state = ball_table(rig, start)[0], np.zeros(1, STATE)
        work[:] = 0.0
        begin = time.process_time_ns()
        used = run(given, True, state, balls, log, work, None)
        hits = int((log["kind"][: int(state["logged"][0])] == IMPACT).sum())
        best = min(best, (time.process_time_ns() - begin) / hits)
    return best, used / hits


def in_lanes(rigs: Callable[[], list[tuple[Rig, Harmonic, Release]]]) -> float:
    """ns an impact of plain rigs side by side for 200 s, amplitudes and rows included."""
    best = math.inf
    for _ in range(12):
        begin = time.process_time_ns()
        every = rigs()
        balls = np.zeros((len(every), 1), BALL)
        for place, (rig, _, start) in zip(balls, every, strict=True):
            place[:] = ball_table(rig, start)[0]
        runs = np.array([_given(*one) for one in every])
        hits = float(amplitudes(runs, balls).impacts.sum())
        best = min(best, (time.process_time_ns() - begin) / hits)
    return best


def _given(rig: Rig, base: Harmonic, start: Release) -> list[float]:
    """A run of 200 s as the lanes are given it."""
    o = rig.oscillator
    run = [o.M, o.c1, o.k1, base.amplitude, base.frequency, base.phase, start.x0, start.v0]
    return [*run, 0.0, 200.0]


def whole_map() -> float:
    """ns an impact over a map of 14 clearances by 14 levels."""
    return in_lanes(lambda: [
        (Rig(TABLE_2, nes=[NES(m=0.032, b=b, r=0.6)]), Harmonic(level, TABLE_2.f0),
         Release(y0=[0.99 * b]))
        for level in np.linspace(0.05e-3, 0.40e-3, CELLS)
        for b in np.linspace(5e-3, 60e-3, CELLS)
    ])  # fmt: skip


def many_starts(b: float, r: float) -> float:
    """ns an impact of 64 starts at one clearance (mm)."""
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=1e-3 * b, r=r)])
    return in_lanes(
        lambda: [(rig, BASE, Release(y0=[1e-3 * b * (0.99 - 0.01 * k)])) for k in range(64)]
    )


def departures() -> list[tuple[str, float, float]]:
    """ns an impact of `simulate` with its impact arrays over 300 s, and over that of the plain rig.

    In rounds through all of them, so that each meets the quiet moments of the machine.
    """
    best = [math.inf] * len(DEPARTURES)
    for _ in range(300):
        for i, (_, b, of_ball, k3, damping) in enumerate(DEPARTURES):
            rig = Rig(replace(TABLE_2, k3=k3), nes=[NES(m=0.032, b=1e-3 * b, r=0.6, **of_ball)])
            begin = time.process_time_ns()
            motion = simulate(rig, BASE, Release(y0=[0.93e-3 * b]), 300.0, damping=damping)
            hits = motion.impacts["time"].size
            best[i] = min(best[i], (time.process_time_ns() - begin) / hits)
    rows, plain = [], math.nan
    for (name, *_), ns in zip(DEPARTURES, best, strict=True):
        plain = ns if name.startswith("plain") else plain
        rows.append((name, ns, ns / plain))
    return rows


def of_a_sample() -> list[tuple[str, float]]:
    """ns a sample of a measured base: 10 s at 1 kHz, b = 30 mm."""
    samples = G * np.sin(2.0 * np.pi * TABLE_2.f0 * np.arange(10001) / 1000.0)
    base, rows = Measured(samples, 1000.0), []
    for name, friction, damping in (
        ("plain", 0.0, None),
        ("friction 0.05 m/s^2", 0.05, None),
        ("Coulomb friction 0.05 N", 0.0, WeakDamping(coulomb=0.05)),
        ("and quadratic damping 0.5 kg/m", 0.0, WeakDamping(coulomb=0.05, quadratic=0.5)),
    ):
        rig = Rig(TABLE_2, nes=[NES(m=0.032, b=0.03, r=0.6, friction=friction)])
        best = math.inf
        for _ in range(300):
            begin = time.process_time_ns()
            simulate(rig, base, Release(y0=[0.0279]), 10.0, damping=damping)
            best = min(best, (time.process_time_ns() - begin) / samples.size)
        rows.append((name, best))
    return rows


def main() -> None:
    """All cases by name, ns."""
    found = {" + ".join(f"{b:g}" for b in loop) + " mm": compiled_loop(loop)[0] for loop in LOOPS}
    found[f"map of {CELLS} by {CELLS} cells"] = whole_map()
    for b, r in STARTS:
        found[f"64 starts at {b} mm, r = {r}"] = many_starts(b, r)
    found |= {f"`simulate`: {name}": ns for name, ns, _ in departures()}
    found |= {f"a sample of a measured base: {name}": ns for name, ns in of_a_sample()}
    print(json.dumps(found))


if __name__ == "__main__":
    main()
