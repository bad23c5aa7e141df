"""The oscilloscope: converter, clocks, lost samples, and random streams that do not disturb."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.laboratory.oscilloscope import (
    Oscilloscope,
    acquire,
    quantised,
    stream,
)
from vinesexp.laboratory.sensors import Accelerometer, Laser


def still(times=(), jumps=()):
    """A motion that moves at a constant speed and has the given impacts."""
    jumps = np.array(jumps, dtype=float)
    return SimpleNamespace(
        impacts={
            "time": np.array(times, dtype=float),
            "v_before": np.zeros(jumps.size),
            "v_after": jumps,
        },
        at=lambda t: (1e-3 * t, np.full_like(t, 1e-3)),
        acceleration=np.zeros_like,
        base=lambda t: (np.zeros_like(t), np.zeros_like(t)),
    )


LASERS = {"base": Laser(400.0, noise=2e-6), "displacement": Laser(40.0, noise=6e-6)}


def record(sensors=LASERS, scope=None, name="a", motion=None, start=0.0, seed=1):
    scope = scope or Oscilloscope(1e4)
    return acquire(
        motion or still(), sensors, scope, start=start, duration=5.0, seed=seed, record=name
    )


@settings(deadline=None, max_examples=50)
@given(bits=st.integers(2, 16), volts=st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=50))
def test_converter_is_right_to_half_a_step_and_clips(bits, volts):
    scope = Oscilloscope(1e4, bits=bits, full_scale=1.0)
    volts = np.array(volts)
    shown = quantised(volts, scope) * scope.step
    top = 1.0 - scope.step
    expected = np.clip(volts, -1.0, top)
    assert np.abs(shown - expected).max() <= 0.5 * scope.step * (1.0 + 1e-12)


@pytest.mark.long
def test_a_block_boundary_leaves_no_trace(monkeypatch):
    sensors = {
        **LASERS,
        "displacement": Laser(40.0, noise=6e-6, drift=5e-5, drift_time=3.0, bandwidth=500.0),
        "acceleration": Accelerometer(2e-3, pulse=4e-4, noise=0.3, ring=3000.0, ring_damping=0.1),
    }
    hits = still(times=np.linspace(0.01, 4.9, 700), jumps=np.full(700, 0.02))
    whole = record(sensors, motion=hits)
    monkeypatch.setattr("vinesexp.laboratory.oscilloscope._BLOCK", 777)
    pieces = record(sensors, motion=hits)
    # sample times are the same numbers; only a sum's order can differ in the last bit
    assert np.abs(whole.codes.astype(int) - pieces.codes).max() <= 1
    assert np.mean(whole.codes != pieces.codes) < 1e-4


def test_same_seed_same_codes_and_other_seed_or_record_others():
    first = record().codes
    np.testing.assert_array_equal(first, record().codes)
    assert np.any(first != record(seed=2).codes)
    assert np.any(first != record(name="b").codes)


def test_a_further_channel_or_fault_changes_no_other_channel():
    alone = record().codes
    more = record({**LASERS, "acceleration": Accelerometer(2e-3, pulse=4e-4, noise=0.3)}).codes
    np.testing.assert_array_equal(alone, more[:2])
    drifting = {"base": LASERS["base"], "displacement": Laser(40.0, noise=6e-6, drift=1e-3)}
    changed = record(drifting).codes
    np.testing.assert_array_equal(alone[0], changed[0])
    assert np.any(alone[1] != changed[1])


def test_skew_and_clock_error_shift_the_samples_of_their_channel():
    quiet = {"base": Laser(400.0), "displacement": Laser(1e5)}
    scope = Oscilloscope(1e3, bits=16, full_scale=1e3, skew={"displacement": 0.25})
    late = record(quiet, scope).codes[1] * scope.step
    # 1e5 V/m times 1e-3 m/s: 100 V/s
    assert late[:3] == pytest.approx([25.0, 25.1, 25.2], abs=scope.step)
    fast = Oscilloscope(1e3, bits=16, full_scale=1e3, clock_error=0.01)
    shown = record(quiet, fast).codes[1] * fast.step
    assert shown[4000] == pytest.approx(100.0 * 4.04, abs=fast.step)
    # what runs past the end of the motion shows its last value
    assert late[-1] == pytest.approx(500.0, abs=scope.step)


def test_a_record_may_begin_late():
    quiet = {"displacement": Laser(1e5)}
    scope = Oscilloscope(1e3, bits=16, full_scale=1e4)
    assert record(quiet, scope, start=20.0).codes[0, 0] * scope.step == pytest.approx(
        2000.0, abs=scope.step
    )


def test_dropped_samples_are_missing_and_known():
    whole = record()
    lossy = record(scope=Oscilloscope(1e4, dropped_samples=7))
    assert lossy.codes.shape == (2, whole.codes.shape[1] - 7)
    assert lossy.ticks[0] == 0
    assert lossy.ticks[-1] == whole.codes.shape[1] - 1
    np.testing.assert_array_equal(lossy.codes, whole.codes[:, lossy.ticks])


def test_no_accelerometer_no_pulses(monkeypatch):
    def never(*args, **kwargs):
        raise AssertionError("a pulse was computed")

    monkeypatch.setattr("vinesexp.laboratory.sensors.contact_acceleration", never)
    record(motion=still(times=[1.0], jumps=[0.02]))


def test_streams_are_independent():
    a = stream(1, "rec", "base", "noise").standard_normal(20000)
    b = stream(1, "rec", "base", "drift").standard_normal(20000)
    # 1/sqrt(20000) = 0.007
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.035
