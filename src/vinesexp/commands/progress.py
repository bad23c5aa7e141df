"""How far a command has come, for a person who waits."""

from __future__ import annotations

import sys
import time


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


def announce(work: object) -> None:
    """Say on standard error what is to be done, before it is begun."""
    print(work, file=sys.stderr, flush=True)
