"""From the defects of a stored record to what is reported: a refusal, or rows of checks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray, IntArray, add_run, usually_held
from vinesexp.errors import RecordError
from vinesexp.records.campaign.schema import Channel, Record
from vinesexp.records.instrument.samples import Samples
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.store import RecordView
from vinesexp.units import counted

#: Which channel shows the oscillator's motion best.
_MOTION = ("displacement", "base", "acceleration")

#: Channels that have to move in each test; others may rest below the instrument's resolution.
_MOVING = {
    "ringdown": ("displacement", "acceleration"),
    "sweep": _MOTION,
    "periodic": _MOTION,
    "transient": ("displacement", "acceleration"),
    "drop": ("acceleration", "sound"),
}

#: Channels of sensors that look at a target.
_TARGETS = ("displacement", "base")

_BREAK = 0.125  # of a period: the motion is known across a shorter gap
_LEAST_PERIODS = 2.0

#: Of the samples of an acceleration at the end of its range: impacts alone clip fewer.
MOTION_CLIPPED = 0.2
_DEFECTS = {
    "saturated": ("is clipped at the end of its range", "measure with a wider range"),
    "frozen": ("is frozen", "look at the sensor and cut the record"),
}

# Defects of a stored record that no single sample shows: clipped, frozen, too short.
#
# All of them are stretches of equal samples, or too few of the others. What separates a defect
# from an honest plateau is the approach. A smooth maximum seen through a quantum d stays n samples
# in its top level and, being a parabola, has fallen by at most 4 d at n/2 samples outside of it; a
# clipped one arrives there at speed.
#
# Stretches in which a sensor shows nothing: a laser that loses its target.
#
# It then gives the end of its range, or its last value, and comes back at once. Nothing that moves
# gets there or back so fast. Such a stretch is a gap; a crest cut off by a range too small is not.
_BLOCK = 1 << 18
_NEAR_END = 0.02  # of the range
_FALL = 8.0  # quanta: twice what a parabola falls by
_LONG = 16  # samples: a clipped parabola falls by 0.75 n quanta or more, 12 here
_REST = 0.03  # of the range: what is left of a motion that comes to rest
_SHRINKS = 0.85  # of the half before: a motion that dies out
_MIDST = 0.2  # of its range that a motion's place of rest is away from its ends
_ALIVE = 64  # samples: 2^-64 a sample to stand still by chance where every second one moves
_EQUAL, _HELD = 3, 3  # samples: a gap is as long, and as so many values of a slow sensor
_QUANTA = 8.0  # usual steps
_LONE, _MOST_LONE = 30.0, 3  # usual bends, or steps, of a sample far off; of them in a row
_RARE, _BACK = 0.01, 0.3  # of the samples, that are far off; of their bends, that may be left
_FEW = 8  # samples: of fewer nothing is said
_CHANCE = 0.01  # stretches as long by chance, of which few would end with such a bend
_TURNS = 2.0  # usual bends: what moves by less in a stretch may stay in one quantum
_BENDS = 4.0  # usual bends: one that no crest has, whose quanta are all that bends
_BESIDE = 4  # samples beside a stretch that the sensor may need to leave and to find its target

#: A counter that starts anew jumps across so much of the range, and no other step is half as large.
_ACROSS, _OTHERS = 0.75, 0.5
_AGAIN, _EACH = 2, 0.8  # times: once may be anything; of the steps so large


#: Samples of a channel: the first, and the one after the last.
Stretch = tuple[int, int]
Stretches = Sequence[Stretch]


@dataclass(frozen=True)
class Runs:
    """Stretches of equal samples as arrays: first sample, the one after the last, value (SI).

    They end in the stretch of samples `block`, which begins at sample `begin`.
    """

    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    values: FloatArray
    block: FloatArray
    begin: int

    @property
    def lengths(self) -> NDArray[np.int64]:
        return self.ends - self.starts

    def stretches(self, chosen: NDArray[np.bool_]) -> list[Stretch]:
        """The chosen ones, one by one."""
        return list(zip(self.starts[chosen].tolist(), self.ends[chosen].tolist(), strict=True))


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

    @property
    def reach(self) -> float:
        return self.high - self.low


def saturated(view: RecordView, role: str) -> list[Stretch]:
    """Stretches in which a channel stands at the end of its range, clipped."""
    levels = _levels(view, role)
    ends = {end: _levels_at(view, role, levels, end) for end in {levels.low, levels.high}}
    short: dict[float, list[Stretch]] = {end: [] for end in ends}
    found: list[Stretch] = []
    elsewhere = 0
    for runs in equal_runs(view, role, least=2):
        at_end = (runs.values == levels.low) | (runs.values == levels.high)
        elsewhere += int(np.count_nonzero(runs.lengths[~at_end] > 2))
        near = _fall(view, role, runs, np.ones_like(runs.lengths))
        far = _fall(view, role, runs, np.maximum(runs.lengths // 2, 1))
        is_long = runs.lengths >= _LONG
        # A record that begins so was held before its release, most likely.
        candidate = at_end & (runs.starts > 0)
        found += runs.stretches(candidate & is_long & (far >= _FALL * near))
        for end, own in ends.items():
            here = candidate & ~is_long & (runs.values == end) & (far > _FALL * own.least)
            short[end] += runs.stretches(here)
    for end, own in ends.items():
        found += _clipped(short[end], own, elsewhere)
    return sorted(found)


def _clipped(short: list[Stretch], levels: _Levels, elsewhere: int) -> list[Stretch]:
    """Which stretches too short to show their shape are clipped, by their number.

    Three equal samples are three in a row by chance as often anywhere else. And at a thousand
    levels or more, even two of them far above their neighbours happen once, not twice.
    """
    flat = [(first, end) for first, end in short if end - first > 2]
    if levels.reach > 1000.0 * levels.fine and (len(short) > 1 or flat):
        return short
    return flat if len(flat) > 2 and len(flat) > 10 * elsewhere else []


def frozen(view: RecordView, role: str, *, period: float | None) -> list[Stretch]:
    """Stretches in which a channel stands still although it cannot.

    Either every second sample changed just before (noise does not stop), or, given the `period`
    of the oscillator in samples, its motion stops dead: half a period or more without change,
    after a period in which it travelled eight times its usual step. A motion that shrinks towards
    the value it then keeps has come to rest, and is no defect.
    A shorter one shows a value that was kept: the noise stopped, and the motion bends at an end.
    """
    levels = _levels(view, role)
    if levels.low == levels.high:
        return [(0, view.n)]
    found = []
    least = _ALIVE
    if period is not None:
        alike = sum(int(np.count_nonzero(np.diff(x) == 0.0)) for _, x in view.blocks(role, more=1))
        by_chance = int(_longest_by_chance(alike, of=view.n, n=view.n)) + 1
        least = max(int(min(least, 0.5 * period, by_chance)), _FEW)
    for runs in equal_runs(view, role, least=least):
        # before the first samples there is nothing to judge by
        for first, end in runs.stretches(runs.starts >= _ALIVE):
            if period is not None and _keeps_its_value(view, role, first, end, levels):
                found.append((first, end))
                continue
            before = view.read(role, first - _ALIVE, first)
            value = float(view.read(role, first, first + 1)[0])
            changes = np.mean(np.diff(before) != 0.0)
            # A slow decay without noise comes to rest from one or two quanta, noise from several.
            still = end - first >= _ALIVE and changes > 0.5 and np.ptp(before) > 5.0 * levels.least
            if period is not None and end - first >= 0.5 * period:
                last = view.read(role, max(first - round(period), 0), first)
                still = still or bool(np.ptp(last) > _FALL * levels.usual)
            if still and not _came_to_rest(view, role, first, value, period, levels):
                found.append((first, end))
    return found


def _longest_by_chance(alike: int, *, of: int, n: int) -> float:
    """Samples of the longest stretch that noise makes of n, where `alike` `of` them are equal."""
    return 1.0 - math.log(n / _CHANCE) / math.log((alike + 1.0) / (of + 2.0))


def _keeps_its_value(view: RecordView, role: str, first: int, end: int, levels: _Levels) -> bool:
    """Whether a sensor shows its last value, by how often samples beside a stretch are alike.

    The motion, which went on, bends at an end as it does nowhere near: a crest without noise stays
    in its top quantum, too. At the end of the range it is clipped, which is something else.
    """
    sides = view.read(role, first - _ALIVE, first + 1), view.read(role, end - 1, end + _ALIVE)
    kept, beside = sides[1][0], np.concatenate([sides[0][:-1], sides[1][1:]])
    alike = int(max(np.sum(beside == kept), np.sum(np.diff(beside) == 0.0)))
    if not end - first > _longest_by_chance(alike, of=beside.size, n=view.n):
        return False
    bends = [np.append(np.abs(np.diff(side, 2)), 0.0) for side in sides]
    usual = max(float(np.median(np.concatenate(bends))), levels.fine)
    leaps = max(bends[0][-2], bends[1][0]) > _BENDS * usual
    if not leaps or kept in (levels.low, levels.high):
        return False
    # where the motion turns, by what is beside it, it stays in one quantum
    length = end - first
    before, after = sides[0][:-1][-length:], sides[1][1:][:length]  # few where the record ends
    own = np.concatenate([before, after])
    at = np.concatenate([np.arange(-before.size, 0), length + np.arange(after.size)])
    turned = np.polyval(np.polyfit(at, own - kept, 2), np.arange(length))
    return bool(np.abs(turned).max() > _TURNS * usual)


def _came_to_rest(
    view: RecordView, role: str, first: int, value: float, period: float | None, levels: _Levels
) -> bool:
    """Whether a motion dies out into a stretch, whose value it then keeps.

    Over a period and a half, of which a part may approach any value, it shrinks towards that value;
    at the end little of it is left, or two quanta of a coarse converter; and the value is no
    turning point but lies in the midst of the motion.
    """
    length = max(_ALIVE, round(1.5 * (period or 0.0)))
    before = view.read(role, max(first - length, 0), first)
    early, late = (float(np.abs(half - value).max()) for half in np.array_split(before, 2))
    left = float(np.abs(before[-len(before) // 4 :] - value).max())
    if late > _SHRINKS * early or left > max(2.0 * levels.least, _REST * levels.reach):
        return False
    motion = view.read(role, max(first - 4 * length, 0), first)
    low, high = float(motion.min()), float(motion.max())
    return low + _MIDST * (high - low) < value < high - _MIDST * (high - low)


def periods(view: RecordView, role: str) -> float:
    """How many periods of its dominant motion a channel holds.

    The peak of the amplitude spectrum of the steps between block means; taking steps keeps a
    slow drift of the sensor from passing for motion.
    """
    values = _thinned(view, role, min(8192, max(view.n // _held(view, role), 1)))
    steps = np.diff(values)
    steps -= steps.mean()
    if not np.any(steps):
        return 0.0
    padding = 8
    spectrum = np.abs(np.fft.rfft(steps, padding * len(steps)))
    return float(np.argmax(spectrum)) / padding


def _held(view: RecordView, role: str) -> int:
    """Samples for which a channel usually keeps its value."""
    return usually_held(view.read(role, 0, _BLOCK))


def equal_runs(view: RecordView, role: str, *, least: int) -> Iterator[Runs]:
    """Every stretch of at least `least` equal samples, in order, a block of them at a time."""
    begun, previous = 0, np.nan
    for begin, block in view.blocks(role, size=_BLOCK):
        edges = np.flatnonzero(np.diff(block, prepend=previous)) + begin
        edges = np.concatenate(([begun], edges[edges > begun]))
        lengths = np.diff(edges)
        chosen = np.flatnonzero(lengths >= least)
        starts = edges[chosen]
        values = block[np.maximum(starts - begin, 0)]
        values[starts < begin] = previous
        yield Runs(starts, edges[chosen + 1], values, block, begin)
        begun, previous = int(edges[-1]), float(block[-1])
    if view.n - begun >= least:
        last = (np.array([begun]), np.array([view.n]), np.array([previous]))
        yield Runs(*last, block=np.empty(0), begin=view.n)


#: Of the records that are open: each check of a channel asks for them, by a pass over the record.
_KNOWN: WeakKeyDictionary[RecordView, dict[str, _Levels]] = WeakKeyDictionary()


def _levels(view: RecordView, role: str) -> _Levels:
    known = _KNOWN.setdefault(view, {})
    if role not in known:
        known[role] = _levels_of(view, role)
    return known[role]


def _levels_of(view: RecordView, role: str) -> _Levels:
    low, high, least = np.inf, -np.inf, np.inf
    fine, usual = [], []
    for _, block in view.blocks(role, size=_BLOCK):
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


def _levels_at(view: RecordView, role: str, levels: _Levels, end: float) -> _Levels:
    """How finely the channel moves near an end of its range.

    A file of three digits has steps of 0.01 below 10 and of 0.1 above. The quantum there is the
    smallest difference of any two values; where hardly any are, that of the record.
    """
    near = _NEAR_END * levels.reach
    parts = [np.unique(x[np.abs(x - end) <= near]) for _, x in view.blocks(role)]
    values = np.unique(np.concatenate(parts))
    if len(values) < 3:
        return levels
    quantum = float(np.diff(values).min())
    return replace(levels, least=max(levels.least, quantum), fine=max(levels.fine, quantum))


def _fall(view: RecordView, role: str, runs: Runs, distance: NDArray[np.int64]) -> FloatArray:
    """How far the channel is from a run's value at these distances outside; the nearer side."""
    sides = (runs.starts - distance, runs.ends - 1 + distance)
    return np.fmin(*(np.abs(_at(view, role, runs, side) - runs.values) for side in sides))


def _at(view: RecordView, role: str, runs: Runs, index: NDArray[np.int64]) -> FloatArray:
    """Samples at `index`, mostly out of the block at hand; NaN outside of the record."""
    values = np.full(len(index), np.nan)
    inside = (index >= runs.begin) & (index < runs.begin + len(runs.block))
    values[inside] = runs.block[index[inside] - runs.begin]
    for k in np.flatnonzero(~inside & (index >= 0) & (index < view.n)):
        values[k] = view.read(role, int(index[k]), int(index[k]) + 1)[0]
    return values


def _thinned(view: RecordView, role: str, most: int) -> FloatArray:
    """The channel as at most `most` means of consecutive samples."""
    group = -(-view.n // most)
    rows = max(_BLOCK // group, 1) * group
    blocks = (x[: len(x) // group * group] for _, x in view.blocks(role, size=rows))
    return np.concatenate([x.reshape(-1, group).mean(axis=1) for x in blocks])


def within(one: Stretch, gaps: Stretches) -> bool:
    """Whether a stretch lies within a gap."""
    return any(first <= one[0] and one[1] <= end for first, end in gaps)


def gaps_of_target(view: RecordView, role: str, *, frozen: Sequence[Stretch] = ()) -> Stretches:
    """The gaps of a channel: samples to be left out, without overlaps, in order.

    A gap is a stretch of equal samples that the channel enters and leaves by a step larger
    than any that its motion takes elsewhere; of a stretch that is known to be frozen, where it
    enters or leaves so. A record may begin or end within a gap. A sample far off alone is one.

    Parameters
    ----------
    view, role
        The channel.
    frozen : sequence of Stretch
        Where it stands still although it cannot (`frozen`).

    Examples
    --------
    A sine, in which the sensor shows the end of its range for 60 samples.

    >>> import tempfile; from pathlib import Path
    >>> from vinesexp.records.stored.store import RecordWriter, open_record
    >>> x = 0.005 * np.sin(np.arange(8000) / 100.0); x[3000:3060] = 0.03
    >>> path = Path(tempfile.mkdtemp()) / "a.nc"
    >>> quantities = {"displacement": "displacement"}
    >>> with RecordWriter(path, sample_rate=1e3, quantities=quantities) as writer:
    ...     writer.append({"displacement": x})
    >>> with open_record(path) as view:
    ...     gaps_of_target(view, "displacement")
    ((3000, 3060),)
    """
    starts, ends = _still(view, role)
    alone = lone_samples(view, role)  # their steps are none of the motion
    odd = np.concatenate([np.stack([starts, ends]), np.reshape(alone, (-1, 2)).T], axis=1)
    far = _far_steps(view, role, *odd.astype(np.int64))
    # The first far step at or before its beginning, the last one at or after its end.
    first = np.append(far, view.n)[np.searchsorted(far, starts - 1 - _BESIDE)]
    last = np.append(-1, far)[np.searchsorted(far, ends - 1 + _BESIDE, side="right")]
    enters, leaves = first < starts, last >= ends - 1
    whole = (enters | (starts == 0)) & (leaves | (ends == view.n))
    for begin, end in frozen:
        whole |= (starts >= begin) & (ends <= end)
    return _joined([*alone, *(
        (int(first[i]) + 1 if enters[i] else int(starts[i]),
         int(last[i]) + 1 if leaves[i] else int(ends[i]))
        for i in np.flatnonzero(whole & (enters | leaves))
    )])  # fmt: skip


def lone_samples(view: RecordView, role: str) -> Stretches:
    """One to three samples that lie far from the motion on either side: a bit that was lost.

    Each is far off the middle of its neighbours, and so are these by one half; a step is far off
    beside two samples alone.

    Examples
    --------
    >>> import tempfile; from pathlib import Path
    >>> from vinesexp.records.stored.store import RecordWriter, open_record
    >>> x = 0.005 * np.sin(np.arange(8000) / 100.0); x[3000] += 0.02; x[5000:5002] -= 0.01
    >>> x[7000:] += 0.001
    >>> path = Path(tempfile.mkdtemp()) / "a.nc"
    >>> quantities = {"displacement": "displacement"}
    >>> with RecordWriter(path, sample_rate=1e3, quantities=quantities) as writer:
    ...     writer.append({"displacement": x})
    >>> with open_record(path) as view:
    ...     lone_samples(view, "displacement")
    ((3000, 3001), (5000, 5002))
    """
    step = _levels(view, role).usual
    found: list[tuple[int, int]] = []
    for low, x in view.blocks(role, size=_BLOCK, before=_BESIDE, more=_BESIDE):
        bend = np.pad(x[1:-1] - 0.5 * (x[:-2] + x[2:]), 1)
        far = np.abs(bend) > _LONE * max(float(np.median(np.abs(bend))), step)
        if far.mean() > _RARE:
            continue
        at = np.flatnonzero(far)
        for group in np.split(at, np.flatnonzero(np.diff(at) > 1) + 1) if at.size else ():
            first, end = int(group[0]) + (group.size > 1), int(group[-1]) + (group.size == 1)
            own = np.abs(bend[first - 1 : end + 1])
            # out and back: a crest bends to one side, and a step is over at its second sample
            alone = abs(float(bend[first - 1 : end + 1].sum())) < _BACK * float(own.sum())
            alone &= float(min(own[0], own[-1])) > _BACK * float(own.max())
            if 0 < end - first <= _MOST_LONE and alone:
                found.append((low + first, low + end))
    return _joined(found)


def _still(view: RecordView, role: str) -> IntArray:
    """First sample, and the one after the last, of each stretch of equal samples: a row each."""
    runs = equal_runs(view, role, least=max(_EQUAL, _HELD * _held(view, role)))
    found = [np.stack([one.starts, one.ends]) for one in runs]
    return np.concatenate([np.empty((2, 0), dtype=np.int64), *found], axis=1)


def _far_steps(view: RecordView, role: str, starts: IntArray, ends: IntArray) -> IntArray:
    """Samples after which the channel steps further than its motion does away from `starts`."""
    usual, sizes = 0.0, []
    for begin, block in view.blocks(role, size=_BLOCK, more=1):
        steps = np.abs(np.diff(block))
        near = np.zeros(steps.size + 1, dtype=np.int64)
        own = (ends + _BESIDE > begin) & (starts - _BESIDE - 1 < begin + steps.size)
        np.add.at(near, np.clip(starts[own] - _BESIDE - 1 - begin, 0, steps.size), 1)
        np.add.at(near, np.clip(ends[own] + _BESIDE - begin, 0, steps.size), -1)
        away = steps[np.cumsum(near)[:-1] == 0]
        usual = max(usual, float(away.max()) if away.size else 0.0)
        sizes.append(float(np.median(steps[steps > 0.0])) if steps.any() else 0.0)
    # A coarse converter stands still almost everywhere: its steps are one quantum.
    usual = max(usual, _QUANTA * float(np.median(sizes)) if sizes else 0.0)
    far = [
        begin + np.flatnonzero(np.abs(np.diff(block)) > usual)
        for begin, block in view.blocks(role, more=1)
    ]
    return np.concatenate([np.empty(0, np.int64), *far]).astype(np.int64)


def _joined(stretches: list[tuple[int, int]]) -> Stretches:
    found: list[tuple[int, int]] = []
    for first, end in sorted(stretches):
        add_run(found, first, end)
    return tuple(found)


def starts_anew(view: RecordView, role: str) -> IntArray:
    """Samples before which a channel jumps across its range while its motion goes on.

    So does an interferometer or an encoder whose counter, or whose phase, is full. What loses its
    target, or switches, does not move on in the same direction on either side of the jump.

    Examples
    --------
    >>> import tempfile; from pathlib import Path
    >>> from vinesexp.records.stored.store import RecordWriter, open_record
    >>> x = (0.012 * np.sin(np.arange(2000) / 100.0) + 0.004) % 0.008
    >>> path = Path(tempfile.mkdtemp()) / "a.nc"
    >>> quantities = {"displacement": "displacement"}
    >>> with RecordWriter(path, sample_rate=1e3, quantities=quantities) as writer:
    ...     writer.append({"displacement": x})
    >>> with open_record(path) as view:
    ...     starts_anew(view, "displacement")[:3]
    array([ 34, 281, 349])
    """
    levels = _levels(view, role)
    least = _ACROSS * (levels.reach)
    found: list[IntArray] = [np.empty(0, dtype=np.int64)]
    large, rest = 0, 0.0
    around = view.blocks(role, size=_BLOCK, before=_BESIDE, more=1 + _BESIDE)
    for number, (first, x) in enumerate(around):
        steps = np.abs(np.diff(x))
        rest = max(rest, float(steps[steps <= least].max(initial=0.0)))
        at = np.flatnonzero(steps > least) + 1
        at = at[(at >= _BESIDE) & (at < len(x) - _BESIDE) & (first + at <= (number + 1) * _BLOCK)]
        step, before = x[at] - x[at - 1], x[at - 1] - x[at - _BESIDE]
        on = (before * step < 0.0) & ((x[at + _BESIDE] - x[at]) * step < 0.0)
        large += at.size
        found.append(first + at[on])
    at = np.concatenate(found)
    sure = at.size >= max(_AGAIN, _EACH * large) and rest < _OTHERS * least
    return at if sure else at[:0]


#: Levels of a displacement from which on its steps matter little, and share of changes that go back
#: at once where noise of half a step or more moves it across them.
_LEVELS, _BACK_AND_FORTH = 64, 0.3


def staircase(view: RecordView, role: str) -> str:
    """That a displacement is a staircase: few levels, and no noise across them; else empty.

    Noise of half a step makes the mean over samples as fine as without steps.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from vinesexp.records.stored.store import RecordWriter, open_record
    >>> t = np.arange(5000) / 500.0
    >>> x = np.round(7.4 * np.cos(2.0 * np.pi * 1.3 * t)) * 1e-4
    >>> path = Path(tempfile.mkdtemp()) / "record.nc"
    >>> quantities = {"displacement": "displacement"}
    >>> with RecordWriter(path, sample_rate=500.0, quantities=quantities) as writer:
    ...     writer.append({"displacement": x})
    >>> with open_record(path) as view:
    ...     staircase(view, "displacement").partition(";")[0]
    'displacement moves over 14 steps of 0.1 mm of the recorder without noise across them'
    """
    levels = _levels(view, role)
    reach = levels.reach
    if not 0.0 < levels.least < np.inf or reach > _LEVELS * levels.least:
        return ""
    back = moves = 0
    for _, block in view.blocks(role, size=_BLOCK):
        steps = np.diff(block)
        steps = steps[steps != 0.0]
        back += int(np.count_nonzero(steps[1:] * steps[:-1] < 0.0))
        moves += steps.size
    if back > _BACK_AND_FORTH * moves:
        return ""
    return (
        f"{role} moves over {reach / levels.least:.0f} steps of {1e3 * levels.least:.3g} mm of the "
        "recorder without noise across them; velocities beside an impact are less sure for it: "
        "choose a smaller range"
    )


def look_over(
    view: RecordView,
    record: Record,
    channels: Mapping[str, Channel],
    samples: Samples,
) -> tuple[list[Check], dict[str, Stretches]]:
    """Refuse a stored record for its defects, or report its size, what is odd, and its gaps.

    Parameters
    ----------
    view : RecordView
        The record as stored.
    record, channels
        What the campaign says of it, and what defects its channels accept.
    samples : Samples
        What it was made from, read to its end.

    Returns
    -------
    checks : list of Check
    missing : dict
        Of each channel with gaps, the stretches to leave out.

    Raises
    ------
    RecordError
        Too short, saturated or frozen, or hardly a stretch without gaps.
    """
    size = f"{view.n} samples at {view.sample_rate:.9g} Hz: {', '.join(view.roles)}"
    found = [Check(record.id, "ingest", "ok", size)]
    found += [Check(record.id, check, "warning", reported) for check, reported in samples.warnings]
    found += _trimmed(record, samples)
    period = _period(view, record)
    missing: dict[str, Stretches] = _paused(view, record, samples, period)
    for role in view.roles:
        checks, gaps = _look_over_channel(view, record, channels[role], samples, period)
        found += checks
        if gaps:
            missing[role] = _joined([*missing.get(role, ()), *gaps])
    return found, missing


def _look_over_channel(
    view: RecordView, record: Record, channel: Channel, samples: Samples, period: float | None
) -> tuple[list[Check], list[Stretch]]:
    """The same of one channel: what is odd, and the stretches to leave out."""
    role, found, missing = channel.role, list[Check](), list[Stretch]()
    lost = tuple(samples.lost.get(role, ()))
    empty = tuple((first - 1, end) for first, end in lost)  # they hold the value before them
    if lost:
        said = _left_out(view, record, samples, role, lost, period, "cells are empty")
        if record.test == "drop":
            raise RecordError(f"{said.detail}: {_EVERY_HIT}")
        found.append(said)
        missing += lost
    if reported := samples.overload(role):
        found.append(_judge(record, channel, "saturated", f"{role} {reported}"))
    if role == "displacement" and record.clearance and (steps := staircase(view, role)):
        found.append(Check(record.id, "steps", "warning", steps))
    # Only the oscillator's own inertia forbids it to stop dead; a shaker can.
    still = frozen(view, role, period=period if role == "displacement" else None)
    stuck = [run for run in still if not within(run, empty)]
    gaps: Stretches = ()
    if role in _TARGETS:
        _refuse_a_new_start(view, role, samples)
        gaps = gaps_of_target(view, role, frozen=stuck if role == "displacement" else ())
        stuck = [run for run in stuck if not within(run, gaps)]
    clipped = [run for run in saturated(view, role) if not within(run, (*gaps, *empty))]
    stuck = [run for run in stuck if run not in clipped]
    whole = stuck == [(0, view.n)]
    accepted = "frozen" in channel.accept or record.test == "drop"
    held = () if whole or accepted else tuple(stuck)
    stuck = [] if held else stuck
    # Of a decay clipped samples show nothing; of impacts, that there is one.
    decays = role == "acceleration" and record.test == "ringdown"
    lacking = tuple(clipped) if decays and "saturated" not in channel.accept else ()
    clipped = [] if lacking else clipped
    for stretches, why in ((gaps, _JUMPS), (held, _STANDS), (lacking, _CLIPPED)):
        if stretches:
            found.append(_left_out(view, record, samples, role, stretches, period, why))
            missing += stretches
    if whole and role not in _MOVING[record.test]:
        reported = f"{role} does not change at all; noise below one step of the instrument?"
        return [*found, Check(record.id, "frozen", "warning", reported)], missing
    alone = role == "acceleration" and "displacement" not in view.roles
    motion = alone and _share(clipped, view) > MOTION_CLIPPED
    for defect, runs in (("saturated", clipped), ("frozen", stuck)):
        if runs:
            reported = f"{role} {_described(view, samples, runs, defect)}"
            found.append(_judge(record, channel, defect, reported, motion=motion))
    return found, missing


def _refuse_a_new_start(view: RecordView, role: str, samples: Samples) -> None:
    """Refuse a displacement whose counter or phase starts anew at the end of its range."""
    at = starts_anew(view, role)
    if not at.size:
        return
    first = int(at[0])
    jump = np.ptp(view.read(role, first - 1, first + 1))
    raise RecordError(
        f"{role} jumps by {jump:.4g} m from one end of its range to the other and moves on "
        f"{at.size} times, first at {view.moment(first)} "
        f"({samples.source.locate(samples.trimmed[0] + first)}): its counter or its phase starts "
        "anew there; measure with a wider range, or unwrap it"
    )


def clipped_share(view: RecordView) -> float:
    """Share of the samples at which the acceleration stands at the end of its range."""
    return _share(saturated(view, "acceleration"), view)


def _share(stretches: Sequence[Stretch], view: RecordView) -> float:
    return sum(end - first for first, end in stretches) / max(view.n, 1)


_EVERY_HIT = "a drop test needs every hit; cut the record there"
_STANDS = (
    "it stands still in the midst of its motion or its noise, as a sensor that is off or shows its "
    "last value"
)
_CLIPPED = "it is clipped at the end of its range; measure with a wider range"
_JUMPS = "it jumps away from its motion and back, as a laser that loses its target"


def _paused(
    view: RecordView, record: Record, samples: Samples, period: float | None
) -> dict[str, Stretches]:
    """The stretches of all channels over which the times pause; no ball may hit in them."""
    if not samples.gaps:
        return {}
    said = next(said for check, said in samples.warnings if check == "time")
    if record.test == "drop":
        raise RecordError(f"{said}: {_EVERY_HIT}")
    _refuse_pieces(view, record, samples.gaps, period, said)
    return dict.fromkeys(view.roles, samples.gaps)


def _refuse_pieces(
    view: RecordView, record: Record, gaps: Stretches, period: float | None, said: str
) -> None:
    """Refuse a record whose gaps leave no two periods in a row; short ones break none."""
    if period is None:
        return
    long = [gap for gap in gaps if gap[1] - gap[0] > _BREAK * period]
    edges = np.array([0, *(edge for gap in long for edge in gap), view.n])
    longest = int(np.diff(edges)[::2].max())
    if longest < _LEAST_PERIODS * period:
        raise RecordError(f"{said}; no two periods of the motion are complete; look at the sensor")


def _left_out(
    view: RecordView, record: Record, samples: Samples, role: str, gaps: Stretches,
    period: float | None, why: str,
) -> Check:  # fmt: skip
    """What is said of gaps; the record is refused where they leave no two periods in a row."""
    seconds = sum(end - first for first, end in gaps) / view.sample_rate
    first, end = max(gaps, key=lambda gap: gap[1] - gap[0])
    reported = (
        f"{role} shows nothing for {seconds:.3g} s of {view.n / view.sample_rate:.4g} s, "
        f"{counted(len(gaps), 'time')}, the longest for "
        f"{1e3 * (end - first) / view.sample_rate:.3g} ms from {view.moment(first)} "
        f"({samples.source.locate(samples.trimmed[0] + first)}): {why}"
    )
    _refuse_pieces(view, record, gaps, period, reported)
    return Check(record.id, "gaps", "warning", f"{reported}; these stretches are left out")


def _period(view: RecordView, record: Record) -> float | None:
    """Period of the motion in samples, refusing a record of fewer than two; None for a drop."""
    if record.frequency and max(record.frequency) >= 0.5 * view.sample_rate:
        raise RecordError(
            f"frequency_hz is {max(record.frequency):g} Hz, the record is sampled at "
            f"{view.sample_rate:g} Hz: expected less than half of that; correct records.csv, or "
            "the times or the sample rate"
        )
    if record.test == "drop":  # a bouncing ball has no period
        return None
    motion = next((role for role in _MOVING[record.test] if role in view.roles), None)
    if motion is None:
        raise RecordError(
            f"{', '.join(view.roles)} alone is enough for drop tests only, expected a channel of "
            f"the motion in a {record.test} test; correct 'test' in records.csv, or the channels"
        )
    seconds = view.n / view.sample_rate
    held = seconds * min(record.frequency) if record.frequency else periods(view, motion)
    if held == 0.0:
        raise RecordError(
            f"{motion} shows no motion; is it the right column, and was the sensor on?"
        )
    if held < _LEAST_PERIODS:
        raise RecordError(
            f"{seconds:.3g} s hold {held:.2g} periods of the motion, expected at least two; record "
            "longer"
        )
    _refuse_other_frequency(view, record, held, motion)
    return view.n / held


def _refuse_other_frequency(view: RecordView, record: Record, held: float, motion: str) -> None:
    """Refuse a periodic test that moves at another frequency than is stated.

    It is the base that does, or without its channel the mass. Harmonics may be stronger than the
    stated frequency, as an acceleration shows them, but are not all there is.
    """
    if record.test != "periodic" or not record.frequency:
        return
    role, least = ("base", _MOST) if "base" in view.roles else (motion, _NEARLY_ALL)
    shown = periods(view, role)
    ratio = shown / held
    near = max(round(ratio), 1)
    if abs(ratio / near - 1.0) < _SAME_FREQUENCY:
        if near == 1:
            return
        least = _ALL
    if _share_at(view, role, shown) < least:
        return
    stated = sum(record.frequency) / len(record.frequency)
    raise RecordError(
        f"frequency_hz is {stated:.5g} Hz, the {'base' if role == 'base' else 'mass'} moves at "
        f"{ratio * stated:.4g} Hz; correct "
        "frequency_hz in records.csv (it is in Hz, no rad/s and no rpm), or the time unit or the "
        "sample rate in campaign.yaml"
    )


#: Shares of the variance at one frequency: of a base that moves at it; of a mass, which may also
#: swing freely; of either, where this is a multiple of what is stated.
_MOST, _NEARLY_ALL, _ALL = 0.5, 0.9, 0.97


def _share_at(view: RecordView, role: str, count: float) -> float:
    """Share of the variance of a channel that is at so many periods in the record."""
    values = _thinned(view, role, 8192)
    values = values - values.mean()
    line = np.exp(-2j * np.pi * count * np.arange(values.size) / values.size)
    return float(2.0 * abs(values @ line) ** 2 / values.size / max(float(values @ values), 1e-300))


_SAME_FREQUENCY = 0.2


def _described(view: RecordView, samples: Samples, found: Stretches, defect: str) -> str:
    first, end = max(found, key=lambda one: one[1] - one[0])
    place = samples.source.locate(samples.trimmed[0] + first)
    more = f", and {counted(len(found) - 1, 'more time')}" if len(found) > 1 else ""
    what, remedy = _DEFECTS[defect]
    return f"{what} for {end - first} samples from {view.moment(first)} ({place}){more}; {remedy}"


def _judge(
    record: Record, channel: Channel, defect: str, reported: str, *, motion: bool = False
) -> Check:
    # Where an accelerometer is clipped the impact is still there, and is marked as clipped later;
    # a clipped displacement would quietly change every amplitude, and so does a clipped motion.
    loud = defect == "saturated" and channel.role in ("acceleration", "sound") and not motion
    if defect in channel.accept or loud:
        return Check(record.id, defect, "warning", reported)
    raise RecordError(f"{reported}, or add accept: {defect} to channels.{channel.role}")


def _trimmed(record: Record, samples: Samples) -> list[Check]:
    before, after = samples.trimmed
    reported = [
        f"{counted(count, 'row')} at the {end}"
        for count, end in ((before, "start"), (after, "end"))
        if count
    ]
    if not reported:
        return []
    detail = f"{' and '.join(reported)} left out, where cells are empty"
    return [Check(record.id, "missing cells", "warning", detail)]
