"""A step of the workflow tells a user's mistake in one line and keeps tracebacks in its log."""

import errno
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from vinesexp.errors import RecordError
from vinesexp.step import run_step


def fail_as_user():
    raise RecordError("is empty; export it again", file="raw/a.csv")


def fail_unexpectedly():
    return 1 / 0


def test_a_mistake_of_the_user_is_one_line_without_traceback(tmp_path, capsys):
    log = tmp_path / "logs" / "a.log"
    with pytest.raises(SystemExit) as caught:
        run_step(fail_as_user, log=log)
    assert caught.value.code == 1
    shown = capsys.readouterr().err
    assert shown == f"vinesexp: raw/a.csv: is empty; export it again (log: {log})\n"
    assert "Traceback" not in log.read_text()


def test_anything_unexpected_keeps_its_traceback_in_the_log(tmp_path, capsys):
    log = tmp_path / "a.log"
    with pytest.raises(SystemExit):
        run_step(fail_unexpectedly, log=log)
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    assert "ZeroDivisionError" in shown
    assert "Traceback" in log.read_text()


def fail_on_a_full_disk():
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "results/a/report.html")


def test_a_full_disk_is_one_line_that_names_the_file(tmp_path, capsys):
    with pytest.raises(SystemExit):
        run_step(fail_on_a_full_disk, log=tmp_path / "a.log")
    shown = capsys.readouterr().err
    assert shown.startswith("vinesexp: results/a/report.html: No space left on device; when this")
    assert shown.count("\n") == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize("step", [lambda: None, fail_as_user, fail_unexpectedly])
def test_a_log_that_cannot_be_written_is_one_line(step, capsys):
    with pytest.raises(SystemExit):
        run_step(step, log="/dev/full")
    shown = capsys.readouterr().err
    assert shown.startswith("vinesexp: ")
    assert shown.count("\n") == 1


def test_what_a_step_prints_is_in_its_log(tmp_path, capsys):
    log = tmp_path / "a.log"
    run_step(lambda *, n: print("n is", n), log=log, n=3)
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
        "from vinesexp.step import run_step\n"
        f"run_step(lambda: None, log={str(tmp_path / 'a.log')!r})\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    peak = re.search(r"peak memory (\d+) MiB", (tmp_path / "a.log").read_text())
    assert held.nbytes > 3e8
    assert int(peak[1]) < 150
