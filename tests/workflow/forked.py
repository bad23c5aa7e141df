"""`snakemake` as a fork of a process that has loaded it: that takes longer than most small runs."""

from __future__ import annotations

import atexit
import multiprocessing
import os
import signal
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from pathlib import Path

_FORKS = multiprocessing.get_context("forkserver")
_FORKS.set_forkserver_preload(["snakemake.cli", __name__])


@dataclass(frozen=True)
class Run:
    """A run under way, in a group of processes of its own; what it prints is in two files."""

    process: BaseProcess
    arguments: tuple[str, ...]
    said: tuple[Path, Path]

    def ended(self, timeout: float = 1200.0) -> subprocess.CompletedProcess[str]:
        """Wait for it; the result carries `returncode`, `stdout` and `stderr`."""
        self.process.join(timeout)
        if self.process.exitcode is None:
            self.kill()
        code = self.process.exitcode
        assert code is not None
        return subprocess.CompletedProcess(
            self.arguments, code, *(file.read_text(encoding="utf-8") for file in self.said)
        )

    def kill(self) -> None:
        """End it and all that it has started."""
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid or 0, signal.SIGKILL)
        self.process.kill()  # before it has a group
        self.process.join()


def start(arguments: tuple[str, ...], folder: Path, *, name: str = "run") -> Run:
    """Start ``snakemake ARGUMENTS`` in a folder; `name` is of the files with what it prints."""
    said = folder / f".{name}.out", folder / f".{name}.err"
    process = _FORKS.Process(target=_snakemake, args=(arguments, said, dict(os.environ)))
    process.start()
    return Run(process, arguments, said)


def _snakemake(
    arguments: tuple[str, ...], said: tuple[Path, Path], environment: dict[str, str]
) -> None:
    os.setsid()
    os.chdir(said[0].parent)
    os.environ.clear()
    os.environ.update(environment)
    for file, stream in zip(said, (1, 2), strict=True):
        os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), stream)
    sys.argv = ["snakemake", *arguments]
    from snakemake.cli import main

    try:
        main(list(arguments))
    finally:
        atexit._run_exitfuncs()  # multiprocessing does not
