"""Means of estimates that agree, and of such as exclude one another."""

import numpy as np
import pytest

from vinesexp.identification.average import weighted_mean
from vinesexp.units import COVERAGE_95


def holds(mean, value):
    return abs(mean[0] - value) <= COVERAGE_95 * mean[1]


def test_agreeing_estimates_are_weighed_by_their_variances():
    value, error = weighted_mean([1.0, 1.2], [0.1, 0.2])
    assert value == pytest.approx((1.0 / 0.01 + 1.2 / 0.04) / (1 / 0.01 + 1 / 0.04))
    assert error == pytest.approx((1 / 0.01 + 1 / 0.04) ** -0.5)


@pytest.mark.parametrize("sure", [1e-2, 1e-4, 1e-9])
def test_two_that_exclude_one_another_are_both_held_however_sure_one_is(sure):
    mean = weighted_mean([4.6, 4.8], [1e-2, sure])
    assert mean[0] == pytest.approx(4.7, abs=2e-3)
    assert holds(mean, 4.6)
    assert holds(mean, 4.8)


def test_a_precise_outlier_does_not_win():
    mean = weighted_mean([4.70, 4.701, 4.699, 4.9], [1e-3, 1e-3, 1e-3, 1e-7])
    assert mean[0] == pytest.approx(4.75, abs=1e-3)
    assert holds(mean, 4.70)


@pytest.mark.long
def test_intervals_hold_the_truth_where_records_differ_by_more_than_they_say():
    """Random effects of 1 % beside errors of 0.1 %: Student's factor keeps 95 % at five records."""
    random = np.random.default_rng(4)
    held = 0
    for _ in range(1000):
        values = 1.0 + 1e-2 * random.standard_normal(5) + 1e-3 * random.standard_normal(5)
        held += holds(weighted_mean(values.tolist(), [1e-3] * 5), 1.0)
    assert 930 <= held <= 980


def test_estimates_without_error_are_no_division_by_zero():
    assert weighted_mean([1.0, 1.0, 1.0], [0.0, 0.0, 0.0])[0] == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize(("apart", "widened"), [(2.90, False), (2.97, True)])
def test_chance_once_in_twenty_times_is_no_disagreement(apart, widened):
    """chi^2 of two is apart^2/2; it is widened from 1 + 1.64 sqrt 2 + 1 = 4.32 on."""
    assert (weighted_mean([0.0, apart], [1.0, 1.0])[1] > 0.71) == widened
