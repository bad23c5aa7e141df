"""What to build and what it gives: the search, each clearance judged afresh, theory beside it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.design.around import (
    CHANGES,
    STEPS,
    Changed,
    Cliffs,
    Range,
    Starts,
    changes,
    cliffs_of,
    operating_range,
)
from vinesexp.design.best_clearance import (
    AFRESH,
    BESIDE,
    BUDGET,
    JUDGING,
    Found,
    affordable,
    parted,
    scan_ends,
    search,
    weighted_percentile,
)
from vinesexp.design.ensemble import duration_of, mean_of_cycle, responses, slow_time, watched
from vinesexp.design.task import WORTH, Task, centre_starts, random_starts, wall_starts
from vinesexp.errors import AnalysisError
from vinesexp.excitation import Release, Sweep, WeakDamping
from vinesexp.rig import Oscillator
from vinesexp.solver.simulation import simulate
from vinesexp.theory.optimal_clearance import b_c_exact, b_c_published
from vinesexp.theory.orbits import Reduced, amplitudes_at, family

#: Shares of the exact b_c that the scan looks at besides its grid.
NEAR_B_C = (0.85, 0.9, 0.95, 0.98, 1.0)
#: Random starts that a clearance is judged by: as many as it was compared by, and as the standard
#: error of the captured share needs, within these, as far as the budget goes.
JUDGED, SHARE_ERROR = (100, AFRESH), 0.025
#: Phases from rest of a clearance that is judged, random starts at the least; phases at the least,
#: in each part of the ranges and of the one excitation.
PHASES, FEWEST, FEWEST_PHASES = 48, 16, (1, 3)
#: Starts of what is shown beside: most phases from rest; least and most random ones.
SHOWN = 8, (2, 20)
#: Share of the work that looking for a jump may take where few starts leave it in doubt.
CLIFFS = 0.15
#: Draws of the starts with which the error of a percentile is found.
RESAMPLED = 200


# What a slow sweep up and one down find at a clearance: the response that a shaker test shows.
#
# A sweep follows one branch of the response as far as it goes; the other way may follow another.

#: A single frequency is swept from this share below it to this share above.
AROUND = 0.05
#: Slow times that the half-power bandwidth of oscillator and captured ball takes.
SLOW = 20.0
#: A sweep has at least and at most this many cycles.
FEWEST_CYCLES, MOST_CYCLES = 500.0, 4000.0
#: The running mean goes over this share of the range swept.
RUNNING = 1.0 / 12.0
_PER_CYCLE = 6


# The equal-mass tuned mass damper on the same rig: the linear absorber to compare with.
#
# Den Hartog's tuning makes the two peaks of an undamped host alike; the numerical one makes the
# largest amplitude least over the frequencies given and over a detuning of the absorber by 5 %
# either way. A single frequency met exactly has no use for damping: the answer there would be an
# undamped absorber and no motion at all, which no rig keeps.

#: Error of the absorber's frequency that the comparison includes.
DETUNING = 0.05
#: Frequencies over a band.
_FREQUENCIES = 201
#: Least damping ratio of the numerically optimal one.
LEAST_DAMPING = 1e-4


@dataclass(frozen=True)
class Absorber:
    """A tuned mass damper: frequency over the host's, damping ratio, amplitudes of the host (m).

    Attributes
    ----------
    tuning, zeta : its own frequency over f0, and damping ratio.
    amplitude : of the host, the largest over the levels and frequencies designed for.
    detuned : the same with the absorber's frequency 5 % off, the worse of both sides.
    mean, mean_detuned : the same as means over the levels and frequencies, as the ball's is.
    """

    tuning: float
    zeta: float
    amplitude: float
    detuned: float
    mean: float
    mean_detuned: float


def host_gain(
    oscillator: Oscillator,
    *,
    mass: float,
    tuning: float | FloatArray,
    zeta: float,
    frequency: FloatArray,
) -> FloatArray:
    """Mean over a cycle of hypot(x, x'/w0) with the absorber, for base motion of amplitude 1.

    Parameters
    ----------
    oscillator : Oscillator
    mass : float
        Of the absorber, kg.
    tuning : float or ndarray
        Its frequency over the oscillator's; an array has to fit that of frequencies.
    zeta : float
        Its damping ratio.
    frequency : ndarray
        Hz.

    Examples
    --------
    >>> o = Oscillator(M=1.0, c1=0.0, k1=1.0)
    >>> gain = host_gain(o, mass=0.05, tuning=1.0, zeta=0.0, frequency=np.array([0.5 / np.pi]))
    >>> float(gain[0]) < 1e-12  # an undamped absorber stills an undamped host at its own frequency
    True
    """
    w = 2.0 * np.pi * frequency
    own = tuning * oscillator.w0
    own_stiffness = own * (own + 2j * zeta * w)
    pull = -mass * w**2 * own_stiffness / (own_stiffness - w**2 + 1e-300)
    spring = oscillator.k1 + 1j * w * oscillator.c1
    x = np.abs(spring / (spring - oscillator.M * w**2 + pull))
    return np.asarray(x * mean_of_cycle(w / oscillator.w0))


def den_hartog(ratio: float) -> tuple[float, float]:
    """Tuning 1/(1 + mu) and damping ratio sqrt(3 mu/(8 (1 + mu))) for a mass ratio mu.

    Den Hartog, Mechanical Vibrations, 1956, section 3.3 (the damping is referred to the absorber's
    own frequency).

    Examples
    --------
    >>> tuning, zeta = den_hartog(0.05)
    >>> round(tuning, 4), round(zeta, 4)
    (0.9524, 0.1336)
    """
    return 1.0 / (1.0 + ratio), math.sqrt(3.0 * ratio / (8.0 * (1.0 + ratio)))


def _rated(task: Task, tuning: float, zeta: float) -> Absorber:
    one = task.frequencies[0] == task.frequencies[1]
    frequency, weight = task.spread(np.linspace(0.0, 1.0, 1 if one else _FREQUENCIES))
    off = np.array([[1.0], [1.0 - DETUNING], [1.0 + DETUNING]])
    gain = host_gain(
        task.oscillator, mass=sum(task.masses), tuning=tuning * off, zeta=zeta, frequency=frequency
    )
    worst = (task.levels[1] * gain.max(axis=1)).tolist()
    mean = (np.mean(task.levels) * np.average(gain, axis=1, weights=weight)).tolist()
    return Absorber(tuning, zeta, worst[0], max(worst), mean[0], max(mean))


def equal_mass_den_hartog(task: Task) -> Absorber:
    """Den Hartog's absorber of the balls' mass."""
    return _rated(task, *den_hartog(task.eps))


def equal_mass_optimal(task: Task) -> Absorber:
    """The absorber of the balls' mass that does best with its frequency up to 5 % off."""
    from scipy.optimize import minimize

    tuning, zeta = den_hartog(task.eps)
    start = np.log([tuning, zeta])
    ratios = [f / task.oscillator.f0 for f in task.frequencies]
    # far from resonance no damper matters: none that nobody could build
    least, most = (
        np.log([0.5 * min(tuning, *ratios), LEAST_DAMPING]),
        np.log([2.0 * max(tuning, *ratios), 1.0]),
    )
    found = minimize(
        lambda p: _rated(task, float(np.exp(p[0])), float(np.exp(p[1]))).detuned,
        np.clip(start, least, most),
        method="Nelder-Mead",
        bounds=list(zip(least, most, strict=True)),
        options={"xatol": 1e-4, "fatol": 1e-6 * task.levels[1]},
    )
    return _rated(task, *(float(v) for v in np.exp(found.x)))


@dataclass(frozen=True)
class Swept:
    """One sweep; lengths in m.

    Attributes
    ----------
    begin, end : frequencies, Hz. duration : s.
    largest : amplitude, and `at` where (Hz).
    running : largest mean over a twelfth of the range.
    """

    begin: float
    end: float
    duration: float
    largest: float
    at: float
    running: float


def slow_sweeps(task: Task, b: float) -> tuple[Swept, Swept]:
    """A sweep up and one down at the greatest level, balls at their walls.

    Each begins in the steady motion of its first frequency.

    Parameters
    ----------
    task : Task
    b : float
        The (largest) clearance, m.
    """
    low, high = task.frequencies
    if low == high:
        low, high = low * (1.0 - AROUND), high * (1.0 + AROUND)
    return _swept(task, b, low, high), _swept(task, b, high, low)


def _swept(task: Task, b: float, begin: float, end: float) -> Swept:
    rig, o = task.rig(b), task.oscillator
    slow = slow_time(rig)
    bandwidth = 1.0 / (np.pi * slow)  # half-power, Hz
    pace = max(begin, end, o.f0)
    wanted = SLOW * slow * abs(end - begin) / bandwidth * pace
    duration = min(max(wanted, FEWEST_CYCLES), MOST_CYCLES) / pace
    x0, v0 = _steady(task, begin)
    y0 = [x0 + nes.b * (-1.0) ** k * (1.0 - 0.02 * k) for k, nes in enumerate(rig.nes)]
    base = Sweep(task.levels[1], begin, end, duration)
    start = Release(x0, v0, y0)
    motion = simulate(rig, base, start, duration=duration, damping=task.damping)
    t = np.linspace(0.0, duration, int(_PER_CYCLE * pace * duration))
    x, v = motion.at(t)
    amplitude = np.hypot(x, v / o.w0)
    width = max(int(RUNNING * t.size), 1)
    sums = np.concatenate([[0.0], np.cumsum(amplitude)])
    running = float(np.max((sums[width:] - sums[:-width]) / width))
    top = int(np.argmax(amplitude))
    at = begin + (end - begin) * float(t[top]) / duration
    return Swept(begin, end, duration, float(amplitude[top]), at, running)


def _steady(task: Task, frequency: float) -> tuple[float, float]:
    """(x, x') at t = 0 of the bare oscillator that has long moved at that frequency (m, m/s).

    From rest a transient, up to twice as large, would be taken for a part of the response.
    """
    o, w = task.oscillator, 2.0 * np.pi * frequency
    spring = o.k1 + 1j * w * o.c1
    x = task.levels[1] * spring / (spring - o.M * w**2)
    return float(x.imag), float((1j * w * x).imag)


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
    random_tail : mean amplitude of the tenth of the random starts that has the largest.
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
    random_tail: float
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
    judged : starts that each clearance was judged by.
    beside : those of what is shown beside.
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
    judged: Starts
    beside: Starts
    seed: int

    @property
    def gain(self) -> float:
        """Share of the bare amplitude that the best clearance takes, from rest or anywhere."""
        rest = 1.0 - min(self.least_mean.rest_mean, self.robust.rest_mean) / self.bare_mean
        return max(rest, self.random_gain)

    @property
    def fixed_mass(self) -> float:
        """Mean amplitude over the ranges with the balls fixed to the oscillator, m.

        The same as an absorber that is far too stiff; under a damping law by simulation.
        """
        task, o = self.task, self.task.oscillator
        if task.damping == WeakDamping():
            return _rated(task, 1e6, 0.0).mean
        heavier = replace(o, M=o.M + sum(task.masses))
        f = 0.5 * sum(task.frequencies)
        own, of_heavier = mean_of_cycle(np.array([f / o.f0, f / heavier.f0]))  # both by x'/w0
        return float(own / of_heavier) * replace(task, oscillator=heavier).mean_bare()

    @property
    def as_fixed(self) -> bool:
        """Whether no clearance takes a twentieth off what the balls leave when fixed."""
        ball = min(self.least_mean.rest_mean, self.robust.rest_mean, self.robust.random_mean)
        return (1.0 - WORTH) * self.fixed_mass < ball

    @property
    def random_gain(self) -> float:
        """Share of the bare amplitude that the robust clearance takes over random starts."""
        return 1.0 - self.robust.random_mean / self.robust.random_bare

    @property
    def hopeless(self) -> bool:
        """Whether no clearance is worth building: over nothing, or over the mass of its balls."""
        return self.gain < WORTH or self.as_fixed


def advise(
    task: Task, *, asked: float | None = None, seed: int = 1, budget: float = BUDGET
) -> Advice:
    """Search the clearances of a task and judge them.

    Parameters
    ----------
    task : Task
    asked : float, optional
        A clearance (the largest, of several balls) that is judged besides, m.
    seed : int
        Of the random starts.
    budget : float
        Work that the answer may take, s.

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
    task = parted(task, ends[1], budget)
    found = search(task, ends=ends, marks=marks, seed=seed, budget=budget)
    shown = {found.least_mean, found.least_max, found.robust}
    every = (*shown, *([] if asked is None else [asked]))
    fewest = FEWEST_PHASES[0 if task.ranged else 1]
    many = _judging(found, JUDGING * budget / len(every), fewest)
    judged = {b: judge(task, b, many, seed + 2) for b in every}
    chosen = _surest([judged[b] for b in shown], judged[found.robust]).b
    alike = replace(found.race, tied=tuple(sorted({*found.race.tied, chosen})))
    found = replace(found, robust=chosen, race=alike)
    beside = _shown_beside(found, BESIDE * budget, min(fewest, 2))
    unchanged, changed = changes(task, found.robust, beside, seed=seed + 3)
    return Advice(
        task=task,
        bare=bare,
        bare_mean=task.mean_bare(),
        published=published,
        exact=exact,
        orbit=None if exact is None else orbit_and_rest(task, 0.98 * exact, f, phases=many.phases),
        found=found,
        least_mean=judged[found.least_mean],
        least_max=judged[found.least_max],
        robust=judged[found.robust],
        cliffs=cliffs_of(task, found.robust, beside, seed=seed + 3, most=CLIFFS * budget),
        asked=None if asked is None else judged[asked],
        unchanged=unchanged,
        changed=changed,
        working=operating_range(task, found, phases=beside.phases),
        den_hartog=equal_mass_den_hartog(task),
        optimal=equal_mass_optimal(task),
        sweeps=slow_sweeps(task, found.robust),
        asked_sweeps=None if asked is None else slow_sweeps(task, asked),
        watched=min(duration_of(task.rig(found.robust), f)[2] for f in task.frequencies),
        judged=many,
        beside=beside,
        seed=seed,
    )


def _judging(found: Found, share: float, fewest: int) -> Starts:
    """Starts by which one clearance is judged, of a share of the work (s)."""
    needed = int(found.captured * (1.0 - found.captured) / SHARE_ERROR**2)
    wanted = min(max(found.race.starts, needed, JUDGED[0]), JUDGED[1])
    return Starts(
        affordable(0.3 * share, found.work[0], (fewest, PHASES)),
        affordable(0.7 * share, found.work[1], (min(FEWEST, wanted), wanted)),
    )


def _surest(others: Iterable[Judged], best: Judged) -> Judged:
    """The robust clearance, or another that no measure of random starts has worse, and one better.

    Where runs are dear, a contest has few starts: those that judge tell as much.
    """

    def ratios(one: Judged) -> tuple[float, float]:
        return one.random_p90 / best.random_p90, one.random_mean / best.random_mean

    better = [one for one in others if max(ratios(one)) <= 1.0 and min(ratios(one)) < 1.0 - WORTH]
    return min(better, key=lambda one: one.random_p90, default=best)


def _shown_beside(found: Found, share: float, fewest: int) -> Starts:
    """Starts of one of the clearances or changes around the robust one."""
    one = 0.5 * share / max(4 * len(CHANGES), 2 * len(STEPS))
    return Starts(
        affordable(one, found.work[0], (fewest, SHOWN[0])),
        affordable(one, found.work[1], SHOWN[1]),
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


def judge(task: Task, b: float, starts: Starts, seed: int) -> Judged:
    """One clearance: from rest, and under random starts that had no part in the choice."""
    many = range(starts.phases)
    from_rest = wall_starts(task, b, many, shift=0.4)
    rest = worst = watched(from_rest, starts=len(from_rest))
    if task.ranged:
        at_nodes = wall_starts(task, b, many, shift=0.4, nodes=True)
        worst = watched(at_nodes, starts=len(at_nodes))
    drawn = random_starts(task, b, starts=starts.random, seed=seed)
    anywhere = watched(drawn, starts=len(drawn))
    means, weight = anywhere.mean, anywhere.weight
    beyond = means >= weighted_percentile(means[np.newaxis], weight[np.newaxis])
    centre = responses(centre_starts(task, b, range(1 if task.ranged else 4)))
    return Judged(
        b=b,
        rest_mean=float(rest.average(rest.mean)),
        rest_max=float(worst.largest.reshape(task.conditions(True), -1).mean(axis=1).max()),
        random_mean=float(anywhere.average(means)),
        random_p90=float(means[beyond].min()),
        random_error=float(weighted_percentile(means[np.newaxis], _resampled(weight)).std()),
        random_max=float(anywhere.largest.max()),
        random_tail=float(np.average(means[beyond], weights=weight[beyond])),
        random_bare=float(anywhere.average(task.bare_of(drawn))),
        captured=float(anywhere.share),
        captured_rest=float(rest.share),
        centre_mean=float(centre.average(centre.mean)),
        centre_touched=bool((centre.impacts_per_cycle > 0.0).any()),
    )


def _resampled(weight: FloatArray) -> FloatArray:
    """Draws of the starts, as what each then stands for; one row each."""
    n = weight.size
    return weight * np.random.default_rng(1).multinomial(n, np.full(n, 1.0 / n), RESAMPLED)


def orbit_and_rest(task: Task, b: float, frequency: float, *, phases: int) -> tuple[float, float]:
    """Amplitude of the exact orbit at b, and the mean amplitude of starts from rest there (m)."""
    o, G = task.oscillator, task.levels[1]
    p = Reduced.of_rig(
        M=o.M, c1=o.c1, k1=o.k1, m=sum(task.masses), r=task.r[0], frequency=frequency
    )
    orbit = G * float(family(amplitudes_at(b / G, p)[1], p).amplitude)
    one = replace(task, levels=(G, G), frequencies=(frequency, frequency))
    rest = responses(wall_starts(one, b, range(phases)))
    return orbit, float(rest.mean.mean())
