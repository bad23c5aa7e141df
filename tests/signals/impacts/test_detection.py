"""Contacts: every one, none else, as exact in time as the noise allows."""

import tracemalloc
from functools import lru_cache

import numpy as np
import pytest
from scipy import signal
from tests.combined import combined
from tests.signals.contacts import detect_contacts

from vinesexp.laboratory.sensors import contact_acceleration
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.filters import butterworth, zero_phase
from vinesexp.signals.impacts.candidates import Stream, boxcars, find_spikes
from vinesexp.signals.impacts.detection import detect_by_template


def trace(times, jumps, *, seconds, rate=1e4, noise=0.3, ring=None, duration=4e-4, seed=0):
    n = round(seconds * rate)
    a = contact_acceleration(
        np.asarray(times), np.asarray(jumps), duration=duration, ring=ring, ring_damping=0.02,
        start=0.0, dt=1.0 / rate, n=n,
    )  # fmt: skip
    return a + noise * np.random.default_rng(seed).standard_normal(n)


def regular(n: int, *, period: float = 0.0636, jump: float = 0.0146, seed: int = 1):
    scatter = np.random.default_rng(seed).uniform(-2e-3, 2e-3, n)
    return 0.1 + period * np.arange(n) + scatter, jump * (-1.0) ** np.arange(n)


@pytest.mark.parametrize(("ring", "rate"), combined([None, 3000.0, 2000.0], [5e3, 1e4, 5e4]))
def test_all_impacts_and_no_other(rate: float, ring: float | None) -> None:
    t, j = regular(120)
    a = trace(t, j, seconds=8.0, rate=rate, ring=ring)
    found = detect_contacts(a, rate, highpass=None)
    assert found.time.size == 120
    assert np.abs(found.time - t).max() < 0.2 / rate
    assert np.median(found.jump / j) == pytest.approx(1.0, abs=0.01)


def test_timing_reaches_the_information_limit() -> None:
    t, j = regular(300)
    a = trace(t, j, seconds=20.0)
    found = detect_contacts(a, 1e4, highpass=None)
    error = found.time - t
    # half sine of length T, height P, density fs: sigma_t = sigma/P T/pi sqrt(2/(T fs))
    peak = np.pi * 0.0146 / (2 * 4e-4)
    bound = 0.3 / peak * 4e-4 / np.pi * np.sqrt(2.0 / (4e-4 * 1e4))
    assert error.std() < 1.5 * bound
    assert abs(error.mean()) < 4.0 * bound / np.sqrt(300)
    assert np.median(found.time_error) == pytest.approx(error.std(), rel=0.25)


def test_highpass_changes_neither_times_nor_jumps() -> None:
    t, j = regular(300)
    a = trace(t, j, seconds=20.0, noise=0.1)
    filtered = zero_phase(a, butterworth(1e4, low=157.0, high=None))
    found = detect_contacts(filtered, 1e4, highpass=157.0)
    assert found.time.size == 300
    assert abs(np.mean(found.time - t)) < 1e-7
    assert np.mean(found.jump / j) == pytest.approx(1.0, abs=1e-3)


def test_errors_of_the_jump_are_honest() -> None:
    t, j = regular(300)
    found = detect_contacts(trace(t, j, seconds=20.0), 1e4, highpass=None)
    pull = (found.jump - j) / found.jump_error
    assert 0.8 < pull.std() < 1.2


@pytest.mark.parametrize("seed", range(10))
def test_noise_alone_is_no_impact(seed: int) -> None:
    """Chosen seeds: about one in ten thousand such records has one by chance (seed 3943 does)."""
    a = np.random.default_rng(seed).standard_normal(200_000)
    assert detect_contacts(a, 1e4, highpass=None).time.size == 0


def test_threshold_does_not_know_the_length_of_the_record() -> None:
    t, j = regular(10)
    short = trace(t, j, seconds=1.0)
    long = np.concatenate([short, trace([], [], seconds=30.0, seed=5)])
    one, other = find_spikes(short, 1e4), find_spikes(long, 1e4)
    near = other.index < short.size - 50
    assert np.abs(other.noise[0] / one.noise[0] - 1.0) < 0.1
    assert set(one.index[one.strength > 12]) <= set(other.index[near])


def test_noise_is_followed_where_it_changes() -> None:
    random = np.random.default_rng(3)
    a = random.standard_normal(400_000) * np.repeat([0.3, 3.0], 200_000)
    assert detect_contacts(a, 1e4, highpass=None).time.size == 0


def test_chatter_is_resolved_until_contacts_touch() -> None:
    t, j = regular(60)
    gaps = 0.03 * 0.7 ** np.arange(12)  # 30 ms down to 0.6 ms
    chatter = 4.2 + np.concatenate([[0.0], np.cumsum(gaps)])
    strength = 0.0146 * 0.8 ** np.arange(13)
    a = trace(np.concatenate([t, chatter]), np.concatenate([j, strength]), seconds=5.0, noise=0.1)
    found = detect_contacts(a, 1e4, highpass=None)
    late = found.time[found.time > 4.1]
    assert late.size == 13
    assert np.abs(late - chatter).max() < 1e-5


def test_contacts_closer_than_a_pulse_are_one_and_flagged() -> None:
    t, j = regular(60)
    a = trace([*t, 4.5, 4.50015], [*j, 0.0146, 0.0146], seconds=5.0, noise=0.1)
    found = detect_contacts(a, 1e4, highpass=None)
    merged = found.time > 4.2
    assert merged.sum() == 1
    assert found.crowded[merged].all()


@pytest.mark.parametrize("ring", [None, 2500.0])
def test_clipped_contacts_are_flagged_and_timed(ring: float | None) -> None:
    t, j = regular(100)
    j[::10] *= 4.0
    a = trace(t, j, seconds=7.0, ring=ring)
    limit = 100.0
    clipped = np.abs(a) >= limit
    found = detect_contacts(np.clip(a, -limit, limit), 1e4, highpass=None, clipped=clipped)
    assert found.time.size == 100
    flagged = np.abs(j) > 0.05
    assert found.clipped[flagged].all()
    assert not found.clipped[~flagged].any()
    assert np.abs(found.time - t)[flagged].max() < 1e-4  # one sample
    assert (np.abs(found.jump - j) < 5.0 * found.jump_error + 0.05 * np.abs(j))[flagged].all()


@pytest.mark.parametrize(("corner", "most"), combined([100.0, 400.0], [1.3, 3.0]))
def test_what_a_highpass_makes_of_clipped_contacts_is_no_impact(corner: float, most: float) -> None:
    """It left chains of false impacts beside each, and jumps 10 % too small, as sure as all others.

    `most`: the highest contact over the limit. At 3 nothing but flanks is left of it.
    """
    t, j = regular(200)
    j *= np.random.default_rng(5).uniform(0.3, most, 200)
    limit = 57.0
    a = trace(t, j, seconds=14.0, noise=0.1)
    filtered = zero_phase(np.clip(a, -limit, limit), butterworth(1e4, low=corner, high=None))
    found = detect_contacts(filtered, 1e4, highpass=corner, clipped=np.abs(a) >= limit)
    assert found.time.size == 200
    assert 30 < found.clipped.sum() < 190
    off = np.abs(found.jump - j)
    assert (off < 4.0 * found.jump_error + 0.006 * np.abs(j)).all()
    assert np.median((off / np.abs(j))[found.clipped]) < 0.006
    assert np.abs(found.time - t).max() < (2e-6 if most < 2.0 else 2e-5)


@pytest.mark.long
@pytest.mark.parametrize(("rate", "swing", "limit"), [(1500.0, 4.0, 0.3), (4000.0, 15.0, 0.5)])
def test_a_motion_beyond_the_range_is_no_error(rate: float, swing: float, limit: float) -> None:
    """What was given back for each clipped contact moved the others, until numbers ran over."""
    t, j = regular(40)
    n = round(3.0 * rate)
    a = trace(t, j, seconds=3.0, rate=rate, noise=0.02, duration=5e-4)
    a += 3.0 * np.sin(2.0 * np.pi * swing * np.arange(n) / rate)
    corner = 6.5 * swing
    filtered = zero_phase(np.clip(a, -limit, limit), butterworth(rate, low=corner, high=None))
    found = detect_contacts(filtered, rate, highpass=corner, clipped=np.abs(a) >= limit)
    assert np.abs(found.jump).max(initial=0.0) < 3.0 * np.abs(j).max()


def test_a_pulse_is_learnt_from_clipped_and_ringing_contacts_only() -> None:
    t, j = regular(100)
    a = trace(t, j, seconds=7.0, ring=3000.0)
    limit = 28.0  # half of a contact without its ringing
    clipped = np.abs(a) >= limit
    found = detect_contacts(np.clip(a, -limit, limit), 1e4, highpass=None, clipped=clipped)
    assert found.time.size == 100
    assert found.clipped.all()
    assert found.template is not None
    assert found.template.shape.ring == pytest.approx(0.3, abs=2e-3)
    assert np.abs(found.time - t).max() < 2e-5


def test_close_pairs_do_not_blur_the_pulse() -> None:
    """Four of five impacts have a second one 0.6 to 1.6 ms after; all are found."""
    random = np.random.default_rng(4)
    first = 0.1 + 0.05 * np.arange(100)
    second = (first + random.uniform(0.6e-3, 1.6e-3, 100))[np.arange(100) % 5 != 0]
    t = np.sort(np.concatenate([first, second]))
    found = detect_contacts(trace(t, 0.0146 * np.ones(180), seconds=6.0), 1e4, highpass=None)
    assert found.time.size == 180
    assert np.abs(found.time - t).max() < 3e-5
    assert found.template is not None
    assert found.template.shape.duration == pytest.approx(4.0, rel=0.03)


def test_missing_samples_hide_only_what_lies_in_them() -> None:
    t, j = regular(100)
    a = trace(t, j, seconds=7.0)
    gap = slice(30_000, 32_000)
    a[gap] = np.nan
    found = detect_contacts(a, 1e4, highpass=None)
    hidden = (t > 2.9995) & (t < 3.2005)
    assert found.time.size == (~hidden).sum()
    assert np.abs(found.time - t[~hidden]).max() < 2e-5


def test_edges_of_the_record() -> None:
    t, j = regular(60)
    t = np.concatenate([[0.0004], t, [4.9996]])
    j = np.concatenate([[0.0146], j, [0.0146]])
    found = detect_contacts(trace(t, j, seconds=5.0), 1e4, highpass=None)
    assert found.time.size == 62
    assert np.abs(found.time - t).max() < 2e-5


def test_a_single_impact_is_found_without_anything_to_learn_from() -> None:
    found = detect_contacts(trace([0.5], [0.01], seconds=1.0), 1e4, highpass=None)
    assert found.time.size == 1
    assert abs(found.time[0] - 0.5) < 2e-5
    assert found.confidence[0] > 0.999


def test_confidence_is_the_chance_of_finding_it_again() -> None:
    t, j = regular(400, jump=0.0006)  # a little above the threshold
    seen = [detect_contacts(trace(t, j, seconds=26.0, seed=s), 1e4, highpass=None) for s in (1, 2)]
    again = [np.abs(seen[1].time - one).min() < 5e-4 for one in seen[0].time]
    # selection makes found ones look stronger than they are: a one-sided bound
    assert np.mean(again) <= seen[0].confidence.mean() + 0.05
    assert np.mean(again) > 0.5


def test_boxcars_reach_what_the_highpass_leaves() -> None:
    assert boxcars(2e5)[-1] == 128
    assert boxcars(1700.0, highpass=0.5)[-1] == 512


@pytest.mark.long
def test_memory_does_not_grow_with_the_record() -> None:
    t, j = regular(60)
    piece = trace(t, j, seconds=5.0)

    def read(begin: int, end: int) -> np.ndarray:
        return piece[np.arange(begin, end) % piece.size]

    peaks = []
    for n in (1_000_000, 4_000_000):
        tracemalloc.start()
        found = detect_by_template(Stream(read, n, 1e4), ImpactSettings())
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert found.time.size == 60 * n // piece.size
    assert peaks[1] < 1.1 * peaks[0]
    assert peaks[1] < 60e6


@pytest.mark.slow
def test_an_hour_of_noise_holds_no_impact_but_the_twenty_put_in() -> None:
    size, n = 1 << 20, 36_000_000
    t, j = 1.0 + 180.0 * np.arange(20), np.full(20, 0.0146)

    @lru_cache(maxsize=3)
    def block(k: int) -> np.ndarray:
        inside = (t * 1e4 > k * size) & (t * 1e4 < (k + 1) * size)
        start = k * size * 1e-4
        return trace(t[inside] - start, j[inside], seconds=size * 1e-4, noise=3.0, seed=k)

    def read(begin: int, end: int) -> np.ndarray:
        blocks = range(begin // size, (end - 1) // size + 1)
        parts = [block(k)[max(begin - k * size, 0) : end - k * size] for k in blocks]
        return np.concatenate(parts)

    found = detect_by_template(Stream(read, n, 1e4), ImpactSettings())
    assert found.time.size == 20
    assert np.abs(found.time - t).max() < 5e-5


def test_impacts_whose_ringing_outlasts_the_time_between_them_are_all_found():
    """A mount of 980 Hz and a damping of 1.5 %: each impact rings beyond the next."""
    rate, fine = 5000.0, 20
    t = np.arange(int(0.3 * rate * fine)) / (rate * fine)
    w = 2.0 * np.pi * 980.0
    ring = w * np.exp(-0.015 * w * t) * np.sin(w * t)
    push = np.where(t < 5e-4, np.sin(np.pi * t / 5e-4), 0.0)
    pulse = np.convolve(ring, push)[: t.size]
    pulse /= np.abs(pulse).max()
    rng = np.random.default_rng(2)
    times = 0.05 + 0.061 * np.arange(60) + 2e-4 * rng.standard_normal(60)
    edges = np.arange(-0.5, 20000.5) / rate
    total = np.concatenate([[0.0], np.cumsum(pulse)]) / (rate * fine)
    a = 0.3 * rng.standard_normal(20000)
    for i, at in enumerate(times):
        shown = np.interp(edges - at, np.append(t, t[-1] + t[1]), total, left=0.0)
        a += (-1.0) ** i * 80.0 * np.diff(shown) * rate
    found = detect_contacts(a, rate, highpass=None)
    assert found.time.size == 60
    assert np.ptp(found.time - times) < 1e-4
    assert (found.strength > 50.0).all()
    assert (found.jump_error < 0.05 * np.abs(found.jump)).all()


@pytest.mark.parametrize(("duration", "order"), combined([1e-4, 2.5e-4], [2, 4, 8]))
def test_a_filter_before_sampling_delays_impacts_as_it_delays_slow_motions(
    order: int, duration: float
) -> None:
    """The displacement passes the same filter: then its slope changes at the times of impacts."""
    rate, over, corner = 5e3, 32, 2e3
    t, j = regular(200)
    fine = contact_acceleration(
        t, j, duration=duration, ring=None, ring_damping=0.02, start=0.0, dt=1.0 / (rate * over),
        n=round(14.0 * rate * over),
    )  # fmt: skip
    sos = signal.butter(order, corner, fs=rate * over, output="sos")
    a = signal.sosfilt(sos, fine)[::over]
    a = a + 0.1 * np.random.default_rng(0).standard_normal(a.size)
    found = detect_contacts(a, rate, highpass=None)
    angles = (np.arange(order) + 0.5) * np.pi / order
    delay = np.sin(angles).sum() / (2.0 * np.pi * corner)
    assert found.time.size == 200
    assert abs(np.median(found.time - t) - delay) < 8e-6
    assert np.median(found.jump / j) == pytest.approx(1.0, abs=0.04)


@pytest.mark.long
@pytest.mark.parametrize(("side", "duration"), combined([-1.0, 1.0], [3e-4, 4e-4]))
def test_a_wall_that_rings_beside_the_sensor_makes_no_impacts(side: float, duration: float) -> None:
    """A mode of 900 Hz takes 30 % of the pulses of one wall: its swings were 80 to 290 contacts."""
    t, j = regular(200)
    both, of_wall = (
        trace(t, one, seconds=13.5, rate=4e4, noise=0.0, duration=duration)
        for one in (j, np.where(side * j > 0.0, j, 0.0))
    )
    w = 2.0 * np.pi * 900.0
    ring = signal.lfilter(*signal.bilinear([w * w], [1.0, 0.1 * w, w * w], 4e4), of_wall)
    a = signal.decimate(both + 0.3 * ring, 4, ftype="fir")
    a += 0.1 * np.random.default_rng(0).standard_normal(a.size)
    filtered = zero_phase(a, butterworth(1e4, low=157.0, high=None))
    off = np.abs(detect_contacts(filtered, 1e4, highpass=157.0).time[:, np.newaxis] - t)
    assert (off.min(axis=0) > 5e-4).sum() <= 2
    assert (off.min(axis=1) > 5e-4).sum() <= 3
