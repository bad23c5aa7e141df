"""Work in a child process that is watched: what it prints, how far it is, and how it ends.

A child that dies, because the system is short of memory or a library crashed, takes nothing along:
the process that watches it has nothing loaded, says which record it was, and goes on with the next.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TextIO

from vinesexp.errors import VinesexpError

Tell = Callable[..., None]


def on_all(step: str, work: Callable[[], Any], *, log: Path) -> bool:
    """Do a piece of work with its output in a log; whether it was done.

    Parameters
    ----------
    step : str
        Its name, for the person at the console, who gets one line where it fails.
    work : callable
    log : Path
        Written anew.
    """
    failed: list[str] = []

    def child(tell: Tell) -> None:
        if (reason := _logged(work, log)) is not None:
            tell(failed=reason)

    code, used = _in_child(child, lambda told: failed.append(told["failed"]))
    if code and not failed:
        failed.append(f"{step}: {_death(code)} (log: {log})")
    _say_all(failed)
    _append(log, f"process: {used}")
    return not failed


def on_each(
    step: str,
    ids: Sequence[str],
    *,
    work: Callable[[str], Any],
    refuse: Callable[[str, str], None],
    log: Path,
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
        Leaves what says that a record cannot be used; takes the record and the reason. A record
        whose process dies is tried once more, since the system may have been at fault.
    log : Path
        What the processes took.
    log_of : callable
        Log of a record.
    """
    todo, failed, died = list(ids), [], dict.fromkeys(ids, 0)
    progress = _Progress(step, len(ids))

    def child(tell: Tell) -> None:
        for id in list(todo):
            tell(begun=id)
            reason = _logged(lambda id=id: work(id), log_of(id))  # type: ignore[misc]
            tell(done=id, failed=reason)
            if reason is not None and _OF_THE_MACHINE in reason:
                break

    def hear(told: dict[str, Any]) -> None:
        if "done" in told:
            todo.remove(told["done"])
            progress.done(told["done"], failed=told["failed"] is not None)
            failed.extend([told["failed"]] if told["failed"] else [])
        else:
            under_way[:] = [told["begun"]]

    while todo:
        under_way: list[str] = []
        code, used = _in_child(child, hear)
        _append(log, f"process: {used}")
        if not code:
            break
        id = under_way[0] if under_way else todo[0]
        died[id] += 1
        if died[id] > 1:
            reason = f"{step}: {_death(code)} twice while this record was read"
            ended, _ = _in_child(lambda tell: refuse(id, reason), lambda told: None)  # noqa: B023
            if ended:
                failed.append(f"{id}: {reason}, and the record could not be refused")
            todo.remove(id)
            progress.done(id, refused=_death(code))
    _say_all(failed)
    return not failed


class _Progress:
    """Lines such as ``impacts 12/30 b34, 8 s left``."""

    def __init__(self, step: str, total: int) -> None:
        self.step, self.total, self.count = step, total, 0
        self.began = time.monotonic()

    def done(self, id: str, *, failed: bool = False, refused: str = "") -> None:
        self.count += 1
        left = (time.monotonic() - self.began) / self.count * (self.total - self.count)
        words = f", {left:.0f} s left" if left >= 1.0 else ""
        how = " failed" if failed else f" refused: {refused}" if refused else ""
        width = len(str(self.total))
        print(f"  {self.step:10} {self.count:{width}}/{self.total} {id}{how}{words}",
              file=sys.stderr, flush=True)  # fmt: skip


def _in_child(work: Callable[[Tell], None], hear: Callable[[Any], None]) -> tuple[int, str]:
    """Exit code of a fork that does the work, below zero for a signal; what it took, in words."""
    read, write = os.pipe()
    sys.stderr.flush()
    sys.stdout.flush()
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            signal.signal(signal.SIGINT, _interrupted)
            os.close(read)
            with os.fdopen(write, "w", encoding="utf-8") as pipe:
                work(lambda **told: print(json.dumps(told), file=pipe, flush=True))
            atexit._run_exitfuncs()
            code = 0
        except KeyboardInterrupt:
            code = 130
        except BrokenPipeError:  # nobody watches any more
            code = 1
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    os.close(write)
    signal.signal(signal.SIGINT, lambda *_: None)  # the child has it too, and ends first
    with os.fdopen(read, encoding="utf-8") as pipe:
        for line in pipe:
            hear(json.loads(line))
    _, status, taken = os.wait4(pid, 0)
    if os.waitstatus_to_exitcode(status) == 130:
        raise SystemExit(130)
    peak = taken.ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)
    seconds = taken.ru_utime + taken.ru_stime
    words = f"{seconds:.2f} s of processor time, peak memory {peak:.0f} MiB"
    return os.waitstatus_to_exitcode(status), words


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


_OF_THE_MACHINE = "when this is mended, the next run goes on from here"


def _logged(work: Callable[[], Any], path: Path) -> str | None:
    """Do something with its output in a log; one line where it fails, None where it does not."""
    began = time.perf_counter()
    try:
        with _written(path) as stream:
            try:
                with contextlib.redirect_stdout(stream), contextlib.redirect_stderr(stream):
                    work()
            except VinesexpError as error:
                stream.write(f"{error}\n")
                return f"{error} (log: {path})"
            except Exception as error:
                stream.write(traceback.format_exc())
                return f"{_one_line(error)} (log: {path})"
            stream.write(f"done in {time.perf_counter() - began:.2f} s\n")
    except OSError as error:  # from the log itself, which a full disk may not take
        return f"{error.filename or path}: {error.strerror or error}; {_OF_THE_MACHINE}"
    return None


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


@contextlib.contextmanager
def _written(path: Path) -> Iterator[TextIO]:
    """The log, written anew. A failure of the step counts for more than one of its log."""
    path.parent.mkdir(parents=True, exist_ok=True)
    stream = path.open("w", encoding="utf-8")
    try:
        yield stream
    except BaseException:
        with contextlib.suppress(OSError):
            stream.close()
        raise
    stream.close()


def _append(path: Path, line: str) -> None:
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8") as stream:
            stream.write(f"{line}\n")


def _say_all(lines: Sequence[str]) -> None:
    for line in lines:
        print(f"vinesexp: {line}", file=sys.stderr, flush=True)
