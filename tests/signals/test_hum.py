"""Mains hum is taken out of a record, and nothing else is."""

import numpy as np
import pytest
from tests.combined import combined

from vinesexp import Harmonic, Release
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.store import RecordWriter, open_record
from vinesexp.signals.condition import condition
from vinesexp.signals.hum import hum_in, remove_hum
from vinesexp.signals.impacts.find import impacts_of_record

F0 = 7.862
G25 = Harmonic(0.25e-3, F0)


def stored(path, channels, rate=1e4):
    kinds = {
        role: "acceleration" if role == "acceleration" else "displacement" for role in channels
    }
    with RecordWriter(path, sample_rate=rate, quantities=kinds) as writer:
        writer.append(channels)
    return path


def with_hum(channels, *, line, size):
    t = np.arange(channels["displacement"].size) / 1e4
    hum = size * np.cos(2 * np.pi * line * t + 1.0)
    return {**channels, "displacement": channels["displacement"] + hum}


@pytest.mark.long
def test_a_line_between_two_points_of_a_short_spectrum_is_none():
    """It ended the search for impacts in a traceback."""
    t = np.arange(20_000) / 4000.0
    x = 5e-3 * np.cos(2 * np.pi * 7.3 * t)
    for line in np.arange(8.0, 60.0, 0.13):
        assert hum_in(x, 1 / 4000.0, frequency=7.3, lines=[float(line)]) == []


@pytest.mark.parametrize(("seconds", "f"), combined([1.5, 2.15, 3.3], [15.35, 16.53]))
def test_hum_of_a_short_decay_near_thrice_its_frequency_is_taken_out(seconds, f):
    """Left in, its bends were impacts, and the decay was refused for a ball in its cavity."""
    t = np.arange(round(6100 * seconds)) / 6100.0
    decay = 13e-3 * np.exp(-0.0156 * 2 * np.pi * f * t) * np.cos(2 * np.pi * f * t)
    noise = 8e-6 * np.random.default_rng(0).standard_normal(t.size)
    hum = 62e-6 * np.cos(2 * np.pi * 50.0 * t + 1.0)
    (found,) = hum_in(decay + hum + noise, 1 / 6100.0, frequency=f)
    assert found.frequency == pytest.approx(50.0, abs=0.03)
    assert found.size == pytest.approx(62e-6, rel=0.05)
    assert hum_in(decay + noise, 1 / 6100.0, frequency=f) == []


def test_a_record_of_few_samples_has_no_hum():
    """It ended in a division by zero."""
    for n in range(1, 30):
        x = 5e-3 * np.cos(2 * np.pi * 7.3 * np.arange(n) / 200.0)
        assert hum_in(x, 1 / 200.0, frequency=7.3) == []


def test_hum_of_an_acceleration_is_found_beside_the_kink_of_a_release():
    """The kink stands in one piece of the record, and took the mean of all with it."""
    t, w = np.arange(15_000) / 5e3, 2.0 * np.pi * 20.0
    free = np.maximum(t - 0.3, 0.0)
    decay = -15e-3 * w**2 * np.exp(-0.004 * w * free) * np.cos(w * free) * (t > 0.3)
    noise = 0.3 * np.random.default_rng(2).standard_normal(t.size)
    hum = 2.0 * np.cos(2 * np.pi * 60.0 * t + 0.7)
    (found,) = hum_in(decay + hum + noise, 1 / 5e3, frequency=20.0, lines=[60.0])
    assert found.frequency == pytest.approx(60.0, abs=0.03)
    assert found.size == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize(("line", "b"), combined([49.97, 60.02, 100.1], [0.031, 0.045]))
def test_hum_beside_impacts_is_taken_out(line, b, measure, tmp_path):
    record = measure(b=[b], drive=G25, start=20.0, duration=30.0)
    clean = {role: x[200_000:] for role, x in record.channels.items()}
    channels = with_hum(clean, line=line, size=1e-4)
    path = stored(tmp_path / "a.nc", channels)
    (check,) = remove_hum(path, Record("a", path, "periodic", frequency=(F0,)))
    assert (check.check, check.outcome) == ("hum", "warning")
    with open_record(path) as view:
        left = view.read("displacement") - clean["displacement"]
        assert np.abs(left).max() < 0.05 * 1e-4
        np.testing.assert_array_equal(view.read("acceleration"), clean["acceleration"])


@pytest.mark.long
def test_jumps_and_places_at_impacts_are_those_without_hum(measure, tmp_path):
    """Left in, 0.1 mm of 60 Hz made r 0.997 of 0.6 in a campaign."""
    record = measure(b=[0.031], drive=G25, start=20.0, duration=21.0)
    clean = {role: x[200_000:] for role, x in record.channels.items()}
    tables = []
    for name, channels in (("clean", clean), ("hum", with_hum(clean, line=60.02, size=1e-4))):
        path = stored(tmp_path / f"{name}.nc", channels)
        remove_hum(path, Record(name, path, "periodic", frequency=(F0,)))
        condition(path, tmp_path / f"{name}_c.nc", f0_hint=F0)
        found = impacts_of_record(
            path, tmp_path / f"{name}_c.nc", tmp_path / f"{name}.csv", clearance=[0.031],
            nes_mass=[0.032], test="periodic",
        )  # fmt: skip
        tables.append(found)
    assert tables[0].n == tables[1].n
    np.testing.assert_allclose(tables[1].velocity_jump_m_s, tables[0].velocity_jump_m_s, atol=2e-4)


@pytest.mark.parametrize(
    ("b", "frequency"),
    combined([0.02, 0.031, 0.036, 0.045, 0.06], [7.862, 10.0]),
)
def test_the_motion_itself_is_no_hum(b, frequency, measure):
    """At 10 Hz its fifth and sixth multiples lie at 50 and 60 Hz."""
    drive = Harmonic(0.25e-3 * (frequency / F0) ** 2, frequency)
    record = measure(b=[b], drive=drive, start=5.0, duration=25.0)
    for x in record.channels.values():
        assert hum_in(x, 1e-4, frequency=frequency) == []


def test_what_impacts_add_to_a_driven_motion_that_fades_is_no_hum():
    """Impacts go on while the amplitude falls: the ninth multiple of 5.57 Hz stays."""
    t = np.arange(90000) / 1e4
    fades = 4e-3 * np.exp(-0.1 * t) * np.cos(2.0 * np.pi * 5.57 * t)
    impacts = 2e-6 * np.cos(2.0 * np.pi * 9.0 * 5.57 * t)
    assert hum_in(fades + impacts, 1e-4, frequency=5.57, driven=True) == []
    (line,) = hum_in(fades + impacts, 1e-4, frequency=5.57)
    assert line.frequency == pytest.approx(50.13, abs=0.02)


@pytest.mark.parametrize("clock", [0.8, 0.91, 0.976, 0.996, 1.004, 1.02, 1.1])
def test_multiples_of_a_motion_whose_frequency_is_not_as_stated_are_no_hum(clock, measure):
    """A clock or a test log that is off: the nineteenth multiple of 7.862 Hz seems to be 150 Hz."""
    record = measure(b=[0.031], drive=G25, start=10.0, duration=20.0)
    for x in record.channels.values():
        assert hum_in(x, 1e-4 / clock, frequency=F0) == []


def test_lines_between_the_multiples_of_a_modulated_motion_are_no_hum():
    """They come again at each multiple; hum beside them, which does not, is found."""
    f, t = 6.7035, np.arange(75_000) / 5e3
    motion = 5e-3 * np.cos(2 * np.pi * f * t)
    motion += sum(1e-4 / n**2 * np.cos(2 * np.pi * (n + 0.928) * f * t + n) for n in range(1, 25))
    assert hum_in(motion, 2e-4, frequency=f) == []
    (line,) = hum_in(motion + 2e-5 * np.cos(2 * np.pi * 50.02 * t), 2e-4, frequency=f)
    assert line.frequency == pytest.approx(50.02, abs=1e-3)
    assert line.size == pytest.approx(2e-5, rel=0.01)


@pytest.mark.parametrize("seed", range(4))
def test_hum_beside_a_sideband_of_a_modulated_motion_is_hum(seed):
    """Left in, its bends hid 22 impacts of a test, and its ball seemed to be a third heavier."""
    f, t = 17.99, np.arange(19_700) / 5.8e3
    rng = np.random.default_rng(seed)
    course = 2 * np.pi * 0.9 * t + np.sin(2 * np.pi * 0.37 * t + rng.uniform(0, 6))
    motion = 9e-3 * (1.0 + 0.4 * np.cos(course)) * np.cos(2 * np.pi * f * t)
    motion += 8e-5 * np.cos(course + 1.0) * np.cos(3 * 2 * np.pi * f * t)
    motion += 8e-6 * rng.standard_normal(t.size)
    assert hum_in(motion, 1 / 5.8e3, frequency=f, driven=True) == []
    hum = 6e-5 * np.cos(2 * np.pi * 50.0 * t + 1.0)
    (line,) = hum_in(motion + hum, 1 / 5.8e3, frequency=f, driven=True)
    assert line.frequency == pytest.approx(50.0, abs=0.03)
    assert line.size == pytest.approx(6e-5, rel=0.1)


def test_hum_beside_a_release_whose_spectrum_is_broad_is_hum():
    """It stayed in one release of three: the motion is strong f0 beside it, and no line there."""
    t = np.arange(60_000) / 1e4
    begun = np.maximum(t - 0.4, 0.0)
    x = 6e-3 * np.exp(-0.9 * begun) * np.cos(2 * np.pi * 22.03 * begun + 3e-2 * np.sin(9.0 * begun))
    (line,) = hum_in(x + 3e-5 * np.cos(2 * np.pi * 50.02 * t), 1e-4, frequency=22.0)
    assert line.frequency == pytest.approx(50.02, abs=5e-3)
    assert line.size == pytest.approx(3e-5, rel=0.05)


def test_hum_at_a_multiple_of_a_motion_that_decays_is_no_part_of_it():
    """At five times f0 it stayed in two ring-downs of four; in a steady motion nobody can tell."""
    t = np.arange(80_000) / 1e4
    hum = 1.6e-4 * np.cos(2 * np.pi * 50.02 * t + 1.0)
    decay = 8e-3 * np.exp(-0.0044 * 2 * np.pi * 10.0 * t) * np.cos(2 * np.pi * 10.0 * t)
    (line,) = hum_in(decay + hum, 1e-4, frequency=10.0)
    assert line.frequency == pytest.approx(50.02, abs=2e-3)
    assert line.size == pytest.approx(1.6e-4, rel=0.02)
    assert not hum_in(8e-3 * np.cos(2 * np.pi * 10.0 * t) + hum, 1e-4, frequency=10.0)


def test_a_release_and_a_decay_at_the_frequency_of_the_grid_are_no_hum(measure):
    record = measure(b=[0.03], release=Release(x0=0.02, y0=[0.02 - 0.0299]), duration=8.0)
    for x in record.channels.values():
        assert hum_in(x, 1e-4, frequency=F0) == []
    t = np.arange(80_000) / 1e4
    decay = np.exp(-0.4 * t) * np.cos(2 * np.pi * 50.0 * t)
    assert hum_in(decay, 1e-4, frequency=F0) == []  # another mode of the rig
    assert hum_in(decay, 1e-4, frequency=50.0) == []


def test_a_slow_line_lies_between_those_of_a_short_record():
    # 0.8 % of 6.3 Hz is less than half of the 0.11 Hz from line to line of 8.8 s
    f = 6.30256
    t = 8.0e-4 * np.arange(11000)
    slow = 2e-4 * np.cos(2 * np.pi * f * t)
    (line,) = hum_in(slow, 8e-4, frequency=15.7, driven=True, lines=[f])
    assert abs(line.frequency - f) < 0.01
    assert abs(line.size / 2e-4 - 1.0) < 0.01


def test_a_record_without_hum_is_left_as_it_is(measure, tmp_path):
    record = measure(b=[0.031], drive=G25, start=20.0, duration=24.0)
    path = stored(tmp_path / "a.nc", record.channels)
    before = path.read_bytes()
    assert remove_hum(path, Record("a", path, "periodic", frequency=(F0,))) == []
    assert path.read_bytes() == before
