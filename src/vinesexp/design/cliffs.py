"""How far from a clearance the amplitude jumps: the cliff on either side of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.design.best_clearance import Effort
from vinesexp.design.compared import WORSE
from vinesexp.design.ensemble import responses
from vinesexp.design.task import Task, random_starts, wall_starts

#: Shares of the clearance by which it is changed, either way.
STEPS = (0.006, 0.012, 0.018, 0.025, 0.035, 0.05, 0.075, 0.1)
#: A cliff stands where the amplitude is this much of that at the clearance.
JUMP = 1.25
#: Starts with which it is looked for, in those of the search: the more where the fewer leave it in
#: doubt; what these leave in doubt is called a cliff.
MORE = (1, 4)


@dataclass(frozen=True)
class Side:
    """One side of a clearance.

    Attributes
    ----------
    clear : share by which the clearance can be changed without a jump.
    jump : share at which there is one, None where there is none as far as was looked.
    before, amplitude : what the clearance itself and what the one beyond the jump gives, m: mean
        from rest or mean of random starts, whichever jumps higher.
    """

    clear: float
    jump: float | None = None
    before: float | None = None
    amplitude: float | None = None


@dataclass(frozen=True)
class Cliffs:
    """Both sides of a clearance."""

    narrower: Side
    wider: Side


def cliffs_of(task: Task, b: float, effort: Effort, *, seed: int) -> Cliffs:
    """Look at clearances beside b, each exactly as wide as it says, under the same starts.

    In runs of full length: just beyond the end of an orbit it takes long to be lost.
    """
    exact = replace(task, tolerance=0.0)

    @cache
    def seen(share: float, more: int) -> tuple[FloatArray, FloatArray]:
        rest = responses(wall_starts(exact, b * share, phases=more * effort.phases))
        by_phase = rest.mean.reshape(len(exact.grid()), -1).T
        drawn = random_starts(exact, b * share, starts=more * effort.starts, seed=seed)
        return np.array([exact.average(one) for one in by_phase]), responses(drawn).mean

    return Cliffs(_side(seen, -1.0), _side(seen, 1.0))


def _side(seen: Callable[[float, int], tuple[FloatArray, FloatArray]], way: float) -> Side:
    clear = 0.0
    for step in STEPS:
        for more in MORE:
            found = list(zip(seen(1.0, more), seen(1.0 + way * step, more), strict=True))
            rises = [there.mean() / before.mean() for before, there in found]
            most = int(np.argmax(rises))
            before, there = found[most]
            if rises[most] <= JUMP:
                break
            if no_accident(before, there) or more == MORE[-1]:
                return Side(clear, step, float(before.mean()), float(there.mean()))
        clear = step
    return Side(clear)


def no_accident(before: FloatArray, there: FloatArray) -> bool:
    """Whether the mean over the same starts is higher, by more than twice the error of that.

    Examples
    --------
    >>> no_accident(np.array([1.0, 1.1, 0.9, 1.0]), np.array([1.4, 1.5, 1.3, 1.4]))
    True
    >>> no_accident(np.array([1.0, 1.1, 0.9, 1.0]), np.array([1.0, 1.1, 0.9, 2.4]))
    False
    """
    excess = there - before
    doubt = float(excess.std(ddof=1)) / np.sqrt(excess.size)
    return bool(excess.mean() > WORSE * doubt)
