"""Contact pulses: the momentum is exact wherever and however coarsely they are sampled."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.laboratory.sensors import contact_acceleration, pulse_momentum


@settings(deadline=None, max_examples=100)
@given(
    time=st.floats(0.01, 0.02),
    duration=st.floats(1e-6, 2e-3),
    dt=st.floats(2e-5, 1e-3),
    jump=st.floats(-1.0, 1.0).filter(lambda value: abs(value) > 1e-9),
    ring=st.none() | st.floats(500.0, 5e4),
    damping=st.floats(0.02, 0.9),
)
def test_samples_add_up_to_the_jump(time, duration, dt, jump, ring, damping):
    n = math.ceil(0.5 / dt)
    a = contact_acceleration(
        np.array([time]),
        np.array([jump]),
        duration=duration,
        ring=ring,
        ring_damping=damping,
        start=0.0,
        dt=dt,
        n=n,
    )
    # telescoping sum of n differences: n/2 roundings of terms of the size of the jump over dt
    assert a.sum() * dt == pytest.approx(jump, rel=0.0, abs=2e-15 * n * abs(jump))


def test_pulse_shorter_than_a_sample_lands_in_its_sample_alone():
    a = contact_acceleration(
        np.array([0.0123]),
        np.array([2.0]),
        duration=1e-6,
        ring=None,
        ring_damping=0.0,
        start=0.0,
        dt=1e-3,
        n=40,
    )
    # sample 12 is the mean over 11.5 to 12.5 ms
    assert np.flatnonzero(a).tolist() == [12]
    assert a[12] == pytest.approx(2.0 / 1e-3, rel=1e-12)


def test_half_sine_is_what_is_sampled_finely():
    T, dt = 4e-4, 1e-6
    a = contact_acceleration(
        np.array([1e-3]),
        np.array([-0.02]),
        duration=T,
        ring=None,
        ring_damping=0.0,
        start=0.0,
        dt=dt,
        n=2000,
    )
    t = np.arange(2000) * dt - (1e-3 - 0.5 * T)
    exact = np.where((t > 0) & (t < T), -0.02 * math.pi / (2 * T) * np.sin(math.pi * t / T), 0.0)
    # a mean over dt differs from the middle by curvature and by the slope change at either end
    assert np.abs(a - exact).max() < 0.02 * (math.pi / T) ** 2 * dt


def test_ring_solves_its_equation():
    """The ringing sensor against a Runge-Kutta integration of its oscillator equation."""
    T, ring, damping = 4e-4, 6000.0, 0.05
    w = 2.0 * math.pi * ring
    h = 5e-8

    def slope(t, state):
        q, rate = state
        push = math.sin(0.5 * math.pi * min(max(t, 0.0), T) / T) ** 2
        return np.array([rate, w * w * (push - q) - 2.0 * damping * w * rate])

    state, times, found = np.zeros(2), [], []
    for step in range(12000):
        t = step * h
        if step % 1200 == 0:
            times.append(t)
            found.append(state[0])
        k1 = slope(t, state)
        k2 = slope(t + h / 2, state + h / 2 * k1)
        k3 = slope(t + h / 2, state + h / 2 * k2)
        k4 = slope(t + h, state + h * k3)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    ours = pulse_momentum(np.array(times), duration=T, ring=ring, ring_damping=damping)
    # h w = 2e-3: the integration's own error is below (h w)^4
    assert np.abs(ours - np.array(found)).max() < 1e-10


def test_many_pulses_are_the_sum_of_each():
    rng = np.random.default_rng(5)
    times = np.sort(rng.uniform(-0.01, 1.01, 6000))
    jumps = rng.normal(size=6000)
    options = {"duration": 4e-4, "ring": 8000.0, "ring_damping": 0.1, "start": 0.0, "dt": 1e-4}
    whole = contact_acceleration(times, jumps, n=10000, **options)
    parts = contact_acceleration(times[:2500], jumps[:2500], n=10000, **options)
    parts += contact_acceleration(times[2500:], jumps[2500:], n=10000, **options)
    assert np.abs(whole - parts).max() < 1e-9 * np.abs(whole).max()


def test_blocks_fit_together_without_a_seam():
    times, jumps = np.array([0.00999, 0.01, 0.0100499]), np.array([1.0, -2.0, 3.0])
    options = {"duration": 4e-4, "ring": 5000.0, "ring_damping": 0.1, "dt": 1e-4}
    whole = contact_acceleration(times, jumps, start=0.0, n=400, **options)
    first = contact_acceleration(times, jumps, start=0.0, n=100, **options)
    second = contact_acceleration(times, jumps, start=100 * 1e-4, n=300, **options)
    # start 0 and start 0.01 round the edges of a sample differently: 1e-16/1e-4 of a pulse
    assert np.abs(whole - np.concatenate([first, second])).max() < 1e-8 * np.abs(whole).max()
