"""`vinesexp map` and `vinesexp basins`: options, one-line errors, what they leave."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from vinesexp.cli import main
from vinesexp.commands.map import share_of_rows
from vinesexp.maps.map_options import cells_of, gather_values
from vinesexp.maps.response_map import read_map

RIG = {
    "--mass": "4.7 kg",
    "--damping": "3.02 N s/m",
    "--stiffness": "1.147e4 N/m",
    "--nes-mass": "32 g",
    "--restitution": "0.6",
    "--clearance": "20:30 mm",
    "--base-amplitude": "0.15 mm:0.25 mm",
}


def words(options: dict[str, str], *more: str) -> list[str]:
    return [word for pair in options.items() for word in pair] + list(more)


@pytest.mark.long
def test_a_map_is_made_drawn_and_taken_up_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, picture = tmp_path / "map.nc", tmp_path / "map.svg"
    given = words(RIG, "--cells", "3x2", "--starts", "2", "--out", str(out))
    assert main(["map", *given, "--rows", "2/2"]) == 0
    part = read_map(out)
    assert part.mean_amplitude.shape == (2, 3)
    assert np.isnan(part.mean_amplitude.values[0]).all()
    assert main(["map", *given, "--plot", str(picture)]) == 0
    whole = read_map(out)
    assert np.isfinite(whole.mean_amplitude).all()
    np.testing.assert_array_equal(whole.mean_amplitude[1], part.mean_amplitude[1])
    assert "<svg" in picture.read_text(encoding="utf-8")
    assert "2 x 3 cells of 2 starts" in capsys.readouterr().out


@pytest.mark.long
def test_basins_as_table_json_and_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = {**RIG, "--base-amplitude": "0.25 mm"}
    table, picture = tmp_path / "motions.csv", tmp_path / "motions.png"
    given = words(options, "--cells", "2", "--starts", "3", "--out", str(table))
    assert main(["basins", *given, "--json", "--plot", str(picture)]) == 0
    answer = json.loads(capsys.readouterr().out)
    shares = {b: sum(m["share"] for m in answer["motions"] if m["b"] == b) for b in (0.02, 0.03)}
    assert shares == pytest.approx({0.02: 1.0, 0.03: 1.0})
    with table.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["mean_m"]) for row in rows] == [m["mean"] for m in answer["motions"]]
    assert picture.stat().st_size > 1000
    assert main(["basins", *given, "--force"]) == 0
    assert "two symmetric" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--clearance", "5:60 mm"], "--clearance: given 2 times"),
        (["--cells", "4", "--cells", "5"], "--cells: given 2 times (4, 5)"),
        (["--cells", "4x5x6"], "--cells: found '4x5x6', expected 40 or 60x40"),
        (["--cells", "1x5"], "2 or more along an axis"),
        (["--starts", "none"], "--starts: found 'none'"),
        (["--kind", "rest"], "starts 'rest': expected random or wall"),
        (["--rows", "9/8"], "--rows: found '9/8'"),
        (["--plot", "map.jpg"], "cannot draw '.jpg'"),
        (["--frequency", "7.2:8.4 Hz"], "ranges found: --clearance, --frequency, --base-amplitude"),
        (["--seed", "-1"], "--seed: found '-1'"),
        (["--seed", "9" * 5000], "--seed: found a number of 5000 digits"),
        (["--cells", "9" * 5000], "--cells: found '9999"),
        (["--cells", "100000x100000"], "a map of 100000x100000 cells would take 640 GB"),
        (["--starts", "1000000000000"], "cells of 1000000000000 starts would take"),
        (["--rows", "1/" + "9" * 5000], "--rows: found '1/999"),
    ],
)
def test_mistakes_are_one_line(
    more: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["map", *words(RIG, "--out", str(tmp_path / "m.nc")), *more]) == 1
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("symbol", "text", "said"),
    [
        ("M", "4:5 kg", "expected one value"),
        ("b", "30:20 mm", "from a smaller to a larger value"),
        ("b", "20:30", "unit is missing"),
        ("b", "0:20 mm", "above 0"),
        ("r", "0.5:1", "from 0 to below 1"),
        ("G", "0.1 mm:0.2 kg", "kg"),
    ],
)
def test_values_that_cannot_be(symbol: str, text: str, said: str) -> None:
    from vinesexp.errors import ParameterError

    with pytest.raises(ParameterError, match=said):
        gather_values({symbol: text})


def test_missing_values_are_asked_for_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["map", "--mass", "4.7 kg"]) == 1
    error = capsys.readouterr().err
    assert "--damping '3.02 N s/m', --stiffness" in error
    assert "--frequency" not in error  # the natural one by default


def test_a_range_of_another_value_is_no_basin(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["basins", *words(RIG)]) == 1
    assert "--base-amplitude: found a range" in capsys.readouterr().err


def test_shares_of_the_rows_are_all_rows_once() -> None:
    rows = sorted(row for k in range(1, 5) for row in share_of_rows(f"{k}/4", 10))
    assert rows == list(range(10))
    assert cells_of("7", 2) == (7, 7)
    assert cells_of("0" * 5000 + "7", 1) == (7,)


@pytest.mark.parametrize("command", ["map", "basins"])
def test_several_balls_are_refused_with_what_takes_them(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = words({**RIG, "--nes-mass": "32 g; 32 g"}, "--out", str(tmp_path / "out"))
    assert main([command, *given]) == 1
    said = capsys.readouterr().err
    assert "--nes-mass: found a list, '32 g; 32 g': maps and basins are of one ball" in said
    assert "vinesexp design" in said
    assert said.count("\n") == 1


def test_basins_of_more_starts_than_memory_holds(capsys: pytest.CaptureFixture[str]) -> None:
    options = {**RIG, "--base-amplitude": "0.25 mm"}
    assert main(["basins", *words(options, "--starts", "1000000000")]) == 1
    said = capsys.readouterr().err
    assert "1000000000 starts would take 2e+03 GB" in said


def test_the_work_is_stated_before_it_is_begun(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("vinesexp.maps.response_map.responses", never)
    out = tmp_path / "map.nc"
    given = words(RIG, "--cells", "400x200", "--starts", "8", "--out", str(out))
    assert main(["map", *given]) == 1
    said = capsys.readouterr().err
    assert "640,000 runs, about" in said
    assert "stopped; the same command continues from here" in said


def test_an_interrupt_leaves_the_basins_that_are_known(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from vinesexp.maps import basins

    grouped, calls = basins.grouped, []

    def once(b: float, found: list[basins.Settled]) -> list[basins.Attractor]:
        calls.append(b)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return grouped(b, found)

    monkeypatch.setattr(basins, "grouped", once)
    options = {**RIG, "--base-amplitude": "0.25 mm"}
    assert main(["basins", *words(options, "--cells", "3", "--starts", "2")]) == 130
    said = capsys.readouterr()
    assert "stopped after 1 of 3 clearances" in said.err
    assert "20.00" in said.out
