"""Displacement from a sensor of velocity, such as a laser Doppler vibrometer: its integral.

The zero of such a sensor is not known to the precision that an integral asks for, so the mean
velocity is left out: motion in the band of the oscillator is right, slow drift and the place about
which it moves are not measured.
"""

from __future__ import annotations

import numpy as np

from vinesexp.arrays import FloatArray

_POINTS = 6
_POWERS = np.arange(_POINTS)[:, np.newaxis]
#: Integrals between neighbours of six samples as sums of them: exact for fifth-order polynomials.
_WEIGHTS = np.array([
    np.linalg.solve(
        np.arange(float(_POINTS)) ** _POWERS,
        ((j + 1.0) ** (_POWERS[:, 0] + 1) - float(j) ** (_POWERS[:, 0] + 1)) / (_POWERS[:, 0] + 1),
    )
    for j in range(_POINTS - 1)
])  # fmt: skip
#: Samples that an interval needs before and behind its own two.
REACH = 2


def integrated(velocity: FloatArray, step: float) -> FloatArray:
    """Displacement, 0 at the first sample; NaN where the velocity is, bridged by a straight line.

    Parameters
    ----------
    velocity : array (n,)
        m/s, `step` s apart. Of a motion of ten samples a period the integral is right to 2e-4.

    Examples
    --------
    >>> t = np.arange(200) / 100.0
    >>> x = integrated(np.cos(20.0 * t), 0.01)
    >>> bool(np.abs(x - np.sin(20.0 * t) / 20.0).max() < 2e-8)
    True
    """
    known = np.isfinite(velocity)
    index = np.arange(velocity.size)
    bridged = velocity if known.all() else np.interp(index, index[known], velocity[known])
    out = np.concatenate([[0.0], np.cumsum(increments(bridged))])[: velocity.size] * step
    out[~known] = np.nan
    return np.asarray(out, dtype=np.float64)


def increments(velocity: FloatArray) -> FloatArray:
    """Integrals from each sample to the next, in steps; array (n - 1,)."""
    n = velocity.size
    if n < _POINTS:
        return np.asarray(0.5 * (velocity[1:] + velocity[:-1]))
    middle = np.convolve(velocity, _WEIGHTS[REACH][::-1], mode="valid")
    first, last = _WEIGHTS[:REACH] @ velocity[:_POINTS], _WEIGHTS[REACH + 1 :] @ velocity[-_POINTS:]
    return np.concatenate([first, middle, last])
