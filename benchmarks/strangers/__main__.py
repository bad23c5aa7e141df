"""One line for each file of a folder: read, roles, kind, value, and whether it was right."""

from __future__ import annotations

import argparse
import signal
import sys
import warnings
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vinesexp.errors import VinesexpError
from vinesexp.identification.ringdown import fit_ringdown
from vinesexp.proposal.kind_of_test import OPEN, describe_test
from vinesexp.proposal.roles import guess_roles, label_of
from vinesexp.proposal.survey import ColumnView, FileView, view_file
from vinesexp.records.campaign.schema import Channel, TimeColumn
from vinesexp.units import UNITS

from .independent import fit
from .true_times import read_at_true_times

_SIGMA = 4.0  # standard errors of the package that a value may be off by
_SAME_F, _SAME_ZETA = 0.005, 0.10  # relative, besides what the halves of the decay differ by
#: What a channel of a unit measures, by tables of units.
_MEASURED = (
    ("acceleration", "acceleration"),
    ("velocity", "velocity"),
    ("velocity", "rate of turn"),
    ("displacement", "angle"),
)
WORDS = ("right", "refused", "open", "no peer", "CONFIDENTLY WRONG", "CRASH")


@dataclass(frozen=True)
class Line:
    """What became of one file."""

    word: str
    text: str


def judged(path: Path, seconds: int) -> Line:
    """Read a file as `look`, `init` and `check` do, and judge what comes out."""
    signal.signal(signal.SIGALRM, _too_long)
    signal.alarm(seconds)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            return _judged(path)
    except VinesexpError as error:
        return Line("refused", str(error).replace(str(path), path.name))
    except Exception as error:
        return Line("CRASH", f"{type(error).__name__}: {error}")
    finally:
        signal.alarm(0)


def _too_long(*_: object) -> None:
    raise TimeoutError("takes too long")


def _judged(path: Path) -> Line:
    view = view_file(path)
    guesses = guess_roles([view])
    test, _, why = describe_test(view, guesses)
    roles = ", ".join(
        f"{guesses[label_of(c)].role} {c.name or c.index}"
        for c in view.signals
        if label_of(c) in guesses
    )
    shown = f"{view.format}, {roles or 'no roles'}, {test}: {why}"
    if test == OPEN:
        return Line("open", shown)
    moving = [c for c in view.signals if label_of(c) in guesses and c.rate]
    ranked = sorted(moving, key=lambda c: guesses[label_of(c)].role != "displacement")
    if test != "ringdown" or not ranked:
        return Line("no peer", shown)
    return _compared(view, ranked[0], shown)


def _compared(view: FileView, column: ColumnView, shown: str) -> Line:
    """The value of a ring-down against the independent fit of the same column."""
    known = ((q, table) for q, table in _MEASURED if column.unit in UNITS[table])
    quantity, table = next(known, ("displacement", "displacement"))
    unit = column.unit if column.unit in UNITS[table] else None
    size = UNITS[table].get(column.unit or "", 1.0)  # of an angle the arc at 1 m
    role = "acceleration" if quantity == "acceleration" else "displacement"
    channel = Channel(role, column.index, quantity, size, unit=unit)
    time = None
    if view.time is not None:
        time = TimeColumn(view.time, view.time_unit, UNITS["time"].get(view.time_unit, 1.0))
    if column.unit in UNITS["voltage"]:  # of a sensor whose sensitivity nobody says
        x = column.finite
        t = np.arange(x.size) / float(column.rate or 1.0)
    else:
        t, values = read_at_true_times(
            view.path, {role: channel}, time=time, sample_rate=None if time else view.rate
        )
        x = values[role]
    try:
        found = fit_ringdown(x, times=t, frequency=column.peak()[0])
    except VinesexpError as error:
        return Line("refused", f"{shown}; {error.problem}")
    peer = fit(t, x, at=found.reference)
    value = (
        f"f0 {found.f0:.5g} +- {found.f0_error:.1g} Hz, zeta {found.zeta:.3g} +- "
        f"{found.zeta_error:.1g}"
    )
    if peer is None:
        return Line("no peer", f"{shown}; {value}; turning points: no decay")
    text = f"{shown}; {value}; turning points: {peer.f:.5g} Hz, {peer.zeta:.3g}"
    f_off = abs(found.f0 - peer.f) > _SIGMA * found.f0_error + peer.f_spread + _SAME_F * peer.f
    off = _SIGMA * found.zeta_error + peer.zeta_spread + _SAME_ZETA * peer.zeta
    wrong = f_off or abs(found.zeta - peer.zeta) > off
    return Line("CONFIDENTLY WRONG" if wrong else "right", text)


def main() -> int:
    """1 where a file was read confidently wrong, or anything crashed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.strangers", description=__doc__)
    parser.add_argument("folder", type=Path, help="of files that other people measured")
    parser.add_argument("--seconds", type=int, default=120, help="that one file may take")
    given = parser.parse_args()
    counted: Counter[str] = Counter()
    for path in sorted(p for p in given.folder.rglob("*") if p.is_file()):
        line = judged(path, given.seconds)
        counted[line.word] += 1
        print(f"{line.word:<18} {path.relative_to(given.folder)}: {line.text}", flush=True)
    print(", ".join(f"{counted[word]} {word}" for word in WORDS))
    return int(bool(counted["CONFIDENTLY WRONG"] + counted["CRASH"]))


if __name__ == "__main__":
    sys.exit(main())
