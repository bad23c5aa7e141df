"""When a mass is let go, and how far out: a record with an ordinary pre-trigger begins before that.

What is held does not oscillate. A filter makes a swing of the end of the hold, a decay time counted
from the first sample holds the wait, and a replay that begins with the record begins too early.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.campaign.schema import RELEASES
from vinesexp.records.stored.store import RecordView
from vinesexp.signals.clipping import resolution_of
from vinesexp.signals.means import channel_means, coarse_channels, group_size

#: Attribute of a conditioned record: s from its first sample until the mass is free.
FREE_FROM = "free_from_s"

_POINTS = 48  # a period
_LONG = 16.0  # quarters of a period: over as many the middle of the swing is a mean
_FAST, _SLOW = 0.7, 0.35  # of the largest speed: the first swing is faster, a hand is slower
_STILL = 0.5  # of a quarter of a period: less is no hold, but where the trigger stood


def free_from(x: FloatArray, step: float, *, frequency: float) -> float:
    """Time from the first sample at which a mass is let go, s; 0 where it is free from the start.

    A mass let go at rest is a quarter of a period later in the middle of its swing, as fast
    as it ever is.

    Parameters
    ----------
    x : array (n,)
        Displacement in any unit, `step` s apart, some 48 a period.
    step, frequency : float
        s, Hz.

    Examples
    --------
    >>> t = np.arange(4000) / 400.0
    >>> s = np.maximum(t - 0.5, 0.0)
    >>> x = 3.0 + np.exp(-0.3 * s) * np.cos(2 * np.pi * 8.0 * s)
    >>> abs(free_from(x, 1 / 400.0, frequency=8.0) - 0.5) < 1e-3
    True
    >>> free_from(x[240:], 1 / 400.0, frequency=8.0)
    0.0
    """
    quarter = 0.25 / (frequency * step)
    if x.size < _LONG * quarter:
        return 0.0
    reach = max(round(0.5 * quarter), 1)
    # At the ends of the record over the samples that are there.
    at = np.arange(x.size)
    low, high = np.maximum(at - reach, 0), np.minimum(at + reach, x.size - 1)
    speed = np.abs(x[high] - x[low]) / (high - low)
    inner = speed[reach:-reach]
    top = float(inner.max())
    first = reach + int(np.argmax(inner > _FAST * top))
    swing = x - x[first : first + round(_LONG * quarter)].mean()
    crosses = np.flatnonzero(np.diff(np.signbit(swing[first:])))
    if not crosses.size:
        return 0.0
    i = first + int(crosses[0])
    begin = i + swing[i] / (swing[i] - swing[i + 1]) - quarter
    before = speed[: max(int(begin - reach), 0) + 1]  # what ends at `begin` lies in the hold
    if begin < _STILL * quarter or before.max() > _SLOW * top:
        return 0.0
    return float(begin * step)


def freed(conditioned: RecordView) -> float:
    """When the mass of a conditioned record is let go, s from its first sample; 0: it is free."""
    return float(conditioned.attributes.get(FREE_FROM, 0.0))


def free_sample(record: RecordView, *, frequency: float) -> int:
    """First sample at which the mass of a release is free; 0 for other tests.

    Parameters
    ----------
    record : RecordView
        As measured.
    frequency : float
        Of the oscillation, Hz.
    """
    role = next((role for role in ("displacement", "acceleration") if role in record.roles), None)
    if record.attributes.get("test") not in RELEASES or role is None:
        return 0
    k, step, (x,) = coarse_channels(record, frequency, _POINTS, role)
    found = free_from if role == "displacement" else _swings_from
    begin = found(x, step, frequency=frequency)
    # The first of the means stands in the middle of its samples.
    return round(begin * record.sample_rate + 0.5 * (k - 1)) if begin > 0.0 else 0


def _swings_from(a: FloatArray, step: float, *, frequency: float) -> float:
    """`free_from` by an accelerometer, which shows nothing of a hold: impacts hide the first swing.

    The oscillation in a window of one period grows from nothing to all of it, and is half when the
    window's middle is where it begins.
    """
    n = max(round(1.0 / (frequency * step)), 4)
    if a.size < 4 * n:
        return 0.0
    turned = np.exp(-2j * np.pi * np.arange(a.size) / n) * (a - a.mean())
    sums = np.append(0.0, np.cumsum(turned))
    size = np.abs(sums[n:] - sums[:-n])
    first = int(np.argmax(size > 0.5 * size[: _FIRST * n].max()))
    if first < 0.25 * n:  # held for less than three quarters of a period: not to be told
        return 0.0
    return (first + 0.5 * n) * step


_FIRST = 400  # periods in which a release begins


@dataclass(frozen=True)
class LetGo:
    """How far from rest a mass was let go.

    Attributes
    ----------
    x, error : m; with its sign, and its standard error.
    held : bool
        The mass is seen at rest before. Else the record begins at a turning point, which may be
        that of a later swing.
    """

    x: float
    error: float
    held: bool


def let_go(measured: RecordView, conditioned: RecordView) -> LetGo | None:
    """How far out the mass of a release was let go; None where its displacement does not show it.

    Rest is the mean of its first cycles: later the sensor has drifted. By the record as measured: a
    bandpass changes the beginning of a motion by what comes later.

    Parameters
    ----------
    measured, conditioned : RecordView
        Of a release.
    """
    frequency, role = conditioned.oscillation, "displacement"
    if not frequency or role not in measured.roles or measured.quantity(role) != role:
        return None
    k = group_size(measured.sample_rate, frequency, points=_FINE)
    step, x = k / measured.sample_rate, channel_means(measured, role, k)
    cycle, free = 1.0 / (frequency * step), round(freed(conditioned) / step)
    half = round(0.5 * _ABOUT_REST * cycle)
    near = max(round(_AT_TURN * cycle), 1)
    swings = x[free : free + 2 * half]
    if swings.size < 2 * half or not np.isfinite(swings).all():
        return None
    rest, drift = _middle(swings), _middle(swings[half:]) - _middle(swings[:half])
    held = x[max(free - round(cycle), 0) : max(free - near, 0)]
    if held.size > near:
        seen, noise = float(held.mean()) - rest, float(held.std())
    else:
        first = swings[: round(0.25 * cycle)] - rest
        turn = int(np.argmax(np.abs(first)))
        if turn > near:
            return None
        seen, noise = float(first[turn]), 0.0
    code = resolution_of(measured.read(role, 0, _LOOK)) / math.sqrt(12.0)
    error = math.hypot(noise, drift, _SEES * seen, code)
    return LetGo(seen, error, held.size > near)


def _middle(swings: FloatArray) -> float:
    """Mean of a swing, whatever part of a cycle is at its ends."""
    weight = np.hanning(swings.size)
    return float(weight @ swings / weight.sum())


_FINE = 200  # means a cycle: the first of a swing is smaller by 2e-4 of it
_ABOUT_REST = 8  # cycles whose middle is rest
_AT_TURN = 1.0 / 16.0  # of a cycle around a turning point
_SEES = 1e-3  # of a release: what is left of the place at which it was let go
_LOOK = 1 << 16  # samples that show the steps of a converter
