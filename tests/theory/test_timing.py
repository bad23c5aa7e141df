"""Derivatives and intervals of the time to a level and of b*(level)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from benchmarks import free_decay

from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.theory import manifold
from vinesexp.theory.timing import (
    RELEASE_VALUES,
    gradient_best,
    gradient_time,
    predict_best,
    predict_time,
)
from vinesexp.theory.transient import Decaying, best_clearance, captured_time
from vinesexp.units import Quantity

TABLE_1 = Decaying(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6, x_m=0.030)
RIG = {
    "M": Quantity(4.7, 0.05),
    "c1": Quantity(3.02, 0.1),
    "k1": Quantity(1.147e4, 120.0),
    "r": Quantity(0.6, 0.01),
    "m": Quantity(0.032, 1e-5),
}


def closed_form(case: Decaying, b: float, level: float) -> float:
    eps, lam = case.m / case.M, case.c1 / (case.m * case.w0)
    tau1 = free_decay.decay_time(case.x_m / b, level / b, lam=lam, r=case.r)
    return float(tau1) / (eps * case.w0)


def moved(case: Decaying, name: str, share: float) -> Decaying:
    return replace(case, **{name: getattr(case, name) * (1.0 + share)})


@pytest.mark.parametrize("name", RELEASE_VALUES)
def test_on_the_branch_the_derivatives_are_those_of_the_closed_form(name: str) -> None:
    time, slopes = gradient_time(TABLE_1, b=0.05, level=0.015)
    h = 1e-4
    ends = [closed_form(moved(TABLE_1, name, d), 0.05, 0.015) for d in (h, -h)]
    plain = (ends[0] - ends[1]) / (2.0 * h * getattr(TABLE_1, name))
    assert slopes[name] == pytest.approx(plain, rel=2e-3, abs=2e-4 * time / getattr(TABLE_1, name))


@pytest.mark.parametrize("name", RELEASE_VALUES)
@pytest.mark.parametrize(("b", "level"), [(0.05, 0.005), (0.02, 0.005)])
def test_below_t1_plain_central_differences_agree(b: float, level: float, name: str) -> None:
    """Steps of 3 %: the mean over flown balls wavers by 1 to 2 % of the time per unit share."""
    time, slopes = gradient_time(TABLE_1, b=b, level=level)
    h = 0.03
    ends = [float(captured_time(moved(TABLE_1, name, d), b=b, level=level)) for d in (h, -h)]
    plain = (ends[0] - ends[1]) / (2.0 * h)
    assert slopes[name] * getattr(TABLE_1, name) == pytest.approx(plain, abs=0.1 * time)


@pytest.mark.parametrize("level", [0.005, 0.003])
def test_at_the_elbow_b_star_moves_with_letting_go(level: float) -> None:
    best, slopes, kind = gradient_best(TABLE_1, level=level)
    assert kind == "let go"
    assert slopes["x_m"] == 0.0
    h = 0.06
    for name in RELEASE_VALUES:
        ends = [best_clearance(moved(TABLE_1, name, d), level=level).b for d in (h, -h)]
        plain = (ends[0] - ends[1]) / (2.0 * h) / best.b
        own = slopes[name] * getattr(TABLE_1, name) / best.b
        assert own == pytest.approx(plain, abs=0.08), name


def test_near_the_release_b_star_is_where_capture_ends() -> None:
    best, slopes, kind = gradient_best(TABLE_1, level=0.025)
    assert kind == "start at T1"
    assert best.b == pytest.approx(0.03 / float(manifold.A_1(0.6)), rel=2e-3)
    assert slopes["x_m"] == pytest.approx(best.b / 0.03)
    h = 0.01
    ends = [0.03 / float(manifold.A_1(0.6 + d)) for d in (h, -h)]
    assert slopes["r"] == pytest.approx((ends[0] - ends[1]) / (2.0 * h), rel=5e-3)


def test_interval_of_a_time_is_the_delta_method() -> None:
    x_m = Quantity(0.03, 2e-4)
    t = predict_time(x_m=x_m, b=0.05, level=0.015, values=RIG)
    errors = {name: q.std_error for name, q in RIG.items()} | {"x_m": 2e-4}
    assert t.std_error == pytest.approx(
        np.sqrt(sum((t.gradient[name] * e) ** 2 for name, e in errors.items()))
    )
    assert t.scatter == 0.0
    assert t.high - t.exact == pytest.approx(1.96 * t.std_error, rel=1e-4)
    # M, k1, c1 that go together (a scale of mass) leave the clock alone: the time depends on m/M
    share = 0.01
    V = np.zeros((5, 5))
    scale = share * np.array([4.7, 3.02, 1.147e4])
    V[:3, :3] = np.outer(scale, scale)
    together = predict_time(x_m=Quantity(0.03), b=0.05, level=0.015, values=RIG, covariance=V)
    h = 1e-3
    both = [
        closed_form(moved(moved(moved(TABLE_1, "M", d), "c1", d), "k1", d), 0.05, 0.015)
        for d in (h, -h)
    ]
    assert together.std_error == pytest.approx(share * (both[0] - both[1]) / (2 * h), rel=5e-3)


def test_below_t1_the_interval_has_the_scatter_over_starts() -> None:
    t = predict_time(x_m=Quantity(0.03), b=0.05, level=0.004, values=RIG)
    assert 0.02 < t.scatter < 0.4
    assert t.low < 3.40 < t.high, "simulated median over captured starts"
    best = predict_best(x_m=Quantity(0.03), level=0.005, values=RIG)
    assert best.low < 0.045 < best.high, "simulation: near 45 mm"
    assert best.scatter > 0.0


def test_bad_input_is_reported() -> None:
    with pytest.raises(ParameterError, match="rig values missing: m"):
        predict_time(
            x_m=Quantity(0.03),
            b=0.05,
            level=0.01,
            values={name: q for name, q in RIG.items() if name != "m"},
        )
    with pytest.raises(AnalysisError, match="r = 1"):
        gradient_time(replace(TABLE_1, r=1.0), b=0.05, level=0.015)
    with pytest.raises(AnalysisError, match="above the release"):
        gradient_best(TABLE_1, level=0.04)


def test_without_damping_the_derivatives_are_finite() -> None:
    _, slopes = gradient_time(replace(TABLE_1, c1=0.0), b=0.05, level=0.015)
    assert all(np.isfinite(slope) for slope in slopes.values())
    h = 1e-3
    ends = [closed_form(replace(TABLE_1, c1=c), 0.05, 0.015) for c in (0.0, h)]
    assert slopes["c1"] == pytest.approx((ends[1] - ends[0]) / h, rel=0.01)
