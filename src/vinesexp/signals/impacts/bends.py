"""Impacts of a record without an accelerometer: where the displacement bends.

At an impact the velocity of the mass jumps, so that its second difference over m means, added to
w^2 times the displacement over the same time, is a triangle of 2 m means and nothing else: the
oscillation, whatever its amplitude, leaves none. A moving mean takes what is slow. Of the triangles
in sight the highest is taken away first, then the next. Short triangles part impacts that follow
one another; in longer ones, without the impacts that the short ones showed, noise is less.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.special import ndtr

from vinesexp.arrays import FloatArray, IntArray
from vinesexp.signals.hum import hum_in
from vinesexp.signals.impacts.candidates import strongest
from vinesexp.signals.impacts.detection import Detection, detection_at
from vinesexp.signals.impacts.slopes import Coarse

_HALVES, _WIDE = (1.0 / 24.0, 1.0 / 10.0), 4.0  # periods: of triangles; moving mean over these
_THRESHOLD = 6.0  # standard deviations of the noise
_ROUNDS, _HIGHEST = 10, 0.5  # of the highest near it, that a triangle needs to be taken away
#: Of a triangle taken away, that is left beside it: half a mean of some ten, a contact.
_MISPLACED = 0.1
_OFF = 0.05  # of w^2 times the displacement: damping, and the drive beside the resonance
_FOURTH = math.sqrt(70.0)  # noise of a fourth difference, over that of a value
_SECOND, _FAINTER = (1.2, 7.0), 3.0  # of the oscillation: of a second motion; any other line
_BESIDE = 0.05  # of the oscillation's frequency, from a multiple of it or another line
_FIFTH = 1.2816  # standard deviations that a fifth of all are beyond


def detect_bends(x: Coarse, *, frequency: float, resolution: float = 0.0) -> Detection:
    """Impacts as candidates, by the displacement alone; the areas of pulses are unknown (NaN).

    Parameters
    ----------
    x : Coarse
        Displacement, m, some 200 means a period.
    frequency : float
        Of the oscillation, Hz.
    resolution : float
        Step of a converter that its noise does not hide in a mean, m.

    Returns
    -------
    Detection
        `jump` in m/s to about a tenth and `time` to about a thousandth of a period: where
        `slope_changes` begins. `peak` is NaN.

    Examples
    --------
    >>> t = np.arange(32_000) / 1600.0
    >>> w, hits = 2 * np.pi * 8.0, np.arange(0.51, 19.0, 1 / 16.3)
    >>> motion = 5e-3 * np.cos(w * t) + sum(
    ...     0.02 * (-1) ** k * np.sin(w * np.maximum(t - at, 0.0)) / w for k, at in enumerate(hits))
    >>> noise = 1e-6 * np.random.default_rng(0).standard_normal(t.size)
    >>> found = detect_bends(Coarse(motion + noise, 1 / 1600, 0.0), frequency=8.0)
    >>> found.time.size == hits.size, bool(np.abs(found.time - hits).max() < 1e-3)
    (True, True)
    """
    found = detection_at(np.empty(0))
    for half in _HALVES:
        found = _at_scale(x, found, half, frequency, resolution).beside(found)[0]
    return found


def without_steady(
    x: Coarse, found: Detection, *, frequency: float, driven: bool
) -> tuple[Coarse, bool]:
    """The displacement without the line of a second motion, and whether there is one.

    It bends between impacts as much as beside them, and is as strong at the end as at the
    beginning: no ball does that.

    Parameters
    ----------
    x : Coarse
    found : Detection
        Impacts so far: without what they make, lines stand alone.
    frequency : float
        Of the oscillation, Hz.
    driven : bool
        Whether the multiples of the oscillation last as long as a line would.
    """
    n, whole = x.values.size, np.fft.rfft(x.values - x.values.mean())
    f = np.fft.rfftfreq(n, x.step)
    band = (f > _SECOND[0] * frequency) & (f < _SECOND[1] * frequency)
    w = 2.0 * math.pi * f[band]
    at, jumps = (found.time - x.start) / x.step, np.zeros(n)
    for mean in (0, 1):  # a jump between two means is a part of it at either
        part = found.jump * (1.0 - np.abs(at - np.floor(at) - mean))
        np.add.at(jumps, np.clip(np.floor(at).astype(np.int64) + mean, 0, n - 1), part)
    jumped = np.fft.rfft(jumps)[band]
    whole[band] -= jumped / (((2.0 * math.pi * frequency) ** 2 - w**2) * x.step)
    left = np.fft.irfft(whole, n)

    size = np.nan_to_num(np.abs(np.fft.rfft(left * np.hanning(n))) * f**2 * band)
    if driven:
        order = f / frequency
        size *= np.abs(order - np.rint(order)) > _BESIDE
    line = float(f[np.argmax(size)])
    others = size[np.abs(f - line) > _BESIDE * frequency]
    if not size.max() > _FAINTER * others.max(initial=0.0):  # impacts that come again have several
        return x, False
    steady = hum_in(left, x.step, frequency=frequency, driven=driven, lines=[line])
    if not steady:
        return x, False
    t: FloatArray = x.step * np.arange(n, dtype=np.float64)
    return replace(x, values=x.values - np.sum([one.at(t) for one in steady], axis=0)), True


def _at_scale(
    x: Coarse, known: Detection, half: float, frequency: float, resolution: float
) -> Detection:
    """Impacts that triangles of one length show beside those known, half of it in periods."""
    step = x.step
    m, wide = max(2, round(half / (frequency * step))), round(_WIDE * half / (frequency * step)) | 1
    if x.values.size < 8 * wide:
        return detection_at(np.empty(0))
    filter_, one = _filter(m, wide, step, 2.0 * math.pi * frequency)
    edge, top = filter_.size // 2, float(one.max())
    away = x.values - np.median(x.values)
    bent = np.convolve(away, filter_, mode="same") - _of_known(known, x, one)
    bent[:edge] = bent[-edge:] = 0.0
    noise = _noise(x.values, resolution) * math.sqrt(float(filter_ @ filter_))
    # of an oscillation that is damped or detuned by a few per cent a sine is left, its top a bend
    swing = float(np.percentile(np.abs(away), 99.0))
    sine = _OFF * (2.0 * math.pi * frequency) ** 2 * swing * (1.0 - np.sinc(_WIDE * half))
    place, jump = _triangles(bent, one, m, wide, least=max(_THRESHOLD * noise, sine))
    known_at = (known.time - x.start) / step
    apart = np.abs(np.subtract.outer(place, known_at)).min(axis=1, initial=np.inf) > 2 * m
    place, jump = place[apart], jump[apart]  # beside one that is known its own error is a bend
    strength = np.abs(jump) * top / max(noise, sine / _THRESHOLD)
    near = np.diff(place, prepend=-np.inf, append=np.inf) < 2 * m
    return detection_at(
        x.start + place * step, time_error=m * step / np.maximum(strength, 1.0),
        jump=jump, strength=strength, confidence=ndtr(strength - _THRESHOLD),
        crowded=near[1:] | near[:-1],
    )  # fmt: skip


def _of_known(known: Detection, x: Coarse, one: FloatArray) -> FloatArray:
    """What impacts that are known make of a filtered displacement."""
    heights = np.zeros(x.values.size)
    at = np.clip(np.rint((known.time - x.start) / x.step).astype(np.int64), 0, heights.size - 1)
    np.add.at(heights, at, known.jump)
    return np.asarray(np.convolve(heights, one, mode="same"))


def _noise(values: FloatArray, resolution: float) -> float:
    """Of the displacement itself, by its fourth differences: impacts may leave no quiet time.

    Of a converter whose steps are larger than its noise most differences are none: by the fifth
    that is largest, and as much as the steps make of a value between two of them.
    """
    size = float(np.percentile(np.abs(np.diff(values, 4)), 80.0))
    return max(size / _FIFTH / _FOURTH, resolution / math.sqrt(12.0))


def _filter(m: int, wide: int, step: float, w: float) -> tuple[FloatArray, FloatArray]:
    """The filter that shows bends, and what it makes of a jump of 1 m/s: both symmetric."""
    mean = np.ones(wide) / wide
    triangle = np.convolve(np.ones(m), np.ones(m)) / m**2  # 2 m - 1 values
    second = np.zeros(2 * m + 1)
    second[[0, m, 2 * m]] = np.array([1.0, -2.0, 1.0]) / (m * step) ** 2
    second[1:-1] += w * w * triangle

    def without_slow(values: FloatArray) -> FloatArray:
        return np.pad(values, (wide - 1) // 2) - np.convolve(values, mean)

    return without_slow(second), without_slow(triangle / step)


def _triangles(
    bent: FloatArray, one: FloatArray, m: int, wide: int, *, least: float
) -> tuple[FloatArray, FloatArray]:
    """Places (means) and jumps (m/s) of what is as `one` in `bent`, the highest first."""
    left, reach, top = bent.copy(), one.size // 2, float(one.max())
    heights = np.zeros(bent.size)

    def highest_near(values: FloatArray, at: IntArray) -> FloatArray:
        near = np.lib.stride_tricks.sliding_window_view(np.pad(values, wide), 2 * wide + 1)
        return np.asarray(near[at].max(axis=1))

    for _ in range(_ROUNDS):
        size = np.abs(left)
        seen = np.flatnonzero(size > least)
        seen = seen[size[seen] > _MISPLACED * top * highest_near(np.abs(heights), seen)]
        peaks = seen[strongest(seen, size[seen], reach=m)]
        peaks = peaks[size[peaks] > _HIGHEST * highest_near(size, peaks)]
        if not peaks.size:
            break
        taken = np.zeros(bent.size)
        taken[peaks] = left[peaks] / top
        heights += taken
        left -= np.convolve(taken, one, mode="same")
        left[:reach] = left[-reach:] = 0.0
    places = np.flatnonzero(heights)
    if not places.size:
        return np.empty(0), np.empty(0)
    begins = np.flatnonzero(np.diff(places, prepend=-wide) > m // 2)  # one contact, in two rounds
    jump = np.add.reduceat(heights[places], begins)
    weight = np.abs(heights[places])
    place = np.add.reduceat(weight * places, begins) / np.add.reduceat(weight, begins)
    keep = np.abs(jump) * top > least
    return place[keep], jump[keep]
