"""Records of one channel, and sweeps as an analyser makes them."""

from pathlib import Path

import numpy as np
import pytest
from tests.combined import combined

from vinesexp import Harmonic
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.one_record import estimate_record
from vinesexp.identification.whole_campaign import possible, remarks
from vinesexp.records.campaign.schema import Known, Record
from vinesexp.records.stored.store import RecordWriter
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.find import impacts_of_record
from vinesexp.units import Quantity

F0, ZETA = 7.862, 0.0065


def analysed(folder: Path, channels: dict, *, rate: float, quantities=None, shown=None, **row):
    """Estimates of a record of these channels."""
    measured, band = folder / "r.nc", folder / "c.nc"
    kinds = {"base": "displacement", "displacement": "displacement", "acceleration": "acceleration"}
    kinds = {role: (quantities or kinds)[role] for role in channels}
    with RecordWriter(measured, sample_rate=rate, quantities=kinds) as writer:
        writer.append(channels)
    record = Record("one", Path("f"), **row)
    centre = sum(record.frequency) / 2 if record.frequency else None
    condition(measured, band, f0_hint=centre)
    found = estimate_record(
        record, Known(), measured=measured, conditioned=band, impacts=Path("-"), shown=shown or {}
    )
    return {(e.parameter, e.method): e for e in found}


def decay(rate, seconds=15.0):
    t = np.arange(round(seconds * rate)) / rate
    w0 = 2 * np.pi * F0
    pole = (-ZETA + 1j * np.sqrt(1 - ZETA**2)) * w0
    z = 0.02 * np.exp(pole * t + 0.3j)
    return t, z.real, (pole**2 * z).real


@pytest.mark.parametrize("offset", [0.0, 9.81])
def test_an_accelerometer_alone_gives_f0_and_zeta(tmp_path, offset):
    _, _, a = decay(2000.0)
    a = a + offset + 0.3 * np.random.default_rng(0).standard_normal(a.size)
    found = analysed(tmp_path, {"acceleration": a}, rate=2000.0, test="ringdown")
    f0, zeta = found["f0", "likelihood"], found["zeta", "likelihood"]
    assert abs(f0.value - F0) < 4 * f0.std_error < 1e-3
    assert abs(zeta.value - ZETA) < 4 * zeta.std_error < 1e-4
    assert f0.amplitude == pytest.approx(0.0089, rel=0.1)  # m, though nothing measured it


@pytest.mark.parametrize("seed", range(5))
def test_what_rings_in_the_first_hundredth_of_a_record_is_found(tmp_path, seed):
    # A hammer's record begins at the blow; a window over all of it is zero there.
    f0, zeta, rate = 1050.0, 0.03, 51200.0
    t = np.arange(round(rate)) / rate - 0.0015
    ring = np.exp(-2 * np.pi * f0 * zeta * t.clip(0.0)) * np.sin(2 * np.pi * f0 * t)
    a = 500.0 * np.where(t > 0.0, ring, 0.0)
    a = a + 0.3 * np.random.default_rng(seed).standard_normal(t.size)
    found = analysed(tmp_path, {"acceleration": a}, rate=rate, test="ringdown")
    assert found["f0", "likelihood"].value == pytest.approx(f0 / np.sqrt(1 - zeta**2), rel=1e-4)
    assert found["zeta", "likelihood"].value == pytest.approx(zeta, rel=1e-2)


def test_a_displacement_alone_gives_the_same(tmp_path):
    _, x, _ = decay(2000.0)
    x = x + 6e-6 * np.random.default_rng(0).standard_normal(x.size)
    found = analysed(tmp_path, {"displacement": x}, rate=2000.0, test="ringdown")
    assert abs(found["f0", "likelihood"].value - F0) < 4 * found["f0", "likelihood"].std_error


@pytest.mark.parametrize("channel", ["displacement", "acceleration"])
def test_a_base_that_yields_is_no_softer_spring(tmp_path, channel):
    """The base follows the mass by 0.6 % and a little late: f0 of the decay is 0.3 % lower."""
    rho, w0 = 0.006 * np.exp(-0.1j), 2 * np.pi * F0
    # s^2 + (2 zeta w0 s + w0^2)(1 - rho) = 0
    pole = max(np.roots([1.0, 2 * ZETA * w0 * (1 - rho), w0**2 * (1 - rho)]), key=np.imag)
    t = np.arange(30_000) / 2000.0
    z = 0.02 * np.exp(pole * t + 0.3j)
    noise = np.random.default_rng(1).standard_normal((2, t.size))
    motion = {
        "displacement": z.real + 6e-6 * noise[0],
        "acceleration": (pole**2 * z).real + 0.03 * noise[0],
    }
    base = (rho * z).real + 1e-6 * noise[1]
    channels = {channel: motion[channel], "base": base}
    found = analysed(tmp_path, channels, rate=2000.0, test="ringdown")
    assert found["f0", "likelihood"].value == pytest.approx(F0, rel=2e-5)
    assert found["zeta", "likelihood"].value == pytest.approx(ZETA, rel=5e-3)
    follows = found["base_follows", "likelihood"]
    assert abs(follows.value - 0.006 * np.cos(0.1)) < 4 * follows.std_error < 1e-4
    (check,) = [c for c in remarks(list(found.values())) if c.check == "base follows"]
    assert "0.6 % as far" in check.detail
    assert "0.3 %" in check.detail


def test_a_base_channel_that_swings_with_the_mass_is_another_channel(tmp_path):
    """f0 of the decay was raised by 8 %, as if 16 % of the motion were that of a base."""
    _, x, _ = decay(2000.0)
    noise = 1e-6 * np.random.default_rng(1).standard_normal((2, x.size))
    channels = {"displacement": x + noise[0], "base": 0.16 * x + noise[1]}
    found = analysed(tmp_path, channels, rate=2000.0, test="ringdown")
    assert not {"f0", "zeta"} & {parameter for parameter, _ in found}
    assert any("moves 16 % as far" in e.note for e in found.values())


def test_a_resonance_without_a_width_is_none():
    width = Estimate("zeta", 1e-7, 0.01, "1", "sweep", ("a",))
    kept, checks = possible([Estimate("f0", 10.0, 1e-3, "Hz", "sweep", ("a",)), width])
    assert kept == []
    assert ["zeta (sweep) is not known" in checks[1].detail, "width" in checks[0].detail] == [1, 1]
    other = Estimate("f0", 10.0, 1e-3, "Hz", "likelihood", ("a",))
    assert possible([other, width])[0] == [other]


def answer(f0, zeta, *, rate, seconds, low, high, level=1.0, seed=0):
    """Base and mass accelerations of a base-excited logarithmic sine sweep, with noise."""
    t = np.arange(round(seconds * rate)) / rate
    ratio = high / low
    phase = 2 * np.pi * low * seconds / np.log(ratio) * (ratio ** (t / seconds) - 1)
    base = level * np.sin(phase)
    size = 2 * t.size
    w = 2 * np.pi * np.fft.rfftfreq(size, 1 / rate)
    w0 = 2 * np.pi * f0
    H = (w0**2 + 2j * zeta * w0 * w) / (w0**2 - w**2 + 2j * zeta * w0 * w)
    mass = np.fft.irfft(H * np.fft.rfft(base, size), size)[: t.size]
    noise = np.random.default_rng(seed).standard_normal((2, t.size))
    return base + 1e-3 * level * noise[0], mass + 1e-3 * level * noise[1]


ANALYSED = [
    (40.0, 2.0, 450.0, {"frequency": (2.0, 450.0)}),
    (170.0, 2.0, 450.0, {"frequency": (2.0, 450.0)}),
    (9.3, 5.0, 15.0, {"frequency": (5.0, 15.0)}),
    (9.3, 5.0, 15.0, {}),
]


@pytest.mark.parametrize(
    ("sweep", "quantity"), combined(ANALYSED, ["acceleration", "velocity", "displacement"])
)
def test_sweeps_of_an_analyser(tmp_path, sweep, quantity):
    """Mass in acceleration, base in any quantity, far beyond or around the resonance."""
    (f0, low, high, row), rate = sweep, 1000.0
    base, mass = answer(f0, 0.02, rate=rate, seconds=60.0, low=low, high=high)
    kinds = {"base": quantity, "acceleration": "acceleration"}
    if quantity != "acceleration":  # the base by a laser
        f = np.fft.rfftfreq(2 * base.size, 1 / rate)
        order = {"velocity": 1, "displacement": 2}[quantity]
        keep = np.where(f > 0.5 * low, (2j * np.pi * np.maximum(f, 0.1)) ** -order, 0.0)
        base = np.fft.irfft(np.fft.rfft(base, 2 * base.size) * keep, 2 * base.size)[: mass.size]
    found = analysed(
        tmp_path, {"base": base, "acceleration": mass}, rate=rate, quantities=kinds, test="sweep",
        **row,
    )  # fmt: skip
    assert found["f0", "sweep"].value == pytest.approx(f0, rel=2e-3)
    assert found["zeta", "sweep"].value == pytest.approx(0.02, rel=0.05)
    assert found["base_gain", "sweep"].value == pytest.approx(1.0, rel=0.05)


def test_a_sweep_without_base_is_said(tmp_path):
    _, mass = answer(9.3, 0.02, rate=1000.0, seconds=20.0, low=5.0, high=15.0)
    found = analysed(tmp_path, {"acceleration": mass}, rate=1000.0, test="sweep")
    assert not {"f0", "zeta"} & {parameter for parameter, _ in found}
    assert "base channel" in found["nothing", ""].note


def test_accelerometer_and_base_without_a_laser_give_their_impacts(tmp_path, measure, store):
    """And the reason why no flights: not that there are no impacts."""
    record = measure(b=[0.03], drive=Harmonic(0.25e-3, F0), start=15.0, duration=5.0, r=0.6)
    measured, band, table = (tmp_path / name for name in ("m.nc", "c.nc", "i.csv"))
    kept = {role: record.channels[role] for role in ("base", "acceleration")}
    store(measured, kept, record.sample_rate)
    condition(measured, band, f0_hint=F0)
    impacts = impacts_of_record(measured, band, table, clearance=(0.03,))
    assert impacts.n == pytest.approx(record.time.size, abs=2)
    row = Record("one", Path("f"), "periodic", clearance=(0.03,), frequency=(F0, F0))
    known = Known(nes_mass=(Quantity(0.032),))
    found = estimate_record(
        row, known, measured=measured, conditioned=band, impacts=table, shown={}
    )
    (reason,) = [e.note for e in found if e.parameter == "nothing"]
    assert f"{impacts.n} impacts found; no M and r by flights: 39 periods are too few" in reason


@pytest.mark.parametrize("b", [0.03, 0.05])  # the wall reaches the ball, or does not
def test_a_test_without_impacts_works_at_no_amplitude(tmp_path, measure, store, b):
    """Damping and frequency were said at an amplitude at which a guide held the mass."""
    record = measure(b=[b], drive=Harmonic(0.25e-3, F0), start=15.0 * (b < 0.04), duration=5.0)
    measured, band, table = (tmp_path / name for name in ("m.nc", "c.nc", "i.csv"))
    store(measured, record.channels, record.sample_rate)
    condition(measured, band, f0_hint=F0)
    impacts = impacts_of_record(measured, band, table, clearance=(b,))
    row = Record("one", Path("f"), "periodic", clearance=(b,), frequency=(F0, F0))
    found = estimate_record(
        row, Known(), measured=measured, conditioned=band, impacts=table, shown={}
    )
    works = any(e.parameter == "working_amplitude" for e in found)
    assert (impacts.n > 0) == works == (b < 0.04)


@pytest.mark.parametrize("regime", ["two symmetric", None])
@pytest.mark.parametrize("count", [1, 2])
def test_impacts_that_were_not_found_are_no_damping(
    tmp_path, measure, store, regime: str | None, count: int
) -> None:
    """zeta was 2.8 times too large by tests with two balls of which half of the impacts showed."""
    record = measure(b=[0.03], drive=Harmonic(0.25e-3, F0), start=15.0, duration=5.0)
    measured, band, table = (tmp_path / name for name in ("m.nc", "c.nc", "i.csv"))
    store(measured, record.channels, record.sample_rate)
    condition(measured, band, f0_hint=F0)
    impacts_of_record(measured, band, table, clearance=(0.03,))
    row = Record("one", Path("f"), "periodic", clearance=(0.03,) * count, frequency=(F0, F0))
    found = estimate_record(
        row, Known(), measured=measured, conditioned=band, impacts=table,
        shown={"regime": [{"regime": regime}]},
    )  # fmt: skip
    names = {e.parameter for e in found}
    assert ("driven" in names) == (regime is not None)
    assert ("lost_impacts" in names) == (regime is None)
    assert count > 1 or "r" in names  # flights of a single ball are free of what was not found


@pytest.mark.parametrize(("cycles", "share"), [(30, 1.8), (30, 0.1), (2, 0.5)])
def test_a_ring_down_with_a_ball_in_it_gives_no_damping(tmp_path, cycles, share):
    """zeta of a release that was called a ring-down was nine times too large."""
    shown = {"struck": {"cycles": cycles, "share": share}}
    found = analysed(
        tmp_path, {"displacement": decay(2000.0)[1]}, rate=2000.0, shown=shown, test="ringdown"
    )
    if cycles > 5 and share > 1.0:
        assert "a ball was in its cavity" in found["nothing", ""].note
    assert (("zeta", "likelihood") in found) == (cycles < 5 or share < 0.2)


@pytest.mark.parametrize("per_period", [2.2, 3.2, 5.6])
def test_a_decay_of_few_samples_a_period_is_read_or_refused_for_that(tmp_path, per_period):
    rate = F0 * per_period
    _, x, _ = decay(rate, 40.0)
    x = x + 2e-5 * np.random.default_rng(1).standard_normal(x.size)
    found = analysed(tmp_path, {"displacement": x}, rate=rate, test="ringdown")
    if per_period < 5.5:
        assert f"{per_period} samples in a period of 7.8" in found["nothing", ""].note
        return
    f0, zeta = found["f0", "likelihood"], found["zeta", "likelihood"]
    assert abs(f0.value - F0) < 4 * f0.std_error < 0.02 * F0
    assert abs(zeta.value - ZETA) < 4 * zeta.std_error < 0.1 * ZETA
