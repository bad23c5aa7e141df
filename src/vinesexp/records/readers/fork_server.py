"""A process of a single thread that makes the processes in which files are read.

Copying a process (fork) takes a few milliseconds, and a new Python a fifth of a second; but a copy
of a process that has several threads may wait for ever on a lock that one of them held. Most
processes have several: the matrix library of numpy alone starts some. So a process of one thread
is started once, loads the library of a format when the first file of it comes, and copies itself
for every file. It serves the process that started it and the forks of that one, and ends with the
last of them. (`multiprocessing` has such a server, whose children run the caller's main program
again.)

For every file the caller keeps one end of a socket: the server writes the number of the process to
it, and how it ended; when the caller closes its end, the process is ended.

The side of a guarded reader that may crash: a process that serves one source by pipe.

A message is two lengths, a pickle, and the samples of a block if there are any. Whatever goes wrong
in the reader is answered as a refusal with its reason; what cannot be answered ends the process,
and who asked sees the pipe close.
"""

from __future__ import annotations

import atexit
import faulthandler
import os
import pickle
import select
import signal
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from vinesexp.errors import RecordError
from vinesexp.records.readers.extras import in_words
from vinesexp.threads import VARIABLES

_NUMBER = struct.Struct("<i")


_LONGEST = 1 << 16  # bytes of a request


#: Libraries start threads of their own unless they are told not to.
ONE_THREAD = {
    **dict.fromkeys(VARIABLES, "1"),
    "NUMEXPR_MAX_THREADS": "1",
    "JE_ARROW_MALLOC_CONF": "background_thread:false",
    "ARROW_IO_THREADS": "1",
}


_lock = threading.Lock()


_server: socket.socket | None = None


_HEAD = struct.Struct("<QQ")  # bytes of the pickle, and of the samples beside it


_PIPE = 1 << 20  # bytes that a pipe holds: fewer changes between the two processes


def fork_for(
    module: str, path: Path, limits: tuple[int, float, int], requests: int, answers: int
) -> tuple[socket.socket, int]:
    """Have a file served by a new process.

    Parameters
    ----------
    module : str
        The reader's.
    path, limits, requests, answers
        As of `serve`.

    Returns
    -------
    life : socket
        Closing it ends the process; `ended` reads from it how it ended.
    pid : int

    Raises
    ------
    OSError
        The server is not to be had.
    """
    ours, theirs = socket.socketpair()
    try:
        request = pickle.dumps((module, os.path.abspath(path), limits))
        ends = [requests, answers, theirs.fileno()]
        try:
            socket.send_fds(_running(), [request], ends)
        except OSError:  # it ended, by the hand of somebody
            _forget()
            socket.send_fds(_running(), [request], ends)
        theirs.close()
        number = ours.recv(_NUMBER.size)
        if len(number) < _NUMBER.size:
            raise OSError("no process to read in can be made")
    except BaseException:
        ours.close()
        raise
    finally:
        theirs.close()
    return ours, int(_NUMBER.unpack(number)[0])


def ended(life: socket.socket) -> int:
    """Wait for a process; its exit status, negative: the signal that ended it."""
    with suppress(OSError):
        status = life.recv(_NUMBER.size)
        if len(status) == _NUMBER.size:
            return int(_NUMBER.unpack(status)[0])
    return -signal.SIGKILL


def start_server() -> None:
    """Start the server beforehand, so that the forks of this process share one."""
    _running()


def _running() -> socket.socket:
    global _server
    with _lock:
        if _server is None:
            _server, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            with theirs:
                code = "from vinesexp.records.readers.fork_server import main; main()"
                process = subprocess.Popen(
                    [sys.executable, "-c", code, str(theirs.fileno())],
                    pass_fds=[theirs.fileno()],
                    stdin=subprocess.DEVNULL,
                    env={
                        **os.environ,
                        **ONE_THREAD,
                        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
                    },
                )
            atexit.register(_end, process, _server, os.getpid())
        return _server


def _forget() -> None:
    global _server
    with _lock:
        _server = None


def _end(process: subprocess.Popen[bytes], server: socket.socket, owner: int) -> None:
    """Let the server go with this process, unless forks of it go on."""
    server.close()
    if os.getpid() == owner:
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=0.5)
        process.returncode = process.returncode or 0  # no word about one that outlives this process


@dataclass
class _Server:
    """What the server's loop knows: who asks, and the processes that are alive."""

    asking: socket.socket
    wake: int
    alive: dict[int, socket.socket] = field(default_factory=dict)
    ending: set[int] = field(default_factory=set)

    def serve(self) -> None:
        """Until nobody is left who could ask."""
        asked = True
        while asked or self.alive:
            lives = [life for pid, life in self.alive.items() if pid not in self.ending]
            watched: list[int | socket.socket] = [
                self.wake,
                *lives,
                *([self.asking] if asked else []),
            ]
            ready = select.select(watched, [], [])[0]
            if self.wake in ready:
                os.read(self.wake, 4096)
                self._bury()
            for pid, life in self.alive.items():
                if life in ready and pid not in self.ending:
                    self.ending.add(pid)
                    os.kill(pid, signal.SIGKILL)  # not yet waited for: the number is still its own
            if self.asking in ready:
                asked = self._fork()

    def _bury(self) -> None:
        with suppress(ChildProcessError):
            while (found := os.waitpid(-1, os.WNOHANG))[0]:
                life = self.alive.pop(found[0])
                self.ending.discard(found[0])
                with suppress(OSError):
                    life.send(_NUMBER.pack(os.waitstatus_to_exitcode(found[1])))
                life.close()

    def _fork(self) -> bool:
        request, ends, _, _ = socket.recv_fds(self.asking, _LONGEST, 3)
        if not request:
            return False
        name, path, limits = pickle.loads(request)
        reader = import_module(name)
        for library in getattr(reader, "LIBRARIES", ()):
            with suppress(ImportError):  # the reader says what to type
                import_module(library)
        requests, answers, life = ends
        pid = os.fork()
        if pid == 0:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            for one in (self.asking, *self.alive.values()):
                one.close()
            os.close(life)
            serve(reader, Path(path), limits, requests, answers)
        os.close(requests)
        os.close(answers)
        self.alive[pid] = socket.socket(fileno=life)
        with suppress(OSError):
            self.alive[pid].send(_NUMBER.pack(pid))
        return True


def main() -> None:
    """The server's process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who asks is told, and ends this one
    wake, rung = os.pipe()
    os.set_blocking(rung, False)
    signal.set_wakeup_fd(rung, warn_on_full_buffer=False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    _Server(socket.socket(fileno=int(sys.argv[1])), wake).serve()


def send(pipe: int, message: Any) -> None:
    """Write one message; samples go beside the pickle, not through it."""
    samples: list[pickle.PickleBuffer] = []
    packed = pickle.dumps(message, protocol=5, buffer_callback=samples.append)
    raw = [one.raw() for one in samples]
    _write(pipe, _HEAD.pack(len(packed), raw[0].nbytes if raw else 0))
    _write(pipe, packed)
    for one in raw[:1]:
        _write(pipe, one)


def receive(pipe: int) -> Any:
    """Read one message; EOFError where the other side is gone."""
    packed, samples = _HEAD.unpack(_read(pipe, _HEAD.size))
    words = _read(pipe, packed)
    return pickle.loads(words, buffers=[_read(pipe, samples)] if samples else ())


def widen(pipe: int) -> None:
    """Let a pipe hold more, where the system allows it."""
    import fcntl

    with suppress(AttributeError, OSError):
        fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, _PIPE)


def _write(pipe: int, data: bytes | memoryview) -> None:
    rest = memoryview(data)
    while rest:
        rest = rest[os.write(pipe, rest) :]


def _read(pipe: int, count: int) -> bytearray:
    found = bytearray(count)
    rest = memoryview(found)
    while rest:
        got = os.readv(pipe, [rest])
        if not got:
            raise EOFError
        rest = rest[got:]
    return found


def serve(
    reader: Any, path: Path, limits: tuple[int, float, int], requests: int, answers: int
) -> NoReturn:
    """Answer requests until nobody asks any more, then end this process."""
    try:
        faulthandler.disable()  # a crash is reported by who asked
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is told, and ends this one
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        _limit(limits[0], limits[2])
        source: Any = None
        streams: dict[int, Iterator[Any]] = {}
        while True:
            what, *given = receive(requests)
            try:
                if what == "open":
                    source = reader.open_file(path)
                    value: Any = _facts(source)
                elif what == "blocks":
                    stream, columns, rows = given
                    streams[stream] = iter(source.blocks(columns, rows))
                    value = None
                elif what == "next":
                    value = next(streams[given[0]], None)
                elif what == "close":
                    value = streams.pop(given[0], None) and None
                else:
                    value = source.locate(given[0])
                send(answers, ("ok", value))
            except Exception as error:  # whatever the broken bytes lead to
                send(answers, ("refused", refusal(error, reader.NAME)))
    except BaseException:
        os._exit(0)  # nobody asks any more, or nobody can be answered


def refusal(error: Exception, name: str) -> tuple[str, str | None]:
    """Problem and place of what went wrong in a reader, as a `RecordError` states them."""
    if isinstance(error, RecordError):
        return error.problem, error.where
    problem = f"cannot be read as {name} ({in_words(error)}); copy or export the record again"
    return problem, None


def _facts(source: Any) -> dict[str, Any]:
    names = ("format", "sample_interval", "start", "time_column", "stated_rows", "parts", "losses")
    columns = [(c.name, c.unit, c.interval, c.start) for c in source.columns]
    return {**{name: getattr(source, name) for name in names}, "columns": columns}


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
    """Serve a source in a process that was started, not copied."""
    from importlib import import_module

    module, path, seconds, patience, memory, requests, answers = sys.argv[1:]
    serve(
        import_module(module),
        Path(path),
        (int(seconds), float(patience), int(memory)),
        int(requests),
        int(answers),
    )
