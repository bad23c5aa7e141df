"""Velocity jumps from the displacement: how much its slope changes at each impact.

Around an impact the displacement is an oscillation, a slow drift and the answer to the jump,
dv sin(w (t - t_j))/w after t_j. All of it is linear, so that one projection serves all impacts.
Neighbouring impacts in the window are subtracted with the jumps that the acceleration showed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.signals.extension import block_means

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_HALF = 0.35  # periods to either side of an impact
_POINTS = 200  # a period: block means lose nothing down to that
_SHORTER = (1.0, 0.5, 0.25)  # of the window, at the ends of the record
_LEAST = 6  # points to either side


@dataclass(frozen=True)
class Kinks:
    """Displacement and velocity at each impact; NaN where the window is too short.

    Attributes
    ----------
    jump, jump_error : arrays (k,)
        From the displacement alone, m/s.
    x, x_error, v_before, v_error : arrays (k,)
        m, m/s; with the jump that was given to `states`, else with the one above. The velocity
        after is v_before plus that jump.
    """

    jump: FloatArray
    jump_error: FloatArray
    x: FloatArray
    x_error: FloatArray
    v_before: FloatArray
    v_error: FloatArray


@dataclass(frozen=True)
class Coarse:
    """Displacement as block means: `step` s apart, the first centred on `start` s."""

    values: FloatArray
    step: float
    start: float


def coarsen(x: FloatArray, sample_rate: float, frequency: float) -> Coarse:
    """Means of the displacement over as many samples as `frequency` (Hz) allows."""
    k = max(1, int(sample_rate / (_POINTS * frequency)))
    return Coarse(block_means(x, k), k / sample_rate, 0.5 * (k - 1) / sample_rate)


def slope_changes(
    x: Coarse, times: FloatArray, jumps: FloatArray, *, frequency: float,
    jump_errors: FloatArray | None = None,
) -> Kinks:  # fmt: skip
    """Jumps, places and velocities at impacts.

    Parameters
    ----------
    x : Coarse
        Displacement, m.
    times : array (k,)
        Rising; s from the first sample of the record.
    jumps : array (k,)
        m/s, from the acceleration: what neighbours are subtracted with.
    frequency : float
        Of the oscillation, Hz; a few per cent off does no harm.
    jump_errors : array (k,), optional
        With it, places and velocities are computed with the weighted mean of both jumps.

    Examples
    --------
    >>> t = np.arange(4000) / 1e4
    >>> w = 2 * np.pi * 8.0
    >>> motion = 5e-3 * np.cos(w * t) + 0.02 * np.sin(w * np.maximum(t - 0.2, 0)) / w
    >>> found = slope_changes(
    ...     coarsen(motion, 1e4, 8.0), np.array([0.2]), np.array([0.0]), frequency=8.0)
    >>> abs(float(found.jump[0]) - 0.02) < 1e-6
    True
    """
    k = times.size
    out = Kinks(*(np.full(k, np.nan) for _ in range(6)))
    half = max(_LEAST, round(_HALF / (frequency * x.step)))
    centre = np.rint((times - x.start) / x.step).astype(np.int64)
    open_ = np.ones(k, dtype=bool)
    for share in _SHORTER:
        reach = round(half * share)
        if reach < _LEAST:
            break
        fits = open_ & (centre >= reach) & (centre + reach < x.values.size)
        chosen = np.flatnonzero(fits)
        for begin in range(0, chosen.size, 4096):
            group = chosen[begin : begin + 4096]
            _solve(x, times, jumps, jump_errors, centre, group, reach, frequency, share, out)
        open_ &= ~fits
    return out


def _solve(
    x: Coarse, times: FloatArray, jumps: FloatArray, jump_errors: FloatArray | None,
    centre: IntArray, group: IntArray, reach: int, frequency: float, share: float, out: Kinks,
) -> None:  # fmt: skip
    w = 2.0 * math.pi * frequency
    grid = np.arange(-reach, reach + 1)
    s = grid * x.step
    smooth = _smooth(s, w, full=share > 0.3)
    q, upper = np.linalg.qr(smooth)
    index = centre[group, np.newaxis] + grid
    samples = x.values[index] - _neighbours(x, times, jumps, index, group, w)
    offset = times[group] - (x.start + centre[group] * x.step)
    kink = _kink(s - offset[:, np.newaxis], w, x.step)
    bent = kink - (kink @ q) @ q.T
    norm = (bent * bent).sum(axis=1)
    jump = (bent * samples).sum(axis=1) / norm
    rest = samples - jump[:, np.newaxis] * kink
    rest = rest - (rest @ q) @ q.T
    # The noise is the same in all windows; one of them knows it to 1/sqrt(2 n) only.
    noise = math.sqrt(float(np.median((rest**2).sum(axis=1))) / (grid.size - smooth.shape[1] - 1))
    error = noise / np.sqrt(norm)
    out.jump[group], out.jump_error[group] = jump, error
    best, best_error = jump, error
    if jump_errors is not None:
        best, best_error = weighted(jump, error, jumps[group], jump_errors[group])
    amplitude = (samples - best[:, np.newaxis] * kink) @ q
    for rows, value, deviation in (
        (_smooth(offset, w, full=share > 0.3), out.x, out.x_error),
        (_smooth_slope(offset, w, full=share > 0.3), out.v_before, out.v_error),
    ):
        functional = np.linalg.solve(upper.T, rows.T).T
        value[group] = (functional * amplitude).sum(axis=1)
        leak = (functional * (kink @ q)).sum(axis=1) * best_error
        deviation[group] = np.hypot(noise * np.sqrt((functional**2).sum(axis=1)), leak)


def weighted(
    a: FloatArray, a_error: FloatArray, b: FloatArray, b_error: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean of two measurements by their variances; one alone where the other is NaN.

    Examples
    --------
    >>> value, error = weighted(np.array([1.0]), np.array([1.0]), np.array([3.0]), np.array([1.0]))
    >>> float(value[0]), round(float(error[0]), 3)
    (2.0, 0.707)
    """
    wa = np.where(np.isfinite(a) & (a_error > 0), 1.0 / a_error**2, 0.0)
    wb = np.where(np.isfinite(b) & (b_error > 0), 1.0 / b_error**2, 0.0)
    total = np.where(wa + wb > 0.0, wa + wb, np.nan)
    value = (wa * np.nan_to_num(a) + wb * np.nan_to_num(b)) / total
    return value, 1.0 / np.sqrt(total)


def _smooth(s: FloatArray, w: float, *, full: bool) -> FloatArray:
    """What the motion without the jump is made of: drift, oscillation, its slow change."""
    columns = [np.ones_like(s), s * w, np.cos(w * s), np.sin(w * s)]
    if full:
        columns += [w * s * np.cos(w * s), w * s * np.sin(w * s)]
    return np.stack(columns, axis=-1)


def _smooth_slope(s: FloatArray, w: float, *, full: bool) -> FloatArray:
    zero, one = np.zeros_like(s), np.ones_like(s)
    columns = [zero, one, -np.sin(w * s), np.cos(w * s)]
    if full:
        columns += [
            np.cos(w * s) - w * s * np.sin(w * s),
            np.sin(w * s) + w * s * np.cos(w * s),
        ]
    return w * np.stack(columns, axis=-1)


def _kink(s: FloatArray, w: float, step: float) -> FloatArray:
    """Displacement s after a unit jump of velocity, averaged over `step`."""
    late = np.sin(w * np.maximum(s, 0.0)) / w
    inside = np.abs(s) < 0.5 * step
    return np.where(inside, (s + 0.5 * step) ** 2 / (2.0 * step), late)


def _neighbours(
    x: Coarse, times: FloatArray, jumps: FloatArray, index: IntArray, group: IntArray, w: float
) -> FloatArray:
    """What the other impacts in the windows did to the displacement (smooth parts left out)."""
    t = x.start + index * x.step
    total = np.zeros(t.shape)
    for direction in (1, -1):
        for step in range(1, times.size):
            other = group + direction * step
            there = (other >= 0) & (other < times.size)
            other = np.clip(other, 0, times.size - 1)
            there &= (times[other] > t[:, 0]) & (times[other] < t[:, -1])
            if not there.any():
                break
            rows = np.flatnonzero(there)
            s = t[rows] - times[other[rows], np.newaxis]
            total[rows] += jumps[other[rows], np.newaxis] * _kink(s, w, x.step)
    return total
