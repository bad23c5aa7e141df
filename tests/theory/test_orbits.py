"""Exact orbits: theory.md's table, the motion itself in many digits, boundaries by two ways."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from benchmarks import sequences, slow_flow
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.theory import boundaries, floquet, manifold, orbits, slowflow
from vinesexp.theory.orbits import Reduced

RIG = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "m": 0.032, "r": 0.6}
TABLE_2 = Reduced.of_rig(**RIG)


@pytest.mark.parametrize(
    ("G", "neimark_sacker", "saddle_node"),
    [(0.15, 20.354, 22.877), (0.20, 27.138, 30.503), (0.25, 33.923, 38.129)],
)
def test_boundaries_of_the_published_rig(
    G: float, neimark_sacker: float, saddle_node: float
) -> None:
    ends = boundaries.stable_range(TABLE_2)
    assert G * ends.b_high == pytest.approx(neimark_sacker, abs=5e-4)
    assert str(ends.kind) == "neimark-sacker"
    assert G * orbits.saddle_node(TABLE_2)[1] == pytest.approx(saddle_node, abs=5e-4)


@pytest.mark.parametrize(
    ("b", "amplitude", "stable"),
    [
        (20, 10.082, True),
        (25, 7.825, True),
        (30, 5.695, True),
        (32, 5.191, True),
        (33, 5.128, True),
        (34, 5.251, False),
    ],
)
def test_amplitudes_of_the_published_rig(b: float, amplitude: float, stable: bool) -> None:
    orbit = floquet.symmetric_orbits(G=0.25e-3, b=1e-3 * b, **RIG)[0]
    assert 1e3 * orbit.amplitude == pytest.approx(amplitude, abs=5e-4)
    assert orbit.stable is stable
    assert orbit.admissible


def _closes(orbit: orbits.Family, digits: int = 40) -> float:
    """How well the orbit closes, by mpmath's matrix exponential: an independent flow."""
    with mp.workdps(digits):
        zeta, Omega = mp.mpf(float(orbit.p.zeta)), mp.mpf(float(orbit.p.Omega))
        eps, r = mp.mpf(float(orbit.p.eps)), mp.mpf(float(orbit.p.r))
        base = complex(orbit.phase)
        # state (x, v, sin, cos) of the base: a linear system without time
        flow = mp.matrix(4, 4)
        flow[0, 1], flow[1, 0], flow[1, 1] = 1, -1, -2 * zeta
        flow[1, 2], flow[1, 3] = 1, 2 * zeta * Omega
        flow[2, 3], flow[3, 2] = Omega, -Omega
        start = mp.matrix([float(orbit.x), float(orbit.v_after), base.imag, base.real])
        end = mp.expm(flow * (mp.pi / Omega)) * start
        x, v, u, b = end[0], end[1], mp.mpf(float(orbit.u)), mp.mpf(float(orbit.b))
        y = mp.mpf(float(orbit.x)) - b + u * mp.pi / Omega
        jump = (1 + r) / (1 + eps) * (v - u)
        errors = [
            x - y + b,
            x + float(orbit.x),
            v - eps * jump + float(orbit.v_after),
            u + jump + u,
        ]
        return float(max(abs(e) for e in errors) / b)


@settings(deadline=None, max_examples=30)
@given(
    st.floats(1e-4, 0.3),
    st.one_of(st.just(0.0), st.floats(1e-6, 0.3)),
    st.floats(0.0, 1.0),
    st.one_of(st.just(1.0), st.floats(0.7, 1.4)),
    st.floats(0.3, 2.0),
)
def test_the_orbit_closes_in_the_full_system(
    eps: float, zeta: float, r: float, Omega: float, C: float
) -> None:
    orbit = orbits.family(C, Reduced.of(eps=eps, zeta=zeta, r=r, Omega=Omega))
    # rounding of float64 times the size of the bare response, which is what nearly cancels
    assert _closes(orbit) < 2e-13 * (1.0 + 1.0 / float(orbit.b))


@settings(deadline=None, max_examples=40)
@given(st.floats(1e-4, 0.3), st.floats(0.0, 0.2), st.floats(0.0, 1.0), st.floats(0.3, 2.0))
def test_determinant_of_the_map(eps: float, zeta: float, r: float, C: float) -> None:
    p = Reduced.of(eps=eps, zeta=zeta, r=r, Omega=1.03)
    J = floquet.jacobian(orbits.family(C, p))
    expected = r * r * np.exp(-2.0 * zeta * np.pi / 1.03)
    size = np.abs(J).max() ** 4
    assert abs(np.linalg.det(J) - expected) < 1e-13 * max(size, 1.0)


def test_jacobian_is_the_derivative_of_the_flight() -> None:
    b, p = 25.0 / 0.25, TABLE_2
    C = orbits.amplitudes_at(b, p)[1]
    point = orbits.family(C, p)
    z = np.array(
        [float(np.angle(point.phase)), float(point.x), float(point.v_after), float(point.u)]
    )

    def half(state: np.ndarray) -> np.ndarray:
        """The map by its definition: fly to the other wall, meet it, change the signs."""
        low, high = 2.0, 4.0

        def gap(tau: float) -> float:
            return sequences._step(state, tau, 1, -1, b, p)[1]

        for _ in range(100):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if gap(middle) * gap(low) > 0.0 else (low, middle)
        after = sequences._step(state, low, 1, -1, b, p)[0]
        return np.array([after[0] / float(p.Omega) - np.pi, *(-after[1:])])

    numeric = np.empty((4, 4))
    for j in range(4):
        h = 1e-5 * (1.0 if j == 0 else b)
        up, down = half(z + h * np.eye(4)[j]), half(z - h * np.eye(4)[j])
        numeric[:, j] = (up - down) / (2.0 * h)
    analytic = floquet.jacobian(point)
    np.testing.assert_allclose(analytic, numeric, rtol=1e-6, atol=1e-6)


def test_boundaries_by_eigenvalue() -> None:
    ends = boundaries.stable_range(TABLE_2)
    at_ns = np.linalg.eigvals(floquet.jacobian(orbits.family(ends.C_low, TABLE_2)))
    pair = at_ns[np.argsort(-np.abs(at_ns))][:2]
    np.testing.assert_allclose(np.abs(pair), 1.0, atol=1e-10)
    assert np.abs(pair.imag).min() > 1e-3
    at_pf = np.linalg.eigvals(floquet.jacobian(orbits.family(ends.C_high, TABLE_2)))
    assert np.min(np.abs(at_pf + 1.0)) < 1e-10
    at_sn = np.linalg.eigvals(
        floquet.jacobian(orbits.family(orbits.saddle_node(TABLE_2)[0], TABLE_2))
    )
    assert np.min(np.abs(at_sn - 1.0)) < 1e-6  # the geometric fold is the eigenvalue +1


def test_small_mass_limit_is_the_fixed_point_on_the_fold_not_f_c() -> None:
    r, lam = 0.6, 1.91
    eps = np.array([1e-2, 1e-3, 1e-4])
    ends = boundaries.stable_range(Reduced.of(eps=eps, zeta=0.5 * eps * lam, r=r))
    to_fold = ends.b_high * eps * float(slow_flow.fold_forcing(lam=lam, r=r))
    to_F_c = ends.b_high * eps * float(slowflow.threshold(lam=lam, r=r))
    error = np.abs(to_fold - 1.0)
    assert error[2] < 1e-4
    assert error[1] / error[0] == pytest.approx(0.1, rel=0.1)  # first order in eps
    assert abs(to_F_c[2] - 1.0) > 0.005  # (36) keeps its offset
    assert ends.C_high[2] == pytest.approx(float(manifold.C_2()), rel=1e-3)


def test_detuned_small_mass_limit() -> None:
    r, lam, eps, sigma = 0.6, 1.91, 1e-4, 1.5
    p = Reduced.of(eps=eps, zeta=0.5 * eps * lam, r=r, Omega=1.0 + eps * sigma)
    b = float(boundaries.stable_range(p).b_high) * eps
    assert b * float(slow_flow.fold_forcing(lam=lam, r=r, sigma=sigma)) == pytest.approx(
        1.0, abs=2e-3
    )


def test_both_orbits_come_back_from_their_clearance() -> None:
    C_sn, b_sn = orbits.saddle_node(TABLE_2)
    for C in (0.3, 0.6, 1.2, 1.6):
        b = float(orbits.family(C, TABLE_2).b)
        pair = orbits.amplitudes_at(b, TABLE_2)
        assert np.nanmin(np.abs(np.array(pair) - C)) < 1e-12
    assert np.isnan(orbits.amplitudes_at(float(b_sn) * 1.001, TABLE_2)).all()
    merged = orbits.amplitudes_at(float(b_sn) * (1.0 - 1e-12), TABLE_2)
    np.testing.assert_allclose(merged, float(C_sn), rtol=1e-5)


def test_no_orbit_is_reported_with_the_limit() -> None:
    with pytest.raises(AnalysisError, match=r"they end at b = 38\.1287 mm"):
        floquet.symmetric_orbits(G=0.25e-3, b=0.04, **RIG)
    with pytest.raises(ParameterError, match="base amplitude G"):
        floquet.symmetric_orbits(G=0.0, b=0.03, **RIG)


def test_asymmetric_orbit_branches_off_at_symmetry_breaking() -> None:
    breaking = float(boundaries.stable_range(TABLE_2).b_low)
    near = sequences.asymmetric_orbit(b=breaking * (1.0 - 2e-3), p=TABLE_2)
    far = sequences.asymmetric_orbit(b=breaking * (1.0 - 8e-3), p=TABLE_2)
    assert near.stable
    assert far.asymmetry / near.asymmetry == pytest.approx(2.0, rel=0.05)  # square-root branch
    with pytest.raises(AnalysisError, match="have not lost their symmetry"):
        sequences.asymmetric_orbit(b=breaking * 1.01, p=TABLE_2)


def test_asymmetric_orbits_of_random_rigs_are_found_or_there_are_none() -> None:
    """A refusal is real: symmetry breaks subcritically there, and no orbit lies below."""
    rng, n = np.random.default_rng(11), 12
    p = Reduced.of(
        eps=10.0 ** rng.uniform(-4.0, -1.0, n),
        zeta=10.0 ** rng.uniform(-4.0, -1.3, n),
        r=rng.uniform(0.2, 0.95, n),
        Omega=rng.uniform(0.95, 1.05, n),
    )
    ends = boundaries.stable_range(p)
    found, refused = [], []
    for k in np.flatnonzero(ends.exists):
        try:
            found.append(sequences.asymmetric_orbit(b=0.99 * float(ends.b_low[k]), p=p[k]))
        except AnalysisError as error:
            refused.append(str(error))
    assert all(orbit.stable and orbit.asymmetry > 0.03 for orbit in found)
    assert all("subcritically" in text for text in refused)
    assert len(found) >= 9


def test_a_symmetric_sequence_has_the_squared_multipliers() -> None:
    C = orbits.amplitudes_at(100.0, TABLE_2)[1]
    point = orbits.family(C, TABLE_2)
    orbit = sequences.close_sequence(
        sides=(1, -1),
        flights=[3.1, 3.2],
        state=[
            float(np.angle(point.phase)) + 0.01,
            float(point.x),
            float(point.v_after),
            float(point.u),
        ],
        b=100.0,
        p=TABLE_2,
    )
    np.testing.assert_allclose(orbit.flights, np.pi, rtol=1e-10)
    half = np.linalg.eigvals(floquet.jacobian(point))
    np.testing.assert_allclose(
        np.sort(np.abs(orbit.multipliers)), np.sort(np.abs(half) ** 2), rtol=1e-8
    )
