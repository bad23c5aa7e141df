"""A result holds as long as the content of what it came from and of itself is the same."""

import json
import os
import shutil

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
    notes = notes_in(folder)
    notes.begin("step", reads=[folder / "a.csv", folder / "missing.csv"])
    notes.finish("step", USED, writes=[folder / "b.csv"])
    return folder


def notes_in(folder):
    return Notes(folder / "made.json", {"results": folder})


def reasons(folder, used=USED):
    return notes_in(folder).why_outdated("step", used)


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
    assert reasons(step) == ["missing.csv is new"]


@pytest.mark.parametrize(
    "text", ["", "{}", "[]", '{"format": 2, "step": 3}', '{"format": 2, "step": {}}', "\x00"]
)
def test_a_damaged_record_counts_as_none(step, text):
    (step / "made.json").write_text(text)
    assert len(reasons(step)) == 1
    (step / "made.json").unlink()
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
    assert notes.why_outdated("step", USED) == []
    notes.renew()
    assert (step / "made.json").read_text() != before


def test_a_step_that_was_killed_vouches_for_nothing(step):
    notes_in(step).begin("step")
    assert reasons(step) == ["was not finished"]


def test_what_a_step_no_longer_makes_goes_also_after_it_was_killed(step):
    (step / "mine.csv").write_text("mine")
    notes_in(step).begin("step")
    (step / "c.csv").write_text("3\n")
    notes = notes_in(step)
    notes.begin("step")
    notes.finish("step", USED, writes=[step / "c.csv"])
    assert {path.name for path in step.iterdir()} == {"a.csv", "c.csv", "made.json", "mine.csv"}
    notes_in(step).remove()
    assert {path.name for path in step.iterdir()} == {"a.csv", "mine.csv"}


def test_a_note_that_names_files_elsewhere_removes_none_of_them(step, tmp_path):
    (tmp_path / "mine.csv").write_text("mine")
    names = {f":{tmp_path / 'mine.csv'}": None, "results:../mine.csv": None}
    (step / "made.json").write_text(
        json.dumps({"format": 2, "step": {"used": {}, "reads": {}, "writes": names}})
    )
    notes_in(step).remove()
    assert (tmp_path / "mine.csv").exists()
