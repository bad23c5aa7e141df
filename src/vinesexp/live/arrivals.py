"""Which files of a folder an instrument has finished writing.

The folder is looked through again and again: whether a file still grows has to be polled anyway,
and network drives send no notice. Times of files are compared with themselves alone, so that it
does not matter what the clock of the drive says.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

#: What programs call files that they still write, and what is no instrument's.
_UNFINISHED = {".tmp", ".part", ".partial", ".crdownload", ".temp", ".lock", ".swp"}

State = tuple[int, int]


class Arrivals:
    """Files below a folder that have come to rest.

    Parameters
    ----------
    folder : Path
    ignored : callable
        Whether a file of this name is none of an instrument.
    besides : Path, optional
        A folder that is not looked into.
    quiet : float
        s for which size and time of change of a file have to stay as they are.
    clock : callable
        s; does not go back.
    """

    def __init__(
        self,
        folder: Path,
        *,
        ignored: Callable[[str], bool],
        besides: Path | None = None,
        quiet: float = 1.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.folder = folder
        self._ignored = ignored
        self._besides = None if besides is None else os.path.realpath(besides)
        self._quiet = quiet
        self._clock = clock
        self._seen: dict[str, tuple[State, float]] = {}
        self._settled: dict[str, State] = {}

    @property
    def growing(self) -> tuple[Path, ...]:
        """Files that were seen and are not at rest yet."""
        seen = self._seen.items()
        return tuple(Path(p) for p, (state, _) in seen if self._settled.get(p) != state)

    def scan(self) -> list[Path]:
        """Files that came to rest or went since the last look, in the order of their names.

        A file that changes later comes again.
        """
        now = self._clock()
        states = dict(self._states())
        found = []
        for path, state in states.items():
            before = self._seen.get(path)
            since = before[1] if before is not None and before[0] == state else now
            self._seen[path] = (state, since)
            # An empty file is one that nothing was written to yet.
            at_rest = state[0] > 0 and now - since >= self._quiet
            if at_rest and self._settled.get(path) != state:
                self._settled[path] = state
                found.append(path)
        for path in set(self._seen) - set(states):
            del self._seen[path]
            if self._settled.pop(path, None) is not None:
                found.append(path)
        return [Path(path) for path in sorted(found)]

    def _states(self) -> Iterator[tuple[str, State]]:
        """Size and time of change of every file that may be an instrument's."""
        for place, folders, names in os.walk(self.folder):
            folders[:] = [
                name
                for name in folders
                if not name.startswith(".")
                and os.path.realpath(os.path.join(place, name)) != self._besides
            ]
            for name in names:
                ending = os.path.splitext(name)[1].lower()
                if name.startswith((".", "~")) or ending in _UNFINISHED or self._ignored(name):
                    continue
                path = os.path.join(place, name)
                try:
                    stat = os.stat(path)
                except OSError:  # gone, or renamed, between the two looks
                    continue
                yield path, (stat.st_size, stat.st_mtime_ns)
