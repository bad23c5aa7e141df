"""Detectors of impacts by name: the learnt template, and the usual ways beside it.

`settings: impacts: detector:` in campaign.yaml chooses one, or names a function of the user's
own: ``module:function``, or an entry point of the group ``vinesexp.detectors``
(docs/how-to/detector.md). Such a function takes a whole acceleration and its sample rate and gives
times. So do the usual ones, what a laboratory would write first, kept to compare with. They take
the contact as known: half a sine of the length that the settings state, whose height is fitted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, cast

import numpy as np
from scipy.special import ndtr

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.impacts.candidates import STRETCH, Stream, louder, stretch_noise, strongest
from vinesexp.signals.impacts.detection import Detection, detect_by_template
from vinesexp.signals.impacts.template import Shape, Template, spring_answer, template_of, window

#: Highpassed acceleration (m/s^2, gaps as zeros) and sample rate (Hz) to times of impacts, s.
Find = Callable[[FloatArray, float], Any]
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
    raw = stream.read(0, stream.n)
    known = np.isfinite(raw)
    a = np.where(known, raw, 0.0)
    usual = USUAL.get(settings.detector)
    if usual is None:
        place = _told(_imported(settings.detector), a, stream.sample_rate, settings.detector)
    else:
        place = usual(a, known, stream, settings)
    return _detection(place, a, known, stream, settings, frequency)


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


def _told(find: Find, a: FloatArray, rate: float, name: str) -> FloatArray:
    """Places of impacts, samples, by a function of the user's own.

    Raises
    ------
    AnalysisError
        The function fails, or what it gives are no times within the record.
    """
    try:
        times = np.sort(np.asarray(find(a.copy(), rate), dtype=np.float64))
    except Exception as error:
        raise AnalysisError(f"detector {name} failed: {type(error).__name__}: {error}") from error
    if times.ndim != 1 or not np.all((times >= 0.0) & (times * rate <= a.size)):
        raise AnalysisError(
            f"detector {name}: expected times in s from the first sample, none beyond the record's "
            f"{a.size / rate:.4g} s"
        )
    return times * rate


def _by_peaks(
    a: FloatArray, known: BoolArray, stream: Stream, settings: ImpactSettings
) -> FloatArray:
    """Peaks of the acceleration, averaged over half a contact, above the threshold."""
    smooth = _smoothed(a, stream, settings)
    return _tops(smooth, smooth / _noise(smooth, known), settings.threshold, stream, settings)


def _by_matched_filter(
    a: FloatArray, known: BoolArray, stream: Stream, settings: ImpactSettings
) -> FloatArray:
    """Peaks of the correlation with the contact above the threshold."""
    from scipy.signal import correlate

    template = contact_template(stream, settings)
    lags = np.arange(-template.last, template.last + 1)
    alike = correlate(a, template.at(lags * 1.0)[0], mode="same") if a.size else a
    return _tops(alike, alike / _noise(alike, known), settings.threshold, stream, settings)


def _by_average_ratio(
    a: FloatArray, known: BoolArray, stream: Stream, settings: ImpactSettings
) -> FloatArray:
    """Short-time over long-time average (STA/LTA), the trigger of seismology.

    References
    ----------
    Allen, R. V., Bulletin of the Seismological Society of America 68 (1978) 1521-1532.
    """
    smooth = _smoothed(a, stream, settings)
    short = max(1, round(settings.short_average * stream.sample_rate))
    long = max(short + 1, round(settings.long_average * stream.sample_rate))
    total = np.concatenate([[0.0], np.cumsum(smooth * smooth)])
    at = np.arange(a.size)

    def mean(begin: IntArray, end: IntArray) -> FloatArray:
        return np.asarray((total[end] - total[begin]) / np.maximum(end - begin, 1))

    now = mean(np.maximum(at - short // 2, 0), np.minimum(at + (short + 1) // 2, a.size))
    end = np.maximum(at - short, 1)  # the impact itself is not yet in it
    before = mean(np.maximum(end - long, 0), end)
    floor = 1e-6 * total[-1] / max(a.size, 1) + 1e-300
    ratio = np.sqrt(now / np.maximum(before, floor))
    ratio[: short + long // 2] = 0.0  # nothing to compare with yet
    near = max(1, round(max(settings.short_average, settings.contact) * stream.sample_rate))
    return _tops(smooth, ratio, settings.ratio, stream, settings, near=near)


Usual = Callable[[FloatArray, BoolArray, Stream, ImpactSettings], FloatArray]
#: The usual detectors by the names that `vinesexp.settings.stages.DETECTORS` allows.
USUAL: Mapping[str, Usual] = {
    "find_peaks": _by_peaks,
    "sta_lta": _by_average_ratio,
    "matched_filter": _by_matched_filter,
}


def _smoothed(a: FloatArray, stream: Stream, settings: ImpactSettings) -> FloatArray:
    """Means over half a contact, of an odd number of samples: nothing is shifted."""
    from scipy.ndimage import uniform_filter1d

    width = 2 * round(0.25 * settings.contact * stream.sample_rate) + 1
    return np.asarray(uniform_filter1d(a, width)) if a.size else a


def _tops(
    shown: FloatArray, score: FloatArray, limit: float, stream: Stream, settings: ImpactSettings,
    *, near: int = 0,
) -> FloatArray:  # fmt: skip
    """Places of the peaks of a score over its limit, by parabolas through what is shown there.

    `near`: samples about a peak in which the highest of what is shown is looked for.
    """
    from scipy.signal import find_peaks

    peaks = find_peaks(np.abs(score), height=limit)[0]
    # Not find_peaks(distance=...): it drops what is near a peak that it keeps, so that a ringing
    # which lasts longer than `apart` would be several impacts.
    reach = settings.apart * stream.sample_rate
    peaks = peaks[strongest(peaks, np.abs(score[peaks]), reach=reach)]
    size = np.abs(shown)
    around = np.clip(peaks[:, np.newaxis] + np.arange(-near, near + 1), 1, max(size.size - 2, 1))
    top = around[np.arange(peaks.size), np.argmax(size[around], axis=1)]
    left, middle, right = size[top - 1], size[top], size[top + 1]
    bend = np.minimum(left - 2.0 * middle + right, -1e-300)
    return np.asarray(top + np.clip(0.5 * (left - right) / bend, -0.5, 0.5))


def contact_template(stream: Stream, settings: ImpactSettings) -> Template:
    """Half a sine of the length that the settings state, as the highpass leaves it."""
    duration = max(0.3, settings.contact * stream.sample_rate)
    span = window(stream.sample_rate, stream.highpass, duration, ringing=0.0)
    dt = 1.0 / stream.sample_rate
    return template_of(Shape(duration=duration), span, highpass=stream.highpass, dt=dt)


def _noise(a: FloatArray, known: BoolArray, floor: float = 0.0) -> FloatArray:
    """Standard deviation of the noise at each sample."""
    stretches = louder(stretch_noise(np.where(known, a, np.nan), floor))
    return np.asarray(np.repeat(stretches, STRETCH)[: a.size])


def _detection(
    place: FloatArray, a: FloatArray, known: BoolArray, stream: Stream, settings: ImpactSettings,
    frequency: float | None,
) -> Detection:  # fmt: skip
    """Contacts of the stated length fitted at places (samples)."""
    template, dt = contact_template(stream, settings), 1.0 / stream.sample_rate
    lags = np.arange(template.core[0], template.core[1] + 1)
    centre = np.rint(place).astype(np.int64)[:, np.newaxis]
    index = np.clip(centre + lags, 0, max(a.size - 1, 0))
    samples = a[index] if a.size else np.zeros(index.shape)
    shape = template.at(centre + lags - place[:, np.newaxis])[0]
    norm = np.maximum((shape * shape).sum(axis=1), 1e-300)
    height = (samples * shape).sum(axis=1) / norm
    noise = _noise(a, known, stream.noise_floor)[index[:, lags.size // 2]]
    strength, height_error = np.abs(height) / np.maximum(noise, 1e-300), noise / np.sqrt(norm)
    answer = spring_answer(template, dt, stream.highpass, frequency)
    # A half sine of n samples is timed to about n/pi of its relative error of height.
    share = height_error / np.maximum(np.abs(height), 1e-300)
    close = np.diff(place, prepend=-np.inf, append=np.inf) < 2.0 * template.shape.duration
    near = [(max(0, int(i) - 2), min(stream.n, int(i) + 3)) for i in centre[:, 0]]
    return Detection(
        time=place * dt,
        time_error=np.hypot(template.shape.duration / np.pi * share, _TOP_ERROR) * dt,
        jump=height * template.area * dt / answer,
        jump_error=height_error * abs(template.area) * dt / answer,
        peak=np.abs(samples).max(axis=1, initial=0.0),
        strength=strength,
        confidence=ndtr(strength - settings.threshold),
        crowded=close[1:] | close[:-1],
        clipped=np.array([stream.beyond(*span).any() for span in near], dtype=bool),
        template=template,
    )
