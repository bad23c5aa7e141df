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


@pytest.mark.long
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


@pytest.mark.parametrize(("apart", "widened"), [(2.90, False), (2.97, True)])
def test_chance_once_in_twenty_times_is_no_disagreement(apart, widened):
    """chi^2 of two is apart^2/2; it is widened from 1 + 1.64 sqrt 2 + 1 = 4.32 on."""
    mean = weighted_mean([0.0, apart], [1.0, 1.0])
    assert (mean.spread > 0.0) == widened
    assert (mean.error > 0.71) == widened


def test_the_interval_of_two_groups_ends_a_tenth_beyond_them():
    values = [0.58] * 20 + [0.62] * 20
    mean = weighted_mean(values, [1e-6] * 40)
    assert mean.value == pytest.approx(0.6)
    assert mean.error * COVERAGE_95 == pytest.approx(1.1 * 0.02)


def test_one_odd_record_among_many_makes_no_group():
    mean = weighted_mean([0.6] * 19 + [0.62], [1e-6] * 20)
    assert mean.value == pytest.approx(0.601)
    scatter = float(np.std([0.6] * 19 + [0.62], ddof=1)) / np.sqrt(20)
    assert mean.error == pytest.approx(scatter * student_95(19) / COVERAGE_95, rel=1e-6)
