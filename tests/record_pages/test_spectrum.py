"""Spectra in the units that they state, and the phase plane of a motion that is known."""

import base64

import numpy as np
import pytest
from scipy.signal import welch
from tests.record_pages.decoded import unpacked

from vinesexp.record_pages.traces import phase_plane, spectrum
from vinesexp.records.stored.store import RecordWriter, open_record

RATE, F = 1000.0, 8.0


@pytest.mark.parametrize(("n", "section"), [(40_000, 8192), (90, 32), (31, 31)])
def test_the_density_is_that_of_welch(n, section):
    x = np.random.default_rng(3).normal(size=n)
    found = spectrum(lambda begin, end: x[begin:end], x.size, RATE)
    frequency, power = welch(x, RATE, nperseg=section, detrend="linear")
    assert found["resolution"] == pytest.approx(frequency[1])
    shown = 10.0 ** unpacked(found["density"])
    # Each drawn value is the largest of its part; the first parts hold one line each.
    count = min(20, power.size - 1)
    assert shown[:count] == pytest.approx(np.sqrt(power[1 : count + 1]), rel=2e-3)


def test_a_sine_stands_at_its_frequency():
    x = 3.0 * np.sin(2.0 * np.pi * F * np.arange(60_000) / RATE) + 100.0
    found = spectrum(lambda begin, end: x[begin:end], x.size, RATE)
    density = unpacked(found["density"])
    frequency = np.frombuffer(base64.b64decode(found["frequency"]["float64"]))
    assert frequency[int(np.argmax(density))] == pytest.approx(F, abs=found["resolution"])


@pytest.mark.parametrize("n", [1, 2, 7, 40, 1000])
def test_short_records_do_no_harm(n):
    x = np.arange(n, dtype=float)
    found = spectrum(lambda begin, end: x[begin:end], n, RATE)
    assert bool(found) == (n >= 8)


def test_a_harmonic_motion_is_a_circle(tmp_path):
    x = 2e-3 * np.sin(2.0 * np.pi * F * np.arange(20_000) / RATE)
    kinds = {"displacement": "displacement"}
    with RecordWriter(tmp_path / "a.nc", sample_rate=RATE, quantities=kinds) as made:
        made.append({"displacement": x})
    with open_record(tmp_path / "a.nc") as view:
        found = phase_plane(view, F)
    assert found is not None
    inside = slice(64, -64)
    radius = np.hypot(unpacked(found["x"]), unpacked(found["v"]))[inside]
    assert radius == pytest.approx(2.0, rel=5e-3)
    section = unpacked(found["x"])[:: found["each"]]
    assert np.ptp(section[1:-1]) < 0.02
