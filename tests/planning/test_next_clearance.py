"""Which clearance comes next: few tests where the expectation is right, and an end where not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.clearance.levels import Tested
from vinesexp.clearance.optimum import lowest_amplitude, scatter_of
from vinesexp.planning.next_clearance import (
    TARGET,
    bracket_of,
    follow_plan,
    next_clearance,
)


def valley(b: float, lowest: float) -> float:
    """Falls slowly up to the minimum, rises, and jumps three percent above it."""
    return 5.0 + abs(b / lowest - 1.0) + (3.0 if b > 1.03 * lowest else 0.0)


def test_three_tests_suffice_where_the_minimum_is_expected():
    tested = follow_plan(lambda b: valley(b, 0.033), expected=0.033)
    assert len(tested) == 3
    assert bracket_of(tested).width <= TARGET


@given(st.floats(0.7, 1.4), st.floats(0.005, 0.2))
@settings(max_examples=60, deadline=None)
def test_any_expectation_ends_in_a_bracket_that_holds_the_minimum(off, target):
    lowest = 0.02
    tested = follow_plan(lambda b: valley(b, lowest), expected=off * lowest, target=target)
    found = bracket_of(tested)
    assert found.width <= target * (1 + 1e-6)
    assert found.low <= lowest <= found.high
    assert len(tested) < 40


@given(st.floats(0.97, 1.03))
@settings(max_examples=40, deadline=None)
def test_an_expectation_that_is_off_by_three_percent_costs_a_few_tests(off):
    tested = follow_plan(lambda b: valley(b, 0.02), expected=off * 0.02)
    assert bracket_of(tested).width <= TARGET
    assert len(tested) <= 9


def test_tests_that_are_there_are_used():
    tested = {0.030: valley(0.030, 0.033), 0.036: valley(0.036, 0.033), 0.0329: 5.003}
    b = next_clearance(tested, expected=0.033)
    assert 0.0329 < b < 0.036


def test_without_any_knowledge_there_is_no_first_test():
    with pytest.raises(ValueError, match="none is predicted"):
        next_clearance({}, expected=None)


@given(st.integers(0, 1000), st.floats(0.0, 0.02))
@settings(max_examples=60, deadline=None)
def test_a_plan_brackets_as_the_report_does(seed, noise):
    """It said 5 % of tests of which the report had 13: three of them were alike."""
    rng = np.random.default_rng(seed)
    b = np.sort(rng.choice(np.arange(20, 60), 9, replace=False)) / 2e3
    value = np.array([valley(one, 0.02) for one in b])
    value *= 1.0 + noise * rng.standard_normal(9)
    tests = [Tested(*one, "two symmetric") for one in zip(b, value, strict=True)]
    found = bracket_of(dict(zip(b, value, strict=True)), scatter=scatter_of(tests))
    best = lowest_amplitude(tests)
    assert (found.low, found.high) == (best.low, best.high)


@given(st.integers(0, 1000), st.floats(0.0005, 0.01), st.floats(0.9, 1.1))
@settings(max_examples=40, deadline=None)
def test_tests_that_scatter_end_in_a_bracket_that_holds_the_minimum(seed, scatter, off):
    rng, lowest = np.random.default_rng(seed), 0.02

    def measured(b):
        return valley(b, lowest) * (1.0 + scatter * rng.standard_normal())

    tested = follow_plan(measured, expected=off * lowest, target=0.03, scatter=scatter)
    found = bracket_of(tested, scatter=scatter)
    assert len(tested) < 40
    assert len(set(np.round(list(tested), 6))) == len(tested)
    slack = 3.0 * scatter * 5.0 * lowest  # of the valley's sides, by what is seldom
    assert found.low - slack <= lowest <= found.high + slack
