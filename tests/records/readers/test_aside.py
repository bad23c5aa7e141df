"""What readers lay aside leaves nothing in the folder for passing files, however they end."""

import gc
import os
import signal
import subprocess
import sys
import time
import zipfile

import pytest
from tests.combined import combined

from vinesexp.records.readers import open_source

ROWS = "time,x\n" + "\n".join(f"{k},{k % 7}" for k in range(3000)) + "\n"


@pytest.fixture
def passing(tmp_path, monkeypatch):
    folder = tmp_path / "passing"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    return folder


def workbook(path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for k in range(3000):
        book.active.append([k, k % 7])
    book.save(path)


def zipped(path):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.csv", ROWS)


def blocks_of_text(path):
    path.write_text(f"time,x\n{ROWS[7:]}\n\ntime,x\n{ROWS[7:]}")


@pytest.mark.long
@pytest.mark.parametrize(
    ("file", "count"),
    combined([("a.xlsx", workbook), ("a.zip", zipped), ("a.txt", blocks_of_text)], [1, 2]),
)
def test_nothing_is_left_when_a_source_is_closed(file, count, tmp_path, passing, monkeypatch):
    name, make = file
    monkeypatch.setattr("vinesexp.records.readers.guard.threads", lambda: count)
    make(tmp_path / name)
    gc.freeze()  # what other tests have left need not be looked through
    source = open_source(tmp_path / name)
    blocks = source.blocks([0, 1], rows=100)
    assert next(blocks)[-1, 0] == 99.0
    assert list(passing.iterdir()) == []
    del blocks, source
    gc.collect()
    assert list(passing.iterdir()) == []


@pytest.mark.long
def test_nothing_is_left_when_the_program_itself_is_killed(tmp_path, passing):
    workbook(tmp_path / "a.xlsx")
    code = (
        "import sys, time\n"
        "from pathlib import Path\n"
        "from vinesexp.records.readers import open_source\n"
        "source = open_source(Path(sys.argv[1]))\n"
        "print(source._child.pid, flush=True)\n"
        "time.sleep(100)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path / "a.xlsx")], stdout=subprocess.PIPE, text=True
    ) as process:
        child = int(process.stdout.readline())
        process.send_signal(signal.SIGKILL)
    end = time.monotonic() + 20.0
    while os.path.exists(f"/proc/{child}") and time.monotonic() < end:
        time.sleep(0.02)
    assert not os.path.exists(f"/proc/{child}")  # nor is its process
    assert list(passing.iterdir()) == []
