"""Samples at uneven times, without gaps, brought onto a uniform clock.

Polynomials through the eight samples around each time: exact for motions of some ten samples a
period and more. The polynomial through the inner six shows the error; it is reported for each
channel as a share of the channel's own strength.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_POINTS = 8


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

    def blocks(self, uneven: Iterable[tuple[Floats, Floats]]) -> Iterator[Floats]:
        """Blocks of samples (rows) on the uniform clock from blocks of times and samples."""
        times = np.empty(0)
        values = np.empty((0, 0))
        done = 0
        sums: list[Floats] = []
        for more_times, more_values in uneven:
            times = np.concatenate((times, more_times))
            values = np.concatenate((values, more_values)) if len(values) else more_values
            if len(times) <= _POINTS:
                continue
            # Up to where eight samples stand around every time.
            reach = int(np.floor((times[-_POINTS // 2] - self.start) / self.interval))
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
        self, times: Floats, values: Floats, begin: int, end: int, sums: list[Floats]
    ) -> Floats:
        wanted: Floats = self.start + np.arange(begin, end, dtype=np.float64) * self.interval
        points = min(_POINTS, len(times))
        place = np.searchsorted(times, wanted)
        left = np.clip(place - points // 2, 0, len(times) - points)
        out = _through(times, values, left, points, wanted)
        # At the ends of the record the six are its last ones: none is asked for what lies beyond.
        inner = max(points - 2, 1)
        left = np.clip(place - inner // 2, 0, len(times) - inner)
        fewer = _through(times, values, left, inner, wanted)
        count = np.full(out.shape[1], float(len(out)))
        sums.append(
            np.array(
                [((out - fewer) ** 2).sum(axis=0), out.sum(axis=0), (out**2).sum(axis=0), count]
            )
        )
        return out


def _through(
    times: Floats, values: Floats, left: NDArray[np.intp], points: int, wanted: Floats
) -> Floats:
    """Lagrange's polynomial through `points` samples from `left` on, at the times `wanted`."""
    out = np.zeros((len(wanted), values.shape[1]))
    for j in range(points):
        weight = np.ones(len(wanted))
        for k in range(points):
            if k != j:
                weight *= (wanted - times[left + k]) / (times[left + j] - times[left + k])
        out += weight[:, None] * values[left + j]
    return out
