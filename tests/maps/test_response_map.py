"""Maps: their cells are the simulations they claim to be, and a stopped one goes on."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tests.solver.test_lanes import scalar

from vinesexp import response_map, simulate
from vinesexp.design.ensemble import duration_of
from vinesexp.errors import ParameterError, VinesexpError
from vinesexp.maps.response_map import (
    VALUES,
    MapGrid,
    empty,
    fill,
    joined,
    known_of,
    published_line,
    read_map,
    write_map,
)

TABLE_2 = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "m": 0.032, "r": 0.6, "frequency": 7.862}


def grid(**changes: object) -> MapGrid:
    given = {
        "values": TABLE_2, "x": "b", "x_values": (0.02, 0.03, 0.04), "y": "G",
        "y_values": (0.15e-3, 0.25e-3), "starts": 2, "kind": "random",
    } | changes  # fmt: skip
    return MapGrid(**given)  # type: ignore[arg-type]


def test_numbers_of_numpy_make_the_same_map():
    rest = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "m": 0.032, "starts": 1, "kind": "wall"}
    plain = response_map({"b": [0.03], "G": [0.25e-3]}, r=0.5, **rest)
    other = response_map({"b": np.array(0.03), "G": np.ma.array([0.25e-3])}, r=np.float32(0.5),
                         **rest)  # fmt: skip
    assert other.identical(plain)
    with pytest.raises(ParameterError, match="m: found '32 g', expected one number"):
        response_map({"b": [0.03], "G": [0.25e-3]}, r=0.5, **rest | {"m": "32 g"})


def test_a_cell_is_the_mean_over_its_starts():
    one = grid(x_values=(0.03,), y_values=(0.25e-3,), starts=3)
    amplitudes, hits = [], []
    for run in one.runs(0):
        settle, end, _ = duration_of(run.rig, 7.862)
        motion = simulate(run.rig, run.base, run.release, end)
        x, v = motion.at(np.linspace(settle, end, 20001))
        amplitudes.append(np.hypot(x, v / run.rig.oscillator.w0))
        hits.append((motion.impacts["time"] >= settle).sum() / (7.862 * (end - settle)))
    found = fill(one)
    mean = np.mean([a.mean() for a in amplitudes])
    assert found["mean_amplitude"][0, 0] == pytest.approx(mean, rel=5e-3)
    assert found["largest_amplitude"][0, 0] == pytest.approx(np.max(amplitudes), rel=2e-2)
    assert found["impacts_per_cycle"][0, 0] == pytest.approx(np.mean(hits), rel=1e-2)
    assert found["captured_share"][0, 0] in (0.0, 1 / 3, 2 / 3, 1.0)


def test_of_a_chatter_the_count_alone_depends_on_where_it_is_cut():
    """Twice a cycle the ball bounces to rest; each bounce is r times as long as the one before."""
    one = grid(x_values=(5e-4,), y_values=(0.25e-3,), starts=1, kind="wall")
    [run], found = one.runs(0), fill(one)
    settle, end, _ = duration_of(run.rig, 7.862)
    counted = []
    for cut in (1e-6, 1e-8, 1e-10):
        mean, largest, hits, _ = scalar(run.rig, run.base, run.release, settle, end, cut)
        assert mean == pytest.approx(found["mean_amplitude"][0, 0], rel=1e-8)
        assert largest == pytest.approx(found["largest_amplitude"][0, 0], rel=1e-8)
        counted.append(hits / (7.862 * (end - settle)))
    assert found["impacts_per_cycle"][0, 0] == pytest.approx(counted[1], rel=1e-3)
    longer = 2.0 * np.log(100.0) / np.log(1.0 / 0.6)
    assert np.diff(counted) == pytest.approx(longer, abs=2.0)


def test_values_do_not_depend_on_threads_nor_on_where_it_was_stopped(tmp_path: Path):
    whole = fill(grid(), workers=1)
    half = fill(grid(), rows=range(1), workers=2)
    assert np.isnan(half["mean_amplitude"][1]).all()
    write_map(grid(), half, tmp_path / "map.nc")
    seen: list[int] = []
    again = fill(
        grid(), known_of(grid(), tmp_path / "map.nc"), progress=lambda done, *_: seen.append(done)
    )
    assert seen == [2]  # the first row was not computed again
    for name in VALUES:
        np.testing.assert_array_equal(again[name], whole[name])


def test_parts_are_joined_and_a_hole_is_noticed(tmp_path: Path):
    parts = [tmp_path / f"{k}.nc" for k in range(2)]
    for k, part in enumerate(parts):
        write_map(grid(), fill(grid(), rows=range(k, 2, 2)), part)
    np.testing.assert_array_equal(
        joined(grid(), parts)["mean_amplitude"], fill(grid())["mean_amplitude"]
    )
    with pytest.raises(VinesexpError, match="1 of 2 rows are in none of the parts"):
        joined(grid(), parts[:1])
    with pytest.raises(VinesexpError, match="missing"):
        joined(grid(), [*parts, tmp_path / "other.nc"])


def test_the_file_says_what_it_is(tmp_path: Path):
    write_map(grid(), empty(grid()), tmp_path / "map.nc")
    found = read_map(tmp_path / "map.nc")
    assert found.mean_amplitude.dims == ("G", "b")
    for name in (*VALUES, "b", "G", "M", "c1", "k1", "m", "r", "frequency"):
        assert found[name].attrs["units"], name
        assert found[name].attrs["long_name"], name
    inputs = json.loads(found.attrs["inputs"])
    assert inputs["over"] == {"b": [0.02, 0.03, 0.04], "G": [0.15e-3, 0.25e-3]}
    assert inputs["M"] == 4.7
    assert found.attrs["vinesexp_version"] in found.attrs["source"]


def test_a_file_of_other_inputs_is_left_alone(tmp_path: Path):
    file = tmp_path / "map.nc"
    write_map(grid(), empty(grid()), file)
    with pytest.raises(VinesexpError, match="other inputs"):
        known_of(grid(seed=2), file)
    file.write_text("no map", encoding="utf-8")
    with pytest.raises(VinesexpError, match="cannot be read"):
        known_of(grid(), file)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"y": "b"}, "two of b, frequency, G, m, r"),
        ({"values": {"M": 1.0}}, "needs a value of c1, k1, frequency, m, r"),
        ({"x_values": (0.03, 0.02)}, "increasing"),
        ({"kind": "rest"}, "random or wall"),
        ({"starts": 0}, "1 or more"),
    ],
)
def test_what_cannot_be_a_map(changes: dict[str, object], words: str):
    with pytest.raises(ParameterError, match=words):
        grid(**changes)


def test_the_function_takes_any_two():
    grid = response_map(
        {"r": [0.5, 0.6], "frequency": [7.8, 7.9, 8.0]}, M=4.7, c1=3.02, k1=1.147e4, m=0.032,
        b=0.02, G=0.25e-3, starts=1, kind="wall",
    )  # fmt: skip
    assert grid.mean_amplitude.dims == ("r", "frequency")
    assert np.isfinite(grid.mean_amplitude).all()
    with pytest.raises(ParameterError, match="a map over 1 values"):
        response_map({"r": [0.5]}, M=4.7, c1=3.02, k1=1.147e4, m=0.032, b=0.02, G=0.25e-3)


def test_the_line_is_b_c_at_resonance_only():
    resonance = {**TABLE_2, "frequency": (1.147e4 / 4.7) ** 0.5 / (2.0 * np.pi)}
    line = published_line(grid(values=resonance))
    assert line is not None
    assert line[1] == pytest.approx(33.97e-3, abs=0.02e-3)  # Table 2 at 0.25 mm
    assert published_line(grid(values={**TABLE_2, "frequency": 8.0})) is None
