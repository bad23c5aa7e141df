"""Files that no longer grow, whatever the clock of the drive says."""

import os
from pathlib import Path

import pytest

from vinesexp.live.session import Arrivals


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def arrivals(tmp_path, clock):
    return Arrivals(tmp_path, ignored=lambda name: name.endswith(".yaml"), quiet=1.0, clock=clock)


def names(found: list[Path]) -> list[str]:
    return [path.name for path in found]


def test_a_file_is_taken_once_and_only_when_it_rests(arrivals, clock, tmp_path):
    file = tmp_path / "a.csv"
    for k in range(5):
        file.write_text("x" * (k + 1))
        assert arrivals.scan() == []
        assert names(list(arrivals.growing)) == ["a.csv"]
        clock.now += 0.9
    clock.now += 0.2
    assert names(arrivals.scan()) == ["a.csv"]
    clock.now += 5.0
    assert arrivals.scan() == []
    assert arrivals.growing == ()


def test_a_file_that_goes_on_growing_comes_again(arrivals, clock, tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("half")
    arrivals.scan()
    clock.now = 2.0
    assert names(arrivals.scan()) == ["a.csv"]
    file.write_text("all of it")
    assert arrivals.scan() == []
    clock.now = 4.0
    assert names(arrivals.scan()) == ["a.csv"]


@pytest.mark.parametrize("of_drive", [0.0, 1e9, 4e9])  # 1970, 2001, 2096
def test_the_clock_of_the_drive_does_not_matter(arrivals, clock, tmp_path, of_drive):
    file = tmp_path / "a.csv"
    file.write_text("x")
    os.utime(file, (of_drive, of_drive))
    arrivals.scan()
    clock.now = 1.1
    assert names(arrivals.scan()) == ["a.csv"]


def test_empty_hidden_and_unfinished_files_are_left(arrivals, clock, tmp_path):
    for name in ("empty.csv", ".hidden.csv", "~$open.xlsx", "a.csv.part", "b.TMP", "c.yaml"):
        (tmp_path / name).write_text("" if name == "empty.csv" else "x")
    (tmp_path / ".git").mkdir()
    (tmp_path / ".git/d.csv").write_text("x")
    arrivals.scan()
    clock.now = 3.0
    assert arrivals.scan() == []


def test_a_renamed_file_is_a_new_one(arrivals, clock, tmp_path):
    (tmp_path / "a.csv").write_text("x")
    arrivals.scan()
    clock.now = 2.0
    arrivals.scan()
    (tmp_path / "a.csv").rename(tmp_path / "b.csv")
    assert names(arrivals.scan()) == ["a.csv"]  # which is gone
    clock.now = 4.0
    assert names(arrivals.scan()) == ["b.csv"]


def test_the_results_in_the_folder_are_not_looked_into(clock, tmp_path):
    results = tmp_path / "results"
    (results / "deeper").mkdir(parents=True)
    (results / "deeper/a.csv").write_text("x")
    (tmp_path / "b.csv").write_text("x")
    found = Arrivals(tmp_path, ignored=lambda _: False, besides=results, clock=clock)
    found.scan()
    clock.now = 2.0
    assert names(found.scan()) == ["b.csv"]
