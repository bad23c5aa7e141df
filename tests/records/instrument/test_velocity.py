"""A sensor of velocity, such as a laser Doppler vibrometer: its integral is the displacement."""

import re

import numpy as np
import pytest

from vinesexp.cli import main
from vinesexp.identification.ringdown import fit_ringdown
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.instrument.ingest import ingest, read_file
from vinesexp.records.stored import store
from vinesexp.records.stored.store import (
    RecordWriter,
    integrate,
    integrated,
    open_record,
    zero_of,
)

F, ZETA, RATE = 7.9, 0.006, 1000.0
W = 2 * np.pi * F
T = np.arange(12000) / RATE


def motion():
    """Displacement, m, and velocity, m/s, of a release from 5 mm."""
    damped = W * np.sqrt(1.0 - ZETA**2)
    z = 5e-3 * np.exp((1j * damped - ZETA * W) * T)
    return z.real, ((1j * damped - ZETA * W) * z).real


def integral(folder, v, *, released=False):
    """The displacement that a record of a velocity has after it was integrated."""
    path = folder / "a.nc"
    with RecordWriter(path, sample_rate=RATE, quantities={"displacement": "velocity"}) as writer:
        writer.append({"displacement": v})
    integrate(path, "displacement", released=released)
    with open_record(path) as view:
        return view.read("displacement")


def written(path, unit, size):
    v = motion()[1] * size + 0.02 * size * np.random.default_rng(1).standard_normal(T.size) * 0.1
    v += 0.003 * size  # the zero of the sensor
    table = np.stack([T, v], axis=1)
    np.savetxt(path, table, delimiter=",", header=f"Time (s),Vib ({unit})", comments="", fmt="%.7g")


@pytest.mark.parametrize(("unit", "size"), [("mm/s", 1e3), ("m/s", 1.0), ("um/s", 1e6)])
def test_a_vibrometers_record_is_proposed_and_gives_displacement_f0_and_zeta(unit, size, tmp_path):
    written(tmp_path / "ring.csv", unit, size)
    assert main(["init", str(tmp_path)]) == 0
    text = (tmp_path / "campaign.yaml").read_text()
    assert f'quantity: velocity, unit: "{unit}"' in text
    assert ",ringdown," in (tmp_path / "records.csv").read_text()
    campaign = load_campaign(tmp_path)
    found = ingest(campaign, campaign.records[0], tmp_path / "a.nc")
    assert any("integral of the measured velocity" in check.detail for check in found)
    with open_record(tmp_path / "a.nc") as view:
        assert view.quantity("displacement") == "displacement"
        x = view.read("displacement")
    fit = fit_ringdown(x, sample_rate=RATE, frequency=F)
    assert fit.amplitude == pytest.approx(5e-3, rel=0.01)
    assert abs(fit.f0 - F) < 4.0 * fit.f0_error
    assert abs(fit.zeta - ZETA) < 4.0 * fit.zeta_error
    assert fit.zeta_error < 0.01 * ZETA
    channels, rate = read_file(tmp_path / "ring.csv", {"displacement": ("Vib*", unit)})
    assert rate == RATE
    drift = channels["displacement"] - channels["displacement"][0] - x  # no test is stated there
    np.testing.assert_allclose(drift, 0.0, atol=1e-3 * 5e-3)


@pytest.mark.parametrize("held", [0.0, 0.4, 2.0])
@pytest.mark.parametrize("end", [3.52, 6.05, 12.0])
def test_the_middle_of_a_release_does_not_drift(held, end, tmp_path):
    """Its way to rest is no zero of the sensor: r of such tests was 0.6 % too large."""
    n, wait = round(end * RATE), round(held * RATE)
    x, v = (np.concatenate([np.full(wait, one[0]), one])[:n] for one in motion())
    v[:wait] = 0.0
    off = integral(tmp_path, v + 0.003, released=True) - x
    # the plain mean leaves a drift of 5 mm over any record
    assert np.ptp(off) < 0.05 * 5e-3


@pytest.mark.parametrize("at", [0, 6000, 11_980])
def test_a_burst_of_the_sensor_is_not_where_the_motion_begins(at, tmp_path):
    """Late in a release it left some cycles to find the zero in: the middle drifted by metres."""
    x, v = motion()
    v[at : at + 6] += 5.0
    off = integral(tmp_path, v + 0.003, released=True) - x
    for part in (off[: max(at - 5, 0)], off[at + 12 :]):  # the burst itself is a step
        assert part.size < 100 or np.ptp(part) < 0.05 * 5e-3


def test_the_hold_of_a_release_says_nothing_of_the_middle_either(tmp_path):
    """From the file that `init` proposes to the record, as a lab has it."""
    wait = 2000
    x, v = (np.concatenate([np.full(wait, one[0]), one]) for one in motion())
    v[:wait] = 0.0
    volts = 40.0 * (v + 0.003) + 1e-4 * np.random.default_rng(3).standard_normal(v.size)
    table = np.stack([np.arange(v.size) / RATE, volts], axis=1)
    head = "Time (s),Vibrometer (V)"
    np.savetxt(tmp_path / "ring.csv", table, delimiter=",", header=head, comments="", fmt="%.7g")
    assert main(["init", str(tmp_path)]) == 0
    path = tmp_path / "campaign.yaml"
    text = path.read_text()
    assert "quantity: velocity" in text
    path.write_text(re.sub(r'sensitivity: "\?[^"]*"', 'sensitivity: "25 mm/s/V"', text))
    campaign = load_campaign(tmp_path)
    ingest(campaign, campaign.records[0], tmp_path / "a.nc")
    with open_record(tmp_path / "a.nc") as view:
        off = view.read("displacement") - x
    assert np.ptp(off) < 0.05 * 5e-3


def test_a_velocity_beside_a_displacement_takes_no_role(tmp_path):
    x, v = motion()
    table = np.stack([T, 1e3 * x, 1e3 * v], axis=1)
    head = "Time (s),s (mm),speed (mm/s)"
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header=head, comments="", fmt="%.7g")
    assert main(["init", str(tmp_path)]) == 0
    text = (tmp_path / "campaign.yaml").read_text()
    assert 'displacement: {column: "s (mm)", quantity: displacement' in text


def test_a_gyroscope_alone_is_the_rate_of_an_arc(tmp_path):
    """A phone on a pendulum: f0 and zeta need no radius, amplitudes do."""
    turn = motion()[1] / 0.4
    noise = 1e-4 * np.random.default_rng(2).standard_normal((2, T.size))
    head = "Time (s),Gyroscope x (rad/s),Gyroscope y (rad/s)"
    table = np.stack([T, turn + noise[0], noise[1]], axis=1)
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header=head, comments="", fmt="%.7g")
    assert main(["init", str(tmp_path)]) == 0
    path = tmp_path / "campaign.yaml"
    text = path.read_text()
    assert 'quantity: velocity, unit: "rad/s", radius: "? m"' in text
    path.write_text(text.replace("? m", "0.4 m"))
    campaign = load_campaign(tmp_path)
    ingest(campaign, campaign.records[0], tmp_path / "a.nc")
    with open_record(tmp_path / "a.nc") as view:
        x = view.read("displacement")
    assert np.ptp(x[:200]) == pytest.approx(np.ptp(motion()[0][:200]), rel=0.01)


def test_the_integral_of_a_long_record_is_made_by_blocks(tmp_path, monkeypatch):
    v = motion()[1]
    v[1390:1420] = np.nan
    monkeypatch.setattr(store, "_AT_ONCE", 700)
    x = integral(tmp_path, v)
    expected = integrated(v - zero_of(v), 1.0 / RATE)
    np.testing.assert_allclose(x, expected, atol=1e-6)
    known = np.isfinite(v)
    assert np.isnan(x[~known]).all()
    assert np.isfinite(x[known]).all()
