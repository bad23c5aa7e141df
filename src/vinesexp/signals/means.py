"""What a slow motion needs of a long record: means over groups of samples, amplitudes of cycles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray, IntArray, runs_of
from vinesexp.records.stored.store import RecordView

BLOCK = 1 << 20  # samples read at once
#: Means a cycle of a motion without impacts: its third harmonic keeps 16.
POINTS = 48
_FEWEST, _SIDE = 4, 8  # samples that have a slope, and that are fitted to at least


def fill_gaps(x: FloatArray) -> FloatArray:
    """The array with NaN and infinite samples replaced by a cubic across each gap.

    It leaves and arrives with place and slope of the stretches beside the gap, as long as the gap
    each: of a motion w it misses (w gap)^4/384 of the amplitude in the middle. A straight line
    would miss (w gap)^2/8.

    Examples
    --------
    >>> fill_gaps(np.array([0.0, np.nan, 2.0]))
    array([0., 1., 2.])
    >>> x = np.sin(np.arange(400) / 20.0); known = x.copy(); x[200:215] = np.nan
    >>> bool(np.abs(fill_gaps(x) - known).max() < 2e-3)
    True
    """
    good = np.isfinite(x)
    if good.all() or not good.any():
        return x if good.all() else np.zeros_like(x)
    filled = np.array(x, dtype=np.float64)
    for first, end in runs_of(~good):
        n = max(end - first, _SIDE)
        sides = [_end_of(filled[max(first - n, 0) : first]), _end_of(x[end : end + n][::-1])]
        if first == 0 or end == x.size:
            filled[first:end] = sides[first == 0][0]
            continue
        (y0, s0), (y1, s1) = sides
        h = float(end - first + 1)
        u = np.arange(1, end - first + 1) / h
        up, down = u * u * (3.0 - 2.0 * u), u * (1.0 - u)
        filled[first:end] = y0 + (y1 - y0) * up + h * (s0 * (1.0 - u) + s1 * u) * down
    return filled


def _end_of(x: FloatArray) -> tuple[float, float]:
    """Value at the last sample and slope there, by the cubic through what is known of it.

    The value is the sample itself: a step to another one would be a knock.
    """
    known = np.flatnonzero(np.isfinite(x))
    if not known.size:
        return 0.0, 0.0
    last = float(x[known[-1]])
    if known.size < _FEWEST:
        return last, 0.0
    s = (known - (x.size - 1.0)) / x.size
    slope = np.polyfit(s, x[known], 3 if known.size >= _SIDE else 2)[-2]
    return last, float(slope) / x.size


def longest_run(good: BoolArray) -> tuple[int, int]:
    """First of the longest run of good ones, and the one after its last.

    Examples
    --------
    >>> longest_run(np.array([True, False, True, True, True, False]))
    (2, 5)
    """
    return max(runs_of(good), key=lambda run: run[1] - run[0], default=(0, 0))


def block_means(x: FloatArray, k: int) -> FloatArray:
    """Means over consecutive groups of k samples; the last incomplete group is left out.

    Examples
    --------
    >>> block_means(np.array([1.0, 3.0, 5.0, 7.0, 9.0]), 2)
    array([2., 6.])
    """
    whole = x.size // k * k
    return np.asarray(x[:whole].reshape(-1, k).mean(axis=1))


def group_size(sample_rate: float, frequency: float, *, points: int) -> int:
    """Samples of which a mean is taken: at least `points` means a period of `frequency` are left.

    Examples
    --------
    >>> group_size(1e4, 8.0, points=48), group_size(100.0, 8.0, points=48)
    (26, 1)
    """
    return max(1, int(sample_rate / (points * frequency)))


def channel_means(record: RecordView, role: str, k: int) -> FloatArray:
    """Means over groups of k samples of a whole channel, read by blocks; gaps are filled."""
    blocks = record.blocks(role, size=max(1, BLOCK // k) * k)
    return np.concatenate([block_means(fill_gaps(x), k) for _, x in blocks])


def coarse_channels(
    record: RecordView, frequency: float, points: int, *roles: str
) -> tuple[int, float, list[FloatArray]]:
    """Samples of a mean, s between means, and the means of whole channels (`channel_means`).

    Of a period of `frequency`, Hz, there are at least so many `points` (`group_size`).
    """
    k = group_size(record.sample_rate, frequency, points=points)
    return k, k / record.sample_rate, [channel_means(record, role, k) for role in roles]


def missing_means(record: RecordView, role: str, k: int, *, bridged: int = 0) -> BoolArray:
    """Which of the means of `channel_means` hold a sample that is missing.

    A gap of fewer than `bridged` samples is none: what fills it is as good.
    """
    from scipy.ndimage import binary_opening

    lost = np.concatenate([~np.isfinite(x) for _, x in record.blocks(role)])
    if bridged > 1:
        lost = binary_opening(lost, np.ones(bridged))
    return np.asarray(lost[: lost.size // k * k].reshape(-1, k).any(axis=1))


def cycle_amplitudes(
    x: FloatArray, sample_rate: float, frequency: float
) -> tuple[FloatArray, FloatArray]:
    """Middle time (s from the first sample) and half swing of each cycle.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Displacement in any unit; an offset does no harm.
    sample_rate, frequency : float
        Hz.

    Examples
    --------
    >>> t = np.arange(1000) / 1000.0
    >>> _, a = cycle_amplitudes(np.sin(2 * np.pi * 10.0 * t), 1000.0, 10.0)
    >>> bool(np.all(np.abs(a - 1.0) < 1e-3)), len(a)
    (True, 10)
    """
    return cycles_from(lambda begin, end: x[begin:end], len(x), sample_rate, frequency)


def cycles_from(
    read: Callable[[int, int], FloatArray], n: int, sample_rate: float, frequency: float
) -> tuple[FloatArray, FloatArray]:
    """`cycle_amplitudes` of a displacement of n samples that is read by blocks of cycles."""
    length = sample_rate / frequency
    edges = np.round(np.arange(0.0, n + 1e-9, length)).astype(np.int64)
    low, high = extremes_of_parts(read, edges, gaps=True)
    middle = np.asarray(0.5 * (edges[:-1] + edges[1:]) / sample_rate, dtype=np.float64)
    return middle, 0.5 * (high - low)


def equal_parts(n: int, parts: int) -> IntArray:
    """Edges of so many equal parts of n samples; of every sample where there are fewer.

    Examples
    --------
    >>> equal_parts(7, 3), equal_parts(2, 3)
    (array([0, 2, 4, 7]), array([0, 1, 2]))
    """
    return np.unique(np.linspace(0, n, min(parts, n) + 1).astype(np.int64))


def extremes_of_parts(
    read: Callable[[int, int], FloatArray], edges: IntArray, *, gaps: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest sample of each part between two edges.

    Read by blocks of whole parts: memory does not grow with the record.

    Parameters
    ----------
    read : callable
        Samples [begin, end).
    edges : ndarray, shape (n + 1,)
        First sample of each part, and the one after the last.
    gaps : bool
        Whether a part that lacks a sample is NaN; else it is what its other samples show.

    Examples
    --------
    >>> x = np.array([0.0, 1.0, np.nan, 2.0])
    >>> extremes_of_parts(lambda begin, end: x[begin:end], np.array([0, 2, 4]))
    (array([0., 2.]), array([1., 2.]))
    """
    least, most = (np.minimum, np.maximum) if gaps else (np.fmin, np.fmax)
    low, high = np.empty(edges.size - 1), np.empty(edges.size - 1)
    begin = 0
    while begin < low.size:
        end = max(int(np.searchsorted(edges, edges[begin] + BLOCK, "right")) - 1, begin + 1)
        samples = read(int(edges[begin]), int(edges[end]))
        starts = edges[begin:end] - edges[begin]
        low[begin:end] = least.reduceat(samples, starts)
        high[begin:end] = most.reduceat(samples, starts)
        begin = end
    return low, high


def time_to_level(time: FloatArray, amplitude: FloatArray, level: float) -> float:
    """When the amplitude falls below `level` for good, interpolated; NaN if it does not.

    Examples
    --------
    >>> time_to_level(np.array([0.0, 1.0, 2.0]), np.array([3.0, 2.0, 1.0]), 1.5)
    1.5
    """
    above = np.flatnonzero(amplitude > level)
    if above.size == 0 or above[-1] + 1 >= amplitude.size:
        return float("nan")
    i = int(above[-1])
    share = (amplitude[i] - level) / (amplitude[i] - amplitude[i + 1])
    return float(time[i] + share * (time[i + 1] - time[i]))


#: Of a hand that stops a mass: share of an amplitude that is left from two cycles later on, how
#: many times as much is lost as in the two before, share of the largest from which on it is told.
_STOPPED, _SUDDEN, _TOLD = 0.1, 3.0, 0.05


def free_cycles(amplitude: FloatArray) -> int:
    """How many cycles of a decay come before a hand stops the mass; all where none does.

    A damper, friction and a ball take no more in a cycle than in those before.

    Examples
    --------
    >>> decay = np.exp(-0.02 * np.arange(60)); free_cycles(decay)
    60
    >>> free_cycles(np.where(np.arange(60) < 25, decay, 1e-3 * decay))
    24
    >>> rubs = np.maximum(1.0 - 0.09 * np.arange(30), 0.0); free_cycles(rubs)
    30
    """
    if amplitude.size < 5 or not np.isfinite(amplitude).any():
        return amplitude.size
    later = np.fmax.accumulate(amplitude[::-1])[::-1]
    before, at, after = amplitude[:-4], amplitude[2:-2], later[4:]
    falls = (after < _STOPPED * at) & (at - after > _SUDDEN * (before - at))
    stopped = np.flatnonzero(falls & (at > _TOLD * np.nanmax(amplitude)))
    return int(stopped[0]) + 3 if stopped.size else amplitude.size
