"""Thirty to sixty samples a period: the motion of the mass must not be taken for impacts."""

import numpy as np
import pytest
from scipy.signal import butter, sosfilt
from tests.combined import leading
from tests.signals.contacts import struck as struck_at

from vinesexp import Harmonic, Release
from vinesexp.records.stored.store import open_record
from vinesexp.settings.stages import Settings
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.find import impacts_of_record, struck
from vinesexp.signals.impacts.slopes import Coarse, slope_changes

F0, FINE = 7.862, 1e4


def slowly(channels: dict[str, np.ndarray], step: int) -> dict[str, np.ndarray]:
    """Channels as a recorder with a filter before its converter takes them every `step` samples."""
    before = butter(4, 0.4 / step, fs=1.0, output="sos")
    return {role: sosfilt(before, x - x[0])[::step] for role, x in channels.items()}


@pytest.mark.long
@pytest.mark.parametrize("per_period", leading(1, [32, 70, 50]))
def test_impacts_are_found_at_few_samples_a_period(measure, tmp_path, store, per_period) -> None:
    record = measure(
        b=[0.03], drive=Harmonic(0.25e-3, F0), start=10.0, duration=20.0, noise=0.1, bits=16
    )
    step = round(FINE / F0 / per_period)
    store(record.path, slowly(record.channels, step), FINE / step)
    condition(record.path, tmp_path / "c.nc", f0_hint=F0)
    found = impacts_of_record(record.path, tmp_path / "c.nc", tmp_path / "i.csv", clearance=(0.03,))
    nearest = np.abs(found.time_s[:, np.newaxis] - record.time).argmin(axis=1)
    assert 0.97 * record.time.size < found.n <= record.time.size
    late = found.time_s - record.time[nearest]  # the filter's delay
    assert np.ptp(late) < 0.2 * step / FINE
    # what all jumps have wrong alike is in each error, so that their mean has it whole
    alike = np.median(found.velocity_jump_error_m_s / np.abs(record.jump[nearest])) / np.sqrt(
        found.n
    )
    ratio = np.median(found.velocity_jump_m_s / record.jump[nearest])
    assert ratio == pytest.approx(1.0, abs=3.0 * alike)
    assert alike < 0.25


@pytest.mark.parametrize("per_period", [24, 26, 34, 42])
def test_a_decay_without_a_ball_has_no_impacts(measure, tmp_path, store, per_period) -> None:
    """Its own swings were impacts, said to take more energy than the mass had."""
    record = measure(release=Release(x0=0.02), duration=16.0, noise=0.1, bits=16, drift=0.0)
    step = round(FINE / F0 / per_period)
    store(record.path, slowly(record.channels, step), FINE / step)
    condition(record.path, tmp_path / "c.nc", f0_hint=F0)
    with open_record(record.path) as raw, open_record(tmp_path / "c.nc") as view:
        cycles, share = struck(raw, view, Settings())
    assert share < 0.05, cycles


def rounded(motion: np.ndarray, step: int, way: str) -> np.ndarray:
    """A motion as a converter takes it every `step` samples of it."""
    if way == "mean":
        return motion[: motion.size // step * step].reshape(-1, step).mean(axis=1)
    return motion[::step] if way == "value" else slowly({"x": motion}, step)["x"] + motion[0]


@pytest.mark.parametrize("per_period", [48, 80, 160])
@pytest.mark.parametrize("way", ["value", "mean", "filter"])
def test_jumps_are_right_however_a_converter_rounds_a_bend(way: str, per_period: int) -> None:
    """Samples were taken for means over their step: of single values jumps were 3 % too large."""
    step, w = 40, 2.0 * np.pi
    fine = float(step * per_period)
    t = np.arange(40.0 * fine) / fine
    hits, jump = np.arange(0.61, 39.5, 0.4967), 0.3
    sign = (-1.0) ** np.arange(hits.size)
    motion = np.cos(w * t) + struck_at(t, hits, jump * sign, w=w)
    x = rounded(motion, step, way)
    x = x + 2e-4 * np.random.default_rng(per_period).standard_normal(x.size)
    delay = {
        "value": 0.0,
        "mean": -0.5 * (step - 1) / fine,
        "filter": 2.6131 / (2.0 * np.pi * 0.4) * step / fine,
    }
    seen = Coarse(x, 1.0 / per_period, 0.0, samples=1)
    found = slope_changes(
        seen, hits + delay[way], sign * jump, frequency=1.0,
        jump_errors=np.full(hits.size, 1.0),
    )  # fmt: skip
    alike = np.nanmedian(found.jump_error) / np.sqrt(hits.size)
    assert np.nanmean(sign * found.jump) == pytest.approx(jump, abs=3.0 * alike)
    assert alike < 0.04 * jump
