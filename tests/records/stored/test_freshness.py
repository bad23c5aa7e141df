"""A result holds as long as the content of what it came from and of itself is the same."""

import hashlib
import json
import os
import shutil
from pathlib import Path

import pytest

from vinesexp.records.stored.freshness import Notes

USED = {"channels": "{'base': 1}", "code": "abc"}


@pytest.fixture
def step(tmp_path):
    """A step that has read a.csv and missing.csv, and written b.csv; all in one folder."""
    folder = tmp_path / "project"
    folder.mkdir()
    (folder / "a.csv").write_text("1\n")
    (folder / "b.csv").write_text("2\n")
    with notes_in(folder).making("step", USED, reads=read_in(folder)) as written:
        written.append(folder / "b.csv")
    return folder


def read_in(folder):
    return [folder / "a.csv", folder / "missing.csv"]


def notes_in(folder):
    return Notes(folder / "made.json", {"results": folder})


def reasons(folder, used=USED):
    return notes_in(folder).why_outdated("step", used, reads=read_in(folder))


def test_nothing_changed(step):
    assert reasons(step) == []


@pytest.mark.parametrize(
    ("used", "words"),
    [
        ({**USED, "channels": "{}"}, ["channels changed"]),
        ({**USED, "more": "1"}, ["more changed"]),
        ({"code": "abc"}, ["channels changed"]),
    ],
)
def test_what_was_used_changed(step, used, words):
    assert reasons(step, used) == words


def test_a_file_swapped_for_another_of_the_same_size_and_an_older_time(step):
    (step / "a.csv").write_text("3\n")
    os.utime(step / "a.csv", (0, 0))
    assert reasons(step) == ["a.csv changed"]


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda file: file.write_text(""), "b.csv is not as the step left it"),
        (lambda file: file.unlink(), "b.csv is missing"),
    ],
)
def test_a_damaged_result(step, damage, words):
    damage(step / "b.csv")
    assert reasons(step) == [words]


def test_an_input_that_was_missing_and_is_there_now(step):
    (step / "missing.csv").write_text("1\n")
    assert reasons(step) == ["missing.csv changed"]


@pytest.mark.parametrize("text", ["", "{}", "[]", '["",\n[{"step": 3}, {}]]\n', "\x00"])
def test_a_damaged_record_counts_as_none(step, text):
    (step / "made.json").write_text(text)
    assert reasons(step) == ["not made yet"]
    (step / "made.json").unlink()
    assert reasons(step) == ["not made yet"]


@pytest.mark.parametrize("flipped", [0, 5, 100, -100, -1])
def test_one_flipped_bit_anywhere_in_a_record_counts(step, flipped):
    """In a key, a digest, a time: whatever it would have made the record say."""
    assert isinstance(json.loads((step / "made.json").read_text()), list)
    text = bytearray((step / "made.json").read_bytes())
    text[flipped] ^= 1
    (step / "made.json").write_bytes(text)
    assert reasons(step) == ["not made yet"]


def test_touched_copied_and_moved_files_hold(step, tmp_path):
    os.utime(step / "a.csv", (0, 0))
    assert reasons(step) == []
    shutil.copytree(step, tmp_path / "copy", copy_function=shutil.copyfile)
    shutil.rmtree(step)
    assert reasons(tmp_path / "copy") == []


def test_new_times_are_written_down_so_that_nothing_is_hashed_twice(step):
    os.utime(step / "a.csv", (0, 0))
    before = (step / "made.json").read_text()
    assert reasons(step) == []
    assert (step / "made.json").read_text() == before
    notes = notes_in(step)
    assert notes.why_outdated("step", USED, reads=read_in(step)) == []
    notes.renew()
    assert (step / "made.json").read_text() != before


def test_a_step_that_was_killed_vouches_for_nothing(step):
    with pytest.raises(RuntimeError), notes_in(step).making("step", USED):
        raise RuntimeError
    assert reasons(step) == ["not made yet"]


def test_of_what_a_step_read_counts_what_it_was_when_the_step_began(step):
    with notes_in(step).making("step", USED, reads=read_in(step)):
        (step / "a.csv").write_text("changed meanwhile\n")
    assert reasons(step) == ["a.csv changed"]


def test_a_result_written_again_within_a_tick_of_the_clock_is_read_again(step, monkeypatch):
    """Times of files are coarse: the same size and times may be of other content."""
    real = os.stat

    def coarse(path, **of):
        found = list(real(path, **of))
        return os.stat_result([*found[:7], 1, 1, 1])

    monkeypatch.setattr("vinesexp.records.stored.freshness.os.stat", coarse)
    for text in ("7\n", "8\n"):
        with notes_in(step).making("step", USED) as written:
            (step / "b.csv").write_text(text)
            written.append(step / "b.csv")
        noted = notes_in(step).outcome("step")
        assert hashlib.sha256(text.encode()).hexdigest() in noted


def test_what_a_step_no_longer_makes_goes_also_after_it_was_killed(step):
    (step / "mine.csv").write_text("mine")
    notes_in(step).doubt("step")
    (step / "c.csv").write_text("3\n")
    with notes_in(step).making("step", USED) as written:
        written.append(step / "c.csv")
    assert {path.name for path in step.iterdir()} == {"a.csv", "c.csv", "made.json", "mine.csv"}
    notes_in(step).remove()
    assert {path.name for path in step.iterdir()} == {"a.csv", "mine.csv"}


def test_a_note_that_names_files_elsewhere_removes_none_of_them(step, tmp_path):
    (tmp_path / "mine.csv").write_text("mine")
    with notes_in(step).making("step", USED) as written:
        written += [tmp_path / "mine.csv", Path(os.path.relpath(tmp_path / "mine.csv"))]
    notes = notes_in(step)
    notes.steps["step"]["writes"]["results:../mine.csv"] = None
    notes.remove()
    assert (tmp_path / "mine.csv").exists()
