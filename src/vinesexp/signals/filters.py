"""Zero-phase Butterworth filters in bounded memory.

A filter that runs forward and then backward shifts nothing in time: its response is |H|^2, for a
Butterworth filter 1/(1 + W^2n) with W the frequency in units of the corner (for a band, its
distance from the middle over the width; frequencies warped as the bilinear transform does). That
is what is multiplied here, transform by transform of overlapping stretches, each with as much
on either side as the filter remembers. `scipy.signal.sosfiltfilt` does the same in time and is its
test; importing `scipy.signal` costs half a second, more than all else in the step of a record.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from vinesexp.arrays import FloatArray
from vinesexp.errors import ParameterError

#: What a filter remembers from farther away than one settling time, relative.
_SETTLED = 1e-10
#: Above this share of the Nyquist frequency an upper corner does nothing but harm.
_TOP = 0.95
_SHORTEST = 1 << 17  # samples transformed at once, where the record has them


@dataclass(frozen=True)
class Butterworth:
    """A band with corners `low` and `high` in Hz (None: open on that side).

    What passes may be integrated twice (`twice`), which takes a lower corner: -1/w^2 has no phase.
    """

    sample_rate: float
    low: float | None
    high: float | None
    order: int = 2
    twice: bool = False

    @property
    def corners(self) -> tuple[float, float]:
        """tan(pi f/fs) of both corners, 0 and infinity where open."""
        low, high = self.low or 0.0, self.high
        warped = math.inf if high is None else math.tan(math.pi * high / self.sample_rate)
        return math.tan(math.pi * low / self.sample_rate), warped

    def gain(self, n: int) -> FloatArray:
        """Response of both directions together at the Fourier frequencies of n samples.

        Examples
        --------
        >>> gain = Butterworth(100.0, low=10.0, high=None).gain(100)
        >>> round(float(gain[10]), 3), float(gain[0])  # the corner, and a constant
        (0.5, 0.0)
        """
        low, high = self.corners
        t = np.tan(np.pi * np.arange(n // 2 + 1) / n)  # huge at the Nyquist frequency, as it should
        with np.errstate(divide="ignore", over="ignore"):
            if high == math.inf:
                W = low / t
            elif low == 0.0:
                W = t / high
            else:
                W = (t - low * high / t) / (high - low)
            gain = 1.0 / (1.0 + W ** (2 * self.order))
        if not self.twice:
            return np.asarray(gain)
        w = 2.0 * np.pi * self.sample_rate * np.arange(1, gain.size) / n
        return np.append(0.0, -gain[1:] / w**2)

    def poles(self) -> NDArray[np.complex128]:
        """Poles of one direction in the z plane."""
        low, high = self.corners
        k = np.arange(self.order)
        p = np.exp(0.5j * np.pi * (2 * k + self.order + 1) / self.order)
        if high == math.inf:
            s = low / p
        elif low == 0.0:
            s = high * p
        else:
            half = 0.5 * p * (high - low)
            root = np.sqrt(half**2 - low * high)
            s = np.concatenate([half + root, half - root])
        return np.asarray((1.0 + s) / (1.0 - s))


def butterworth(
    sample_rate: float, *, low: float | None, high: float | None, order: int = 2
) -> Butterworth | None:
    """A Butterworth band; None where nothing is to be filtered.

    Parameters
    ----------
    sample_rate : float
        Hz.
    low, high : float or None
        Corners (-3 dB; -6 dB after both directions), Hz; None: open on that side. An upper
        corner above 0.95 of the Nyquist frequency is left out.
    order : int
        Of each corner.

    Raises
    ------
    ParameterError
        A lower corner that is not below the upper one and below the Nyquist frequency.

    Examples
    --------
    >>> butterworth(1e4, low=2.0, high=40.0).order
    2
    >>> butterworth(1e4, low=None, high=6e3) is None
    True
    """
    nyquist = 0.5 * sample_rate
    if high is not None and high >= _TOP * nyquist:
        high = None
    ceiling = nyquist if high is None else high
    if low is not None and not 0.0 < low < ceiling:
        raise ParameterError(
            f"bandpass: lower corner {low:.6g} Hz, expected above 0 and below {ceiling:.6g} Hz "
            f"(sample rate {sample_rate:.6g} Hz)"
        )
    if low is None and high is None:
        return None
    return Butterworth(sample_rate, low, high, order)


def settling_samples(band: Butterworth, *, remains: float = _SETTLED) -> int:
    """Samples after which what the filter remembers has shrunk to `remains`.

    Examples
    --------
    >>> settling_samples(butterworth(1e4, low=2.0, high=None)) / 1e4 < 4.0
    True
    """
    poles = np.abs(band.poles())
    slowest = min(float(poles.max()), 1.0 - 1e-12)
    # Both directions meet: n p^n, and an octave of amplitude more for each pair of poles.
    target = math.log(remains) - math.ceil(poles.size / 2) * math.log(2.0) - 2.0
    return math.ceil(target / math.log(slowest))


def zero_phase_blocks(
    blocks: Iterable[FloatArray], band: Butterworth, *, before: FloatArray, after: FloatArray
) -> Iterator[FloatArray]:
    """Filter a record given by blocks, without phase.

    Parameters
    ----------
    blocks : iterable of arrays
        Consecutive stretches of the record.
    band : Butterworth
    before, after : arrays
        What is taken to lie before the first and after the last sample (`condition.continued_sine`,
        `condition.continued_line`); beyond that, the end value stands.

    Yields
    ------
    array
        Consecutive stretches of the filtered record, all in all as long as the blocks. Blocks
        need not be those of the input.
    """
    margin = settling_samples(band)
    size = 1 << (max(_SHORTEST, 3 * margin) - 1).bit_length()
    gain = band.gain(size)
    held, pending = np.empty(0), 0  # the margin before, then samples not yet given out
    for block in blocks:
        if not block.size:
            continue
        if not held.size:
            held = _stretched(before, block[0], margin, at_end=False)
        held = np.concatenate([held, block])
        pending += block.size
        while pending >= size - margin:  # a margin of it is what comes after
            ready = size - 2 * margin
            yield _through(held[:size], gain)[margin : margin + ready]
            held, pending = held[ready:], pending - ready
    if pending:
        last = held[-1]
        whole = np.concatenate([held, _stretched(after, last, margin, at_end=True)])
        n = next_fast_len(whole.size, real=True)
        padded = np.concatenate([whole, np.full(n - whole.size, whole[-1])])
        yield _through(padded, band.gain(n))[margin : margin + pending]


def _through(x: FloatArray, gain: FloatArray) -> FloatArray:
    return np.fft.irfft(np.fft.rfft(x) * gain, x.size)


def _stretched(extension: FloatArray, value: float, length: int, *, at_end: bool) -> FloatArray:
    """An extension as long as the margin: its far end goes on."""
    if at_end:
        known = extension[:length]
        return np.concatenate(
            [known, np.full(length - known.size, known[-1] if known.size else value)]
        )
    known = extension[max(0, extension.size - length) :]
    return np.concatenate([np.full(length - known.size, known[0] if known.size else value), known])


def zero_phase(
    x: FloatArray,
    band: Butterworth | None,
    *,
    before: FloatArray | None = None,
    after: FloatArray | None = None,
) -> FloatArray:
    """Filter one array without phase; see `zero_phase_blocks`.

    Examples
    --------
    >>> t = np.arange(4000) / 1e3
    >>> x = np.cos(2 * np.pi * 8.0 * t) + 3.0
    >>> y = zero_phase(x, butterworth(1e3, low=1.0, high=60.0))
    >>> bool(np.abs(y - (x - 3.0))[1500:2500].max() < 2e-3)
    True
    """
    if band is None or not x.size:
        return x.copy()
    none = np.empty(0)
    return np.concatenate(
        list(
            zero_phase_blocks(
                [x],
                band,
                before=none if before is None else before,
                after=none if after is None else after,
            )
        )
    )
