"""Work in processes that are watched and end alone, forked from one that has loaded the libraries.

A process that dies, because the system is short of memory or a library crashed, takes nothing
along: it does what it is asked for, one record after the other, so that who asks knows at which
record it died and what ended it, and asks another one.
"""

from __future__ import annotations

import atexit
import gc
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Collection, Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from functools import partial
from importlib.machinery import ModuleSpec
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from typing import Any, NamedTuple

from vinesexp.environment import one_thread_each
from vinesexp.errors import VinesexpError, say
from vinesexp.steps import Study

#: Exit code of work that a person has ended with Ctrl-C.
INTERRUPTED = 130

#: How many of its units of memory the system has in a MiB.
_MIB = 2**20 if sys.platform == "darwin" else 2**10

#: To start a process also looks after those that have ended, which two threads must not do at once.
_STARTING = threading.Lock()

_Worker = tuple[BaseProcess, "Connection[Any, Any]"]


def run_apart(
    study: Study, step: str, ids: Sequence[str], *, log: Path, loads: Collection[str] = ()
) -> int:
    """Exit code of a step that is done in a process of its own, on one record after the other.

    A record at which the process dies is tried once more, since the system may have been at fault.
    After that it is refused.

    Parameters
    ----------
    study : Study
    step : str
    ids : sequence of str
        Records; ``[""]`` for all together.
    log : Path
        Where the process says what it took.
    loads : collection of str
        Modules that are imported before the first process of all, for all of them.
    """
    worker, stopped = None, False
    failed, died, began, done = list[str](), list[str](), time.monotonic(), 0
    while done < len(ids) and not stopped:
        id, refused = ids[done], len(died) > 1
        reason = f"{step}: {died[-1]} twice while this record was read" if refused else ""
        worker = worker or _started(loads, study, step, log)
        if (answer := _done(worker, id, reason)) is not None:
            line, stopped = answer
            how = " failed" if line else f" refused: {died[-1]}" if refused else ""
            failed, died, done = failed + [line] * bool(line), [], done + 1
            if id:
                say(f"  {step:10} {_progress(done, len(ids), began, id + how)}")
            continue
        code, worker = _ended(worker), None
        if code in (None, INTERRUPTED):  # somebody ended the one that forks, or all
            return code or 1
        died.append(_death(code))
        if refused or not id:
            at = f" while {id} was refused" if id else ""
            say(f"vinesexp: {step}: {died[-1]}{at} (log: {log})")
            return 1
    if worker:
        _ended(worker)
    for line in failed:
        say(f"vinesexp: {line}")
    return 1 if failed else 0


def _progress(done: int, of: int, began: float, what: str) -> str:
    """Say what was done, as the last of so many, and how long the rest may take."""
    left = (time.monotonic() - began) / done * (of - done)
    return f"{done:{len(str(of))}}/{of} {what}" + (f", {left:.0f} s left" if left >= 1.0 else "")


def _started(loads: Collection[str], *work: object) -> _Worker:
    """A process that does a step on the records that it is told, or one that could not be."""
    main, context = sys.modules["__main__"], get_context("forkserver")
    if main.__spec__ is None:  # as that of `python -m`, which no process imports again
        main.__spec__ = ModuleSpec("vinesexp.__main__", None)
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(*work, theirs))
    with _STARTING, theirs, suppress(EOFError, OSError):
        one_thread_each()
        context.set_forkserver_preload(["vinesexp.garbage", *loads, __name__])
        process.start()
    return process, ours


def _done(worker: _Worker, id: str, reason: str) -> Failure | None:
    """Have a record done, or refused for a reason; None where the process died."""
    try:
        worker[1].send((id, reason))
        return Failure(*worker[1].recv())
    except (EOFError, OSError):
        return None


def _ended(worker: _Worker) -> int | None:
    """Exit code of a process that has nothing more to do; None where it was not started."""
    process, pipe = worker
    pipe.close()
    with _STARTING:
        if process.pid is not None:
            process.join()
    return process.exitcode


def _work(study: Study, step: str, job_log: Path, asked: Connection) -> None:
    """Do, in the fork, what is asked for, until nobody asks any more."""
    signal.signal(signal.SIGINT, _interrupted)
    gc.freeze()
    code = 0
    try:
        with suppress(EOFError, ConnectionError):
            while True:
                id, reason = asked.recv()
                do = partial(study.refuse, reason=reason) if reason else study.run
                asked.send(logged(partial(do, step, id), study.paths.log(step, id)))
        atexit._run_exitfuncs()
    except KeyboardInterrupt:
        code = INTERRUPTED
    used = getrusage(RUSAGE_SELF)
    took, peak = used.ru_utime + used.ru_stime, used.ru_maxrss / _MIB
    with suppress(OSError), job_log.open("a", encoding="utf-8") as log:
        log.write(f"process: {took:.2f} s of processor time, peak memory {peak:.0f} MiB\n")
    sys.exit(code)


def _interrupted(*_: object) -> None:
    """End, once: whatever is being cleared away must not be interrupted again."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    raise KeyboardInterrupt


def _death(code: int) -> str:
    """How a process ended without a word of its own."""
    if code == -signal.SIGKILL:
        return "its process was killed, as systems do when memory is short"
    if code < 0:
        return f"its process crashed ({signal.Signals(-code).name})"
    return f"its process ended with {code}"


class Failure(NamedTuple):
    """What failed, in one line, empty where nothing did; whether the machine has to be mended."""

    line: str = ""
    of_the_machine: bool = False


def logged(work: Callable[[], Any], path: Path) -> Failure:
    """Do something with its output in a log, written anew."""
    began, failed = time.perf_counter(), Failure()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", encoding="utf-8") as log, redirect_stdout(log), redirect_stderr(log):
            try:
                work()
                print(f"done in {time.perf_counter() - began:.2f} s")
            except VinesexpError as error:
                failed = Failure(f"{error} (log: {path})")
                print(error)
            except Exception as error:
                failed = _failure(error, f" (log: {path})")
                traceback.print_exc()
    except OSError as error:  # from the log itself, which a full disk may not take
        said = f"{error.filename or path}: {error.strerror or error}"
        failed = failed if failed.line else _of_the_machine(said)
    return failed


def _of_the_machine(said: str, log: str = "") -> Failure:
    return Failure(f"{said}; when this is mended, the next run goes on from here{log}", True)


def _failure(error: Exception, log: str) -> Failure:
    from vinesexp.records.stored.refusal import reason_of_machine

    if reason := reason_of_machine(error):
        # HDF5 fails again for all that it has open, in tracebacks.
        sys.unraisablehook = lambda _: None
        return _of_the_machine(reason, log)
    return Failure(f"unexpected {type(error).__name__}: {error}{log}")
