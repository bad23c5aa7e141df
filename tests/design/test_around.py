"""Levels over which a clearance works: by scaling where lengths scale, by simulation elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vinesexp import Oscillator
from vinesexp.design import around, best_clearance
from vinesexp.design.best_clearance import Found, search
from vinesexp.design.ensemble import responses
from vinesexp.design.task import Task, wall_starts
from vinesexp.excitation import WeakDamping

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
G = 0.25e-3
TASK = Task(TABLE_2, (0.032,), (0.6,), levels=(G, G), frequencies=(TABLE_2.f0,) * 2)


def found_of(task: Task) -> Found:
    with pytest.MonkeyPatch.context() as patched:
        for name, value in (("COARSE", (24, 24)), ("CLOSER", (2, 2)), ("FINALISTS", 3)):
            patched.setattr(best_clearance, name, value)
        return search(task, ends=(4e-3, 90e-3), budget=0.25)


@pytest.fixture(scope="module")
def found() -> Found:
    """The search of TASK."""
    return found_of(TASK)


def left(task: Task, b: float, level: float) -> float:
    """Share of the bare amplitude at one level, by simulation."""
    at = replace(task, levels=(level, level))
    rest = responses(wall_starts(at, b, range(12)))
    return float(rest.average(rest.mean)) / at.mean_bare()


def test_the_range_read_from_the_scan_is_that_of_a_simulation(found: Found) -> None:
    working = around.operating_range(TASK, found, phases=2)
    assert working.low is not None
    assert working.high is not None
    assert working.low < G < working.high
    for level in (1.1 * working.low, 0.9 * working.high):
        assert left(TASK, found.robust, level) < 0.85
    assert left(TASK, found.robust, 0.5 * working.low) > 0.8


def test_a_range_of_levels_has_an_operating_range_too(found: Found) -> None:
    task = replace(TASK, levels=(0.15e-3, 0.25e-3))
    working = around.operating_range(task, found, phases=2)
    single = around.operating_range(TASK, found, phases=2)
    assert working.low == pytest.approx(single.low, rel=0.35)
    assert working.high == pytest.approx(single.high, rel=0.35)


def test_under_a_damping_law_levels_are_simulated_not_scaled(
    found: Found, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Quadratic damping takes off large motions more than small ones: lengths do not scale."""
    law = replace(TASK, damping=WeakDamping(quadratic=5.0))
    monkeypatch.setattr(around, "LEVELS", 5)
    half = left(law, 0.021, 0.5 * G)
    assert half < 0.9 * left(law, 0.042, G), "the same, were lengths to scale"
    found = replace(found, robust=0.021)  # of the rig without the law: it will do
    tried = around._tried(law, 0.021, phases=2)
    assert tried[0] == pytest.approx([0.25 * G, 0.5 * G, G, 2.0 * G, 4.0 * G])
    assert tried[1][1] == pytest.approx(half, rel=0.1)
    assert around.operating_range(law, found, phases=2) == around._range(law, *tried)


@pytest.mark.long
def test_over_a_band_no_level_is_said_to_work_where_the_ball_is_a_dead_mass(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A scan whose few starts met no resonance with the mass had 27 % less at any high level."""
    o = Oscillator.from_modal(M=24.8, f0=5.525, zeta=3.5e-4)
    task = Task(
        o, (0.0186 * 24.8,), (0.62,), levels=(2.85e-5,) * 2, frequencies=(4.74, 6.203),
        tolerance=0.05,
    )  # fmt: skip
    monkeypatch.setattr(around, "LEVELS", 5)
    levels, left, _ = around._tried(task, 2.37e-3, phases=4)
    assert left[np.abs(levels / 2.85e-5 - 1.0).argmin()] < 0.7
    high = replace(task, levels=(float(levels[-1]),) * 2)
    rest = responses(wall_starts(high, 2.37e-3, range(12)))
    true = float(rest.average(rest.mean)) / high.mean_bare()
    assert true > 0.85
    assert left[-1] == pytest.approx(true, rel=0.05)


def test_ends_where_the_levels_tried_end_are_bounds() -> None:
    levels = np.array([0.1e-3, 0.24e-3, 0.4e-3])
    all_work = around._range(TASK, levels, np.full(3, 0.5), np.ones(3))
    assert (all_work.low_open, all_work.high_open) == (True, True)
    ends = around._range(TASK, levels, np.array([0.9, 0.5, 0.9]), np.zeros(3))
    assert ends.activation is None
    assert (ends.low_open, ends.high_open) == (False, False)
    assert ends.low == 0.24e-3
    assert ends.high == G
    band = replace(TASK, frequencies=(7.2, 8.4))
    assert around._range(band, levels, np.full(3, 0.5), np.ones(3)).activation is None
