"""What to build and what it gives: the search, each clearance judged afresh, theory beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vinesexp.design.absorber import Absorber, equal_mass_den_hartog, equal_mass_optimal
from vinesexp.design.around import Changed, Cliffs, Range, changes, cliffs_of, operating_range
from vinesexp.design.best_clearance import Found, scan_ends, search
from vinesexp.design.compared import percentile, resampled
from vinesexp.design.ensemble import cut_short, responses
from vinesexp.design.slow_sweep import Swept, slow_sweeps
from vinesexp.design.task import Task, centre_starts, random_starts, wall_starts
from vinesexp.errors import AnalysisError
from vinesexp.theory.optimal_clearance import b_c_exact, b_c_published
from vinesexp.theory.orbits import Reduced, amplitudes_at, family

#: Shares of the exact b_c that the scan looks at besides its grid.
NEAR_B_C = (0.85, 0.9, 0.95, 0.98, 1.0)
#: Random starts that a clearance is judged by: as many as it was compared by, within these. With
#: the fewer the standard error of the captured share is 0.05 at most.
JUDGED = (100, 400)
#: Share of the bare amplitude below which nothing is called a gain.
WORTH = 0.05


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
    random_error : standard error of that percentile, from the number of starts.
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
    random_error: float
    random_max: float
    random_bare: float
    captured: float
    captured_rest: float
    centre_mean: float
    centre_touched: bool


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
    cliffs : how far the robust clearance stands from a jump of the amplitude.
    asked, asked_sweeps : the same of a clearance that was asked for; None where none was.
    unchanged, changed : the robust clearance as it is, and with one value off.
    working : levels at which the robust clearance works.
    watched : share of the time to settle that was run; below 1 where that would be too long.
    judged : random starts that each clearance was judged by.
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
    cliffs: Cliffs
    asked: Judged | None
    unchanged: Changed
    changed: list[Changed]
    working: Range
    den_hartog: Absorber
    optimal: Absorber
    sweeps: tuple[Swept, Swept]
    asked_sweeps: tuple[Swept, Swept] | None
    watched: float
    judged: int
    seed: int

    @property
    def gain(self) -> float:
        """Share of the bare amplitude that the best clearance takes, from rest or anywhere."""
        rest = 1.0 - min(self.least_mean.rest_mean, self.robust.rest_mean) / self.bare_mean
        return max(rest, 1.0 - self.robust.random_mean / self.robust.random_bare)

    @property
    def hopeless(self) -> bool:
        """Whether no clearance is worth building."""
        return self.gain < WORTH


def advise(task: Task, *, asked: float | None = None, seed: int = 1) -> Advice:
    """Search the clearances of a task and judge them.

    Parameters
    ----------
    task : Task
    asked : float, optional
        A clearance (the largest, of several balls) that is judged besides, m.
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
    low, high = scan_ends(bare=bare, published=published, exact=exact)
    ends = low, high / min(task.ratios)  # of several balls the least one has to get as far
    marks = [] if exact is None else [share * exact for share in NEAR_B_C]
    found = search(task, ends=ends, marks=marks, seed=seed)
    many = min(max(found.race.starts, JUDGED[0]), JUDGED[1])
    shown = {found.least_mean, found.least_max, found.robust}
    every = (*shown, *([] if asked is None else [asked]))
    judged = {b: judge(task, b, found, many, seed + 2) for b in every}
    unchanged, changed = changes(task, found.robust, found.effort, seed=seed + 3)
    return Advice(
        task=task,
        bare=bare,
        bare_mean=task.mean_bare(),
        published=published,
        exact=exact,
        orbit=None
        if exact is None
        else orbit_and_rest(task, 0.98 * exact, f, phases=found.effort.judged),
        found=found,
        least_mean=judged[found.least_mean],
        least_max=judged[found.least_max],
        robust=judged[found.robust],
        cliffs=cliffs_of(task, found.robust, found.effort, seed=seed + 3),
        asked=None if asked is None else judged[asked],
        unchanged=unchanged,
        changed=changed,
        working=operating_range(task, found),
        den_hartog=equal_mass_den_hartog(task),
        optimal=equal_mass_optimal(task),
        sweeps=slow_sweeps(task, found.robust),
        asked_sweeps=None if asked is None else slow_sweeps(task, asked),
        watched=min(cut_short(task.rig(found.robust), f) for f in task.frequencies),
        judged=many,
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


def judge(task: Task, b: float, found: Found, starts: int, seed: int) -> Judged:
    """One clearance: from rest, and under random starts that had no part in the choice."""
    rest = responses(wall_starts(task, b, phases=found.effort.judged, shift=0.4))
    drawn = random_starts(task, b, starts=starts, seed=seed)
    anywhere = responses(drawn)
    means = anywhere.mean
    centre = responses(centre_starts(task, b, phases=2))
    return Judged(
        b=b,
        rest_mean=float(task.average(rest.mean)),
        rest_max=float(task.worst(rest.largest)),
        random_mean=float(means.mean()),
        random_p90=percentile(means),
        random_error=float(resampled(means, 1).std()),
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
