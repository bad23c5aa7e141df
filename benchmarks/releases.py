"""Releases of rigs nobody chose: whether three of four balls keep the time that is printed.

    python -m benchmarks.releases 20 [seconds]     # a table, and the sentences of the page

A rig of random eps, zeta and r (log-uniform 1e-3 to 0.05 and 1e-3 to 0.03, 0.3 to 0.9) is released;
`design.released` prints for each level the fastest clearance and the time by which three of four
balls are there. Thirty other balls, at rest anywhere, are then released at that clearance.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from vinesexp import NES, Oscillator, Release, Rig, simulate
from vinesexp.design.predictions import LEVELS
from vinesexp.design.released import FOLLOWED, LONGEST, _measures, released
from vinesexp.design.task import OpenRig
from vinesexp.theory.transient import Decaying, best_clearance

SEED, OTHERS = 80_000, 30
X_M, F_0 = 0.02, 8.0


def study(index: int) -> list[tuple[float, float, float, float, float, float]]:
    """For each level printed, seen and bare time (s), share captured, theory's time and reach."""
    rng = np.random.default_rng(SEED + index)
    eps, zeta = 10.0 ** rng.uniform(-3.0, np.log10([0.05, 0.03]))
    r = float(rng.uniform(0.3, 0.9))
    o, levels = Oscillator.from_modal(M=1.0, f0=F_0, zeta=zeta), [s * X_M for s in LEVELS]
    falls = released(OpenRig(o, (eps,), (r,)), x0=X_M, v0=0.0, levels=levels)
    duration = min(FOLLOWED / (zeta * o.w0), LONGEST / F_0)
    places, found = rng.uniform(-1.0, 1.0, OTHERS), []
    for k, level in enumerate(levels):
        best = falls.found[falls.fastest[k]]
        rig = Rig(o, [NES(m=eps, b=best.b, r=r)])
        motions = [
            simulate(rig, None, Release(X_M, 0.0, [X_M + u * best.b]), duration) for u in places
        ]
        seen = float(np.percentile([_measures(one, [level])[0][0] for one in motions], 75.0))
        theory = best_clearance(Decaying(M=1.0, c1=o.c1, k1=o.k1, m=eps, r=r, x_m=X_M), level=level)
        printed = best.sure(k)
        row = (printed, seen, falls.bare[k], best.share, theory.time, theory.capture_rate)
        found.append(row)
    return found


def main() -> None:
    """Rigs one after the other, as many as fit the time given."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    most = float(sys.argv[2]) if len(sys.argv) > 2 else 600.0
    begin, rows, rigs = time.monotonic(), [], 0
    for index in range(count):
        rows += study(index)
        rigs += 1
        if time.monotonic() - begin > most:
            break
    printed, seen, bare, _, theory, reach = np.array(rows).T
    helps = printed < 0.95 * bare
    off = np.abs(seen / printed - 1.0)[helps]
    print(f"{rigs} rigs, {len(rows)} levels, {int(helps.sum())} at which a clearance is printed")
    print(f"three of four of {OTHERS} other balls over the printed time, off: median "
          f"{100 * np.median(off):.1f} %, 95th percentile {100 * np.percentile(off, 95):.1f} %, "
          f"above 20 %: {int((off > 0.2).sum())}")  # fmt: skip
    slower = seen[helps] > 0.95 * bare[helps]
    print(f"no faster than without a ball: {int(slower.sum())}")
    shown = reach >= 1.0
    for name, these in (("shown beside it", shown), ("left out", ~shown)):
        if these.any():
            error = np.abs(seen / theory - 1.0)[these]
            print(f"theory's b*, {name}: {int(these.sum())}; its time off by over 20 %: "
                  f"{int((error > 0.2).sum())}")  # fmt: skip


if __name__ == "__main__":
    main()
