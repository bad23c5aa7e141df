"""What the pages of records hold: levels, samples, packing, and what is written when."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from tests.record_pages.decoded import unpacked, unsqueezed

from vinesexp.record_pages.traces import (
    chunks_of,
    exact,
    packed,
    part_size,
    squeezed,
    traces_of,
)
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import RecordWriter, open_record
from vinesexp.signals.means import extremes_of_parts

RATE, F = 1000.0, 8.0


def record(path, samples, rate=RATE):
    with RecordWriter(path, sample_rate=rate, quantities={"displacement": "displacement"}) as made:
        made.append({"displacement": samples})
    return path


def test_parts_hold_the_smallest_and_largest_sample_of_all(tmp_path):
    samples = np.random.default_rng(1).normal(size=50_001)
    edges = np.append(np.arange(0, 50_001, 7), 50_001)
    with open_record(record(tmp_path / "a.nc", samples)) as view:
        low, high = extremes_of_parts(partial(view.read, "displacement"), edges)
    assert low.min() == np.float32(samples.min())
    assert high.max() == np.float32(samples.max())
    assert low.size == -(-50_001 // 7)


def test_a_gap_is_a_gap_and_hides_nothing_beside_it(tmp_path):
    samples = np.ones(100)
    samples[10:31] = np.nan
    with open_record(record(tmp_path / "a.nc", samples)) as view:
        low, _ = extremes_of_parts(partial(view.read, "displacement"), np.arange(0, 101, 10))
    assert np.isnan(low[1:3]).all()
    assert low[3] == 1.0


@pytest.mark.parametrize("seconds", [100, 1000, 3600, 36_000])
@pytest.mark.parametrize("rate", [500.0, 1e4, 1e5])
def test_a_steady_motion_never_looks_modulated(seconds, rate):
    """Parts show a cycle, or are whole cycles: in between they would beat with it."""
    size = part_size(int(seconds * rate), rate, F)
    cycle = rate / F
    assert size * 8 <= cycle or abs(size / cycle - round(size / cycle)) * cycle < 1.0
    assert int(seconds * rate) / size < 70_000


@pytest.mark.parametrize("order", [0, 1, 2])
def test_every_sample_comes_back(order):
    """To an eighth of the noise, or a 65,000th of the range; across chunks and beside gaps."""
    rng = np.random.default_rng(1)
    t = np.arange(20_000.0)
    values = {0: 1.0, 1: 0.03, 2: 0.0}[order] * rng.normal(size=t.size) + np.sin(t / 300.0)
    values[500:700] = np.nan
    content = squeezed(values)
    found = unsqueezed(content)
    assert (np.isnan(found) == np.isnan(values)).all()
    assert np.nanmax(np.abs(found - values)) <= 0.51 * content["scale"]
    assert content["scale"] < 0.2 * max({0: 1.0, 1: 0.03, 2: 0.0}[order], 5e-4)


@pytest.mark.parametrize("values", [[0.0], [np.nan] * 5, [1.0, -1.0] * 50, [2.0] * 9])
def test_odd_stretches_come_back(values):
    found = unsqueezed(squeezed(np.array(values)))
    assert found == pytest.approx(np.array(values), abs=3e-4, nan_ok=True)


def test_chunks_hold_all_samples_of_both_kinds(tmp_path, monkeypatch):
    monkeypatch.setattr("vinesexp.record_pages.traces.CHUNK", 1000)
    samples = np.random.default_rng(1).normal(size=2500)
    with open_record(record(tmp_path / "a.nc", samples)) as view:
        chunks = list(chunks_of({"measured": view}, {"displacement": 1.0}))
    assert [(c["begin"], c["end"]) for c in chunks] == [(0, 1000), (1000, 2000), (2000, 2500)]
    whole = np.concatenate([unsqueezed(c["channels"]["measured displacement"]) for c in chunks])
    assert np.abs(whole - samples).max() < 0.1


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
