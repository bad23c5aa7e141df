"""The oscillator alone under a harmonic base, in closed form."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from vinesexp.rig import Oscillator


def bare_gain(oscillator: Oscillator, frequency: float) -> float:
    """Mean over a cycle of hypot(x, x'/w0), for base motion of amplitude 1.

    Examples
    --------
    >>> round(bare_gain(Oscillator(M=4.7, c1=3.02, k1=1.147e4), 7.8623), 2)  # 1/(2 zeta)
    76.89
    """
    w = 2.0 * math.pi * frequency / oscillator.w0
    z = 2.0 * oscillator.zeta * w
    return math.hypot(1.0, z) / math.hypot((1.0 - w) * (1.0 + w), z) * mean_of_cycle(w)


@lru_cache(maxsize=512)
def mean_of_cycle(w: float) -> float:
    """Mean of hypot(sin, w cos) over a cycle: amplitude of x to mean amplitude, w = f/f0."""
    angle = (np.arange(64) + 0.5) * (math.pi / 64)
    return float(np.hypot(np.sin(angle), w * np.cos(angle)).mean())
