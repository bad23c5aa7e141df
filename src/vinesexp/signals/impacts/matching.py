"""Fit every contact of a stretch at once: time, height, and what is still unexplained.

All contacts share one pulse shape. Each round refines times and heights together (what one
contact leaves under another is subtracted), looks at what remains, and takes up what still
stands out of noise and of the doubt about the shape.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.signals.impacts.candidates import STRETCH, louder, stretch_noise
from vinesexp.signals.impacts.overlapping import (
    State,
    align,
    keep_only,
    less,
    normal_equations,
    seen_lags,
    settle,
)
from vinesexp.signals.impacts.template import Pulse

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_ROUNDS = 8
_DOUBT = 3.0  # times the spread about the shape is still the shape
_QUIETER = 0.7  # times the noise believed before
_NARROW = 8  # samples: so many sums are quicker than a running one


@dataclass(frozen=True)
class Contacts:
    """Contacts in order of time.

    Attributes
    ----------
    place, place_error : arrays (k,)
        Time in samples from the start of the array, and its standard error.
    height, height_error : arrays (k,)
        Of the pulse, m/s^2.
    strength : array (k,)
        Height over its standard error, the doubt about stronger neighbours included.
    area : array (k,)
        Velocity jump in units of (m/s^2 samples): multiply by the sample interval.
    area_error : array (k,)
    peak : array (k,)
        Largest sample of the contact, m/s^2.
    crowded : bool array (k,)
        Another contact overlaps this one's core, or something in it is left unexplained.
    sure : bool array (k,)
        It stood out before the pulse was known.
    """

    place: FloatArray
    place_error: FloatArray
    height: FloatArray
    height_error: FloatArray
    strength: FloatArray
    area: FloatArray
    area_error: FloatArray
    peak: FloatArray
    crowded: BoolArray
    sure: BoolArray


def explained_rest(a: FloatArray, contacts: Contacts, pulse: Pulse) -> FloatArray:
    """What fitted contacts leave of an array."""
    return less(a, contacts.place, contacts.height, pulse)


def fit_contacts(
    a: FloatArray, start: IntArray, pulse: Pulse, *,
    noise: FloatArray, threshold: float, valid: BoolArray | None = None,
    clipped: BoolArray | None = None, sure: BoolArray | None = None,
) -> Contacts:  # fmt: skip
    """Fit contacts of one shape to an acceleration.

    Parameters
    ----------
    a : array (n,)
        Highpassed acceleration, m/s^2.
    start : int array
        Samples of the contacts to begin with; others are found on the way.
    pulse : Pulse
    noise : array
        Of a sample, for every `STRETCH` samples.
    threshold : float
        A contact has to exceed so many standard deviations.
    valid : bool array (n,), optional
        False where a sample is clipped or missing.
    clipped : bool array (n,), optional
        True where it is clipped: it then says that the truth is no smaller. A missing one says
        nothing.
    sure : bool array, optional
        False where `start` stands out too little to be kept without the pulse's help.
    """
    truth = np.ones(a.size, dtype=bool) if valid is None else valid
    beyond = np.zeros(a.size, dtype=bool) if clipped is None else clipped
    place = start.astype(np.float64)
    box = _BoxNoise(a, pulse.width, truth)
    noise = box.at_least(noise)
    known = np.ones(start.size, dtype=bool) if sure is None else sure
    state = State(a, noise, truth, beyond, pulse, place, a[start].astype(np.float64), known)
    seen = seen_lags(pulse)
    align(state, seen, reach=pulse.search)
    tried: list[float] = []
    for _ in range(_ROUNDS):
        settle(state, seen)
        _merge(state, threshold, seen)
        rest = state.residual()
        more, near = _left_over(state, rest, box, threshold)
        split = _split(state, near, tried)
        if not more.size and not split and not _quieter(state, rest, box):
            break
        state.place = np.concatenate([state.place, more.astype(np.float64)])
        state.height = np.concatenate([state.height, rest[more]])
        state.sure = np.append(state.sure, np.ones(more.size, dtype=bool))
    else:
        settle(state, seen)
        _merge(state, threshold, seen)
    return _finished(state, seen)


def _quieter(state: State, rest: FloatArray, box: _BoxNoise) -> bool:
    """Take the noise from what the contacts leave, where they themselves had passed for noise."""
    single = stretch_noise(np.where(state.valid, rest, np.nan))
    if not (single < _QUIETER * state.noise).any():
        return False
    again = _BoxNoise(rest, box.width, state.valid)
    noise = again.at_least(single)
    if not (noise < _QUIETER * state.noise).any():
        return False
    state.noise = np.minimum(state.noise, noise)
    box.noise = np.minimum(box.noise, again.noise)
    return True


def _merge(state: State, threshold: float, seen: IntArray) -> None:
    """Drop contacts that became insignificant or that coincide with a stronger one."""
    if not state.place.size:
        return
    keep_only(state, np.argsort(state.place, kind="stable"))
    _, _, _, vv, _, _ = normal_equations(state, seen)
    norm = float(np.sqrt((state.pulse.at(seen.astype(np.float64))[0] ** 2).sum()))
    # A contact at the edge or half clipped is judged by what is left of it.
    strength = np.abs(state.height) * np.sqrt(np.maximum(vv, 0.04 * norm**2)) / state.noise_at()
    inside = (state.place > -0.5) & (state.place < state.a.size - 0.5)
    keep = inside & (strength >= 0.8 * threshold)
    keep_only(state, keep)
    while state.place.size > 1:
        close = np.flatnonzero(np.diff(state.place) < 0.75 * state.pulse.width)
        if not close.size:
            break
        weaker = np.where(
            np.abs(state.height[close]) < np.abs(state.height[close + 1]), close, close + 1
        )
        keep = np.ones(state.place.size, dtype=bool)
        keep[weaker] = False
        keep_only(state, keep)


class _BoxNoise:
    """Boxcar of the pulse's width over the array, and its noise in every stretch."""

    def __init__(self, a: FloatArray, width: int, valid: BoolArray) -> None:
        self.width = width
        box = self.of(a)
        self.noise = stretch_noise(np.where(valid, box, np.nan))

    def at_least(self, noise: FloatArray) -> FloatArray:
        """Noise of samples; a rumble that only the boxcar shows is noise to a contact too."""
        return np.asarray(np.maximum(noise, self.noise / np.sqrt(self.width)))

    def of(self, a: FloatArray) -> FloatArray:
        """Sum over the boxcar centred on each sample, over sqrt(width)."""
        if self.width == 1:
            return a
        lead, count = (self.width - 1) // 2, a.size - self.width + 1
        out = np.zeros_like(a)
        if count < 1:
            return out
        inner = out[lead : lead + count]
        if self.width <= _NARROW:
            for k in range(self.width):
                inner += a[k : k + count]
        else:
            total = np.concatenate([[0.0], np.cumsum(a)])
            np.subtract(total[self.width :], total[: -self.width], out=inner)
        inner *= 1.0 / np.sqrt(self.width)
        return out


def _left_over(
    state: State, rest: FloatArray, box: _BoxNoise, threshold: float
) -> tuple[IntArray, IntArray]:
    """Samples where something still stands out, one for each pulse length at most.

    First those where a contact may be added, then those too near to one that is there. What
    stands out less than a near one beside it comes of it.
    """
    size = np.abs(box.of(np.where(state.valid, rest, 0.0)))
    limit = np.repeat(threshold * louder(box.noise), STRETCH)[: size.size]
    candidates = np.flatnonzero(size > limit)
    if not candidates.size:
        return candidates, candidates
    allowed = _doubts(state) * (_DOUBT * np.sqrt(box.width))
    candidates = candidates[size[candidates] > limit[candidates] + allowed[candidates]]
    candidates = strongest(candidates, size[candidates], reach=3 * state.pulse.width + 2)
    if not state.place.size or not candidates.size:
        return candidates, candidates[:0]
    order = np.sort(state.place)
    after = np.searchsorted(order, candidates)
    left = candidates - order[np.maximum(after - 1, 0)]
    right = order[np.minimum(after, order.size - 1)] - candidates
    near = np.minimum(np.abs(left), np.abs(right)) < max(1.0, state.pulse.width)
    return candidates[~near], candidates[near]


def _split(state: State, near: IntArray, tried: list[float]) -> bool:
    """Make two of every contact that does not explain what lies in it; each is tried once."""
    apart = 0.5 * max(1.0, state.pulse.width)
    found = False
    for sample in near:
        i = int(np.argmin(np.abs(state.place - sample)))
        if any(abs(state.place[i] - one) < 2.0 * apart for one in tried):
            continue
        tried.append(float(state.place[i]))
        half = 0.5 * state.height[i]
        state.place = np.append(state.place, state.place[i] + apart)
        state.height = np.append(state.height, half)
        state.sure = np.append(state.sure, True)
        state.place[i] -= apart
        state.height[i] = half
        found = True
    return found


def _doubts(state: State) -> FloatArray:
    """Sum of what every contact may differ from the shape, at each sample."""
    if not state.place.size:
        return np.zeros(state.a.size)
    lags = np.arange(state.pulse.first, state.pulse.last + 1)
    index, _, inside = state.windows(lags)
    doubt = state.pulse.doubt * np.abs(state.height)[:, np.newaxis] * inside
    total = np.bincount(index.ravel(), doubt.ravel(), state.a.size)
    if state.pulse.rings:  # an impact just before the record would still ring in it
        tail = np.arange(state.pulse.core[1], state.pulse.last + 1)
        envelope = np.maximum.accumulate(np.abs(state.pulse.at(tail * 1.0)[0])[::-1])[::-1]
        n = min(tail.size, total.size)
        total[:n] += np.abs(state.height).max() * envelope[:n]
    return np.asarray(total)


def strongest(index: IntArray, size: FloatArray, *, reach: float) -> IntArray:
    """Those of rising samples `index` that are largest within `reach` samples to either side.

    Examples
    --------
    >>> strongest(np.array([3, 5, 20]), np.array([1.0, 2.0, 1.0]), reach=4).tolist()
    [5, 20]
    """
    largest = np.ones(index.size, dtype=bool)
    for step in range(1, index.size):
        near = index[step:] - index[:-step] <= reach
        if not near.any():
            break
        largest[:-step] &= ~(near & (size[step:] > size[:-step]))
        largest[step:] &= ~(near & (size[:-step] >= size[step:]))
    return index[largest]


def _finished(state: State, seen: IntArray) -> Contacts:
    if not state.place.size:
        none = np.empty(0)
        flags = none.astype(bool)
        return Contacts(none, none, none, none, none, none, none, none, flags, flags)
    noise, pulse = state.noise_at(), state.pulse
    _, _, _, vv, vs, ss = normal_equations(state, seen)
    determinant = np.maximum(vv * ss - vs * vs, 1e-300)
    place_error = noise * np.sqrt(vv / determinant)
    height_error = noise * np.sqrt(ss / determinant)
    own_doubt = pulse.doubt[np.clip(-pulse.first, 0, pulse.doubt.size - 1)] * np.abs(state.height)
    index, _, inside = state.windows(np.arange(pulse.first, pulse.last + 1))
    around = _doubts(state)[np.clip(np.rint(state.place).astype(np.int64), 0, state.a.size - 1)]
    from_others = np.maximum(around - own_doubt, 0.0)
    strength = np.abs(state.height) / np.hypot(height_error, from_others)
    if pulse.shape.duration < 1.5:  # within one sample nothing tells where it lies
        place_error = np.hypot(place_error, 0.2)

    core = np.arange(pulse.core[0], pulse.core[1] + 1)
    index, u, inside = state.windows(core)
    rest = state.residual()[index] * (inside & state.valid[index])
    area, area_error = _areas(state, u, rest, inside & state.valid[index], noise)
    shape_error = np.abs(pulse.area) * (height_error + from_others + own_doubt)
    whole = (inside & state.valid[index]).all(1)
    area_error = np.where(whole, area_error, shape_error)
    peak = np.abs(state.a[index] * inside).max(1)
    gap = np.diff(state.place)
    close = gap < 0.5 * (core.size - 1)
    misfit = np.sqrt((rest**2).mean(1)) > 4.0 * np.hypot(noise, own_doubt)
    crowded = np.append(close, False) | np.append(False, close) | misfit
    return Contacts(
        state.place, place_error, state.height, height_error, strength, area, area_error, peak,
        crowded, state.sure,
    )  # fmt: skip


def _areas(
    state: State, u: FloatArray, rest: FloatArray, use: BoolArray, noise: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Velocity jumps, in sample intervals.

    Without ringing the core's samples are added up, whatever the form of this very contact; with
    ringing the core ends in mid-swing, and the height of the known pulse tells better.
    """
    pulse = state.pulse
    norm = np.sqrt(np.maximum((pulse.at(u)[0] ** 2 * use).sum(1), 1e-300))
    if pulse.rings:
        doubt = pulse.doubt.max() * np.abs(state.height)
        return pulse.area * state.height, pulse.area * np.hypot(noise / norm, doubt)
    area = pulse.area * state.height + rest.sum(1) / pulse.kept
    return area, noise * np.sqrt(rest.shape[1]) / pulse.kept
