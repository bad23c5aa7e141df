"""Drop test: flights, momentum, and when the bouncing is over."""

import math

import numpy as np
import pytest

from vinesexp.laboratory.experiment import drop
from vinesexp.rig import NES
from vinesexp.units import STANDARD_GRAVITY


def test_flight_times_shrink_by_the_restitution():
    bounces = drop(NES(m=0.032, b=0.034, r=0.6), M=4.7, height=0.05, duration=5.0).impacts
    flights = np.diff(bounces["time"])
    # differences of times near 0.4 s
    assert flights[1:8] / flights[:7] == pytest.approx(0.6, rel=1e-12)
    assert bounces["time"][0] == pytest.approx(math.sqrt(0.1 / STANDARD_GRAVITY), rel=1e-15)


def test_bouncing_ends_at_its_accumulation_time():
    r, t1 = 0.6, math.sqrt(0.1 / STANDARD_GRAVITY)
    bounces = drop(NES(m=0.032, b=0.034, r=r), M=4.7, height=0.05, duration=5.0).impacts
    assert bounces["time"][-1] == pytest.approx(t1 * (1 + r) / (1 - r), rel=1e-11)


def test_momentum_is_kept_and_the_wall_is_below():
    bounces = drop(NES(m=0.032, b=0.034, r=0.6), M=4.7, height=0.05, duration=1.0).impacts
    jump = bounces["v_after"] - bounces["v_before"]
    ball = 0.032 * (bounces["vy_after"] - bounces["vy_before"])
    np.testing.assert_allclose(4.7 * jump, -ball, rtol=1e-13)
    assert np.all(jump < 0)
    assert np.all(bounces["side"] == 1)


@pytest.mark.parametrize(("r", "count"), [(0.0, 1), (1.0, 10)])
def test_a_dead_ball_hits_once_and_an_elastic_one_for_ever(r, count):
    fall = math.sqrt(0.1 / STANDARD_GRAVITY)
    bounces = drop(NES(m=0.032, b=0.034, r=r), M=4.7, height=0.05, duration=20.0 * fall).impacts
    assert bounces["time"].size == count


def test_bounces_of_a_ball_whose_r_scatters_are_unlike_about_their_mean():
    balls = [NES(m=0.032, b=0.034, r=0.9, r_scatter=0.03, r_seed=seed) for seed in (5, 5, 6)]
    hits = [drop(ball, M=4.7, height=0.05, duration=30.0).impacts for ball in balls]
    r = [-one["vy_after"] / one["vy_before"] for one in hits]
    assert np.array_equal(r[0], r[1])
    assert not np.array_equal(r[0][:20], r[2][:20])
    every = np.concatenate(r[::2])
    assert every.mean() == pytest.approx(0.9, abs=4.0 * 0.027 / math.sqrt(every.size))
    assert every.std() == pytest.approx(0.027, rel=0.2)
