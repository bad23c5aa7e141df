"""Mean amplitudes of tests recorded from rest on: how many are wrong, and which are warned of.

    python -m benchmarks.from_rest [--records 600] [--seed 2]

Random rigs, clearances, base amplitudes and lengths of record; each test begins at rest with the
ball at a wall. What `regimes.csv` says of its mean amplitude is compared with the mean of the same
motion much later. docs/signals.md has the figures.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass

import numpy as np

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.arrays import FloatArray
from vinesexp.clearance.comparison import start_checks
from vinesexp.clearance.levels import LevelBase, PeriodicLevel, Tested
from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.signals.means import cycle_amplitudes
from vinesexp.signals.steady_part import SteadyPart, from_rest, steady_part
from vinesexp.units import Quantity

_SKIPPED = 0.2  # the setting `regimes.settling`
_RATE = 32  # samples a cycle


@dataclass(frozen=True)
class Tried:
    """Standard errors and share by which the mean is off, and the warnings."""

    errors: float
    share: float
    drifts: bool
    soon: bool


def tried(rng: np.random.Generator) -> Tried:
    """One random test from rest."""
    f0, zeta = rng.uniform(3.0, 25.0), math.exp(rng.uniform(math.log(1e-3), math.log(2e-2)))
    eps, r = math.exp(rng.uniform(math.log(0.004), math.log(0.03))), rng.uniform(0.3, 0.8)
    w = 2.0 * math.pi * f0
    host = Oscillator(M=5.0, c1=2.0 * zeta * 5.0 * w, k1=5.0 * w**2)
    G = rng.uniform(0.5, 2.0) * 1e-2 * zeta
    b = G / (2.0 * zeta) * rng.uniform(0.3, 8.0)  # of amplitudes of the bare mass
    f = f0 * (1.0 + zeta * rng.uniform(-1.0, 1.0))
    forgets = 1.0 / (w * zeta)
    rig = Rig(host, nes=[NES(m=5.0 * eps, b=b, r=r)])
    length = int(f * math.exp(rng.uniform(math.log(5.0), math.log(90.0))))  # cycles of the record
    start, end = max(40.0 * forgets, length / f), max(100.0 * forgets, 3.0 * length / f)
    motion = simulate(rig, Harmonic(G, f), Release(0.0, y0=[b]), duration=end)
    x, _ = motion.at(np.arange(int(end * f * _RATE)) / (f * _RATE))
    amplitude = cycle_amplitudes(x, f * _RATE, f)[1]
    skipped = round(_SKIPPED * length)
    shown = steady_part(amplitude[skipped:length])
    settled = steady_part(amplitude[int(start * f) :])
    known = IdentifiedRig({}, Quantity(f0), Quantity(zeta))
    return Tried(
        abs(shown.mean - settled.mean) / math.hypot(shown.error, settled.error),
        abs(shown.mean / settled.mean - 1.0),
        shown.drifts,
        _soon(amplitude[:length], shown, skipped, b, f, rig=known),
    )


def _soon(
    amplitude: FloatArray, shown: SteadyPart, skipped: int, b: float, f: float, rig: IdentifiedRig
) -> bool:
    waited = (skipped + shown.first) / f if from_rest(amplitude) else math.inf
    test = Tested(b, shown.mean, waited=waited)
    base = LevelBase(Quantity(1e-3), Quantity(f))
    return bool(start_checks(PeriodicLevel(1e-3, base, (test,)), rig))


def main() -> None:
    """Simulate and count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=600)
    parser.add_argument("--seed", type=int, default=2)
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    found = [tried(rng) for _ in range(given.records)]
    for name, wrong in (
        ("95 % interval misses", lambda t: t.errors > 1.96),
        ("by 3 errors", lambda t: t.errors > 3.0),
        ("by 3 errors and 3 %", lambda t: t.errors > 3.0 and t.share > 0.03),
    ):
        those, others = ([t for t in found if wrong(t) is is_so] for is_so in (True, False))
        print(
            f"{name}: {len(those)} of {len(found)}, warned of "
            f"{sum(t.drifts or t.soon for t in those)} (start {sum(t.soon for t in those)}, "
            f"drift {sum(t.drifts for t in those)}); warned of among the others "
            f"{sum(t.drifts or t.soon for t in others)} of {len(others)}; "
            f"unwarned that are right {sum(not (t.drifts or t.soon) for t in others)}"
        )


if __name__ == "__main__":
    main()
