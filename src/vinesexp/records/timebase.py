"""Whether the times of a file are the uniform clock of a sampler, checked while they stream by.

Printed times are rounded, to q say (0.001 s of the last digit). Two rounded times of a clock with
interval dt differ from dt by less than q, and lie within q of the straight line through the
first and last time (q/2 of their own, at most q/2 of the line's). More than that is a gap, a jump
or jitter. Where q comes near dt, a lost sample could hide in it, so at most dt/2 is allowed for
a step. The sampler's own clock is granted a hundredth of dt.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import RecordError

Floats = NDArray[np.float64]

_JITTER = 0.01  # of an interval: a hundredth of a sample, a tenth of what impact timing needs
_PIECES = 64  # stretches of a block whose extremes are kept for the check against the whole line
_PROBE = 1000  # times from which the printed resolution of a block is found


class Clock:
    """Checks uniformity block by block; `finish` gives sample rate and start.

    Parameters
    ----------
    file : Path
        For messages.
    locate : callable
        Row number to its place in words.
    size : float
        Size of the file's time unit, s.
    """

    def __init__(self, file: Path, locate: Callable[[int], str], size: float = 1.0) -> None:
        self._file = file
        self._locate = locate
        self._size = size
        self._n = 0
        self._first_row = 0
        self._first = self._last = self._interval = self._resolution = math.nan
        self._extremes: list[tuple[NDArray[np.int64], Floats]] = []

    def add(self, times: Floats, *, row: int) -> None:
        """Check one further block of times (file's unit), whose first stands in row `row`.

        Raises
        ------
        RecordError
            A time that does not increase, or a step of another length; with its line.
        """
        if not self._n:
            self._first_row, self._first, self._last = row, float(times[0]), float(times[0])
            steps = np.diff(times)
        else:
            steps = np.diff(times, prepend=self._last)
        if not len(steps):
            self._n += len(times)
            return
        self._resolution = np.fmax(
            self._resolution, max(_resolution(times[:_PROBE]), _resolution(times[-_PROBE:]))
        )
        if math.isnan(self._interval):
            # The mean step stands up to rounding (1.5 ms printed to 1 ms), the median to gaps.
            self._interval = float(steps.mean())
            if not self._are_even(steps):
                self._interval = float(np.median(steps))
        self._check_steps(times, steps, row)
        index = np.arange(self._n, self._n + len(times))
        self._n += len(times)
        self._last = float(times[-1])
        # The line through all times is known at the end only: keep the points that stray most
        # from the line so far, in stretches so short that the two lines run parallel there.
        interval = (self._last - self._first) / max(self._n - 1, 1)
        astray = times - (self._first + index * interval)
        pieces = np.array_split(np.arange(len(times)), min(_PIECES, len(times)))
        chosen = np.array([p[f(astray[p])] for p in pieces for f in (np.argmin, np.argmax)])
        self._extremes.append((index[chosen], times[chosen]))

    def finish(self) -> tuple[float, float]:
        """Sample rate (Hz) and time of the first sample (s).

        Raises
        ------
        RecordError
            Fewer than two samples, or times that wander from a uniform clock.
        """
        if self._n < 2:
            raise RecordError(
                "holds fewer than two samples; export the record again", file=self._file
            )
        interval = (self._last - self._first) / (self._n - 1)
        tolerance = self._resolution + _JITTER * interval
        for index, times in self._extremes:
            astray = np.abs(times - (self._first + index * interval))
            worst = int(np.argmax(astray))
            if astray[worst] > tolerance:
                row = self._first_row + int(index[worst])
                raise RecordError(
                    f"time {times[worst]:.9g} is {astray[worst] / interval:.2g} intervals from a "
                    "uniform clock; resample the record, or give 'sample_rate' instead of 'time' "
                    "if the samples are uniform",
                    file=self._file,
                    where=self._locate(row),
                )
        return self._rate(interval), self._first * self._size

    def _check_steps(self, times: Floats, steps: Floats, row: int) -> None:
        if self._are_even(steps):
            return
        interval = self._interval
        wrong = (steps <= 0.0) | (np.abs(steps - interval) > self._allowed())
        k = int(np.argmax(wrong))
        step = float(steps[k])
        at = row + k + (0 if len(steps) == len(times) else 1)
        now = times[k if len(steps) == len(times) else k + 1]
        if step < 0.0:
            told = f"time goes backward, from {now - step:.9g} to {now:.9g}; remove the rows that "
            told += "are out of order, or give 'sample_rate' instead of 'time'"
        elif step == 0.0 or interval <= 0.0:
            told = f"time stands still at {now:.9g}; if it is only printed too coarsely, give "
            told += "'sample_rate' instead of 'time'"
        else:
            told = f"time steps by {step:.6g} from {now - step:.9g} to {now:.9g}, expected "
            told += f"{interval:.3g}; samples are missing or unevenly spaced, cut or resample "
            told += "the record"
        raise RecordError(told, file=self._file, where=self._locate(at))

    def _are_even(self, steps: Floats) -> bool:
        return self._interval > 0.0 and bool(
            np.abs(steps - self._interval).max() <= self._allowed()
        )

    def _allowed(self) -> float:
        interval = abs(self._interval)
        return min(self._resolution, 0.5 * interval) + _JITTER * interval

    def _rate(self, interval: float) -> float:
        """1/interval in Hz, the whole number if that is within what the printed times tell."""
        rate = 1.0 / (interval * self._size)
        uncertainty = rate * (
            self._resolution / (interval * (self._n - 1)) + 4.0 * np.finfo(float).eps
        )
        return float(round(rate)) if abs(rate - round(rate)) <= min(uncertainty, 0.01) else rate


def _resolution(times: Floats) -> float:
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
