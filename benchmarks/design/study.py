"""One rig: what `design` recommends, against a dense search with fresh starts."""

from __future__ import annotations

import math
import time

import numpy as np
from benchmarks.design.rigs import SEED, cheaper_models, rig_of

from vinesexp.design.advice import Advice, advise
from vinesexp.design.ensemble import duration_of, watched
from vinesexp.design.task import Task, random_starts, wall_starts

#: The dense search: clearances over a wider span than the search itself, fresh phases and starts.
DENSE, PHASES, STARTS = 60, 8, 40
#: The lowest by each criterion are judged again with so many phases and starts, fewer where a run
#: lasts a thousand cycles or so.
LOWEST, FINE, FINE_STARTS = 3, 200, 400
LONG, FINE_LONG, FINE_STARTS_LONG = 700.0, 32, 160
#: Random starts by which the captured share is checked.
CAPTURED_STARTS = 400
CRITERIA = {"mean": "mean from rest", "max": "largest from rest", "robust": "90th percentile"}


def criteria(
    task: Task, b: np.ndarray, *, phases: int, shift: float, starts: int, seed: int
) -> np.ndarray:
    """Mean and largest from rest, 90th percentile over random starts, at each b; shape (3, n).

    Watched as the answer watches them: a capture that takes long counts here too.
    """
    rest = watched(
        [run for one in b for run in wall_starts(task, one, phases=phases, shift=shift)],
        starts=phases,
    )
    free = watched(
        [run for one in b for run in random_starts(task, one, starts=starts, seed=seed)],
        starts=starts,
    )
    return np.array(
        [
            rest.mean.reshape(b.size, -1).mean(axis=1),
            rest.largest.reshape(b.size, -1).mean(axis=1),
            np.percentile(free.mean.reshape(b.size, -1), 90.0, axis=1),
        ]
    )


def dense(task: Task, advice: Advice, cheaper: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """The lowest of a dense search, b_c and what was recommended, judged with many fresh starts.

    Returns
    -------
    b : ndarray, shape (n,)
    values : ndarray, shape (3, n)
        The three criteria.
    """
    low, high = advice.found.grid[0], advice.found.grid[-1]
    places = [advice.least_mean.b, advice.least_max.b, advice.robust.b]
    places += [b for b in cheaper if math.isfinite(b)]
    near = np.array([0.9, 0.95, 0.98, 1.02, 1.05])
    b = np.concatenate(
        [np.geomspace(low / 1.5, high * 1.5, DENSE), *(one * near for one in places[:3])]
    )
    values = criteria(task, b, phases=PHASES, shift=0.7, starts=STARTS, seed=SEED)
    lowest = np.argsort(values, axis=1)[:, :LOWEST].ravel()
    b = np.unique(np.concatenate([b[lowest], places]))
    f = task.frequencies[0]
    long = duration_of(task.rig(advice.robust.b), f)[1] * f > LONG
    phases, starts = (FINE_LONG, FINE_STARTS_LONG) if long else (FINE, FINE_STARTS)
    return b, criteria(task, b, phases=phases, shift=0.15, starts=starts, seed=SEED + 1)


def study(index: int) -> dict[str, float]:
    """One rig: regret of every model, error of the captured share, processor times."""
    task = rig_of(index)
    cheaper = cheaper_models(task)
    begin, wall = time.process_time(), time.perf_counter()
    advice = advise(task, seed=index)
    spent, waited = time.process_time() - begin, time.perf_counter() - wall
    b, values = dense(task, advice, [clearance for clearance, _ in cheaper.values()])

    def regret(clearance: float, which: int) -> float:
        if not math.isfinite(clearance):
            return math.nan
        return float(values[which][np.abs(b - clearance).argmin()] / values[which].min() - 1.0)

    drawn = random_starts(task, advice.robust.b, starts=CAPTURED_STARTS, seed=SEED + 2)
    fresh = watched(drawn, starts=CAPTURED_STARTS)
    o = task.oscillator
    row = {
        "rig": index, "eps": task.eps, "zeta": o.zeta, "r": task.r[0],
        "omega": task.frequencies[0] / o.f0, "bare": advice.bare,
        "captured_error": advice.robust.captured - float(fresh.captured.mean()),
        "recommended_s": spent, "wall_s": waited,
        "reduction": 1.0 - advice.least_mean.rest_mean / advice.bare,
    }  # fmt: skip
    chosen = (advice.least_mean.b, advice.least_max.b, advice.robust.b)
    for k, name in enumerate(CRITERIA):
        row[f"recommended_{name}_b"] = chosen[k]
        row[f"least_{name}_b"] = float(b[values[k].argmin()])
        row[f"recommended_{name}"] = regret(chosen[k], k)
        for model, (clearance, seconds) in cheaper.items():
            row[f"{model}_{name}"] = regret(clearance, k)
            row[f"{model}_s"] = seconds
    return row
