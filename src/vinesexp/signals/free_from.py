"""When a mass is let go, and how far out: a record with an ordinary pre-trigger begins before that.

What is held does not oscillate. A filter makes a swing of the end of the hold, a decay time counted
from the first sample holds the wait, and a replay that begins with the record begins too early.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.campaign.schema import RELEASES
from vinesexp.records.stored.store import RecordView
from vinesexp.signals.clipping import resolution_in
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.signals.means import POINTS, channel_means, coarse_channels, group_size
from vinesexp.units import LIKELY

#: Attribute of a conditioned record: s from its first sample until the mass is free.
FREE_FROM = "free_from_s"

_LONG = 16.0  # quarters of a period: over as many the middle of the swing is a mean
_FAST, _SLOW = 0.7, 0.35  # of the largest speed: the first swing is faster, a hand is slower
_HARDLY, _DRAWN = 0.2, 0.6  # of the largest swing: a mass that is held; more than draws it out
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
    period = round(4.0 * quarter)
    if x.size <= 4 * period:
        return 0.0
    still = _last_still(_swing(x, period)[: -3 * period], period)
    x = x[still:]
    reach = max(round(0.5 * quarter), 1)
    # At the ends of the record over the samples that are there.
    at = np.arange(x.size)
    low, high = np.maximum(at - reach, 0), np.minimum(at + reach, x.size - 1)
    speed = np.abs(x[high] - x[low]) / (high - low)
    inner = speed[reach:-reach]
    top = float(inner.max())
    first = reach + int(np.argmax(inner > _FAST * top))
    moves = float((still + first) * step) if still else 0.0
    swing = x - x[first : first + round(_LONG * quarter)].mean()
    crosses = np.flatnonzero(np.diff(np.signbit(swing[first:])))
    if not crosses.size:
        return moves
    i = first + int(crosses[0])
    begin = i + swing[i] / (swing[i] - swing[i + 1]) - quarter
    before = speed[: max(int(begin - reach), 0) + 1]  # what ends at `begin` lies in the hold
    if begin < _STILL * quarter or before.max() > _SLOW * top:
        return moves
    return float((still + begin) * step)


def _last_still(swing: FloatArray, period: int) -> int:
    """First sample of the last period in which a mass hardly moves that then swings most; or 0.

    It may be let go, pushed or hit, and more than once. What draws it out from rest moves it by
    half of the swing at most; beats grow more slowly. `swing` is that of the period from each
    sample on.
    """
    from scipy.ndimage import maximum_filter1d

    top = float(swing.max())
    soon = maximum_filter1d(swing, 2 * period + 1, origin=-period, mode="nearest")
    still = np.flatnonzero((swing < _HARDLY * top) & (soon > _DRAWN * top))
    return int(still[-1]) if still.size else 0


def _swing(x: FloatArray, period: int) -> FloatArray:
    """Largest less smallest value of the period from each sample on."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    first = period // 2  # the filters have it about its middle
    both = maximum_filter1d(x, period) - minimum_filter1d(x, period)
    return np.asarray(both[first : first - period])


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
    k, step, (x,) = coarse_channels(record, frequency, POINTS, role)
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
    size = np.abs(sums[n:] - sums[:-n])[: _FIRST * n]
    still = _last_still(size, n)
    first = still + int(np.argmax(size[still:] > 0.5 * size[still:].max()))
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
        that of a later swing, or the mass was hit.
    amplitude, amplitude_error : m
        Of the free motion where it begins: that of x, unless a hand pushed the mass or went along.
    """

    x: float
    error: float
    held: bool
    amplitude: float
    amplitude_error: float


def let_go(measured: RecordView, conditioned: RecordView, impacts: Impacts) -> LetGo | None:
    """How far out the mass of a release was let go; None where its displacement does not show it.

    Rest is the mean of its first cycles: later the sensor has drifted. By the record as measured: a
    bandpass changes the beginning of a motion by what comes later. What a push adds shows in the
    free motion that follows.

    Parameters
    ----------
    measured, conditioned : RecordView
        Of a release.
    impacts : Impacts
        Found in it.
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
    code = resolution_in(measured, role) / math.sqrt(12.0)
    held = x[max(free - round(cycle), 0) : max(free - near, 0)]
    if held.size > near:
        begins = measured.start + (free + 0.5) * step
        after = partial(_amplitude, swings - rest, step, frequency, impacts, begins)
        swing, unsure, taken = after()
        at, noise = float(held.mean()) - rest, float(held.std())
        if abs(at) < _HIT * swing:
            swing, unsure, _ = after(hand=_HAND)
            first = swings[: round(cycle)] - rest
            hit = math.copysign(swing, first[np.argmax(np.abs(first))])
            return LetGo(hit, unsure, held=False, amplitude=swing, amplitude_error=unsure)
    else:
        first = swings[: round(0.25 * cycle)] - rest
        turn = int(np.argmax(np.abs(first)))
        if turn > near:
            return None
        at, noise, swing, unsure, taken = float(first[turn]), 0.0, 0.0, math.inf, 0.0
    error = math.hypot(noise, drift, _SEES * at, code)
    more, sure = swing - abs(at), LIKELY * math.hypot(error, unsure)
    if -taken - sure < more < sure:
        swing, unsure = abs(at), error
    return LetGo(at, error, held.size > near, swing, unsure)


def _amplitude(
    x: FloatArray, step: float, frequency: float, impacts: Impacts, begins: float, *,
    hand: float = 0.0,
) -> tuple[float, float, float]:  # fmt: skip
    """Amplitude that the free motion x of a release has where it begins, and its error, m.

    And how much smaller it may be as the ball lay at the wall: that accelerates it without impacts.

    After the first quarter of a cycle no hand pushes any more. Without what the impacts of the ball
    do, the mass is a linear oscillator, whose amplitude changes little in so short a time. In
    the first share of a cycle, `hand`, what looks like an impact is the blow of a hammer.
    """
    w, cycle = 2.0 * math.pi * frequency, round(1.0 / (frequency * step))
    t = step * np.arange(cycle // 4, 2 * cycle)
    jumps, at = np.nan_to_num(impacts.velocity_jump_m_s), impacts.time_s - begins
    own = at > hand / frequency
    since = np.maximum(t[:, None] - at[own], 0.0)
    y = x[cycle // 4 : 2 * cycle] - np.sin(w * since) @ jumps[own] / w
    sine = np.stack([np.cos(w * t), np.sin(w * t)], axis=1)
    columns = np.hstack([sine, w * t[:, None] * sine, np.ones((t.size, 1))])
    found = np.linalg.lstsq(columns, y, rcond=None)[0]
    swing, left = float(np.hypot(*found[:2])), y - columns @ found
    unsure = math.hypot(_LAW * float(left.std()), _OFF * swing, _BLOW * hand * swing)
    met = np.abs(jumps[own & (at < t[-1])])
    return swing, unsure, float(met.max(initial=0.0)) / w


def _middle(swings: FloatArray) -> float:
    """Mean of a swing, whatever part of a cycle is at its ends."""
    weight = np.hanning(swings.size)
    return float(weight @ swings / weight.sum())


_FINE = 200  # means a cycle: the first of a swing is smaller by 2e-4 of it
_ABOUT_REST = 8  # cycles whose middle is rest
_AT_TURN = 1.0 / 16.0  # of a cycle around a turning point
_SEES = 1e-3  # of a release: what is left of the place at which it was let go
_HIT = 0.5  # of the free motion: a mass that moves as much before was let go, not hit
#: Error of that amplitude over what the fit leaves (springs that are not linear, other modes), and
#: as a share of it (the velocity jumps).
_LAW, _OFF = 5.0, 3e-3
#: Share of a cycle about its beginning in which a blow is, and what the ball may take meanwhile
#: over this share.
_HAND, _BLOW = 0.125, 0.1
