"""What a recorder does to good samples shows before any rig, and reaches no value of the rig."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, analyse, simulate

M, C1, K1, BALL, R = 4.7, 3.02, 1.147e4, 0.032, 0.6
F, G, RATE, SECONDS = 7.862, 0.25e-3, 5000.0, 8.0


@lru_cache(maxsize=4)
def channels(b: float = 0.033, *, rate: float = RATE, seconds: float = SECONDS, seed: int = 0):
    """Base, displacement and acceleration of the rig of Table 2; pulses of 0.4 ms, noise."""
    rig = Rig(Oscillator(M=M, c1=C1, k1=K1), nes=[NES(m=BALL, b=b, r=R)])
    base, start = Harmonic(G, F), 12.0
    motion = simulate(rig, base, Release(y0=[-0.999 * b]), duration=start + seconds)
    t = np.arange(round(seconds * rate)) / rate
    rng = np.random.default_rng(seed)
    x, v = motion.at(start + t)
    w = 2 * np.pi * F
    moved, speed = G * np.sin(w * (start + t)), w * G * np.cos(w * (start + t))
    a = -(K1 * (x - moved) + C1 * (v - speed)) / M
    hits = motion.impacts
    for when, jump in zip(hits["time"] - start, hits["v_after"] - hits["v_before"], strict=True):
        if 0.0 < when < seconds:
            s = (t - when) / 4e-4
            a = a + np.where(abs(s) < 0.5, 0.5 * np.pi * jump / 4e-4 * np.cos(np.pi * s), 0.0)
    found = {
        "base": moved + 1e-7 * rng.standard_normal(t.size),
        "displacement": x + 5e-6 * rng.standard_normal(t.size),
        "acceleration": a + 0.3 * rng.standard_normal(t.size),
    }
    return {role: np.asarray(values) for role, values in found.items()}


def analysed(given, *, rate=RATE, b=0.033):
    """Analysis of a periodic test whose sheet and gains are right."""
    return analyse(
        given, rate, test="periodic", clearance=b, nes_mass=BALL, base_amplitude=G, frequency=F,
        exact=True,
    )  # fmt: skip


def value_of(found, name, method="combined"):
    rows = found.identified[found.identified.parameter == name]
    rows = rows[rows.method == method] if (rows.method == method).any() else rows
    return float(rows.value.iloc[0]), float(rows.std_error.iloc[0])


@pytest.mark.parametrize("count", [10, 40])
def test_a_laser_that_loses_its_target_leaves_gaps_and_right_values(count):
    given = dict(channels())
    x, rng = given["displacement"].copy(), np.random.default_rng(5)
    for first in rng.integers(0, x.size - 100, count):
        x[first : first + int(RATE * rng.uniform(0.004, 0.02))] = 0.05
    found = analysed(given | {"displacement": x})
    said = found.checks[found.checks.check == "gaps"]
    assert "shows nothing for" in said.detail.item()
    value, error = value_of(found, "r")
    assert abs(value - R) < max(4.0 * error, 1e-3)
    assert error < 0.005
    assert found.regime["regime"] == "two symmetric"
    assert found.regime["amplitude_mean_m"] == pytest.approx(5.268e-3, rel=2e-3)
    base, error = value_of(found, "base_amplitude")
    assert base == pytest.approx(G, rel=5e-3)
