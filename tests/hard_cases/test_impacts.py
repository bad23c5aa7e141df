"""What a finder of impacts gets wrong first: coarse, broken, crowded and cut records."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from benchmarks.streams import stream_of
from tests.signals.contacts import coarsen

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.laboratory.oscilloscope import Oscilloscope, acquire
from vinesexp.laboratory.sensors import Accelerometer, Laser
from vinesexp.records.stored.store import RecordWriter
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.detection import Detection, detect_by_template
from vinesexp.signals.impacts.find import impacts_of_record
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.signals.impacts.matching import State, less, seen_lags, settle
from vinesexp.signals.impacts.slopes import Coarse, joined, slope_changes
from vinesexp.signals.impacts.template import Shape, template_of

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
BASE = Harmonic(0.25e-3, 7.862)
RATE = 1e4
SAMPLE = 1.0 / RATE
CONTACT = 4e-4


@dataclass
class Measured:
    """Channels in SI and the truth, times from the first sample."""

    channels: dict[str, np.ndarray]
    time: np.ndarray
    jump: np.ndarray


def measured(*, b=0.030, r=0.6, start=10.0, duration=8.0, bits=14, noise=1.0, limit=250.0):
    """A record of the rig of Table 2, driven; `start` seconds after it was switched on."""
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=b, r=r)])
    motion = simulate(rig, BASE, Release(y0=[-0.999 * b]), duration=start + duration)
    sensors = {
        "displacement": Laser(sensitivity=1 / 25e-3, noise=6e-6 * noise),
        "acceleration": Accelerometer(sensitivity=1 / limit, pulse=CONTACT, noise=0.3 * noise),
    }
    scope = Oscilloscope(RATE, bits=bits)
    trace = acquire(motion, sensors, scope, start=start, duration=duration, seed=3, record="hard")
    channels = {
        role: trace.codes[i] * (scope.step / sensor.sensitivity)
        for i, (role, sensor) in enumerate(sensors.items())
    }
    time, jump = (
        np.asarray(motion.impacts["time"]) - start,
        motion.impacts["v_after"] - motion.impacts["v_before"],
    )
    inside = (time > 0.0) & (time < duration)
    return Measured(channels, time[inside], jump[inside])


def found_in(channels: dict[str, np.ndarray], folder: Path, *, frequency: float = 7.862) -> Impacts:
    """The whole way from a record on disk to its table of impacts."""
    kinds = {role: role for role in channels}
    with RecordWriter(folder / "r.nc", sample_rate=RATE, quantities=kinds) as writer:
        writer.append(channels)
    condition(folder / "r.nc", folder / "c.nc", f0_hint=frequency)
    return impacts_of_record(folder / "r.nc", folder / "c.nc", folder / "i.csv", clearance=(0.03,))


def assert_whole(found: Impacts, time: np.ndarray, *, within: float = 5e-6) -> None:
    """Every impact, no other, each in its place."""
    assert found.n == time.size
    assert np.abs(found.time_s - time).max() < within


@pytest.mark.long
def test_eight_bits(tmp_path: Path) -> None:
    record = measured(bits=8, duration=4.0)  # a step of 2 m/s^2 under contacts of 55
    found = found_in(record.channels, tmp_path)
    assert_whole(found, record.time, within=0.2 * SAMPLE)
    assert (np.sign(found.velocity_jump_m_s) == np.sign(record.jump)).all()
    pull = (found.time_s - record.time) / found.time_error_s
    assert pull.std() < 1.6  # the step is the noise, and is said to be


@pytest.mark.long
def test_five_per_cent_of_the_samples_missing(tmp_path: Path) -> None:
    record = measured(duration=2.5)
    lost = np.random.default_rng(5).random(record.channels["acceleration"].size) < 0.05
    for role in record.channels:
        record.channels[role] = np.where(lost, np.nan, record.channels[role])
    found = found_in(record.channels, tmp_path)
    assert_whole(found, record.time, within=SAMPLE)
    assert np.median(np.abs(found.time_s - record.time)) < 5e-6


@pytest.mark.long
def test_mains_hum_above_the_noise(tmp_path: Path) -> None:
    record = measured(duration=4.0)
    t = np.arange(record.channels["acceleration"].size) / RATE
    for harmonic, size in ((1, 6.0), (2, 1.0), (3, 3.0), (5, 1.5), (7, 0.8)):  # noise: 0.3
        record.channels["acceleration"] += size * np.sin(2 * np.pi * 50.0 * harmonic * t + harmonic)
    found = found_in(record.channels, tmp_path)
    assert_whole(found, record.time, within=SAMPLE)


@pytest.mark.parametrize("r", [0.02, 0.97])
def test_restitution_at_its_ends(r: float, tmp_path: Path) -> None:
    record = measured(r=r)
    found = found_in(record.channels, tmp_path)
    apart = np.diff(record.time, prepend=-1.0) > CONTACT
    apart &= np.diff(record.time, append=1e9) > CONTACT
    clear = apart & (np.abs(record.jump) > 1.2e-3)  # a contact of 15 noises
    nearest = np.abs(found.time_s[:, np.newaxis] - record.time[clear]).min(axis=0)
    assert clear.sum() > 20
    assert nearest.max() < 0.3 * SAMPLE
    assert np.abs(found.time_s[:, np.newaxis] - record.time).min(axis=1).max() < CONTACT


def test_chatter_is_resolved_or_flagged(tmp_path: Path) -> None:
    record = measured(b=0.010, r=0.75, start=0.0, duration=10.0)
    gap = np.diff(record.time)
    found = found_in(record.channels, tmp_path)
    # nothing is found where there is nothing
    assert np.abs(found.time_s[:, np.newaxis] - record.time).min(axis=1).max() < CONTACT
    strong = np.abs(record.jump) > 1.2e-3
    tight = np.flatnonzero((gap < 0.4 * CONTACT) & strong[1:] & strong[:-1])
    for i in tight:
        near = np.abs(found.time_s - record.time[i]) < CONTACT
        assert near.any()
        assert found.crowded[near].all()
    apart = np.append(True, gap > 2.0 * CONTACT) & np.append(gap > 2.0 * CONTACT, True)
    wanted = record.time[apart & strong]
    assert np.abs(found.time_s[:, np.newaxis] - wanted).min(axis=0).max() < SAMPLE


@pytest.mark.long
@pytest.mark.parametrize("alternate", [True, False])
def test_impacts_every_twenty_samples(alternate: bool, tmp_path: Path) -> None:
    from vinesexp.laboratory.sensors import contact_acceleration

    random = np.random.default_rng(2)
    time = 0.05 + 20.0 * SAMPLE * np.arange(300) + random.uniform(-2e-4, 2e-4, 300)
    jump = 0.01 * random.uniform(0.5, 1.5, 300)
    jump *= (-1.0) ** np.arange(300) if alternate else 1.0
    a = contact_acceleration(
        time, jump, duration=CONTACT, ring=None, ring_damping=0.0, start=0.0, dt=SAMPLE, n=7000
    )
    a += 0.3 * random.standard_normal(a.size)
    found = found_in({"acceleration": a}, tmp_path)
    assert_whole(found, time, within=0.5 * SAMPLE)
    assert np.median(found.velocity_jump_m_s / jump) == pytest.approx(1.0, abs=0.03)


def test_sensor_saturated_through_a_third(tmp_path: Path) -> None:
    record = measured()
    n = record.channels["acceleration"].size
    stuck = slice(n // 3, 2 * n // 3)
    record.channels["acceleration"][stuck] = record.channels["acceleration"].max() * 1.5
    found = found_in(record.channels, tmp_path)
    seen = (record.time < n / 3 * SAMPLE - 1e-3) | (record.time > 2 * n / 3 * SAMPLE + 1e-3)
    nearest = np.abs(found.time_s[:, np.newaxis] - record.time[seen]).min(axis=0)
    assert nearest.max() < 2e-5
    others = np.abs(found.time_s[:, np.newaxis] - record.time[seen]).min(axis=1) > 2e-5
    assert found.clipped[others].all()  # at most the jump to the rail and back, and said so
    assert others.sum() <= 2


@pytest.mark.parametrize("frequency", [7.862, 62.0])
def test_the_ends_of_a_record_are_no_impacts(frequency: float, tmp_path: Path) -> None:
    """Continued by a line, an oscillation left a spike at each end of the highpassed record."""
    random = np.random.default_rng(8)
    t = np.arange(20_000) * SAMPLE
    w = 2.0 * np.pi * frequency
    for phase, beside in ((0.0, 0.0), (0.8, 0.0), (1.6, 0.0), (0.3, 0.02), (2.0, 0.02)):
        folder = tmp_path / f"{phase}"
        folder.mkdir()
        x = 1e-3 * np.sin(w * t + phase) * np.exp(-0.05 * t)
        x += beside * 1e-3 * np.sin(1.4 * w * t + 2.0 * phase)  # modulated: no sine goes on
        a = -(w**2) * x + 2e-3 * w**2 * 1e-3 * random.standard_normal(t.size)
        found = found_in({"displacement": x, "acceleration": a}, folder, frequency=frequency)
        assert found.n == 0


def test_impacts_at_the_very_edges(tmp_path: Path) -> None:
    whole = measured(duration=4.0)
    first, last = 3, whole.time.size - 4
    begin = round((whole.time[first] - 3e-4) * RATE)
    end = round((whole.time[last] + 3e-4) * RATE)
    cut = {role: x[begin:end] for role, x in whole.channels.items()}
    found = found_in(cut, tmp_path)
    assert_whole(found, whole.time[first : last + 1] - begin * SAMPLE, within=2e-5)


def test_three_periods(tmp_path: Path) -> None:
    record = measured(duration=3.0 / 7.862)
    assert record.time.size in (5, 6, 7)
    found = found_in(record.channels, tmp_path)
    assert_whole(found, record.time, within=2e-5)
    assert (found.side == -np.sign(record.jump)).all()


def test_gaps_hide_only_what_lies_in_them(tmp_path: Path) -> None:
    record = measured()
    gaps = [(12345, 12950), (40000, 40700), (79000, 80000)]
    hidden = np.zeros(record.time.size, dtype=bool)
    for begin, end in gaps:
        for role in record.channels:
            record.channels[role][begin:end] = np.nan
        hidden |= (record.time > begin * SAMPLE - CONTACT) & (record.time < end * SAMPLE + CONTACT)
    found = found_in(record.channels, tmp_path)
    assert hidden.any()
    assert_whole(found, record.time[~hidden], within=2e-5)


def test_a_long_chain_of_contacts_is_moved_in_parts_and_still_found(monkeypatch):
    """The work would grow as the cube of their number: hours for three seconds of record."""
    template = template_of(Shape(duration=8.0), (-20, 20), highpass=None, dt=1e-4)
    rng = np.random.default_rng(0)
    place = 50.0 + 9.0 * np.arange(200) + rng.uniform(-0.4, 0.4, 200)
    height = rng.choice([-1.0, 1.0], 200) * rng.uniform(20.0, 60.0, 200)
    a = -less(np.zeros(1900), place, height, template) + 0.1 * rng.standard_normal(1900)
    sizes = []
    solve = np.linalg.lstsq

    def counted(columns, *given, **named):
        sizes.append(columns.shape[1])
        return solve(columns, *given, **named)

    monkeypatch.setattr(np.linalg, "lstsq", counted)
    state = State(
        a, np.full(1, 0.1), np.ones(a.size, dtype=bool), np.zeros(a.size, dtype=bool), template,
        np.rint(place), a[np.rint(place).astype(np.int64)], np.ones(200, dtype=bool),
    )  # fmt: skip
    for _ in range(4):
        settle(state, seen_lags(template))
    assert 4 < max(sizes) <= 32
    np.testing.assert_allclose(state.place, place, atol=0.05)
    np.testing.assert_allclose(state.height, height, rtol=0.02)


def test_a_displacement_shows_no_single_one_of_impacts_beyond_number():
    rate, n = 1e3, 4000
    x = coarsen(1e-3 * np.cos(2 * np.pi * 8.0 * np.arange(n) / rate), rate, 8.0)
    times = np.concatenate([[0.5], np.linspace(2.0, 2.1, 500), [3.5]])
    found = slope_changes(x, times, np.full(times.size, 0.01), frequency=8.0)
    assert np.isfinite(found.jump[[0, -1]]).all()
    assert np.isnan(found.jump[200:300]).all()


def test_times_between_two_samples_are_as_unsure_as_they_are() -> None:
    """All are drawn to some places between the samples: by 120 us, where 0.8 us were stated."""
    rate, fine = 2000.0, 50
    times = 0.031 + 0.05237 * np.arange(110)
    t = np.arange(int(6.0 * rate) * fine) / (rate * fine)
    push = np.zeros(t.size)
    for number, one in enumerate(times):
        near = np.abs(t - one) < 2e-4
        push[near] += (-1.0) ** number * 400.0 * np.cos(np.pi * (t[near] - one) / 4e-4)
    a = push.reshape(-1, fine).mean(axis=1)
    a = np.convolve(a, [1 / 3, 2 / 3])[: a.size]
    a += 0.4 * np.random.default_rng(4).standard_normal(a.size)
    found = detect_by_template(stream_of(a, rate), ImpactSettings())
    off = found.time - times[np.abs(found.time[:, np.newaxis] - times).argmin(axis=1)]
    off -= np.median(off)
    assert off.std() < 3.0 * np.median(found.time_error)


def test_two_balls_that_take_turns_are_no_single_contact() -> None:
    """Of 180 impacts one was left, and the motion was chaos."""
    times = np.sort(np.concatenate([np.arange(40) * 0.1 + 0.02, np.arange(40) * 0.1 + 0.04]))
    size = np.where(np.arange(80) % 2, 0.0227, 0.003)
    jump = size * np.where(np.arange(80) // 2 % 2, 1.0, -1.0)
    flags = np.zeros(80, dtype=bool)
    one = np.full(80, 1e-4)
    found = Detection(times, one, jump, one, one, one, one, flags, flags)
    x = Coarse(9.7e-3 * np.sin(2.0 * np.pi * 4.978 * np.arange(4100) * 1e-3), 1e-3, 0.0)
    assert joined(found, x, frequency=4.978, clearance=0.0544).time.size == 80
