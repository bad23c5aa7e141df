"""An AC-coupled accelerometer is not a late displacement."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal
from tests.combined import combined

from vinesexp import Harmonic, Release
from vinesexp.records.stored.store import RecordWriter, open_record
from vinesexp.signals.channel_agreement import (
    agreement_in,
    agreement_of,
    expected_lead,
    law_of_lines,
    pulse_share,
)
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.find import impacts_of_record

G25 = Harmonic(0.25e-3, 7.862)
F0 = 7.862


def ac_coupled(a: np.ndarray, *, corner: float, rate: float = 1e4) -> np.ndarray:
    """One pole: what a charge amplifier or an IEPE supply leaves of an acceleration."""
    w = 2.0 * np.pi * corner
    numerator, denominator = signal.bilinear([1.0, 0.0], [1.0, w], fs=rate)
    return np.asarray(signal.lfilter(numerator, denominator, a))


def stored(path: Path, channels: dict[str, np.ndarray]) -> Path:
    kinds = {
        role: "acceleration" if role == "acceleration" else "displacement" for role in channels
    }
    with RecordWriter(path, sample_rate=1e4, quantities=kinds) as writer:
        writer.append(channels)
    return path


@pytest.mark.parametrize(("corner", "late"), [(0.5, 0.0), (0.1, 0.0), (1.0, 1.5e-4), (2.5, 0.0)])
def test_a_corner_is_parted_from_a_lag(corner: float, late: float, measure, tmp_path: Path) -> None:
    record = measure(b=[0.03], drive=G25, start=10.0, duration=15.0, skew={"displacement": -late})
    channels = {role: record.channels[role] for role in ("displacement", "acceleration")}
    channels["acceleration"] = ac_coupled(channels["acceleration"], corner=corner)
    cut = {role: x[50_000:] for role, x in channels.items()}  # the filter has settled
    path = stored(tmp_path / "ac.nc", cut)
    condition(path, tmp_path / "c.nc", f0_hint=F0)
    with open_record(tmp_path / "c.nc") as view:
        found = agreement_in(view.attributes)
    assert found is not None
    assert found.corner == pytest.approx(corner, abs=5.0 * found.corner_error)
    assert found.corner_error < 0.1 * corner
    assert abs(found.lag - late) < 3.0 * found.lag_error
    assert found.lag_error < 3e-5  # atan(0.5/7.862)/w: taken for a lag it would be 1.3 ms
    assert found.gain == pytest.approx(1.0, abs=2e-3)


def test_a_corner_shows_in_six_seconds(measure, tmp_path: Path) -> None:
    """47 periods: taken for a lag, a corner of 0.3 Hz would be one of 0.8 ms."""
    record = measure(b=[0.03], drive=G25, start=10.0, duration=16.0)
    channels = {role: record.channels[role] for role in ("displacement", "acceleration")}
    channels["acceleration"] = ac_coupled(channels["acceleration"], corner=0.3)
    path = stored(tmp_path / "ac.nc", {role: x[100_000:] for role, x in channels.items()})
    condition(path, tmp_path / "c.nc", f0_hint=F0)
    with open_record(tmp_path / "c.nc") as view:
        found = agreement_in(view.attributes)
    assert found is not None
    assert found.corner == pytest.approx(0.3, abs=max(5.0 * found.corner_error, 0.02))
    assert abs(found.lag) < 1e-4


def test_a_decay_alone_knows_no_lag(tmp_path: Path) -> None:
    t = np.arange(60_000) / 1e4
    w = 2.0 * np.pi * F0
    z = 5e-3 * np.exp((1j * w - 0.3) * (t + 20.0)) * np.exp(6.0)
    a = ac_coupled(((1j * w - 0.3) ** 2 * z).real, corner=0.3)
    path = stored(tmp_path / "d.nc", {"displacement": z.real, "acceleration": a})
    condition(path, tmp_path / "c.nc", f0_hint=F0)
    with open_record(tmp_path / "c.nc") as view:
        found = agreement_in(view.attributes)
    assert found is not None
    assert found.lag_error >= abs(found.lag)  # it may be a corner


@pytest.mark.parametrize("begins", [0.40002, 0.40005, 0.40008])
def test_a_release_within_one_sample_is_no_lag_and_no_motion_across(begins, tmp_path: Path) -> None:
    """Its step fills all lines of one segment: eight segments were taken for as many witnesses."""
    t = np.arange(70_000) / 1e4
    s = -0.3 + 2j * np.pi * F0
    z = np.where(t > begins, np.exp(s * (t - begins)), 0.0)
    x = np.where(t > begins, z.real - (s.real / s.imag) * z.imag, 1.0)  # at rest before
    a = (s**2 * z).real - (s.real / s.imag) * (s**2 * z).imag
    rng = np.random.default_rng(2)
    channels = {"displacement": 5e-3 * x + 1e-6 * rng.standard_normal(t.size),
                "acceleration": 5e-3 * a + 0.05 * rng.standard_normal(t.size)}  # fmt: skip
    with open_record(stored(tmp_path / "d.nc", channels)) as view:
        found = agreement_of(view, frequency=F0)
    assert found is not None
    assert found.across == 0.0
    assert abs(found.lag) < 3.0 * found.lag_error


@pytest.mark.long
def test_places_at_impacts_are_right_behind_an_ac_coupled_sensor(measure, tmp_path: Path) -> None:
    record = measure(b=[0.03], drive=G25, start=10.0, duration=15.0)
    channels = {role: record.channels[role] for role in ("displacement", "acceleration")}
    channels["acceleration"] = ac_coupled(channels["acceleration"], corner=0.5)
    cut = {role: x[50_000:] for role, x in channels.items()}
    path = stored(tmp_path / "ac.nc", cut)
    condition(path, tmp_path / "c.nc", f0_hint=F0)
    found = impacts_of_record(path, tmp_path / "c.nc", tmp_path / "i.csv", clearance=(0.03,))
    seen = record.time > 5.0
    assert found.n == seen.sum()
    inner = slice(1, -1)
    error = found.v_before_m_s - record.v_before[seen]
    # 1.3 ms late at 3 Hz-wide slopes of 25 m/s^2 the velocity would be off by 30 mm/s
    assert np.abs(error[inner]).max() < 3e-3


# m/s2; 6 is what the mass would make of 60 um
@pytest.mark.parametrize(("size", "turn"), combined([3.0, 6.0], [0.0, 0.5, 1.0]))
def test_hum_in_both_channels_is_no_lag(size: float, turn: float, measure, tmp_path: Path) -> None:
    record = measure(b=[0.031], drive=G25, start=20.0, duration=30.0)
    channels = {role: record.channels[role] for role in ("displacement", "acceleration")}
    channels = {role: x[200_000:] for role, x in channels.items()}
    hum = 2.0 * np.pi * 50.0 * np.arange(channels["displacement"].size) / 1e4
    channels["displacement"] = channels["displacement"] + 6e-5 * np.cos(hum)
    channels["acceleration"] = channels["acceleration"] + size * np.cos(hum + np.pi * turn)
    path = stored(tmp_path / "hum.nc", channels)
    condition(path, tmp_path / "c.nc", f0_hint=F0)
    with open_record(tmp_path / "c.nc") as view:
        found = agreement_in(view.attributes)
    assert found is not None
    assert abs(found.lag) < 3.0 * found.lag_error < 5e-5


def test_a_lag_without_a_corner_stays_a_lag(measure, tmp_path: Path) -> None:
    record = measure(b=[0.03], drive=G25, start=10.0, duration=20.0, skew={"displacement": -1.5e-4})
    condition(record.path, tmp_path / "c.nc", f0_hint=F0)
    with open_record(tmp_path / "c.nc") as view:
        found = agreement_in(view.attributes)
    assert found is not None
    assert abs(found.corner) < 3.0 * found.corner_error
    assert found.lag == pytest.approx(1.5e-4, abs=3e-6)
    assert found.lag_error < 5e-6


def test_without_impacts_corner_and_lag_cannot_be_parted(measure, tmp_path: Path) -> None:
    record = measure(drive=G25, start=10.0, duration=20.0, release=Release(x0=0.005))
    condition(record.path, tmp_path / "c.nc", f0_hint=F0)
    with open_record(tmp_path / "c.nc") as view:
        found = agreement_in(view.attributes)
    assert found is not None
    assert np.isnan(found.corner)


def test_a_motion_across_its_axis_is_no_lag(measure, tmp_path: Path) -> None:
    record = measure(b=[0.03], drive=G25, start=10.0, duration=30.0)
    channels = {role: record.channels[role] for role in ("displacement", "acceleration")}
    t = np.arange(channels["acceleration"].size) / 1e4
    w = 2.0 * np.pi * F0
    # What moves across does so at the oscillation, a quarter of a cycle behind.
    own = 2.0 * np.mean(channels["acceleration"] * np.exp(-1j * w * t))
    channels["acceleration"] = (
        channels["acceleration"] + 0.03 * (own * np.exp(1j * (w * t - 0.5 * np.pi))).real
    )
    path = stored(tmp_path / "ac.nc", channels)
    condition(path, tmp_path / "c.nc", f0_hint=F0)
    with open_record(tmp_path / "c.nc") as view:
        found = agreement_in(view.attributes)
    assert found is not None
    assert found.across == pytest.approx(0.03, abs=2e-3)
    assert np.isnan(found.corner)
    assert abs(found.lag) < 3.0 * found.lag_error  # taken for a lag it would be 0.6 ms


def test_channels_that_agree_show_nothing_across(measure, tmp_path: Path) -> None:
    record = measure(b=[0.03], drive=G25, start=10.0, duration=15.0, skew={"displacement": -1e-3})
    channels = {role: record.channels[role] for role in ("displacement", "acceleration")}
    condition(stored(tmp_path / "ac.nc", channels), tmp_path / "c.nc", f0_hint=F0)
    with open_record(tmp_path / "c.nc") as view:
        found = agreement_in(view.attributes)
    assert found is not None
    assert found.across == 0.0


A_HERTZ = 1.0 / (2.0 * np.pi * 8.0**2)  # s by which a corner of 1 Hz leads at 8 Hz


def test_a_corner_of_which_nothing_is_known_leaves_the_lag_unknown() -> None:
    """Whatever the fit of too few lines says: no digits cancel, and the error does not vanish."""
    found = [expected_lead(c, e, frequency=F0) for e in (1e2, 1e3, 1e5, 1e8) for c in (-0.3 * e, e)]
    found.append(expected_lead(0.3, np.inf, frequency=F0))
    leads, errors = np.array(found).T
    assert (errors > 1e-3).all()
    assert np.ptp(errors) < 0.02 * errors.mean()
    assert (np.abs(leads) < errors).all()


def test_a_corner_that_one_record_hardly_shows_widens_its_lag() -> None:
    """Half of the odds for a corner: neither that of one case nor of the other."""
    found = [
        np.array(expected_lead(z * 0.01, 0.01, frequency=8.0)) / A_HERTZ for z in (0.0, 2.6, 5.0)
    ]
    assert found[0][0] < 0.005
    assert 0.3 * 0.026 < found[1][0] < 0.026
    assert found[1][1] > 0.011
    np.testing.assert_allclose(found[2], (0.05, 0.01), rtol=0.1)


@pytest.mark.long
@given(z=st.floats(-30.0, 30.0), error=st.floats(1e-4, 10.0))
def test_noise_makes_no_corner(z: float, error: float) -> None:
    """Below zero no sensor has one, however wide the error: what is left is a motion across."""
    lead, spread = np.array(expected_lead(z * error, error, frequency=8.0)) / A_HERTZ
    # three standard errors above zero, a corner or none: 1.7 % more than either alone
    assert 0.0 <= spread <= 1.02 * max(error, 0.9)
    assert lead <= max(z * error + 0.1, 0.8)
    if -3.0 < z < -1.0 and error > 0.2:
        assert abs(lead) < 0.4


def test_harmonics_of_impacts_do_not_alias_into_the_gain(measure, tmp_path: Path) -> None:
    """Means of a fortieth of a period turn the fortieth harmonic into the oscillation itself."""
    rate = 15 * 41.003 * F0
    record = measure(b=[0.03], drive=G25, start=10.0, duration=20.0, sample_rate=rate, noise=0.1)
    channels = {role: record.channels[role] for role in ("displacement", "acceleration")}
    path = tmp_path / "r.nc"
    kinds = {role: role for role in channels}
    with RecordWriter(path, sample_rate=rate, quantities=kinds) as writer:
        writer.append(channels)
    with open_record(path) as view:
        found = agreement_of(view, frequency=F0)
    assert found is not None
    assert abs(found.gain - 1.0) < 3e-4


@pytest.mark.long
def test_pulses_that_read_too_large_move_the_gain_by_their_share(measure, tmp_path: Path) -> None:
    moved, shares = [], []
    for b in (0.026, 0.029, 0.031):
        record = measure(b=[b], drive=G25, start=10.0, duration=10.0, noise=0.1, name=f"{b}")
        channels = {role: record.channels[role].copy() for role in ("displacement", "acceleration")}
        gains = []
        for _ in range(2):
            with open_record(stored(tmp_path / "r.nc", channels)) as view:
                found = agreement_of(view, frequency=F0)
                shares.append(pulse_share(view, record.time, record.jump, frequency=F0))
            assert found is not None
            gains.append(found.gain)
            at = np.rint(record.time * 1e4).astype(int)
            channels["acceleration"][at] += 0.2 * record.jump * 1e4
        moved.append(gains[1] - gains[0])
    assert np.ptp(moved) > 1e-3
    np.testing.assert_allclose(moved, 0.2 * np.array(shares[::2]), atol=2e-4)


@pytest.mark.parametrize(("corner", "known"), [(0.5, True), (4.0, True), (10.0, False)])
def test_a_corner_above_the_oscillation_is_no_law(corner: float, known: bool) -> None:
    """A laser that lost its target after each impact made one of 12 Hz, and a gain of 1.75."""
    f0, w = 8.0, 2.0 * np.pi * np.arange(13.0, 24.0, 1.0)
    late = -np.arctan(corner / f0) / (2.0 * np.pi * f0)  # so that both agree at the oscillation
    x = np.random.default_rng(0).standard_normal((20, 2 * w.size)).view(complex)
    a = x * np.exp(1j * (w * late + np.arctan(2.0 * np.pi * corner / w)))
    law = law_of_lines(a, x, w, frequency=f0, own=(0.0, 1e-6, 1.0))
    assert (law is not None) == known
    if law is not None:
        assert law.corner == pytest.approx(corner, rel=0.05)
