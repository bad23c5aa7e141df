"""Sensors: each fault as its data sheet says, none that is not asked for."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.laboratory.sensors import (
    Accelerometer,
    Laser,
    LocalMode,
    accelerometer_volts,
    contact_acceleration,
    laser_volts,
    low_passed,
    pulse_momentum,
    slow_drift,
)

DT = 1e-4
T = np.arange(20000) * DT


def wave(t):
    return 5e-3 * np.sin(2.0 * np.pi * 7.862 * t)


def generator(seed=1):
    return np.random.default_rng(seed)


def test_an_ideal_laser_is_its_sensitivity():
    volts = laser_volts(Laser(sensitivity=40.0), wave, T, dt=DT, noise=generator())
    np.testing.assert_array_equal(volts, 40.0 * wave(T))


def test_the_motion_is_not_changed_in_place():
    values = wave(T)
    laser_volts(Laser(sensitivity=40.0, bias=1e-3), lambda t: values, T, dt=DT, noise=generator())
    np.testing.assert_array_equal(values, wave(T))


def test_offset_is_volts_and_bias_is_metres():
    laser = Laser(sensitivity=100.0, offset=2.5, bias=0.01)
    volts = laser_volts(laser, np.zeros_like, T, dt=DT, noise=generator())
    assert volts == pytest.approx(3.5, abs=1e-15)


def test_noise_has_its_rms_and_repeats_with_its_seed():
    laser = Laser(sensitivity=1.0, noise=6e-6)
    first = laser_volts(laser, np.zeros_like, T, dt=DT, noise=generator(3))
    again = laser_volts(laser, np.zeros_like, T, dt=DT, noise=generator(3))
    np.testing.assert_array_equal(first, again)
    # 20000 samples: the rms is known to 1/sqrt(40000) = 0.5 %; five of these
    assert first.std() == pytest.approx(6e-6, rel=0.025)


def test_range_clips_what_lies_beyond():
    laser = Laser(sensitivity=2.0, range=4e-3)
    volts = laser_volts(laser, wave, T, dt=DT, noise=generator())
    np.testing.assert_array_equal(volts, 2.0 * np.clip(wave(T), -4e-3, 4e-3))
    assert volts.max() == 8e-3


@settings(deadline=None, max_examples=30)
@given(frequency=st.floats(1.0, 200.0), bandwidth=st.floats(50.0, 2e4))
def test_bandwidth_is_a_first_order_lag(frequency, bandwidth):
    w = 2.0 * math.pi * frequency

    def sine(t):
        return np.sin(w * t)

    t = 1.0 + np.arange(500) * 1e-5
    lag = 1.0 / complex(1.0, frequency / bandwidth)
    exact = abs(lag) * np.sin(w * t + np.angle(lag))
    found = low_passed(sine, t, dt=1e-5, bandwidth=bandwidth)
    # straight lines between samples miss a sine by (w dt)^2/8, rounding aside
    assert np.abs(found - exact).max() < (w * 1e-5) ** 2 / 8.0 + 1e-12


def test_blocks_of_a_slow_laser_fit_together():
    laser = Laser(sensitivity=1.0, bandwidth=300.0)
    whole = laser_volts(laser, wave, T[:2000], dt=DT, noise=generator())
    late = laser_volts(laser, wave, T[1000:2000], dt=DT, noise=generator())
    assert np.abs(whole[1000:] - late).max() < 1e-15


def test_drift_is_slow_and_has_its_rms():
    values = []
    for seed in range(200):
        drift = slow_drift(5e-5, shortest_period=60.0, span=100.0, stream=generator(seed))
        values.append(drift(np.linspace(0.0, 100.0, 50)))
        rate = np.abs(np.diff(drift(np.linspace(0.0, 100.0, 1001)))).max() / 0.1
        assert rate < 8 * 2.5e-5 * 2 * math.pi / 60.0
    # 200 independent drifts: the rms is known to 1/sqrt(400) = 5 %; four of these
    assert np.sqrt(np.mean(np.square(values))) == pytest.approx(5e-5, rel=0.2)


def test_accelerometer_adds_contacts_to_the_smooth_acceleration():
    sensor = Accelerometer(sensitivity=0.5, pulse=4e-4)
    volts = accelerometer_volts(
        sensor,
        lambda t: np.full_like(t, 3.0),
        T,
        times=np.array([1.00003]),
        jumps=np.array([0.02]),
        dt=DT,
        noise=generator(),
    )
    assert volts[:9000] == pytest.approx(1.5, abs=0)
    assert (volts - 1.5).sum() * DT == pytest.approx(0.5 * 0.02, rel=1e-12)


def test_accelerometer_clips():
    sensor = Accelerometer(sensitivity=1.0, pulse=4e-4, range=50.0)
    volts = accelerometer_volts(
        sensor,
        np.zeros_like,
        T,
        times=np.array([1.0]),
        jumps=np.array([0.1]),
        dt=DT,
        noise=generator(),
    )
    assert volts.max() == 50.0


def accelerated(sensor, acceleration, t=T, jumps=(), **more):
    times = np.linspace(1.0, 1.5, len(jumps))
    return accelerometer_volts(
        sensor, acceleration, t, times=times, jumps=np.asarray(jumps, dtype=float), dt=DT,
        noise=generator(), **more,
    )  # fmt: skip


def test_a_wrong_gain_scales_what_is_measured_and_not_the_offset():
    laser = Laser(sensitivity=40.0, offset=0.5, gain=1.03)
    volts = laser_volts(laser, wave, T, dt=DT, noise=generator())
    np.testing.assert_allclose(volts, 0.5 + 1.03 * 40.0 * wave(T), rtol=1e-13)


def test_an_ac_coupling_leads_in_phase_and_shows_nothing_constant():
    """A sine long after its beginning: gain and phase of if/(if + fc); a constant dies away."""
    f, corner = 2.0, 0.5
    sensor = Accelerometer(sensitivity=1.0, pulse=4e-4, ac_corner=corner)
    t = 12.0 + np.arange(5000) * DT
    volts = accelerated(sensor, lambda t: 3.0 + np.sin(2 * math.pi * f * t), t)
    H = 1j * f / (1j * f + corner)
    exact = abs(H) * np.sin(2 * math.pi * f * t + np.angle(H))
    # straight lines between samples: (w dt)^2/8
    np.testing.assert_allclose(volts, exact, atol=2e-7)
    early = accelerated(sensor, lambda t: np.full_like(t, 3.0))
    assert early[0] == pytest.approx(3.0, rel=1e-3)  # the step of the release is seen
    assert early[3183] == pytest.approx(3.0 * math.exp(-1.0), rel=1e-3)


def test_blocks_of_an_ac_coupled_accelerometer_fit_together():
    sensor = Accelerometer(sensitivity=1.0, pulse=4e-4, ac_corner=5.0)
    jumps = [0.02, -0.03, 0.01]
    whole = accelerated(sensor, wave, jumps=jumps)
    late = accelerated(sensor, wave, t=T[9000:], jumps=jumps)
    np.testing.assert_allclose(whole[9000:], late, atol=1e-9 * np.abs(whole).max())


def test_cross_axis_sensitivity_shows_a_share_of_the_base():
    w = 2.0 * math.pi * 8.0
    sensor = Accelerometer(sensitivity=1.0, pulse=4e-4, cross_axis=0.05)
    volts = accelerated(sensor, np.zeros_like, base_velocity=lambda t: 1e-3 * w * np.cos(w * t))
    exact = -0.05 * 1e-3 * w * w * np.sin(w * T)
    assert np.abs(volts - exact).max() < 1e-5 * np.abs(exact).max()


def test_both_sensors_see_a_local_mode():
    mode = LocalMode(frequency=100.0, share=0.3)
    times, jumps = np.array([1.0]), np.array([0.02])
    laser = Laser(sensitivity=1.0, mode=mode)
    q = laser_volts(laser, np.zeros_like, T, dt=DT, noise=generator(), times=times, jumps=jumps)
    assert np.abs(q[:10000]).max() == 0.0
    assert q.max() == pytest.approx(0.3 * 0.02 / (2 * math.pi * 100.0), rel=0.05)
    plain = Accelerometer(sensitivity=1.0, pulse=4e-4)
    ringing = Accelerometer(sensitivity=1.0, pulse=4e-4, mode=mode)
    one, two = (accelerated(s, np.zeros_like, jumps=[0.02]) for s in (plain, ringing))
    assert two[9990:10004].sum() > 1.2 * one[9990:10004].sum()
    assert two.sum() == pytest.approx(one.sum(), rel=1e-4)


# Contact pulses: the momentum is exact wherever and however coarsely they are sampled.
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
