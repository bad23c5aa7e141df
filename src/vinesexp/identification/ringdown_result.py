"""What one decay says by one method, and how f0 and zeta follow from its parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.identification.damping_law import Decay, logs_and_phases

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class RingDown:
    """What one decay says.

    Attributes
    ----------
    method : str
        ``log decrement``, ``envelope`` or ``likelihood``.
    f0, f0_error : float
        Undamped natural frequency, Hz, at amplitude `reference`.
    zeta, zeta_error : float
        Equivalent viscous damping ratio at amplitude `reference`.
    reference : float
        m; where the record speaks loudest.
    decay : Decay
        All parameters; `covariance` is of those in `free`.
    residual : float
        rms of the misfit over the rms of the motion.
    window : (float, float)
        What was fitted, s from the first sample.
    beat : (float, float) or None
        A second oscillation, which was taken out: Hz, and its amplitude over that of the first.
    """

    method: str
    f0: float
    f0_error: float
    zeta: float
    zeta_error: float
    reference: float
    decay: Decay
    free: tuple[str, ...]
    covariance: FloatArray
    residual: float
    window: tuple[float, float]
    beat: tuple[float, float] | None = None

    @property
    def start(self) -> float:
        """Beginning of what was fitted, s from the first sample."""
        return self.window[0]

    @property
    def end(self) -> float:
        """End of what was fitted, s from the first sample."""
        return self.window[1]

    @property
    def amplitude(self) -> float:
        """Amplitude at `start`, m."""
        return float(self.amplitude_at(np.array([self.start]))[0])

    def amplitude_at(self, t: FloatArray) -> FloatArray:
        """Fitted amplitude at times t (s from the first sample), m."""
        row = self.decay.vector()[np.newaxis]
        later = np.maximum(t, self.decay.start)
        log_A = logs_and_phases(row, later, start=self.decay.start)[0][0]
        # Less than a window before its first centre, the decay is continued at its first rate.
        early = np.minimum(t - self.decay.start, 0.0)
        return np.asarray(np.exp(log_A - self.decay.rate(math.exp(self.decay.log_A)) * early))


def rung(
    method: str, decay: Decay, free: tuple[str, ...], covariance: FloatArray, amplitude: float,
    residual: float, window: tuple[float, float],
) -> RingDown:  # fmt: skip
    """f0 and zeta with errors, from damped frequency and decay rate at `amplitude`."""
    rate = decay.rate(amplitude)
    gradient = {"alpha": 1.0, "beta": amplitude, "gamma": 1.0 / amplitude}
    g_rate = np.array([gradient.get(name, 0.0) for name in free])
    w = decay.frequency(amplitude)
    bend = {"w": w / decay.w, "mu": decay.w * amplitude, "kappa": decay.w * amplitude**2}
    g_w = np.array([bend.get(name, 0.0) for name in free])
    # w_d^2 + rate^2 = w0^2, zeta = rate/w0
    w0 = math.hypot(w, rate)
    g_w0 = (w * g_w + rate * g_rate) / w0
    g_zeta = g_rate / w0 - rate / w0**2 * g_w0
    f0_error = math.sqrt(max(float(g_w0 @ covariance @ g_w0), 0.0)) / (2.0 * math.pi)
    zeta_error = math.sqrt(max(float(g_zeta @ covariance @ g_zeta), 0.0))
    return RingDown(
        method, w0 / (2.0 * math.pi), f0_error, rate / w0, zeta_error, amplitude, decay, free,
        covariance, residual, window,
    )  # fmt: skip
