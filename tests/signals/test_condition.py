"""Conditioned records: first cycle and last impact survive, whatever channels there are."""

from pathlib import Path

import numpy as np
import pytest

from vinesexp import Harmonic, Release
from vinesexp.errors import ParameterError
from vinesexp.records.stored.store import open_record, write_refused
from vinesexp.signals.channel_agreement import agreement_in
from vinesexp.signals.condition import condition
from vinesexp.signals.filters import default_bands
from vinesexp.signals.means import cycle_amplitudes, fill_gaps


def test_first_and_last_cycle_of_a_ring_down_survive(measure, tmp_path: Path) -> None:
    record = measure(release=Release(x0=0.02), duration=10.0)
    bands = condition(record.path, tmp_path / "out.nc")
    assert bands is not None
    assert bands.frequency == pytest.approx(7.862, rel=2e-3)
    with open_record(tmp_path / "out.nc") as out:
        x = out.read("displacement")
    error = np.abs(x - record.x_exact)
    cycle = round(1e4 / 7.862)
    # within 2 % of the amplitude at each end, where a mirrored record is off by a fifth
    assert error[:cycle].max() < 0.02 * np.abs(record.x_exact[:cycle]).max()
    assert error[-cycle:].max() < 0.02 * np.abs(record.x_exact[-cycle:]).max()


def test_last_impact_survives(measure, tmp_path: Path) -> None:
    record = measure(b=[0.03], drive=Harmonic(0.25e-3, 7.862), start=10.0, duration=5.0)
    last = record.time[-1]
    cut = round(last * 1e4) + 4  # the record ends within the contact
    channels = {role: values[:cut] for role, values in record.channels.items()}
    from vinesexp.records.stored.store import RecordWriter

    path = tmp_path / "cut.nc"
    kinds = {"base": "displacement", "displacement": "displacement", "acceleration": "acceleration"}
    with RecordWriter(path, sample_rate=1e4, quantities=kinds) as writer:
        writer.append(channels)
    condition(path, tmp_path / "out.nc", f0_hint=7.862)
    with open_record(tmp_path / "out.nc") as out:
        a = out.read("acceleration")
    before = np.abs(record.channels["acceleration"][cut - 10 : cut]).max()
    assert np.abs(a[-10:]).max() > 0.7 * before


def test_acceleration_keeps_the_impacts_and_loses_the_motion(measure, tmp_path: Path) -> None:
    record = measure(b=[0.03], drive=Harmonic(0.25e-3, 7.862), start=10.0, duration=5.0)
    condition(record.path, tmp_path / "out.nc", f0_hint=7.862)
    with open_record(tmp_path / "out.nc") as out:
        a = out.read("acceleration")
        assert out.attributes["acceleration_low_hz"] == pytest.approx(157.24)
    quiet = np.ones(a.size, dtype=bool)
    for t in record.time:
        quiet[max(0, round(t * 1e4) - 60) : round(t * 1e4) + 60] = False
    assert a[quiet].std() == pytest.approx(0.3, rel=0.1)


def test_slow_record_without_acceleration(store, tmp_path: Path) -> None:
    t = np.arange(3000) / 100.0
    x = np.round((0.4 + 0.08 * np.exp(-0.03 * t) * np.cos(2 * np.pi * 1.226 * t)) * 100) / 100
    store(tmp_path / "in.nc", {"displacement": x}, 100.0)
    bands = condition(tmp_path / "in.nc", tmp_path / "out.nc")
    assert bands is not None
    assert bands.frequency == pytest.approx(1.226, abs=0.01)
    with open_record(tmp_path / "out.nc") as out:
        assert out.roles == ("displacement",)
        assert abs(out.read("displacement").mean()) < 5e-3


def test_drop_test_with_acceleration_only_and_a_very_short_record(store, tmp_path: Path) -> None:
    a = np.random.default_rng(0).standard_normal(40)
    store(tmp_path / "in.nc", {"acceleration": a}, 1e4)
    bands = condition(tmp_path / "in.nc", tmp_path / "out.nc")
    assert bands is not None
    assert bands.frequency is None
    with open_record(tmp_path / "out.nc") as out:
        assert out.n == 40
        assert np.isfinite(out.read("acceleration")).all()


def test_refused_record_is_passed_on(tmp_path: Path) -> None:
    write_refused(tmp_path / "in.nc", "frozen")
    assert condition(tmp_path / "in.nc", tmp_path / "out.nc") is None
    with open_record(tmp_path / "out.nc") as out:
        assert out.refused == "frozen"


def test_band_that_the_record_does_not_hold(store, tmp_path: Path) -> None:
    store(tmp_path / "in.nc", {"displacement": np.sin(np.arange(500.0))}, 10.0)
    with pytest.raises(ParameterError, match=r"^bandpass: lower corner 8 Hz"):
        condition(tmp_path / "in.nc", tmp_path / "out.nc", bandpass=(8.0, 20.0))
    assert not (tmp_path / "out.nc").exists()


def test_user_band_is_for_the_motion_only() -> None:
    bands = default_bands(sample_rate=1e4, frequency=8.0, bandpass=(3.0, 30.0))
    assert bands.displacement == (3.0, 30.0)
    assert bands.acceleration == (160.0, None)


def test_gaps_are_bridged() -> None:
    assert fill_gaps(np.array([np.nan, 1.0, np.nan, 3.0, np.inf])).tolist() == [1, 1, 2, 3, 3]
    assert fill_gaps(np.full(3, np.nan)).tolist() == [0, 0, 0]


@pytest.mark.parametrize("b", [0.03, 0.046])  # two impacts per cycle; strongly modulated
def test_an_accelerometer_alone_shows_the_displacement_in_its_band(measure, store, tmp_path, b):
    record = measure(b=[b], drive=Harmonic(0.25e-3, 7.862), start=10.0, duration=8.0)
    kept = {role: record.channels[role] for role in ("base", "acceleration")}
    for name, channels in (("with", record.channels), ("without", kept)):
        store(tmp_path / f"{name}.nc", channels, record.sample_rate)
        condition(tmp_path / f"{name}.nc", tmp_path / f"{name}_out.nc", f0_hint=7.862)
    amplitudes = {}
    for name in ("with", "without"):
        with open_record(tmp_path / f"{name}_out.nc") as out:
            x = out.read("displacement")
            amplitudes[name] = cycle_amplitudes(x, record.sample_rate, 7.862)[1]
    mean = amplitudes["with"].mean()
    assert np.abs(amplitudes["without"] / amplitudes["with"] - 1.0)[2:-2].max() < 0.02
    assert amplitudes["without"].mean() == pytest.approx(mean, rel=3e-3)


@pytest.mark.parametrize(("limit", "agrees"), [(60.0, True), (8.0, False)])
def test_a_swing_that_is_clipped_says_nothing_of_gains(measure, store, tmp_path, limit, agrees):
    """Its gain was 0.82 beside the displacement, and a sensitivity was called wrong."""
    record = measure(b=[0.03], drive=Harmonic(0.25e-3, 7.862), start=10.0, duration=10.0)
    a = np.clip(record.channels["acceleration"], -limit, limit)
    path = tmp_path / "clipped.nc"
    store(path, {**record.channels, "acceleration": a}, 1e4)
    condition(path, tmp_path / "c.nc", f0_hint=7.862)
    with open_record(tmp_path / "c.nc") as view:
        found = agreement_in(view.attributes)
    assert (found is not None) == agrees
    assert found is None or found.gain == pytest.approx(1.0, abs=0.01)
