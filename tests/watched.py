"""A study for `vinesexp.supervised.run_apart` that writes a file a record; some kill it."""

import errno
import faulthandler
import os
import time
from dataclasses import dataclass
from pathlib import Path

from vinesexp.errors import RecordError


@dataclass(frozen=True)
class Watched:
    """Goes through records; those in `deadly`, `once`, `wrong`, `stubborn`, `full` are so."""

    folder: Path
    takes: float = 0.0
    deadly: tuple[str, ...] = ()
    once: tuple[str, ...] = ()
    wrong: tuple[str, ...] = ()
    stubborn: tuple[str, ...] = ()
    full: tuple[str, ...] = ()
    how: int = 9
    held: bool = False

    @property
    def paths(self):
        return self

    def log(self, step, id):
        return self.folder / f"{id}.log"

    def why(self, step, id):
        return [] if (self.folder / id).is_file() else ["not made yet"]

    def may_refuse(self, step, id):
        return bool(id)

    def run(self, step, id):
        if self.held:
            _held(self.folder)
        tried = self.folder / f"{id}.tried"
        before = tried.exists()
        tried.touch()
        time.sleep(self.takes)
        if id in self.deadly or (id in self.once and not before):
            faulthandler.disable()  # of pytest, which would print all that the system knows
            os.kill(os.getpid(), self.how) if self.how else os._exit(1)
        if id in self.wrong:
            raise RecordError("is wrong", file=id)
        if id in self.full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), id)
        (self.folder / id).write_text(f"{os.getpid()}")

    def refuse(self, step, id, reason):
        if id in self.stubborn:
            os.kill(os.getpid(), 9)
        (self.folder / id).write_text(f"refused: {reason}")


def _held(folder):
    """Something that is cleared away slowly."""
    (folder / "temporary").touch()
    try:
        time.sleep(60)
    finally:
        time.sleep(0.5)
        (folder / "temporary").unlink()
