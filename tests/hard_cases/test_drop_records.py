"""Drop tests as they are heard: hits that ring for long, fade a hundredfold, or come alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.combined import combined, leading

from vinesexp.errors import AnalysisError
from vinesexp.identification.bounces import restitution_of_bounces
from vinesexp.records.campaign.schema import Channel, Setup, TimeColumn
from vinesexp.records.instrument.ingest import read_channels
from vinesexp.records.stored.store import RecordWriter
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
        on = slice(*np.searchsorted(t, (time, time + 0.6)))
        late = t[on] - time
        rise = 1.0 - np.exp(-late / 1e-4)
        for frequency, decay in modes:
            share = one * random.uniform(0.4, 1.0)
            phase = random.uniform(0.0, 2 * np.pi)
            ring = rise * np.exp(-late / decay) * np.sin(2 * np.pi * frequency * late + phase)
            sound[on] += share * ring
    return sound


def found_in(
    x: np.ndarray, folder: Path, *, rate: float = RATE, role: str = "acceleration"
) -> Impacts:
    kinds = {role: "acceleration" if role == "acceleration" else "displacement"}
    attributes = {"record": "drop", "test": "drop"}
    with RecordWriter(
        folder / "r.nc", sample_rate=rate, quantities=kinds, attributes=attributes
    ) as writer:
        writer.append({role: x})
    condition(folder / "r.nc", folder / "c.nc")
    return impacts_of_record(folder / "r.nc", folder / "c.nc", folder / "i.csv", test="drop")


@pytest.mark.parametrize("seed", leading(3, range(6)))
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


@pytest.mark.long
@pytest.mark.skipif(not REAL.is_dir(), reason="no ../shared/real beside the repository")
@pytest.mark.parametrize("column", ["accelerometer_board", "accelerometer_base"])
@pytest.mark.parametrize("name", ["impact_0.5_vibration_0.0", "impact_1_vibration_0.0"])
def test_a_real_shock_taken_for_a_drop_gives_no_r(name: str, column: str, tmp_path: Path) -> None:
    role = Channel("acceleration", column, "acceleration", 9.80665, unit="g", sensitivity=False)
    times = TimeColumn("time", "s", 1.0)
    rate, _, values = read_channels(REAL / f"{name}.lvm", Setup({"acceleration": role}, time=times))
    found = found_in(np.asarray(values["acceleration"]), tmp_path, rate=rate)
    with pytest.raises(AnalysisError):
        restitution_of_bounces(found.time_s, found.time_error_s)


def speech(x: np.ndarray, begin: float, end: float, random: np.random.Generator) -> None:
    """Add syllables between two times: voiced or hissing, each with a beginning of its own."""
    time = begin
    while time < end:
        t = np.arange(round(random.uniform(0.06, 0.3) * RATE)) / RATE
        first = round(time * RATE)
        pitch = random.uniform(100.0, 220.0) * t + random.uniform(0.0, 1.0)
        voice = sum(np.sin(2 * np.pi * k * pitch) / k**0.7 for k in range(1, 25))
        sound = voice if random.random() < 0.7 else 1.5 * random.standard_normal(t.size)
        rise = np.minimum(1.0, t / random.uniform(0.005, 0.04))
        fall = np.minimum(1.0, (t[-1] - t) / 0.03)
        x[first : first + t.size] += random.uniform(0.1, 0.3) * rise * fall * sound
        time += t[-1] + random.uniform(0.0, 0.25)


@pytest.mark.long
@pytest.mark.parametrize(("between", "seed"), combined(["speech", "bumps"], range(3)))
def test_what_is_heard_beside_a_drop_gives_no_wrong_r(
    between: str, seed: int, tmp_path: Path
) -> None:
    random = np.random.default_rng(seed)
    drop = hits(r=0.72, first=0.6, count=7, start=4.0)
    for there in (True, False):  # the drop, and without it
        times = drop if there else np.empty(0)
        x = heard(times, seconds=12.0, fade=30.0 if there else 1.0, seed=seed)
        if between == "speech":
            speech(x, 0.3, 3.7, random)
            speech(x, 6.3, 11.4, random)
        else:
            put = np.sort(np.append(random.uniform(0.3, 3.7, 6), random.uniform(6.3, 11.5, 9)))
            x += heard(put, seconds=12.0, fade=1.0, seed=seed + 50, noise=0.0, hum=0.0)
        found = found_in(x, tmp_path)
        if there:
            bounces = restitution_of_bounces(found.time_s, found.time_error_s)
            assert abs(bounces.r - 0.72) < max(4.0 * bounces.error, 5e-4)
            continue
        with pytest.raises(AnalysisError):
            restitution_of_bounces(found.time_s, found.time_error_s)


def test_drops_on_several_surfaces_have_no_r_in_common(tmp_path: Path) -> None:
    times = np.concatenate([
        hits(r=0.81, first=0.7, count=7, start=0.4), hits(r=0.6, first=0.5, count=6, start=5.0),
    ])  # fmt: skip
    found = found_in(heard(times, seconds=8.0, fade=20.0), tmp_path)
    with pytest.raises(AnalysisError, match=r"2 drops with different r \(0\.81.* 0\.6"):
        restitution_of_bounces(found.time_s, found.time_error_s)


def test_drops_on_one_surface_give_their_mean(tmp_path: Path) -> None:
    starts = ((0.4, 0.7), (4.0, 0.5), (7.0, 0.6))
    times = np.concatenate([hits(r=0.7, first=T, count=7, start=t) for t, T in starts])
    found = found_in(heard(times, seconds=10.0, fade=10.0), tmp_path)
    bounces = restitution_of_bounces(found.time_s, found.time_error_s)
    assert bounces.count == times.size
    assert abs(bounces.r - 0.7) < max(4.0 * bounces.error, 2e-4)
