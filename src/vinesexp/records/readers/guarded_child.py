"""The side of a guarded reader that may crash: a process that serves one source by pipe.

A message is two lengths, a pickle, and the samples of a block if there are any. Whatever goes wrong
in the reader is answered as a refusal with its reason; what cannot be answered ends the process,
and who asked sees the pipe close.
"""

from __future__ import annotations

import faulthandler
import os
import pickle
import signal
import struct
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

from vinesexp.errors import RecordError
from vinesexp.records.readers.extras import in_words

_HEAD = struct.Struct("<QQ")  # bytes of the pickle, and of the samples beside it
_PIPE = 1 << 20  # bytes that a pipe holds: fewer changes between the two processes


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


def main() -> None:
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
