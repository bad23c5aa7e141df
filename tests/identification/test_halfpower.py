"""The width of a resonance."""

import numpy as np
import pytest

from vinesexp import Oscillator, Release, Rig, Sweep, simulate
from vinesexp.errors import AnalysisError
from vinesexp.identification.sweep_record import half_power

STEP, DURATION = 5e-3, 200.0


def swept(zeta=0.0065, low=7.2, high=8.6, noise=1e-6, seed=0, duration=DURATION):
    oscillator = Oscillator.from_modal(M=4.7, f0=7.862, zeta=zeta)
    motion = simulate(
        Rig(oscillator), Sweep(0.25e-3, low, high, duration), Release(), duration=duration
    )
    t = STEP * np.arange(round(duration / STEP))
    random = np.random.default_rng(seed)
    return (
        motion.base(t)[0] + noise * random.standard_normal(t.size),
        motion.at(t)[0] + noise * random.standard_normal(t.size),
    )


@pytest.mark.parametrize("zeta", [0.004, 0.0065, 0.02])
def test_peak_and_width(zeta):
    base, x = swept(zeta)
    found = half_power(base, x, STEP, swept=(7.2, 8.6))
    assert found.f0 == pytest.approx(7.862, rel=1e-4 + 2 * zeta**2)  # of second order
    assert found.zeta == pytest.approx(zeta, rel=0.03)
    assert abs(found.f0 - 7.862) < 2 * found.f0_error < 0.01
    assert abs(found.zeta - zeta) < 2 * found.zeta_error < 0.2 * zeta


def test_a_sweep_that_stops_on_the_resonance_is_refused():
    base, x = swept(high=7.9)
    with pytest.raises(AnalysisError, match="sweep wider"):
        half_power(base, x, STEP, swept=(7.2, 7.88))


def test_a_short_sweep_is_refused():
    base, x = swept(duration=20.0)
    for n in (0, 1, base.size):
        with pytest.raises(AnalysisError, match="longer sweep"):
            half_power(base[:n], x[:n], STEP, swept=(7.2, 8.6))


def test_a_base_that_rests_is_said():
    _, x = swept()
    with pytest.raises(AnalysisError, match="base does not move"):
        half_power(np.full(x.size, 1e-4), x, STEP, swept=(7.2, 8.6))
