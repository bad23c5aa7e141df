"""Tests that it takes to bracket the lowest amplitude within 2 %: by plan, bisection, equal steps.

    python -m benchmarks.plan 0 50 0.0005 kept.jsonl      # labs 0 to 49, scatter 0.05 %

Each lab has a rig of its own, drawn at random, and knows it as an identification leaves it: M to
0.5 %, f0 to 0.01 %, damping to 1 %, r to 1 %, the ball's mass to 0.3 g, the base amplitude to 1 %.
A test is the exact simulation of the true rig from rest, settled, at a clearance set to 0.05 mm;
its amplitude is half the swing of each cycle, on the average, with the scatter of the records.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.planning.expected_valley import expected_valley
from vinesexp.planning.next_clearance import bracket_of, follow_plan
from vinesexp.units import Quantity

TARGET, CYCLES, SAMPLES = 0.02, 60, 48
SETTING = 5e-5  # m, of a cavity by caliper


@dataclass
class Lab:
    """The true rig, how it is driven, and what the lab knows of it."""

    rig: dict[str, float]
    G: float
    known: IdentifiedRig
    G_known: Quantity
    rng: np.random.Generator
    scatter: float

    @property
    def frequency(self) -> float:
        return float(np.sqrt(self.rig["k1"] / self.rig["M"]) / (2.0 * np.pi))

    def amplitude(self, b: float, *, exact: bool = False) -> float:
        """Mean half swing of a settled test, m."""
        rig = self.rig
        set_b = b if exact else max(b + SETTING * self.rng.standard_normal(), 1e-5)
        host = Oscillator(M=rig["M"], c1=rig["c1"], k1=rig["k1"])
        whole = Rig(host, nes=[NES(m=rig["m"], b=set_b, r=rig["r"])])
        f = self.frequency
        settle = 6.0 / (host.zeta * host.w0)
        duration = settle + CYCLES / f
        base = Harmonic(amplitude=self.G, frequency=f)
        motion = simulate(whole, base, Release(y0=[0.999 * set_b]), duration=duration)
        t = settle + np.arange(CYCLES * SAMPLES) / (SAMPLES * f)
        x = motion.at(t)[0].reshape(CYCLES, SAMPLES)
        mean = 0.5 * float((x.max(axis=1) - x.min(axis=1)).mean())
        return mean if exact else mean * (1.0 + self.scatter * self.rng.standard_normal())


def draw_lab(seed: int, scatter: float) -> Lab:
    """A rig between a tabletop and a machine, and the lab's knowledge of it."""
    rng = np.random.default_rng(seed)
    M = 10.0 ** rng.uniform(-0.3, 1.5)
    f0, zeta = 10.0 ** rng.uniform(0.6, 1.4), 10.0 ** rng.uniform(-2.4, -1.8)
    r, eps = rng.uniform(0.45, 0.8), 10.0 ** rng.uniform(-2.3, -1.7)
    G = 10.0 ** rng.uniform(-4.0, -3.4)
    w = 2.0 * np.pi * f0

    def values(M: float, f0: float, zeta: float, r: float, m: float) -> dict[str, float]:
        w = 2.0 * np.pi * f0
        return {"M": M, "c1": 2.0 * zeta * w * M, "k1": M * w**2, "r": r, "m": m}

    true = values(M, f0, zeta, r, eps * M)
    z = rng.standard_normal(6)
    errors = {"M": 0.005 * M, "f0": 1e-4 * f0, "zeta": 0.01 * zeta, "r": 0.01 * r, "m": 3e-4}
    seen = values(
        M + errors["M"] * z[0],
        f0 + errors["f0"] * z[1],
        zeta + errors["zeta"] * z[2],
        r + errors["r"] * z[3],
        eps * M + errors["m"] * z[4],
    )
    of = {"M": errors["M"], "r": errors["r"], "m": errors["m"]}
    known = IdentifiedRig(
        {name: Quantity(value, of.get(name, 0.01 * value)) for name, value in seen.items()},
        Quantity(w / (2.0 * np.pi), errors["f0"]),
        Quantity(zeta, errors["zeta"]),
    )
    return Lab(true, G, known, Quantity(G * (1.0 + 0.01 * z[5]), 0.01 * G), rng, scatter)


def true_minimum(lab: Lab, near: float) -> float:
    """Clearance of the smallest simulated amplitude, by steps of 0.25 %, m."""
    steps = near * (1.0 + 0.0025 * np.arange(-24, 25))
    return float(steps[int(np.argmin([lab.amplitude(b, exact=True) for b in steps]))])


def by_bisection(lab: Lab, low: float, high: float) -> dict[float, float]:
    """Both ends and the middle, then the middle of the wider gap beside the lowest."""
    tested = {b: lab.amplitude(b) for b in (low, 0.5 * (low + high), high)}
    while len(tested) < 60:
        found = bracket_of(tested)
        if found.low is None or found.high is None:  # the minimum is at an end: nothing beyond
            other = found.high if found.low is None else found.low
            b = 0.5 * (found.best + other)
            if abs(found.best - other) <= 0.5 * TARGET * found.best:
                break
        elif found.width <= TARGET:
            break
        else:
            below, above = found.best - found.low, found.high - found.best
            b = found.best - 0.5 * below if below > above else found.best + 0.5 * above
        tested[b] = lab.amplitude(b)
    return tested


def by_equal_steps(lab: Lab, low: float, high: float) -> dict[float, float]:
    """A step of 1 % of the middle from end to end."""
    step = 0.5 * TARGET * 0.5 * (low + high) * 0.95
    return {float(b): lab.amplitude(float(b)) for b in np.arange(low, high + 0.5 * step, step)}


def study(seed: int, scatter: float) -> dict[str, tuple[int, bool, float]] | None:
    """Per strategy: tests, whether the bracket holds the true minimum, its width."""
    lab = draw_lab(seed, scatter)
    valley = expected_valley(lab.known, G=lab.G_known, frequency=lab.frequency)
    if valley is None:
        return None
    truth = true_minimum(lab, valley.lowest)
    hand = truth * (1.0 + 0.1 * lab.rng.standard_normal())  # what a lab would guess: to 10 %
    low, high = 0.5 * hand, 1.5 * hand
    found = {
        "plan": follow_plan(lab.amplitude, expected=valley.lowest, target=TARGET),
        "bisection": by_bisection(lab, low, high),
        "equal steps": by_equal_steps(lab, low, high),
    }
    rows = {}
    for name, tested in found.items():
        bracket = bracket_of(tested)
        ends = bracket.low or -np.inf, bracket.high or np.inf
        slack = SETTING + 0.0013 * truth  # of the setting, and of the truth's own steps
        holds = ends[0] - slack <= truth <= ends[1] + slack
        rows[name] = (len(tested), bool(holds), bracket.width or 9.9)
    return rows


def table(rows: list[dict[str, tuple[int, bool, float]]]) -> str:
    """One row a strategy."""
    lines = [
        "| strategy | tests, median (10 to 90 %) | brackets of 2 % | that hold the minimum |",
        "|---|---|---|---|",
    ]
    for name in ("plan", "bisection", "equal steps"):
        n = np.array([row[name][0] for row in rows])
        narrow = sum(row[name][2] <= 1.02 * TARGET for row in rows)
        holds = sum(row[name][1] for row in rows)
        low, high = np.percentile(n, [10, 90])
        lines.append(
            f"| {name} | {np.median(n):.0f} ({low:.0f} to {high:.0f}) | "
            f"{narrow} of {len(rows)} | {holds} of {len(rows)} |"
        )
    return "\n".join(lines)


def main(first: int, last: int, scatter: float, kept: Path) -> None:
    """Study labs `first` to `last`, keep their rows in a file, and print the table of all kept."""
    began = time.process_time()
    for seed in range(first, last):
        row = study(seed, scatter)
        with kept.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps({"seed": seed, "scatter": scatter, "row": row}) + "\n")
    print(f"{time.process_time() - began:.0f} s of processor time", file=sys.stderr)
    done = [json.loads(line) for line in kept.read_text(encoding="utf-8").splitlines()]
    done = [one for one in done if one["scatter"] == scatter]
    rows = [one["row"] for one in done if one["row"] is not None]
    print(f"scatter {100 * scatter:g} %: {len(rows)} of {len(done)} labs have a valley\n")
    print(table(rows))


if __name__ == "__main__":
    if len(sys.argv) != 5:
        raise SystemExit(__doc__)
    main(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), Path(sys.argv[4]))
