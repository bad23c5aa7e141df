"""Drop tests as they are heard: hits that ring for long, fade a hundredfold, or come alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vinesexp.errors import AnalysisError
from vinesexp.identification.bounces import restitution_of_bounces
from vinesexp.records.campaign import Channel, TimeColumn
from vinesexp.records.ingest import read_channels
from vinesexp.records.store import create_record
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.find import impacts_of_record
from vinesexp.signals.impacts.impact_table import Impacts

RATE = 44_100.0
REAL = Path(__file__).resolve().parents[2].parent / "shared/real/shock_in_vibration"


def hits(*, r: float, first: float, count: int, start: float = 0.3) -> np.ndarray:
    """Times of the hits of a ball whose first flight lasts `first` s."""
    return start + first * np.concatenate([[0.0], np.cumsum(r ** np.arange(count - 1))])


def heard(
    times: np.ndarray, *, seconds: float, fade: float, rate: float = RATE, seed: int = 0,
    modes: tuple[tuple[float, float], ...] = ((870.0, 0.035), (2310.0, 0.020), (4170.0, 0.012)),
    noise: float = 3e-4, hum: float = 2e-3,
) -> np.ndarray:  # fmt: skip
    """A microphone: every hit excites modes (Hz, decay time s) with phases and shares of its own.

    The last hit is `fade` times weaker than the first; there are hum and room noise.
    """
    random = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate)) / rate
    sound = noise * random.standard_normal(t.size)
    sound += hum * np.sin(2 * np.pi * 50.0 * t) + 0.4 * hum * np.sin(2 * np.pi * 150.0 * t + 1.0)
    size = fade ** (-np.arange(times.size) / max(times.size - 1, 1))
    for time, one in zip(times, size, strict=True):
        s = t - time
        on = (s >= 0.0) & (s < 0.6)
        late = s[on]
        for frequency, decay in modes:
            share = one * random.uniform(0.4, 1.0)
            phase = random.uniform(0.0, 2 * np.pi)
            rise = 1.0 - np.exp(-late / 1e-4)
            ring = rise * np.exp(-late / decay) * np.sin(2 * np.pi * frequency * late + phase)
            sound[on] += share * ring
    return sound


def found_in(
    x: np.ndarray, folder: Path, *, rate: float = RATE, role: str = "acceleration"
) -> Impacts:
    kinds = {role: "acceleration" if role == "acceleration" else "displacement"}
    attributes = {"record": "drop", "test": "drop"}
    with create_record(
        folder / "r.nc", sample_rate=rate, quantities=kinds, attributes=attributes
    ) as writer:
        writer.append({role: x})
    condition(folder / "r.nc", folder / "c.nc")
    return impacts_of_record(folder / "r.nc", folder / "c.nc", folder / "i.csv", test="drop")


@pytest.mark.parametrize("seed", range(6))
def test_ten_hits_that_ring_and_fade_a_hundredfold(seed: int, tmp_path: Path) -> None:
    times = hits(r=0.81, first=1.1, count=10)
    found = found_in(heard(times, seconds=7.0, fade=100.0, seed=seed), tmp_path)
    assert found.n == times.size
    late = found.time_s - times
    assert np.abs(late - np.median(late)).max() < 3e-4
    bounces = restitution_of_bounces(found.time_s, found.time_error_s)
    assert abs(bounces.r - 0.81) < max(4.0 * bounces.error, 2e-4)
    assert bounces.error < 2e-3


@pytest.mark.parametrize("role", ["acceleration", "displacement", "base"])
def test_any_channel_serves(role: str, tmp_path: Path) -> None:
    times = hits(r=0.7, first=0.6, count=6)
    found = found_in(heard(times, seconds=3.0, fade=20.0), tmp_path, role=role)
    assert found.n == times.size


def test_the_scale_of_the_channel_does_not_matter(tmp_path: Path) -> None:
    times = hits(r=0.7, first=0.6, count=6)
    sound = heard(times, seconds=3.0, fade=20.0)
    one, other = (found_in(k * sound, tmp_path) for k in (1.0, 1e-4))
    np.testing.assert_allclose(one.time_s, other.time_s, atol=1e-7)


@pytest.mark.parametrize("decay", [0.03, 0.1, 0.3])
def test_one_shock_with_its_ringing_is_one_and_gives_no_r(decay: float, tmp_path: Path) -> None:
    modes = ((140.0, decay), (610.0, 0.6 * decay))
    shock = heard(np.array([1.0]), seconds=4.0, fade=1.0, rate=10e3, modes=modes)
    found = found_in(shock, tmp_path, rate=10e3)
    assert found.n == 1
    assert found.time_s[0] == pytest.approx(1.0, abs=2e-3)
    with pytest.raises(AnalysisError):
        restitution_of_bounces(found.time_s, found.time_error_s)


def test_noise_and_hum_hold_no_hit(tmp_path: Path) -> None:
    assert found_in(heard(np.empty(0), seconds=5.0, fade=1.0), tmp_path).n == 0


@pytest.mark.skipif(not REAL.is_dir(), reason="no ../shared/real beside the repository")
@pytest.mark.parametrize("column", ["accelerometer_board", "accelerometer_base"])
@pytest.mark.parametrize("name", ["impact_0.5_vibration_0.0", "impact_1_vibration_0.0"])
def test_a_real_shock_taken_for_a_drop_gives_no_r(name: str, column: str, tmp_path: Path) -> None:
    role = Channel("acceleration", column, "acceleration", 9.80665, unit="g", sensitivity=False)
    times = TimeColumn("time", "s", 1.0)
    rate, _, values = read_channels(REAL / f"{name}.lvm", {"acceleration": role}, time=times)
    found = found_in(np.asarray(values["acceleration"]), tmp_path, rate=rate)
    with pytest.raises(AnalysisError):
        restitution_of_bounces(found.time_s, found.time_error_s)
