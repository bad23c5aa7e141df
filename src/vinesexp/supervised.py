"""Work in forks of a process that has loaded the libraries: each is watched, and ends alone.

A fork that dies, because the system is short of memory or a library crashed, takes nothing along:
who asked for it is told which record it was at and what ended it, and asks for another.
"""

from __future__ import annotations

import atexit
import gc
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from vinesexp.environment import one_thread_each
from vinesexp.errors import VinesexpError

#: What is to be done, as JSON: its ``step``, its ``log``, and whatever else the work needs.
Asked = Mapping[str, Any]

#: How the process of a record ended, each time that it died.
Deaths = Mapping[str, Sequence[str]]

#: Objects that are made between two searches for garbage. Figures are made of many that all stay
#: to the end of a figure: with the default of 700 the searches took a quarter of their time.
_MADE = 100_000


class Forks:
    """A process that imports what work needs, and forks for it: libraries are loaded once a run.

    Parameters
    ----------
    module : str
        Its ``load(asked)`` is called before a fork, its ``do(asked, died, begin)`` in it: exit code
        of the work. ``begin(record=id)`` says which record it is at.
    """

    def __init__(self, module: str = "vinesexp.steps") -> None:
        self.module = module
        self._server: socket.socket | None = None
        self._alone = threading.Lock()

    def run(self, asked: Asked) -> int:
        """Exit code of the work.

        A record at which its fork dies is tried once more, since the system may have been at fault.
        After that the work is told to refuse it.
        """
        died: dict[str, list[str]] = {}
        while True:
            told = self._answer({"asked": asked, "died": died})
            if "took" in told:
                _append(Path(asked["log"]), f"process: {told['took']}")
            if "code" in told or "ended" not in told:
                return int(told.get("code", 1))
            of_this = died.setdefault(told.get("record", ""), [])
            of_this.append(_death(told["ended"]))
            if "record" not in told or len(of_this) > 2:
                at = f" while {told['record']} was refused" if "record" in told else ""
                _say(f"vinesexp: {asked['step']}: {of_this[-1]}{at} (log: {asked['log']})")
                return 1

    def _answer(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """All that was told of a request: ``record``, ``code``, how the fork ``ended``."""
        ours, theirs = socket.socketpair()
        with ours, ours.makefile(encoding="utf-8") as lines:
            with self._alone, theirs:
                try:
                    self._ask(request, theirs)
                except OSError:  # somebody has ended the process
                    self.end()
                    self._ask(request, theirs)
                theirs.close()  # where nobody holds it any more, the lines end
                told: dict[str, Any] = json.loads(lines.readline() or "{}")  # requests come singly
            for line in lines:
                told |= json.loads(line)
                if "ended" in told:
                    break
        return told

    def _ask(self, request: Mapping[str, Any], tell: socket.socket) -> None:
        """Send a request; the process starts with the first, and ends when this one does."""
        if self._server is None:
            self._server, theirs = socket.socketpair()
            with theirs:
                fd = theirs.fileno()
                command = [sys.executable, "-m", __name__, str(fd), self.module]
                self._process = subprocess.Popen(command, pass_fds=[fd])
            atexit.register(self.end)
        socket.send_fds(self._server, [json.dumps(request).encode()], [tell.fileno()])

    def end(self) -> None:
        """Wait for the process, which ends when nobody can ask any more."""
        if self._server is not None:
            self._server.close()
            self._process.wait()
            self._server = None


def _serve(client: socket.socket, module: Any) -> None:
    """Load what each request needs and fork for it, until nobody can ask any more."""
    one_thread_each()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the forks end without a word from here
    gc.set_threshold(_MADE)
    while True:
        text, fds, *_ = socket.recv_fds(client, 1 << 20, 1)
        if not text:
            return
        request = json.loads(text)
        with socket.socket(fileno=fds[0]) as answer:
            module.load(request["asked"])
            gc.freeze()  # what is loaded stays, and forks share its memory
            with suppress(OSError):  # the run was killed
                _tell(answer)  # the request is read, another may come
            if not os.fork():
                client.close()
                os._exit(_watch(module, request, answer))


def _watch(module: Any, request: Mapping[str, Any], answer: socket.socket) -> int:
    """Fork once more for the work, and say how that ended."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    if not (pid := os.fork()):
        os._exit(_work(module, request, answer))  # what is loaded need not be cleared away
    _, status, used = os.wait4(pid, 0)
    with suppress(OSError):  # the run was killed
        _tell(answer, ended=os.waitstatus_to_exitcode(status), took=_in_words(used))
    return 0


def _work(module: Any, request: Mapping[str, Any], answer: socket.socket) -> int:
    """Exit code of the work, in the fork; it is told too, so that a death can be told from it."""
    signal.signal(signal.SIGINT, _interrupted)
    try:
        code = int(module.do(request["asked"], request["died"], partial(_tell, answer)))
        atexit._run_exitfuncs()
    except KeyboardInterrupt:
        code = 130
    except BaseException as error:
        code = 1
        if not isinstance(error, BrokenPipeError):  # nobody listens any more
            traceback.print_exc()
    with suppress(OSError):
        _tell(answer, code=code)
    return code


def _tell(answer: socket.socket, **what: object) -> None:
    answer.sendall(json.dumps(what).encode() + b"\n")


def _interrupted(*_: object) -> None:
    """End, once: whatever is being cleared away must not be interrupted again."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    raise KeyboardInterrupt


def _in_words(used: Any) -> str:
    """Processor time and memory of a process."""
    peak = used.ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)
    return f"{used.ru_utime + used.ru_stime:.2f} s of processor time, peak memory {peak:.0f} MiB"


def _death(code: int) -> str:
    """How a process ended without a word of its own."""
    if code == -signal.SIGKILL:
        return "its process was killed, as systems do when memory is short"
    if code < 0:
        return f"its process crashed ({signal.Signals(-code).name})"
    return f"its process ended with {code}"


def on_each(
    step: str,
    ids: Sequence[str],
    *,
    work: Callable[[str], Any],
    refuse: Callable[[str, str], None],
    died: Deaths,
    begin: Callable[..., None],
    log_of: Callable[[str], Path],
) -> bool:
    """Do a step on one record after the other, a line of progress each; whether all were done.

    Parameters
    ----------
    step : str
    ids : sequence of str
        The records.
    work : callable
        The step on a record.
    refuse : callable
        Leaves what says that a record cannot be used; takes the record and the reason.
    died : mapping
        Records at which the process died: those at which it did so twice are refused.
    begin : callable
        Is told the ``record`` that comes now.
    log_of : callable
        Log of a record.
    """
    failed, began = [], time.monotonic()
    for count, id in enumerate(ids, 1):
        begin(record=id)
        ends = died.get(id, ())
        if refused := len(ends) > 1:
            reason = f"{step}: {ends[-1]} twice while this record was read"
            line = logged(partial(refuse, id, reason), log_of(id))
        else:
            line = logged(partial(work, id), log_of(id))
        failed += [line] if line else []
        left = (time.monotonic() - began) / count * (len(ids) - count)
        how = " failed" if line else f" refused: {ends[-1]}" if refused else ""
        rest = f", {left:.0f} s left" if left >= 1.0 else ""
        _say(f"  {step:10} {count:{len(str(len(ids)))}}/{len(ids)} {id}{how}{rest}")
        if line and _OF_THE_MACHINE in line:
            break
    for line in failed:
        _say(f"vinesexp: {line}")
    return not failed


def on_all(work: Callable[[], Any], *, log: Path) -> bool:
    """Do a piece of work with its output in a log; whether it was done. One line where not."""
    if line := logged(work, log):
        _say(f"vinesexp: {line}")
    return not line


_OF_THE_MACHINE = "when this is mended, the next run goes on from here"


def logged(work: Callable[[], Any], path: Path) -> str:
    """Do something with its output in a log, written anew; one line where it fails, or nothing."""
    began, line = time.perf_counter(), ""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", encoding="utf-8") as log, redirect_stdout(log), redirect_stderr(log):
            try:
                work()
                print(f"done in {time.perf_counter() - began:.2f} s")
            except VinesexpError as error:
                line = f"{error} (log: {path})"
                print(error)
            except Exception as error:
                line = f"{_one_line(error)} (log: {path})"
                traceback.print_exc()
    except OSError as error:  # from the log itself, which a full disk may not take
        line = line or f"{error.filename or path}: {error.strerror or error}; {_OF_THE_MACHINE}"
    return line


def _one_line(error: Exception) -> str:
    from vinesexp.records.stored.refusal import is_of_the_machine, reason_of_machine

    if not is_of_the_machine(error):
        return f"unexpected {type(error).__name__}: {error}"
    if "errno = " in str(error):  # HDF5 fails again for all that it has open, in tracebacks
        sys.excepthook = sys.unraisablehook = _say_nothing
    file = getattr(error, "filename", None)
    return f"{f'{file}: ' if file else ''}{reason_of_machine(error)}; {_OF_THE_MACHINE}"


def _say_nothing(*_: object) -> None:
    pass


def _append(path: Path, line: str) -> None:
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8") as stream:
            stream.write(f"{line}\n")


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


if __name__ == "__main__":
    _serve(socket.socket(fileno=int(sys.argv[1])), import_module(sys.argv[2]))
