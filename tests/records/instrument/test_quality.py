"""Clipped, frozen and short records are found; honest quantised ones pass."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.combined import combined

from vinesexp.records.instrument import findings
from vinesexp.records.stored.store import RecordWriter, open_record

F = 7.862
MOTIONS = {
    "steady": lambda t: np.sin(2 * np.pi * F * t),
    "decay": lambda t: np.exp(-0.3 * t) * np.cos(2 * np.pi * F * t),
    "beat": lambda t: np.sin(2 * np.pi * F * t) * np.sin(2 * np.pi * 0.1 * t),
    "gone": lambda t: np.exp(-2.0 * t) * np.cos(2 * np.pi * F * t),
    "held": lambda t: np.where(
        t < 2, 1.0, np.exp(-0.3 * (t - 2)) * np.cos(2 * np.pi * F * (t - 2))
    ),
}


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    folder = tmp_path_factory.mktemp("quality")

    def make(values, rate, role="displacement"):
        quantities = {role: "acceleration" if role == "acceleration" else "displacement"}
        with RecordWriter(folder / "a.nc", sample_rate=rate, quantities=quantities) as writer:
            writer.append({role: values})
        return open_record(folder / "a.nc")

    return make


def digitised(motion, rate, bits, noise, *, clip=None, seconds=20.0, seed=0):
    """A motion of 20 mm through a converter of a range of 50 mm, with noise in quanta."""
    t = np.arange(int(seconds * rate)) / rate
    quantum = 50.0 / 2**bits
    values = 20.0 * MOTIONS[motion](t)
    values += noise * quantum * np.random.default_rng(seed).standard_normal(len(t))
    if clip is not None:
        values = np.clip(values, -20.0 * clip, 20.0 * clip)
    return np.round(values / quantum) * quantum * 1e-3


@pytest.mark.parametrize(
    ("motion", "rate", "bits", "noise"),
    combined(MOTIONS, [100.0, 1e3, 1e4], [8, 12, 16, 24], [0.0, 0.3, 3.0]),
)
def test_an_honest_record_passes(motion, rate, bits, noise, stored):
    seconds = 20.0 if rate < 1e4 else 10.0  # one beat
    with stored(digitised(motion, rate, bits, noise, seconds=seconds), rate) as view:
        assert findings.saturated(view, "displacement") == []
        assert findings.frozen(view, "displacement", period=rate / F) == []


@pytest.mark.parametrize("held", [10, 14])
def test_a_crest_that_stays_in_one_quantum_by_chance_is_no_value_that_was_kept(held, stored):
    """A sensor was said to be off for 2 ms where the mass turned; a value kept on its way is."""
    rate, quantum = 5e3, 5e-6
    t = np.arange(20_000) / rate
    x = np.sin(2.0 * np.pi * F * t) / quantum * 7e-3
    x = np.round(x + 0.3 * np.random.default_rng(2).standard_normal(t.size))
    crest = int(np.argmin(np.abs(t - 20.25 / F)))
    x[crest - held // 2 : crest + held // 2] = x.max() - 3.0
    x[crest + held // 2 : crest + held // 2 + 2] = x.max() - [8.0, 4.0]
    with stored(quantum * x, rate) as view:
        assert findings.frozen(view, "displacement", period=rate / F) == []
    middle = int(np.argmin(np.abs(t - 20.0 / F)))
    x[middle : middle + held] = x[middle]
    with stored(quantum * x, rate) as view:
        found = findings.frozen(view, "displacement", period=rate / F)
    assert found == [(middle, middle + held)]


@pytest.mark.parametrize("motion", ["steady", "decay", "beat"])
@pytest.mark.parametrize(
    ("rate", "bits", "noise", "clip"),
    [(1e4, 16, 1.0, 0.97), (1e4, 12, 0.3, 0.97), (1e4, 8, 0.3, 0.9), (1e3, 12, 0.5, 0.97)],
)
def test_clipped_peaks_are_found(motion, rate, bits, noise, clip, stored):
    values = digitised(motion, rate, bits, noise, clip=clip)
    with stored(values, rate) as view:
        found = findings.saturated(view, "displacement")
    assert found
    for run in found:
        stretch = values[run[0] : run[1]]
        assert np.ptp(stretch) == 0.0
        assert abs(stretch[0]) >= 0.99 * np.abs(values).max()


def of_three_digits(values):
    """A file that prints millimetres with three digits, as metres."""
    return np.array([float(f"{value:.3g}") for value in 1e3 * values]) * 1e-3


@pytest.mark.parametrize("size", [0.59, 0.78, 1.9])
@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_file_of_three_digits_is_not_clipped(size, noise, stored):
    values = of_three_digits(size * digitised("decay", 5e3, 16, noise, seconds=8.0))
    with stored(values, 5e3) as view:
        assert findings.saturated(view, "displacement") == []


def test_clipped_peaks_of_a_file_of_three_digits_are_found(stored):
    values = of_three_digits(digitised("steady", 5e3, 16, 1.0, clip=0.9, seconds=8.0))
    with stored(values, 5e3) as view:
        assert len(findings.saturated(view, "displacement")) > 100


def test_clipped_spikes_of_an_accelerometer_are_found(stored):
    rng = np.random.default_rng(1)
    t = np.arange(100_000) / 1e4
    spikes = np.zeros_like(t)
    for at in np.arange(0.1, 9.9, 0.0636):
        shape = np.exp(-(((t - at) * 3000.0) ** 2))
        spikes += shape * rng.uniform(50.0, 150.0)
    values = np.round((spikes + 0.1 * rng.standard_normal(len(t))) / 0.01) * 0.01
    with stored(values, 1e4, "acceleration") as view:
        assert findings.saturated(view, "acceleration") == []
    with stored(np.minimum(values, 100.0), 1e4, "acceleration") as view:
        assert len(findings.saturated(view, "acceleration")) > 10


@pytest.mark.parametrize(
    ("samples", "zeta", "digits", "role"),
    combined([6, 12, 20, 200], [0.01, 0.05, 0.2], [3, 5], ["displacement", "acceleration"]),
)
def test_a_decay_without_noise_that_comes_to_rest_is_not_frozen(
    samples, zeta, digits, role, stored
):
    t = np.arange(100 * samples) / samples  # periods
    values = np.exp(-2.0 * np.pi * zeta * t) * np.cos(2.0 * np.pi * t + 0.3)
    with stored(0.02 * np.round(values, digits), 1e3, role) as view:
        period = samples if role == "displacement" else None
        assert findings.frozen(view, role, period=period) == []


def whole_numbers(n=250):
    """A strongly damped decay as a ruler in steps of 2 mm shows it, at 100 Hz."""
    t = np.arange(n) / 100.0
    return 2e-3 * np.round(35.0 * np.exp(-2.9 * t) * np.cos(18.0 * t))


def test_a_strongly_damped_decay_in_whole_numbers_comes_to_rest(stored):
    with stored(whole_numbers(), 100.0) as view:
        assert findings.frozen(view, "displacement", period=35.0) == []


@pytest.mark.parametrize("at", [20, 34, 52, 70])
def test_a_strongly_damped_decay_that_stops_in_its_midst_is_frozen(at, stored):
    values = np.concatenate([whole_numbers(n=150), whole_numbers(n=at), np.zeros(200)])
    values[150 + at :] = values[150 + at - 1]
    with stored(values, 100.0) as view:
        assert findings.frozen(view, "displacement", period=35.0)[-1][0] <= 150 + at


@pytest.mark.parametrize(
    ("quanta", "zeta", "samples"), [(12.0, 0.15, 18.0), (66.0, 0.25, 18.0), (285.0, 0.15, 8.0)]
)
def test_a_held_mass_that_is_let_go_and_dies_out_at_once_is_not_frozen(
    quanta, zeta, samples, stored
):
    """Within a period and a half a motion that damping strongly takes is within two quanta."""
    w, since = 2.0 * np.pi / samples, np.maximum(np.arange(1100.0) - 100.0, 0.0)
    values = np.round(quanta * np.exp(-zeta * w * since) * np.cos(w * since))
    with stored(1e-5 * values, 1e3) as view:
        assert findings.frozen(view, "displacement", period=samples) == []
        assert findings.frozen(view, "displacement", period=None) == []


def test_a_slow_swing_that_stops_at_its_turning_point_is_frozen(stored):
    """Towards the turning point the steps shrink as in a decay, but it is no place of rest."""
    k = 6 * 300 + 75
    values = np.round(40.0 * np.sin(2.0 * np.pi * np.minimum(np.arange(3000.0), k) / 300.0))
    with stored(1e-5 * values, 1e3) as view:
        ((begin, end),) = findings.frozen(view, "displacement", period=None)
    assert abs(begin - k) < 10
    assert end == 3000


@pytest.mark.parametrize(("bits", "noise"), [(16, 1.0), (12, 0.3), (8, 0.3), (8, 0.0), (24, 3.0)])
@pytest.mark.parametrize("rate", [100.0, 1e4])
def test_a_frozen_stretch_is_found_where_it_is(bits, noise, rate, stored):
    values = digitised("steady", rate, bits, noise)
    start, length = int(5.03 * rate), int(1.5 * rate)
    values[start : start + length] = values[start]
    with stored(values, rate) as view:
        (run,) = findings.frozen(view, "displacement", period=rate / F)
    # The neighbours may happen to have the same value: up to a plateau of the sine.
    assert start - 0.1 * rate < run[0] <= start
    assert start + length <= run[1] < start + length + 0.1 * rate


def test_a_channel_that_never_moves_is_frozen_and_not_saturated(stored):
    with stored(np.full(1000, 0.3), 100.0) as view:
        assert findings.saturated(view, "displacement") == []
        (run,) = findings.frozen(view, "displacement", period=None)
    assert run == (0, 1000)


def test_a_quiet_sensor_between_shocks_is_not_frozen(stored):
    # Noise below one quantum: between the bounces of a ball, a scope shows one value.
    values = np.zeros(50_000)
    for at in (5_000, 20_000, 30_000, 37_000):
        values[at : at + 30] = 10.0 * np.random.default_rng(at).standard_normal(30)
    with stored(values, 1e4, "acceleration") as view:
        assert findings.frozen(view, "acceleration", period=None) == []


def test_a_ringing_that_dies_out_before_the_next_impact_is_not_frozen(stored):
    """An impact leaps away from the rest before it, which passed for a sensor that was stuck."""
    n = np.arange(200)
    ringing = np.round(40.0 * np.exp(-n / 15.0) * np.cos(2.0 * np.pi * n / 7.0))
    with stored(np.tile(ringing, 12), 1000.0, "acceleration") as view:
        assert findings.frozen(view, "acceleration", period=None) == []


def test_frozen_noise_is_found_without_knowing_a_period(stored):
    values = np.round(np.random.default_rng(2).standard_normal(50_000) * 5.0)
    values[30_000:30_200] = values[30_000]
    with stored(values, 1e4, "acceleration") as view:
        (run,) = findings.frozen(view, "acceleration", period=None)
    assert abs(run[0] - 30_000) <= 3


@pytest.mark.long
@given(
    held=st.floats(0.3, 12.0),
    phase=st.floats(0.0, 6.28),
    drift=st.floats(-1.0, 1.0),
)
@settings(max_examples=60, deadline=None)
def test_periods_are_counted(held, phase, drift, stored):
    t = np.arange(int(held / F * 1e4)) / 1e4
    values = np.sin(2 * np.pi * F * t + phase) + drift * t * F / held
    values += 1e-3 * np.random.default_rng(0).standard_normal(len(t))
    with stored(values, 1e4) as view:
        found = findings.periods(view, "displacement")
    if held < 1.6:
        assert found < 2.0
    elif held > 2.4:
        assert found >= 2.0
        assert found == pytest.approx(held, rel=0.25)


def test_runs_are_found_across_blocks(stored, monkeypatch):
    monkeypatch.setattr(findings, "_BLOCK", 16)
    rng = np.random.default_rng(5)
    lengths = rng.integers(1, 40, 60)
    values = np.repeat(np.arange(60.0), lengths)
    starts = np.cumsum(lengths) - lengths
    with stored(values, 100.0) as view:
        blocks = list(findings.equal_runs(view, "displacement", least=5))
    found = [run for runs in blocks for run in runs.stretches(runs.lengths > 0)]
    pairs = zip(starts.tolist(), (starts + lengths).tolist(), strict=True)
    expected = [pair for pair in pairs if pair[1] - pair[0] >= 5]
    assert found == expected
    kept = np.concatenate([runs.values for runs in blocks])
    np.testing.assert_array_equal(kept, np.flatnonzero(lengths >= 5))
