"""b_c and b_t: published numbers, derivatives by two ways, intervals against Monte Carlo."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks import amplitude_damping
from hypothesis import example, given, settings
from hypothesis import strategies as st

from vinesexp.errors import ParameterError
from vinesexp.theory import intervals
from vinesexp.theory import optimal_clearance as clearance
from vinesexp.theory.intervals import predict_periodic, predict_transient
from vinesexp.units import Quantity

RIG = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "r": 0.6, "m": 0.032}
EPS = 0.032 / 4.7
LAM = 3.02 / (0.032 * (1.147e4 / 4.7) ** 0.5)


@pytest.mark.parametrize(
    ("G", "published", "exact"),
    [(0.15e-3, 20.381, 20.354), (0.20e-3, 27.174, 27.138), (0.25e-3, 33.968, 33.923)],
)
def test_periodic_numbers(G: float, published: float, exact: float) -> None:
    formula = clearance.b_c_published(G=G, eps=EPS, lam=LAM, r=0.6)
    assert 1e3 * formula == pytest.approx(published, abs=5e-4)
    assert 1e3 * clearance.b_c_exact(G=G, **RIG) == pytest.approx(exact, abs=5e-4)


def test_transient_numbers() -> None:
    assert 1e3 * clearance.b_t_published(x_m=0.030) == pytest.approx(50.0, abs=5e-3)
    assert 1e3 * clearance.b_t_exact(x_m=0.030, r=0.6) == pytest.approx(40.98, abs=5e-3)
    assert 1e3 * clearance.b_t_published(x_m=0.020) == pytest.approx(33.3, abs=5e-2)
    assert 1e3 * clearance.b_t_exact(x_m=0.020, r=0.6) == pytest.approx(27.3, abs=5e-2)
    w0 = (1.147e4 / 4.7) ** 0.5
    x_m = clearance.release_amplitude(x0=0.003, v0=0.004 * w0, M=4.7, k1=1.147e4)
    assert x_m == pytest.approx(0.005)


@pytest.mark.long
@settings(deadline=None, max_examples=6)
@example(eps=0.00390625, zeta=0.0, r=0.375, tuning=1.003)
@given(
    st.floats(1e-3, 0.2),
    st.one_of(st.just(0.0), st.floats(1e-4, 0.04)),
    st.floats(0.3, 0.95),
    st.sampled_from([None, 1.003]),
)
def test_derivatives_agree_with_differences_of_whole_solutions(
    eps: float, zeta: float, r: float, tuning: float | None
) -> None:
    k1, M = 1.147e4, 4.7
    rig = {"M": M, "c1": 2 * zeta * (k1 * M) ** 0.5, "k1": k1, "r": r, "m": eps * M}
    frequency = None if tuning is None else tuning * (k1 / M) ** 0.5 / (2 * np.pi)

    def exact(**values: float) -> float:
        return float(clearance.b_c_exact(G=1e-3, frequency=frequency, **values))

    value, slopes = intervals.gradient_exact(G=1e-3, frequency=frequency, **rig)
    assert value == pytest.approx(exact(**rig))
    for name in rig:
        if rig[name] == 0.0:
            continue
        # Extrapolated to no step: near resonance without damping k1 moves the detuning so much
        # that a plain central difference is off by a few 1e-4.
        coarse, fine = (_difference(exact, rig, name, h * rig[name]) for h in (1e-4, 5e-5))
        difference = (4.0 * fine - coarse) / 3.0
        assert slopes[name] == pytest.approx(difference, rel=1e-4, abs=1e-6 * value / rig[name])


def _difference(b, rig: dict[str, float], name: str, h: float) -> float:
    up, down = {**rig, name: rig[name] + h}, {**rig, name: rig[name] - h}
    return (b(**up) - b(**down)) / (2 * h)


def test_a_derivative_beside_resonance_is_that_of_small_differences() -> None:
    rig = {"M": 1.0, "c1": 0.0038, "k1": 1.0, "r": 0.86, "m": 0.0133}
    frequency = 0.9768 / (2.0 * np.pi)

    def moved(share: float) -> float:
        k1 = 1.0 + share
        return float(clearance.b_c_exact(G=1.0, frequency=frequency, **{**rig, "k1": k1}))

    h = 1e-6
    ends = (moved(-2 * h), moved(-h), moved(h), moved(2 * h))
    small = (ends[0] - 8.0 * ends[1] + 8.0 * ends[2] - ends[3]) / (12.0 * h)
    _, slopes = intervals.gradient_exact(G=1.0, frequency=frequency, **rig)
    assert slopes["k1"] == pytest.approx(small, rel=1e-5)


def test_far_below_resonance_derivatives_add_up() -> None:
    """Between two impacts the oscillator turns 39 times: a step must not change how often."""
    _, slopes = intervals.gradient_exact(G=1e-3, frequency=0.1, **RIG)
    assert np.isfinite(list(slopes.values())).all()
    # b_c is of eps, zeta, r and Omega alone: all that are of M, c1, k1, m stay where these grow
    total = sum(slopes[name] * RIG[name] for name in ("M", "c1", "k1", "m"))
    assert total == pytest.approx(0.0, abs=1e-5 * max(abs(slopes[n] * RIG[n]) for n in RIG))


def test_an_elastic_ball_on_a_hardly_damped_mass_has_derivatives() -> None:
    _, slopes = intervals.gradient_exact(G=1e-3, **{**RIG, "r": 1.0, "c1": 3e-3})
    assert np.isfinite(list(slopes.values())).all()


def test_derivative_by_damping_without_damping() -> None:
    for tuning in (None, 7.9):
        rig = {**RIG, "c1": 0.0}
        _, slopes = intervals.gradient_exact(G=1e-3, frequency=tuning, **rig)
        h = 1e-3
        ends = [
            float(clearance.b_c_exact(G=1e-3, frequency=tuning, **{**rig, "c1": c}))
            for c in (0.0, h)
        ]
        assert slopes["c1"] == pytest.approx((ends[1] - ends[0]) / h, rel=1e-2)


@pytest.mark.long
def test_interval_agrees_with_monte_carlo() -> None:
    errors = {"M": 0.03, "c1": 0.08, "k1": 60.0, "r": 0.01, "m": 2e-4}
    values = {name: Quantity(RIG[name], errors[name]) for name in RIG}
    predicted = predict_periodic(G=0.25e-3, values=values)
    rng = np.random.default_rng(4)
    draws = {name: rng.normal(RIG[name], errors[name], 1500) for name in RIG}
    b = clearance.b_c_exact(G=0.25e-3, **draws)
    # standard error of a standard deviation from 1500 draws: 1.8 %; four of them
    assert b.std() == pytest.approx(predicted.std_error, rel=0.075)
    inside = np.mean((b > predicted.low) & (b < predicted.high))
    assert inside == pytest.approx(0.95, abs=4 * (0.95 * 0.05 / 1500) ** 0.5)


def test_transient_interval_and_velocity() -> None:
    values = {name: Quantity(value, 0.01 * value) for name, value in RIG.items()}
    predicted = predict_transient(x0=0.02, v0=0.6, values=values)
    rng = np.random.default_rng(5)
    draws = {name: rng.normal(value, 0.01 * value, 20000) for name, value in RIG.items()}
    x_m = clearance.release_amplitude(x0=0.02, v0=0.6, M=draws["M"], k1=draws["k1"])
    b = clearance.b_t_exact(x_m=x_m, r=draws["r"])
    assert b.std() == pytest.approx(predicted.std_error, rel=0.03)
    assert predicted.published == pytest.approx(float(x_m.mean()) / 0.6, rel=1e-3)


def test_an_interval_never_goes_below_zero() -> None:
    values = {name: Quantity(value, value) for name, value in RIG.items()}
    predicted = predict_periodic(G=0.25e-3, values={**values, "r": Quantity(0.6, 0.1)})
    assert predicted.low == 0.0 < predicted.high


def test_refusals() -> None:
    values = {name: Quantity(value) for name, value in RIG.items()}
    with pytest.raises(ParameterError, match="rig values missing: c1, m"):
        predict_periodic(G=1e-3, values={n: values[n] for n in ("M", "k1", "r")})
    with pytest.raises(ParameterError, match="unknown rig value 'k2'; known: M, c1, k1, r, m"):
        predict_periodic(G=1e-3, values={**values, "k2": Quantity(1.0)})


@pytest.mark.long
def test_amplitude_dependent_damping_solves_both_at_once() -> None:
    rig = {name: RIG[name] for name in ("M", "k1", "m", "r")}

    def c1_at(x: float) -> float:
        return 3.02 * (1.0 + 60.0 * x)

    for solve in (amplitude_damping.b_c_published_damped, amplitude_damping.b_c_exact_damped):
        found = solve(G=0.15e-3, c1_at=c1_at, **rig)
        assert found.c1 == pytest.approx(c1_at(found.amplitude))
        if solve is amplitude_damping.b_c_exact_damped:
            again = clearance.b_c_exact(G=0.15e-3, c1=found.c1, **rig)
        else:
            lam = found.c1 / (0.032 * (1.147e4 / 4.7) ** 0.5)
            again = clearance.b_c_published(G=0.15e-3, eps=EPS, lam=lam, r=0.6)
        assert found.b_c == pytest.approx(float(again), rel=1e-9)
        assert found.b_c < 20.38e-3  # more damping, smaller clearance
