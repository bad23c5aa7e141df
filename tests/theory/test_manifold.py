"""The SIM: published digits, two derivations of T1 and T2, branches at and around the fold."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.theory.half_period import impact_map, impact_phase, multipliers

from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.theory import manifold

RESTITUTION = st.floats(0.0, 0.999)


@pytest.mark.parametrize(
    ("r", "published"),
    [
        (0.6, 0.15717673),
        (0.5, 0.20758413),
        (0.65, 0.13382585),
        (0.7, 0.11164234),
        (0.8, 0.07055923),
    ],
)
def test_fold_amplitude_matches_published_digits(r: float, published: float) -> None:
    assert manifold.A_1(r) == pytest.approx(published, abs=5e-9)


def test_symmetry_breaking_amplitude() -> None:
    assert manifold.A_2(0.6) == pytest.approx(0.73213987, abs=5e-9)
    assert manifold.A_2(1.0) == pytest.approx(4.0 / (np.pi**2 - 4.0), rel=1e-15)
    r = np.linspace(0.0, 1.0, 101)
    assert np.all(np.diff(manifold.A_2(r)) < 0.0), "A_2 rises as r falls"
    assert manifold.A_2(r).min() > 0.6, "the published 0.6 is never reached"


@settings(deadline=None, max_examples=60)
@given(RESTITUTION)
def test_t1_and_t2_are_eigenvalues_plus_and_minus_one(r: float) -> None:
    at_fold = multipliers(manifold.C_1(r), r=r)
    at_breaking = multipliers(manifold.C_2(), r=r)
    # the second eigenvalue is r^2 (determinant); near r = 1 the pair is almost double
    assert np.min(np.abs(at_fold - 1.0)) < 1e-6
    assert np.min(np.abs(at_breaking + 1.0)) < 1e-6
    assert manifold.amplitude(manifold.C_1(r), r=r) == pytest.approx(float(manifold.A_1(r)))
    assert manifold.amplitude(manifold.C_2(), r=r) == pytest.approx(float(manifold.A_2(r)))


@settings(deadline=None, max_examples=60)
@given(RESTITUTION, st.floats(0.05, 3.0))
def test_the_manifold_attracts_where_both_eigenvalues_are_inside_the_unit_circle(
    r: float, C: float
) -> None:
    largest = float(np.abs(multipliers(C, r=r)).max())
    if abs(largest - 1.0) > 1e-6:
        assert bool(manifold.is_stable(C, r=r)) == (largest < 1.0)


@settings(deadline=None, max_examples=60)
@given(RESTITUTION, st.floats(0.05, 3.0))
def test_impact_map_has_the_derived_trace_and_determinant(r: float, C: float) -> None:
    J = impact_map(C, r=r)
    phi = impact_phase(C, r=r)
    assert np.linalg.det(J) == pytest.approx(r * r, abs=1e-12)
    trace = 2.0 * r + 0.5 * np.pi * (1.0 - r * r) * np.tan(phi)
    assert np.trace(J) == pytest.approx(float(trace), rel=1e-9, abs=1e-9)


def _half_period(phase: float, u: float, A: float, r: float) -> tuple[float, float]:
    """Next (phase, speed), folded: the box map itself, solved by bisection."""
    place = A * np.sin(phase) - 1.0

    def gap(t: float) -> float:
        return A * np.sin(phase + t) - place - u * t + 1.0  # 0 at the wall on the other side

    low, high = 0.5, 6.0
    assert gap(low) > 0.0 > gap(high)
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if gap(middle) > 0.0 else (low, middle)
    after = (1.0 + r) * A * np.cos(phase + low) - r * u
    return phase + low - np.pi, -after


@pytest.mark.parametrize("C", [1.05, 1.3, 1.5, 1.9])
def test_impact_map_is_the_derivative_of_the_box_itself(C: float) -> None:
    r = 0.6
    A, phase = float(manifold.amplitude(C, r=r)), float(impact_phase(C, r=r))
    state = np.array([phase, 2.0 * C / np.pi])
    np.testing.assert_allclose(_half_period(*state, A, r), state, atol=1e-12)
    numeric = np.empty((2, 2))
    for j in range(2):
        step = 1e-5 * np.eye(2)[j]
        up, down = (_half_period(*(state + s * step), A, r) for s in (1, -1))
        numeric[:, j] = (np.array(up) - np.array(down)) / 2e-5
    np.testing.assert_allclose(impact_map(C, r=r), numeric, atol=1e-8)


@settings(deadline=None, max_examples=60)
@given(st.floats(0.0, 1.0), st.floats(1.0, 20.0))
def test_the_branch_lies_on_the_manifold(r: float, factor: float) -> None:
    A = max(float(manifold.A_1(r)), 1e-3) * factor
    C = manifold.upper_branch(A, r=r)
    assert manifold.amplitude(C, r=r) == pytest.approx(A, rel=1e-12)
    assert manifold.C_1(r) <= C


def test_stability_is_between_the_transitions() -> None:
    for r in (0.05, 0.3, 0.6, 0.95):
        C_1, C_2 = float(manifold.C_1(r)), float(manifold.C_2())
        C = np.array([C_1 - 1e-6, C_1 + 1e-6, C_2 - 1e-6, C_2 + 1e-6])
        assert manifold.is_stable(C, r=r).tolist() == [False, True, True, False]


def test_below_the_fold_is_refused_in_one_line() -> None:
    with pytest.raises(AnalysisError, match=r"below the fold A_1 = 0\.157177"):
        manifold.upper_branch(0.15, r=0.6)
    with pytest.raises(
        ParameterError, match=r"restitution r = 1\.2: expected a number from 0 to 1"
    ):
        manifold.A_1(1.2)
