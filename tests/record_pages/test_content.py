"""What the pages of records hold: levels, windows, packing, and what is written when."""

from __future__ import annotations

import numpy as np
import pytest

from vinesexp.record_pages.drawn_content import traces_of
from vinesexp.record_pages.packing import exact, packed, unpacked
from vinesexp.record_pages.zoom_levels import part_size, read_channel, windows_around
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.store import create_record, open_record

RATE, F = 1000.0, 8.0


def record(path, samples, rate=RATE):
    with create_record(path, sample_rate=rate, quantities={"displacement": "displacement"}) as made:
        made.append({"displacement": samples})
    return path


def test_parts_hold_the_smallest_and_largest_sample_of_all(tmp_path):
    samples = np.random.default_rng(1).normal(size=50_001)
    with open_record(record(tmp_path / "a.nc", samples)) as view:
        level, _ = read_channel(view, "displacement", 7)
    assert level.low.min() == np.float32(samples.min())
    assert level.high.max() == np.float32(samples.max())
    assert level.low.size == -(-50_001 // 7)


def test_a_gap_is_a_gap_and_hides_nothing_beside_it(tmp_path):
    samples = np.ones(100)
    samples[10:31] = np.nan
    with open_record(record(tmp_path / "a.nc", samples)) as view:
        level, _ = read_channel(view, "displacement", 10)
    assert np.isnan(level.low[1:3]).all()
    assert level.low[3] == 1.0


@pytest.mark.parametrize("seconds", [100, 1000, 3600, 36_000])
@pytest.mark.parametrize("rate", [500.0, 1e4, 1e5])
def test_a_steady_motion_never_looks_modulated(seconds, rate):
    """Parts show a cycle, or are whole cycles: in between they would beat with it."""
    size = part_size(int(seconds * rate), rate, F)
    cycle = rate / F
    assert size * 8 <= cycle or abs(size / cycle - round(size / cycle)) * cycle < 1.0
    assert int(seconds * rate) / size < 70_000


def test_windows_hold_every_sample_around_an_impact(tmp_path):
    samples = np.arange(40_000.0)
    windows = windows_around(np.array([5.0, 5.01, 30.0]), n=40_000, sample_rate=RATE, start=0.0)
    assert windows == [(4976, 5058), (29976, 30048)]
    with open_record(record(tmp_path / "a.nc", samples)) as view:
        _, found = read_channel(view, "displacement", 1000, windows)
    assert found.tolist() == [*range(4976, 5058), *range(29976, 30048)]


def test_windows_are_read_across_blocks(tmp_path, monkeypatch):
    monkeypatch.setattr("vinesexp.record_pages.zoom_levels._BLOCK", 64)
    samples = np.arange(5_000.0)
    with open_record(record(tmp_path / "a.nc", samples)) as view:
        level, found = read_channel(view, "displacement", 10, [(60, 70), (4990, 5000)])
    assert found.tolist() == [*range(60, 70), *range(4990, 5000)]
    assert level.high.tolist() == [*np.arange(9.0, 5000.0, 10.0)]


def test_of_very_many_impacts_even_choices_have_windows():
    windows = windows_around(np.arange(0.0, 3600.0, 0.06), n=36_000_000, sample_rate=1e4, start=0.0)
    assert sum(end - begin for begin, end in windows) <= 36_000
    assert windows[0][0] == 0
    assert windows[-1][1] > 35_990_000


@pytest.mark.parametrize("values", [[], [2.0], [0.0, 0.0], [np.nan], [-1e-9, 3.0, np.nan]])
def test_packed_numbers_come_back(values):
    found = unpacked(packed(values))
    assert found == pytest.approx(np.array(values), abs=3.0 / 65000, nan_ok=True)


def test_times_are_packed_to_the_last_digit():
    import base64

    times = np.array([3599.123456789, 1e-7])
    assert (np.frombuffer(base64.b64decode(exact(times)["float64"])) == times).all()


def test_a_record_of_several_balls_has_a_strip_each(full):
    found = traces_of("t_two", test="transient", balls=2, paths=ResultPaths(full.results))
    assert [strip["name"] for strip in found["strips"]] == ["ball 1"]  # all are of the first


def test_a_refused_record_has_facts_and_no_traces(full):
    found = traces_of("broken", test="periodic", balls=1, paths=ResultPaths(full.results))
    assert found == {"channels": []}
