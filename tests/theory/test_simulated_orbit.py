"""The end of two impacts per cycle of balls that no formula covers."""

import numpy as np
import pytest
from tests.combined import combined

from vinesexp import NES, Oscillator, Rig
from vinesexp.errors import AnalysisError
from vinesexp.excitation import WeakDamping
from vinesexp.theory.floquet import symmetric_orbits
from vinesexp.theory.optimal_clearance import b_c_exact
from vinesexp.theory.simulated_orbit import simulated_end

M, C1, K1, BALL, G, F = 4.7, 3.02, 1.147e4, 0.032, 0.25e-3, 7.862


def end_of(**ball) -> float:
    nes = NES(**{"m": BALL, "b": 1.0, "r": 0.6, **ball})
    return simulated_end(Rig(Oscillator(M, C1, K1), [nes]), G=G, frequency=F)


@pytest.mark.parametrize(
    ("eps", "zeta", "r", "ratio"),
    [(0.0068, 0.0065, 0.6, 1.0), (0.05, 0.005, 0.6, 1.01), (0.003, 5e-4, 0.3, 0.995)],
)
def test_of_a_plain_ball_it_is_the_exact_b_c(eps, zeta, r, ratio):
    rig = Rig(Oscillator.from_modal(M=2.0, f0=10.0, zeta=zeta), [NES(m=2.0 * eps, b=1.0, r=r)])
    one = rig.oscillator
    exact = b_c_exact(
        G=1e-4, M=one.M, c1=one.c1, k1=one.k1, m=2.0 * eps, r=r, frequency=10.0 * ratio
    )
    end = simulated_end(rig, G=1e-4, frequency=10.0 * ratio)
    assert end == pytest.approx(float(exact), rel=2e-5)


#: By another simulation (Runge-Kutta steps, orbits followed from clearance to clearance until they
#: lose their stability); its own error is 5e-4.
FOLLOWED = [
    ({"friction": 0.3}, 33.592e-3),
    ({"friction": 1.0}, 32.835e-3),
    ({"r": 0.65, "r_minus": 0.55}, 33.867e-3),
    ({"r": 0.6 + 0.15 * 1.3, "r_slope": -0.15}, 34.447e-3),
    ({"r": 0.63, "r_minus": 0.57, "friction": 0.2}, 33.674e-3),
    ({"tilt": 0.2}, 33.906e-3),
    ({"contact_time": 1.7e-3}, 33.020e-3),
]


@pytest.mark.parametrize(("ball", "end"), FOLLOWED)
def test_it_is_the_end_that_another_simulation_finds(ball, end):
    assert end_of(**ball) == pytest.approx(end, rel=1e-3)


def test_it_scales_with_the_base_where_nothing_else_has_a_length():
    rig = Rig(Oscillator(M, C1, K1), [NES(m=BALL, b=1.0, r=0.62, r_minus=0.55)])
    small, large = (simulated_end(rig, G=g, frequency=F) for g in (1e-4, 1e-3))
    assert large == pytest.approx(10.0 * small, rel=2e-5)


@pytest.mark.long
@pytest.mark.parametrize(
    ("shares", "ratio"), combined([(0.2, 0.8, 0.0), (0.5, 0.0, 0.5), (0.2, 0.5, 0.3)], [1.0, 1.001])
)
def test_a_damping_law_ends_the_orbit_as_the_viscous_damping_of_its_amplitude(shares, ratio):
    """So what damping adds per amplitude, the increment, is no part of the error of b_c."""
    viscous, quadratic, coulomb = shares
    values = {"G": G, "frequency": ratio * F, "M": M, "c1": C1, "k1": K1, "m": BALL, "r": 0.6}
    plain = float(b_c_exact(**values))
    orbit = symmetric_orbits(b=(1.0 - 1e-6) * plain, **values)[0]
    wA = 2.0 * np.pi * ratio * F * orbit.amplitude
    law = WeakDamping(quadratic * C1 * 3.0 * np.pi / (8.0 * wA), coulomb * C1 * np.pi * wA / 4.0)
    rig = Rig(Oscillator(M, viscous * C1, K1), [NES(m=BALL, b=1.0, r=0.6)])
    end = simulated_end(rig, G=G, frequency=ratio * F, damping=law)
    assert end == pytest.approx(plain, rel=5e-3)
    more = float(b_c_exact(**{**values, "c1": (1.0 + 0.5 * (quadratic + coulomb)) * C1}))
    assert abs(end - plain) < 0.1 * abs(more - plain)  # half of the increment, as viscous damping


def test_a_ball_that_friction_holds_has_no_end():
    with pytest.raises(AnalysisError, match="two impacts per cycle"):
        end_of(friction=30.0)


@pytest.mark.long
def test_it_moves_little_with_a_little_of_each_effect():
    plain = end_of()
    for small in ({"friction": 1e-4}, {"tilt": 1e-3}, {"contact_time": 1e-6}, {"r_slope": -1e-6}):
        assert abs(end_of(**small) / plain - 1.0) < 1e-4
    assert np.isfinite(plain)
