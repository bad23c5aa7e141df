"""The score counts what was missed and what was invented."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.laboratory.score import match, score_impacts, score_parameters


@given(st.lists(st.floats(0.0, 100.0), max_size=40), st.floats(0.0, 4e-4))
@settings(max_examples=40, deadline=None)
def test_shifted_times_all_match_and_none_twice(times, shift):
    true = np.sort(np.array(times))
    pairs = match(true, true + shift, within=5e-4)
    assert len({i for i, _ in pairs}) == len({j for _, j in pairs}) == len(pairs) == true.size


def test_missed_and_false_impacts_are_counted():
    true, jumps = np.array([1.0, 2.0, 3.0, 4.0, 9.0]), np.array([0.01, -0.01, 0.01, 1e-6, 0.01])
    found = np.array([1.0001, 3.0001, 5.0])
    scores = {s.unit: s for s in score_impacts("a", true, jumps, found, until=8.0)}
    assert scores["missed"].error == 1  # 2.0; 4.0 is negligible, 9.0 after the record
    assert scores["false"].error == 1  # 5.0
    assert scores["s"].error == pytest.approx(0.0, abs=1e-12)


TIMES = st.lists(st.integers(0, 4000), max_size=60).map(lambda ms: np.sort(np.array(ms) * 1e-3))


@given(TIMES, TIMES, st.floats(0.0, 0.2), st.integers(0, 2**32 - 1))
@settings(max_examples=80, deadline=None)
def test_a_row_adds_up_whatever_was_found(true, found, weak, seed):
    """Once a row said 58 true, 63 found and 0 false: what is counted is one set."""
    sizes = np.where(np.random.default_rng(seed).random(true.size) < weak, 1e-6, 0.01)
    rows = {s.unit: s for s in score_impacts("a", true, sizes, found, until=3.5)}
    missed, false = rows["missed"], rows["false"]
    assert missed.truth == false.truth
    assert missed.found == false.found == found.size
    assert missed.truth - missed.error + false.error == found.size
    assert 0 <= missed.error <= missed.truth


def test_only_combined_values_are_scored():
    rows = [
        {"parameter": "M", "method": "impacts", "value": 9.0, "std_error": 1.0, "unit": "kg"},
        {"parameter": "M", "method": "combined", "value": 4.6, "std_error": 0.1, "unit": "kg"},
    ]
    relative, errors = score_parameters(rows, {"M": 4.7})
    assert relative.error == pytest.approx(-0.1 / 4.7)
    assert errors.error == pytest.approx(-1.0)


def test_balls_that_hit_together_are_one_impact_to_be_found():
    true, jumps = np.array([1.0, 1.0, 2.0, 2.00015, 3.0]), np.full(5, 0.01)
    found = np.array([1.0, 2.0001, 3.0])
    scores = {s.unit: s for s in score_impacts("a", true, jumps, found, until=8.0)}
    assert scores["missed"].truth == 3
    assert scores["missed"].error == scores["false"].error == 0
