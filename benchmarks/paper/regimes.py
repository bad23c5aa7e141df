"""Section 2.2: five regimes by where the fixed point lies on the SIM, and how far a NES works."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from benchmarks.paper.rig import (
    BALL,
    TABLE_2,
    G,
    R,
    Verdict,
    Verdicts,
    amplitude_peaks,
    periodic,
    rig_with,
)

from vinesexp.design.task import bare_gain
from vinesexp.theory import boundaries, manifold, orbits, slowflow
from vinesexp.theory.regime_definitions import Regime, regime_of

SETTLED, DURATION = 60.0, 240.0
CLEARANCES = (5, 10, 12, 14, 16, 18, 20, 25, 30, 33, 35, 36, 38, 40, 45, 60, 80, 100, 120)
LEVELS = (0.05, 0.10, 0.15, 0.20, 0.25, 0.30, 0.40, 0.60, 0.90, 1.40, 2.50)
A_1, A_2 = float(manifold.A_1(R)), float(manifold.A_2(R))
C_1 = np.pi**2 / (np.pi**2 + 4.0 * ((1.0 - R) / (1.0 + R)) ** 2)


@dataclass(frozen=True)
class Seen:
    """One motion from the wall: fixed points (C, A) of the slow flow, and what is simulated."""

    b: float
    level: float
    points: list[tuple[float, float]]
    regime: Regime
    per_cycle: float
    captured: float
    mean: float


def seen(b: float, level: float = G) -> Seen:
    """Clearance and level in m."""
    rig = rig_with(b)
    points = slowflow.fixed_points(F=level / (rig.eps * b), sigma=0.0, lam=rig.lam, r=R)
    motion = periodic(b, DURATION, level)
    i = motion.impacts
    found = regime_of(
        i["time"], i["side"], period=1.0 / TABLE_2.f0, start=SETTLED, end=DURATION
    )  # fmt: skip
    mean = float(amplitude_peaks(motion, SETTLED).mean())
    return Seen(
        b, level, [(p.C, p.A) for p in points], found.regime, found.impacts_per_cycle,
        found.captured, mean,
    )  # fmt: skip


def section_2_2() -> tuple[list[str], Verdicts]:
    """The regimes over the clearance at one level, and over the level at one clearance."""
    over_b = [seen(1e-3 * b) for b in CLEARANCES]
    over_G = [seen(0.034, 1e-3 * level) for level in LEVELS]
    lines = [
        "G = 0.25 mm, resonance, ball started at a wall. Fixed points of the slow flow (23): C on "
        f"the SIM; the left branch ends at T1, C = {C_1:.3f}.",
        "",
        "| b (mm) | C, left branch | C, right branch | A | simulated | impacts per cycle "
        "| cycles with one impact a side |",
        "|---|---|---|---|---|---|---|",
    ]
    for one in over_b:
        left = ", ".join(f"{C:.2f}" for C, _ in one.points if C < C_1)
        right = [(C, A) for C, A in one.points if C >= C_1]
        lines.append(
            f"| {1e3 * one.b:g} | {left or '-'} | {', '.join(f'{C:.2f}' for C, _ in right) or '-'} "
            f"| {', '.join(f'{A:.2f}' for _, A in right) or '-'} | {one.regime.value} "
            f"| {one.per_cycle:.2f} | {100 * one.captured:.0f} % |"
        )
    lines += [
        "",
        "The same with b = 34 mm over the level:",
        "",
        "| G (mm) | mean amplitude (mm) | of the bare one | simulated |",
        "|---|---|---|---|",
    ]
    bare = bare_gain(TABLE_2, TABLE_2.f0)
    for one in over_G:
        lines.append(
            f"| {1e3 * one.level:.2f} | {1e3 * one.mean:.2f} "
            f"| {100 * one.mean / (bare * one.level):.0f} % | {one.regime.value} |"
        )
    return lines, _regimes(over_b) | _fold() | _range(over_G, bare)


def _names(rows: list[Seen]) -> str:
    """Clearances (mm), as a range."""
    if not rows:
        return "none"
    b = [1e3 * one.b for one in rows]
    return f"{min(b):g} mm" if len(b) == 1 else f"{min(b):g} to {max(b):g} mm"


def _regimes(rows: list[Seen]) -> Verdicts:
    none = [one for one in rows if not one.points]
    left = [one for one in rows if one.points and all(C < C_1 for C, _ in one.points)]
    stable = [one for one in rows if any(C >= C_1 and A <= A_2 for C, A in one.points)]
    beyond = [one for one in rows if any(C >= C_1 and A > A_2 for C, A in one.points)]
    modulated = [one for one in rows if one.regime is Regime.MODULATED]
    idle = [one for one in none if one.captured < 0.1]
    spells = [one for one in none if one not in idle]
    two = [one for one in beyond if one.regime is Regime.TWO_ASYMMETRIC]
    more = [one for one in beyond if one.regime is Regime.MORE]
    whole = [one for one in more if abs(one.per_cycle - round(one.per_cycle)) < 0.02]
    steady = all(one.regime is Regime.TWO_SYMMETRIC for one in stable)
    return {
        "regime_1": Verdict(
            "in part" if spells else "agrees",
            f"no fixed point for b = {_names(none)}; without spells of two impacts per cycle only "
            f"{_names(idle)}, at {_names(spells)} they come and go: the end of the fixed points is "
            "not the end of the captures",
        ),
        "regime_2": Verdict(
            "in part" if any(one in none for one in modulated) else "agrees",
            f"all fixed points on the left branch for b = {_names(left)}, and the response is "
            f"modulated there; but it is modulated for b = {_names(modulated)}, mostly without any "
            "fixed point",
        ),
        "regime_3": Verdict(
            "agrees" if steady else "in part",
            f"fixed point on the right branch between T1 and T2 for b = {_names(stable)}: two "
            f"symmetric impacts per cycle in {'all' if steady else 'some'} of them",
        ),
        "regime_4": Verdict(
            "agrees" if two else "differs",
            f"fixed point past A_2 = {A_2:.3f} for b = {_names(beyond)}; of these {_names(two)} "
            "give two asymmetric impacts per cycle",
        ),
        "regime_5": Verdict(
            "in part" if whole else "agrees",
            f"more than two impacts per cycle for b = {_names(more)}, yes; "
            + ", ".join(f"{1e3 * one.b:g} mm: {one.per_cycle:.2f}" for one in more)
            + " per cycle, whole numbers that repeat: not chaos, and not infinitely many",
        ),
    }  # fmt: skip


def _fold() -> Verdicts:
    p = orbits.Reduced.of_rig(M=TABLE_2.M, c1=TABLE_2.c1, k1=TABLE_2.k1, m=BALL, r=R)
    ends = boundaries.stable_range(p)
    orbit = orbits.family(np.linspace(float(ends.C_low), float(ends.C_high), 400), p)
    least = float((orbit.amplitude / orbit.b).min())
    return {
        "T1": Verdict(
            "in part",
            f"of the stable orbits of the whole equations the least has x/b = {least:.4f}, A_1 is "
            f"{A_1:.4f}: right to order eps. A ball that is captured in a decaying motion is lost "
            "later, at 0.12 b (figure 13 below)",
        )
    }


def _range(rows: list[Seen], bare: float) -> Verdicts:
    works = [one for one in rows if one.mean < 0.8 * bare * one.level]
    low, high = 1e3 * works[0].level, 1e3 * works[-1].level
    best = min(rows, key=lambda one: one.mean / one.level)
    limited = works[0] is not rows[0] and works[-1] is not rows[-1]
    return {
        "range": Verdict(
            "agrees" if limited else "in part",
            f"b = 34 mm takes a fifth or more off the bare amplitude from {low:.2f} to {high:.2f} "
            f"mm base amplitude, of {1e3 * rows[0].level:.2f} to {1e3 * rows[-1].level:.2f} tried "
            f"(table); best at {1e3 * best.level:.2f} mm",
        )
    }
