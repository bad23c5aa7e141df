"""The levels and frequencies that stand for the ranges a design is for, and their weights.

A resonance is narrow beside the band that one sweeps: evenly spaced frequencies would miss it, and
with it all that a ball is for. So frequencies crowd around it, ever wider apart, and a mean weighs
each by what it stands for: the mean of the bare response is exact.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.design.bare import bare_gain
from vinesexp.rig import Oscillator

#: Levels of a range.
LEVELS = 3
#: Distances of frequencies from resonance, in half widths of it with a ball that is captured.
NEAR = (0.0, 1.0, 3.0, 9.0, 27.0)
#: Nearer to an end of the band, or to each other, than this part of the way none is needed.
_APART = 0.15
_FINE = 60


def levels_of(ends: tuple[float, float]) -> FloatArray:
    """Base amplitudes (m) that stand for the range."""
    return np.array(ends[:1]) if ends[0] == ends[1] else np.linspace(*ends, LEVELS)


def level_weights(ends: tuple[float, float]) -> FloatArray:
    """What each level stands for in a mean over the range; the sum is 1."""
    return np.ones(1) if ends[0] == ends[1] else np.array([0.25, 0.5, 0.25])


def frequencies_of(ends: tuple[float, float], oscillator: Oscillator, eps: float) -> FloatArray:
    """Frequencies (Hz) that stand for the band, closer around the resonance.

    Examples
    --------
    >>> o = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
    >>> [round(float(f), 2) for f in frequencies_of((7.2, 8.4), o, 0.0068)]
    [7.2, 7.43, 7.66, 7.8, 7.86, 7.93, 8.06, 8.4]
    """
    low, high = ends
    if low == high:
        return np.array(ends[:1])
    half = oscillator.f0 * (oscillator.zeta + 0.3 * eps)
    away = half * np.array(NEAR)
    near = np.unique(np.concatenate([oscillator.f0 - away, oscillator.f0 + away]))
    room = np.minimum(near - low, high - near)
    near = near[room > _APART * np.maximum(np.abs(near - oscillator.f0), half)]
    found = np.concatenate([[low], near, [high]])
    # at least one in the middle, also of a band that does not hold the resonance
    widest = int(np.argmax(np.diff(found)))
    return np.sort(np.append(found, 0.5 * (found[widest] + found[widest + 1])))


@lru_cache(maxsize=64)
def frequency_weights(ends: tuple[float, float], oscillator: Oscillator, eps: float) -> FloatArray:
    """What each of `frequencies_of` stands for in a mean over the band.

    Between two of them by the trapezoidal rule, times what the rule is off for the bare response.
    """
    nodes = frequencies_of(ends, oscillator, eps)
    if nodes.size == 1:
        return np.ones(1)
    weights = np.zeros(nodes.size)
    at = np.array([bare_gain(oscillator, float(f)) for f in nodes])
    for k, (low, high) in enumerate(pairwise(nodes)):
        fine = low + (high - low) * (np.arange(_FINE) + 0.5) / _FINE
        mean = float(np.mean([bare_gain(oscillator, float(f)) for f in fine]))
        share = (high - low) / (ends[1] - ends[0]) * mean / (at[k] + at[k + 1])
        weights[k] += share
        weights[k + 1] += share
    return weights
