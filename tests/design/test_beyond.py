"""Friction, damping laws and slow sweeps in a design; its bounds far from resonance."""

from dataclasses import replace

import numpy as np
import pytest

from vinesexp import Oscillator
from vinesexp.design.advice import advise, slow_sweeps
from vinesexp.design.best_clearance import affordable, parted
from vinesexp.design.ensemble import (
    LONGEST_FAR,
    duration_of,
    longest_watch,
    responses,
)
from vinesexp.design.headline import warnings_of
from vinesexp.design.task import Task, wall_starts
from vinesexp.excitation import WeakDamping

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
G = 0.25e-3
TASK = Task(TABLE_2, (0.032,), (0.6,), levels=(G, G), frequencies=(TABLE_2.f0,) * 2)


@pytest.mark.slow
def test_a_law_of_no_size_changes_nothing_and_one_of_some_size_does() -> None:
    b = 0.030
    plain = responses(wall_starts(TASK, b, range(2)))
    tiny = replace(TASK, damping=WeakDamping(quadratic=1e-9), friction=1e-9)
    assert responses(wall_starts(tiny, b, range(2))).mean == pytest.approx(plain.mean, rel=2e-3)
    law = replace(TASK, damping=WeakDamping(quadratic=5.0))
    assert law.largest_bare() < 0.8 * TASK.largest_bare()
    stiff = replace(TASK, friction=2.0)  # holds the ball to its floor: it moves with the mass
    held = responses(wall_starts(stiff, b, range(2)))
    assert held.mean.mean() > 1.2 * plain.mean.mean()


def test_a_bare_amplitude_without_law_is_the_closed_form() -> None:
    tiny = replace(TASK, damping=WeakDamping(quadratic=1e-12))
    assert tiny.bare(G, 8.0) == pytest.approx(TASK.bare(G, 8.0), rel=5e-3)


@pytest.mark.parametrize("ratio", [0.02, 0.3, 3.0, 40.0])
def test_far_from_resonance_a_run_is_bounded_and_says_what_it_lacks(ratio: float) -> None:
    light = Oscillator(M=1.0, c1=2e-4, k1=1.0)
    task = Task(light, (0.001,), (0.6,), levels=(1.0, 1.0), frequencies=(ratio * light.f0,) * 2)
    rig, f = task.rig(1.0), task.frequencies[0]
    assert duration_of(rig, f)[1] * max(f, light.f0) <= LONGEST_FAR * (1.0 + 1e-9)
    assert 0.0 < duration_of(rig, f)[2] <= 1.0
    assert duration_of(rig, f)[2] < duration_of(rig, light.f0)[2]


@pytest.mark.compiles
def test_several_balls_and_laws_are_reckoned_to_take_more_work() -> None:
    pair = Task(TABLE_2, (0.016,) * 2, (0.6,) * 2, (G, G), (8.0, 8.0), ratios=(1.0, 1.0))
    law = replace(TASK, friction=0.02)
    one, two, rough = (
        float(responses(wall_starts(task, 0.02, range(2))).work.mean())
        for task in (TASK, pair, law)
    )
    assert one < two < rough
    assert affordable(1.0, one, (2, 10**6)) > affordable(1.0, rough, (2, 10**6)) > 2
    assert affordable(1e-9, one, (2, 10**6)) == 2


@pytest.mark.long
def test_where_a_cycle_is_dear_a_range_has_fewer_parts_and_a_start_is_watched_for_less() -> None:
    """A band under a damping law took 115 s of the processor, half of it to watch 315 starts."""
    light = Oscillator.from_modal(M=7.0, f0=3.0, zeta=3e-4)
    plain = Task(light, (0.02,), (0.5,), levels=(2e-5, 4e-5), frequencies=(3.0, 3.0))
    law = replace(plain, damping=WeakDamping(quadratic=1.0))
    once = duration_of(plain.rig(0.015), 3.0)[0]
    assert longest_watch(wall_starts(plain, 0.015, range(1))) == pytest.approx(8.0 * once)
    assert longest_watch(wall_starts(law, 0.015, range(1))) == pytest.approx(once)
    assert parted(plain, 0.015, 4.0).conditions() == 24
    assert parted(law, 0.015, 4.0).conditions() == 8
    assert parted(law, 0.015, 400.0).conditions() == 24
    assert len(wall_starts(parted(law, 0.015, 4.0), 0.015, range(2))) == 16


@pytest.mark.long
def test_what_an_answer_may_take_bounds_its_runs() -> None:
    """A twentieth of the usual work, on a rig whose runs take long; the answer says so."""
    light = Oscillator.from_modal(M=1.0, f0=10.0, zeta=3e-4)
    task = Task(light, (0.002,), (0.7,), (1e-4, 1e-4), (10.0, 10.0), tolerance=0.01)
    advice = advise(task, budget=0.2)
    assert advice.judged.random < 100
    assert advice.beside.phases == 2
    [said] = [one for one in warnings_of(advice) if "which is long" in one]
    assert f"{advice.judged.random} random ones" in said


def test_slow_sweeps_find_what_sweeps_of_the_paper_find() -> None:
    """34 mm, 7.2 to 8.4 Hz: largest 8.6 to 14 mm, running mean 6.8 to 10.9 over starts."""
    up, down = slow_sweeps(replace(TASK, frequencies=(7.2, 8.4)), 0.034)
    assert (up.begin, up.end) == (7.2, 8.4) == (down.end, down.begin)
    for one in (up, down):
        assert 7e-3 < one.largest < 15e-3
        assert 5e-3 < one.running < one.largest
        assert 7.6 < one.at < 8.2
        assert one.duration * 8.4 <= 4000.0 * (1 + 1e-9)
    single, _ = slow_sweeps(TASK, 0.034)
    assert single.begin == pytest.approx(0.95 * TABLE_2.f0)
    assert np.isfinite(single.largest)


def test_a_sweep_beside_resonance_begins_without_a_transient() -> None:
    """9 Hz: from rest the first beat, 2.5 mm, would have been the largest amplitude."""
    task = replace(TASK, frequencies=(9.0, 9.0))
    for one in slow_sweeps(task, 0.2):  # so wide that the ball is never struck
        assert one.largest == pytest.approx(task.bare(G, 0.95 * 9.0), rel=0.08)
