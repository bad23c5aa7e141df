"""What one decay says by one method, and how f0 and zeta follow from its parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.identification.damping_law import Decay
from vinesexp.identification.least_squares import variance_along

_LEAST = 0.05  # of the largest amplitude: below, noise decides


@dataclass(frozen=True)
class Oscillation:
    """f0 (Hz) and zeta, with their standard errors."""

    f0: float
    f0_error: float
    zeta: float
    zeta_error: float


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
        m; mean amplitude, weighted with its square, as the information on f0 is.
    decay : Decay
        All parameters; `covariance` is of those in `free`.
    residual : float
        rms of the misfit over the rms of the motion.
    window : (float, float)
        What was fitted, s from the first sample.
    beat : (float, float) or None
        A second oscillation, which was taken out: Hz, and its amplitude over that of the first.
    note : str
        Why this method was taken where it is not the likelihood, or why its errors are widened.
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
    note: str = ""

    @property
    def amplitude(self) -> float:
        """Amplitude where the window begins, m."""
        return float(self.amplitude_at(np.array(self.window))[0])

    @property
    def drift(self) -> tuple[float, float]:
        """By what share the frequency changes with time over what was fitted; its error."""
        span = self.window[1] - self.window[0]
        if "nu" not in self.free:
            return 0.0, 0.0
        i = self.free.index("nu")
        return self.decay.nu * span, span * math.sqrt(self.covariance[i, i])

    @property
    def fallen(self) -> float:
        """By which factor the amplitude falls over what was fitted, less one; 0: a steady drive."""
        a = self.amplitude_at(np.array(self.window))
        return float(a[0] / max(a[1], 1e-300) - 1.0)

    def amplitude_at(self, t: FloatArray) -> FloatArray:
        """Fitted amplitude at times t (s from the first sample), m."""
        log_A = self.decay.at(np.maximum(t, self.decay.start))[0]
        # Less than a window before its first centre, the decay is continued at its first rate.
        early = np.minimum(t - self.decay.start, 0.0)
        return np.asarray(np.exp(log_A - self.decay.rate(math.exp(self.decay.log_A)) * early))

    def at(self, amplitude: float) -> Oscillation:
        """f0 and zeta at another amplitude, m, by the law of damping that was chosen."""
        return oscillation_at(amplitude, self.decay, self.free, self.covariance)

    def over_amplitude(self, name: str) -> dict[str, list[Any]]:
        """f0 or zeta at as many amplitudes as its law has terms, with their covariance.

        These say the same as the terms: `amplitude` (m), `value`, and `covariance`, which holds
        what two methods disagree by at every amplitude alike.
        """
        terms = ("alpha", "beta", "gamma") if name == "zeta" else ("w", "mu", "kappa", "xi")
        fixed = np.isfinite(np.diag(self.covariance))
        names = [one for one, known in zip(self.free, fixed, strict=True) if known]
        count = sum(one in terms for one in names)
        last, first = self.amplitude_at(np.array(self.window))[::-1]
        A = np.array([self.reference])
        if count > 1 and first > last > 0.0:
            A = np.geomspace(max(last, _LEAST * first), first, count)
        which = ("f0", "zeta").index(name)
        found = [_at(float(one), self.decay, tuple(names)) for one in A]
        gradients = np.array([g[which] for _, g in found])
        covariance = gradients @ self.covariance[np.ix_(fixed, fixed)] @ gradients.T
        stated = {"f0": self.f0_error, "zeta": self.zeta_error}[name]
        there = self.at(self.reference)
        own = {"f0": there.f0_error, "zeta": there.zeta_error}[name]
        covariance += max(stated**2 - own**2, 0.0)
        return {
            "amplitude": A.tolist(),
            "value": [values[which] for values, _ in found],
            "covariance": covariance.tolist(),
        }


def oscillation_at(
    amplitude: float, decay: Decay, free: tuple[str, ...], covariance: FloatArray
) -> Oscillation:
    """f0 and zeta from damped frequency w and decay rate: w0^2 = w^2 + rate^2, zeta = rate/w0.

    Parameters
    ----------
    amplitude : float
        m.
    decay : Decay
    free : tuple of str
        Names of the parameters that `covariance` is of.
    covariance : array (p, p)
    """
    values, gradients = _at(amplitude, decay, free)
    f0_error, zeta_error = (math.sqrt(variance_along(g, covariance)) for g in gradients)
    return Oscillation(values[0], f0_error, values[1], zeta_error)


def _at(
    amplitude: float, decay: Decay, free: tuple[str, ...]
) -> tuple[tuple[float, float], tuple[FloatArray, FloatArray]]:
    """f0 and zeta at an amplitude, and their derivatives by the free parameters."""
    rate = decay.rate(amplitude)
    gradient = {"alpha": 1.0, "beta": amplitude, "gamma": 1.0 / amplitude}
    g_rate = np.array([gradient.get(name, 0.0) for name in free])
    w = decay.frequency(amplitude)
    bend = {"w": w / decay.w, "mu": decay.w * amplitude, "kappa": decay.w * amplitude**2}
    bend |= {"xi": decay.w / amplitude}
    if decay.nu:
        bend["nu"] = decay.w * decay.time(amplitude)
    g_w = np.array([bend.get(name, 0.0) for name in free])
    w0 = math.hypot(w, rate)
    g_w0 = (w * g_w + rate * g_rate) / w0
    g_zeta = g_rate / w0 - rate / w0**2 * g_w0
    return (w0 / (2.0 * math.pi), rate / w0), (g_w0 / (2.0 * math.pi), g_zeta)


def ring_down_by(
    method: str, decay: Decay, free: tuple[str, ...], covariance: FloatArray, amplitude: float,
    residual: float, window: tuple[float, float],
) -> RingDown:  # fmt: skip
    """The result of one method, its f0 and zeta at `amplitude`."""
    found = oscillation_at(amplitude, decay, free, covariance)
    return RingDown(
        method, found.f0, found.f0_error, found.zeta, found.zeta_error, amplitude, decay, free,
        covariance, residual, window,
    )  # fmt: skip
