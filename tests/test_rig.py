"""Rig parameters: Table 2 of the paper, and refusal of what has no meaning."""

import math

import pytest

from vinesexp import NES, Oscillator, Rig
from vinesexp.errors import ParameterError

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)


def test_table_2_gives_the_published_reduced_parameters():
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=0.034, r=0.6)])
    assert rig.eps == pytest.approx(0.0068, abs=5e-5)
    assert rig.lam == pytest.approx(1.91, abs=5e-3)
    assert TABLE_2.f0 == pytest.approx(7.862, abs=5e-4)
    assert rig.nes[0].Gamma == pytest.approx(0.25, rel=1e-15)
    assert TABLE_2.zeta == pytest.approx(rig.eps * rig.lam / 2, rel=1e-14)


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
        (lambda: NES(m=1.0, b=1.0, r=0.5, friction=-0.1), "friction mu g = -0.1"),
        (lambda: NES(m=1.0, b=1.0, r=0.5, tilt=math.inf), "tilt = inf"),
        (lambda: Oscillator(M=1.0, c1=1.0, k1=1.0, k3=math.nan), "cubic stiffness k3"),
    ],
)
def test_a_value_without_meaning_is_refused(make, words):
    with pytest.raises(ParameterError) as caught:
        make()
    assert words in str(caught.value)
