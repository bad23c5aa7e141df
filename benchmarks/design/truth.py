"""The best clearances of one rig by a dense search that knows nothing of the answer.

It takes many times as long as an answer, and does not depend on it: it is kept, a file a rig.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np
from benchmarks.design.kept import TRUTHS, keep, kept
from benchmarks.design.rigs import SEED, cheaper_models, rig_of, span_of

from vinesexp.design.ensemble import duration_of, together, watched
from vinesexp.design.task import Task, random_starts, wall_starts

CRITERIA = {"mean": "mean from rest", "max": "largest from rest", "robust": "90th percentile"}
#: Which of them are known from random starts; the others are from starts from rest.
ANYWHERE = {"mean": False, "max": False, "robust": True}
#: Clearances of the scan, over WIDER than the span that an answer looks at, and how many minima of
#: each criterion are looked at closer: so many clearances between the neighbours, then so many
#: within NEAR of the lowest, which a jump may be beside. A closer look takes the starts of its
#: criterion alone.
DENSE, WIDER, MINIMA, CLOSER, NEAR, NEAREST = 60, 1.25, 3, 9, 0.02, 17
#: Phases and random starts of a clearance in scan and closer looks, and beside the lowest.
SCAN, BESIDE = (8, 40), (24, 100)
#: The lowest by each criterion are judged by fresh starts, so many, and fewer where a run lasts
#: LONG cycles.
LOWEST, FINE, FINE_LONG, LONG = 3, (600, 600), (200, 300), 700.0


def values_of(
    task: Task, names: Sequence[str], b: np.ndarray, many: tuple[int, int], shift: float, seed: int
) -> np.ndarray:
    """Some criteria at each b, shape (names, n), those of one kind by the same starts.

    Watched to the end, however long: a capture that takes long counts here too.
    """
    (phases, starts), found = many, {}
    each = b.tolist()
    if not all(ANYWHERE[name] for name in names):
        walls = [wall_starts(task, one, range(phases), shift=shift) for one in each]
        rest = watched(together(walls), starts=phases)
        found["mean"] = rest.mean.reshape(b.size, -1).mean(axis=1)
        found["max"] = rest.largest.reshape(b.size, -1).mean(axis=1)
    if any(ANYWHERE[name] for name in names):
        drawn = [random_starts(task, one, starts=starts, seed=seed) for one in each]
        free = watched(together(drawn), starts=starts)
        found["robust"] = np.percentile(free.mean.reshape(b.size, -1), 90.0, axis=1)
    return np.array([found[name] for name in names])


def judged(task: Task, names: Sequence[str], b: np.ndarray) -> np.ndarray:
    """Some criteria by the starts that count, the same at every clearance."""
    f = task.frequencies[0]
    long = duration_of(task.rig(float(b[0])), f)[1] * f > LONG
    return values_of(task, names, b, FINE_LONG if long else FINE, 0.15, SEED + 1)


def truth_of(index: int) -> dict[str, float]:
    """The least of each criterion and where it is; regret of each model cheaper than an answer."""
    known = kept(TRUTHS, index)
    if known is not None:
        return known
    begin, task = time.process_time(), rig_of(index)
    cheaper = cheaper_models(task)
    low, high = span_of(task)
    grid = np.geomspace(low / WIDER, high * WIDER, DENSE)
    scan = values_of(task, tuple(CRITERIA), grid, SCAN, 0.7, SEED)
    finite = {model: one for model, (one, _) in cheaper.items() if math.isfinite(one)}
    others = judged(task, tuple(CRITERIA), np.array(list(finite.values())))
    row: dict[str, float] = {"rig": index}
    for k, name in enumerate(CRITERIA):
        more = np.unique(_between(grid, scan[k]))
        b = np.concatenate([grid, more])
        values = np.concatenate([scan[k], values_of(task, [name], more, SCAN, 0.7, SEED)[0]])
        near = b[values.argmin()] * np.linspace(1.0 - NEAR, 1.0 + NEAR, NEAREST)
        values = values_of(task, [name], near, BESIDE, 0.45, SEED + 2)[0]
        lowest = near[np.argsort(values)[:LOWEST]]
        final = np.concatenate([lowest, list(finite.values())])
        values = np.concatenate([judged(task, [name], lowest)[0], others[k]])
        row[f"least_{name}_b"] = float(final[values.argmin()])
        row[f"least_{name}"] = float(values.min())
        worth = dict(zip(finite, others[k] / values.min() - 1.0, strict=True))
        for model, (_, seconds) in cheaper.items():
            row[f"{model}_{name}"] = float(worth.get(model, math.nan))
            row[f"{model}_s"] = seconds
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
