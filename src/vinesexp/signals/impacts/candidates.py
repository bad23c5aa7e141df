"""Where an acceleration stands out of its noise: candidates for impacts, quickly.

Boxcars of 1, 2, 4, ... samples serve contacts of any length that the highpass lets through. Each
is compared with its own noise, taken anew for every stretch of samples from the range of the
central quarter of its values: impacts and their ringing may fill half of a stretch before they
count as noise, and the threshold knows nothing of the record's length.

The acceleration is read by pieces (`Stream`): memory is bounded whatever its length.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.signals.means import block_means

Samples = NDArray[np.float32] | FloatArray

#: Samples over which noise is taken as constant.
STRETCH = 16384
#: Half of the range that the central quarter of a standard normal variable fills.
_CENTRAL = 0.318639
#: Noise is taken from every so many-th sample: enough for 3 per cent.
_THIN = 4
_LARGEST = 1e30  # of an inverse noise, in seven digits
#: Contacts that are looked for: up to so many s, and up to so many periods of the highpass.
_SHORTEST, _LONGEST = 1e-3, 0.2


@dataclass(frozen=True)
class Spikes:
    """Samples that stand out, in order of time.

    Attributes
    ----------
    index : int array (k,)
        Sample of the local peak.
    strength : float array (k,)
        Height in standard deviations of the noise, after the boxcar that shows it best.
    width : int array (k,)
        Samples of that boxcar.
    noise : float array (stretches,)
        Standard deviation of single samples, one for every `STRETCH` samples.
    """

    index: IntArray
    strength: FloatArray
    width: IntArray
    noise: FloatArray

    def keep(self, chosen: BoolArray) -> Spikes:
        """The chosen ones."""
        index, strength, width = self.index[chosen], self.strength[chosen], self.width[chosen]
        return Spikes(index, strength, width, self.noise)


def boxcars(sample_rate: float, highpass: float | None = None) -> list[int]:
    """Lengths of the boxcars at a sample rate, after a highpass (Hz).

    Examples
    --------
    >>> boxcars(1e4), boxcars(1e3), boxcars(1e3, highpass=10.0)
    ([1, 2, 4, 8], [1], [1, 2, 4, 8, 16])
    """
    seconds = max(_SHORTEST, _LONGEST / highpass) if highpass else _SHORTEST
    longest = max(1, int(seconds * sample_rate))
    return [1 << k for k in range(longest.bit_length()) if 1 << k <= longest]


def noise_of(z: Samples, floor: float = 0.0, *, width: int = 1) -> float:
    """Standard deviation of the noise in z about its median, spikes put aside.

    About the median: where impacts follow one another closely, what the highpass took from them
    lies evenly between them. Of sums over `width` samples fewer are looked at: they overlap.

    Examples
    --------
    >>> z = np.random.default_rng(1).standard_normal(20000); z[::50] = 100.0
    >>> abs(noise_of(z) - 1.0) < 0.1
    True
    """
    every = max(_THIN, width // 2)
    thin = z[:: every if z.size > 64 * every else 1]
    if np.isnan(thin.sum()):
        thin = thin[np.isfinite(thin)]
    if not thin.size:
        return max(floor, 1e-300)
    low, high = (3 * thin.size) // 8, (5 * thin.size) // 8
    part = np.partition(thin, (low, high))
    return float(max(0.5 * (part[high] - part[low]) / _CENTRAL, floor, 1e-300))


def stretch_noise(z: FloatArray, floor: float = 0.0) -> FloatArray:
    """Noise of every stretch of `STRETCH` samples."""
    starts = range(0, max(z.size, 1), STRETCH)
    return np.array([noise_of(z[i : i + STRETCH], floor) for i in starts])


def louder(noise: FloatArray) -> FloatArray:
    """Of every stretch and its neighbours the largest noise.

    For thresholds: where the noise grows within a stretch, its quartile is that of its quiet part.

    Examples
    --------
    >>> louder(np.array([1.0, 1.0, 1.0, 3.0, 1.0])).tolist()
    [1.0, 1.0, 3.0, 3.0, 3.0]
    """
    return np.asarray(maximum_filter1d(noise, 3, mode="nearest"))


def find_spikes(
    a: FloatArray, sample_rate: float, *, threshold: float = 6.0, noise_floor: float = 0.0,
    highpass: float | None = None,
) -> Spikes:  # fmt: skip
    """Local peaks of a highpassed acceleration above `threshold` times the local noise.

    NaN stands for a missing sample: it neither stands out nor counts as quiet.

    Parameters
    ----------
    a : array (n,)
        m/s^2, the oscillator's motion filtered out.
    sample_rate : float
        Hz.
    threshold : float
        In standard deviations of the noise. At 6, noise alone passes once in 5e8 samples.
    noise_floor : float
        The noise of a sample is at least this: what the converter resolves.
    highpass : float, optional
        Corner of the filter before, Hz.

    Examples
    --------
    >>> a = np.random.default_rng(0).standard_normal(30000)
    >>> a[12000:12004] += [6.0, 12.0, 12.0, 6.0]
    >>> spikes = find_spikes(a, 1e4)
    >>> spikes.index.tolist(), bool(spikes.strength[0] > 10.0)
    ([12001], True)
    """
    # Candidates need no more than seven digits, and half the memory is moved in half the time.
    coarse = a.astype(np.float32)
    widths = boxcars(sample_rate, highpass)
    floors = noise_floor * np.sqrt(widths)
    noise = np.array([
        [noise_of(z, floor, width=width)
         for z, floor, width in zip(_boxed(part, widths), floors, widths, strict=True)]
        for part in (coarse[i : i + STRETCH] for i in range(0, max(a.size, 1), STRETCH))
    ])  # fmt: skip
    best, shown = np.zeros_like(coarse), []
    for width, total, sigma in zip(widths, _boxed(coarse, widths), noise.T, strict=True):
        lead = (width - 1) // 2  # the boxcar stands centred on its sample
        here = slice(lead, lead + total.size)
        scale = np.minimum(1.0 / louder(sigma), _LARGEST).astype(np.float32)
        size = np.zeros_like(coarse)
        np.abs(total, out=size[here])
        size *= np.repeat(scale, STRETCH)[: a.size]
        np.fmax(best, size, out=best)
        shown.append(size)
    index = np.flatnonzero(best > threshold)
    peaks = index[_peaks(index, best[index])] if index.size else index
    most = np.argmax(np.nan_to_num([size[peaks] for size in shown]), axis=0)
    return Spikes(peaks, best[peaks].astype(np.float64), np.array(widths)[most], noise[:, 0])


def _boxed(a: NDArray[np.float32], widths: list[int]) -> Iterator[NDArray[np.float32]]:
    """Sums over boxcars of 1, 2, 4, ... samples; each doubles the one before."""
    total = a
    for width in widths:
        if width > 1:
            half = width // 2
            total = total[:-half] + total[half:] if total.size > half else total[:0]
        yield total


def _peaks(index: IntArray, strength: Samples) -> IntArray:
    """Places in `index` (rising samples) that no neighbouring sample exceeds."""
    gap = np.diff(index) > 1
    rises = np.diff(strength) > 0.0
    start = np.concatenate([[True], gap | rises])
    stop = np.concatenate([gap | ~rises, [True]])
    return np.flatnonzero(start & stop)


def strongest(index: IntArray, size: FloatArray, *, reach: float) -> BoolArray:
    """Which of rising samples `index` are largest within `reach` samples to either side.

    Examples
    --------
    >>> strongest(np.array([3, 5, 20]), np.array([1.0, 2.0, 1.0]), reach=4).tolist()
    [False, True, True]
    """
    largest = np.ones(index.size, dtype=bool)
    for step in range(1, index.size):
        near = index[step:] - index[:-step] <= reach
        if not near.any():
            break
        largest[:-step] &= ~(near & (size[step:] > size[:-step]))
        largest[step:] &= ~(near & (size[:-step] >= size[step:]))
    return largest


#: Samples handled at once: a quarter of a million, which a cache holds.
CHUNK = 16 * STRETCH


@dataclass(frozen=True)
class Piece:
    """Samples (means of groups where contacts are long), which are good, and which clipped."""

    a: FloatArray
    good: BoolArray
    clipped: BoolArray


@dataclass(frozen=True)
class Stream:
    """One acceleration.

    Attributes
    ----------
    read : callable
        (begin, end) to highpassed samples, m/s^2; NaN where there are none.
    n : int
        Samples.
    sample_rate : float
        Hz.
    highpass : float or None
        Corner of the zero-phase second-order Butterworth highpass they went through, Hz.
    noise_floor : float
        m/s^2: half of what the converter resolves.
    clipped : callable, optional
        (begin, end) to True where a sample is beyond the sensor's range.
    """

    read: Callable[[int, int], FloatArray]
    n: int
    sample_rate: float
    highpass: float | None = None
    noise_floor: float = 0.0
    clipped: Callable[[int, int], BoolArray] | None = None

    def beyond(self, begin: int, end: int) -> BoolArray:
        """Which samples are clipped."""
        if self.clipped is None:
            return np.zeros(end - begin, dtype=bool)
        return self.clipped(begin, end)


@dataclass(frozen=True)
class Grouped:
    """A stream of which `k` samples at a time are averaged: long contacts need no more."""

    stream: Stream
    k: int

    @property
    def dt(self) -> float:
        """Between two means, s."""
        return self.k / self.stream.sample_rate

    @property
    def noise_floor(self) -> float:
        """Of a mean, m/s^2."""
        return float(self.stream.noise_floor / np.sqrt(self.k))

    @property
    def chunk(self) -> int:
        """Samples (not means) that are handled at once."""
        return CHUNK // self.k * self.k

    def piece(self, begin: int, end: int) -> Piece:
        """Means of the samples from `begin` to `end`, a group that is damaged being not good."""
        raw = self.stream.read(begin, end)
        missing = np.isnan(raw)
        beyond = self.stream.beyond(begin, begin + raw.size)
        a: FloatArray = np.where(missing, 0.0, raw) if missing.any() else raw
        if self.k == 1:
            return Piece(a, ~(missing | beyond), beyond & ~missing)
        holes, over = self._any(missing), self._any(beyond)
        return Piece(block_means(a, self.k), ~(holes | over), over & ~holes)

    def noise(self, piece: Piece) -> FloatArray:
        """Of a mean, for every `STRETCH` of a piece."""
        return stretch_noise(np.where(piece.good, piece.a, np.nan), self.noise_floor)

    def _any(self, flags: BoolArray) -> BoolArray:
        """Whether any of a group's flags is set."""
        return np.asarray(flags[: flags.size // self.k * self.k].reshape(-1, self.k).any(axis=1))
