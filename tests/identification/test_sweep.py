"""Sweeps: the transmissibility's f0, zeta, gain and lag, with both channels noisy."""

from pathlib import Path

import numpy as np
import pytest

from vinesexp import Oscillator, Release, Rig, Sweep, analyse, simulate
from vinesexp.errors import AnalysisError
from vinesexp.excitation import WeakDamping
from vinesexp.identification.sweep_record import estimates_of_sweep, transmissibility
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.store import RecordWriter, open_record

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
STEP = 5e-3


@pytest.fixture(scope="module")
def clean() -> tuple[np.ndarray, np.ndarray]:
    motion = simulate(Rig(TABLE_2), Sweep(0.25e-3, 7.2, 8.4, 60.0), Release(), duration=60.0)
    t = STEP * np.arange(12_000)
    return motion.base(t)[0], motion.at(t)[0]


def noisy(clean, seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    return tuple(y + 8.5e-7 * random.standard_normal(y.size) for y in clean)


def test_truth_within_its_errors_over_many_noises(clean) -> None:
    found = [
        transmissibility(*noisy(clean, s), STEP, frequency=7.8, swept=(7.2, 8.4)) for s in range(30)
    ]
    for name, truth in (("f0", TABLE_2.f0), ("zeta", TABLE_2.zeta), ("gain", 1.0), ("lag", 0.0)):
        pull = np.array([(getattr(f, name) - truth) / getattr(f, f"{name}_error") for f in found])
        assert 0.6 < np.sqrt((pull**2).mean()) < 1.5, name
        assert abs(pull.mean()) < 0.6, name


def test_gain_and_lag_of_a_channel_are_taken_out(clean) -> None:
    base, x = noisy(clean, 1)
    late = np.interp(STEP * np.arange(x.size) - 3e-4, STEP * np.arange(x.size), x)
    found = transmissibility(base, 1.03 * late, STEP, frequency=7.8, swept=(7.2, 8.4))
    assert found.f0 == pytest.approx(TABLE_2.f0, rel=2e-5)
    assert found.zeta == pytest.approx(TABLE_2.zeta, rel=2e-3)
    assert found.gain == pytest.approx(1.03, rel=2e-3)
    assert found.lag == pytest.approx(3e-4, abs=3e-5)


def test_drift_and_hum_stay_out(clean) -> None:
    base, x = noisy(clean, 2)
    t = STEP * np.arange(x.size)
    x = x + 2e-3 * (t / 60) ** 2 + 1e-4 * np.sin(2 * np.pi * 50 * t)
    found = transmissibility(base, x, STEP, frequency=7.8, swept=(7.2, 8.4))
    assert found.f0 == pytest.approx(TABLE_2.f0, rel=1e-5)
    assert found.zeta == pytest.approx(TABLE_2.zeta, rel=1e-3)


def test_base_that_rests_or_record_too_short_is_said(clean) -> None:
    base, x = noisy(clean, 3)
    still = 1e-6 * np.random.default_rng(0).standard_normal(base.size)
    with pytest.raises(AnalysisError, match="base does not move"):
        transmissibility(still, x, STEP, frequency=7.8)
    for n in (0, 1, 400):
        with pytest.raises(AnalysisError, match="Fourier lines"):
            transmissibility(base[:n], x[:n], STEP, frequency=7.8)


def test_a_sweep_of_hardly_more_lines_than_are_averaged_gives_what_it_can() -> None:
    rig = Oscillator(M=4.7, c1=0.5, k1=4.7 * (2 * np.pi * 1.5) ** 2)
    motion = simulate(Rig(rig), Sweep(1e-3, 1.39, 1.58, 40.0), Release(), duration=40.0)
    t = np.arange(40 * 500) / 500.0
    random = np.random.default_rng(0)
    shown = {"base": motion.base(t)[0], "displacement": motion.at(t)[0]}
    channels = {role: y + 1e-6 * random.standard_normal(t.size) for role, y in shown.items()}
    found = analyse(channels, 500.0, test="sweep", frequency=(1.39, 1.58))
    assert not found.checks["detail"].str.contains("ValueError").any()
    assert "f0" not in found.identified.index


@pytest.fixture(scope="module")
def rubbing() -> tuple[np.ndarray, np.ndarray]:
    """A guide that rubs with half of the force that drives the mass at its resonance."""
    force = 0.5 * TABLE_2.k1 * 0.25e-3
    motion = simulate(
        Rig(TABLE_2), Sweep(0.25e-3, 7.2, 8.4, 60.0), Release(), duration=60.0,
        damping=WeakDamping(coulomb=force),
    )  # fmt: skip
    t = STEP * np.arange(12_000)
    return motion.base(t)[0], motion.at(t)[0]


def test_what_is_no_linear_resonance_is_as_unsure_as_it_is_unlike_one(rubbing) -> None:
    """Its height was said to be that of a wrong sensitivity, its width to be sure to some per cent.

    At resonance the force of the base balances the damping, however this depends on amplitude.
    """
    found = transmissibility(*noisy(rubbing, 1), STEP, frequency=7.8, swept=(7.2, 8.4))
    balanced = 0.25e-3 / (2.0 * np.abs(rubbing[1]).max())
    assert found.left > 0.1
    assert abs(found.gain - 1.0) < 3.0 * found.gain_error
    assert abs(found.zeta - balanced) < 3.0 * found.zeta_error
    assert abs(found.f0 - TABLE_2.f0) < 3.0 * found.f0_error


def test_a_sweep_is_of_the_amplitude_of_its_resonance(clean, tmp_path) -> None:
    """It was the rms of the whole sweep, of which the resonance is a small part."""
    base, x = noisy(clean, 1)
    path = tmp_path / "r.nc"
    kinds = {"base": "displacement", "displacement": "displacement"}
    with RecordWriter(path, sample_rate=1.0 / STEP, quantities=kinds, attributes={}) as out:
        out.append({"base": base, "displacement": x})
    record = Record("a", Path("a"), "sweep", frequency=(7.2, 8.4))
    with open_record(path) as view:
        found = estimates_of_sweep(record, view, None)
    (zeta,) = [e for e in found if (e.parameter, e.method) == ("zeta", "sweep")]
    assert zeta.amplitude == pytest.approx(np.abs(x).max(), rel=0.02)
