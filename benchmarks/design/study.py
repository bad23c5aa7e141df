"""One rig: what `design` recommends, against the dense search, by fresh starts."""

from __future__ import annotations

import time
from functools import cache

import numpy as np
from benchmarks.design.rigs import MODELS, SEED, rig_of
from benchmarks.design.truth import CRITERIA, judged, truth_of

from vinesexp.design.advice import advise
from vinesexp.design.ensemble import watched
from vinesexp.design.task import random_starts

#: Random starts by which the captured share is checked.
CAPTURED_STARTS = 400


@cache
def compiled() -> None:
    """What is compiled, or read from where it is kept compiled, is no part of an answer's time."""
    advise(rig_of(0), budget=0.05)


def study(index: int) -> dict[str, float]:
    """One rig: regret of every model, error of the captured share, processor times."""
    task, truth = rig_of(index), truth_of(index)
    compiled()
    begin, wall = time.process_time(), time.perf_counter()
    advice = advise(task, seed=index)
    spent, waited = time.process_time() - begin, time.perf_counter() - wall
    drawn = random_starts(task, advice.robust.b, starts=CAPTURED_STARTS, seed=SEED + 3)
    fresh = watched(drawn, starts=CAPTURED_STARTS)
    row = truth | {
        "eps": task.eps, "zeta": task.oscillator.zeta, "r": task.r[0],
        "omega": task.frequencies[0] / task.oscillator.f0, "bare": advice.bare,
        "captured_error": advice.robust.captured - float(fresh.captured.mean()),
        "recommended_s": spent, "wall_s": waited,
        "reduction": 1.0 - advice.least_mean.rest_mean / advice.bare,
    }  # fmt: skip
    chosen = (advice.least_mean.b, advice.least_max.b, advice.robust.b)
    values = {}
    for names in (["mean", "max"], ["robust"]):
        b = np.array([*chosen, *(truth[f"least_{name}_b"] for name in names)])
        values |= dict(zip(names, judged(task, names, b), strict=True))
    for k, name in enumerate(CRITERIA):
        least = float(values[name].min())
        row[f"recommended_{name}_b"] = chosen[k]
        row[f"recommended_{name}"] = float(values[name][k]) / least - 1.0
        if least < truth[f"least_{name}"]:  # the answer found a better one than the dense search
            for model in MODELS:
                if model != "recommended":
                    worth = (1.0 + row[f"{model}_{name}"]) * truth[f"least_{name}"] / least - 1.0
                    row[f"{model}_{name}"] = worth
    return row
