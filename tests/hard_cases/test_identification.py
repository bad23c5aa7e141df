"""Records that are bad in the ways records are: what can be known is right, the rest is said."""

from pathlib import Path

import numpy as np
import pytest
from tests.rehearsal import rehearse

from vinesexp.errors import AnalysisError, RecordError
from vinesexp.identification.ringdown import fit_ringdown

F0, ZETA, RATE = 7.862, 0.0065, 500.0


def decay(*, seconds=18.0, A=0.02, noise=6e-6, seed=0, f0=F0, zeta=ZETA, start=0.0):
    t = start + np.arange(round(seconds * RATE)) / RATE
    w0 = 2 * np.pi * f0
    x = A * np.exp(-zeta * w0 * t) * np.cos(w0 * np.sqrt(1 - zeta**2) * t + 0.3)
    return x + noise * np.random.default_rng(seed).standard_normal(t.size)


def fitted(x, frequency=7.7):
    return fit_ringdown(x, sample_rate=RATE, frequency=frequency)


def right(found, *, errors=4.0, f0=F0, zeta=ZETA):
    """Within the stated errors, and these no larger than useful."""
    assert abs(found.f0 - f0) < errors * found.f0_error
    assert abs(found.zeta - zeta) < errors * found.zeta_error
    assert found.f0_error < 1e-3 * f0
    assert found.zeta_error < 0.05 * zeta


def test_a_late_trigger_leaves_the_end_of_the_decay():
    right(fitted(decay(start=12.0, seconds=6.0)))


def test_waiting_and_a_hand_before_the_release():
    quiet = 6e-6 * np.random.default_rng(1).standard_normal(round(3 * RATE))
    pulled = 0.02 * np.cos(0.3) * np.ones(round(0.2 * RATE))
    right(fitted(np.concatenate([quiet, pulled, decay()])))


@pytest.mark.long
def test_drift_larger_than_the_motion():
    t = np.arange(round(18 * RATE)) / RATE
    drift = 0.08 * np.sin(2 * np.pi * t / 25.0) + 0.02 * np.sin(2 * np.pi * t / 7.0 + 1.0)
    right(fitted(decay() + drift))


def test_eight_bits():
    step = 0.05 / 256
    right(fitted(step * np.round(decay() / step)))


@pytest.mark.parametrize("seed", range(4))
def test_a_twentieth_of_the_samples_missing(seed):
    x = decay(seed=seed)
    x[np.random.default_rng(seed).random(x.size) < 0.05] = np.nan
    right(fitted(x))


def test_a_gap_of_half_a_second():
    x = decay()
    x[round(4.5 * RATE) : round(5.0 * RATE)] = np.nan
    right(fitted(x))


def test_mains_hum_stronger_than_the_noise():
    t = np.arange(round(18 * RATE)) / RATE
    hum = 2e-4 * np.sin(2 * np.pi * 50.0 * t) + 1e-4 * np.sin(2 * np.pi * 150.0 * t + 1.0)
    right(fitted(decay() + hum))


@pytest.mark.parametrize("seed", range(4))
def test_three_periods(seed):
    found = fitted(decay(seconds=3.2 / F0, seed=seed))
    assert abs(found.f0 - F0) < 4 * found.f0_error
    assert abs(found.zeta - ZETA) < 4 * found.zeta_error
    assert found.f0_error < 1e-3 * F0


def test_two_periods_are_refused():
    with pytest.raises(AnalysisError, match=r"2 periods of 7\.7 Hz in the record, expected 3"):
        fitted(decay(seconds=2.2 / F0))


@pytest.mark.parametrize(
    ("share", "other"), [(0.02, 8.4), (0.1, 7.2), (0.3, 11.0), (0.02, 11.0), (0.3, 8.4)]
)
def test_beats_of_two_close_modes_are_said(share, other):
    found = fitted(decay() + decay(A=0.02 * share, f0=other, zeta=0.004, noise=0.0))
    assert abs(found.f0 - F0) < 4 * found.f0_error
    assert found.beat is not None
    assert found.beat[0] == pytest.approx(other, rel=0.02)
    assert found.beat[1] == pytest.approx(share, rel=0.5)


def test_one_mode_has_no_beats():
    assert fitted(decay()).beat is None


@pytest.mark.parametrize("zeta", [1e-5, 0.1, 0.2])
def test_damping_almost_none_and_strong(zeta):
    found = fitted(decay(zeta=zeta))
    assert found.f0 == pytest.approx(F0, rel=2e-3)
    assert abs(found.zeta - zeta) < 5 * found.zeta_error + 1e-3 * zeta


@pytest.mark.parametrize("drift", [0.0, 2e-3, -2e-3])
def test_a_steady_drive_is_no_ring_down(drift):
    t = np.arange(round(18 * RATE)) / RATE
    x = 5e-3 * (1.0 - drift * t / 18.0) * np.cos(2 * np.pi * F0 * t + 0.3)
    x += 6e-6 * np.random.default_rng(3).standard_normal(t.size)
    with pytest.raises(AnalysisError, match=r"the mass is driven|does not decay") as found:
        fitted(x)
    assert "falls by -" not in str(found.value)


@pytest.mark.long
def test_a_likelihood_that_contradicts_the_amplitudes_does_not_win():
    """Half of a record lies under a burst of something else: every method errs, and says so."""
    t = np.arange(round(6 * RATE)) / RATE
    x = decay(seconds=6.0)
    burst = (t > 1.5) & (t < 4.0)
    x[burst] += 6e-3 * np.cos(2 * np.pi * (F0 + 0.35) * t[burst] + 1.0)
    found = fitted(x)
    assert abs(found.zeta - ZETA) < 3 * found.zeta_error
    assert abs(found.f0 - F0) < 3 * found.f0_error


@pytest.mark.parametrize("seconds", [0.5, 3.0])
@pytest.mark.parametrize(
    ("f0", "zeta", "share"),
    [(30.0, 0.03, 0.2), (12.0, 0.02, 0.1), (20.0, 0.005, 0.4)],
)
@pytest.mark.long
def test_a_strong_third_mode_on_a_short_record_misleads_nobody(f0, zeta, share, seconds):
    """A likelihood that leaves a tenth of the motion neither wins nor refuses a plain decay."""
    t = np.arange(round(seconds * RATE)) / RATE
    w = 2 * np.pi * f0
    x = np.exp(-zeta * w * t) * np.cos(w * t)
    x += share * np.exp(-0.01 * 3.1 * w * t) * np.cos(3.1 * w * t + 1.0) + 0.02 * t
    x += 1e-3 * np.random.default_rng(0).standard_normal(t.size)
    found = fitted(1e-2 * x, frequency=1.03 * f0)
    true = f0 / np.sqrt(1 - zeta**2)
    assert abs(found.f0 - true) < 4 * found.f0_error + 1e-5 * true
    assert abs(found.zeta - zeta) < 4 * found.zeta_error
    assert found.f0 == pytest.approx(true, rel=5e-3)
    assert found.zeta == pytest.approx(zeta, rel=0.1)


SCENE = """\
title: Channels
seed: 3
rig: {mass: 4.7 kg, damping: 3.02 N s/m, stiffness: 1.147e4 N/m, nes_mass: 32 g, restitution: 0.6}
sensors:
  base: {sensitivity: 400 mV/mm, noise: 2 um, range: 2.5 mm}
  displacement: {sensitivity: 40 mV/mm, noise: 6 um, range: 25 mm}
  acceleration: {sensitivity: 20 mV/g, noise: 0.3 m/s^2, pulse: 0.4 ms, range: 50 g}
oscilloscope: {sample_rate: 10 kHz, bits: 14, full_scale: 1 V, format: hdf5}
groups:
  all:
    test: periodic
    records:
      forced: {duration: 8 s, settle: 10 s, base_amplitude: 0.25 mm, frequency: 7.862 Hz,
               clearance: 30 mm, ball_start: wall -1}
"""


def reported(folder: Path, change) -> set[tuple[str, str]]:
    """Record and name of the warnings where campaign.yaml is wrong."""
    (folder / "scene.yaml").write_text(SCENE, encoding="utf-8")
    from vinesexp.laboratory.scene import load_scene
    from vinesexp.laboratory.simulated_files import campaign_text

    text = campaign_text(load_scene(folder / "scene.yaml"))
    (folder / "campaign.yaml").write_text(change(text), encoding="utf-8")
    checks = rehearse(folder / "scene.yaml").checks
    return {(c.record, c.check) for c in checks if c.outcome == "warning"}


@pytest.mark.long
def test_right_channels_raise_no_warning_of_sign_or_gain(tmp_path):
    assert not {"sign", "gain"} & {check for _, check in reported(tmp_path, lambda text: text)}


@pytest.mark.long
def test_the_wrong_sign_of_a_channel_is_reported(tmp_path):
    assert ("forced", "sign") in reported(
        tmp_path, lambda text: text.replace("20 mV/g", "-20 mV/g")
    )


def test_swapped_channels_are_refused(tmp_path):
    def swapped(text):
        return (
            text.replace('"CH2*"', '"other*"')
            .replace('"CH3*"', '"CH2*"')
            .replace('"other*"', '"CH3*"')
        )

    with pytest.raises(RecordError, match="exchange their columns"):
        reported(tmp_path, swapped)
