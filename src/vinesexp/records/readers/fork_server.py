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
"""

from __future__ import annotations

import atexit
import os
import pickle
import select
import signal
import socket
import struct
import subprocess
import sys
import threading
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

from vinesexp.records.readers.guarded_child import serve
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


def fork_for(
    module: str, path: Path, limits: tuple[int, float, int], requests: int, answers: int
) -> tuple[socket.socket, int]:
    """Have a file served by a new process.

    Parameters
    ----------
    module : str
        The reader's.
    path, limits, requests, answers
        As of `guarded_child.serve`.

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
