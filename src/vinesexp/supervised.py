"""Steps in processes of their own, forked from one that has loaded the libraries.

A process that dies, because the system is short of memory or a library crashed, takes nothing
along. It goes through its records in order and notes each that it has done. The first one whose
results do not hold is therefore the one at which it died, and another process goes on there.
"""

from __future__ import annotations

import gc
import signal
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from contextlib import redirect_stderr, redirect_stdout
from copy import copy
from functools import partial
from importlib.machinery import ModuleSpec
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from pathlib import Path
from resource import RUSAGE_SELF, getrusage

from vinesexp.environment import one_thread_each
from vinesexp.errors import say
from vinesexp.steps import Study

#: Exit codes of a step that a person has ended with Ctrl-C, and of one that has said what failed.
INTERRUPTED, _SAID = 130, 70

#: How many of its units of memory the system has in a MiB.
_MIB = 2**20 if sys.platform == "darwin" else 2**10

#: To start a process also looks after those that have ended, which two threads must not do at once.
_STARTING = threading.Lock()


def run_apart(study: Study, step: str, ids: Sequence[str], *, loads: Collection[str] = ()) -> int:
    """Exit code of a step that is done in a process of its own, on one record after the other.

    A record at which the process dies is tried once more, since the system may have been at fault.
    After that it is refused.

    Parameters
    ----------
    study : Study
    step : str
    ids : sequence of str
        Records, of which those are done whose results do not hold; ``[""]`` for all together.
    loads : collection of str
        Modules that are imported before the first process of all, for all of them.
    """
    code, died = 0, Counter[str]()
    while outdated := [id for id in ids if study.why(step, id)]:
        at, reason = outdated[0], ""
        if code:
            died[at] += 1
            reason = f"{step}: {_death(code)}"
        if died[at] > 1 + study.may_refuse(step, at):
            say(f"vinesexp: {reason} (log: {study.paths.log(step, at)})")
            return _SAID
        reason = f"{reason} twice while this record was read" if died[at] == 2 else ""
        code = _forked(loads, study, step, outdated, reason)
        if code in (0, _SAID, INTERRUPTED):
            return code
        study = copy(study)
    return 0


def _forked(loads: Collection[str], *work: object) -> int:
    """Exit code of a fork that does a step; below zero a signal that ended it."""
    main, context = sys.modules["__main__"], get_context("forkserver")
    if main.__spec__ is None:  # as that of `python -m`, which no process imports again
        main.__spec__ = ModuleSpec("vinesexp.__main__", None)
    process = context.Process(target=_work, args=work)
    try:
        with _STARTING:
            one_thread_each()
            context.set_forkserver_preload(["vinesexp.garbage", *loads, __name__])
            process.start()
        wait([process.sentinel])
        with _STARTING:
            process.join()
    except (EOFError, OSError):  # somebody ended the process that forks
        return _SAID
    return process.exitcode or 0


def _work(study: Study, step: str, ids: Sequence[str], reason: str) -> None:
    """Do, in the fork, a step on one record after the other; refuse the first one for a reason."""
    signal.signal(signal.SIGINT, _interrupted)
    gc.freeze()
    began = time.monotonic()
    for done, id in enumerate(ids, start=1):
        if not parent_process().is_alive():  # type: ignore[union-attr]
            sys.exit(1)  # the run was killed
        path = study.paths.log(step, id)
        if line := logged(partial(_done, study, step, id, reason), path):
            say(f"vinesexp: {line}")
            sys.exit(_SAID)
        left = (time.monotonic() - began) / done * (len(ids) - done)
        if id:
            what = f"{id} refused: {reason}" if reason else id
            say(f"  {step:10} {done}/{len(ids)} {what}" + f", {left:.0f} s left" * (left >= 1.0))
        reason = ""


def _done(study: Study, step: str, id: str, reason: str) -> None:
    """Do a step; refuse the record for a reason that is given, or where the step fails by it."""
    from vinesexp.records.stored.refusal import is_of_the_machine, reason_of

    try:
        if not reason:
            return study.run(step, id)
    except Exception as error:
        if is_of_the_machine(error) or not study.may_refuse(step, id):
            raise
        reason = f"{step}: {reason_of(error, log=f'logs/{step}/{id}.log')}"
    study.refuse(step, id, reason)


def _interrupted(*_: object) -> None:
    """End, once: whatever is being cleared away must not be interrupted again."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.exit(INTERRUPTED)


def _death(code: int) -> str:
    """How a process ended without a word of its own."""
    if code == -signal.SIGKILL:
        return "its process was killed, as systems do when memory is short"
    if code < 0:
        return f"its process crashed ({signal.Signals(-code).name})"
    return f"its process ended with {code}"


def logged(work: Callable[[], object], path: Path) -> str:
    """Do something with its output in a log, written anew; in one line what failed, if it did."""
    from vinesexp.records.stored.refusal import reason_of, reason_of_machine

    began, line = time.process_time(), ""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", encoding="utf-8") as log, redirect_stdout(log), redirect_stderr(log):
            try:
                work()
                took, peak = time.process_time() - began, getrusage(RUSAGE_SELF).ru_maxrss / _MIB
                print(f"done in {took:.2f} s of processor time, peak memory {peak:.0f} MiB")
            except Exception as error:
                machine = reason_of_machine(error)
                said = _when_mended(machine) if machine else reason_of(error)
                line = f"{said} (log: {path})"
                print(line)
    except OSError as error:  # from the log itself, which a full disk may not take
        line = line or _when_mended(f"{error.filename or path}: {error.strerror or error}")
    return line


def _when_mended(said: str) -> str:
    return f"{said}; when this is mended, the next run goes on from here"
