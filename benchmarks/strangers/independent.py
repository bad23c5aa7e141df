"""f0 and zeta of a decay from its turning points, in numpy alone: nothing of the package."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

_NOISE = 4.0  # times the scatter at the end of a record that a turning point stands out by
_FEWEST = 5  # periods
_NEAR = 1.4  # times the amplitude that values are compared at: those above and below it


@dataclass(frozen=True)
class Fit:
    """f (Hz) and zeta over the decay, and how far its halves differ from the whole."""

    f: float
    f_spread: float
    zeta: float
    zeta_spread: float
    periods: int


def fit(
    times: NDArray[np.float64], values: NDArray[np.float64], *, at: float | None = None
) -> Fit | None:
    """Periods by zero crossings, damping by the logarithm of half swings; None without a decay.

    A frequency or a damping that moves with amplitude is compared near the amplitude `at`.
    """
    good = np.isfinite(times) & np.isfinite(values)
    t, x = times[good], values[good]
    if t.size < 50 or not np.all(np.diff(t) >= 0.0) or np.ptp(x) == 0.0:
        return None
    step = float(np.median(np.diff(t)))
    if step <= 0.0:
        return None
    even = np.arange(t[0], t[-1], step)
    if even.size > 4_000_000 or even.size < 50:
        return None
    y = np.interp(even, t, x)
    y = y - y.mean()
    power = np.abs(np.fft.rfft(y * np.hanning(y.size)))
    frequency = np.fft.rfftfreq(y.size, step)
    power[frequency < 3.0 / (even[-1] - even[0])] = 0.0
    f = float(frequency[np.argmax(power)])
    if f <= 0.0 or f > 0.25 / step:
        return None
    spectrum = np.fft.rfft(y)
    spectrum[(frequency < 0.5 * f) | (frequency > 1.6 * f)] = 0.0
    y = np.fft.irfft(spectrum, y.size)
    signs = np.signbit(y)
    turn = np.flatnonzero(signs[1:] != signs[:-1])
    crossings = even[turn] + step * y[turn] / (y[turn] - y[turn + 1])
    tops = np.array([np.abs(y[a + 1 : b + 1]).max() for a, b in pairwise(turn)])
    if tops.size < 4 * _FEWEST:
        return None
    begin = int(np.argmax(tops[: tops.size // 2])) + 2
    floor = _NOISE * float(np.median(tops[-max(tops.size // 10, 3) :]))
    below = np.flatnonzero(tops[begin:] < min(floor, 0.5 * tops[begin]))
    end = begin + int(below[0]) if below.size else tops.size
    if at is not None:
        near = np.flatnonzero(np.abs(np.log(tops[begin:] / at)) < np.log(_NEAR)) + begin
        if near.size >= 2 * _FEWEST:
            begin, end = int(near[0]), int(near[-1]) + 1
    if end - begin < 2 * _FEWEST:
        return None
    parts = [(begin, end), (begin, (begin + end) // 2), ((begin + end) // 2, end)]
    found = []
    for first, last in parts:
        # Where both move with amplitude, a mean says at which: weighted as noise weights them.
        size = tops[first:last]
        place = 0.5 * (crossings[first:last] + crossings[first + 1 : last + 1])
        slope = np.polyfit(place, np.log(size), 1, w=size)[0]
        here = 0.5 * np.polyfit(crossings[first:last], np.arange(last - first), 1, w=size)[0]
        found.append((here, -slope / (2.0 * np.pi * here)))
    (f, zeta), *halves = found
    if not zeta > 0.0:
        return None
    return Fit(
        f,
        max(abs(h[0] - f) for h in halves),
        zeta,
        max(abs(h[1] - zeta) for h in halves),
        (end - begin) // 2,
    )
