"""Signals that no oscillator makes, or that make work: as arrays for the public steps."""

from __future__ import annotations

import random

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

TESTS = ("ringdown", "sweep", "periodic", "transient", "drop")


def hostile(rng: random.Random) -> tuple[float, dict[str, Floats]]:
    """Sample rate, and one to three channels in SI by role."""
    rate = rng.choice((1e-3, 1.0, 50.0, 500.0, 2e3, 1e4, 1e6))
    n = rng.choice((2, 3, 10, 50, 300, 2000, 6000))
    numbers = np.random.default_rng(rng.randrange(1 << 30))
    roles = rng.choice(
        (("displacement",), ("acceleration",), ("displacement", "acceleration"),
         ("base", "displacement", "acceleration"), ("base", "displacement"))
    )  # fmt: skip
    cycles = rng.choice((0.5, 2.3, 7.9, 40.0, n / 5.0))
    return rate, {role: _channel(n, cycles, rng, numbers) for role in roles}


def _channel(n: int, cycles: float, rng: random.Random, numbers: np.random.Generator) -> Floats:
    t = np.arange(n, dtype=np.float64)
    carrier = np.cos(2.0 * np.pi * cycles * t / n)
    values = rng.choice((1.0, 1.0, 0.0)) * carrier * np.exp(-rng.choice((0.0, 5.0)) * t / n)
    values += rng.choice((0.0, 1e-3, 1e-3, 1.0)) * numbers.standard_normal(n)
    for _ in range(rng.choice((0, 1, 1, 2))):
        values = _spoiled(values, rng, numbers)
    return values * rng.choice((1e-3, 1e-3, 1.0, 10.0, 1e-30, 1e-300, 1e8, 1e37))


def _spoiled(values: Floats, rng: random.Random, numbers: np.random.Generator) -> Floats:
    n = len(values)
    every = rng.choice((2, 3, 7, 50, 400))
    match rng.randrange(12):
        case 0:
            values[rng.randrange(n)] += rng.choice((-30.0, 30.0, 1e9))
        case 1:
            values[::every] += rng.choice((1.0, 30.0, 1e6))
        case 2:
            values[::every] *= -20.0
        case 3:
            values[:] = rng.choice((0.0, 1.0, -1e-300))
        case 4:
            values[rng.randrange(n) :] = 0.0
        case 5:
            values[:] = np.sign(values)
        case 6:
            values = np.clip(values, -0.3, 0.4)
        case 7:
            values = np.round(values * rng.choice((2.0, 16.0))) / 16.0
        case 8:
            values += np.linspace(0.0, rng.choice((1e3, 1e12)), n)
        case 9:
            values = np.cumsum(numbers.standard_normal(n))
        case 10:
            values[rng.randrange(n)] = rng.choice((np.nan, np.inf, -np.inf, 9.9e37))
        case _:
            values = np.repeat(values[::every], every)[:n]
            values = np.pad(values, (0, n - len(values)))
    return np.asarray(values, dtype=np.float64)
