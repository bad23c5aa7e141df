"""Where permanent two impacts per cycle truly end, from the simulated motion alone.

Once a cycle, motion near the periodic one returns to it by a factor that tends to 1 at the end.
The factor is read from a few runs below the end and extrapolated to 1: to 1e-4 of the clearance,
where trying clearance after clearance would take hours.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from benchmarks.robustness.motion import STEP, FloatArray, move
from benchmarks.robustness.rig import Body, Drive

_SECONDS = 110.0
_SMALL = 3e-3  # of the amplitude: farther from the periodic motion nothing is linear
_STILL = 1e-9  # of the amplitude: nearer, nothing is left to see
_FEWEST = 40  # cycles
_LASTS = 1e-5  # a modulation that shrinks no faster stays
_CAPTURED = 0.7  # of the amplitude without a ball: with more, the ball does not hit
_BRACKET = 2e-3  # of the clearance
_BELOW = (0.994, 0.998)  # of the last clearance that settled
#: Periodic tests begin with the mass pulled out so far, m: a rubbing ball would not start else.
PULLED = 0.010


@cache
def true_end(body: Body, drive: Drive, guess: float = 0.0339) -> float | None:
    """Clearance, m, at which the return factor is 1; None where no orbit is found.

    Clearances are tried by halves to 1e-3; the factors a little below then give the end.
    """
    low, high = None, 1.4 * guess
    for share in (0.95, 0.8, 0.65):
        if return_rate(body, drive, share * guess) is not None:
            low = share * guess
            break
    if low is None:
        return None
    while high - low > _BRACKET * guess:
        middle = 0.5 * (low + high)
        if return_rate(body, drive, middle) is None:
            high = middle
        else:
            low = middle
    near, rates = [], []
    for share in _BELOW:
        rate = return_rate(body, drive, share * low)
        if rate is not None and math.isfinite(rate):
            near.append(share * low)
            rates.append(rate)
    if len(near) == 2 and rates[0] < rates[1] < 0.0:
        end = near[1] - rates[1] * (near[1] - near[0]) / (rates[1] - rates[0])
        if low - _BRACKET * guess < end < high + _BRACKET * guess:
            return end
    return 0.5 * (low + high)


def return_rate(body: Body, drive: Drive, b: float) -> float | None:
    """Logarithm of the factor a cycle; None where the motion does not settle."""
    path = move(body, drive, b=b, seconds=_SECONDS, x0=PULLED)
    z = _strobed(path.x, path.v, drive.frequency)
    change = np.diff(z)
    size = float(np.abs(path.x[-20000:]).max())
    if size > _CAPTURED * _bare(body, drive):
        return None
    scale = np.abs(change) / size
    far, moving = np.flatnonzero(scale > _SMALL), np.flatnonzero(scale > _STILL)
    first = 1 + int(far[-1]) if far.size else 0
    d = change[first : int(moving[-1]) + 1]
    if far.size and far[-1] > scale.size - _FEWEST:
        return None
    if d.size < _FEWEST:
        return -math.inf
    # The fast part of the return is over after a while.
    d = d[d.size // 3 :]
    rows = np.stack([d[1:-1], d[:-2]], axis=1)
    weight = 1.0 / (np.abs(rows).sum(axis=1) + 1e-300)
    a = np.linalg.lstsq(rows * weight[:, np.newaxis], d[2:] * weight, rcond=None)[0]
    factor = float(np.abs(np.roots([1.0, -a[0], -a[1]])).max())
    rate = math.log(factor)
    return rate if rate < -_LASTS else None


def _bare(body: Body, drive: Drive) -> float:
    """Amplitude of the linear oscillator without a ball, m."""
    w = 2.0 * math.pi * drive.frequency
    path = complex(body.k1, body.c1 * w)
    return abs(drive.amplitude * path / (path - body.M * w * w))


def _strobed(x: FloatArray, v: FloatArray, frequency: float) -> FloatArray:
    """x once a cycle, by cubic interpolation."""
    t = np.arange(1, int((x.size - 2) * STEP * frequency)) / frequency / STEP
    i = t.astype(np.int64)
    s = t - i
    p = x[i], STEP * v[i], x[i + 1], STEP * v[i + 1]
    return np.asarray(
        (2 * s**3 - 3 * s**2 + 1) * p[0] + (s**3 - 2 * s**2 + s) * p[1]
        + (3 * s**2 - 2 * s**3) * p[2] + (s**3 - s**2) * p[3]
    )  # fmt: skip
