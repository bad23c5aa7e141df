"""The cheapest method on a decay: a straight line through the logarithm of its amplitude."""

from __future__ import annotations

import math

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.identification.damping_law import Decay
from vinesexp.identification.phasors import Phasors
from vinesexp.identification.ringdown_result import RingDown, ring_down_by


def straight_line(p: Phasors) -> FloatArray:
    """Frequency, decay rate, log amplitude and phase at the first window, by straight lines."""
    size = np.abs(p.z)
    weight = size / p.error if p.error > 0 else size / size.max()
    log_z = np.log(size) + 1j * np.unwrap(np.angle(p.z))
    basis = np.stack([np.ones(p.t.size), p.t - p.t[0]], axis=1)
    c = np.linalg.lstsq(basis * weight[:, np.newaxis], log_z * weight, rcond=None)[0]
    return np.array([p.w + c[1].imag, -c[1].real, c[0].real, c[0].imag])


def log_decrement(p: Phasors) -> RingDown:
    """f0 and zeta from phase and logarithm of the amplitude of every period."""
    w, alpha, log_A, phase = straight_line(p)
    t = p.t - p.t[0]
    fitted = np.exp(log_A - alpha * t + 1j * (phase + (w - p.w) * t))
    rest = p.z / fitted - 1.0
    weight = np.abs(p.z) ** 2
    freedom = max(1, p.t.size - 2)
    spread = float(np.sqrt((weight * rest.real**2).sum() / freedom))
    turned = float(np.sqrt((weight * rest.imag**2).sum() / freedom))
    mean = (weight * t).sum() / weight.sum()
    lever = math.sqrt(float((weight * (t - mean) ** 2).sum()))
    decay = Decay(log_A, phase + p.w * p.t[0], w, alpha=alpha, start=float(p.t[0]))
    covariance = np.diag([turned**2, spread**2]) / lever**2
    residual = float(np.sqrt((np.abs(p.z - fitted) ** 2).sum() / weight.sum()))
    window = (float(p.t[0] - 0.5 * p.span), float(p.t[-1] + 0.5 * p.span))
    told = telling_amplitude(np.abs(fitted), p.t)
    return ring_down_by("log decrement", decay, ("w", "alpha"), covariance, told, residual, window)


def telling_amplitude(A: FloatArray, t: FloatArray) -> float:
    """Amplitude at which amplitudes A at times t say most about frequency and damping.

    All are as sure. A slope between two times counts as what lies before it is known from what
    lies after it. There a law that is wrong is off least: by 1
    to 4 % in a decay by a factor of 2 to 3, where it is off by 3 to 10 % at the mean amplitude; in
    deep decays by as much as there.

    Examples
    --------
    >>> t = np.linspace(0.0, 20.0, 20001)
    >>> round(telling_amplitude(np.exp(-t), t), 2)  # 4/9
    0.44
    """
    power = A**2
    lever = power * (t - (power * t).sum() / power.sum())
    weight = np.cumsum(lever[::-1])[::-1][1:] * np.diff(t)
    return float((weight * np.sqrt(A[1:] * A[:-1])).sum() / weight.sum())
