"""Sensors: each fault as its data sheet says, none that is not asked for."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.laboratory.modes import Mode
from vinesexp.laboratory.sensors import (
    Accelerometer,
    Laser,
    accelerometer_volts,
    laser_volts,
    low_passed,
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
    mode = Mode(frequency=100.0, share=0.3)
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
