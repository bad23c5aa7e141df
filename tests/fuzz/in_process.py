"""Binary files read in this process: a child process for each would be most of the time of a case.

Errors are worded as the child words them, memory is limited as the child's is, and a case that
takes too long or breaks a library ends this process. Whatever is found in this way is tried again
with the child, which is what the program uses: only what is still found then counts.
"""

from __future__ import annotations

import resource
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import vinesexp.records.readers as readers
from vinesexp.errors import RecordError
from vinesexp.records.readers.guard import limits_for, refusal
from vinesexp.records.readers.source import BLOCK_ROWS, Source

SECONDS = 5.0  # of the processor, for a case without a child


class SourceHere:
    """Stands in for `GuardedSource`; the interface is `readers.source.Source`."""

    def __init__(self, path: Path, reader: Any) -> None:
        self.path, self._name = path, reader.NAME
        self._source = self._try(reader.open_file, path)
        for name in Source.__annotations__:
            setattr(self, name, getattr(self._source, name))

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[Any]:
        stream = self._try(lambda: iter(self._source.blocks(columns, rows)))
        while (block := self._try(next, stream, None)) is not None:
            yield block

    def locate(self, row: int) -> str:
        return str(self._try(self._source.locate, row))

    def _try(self, function: Any, *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except Exception as error:
            problem, where = refusal(error, self._name)
            raise RecordError(problem, file=self.path, where=where) from None


@contextmanager
def no_child() -> Iterator[None]:
    """Readers work in this process, which ends if one takes more than `SECONDS`."""
    guarded, readers.GuardedSource = readers.GuardedSource, SourceHere  # type: ignore[misc, assignment]
    signal.setitimer(signal.ITIMER_PROF, SECONDS)  # nobody catches it
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        readers.GuardedSource = guarded  # type: ignore[misc]


def limit_memory() -> None:
    """No more for this process than for a child that reads."""
    status = Path("/proc/self/status")
    if status.is_file():
        held = next(line.split()[1] for line in status.read_text().splitlines() if "VmData" in line)
        most = int(held) * 1024 + limits_for(0).memory
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
