"""Bands of a sweep: made by hand, and of the published rig simulated."""

import numpy as np
import pytest

from vinesexp import NES, Oscillator, Release, Rig, Sweep, simulate
from vinesexp.records.stored.result_columns import BANDS
from vinesexp.records.stored.tables import read_rows, write_rows
from vinesexp.settings.stages import RegimeSettings
from vinesexp.signals.means import cycle_amplitudes
from vinesexp.signals.regimes import Series, Swept, band_rows, bands_of, largest_running_mean

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
SETTINGS = RegimeSettings()


def named(spells, cycles=1000.0):
    found = bands_of(np.array(spells, dtype=float).reshape(-1, 2), cycles, permanent=40, gap=40)
    return [(one.response, one.begin, one.end) for one in found]


def test_a_spell_alone_is_chance_and_two_are_modulation():
    assert named([]) == [("inactive", 0.0, 1000.0)]
    assert named([(500, 520)]) == [("inactive", 0.0, 1000.0)]
    assert named([(500, 520), (550, 560)]) == [
        ("inactive", 0.0, 500.0), ("modulated", 500.0, 560.0), ("inactive", 560.0, 1000.0)
    ]  # fmt: skip
    assert named([(500, 520), (561, 570)]) == [("inactive", 0.0, 1000.0)], "too far apart"


def test_bands_beside_each_other_share_their_edge():
    found = named([(0, 400), (410, 420), (430, 440)])
    assert found == [
        ("permanent", 0.0, 400.0), ("modulated", 400.0, 440.0), ("inactive", 440.0, 1000.0)
    ]  # fmt: skip
    ends = [
        end for _, _, end in named([(410, 420), (430, 440), (450, 700), (720, 730), (750, 760)])
    ]
    assert ends == [410.0, 450.0, 700.0, 760.0, 1000.0]


def test_bands_far_from_each_other_leave_what_is_between_them_inactive():
    assert named([(0, 400), (500, 520), (550, 560)]) == [
        ("permanent", 0.0, 400.0), ("inactive", 400.0, 500.0), ("modulated", 500.0, 560.0),
        ("inactive", 560.0, 1000.0),
    ]  # fmt: skip


def swept_rig(b, *, begins=0.999):
    """Sweep up of the twin: 7.2 to 8.4 Hz in 100 s, ball at a wall or near it."""
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=b, r=0.6)])
    sweep = Sweep(0.25e-3, 7.2, 8.4, 100.0)
    motion = simulate(rig, sweep, Release(y0=[-begins * b]), duration=100.0)
    cycles = np.arange(0, 780)
    # cycles of 7.2 t + 0.006 t^2
    time = (-7.2 + np.sqrt(7.2**2 + 4 * 0.006 * cycles)) / 0.012
    x = motion.at(np.arange(100_000) / 1e3)[0]
    decay = cycle_amplitudes(x, 1e3, 7.8)
    i = motion.impacts
    return Series(1, b, i["time"], i["side"]), Swept(time), decay


def test_25_mm_is_permanent_around_resonance():
    series, base, decay = swept_rig(0.025)
    rows = band_rows("a", [series], base, decay, SETTINGS)
    assert [row["response"] for row in rows] == ["inactive", "permanent", "inactive"]
    permanent = rows[1]
    assert permanent["from_hz"] == pytest.approx(7.74, abs=0.05)
    assert permanent["to_hz"] == pytest.approx(8.08, abs=0.03)
    assert permanent["impacts_per_cycle"] == pytest.approx(2.0, abs=0.02)
    assert permanent["amplitude_max_m"] == pytest.approx(11.1e-3, rel=0.03)


def test_rows_are_those_of_the_table(tmp_path):
    series, base, decay = swept_rig(0.034)
    rows = band_rows("a", [series], base, decay, SETTINGS)
    write_rows(tmp_path / "bands.csv", BANDS, rows)
    back = read_rows(tmp_path / "bands.csv", BANDS)
    assert [row["response"] for row in back] == [row["response"] for row in rows]
    assert {row["nes"] for row in back} == {1}


def test_45_mm_is_modulated_and_its_running_mean_lies_below_its_peak():
    """The motion is chaotic: one start of six passes the resonance without a lasting response."""
    found = []
    for begins in (0.998, 0.97, 0.95, 0.9):
        series, base, decay = swept_rig(0.045, begins=begins)
        rows = band_rows("a", [series], base, decay, SETTINGS)
        found.append({row["response"] for row in rows} == {"inactive", "modulated"})
        running = largest_running_mean(base, decay, width=0.1)
        assert not found[-1] or running < 0.9 * decay[1].max()
    assert sum(found) >= 3


def test_running_mean_of_a_line_and_of_too_short_a_sweep():
    base = Swept(np.arange(800) / 8.0 - 1e-6 * np.arange(800) ** 2)
    time = np.linspace(1.0, 99.0, 700)
    f = base.frequency(base.count(time))
    width = 0.1 * abs(f[-1] - f[0])
    assert largest_running_mean(base, (time, time), width=width) == pytest.approx(94.1, abs=0.5)
    assert largest_running_mean(base, (time, time), width=10.0) is None
