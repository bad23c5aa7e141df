"""Flights of an oscillator that is a little nonlinear, against the power series."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numba import njit
from numpy.polynomial import Polynomial

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.excitation import WeakDamping
from vinesexp.solver import bent
from vinesexp.solver.arrays import ball_table
from vinesexp.solver.response import phasor, prepare
from vinesexp.solver.simulation import _loop_of
from vinesexp.solver.state import EVENT, STATE, WORK, Parameters

TABLE2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
DRIVE = Harmonic(amplitude=0.25e-3, frequency=1.02 * TABLE2.f0, phase=0.4)
X0, V0 = 4e-3, 0.15


@njit
def bend(response, table, par, c, xh, vh, way, work):
    return bent.bend(response[0], table, par, c, xh, vh, 0.0, way, work, 7)


@njit
def start(response):
    return phasor(response[0], 0.0, 0.0)


def bent_by(k3: float, quadratic: float, way: float):
    """Whether there is a bend from (X0, V0) under DRIVE, and what it is."""
    o = TABLE2
    response = prepare(o.M, o.c1, o.k1, DRIVE.amplitude, DRIVE.frequency, DRIVE.phase)
    table, work = bent.bent_table(response), np.zeros((WORK, 31))
    par = Parameters(o.M, o.c1, o.k1, quadratic, 0.0, k3)
    c = np.array(start(response))
    w = 2.0 * math.pi * DRIVE.frequency
    found = bend(response, table, par, c, X0 - c[0], V0 + w * c[1], way, work)
    return found, work[10], table[0]


@pytest.mark.long
@pytest.mark.parametrize("k3", [3e5, 1e6, -1e6])
def test_a_bent_flight_is_that_of_the_power_series(k3):
    """Over the whole reach, the linear motion from the same start and u added up."""
    found, u, h = bent_by(k3, 0.0, 0.0)
    assert found
    s = np.linspace(0.0, h, 200)
    here = Polynomial(u[: bent.NODES])(2.0 * s / h - 1.0)
    linear = simulate(Rig(TABLE2), DRIVE, Release(X0, V0), h)
    exact = simulate(Rig(replace(TABLE2, k3=k3)), DRIVE, Release(X0, V0), h, general=True)
    difference = exact.at(s)[0] - linear.at(s)[0]
    assert np.abs(difference).max() > 1e-6
    assert np.abs(here - difference).max() < 4e-17  # 1e-14 of the motion, 4 mm


@pytest.mark.parametrize(
    ("k3", "quadratic", "way"), [(3e5, 0.0, 0.0), (0.0, 0.5, 1.0), (1e6, 1.0, -1.0)]
)
def test_the_bounds_hold_and_are_not_far_off(k3, quadratic, way):
    found, u, _ = bent_by(k3, quadratic, way)
    assert found
    p, per = Polynomial(u[: bent.NODES]), u[bent.PER_HALF]
    places = np.linspace(-1.0, 1.0, 2000)
    for order, column in ((4, bent.FOURTH), (5, bent.FIFTH)):
        largest = np.abs(p.deriv(order)(places)).max() * per**order
        assert largest <= u[column] < 20.0 * largest


def test_what_is_far_from_linear_is_left_to_the_power_series():
    assert not bent_by(1e9, 0.0, 0.0)[0]
    assert not bent_by(0.0, 500.0, 1.0)[0]


@pytest.mark.long
@pytest.mark.parametrize("law", ["cubic", "softening", "quadratic", "both", "and Coulomb friction"])
def test_motions_are_those_of_the_power_series(law):
    """200 rigs and starts nobody chose: the same events, at the same times to rounding."""
    off, hits = [], 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        G, zeta = 0.25e-3, 10.0 ** rng.uniform(-3.0, -1.5)
        o = Oscillator.from_modal(M=4.7, f0=7.86, zeta=zeta)
        weak = 10.0 ** rng.uniform(-5.0, -1.0)
        k3 = {"quadratic": 0.0, "softening": -0.3}.get(law, 1.0) * weak * o.k1 / (10.0 * G) ** 2
        quadratic = 0.0 if law in ("cubic", "softening") else weak * o.M / (10.0 * G)
        coulomb = 0.1 * o.k1 * G if law == "and Coulomb friction" else 0.0
        b = G * 10.0 ** rng.uniform(0.5, 1.5)
        ball = NES(m=0.05, b=b, r=rng.uniform(0.3, 0.9), friction=rng.choice([0.0, 0.0, 0.02]))
        rig = Rig(replace(o, k3=k3), nes=[ball])
        base = Harmonic(G, o.f0 * rng.uniform(0.95, 1.05), rng.uniform(0.0, 6.0))
        release, damping = Release(y0=[0.95 * b]), WeakDamping(quadratic, coulomb)
        fast = simulate(rig, base, release, 8.0 / o.f0, damping=damping)
        slow = simulate(rig, base, release, 8.0 / o.f0, damping=damping, general=True)
        assert np.array_equal(*(one.events[["kind", "nes", "side"]] for one in (fast, slow)))
        hits += fast.impacts["time"].size
        if fast.impacts["time"].size:
            off.append(abs(fast.events["time"][-1] - slow.events["time"][-1]) * o.f0)
    assert hits > 1000
    assert np.median(off) < 1e-14
    assert np.quantile(off, 0.97) < 1e-11


def test_a_steady_motion_needs_the_power_series_seldom():
    """100 s at 30 mm: turns of the loop, where every segment of a series would be one."""
    rig, damping = Rig(replace(TABLE2, k3=3e5), nes=[NES(m=0.032, b=0.03, r=0.6)]), WeakDamping()
    turns = {}
    for general in (False, True):
        loop = _loop_of(rig, Harmonic(0.25e-3, TABLE2.f0), damping, 100.0, None, general)
        balls, _ = ball_table(rig, Release(y0=[0.0279]))
        state = np.zeros(1, STATE)
        turns[general] = loop(state, balls, np.zeros(4096, EVENT))
        rows = state["logged"][0]
        assert 1500 < rows < 1700
    assert turns[False] < 1.3 * rows < 3.0 * rows < turns[True]
