"""Several modes in one ring-down: each with frequency and damping, and nothing that is no mode."""

import numpy as np
import pytest

from vinesexp.identification.decay_record import other_modes
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.whole_campaign import remarks

RATE = 2000.0
T = np.arange(30000) / RATE
#: Hz, zeta, amplitude: a beam after a blow.
MODES = ((7.9, 0.006, 1.0), (49.5, 0.002, 0.3), (138.0, 0.0012, 0.1))


def ringing(modes=MODES, noise=1e-3):
    x = sum(
        A * np.exp(-z * 2 * np.pi * f * T) * np.cos(2 * np.pi * f * T + k)
        for k, (f, z, A) in enumerate(modes)
    )
    return x + noise * np.random.default_rng(1).standard_normal(T.size)


def test_every_mode_is_found():
    found = other_modes(ringing(), 1 / RATE, frequency=7.9, zeta=0.006)
    assert len(found) == 2
    for mode, (f, zeta, A) in zip(sorted(found, key=lambda m: m.f0), MODES[1:], strict=True):
        assert mode.f0 == pytest.approx(f, abs=4 * mode.f0_error + 1e-4 * f)
        assert mode.zeta == pytest.approx(zeta, abs=4 * mode.zeta_error + 0.02 * zeta)
        assert mode.amplitude == pytest.approx(A, rel=0.1)
        assert mode.zeta_error < 0.1 * zeta


def test_beside_the_mode_that_the_sheet_asks_for_the_strongest_is_said():
    found = other_modes(ringing(), 1 / RATE, frequency=49.5, zeta=0.002)
    assert min(abs(mode.f0 - 7.9) for mode in found) < 0.01


def test_neither_hum_nor_harmonics_nor_noise_are_modes():
    x = ringing(MODES[:1]) + 0.1 * np.cos(2 * np.pi * 50.0 * T)
    swing = np.exp(-0.006 * 2 * np.pi * 7.9 * T)
    x += 0.1 * swing**3 * np.cos(3 * 2 * np.pi * 7.9 * T)
    assert other_modes(x, 1 / RATE, frequency=7.9, zeta=0.006) == []


def test_a_record_without_motion_has_no_modes():
    assert other_modes(np.zeros(4000), 1e-3, frequency=7.9, zeta=0.006) == []


def test_checks_say_them():
    rows = (("mode", 49.5, 1e-3), ("mode_zeta", 2e-3, 1e-5), ("mode_share", 0.3, 0.0))
    found = [Estimate(name, value, error, "1", "x", ("a",)) for name, value, error in rows]
    (check,) = remarks(found)
    assert check.record == "a"
    assert "49.5 Hz (zeta 0.002 +- 1e-05, 30 % of the amplitude)" in check.detail
