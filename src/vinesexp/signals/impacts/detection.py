"""From a highpassed acceleration to contacts: find spikes, learn the pulse, fit every contact.

The record is read by chunks, so that memory is bounded whatever its length. Nothing here needs
tuning for a rig: thresholds follow the noise, and the pulse is learnt from the record.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from vinesexp.signals.extension import block_means
from vinesexp.signals.impacts.candidates import Spikes, find_spikes, stretch_noise
from vinesexp.signals.impacts.matching import Contacts, fit_contacts, strongest
from vinesexp.signals.impacts.template import Pulse, Shape, window
from vinesexp.signals.impacts.template_learning import (
    CHUNK,
    FEW,
    Piece,
    learnt_alone,
    learnt_in_company,
    strongest_neighbour,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
Read = Callable[[int, int], FloatArray]

THRESHOLD = 6.0  # standard deviations: noise alone passes once in 5e8 samples
_APART = 3e-3  # s: first guesses this close together are one contact and its ringing
_TAIL = 1.5  # times a tail may show as strong as it should
_STRONG = 0.3  # of the strongest
_WEAK = 0.15  # of the strongest neighbour
_FAINT = 0.7  # of the threshold: looked at again with the pulse
_FINEST = 8  # samples of a pulse that are worth keeping: more are averaged


@dataclass(frozen=True)
class Detection:
    """What was found in one acceleration.

    Attributes
    ----------
    time, time_error : arrays (k,)
        s from the first sample.
    jump, jump_error : arrays (k,)
        Velocity jumps from the pulses' areas, m/s.
    peak : array (k,)
        Largest acceleration, m/s^2.
    strength, confidence : arrays (k,)
        Height over its error; probability that a repetition with fresh noise would pass the
        threshold again.
    crowded, clipped : bool arrays (k,)
        Overlapping others or ill explained; partly beyond the sensor's range.
    pulse : Pulse or None
        The learnt shape, in samples of `interval` seconds.
    noise : float
        Median standard deviation of a sample, m/s^2.
    """

    time: FloatArray
    time_error: FloatArray
    jump: FloatArray
    jump_error: FloatArray
    peak: FloatArray
    strength: FloatArray
    confidence: FloatArray
    crowded: BoolArray
    clipped: BoolArray
    pulse: Pulse | None
    interval: float
    noise: float


def detect_contacts(
    acceleration: FloatArray, sample_rate: float, *,
    highpass: float | None, threshold: float = THRESHOLD, noise_floor: float = 0.0,
    clipped: BoolArray | None = None,
) -> Detection:  # fmt: skip
    """Find every contact in an acceleration held in memory; see `detect_from`.

    Examples
    --------
    >>> t = np.arange(20000) / 1e4
    >>> a = 0.3 * np.random.default_rng(0).standard_normal(t.size)
    >>> for s in (0.30004, 0.6, 0.90007, 1.2, 1.50001, 1.8):
    ...     a += np.where(abs(t - s) < 2e-4, 60.0 * np.cos(np.pi * (t - s) / 4e-4), 0.0)
    >>> found = detect_contacts(a, 1e4, highpass=None)
    >>> bool(np.abs(found.time - [0.30004, 0.6, 0.90007, 1.2, 1.50001, 1.8]).max() < 5e-6)
    True
    """
    return detect_from(
        lambda begin, end: acceleration[begin:end], acceleration.size, sample_rate,
        highpass=highpass, threshold=threshold, noise_floor=noise_floor,
        clipped=None if clipped is None else lambda begin, end: clipped[begin:end],
    )  # fmt: skip


def detect_from(
    read: Read, n: int, sample_rate: float, *,
    highpass: float | None, threshold: float = THRESHOLD, noise_floor: float = 0.0,
    clipped: Callable[[int, int], BoolArray] | None = None, frequency: float | None = None,
) -> Detection:  # fmt: skip
    """Find every contact in an acceleration that is read by pieces.

    Parameters
    ----------
    read : callable
        (begin, end) to highpassed samples, m/s^2; NaN where there are none.
    n : int
        Samples.
    sample_rate : float
        Hz.
    highpass : float or None
        Corner of the zero-phase second-order Butterworth highpass they went through, Hz.
    threshold : float
        In standard deviations of the noise.
    noise_floor : float
        m/s^2: half of what the converter resolves.
    clipped : callable, optional
        (begin, end) to True where a sample is beyond the sensor's range.
    frequency : float, optional
        Of the oscillator, Hz: its spring answers every jump a little within the contact.
    """

    def good(begin: int, end: int) -> FloatArray:
        raw = read(begin, end)
        good = np.isfinite(raw)
        return raw if good.all() else np.where(good, raw, np.nan)

    spikes = _all_spikes(good, n, sample_rate, threshold, noise_floor, highpass)
    noise = float(np.median(spikes.noise))
    # What is faint may be an impact between two samples: the pulse will tell, if one is learnt.
    if not (spikes.strength > threshold).any():
        return _nothing(1.0 / sample_rate, noise)
    width = _typical(spikes, reach=_APART * sample_rate)
    reach = max(_APART * sample_rate, 2.0 * width)
    first = strongest(spikes.index, spikes.strength, reach=reach)
    strength = spikes.strength[np.searchsorted(spikes.index, first)]
    duration = 1.33 * width
    k = max(1, int(duration / 1.33 / _FINEST))
    span = window(sample_rate / k, highpass, duration / k)

    def coarse(begin: int, end: int) -> Piece:
        raw = read(begin, end)
        missing = ~np.isfinite(raw)
        beyond = np.zeros(raw.size, dtype=bool) if clipped is None else clipped(begin, end)
        a: FloatArray = np.where(missing, 0.0, raw) if missing.any() else raw
        if k == 1:
            return Piece(a, ~(missing | beyond), beyond & ~missing)
        holes, over = _any_of(missing, k), _any_of(beyond, k)
        return Piece(block_means(a, k), ~(holes | over), over & ~holes)

    # What is weak beside a strong neighbour may be its undershoot or ringing: left for later.
    tall = strength >= _WEAK * strongest_neighbour(first, strength, reach=(span[1] - span[0]) * k)
    first, strength = first[tall], strength[tall]
    pulse = learnt_alone(
        coarse, n, k, first, strength, spikes, span,
        Shape(duration=max(1.0, duration / k)), highpass, k / sample_rate,
    )  # fmt: skip
    if pulse.learnt_from < FEW:
        pulse = learnt_in_company(
            coarse, n, k, first, strength, pulse, threshold, noise_floor, highpass, k / sample_rate
        )
    parts = [
        _fit_chunk(coarse, n, k, begin, first, strength, pulse, threshold, noise_floor)
        for begin in range(0, n, CHUNK // k * k)
    ]
    answer = _spring_answer(pulse, k / sample_rate, highpass, frequency)
    return _gathered(parts, pulse, k / sample_rate, noise, threshold, answer)


def _any_of(flags: BoolArray, k: int) -> BoolArray:
    """Whether any of k consecutive flags is set."""
    return np.asarray(flags[: flags.size // k * k].reshape(-1, k).any(axis=1))


def _all_spikes(
    read: Read, n: int, sample_rate: float, threshold: float, noise_floor: float,
    highpass: float | None,
) -> Spikes:  # fmt: skip
    parts = []
    for begin in range(0, n, CHUNK):
        found = find_spikes(
            read(begin, min(n, begin + CHUNK)), sample_rate,
            threshold=_FAINT * threshold, noise_floor=noise_floor, highpass=highpass,
        )  # fmt: skip
        parts.append(Spikes(found.index + begin, found.strength, found.width, found.noise))
    return Spikes(
        *(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Spikes))
    )


def _typical(spikes: Spikes, *, reach: float) -> float:
    """Boxcar that shows most of the strong contacts best, whatever lies beside their tops."""
    reach = max(reach, 2.0 * spikes.width[np.argmax(spikes.strength)])
    tops = np.searchsorted(spikes.index, strongest(spikes.index, spikes.strength, reach=reach))
    strong = tops[spikes.strength[tops] >= _STRONG * spikes.strength.max()]
    return float(np.median(spikes.width[strong]))


def _unexplained(index: IntArray, strength: FloatArray, pulse: Pulse) -> BoolArray:
    """Candidates that the tail of a stronger one before them does not account for.

    One that is left out for nothing is found again when the others are subtracted.
    """
    lags = np.arange(pulse.last + 1)
    tail = np.maximum.accumulate(np.abs(pulse.at(lags * 1.0)[0])[::-1])[::-1]
    fine = np.ones(index.size, dtype=bool)
    for step in range(1, index.size):
        gap = index[step:] - index[:-step]
        near = gap <= pulse.last
        if not near.any():
            break
        reaches = _TAIL * tail[np.minimum(gap, pulse.last)] * strength[:-step]
        fine[step:] &= ~(near & (strength[step:] < reaches))
    return fine


def _fit_chunk(
    coarse: Callable[[int, int], Piece], n: int, k: int, begin: int,
    first: IntArray, strength: FloatArray, pulse: Pulse, threshold: float, noise_floor: float,
) -> tuple[Contacts, BoolArray]:  # fmt: skip
    """Contacts in one chunk, placed on the record's own samples, and which are clipped."""
    end = min(n, begin + CHUNK // k * k)
    margin = 2 * (pulse.last - pulse.first) * k
    low, high = max(0, begin - margin) // k * k, min(n, end + margin)
    piece = coarse(low, high)
    a, valid = piece.a, piece.good
    floor = noise_floor / np.sqrt(k)
    noise = stretch_noise(np.where(valid, a, np.nan), floor)
    here = (first >= low) & (first < high)
    here[here] = _unexplained(first[here] // k, strength[here], pulse)
    start, at = np.unique(np.clip((first[here] - low) // k, 0, a.size - 1), return_index=True)
    found = fit_contacts(
        a, start, pulse, noise=noise, threshold=threshold, valid=valid, clipped=piece.clipped,
        sure=strength[here][at] > threshold,
    )  # fmt: skip
    core = np.rint(found.place).astype(np.int64)[:, np.newaxis] + np.arange(
        pulse.core[0], pulse.core[1] + 1
    )
    clipped = ~valid[np.clip(core, 0, a.size - 1)].all(axis=1)
    place = low + found.place * k + 0.5 * (k - 1)
    keep = (place >= begin - 0.5) & (place < end - 0.5)
    keep &= found.strength > np.where(found.sure, threshold - 2.0, threshold)
    chosen = {field.name: getattr(found, field.name)[keep] for field in fields(Contacts)}
    chosen["place"] = place[keep] / k
    return Contacts(**chosen), clipped[keep]


def _spring_answer(
    pulse: Pulse, dt: float, highpass: float | None, frequency: float | None
) -> float:
    """What the measured jump is multiplied by because of the spring.

    After a jump dv the spring decelerates with w0^2 dv t. Highpassed, that ramp is
    w0^2 dv/(2 sqrt(2) wc) high at the contact itself, and adds to its area.
    """
    if not highpass or not frequency:
        return 1.0
    two_pi = 2.0 * np.pi
    height = (two_pi * frequency) ** 2 / (2.0 * np.sqrt(2.0) * two_pi * highpass)
    lags = np.arange(pulse.core[0], pulse.core[1] + 1)
    if pulse.rings:
        value = pulse.at(lags * 1.0)[0]
        return float(1.0 + height * dt * pulse.area * value.sum() / (value @ value))
    return float(1.0 + height * dt * lags.size / pulse.kept)


def _gathered(
    parts: list[tuple[Contacts, BoolArray]], pulse: Pulse, dt: float, noise: float,
    threshold: float, answer: float,
) -> Detection:  # fmt: skip
    def all_of(name: str) -> FloatArray:
        return np.concatenate([getattr(part, name) for part, _ in parts])

    strength = all_of("strength")
    return Detection(
        time=all_of("place") * dt,
        time_error=all_of("place_error") * dt,
        jump=all_of("area") * dt / answer,
        jump_error=all_of("area_error") * dt / answer,
        peak=all_of("peak"),
        strength=strength,
        confidence=_normal_cdf(strength - threshold),
        crowded=all_of("crowded").astype(bool),
        clipped=np.concatenate([clipped for _, clipped in parts]),
        pulse=pulse,
        interval=dt,
        noise=noise,
    )


def _nothing(dt: float, noise: float) -> Detection:
    none = np.empty(0)
    flags = np.empty(0, dtype=bool)
    return Detection(none, none, none, none, none, none, none, flags, flags, None, dt, noise)


def _normal_cdf(x: FloatArray) -> FloatArray:
    """Cumulative normal distribution to 1e-5: logistic with a cubic term."""
    z = np.clip(1.5976 * x + 0.070566 * x**3, -40.0, 40.0)
    return np.asarray(1.0 / (1.0 + np.exp(-z)))
