"""Contacts as an accelerometer shows them: half-sine pulses of the exact momentum.

What is known exactly is how much of the velocity jump has been shown until a time; a sample is the
difference of that over its interval, so that no momentum falls between two samples.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: A ringing below this share of the pulse is lost in 24 bits; the window of a pulse ends there.
_RUNG_OUT = 1e-9
#: Pulses are evaluated this many at a time: bounds the memory of long spells of chatter.
_PULSES_AT_ONCE = 4096


def pulse_momentum(t: Array, *, duration: float, ring: float | None, ring_damping: float) -> Array:
    """Share of the velocity jump that the sensor has shown until t after the contact begins.

    The half-sine (pi/(2 T)) sin(pi t/T) on [0, T] integrates to g0(t) + g0(t - T) with
    g0(t) = (1 - cos(pi t/T))/2 for t > 0; a resonance H(s) = w^2/(s^2 + 2 z w s + w^2) turns g0
    into its response to that input from rest. H(0) = 1: the momentum stays exact.

    Parameters
    ----------
    t : array
        s after the beginning of the contact.
    duration, ring, ring_damping
        T in s; the resonance, Hz, and its damping ratio below 1.

    Returns
    -------
    array
        0 before the contact, 1 long after it.

    Examples
    --------
    >>> t = np.array([-1e-4, 0.0, 2e-4, 4e-4, 1.0])
    >>> pulse_momentum(t, duration=4e-4, ring=None, ring_damping=0.0).round(12).tolist()
    [0.0, 0.0, 0.5, 1.0, 1.0]
    """
    W = math.pi / duration
    if ring is None:
        # sin^2 keeps the first instants of the contact to full relative precision
        return np.asarray(np.sin(0.5 * W * np.clip(t, 0.0, duration)) ** 2)
    w = 2.0 * math.pi * ring
    H = w * w / complex(w * w - W * W, 2.0 * ring_damping * w * W)
    decay, wd = ring_damping * w, w * math.sqrt(1.0 - ring_damping**2)
    # 1 - Re(H exp(iWt)) from rest: the free ringing takes its start value and slope away
    A, B = H.real - 1.0, (-W * H.imag + decay * (H.real - 1.0)) / wd

    def response(s: Array) -> Array:
        s = np.maximum(s, 0.0)
        forced = 1.0 - H.real * np.cos(W * s) + H.imag * np.sin(W * s)
        free = np.exp(-decay * s) * (A * np.cos(wd * s) + B * np.sin(wd * s))
        return np.asarray(0.5 * (forced + free))

    return response(t) + response(t - duration)


def contact_acceleration(
    times: Array,
    jumps: Array,
    *,
    duration: float,
    ring: float | None,
    ring_damping: float,
    start: float,
    dt: float,
    n: int,
) -> Array:
    """Acceleration of the impacts, averaged over each sample interval.

    Sample k is the mean over start + (k -+ 1/2) dt, so that the samples times dt add up to the
    velocity jumps exactly, however few samples a pulse spans and wherever it falls between them.

    Parameters
    ----------
    times, jumps : array (k,)
        Impact times, s, rising, and jumps of the oscillator's velocity, m/s.
    duration, ring, ring_damping
        As of `pulse_momentum`; each contact is centred on its impact time.
    start, dt, n
        Time of sample 0 and sample interval, s; number of samples.

    Returns
    -------
    array (n,)
        m/s^2.

    Examples
    --------
    >>> a = contact_acceleration(
    ...     np.array([0.01]), np.array([-0.02]), duration=4e-4, ring=None, ring_damping=0.0,
    ...     start=0.0, dt=1e-4, n=200)
    >>> round(float(a.sum() * 1e-4), 15), int(np.argmin(a))
    (-0.02, 100)
    """
    found = np.zeros(n)
    T, tail = duration, 0.0
    if ring is not None:
        tail = math.log(1.0 / _RUNG_OUT) / (ring_damping * 2.0 * math.pi * ring)
    width = math.ceil((T + tail) / dt) + 2
    # first sample interval that the contact reaches into
    first = np.floor((times - 0.5 * T - start) / dt + 0.5).astype(np.int64)
    inside = np.flatnonzero((first < n) & (first + width > 0))
    for begin in range(0, inside.size, _PULSES_AT_ONCE):
        chosen = inside[begin : begin + _PULSES_AT_ONCE]
        index = first[chosen, np.newaxis] + np.arange(width + 1)
        edges = start + (index - 0.5) * dt - (times[chosen, np.newaxis] - 0.5 * T)
        share = pulse_momentum(edges, duration=T, ring=ring, ring_damping=ring_damping)
        share[:, 0], share[:, -1] = 0.0, 1.0  # what the window cuts off stays in its last sample
        mean = np.diff(share, axis=1) * (jumps[chosen, np.newaxis] / dt)
        sample = index[:, :-1]
        here = (sample >= 0) & (sample < n)
        found += np.bincount(sample[here], weights=mean[here], minlength=n)
    return found
