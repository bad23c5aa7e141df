"""The part of a driven record that shows its response, and how well it gives the mean amplitude.

The start of a test is not the response. Where it ends is found as in simulation studies: the mean
of what is left is known best when all of the start, and nothing else, is left out (K. P. White,
"An effective truncation heuristic for bias reduction in simulation output", Simulation 69, 1997).
The error of the mean allows for cycles that resemble their neighbours, by averages over ever longer
blocks (H. Flyvbjerg and H. G. Petersen, J. Chem. Phys. 91, 461, 1989).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from vinesexp.arrays import FloatArray
from vinesexp.units import COVERAGE_95, SIGNIFICANT

#: Fewer cycles are taken as they are: they show no start.
_FEWEST = 16
#: A start that is left out takes at most this share of the cycles; a longer one has not ended.
_MOST = 0.5
#: Blocks from which an error is still read.
_BLOCKS = 6
_SHARE = 0.005  # of the mean, beyond which a start, or a drift, counts
#: Halves that differ by less have settled as well as a mean needs: the difference is in its error.
_DRIFT = 0.03


@dataclass(frozen=True)
class SteadyPart:
    """Cycles of a record from `first` on: their mean amplitude, and whether it stays.

    Attributes
    ----------
    first : int
        The first cycle that counts.
    cycles : int
        How many count.
    mean, error : float
        Mean amplitude and its standard error, in the unit of the amplitudes; the half width of a
        95 % interval is 1.96 of it. NaN where too few cycles give no error.
    start : float
        Mean amplitude of the start that was left out; NaN where there was none.
    ends : tuple of float
        Mean amplitude of the first and of the last half of the cycles that count.
    drifts : bool
        The amplitude moves one way, the halves differing by more than their errors and 3 %: it
        has not settled. Any other difference between the halves is in `error`.
    """

    first: int
    cycles: int
    mean: float
    error: float
    start: float = math.nan
    ends: tuple[float, float] = (math.nan, math.nan)
    drifts: bool = False


def steady_part(amplitude: FloatArray) -> SteadyPart:
    """Find where the response begins, and give its mean amplitude with a standard error.

    Parameters
    ----------
    amplitude : ndarray, shape (n,)
        One a cycle, n > 0.

    Examples
    --------
    >>> n = np.arange(200)
    >>> amplitude = 5.0 + 2.0 * np.exp(-n / 15.0) + 0.05 * np.sin(1.7 * n)
    >>> found = steady_part(amplitude)
    >>> found.first > 30, abs(found.mean - 5.0) < 0.02, found.drifts
    (True, True, False)
    """
    amplitude = np.asarray(amplitude, dtype=np.float64)
    n = amplitude.size
    first = _truncation(amplitude) if n >= _FEWEST else 0
    if first:
        kept, left_out = amplitude[first:], amplitude[:first]
        error = error_of_mean(kept)
        error *= math.sqrt(1.0 + kept.size / left_out.size)  # of the difference of both means
        if not _differ(left_out.mean(), kept.mean(), error):
            first = 0
    kept = amplitude[first:]
    half = kept.size // 2
    ends = (float(kept[:half].mean()), float(kept[half:].mean())) if half else (math.nan, math.nan)
    error = error_of_mean(kept)
    drifts = kept.size >= _FEWEST and _differ(*ends, 2.0 * _within_halves(kept))
    if drifts:
        error = math.hypot(error, 0.5 * (ends[1] - ends[0]))
        drifts = abs(ends[1] - ends[0]) > _DRIFT * float(kept.mean()) and _one_way(kept)
    return SteadyPart(
        first=first,
        cycles=kept.size,
        mean=float(kept.mean()),
        error=error,
        start=float(amplitude[:first].mean()) if first else math.nan,
        ends=ends,
        drifts=drifts,
    )


def steady_after(
    begin: float, time: FloatArray, amplitude: FloatArray, *, period: float
) -> tuple[SteadyPart, float]:
    """The settled cycles from `begin` on, and when they begin, s.

    Parameters
    ----------
    begin : float
        s; some cycle has to be later.
    time, amplitude : arrays (n,)
        Middle of each cycle, s, and its amplitude.
    period : float
        s.
    """
    judged = time >= begin
    found = steady_part(amplitude[judged])
    return found, float(time[judged][found.first] - 0.5 * period) if found.first else begin


#: Below this share of the least that comes later, the amplitude at the first sample is a start.
_AT_REST, _START = 0.5, 3


def from_rest(amplitude: FloatArray) -> bool:
    """Whether a record begins from rest, by its amplitudes, one a cycle.

    The line through the first three cycles begins below half of what any three later cycles have: a
    response that is modulated comes back to amplitudes as low as it may happen to begin with.

    Examples
    --------
    >>> growing = 5.0 * (1.0 - np.exp(-(np.arange(100) + 0.5) / 20.0))
    >>> from_rest(growing), from_rest(3.0 - 2.5 * np.cos(np.arange(100) / 8.0))
    (True, False)
    """
    if amplitude.size < _FEWEST:
        return False
    first = amplitude[:_START]
    begins = float(first.mean() - (first[-1] - first[0]) * 0.5 * _START / (_START - 1))
    later = np.convolve(amplitude[_START:], np.full(_START, 1.0 / _START), "valid")
    return begins < _AT_REST * float(later.min())


def _one_way(values: FloatArray) -> bool:
    """Whether the means of the quarters only rise or only fall: bursts that come and go do not."""
    steps = np.diff([quarter.mean() for quarter in np.array_split(values, 4)])
    return bool(np.all(steps > 0.0) or np.all(steps < 0.0))


def students_factor(freedom: int) -> float:
    """By what an error is larger whose 95 % interval is that of Student's distribution.

    Examples
    --------
    >>> round(students_factor(1), 2), round(students_factor(1000), 2)
    (6.48, 1.0)
    """
    return max(1.0, float(stdtrit(freedom, 0.975)) / COVERAGE_95)


def error_of_mean(values: FloatArray) -> float:
    """Standard error of the mean of values that resemble their neighbours; NaN of fewer than six.

    The largest of the errors that blocks of 1, 2, 4, ... neighbours give, as long as there are six
    blocks, each widened by the t quantile of its few blocks: 1.96 of it is half a 95 % interval.

    Examples
    --------
    >>> values = np.random.default_rng(1).normal(size=4000)
    >>> bool(abs(error_of_mean(values) * np.sqrt(4000) - 1.0) < 0.4)
    True
    """
    found = [math.nan]
    blocks = np.asarray(values, dtype=np.float64)
    while blocks.size >= _BLOCKS:
        single = students_factor(blocks.size - 1) * float(blocks.std(ddof=1))
        found.append(single / math.sqrt(blocks.size))
        even = blocks.size - blocks.size % 2
        blocks = blocks[:even].reshape(-1, 2).mean(axis=1)
    return max(found[1:], default=math.nan)


def _truncation(amplitude: FloatArray) -> int:
    """Cycles to leave out so that the standard error of the rest is least (White's rule)."""
    n = amplitude.size
    left = np.arange(n, 0, -1.0)
    total = np.cumsum(amplitude[::-1])[::-1]
    spread = np.cumsum((amplitude[::-1] - amplitude.mean()) ** 2)[::-1]
    variance = spread / left - (total / left - amplitude.mean()) ** 2
    error = variance / left
    most = int(_MOST * n)
    return int(np.argmin(error[: most + 1]))


def _within_halves(values: FloatArray) -> float:
    """Standard error of the mean of all values that the scatter inside each half gives."""
    half = values.size // 2
    errors = error_of_mean(values[:half]), error_of_mean(values[half:])
    return 0.5 * math.hypot(*errors)


def _differ(a: float, b: float, error: float) -> bool:
    apart = abs(a - b)
    return apart > _SHARE * abs(b) and not apart <= SIGNIFICANT * error
