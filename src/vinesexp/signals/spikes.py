"""Where an acceleration stands out of its noise: candidates for impacts, quickly.

Boxcars of 1, 2, 4, ... samples up to a millisecond serve pulses of any length. Each is compared
with its own noise, taken anew for every stretch of samples from the lower quartile of its
absolute values: impacts and their ringing may fill half of a stretch before they count as
noise, and the threshold knows nothing of the record's length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Samples over which noise is taken as constant.
STRETCH = 16384
#: Lower quartile of the absolute value of a standard normal variable.
_QUARTILE = 0.318639
#: Noise is taken from every so many-th sample: neighbours tell little new.
_THIN = 8
_LONGEST_PULSE = 1e-3  # s


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


def boxcars(sample_rate: float) -> list[int]:
    """Lengths of the boxcars at a sample rate (Hz).

    Examples
    --------
    >>> boxcars(1e4), boxcars(1e3)
    ([1, 2, 4, 8], [1])
    """
    longest = max(1, int(_LONGEST_PULSE * sample_rate))
    return [1 << k for k in range(longest.bit_length()) if 1 << k <= longest]


def noise_of(z: FloatArray, floor: float = 0.0) -> float:
    """Standard deviation of the noise in z, spikes put aside.

    Examples
    --------
    >>> z = np.random.default_rng(1).standard_normal(20000); z[::50] = 100.0
    >>> abs(noise_of(z) - 1.0) < 0.1
    True
    """
    thin = np.abs(z[:: _THIN if z.size > 64 * _THIN else 1])
    if not thin.size:
        return max(floor, 1e-300)
    at = thin.size // 4
    return float(max(np.partition(thin, at)[at] / _QUARTILE, floor, 1e-300))


def find_spikes(
    a: FloatArray, sample_rate: float, *, threshold: float = 6.0, noise_floor: float = 0.0
) -> Spikes:
    """Local peaks of a highpassed acceleration above `threshold` times the local noise.

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

    Examples
    --------
    >>> a = np.random.default_rng(0).standard_normal(30000)
    >>> a[12000:12004] += [6.0, 12.0, 12.0, 6.0]
    >>> spikes = find_spikes(a, 1e4)
    >>> spikes.index.tolist(), spikes.width.tolist()
    ([12001], [4])
    """
    widths = boxcars(sample_rate)
    found: list[tuple[IntArray, FloatArray, IntArray]] = []
    noise = np.empty(max(1, -(-a.size // STRETCH)))
    margin = widths[-1]
    for k in range(noise.size):
        begin, end = k * STRETCH, min(a.size, (k + 1) * STRETCH)
        low, high = max(0, begin - margin), min(a.size, end + margin)
        peaks, noise[k] = _stretch(a[low:high], widths, threshold, noise_floor)
        if peaks is not None:
            keep = (peaks[0] + low >= begin) & (peaks[0] + low < end)
            found.append((peaks[0][keep] + low, peaks[1][keep], peaks[2][keep]))
    if not found:
        none = np.empty(0, dtype=np.int64)
        return Spikes(none, np.empty(0), none, noise)
    index, strengths, best_widths = (np.concatenate(part) for part in zip(*found, strict=True))
    return Spikes(index, strengths, best_widths, noise)


def _stretch(
    a: FloatArray, widths: list[int], threshold: float, floor: float
) -> tuple[tuple[IntArray, FloatArray, IntArray] | None, float]:
    """Peaks of one stretch (index, strength, width) and the noise of a sample in it."""
    total = a
    where: list[IntArray] = []
    strength: list[FloatArray] = []
    first = 0.0
    for width in widths:
        if width > 1:
            if total.size <= width:
                break
            total = total[: -(width // 2)] + total[width // 2 :]
        size = np.abs(total)
        noise = noise_of(size, floor * np.sqrt(width))
        if width == 1:
            first = noise
        above = np.flatnonzero(size > threshold * noise)
        where.append(above + (width - 1) // 2)  # the boxcar stands centred on its sample
        strength.append(size[above] / noise)
    lengths = [part.size for part in where]
    if not sum(lengths):
        return None, first
    index, values = np.concatenate(where), np.concatenate(strength)
    width_of = np.repeat(widths[: len(lengths)], lengths)
    best = np.lexsort((-values, index))  # by sample, the strongest boxcar first
    best = best[np.unique(index[best], return_index=True)[1]]
    peaks = best[_peaks(index[best], values[best])]
    return (index[peaks], values[peaks], width_of[peaks]), first


def _peaks(index: IntArray, strength: FloatArray) -> IntArray:
    """Places in `index` (rising samples) that no neighbouring sample exceeds."""
    gap = np.diff(index) > 1
    rises = np.diff(strength) > 0.0
    start = np.concatenate([[True], gap | rises])
    stop = np.concatenate([gap | ~rises, [True]])
    return np.flatnonzero(start & stop)
