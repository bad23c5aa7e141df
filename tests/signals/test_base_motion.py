"""The base's motion from its channel, against bases whose motion is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.store import RecordWriter, open_record
from vinesexp.signals.base_motion import base_motion, base_rows

RATE, F, G = 1000.0, 7.862, 0.25e-3
T = np.arange(50_000) / RATE
W = 2.0 * np.pi * F


def sine(amplitude=G, phase=0.4):
    return amplitude * np.sin(W * T + phase)


@pytest.mark.parametrize("hint", [0.96, 1.0, 1.04])
@pytest.mark.parametrize(("quantity", "order"), [
    ("displacement", 0), ("velocity", 1), ("acceleration", 2),
])  # fmt: skip
def test_amplitude_and_frequency_whatever_the_channel_measures(hint, quantity, order):
    x = G * W**order * np.sin(W * T + 0.4 + 0.5 * np.pi * order)
    noise = 0.02 * G * W**order * np.random.default_rng(1).standard_normal(T.size)
    found = base_motion(x + noise, 1 / RATE, frequency=hint * F, quantity=quantity)
    assert abs(found.amplitude - G) < 4.0 * found.amplitude_error
    assert abs(found.frequency - F) < 4.0 * found.frequency_error
    assert found.amplitude_error < 1e-3 * G
    assert found.frequency_error < 1e-5 * F
    assert found.harmonic_2 < 1e-3
    assert found.wander < 1e-3
    assert found.dip < 0.01


def test_errors_are_those_of_the_scatter():
    rng = np.random.default_rng(5)
    pulls = []
    for _ in range(60):
        x = sine(phase=6.0 * rng.random()) + 0.2 * G * rng.standard_normal(T.size)
        found = base_motion(x, 1 / RATE, frequency=F)
        pulls.append(((found.amplitude - G) / found.amplitude_error,
                      (found.frequency - F) / found.frequency_error))  # fmt: skip
    assert np.std(pulls, axis=0).min() > 0.75
    assert np.std(pulls, axis=0).max() < 1.35


@pytest.mark.parametrize(("quantity", "order"), [("displacement", 0), ("acceleration", 2)])
def test_harmonics_are_shares_of_the_displacement(quantity, order):
    x = sum(
        share * G * (k * W) ** order * np.cos(k * W * T + k)
        for k, share in ((1, 1.0), (2, 0.06), (3, 0.03))
    )
    found = base_motion(x, 1 / RATE, frequency=F, quantity=quantity)
    assert found.harmonic_2 == pytest.approx(0.06, rel=1e-3)
    assert found.harmonic_3 == pytest.approx(0.03, rel=1e-3)
    assert found.amplitude == pytest.approx(G, rel=1e-4)


def test_a_base_that_wanders_and_dips():
    slow = 1.0 + 0.05 * np.sin(2 * np.pi * 0.05 * T)
    found = base_motion(slow * sine(), 1 / RATE, frequency=F)
    assert found.wander == pytest.approx(0.05 / np.sqrt(2.0), rel=0.1)
    dipped = np.where((T > 20.0) & (T < 22.0), 0.7, 1.0) * sine()
    assert base_motion(dipped, 1 / RATE, frequency=F).dip == pytest.approx(0.3, abs=0.01)


def test_a_base_at_rest_and_a_short_record_have_no_motion():
    noise = 1e-6 * np.random.default_rng(2).standard_normal(T.size)
    assert base_motion(noise, 1 / RATE, frequency=F) is None
    assert base_motion(sine()[:2000], 1 / RATE, frequency=F) is None


def write(path: Path, base: np.ndarray, quantity: str, **attributes: float) -> None:
    with RecordWriter(
        path, sample_rate=RATE, quantities={"base": quantity}, attributes=attributes
    ) as writer:
        writer.append({"base": base})


def test_row_of_a_record(tmp_path, monkeypatch):
    monkeypatch.setattr("vinesexp.signals.means.BLOCK", 700)  # read by blocks
    write(tmp_path / "a.nc", -(W**2) * sine(0.9 * G), "acceleration")
    write(tmp_path / "c.nc", np.zeros(10), "acceleration", oscillation_hz=F)
    with open_record(tmp_path / "a.nc") as measured, open_record(tmp_path / "c.nc") as conditioned:
        views = {"measured": measured, "conditioned": conditioned}
        (row,) = base_rows(Record("a", tmp_path, "periodic"), **views, steady_from=None)
        assert base_rows(Record("a", tmp_path, "transient"), **views, steady_from=None) == []
    assert row["record"] == "a"
    assert row["amplitude_m"] == pytest.approx(0.9 * G, rel=1e-3)
    assert row["frequency_hz"] == pytest.approx(F, rel=1e-6)
