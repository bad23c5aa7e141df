"""What an ensemble of runs settles to."""

import pytest

from vinesexp import NES, Harmonic, Oscillator, Release, Rig
from vinesexp.design.ensemble import Run, responses
from vinesexp.design.task import bare_gain


@pytest.mark.parametrize("ratio", [0.5, 1.9, 2.5, 15.0, 40.0, 130.0])
def test_a_base_far_from_resonance_gives_the_bare_motion_while_the_ball_is_not_met(ratio):
    """Up to the largest ratios the closed form is asked for no step beyond its table.

    Runs are cut at 4000 cycles of the base: at 130 times f0 these are 31 of the oscillator, and a
    few per cent of the free motion are left (`settled_share` of the answer says what was cut).
    """
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.03, r=0.6)])
    base = Harmonic(amplitude=0.25e-3, frequency=ratio * rig.oscillator.f0)
    found = responses([Run(rig, base, Release())], workers=1)
    expected = base.amplitude * bare_gain(rig.oscillator, base.frequency)
    assert float(found.mean[0]) == pytest.approx(expected, rel=0.1 if ratio > 100.0 else 0.05)
    assert expected < float(found.largest[0]) < 3.0 * expected
    assert float(found.impacts_per_cycle[0]) == 0.0
