"""The simulated motion against forty digits, within what rounding alone may do to it."""

from __future__ import annotations

import sys
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from benchmarks.impact_problems import ExactReplay, Problem, problems  # noqa: E402

pytestmark = pytest.mark.long

EPS = np.finfo(np.float64).eps


def random_problem(number):
    """A rig with one ball or two, log-random in all that matters, and a start anywhere."""
    rng = np.random.default_rng(number)
    zeta, mass, f0 = 10.0 ** rng.uniform([-4.0, -3.0, -0.3], [-1.3, -0.7, 1.3])
    oscillator, ratio = Oscillator.from_modal(M=1.0, f0=f0, zeta=zeta), rng.uniform(0.8, 1.25)
    base = Harmonic(10.0 ** rng.uniform(-4.0, -2.5), ratio * f0, phase=rng.uniform(0.0, 6.0))
    size = base.amplitude / max(abs(1.0 - ratio**2), 2.0 * zeta, 0.02)
    clearances = size * 10.0 ** rng.uniform(-0.7, 0.5, 1 + number % 2)
    rig = Rig(oscillator, nes=[NES(m=mass, b=b, r=rng.uniform(0.3, 0.95)) for b in clearances])
    x0, v0 = size * rng.uniform(-1.0, 1.0), size * oscillator.w0 * rng.uniform(-1.0, 1.0)
    places = [x0 + rng.uniform(-0.99, 0.99) * b for b in clearances]
    speeds = [size * oscillator.w0 * rng.uniform(-1.0, 1.0) for _ in clearances]
    return Problem("", rig, base, Release(x0, v0, places, speeds), 60.0 / f0, 20)


def flights(problem):
    """What is wrong with each flight, in units of rounding: rows of gap, x and x'.

    Every flight starts anew from the numbers that the simulation gives for its start, so nothing
    is carried on from the ones before. What is looked at is the distance left to the wall at the
    time of the impact: it goes to zero with the closing speed, by which the error of the time
    would have to be divided. Rounding of the time itself moves it by that speed times EPS t.
    """
    motion = simulate(problem.rig, problem.base, problem.release, problem.duration)
    hits, replay = motion.impacts, ExactReplay(problem, digits=40, order=36)
    first_rest = motion.rests["start"].min(initial=np.inf)
    left, w0 = np.zeros(len(problem.rig.nes)), problem.rig.oscillator.w0
    for k in range(min(problem.count, int((hits["time"] < first_rest).sum()))):
        i, side, t = int(hits["nes"][k]), int(hits["side"][k]), float(hits["time"][k])
        x, v, u = (float(hits[name][k]) for name in ("x", "v_before", "vy_before"))
        sizes = 2.0 * problem.rig.nes[i].b + abs(float(replay.x)) + abs(x)
        path = (abs(float(replay.v)) + abs(u)) * (t - left[i]) + (abs(v) + abs(u)) * t
        replay.advance(mp.mpf(t) - replay.t)
        clearance = mp.mpf(problem.rig.nes[i].b)
        gap = clearance - side * (replay.x - replay.y[i])
        yield np.array([gap, replay.x - x, (replay.v - v) / w0], float) / (EPS * (sizes + path))
        replay.x, replay.v = mp.mpf(x), mp.mpf(float(hits["v_after"][k]))
        replay.y[i], replay.u[i] = replay.x - side * clearance, mp.mpf(float(hits["vy_after"][k]))
        left[i] = t


def test_every_flight_ends_at_the_wall_to_rounding():
    found = np.array([row for number in range(40) for row in flights(random_problem(number))])
    assert len(found) > 600
    assert np.abs(found[:, 0]).max() < 2.0
    assert np.abs(found[:, 1]).max() < 2.0
    assert np.abs(found[:, 2]).max() < 6.0
    assert (np.sqrt((found**2).mean(axis=0)) < 0.3).all()


def exact_times(problem, hits, *, moved=0.0):
    """Impact times to 40 digits, of the oscillator started `moved` metres aside."""
    replay = ExactReplay(problem)
    replay.x += mp.mpf(moved)
    rows = list(zip(hits["nes"], hits["side"], hits["time"], strict=True))[: min(50, problem.count)]
    return np.array([replay.impact(int(i), int(side), float(t)) for i, side, t in rows])


@pytest.mark.parametrize("problem", problems()[1:4], ids=lambda problem: problem.name)
def test_a_motion_is_that_of_a_start_within_rounding(problem):
    """Times of up to 50 impacts in a row: off by no more than a few EPS b at the start do.

    A slow impact magnifies what was rounded before it a hundredfold, a chaotic motion without end:
    how far depends on the motion, and is measured here in 40 digits.
    """
    hits = simulate(problem.rig, problem.base, problem.release, problem.duration).impacts
    exact, b = exact_times(problem, hits), max(nes.b for nes in problem.rig.nes)
    simulated = np.array([mp.mpf(float(t)) for t in hits["time"][: len(exact)]])
    error = np.abs((simulated - exact).astype(float))
    shift = np.abs((exact_times(problem, hits, moved=EPS * b) - exact).astype(float))
    assert len(exact) > 15
    assert (error < 4.0 * shift + 16.0 * EPS * exact.astype(float)).all()
