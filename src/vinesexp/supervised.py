"""Work in processes that are watched and end alone, forked from one that has loaded the libraries.

A process that dies, because the system is short of memory or a library crashed, takes nothing
along: who asked for it is told which record it was at and what ended it, and asks for another.
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
from dataclasses import dataclass
from functools import partial
from importlib.machinery import ModuleSpec
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from typing import Any

from vinesexp.environment import one_thread_each
from vinesexp.errors import VinesexpError
from vinesexp.steps import Study, members


@dataclass(frozen=True)
class Job:
    """A step on a batch of records, or on all together where `batch` is empty."""

    study: Study
    step: str
    batch: str

    def pending(self) -> Sequence[str]:
        """Records whose results do not hold; ``[""]`` for all together."""
        if not self.batch:
            return [""]
        ids = members(list(self.study.records), self.batch)
        return [id for id in ids if self.study.why(self.step, id)]

    def do(self, id: str) -> None:
        """Run the step."""
        self.study.run(self.step, id or None)

    def refuse(self, id: str, reason: str) -> None:
        """Leave what says that a record cannot be used."""
        self.study.refuse(self.step, id, reason)

    def log(self, id: str = "") -> Path:
        """Log of a record, or of the job."""
        if id:
            return self.study.paths.log(self.step, id)
        return self.study.paths.log(f"{self.step}.{self.batch}".rstrip("."))


#: Exit code of work that a person has ended with Ctrl-C.
INTERRUPTED = 130

#: Objects that are made between two searches for garbage. Figures are made of many that all stay
#: to the end of a figure: with the default of 700 the searches took a quarter of their time.
_MADE = 100_000

#: How many of its units of memory the system has in a MiB.
_MIB = 2**20 if sys.platform == "darwin" else 2**10

#: To start a process also looks after those that have ended, which two threads must not do at once.
_STARTING = threading.Lock()


def run_apart(job: Job, *, loads: Collection[str] = ()) -> int:
    """Exit code of a job that is done in a process of its own.

    A record at which the process dies is tried once more, since the system may have been at fault.
    After that it is refused.

    Parameters
    ----------
    job : Job
    loads : collection of str
        Modules that are imported before the first process of all, for all of them.
    """
    died: dict[str, list[str]] = {}
    while True:
        told = _told_by_process(job, died, loads)
        if "code" in told or "ended" not in told:
            return int(told.get("code", 1))
        record = told.get("record", "")
        ends = died.setdefault(record, [])
        ends.append(_death(told["ended"]))
        if not record or len(ends) > 2:
            at = f" while {record} was refused" if record else ""
            _say(f"vinesexp: {job.step}: {ends[-1]}{at} (log: {job.log()})")
            return 1


def _told_by_process(
    job: Job, died: dict[str, list[str]], loads: Collection[str]
) -> dict[str, Any]:
    """All that was told: the ``record`` it was at, its ``code``, or how it ``ended`` without."""
    told: dict[str, Any] = {}
    main, context = sys.modules["__main__"], get_context("forkserver")
    if main.__spec__ is None:  # as that of `python -m`, which no process imports again
        main.__spec__ = ModuleSpec("vinesexp.__main__", None)
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(job, died, theirs))
    with ours, suppress(EOFError, OSError):
        with _STARTING, theirs:
            one_thread_each()
            context.set_forkserver_preload([*loads, __name__])
            process.start()
        while "code" not in told:
            told |= ours.recv()
    if "code" not in told and process.pid is not None:  # else somebody ended the one that forks
        with _STARTING:
            process.join()
        told["ended"] = process.exitcode
    return told


def _work(job: Job, died: dict[str, list[str]], tell: Connection) -> None:
    """Do the job, in the fork, and tell its exit code: that of who was killed is not told."""
    signal.signal(signal.SIGINT, _interrupted)
    gc.freeze()
    gc.set_threshold(_MADE)
    try:
        code = 0 if _go_through(job, died, tell) else 1
        atexit._run_exitfuncs()
    except KeyboardInterrupt:
        code = INTERRUPTED
    except BaseException as error:
        code = 1
        if not isinstance(error, BrokenPipeError):  # nobody listens any more
            traceback.print_exc()
    used = getrusage(RUSAGE_SELF)
    took, peak = used.ru_utime + used.ru_stime, used.ru_maxrss / _MIB
    with suppress(OSError), job.log().open("a", encoding="utf-8") as log:
        log.write(f"process: {took:.2f} s of processor time, peak memory {peak:.0f} MiB\n")
    with suppress(OSError):  # the run was killed
        tell.send({"code": code})


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


def _go_through(job: Job, died: dict[str, list[str]], tell: Connection) -> bool:
    """Do a step on one record after the other, a line of progress each; whether all were done."""
    ids = job.pending()
    failed, began = [], time.monotonic()
    for count, id in enumerate(ids, 1):
        tell.send({"record": id})
        ends = died.get(id, [])
        refused = len(ends) > 1
        reason = f"{job.step}: {ends[-1]} twice while this record was read" if refused else ""
        work = partial(job.refuse, id, reason) if refused else partial(job.do, id)
        line = logged(work, job.log(id))
        failed += [line] if line else []
        left = (time.monotonic() - began) / count * (len(ids) - count)
        how = " failed" if line else f" refused: {ends[-1]}" if refused else ""
        rest = f", {left:.0f} s left" if left >= 1.0 else ""
        if id:
            _say(f"  {job.step:10} {count:{len(str(len(ids)))}}/{len(ids)} {id}{how}{rest}")
        if _OF_THE_MACHINE in line:
            break
    for line in failed:
        _say(f"vinesexp: {line}")
    return not failed


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

    unexpected = f"unexpected {type(error).__name__}: {error}"
    while not is_of_the_machine(error):  # a full disk, and what a library stumbles over behind it
        if not isinstance(error.__context__, Exception):
            return unexpected
        error = error.__context__
    if "errno = " in str(error):  # HDF5 fails again for all that it has open, in tracebacks
        sys.unraisablehook = lambda _: None
    file = getattr(error, "filename", None)
    return f"{f'{file}: ' if file else ''}{reason_of_machine(error)}; {_OF_THE_MACHINE}"


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
