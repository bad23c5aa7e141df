"""A reader in a process of its own, so that no file can take the program down with it.

Bytes that were damaged or made up can crash the library that reads a format, hold it for ever or
have it ask for all memory there is. The child has limits of processor time and memory in proportion
to the size of the file; when it dies, the file is refused in one line. It opens the file once and
gives blocks for as long as the source is used. Its refusals need no file: who asked names it.

It is a copy (fork) of this process where that has a single thread: the copy of one that has several
may wait for ever on a lock that one of them held. Else, and on macOS, where libraries may not
survive a fork, it is a new process, which takes an eighth of a second more.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import subprocess
import sys
import weakref
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from importlib import import_module
from itertools import count
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NoReturn

from vinesexp.arrays import FloatArray
from vinesexp.environment import THREAD_VARIABLES
from vinesexp.errors import RecordError, VinesexpError
from vinesexp.records.readers.source import BLOCK_ROWS, Source, file_of
from vinesexp.records.readers.unread import unreadable

if sys.platform == "win32":
    raise VinesexpError(
        "records are read in a process whose memory and time are limited, in a way that Windows "
        "does not have: install and run vinesexp inside WSL "
        "(https://learn.microsoft.com/windows/wsl/install)"
    )

#: Libraries start threads of their own unless they are told not to.
ONE_THREAD = {
    **dict.fromkeys(THREAD_VARIABLES, "1"),
    "NUMEXPR_MAX_THREADS": "1",
    "JE_ARROW_MALLOC_CONF": "background_thread:false",
    "ARROW_IO_THREADS": "1",
}


def serve_reader(reader: Any, path: Path, limits: Limits, line: Connection) -> NoReturn:
    """Answer requests until nobody asks any more, then end this process.

    Whatever goes wrong in the reader is answered as a refusal with its reason; what cannot be
    answered ends the process, and who asked sees the line close.
    """
    try:
        faulthandler.disable()  # a crash is reported by who asked
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is told, and ends this one
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        _limit(limits.seconds, limits.memory)
        source: Any = None
        streams: dict[int, Iterator[Any]] = {}
        while True:
            what, *given = line.recv()
            try:
                if what == "open":
                    source = reader.open_file(path)
                    names = [one.name for one in fields(Source) if one.name != "path"]
                    value: Any = {name: getattr(source, name) for name in names}
                elif what == "next":
                    stream, columns, rows = given
                    if stream not in streams:
                        streams[stream] = iter(source.blocks(columns, rows))
                    value = next(streams[stream], None)
                else:
                    value = source.locate(given[0])
                line.send(("ok", value))
            except Exception as error:  # whatever the broken bytes lead to
                line.send(("refused", refusal(error, reader.NAME)))
    except BaseException:
        os._exit(0)  # nobody asks any more, or nobody can be answered


def refusal(error: Exception, name: str) -> tuple[str, str | None]:
    """Problem and place of what went wrong in a reader, as a `RecordError` states them."""
    told = error if isinstance(error, RecordError) else unreadable(name, error)
    return told.problem, told.where


def _limit(seconds: int, memory: int) -> None:
    """Let the system end this process when it takes too much."""
    import resource

    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))
    with suppress(ValueError, OSError, StopIteration):
        status = Path("/proc/self/status").read_text(encoding="ascii")
        held = next(line.split()[1] for line in status.splitlines() if "VmData" in line)
        most = int(held) * 1024 + memory
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def serve_in_new_process() -> None:
    """Serve a source in a process that was started, not copied; the first message says which."""
    line = Connection(int(sys.argv[1]))
    module, path, limits = line.recv()
    serve_reader(import_module(module), path, limits, line)


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


class GuardedSource(Source):
    """A source that is read by a child process.

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

    def __init__(self, path: Path, reader: Any, limits: Limits | None = None) -> None:
        self.path = path
        self._name = reader.NAME
        found = limits or limits_for(file_of(path).stat().st_size)
        self._limits = replace(found, memory=found.memory + getattr(reader, "RESERVED", 0))
        self._child = _start(reader, path, self._limits)
        self._end = weakref.finalize(self, _finish, self._child, os.getpid())
        self._dead: RecordError | None = None
        self._streams = count()
        vars(self).update(self._ask(("open",)))

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[FloatArray]:
        """Blocks of the given columns; see `Source.blocks`."""
        request = ("next", next(self._streams), [int(column) for column in columns], rows)
        while (block := self._ask(request)) is not None:
            yield block

    def locate(self, row: int) -> str:
        """Where a row stands, in the words of the format."""
        return str(self._ask(("locate", int(row))))

    def _ask(self, request: tuple[Any, ...]) -> Any:
        if self._dead is not None:
            raise self._dead
        try:
            self._child.line.send(request)
            if not self._child.line.poll(self._limits.patience):
                raise self._died(f"gives nothing for {self._limits.patience:.0f} s")
            kind, value = self._child.line.recv()
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
        if reported is None and status == -signal.SIGKILL:
            reported = "the process that read it was killed (out of memory?)"
        if reported is None and status < 0:
            death = str(signal.strsignal(-status)).lower()
            reported = f"breaks the library that reads it ({death})"
        reported = reported or f"ends the process that reads it (status {status})"
        self._dead = RecordError(
            f"{reported} as {self._name}; it is probably damaged: copy or export it again",
            file=self.path,
        )
        return self._dead


@dataclass
class _Child:
    """A process that serves one source, the socket to it, and what waits for its end."""

    pid: int
    line: Connection
    end: Callable[[], int]
    status: int | None = None

    def wait(self, *, kill: bool) -> int:
        """Exit status; negative: the signal that ended it."""
        if self.status is None:
            if kill:  # not yet waited for: the number is still its own
                with suppress(ProcessLookupError):
                    os.kill(self.pid, signal.SIGKILL)
            self.status = self.end()
        return self.status


def threads() -> int:
    """How many threads this process has: those of libraries count, and Python sees only its own."""
    return len(os.listdir("/proc/self/task"))


def _start(reader: Any, path: Path, limits: Limits) -> _Child:
    ours, theirs = Pipe()
    with theirs:
        if _may_fork(reader):
            pid = os.fork()
            if pid == 0:  # pragma: no cover
                ours.close()
                serve_reader(reader, path, limits, theirs)
            return _Child(pid, ours, lambda: os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
        code = "from vinesexp.records.readers.guard import serve_in_new_process as main; main()"
        process = subprocess.Popen(
            [sys.executable, "-c", code, str(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            env=os.environ | ONE_THREAD | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
    ours.send((reader.__name__, path.absolute(), limits))
    return _Child(process.pid, ours, process.wait)


def _may_fork(reader: Any) -> bool:
    if sys.platform != "linux" or threads() > 1:
        return False
    for library in getattr(reader, "LIBRARIES", ()):
        with suppress(ImportError):  # the reader says what to type
            import_module(library)  # once for all files, not in every child
    return threads() == 1  # a library may bring some


def _finish(child: _Child, owner: int) -> None:
    """End the child when its source is no longer used; not in a copy of the owner."""
    if os.getpid() == owner:
        child.line.close()
        child.wait(kill=True)
