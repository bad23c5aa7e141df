"""What the sensor of the displacement leaves out is put back; a good one is left as it is."""

from pathlib import Path

import numpy as np
import pytest
from scipy import integrate, signal

from vinesexp import Harmonic, Release
from vinesexp.errors import RecordError
from vinesexp.identification.one_record import estimate_record
from vinesexp.records.campaign.schema import Known, Record
from vinesexp.records.stored.store import RecordWriter, open_record
from vinesexp.records.stored.store import integrate as integrate_velocity
from vinesexp.signals.channel_agreement import agreement_of
from vinesexp.signals.condition import condition, condition_or_refuse
from vinesexp.signals.displacement_sensor import set_right
from vinesexp.signals.impacts.find import impacts_of_record

F0 = 7.862
RATE = 1e4
B = 0.031
G25 = Harmonic(0.25e-3, F0)


@pytest.fixture
def channels(measure):
    record = measure(b=[B], drive=G25, start=20.0, duration=30.0)
    return {role: x[200_000:] for role, x in record.channels.items()}


def stored(path, channels):
    kinds = {
        role: "acceleration" if role == "acceleration" else "displacement" for role in channels
    }
    with RecordWriter(path, sample_rate=RATE, quantities=kinds) as writer:
        writer.append(channels)
    return path


def mended(channels, folder, test="periodic"):
    """The displacement after it was set right, and the checks."""
    path = stored(folder / "a.nc", channels)
    checks = set_right(path, Record("a", path, test, frequency=(F0,)))
    with open_record(path) as view:
        return view.read("displacement"), checks


def averaged(x, seconds):
    n = round(seconds * RATE)
    return np.convolve(np.concatenate([np.full(n - 1, x[0]), x]), np.ones(n) / n, "valid")


def low_passed(x, hertz):
    return signal.sosfilt(signal.butter(1, hertz, fs=RATE, output="sos"), x - x[0]) + x[0]


def coupled(x, corner):
    sos = signal.butter(1, corner, "high", fs=RATE, output="sos")
    return signal.sosfilt(sos, x, zi=signal.sosfilt_zi(sos) * x[0])[0]


def jumps(channels, folder):
    """Velocity jumps by the displacement, and velocities before impacts."""
    path = stored(folder / "j.nc", channels)
    condition(path, folder / "c.nc", f0_hint=F0)
    found = impacts_of_record(
        path, folder / "c.nc", folder / "j.csv", clearance=[B], nes_mass=[0.032], test="periodic"
    )
    return found.jump_displacement_m_s, found.v_before_m_s


SLOW = [
    pytest.param(lambda x: averaged(x, 6.4e-3), id="64 samples averaged"),
    pytest.param(lambda x: low_passed(x, 150.0), id="filter of 150 Hz"),
]


@pytest.mark.long
@pytest.mark.parametrize("sensor", SLOW)
def test_jumps_and_velocities_beside_a_slow_sensor(sensor, channels, tmp_path):
    """With 64 samples averaged M of a rig was three times the true one."""
    true_jump, true_v = jumps(channels, tmp_path)
    slow = {**channels, "displacement": sensor(channels["displacement"])}
    x, checks = mended(slow, tmp_path)
    assert {check.check for check in checks} == {"slow sensor"}
    jump, v = jumps({**channels, "displacement": np.nan_to_num(x, nan=float(np.nanmean(x)))},
                    tmp_path)  # fmt: skip
    middle = slice(3, -3)
    np.testing.assert_allclose(np.abs(jump[middle]), np.abs(true_jump[middle]), rtol=0.03)
    np.testing.assert_allclose(np.abs(v[middle]), np.abs(true_v[middle]), rtol=0.01)


def test_a_good_sensor_is_left_alone(channels, tmp_path):
    late = {**channels, "displacement": np.roll(channels["displacement"], 20)}
    for own in (channels, late):
        x, checks = mended(own, tmp_path)
        assert not checks
        np.testing.assert_allclose(x, own["displacement"], atol=1e-8)


def test_an_accelerometer_on_a_mount_that_gives_way_is_no_slow_displacement(channels, tmp_path):
    """Its ratio to the displacement grows over frequency, too; impacts were lost by the mend."""
    w, quality = 2.0 * np.pi * 200.0, 5.0
    mount = signal.bilinear([w**2], [1.0, w / quality, w**2], RATE)
    a = channels["acceleration"]
    own = {**channels, "acceleration": signal.lfilter(*mount, a - a[0]) + a[0]}
    x, checks = mended(own, tmp_path)
    assert not checks
    np.testing.assert_allclose(x, channels["displacement"], atol=1e-8)


def test_a_motion_across_the_accelerometer_is_no_coupling(channels, measure, tmp_path):
    """All displacements of such a campaign were changed, and r was 3 % off."""
    release = Release(x0=0.02, v0=0.0, y0=[0.02 + 0.99 * B], vy0=[0.0])
    let_go = measure(b=[B], release=release, start=0.0, duration=12.0).channels
    quarter, w = round(0.25 * RATE / F0), 2.0 * np.pi * F0
    for test, own in (("periodic", channels), ("transient", let_go)):
        late = np.concatenate([np.zeros(quarter), own["displacement"][:-quarter]])
        across = own["acceleration"] - 0.03 * w**2 * late
        folder = tmp_path / test
        folder.mkdir()
        seen, checks = mended({**own, "acceleration": across}, folder, test)
        assert not [check for check in checks if check.check == "coupling"]
        np.testing.assert_allclose(seen, own["displacement"], atol=1e-8)


@pytest.mark.parametrize("corner", [0.16, 0.5, 2.0])
def test_the_middle_of_a_decay_tells_an_ac_coupling(corner, tmp_path):
    """Taken as it is, zeta was off by five errors, and the release by half."""
    t = np.arange(60_000) / RATE
    w = 2.0 * np.pi * F0
    x = 0.02 * np.exp(-0.005 * w * t) * np.cos(w * t)
    x, (check,) = mended({"displacement": coupled(np.append(np.full(9000, 0.02), x), corner)},
                         tmp_path, "ringdown")  # fmt: skip
    assert check.check == "coupling"
    moves = x[9000:]
    expected = 0.02 * np.exp(-0.005 * w * t) * np.cos(w * t)
    off = moves - expected
    assert np.ptp(off - np.polyval(np.polyfit(t, off, 1), t)) < 0.05 * 0.02


@pytest.mark.parametrize("corner", [0.1, 0.3, 1.0])
@pytest.mark.parametrize("held", [0, 9000])
def test_the_middle_of_a_velocity_that_was_integrated_tells_its_coupling(held, corner, tmp_path):
    """Its zero is not known: it drifts, and the coupling bends the drift. r was 3 % off."""
    t = np.arange(60_000) / RATE
    w = 2.0 * np.pi * F0
    x = 0.02 * np.exp(-0.005 * w * t) * np.cos(w * t)
    whole = coupled(np.append(np.full(9000, 0.02), x), corner)[9000 - held :]
    path = stored(tmp_path / "v.nc", {"displacement": np.gradient(whole) * RATE + 0.003})
    integrate_velocity(path, "displacement")
    (check,) = set_right(path, Record("a", Path("a"), "ringdown"))
    assert check.check == "coupling"
    with open_record(path) as view:
        off = view.read("displacement")[held + 100 :] - x[100:]
    assert np.ptp(off) < 0.05 * 0.02


def test_a_sensor_that_drifts_or_creeps_is_not_coupled(tmp_path):
    t = np.arange(60_000) / RATE
    w = 2.0 * np.pi * F0
    x = 0.02 * np.exp(-0.005 * w * t) * np.cos(w * t)
    for drift in (5e-4 * t, 2e-3 * np.exp(-t / 0.5), 0.01 + 0.0 * t):
        found, checks = mended({"displacement": x + drift}, tmp_path, "ringdown")
        assert not checks
        np.testing.assert_allclose(found, x + drift, atol=1e-8)


def test_a_velocity_that_is_called_a_displacement_is_refused(channels, tmp_path):
    speed = np.gradient(channels["displacement"]) * RATE
    path = stored(tmp_path / "v.nc", {**channels, "displacement": speed})
    with open_record(path) as view, pytest.raises(RecordError, match="quantity: velocity"):
        agreement_of(view, frequency=F0)


def test_pulses_alone_of_a_coarse_converter_are_not_the_motion_of_the_base(tmp_path):
    """At resonance they give the mass what the base gives it: exchanged channels were named."""
    w, turns = 2.0 * np.pi * F0, np.arange(60_000) / RATE * F0
    base = 2.5e-4 * np.sin(w * turns / F0)
    pulses = np.zeros(turns.size)
    for side in (1, -1):  # one at either end of its course, of one sample
        at = np.searchsorted(turns, np.arange(0.5 - 0.25 * side, turns[-1]))
        pulses[at] = -side * 2.5e-4 * w**2 * RATE / F0 / 4.0
    shown = {"base": base, "displacement": 5e-3 * np.cos(w * turns / F0), "acceleration": pulses}
    with open_record(stored(tmp_path / "v.nc", shown)) as view:
        agreement_of(view, frequency=F0)


@pytest.mark.parametrize("share", [1.0, 0.2])
def test_exchanged_channels_are_refused_and_nothing_of_their_record_is_used(
    share, channels, tmp_path
):
    """Also where their sensitivities differ: f0 was 15 % low with 17 standard errors."""
    other = {"base": share * channels["displacement"], "displacement": channels["base"] / share}
    path, band = stored(tmp_path / "v.nc", {**channels, **other}), tmp_path / "c.nc"
    condition_or_refuse(path, band, f0_hint=F0)
    with open_record(band) as view:
        assert "base and displacement are exchanged" in view.refused
    row = Record("a", Path("a.csv"), "periodic", (B,), base_amplitude=2.5e-4, frequency=(F0,))
    paths = {"measured": path, "conditioned": band, "impacts": Path("-")}
    assert estimate_record(row, Known(), **paths, shown={}) == []


def test_a_release_keeps_its_impacts(measure, tmp_path):
    record = measure(
        b=[B], start=0.0, duration=8.0, drive=None,
        release=Release(x0=0.02, v0=0.0, y0=[0.02 + 0.99 * B], vy0=[0.0]),
    )  # fmt: skip
    x, checks = mended(record.channels, tmp_path, "transient")
    assert not checks
    np.testing.assert_allclose(x, record.channels["displacement"], atol=1e-8)


@pytest.mark.parametrize("share", [1.0, 30.0])
def test_exchanged_laser_and_accelerometer_are_refused_where_impacts_tell(
    share, channels, tmp_path
):
    """Such a record had no impacts, and a gain of the displacement that was 1.9 times the true."""
    other = {
        "displacement": channels["acceleration"] / (share * 2000.0),
        "acceleration": share * 2000.0 * channels["displacement"],
    }
    path = stored(tmp_path / "v.nc", {**channels, **other})
    with open_record(path) as view, pytest.raises(RecordError, match="exchange their columns"):
        agreement_of(view, frequency=F0)


@pytest.mark.long
def test_a_mass_held_before_its_release_is_not_taken_for_an_ac_coupling(tmp_path):
    """The integral from the hold on hardly changes after it, and goes with noise as any line."""
    rate, f, release = 5000.0, 4.993, 0.02308
    t = np.arange(60_000) / rate - 0.4
    w = 2.0 * np.pi * f
    free = integrate.solve_ivp(
        lambda _, s: [s[1], -(w**2) * s[0] - 0.0054 * w * s[1] - 0.926 * s[1] * abs(s[1])],
        (0.0, t[-1]), [release, 0.0], t_eval=t[t >= 0.0], rtol=1e-8, atol=1e-10,
    ).y[0]  # fmt: skip
    x = np.concatenate([np.full(t.size - free.size, release), free])
    for seed in range(3):
        path = tmp_path / f"{seed}.nc"
        noisy = x + 8e-6 * np.random.default_rng(seed).standard_normal(x.size)
        with RecordWriter(
            path, sample_rate=rate, quantities={"displacement": "displacement"}
        ) as writer:
            writer.append({"displacement": noisy})
        assert set_right(path, Record("a", path, "ringdown", frequency=(f,))) == []
