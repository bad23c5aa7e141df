"""How late the displacement is behind the acceleration, which is its second derivative.

Over a finite record, exactly but for sampling, -w^2 X = A - (j w) p - q with real numbers p and q
for the state at both ends, impacts included. A lag turns the phase of that equation in proportion
to w, a wrong calibration scales it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError
from vinesexp.identification.least_squares import gauss_newton
from vinesexp.identification.sweep import fourier_sums

Floats = NDArray[np.float64]

_BAND = 0.15  # of the frequency, on either side
_FEWEST_BINS = 4


@dataclass(frozen=True)
class ChannelLag:
    """Of the displacement behind the acceleration.

    Attributes
    ----------
    lag, lag_error : s.
    gain, gain_error : displacement over what the acceleration says; 1 where both are calibrated.
    """

    lag: float
    lag_error: float
    gain: float
    gain_error: float


def channel_lag(
    acceleration: Floats, displacement: Floats, *, sample_rate: float, frequency: float
) -> ChannelLag:
    """Lag and gain of the displacement against the acceleration around `frequency`, Hz.

    Raises
    ------
    AnalysisError
        A record of fewer than about fourteen cycles.

    Examples
    --------
    >>> t = np.arange(20000) / 1000.0
    >>> found = channel_lag(-np.sin(t * 50.0) * 2500.0, np.sin((t - 2e-4) * 50.0),
    ...                     sample_rate=1000.0, frequency=8.0)
    >>> round(found.lag, 5), round(found.gain, 4)
    (0.0002, 1.0)
    """
    band = (frequency * (1.0 - _BAND), frequency * (1.0 + _BAND))
    n = len(displacement) - 1
    X = fourier_sums(displacement, sample_rate=sample_rate, band=band)
    A = fourier_sums(acceleration, sample_rate=sample_rate, band=band)
    if X.size < _FEWEST_BINS:
        raise AnalysisError("the record is too short to tell the lag between its channels")
    first = math.ceil(band[0] * n / sample_rate)
    w = 2.0 * math.pi * (first + np.arange(X.size)) * sample_rate / n

    def model(p: Floats) -> tuple[Floats, Floats]:
        late = np.exp(-1j * w * p[0]) / -(w * w)
        clean = A - 1j * w * p[2] - p[3]
        columns = np.stack(
            [-1j * w * p[1] * late * clean, late * clean, -1j * w * p[1] * late, -p[1] * late],
            axis=1,
        )
        value = p[1] * late * clean
        return (
            np.concatenate([value.real, value.imag]),
            np.concatenate([columns.real, columns.imag]),
        )

    data = np.concatenate([X.real, X.imag])
    found, covariance, residual = gauss_newton(model, data, np.array([0.0, 1.0, 0.0, 0.0]))
    errors = np.sqrt(np.diag(covariance) * float(residual @ residual) / (data.size - 4))
    return ChannelLag(float(found[0]), float(errors[0]), float(found[1]), float(errors[1]))
