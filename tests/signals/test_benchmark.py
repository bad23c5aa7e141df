"""The benchmark of finding impacts, a few short records of it: what it promises holds."""

import math

import pytest

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def scores():
    from benchmarks.detection_scenes import record_of, scenes
    from benchmarks.impacts import run

    return run(record_of(scene) for scene in scenes(quick=True))


def test_nothing_missed_nothing_false_where_it_can_be_known(scores) -> None:
    own = [s for s in scores if s.method == "vinesexp"]
    assert len(own) == 6
    assert all(s.missed == 0 and s.false == 0 for s in own if s.scene != "S/N 7")
    noisy = next(s for s in own if s.scene == "S/N 7")
    assert noisy.false == 0
    assert noisy.missed <= 2


def test_times_at_the_limit(scores) -> None:
    own = [s for s in scores if s.method == "vinesexp" and not math.isnan(s.ratio)]
    assert len(own) == 5
    assert max(s.ratio for s in own) < 1.5
    assert min(s.ratio for s in own) > 0.6  # nothing beats the limit by much: the score is sound


def test_no_usual_way_does_better(scores) -> None:
    for own in (s for s in scores if s.method == "vinesexp" and s.scene != "S/N 7"):
        peers = [s for s in scores if s.scene == own.scene and s.method != "vinesexp"]
        assert len(peers) == 3
        assert own.f1 >= max(s.f1 for s in peers)


def test_pulses_that_overlap_count_once() -> None:
    import numpy as np
    from benchmarks.detection_score import pulses

    time, jump = pulses(np.array([1.0, 1.0001, 2.0]), np.array([0.03, 0.01, -0.02]), 1e4)
    assert time == pytest.approx([1.000025, 2.0])
    assert jump == pytest.approx([0.04, -0.02])
