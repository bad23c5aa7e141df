"""Coefficients of the shaken box's mean power below T1 and past T2: `theory.transient`.

    python -m benchmarks.box_power          # about two minutes; prints both tables

Runs the box over restitution and amplitude and fits smooth surfaces (docs/theory.md, 28). The
tests hold the stored coefficients to fresh runs of the box.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.polynomial.legendre import legvander2d

from vinesexp.theory.manifold import A_1, A_2
from vinesexp.theory.transient import HIGHEST, RISE, captured_power, mean_power

RESTITUTIONS = (0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.93, 0.97)
BELOW = np.array([0.1, 0.17, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85])  # shares of A_1
PAST = np.linspace(0.02, 1.0, 24)  # from A_2 to HIGHEST


def main() -> int:
    below, past = [], []
    for r in RESTITUTIONS:
        A = BELOW * float(A_1(r))
        below.append(np.log(mean_power(A, r=r, starts=40, cycles=150, settle=40, steps=32) / A**3))
        A = float(A_2(r)) + PAST * (HIGHEST - float(A_2(r)))
        power = mean_power(A, r=r, starts=12, cycles=100, settle=50, steps=32)
        past.append(np.log(power / captured_power(A, r=r)))
    for name, at, values, degree, weight in (
        ("_BELOW", BELOW / BELOW[-1], below, (3, 2), np.ones(BELOW.size)),
        ("_PAST", PAST, past, (3, 3), 1.0 - np.exp(-PAST / RISE)),
    ):
        place, r = np.meshgrid(2.0 * at - 1.0, 2.0 * np.array(RESTITUTIONS) - 1.0)
        rows = legvander2d(place.ravel(), r.ravel(), degree) * np.tile(weight, r.shape[0])[:, None]
        found, *_ = np.linalg.lstsq(rows, np.ravel(values), rcond=None)
        rms = np.sqrt(np.mean((rows @ found - np.ravel(values)) ** 2))
        print(name, f"rms {rms:.3f}")
        print(np.array2string(found.reshape(degree[0] + 1, -1), precision=4, separator=", "))
    return 0


if __name__ == "__main__":
    sys.exit(main())
