"""Corners of the theory: a right value or a clear error, never a silent NaN."""

from __future__ import annotations

import math

import numpy as np
import pytest
from benchmarks import free_decay, sequences
from tests.combined import combined
from tests.theory.half_period import multipliers

from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.theory import boundaries, floquet, manifold, orbits, slowflow
from vinesexp.theory import optimal_clearance as clearance
from vinesexp.theory.orbits import Reduced
from vinesexp.theory.transient import Decaying, best_clearance, captured_time

RIG = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "m": 0.032, "r": 0.6}


def test_elastic_limit() -> None:
    """r -> 1: the fold goes to zero amplitude as pi A_1 = 2 Gamma, b_c to G pi^2/(8 eps)."""
    r = 1.0 - 1e-9
    assert manifold.A_1(r) == pytest.approx((1.0 - r) / np.pi, rel=1e-6)
    assert manifold.A_1(1.0) == 0.0
    assert manifold.C_1(1.0) == 1.0
    assert clearance.b_c_published(G=1.0, eps=0.01, lam=2.0, r=1.0) == pytest.approx(
        np.pi**2 / (8.0 * 0.01)
    )
    assert float(manifold.upper_branch(0.3, r=1.0)) == pytest.approx(1.3)
    for point in slowflow.fixed_points(F=1.2, sigma=0.0, lam=2.0, r=1.0):
        assert np.isfinite([point.A, point.C, point.rho]).all()


def test_elastic_ball_without_damping_has_no_stable_orbit() -> None:
    with pytest.raises(AnalysisError, match="no stable orbit"):
        clearance.b_c_exact(G=1e-3, **{**RIG, "r": 1.0, "c1": 0.0})


def test_plastic_limit() -> None:
    """r = 0: one eigenvalue of the impact map vanishes; everything stays finite."""
    assert np.min(np.abs(multipliers(1.0, r=0.0))) < 1e-15
    assert manifold.A_1(0.0) == pytest.approx(2.0 / np.hypot(np.pi, 2.0))
    assert manifold.A_2(0.0) == pytest.approx(2.0 * np.hypot(2.0, np.pi) / (np.pi**2 - 4.0))
    assert np.isfinite(clearance.b_c_exact(G=1e-3, **{**RIG, "r": 0.0}))
    assert free_decay.decay_time(1.0, 0.6, lam=0.0, r=0.0) > 0.0


@pytest.mark.parametrize(
    ("eps", "zeta", "r"),
    combined([1e-5, 1e-4, 0.3], [0.0, 1e-12, 0.05], [0.0, 0.6, 0.99]),
)
def test_extreme_mass_ratios_and_no_damping(eps: float, zeta: float, r: float) -> None:
    p = Reduced.of(eps=eps, zeta=zeta, r=r)
    ends = boundaries.end_of_permanent_response(p)
    assert math.isfinite(ends.b_high)
    assert 0.0 < ends.b_low < ends.b_high
    point = orbits.family(ends.C_low, p)
    assert point.amplitude > 0.0


def test_no_damping_is_the_limit_of_little() -> None:
    b = [
        float(boundaries.stable_range(Reduced.of(eps=0.01, zeta=z, r=0.6)).b_high)
        for z in (0.0, 1e-15, 1e-9)
    ]
    assert b[1] == pytest.approx(b[0], rel=1e-12)
    assert b[2] == pytest.approx(b[0], rel=1e-6)
    C, b_sn = orbits.saddle_node(Reduced.of(eps=0.01, zeta=0.0, r=0.6))
    assert b_sn == np.inf, "an undamped resonance: the orbits never merge"
    assert np.isfinite(C)


def test_across_resonance_without_damping_nothing_jumps() -> None:
    Omega = 1.0 + np.array([-1e-9, -1e-13, 0.0, 1e-13, 1e-9])
    p = Reduced.of(eps=0.01, zeta=0.0, r=0.6, Omega=Omega)
    b = orbits.family(1.2, p).b
    np.testing.assert_allclose(b, b[2], rtol=1e-7)


def test_exactly_on_the_fold() -> None:
    for r in (0.0, 0.3, 0.6, 0.9, 1.0 - 1e-12):
        A_1 = float(manifold.A_1(r))
        at_fold = manifold.upper_branch(A_1, r=r)
        assert float(at_fold) == pytest.approx(float(manifold.C_1(r)), abs=1e-12)
    A_1 = float(manifold.A_1(0.6))
    assert free_decay.decay_time(A_1, A_1, lam=1.9, r=0.6) == 0.0


def test_forcing_exactly_f_c_and_at_the_saddle_node_of_the_slow_flow() -> None:
    lam, r = 1.91, 0.6
    points = slowflow.fixed_points(
        F=float(slowflow.threshold(lam=lam, r=r)), sigma=0.0, lam=lam, r=r
    )
    assert points
    assert not any(p.stable for p in points), "the fixed point has already left the stable branch"
    C = np.linspace(0.05, 0.97, 20001)
    F = slowflow.forcing(C, sigma=0.0, lam=lam, r=r)[0]
    i = int(F.argmin())
    below = slowflow.fixed_points(F=float(F[i]) * (1 - 1e-6), sigma=0.0, lam=lam, r=r)
    above = slowflow.fixed_points(F=float(F[i]) * (1 + 1e-6), sigma=0.0, lam=lam, r=r)
    assert (len(below), len(above)) == (0, 2)


def test_detuning_without_orbit_is_reported() -> None:
    """Far off resonance the oscillator hardly moves, and only a tiny clearance keeps an orbit."""
    p = Reduced.of_rig(**RIG, frequency=2.5 * 7.862)
    limit = float(orbits.saddle_node(p)[1])
    assert 1.0 < limit < 2.0, "of the order of the base motion itself"
    with pytest.raises(AnalysisError, match="no symmetric orbit with two impacts per cycle"):
        floquet.symmetric_orbits(G=0.25e-3, b=0.02, frequency=2.5 * 7.862, **RIG)
    assert 0.0 < float(boundaries.end_of_permanent_response(p).b_high) <= limit


def test_conservative_motion_is_not_called_stable_by_rounding() -> None:
    p = Reduced.of(eps=[0.01, 0.01, 0.3], zeta=[0.0, 0.001, 0.0], r=[1.0, 1.0, 1.0])
    ends = boundaries.stable_range(p)
    assert ends.exists.tolist() == [False, True, False]
    assert ends.kind.tolist()[0] == ""


def test_an_orbit_that_leaves_its_cavity_is_no_orbit() -> None:
    """Far below resonance the ball of an orbit that is stable on paper passes a wall on its way."""
    p = Reduced.of(eps=0.05, zeta=0.01, r=0.3, Omega=0.2)
    paper = orbits.family(orbits.amplitudes_at(1.57, p)[1], p)
    assert floquet.routh_stable(floquet.jacobian(paper))
    assert not floquet.stays_inside(paper)
    with pytest.raises(AnalysisError, match="no stable orbit"):
        clearance.b_c_exact(
            G=1e-3, M=1.0, c1=0.02, k1=1.0, m=0.05, r=0.3, frequency=0.2 / (2.0 * math.pi)
        )


def test_every_stretch_found_stays_in_its_cavity() -> None:
    rng = np.random.default_rng(20)
    n = 300
    p = Reduced.of(
        eps=10.0 ** rng.uniform(-4.0, -0.5, n),
        zeta=10.0 ** rng.uniform(-4.0, -1.0, n),
        r=rng.uniform(0.0, 1.0, n),
        Omega=rng.uniform(0.1, 1.5, n),
    )
    ends = boundaries.stable_range(p)
    there = ends.exists
    for share in (1e-6, 0.3, 0.6, 1.0 - 1e-6):
        C = ends.C_low[there] + share * (ends.C_high[there] - ends.C_low[there])
        assert floquet.stays_inside(orbits.family(C, p[there])).all()
    assert {"symmetry breaking", "graze"} <= set(ends.kind_low[there].tolist())


@pytest.mark.parametrize(
    ("rig", "message"),
    [
        ({"eps": 0.004, "zeta": 0.006, "r": 0.9, "Omega": 1.3}, "end by a neimark-sacker"),
        ({"eps": 0.00935, "zeta": 0.012, "r": 0.06, "Omega": 0.829}, "end by a graze"),
        ({"eps": 0.132, "zeta": 0.000448, "r": 0.15, "Omega": 0.973}, "breaks subcritically"),
    ],
)
def test_why_no_asymmetric_orbit_branches_off(rig: dict[str, float], message: str) -> None:
    p = Reduced.of(**rig)
    b = 0.99 * float(boundaries.stable_range(p).b_low)
    with pytest.raises(AnalysisError, match=message):
        sequences.asymmetric_orbit(b=b, p=p)


def test_one_impact_a_cycle_is_refused() -> None:
    with pytest.raises(ParameterError, match="expected two or more"):
        sequences.close_sequence(
            sides=(1,),
            flights=[6.28],
            state=[0, 0, 0, 0],
            b=100.0,
            p=Reduced.of(eps=0.01, zeta=0.01, r=0.6),
        )


def test_a_sequence_that_does_not_close_is_reported() -> None:
    with pytest.raises(AnalysisError, match="no orbit with the impact sequence"):
        sequences.close_sequence(
            sides=(1, 1, -1),
            flights=[1.0, 2.0, 3.0],
            state=[0.0, 1.0, 1.0, 1.0],
            b=1e4,
            p=Reduced.of(eps=0.01, zeta=0.01, r=0.6),
        )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"M": 0.0}, "mass M = 0: expected kg, above zero"),
        ({"M": math.nan}, "mass M = nan"),
        ({"k1": -1.0}, "stiffness k1 = -1"),
        ({"m": math.inf}, "ball mass m = inf"),
        ({"r": -0.1}, "restitution r = -0.1"),
        ({"c1": -1e-9}, "damping c1 = -1e-09"),
        ({"c1": 1e4}, "damping ratio zeta"),
    ],
)
def test_values_without_meaning(change: dict[str, float], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        clearance.b_c_exact(G=1e-3, **{**RIG, **change})


def test_arrays_are_refused_by_their_wrong_element() -> None:
    with pytest.raises(ParameterError, match=r"mass ratio eps = -0\.1"):
        clearance.b_c_published(G=1.0, eps=[0.1, -0.1, 0.2], lam=1.0, r=0.5)
    with pytest.raises(ParameterError, match="nan"):
        clearance.b_t_exact(x_m=[0.01, np.nan], r=0.6)
    assert clearance.b_t_exact(x_m=[], r=0.6).size == 0


def test_release_corners() -> None:
    undamped = Decaying(M=4.7, c1=0.0, k1=1.147e4, m=0.032, r=0.6, x_m=0.03)
    assert np.isfinite(captured_time(undamped, b=0.05, level=0.004))
    assert np.isfinite(best_clearance(undamped, level=0.01).time)
    released_below_the_fold = Decaying(**{**vars(undamped), "c1": 3.02, "x_m": 0.003})
    slow = captured_time(released_below_the_fold, b=0.05, level=0.001)
    bare = np.log(3.0) * 2 * 4.7 / 3.02
    assert 0.5 * bare < slow < bare
    with pytest.raises(AnalysisError, match="never loses energy"):
        captured_time(Decaying(**{**vars(undamped), "r": 1.0}), b=0.05, level=0.01)
    heavy = Decaying(M=1.0, c1=0.5, k1=100.0, m=0.3, r=0.6, x_m=0.03)
    with pytest.raises(AnalysisError, match="no slow decay; simulate"):
        captured_time(heavy, b=0.04, level=0.005)
    plastic = Decaying(**{**vars(undamped), "c1": 3.02, "r": 0.0})
    assert 0.0 < captured_time(plastic, b=0.05, level=0.004) < np.log(7.5) * 2 * 4.7 / 3.02
    nearly_elastic = Decaying(**{**vars(undamped), "r": 1.0 - 1e-9})
    with pytest.raises(AnalysisError, match="no slow decay"):
        captured_time(nearly_elastic, b=0.05, level=0.01)
