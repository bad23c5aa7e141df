"""Rig parameters: Table 2 of the paper, and refusal of what has no meaning."""

import math

import numpy as np
import pytest

from vinesexp import NES, Harmonic, Measured, Oscillator, Release, Rig, simulate
from vinesexp.errors import ParameterError
from vinesexp.excitation import SteppedSweep, WeakDamping
from vinesexp.theory import b_c_exact

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)


def test_table_2_gives_the_published_reduced_parameters():
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=0.034, r=0.6)])
    assert rig.eps == pytest.approx(0.0068, abs=5e-5)
    assert rig.lam == pytest.approx(1.91, abs=5e-3)
    assert TABLE_2.f0 == pytest.approx(7.862, abs=5e-4)
    assert rig.nes[0].Gamma == pytest.approx(0.25, rel=1e-15)
    assert TABLE_2.zeta == pytest.approx(rig.eps * rig.lam / 2, rel=1e-14)


@pytest.mark.parametrize("kind", [np.float32, np.int64, np.array, lambda x: np.ma.array(x)])
def test_a_number_of_numpy_is_a_number(kind):
    rig = Rig(Oscillator(M=kind(4), c1=kind(3), k1=kind(11470)), NES(m=0.032, b=0.03, r=0.6))
    assert (rig.oscillator.M, type(rig.oscillator.M)) == (4.0, float)
    assert [ball.m for ball in rig.nes] == [0.032], "one ball may stand without a list"
    start = Release(x0=kind(1), y0=kind(1))
    assert (start.x0, start.y0) == (1.0, (1.0,))
    sweep = SteppedSweep(kind(0), frequencies=kind(7), dwell=kind(20))
    assert (sweep.frequencies, sweep.duration) == ((7.0,), 20.0)


def test_a_masked_sample_is_a_missing_one():
    samples = np.ma.masked_greater(np.arange(20.0), 12.0)
    with pytest.raises(ParameterError, match="base record, sample 13: nan"):
        Measured(samples, 100.0)
    assert np.asarray(Measured(samples[:10], np.float32(100.0)).samples).tolist() == list(range(10))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Oscillator(M="4.7 kg", c1=1.0, k1=1.0), "mass M: found '4.7 kg', expected one"),
        (lambda: Oscillator(M=np.array([4.7]), c1=1.0, k1=1.0), "mass M: found array([4.7])"),
        (lambda: Oscillator(M=4.7, c1=1j, k1=1.0), "damping c1: found complex numbers"),
        (lambda: Oscillator(M=np.ma.masked, c1=1.0, k1=1.0), "mass M = nan"),
        (lambda: Rig(TABLE_2, nes=0.03), "expected Rig(Oscillator(...), nes=[NES(...), ...])"),
        (lambda: Rig(4.7), "expected Rig(Oscillator(...), nes=[NES(...), ...])"),
        (lambda: Harmonic("0.25 mm", 7.8), "base amplitude: found '0.25 mm', expected one number"),
        (lambda: Measured(np.zeros(9), "1 kHz"), "sample rate: found '1 kHz', expected one"),
        (lambda: Measured(np.zeros(9), np.zeros(9)), "sample rate: found array([0., 0., 0."),
        (lambda: Measured(np.zeros(9) + 1j, 10.0), "base record: found complex numbers"),
        (lambda: Release(y0="30 mm"), "y0: found '30 mm', expected one number, in SI"),
        (lambda: simulate(Rig(TABLE_2), duration="20 s"), "duration: found '20 s', expected one"),
        (lambda: WeakDamping(coulomb="50 N"), "Coulomb: found '50 N'"),
        (lambda: b_c_exact(G="1 mm", M=1.0, c1=1.0, k1=1.0, m=1.0, r=0.5), "found '1 mm'"),
    ],
)
def test_what_is_no_number_is_refused_in_one_line(make, words):
    with pytest.raises(ParameterError) as caught:
        make()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_modal_values_come_back():
    again = Oscillator.from_modal(M=TABLE_2.M, f0=TABLE_2.f0, zeta=TABLE_2.zeta)
    assert again.c1 == pytest.approx(TABLE_2.c1, rel=1e-14)
    assert again.k1 == pytest.approx(TABLE_2.k1, rel=1e-14)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Oscillator(M=-1.0, c1=1.0, k1=1.0), "mass M = -1.0: expected kg, above zero"),
        (lambda: Oscillator(M=1.0, c1=-1.0, k1=1.0), "damping c1"),
        (lambda: Oscillator(M=1.0, c1=1.0, k1=0.0), "stiffness k1"),
        (lambda: Oscillator(M=math.nan, c1=1.0, k1=1.0), "mass M"),
        (lambda: NES(m=0.0, b=1.0, r=0.5), "ball mass m"),
        (lambda: NES(m=1.0, b=-1.0, r=0.5), "clearance b"),
        (lambda: NES(m=1.0, b=1.0, r=1.01), "restitution r"),
        (lambda: NES(m=1.0, b=1.0, r=0.5, b_minus=0.0), "clearance b_minus = 0.0"),
        (lambda: NES(m=1.0, b=1.0, r=0.5, r_minus=1.5), "restitution r_minus = 1.5"),
        (lambda: NES(m=1.0, b=1.0, r=0.5, r_slope=math.nan), "r_slope = nan"),
        (lambda: NES(m=1.0, b=1.0, r=0.5, r_minus=1.5, r_slope=-0.1), "restitution r_minus = 1.5"),
        (lambda: NES(m=1.0, b=1.0, r=0.5, friction=-0.1), "friction mu g = -0.1"),
        (lambda: NES(m=1.0, b=1.0, r=0.5, tilt=math.inf), "tilt = inf"),
        (lambda: Oscillator(M=1.0, c1=1.0, k1=1.0, k3=math.nan), "cubic stiffness k3"),
    ],
)
def test_a_value_without_meaning_is_refused(make, words):
    with pytest.raises(ParameterError) as caught:
        make()
    assert words in str(caught.value)
