"""A process with everything loaded that forks for each step on a record.

A new Python with the package takes longer to start than most steps to do their work. While a local
run lives, its steps come from here: `vinesexp.step_client`, which a rule starts, hands over its
job and its output, a fork of this process does the step, and the client ends with its code. No
step depends on it: without the server, or once it has ended, the client becomes the step itself.

A step ends when its client ends, as it would as a process of its own. When the run ends, however it
ends, the server does; steps under way go on, as other jobs of a killed run do.
"""

from __future__ import annotations

import atexit
import importlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import traceback
from contextlib import suppress
from pathlib import Path
from select import select
from typing import NoReturn

from vinesexp.records.readers.fork_server import ONE_THREAD
from vinesexp.records.readers.fork_server import start_server as start_readers
from vinesexp.step_client import SOCKET

#: Modules whose imports, with all that they import in functions, the steps on a record need.
_ROOTS = (
    "vinesexp.record_job",
    "vinesexp.records.campaign",
    "vinesexp.records.freshness",
    "vinesexp.records.ingest",
    "vinesexp.signals.condition",
    "vinesexp.signals.impacts.find",
    "vinesexp.signals.tables_of_record",
    "vinesexp.identification.decay_table",
    "vinesexp.identification.one_record",
)
_LIBRARIES = ("h5py", "pandas", "yaml")


def start_server() -> None:
    """Start a server that lives as long as this process, and tell the processes started from here.

    Nothing happens where it runs already, where it finds no place for its socket, or where the
    system is not Linux: elsewhere libraries may not survive a fork.
    """
    if not sys.platform.startswith("linux") or SOCKET in os.environ:
        return
    with socket.socket(socket.AF_UNIX) as listening:
        place = _bound(listening)
        if place is None:
            return
        listening.listen(64)
        server = subprocess.Popen(
            [sys.executable, "-m", "vinesexp.step_server", str(listening.fileno())],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            pass_fds=[listening.fileno()],
            env={**os.environ, **ONE_THREAD},  # a process with threads is not safe to fork
        )
    os.environ[SOCKET] = str(place)
    atexit.register(_end, server, place.parent)


def _bound(listening: socket.socket) -> Path | None:
    """Place of the socket, in a folder that nobody else may enter; None where there is none."""
    try:
        folder = Path(tempfile.mkdtemp(prefix="vinesexp-"))
    except OSError:  # no room for files that pass
        return None
    try:
        listening.bind(str(folder / "steps"))
    except OSError:  # a name longer than a socket's may be
        folder.rmdir()
        return None
    return folder / "steps"


def _end(server: subprocess.Popen[bytes], folder: Path) -> None:
    os.environ.pop(SOCKET, None)
    if server.stdin is not None:
        server.stdin.close()
    server.wait()
    shutil.rmtree(folder, ignore_errors=True)


def serve(listening: socket.socket) -> None:
    """Fork for every job that comes, until standard input ends with the run."""
    start_readers()  # one for all forks
    _load()
    while True:
        ready, _, _ = select([listening, sys.stdin], [], [])
        _clear_ended()
        if sys.stdin in ready:
            return
        client, _ = listening.accept()
        if os.fork() == 0:
            listening.close()
            _do(client)
        client.close()


def _clear_ended() -> None:
    """Take note of steps that have ended: their processor time counts as this process's."""
    with suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def _load() -> None:
    from vinesexp.codedigest import imported_modules

    files = [Path(name) for name in imported_modules(*_ROOTS) if name.endswith(".py")]
    own = (".".join(file.with_suffix("").parts).removesuffix(".__init__") for file in files)
    for name in (*_LIBRARIES, *(f"vinesexp.{module}" for module in own if module != "__init__")):
        importlib.import_module(name)


def _do(client: socket.socket) -> NoReturn:
    """The step of one client, in a fork; it ends here."""
    code = 1
    try:
        folder, job = _received(client)
        os.chdir(folder)
        client.sendall(b"\1")
        threading.Thread(target=_end_with, args=(client,), daemon=True).start()
        code = _code_of(job)
    finally:
        with suppress(OSError):  # nobody waits for it any more
            client.sendall(bytes([code]))
        os._exit(code)


def _received(client: socket.socket) -> tuple[str, str]:
    """Folder and text of a job; its output and errors become those of this process."""
    head, streams, _, _ = socket.recv_fds(client, 8, 2)
    for theirs, own in zip(streams, (1, 2), strict=True):
        os.dup2(theirs, own)
        os.close(theirs)
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    with client.makefile("rb") as sent:
        text = sent.read(int.from_bytes(head, "big"))
    folder, _, job = text.decode(errors="surrogateescape").partition("\0")
    return folder, job


def _code_of(job: str) -> int:
    from vinesexp.record_job import run_text

    code = 0
    try:
        run_text(job)
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else 1
    except BaseException:
        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.stderr.flush()
    return code


def _end_with(client: socket.socket) -> None:
    """Wait until the client is gone before its step has ended, and end the step too."""
    if not client.recv(1):
        os.kill(os.getpid(), signal.SIGKILL)


if __name__ == "__main__":
    serve(socket.socket(fileno=int(sys.argv[1])))
