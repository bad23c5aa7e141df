"""Whether the times of a file are the uniform clock of a sampler, checked while they stream by.

Printed times are rounded, to q say (0.001 s of the last digit). Two rounded times of a clock with
interval dt differ from dt by less than q, and lie within q of the straight line through the
first and last time (q/2 of their own, at most q/2 of the line's). Where q comes near dt, a lost
sample could hide in it, so at most dt/2 is allowed for a step.

The interval is that of the straight line through all times where they are rounded or stray.
Beyond rounding, a time may stray by a tenth of a sample and the clock still counts as uniform: a
motion of frequency f is off by 2 pi f dt/10 of its amplitude then, a thousandth at 600 samples a
period. What strays more, by jitter or a drifting clock, is `UnevenClockError`: the record can be
resampled. A step that is too long for that is a pause of the logger: what it missed is a gap.

Samples at uneven times brought onto a uniform clock, between the pauses.

Polynomials through the eight samples around each time: exact for motions of some ten samples a
period and more. The polynomial through the inner six shows the error; it is reported for each
channel as a share of the channel's own strength.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import BoolArray, FloatArray, add_run, runs_of
from vinesexp.errors import RecordError
from vinesexp.units import counted

_JITTER = 0.1  # of an interval: what impact timing needs
_COARSE = 1e-3  # of an interval: printed times that are coarser round the interval, too
_STAIRS = (1.25, 20.0)  # intervals in a printed step of times that stand still between its leaps
_ALMOST, _ODD = 0.5, 3  # intervals in a printed step that seem to be pauses; so many of them
#: Printed steps at least of such a record: fewer leave its rate uncertain by a percent.
_FLIGHTS = 100
_ROUND = (1.0, 1.25, 2.0, 2.5, 4.0, 5.0, 8.0, 10.0)  # rates of oscilloscopes, of intervals too
_STILL = 0.02  # of the samples: so many may stand at the time of the one before
_USUAL = 2.5  # times the median: steps among which an uneven clock goes

_GAP = 1.6  # intervals: a lost sample makes two, jitter of a quarter of a sample 1.5
_RECORD = 20  # rows at least of a record that another one follows
_PIECES = 64  # stretches of a block whose extremes are kept for the check against the whole line
_PROBE, _ENDS = 1000, 32  # times from which the printed resolution of a block is found
_POINTS = 8
_PAUSES = 0.2  # of the samples: more long steps are times without any clock


@dataclass(frozen=True)
class Pause:
    """A step over which the logger paused: the times beside it, and its second row."""

    before: float
    after: float
    row: int


class UnevenClockError(Exception):
    """The times stray from a uniform clock, or pause: the record can be resampled.

    Parameters
    ----------
    stray : float
        Largest distance of a time from the uniform clock, in samples; 0 where times pause.
    interval : float
        Of that clock, in the unit of the times.
    pauses : sequence of Pause
        Where nothing was recorded.
    """

    def __init__(self, stray: float, interval: float, pauses: Sequence[Pause] = ()) -> None:
        super().__init__(f"times stray by {stray:.2g} samples")
        self.stray = stray
        self.interval = interval
        self.pauses = tuple(pauses)

    def said(self, locate: Callable[[int], str]) -> str:
        """What is wrong with the times, for a warning."""
        if not self.pauses:
            return f"times stray by up to {self.stray:.2g} samples from a uniform clock"
        longest = max(self.pauses, key=lambda pause: pause.after - pause.before)
        return (
            f"the times pause {counted(len(self.pauses), 'time')}, the longest "
            f"from {longest.before:.9g} to {longest.after:.9g} ({locate(longest.row)}); nothing is "
            "known there"
        )


class Clock:
    """Checks uniformity block by block; `finish` gives sample rate and start.

    Parameters
    ----------
    locate : callable
        Row number to its place in words.
    size : float
        Size of the file's time unit, s.
    stated : float, optional
        Interval that the file states, s: it counts where times are printed more coarsely than it.

    Attributes
    ----------
    n : int
        Times seen.
    first, last : float
        First and last of them, in the file's unit.
    stray : float
        After `finish`: how far times stray beyond their rounding, in samples.
    stairs : float
        Samples to one printed step, where times stand still in between; else 0.
    rounded : float or None
        The round rate (Hz) that is taken, of those that such stairs allow.
    repeated : int
        Times that were those of other rows, and for which the rows count.
    """

    def __init__(
        self, locate: Callable[[int], str], size: float = 1.0, stated: float | None = None
    ) -> None:
        self._locate = locate
        self.size = size
        self._stated = math.nan if stated is None else stated / size
        self.n = 0
        self.first = self.last = self.stray = math.nan
        self.stairs = 0.0
        self.rounded: float | None = None
        self.pauses: list[Pause] = []
        self._refusal: RecordError | None = None  # of the first of them, where they are no pauses
        self._interval = self._coarsest = self._finest = math.nan
        self._longest = np.zeros(3)  # steps
        self.repeated = 0
        self._still = 0
        self._stood: RecordError | None = None
        self._uneven = False
        self._even = math.nan  # interval of a first line, from which the sums below count
        self._sum = self._moment = 0.0
        self._extremes: list[tuple[NDArray[np.int64], FloatArray]] = []

    def add(self, times: FloatArray, *, row: int) -> None:
        """Check one further block of times (file's unit), whose first stands in row `row`.

        Raises
        ------
        RecordError
            A time that does not increase, with its line.
        """
        now, before = times, np.append(self.last, times[:-1])
        if not self.n:
            self.first = self.last = float(times[0])
            now, before, row = times[1:], times[:-1], row + 1
        steps = now - before
        if not len(steps):
            self.n += len(times)
            return
        self._longest = np.partition(np.append(self._longest, steps), -3)[-3:]
        # Numbers of so many digits are printed the more coarsely the larger they are: at the ends.
        ends = [_resolution(times[:_ENDS]), _resolution(times[-_ENDS:])]
        self._coarsest = np.fmax(self._coarsest, max(ends))
        found = [_resolution(times[:_PROBE]), _resolution(times[-_PROBE:])]
        # A few times may happen to be round numbers: what they are printed to shows in the others.
        self._finest = np.fmin(self._finest, min(found))
        if math.isnan(self._interval):
            # The mean step stands up to rounding (1.5 ms printed to 1 ms), the median to gaps.
            self._interval = float(steps.mean())
            if not self._are_even(steps):
                usual = float(np.median(steps))
                most = steps[np.abs(steps) < _USUAL * abs(usual)]
                self._interval = float(most.mean()) if most.size else usual
        if not self._are_even(steps) and 0.0 < (steps == 0.0).mean() < _STILL:
            by_row = self._by_row(np.append(before[0], now))
            now, before, times = by_row[1:], by_row[:-1], by_row[-len(times) :]
            steps = now - before
        if not self._are_even(steps):
            long = self._judge_steps(before, now, row)
            self._uneven = True
            self._interval = float(steps[~long].mean())  # a clock may slow down
        index = np.arange(self.n, self.n + len(times))
        self.n += len(times)
        self.last = float(times[-1])
        # The line through all times is known at the end only: keep the points that stray most
        # from the line so far, in stretches so short that the two lines run parallel there.
        interval = (self.last - self.first) / max(self.n - 1, 1)
        if math.isnan(self._even):
            self._even = interval
        late = times - (self.first + index * self._even)
        self._sum += float(late.sum())
        self._moment += float(index @ late)
        astray = times - (self.first + index * interval)
        pieces = np.array_split(np.arange(len(times)), min(_PIECES, len(times)))
        chosen = np.array([p[f(astray[p])] for p in pieces for f in (np.argmin, np.argmax)])
        self._extremes.append((index[chosen], times[chosen]))

    def finish(self) -> tuple[float, float]:
        """Sample rate (Hz) and time of the first sample (s).

        Raises
        ------
        RecordError
            Fewer than two samples.
        UnevenClockError
            Times that stray from a uniform clock by more than a tenth of a sample.
        """
        if self.n < 2:
            raise RecordError("holds fewer than two samples; export the record again")
        if self._coarser_than_stated():
            self.stairs = min(self._coarsest, float(self._longest.min())) / self._stated
            return self._rate(self._stated), self.first * self.size
        self._forgive_rounding()
        if self._stood is not None and self._still > _STILL * self.n:
            if abs(2 * self._still - self.n) > 2:
                raise self._stood
            raise RecordError(
                "every time stands twice: smallest and largest values (peak detection, envelope); "
                "record with an instrument that writes samples"
            )
        if self.pauses:
            self._finish_with_pauses()
        interval, astray, fitted = self._from_line()
        worst = min(float(np.abs(astray).max()), float(np.abs(fitted).max()))
        self.stray = max(worst - self._coarsest, 0.0) / interval
        if self.stairs and self.last - self.first < _FLIGHTS * self._coarsest:
            raise RecordError(
                f"times are printed to {self._coarsest:g}, too coarsely for their rate; give "
                "'sample_rate' instead of 'time'"
            )
        if self._uneven or self.stray > _JITTER:
            raise UnevenClockError(float(np.abs(astray).max()) / interval, interval)
        if self.stray > 0.0 or self._coarsest > _COARSE * interval:
            interval = self._interval_of_line()
        rate = self._rate(interval)
        self.rounded = _round_rate(rate, self.stairs / self.n)
        return self.rounded or rate, self.first * self.size

    def _from_line(self) -> tuple[float, FloatArray, FloatArray]:
        """Interval of the line through the first and last time; how far times are from it at most.

        The first and the last time stray as the others do: from a line among all of them, too.
        """
        interval = (self.last - self.first) / (self.n - 1)
        index = np.concatenate([index for index, _ in self._extremes])
        astray = np.concatenate([t for _, t in self._extremes]) - (self.first + index * interval)
        return (
            interval,
            astray,
            astray - np.polyval(np.polyfit(index / self.n, astray, 1), index / self.n),
        )

    def _forgive_rounding(self) -> None:
        """Take for rounding what seemed to be pauses of times printed to about their interval.

        1024 Hz in milliseconds: some times stand, or leap by two, at equal distances, so that all
        of them are within half a printed step of one line. A single lost sample is no such thing.
        """
        interval, _, fitted = self._from_line()
        printed = self._coarsest / interval
        odd = len(self.pauses) + self._still
        near = float(np.abs(fitted).max()) < (0.5 + _JITTER) * self._coarsest
        if odd >= _ODD and _ALMOST <= printed <= _STAIRS[1] and near:
            self.pauses, self._still, self._stood, self._refusal = [], 0, None, None
            self._uneven, self.stairs = False, printed

    def _coarser_than_stated(self) -> bool:
        """Whether times that are printed too coarsely to show their interval go with the stated."""
        off = abs(self.last - self.first - (self.n - 1) * self._stated)
        printed = min(self._coarsest, float(self._longest.min()))  # longer ones are gaps
        return printed > _STAIRS[0] * self._stated and off < 2.0 * printed

    def remarks(self) -> list[str]:
        """What is odd about times that are used as a uniform clock; after `finish`."""
        said = []
        if self.repeated:
            said.append(
                f"{counted(self.repeated, 'time')} stood still and came back to the clock: two "
                "samples have no one time, and the rows count there"
            )
        if self.stray > 0.01:
            said.append(
                f"times stray by up to {self.stray:.2g} samples from a uniform clock, which is "
                "ignored"
            )
        if self.stairs:
            known = f"known to {100.0 * self.stairs / self.n:.1g} %"
            known += f" and taken as the round {self.rounded:g} Hz" if self.rounded else ""
            known = "that of the header" if self._coarser_than_stated() else known
            said.append(
                f"times are printed to steps of {self.stairs:.2g} samples: the rate is {known}, "
                "and a lost sample would not show"
            )
        return said

    def _interval_of_line(self) -> float:
        """Interval of the straight line through all times (least squares).

        First and last time stray as the others do, or are rounded; of a record of n times the line
        has the interval better by the root of n.
        """
        middle = 0.5 * (self.n - 1)
        slope = (self._moment - middle * self._sum) / (self.n * (self.n**2 - 1) / 12.0)
        return self._even + slope

    def _finish_with_pauses(self) -> None:
        """Raise `UnevenClockError` where pauses leave most of a clock, else the first refusal."""
        missed = sum(pause.after - pause.before for pause in self.pauses)
        steps = self.n - 1 - len(self.pauses) - self._still
        interval = (self.last - self.first - missed) / max(steps, 1)
        rare = len(self.pauses) < _PAUSES * self.n and missed < self.n * interval
        if self._refusal is not None and not rare:
            raise self._refusal
        raise UnevenClockError(0.0, interval, self.pauses)

    def _by_row(self, times: FloatArray) -> FloatArray:
        """Times of which some stood still and came back to their clock, by the rows instead.

        No two samples have one time. Where the steps about one of nothing last as long together as
        so many rows do, none is missing, and what was written in between is wrong.
        """
        interval, times = self._interval, times.copy()
        near = min(self._coarsest, 0.5 * interval) + 2.0 * _JITTER * interval
        steps = np.diff(times)
        for first, after in runs_of(np.abs(steps - interval) > near):
            rows = after - first
            off = times[after] - times[first] - rows * interval
            if (steps[first:after] == 0.0).any() and abs(off) <= near:
                times[first : after + 1] = np.linspace(times[first], times[after], rows + 1)
                self.repeated += rows - 1
        return times

    def _judge_steps(self, before: FloatArray, now: FloatArray, row: int) -> BoolArray:
        """Which steps are pauses; a step backward, or of nothing, is refused.

        Parameters
        ----------
        before, now : array
            Times on either side of each step.
        row : int
            Of the first of `now`.
        """
        interval, steps = self._interval, now - before
        long = steps > _GAP * interval if interval > 0.0 else np.zeros(steps.size, dtype=bool)
        for k in np.flatnonzero(long).tolist():
            pause = Pause(float(before[k]), float(now[k]), row + k)
            self.pauses.append(pause)
            if self._refusal is None:
                self._refusal = RecordError(
                    f"time steps by {steps[k]:.6g} from {pause.before:.9g} to {pause.after:.9g}, "
                    f"expected {interval:.3g}; samples are missing or unevenly spaced, cut the "
                    "record there, or give 'sample_rate' instead of 'time' if only the times are "
                    "wrong",
                    where=self._locate(pause.row),
                )
        still, back = (steps == 0.0) & ~long, steps < 0.0
        self._still += int(still.sum())
        if back.any():
            k = int(np.argmax(back))
            moved = f"from {before[k]:.9g} to {now[k]:.9g}"
            problem = (
                f"time goes backward, {moved}; remove the rows that are out of order, or give "
                "'sample_rate' instead of 'time'"
            )
            if row + k >= _RECORD and now[k] <= self.first + abs(interval):
                problem = f"the times start again, {moved}: a second record, most likely; put each "
                problem += "into a file of its own"
            raise RecordError(problem, where=self._locate(row + k))
        if still.any() and self._stood is None:
            k = int(np.argmax(still))
            self._stood = RecordError(
                f"the time does not advance at {now[k]:.9g}; if it is only printed too coarsely, "
                "give 'sample_rate' instead of 'time'",
                where=self._locate(row + k),
            )
        return long

    def _are_even(self, steps: FloatArray) -> bool:
        interval = self._interval
        if not interval > 0.0:
            return False
        beyond = float(np.abs(steps - interval).max())
        spare = 2.0 * _JITTER * interval
        printed = self._coarsest / interval
        if beyond > min(self._coarsest, 0.5 * interval) + spare:
            fewest, most = _STAIRS
            if not (fewest <= printed <= most and beyond <= self._coarsest + spare):
                return False
            self.stairs = printed
        return True

    def _rate(self, interval: float) -> float:
        """1/interval in Hz, the whole number if the printed times allow it."""
        rate = 1.0 / (interval * self.size)
        # Half a printed step: the whole number is taken only where it is likely, not just possible.
        printed = 0.5 * self._finest / (interval * (self.n - 1))
        uncertainty = rate * (printed + 4.0 * np.finfo(float).eps)
        return float(round(rate)) if abs(rate - round(rate)) <= min(uncertainty, 0.01) else rate


def _round_rate(rate: float, uncertainty: float) -> float | None:
    """The rate of those that oscilloscopes have, within a relative uncertainty; None of others.

    Examples
    --------
    >>> _round_rate(39973.8, 0.002), _round_rate(1023.9, 0.002), _round_rate(39973.8, 0.0)
    (40000.0, None, None)
    """
    size = 10.0 ** math.floor(math.log10(rate))
    near = min((size * step for step in _ROUND), key=lambda one: abs(one - rate))
    return near if abs(near - rate) <= uncertainty * rate else None


def _resolution(times: FloatArray) -> float:
    """Step in which times were printed: a power of ten, or that of the number format.

    Examples
    --------
    >>> _resolution(np.array([0.0, 0.25, 0.5]))
    0.01
    """
    largest = float(np.abs(times).max())
    precision = 8.0 * np.finfo(float).eps * largest
    for digits in range(16):
        scaled = times * 10.0**digits
        if 10.0**-digits <= precision:
            break
        if np.abs(scaled - np.rint(scaled)).max() <= precision * 10.0**digits:
            return 10.0**-digits
    single = times.astype(np.float32)
    if np.array_equal(single, times):
        return float(np.spacing(np.float32(largest)))
    return precision


@dataclass
class Resampler:
    """Interpolates blocks of uneven samples onto ``start + k*interval``.

    Parameters
    ----------
    start, interval : float
        The uniform clock, in the unit of the times.
    n : int
        Samples to make.

    Attributes
    ----------
    errors : list of float
        After the last block, for each column: rms difference between polynomials through eight and
        six samples over the rms of the column about its mean.
    gaps : list of (int, int)
        Samples made in pauses, which stand on a straight line: first, and the one after the last.

    Examples
    --------
    >>> t = np.arange(200.0) + 0.3 * np.sin(np.arange(200.0))
    >>> resampler = Resampler(start=t[0], interval=(t[-1] - t[0]) / 199, n=200)
    >>> out = np.concatenate(list(resampler.blocks([(t, np.sin(0.1 * t)[:, None])])))
    >>> even = t[0] + np.arange(200) * resampler.interval
    >>> bool(np.abs(out[:, 0] - np.sin(0.1 * even)).max() < 1e-6), resampler.errors[0] < 1e-4
    (True, True)
    """

    start: float
    interval: float
    n: int
    errors: list[float] = field(default_factory=list)
    gaps: list[tuple[int, int]] = field(default_factory=list)

    def blocks(self, uneven: Iterable[tuple[FloatArray, FloatArray]]) -> Iterator[FloatArray]:
        """Blocks of samples (rows) on the uniform clock from blocks of times and samples."""
        times = np.empty(0)
        values = np.empty((0, 0))
        done = 0
        sums: list[FloatArray] = []
        for more_times, more_values in uneven:
            # Polynomials through samples that nearly coincide would be steep between the others.
            apart = np.diff(more_times, prepend=times[-1:] if len(times) else -np.inf)
            kept = apart > (2.0 - _GAP) * self.interval
            more = more_values[kept]
            times = np.concatenate((times, more_times[kept]))
            values = np.concatenate((values, more)) if len(values) else more
            if len(times) <= _POINTS:
                continue
            # Up to where eight samples stand around every time.
            reach = int(np.floor((times[-_POINTS] - self.start) / self.interval))
            if reach > done:
                yield self._block(times, values, done, min(reach, self.n), sums)
                done = min(reach, self.n)
                keep = np.searchsorted(times, self.start + done * self.interval) - _POINTS
                times, values = times[max(keep, 0) :], values[max(keep, 0) :]
        if done < self.n and len(times):
            yield self._block(times, values, done, self.n, sums)
        if sums:
            wrong, first, second, count = (np.sum(part, axis=0) for part in zip(*sums, strict=True))
            strength = np.maximum(second / count - (first / count) ** 2, 0.0)
            share = np.divide(wrong / count, strength, out=np.zeros_like(wrong), where=strength > 0)
            self.errors = [float(one) for one in np.sqrt(share)]

    def _block(
        self, times: FloatArray, values: FloatArray, begin: int, end: int, sums: list[FloatArray]
    ) -> FloatArray:
        """Polynomials through the samples of each stretch, straight lines across the pauses."""
        wanted: FloatArray = self.start + np.arange(begin, end, dtype=np.float64) * self.interval
        place = np.searchsorted(times, wanted)
        edges = np.flatnonzero(np.diff(times) > _GAP * self.interval) + 1
        firsts, ends = np.append(0, edges), np.append(edges, len(times))
        near = np.clip(place, 0, len(times) - 1)
        near -= (near > 0) & (wanted - times[near - 1] < np.abs(times[near] - wanted))
        stretch = np.searchsorted(edges, near, side="right")
        first, end_of = firsts[stretch], ends[stretch]
        size = end_of - first
        known = (size > 1) & (np.abs(times[near] - wanted) < 0.5 * _GAP * self.interval)
        out, fewer = np.empty((2, len(wanted), values.shape[1]))
        for k, column in enumerate(values.T if not known.all() else ()):
            out[~known, k] = np.interp(wanted[~known], times, column)
        for found, most in ((out, _POINTS), (fewer, _POINTS - 2)):
            left_over = known.copy()
            for points in range(most, 0, -2):  # fewer where a stretch has no more
                own = left_over & (size >= points)
                left_over &= ~own
                if own.any():
                    left = np.clip(place - points // 2, first, end_of - points)[own]
                    found[own] = _through(times, values, left, points, wanted[own])
        for one, after in runs_of(~known):
            add_run(self.gaps, begin + one, begin + after)
        count = np.full(out.shape[1], float(max(known.sum(), 1)))
        seen, other = (out, fewer) if known.all() else (out[known], fewer[known])
        sums.append(np.array([((seen - other) ** 2).sum(0), seen.sum(0), (seen**2).sum(0), count]))
        return out


def _through(
    times: FloatArray, values: FloatArray, left: NDArray[np.intp], points: int, wanted: FloatArray
) -> FloatArray:
    """Lagrange's polynomial through `points` samples from `left` on, at the times `wanted`."""
    out = np.zeros((len(wanted), values.shape[1]))
    for j in range(points):
        weight = np.ones(len(wanted))
        for k in range(points):
            if k != j:
                weight *= (wanted - times[left + k]) / (times[left + j] - times[left + k])
        out += weight[:, None] * values[left + j]
    return out
