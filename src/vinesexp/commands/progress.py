"""How far a command has come, for a person who waits."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread


class Bar:
    """A progress bar on standard error, where a person looks at it."""

    def __init__(self, what: str) -> None:
        self.what, self.begin, self.shown = what, time.monotonic(), sys.stderr.isatty()

    def __call__(self, done: int, total: int) -> None:
        """Show how many are done, and for how long the rest will take."""
        if self.shown:
            spent = time.monotonic() - self.begin
            full = 40 * done // total
            print(
                f"\r[{'#' * full}{' ' * (40 - full)}] {done}/{total} {self.what}, {spent:.0f} s, "
                f"{spent / done * (total - done):.0f} s left ",
                end="", file=sys.stderr, flush=True,
            )  # fmt: skip

    def end(self) -> None:
        """Leave the line."""
        if self.shown:
            print(file=sys.stderr)


@contextmanager
def clock(what: str, expected: float) -> Iterator[None]:
    """Show for how long a piece of work has run, beside what was expected, where a person looks.

    Parameters
    ----------
    what : str
        The work, in two words.
    expected : float
        s.
    """
    if not sys.stderr.isatty():
        yield
        return
    begin, ended = time.monotonic(), Event()

    def tick() -> None:
        while not ended.wait(_TICK):
            spent = time.monotonic() - begin
            print(
                f"\r{what}: {spent:.0f} s of about {max(expected, spent):.0f} s ",
                end="", file=sys.stderr, flush=True,
            )  # fmt: skip

    thread = Thread(target=tick, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        print("\r\x1b[K", end="", file=sys.stderr, flush=True)


#: s between two looks of a person.
_TICK = 0.5


def announce(work: object) -> None:
    """Say on standard error what is to be done, before it is begun."""
    print(work, file=sys.stderr, flush=True)
