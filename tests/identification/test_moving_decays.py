"""Decays whose frequency or damping moves with amplitude, and motions that do not decay."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vinesexp.errors import AnalysisError
from vinesexp.identification.ringdown import fit_ringdown

RATE = 30.0
F, B = 0.97, 0.03  # Hz in small motion; damping, 1/s


def motion(angle, seconds=60.0):
    """A pendulum with viscous damping, let go at `angle` rad, and its turning points."""

    def turns(t, y):
        return y[1]

    turns.direction = -1
    t = np.arange(int(seconds * RATE)) / RATE
    found = solve_ivp(
        lambda t, y: [y[1], -B * y[1] - (2 * np.pi * F) ** 2 * np.sin(y[0])],
        (0.0, seconds), [angle, 0.0], t_eval=t, events=turns, rtol=1e-9, atol=1e-11,
    )  # fmt: skip
    return found.y[0], found.t_events[0][1:], found.y_events[0][1:, 0]


@pytest.mark.parametrize("angle", [0.3, 1.0, pytest.param(2.2, marks=pytest.mark.long)])
def test_a_pendulum_of_any_swing(angle):
    x, times, tops = motion(angle)
    x = x + 2e-3 * np.random.default_rng(4).standard_normal(x.size)
    found = fit_ringdown(x, sample_rate=RATE, frequency=0.88)
    last = tops[-6:]
    for amplitude, k in ((found.reference, int(np.argmin(np.abs(tops - found.reference)))),
                         (float(last.mean()), len(tops) - 4)):  # fmt: skip
        k = min(max(k, 3), len(tops) - 4)
        span = times[k + 3] - times[k - 3]
        f = 6.0 / span
        zeta = np.log(tops[k - 3] / tops[k + 3]) / span / (2.0 * np.pi * f)
        here = found.at(amplitude)
        # The swing of a cycle is known to half of its change: twice the errors, and one percent.
        assert abs(here.f0 - f) < 3.0 * here.f0_error + 0.006 * f
        # A swing this large is no sine: its top lies a few thousandths beyond its fundamental.
        assert abs(here.zeta - zeta) < 3.0 * here.zeta_error + 0.02 * zeta


def test_a_hammer_test_whose_damping_falls_fivefold():
    rate, f = 25600.0, 1050.0
    a, phase, values = 1.0, 0.0, []
    for _ in range(int(0.3 * rate)):
        values.append(a * np.cos(phase))
        a *= np.exp(-(0.005 + 0.022 * a) * 2 * np.pi * f / rate)
        phase += 2 * np.pi * f * (1.0 - 0.03 * a) / rate
    x = np.array(values) + 3e-3 * np.random.default_rng(1).standard_normal(len(values))
    found = fit_ringdown(x, sample_rate=rate, frequency=f)
    for amplitude in (0.9, 0.5, 0.1, 0.03):
        here = found.at(amplitude)
        assert here.zeta == pytest.approx(0.005 + 0.022 * amplitude, rel=0.05)
        assert here.f0 == pytest.approx(f * (1.0 - 0.03 * amplitude), rel=2e-3)


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.long) for k in (1, 2))])
def test_a_sustained_oscillation_gives_no_damping(seed):
    rng = np.random.default_rng(seed)
    t = np.arange(6000) / 100.0
    wander = np.cumsum(rng.standard_normal(t.size))
    wander -= wander.mean()
    x = (1.0 + 0.05 * wander / wander.std()) * np.cos(2 * np.pi * 2.57 * t)
    with pytest.raises(AnalysisError):
        fit_ringdown(x, sample_rate=100.0, frequency=2.57)


@pytest.mark.parametrize("seed", range(3))
def test_a_plain_decay_keeps_its_error(seed):
    """What noise alone leaves is not widened."""
    t = np.arange(6000) / 100.0
    x = np.exp(-0.05 * t) * np.cos(2 * np.pi * 2.57 * t)
    x += 0.01 * np.random.default_rng(seed).standard_normal(t.size)
    found = fit_ringdown(x, sample_rate=100.0, frequency=2.57)
    assert found.zeta == pytest.approx(0.05 / (2 * np.pi * 2.57), abs=4.0 * found.zeta_error)
    assert found.zeta_error < 4e-5


@pytest.mark.long
def test_a_decay_of_which_the_law_leaves_much_has_a_wide_error():
    """Two close modes that no other line tells apart: fast and slow at one frequency."""
    t = np.arange(6000) / 100.0
    wobble = 1.0 + 0.3 * np.sin(2 * np.pi * t / 25.0)
    x = wobble * np.exp(-0.05 * t) * np.cos(2 * np.pi * 2.57 * t)
    try:
        found = fit_ringdown(x, sample_rate=100.0, frequency=2.57)
    except AnalysisError as error:
        assert "no free decay" in str(error)  # noqa: PT017
        return
    assert found.zeta_error > 0.05 * found.zeta
    assert abs(found.zeta - 0.05 / (2 * np.pi * 2.57)) < 3.0 * found.zeta_error
