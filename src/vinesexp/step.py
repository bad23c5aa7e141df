"""One step of the workflow: a function, its log, and one line at the console when it fails.

A script of the workflow calls `run_job(main, snakemake)`, a step on a single record comes from
`vinesexp.record_job`, anything else calls `run_step(main, log=..., **arguments)`. What the step
prints and the traceback of anything unexpected go to the log; a user's mistake is one line at the
console, with the log's path, and no traceback.
"""

from __future__ import annotations

import contextlib
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn, TextIO

from vinesexp.errors import VinesexpError


def run_job(function: Callable[..., Any], job: Any, **arguments: Any) -> None:
    """Run one job of the workflow: `function(campaign, [record,] paths=..., **arguments)`.

    Parameters
    ----------
    function : callable
        The step, as in `vinesexp.pipeline`. What it returns is the summary line of the log; a
        list of files before it, ``(files, summary)``, counts to what the step wrote.
    job : snakemake
        What Snakemake gives to a script. Its param ``about`` says where campaign and results are
        and what the result depends on, which is recorded beside it
        (`vinesexp.records.freshness`); the wildcard ``record``, where there is one, says which
        record it is about.
    """
    read, record = [*job.input], getattr(job.wildcards, "record", None)

    def run() -> Any:
        files = {"read": read, "written": [*job.output]}
        return on_campaign(function, about=job.params.about, record=record, **files, **arguments)

    run_step(run, log=job.log[0])


def on_campaign(
    function: Callable[..., Any],
    *,
    about: Mapping[str, Any],
    read: Sequence[str],
    written: Sequence[str],
    record: str | None = None,
    **arguments: Any,
) -> Any:
    """Run a step, and note beside its results what they were made from.

    Parameters
    ----------
    function : callable
        As for `run_job`.
    about : mapping
        Folders of ``campaign`` and ``results``, ``made``, the file of the note, ``used``, what the
        result depends on besides files, and ``reads``, files besides `read`.
    read, written : sequences of str
        Inputs and outputs of the job.
    record : str, optional
        Name of the record that the step is about.
    """
    from vinesexp.records.campaign import load_campaign
    from vinesexp.records.freshness import begin, file_states, remove_left_out, write_made
    from vinesexp.records.result_paths import ResultPaths

    campaign, paths = load_campaign(Path(about["campaign"])), ResultPaths(Path(about["results"]))
    roots = {"results": paths.folder, "campaign": campaign.folder}
    made = Path(about["made"])
    before = begin(made)  # a job that is killed leaves nothing that vouches for its files
    inputs = file_states(dict.fromkeys(map(Path, [*read, *about["reads"]])), roots=roots)
    records = [] if record is None else [campaign.record(record)]
    summary = function(campaign, *records, paths=paths, **arguments)
    files, summary = summary if isinstance(summary, tuple) else ([], summary)
    outputs = file_states([*map(Path, written), *files], roots=roots)
    remove_left_out(before, outputs, roots=roots)
    write_made(made, about["used"], inputs=inputs, outputs=outputs)
    return summary


def run_step(function: Callable[..., Any], *, log: str | Path, **arguments: Any) -> None:
    """Run `function(**arguments)` with its output in `log`; exit with 1 if it fails.

    Parameters
    ----------
    function : callable
        The step. What it returns, if anything, is the summary line of the log.
    log : path
        Text file, written anew.

    Raises
    ------
    SystemExit
        With code 1, after one line on standard error.
    """
    path = Path(log)
    started, before = time.perf_counter(), time.process_time()
    try:
        with _written(path) as stream:
            summary = _run(function, arguments, stream)
            seconds = time.perf_counter() - started
            stream.write(f"{summary if summary is not None else 'done'} in {seconds:.2f} s\n")
            spent = f"{time.process_time():.2f} s of processor time, {before:.2f} before the step"
            stream.write(f"process: {spent}, {_memory_words()}\n")
    except VinesexpError as error:
        _fail(f"{error} (log: {path})")
    except OSError as error:  # from the log itself, which a full disk may not take
        _fail(f"{error.filename or path}: {error.strerror or error}")


def _run(function: Callable[..., Any], arguments: dict[str, Any], stream: TextIO) -> Any:
    """What the function returns; what it raises is in the log, and becomes a VinesexpError."""
    try:
        with contextlib.redirect_stdout(stream), contextlib.redirect_stderr(stream):
            return function(**arguments)
    except VinesexpError as error:
        stream.write(f"{error}\n")
        raise
    except Exception as error:
        from vinesexp.records.refusal import is_of_the_machine, reason_of_machine

        stream.write(traceback.format_exc())
        if is_of_the_machine(error):
            if "errno = " in str(error):  # HDF5 fails again for all that it has open, in tracebacks
                sys.excepthook = sys.unraisablehook = _say_nothing
            file = getattr(error, "filename", None)
            raise VinesexpError(
                f"{reason_of_machine(error)}; when this is mended, the next run goes on from here",
                file=None if file is None else Path(file),
            ) from None
        raise VinesexpError(f"unexpected {type(error).__name__}: {error}") from None


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


def _say_nothing(*_: object) -> None:
    pass


def _fail(words: str) -> NoReturn:
    print(f"vinesexp: {words}", file=sys.stderr, flush=True)
    raise SystemExit(1)


def _memory_words() -> str:
    peak = peak_memory()
    return "peak memory unknown" if peak is None else f"peak memory {peak:.0f} MiB"


def peak_memory() -> float | None:
    """Largest memory that this process has held, MiB, where the system says it.

    The usual `ru_maxrss` outlives the start of a new program on Linux, and a step would show what
    its parent had held; VmHWM is of this program alone. Of the processes that it started and that
    have ended the largest counts too.
    """
    try:
        import resource
    except ImportError:  # Windows
        return None
    size = 2**20 if sys.platform == "darwin" else 2**10
    children = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / size
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
        kilobytes = next(line.split()[1] for line in status.splitlines() if "VmHWM" in line)
        return max(int(kilobytes) / 2**10, children)
    except (OSError, StopIteration):
        return max(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / size, children)
