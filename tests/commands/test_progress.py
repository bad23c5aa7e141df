"""A person who waits sees how far it is; a file or another program gets none of it."""

import io
import time
from pathlib import Path

import pytest
from tests.fuzz.commands import RIG

from vinesexp.cli import main
from vinesexp.commands import options

TWIN = Path(__file__).parents[2] / "data/twin/scene.yaml"


class Screen(io.StringIO):
    """Text that says that a person looks at it."""

    def isatty(self) -> bool:
        return True


def watched(monkeypatch) -> Screen:
    """A screen in the place of standard error; called by the test, after pytest took the stream."""
    shown = Screen()
    monkeypatch.setattr("sys.stderr", shown)
    monkeypatch.setattr(options, "_TICK", 0.01)
    return shown


def test_a_clock_runs_beside_the_work_and_leaves_no_line(monkeypatch):
    screen = watched(monkeypatch)
    with options.clock("simulating", 30.0):
        time.sleep(0.2)
    assert "simulating: 0 s of about 30 s" in screen.getvalue()
    assert screen.getvalue().endswith("\r\x1b[K")


def test_a_clock_ends_with_the_work_that_fails(monkeypatch):
    screen = watched(monkeypatch)
    with pytest.raises(ValueError, match="broken"), options.clock("simulating", 1.0):
        raise ValueError("broken")
    before = len(screen.getvalue())
    time.sleep(0.05)
    assert len(screen.getvalue()) == before


def test_nobody_looks_nothing_is_shown(capsys):
    with options.clock("simulating", 1.0):
        time.sleep(0.02)
    assert capsys.readouterr().err == ""


def test_design_shows_the_clock(monkeypatch):
    screen = watched(monkeypatch)
    monkeypatch.setattr("vinesexp.design.ask.answered", lambda *a, **k: time.sleep(0.1) or 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main(["design", *(f"{key}={value}" for key, value in RIG.items())])
    assert "simulating: 0 s of about" in screen.getvalue()


def test_simulate_counts_the_records_of_a_group(monkeypatch, tmp_path):
    screen = watched(monkeypatch)
    assert main(["simulate", str(TWIN), str(tmp_path / "out"), "--group", "drops"]) == 0
    assert "1/3 records of drops" in screen.getvalue()
    assert "3/3 records of drops" in screen.getvalue()
