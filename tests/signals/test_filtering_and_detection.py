"""Properties of the bandpass and of the detection that no campaign shows by itself."""

import numpy as np
import pytest
from scipy import signal
from tests.signals.contacts import detect_contacts

from vinesexp.errors import ParameterError
from vinesexp.signals.filters import (
    butterworth,
    settling_samples,
    zero_phase,
    zero_phase_blocks,
)
from vinesexp.signals.means import cycle_amplitudes, time_to_level

RATE = 1e4


def contacts(times, *, seconds, noise, seed, peak=60.0, duration=4e-4):
    """Acceleration with half-sine contacts, each averaged over the sample, and white noise."""
    t = np.arange(round(seconds * RATE)) / RATE
    a = np.random.default_rng(seed).normal(0.0, noise, t.size)
    w = np.pi / duration
    for k, time in enumerate(times):
        near = np.abs(t - time) < duration
        edges = np.stack([t[near] - 0.5 / RATE, t[near] + 0.5 / RATE]) - time
        area = np.sin(w * np.clip(edges, -duration / 2, duration / 2)) / w
        a[near] += (-1) ** k * peak * RATE * (area[1] - area[0])
    return a


@pytest.mark.parametrize(
    ("low", "high", "kind"),
    [(20.0, 800.0, "band"), (7.0, 9.0, "band"), (157.0, None, "high"), (None, 400.0, "low")],
)
@pytest.mark.parametrize("order", [1, 2, 3])
def test_inside_the_filter_is_the_forward_backward_filter_of_scipy(low, high, kind, order):
    band = butterworth(RATE, low=low, high=high, order=order)
    margin = settling_samples(band)
    x = np.cumsum(np.random.default_rng(0).standard_normal(2 * margin + 5000))
    corners = [corner for corner in (low, high) if corner is not None]
    sos = signal.butter(order, np.squeeze(corners), kind, fs=RATE, output="sos")
    mine, reference = zero_phase(x, band), signal.sosfiltfilt(sos, x, padlen=1000)
    inside = slice(margin, -margin)
    np.testing.assert_allclose(mine[inside], reference[inside], atol=1e-8 * np.abs(x).max())


def test_a_long_record_in_small_blocks_is_the_record_at_once():
    x = np.cumsum(np.random.default_rng(0).standard_normal(600_000))
    band, none = butterworth(RATE, low=2.0, high=40.0), np.empty(0)
    pieces = np.concatenate(
        list(zero_phase_blocks(np.array_split(x, 23), band, before=none, after=none))
    )
    np.testing.assert_allclose(pieces, zero_phase(x, band), atol=1e-8 * np.abs(x).max())


def test_blocks_make_no_difference():
    x = np.random.default_rng(1).standard_normal(30000)
    band = butterworth(RATE, low=100.0, high=None)
    none = np.empty(0)
    whole = np.concatenate(list(zero_phase_blocks([x], band, before=none, after=none)))
    parts = [x[:7], x[7:12000], x[12000:12001], x[12001:]]
    pieces = np.concatenate(list(zero_phase_blocks(parts, band, before=none, after=none)))
    np.testing.assert_allclose(pieces, whole, atol=1e-7)


def test_a_band_that_the_sample_rate_does_not_hold_is_refused():
    with pytest.raises(ParameterError, match="lower corner"):
        butterworth(100.0, low=60.0, high=None)


@pytest.mark.parametrize("noise", [0.1, 0.3, 1.0])
def test_contacts_are_found_and_timed_to_a_fraction_of_a_sample(noise):
    times = 0.05 + 0.0637 * np.arange(60)
    a = contacts(times, seconds=4.0, noise=noise, seed=2)
    found = detect_contacts(a, RATE, highpass=None)
    assert found.time.size == times.size
    errors = found.time - times
    assert np.sqrt(np.mean(errors**2)) < 0.1 / RATE * max(noise / 0.3, 1.0)
    assert np.sqrt(np.mean((errors / found.time_error) ** 2)) < 2.0


def test_the_jump_is_the_momentum_of_the_contact():
    times = 0.05 + 0.0637 * np.arange(60)
    found = detect_contacts(contacts(times, seconds=4.0, noise=0.3, seed=3), RATE, highpass=None)
    area = 60.0 * 2.0 * 4e-4 / np.pi
    np.testing.assert_array_equal(np.sign(found.jump), (-1.0) ** np.arange(60))
    assert np.mean(np.abs(found.jump)) == pytest.approx(area, rel=0.01)


def test_noise_alone_is_no_impact_however_long_the_record():
    for seconds in (1.0, 10.0, 60.0):
        a = contacts([], seconds=seconds, noise=0.3, seed=4)
        assert detect_contacts(a, RATE, highpass=None).time.size == 0


def test_what_is_found_does_not_depend_on_the_length_of_the_record():
    times = 0.05 + 0.0637 * np.arange(30)
    a = contacts(times, seconds=30.0, noise=0.3, seed=5)
    short = detect_contacts(a[:20000], RATE, highpass=None)
    long = detect_contacts(a, RATE, highpass=None)
    assert short.time.size == long.time.size == 30
    np.testing.assert_allclose(short.time, long.time, atol=2e-6)


def test_scaling_the_acceleration_scales_the_jumps_and_nothing_else():
    times = 0.05 + 0.0637 * np.arange(30)
    a = contacts(times, seconds=2.5, noise=0.3, seed=6)
    one, ten = (detect_contacts(k * a, RATE, highpass=None) for k in (1.0, 10.0))
    np.testing.assert_allclose(ten.time, one.time, atol=1e-9)
    np.testing.assert_allclose(ten.jump, 10.0 * one.jump, rtol=1e-6)


def test_missing_samples_hide_nothing_elsewhere():
    times = 0.05 + 0.0637 * np.arange(30)
    a = contacts(times, seconds=2.5, noise=0.3, seed=7)
    a[12000:12200] = np.nan
    found = detect_contacts(a, RATE, highpass=None)
    away = np.abs(times - 1.21) > 0.02
    apart = np.abs(found.time[:, None] - times[away]).min(axis=0)
    assert np.all(apart < 1e-5)


def test_amplitude_is_half_the_swing_whatever_the_offset():
    t = np.arange(20000) / 1e3
    x = 5.0 + 2.0 * np.exp(-0.1 * t) * np.sin(2 * np.pi * 7.862 * t)
    time, amplitude = cycle_amplitudes(x, 1e3, 7.862)
    np.testing.assert_allclose(amplitude, 2.0 * np.exp(-0.1 * time), rtol=0.01)
    assert time_to_level(time, amplitude, 1.0) == pytest.approx(np.log(2.0) / 0.1, rel=0.01)
    assert np.isnan(time_to_level(time, amplitude, 0.01))
