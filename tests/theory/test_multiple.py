"""Several NESs: bands, gaps, additivity of the balance, the designer."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks import slow_flow

from vinesexp import NES, Oscillator, Rig
from vinesexp.theory import manifold, multiple, orbits, slowflow
from vinesexp.theory.manifold import project

OSCILLATOR = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
PAIR = [NES(m=0.032, b=0.023, r=0.6), NES(m=0.032, b=0.034, r=0.6)]


def test_bands_follow_the_clearance_and_overlap_for_the_paper_pair() -> None:
    low, high = multiple.bands(PAIR)
    assert low.low == pytest.approx(0.15717673 * 0.023)
    assert high.high == pytest.approx(0.73213987 * 0.034)
    assert multiple.gaps(PAIR) == []
    apart = multiple.gaps([NES(m=0.032, b=0.005, r=0.6), NES(m=0.032, b=0.034, r=0.6)])
    assert len(apart) == 1
    assert apart[0].low == pytest.approx(0.73213987 * 0.005)


def test_one_ball_balance_is_the_slow_flow() -> None:
    G, b, eps = 0.25e-3, 0.025, 0.032 / 4.7
    rig = Rig(OSCILLATOR, [NES(m=0.032, b=b, r=0.6)])
    for frequency, sigma in ((None, 0.0), (OSCILLATOR.f0 * (1 + 0.5 * eps), 0.5)):
        points = slowflow.fixed_points(F=G / (eps * b), sigma=sigma, lam=rig.lam, r=0.6)
        A = next(p.A for p in points if p.stable)
        assert multiple.base_amplitude_for(A * b, rig, frequency=frequency) == pytest.approx(G)
    response = slow_flow.response_amplitude(G, rig)
    stable = next(
        p.A for p in slowflow.fixed_points(F=G / (eps * b), sigma=0, lam=rig.lam, r=0.6) if p.stable
    )
    assert response == pytest.approx(stable * b, rel=1e-3)


def test_two_equal_balls_are_one_of_twice_the_mass() -> None:
    x = np.linspace(0.006, 0.02, 7)
    two = Rig(OSCILLATOR, [NES(m=0.016, b=0.025, r=0.6)] * 2)
    one = Rig(OSCILLATOR, [NES(m=0.032, b=0.025, r=0.6)])
    np.testing.assert_allclose(
        multiple.base_amplitude_for(x, two), multiple.base_amplitude_for(x, one), rtol=1e-14
    )


def test_below_its_fold_a_ball_does_nothing() -> None:
    x = 0.004  # above the fold of the small ball (3.6 mm), below that of the large one (5.3 mm)
    both = multiple.base_amplitude_for(x, Rig(OSCILLATOR, PAIR))
    small = multiple.base_amplitude_for(x, Rig(OSCILLATOR, PAIR[:1]))
    assert both == small


def test_designer_puts_each_ball_on_its_fold_at_its_level() -> None:
    plan = multiple.design_clearances(
        G_low=0.1e-3, G_high=0.4e-3, oscillator=OSCILLATOR, masses=[0.016] * 3, r=[0.6] * 3
    )
    assert list(plan) == sorted(plan)
    assert multiple.gaps([NES(m=0.016, b=b, r=0.6) for b in plan]) == []
    for i, (b, level) in enumerate(zip(plan, (0.1e-3, 0.2e-3, 0.4e-3), strict=True)):
        x = float(manifold.A_1(0.6)) * b
        balls = [NES(m=0.016, b=c, r=0.6) for c in plan[: i + 1]]
        balls = [n for n in balls if x <= float(manifold.A_2(0.6)) * n.b]
        assert multiple.base_amplitude_for(x, Rig(OSCILLATOR, balls)) == pytest.approx(level)


def test_designer_with_one_ball_is_the_clearance_of_the_fold() -> None:
    plan = multiple.design_clearances(
        G_low=0.1e-3, G_high=0.25e-3, oscillator=OSCILLATOR, masses=[0.032], r=[0.6]
    )
    eps = 0.032 / 4.7
    lam = Rig(OSCILLATOR, PAIR[:1]).lam
    assert plan[0] == pytest.approx(0.25e-3 / (eps * float(slow_flow.fold_forcing(lam=lam, r=0.6))))


def test_projection_of_the_exact_orbit_lies_on_the_manifold_as_eps_vanishes() -> None:
    p = orbits.Reduced.of(eps=1e-6, zeta=1e-6, r=0.6)
    orbit = orbits.family(1.3, p)
    C, A = project(
        x=orbit.x,
        v=orbit.v_after,
        y=orbit.x - orbit.b,
        vy=orbit.u,
        w0=1.0,
        b=float(orbit.b),
        eps=1e-6,
    )
    assert pytest.approx(1.3) == C
    assert pytest.approx(float(manifold.amplitude(1.3, r=0.6)), rel=1e-5) == A


def test_each_ball_of_a_design_has_its_own_restitution() -> None:
    """Each sits on its fold at its level, whatever the r of the others."""
    o, masses, r = Oscillator(M=4.7, c1=3.02, k1=1.147e4), (0.032, 0.016), (0.6, 0.8)
    plan = multiple.design_clearances(G_low=1e-4, G_high=3e-4, oscillator=o, masses=masses, r=r)
    balls = [NES(m=m, b=b, r=one) for m, b, one in zip(masses, plan, r, strict=True)]
    fold = float(manifold.A_1(0.8)) * balls[1].b
    assert float(multiple.base_amplitude_for(fold, Rig(o, balls))) == pytest.approx(3e-4, rel=1e-9)
    alike = multiple.design_clearances(
        G_low=1e-4, G_high=3e-4, oscillator=o, masses=masses, r=(0.6, 0.6)
    )
    assert plan[0] == alike[0]
    assert plan[1] > 1.2 * alike[1]
