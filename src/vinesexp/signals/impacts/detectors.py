"""Detectors of impacts by name: the learnt template, and the usual ways beside it.

A detector takes a stream, the settings, and the oscillator's frequency where it is known, and
gives a `Detection`. `settings: impacts: detector:` in campaign.yaml chooses one, or names a
function of the user's own: ``module:function``, or an entry point of the group
``vinesexp.detectors`` (docs/how-to/detector.md).

Detectors that take the contact as known: peaks, short over long average, matched filter.

They are what a laboratory would write first, kept to compare with. Each finds tops in a score of
the acceleration; the contact is taken as half a sine of the length that the settings state, and its
height is fitted at the top.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from importlib import import_module
from typing import Any, cast

import numpy as np

from vinesexp.arrays import FloatArray, IntArray
from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.impacts.candidates import (
    CHUNK,
    STRETCH,
    Stream,
    louder,
    stretch_noise,
    strongest,
)
from vinesexp.signals.impacts.detection import Detection, detect_by_template, normal_cdf
from vinesexp.signals.impacts.template import Shape, Template, spring_answer, template_of, window

#: Highpassed acceleration (m/s^2, gaps as zeros) and sample rate (Hz) to times of impacts, s.
Find = Callable[[FloatArray, float], Any]

#: Samples without gaps to a score at each of them.
Score = Callable[[FloatArray], FloatArray]
_TOP_ERROR = 0.3  # samples: of a top placed by a parabola, however clear


def detect(
    stream: Stream, settings: ImpactSettings, *, frequency: float | None = None
) -> Detection:
    """What the detector of the settings finds.

    Raises
    ------
    ParameterError
        There is no such function.
    """
    if settings.detector == "template":
        return detect_by_template(stream, settings, frequency=frequency)
    if settings.detector in SCORES:
        score = SCORES[settings.detector](stream, settings)
        found, limit = _tops(stream, settings, score), score.limit
    else:
        found, limit = _told_by(_imported(settings.detector), stream, settings), settings.threshold
    return _detection(found, stream, settings, frequency, limit=limit)


#: Functions that were handed over in this process, by the name that the settings have.
_HANDED_OVER: dict[str, Find] = {}


def hand_over(find: Find) -> str:
    """A name under which `detect` finds a function, for `vinesexp.analyse`."""
    name = f"{find.__module__}:{getattr(find, '__name__', 'function').strip('<>')}"
    _HANDED_OVER[name] = find
    return name


def _imported(name: str) -> Find:
    if name in _HANDED_OVER:
        return _HANDED_OVER[name]
    from importlib.metadata import entry_points  # slow to import

    try:
        for point in entry_points(group="vinesexp.detectors", name=name):
            return cast(Find, point.load())
        module, _, function = name.partition(":")
        return cast(Find, getattr(import_module(module), function))
    except (ImportError, AttributeError, ValueError) as error:
        raise ParameterError(
            f"detector {name} cannot be imported ({error}); install its package in the environment "
            "that runs vinesexp, or add its folder to PYTHONPATH",
            where="impacts.detector",
        ) from None


@dataclass(frozen=True)
class _Tops:
    """Place (samples), score, height (m/s^2), noise of a sample and largest sample of each top."""

    place: FloatArray
    score: FloatArray
    height: FloatArray
    noise: FloatArray
    peak: FloatArray


def _told_by(find: Find, stream: Stream, settings: ImpactSettings) -> _Tops:
    """Impacts at the times that a function of the user's own gives.

    Raises
    ------
    AnalysisError
        The function fails, or what it gives are no times within the record.
    """
    raw = stream.samples(0, stream.n)
    known = np.isfinite(raw)
    a = np.where(known, raw, 0.0)
    try:
        times = np.sort(np.asarray(find(a.copy(), stream.sample_rate), dtype=np.float64))
    except Exception as error:
        raise AnalysisError(
            f"detector {settings.detector} failed: {type(error).__name__}: {error}"
        ) from error
    if times.ndim != 1 or not np.all((times >= 0.0) & (times * stream.sample_rate <= stream.n)):
        raise AnalysisError(
            f"detector {settings.detector}: expected times in s from the first sample, none beyond "
            f"the record's {stream.n / stream.sample_rate:.4g} s"
        )
    place = times * stream.sample_rate
    if not place.size:
        return _Tops(*(np.empty(0),) * 5)
    height, largest = _heights(a, place, contact_template(stream, settings))
    at = np.clip(np.rint(place).astype(np.int64), 0, stream.n - 1)
    noise = _noise(a, known, stream.noise_floor)[at]
    return _Tops(place, np.abs(height) / np.maximum(noise, 1e-300), height, noise, largest)


@dataclass(frozen=True)
class _Scored:
    """How an impact stands out.

    Attributes
    ----------
    score : of samples without gaps, at each of them.
    limit : beyond which there is an impact.
    in_noise : the score is taken in standard deviations of its own noise.
    placed_by : a score that shows where in it the impact lies; None: itself.
    """

    score: Score
    limit: float
    in_noise: bool = True
    placed_by: Score | None = None


def _by_peaks(stream: Stream, settings: ImpactSettings) -> _Scored:
    """Peaks of the acceleration, averaged over half a contact, above the threshold.

    What `scipy.signal.find_peaks(height=..., distance=...)` gives, by blocks.
    """
    return _Scored(_smoothing(stream, settings), settings.threshold)


def _by_matched_filter(stream: Stream, settings: ImpactSettings) -> _Scored:
    """Peaks of the correlation with the contact above the threshold."""
    template = contact_template(stream, settings)
    shape = template.at(np.arange(template.first, template.last + 1) * 1.0)[0]

    def correlated(a: FloatArray) -> FloatArray:
        whole = np.convolve(a, shape[::-1], mode="full")
        return np.asarray(whole[template.last : template.last + a.size])

    return _Scored(correlated, settings.threshold)


def _by_average_ratio(stream: Stream, settings: ImpactSettings) -> _Scored:
    """Short-time over long-time average (STA/LTA), the trigger of seismology.

    References
    ----------
    Allen, R. V., Bulletin of the Seismological Society of America 68 (1978) 1521-1532.
    """
    rate = stream.sample_rate
    short = max(1, round(settings.short_average * rate))
    long = max(short + 1, round(settings.long_average * rate))
    smoothed = _smoothing(stream, settings)

    def ratio(raw: FloatArray) -> FloatArray:
        a = smoothed(raw)
        total = np.concatenate([[0.0], np.cumsum(a * a)])
        end = np.maximum(np.arange(a.size) - short, 1)  # the impact itself is not yet in it
        begin = np.maximum(end - long, 0)
        before = (total[end] - total[begin]) / (end - begin)
        power = running_mean(a * a, short) / np.maximum(before, 1e-6 * total[-1] / a.size + 1e-300)
        power[: short + long // 2] = 0.0  # nothing to compare with yet
        return np.asarray(np.sqrt(power))

    return _Scored(ratio, settings.ratio, in_noise=False, placed_by=smoothed)


#: The usual detectors by the names that `vinesexp.settings.stages.DETECTORS` allows.
SCORES: Mapping[str, Callable[[Stream, ImpactSettings], _Scored]] = {
    "find_peaks": _by_peaks,
    "sta_lta": _by_average_ratio,
    "matched_filter": _by_matched_filter,
}


def _smoothing(stream: Stream, settings: ImpactSettings) -> Score:
    """Means over half a contact, of an odd number of samples: nothing is shifted."""
    width = 2 * round(0.25 * settings.contact * stream.sample_rate) + 1
    return lambda a: running_mean(a, width)


def contact_template(stream: Stream, settings: ImpactSettings) -> Template:
    """Half a sine of the length that the settings state, as the highpass leaves it."""
    duration = max(0.3, settings.contact * stream.sample_rate)
    span = window(stream.sample_rate, stream.highpass, duration, ringing=0.0)
    dt = 1.0 / stream.sample_rate
    return template_of(Shape(duration=duration), span, highpass=stream.highpass, dt=dt)


def running_mean(a: FloatArray, width: int) -> FloatArray:
    """Centred means of `width` samples; of fewer at the ends.

    Examples
    --------
    >>> running_mean(np.array([0.0, 3.0, 0.0, 3.0]), 3).tolist()
    [1.5, 1.0, 2.0, 1.5]
    """
    total = np.concatenate([[0.0], np.cumsum(a)])
    begin = np.clip(np.arange(a.size) - width // 2, 0, a.size)
    end = np.clip(np.arange(a.size) - width // 2 + width, 0, a.size)
    return np.asarray((total[end] - total[begin]) / np.maximum(end - begin, 1))


def refined(size: FloatArray, peaks: IntArray) -> FloatArray:
    """Tops of parabolas through each peak and its neighbours, in samples."""
    inner = np.clip(peaks, 1, size.size - 2)
    left, top, right = size[inner - 1], size[inner], size[inner + 1]
    bend = left - 2.0 * top + right
    shift = np.where(bend < 0.0, 0.5 * (left - right) / np.where(bend < 0.0, bend, 1.0), 0.0)
    return np.asarray(inner + np.clip(shift, -0.5, 0.5))


def _tops(stream: Stream, settings: ImpactSettings, by: _Scored) -> _Tops:
    """Tops of the score over its limit, none closer than `settings.apart` to a higher one."""
    template = contact_template(stream, settings)
    reach = settings.apart * stream.sample_rate
    near = max(1, round(max(settings.short_average, settings.contact) * stream.sample_rate))
    margin = int(settings.long_average * stream.sample_rate + reach) + 2 * template.last + 2
    parts = []
    for begin in stream.chunks():
        low, high = max(0, begin - margin), min(stream.n, begin + CHUNK + margin)
        raw = stream.samples(low, high)
        known = np.isfinite(raw)
        a = np.where(known, raw, 0.0)
        size, noise = np.abs(value := by.score(a)), _noise(a, known, stream.noise_floor)
        if by.in_noise:
            size = size / _noise(value, known, 0.0)
        peaks = _peaks(size, by.limit)
        peaks = strongest(peaks, size[peaks], reach=reach)
        place = np.empty(0)
        if peaks.size:
            shown = size if by.placed_by is None else np.abs(by.placed_by(a))
            place = refined(shown, peaks if by.placed_by is None else _highest(shown, peaks, near))
        mine = (place + low >= begin - 0.5) & (place + low < begin + CHUNK - 0.5)
        peaks, place = peaks[mine], place[mine]
        height, largest = _heights(a, place, template)
        parts.append(_Tops(place + low, size[peaks], height, noise[peaks], largest))
    if not parts:
        return _Tops(*(np.empty(0) for _ in fields(_Tops)))
    return _Tops(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(_Tops)))


def _highest(size: FloatArray, peaks: IntArray, near: int) -> IntArray:
    """Highest sample within `near` samples of each peak."""
    around = np.clip(peaks[:, np.newaxis] + np.arange(-near, near + 1), 0, size.size - 1)
    return np.asarray(around[np.arange(peaks.size), np.argmax(size[around], axis=1)])


def _noise(a: FloatArray, known: np.ndarray, floor: float) -> FloatArray:
    """Standard deviation of the noise at each sample."""
    stretches = louder(stretch_noise(np.where(known, a, np.nan), floor))
    return np.asarray(np.repeat(stretches, STRETCH)[: a.size])


def _peaks(size: FloatArray, limit: float) -> IntArray:
    middle = size[1:-1]
    top = (middle > limit) & (middle >= size[:-2]) & (middle > size[2:])
    return np.asarray(np.flatnonzero(top) + 1, dtype=np.int64)


def _heights(a: FloatArray, place: FloatArray, template: Template) -> tuple[FloatArray, FloatArray]:
    """Height of the template fitted at each place, and the largest sample there."""
    lags = np.arange(template.core[0], template.core[1] + 1)
    centre = np.rint(place).astype(np.int64)[:, np.newaxis]
    samples = a[np.clip(centre + lags, 0, a.size - 1)]
    shape = template.at(centre + lags - place[:, np.newaxis])[0]
    norm = np.maximum((shape * shape).sum(axis=1), 1e-300)
    return (samples * shape).sum(axis=1) / norm, np.abs(samples).max(axis=1, initial=0.0)


def _detection(
    found: _Tops, stream: Stream, settings: ImpactSettings, frequency: float | None, *, limit: float
) -> Detection:
    template, dt = contact_template(stream, settings), 1.0 / stream.sample_rate
    shape = template.at(np.arange(template.core[0], template.core[1] + 1) * 1.0)[0]
    height_error = found.noise / np.sqrt(shape @ shape)
    answer = spring_answer(template, dt, stream.highpass, frequency)
    # A half sine of n samples is timed to about n/pi of its relative error of height.
    share = height_error / np.maximum(np.abs(found.height), 1e-300)
    shaky = template.shape.duration / np.pi * share
    close = np.diff(found.place) < 2.0 * template.shape.duration
    crowded = np.zeros(found.place.size, dtype=bool)
    crowded[1:] |= close
    crowded[:-1] |= close
    near = [(max(0, i - 2), min(stream.n, i + 3)) for i in np.rint(found.place).astype(np.int64)]
    return Detection(
        time=found.place * dt,
        time_error=np.hypot(shaky, _TOP_ERROR) * dt,
        jump=found.height * template.area * dt / answer,
        jump_error=height_error * abs(template.area) * dt / answer,
        peak=found.peak,
        strength=found.score,
        confidence=normal_cdf(found.score - limit),
        crowded=crowded,
        clipped=np.array([stream.beyond(*span).any() for span in near], dtype=bool),
        template=template,
        interval=dt,
        noise=float(np.median(found.noise)) if found.noise.size else 0.0,
    )
