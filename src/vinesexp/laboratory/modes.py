"""A local mode: a resonance of the structure near the sensor that answers every impact.

The sensor does not see the rigid mass alone but x + q, with q the coordinate of a mode that an
impact excites as it excites the mass, times a share p:

    q'' + 2 z w q' + w^2 q = p a_contact,    shown: x'' + q'' (accelerometer), x + q (laser).

So an accelerometer shows (1 + p) times the jump at first and takes p of it back within a period of
the mode. Everything is in closed form; a response is followed until 1e-6 of it is left.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray

#: A response below this share of its beginning has rung out.
RUNG_OUT = 1e-6
#: Numbers evaluated at a time: bounds the memory where many impacts ring for long.
_AT_ONCE = 2_000_000


@dataclass(frozen=True)
class Mode:
    """A local mode as one sensor shows it.

    Parameters
    ----------
    frequency : float
        Hz.
    share : float
        p: its response to an impact over that of the rigid mass.
    damping : float
        Damping ratio, below 1.
    """

    frequency: float
    share: float
    damping: float = 0.02

    @property
    def lasts(self) -> float:
        """Time after which a response has rung out, s."""
        return math.log(1.0 / RUNG_OUT) / (2.0 * math.pi * self.damping * self.frequency)


def modal_velocity(t: FloatArray, mode: Mode, *, duration: float) -> FloatArray:
    """q' over the velocity jump of the mass, t after the beginning of a half-sine contact.

    The half-sine on [0, T] gives the mass the velocity g(t) + g(t - T), g = (1 - cos(pi t/T))/2;
    q' is that after H(s) = p s^2/(s^2 + 2 z w s + w^2), from rest.

    Examples
    --------
    >>> mode = Mode(frequency=100.0, share=0.3)
    >>> modal_velocity(np.array([0.0, 4e-4, 1.0]), mode, duration=4e-4).round(3).tolist()
    [0.0, 0.296, 0.0]
    """
    W, w = math.pi / duration, 2.0 * math.pi * mode.frequency
    H = -W * W / complex(w * w - W * W, 2.0 * mode.damping * w * W)
    decay, wd = mode.damping * w, w * math.sqrt(1.0 - mode.damping**2)
    A = H.real
    B = (decay * A - W * H.imag) / wd

    def response(s: FloatArray) -> FloatArray:
        s = np.maximum(s, 0.0)
        forced = -H.real * np.cos(W * s) + H.imag * np.sin(W * s)
        free = np.exp(-decay * s) * (A * np.cos(wd * s) + B * np.sin(wd * s))
        return np.asarray(0.5 * (forced + free))

    return mode.share * (response(t) + response(t - duration))


def modal_place(t: FloatArray, mode: Mode) -> FloatArray:
    """q over the velocity jump of the mass, t after an impact without duration, s."""
    w = 2.0 * math.pi * mode.frequency
    wd = w * math.sqrt(1.0 - mode.damping**2)
    s = np.maximum(t, 0.0)
    return mode.share / wd * np.exp(-mode.damping * w * s) * np.sin(wd * s)


def modal_displacement(
    mode: Mode, t: FloatArray, *, times: FloatArray, jumps: FloatArray
) -> FloatArray:
    """q of all impacts at the sorted times t, m."""
    found = np.zeros(t.size)
    first = np.searchsorted(t, times)
    last = np.searchsorted(t, times + mode.lasts)
    for k in np.flatnonzero(last > first):
        here = slice(first[k], last[k])
        found[here] += jumps[k] * modal_place(t[here] - times[k], mode)
    return found


def modal_acceleration(
    mode: Mode,
    *,
    times: FloatArray,
    jumps: FloatArray,
    duration: float,
    start: float,
    dt: float,
    n: int,
) -> FloatArray:
    """q'' of all impacts, averaged over each of the n sample intervals, m/s^2.

    Parameters are those of `sensors.contact_acceleration`.
    """
    return averaged_over_samples(
        lambda late: modal_velocity(late, mode, duration=duration),
        *(times, jumps),
        lasts=duration + mode.lasts, duration=duration, start=start, dt=dt, n=n,
    )  # fmt: skip


def averaged_over_samples(
    gained: Callable[[FloatArray], FloatArray],
    times: FloatArray,
    jumps: FloatArray,
    *,
    duration: float,
    lasts: float,
    start: float,
    dt: float,
    n: int,
) -> FloatArray:
    """Mean acceleration in each of n sample intervals, of contacts centred on their times.

    Parameters
    ----------
    gained : callable
        Velocity over the jump of the impact, at times (impacts, edges) after its contact begins.
    lasts : float
        s after the beginning of a contact for which it is followed.

    Others are those of `sensors.contact_acceleration`.
    """
    found = np.zeros(n)
    width = math.ceil(lasts / dt) + 2
    # first sample interval that the contact reaches into
    first = np.floor((times - 0.5 * duration - start) / dt + 0.5).astype(np.int64)
    inside = np.flatnonzero((first < n) & (first + width > 0))
    step = max(1, _AT_ONCE // width)
    for begin in range(0, inside.size, step):
        chosen = inside[begin : begin + step]
        index = first[chosen, np.newaxis] + np.arange(width + 1)
        edges = start + (index - 0.5) * dt - (times[chosen, np.newaxis] - 0.5 * duration)
        mean = np.diff(gained(edges), axis=1) * (jumps[chosen, np.newaxis] / dt)
        sample = index[:, :-1]
        here = (sample >= 0) & (sample < n)
        found += np.bincount(sample[here], weights=mean[here], minlength=n)
    return found
