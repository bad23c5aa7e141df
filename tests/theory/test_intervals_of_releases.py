"""Derivatives and intervals of b*(level)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.theory import manifold
from vinesexp.theory.intervals import RELEASE_VALUES, gradient_best, predict_best
from vinesexp.theory.transient import Decaying, best_clearance
from vinesexp.units import Quantity

TABLE_1 = Decaying(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6, x_m=0.030)
RIG = {
    "M": Quantity(4.7, 0.05),
    "c1": Quantity(3.02, 0.1),
    "k1": Quantity(1.147e4, 120.0),
    "r": Quantity(0.6, 0.01),
    "m": Quantity(0.032, 1e-5),
}


def moved(case: Decaying, name: str, share: float) -> Decaying:
    return replace(case, **{name: getattr(case, name) * (1.0 + share)})


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


def test_interval_of_b_star_is_the_delta_method() -> None:
    x_m = Quantity(0.03, 2e-4)
    best, slopes, _ = gradient_best(TABLE_1, level=0.025)
    errors = {name: q.std_error for name, q in RIG.items()} | {"x_m": 2e-4}
    found = predict_best(x_m=x_m, level=0.025, values=RIG)
    assert found.value == best.b
    assert found.std_error == pytest.approx(
        np.sqrt(sum((slopes[name] * e) ** 2 for name, e in errors.items()))
    )


def test_below_t1_the_interval_has_the_scatter_over_starts() -> None:
    exact = {name: Quantity(q.value) for name, q in RIG.items()}
    alone = predict_best(x_m=Quantity(0.03), level=0.005, values=exact)
    assert 0.003 < alone.std_error / alone.value < 0.03
    best = predict_best(x_m=Quantity(0.03), level=0.005, values=RIG)
    assert best.std_error > alone.std_error
    assert abs(best.value - 0.045) < 1.96 * best.std_error, "simulation: near 45 mm"


def test_bad_input_is_reported() -> None:
    lacking = {name: q for name, q in RIG.items() if name != "m"}
    with pytest.raises(ParameterError, match="rig values missing: m"):
        predict_best(x_m=Quantity(0.03), level=0.01, values=lacking)
    with pytest.raises(AnalysisError, match="above the release"):
        gradient_best(TABLE_1, level=0.04)
