"""The random rigs of the study, and the models that are cheaper than `vinesexp design`."""

from __future__ import annotations

import math
import time

import numpy as np

from vinesexp import Oscillator
from vinesexp.design.advice import theory_of
from vinesexp.design.ask import DRILLED
from vinesexp.design.best_clearance import scan_ends
from vinesexp.design.ensemble import responses, together
from vinesexp.design.task import Task, wall_starts
from vinesexp.errors import AnalysisError
from vinesexp.theory import boundaries, orbits

SEED = 20260101
#: Base amplitude, m. All lengths scale with it; a metre would be warned of.
LEVEL = 1e-4
#: Rigs that the study asks for.
RIGS = 300
#: Models from cheap to dear: the name in a row, and how the page calls it.
MODELS = {
    "published": "b_c published, formula (36)",
    "exact": "b_c exact, Floquet multipliers",
    "orbit": "least amplitude on the exact orbit",
    "quick": "quick scan: 12 clearances, 2 phases",
    "recommended": "`vinesexp design`",
}


def rig_of(index: int) -> Task:
    """Log-random rig: eps 1e-4 to 0.1, zeta 1e-4 to 0.05, r 0.2 to 0.95, frequency within 5 %.

    The cavity is as exact as a drilled one, as in every answer that is not told otherwise.
    """
    rng = np.random.default_rng([SEED, index])
    eps, zeta = 10.0 ** rng.uniform(-4.0, -1.0), 10.0 ** rng.uniform(-4.0, math.log10(0.05))
    r, omega = rng.uniform(0.2, 0.95), rng.uniform(0.95, 1.05)
    f = omega / (2.0 * math.pi)
    o = Oscillator(M=1.0, c1=2.0 * zeta, k1=1.0)
    return Task(o, (eps,), (r,), levels=(LEVEL, LEVEL), frequencies=(f, f), tolerance=DRILLED)


def span_of(task: Task) -> tuple[float, float]:
    """Clearances between which an answer looks, m."""
    published, exact = theory_of(task, task.levels[1], task.frequencies[0])
    return scan_ends(bare=task.largest_bare(), published=published, exact=exact)


def cheaper_models(task: Task) -> dict[str, tuple[float, float]]:
    """Clearance (m) and processor time (s) of each model cheaper than `design`."""
    G, f = task.levels[1], task.frequencies[0]
    found: dict[str, tuple[float, float]] = {}
    published, _ = theory_of(task, G, f)
    found["published"] = published, 5e-6
    begin = time.process_time()
    exact = theory_of(task, G, f)[1]
    found["exact"] = (math.nan if exact is None else exact), time.process_time() - begin
    begin = time.process_time()
    found["orbit"] = _least_on_orbit(task, G, f), time.process_time() - begin
    begin = time.process_time()
    b = np.geomspace(*span_of(task), 12)
    runs = together([wall_starts(task, one, range(2)) for one in b.tolist()])
    means = responses(runs, haste=2.0).mean.reshape(b.size, -1).mean(axis=1)
    found["quick"] = float(b[means.argmin()]), time.process_time() - begin
    return found


def _least_on_orbit(task: Task, G: float, f: float) -> float:
    o = task.oscillator
    p = orbits.Reduced.of_rig(M=o.M, c1=o.c1, k1=o.k1, m=sum(task.masses), r=task.r[0], frequency=f)
    try:
        ends = boundaries.end_of_permanent_response(p)
    except AnalysisError:
        return math.nan
    C = np.linspace(float(ends.C_low), float(ends.C_high), 400)
    point = orbits.family(C, p)
    return float(G * point.b[int(np.argmin(point.amplitude))])
