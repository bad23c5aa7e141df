"""A reader in a process of its own, so that no file can take the program down with it.

Bytes that were damaged or made up can crash the library that reads a format, hold it for ever or
have it ask for all memory there is. The child has limits of processor time and memory in proportion
to the size of the file; when it dies, the file is refused in one line. It opens the file once and
gives blocks for as long as the source is used. It is a copy (fork) of this process where that has
a single thread, else of one that is kept for it (`fork_server.py`): both take a few milliseconds.
On macOS, where libraries may not survive a fork, a new process is started.
"""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import sys
import weakref
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import astuple, dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from vinesexp.arrays import FloatArray
from vinesexp.errors import RecordError, VinesexpError
from vinesexp.records.readers.fork_server import ended, fork_for, receive, send, serve, widen
from vinesexp.records.readers.parts import file_of
from vinesexp.records.readers.source import BLOCK_ROWS, Column

if sys.platform == "win32":
    raise VinesexpError(
        "records are read in a process whose memory and time are limited, in a way that Windows "
        "does not have: install and run vinesexp inside WSL "
        "(https://learn.microsoft.com/windows/wsl/install)"
    )

_DEATHS = {
    signal.SIGSEGV: "breaks the library that reads it (segmentation fault)",
    signal.SIGABRT: "breaks the library that reads it (abort)",
    signal.SIGBUS: "breaks the library that reads it (bus error)",
    signal.SIGFPE: "breaks the library that reads it (arithmetic error)",
    signal.SIGILL: "breaks the library that reads it (illegal instruction)",
    signal.SIGKILL: "the process that read it was killed (out of memory?)",
}


class Reader(Protocol):
    """A module among the readers."""

    __name__: str
    NAME: str

    def open_file(self, path: Path) -> Any:
        """Open the file as a source."""


@dataclass(frozen=True)
class Limits:
    """What the reading of one file may take, all passes over it together.

    Parameters
    ----------
    seconds : float
        Of the processor.
    patience : float
        Seconds that an answer may take on a clock: a disk or a network may stall.
    memory : int
        Bytes beyond what this process holds.

    Examples
    --------
    >>> limits_for(0).seconds, limits_for(50_000_000).seconds
    (8, 508)
    """

    seconds: int
    patience: float
    memory: int


def limits_for(size: int) -> Limits:
    """The limits for a file of `size` bytes.

    The slowest format, a packed sheet of a workbook, takes 3 s a MB.
    """
    seconds = 8 + size // 100_000
    return Limits(seconds, 60.0 + 2.0 * seconds, (1 << 30) + 64 * size)


class GuardedSource:
    """A source that is read by a child process. The interface is `readers.source.Source`.

    Parameters
    ----------
    path : Path
        The file.
    reader : module
        Opens it.
    limits : Limits, optional
        Default: by the size of the file.

    Raises
    ------
    RecordError
        What the reader reports; or that it crashed, took too long, or failed otherwise.
    """

    def __init__(self, path: Path, reader: Reader, limits: Limits | None = None) -> None:
        self.path = path
        self._name = reader.NAME
        found = limits or limits_for(file_of(path).stat().st_size)
        self._limits = replace(found, memory=found.memory + getattr(reader, "RESERVED", 0))
        self._child = _start(reader, path, self._limits)
        self._end = weakref.finalize(self, _finish, self._child, os.getpid())
        self._dead: RecordError | None = None
        self._streams = 0
        facts = self._ask(("open",))
        self.format: str = facts["format"]
        self.columns = tuple(Column(*column) for column in facts["columns"])
        self.sample_interval: float | None = facts["sample_interval"]
        self.start: float = facts["start"]
        self.time_column: int | None = facts["time_column"]
        self.stated_rows: int | None = facts["stated_rows"]
        self.parts: tuple[str, ...] = facts["parts"]
        self.losses: tuple[str, ...] = facts["losses"]

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[FloatArray]:
        """Blocks of the given columns; see `Source.blocks`."""
        self._streams += 1
        stream = self._streams
        self._ask(("blocks", stream, [int(column) for column in columns], rows))
        try:
            while (block := self._ask(("next", stream))) is not None:
                yield block
        finally:
            with suppress(RecordError):
                self._ask(("close", stream))

    def locate(self, row: int) -> str:
        """Where a row stands, in the words of the format."""
        return str(self._ask(("locate", int(row))))

    def _ask(self, request: tuple[Any, ...]) -> Any:
        if self._dead is not None:
            raise self._dead
        try:
            send(self._child.requests, request)
            ready, _, _ = select.select([self._child.answers], [], [], self._limits.patience)
            if not ready:
                raise self._died(f"gives nothing for {self._limits.patience:.0f} s")
            kind, value = receive(self._child.answers)
        except (OSError, EOFError):
            raise self._died(None) from None
        if kind == "refused":
            problem, where = value
            raise RecordError(problem, file=self.path, where=where)
        return value

    def _died(self, reported: str | None) -> RecordError:
        status = self._child.wait(kill=reported is not None)
        self._end()
        if reported is None and status == -signal.SIGXCPU:
            reported = f"takes more than {self._limits.seconds} s of the processor to read"
        if reported is None:
            reported = _DEATHS.get(
                signal.Signals(-status) if status < 0 else signal.SIGHUP,
                f"ends the process that reads it (status {status})",
            )
        self._dead = RecordError(
            f"{reported} as {self._name}; it is damaged, most likely: copy or export it again",
            file=self.path,
        )
        return self._dead


@dataclass
class _Child:
    """A process that serves one source, and the ends of its pipes.

    `life` is the socket of one that the fork server made, `process` one that was started.
    """

    pid: int
    requests: int
    answers: int
    life: socket.socket | None = None
    process: subprocess.Popen[bytes] | None = None
    status: int | None = None

    def wait(self, *, kill: bool) -> int:
        """Exit status; negative: the signal that ended it."""
        if self.status is None:
            if self.life is not None:
                if kill:
                    self.life.shutdown(socket.SHUT_WR)
                self.status = ended(self.life)
                self.life.close()
                return self.status
            if kill:
                with suppress(ProcessLookupError):
                    os.kill(self.pid, signal.SIGKILL)
            if self.process is not None:
                self.status = self.process.wait()
            else:
                self.status = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        return self.status


def threads() -> int:
    """How many threads this process has: those of libraries count, and Python sees only its own."""
    return len(os.listdir("/proc/self/task"))


def _start(reader: Reader, path: Path, limits: Limits) -> _Child:
    requests, to_child = os.pipe()
    from_child, answers = os.pipe()
    widen(answers)
    try:
        if sys.platform != "linux":
            process = _new_process(reader, path, limits, requests, answers)
            return _Child(process.pid, to_child, from_child, process=process)
        if threads() == 1:
            for library in getattr(reader, "LIBRARIES", ()):
                with suppress(ImportError):  # the reader says what to type
                    import_module(library)  # once for all files, not in every child
        if threads() > 1:  # of this process, or brought by a library
            life, pid = fork_for(reader.__name__, path, astuple(limits), requests, answers)
            return _Child(pid, to_child, from_child, life)
        pid = os.fork()
        if pid == 0:  # pragma: no cover
            os.close(to_child)
            os.close(from_child)
            serve(reader, path, astuple(limits), requests, answers)
        return _Child(pid, to_child, from_child)
    finally:
        os.close(requests)
        os.close(answers)


def _new_process(
    reader: Reader, path: Path, limits: Limits, requests: int, answers: int
) -> subprocess.Popen[bytes]:
    code = "from vinesexp.records.readers.fork_server import serve_in_new_process as main; main()"
    return subprocess.Popen(
        [
            *(sys.executable, "-c", code, reader.__name__, os.fspath(path)),
            *map(str, (*astuple(limits), requests, answers)),
        ],
        pass_fds=(requests, answers),
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )


def _finish(child: _Child, owner: int) -> None:
    """End the child when its source is no longer used; not in a copy of the owner."""
    if os.getpid() == owner:
        os.close(child.requests)
        os.close(child.answers)
        child.wait(kill=True)
