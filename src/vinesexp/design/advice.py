"""What to build and what it gives: the search, each clearance judged afresh, theory beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vinesexp.design.absorber import Absorber, equal_mass_den_hartog, equal_mass_optimal
from vinesexp.design.best_clearance import PERCENTILE, Effort, Found, scan_ends, search
from vinesexp.design.ensemble import cut_short, responses
from vinesexp.design.slow_sweep import Swept, slow_sweeps
from vinesexp.design.task import Task, centre_starts, random_starts, wall_starts
from vinesexp.errors import AnalysisError
from vinesexp.theory.optimal_clearance import b_c_exact, b_c_published
from vinesexp.theory.orbits import Reduced, amplitudes_at, family

#: Shares of the exact b_c that the scan looks at besides its grid.
NEAR_B_C = (0.85, 0.9, 0.95, 0.98, 1.0)
#: Changes of b, G, f and r that the robust clearance is tried under.
CHANGES = (-0.10, -0.05, 0.05, 0.10)
#: A clearance works where it leaves at most this share of the bare amplitude.
WORKS = 0.8
#: At least so many random starts tell the captured share of the robust clearance: its standard
#: error is then 0.05 at most.
SHARE_STARTS = 100


@dataclass(frozen=True)
class Judged:
    """What one clearance gives, by starts it was not chosen with; lengths in m.

    Attributes
    ----------
    b : clearance (the largest, of several balls).
    rest_mean, rest_max : oscillator at rest, balls at their walls: mean amplitude, and the largest
        amplitude, both averaged over the phase at which the shaker starts.
    random_mean, random_p90, random_max : random starts: mean amplitude, its 90th percentile over
        starts, the largest amplitude of any start.
    random_bare : mean amplitude of the oscillator alone over the same draws.
    captured, captured_rest : share of random starts, and of those from rest, that are captured.
    centre_mean : ball at rest in the middle of its cavity.
    centre_touched : whether a wall meets that ball at all once the motion has settled.
    """

    b: float
    rest_mean: float
    rest_max: float
    random_mean: float
    random_p90: float
    random_max: float
    random_bare: float
    captured: float
    captured_rest: float
    centre_mean: float
    centre_touched: bool


@dataclass(frozen=True)
class Changed:
    """The robust clearance with one value off: from rest and from random starts, m."""

    name: str
    change: float
    rest_mean: float
    random_p90: float
    captured: float


@dataclass(frozen=True)
class Range:
    """Levels (m) around the given one at which a clearance works from rest, and the least level
    at which half of the starts from rest are captured; None where there is none.
    """

    activation: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Advice:
    """The answer of a design; lengths in m.

    Attributes
    ----------
    bare : amplitude of the oscillator alone, the largest over the ranges designed for.
    bare_mean : its mean over the ranges, with which mean amplitudes are compared.
    published, exact : b_c at the greatest level and the middle frequency; None: no stable orbit.
    orbit : amplitude of the exact orbit at 0.98 b_c, and what a start from rest gives there.
    sweeps : slow ones with the robust clearance, up and down.
    watched : share of the time to settle that was run; below 1 where that would be too long.
    """

    task: Task
    bare: float
    bare_mean: float
    published: float
    exact: float | None
    orbit: tuple[float, float] | None
    found: Found
    least_mean: Judged
    least_max: Judged
    robust: Judged
    changed: list[Changed]
    working: Range | None
    den_hartog: Absorber
    optimal: Absorber
    sweeps: tuple[Swept, Swept]
    watched: float
    seed: int


def advise(task: Task, *, seed: int = 1) -> Advice:
    """Search the clearances of a task and judge them.

    Parameters
    ----------
    task : Task
    seed : int
        Of the random starts.

    Raises
    ------
    AnalysisError
        An oscillator past damping ratio 0.9, or undamped exactly at resonance.
    """
    G = task.levels[1]
    f = min(max(task.oscillator.f0, task.frequencies[0]), task.frequencies[1])
    bare = task.largest_bare()
    published, exact = theory_of(task, G, f)
    ends = scan_ends(bare=bare, published=published, exact=exact)
    marks = [] if exact is None else [share * exact for share in NEAR_B_C]
    found = search(task, ends=ends, marks=marks, seed=seed)
    judged = {
        b: judge(task, b, found.effort, seed=seed + 2, starts=found.effort.fresh)
        for b in (found.least_mean, found.least_max)
    }
    many = max(2 * found.effort.fresh, SHARE_STARTS)
    judged[found.robust] = judge(task, found.robust, found.effort, seed=seed + 2, starts=many)
    return Advice(
        task=task,
        bare=bare,
        bare_mean=task.mean_bare(),
        published=published,
        exact=exact,
        orbit=None
        if exact is None
        else orbit_and_rest(task, 0.98 * exact, f, phases=2 * found.effort.phases),
        found=found,
        least_mean=judged[found.least_mean],
        least_max=judged[found.least_max],
        robust=judged[found.robust],
        changed=changes(task, found.robust, found.effort, seed=seed + 3),
        working=working_range(task, found) if len(task.grid()) == 1 else None,
        den_hartog=equal_mass_den_hartog(task),
        optimal=equal_mass_optimal(task),
        sweeps=slow_sweeps(task, found.robust),
        watched=min(cut_short(task.rig(found.robust), f) for f in task.frequencies),
        seed=seed,
    )


def theory_of(task: Task, G: float, frequency: float) -> tuple[float, float | None]:
    """b_c published and exact (m) of all balls taken as one; None where no orbit is stable."""
    o, mass, r = task.oscillator, sum(task.masses), task.r[0]
    published = float(b_c_published(G=G, eps=mass / o.M, lam=o.c1 / (mass * o.w0), r=r))
    try:
        exact = float(b_c_exact(G=G, M=o.M, c1=o.c1, k1=o.k1, m=mass, r=r, frequency=frequency))
    except AnalysisError:
        return published, None
    return published, exact


def judge(task: Task, b: float, effort: Effort, *, seed: int, starts: int) -> Judged:
    """One clearance under fresh starts, `starts` of them random."""
    rest = responses(wall_starts(task, b, phases=2 * effort.phases, shift=0.4))
    drawn = random_starts(task, b, starts=starts, seed=seed)
    anywhere = responses(drawn)
    centre = responses(centre_starts(task, b, phases=2))
    return Judged(
        b=b,
        rest_mean=float(task.average(rest.mean)),
        rest_max=float(task.worst(rest.largest)),
        random_mean=float(anywhere.mean.mean()),
        random_p90=float(np.percentile(anywhere.mean, PERCENTILE)),
        random_max=float(anywhere.largest.max()),
        random_bare=float(np.mean([task.bare_of(run) for run in drawn])),
        captured=float(anywhere.captured.mean()),
        captured_rest=float(task.share(rest.captured)),
        centre_mean=float(task.average(centre.mean)),
        centre_touched=bool((centre.impacts_per_cycle > 0.0).any()),
    )


def orbit_and_rest(task: Task, b: float, frequency: float, *, phases: int) -> tuple[float, float]:
    """Amplitude of the exact orbit at b, and the mean amplitude of starts from rest there (m)."""
    o, G = task.oscillator, task.levels[1]
    p = Reduced.of_rig(
        M=o.M, c1=o.c1, k1=o.k1, m=sum(task.masses), r=task.r[0], frequency=frequency
    )
    orbit = G * float(family(amplitudes_at(b / G, p)[1], p).amplitude)
    one = replace(task, levels=(G, G), frequencies=(frequency, frequency))
    rest = responses(wall_starts(one, b, phases=phases))
    return orbit, float(rest.mean.mean())


def changes(task: Task, b: float, effort: Effort, *, seed: int) -> list[Changed]:
    """The clearance b with b, G, f or r off by 5 and 10 %."""
    found = []
    for name in ("b", "G", "f", "r"):
        for change in CHANGES:
            case, clearance = _moved(task, b, name, 1.0 + change)
            if any(r > 1.0 for r in case.r):
                continue
            rest = responses(wall_starts(case, clearance, phases=effort.phases))
            anywhere = responses(random_starts(case, clearance, starts=effort.starts, seed=seed))
            found.append(
                Changed(
                    name,
                    change,
                    float(case.average(rest.mean)),
                    float(np.percentile(anywhere.mean, PERCENTILE)),
                    float(anywhere.captured.mean()),
                )
            )
    return found


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


def working_range(task: Task, found: Found) -> Range:
    """Levels at which the robust clearance works, from the scan at one level.

    Lengths scale together: clearance b under level G s does what b/s does under G, s times as
    large. So the scan over clearances is one over levels too.
    """
    G, b = task.levels[0], found.robust
    levels = G * b / found.grid[::-1]  # rising
    gain = found.rest.scan.mean.mean(axis=1)[::-1] / task.bare(G, task.frequencies[0])
    captured = found.rest.scan.captured.mean(axis=1)[::-1]
    active = np.flatnonzero(captured >= 0.5)
    works = gain <= WORKS
    low = high = int(np.abs(levels - G).argmin())
    while low > 0 and works[low - 1]:
        low -= 1
    while high < works.size - 1 and works[high + 1]:
        high += 1
    here = bool(works[np.abs(levels - G).argmin()])
    return Range(
        activation=float(levels[active[0]]) if active.size else None,
        # the given level lies between two of the scan
        low=min(float(levels[low]), G) if here else None,
        high=max(float(levels[high]), G) if here else None,
    )
