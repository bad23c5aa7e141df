"""Periodic tests with a ball and nothing beside them: f0 and zeta by how the mass moves."""

import pytest
from tests.rehearsal import rehearse

pytestmark = pytest.mark.long

SCENE = """\
title: Tests with a ball alone
seed: 3
rig: {mass: 4.7 kg, damping: 3.02 N s/m, stiffness: 1.147e4 N/m, nes_mass: 32 g, restitution: 0.6}
sensors:
  base: {sensitivity: 400 mV/mm, noise: 2 um, range: 2.5 mm}
  displacement: {sensitivity: 100 mV/mm, noise: 5 um, range: 25 mm}
  acceleration: {sensitivity: 20 mV/g, noise: 0.3 m/s^2, pulse: 0.4 ms, range: 50 g}
oscilloscope: {sample_rate: 5 kHz, bits: 14, full_scale: 2.5 V, format: hdf5}
groups:
  a:
    test: periodic
    duration: 12 s
    settle: 20 s
    base_amplitude: 0.25 mm
    frequency: 7.862 Hz
    ball_start: wall -1
    records: {b30: {clearance: 30 mm}, b37: {clearance: 37 mm}, b45: {clearance: 45 mm}}
"""


@pytest.mark.parametrize("recorded", [True, False])
def test_the_rig_is_known_without_a_ring_down(tmp_path, recorded):
    text = SCENE if recorded else "\n".join(
        line for line in SCENE.splitlines() if "  base:" not in line
    )  # fmt: skip
    (tmp_path / "scene.yaml").write_text(text)
    found = rehearse(tmp_path / "scene.yaml")
    for name, true, most in (("f0", 7.8623, 3e-4), ("zeta", 6.504e-3, 2e-2), ("r", 0.6, 1e-3),
                             ("M", 4.7, 3e-2), ("k1", 1.147e4, 3e-2)):  # fmt: skip
        value = found.combined(name)
        assert abs(value.value - true) < 3.5 * value.std_error < 3.5 * most * true, name
    frequency = [e for e in found.rows if e.parameter == "base_frequency"]
    assert bool(frequency) == (not recorded)
    assert all(abs(e.value - 7.862) < 3.5 * e.std_error < 3e-3 for e in frequency)
