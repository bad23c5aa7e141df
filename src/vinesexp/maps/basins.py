"""Which motions a rig has side by side, and how many starts lead to each.

Every start is simulated exactly and judged once it has settled: by the regimes that records and
theory share, and by its amplitude, because motions of one regime may differ in it. Mirror images
count as one. A motion that has not settled within the time that it is given (that of
`design.ensemble.duration_of` and a window more) is named by what it does at the end.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from vinesexp.arrays import as_floats, as_number, several
from vinesexp.design.ensemble import Run, duration_of, refuse_what_never_settles
from vinesexp.design.task import Task, random_starts
from vinesexp.errors import ParameterError
from vinesexp.rig import Rig
from vinesexp.solver.effort import refuse_beyond_memory
from vinesexp.theory.regime_definitions import Regime, regime_of

#: Points a cycle at which the amplitude is taken.
PER_CYCLE = 8
#: Amplitudes of one regime further apart than this share belong to two motions: a periodic motion
#: has one amplitude, that of an irregular one varies from window to window.
APART = {
    Regime.TWO_SYMMETRIC: 0.03,
    Regime.TWO_ASYMMETRIC: 0.03,
    Regime.NO_IMPACT: 0.03,
}
APART_OTHERS = 0.25
#: Random starts at each clearance.
STARTS = 40
#: Bytes of a `Run` in memory.
RUN_SIZE = 2000.0


@dataclass(frozen=True)
class Settled:
    """What one start has settled to: regime, amplitudes (m), impacts per cycle."""

    regime: Regime
    mean: float
    largest: float
    impacts_per_cycle: float


@dataclass(frozen=True)
class Attractor:
    """A motion that several starts settle to.

    Attributes
    ----------
    b : clearance, m.
    regime : name of the regime (`theory.regime_definitions`).
    share : of the starts that lead to it.
    starts : their number.
    mean : amplitude hypot(x, x'/w0), mean over its starts, m.
    low, high : least and greatest mean amplitude of these starts, m.
    largest : amplitude of any of them, m.
    impacts_per_cycle : mean over them.
    """

    b: float
    regime: str
    share: float
    starts: int
    mean: float
    low: float
    high: float
    largest: float
    impacts_per_cycle: float


def settled(run: Run) -> Settled:
    """Simulate one start of a rig with one ball and judge what it does in the end.

    Raises
    ------
    AnalysisError
        The motion comes to a stop (`simulate`), or nothing ever settles.
    """
    from vinesexp.solver.simulation import simulate

    period = 1.0 / run.base.frequency
    settle, whole, _ = duration_of(run.rig, run.base.frequency)
    # A window later than `responses` looks: what is still settling must not pass for a motion.
    begin, end = whole, 2.0 * whole - settle
    motion = simulate(run.rig, run.base, run.release, end)
    hits = motion.impacts
    count = regime_of(hits["time"], hits["side"], period=period, start=begin, end=end)
    x, v = motion.at(np.linspace(begin, end, int((end - begin) / period * PER_CYCLE) + 1))
    amplitude = np.hypot(x, v / run.rig.oscillator.w0)
    return Settled(
        count.regime, float(amplitude.mean()), float(amplitude.max()), count.impacts_per_cycle
    )


def grouped(b: float, found: Sequence[Settled]) -> list[Attractor]:
    """Starts that settled to the same motion, the motion of most starts first.

    Examples
    --------
    >>> low, high = (Settled(Regime.TWO_SYMMETRIC, a, a, 2.0) for a in (1.3e-3, 6.0e-3))
    >>> [(one.share, one.starts) for one in grouped(0.03, [low, high, high, high])]
    [(0.75, 3), (0.25, 1)]
    """
    groups: list[list[Settled]] = []
    for regime in Regime:
        own = sorted((one for one in found if one.regime is regime), key=lambda one: one.mean)
        apart = APART.get(regime, APART_OTHERS)
        for i, one in enumerate(own):
            if i == 0 or one.mean > (1.0 + apart) * own[i - 1].mean:
                groups.append([])
            groups[-1].append(one)
    groups.sort(key=lambda group: (-len(group), group[0].mean))
    return [_attractor(b, group, len(found)) for group in groups]


def _attractor(b: float, group: list[Settled], total: int) -> Attractor:
    means = [one.mean for one in group]
    return Attractor(
        b=b,
        regime=group[0].regime.value,
        share=len(group) / total,
        starts=len(group),
        mean=float(np.mean(means)),
        low=min(means),
        high=max(means),
        largest=max(one.largest for one in group),
        impacts_per_cycle=float(np.mean([one.impacts_per_cycle for one in group])),
    )


def coexisting(
    rig: Rig,
    *,
    level: float,
    frequency: float,
    clearances: Iterable[float] | float,
    starts: int = STARTS,
    seed: int = 1,
    workers: int | None = None,
) -> list[Attractor]:
    """The motions a rig settles to at each clearance, with their shares of random starts.

    Parameters
    ----------
    rig : Rig
        With one NES; its clearance is replaced.
    level, frequency : float
        Amplitude (m) and frequency (Hz) of the base.
    clearances : iterable of float, or float
        m.
    starts, seed : int
        Random starts at each (`design.task.random_starts`), the same draws at all of them.
    workers : int, optional
        Threads; by default one per core. The result does not depend on it.

    Returns
    -------
    list of Attractor
        By clearance, then by falling share.

    Raises
    ------
    ParameterError
        Not one NES, no start, values out of range.
    AnalysisError
        A motion that comes to a stop or never settles.

    Examples
    --------
    >>> from vinesexp import NES, Oscillator
    >>> rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.03, r=0.6)])
    >>> found = coexisting(rig, level=0.25e-3, frequency=7.862, clearances=[0.025], starts=6)
    >>> [(one.regime, one.starts) for one in found]  # a ball mid-cavity is never touched
    [('two symmetric', 4), ('no impact', 2)]
    """
    if len(rig.nes) != 1:
        raise ParameterError(f"the rig has {len(rig.nes)} NESs: motions side by side are for one")
    if starts < 1:
        raise ParameterError(f"{starts} starts: expected 1 or more")
    refuse_beyond_memory(RUN_SIZE * starts, f"{starts} starts", "ask for fewer")
    level, frequency = as_number(level, "level"), as_number(frequency, "frequency")
    ball, o, found = rig.nes[0], rig.oscillator, list[Attractor]()
    task = Task(o, (ball.m,), (ball.r,), (level, level), (frequency, frequency))
    with ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        try:
            for b in np.unique(as_floats(several(clearances), "clearances")).tolist():
                drawn = random_starts(task, b, starts=starts, seed=seed)
                refuse_what_never_settles(drawn)
                runs = [replace(run, rig=Rig(o, [replace(ball, b=b)])) for run in drawn]
                found += grouped(b, list(pool.map(settled, runs)))
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
    return found
