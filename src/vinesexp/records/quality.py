"""Defects of a stored record that no single sample shows: clipped, frozen, too short.

All of them are stretches of equal samples, or too few of the others. What separates a defect from
an honest plateau is the approach. A smooth maximum seen through a quantum d stays n samples in its
top level and, being a parabola, has fallen by at most 4 d at n/2 samples outside of it; a
clipped one arrives there at speed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vinesexp.records.store import RecordView

Floats = NDArray[np.float64]

_BLOCK = 1 << 18
_FALL = 8.0  # quanta: twice what a parabola falls by
_LONG = 16  # samples: a clipped parabola falls by 0.75 n quanta or more, 12 here
_ALIVE = 64  # samples: 2^-64 a sample to stand still by chance where every second one moves


@dataclass(frozen=True)
class Stretch:
    """A stretch of equal samples: first sample, length, value (SI); whether it stands out."""

    start: int
    length: int
    value: float
    steep: bool = True


@dataclass(frozen=True)
class _Levels:
    """Range of a channel and how finely it moves.

    `least` is its smallest change, 5 % of the changes are below `fine`, half of them below `usual`.
    """

    low: float
    high: float
    least: float
    fine: float
    usual: float


def saturated(view: RecordView, role: str) -> list[Stretch]:
    """Stretches in which a channel stands at the end of its range, clipped."""
    levels = _levels(view, role)
    long: list[Stretch] = []
    short: list[Stretch] = []
    elsewhere = 0
    for run in equal_runs(view, role, least=2):
        if run.start == 0:
            continue  # held before its release, most likely
        if run.value not in (levels.low, levels.high):
            elsewhere += run.length > 2
            continue
        near, far = _fall(view, role, run, [1, max(run.length // 2, 1)])
        if run.length >= _LONG:
            if far >= _FALL * near:
                long.append(run)
        elif far > _FALL * levels.least:
            short.append(run if far > _FALL * levels.fine else replace(run, steep=False))
    for value in (levels.low, levels.high):
        long.extend(_clipped(short, value, levels, elsewhere))
    return sorted(long, key=lambda run: run.start)


def _clipped(short: list[Stretch], value: float, levels: _Levels, elsewhere: int) -> list[Stretch]:
    """Which stretches too short to show their shape are clipped, by their number.

    Three equal samples are three in a row by chance as often anywhere else. And at a thousand
    levels or more, even two of them far above their neighbours happen once, not twice.
    """
    peaks = [run for run in short if run.value == value]
    if levels.high - levels.low > 1000.0 * levels.fine:
        steep = [run for run in peaks if run.steep]
        if len(steep) > 1 or any(run.length > 2 for run in steep):
            return steep
    flat = [run for run in peaks if run.length > 2]
    return flat if len(flat) > 2 and len(flat) > 10 * elsewhere else []


def frozen(view: RecordView, role: str, *, period: float | None) -> list[Stretch]:
    """Stretches in which a channel stands still although it cannot.

    Either every second sample changed just before (noise does not stop), or, given the `period`
    of the oscillator in samples, its motion stops dead: half a period or more without change,
    after a period in which it travelled eight times its usual step.
    """
    levels = _levels(view, role)
    if levels.low == levels.high:
        return [Stretch(0, view.n, levels.low)]
    found = []
    least = _ALIVE if period is None else int(min(_ALIVE, max(0.5 * period, 8.0)))
    for run in equal_runs(view, role, least=least):
        if run.start < _ALIVE:
            continue  # nothing before it to judge by
        before = view.read(role, run.start - _ALIVE, run.start)
        changes = np.mean(np.diff(before) != 0.0)
        # A decay without noise comes to rest from one or two quanta, noise from several.
        alive = run.length >= _ALIVE and changes > 0.5 and np.ptp(before) > 5.0 * levels.least
        stopped = False
        if period is not None and run.length >= 0.5 * period:
            last = view.read(role, max(run.start - round(period), 0), run.start)
            stopped = bool(np.ptp(last) > _FALL * levels.usual)
        if alive or stopped:
            found.append(run)
    return found


def periods(view: RecordView, role: str) -> float:
    """How many periods of its dominant motion a channel holds.

    The peak of the amplitude spectrum of the steps between block means; taking steps keeps a
    slow drift of the sensor from passing for motion.
    """
    values = _thinned(view, role, 8192)
    steps = np.diff(values)
    steps -= steps.mean()
    if not np.any(steps):
        return 0.0
    padding = 8
    spectrum = np.abs(np.fft.rfft(steps, padding * len(steps)))
    return float(np.argmax(spectrum)) / padding


def equal_runs(view: RecordView, role: str, *, least: int) -> Iterator[Stretch]:
    """Every stretch of at least `least` equal samples, in order, in bounded memory."""
    begun, previous = 0, np.nan
    for begin in range(0, view.n, _BLOCK):
        block = view.read(role, begin, begin + _BLOCK)
        changes = np.flatnonzero(np.diff(block, prepend=previous)) + begin
        if begin == 0:
            changes = changes[changes > 0]
        edges = np.concatenate(([begun], changes))
        lengths = np.diff(edges)
        for k in np.flatnonzero(lengths >= least):
            start = int(edges[k])
            value = float(block[start - begin]) if start >= begin else previous
            yield Stretch(start, int(lengths[k]), value)
        begun, previous = int(edges[-1]), float(block[-1])
    if view.n - begun >= least:
        yield Stretch(begun, view.n - begun, previous)


def _levels(view: RecordView, role: str) -> _Levels:
    low, high, least = np.inf, -np.inf, np.inf
    fine, usual = [], []
    for begin in range(0, view.n, _BLOCK):
        block = view.read(role, begin, begin + _BLOCK)
        low, high = min(low, block.min()), max(high, block.max())
        steps = np.abs(np.diff(block[: _BLOCK // 4]))
        steps = steps[steps > 0.0]
        if len(steps):
            least = min(least, steps.min())
            quantiles = np.quantile(steps, [0.05, 0.5])
            fine.append(quantiles[0])
            usual.append(quantiles[1])
    middle = [float(np.median(values)) if values else 0.0 for values in (fine, usual)]
    return _Levels(float(low), float(high), float(least), *middle)


def _fall(view: RecordView, role: str, run: Stretch, distances: list[int]) -> list[float]:
    """How far the channel is from the run's value at these distances outside, the nearer side."""
    falls = []
    for distance in distances:
        sides = [run.start - distance, run.start + run.length - 1 + distance]
        values = [view.read(role, at, at + 1)[0] for at in sides if 0 <= at < view.n]
        falls.append(min((abs(value - run.value) for value in values), default=0.0))
    return falls


def _thinned(view: RecordView, role: str, most: int) -> Floats:
    """The channel as at most `most` means of consecutive samples."""
    group = -(-view.n // most)
    rows = max(_BLOCK // group, 1) * group
    parts = []
    for begin in range(0, view.n - group + 1, rows):
        block = view.read(role, begin, min(begin + rows, view.n))
        parts.append(block[: len(block) // group * group].reshape(-1, group).mean(axis=1))
    return np.concatenate(parts)
