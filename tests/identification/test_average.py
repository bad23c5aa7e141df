"""Means of estimates that agree, and of such as exclude one another."""

import numpy as np
import pytest

from vinesexp.identification.average import student_95, weighted_mean
from vinesexp.units import COVERAGE_95


def holds(mean, value):
    return abs(mean.value - value) <= COVERAGE_95 * mean.error


def test_agreeing_estimates_are_weighed_by_their_variances():
    mean = weighted_mean([1.0, 1.2], [0.1, 0.2])
    assert mean.value == pytest.approx((1.0 / 0.01 + 1.2 / 0.04) / (1 / 0.01 + 1 / 0.04))
    assert mean.error == pytest.approx((1 / 0.01 + 1 / 0.04) ** -0.5)
    assert mean.weights == pytest.approx([0.8, 0.2])
    assert (mean.spread, mean.outlier) == (0.0, None)


@pytest.mark.parametrize("sure", [1e-2, 1e-4, 1e-9])
def test_two_that_exclude_one_another_are_both_held_however_sure_one_is(sure):
    mean = weighted_mean([4.6, 4.8], [1e-2, sure])
    assert mean.value == pytest.approx(4.7, abs=2e-3)
    assert holds(mean, 4.6)
    assert holds(mean, 4.8)


def test_a_precise_outlier_does_not_win():
    mean = weighted_mean([4.70, 4.701, 4.699, 4.9], [1e-3, 1e-3, 1e-3, 1e-7])
    assert mean.value == pytest.approx(4.75, abs=1e-3)
    assert holds(mean, 4.70)
    assert mean.outlier == 3


@pytest.mark.parametrize("each", [2, 5, 20])
def test_two_groups_are_both_held(each):
    values = [0.58] * each + [0.62] * each
    mean = weighted_mean([v + 1e-5 * i for i, v in enumerate(values)], [1e-5] * (2 * each))
    assert holds(mean, 0.58)
    assert holds(mean, 0.62)


def test_the_spread_between_records_is_found_and_intervals_hold_the_truth():
    """Random effects of 1 % beside errors of 0.1 %: Student's factor keeps 95 % at five records."""
    random = np.random.default_rng(4)
    spreads, held = [], 0
    for _ in range(1000):
        values = 1.0 + 1e-2 * random.standard_normal(5) + 1e-3 * random.standard_normal(5)
        mean = weighted_mean(values.tolist(), [1e-3] * 5)
        spreads.append(mean.spread)
        held += holds(mean, 1.0)
    assert np.sqrt(np.mean(np.square(spreads))) == pytest.approx(1e-2, rel=0.05)
    assert 930 <= held <= 980


def test_estimates_without_error_are_no_division_by_zero():
    mean = weighted_mean([1.0, 1.0, 1.0], [0.0, 0.0, 0.0])
    assert mean.value == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize(("freedom", "point"), [(1, 12.706), (10, 2.228), (11, 2.201), (40, 2.021)])
def test_points_of_student(freedom, point):
    assert student_95(freedom) == pytest.approx(point, abs=3e-3)
