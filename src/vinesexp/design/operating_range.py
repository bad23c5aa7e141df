"""Base amplitudes over which a clearance works: where the balls wake up, where they saturate."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.design.best_clearance import Found
from vinesexp.design.conditions import frequency_weights
from vinesexp.design.ensemble import responses
from vinesexp.design.task import Task, wall_starts

#: A clearance works where it leaves at most this share of the bare amplitude.
WORKS = 0.8
#: With friction or a damping law: levels tried, from a share of the least to a multiple of the
#: greatest level designed for.
LEVELS, ENDS = 9, (0.25, 4.0)


@dataclass(frozen=True)
class Range:
    """Levels (m) around those designed for at which a clearance works from rest.

    Attributes
    ----------
    activation : least level at which half of the starts from rest are captured; None: at none, or
        designed for a band, in most of which none is.
    low, high : ends of the levels at which it works; None where it does not.
    low_open, high_open : that end is where the levels tried end: it works beyond.
    """

    activation: float | None
    low: float | None
    high: float | None
    low_open: bool = False
    high_open: bool = False


def operating_range(task: Task, found: Found) -> Range:
    """Where the robust clearance works, over the level; mean over the band, if there is one.

    Parameters
    ----------
    task : Task
    found : Found
        Its search.
    """
    levels, left, captured = _scaled(task, found) if task.plain else _tried(task, found.robust)
    return _range(task, levels, left, captured)


def _scaled(task: Task, found: Found) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Levels (m), share of the bare amplitude left, share captured, from the scan.

    Lengths scale together where nothing but c1 damps: clearance b under level G s does what b/s
    does under G, s times as large. So the scan over clearances is one over levels too.
    """
    conditions = np.array([G for G, _ in task.grid()])
    ends = np.unique(conditions)
    shape = found.grid.size, ends.size, conditions.size // ends.size, -1
    along = frequency_weights(task.frequencies, task.oscillator, task.eps)
    mean, captured = (
        values.reshape(shape).mean(axis=-1) @ along
        for values in (found.rest.scan.mean, found.rest.scan.captured.astype(np.float64))
    )
    levels = np.outer(found.robust / found.grid, ends)
    left = mean / np.array([_bare(task, float(G)) for G in ends])
    order = np.argsort(levels.ravel())
    return (
        levels.ravel()[order], left.ravel()[order], (captured / along.sum()).ravel()[order]
    )  # fmt: skip


def _tried(task: Task, b: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same by simulation: friction and damping laws have lengths of their own."""
    levels = np.geomspace(ENDS[0] * task.levels[0], ENDS[1] * task.levels[1], LEVELS)
    rows = []
    for level in levels:
        at = replace(task, levels=(float(level),) * 2)
        rest = responses(wall_starts(at, b, phases=2))
        rows.append((float(at.average(rest.mean)) / at.mean_bare(), float(at.share(rest.captured))))
    left, captured = np.array(rows).T
    return levels, left, captured


def _bare(task: Task, level: float) -> float:
    return replace(task, levels=(level, level)).mean_bare()


def _range(task: Task, levels: FloatArray, left: FloatArray, captured: FloatArray) -> Range:
    single = task.frequencies[0] == task.frequencies[1]
    active = np.flatnonzero(captured >= 0.5) if single else np.empty(0, dtype=np.intp)
    works = left <= WORKS
    at = int(np.abs(np.log(levels / np.sqrt(task.levels[0] * task.levels[1]))).argmin())
    low = high = at
    while low > 0 and works[low - 1]:
        low -= 1
    while high < works.size - 1 and works[high + 1]:
        high += 1
    ends = float(levels[low]), float(levels[high])
    if task.levels[0] == task.levels[1]:  # that level lies between two of those looked at
        ends = min(ends[0], task.levels[0]), max(ends[1], task.levels[0])
    return Range(
        activation=float(levels[active[0]]) if active.size else None,
        low=ends[0] if works[at] else None,
        high=ends[1] if works[at] else None,
        low_open=bool(works[at]) and low == 0,
        high_open=bool(works[at]) and high == works.size - 1,
    )
