"""Work in a watched process: one line for a mistake, a log, and deaths that take nothing along."""

import errno
import os
import re
import signal
import subprocess
import sys
import time
from multiprocessing import forkserver
from pathlib import Path

import numpy as np
import pytest
from tests.watched import Watched

from vinesexp.errors import RecordError
from vinesexp.supervised import logged, run_apart


def fail_as_user():
    raise RecordError("is empty; export it again", file="raw/a.csv")


def fail_unexpectedly():
    return 1 / 0


def fail_on_a_full_disk():
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "results/a/report.html")


def test_a_mistake_of_the_user_is_one_line_without_traceback(tmp_path, capsys):
    log = tmp_path / "logs" / "a.log"
    assert logged(fail_as_user, log) == f"raw/a.csv: is empty; export it again (log: {log})"
    assert capsys.readouterr() == ("", "")
    assert "Traceback" not in log.read_text()


def test_anything_unexpected_keeps_its_traceback_in_the_log(tmp_path):
    log = tmp_path / "a.log"
    said = logged(fail_unexpectedly, log)
    assert "\n" not in said
    assert "ZeroDivisionError" in said
    assert "Traceback" in log.read_text()


def test_a_full_disk_is_one_line_that_names_the_file(tmp_path):
    said = logged(fail_on_a_full_disk, tmp_path / "a.log")
    assert said.startswith("results/a/report.html: No space left on device; when this")
    assert "\n" not in said


def fail_behind_a_full_disk():
    try:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    finally:
        raise AttributeError("'Stream' object has no attribute 'pos'")


def test_a_full_disk_is_named_and_not_what_a_library_stumbles_over_behind_it(tmp_path):
    said = logged(fail_behind_a_full_disk, tmp_path / "a.log")
    assert said.startswith("No space left on device; when this")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize("step", [lambda: None, fail_as_user, fail_unexpectedly])
def test_a_log_that_cannot_be_written_is_one_line(step):
    said = logged(step, Path("/dev/full"))
    assert said
    assert "\n" not in said


def test_what_a_step_prints_is_in_its_log(tmp_path, capsys):
    log = tmp_path / "a.log"
    assert logged(lambda: print("n is", 3), log) == ""
    assert log.read_text().startswith("n is 3\ndone in ")
    assert capsys.readouterr().out == ""


@pytest.fixture
def go(tmp_path):
    """Have the work of tests/watched.py done; the exit code."""

    def go(*ids, **given):
        return run_apart(Watched(tmp_path, **given), "impacts", ids)

    forkserver._forkserver._stop()  # the next one prints where this test looks
    yield go
    forkserver._forkserver._stop()


def test_a_step_that_the_system_kills_says_what_was_killed_and_why_it_may_be(go, tmp_path, capsys):
    assert go("", deadly=[""])
    shown = capsys.readouterr().err
    assert "impacts: its process was killed, as systems do when memory is short" in shown
    assert str(tmp_path / ".log") in shown


@pytest.mark.long
def test_peak_memory_is_the_step_s_own_and_not_that_of_who_started_it(go, tmp_path):
    if not sys.platform.startswith("linux"):
        pytest.skip("elsewhere the system says nothing better")
    held = np.ones(40_000_000)  # 320 MB here, while the step starts
    assert go("a") == 0
    said = (tmp_path / "a.log").read_text()
    peak = re.search(r"processor time, peak memory (\d+) MiB", said)
    assert held.nbytes > 3e8
    assert int(peak[1]) < 150


def test_records_of_a_batch_share_a_process_and_each_is_a_line(go, tmp_path, capfd):
    assert go("a", "b", "c") == 0
    assert len({(tmp_path / id).read_text() for id in "abc"}) == 1
    shown = capfd.readouterr().err.splitlines()
    assert [line.split(",")[0].split() for line in shown] == [  # without the time that is left
        ["impacts", "1/3", "a"], ["impacts", "2/3", "b"], ["impacts", "3/3", "c"],
    ]  # fmt: skip


@pytest.mark.long
def test_a_line_says_how_long_the_rest_may_take(go, capfd):
    assert go("a", "b", "c", takes=0.6) == 0
    first, *_, last = capfd.readouterr().err.splitlines()
    assert re.search(r"a, \d s left", first)
    assert "left" not in last


@pytest.mark.parametrize(
    ("how", "words"),
    [
        (signal.SIGKILL, "memory is short"),
        (signal.SIGSEGV, "crashed (SIGSEGV)"),
        (0, "ended with 1"),
    ],
)
def test_a_record_that_kills_its_process_is_refused_by_name(how, words, go, tmp_path, capfd):
    assert go("a", "b", "c", deadly=["b"], how=how) == 0
    assert words in (tmp_path / "b").read_text()
    assert "twice while this record was read" in (tmp_path / "b").read_text()
    assert (tmp_path / "c").read_text().isdigit()
    assert "b refused" in capfd.readouterr().err


def test_a_record_whose_process_dies_once_is_tried_again(go, tmp_path):
    assert go("a", "b", "c", once=["b"]) == 0
    assert all((tmp_path / id).read_text().isdigit() for id in "abc")


def test_two_records_that_kill_their_process_are_both_refused(go, tmp_path):
    assert go("a", "b", "c", deadly=["a", "c"]) == 0
    assert [(tmp_path / id).read_text()[:7] == "refused" for id in "abc"] == [True, False, True]


def test_a_record_that_cannot_even_be_refused_ends_the_batch(go, tmp_path, capsys):
    assert go("a", "b", deadly=["a"], stubborn=["a"])
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("vinesexp: impacts: its process was killed")
    assert line.endswith(f"(log: {tmp_path / 'a.log'})")


def test_a_record_at_which_a_step_fails_is_refused_and_the_others_go_on(go, tmp_path, capfd):
    assert go("a", "b", wrong=["a"]) == 0
    assert (tmp_path / "a").read_text() == "refused: impacts: a: is wrong"
    assert (tmp_path / "b").read_text().isdigit()


def test_a_full_disk_ends_the_batch_in_one_line(go, tmp_path, capfd):
    assert go("a", "b", full=["a"])
    assert not (tmp_path / "b").exists()
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("vinesexp: a: No space left on device; when this is mended")


def started(work, seen):
    """A run that has some work done, under way: a file says that the work has begun."""
    code = (
        "import signal, sys\nfrom pathlib import Path\nfrom tests.watched import Watched\n"
        "from vinesexp.supervised import run_apart\n"
        "signal.signal(signal.SIGINT, lambda *_: None)\n"
        f"folder = Path({str(seen.parent)!r})\n"
        f"sys.exit(run_apart({work}))\n"
    )
    root = Path(__file__).parents[1]
    run = subprocess.Popen([sys.executable, "-c", code], start_new_session=True, cwd=root)
    assert until(seen.exists)
    return run


def until(happens):
    """Whether something happens within half a minute."""
    for _ in range(600):
        if happens():
            return True
        time.sleep(0.05)
    return False


@pytest.mark.long
def test_an_interrupt_ends_the_step_first_and_only_once(tmp_path):
    """Ctrl-C twice: what the step clears away on its way out is cleared away."""
    run = started("Watched(folder, held=True), 'impacts', ['a']", tmp_path / "temporary")
    for _ in range(2):
        os.killpg(run.pid, signal.SIGINT)
        time.sleep(0.1)
    assert run.wait(timeout=60) == 130
    assert not (tmp_path / "temporary").exists()


@pytest.mark.long
def test_a_step_ends_when_the_run_is_killed(tmp_path):
    """The next record does not begin; what waits for the step ends too."""
    run = started("Watched(folder, takes=0.5), 'impacts', ['a', 'b']", tmp_path / "a.tried")
    run.kill()
    run.wait()

    def ended():
        try:
            os.killpg(run.pid, 0)
        except ProcessLookupError:
            return True
        return False

    assert until(ended), "processes are left"
    assert (tmp_path / "a").exists()
    assert not (tmp_path / "b.tried").exists()
