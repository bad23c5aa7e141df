"""Work for `vinesexp.supervised.Forks` that writes a file for each record; some kill it."""

import faulthandler
import os
import time
from pathlib import Path

from vinesexp.errors import RecordError
from vinesexp.supervised import on_each


def load(asked):
    """Nothing to load."""


def do(asked, died, begin):
    """Go through records: ``{"step": ..., "folder": ..., "ids": [...], "deadly": [...], ...}``."""
    step, folder, given = asked["step"], Path(asked["folder"]), asked

    def work(id):
        tried = folder / f"{id}.tried"
        before = tried.exists()
        tried.touch()
        time.sleep(given.get("takes", 0.0))
        if id in given.get("deadly", ()) or (id in given.get("once", ()) and not before):
            faulthandler.disable()  # of pytest, which would print all that the system knows
            os.kill(os.getpid(), given.get("how", 9))
        if id in given.get("wrong", ()):
            raise RecordError("is wrong", file=id)
        (folder / id).write_text(f"{os.getpid()}")

    def refuse(id, reason):
        if id in given.get("stubborn", ()):
            os.kill(os.getpid(), 9)
        (folder / id).write_text(f"refused: {reason}")

    if given.get("held"):
        return _held(folder)
    if given.get("killed"):
        os.kill(os.getpid(), 9)
    ids = [id for id in given["ids"] if not (folder / id).exists()]
    done = on_each(
        step, ids, work=work, refuse=refuse, died=died, begin=begin,
        log_of=lambda id: folder / f"{id}.log",
    )  # fmt: skip
    return 0 if done else 1


def _held(folder):
    """Something that is cleared away slowly."""
    (folder / "temporary").touch()
    try:
        time.sleep(60)
    finally:
        time.sleep(0.5)
        (folder / "temporary").unlink()
    return 0
