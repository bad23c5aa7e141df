"""Contacts that last: error and cost of the bounded-error scheme.

Against a spring with a dashpot in the wall, stepped through every contact
(`benchmarks/robustness/motion.py`): the rig of Table 2, a release from 20 mm at b = 24 mm and a
periodic test at b = 30 mm, for contacts of several durations. Beside it what contacts without
duration give. `benchmarks.simulation` puts it into its page.
"""

from __future__ import annotations

import time

import numpy as np
from benchmarks.robustness.motion import STEP, move
from benchmarks.robustness.rig import Body, Drive

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
G, FREQUENCY = 0.25e-3, 7.862
CONTACTS = (0.2e-3, 0.4e-3, 0.8e-3, 1.6e-3)
_RELEASED, _SETTLED, _DRIVEN = 0.5, 30.0, 40.0  # s


def rig(b: float, tau: float) -> Rig:
    return Rig(TABLE_2, [NES(m=0.032, b=b, r=0.6, contact_time=tau)])


def release_error(tau: float, simulated: float) -> float:
    """Largest difference of x between contacts in the first half second, over the release."""
    b, start = 0.024, Release(0.02, 0.0, [0.02 + 0.999 * 0.024])
    true = move(Body(contact=tau), Drive(), b=b, seconds=_RELEASED, x0=0.02)
    motion = simulate(rig(b, simulated), None, start, duration=_RELEASED + 0.01)
    t = STEP * np.arange(true.x.size)
    hits = motion.impacts["time"]
    away = np.abs(t[:, None] - hits).min(axis=1) > 1.5 * tau
    x, _ = motion.at(t)
    return float(np.abs(x - true.x)[away].max() / 0.02)


def periodic_error(tau: float, simulated: float) -> float:
    """Amplitude of two impacts per cycle, over that of the reference, minus one."""
    b, base = 0.030, Harmonic(G, FREQUENCY)
    true = move(Body(contact=tau), Drive(G, FREQUENCY), b=b, seconds=_DRIVEN)
    late = np.arange(int(_SETTLED / STEP), true.x.size - 1)
    motion = simulate(rig(b, simulated), base, Release(y0=[0.999 * b]), duration=_DRIVEN)
    x, _ = motion.at(STEP * late)
    return float(np.abs(x).max() / np.abs(true.x[late]).max() - 1.0)


def cost(tau: float) -> float:
    """Processor time an impact, s."""
    b, base = 0.030, Harmonic(G, FREQUENCY)
    began = time.process_time()
    motion = simulate(rig(b, tau), base, Release(y0=[0.999 * b]), duration=2000.0)
    return (time.process_time() - began) / motion.impacts["time"].size


def table() -> list[str]:
    """Errors by duration of the contact, and what an impact costs."""
    lines = [
        "| contact | release: error of x, over 20 mm | contacts without duration "
        "| periodic: error of the amplitude | contacts without duration |",
        "|---" * 5 + "|",
    ]
    for tau in CONTACTS:
        cells = (
            f"{one(tau, simulated):.1e}"
            for one in (release_error, periodic_error)
            for simulated in (tau, 0.0)
        )
        lines.append(f"| {1e3 * tau:g} ms | " + " | ".join(cells) + " |")
    cost(1e-3)  # compiles
    lasting, plain = (min(cost(tau) for _ in range(5)) for tau in (1e-3, 0.0))
    return [
        *lines,
        "",
        f"It costs {1e6 * lasting:.2f} us an impact, {lasting / plain:.1f} times the plain rig "
        f"({1e6 * plain:.2f} us).",
    ]
