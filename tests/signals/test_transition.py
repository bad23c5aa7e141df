"""Decay rates before and after the ball is lost, on simulated releases."""

import numpy as np
import pytest

from vinesexp import NES, Oscillator, Release, Rig, simulate
from vinesexp.records.stored.result_columns import TRANSITIONS
from vinesexp.records.stored.tables import read_rows, write_rows
from vinesexp.signals.means import cycle_amplitudes
from vinesexp.signals.regimes import Series, transition_row

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
BARE = TABLE_2.zeta * TABLE_2.w0


def row_of(b):
    """Of a release of one ball from 20 mm."""
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=b, r=0.6)])
    motion = simulate(rig, None, Release(0.02, 0.0, [0.02 + 0.999 * b]), duration=12.0)
    x, i = motion.at(np.arange(120_000) / 1e4)[0], motion.impacts
    decay = cycle_amplitudes(x, 1e4, TABLE_2.f0)
    return transition_row(
        "a", Series(1, b, i["time"], i["side"]), decay, start=0.0, period=1 / TABLE_2.f0
    )


@pytest.mark.parametrize("b", [0.027, 0.030, 0.033, 0.042])
def test_the_ball_is_lost_near_T1(b):
    row = row_of(b)
    assert row["decay_rate_1_s"] > 1.5 * BARE
    assert row["decay_rate_1_s"] > row["decay_rate_after_1_s"] > 0.9 * BARE
    assert 0.7 < row["transition_m"] / (0.1572 * b) < 1.3  # T1: A_1(0.6) b


def hits(begin, end):
    """Two impacts a cycle from one time to another, of a ball of 33 mm."""
    time = np.arange(begin, end, 0.5 / TABLE_2.f0)
    return Series(1, 0.033, time, (-1.0) ** np.arange(time.size))


def test_rates_of_a_damper_alone():
    t = np.arange(0.0, 12.0, 1 / TABLE_2.f0)
    decay = t, 0.02 * np.exp(-BARE * t)
    row = transition_row("a", hits(0.0, 3.0), decay, start=0.0, period=1 / TABLE_2.f0)
    assert row["decay_rate_1_s"] == pytest.approx(BARE)
    assert row["decay_rate_after_1_s"] == pytest.approx(BARE)


def test_after_a_release_that_ends_captured_there_is_no_rate():
    t = np.arange(0.0, 12.0, 1 / TABLE_2.f0)
    decay = t, 0.02 * np.exp(-0.05 * t)
    row = transition_row("a", hits(0.0, 11.9), decay, start=0.0, period=1 / TABLE_2.f0)
    assert row["decay_rate_1_s"] == pytest.approx(0.05)
    assert row["decay_rate_after_1_s"] is None


def test_each_ball_of_a_pair_is_lost_at_its_own_amplitude(tmp_path):
    """33 + 10 mm from 20 mm: the large cavity first, then the small one (T1a, T1b)."""
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=b, r=0.6) for b in (0.033, 0.010)])
    start = Release(0.02, 0.0, [0.02 + 0.999 * 0.033, 0.02 + 0.008])
    motion = simulate(rig, None, start, duration=12.0)
    decay = cycle_amplitudes(motion.at(np.arange(120_000) / 1e4)[0], 1e4, TABLE_2.f0)
    i = motion.impacts
    rows = [
        transition_row(
            "a",
            Series(k + 1, b, i["time"][i["nes"] == k], i["side"][i["nes"] == k]),
            decay,
            start=0.0,
            period=1 / TABLE_2.f0,
        )
        for k, b in enumerate((0.033, 0.010))
    ]
    large, small = rows
    assert large["captured_from_s"] < small["captured_from_s"] < large["captured_until_s"]
    assert large["captured_until_s"] < small["captured_until_s"]
    for row, b in zip(rows, (0.033, 0.010), strict=True):
        assert 0.6 < row["transition_m"] / (0.1572 * b) < 1.2
    assert small["from_m"] < 0.0073 * 1.3  # A_2(0.6) b, above which the small one rattles
    write_rows(tmp_path / "t.csv", TRANSITIONS, rows)
    assert [row["nes"] for row in read_rows(tmp_path / "t.csv", TRANSITIONS)] == [1, 2]
    assert transition_row(
        "a", Series(1, 0.01, np.empty(0), np.empty(0)), decay, start=0.0, period=0.1
    ) is None  # fmt: skip
