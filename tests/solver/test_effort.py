"""Every run ends: by its own time, or with a line that says which scene did not."""

from __future__ import annotations

import random
import warnings

import numpy as np
import pytest
from tests.fuzz.scenes import energies, motion

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.errors import AnalysisError, RigWarning
from vinesexp.excitation import WeakDamping
from vinesexp.rig import remarks_on
from vinesexp.solver import effort
from vinesexp.solver.state import ALLOWANCE

LABORATORY = Oscillator(M=4.7, c1=1.857, k1=11469.0)


@pytest.mark.parametrize("duration", [13.0, 15.0, 60.0])
def test_an_oscillator_that_dry_friction_brings_to_rest(duration):
    damping = WeakDamping(quadratic=4.0, coulomb=0.06)
    found = simulate(Rig(LABORATORY), None, Release(x0=0.02), duration, damping=damping)
    x, v = found.at(np.linspace(0.0, duration, 2000))
    assert abs(x[-1]) <= 0.06 / LABORATORY.k1
    assert v[-1] == 0.0
    assert np.diff(energies(found)).max() <= 1e-15


@pytest.mark.parametrize("balls", [[], [NES(m=0.032, b=0.03, r=0.6)]])
@pytest.mark.parametrize("k3", [1e7, 6e9, 1e10])
def test_a_spring_far_stiffer_than_k1_keeps_its_energy(k3, balls):
    rig = Rig(Oscillator(M=4.7, c1=0.0, k1=11469.0, k3=k3), balls)
    found = simulate(rig, None, Release(x0=0.02), 0.5 if balls else 2.0)
    total = energies(found)
    assert np.isfinite(total).all()
    if balls:
        assert np.diff(total).max() <= 1e-9 * total[0]
    else:
        np.testing.assert_allclose(total, total[0], rtol=1e-9)


def test_a_spring_that_gives_way_is_one_line():
    rig = Rig(Oscillator(M=4.7, c1=1.857, k1=11469.0, k3=-1e9))
    with pytest.raises(AnalysisError, match=r"k3 = -1e\+09.*beyond all bounds.*gives way"):
        simulate(rig, None, Release(x0=0.02), 2.0)


@pytest.mark.parametrize("number", range(40))
def test_random_scenes_end_and_make_no_energy(number, tmp_path):
    """10,000 of them: ``python -m tests.fuzz --targets motion --cases 10000``."""
    assert motion(random.Random(f"motion:{number}"), tmp_path) in ("ok", "refused")


@pytest.mark.parametrize(
    "balls",
    [
        [NES(m=0.01, b=1e-12, r=1.0)],
        [NES(m=0.01, b=1e-12, r=1.0, friction=0.1)],
        [NES(m=0.01, b=1e-12, r=1.0, contact_time=1e-15)],
    ],
)
def test_a_loop_that_stands_still_says_which_scene_it_is(balls):
    start = Release(x0=0.02, y0=[0.02], vy0=[3.0])
    with pytest.raises(AnalysisError, match=r"ball 0\.01 kg, b = 1e-12 m.* comes to a stop"):
        simulate(Rig(LABORATORY, balls), None, start, 10.0)


def test_a_motion_that_memory_cannot_hold_is_refused_before_it_starts(monkeypatch):
    rig = Rig(LABORATORY, [NES(m=0.032, b=0.03, r=0.6)])
    with pytest.raises(AnalysisError, match=r"1e\+12 s, of about .* impacts, would take .* GB"):
        simulate(rig, Harmonic(0.25e-3, 7.86), Release(y0=[0.0299]), 1e12)
    monkeypatch.setattr(effort, "free_memory", lambda: 1e6)
    with pytest.raises(AnalysisError, match="ask for amplitudes alone"):
        simulate(rig, Harmonic(0.25e-3, 7.86), Release(y0=[0.0299]), 2000.0)


def test_an_interrupt_is_heard_in_a_run_without_impacts(monkeypatch):
    seen = []

    def stop(self, state, used):
        seen.append(float(state[0]) / self.duration)
        if state[0] > 1000.0:
            raise KeyboardInterrupt

    monkeypatch.setattr(effort.Effort, "add", stop)
    with pytest.raises(KeyboardInterrupt):
        simulate(Rig(LABORATORY, [NES(m=0.032, b=1.0, r=0.6)]), Harmonic(1e-3, 7.8), Release(), 1e6)
    assert 0.0 < seen[0] < 0.1, "such a run comes back to Python too"


def test_a_rig_in_kilograms_and_metres_that_were_grams_and_millimetres():
    with pytest.warns(RigWarning, match=r"m = 32 kg is more than the mass M = 4\.7 kg"):
        rig = Rig(LABORATORY, [NES(m=32.0, b=34.0, r=0.6)])
    assert len(remarks_on(rig)) == 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Rig(LABORATORY, [NES(m=0.032, b=0.034, r=0.6)])
        Rig(Oscillator(M=1.0, c1=0.0, k1=1.0), [NES(m=0.1, b=1.0, r=0.6)])


def test_free_memory_is_a_number_of_bytes():
    assert effort.free_memory() > 1e6


def test_a_rig_without_balls_needs_no_event_loop(monkeypatch):
    """It takes twenty seconds to compile where none of it is kept yet."""
    monkeypatch.setattr("vinesexp.solver.simulation._loop_of", None)
    o = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
    found = simulate(Rig(o), None, Release(x0=0.02), 8.0)
    assert not found.impacts["time"].size
    decay, rate = o.c1 / (2.0 * o.M), np.sqrt(o.k1 / o.M - (o.c1 / (2.0 * o.M)) ** 2)
    t = np.linspace(0.0, 8.0, 50)
    expected = np.cos(rate * t) + decay / rate * np.sin(rate * t)
    np.testing.assert_allclose(found.at(t)[0], 0.02 * np.exp(-decay * t) * expected, atol=1e-14)


@pytest.mark.parametrize("b", [1.6e-5, 2e-5])
def test_a_motion_with_more_impacts_than_segments_are_allowed_can_be_read(b):
    rig = Rig(Oscillator(M=1.0, c1=0.0, k1=0.01), nes=[NES(m=1e-3, b=b, r=1.0)])
    motion = simulate(rig, None, Release(x0=0.0, v0=1.0, y0=[0.0]), 9.0)
    hit = motion.impacts
    assert hit["time"].size > ALLOWANCE  # in less than a radian
    assert np.abs(motion.at(hit["time"][::1000])[0] - hit["x"][::1000]).max() < 1e-12
