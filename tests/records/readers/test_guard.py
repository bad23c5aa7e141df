"""Readers that crash, hang or ask for all memory there is: one line, and the others go on."""

import ctypes
import gc
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

from vinesexp.errors import RecordError
from vinesexp.records import readers
from vinesexp.records.readers import guard, open_source
from vinesexp.records.readers.guard import GuardedSource, Limits
from vinesexp.records.readers.source import Column, TableSource

QUICK = Limits(seconds=1, patience=200.0, memory=1 << 28)
IMPATIENT = Limits(seconds=1, patience=2.0, memory=1 << 28)


def reader(open_file):
    return SimpleNamespace(NAME="Test format", open_file=open_file, __name__="test")


def crashing(path):
    ctypes.string_at(0)


def spinning(path):
    while True:
        pass


def sleeping(path):
    time.sleep(1000.0)


def greedy(path):
    return np.ones(1 << 30)


def leaving(path):
    os._exit(3)


def mistaken(path):
    return {}["no such\nkey"]


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"bytes")
    return path


@pytest.mark.long
@pytest.mark.parametrize(
    ("open_file", "words"),
    [
        (crashing, "segmentation fault"),
        (spinning, "more than 1 s of the processor"),
        (sleeping, "gives nothing for 2 s"),
        (greedy, "more memory than a file of its size"),
        (leaving, "status 3"),
        (mistaken, "its content is damaged"),
    ],
)
def test_a_reader_that_breaks_is_one_line(open_file, words, file):
    limits = IMPATIENT if open_file is sleeping else QUICK
    with pytest.raises(RecordError, match=words) as refused:
        GuardedSource(file, reader(open_file), limits)
    assert str(refused.value).startswith(f"{file}: ")
    assert "\n" not in str(refused.value)
    assert "Test format" in str(refused.value)


def test_a_crash_among_the_samples_leaves_what_was_read_and_no_process(file):
    class Breaking(TableSource):
        def blocks(self, columns, rows=3):
            for k, block in enumerate(super().blocks(columns, 3)):
                if k == 2:
                    os.kill(os.getpid(), signal.SIGSEGV)
                yield block

    def open_file(path):
        return Breaking(path, "Test", [(Column("x"), np.arange(12.0))], sample_interval=0.5)

    source = GuardedSource(file, reader(open_file), QUICK)
    assert (source.format, source.sample_interval) == ("Test", 0.5)
    assert source.locate(4) == "sample 4"
    blocks = source.blocks([0])
    assert next(blocks)[:, 0].tolist() == [0.0, 1.0, 2.0]
    assert next(blocks)[:, 0].tolist() == [3.0, 4.0, 5.0]
    with pytest.raises(RecordError, match="segmentation fault"):
        next(blocks)
    with pytest.raises(RecordError, match="segmentation fault"):
        next(source.blocks([0]))


def write_hdf5(path: Path) -> None:
    with h5py.File(path, "w") as stored:
        stored.attrs["fs"] = 100.0
        stored["x"] = np.arange(1000.0)


def test_a_source_gives_the_same_from_a_copied_and_from_a_new_process(tmp_path, monkeypatch):
    write_hdf5(tmp_path / "a.h5")
    sources = []
    for count in (1, 2):
        monkeypatch.setattr(guard, "threads", lambda count=count: count)
        sources.append(open_source(tmp_path / "a.h5"))
    copied, started = sources
    commands = [Path(f"/proc/{source._child.pid}/cmdline").read_bytes() for source in sources]
    assert [b"serve_in_new_process" in command for command in commands] == [False, True]
    assert copied.columns == started.columns == (Column("x", None, 0.01),)
    for source in sources:
        first, second = source.blocks([0], 600), source.blocks([0], 600)
        assert next(first)[-1, 0] == 599.0  # two readings of one source do not mix
        assert [len(block) for block in second] == [600, 400]
        assert [len(block) for block in first] == [400]


@pytest.mark.long
def test_no_process_with_several_threads_is_forked(tmp_path):
    """Python 3.12 warns of it, and the copy may wait for ever on a lock."""
    write_hdf5(tmp_path / "a.h5")
    code = (
        "import os, sys, threading, warnings\n"
        "from pathlib import Path\n"
        "warnings.simplefilter('error')\n"
        "forked = []\n"
        "os.register_at_fork(before=lambda: forked.append(len(os.listdir('/proc/self/task'))))\n"
        "beside = threading.Thread(target=threading.Event().wait, daemon=True)\n"
        "beside.start()\n"
        "from vinesexp.records.readers import open_source\n"
        "files = [Path(name) for name in sys.argv[1:]]\n"
        "sources = [open_source(file) for file in files for _ in range(3)]\n"
        "assert [len(s.columns) for s in sources] == [1, 1, 1]\n"
        "assert forked == [], forked\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "a.h5")],
        capture_output=True, text=True, check=False, timeout=100,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.long
def test_no_library_brings_threads_into_the_process_that_is_forked():
    """A new process keeps to its limits, and a process of one thread can go on forking."""
    code = (
        "import os, sys\n"
        "from importlib import import_module\n"
        "for name in ['vinesexp.records.readers', *sys.argv[1:]]:\n"
        "    try: import_module(name)\n"
        "    except ImportError: pass\n"
        "    print(name, len(os.listdir('/proc/self/task')))\n"
    )
    guarded = [reader for reader in readers.READERS if reader not in readers.PLAIN]
    names = [name for reader in guarded for name in getattr(reader, "LIBRARIES", ())]
    done = subprocess.run(
        [sys.executable, "-c", code, *names],
        capture_output=True, text=True, check=True,
        env={**os.environ, **guard.ONE_THREAD},
    )  # fmt: skip
    threads = dict(line.split() for line in done.stdout.splitlines())
    assert threads == dict.fromkeys(["vinesexp.records.readers", *names], "1")


def test_a_new_process_that_dies_is_reported_as_a_copied_one(tmp_path, monkeypatch):
    monkeypatch.setattr(guard, "threads", lambda: 2)
    write_hdf5(tmp_path / "a.h5")
    source = open_source(tmp_path / "a.h5")
    os.kill(source._child.pid, signal.SIGSEGV)
    with pytest.raises(RecordError, match="segmentation fault"):
        next(source.blocks([0]))
    assert len(next(open_source(tmp_path / "a.h5").blocks([0]))) == 1000


def test_the_child_ends_with_its_source(tmp_path):
    write_hdf5(tmp_path / "a.h5")
    source = open_source(tmp_path / "a.h5")
    pid = source._child.pid
    os.kill(pid, 0)
    del source
    gc.collect()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_every_format_that_a_library_reads_is_guarded():
    names = {reader.__name__.rpartition(".")[2] for reader in readers.PLAIN}
    assert names == {"wav", "tektronix", "lecroy", "text"}


def test_a_dataset_larger_than_its_file_can_hold_is_refused(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as stored:
        stored.create_dataset("x", shape=(10**12,), chunks=(1024,), dtype="f8")
    with pytest.raises(RecordError, match="more than the file can hold"):
        open_source(tmp_path / "a.h5")


@pytest.mark.long
def test_windows_itself_is_told_to_use_wsl():
    code = (
        "import select, signal, subprocess, sys, threading\n"
        "from vinesexp.cli import main\n"
        "import ctypes, csv, io, json, pickle, tempfile, h5py, numpy, pandas, scipy.io\n"
        "import multiprocessing.connection\n"
        "sys.platform = 'win32'\n"
        "sys.exit(main(['look', 'a.csv']))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "install and run vinesexp inside WSL" in done.stderr
