"""Intervals of b*(level)."""

from __future__ import annotations

import numpy as np
import pytest

from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.theory import manifold
from vinesexp.theory.intervals import predict_best
from vinesexp.theory.transient import Decaying, passage
from vinesexp.units import Quantity

TABLE_1 = Decaying(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6, x_m=0.030)
RIG = {
    "M": Quantity(4.7, 0.05),
    "c1": Quantity(3.02, 0.1),
    "k1": Quantity(1.147e4, 120.0),
    "r": Quantity(0.6, 0.01),
    "m": Quantity(0.032, 1e-5),
}


def alone(name: str, error: float) -> dict[str, Quantity]:
    """The rig with one value that is not known exactly."""
    return {n: Quantity(q.value, error if n == name else 0.0) for n, q in RIG.items()}


def test_near_the_release_b_star_is_where_capture_ends() -> None:
    """b* = x_m/A_1(r), whose derivatives are known."""
    b = 0.03 / float(manifold.A_1(0.6))
    exact = predict_best(x_m=Quantity(0.03), level=0.025, values=alone("M", 0.0))
    assert exact.value == pytest.approx(b, rel=2e-3)
    assert exact.std_error == 0.0
    found = predict_best(x_m=Quantity(0.03, 2e-4), level=0.025, values=alone("M", 0.0))
    assert found.std_error == pytest.approx(b / 0.03 * 2e-4, rel=2e-3)
    h = 0.01
    by_r = [0.03 / float(manifold.A_1(0.6 + d)) for d in (h, -h)]
    found = predict_best(x_m=Quantity(0.03), level=0.025, values=alone("r", 1e-3))
    assert found.std_error == pytest.approx((by_r[0] - by_r[1]) / (2.0 * h) * 1e-3, rel=0.02)


def test_at_the_elbow_b_star_moves_with_letting_go() -> None:
    """As the mean amplitude at which the flown balls let go, beside the scatter over starts."""

    def elbow(r: float) -> float:
        run = passage(eps=TABLE_1.eps, lam=TABLE_1.lam, r=r)
        return 0.005 / float(np.nanmean(run.let_go))

    scatter = predict_best(x_m=Quantity(0.03), level=0.005, values=alone("r", 0.0)).std_error
    both = predict_best(x_m=Quantity(0.03), level=0.005, values=alone("r", 0.02)).std_error
    own = np.sqrt(both**2 - scatter**2) / 0.02
    assert own == pytest.approx((elbow(0.624) - elbow(0.576)) / 0.048, rel=0.1)


def test_errors_of_values_add_in_squares() -> None:
    every = predict_best(x_m=Quantity(0.03), level=0.025, values=RIG).std_error
    each = [
        predict_best(x_m=Quantity(0.03), level=0.025, values=alone(n, q.std_error)).std_error
        for n, q in RIG.items()
    ]
    assert every == pytest.approx(np.linalg.norm(each))


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
        predict_best(x_m=Quantity(0.03), level=0.04, values=RIG)
