"""How far from a clearance the amplitude jumps: the cliff on either side of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.design.best_clearance import Effort
from vinesexp.design.ensemble import responses
from vinesexp.design.task import Task, random_starts, wall_starts

#: Shares of the clearance by which it is changed, either way.
STEPS = (0.006, 0.012, 0.018, 0.025, 0.035, 0.05, 0.075, 0.1)
#: A cliff stands where the amplitude is this much of that at the clearance.
JUMP = 1.25


@dataclass(frozen=True)
class Side:
    """One side of a clearance.

    Attributes
    ----------
    clear : share by which the clearance can be changed without a jump.
    jump : share at which there is one, None where there is none as far as was looked.
    amplitude : what stands there, m: the larger of the two measures (mean from rest, mean of random
        starts) where one has jumped.
    """

    clear: float
    jump: float | None
    amplitude: float | None


@dataclass(frozen=True)
class Cliffs:
    """Both sides of a clearance."""

    narrower: Side
    wider: Side


def cliffs_of(task: Task, b: float, effort: Effort, *, seed: int) -> Cliffs:
    """Look at clearances beside b, each exactly as wide as it says, under the same starts."""
    exact = replace(task, tolerance=0.0)

    def seen(share: float) -> tuple[float, float]:
        rest = responses(wall_starts(exact, b * share, phases=effort.phases))
        drawn = random_starts(exact, b * share, starts=effort.starts, seed=seed)
        return float(exact.average(rest.mean)), float(responses(drawn).mean.mean())

    own = np.array(seen(1.0))
    return Cliffs(_side(own, seen, -1.0), _side(own, seen, 1.0))


def _side(own: FloatArray, seen: Callable[[float], tuple[float, float]], way: float) -> Side:
    clear = 0.0
    for step in STEPS:
        there = np.array(seen(1.0 + way * step))
        jumped = there > JUMP * own
        if jumped.any():
            return Side(clear, step, float(there[jumped].max()))
        clear = step
    return Side(clear, None, None)
