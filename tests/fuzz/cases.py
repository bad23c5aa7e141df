"""One case by its name, ``target:number``, judged: what happened and how long it took."""

from __future__ import annotations

import random
import resource
import shutil
import time
import traceback
import warnings
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

from .in_process import no_child
from .targets import TARGETS

SLOW = 10.0  # s of the processor


@dataclass(frozen=True)
class Outcome:
    """What became of a case.

    Parameters
    ----------
    case : str
        Its name.
    word : str
        ``ok``, ``refused``, ``looked at``; ``FOUND`` where something is wrong.
    detail : str
        The traceback of what was found.
    seconds : float
        Of the processor, child processes included.
    """

    case: str
    word: str
    detail: str
    seconds: float


def run_case(case: str, folder: Path, *, child: bool = True) -> Outcome:
    """Run a case in `folder`, which is emptied before; binary files in a child process or not.

    A slow case runs a second time: the first to meet a compiled function waits for its compilation.
    """
    outcome = _run_once(case, folder, child=child)
    if outcome.seconds > SLOW:
        outcome = _run_once(case, folder, child=child)
        if outcome.seconds > SLOW:
            detail = f"{outcome.seconds:.1f} s of the processor\n{outcome.detail}"
            outcome = replace(outcome, word="FOUND", detail=detail)
    if outcome.word == "FOUND" and not child:
        return run_case(case, folder)
    return outcome


def _run_once(case: str, folder: Path, *, child: bool) -> Outcome:
    target, _, number = case.partition(":")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    rng = random.Random(f"{target}:{number}")
    started = _used()
    detail = ""
    try:
        with warnings.catch_warnings(), nullcontext() if child else no_child():
            warnings.simplefilter("ignore")
            word = TARGETS[target](rng, folder)
    except Exception:
        word, detail = "FOUND", traceback.format_exc()
    return Outcome(case, word, detail, _used() - started)


def _used() -> float:
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime
