"""The slow flow: fixed points by two ways, their stability against integration, F_c, free decay."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks import free_decay, slow_flow
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.theory import manifold, slowflow

LAM = 3.02 / (0.032 * (1.147e4 / 4.7) ** 0.5)
EPS = 0.032 / 4.7
W0 = (1.147e4 / 4.7) ** 0.5


def test_threshold_agrees_with_the_force_needed_at_the_fold() -> None:
    r = np.linspace(0.0, 0.99, 50)
    Gamma = (1.0 - r) / (1.0 + r)
    A_1, C_1 = manifold.A_1(r), manifold.C_1(r)
    at_fold = LAM * A_1 + 16.0 * Gamma * C_1**2 / (np.pi**3 * A_1)
    np.testing.assert_allclose(slowflow.threshold(lam=LAM, r=r), at_fold, rtol=1e-13)


@settings(deadline=None, max_examples=80)
@given(st.floats(0.05, 3.0), st.floats(-5.0, 5.0), st.floats(0.0, 10.0), st.floats(0.0, 0.98))
def test_parametric_form_is_at_rest_in_the_flow(
    C: float, sigma: float, lam: float, r: float
) -> None:
    F, rho = slowflow.forcing(C, sigma=sigma, lam=lam, r=r)
    A = float(manifold.amplitude(C, r=r))
    if A < 1e-3:
        return
    dA, drho = slow_flow.rates(C, rho, F=F, sigma=sigma, lam=lam, r=r)
    size = float(F) + abs(sigma) + 1.0 / A**2
    assert abs(dA) < 1e-12 * size
    assert abs(drho) < 1e-12 * size / A


@pytest.mark.long
@settings(deadline=None, max_examples=80)
@given(st.floats(0.1, 2.5), st.floats(-3.0, 3.0), st.floats(0.0, 5.0), st.floats(0.1, 0.95))
def test_every_fixed_point_is_found(C: float, sigma: float, lam: float, r: float) -> None:
    F = float(slowflow.forcing(C, sigma=sigma, lam=lam, r=r)[0])
    found = [p.C for p in slowflow.fixed_points(F=F, sigma=sigma, lam=lam, r=r)]
    # a double root is only as good as the square root of rounding
    assert min(abs(c - C) for c in found) < 1e-5


@pytest.mark.parametrize(("C", "rho"), [(1.1, 0.3), (1.4, 2.0), (0.6, -1.0)])
def test_the_rate_of_the_paper_lacks_a_factor_pi(C: float, rho: float) -> None:
    """(24) prints dC/dtau1 = f1/g; with (25) and (27) it is f1/(pi g)."""
    F, r = 1.6, 0.6
    Gamma, A = (1.0 - r) / (1.0 + r), float(manifold.amplitude(C, r=r))
    dA, _ = slow_flow.rates(C, rho, F=F, sigma=0.7, lam=LAM, r=r)
    to_impact = rho - 0.5 * np.pi + np.arctan2(1.0 - C, 2.0 * Gamma * C / np.pi)
    f1 = (
        F * np.pi**3 * (1.0 - C) * np.sin(to_impact)
        + 2.0 * F * C * Gamma * np.pi**2 * np.cos(to_impact)
        - 4.0 * Gamma**2 * np.pi * C**2 * LAM
        - 16.0 * C**2 * Gamma
        - np.pi**3 * LAM * (C - 1.0) ** 2
    )
    g = 8.0 * Gamma**2 * C + 2.0 * np.pi**2 * C - 2.0 * np.pi**2
    rate_of_C = A * dA / (C / float(manifold.C_1(r)) - 1.0)
    assert rate_of_C == pytest.approx(f1 / (np.pi * g), rel=1e-12)


def test_flow_jacobian_is_the_derivative_of_the_flow() -> None:
    F, sigma, r = 1.6, 0.7, 0.6
    point = next(p for p in slowflow.fixed_points(F=F, sigma=sigma, lam=LAM, r=r) if p.stable)
    h = 1e-6
    numeric = np.empty((2, 2))
    for j, (dA, drho) in enumerate([(h, 0.0), (0.0, h)]):
        ends = [
            np.array(
                slow_flow.rates(
                    manifold.upper_branch(point.A + s * dA, r=r),
                    point.rho + s * drho,
                    F=F,
                    sigma=sigma,
                    lam=LAM,
                    r=r,
                )
            )
            for s in (1, -1)
        ]
        numeric[:, j] = (ends[0] - ends[1]) / (2.0 * h)
    analytic = slowflow.flow_jacobian(point.C, point.rho, F=F, lam=LAM, r=r)
    np.testing.assert_allclose(analytic, numeric, rtol=1e-7, atol=1e-8)


def test_a_stable_fixed_point_attracts_the_integrated_flow() -> None:
    F, r = 1.6, 0.6
    point = next(p for p in slowflow.fixed_points(F=F, sigma=0.0, lam=LAM, r=r) if p.stable)

    def slope(_: float, state: np.ndarray) -> np.ndarray:
        C = manifold.upper_branch(state[0], r=r)
        return np.array(slow_flow.rates(C, state[1], F=F, sigma=0.0, lam=LAM, r=r))

    start = [point.A * 1.2, point.rho + 0.3]
    found = solve_ivp(slope, (0.0, 40.0), start, "LSODA", rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.y[:, -1], [point.A, point.rho], atol=1e-9)


def test_fold_forcing_is_the_parametric_form_at_the_fold() -> None:
    for sigma in (-2.0, 0.0, 0.5, 3.0):
        F = slowflow.forcing(manifold.C_1(0.6), sigma=sigma, lam=LAM, r=0.6)[0]
        assert slow_flow.fold_forcing(lam=LAM, r=0.6, sigma=sigma) == pytest.approx(float(F))
        assert slowflow.threshold(lam=LAM, r=0.6) <= F


def test_exactly_at_the_threshold_and_at_the_fold_there_are_answers() -> None:
    F_c = float(slowflow.threshold(lam=LAM, r=0.6))
    assert slowflow.fixed_points(F=F_c, sigma=0.0, lam=LAM, r=0.6)
    F_fold = float(slow_flow.fold_forcing(lam=LAM, r=0.6))
    nearest = min(
        abs(p.C - float(manifold.C_1(0.6)))
        for p in slowflow.fixed_points(F=F_fold, sigma=0.0, lam=LAM, r=0.6)
    )
    assert nearest < 1e-7
    assert slowflow.fixed_points(F=0.0, sigma=0.0, lam=LAM, r=0.6) == []


def test_decay_time_of_the_published_rig() -> None:
    tau1 = free_decay.decay_time(30.0 / 50.0, 15.0 / 50.0, lam=LAM, r=0.6)
    assert tau1 / (EPS * W0) == pytest.approx(1.264, abs=5e-4)


@settings(deadline=None, max_examples=40)
@given(st.floats(0.05, 0.95), st.floats(0.0, 8.0), st.floats(1.0, 8.0), st.floats(1.05, 5.0))
def test_closed_form_decay_is_the_quadrature(
    r: float, lam: float, low: float, ratio: float
) -> None:
    end = float(manifold.A_1(r)) * low
    start = end * ratio
    C = np.linspace(*(float(manifold.upper_branch(A, r=r)) for A in (end, start)), 4001)
    Gamma = (1.0 - r) / (1.0 + r)
    A2 = manifold.amplitude(C, r=r) ** 2
    f = (C / manifold.C_1(r) - 1.0) / (0.5 * lam * A2 + 8.0 * Gamma * C**2 / np.pi**3)
    h = C[1] - C[0]
    simpson = h / 3.0 * (f[0] + f[-1] + 4.0 * f[1:-1:2].sum() + 2.0 * f[2:-1:2].sum())
    assert free_decay.decay_time(start, end, lam=lam, r=r) == pytest.approx(simpson, rel=1e-9)


def test_decay_refusals() -> None:
    with pytest.raises(AnalysisError, match="below the fold"):
        free_decay.decay_time(0.5, 0.1, lam=LAM, r=0.6)
    with pytest.raises(AnalysisError, match="below the one to be reached"):
        free_decay.decay_time(0.3, 0.5, lam=LAM, r=0.6)
    with pytest.raises(AnalysisError, match="never loses energy"):
        free_decay.decay_time(0.5, 0.3, lam=0.0, r=1.0)
    with pytest.raises(ParameterError, match="lambda"):
        free_decay.decay_time(0.5, 0.3, lam=-1.0, r=0.6)


@pytest.mark.parametrize(
    ("lam", "r", "sigma", "kind"),
    [(1.9, 0.6, 0.0, "fold"), (1.9, 0.6, -5.0, "saddle-node"), (20.0, 0.6, 0.0, "fold")],
)
def test_end_of_permanent_response_is_the_limit_of_the_exact_one(
    lam: float, r: float, sigma: float, kind: str
) -> None:
    from vinesexp.theory.boundaries import stable_range
    from vinesexp.theory.orbits import Reduced

    end = slow_flow.slow_end(lam=lam, r=r, sigma=sigma)
    assert end.kind == kind
    errors = []
    for eps in (1e-3, 1e-4):
        p = Reduced.of(eps=eps, zeta=0.5 * eps * lam, r=r, Omega=1.0 + eps * sigma)
        errors.append(abs(float(stable_range(p).b_high) * eps * end.F - 1.0))
    assert errors[1] < 5e-4
    assert errors[1] < 0.2 * errors[0]


def test_no_stable_fixed_point_below_resonance_without_damping() -> None:
    from vinesexp.theory.boundaries import stable_range
    from vinesexp.theory.orbits import Reduced

    with pytest.raises(AnalysisError, match="no stable fixed point at any forcing"):
        slow_flow.slow_end(lam=0.0, r=0.45, sigma=-0.5)
    assert not stable_range(Reduced.of(eps=1e-3, zeta=0.0, r=0.45, Omega=1.0 - 0.5e-3)).exists
