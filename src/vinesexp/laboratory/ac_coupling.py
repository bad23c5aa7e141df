"""AC coupling: the first-order high-pass between an accelerometer and its converter."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Time constants after which the past is forgotten: e^-25 is a thousandth of 24 bits.
_FORGOTTEN = 25.0


def high_passed(signal: Callable[[Array], Array], t: Array, *, dt: float, corner: float) -> Array:
    """`signal` after a first-order high-pass of a corner (Hz), at the evenly spaced times t.

    The signal is what each sample interval holds in the mean, taken as linear between samples.
    Before t = 0 there was none: the mass was held. The filter's memory is evaluated anew from the
    signal before t[0], so that blocks fit together without a seam.

    Examples
    --------
    >>> t = np.arange(5) * 0.1
    >>> high_passed(np.ones_like, t, dt=0.1, corner=0.5).round(3).tolist()
    [0.858, 0.627, 0.458, 0.334, 0.244]
    """
    from scipy.signal import lfilter

    q = 2.0 * math.pi * corner * dt
    taps = min(math.ceil(_FORGOTTEN / q), math.ceil(max(t[0], 0.0) / dt) + 1) + 1
    times = np.concatenate([t[0] - dt * np.arange(taps, 0, -1), t])
    values = np.where(times >= -1e-9 * dt, signal(times), 0.0)
    # The low-pass answers a straight line over one interval with these weights of its two ends.
    forgotten = math.exp(-q)
    mean = -math.expm1(-q) / q
    slow = lfilter([1.0 - mean, mean - forgotten], [1.0, -forgotten], values)
    return np.asarray((values - slow)[taps:])
