"""The oscillation of a record: found in any one channel, and never in its noise."""

from pathlib import Path

import numpy as np
import pytest
from tests.combined import combined

from vinesexp.errors import AnalysisError
from vinesexp.records.stored.store import RecordWriter, open_record
from vinesexp.signals.condition import condition
from vinesexp.signals.filters import default_bands, dominant_frequency, oscillation_of


def decay(rate: float, *, f0: float = 10e3, seconds: float = 0.02, seed: int = 0):
    """Velocity of a ring-down of some tens of periods, with noise that is white far beyond it."""
    t = np.arange(round(seconds * rate)) / rate
    noise = 0.02 * np.random.default_rng(seed).standard_normal(t.size)
    return np.exp(-120.0 * t) * np.cos(2 * np.pi * f0 * t) + noise


@pytest.mark.parametrize("rate", [1e5, 1e6, 1e7])
def test_white_noise_at_high_rates_does_not_win(rate: float) -> None:
    assert dominant_frequency(decay(rate), rate) == pytest.approx(10e3, rel=5e-3)


@pytest.mark.parametrize(("seed", "n"), combined(range(20), [64, 1000, 100_000]))
def test_noise_alone_oscillates_nowhere(n: int, seed: int) -> None:
    x = np.random.default_rng(seed).standard_normal(n)
    with pytest.raises(AnalysisError, match="no oscillation is above its noise"):
        dominant_frequency(x, 1000.0)


@pytest.mark.parametrize("seed", range(5))
def test_a_wandering_sensor_oscillates_nowhere(seed: int) -> None:
    x = np.cumsum(np.random.default_rng(seed).standard_normal(50_000))
    with pytest.raises(AnalysisError):
        dominant_frequency(x, 1000.0)


@pytest.mark.parametrize("own", [445.0, 1000.0, 2500.0])
@pytest.mark.parametrize("rate", [5e3, 1e4, 51200.0])
def test_steps_of_a_sensor_that_holds_its_value_are_no_oscillation(own: float, rate: float) -> None:
    t = np.floor(np.arange(round(6.0 * rate)) / rate * own) / own
    x = np.exp(-0.2 * t) * np.cos(2 * np.pi * 7.9 * t)
    assert dominant_frequency(x, rate) == pytest.approx(7.9, abs=0.02)


def test_a_line_of_hum_in_an_acceleration_of_other_things_is_no_oscillation() -> None:
    """It stands out of the noise, and holds next to nothing of the velocity."""
    t = np.arange(20_000) / 1000.0
    hum = np.cos(2 * np.pi * 50.0 * t)
    noise = np.random.default_rng(0).standard_normal(t.size)
    alone = dominant_frequency(hum + 0.1 * noise, 1000.0, quantity="acceleration")
    assert alone == pytest.approx(50.0, abs=0.01)
    with pytest.raises(AnalysisError, match="no oscillation"):
        dominant_frequency(0.2 * hum + noise, 1000.0, quantity="acceleration")


def record_with(folder: Path, channels: dict[str, np.ndarray], *, rate: float, test: str) -> Path:
    kinds = {
        role: "acceleration" if role == "acceleration" else "displacement" for role in channels
    }
    path = folder / "r.nc"
    with RecordWriter(
        path, sample_rate=rate, quantities=kinds, attributes={"record": "r", "test": test}
    ) as writer:
        writer.append(channels)
    return path


@pytest.mark.parametrize("role", ["displacement", "acceleration", "base"])
def test_any_one_channel_suffices(role: str, tmp_path: Path) -> None:
    rate, f0, zeta = 2000.0, 7.9, 0.006
    t = np.arange(40_000) / rate
    w = 2 * np.pi * f0
    x = 0.02 * np.exp(-zeta * w * t) * np.cos(w * t)
    random = np.random.default_rng(1)
    value = -w * w * x if role == "acceleration" else x
    value = value + 0.01 * np.abs(value).max() * random.standard_normal(t.size)
    path = record_with(tmp_path, {role: value}, rate=rate, test="ringdown")
    with open_record(path) as record:
        assert oscillation_of(record) == pytest.approx(f0, rel=2e-3)


def test_a_drop_test_has_no_oscillation_and_no_band_beyond_what_was_sampled(tmp_path: Path) -> None:
    rate = 1e4
    random = np.random.default_rng(2)
    ringing = np.exp(-np.arange(30_000) % 3000 / 200.0) * np.sin(np.arange(30_000) * 1.2)
    channels = {
        "displacement": 1e-6 * random.standard_normal(30_000),
        "acceleration": ringing + 0.01 * random.standard_normal(30_000),
    }
    path = record_with(tmp_path, channels, rate=rate, test="drop")
    bands = condition(path, tmp_path / "c.nc")
    assert bands is not None
    assert bands.frequency is None
    assert bands.displacement[1] is None
    assert bands.acceleration == (100.0, None)


def test_no_band_ends_beyond_the_nyquist_frequency() -> None:
    assert default_bands(sample_rate=1e4, frequency=1500.0).displacement == (375.0, None)
