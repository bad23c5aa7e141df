"""What a clearance gives when one value of the rig or the excitation is not what was planned."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vinesexp.design.best_clearance import HASTE, Effort
from vinesexp.design.compared import PERCENTILE
from vinesexp.design.ensemble import responses
from vinesexp.design.task import Task, random_starts, wall_starts

#: Changes of b, G, f and r that the robust clearance is tried under.
CHANGES = (-0.10, -0.05, 0.05, 0.10)


@dataclass(frozen=True)
class Changed:
    """A clearance with one value off: from rest and from random starts, m.

    Attributes
    ----------
    name, change : which value, and by what share; "" and 0 where nothing is off.
    rest_mean : mean amplitude from rest.
    random_p90 : 90th percentile over random starts of the mean amplitude.
    captured : share of random starts.
    bare : mean amplitude of the oscillator alone under the same.
    """

    name: str
    change: float
    rest_mean: float
    random_p90: float
    captured: float
    bare: float


def changes(task: Task, b: float, effort: Effort, *, seed: int) -> tuple[Changed, list[Changed]]:
    """The clearance b as it is, and with b, G, f or r off by 5 and 10 %; by the same starts."""
    found = []
    for name in ("b", "G", "f", "r"):
        for change in CHANGES:
            case, clearance = _moved(task, b, name, 1.0 + change)
            if any(r > 1.0 for r in case.r):
                continue
            found.append(_seen(case, clearance, effort, seed, name, change))
    return _seen(task, b, effort, seed, "", 0.0), found


def _seen(task: Task, b: float, effort: Effort, seed: int, name: str, change: float) -> Changed:
    rest = responses(wall_starts(task, b, phases=effort.phases), haste=HASTE)
    anywhere = responses(random_starts(task, b, starts=effort.starts, seed=seed), haste=HASTE)
    return Changed(
        name=name,
        change=change,
        rest_mean=float(task.average(rest.mean)),
        random_p90=float(np.percentile(anywhere.mean, PERCENTILE)),
        captured=float(anywhere.captured.mean()),
        bare=task.mean_bare(),
    )


def _moved(task: Task, b: float, name: str, factor: float) -> tuple[Task, float]:
    def scaled(pair: tuple[float, float]) -> tuple[float, float]:
        return pair[0] * factor, pair[1] * factor

    if name == "b":
        return task, b * factor
    if name == "G":
        return replace(task, levels=scaled(task.levels)), b
    if name == "f":
        return replace(task, frequencies=scaled(task.frequencies)), b
    return replace(task, r=tuple(r * factor for r in task.r)), b
