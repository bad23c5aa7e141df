"""The best clearances of one rig by a dense search that knows nothing of the answer.

It takes many times as long as an answer, and does not depend on it: it is kept, a file a rig.
"""

from __future__ import annotations

import math
import time

import numpy as np
from benchmarks.design.kept import TRUTHS, keep, kept
from benchmarks.design.rigs import SEED, cheaper_models, rig_of, span_of

from vinesexp.design.ensemble import duration_of, together, watched
from vinesexp.design.task import Task, random_starts, wall_starts

CRITERIA = {"mean": "mean from rest", "max": "largest from rest", "robust": "90th percentile"}
#: Clearances of the scan, over WIDER than the span that an answer looks at, and how many minima of
#: each criterion are looked at closer: so many clearances between the neighbours, then so many
#: within NEAR of the lowest, which a jump may be beside.
DENSE, WIDER, MINIMA, CLOSER, NEAR, NEAREST = 60, 1.5, 3, 9, 0.02, 17
#: Phases and random starts of a clearance in scan and closer looks, and beside the lowest.
SCAN, BESIDE = (8, 40), (24, 100)
#: The lowest by each criterion are judged by fresh starts, so many, and fewer where a run lasts
#: LONG cycles.
LOWEST, FINE, FINE_LONG, LONG = 3, (600, 600), (200, 300), 700.0


def runs_of(
    task: Task, b: np.ndarray, many: tuple[int, int], shift: float, seed: int
) -> np.ndarray:
    """Mean and largest from rest, 90th percentile over random starts, at each b; shape (3, n).

    Watched to the end, however long: a capture that takes long counts here too.
    """
    phases, starts = many

    each = b.tolist()
    walls = [wall_starts(task, one, phases=phases, shift=shift) for one in each]
    drawn = [random_starts(task, one, starts=starts, seed=seed) for one in each]
    rest, free = watched(together(walls), starts=phases), watched(together(drawn), starts=starts)
    return np.array(
        [
            rest.mean.reshape(b.size, -1).mean(axis=1),
            rest.largest.reshape(b.size, -1).mean(axis=1),
            np.percentile(free.mean.reshape(b.size, -1), 90.0, axis=1),
        ]
    )


def judged(task: Task, b: np.ndarray) -> np.ndarray:
    """The three criteria by the starts that count, the same at every clearance."""
    f = task.frequencies[0]
    long = duration_of(task.rig(float(b[0])), f)[1] * f > LONG
    return runs_of(task, b, FINE_LONG if long else FINE, 0.15, SEED + 1)


def truth_of(index: int) -> dict[str, float]:
    """The least of each criterion and where it is; regret of each model cheaper than an answer."""
    known = kept(TRUTHS, index)
    if known is not None:
        return known
    begin, task = time.process_time(), rig_of(index)
    cheaper = cheaper_models(task)
    low, high = span_of(task)
    b = np.geomspace(low / WIDER, high * WIDER, DENSE)
    values = runs_of(task, b, SCAN, 0.7, SEED)
    places = np.concatenate([_between(b, row) for row in values])
    more = np.unique(places)
    b = np.concatenate([b, more])
    values = np.concatenate([values, runs_of(task, more, SCAN, 0.7, SEED)], axis=1)
    shares = np.linspace(1.0 - NEAR, 1.0 + NEAR, NEAREST)
    near = np.unique(np.concatenate([b[row.argmin()] * shares for row in values]))
    values = runs_of(task, near, BESIDE, 0.45, SEED + 2)
    lowest = np.unique(near[np.argsort(values, axis=1)[:, :LOWEST]])
    finite = [one for one, _ in cheaper.values() if math.isfinite(one)]
    final = np.concatenate([lowest, finite])
    values = judged(task, final)
    row: dict[str, float] = {"rig": index}
    for k, name in enumerate(CRITERIA):
        row[f"least_{name}_b"] = float(final[values[k].argmin()])
        row[f"least_{name}"] = float(values[k].min())
        for model, (clearance, seconds) in cheaper.items():
            there = np.abs(final - clearance).argmin() if math.isfinite(clearance) else None
            worth = math.nan if there is None else float(values[k][there] / values[k].min() - 1.0)
            row[f"{model}_{name}"], row[f"{model}_s"] = worth, seconds
    row["truth_s"] = time.process_time() - begin
    keep(TRUTHS, row)
    return row


def _between(b: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Clearances between the neighbours of each of the lowest minima."""
    padded = np.concatenate([[np.inf], value, [np.inf]])
    minima = np.flatnonzero((value <= padded[:-2]) & (value <= padded[2:]))
    minima = minima[np.argsort(value[minima])][:MINIMA]
    ends = [(b[max(i - 1, 0)], b[min(i + 1, b.size - 1)]) for i in minima]
    return np.concatenate([np.geomspace(*pair, CLOSER + 2)[1:-1] for pair in ends])
