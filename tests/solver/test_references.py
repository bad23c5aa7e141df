"""Event times against closed forms and 50 digits on problems this project did not invent."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from reference_rigs import against_wall, falling_ball

from vinesexp import Harmonic, Oscillator

mp.mp.dps = 50


def worst_ulps(times, exact) -> float:
    """Largest error in units in the last place of the elapsed time."""
    pairs = zip(times, exact, strict=False)
    return max(float(abs(mp.mpf(float(t)) - e)) / np.spacing(float(e)) for t, e in pairs)


def bouncing_times(first, speed, g, e, count):
    """Impacts of a ball that hits the floor at `first` with `speed`: exact."""
    times, speed = [first], mp.mpf(speed)
    for _ in range(count - 1):
        speed *= e
        times.append(times[-1] + 2 * speed / g)
    return times


def test_bouncing_ball():
    motion = falling_ball(height=1.0, speed=0.0, g=9.81, e=0.9, duration=10.0)
    times = motion.impacts["time"]
    g, e = mp.mpf(9.81), mp.mpf(0.9)
    first = mp.sqrt(2 / g)
    assert times[0] == pytest.approx(0.4515236409857309, rel=4e-16)
    assert (times < 8.5).sum() == 44
    assert times[times < 8.5][-1] == pytest.approx(8.491374025647692, rel=5e-15)
    assert motion.rests["start"][0] == pytest.approx(8.578949178728887, rel=1e-14)
    assert motion.rests["end"][0] == 10.0
    assert worst_ulps(times[:50], bouncing_times(first, g * first, g, e, 50)) < 16


def test_impact_at_time_zero():
    motion = falling_ball(height=0.0, speed=-1.0, g=9.81, e=0.9, duration=3.0)
    assert motion.impacts["time"][0] == 0.0
    assert motion.rests["start"][0] == pytest.approx(1.8348623853211012, rel=1e-14)
    exact = bouncing_times(mp.mpf(0), mp.mpf(1), mp.mpf(9.81), mp.mpf(0.9), 50)
    # The first flight starts at a wall, so time and flight lengths agree to the last places.
    assert worst_ulps(motion.impacts["time"][1:50], exact[1:]) < 16


def test_two_walls():
    motion = falling_ball(height=1.0, speed=10.0, g=10.0, e=0.8, duration=8.0, gap=1.5)
    times, sides = motion.impacts["time"], motion.impacts["side"]
    assert times[sides == -1][0] == pytest.approx(0.0513167019, abs=1e-10)
    floor = [
        0.2283187800528825, 0.7413599657472243, 1.834535421015040, 2.709075785229291,
        3.408708076600690,
    ]  # fmt: skip
    np.testing.assert_allclose(times[sides == 1][:5], floor, rtol=4e-15)
    assert len(motion.rests["start"]) == 1
    assert not motion.impacts["time"][-1] > motion.rests["start"][0]


def test_inelastic_ball_rests_with_its_weight():
    motion = falling_ball(height=1.0, speed=10.0, g=9.81, e=0.0, duration=8.0, gap=1.5)
    assert len(motion.impacts["time"]) == 2
    t = np.linspace(motion.rests["start"][0], 8.0, 50)
    np.testing.assert_allclose(1.0 * motion.acceleration(t), 9.81, rtol=1e-12)  # m = 1 kg


def test_fmi_ball():
    motion = falling_ball(height=1.0, speed=0.0, g=9.81, e=0.7, duration=4.0)
    fast = np.abs(motion.impacts["v_after"] - motion.impacts["vy_after"]) >= 0.1
    assert fast.sum() + 1 == 11  # the 11th leaves at less and stops it
    assert motion.impacts["time"][10] == pytest.approx(2.4991133142, abs=1e-10)


def test_julia_ball():
    motion = falling_ball(height=50.0, speed=0.0, g=9.8, e=0.8, duration=20.0)
    np.testing.assert_allclose(
        motion.impacts["time"][:3], [3.1943828249997, 8.3053953449992, 12.394205360999], rtol=1e-12
    )


def spring_ball(count):
    """Exact impact times of reference 5 for the float parameters in use."""
    shift, w = -9.81e-3 / 100.0, mp.sqrt(mp.mpf(100.0) / mp.mpf(1e-3))
    wall, top = mp.mpf(-shift), mp.mpf(1.0 - shift)
    times = [mp.acos(wall / top) / w]
    speed = w * mp.sqrt(top**2 - wall**2)
    for _ in range(count - 1):
        speed *= mp.mpf(0.9)
        times.append(times[-1] + 2 * mp.atan2(speed / w, wall) / w)
    return times


def test_spring_ball():
    shift = -9.81e-3 / 100.0  # equilibrium, from which x is measured
    oscillator = Oscillator(M=1e-3, c1=0.0, k1=100.0)
    motion = against_wall(
        oscillator=oscillator,
        x0=1.0 - shift,
        v0=0.0,
        wall=-shift,
        e=0.9,
        duration=1.0,
        below=True,
        b=0.625,
    )
    times = motion.impacts["time"]
    assert times[0] == pytest.approx(4.966983943888618e-3, rel=1e-14)
    assert motion.impacts["v_before"][0] == pytest.approx(-316.2587864, rel=1e-9)
    assert motion.rests["start"][0] == pytest.approx(0.8702796077, abs=1e-10)
    force = oscillator.k1 * motion.at(0.95)[0]
    # x carries the rounding of 150 bounces of 1 m: 1e-12 m times k1.
    assert force == pytest.approx(9.81e-3, abs=1e-10)
    assert worst_ulps(times[:50], spring_ball(50)) < 200  # 1e-14 s; x carries 1e-15 m


@pytest.mark.parametrize("power", range(1, 13))
def test_near_graze_is_never_missed(power):
    d = 10.0**-power
    motion = against_wall(
        oscillator=Oscillator(M=1.0, c1=0.0, k1=1.0),
        x0=0.0,
        v0=1.0,
        wall=1.0 - d,
        e=0.8,
        duration=3.0,
        b=1.5,
    )
    exact = mp.asin(mp.mpf(1.0 - d))
    # An error of one rounding in x is one of eps/x' in time; x' = sqrt(2 d).
    allowed = 4e-16 + 8 * 2.3e-16 / np.sqrt(2.0 * d)
    assert abs(float(mp.mpf(float(motion.impacts["time"][0])) - exact)) < allowed


@pytest.mark.parametrize("w", [0.5, 1.0, 2.0])
def test_grazing_amplitude(w):
    """x'' + 0.1 x' + x = A cos(wt), wall at 1: touched from A = sqrt(...) on, never passed."""
    graze = np.sqrt((1.0 - w * w) ** 2 + (0.1 * w) ** 2)
    oscillator = Oscillator(M=1.0, c1=0.1, k1=1.0)
    gain = abs((1.0 + 0.1j * w) / 1.0)
    for factor, touches in ((1.0 - 1e-9, False), (1.0 + 1e-9, True), (1.2, True)):
        steady = factor * graze / ((1.0 - w * w) + 0.1j * w)  # x = Re(steady e^{iwt})
        phase = 0.5 * np.pi - np.angle(1.0 + 0.1j * w)
        base = Harmonic(amplitude=factor * graze / gain, frequency=w / (2.0 * np.pi), phase=phase)
        turn = -np.angle(steady)  # starts at the phase of largest x, half a turn back
        start = steady * np.exp(1j * (turn + np.pi))
        late = Harmonic(base.amplitude, base.frequency, base.phase + turn + np.pi)
        motion = against_wall(
            oscillator=oscillator, x0=start.real, v0=(1j * w * start).real, wall=1.0, e=0.8, b=2.0,
            duration=200.0, base=late,
        )  # fmt: skip
        assert (len(motion.impacts["time"]) > 0) == touches, factor
        t = np.linspace(0.0, 200.0, 20001)
        assert motion.at(t)[0].max() < 1.0 + 1e-13
