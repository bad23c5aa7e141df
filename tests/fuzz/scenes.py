"""Random rigs, dampings, springs, bases and durations: each run ends, and makes no energy."""

from __future__ import annotations

import math
import random
import warnings
from pathlib import Path

import numpy as np

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.errors import AnalysisError, RigWarning
from vinesexp.excitation import Base, Measured, SteppedSweep, Sweep, WeakDamping
from vinesexp.solver.effort import Effort, fastest_of
from vinesexp.solver.motion import Motion

#: Evaluations a radian that no scene of these may take; `effort.STALL` ends a run at 300,000.
DENSE = 60_000
#: Radians of its fastest motion that a scene goes on for: some seconds of the processor.
LONGEST = 30_000.0
#: Of the energy, by which rounding may raise it over a run.
ROUNDING = 1e-9


def _log(rng: random.Random, low: float, high: float) -> float:
    return 10.0 ** rng.uniform(math.log10(low), math.log10(high))


def _some(rng: random.Random, share: float, low: float, high: float) -> float:
    return _log(rng, low, high) if rng.random() < share else 0.0


def random_scene(
    rng: random.Random,
) -> tuple[Rig, Base | None, Release, float, WeakDamping]:
    """A scene of any scale: what it is made of spans decades, what a laboratory has and beyond."""
    M, f0, x0 = _log(rng, 1e-3, 1e3), _log(rng, 0.05, 5e3), _log(rng, 1e-6, 1.0)
    k1 = M * (2.0 * math.pi * f0) ** 2
    zeta = _some(rng, 0.9, 1e-5, 2.0)
    k3 = _some(rng, 0.3, 1e-4, 1e7) * k1 / x0**2 * rng.choice((1.0, 1.0, 1.0, -1e-5))
    o = Oscillator(M=M, c1=2.0 * zeta * math.sqrt(k1 * M), k1=k1, k3=k3)
    damping = WeakDamping(
        _some(rng, 0.4, 1e-4, 10.0) * M / x0, _some(rng, 0.5, 1e-7, 2.0) * k1 * x0
    )
    lasting = rng.random() < 0.1
    balls, rubs = [], rng.random() < 0.4
    for _ in range(rng.choice((0, 0, 1, 1, 1, 2, 3))):
        push = k1 * x0 / M
        balls.append(
            NES(
                m=M * _log(rng, 1e-4, 3.0),
                b=x0 * _log(rng, 3e-3, 30.0),
                r=rng.choice((0.0, 1.0, 0.999, rng.random(), rng.random(), rng.random())),
                r_slope=rng.choice((0.0, 0.0, -1.0)) * rng.random() * math.sqrt(M / k1) / x0,
                friction=0.0 if lasting or not rubs else _some(rng, 0.7, 1e-5, 1.0) * push,
                tilt=rng.choice((0.0, 0.0, 1.0, -1.0)) * _log(rng, 1e-6, 0.1) * push if rubs else 0,
                contact_time=_log(rng, 1e-3, 0.05) / f0 if lasting else 0.0,
            )
        )
    duration = _log(rng, 0.03, 40.0) / f0
    G = x0 * _log(rng, 1e-3, 1.0)
    f = f0 * rng.choice((1.0, _log(rng, 0.05, 20.0)))
    bases: tuple[Base, ...] = (
        Harmonic(G, f, rng.uniform(0.0, 6.0)),
        Sweep(G, f, f * rng.uniform(0.5, 2.0), duration * rng.uniform(0.5, 1.0)),
        SteppedSweep(G, [f, 1.1 * f], 0.5 * duration),
        Measured(
            G * np.cumsum(np.random.default_rng(rng.randrange(10**6)).normal(size=65)) / 8.0,
            64.0 / duration,
        ),
    )
    base = rng.choice(bases) if rng.random() < 0.4 else None
    y0 = [x0 + n.b * rng.choice((1.0, -1.0, 0.0, rng.uniform(-1.0, 1.0))) for n in balls]
    v0 = rng.choice((0.0, x0 * o.w0 * rng.uniform(-1.0, 1.0)))
    duration = min(duration, LONGEST / (o.w0 * (1.0 + math.sqrt(abs(k3) / k1) * x0)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RigWarning)
        return Rig(o, balls), base, Release(x0=x0, v0=v0, y0=y0), duration, damping


def energies(motion: Motion) -> np.ndarray:
    """Energy of oscillator and balls over the run, J, with that of the balls in a tilted floor."""
    o, nes = motion.rig.oscillator, motion.rig.nes
    t = np.linspace(0.0, motion.duration, 400)
    x, v = motion.at(t)
    total = 0.5 * o.M * v**2 + 0.5 * o.k1 * x**2 + 0.25 * o.k3 * x**4
    if nes:
        y, vy = motion.ball(t)
        for i, ball in enumerate(nes):
            total = total + 0.5 * ball.m * vy[i] ** 2 - ball.m * ball.tilt * y[i]
    return np.asarray(total)


def motion(rng: random.Random, folder: Path) -> str:
    """A random scene: it ends within a bound of work, all of it finite, with no energy made."""
    rig, base, release, duration, damping = random_scene(rng)
    used, add = 0, Effort.add

    def count(self: Effort, state: np.ndarray, evaluations: int) -> None:
        nonlocal used
        used += evaluations
        add(self, state, evaluations)

    Effort.add = count  # type: ignore[method-assign]
    try:
        found = simulate(rig, base, release, duration, damping=damping)
    except AnalysisError as error:
        if "\n" in str(error) or "inf" in str(error).split(":")[-1]:
            raise
        return "refused"
    finally:
        Effort.add = add  # type: ignore[method-assign]
    radians = duration * fastest_of(rig, base)
    stiff = 1.0 + math.sqrt(abs(rig.oscillator.k3) / rig.oscillator.k1) * abs(release.x0)
    assert used <= DENSE * (1.0 + radians * stiff), f"{used} evaluations in {radians:.3g} rad"
    x, v = found.at(np.linspace(0.0, duration, 200))
    assert np.isfinite(x).all(), "x is not finite"
    assert np.isfinite(v).all(), "x' is not finite"
    if base is None and not any(n.contact_time for n in rig.nes):
        total = energies(found)
        scale = np.abs(total).max() + sum(abs(n.m * n.tilt * n.b) for n in rig.nes)
        rise = float(np.diff(np.maximum.accumulate(total)).sum())
        assert rise <= ROUNDING * scale, f"energy rises by {rise / scale:.2e} of it"
    return "ok"
