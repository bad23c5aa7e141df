"""A highpassed acceleration read by pieces, so that memory is bounded whatever its length."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.signals.impacts.candidates import STRETCH
from vinesexp.signals.means import block_means

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
        (begin, end) to highpassed samples, m/s^2; not finite where there are none.
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

    def samples(self, begin: int, end: int) -> FloatArray:
        """Samples, NaN where there are none."""
        raw = self.read(begin, end)
        good = np.isfinite(raw)
        return raw if good.all() else np.where(good, raw, np.nan)

    def beyond(self, begin: int, end: int) -> BoolArray:
        """Which samples are clipped."""
        if self.clipped is None:
            return np.zeros(end - begin, dtype=bool)
        return self.clipped(begin, end)

    def chunks(self) -> range:
        """First samples of the pieces that are handled at once."""
        return range(0, self.n, CHUNK)


def stream_of(
    acceleration: FloatArray, sample_rate: float, *, highpass: float | None = None,
    noise_floor: float = 0.0, clipped: BoolArray | None = None,
) -> Stream:  # fmt: skip
    """A stream of an acceleration held in memory; see `Stream`."""
    return Stream(
        lambda begin, end: acceleration[begin:end], acceleration.size, sample_rate,
        highpass, noise_floor,
        None if clipped is None else lambda begin, end: clipped[begin:end],
    )  # fmt: skip


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
        missing = ~np.isfinite(raw)
        beyond = self.stream.beyond(begin, begin + raw.size)
        a: FloatArray = np.where(missing, 0.0, raw) if missing.any() else raw
        if self.k == 1:
            return Piece(a, ~(missing | beyond), beyond & ~missing)
        holes, over = self._any(missing), self._any(beyond)
        return Piece(block_means(a, self.k), ~(holes | over), over & ~holes)

    def _any(self, flags: BoolArray) -> BoolArray:
        """Whether any of a group's flags is set."""
        return np.asarray(flags[: flags.size // self.k * self.k].reshape(-1, self.k).any(axis=1))
