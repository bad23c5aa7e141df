"""Work in a watched process: one line for a mistake, a log, and deaths that take nothing along."""

import errno
import faulthandler
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from vinesexp.errors import RecordError
from vinesexp.supervised import on_all, on_each


def fail_as_user():
    raise RecordError("is empty; export it again", file="raw/a.csv")


def fail_unexpectedly():
    return 1 / 0


def fail_on_a_full_disk():
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "results/a/report.html")


def killed():
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_mistake_of_the_user_is_one_line_without_traceback(tmp_path, capsys):
    log = tmp_path / "logs" / "a.log"
    assert not on_all("identify", fail_as_user, log=log)
    shown = capsys.readouterr().err
    assert shown == f"vinesexp: raw/a.csv: is empty; export it again (log: {log})\n"
    assert "Traceback" not in log.read_text()


def test_anything_unexpected_keeps_its_traceback_in_the_log(tmp_path, capsys):
    log = tmp_path / "a.log"
    assert not on_all("identify", fail_unexpectedly, log=log)
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    assert "ZeroDivisionError" in shown
    assert "Traceback" in log.read_text()


def test_a_full_disk_is_one_line_that_names_the_file(tmp_path, capsys):
    assert not on_all("report", fail_on_a_full_disk, log=tmp_path / "a.log")
    shown = capsys.readouterr().err
    assert shown.startswith("vinesexp: results/a/report.html: No space left on device; when this")
    assert shown.count("\n") == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize("step", [lambda: None, fail_as_user, fail_unexpectedly])
def test_a_log_that_cannot_be_written_is_one_line(step, capsys):
    assert not on_all("identify", step, log=Path("/dev/full"))
    shown = capsys.readouterr().err
    assert shown.startswith("vinesexp: ")
    assert shown.count("\n") == 1


def test_a_step_that_the_system_kills_says_what_was_killed_and_why_it_may_be(tmp_path, capsys):
    log = tmp_path / "a.log"
    assert not on_all("identify", killed, log=log)
    shown = capsys.readouterr().err
    assert "identify: its process was killed, as systems do when memory is short" in shown
    assert str(log) in shown
    assert "memory" in log.read_text()


def test_what_a_step_prints_is_in_its_log(tmp_path, capsys):
    log = tmp_path / "a.log"
    assert on_all("identify", lambda: print("n is", 3), log=log)
    text = log.read_text()
    assert text.startswith("n is 3\ndone in ")
    assert "processor time" in text
    assert "peak memory" in text
    assert capsys.readouterr().out == ""


def test_peak_memory_is_the_step_s_own_and_not_that_of_who_started_it(tmp_path):
    if not sys.platform.startswith("linux"):
        pytest.skip("elsewhere the system says nothing better")
    held = np.ones(40_000_000)  # 320 MB here, while the step starts
    code = (
        "from pathlib import Path\nfrom vinesexp.supervised import on_all\n"
        f"on_all('a', lambda: None, log=Path({str(tmp_path / 'a.log')!r}))\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    peak = re.search(r"peak memory (\d+) MiB", (tmp_path / "a.log").read_text())
    assert held.nbytes > 3e8
    assert int(peak[1]) < 150


class Records:
    """A step on records that writes a file for each; some kill their process."""

    def __init__(self, folder, deadly=(), once=(), wrong=(), how=signal.SIGKILL):
        self.folder, self.deadly, self.once = folder, deadly, once
        self.wrong, self.how = wrong, how

    def work(self, id):
        tried = self.folder / f"{id}.tried"
        before = tried.exists()
        tried.touch()
        if id in self.deadly or (id in self.once and not before):
            faulthandler.disable()  # of pytest, which would print all that the system knows
            os.kill(os.getpid(), self.how)
        if id in self.wrong:
            raise RecordError("is wrong", file=id)
        (self.folder / id).write_text(f"{os.getpid()}")

    def refuse(self, id, reason):
        (self.folder / id).write_text(f"refused: {reason}")

    def go(self, ids):
        return on_each(
            "impacts", ids, work=self.work, refuse=self.refuse, log=self.folder / "all.log",
            log_of=lambda id: self.folder / f"{id}.log",
        )  # fmt: skip


def test_records_of_a_batch_share_a_process_and_each_is_a_line(tmp_path, capsys):
    assert Records(tmp_path).go(["a", "b", "c"])
    assert len({(tmp_path / id).read_text() for id in "abc"}) == 1
    shown = capsys.readouterr().err.splitlines()
    assert [line.split() for line in shown] == [
        ["impacts", "1/3", "a"], ["impacts", "2/3", "b"], ["impacts", "3/3", "c"],
    ]  # fmt: skip


def test_a_line_says_how_long_the_rest_may_take(tmp_path, capsys):
    slow = Records(tmp_path)
    work = slow.work
    slow.work = lambda id: (time.sleep(0.6), work(id))
    assert slow.go(["a", "b", "c"])
    first, *_, last = capsys.readouterr().err.splitlines()
    assert re.search(r"a, \d s left", first)
    assert "left" not in last


@pytest.mark.parametrize(
    ("how", "words"), [(signal.SIGKILL, "memory is short"), (signal.SIGSEGV, "crashed (SIGSEGV)")]
)
def test_a_record_that_kills_its_process_is_refused_by_name(how, words, tmp_path, capsys):
    assert Records(tmp_path, deadly=["b"], how=how).go(["a", "b", "c"])
    assert words in (tmp_path / "b").read_text()
    assert (tmp_path / "c").read_text().isdigit()
    assert "b refused" in capsys.readouterr().err


def test_a_record_whose_process_dies_once_is_tried_again(tmp_path):
    assert Records(tmp_path, once=["b"]).go(["a", "b", "c"])
    assert all((tmp_path / id).read_text().isdigit() for id in "abc")


def test_a_record_that_fails_leaves_the_others(tmp_path, capsys):
    assert not Records(tmp_path, wrong=["a"]).go(["a", "b"])
    assert (tmp_path / "b").exists()
    assert f"vinesexp: a: is wrong (log: {tmp_path / 'a.log'})" in capsys.readouterr().err


def test_an_interrupt_ends_the_child_first_and_only_once(tmp_path):
    """Ctrl-C twice: what the step clears away on its way out is cleared away."""
    code = (
        "import sys, time\nfrom pathlib import Path\nfrom vinesexp.supervised import on_all\n"
        f"here = Path({str(tmp_path)!r})\n"
        "def work():\n"
        "    (here / 'temporary').touch()\n"
        "    try:\n"
        "        time.sleep(60)\n"
        "    finally:\n"
        "        time.sleep(0.5)\n"
        "        (here / 'temporary').unlink()\n"
        "on_all('a', work, log=here / 'a.log')\n"
    )
    run = subprocess.Popen([sys.executable, "-c", code], start_new_session=True)
    for _ in range(600):
        if (tmp_path / "temporary").exists():
            break
        time.sleep(0.05)
    for _ in range(2):
        os.killpg(run.pid, signal.SIGINT)
        time.sleep(0.1)
    assert run.wait(timeout=60) == 130
    assert not (tmp_path / "temporary").exists()
