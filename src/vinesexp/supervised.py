"""Work in processes that are watched and end alone, forked from one that has loaded the libraries.

A process that dies, because the system is short of memory or a library crashed, takes nothing
along: who asked for it is told which record it was at and what ended it, and asks for another.
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from functools import partial
from importlib.machinery import ModuleSpec
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from vinesexp.environment import one_thread_each
from vinesexp.errors import VinesexpError

#: How the process of a record ended, each time that it died.
Deaths = Mapping[str, Sequence[str]]

#: Says which ``record`` the work is at.
Begin = Callable[[str], None]

#: What is to be done; it is sent to the process. Takes the deaths before this one; its exit code.
Work = Callable[[Deaths, Begin], int]

#: Exit code of work that a person has ended with Ctrl-C.
INTERRUPTED = 130

#: Objects that are made between two searches for garbage. Figures are made of many that all stay
#: to the end of a figure: with the default of 700 the searches took a quarter of their time.
_MADE = 100_000

#: To start a process also looks after those that have ended, which two threads must not do at once.
_STARTING = threading.Lock()


def run_apart(name: str, work: Work, *, log: Path, loads: Collection[str] = ()) -> int:
    """Exit code of work that is done in a process of its own.

    A record at which the process dies is tried once more, since the system may have been at fault.
    After that the work is told to refuse it.

    Parameters
    ----------
    name : str
        What the work is called where it fails as a whole.
    work : callable
        Can be pickled.
    log : Path
        Gets a line that says what the process took.
    loads : collection of str
        Modules that are imported before the first process of all, for all of them.
    """
    died: dict[str, list[str]] = {}
    while True:
        told = _told_by_process(work, died, loads)
        with suppress(OSError):
            log.parent.mkdir(parents=True, exist_ok=True)
            with log.open("a", encoding="utf-8") as stream:
                stream.write(f"process: {told.get('took', 'is gone')}\n")
        if "code" in told or "ended" not in told:
            return int(told.get("code", 1))
        of_this = died.setdefault(told.get("record", ""), [])
        of_this.append(_death(told["ended"]))
        if "record" not in told or len(of_this) > 2:
            at = f" while {told['record']} was refused" if "record" in told else ""
            _say(f"vinesexp: {name}: {of_this[-1]}{at} (log: {log})")
            return 1


def _told_by_process(work: Work, died: Deaths, loads: Collection[str]) -> dict[str, Any]:
    """All that was told: the ``record`` it was at, its ``code``, how it ``ended``, and ``took``."""
    told: dict[str, Any] = {}
    main, context = sys.modules["__main__"], get_context("forkserver")
    if main.__spec__ is None:  # as that of `python -m`, which no process imports again
        main.__spec__ = ModuleSpec("vinesexp.__main__", None)
    ours, theirs = context.Pipe(duplex=False)
    with ours, suppress(EOFError, OSError):  # somebody has ended the process that forks
        with _STARTING, theirs:
            one_thread_each()
            context.set_forkserver_preload([*loads, __name__])
            context.Process(target=_watch, args=(work, died, theirs)).start()
        while "ended" not in told:
            told |= ours.recv()
    return told


def _watch(work: Work, died: Deaths, tell: Connection) -> None:
    """Fork once more for the work, and say how that ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if not (pid := os.fork()):
        os._exit(_work(work, died, tell))  # what is loaded need not be cleared away
    _, status, used = os.wait4(pid, 0)
    with suppress(OSError):  # the run was killed
        tell.send({"ended": os.waitstatus_to_exitcode(status), "took": _in_words(used)})


def _work(work: Work, died: Deaths, tell: Connection) -> int:
    """Exit code of the work, in the fork; it is told too, so that a death can be told from it."""
    signal.signal(signal.SIGINT, _interrupted)
    gc.freeze()
    gc.set_threshold(_MADE)
    try:
        code = work(died, lambda record: tell.send({"record": record}))
        atexit._run_exitfuncs()
    except KeyboardInterrupt:
        code = INTERRUPTED
    except BaseException as error:
        code = 1
        if not isinstance(error, BrokenPipeError):  # nobody listens any more
            traceback.print_exc()
    with suppress(OSError):
        tell.send({"code": code})
    return code


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
    begin: Begin,
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
        Is told the record that comes now.
    log_of : callable
        Log of a record.
    """
    failed, began = [], time.monotonic()
    for count, id in enumerate(ids, 1):
        begin(id)
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
