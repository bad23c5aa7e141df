"""Impacts by a learnt template: find candidates, learn the template, fit every contact.

Nothing here needs tuning for a rig: thresholds follow the noise, and the template is learnt from
the record.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import ndtr

from vinesexp.arrays import BoolArray, FloatArray, each_array, joined_arrays
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.impacts.candidates import (
    CHUNK,
    Grouped,
    Spikes,
    Stream,
    find_spikes,
    strongest,
)
from vinesexp.signals.impacts.matching import Contacts, fit_contacts
from vinesexp.signals.impacts.template import Shape, Template, spring_answer, template_of, window
from vinesexp.signals.impacts.template_learning import (
    FEW,
    learnt_alone,
    learnt_among_neighbours,
    strongest_neighbour,
)

_STRONG = 0.3  # of the strongest contact: from there on they show how long a contact is
_WEAK = 0.15  # of the strongest neighbour
_WEAKER = 0.5  # of a contact, whose template may have made those beside it
_RINGING, _DIES_OUT = 8e-3, 24e-3  # s after an impact in which the sensor may ring; a little
_FINEST = 8  # samples of a contact that are worth keeping: more are averaged
_HALF_HEIGHT = 1.33  # length of a half sine over its length at half height
_FEW_SAMPLES = 3.0  # of a contact: between them its shape can be bent, and its time with it
#: Contacts of a wall that show whether the template explains it; share of their momentum it does
#: not.
_ENOUGH, _ILL = 10, 0.5
_SHAKY = 2.0  # standard deviations that a sure candidate may lose in the fit


@dataclass(frozen=True)
class Detection:
    """What was found in one acceleration.

    Attributes
    ----------
    time, time_error : arrays (k,)
        s from the first sample.
    jump, jump_error : arrays (k,)
        Velocity jumps from the areas of the contacts, m/s.
    peak : array (k,)
        Largest acceleration, m/s^2.
    strength, confidence : arrays (k,)
        Height over its error; probability that a repetition with fresh noise would pass the
        threshold again.
    crowded, clipped : bool arrays (k,)
        Overlapping others or ill explained; partly beyond the sensor's range.
    template : Template or None
        The shape that was used, in samples or in the means that were fitted.
    lasts : float
        How long a contact of this shape pushes, s; 0: not known.
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
    template: Template | None = None
    lasts: float = 0.0

    def keep(self, chosen: BoolArray) -> Detection:
        """The chosen contacts."""
        return each_array(lambda values: values[chosen], self)

    def beside(self, other: Detection) -> tuple[Detection, BoolArray]:
        """The contacts of both in order of time, and which of them are those of `other`."""
        order = np.argsort(np.append(self.time, other.time), kind="stable")
        both = each_array(lambda values: values[order], joined_arrays(self, other))
        return both, order >= self.time.size


def detect_by_template(
    stream: Stream, settings: ImpactSettings, *, frequency: float | None = None
) -> Detection:
    """Find every contact in an acceleration that is read by pieces.

    Parameters
    ----------
    stream : Stream
    settings : ImpactSettings
    frequency : float, optional
        Of the oscillator, Hz: its spring answers every jump a little within the contact.

    Examples
    --------

    >>> t, hits = np.arange(20000) / 1e4, (0.30004, 0.6, 0.90007, 1.2, 1.50001, 1.8)
    >>> a = 0.3 * np.random.default_rng(0).standard_normal(t.size)
    >>> for s in hits:
    ...     a += np.where(abs(t - s) < 2e-4, 60.0 * np.cos(np.pi * (t - s) / 4e-4), 0.0)
    >>> stream = Stream(lambda begin, end: a[begin:end], a.size, 1e4)
    >>> found = detect_by_template(stream, ImpactSettings())
    >>> bool(np.abs(found.time - hits).max() < 5e-6)
    True
    """
    spikes = _all_spikes(stream, settings)
    # What is faint may be an impact between two samples: the template will show, if one is learnt.
    if not (spikes.strength > settings.threshold).any():
        return detection_at(np.empty(0))
    found, guesses = _by_one_template(stream, spikes, settings, frequency)
    ill = _ill_explained(found)
    if settings.learn and ill > _ILL:
        sides = _signs(stream, guesses)
        walls = [
            (side, _by_one_template(stream, guesses.keep(sides == side), settings, frequency)[0])
            for side in (1.0, -1.0)
            if (guesses.strength[sides == side] > settings.threshold).sum() >= FEW
        ]
        by_wall = _of_either_wall(walls) if len(walls) > 1 else found
        found = by_wall if _ill_explained(by_wall) < 0.5 * ill else found
    return found


def _by_one_template(
    stream: Stream, spikes: Spikes, settings: ImpactSettings, frequency: float | None
) -> tuple[Detection, Spikes]:
    """All contacts by the template that these spikes show, and the spikes that may be contacts."""
    width = _typical(spikes, reach=settings.apart * stream.sample_rate)
    # One candidate for each contact and its ringing.
    reach = max(settings.apart * stream.sample_rate, 2.0 * width)
    guesses = spikes.keep(strongest(spikes.index, spikes.strength, reach=reach))
    duration = _HALF_HEIGHT * width
    k = max(1, int(duration / _HALF_HEIGHT / _FINEST))
    grouped = Grouped(stream, k)
    span = window(stream.sample_rate / k, stream.highpass, duration / k, ringing=_RINGING)
    # What is weak beside a strong neighbour may be its undershoot or ringing: left for later.
    neighbour = strongest_neighbour(guesses, reach=(span[1] - span[0]) * k)
    guesses = guesses.keep(guesses.strength >= _WEAK * neighbour)
    shape = Shape(duration=max(1.0, duration / k))
    template = _learnt(grouped, guesses, span, shape, settings)
    parts = [
        _fit_chunk(grouped, begin, guesses, template, settings)
        for begin in range(0, stream.n, grouped.chunk)
    ]
    answer = spring_answer(template, grouped.dt, stream.highpass, frequency)
    return _gathered(parts, template, grouped.dt, settings.threshold, answer), guesses


def _ill_explained(found: Detection) -> float:
    """Share of the momentum of a wall's contacts that one template does not explain, at most.

    One wall may have a pad, or ring with the sensor beside it. What a template lacks, or has too
    much, is left in the contact, or is taken for weaker contacts beside it, and then is left no
    more.
    """
    size, ill = np.abs(found.jump), found.crowded.copy()
    for step in range(1, size.size):
        near = found.time[step:] - found.time[:-step] < _RINGING
        if not near.any():
            break
        ill[:-step] |= near & (size[step:] < _WEAKER * size[:-step])
        ill[step:] |= near & (size[:-step] < _WEAKER * size[step:])
    walls = [side * found.jump > 0.0 for side in (1.0, -1.0)]
    return max(
        float(size[wall & ill].sum() / size[wall].sum()) if wall.sum() >= _ENOUGH else 0.0
        for wall in walls
    )


def _signs(stream: Stream, spikes: Spikes) -> FloatArray:
    """Direction in which each spike goes."""
    signs = np.zeros(spikes.index.size)
    for begin in range(0, max(1, stream.n), CHUNK):
        here = (spikes.index >= begin) & (spikes.index < begin + CHUNK)
        a = stream.read(begin, min(stream.n, begin + CHUNK))
        signs[here] = np.sign(np.nan_to_num(a[spikes.index[here] - begin]))
    return signs


def _of_either_wall(walls: Sequence[tuple[float, Detection]]) -> Detection:
    """Of what the template of each wall finds, the contacts with that wall, by their direction.

    What is left of a contact with the other wall, whose template is another, is none. It dies out
    as what rings does.
    """
    own = []
    for (side, wall), (_, other) in zip(walls, walls[::-1], strict=True):
        mine = wall.keep(np.asarray(side * wall.jump > 0.0))
        size, (begin, end) = (
            np.maximum(-side * other.jump, 0.0),
            (np.searchsorted(other.time, mine.time + way * _DIES_OUT) for way in (-1.0, 1.0)),
        )
        left = np.array([
            np.max(size[i:k] * np.exp(-np.abs(other.time[i:k] - t) / _RINGING), initial=0.0)
            for i, k, t in zip(begin, end, mine.time, strict=True)
        ])  # fmt: skip
        own.append(mine.keep(np.asarray(left <= np.abs(mine.jump), dtype=bool)))
    return own[0].beside(own[1])[0]


def _learnt(
    grouped: Grouped, guesses: Spikes, span: tuple[int, int], shape: Shape, settings: ImpactSettings
) -> Template:
    if not settings.learn:
        known = Shape(duration=max(0.3, settings.contact / grouped.dt))
        return template_of(known, span, highpass=grouped.stream.highpass, dt=grouped.dt)
    template = learnt_alone(grouped, guesses, span, shape, settings)
    if template.learnt_from < FEW:
        template = learnt_among_neighbours(grouped, guesses, template, settings)
    return template


def _all_spikes(stream: Stream, settings: ImpactSettings) -> Spikes:
    parts = []
    for begin in range(0, max(1, stream.n), CHUNK):
        found = find_spikes(
            stream.read(begin, min(stream.n, begin + CHUNK)), stream.sample_rate,
            threshold=settings.faint * settings.threshold, noise_floor=stream.noise_floor,
            highpass=stream.highpass,
        )  # fmt: skip
        parts.append(Spikes(found.index + begin, found.strength, found.width, found.noise))
    return joined_arrays(*parts)


def _typical(spikes: Spikes, *, reach: float) -> float:
    """Boxcar that shows most of the strong contacts best, whatever lies beside their tops."""
    reach = max(reach, 2.0 * spikes.width[np.argmax(spikes.strength)])
    clear = strongest(spikes.index, spikes.strength, reach=reach)
    clear &= spikes.strength >= _STRONG * spikes.strength.max()
    return float(np.median(spikes.width[clear]))


def _fit_chunk(
    grouped: Grouped, begin: int, guesses: Spikes, template: Template, settings: ImpactSettings
) -> tuple[Contacts, BoolArray]:
    """Contacts in one chunk, placed on the record's own samples, and which are clipped."""
    k, n = grouped.k, grouped.stream.n
    end = min(n, begin + grouped.chunk)
    margin = 2 * (template.last - template.first) * k
    low, high = max(0, begin - margin) // k * k, min(n, end + margin)
    piece = grouped.piece(low, high)
    here = guesses.keep((guesses.index >= low) & (guesses.index < high))
    last = piece.a.size - 1
    start, at = np.unique(np.clip((here.index - low) // k, 0, last), return_index=True)
    found = fit_contacts(
        piece, start, template, noise=grouped.noise(piece), settings=settings,
        sure=here.strength[at] > settings.threshold,
    )  # fmt: skip
    core = np.rint(found.place).astype(np.int64)[:, np.newaxis] + np.arange(
        template.core[0], template.core[1] + 1
    )
    clipped = ~piece.good[np.clip(core, 0, last)].all(axis=1)
    place = low + found.place * k + 0.5 * (k - 1)
    keep = (place >= begin - 0.5) & (place < end - 0.5)
    limit = np.where(found.sure, settings.threshold - _SHAKY, settings.threshold)
    keep &= found.strength > limit
    kept = each_array(lambda values: values[keep], found)
    return replace(kept, place=place[keep] / k), clipped[keep]


def _gathered(
    parts: list[tuple[Contacts, BoolArray]], template: Template, dt: float, threshold: float,
    answer: float,
) -> Detection:  # fmt: skip
    found = joined_arrays(*(part for part, _ in parts))
    error = found.place_error
    if found.place.size and template.shape.duration < _FEW_SAMPLES:
        error = np.sqrt(error**2 + _unevenness(found.place) ** 2)
    return Detection(
        time=(found.place + template.late) * dt,
        time_error=error * dt,
        jump=found.area * dt / answer,
        jump_error=found.area_error * dt / answer,
        peak=found.peak,
        strength=found.strength,
        confidence=ndtr(found.strength - threshold),
        crowded=found.crowded.astype(bool),
        clipped=np.concatenate([clipped for _, clipped in parts]),
        template=template,
        lasts=template.shape.duration * dt,
    )


def _unevenness(place: FloatArray) -> float:
    """How far places between samples are from being spread evenly, root mean square, in samples.

    Contacts know nothing of the samples. A shape that was learnt from one or two samples of each
    can be wrong in such a way that all are drawn to some places between them.

    Examples
    --------
    >>> even = np.arange(1000) * 1.618
    >>> _unevenness(even) < 0.01, round(_unevenness(even + 0.1 * np.sin(2 * np.pi * even)), 2)
    (True, 0.07)
    """
    n = place.size
    off = np.sort(place % 1.0) - (np.arange(n) + 0.5) / n
    return math.sqrt(max(float(np.var(off)) - 1.0 / (12.0 * n), 0.0))


def detection_at(time: FloatArray, **known: Any) -> Detection:
    """A detection without a template: what is not `known` of each contact is NaN, or false."""
    unknown, no = np.full(time.size, np.nan), np.zeros(time.size, dtype=bool)
    nothing = Detection(time, unknown, unknown, unknown, unknown, unknown, unknown, no, no)
    return replace(nothing, **known)
