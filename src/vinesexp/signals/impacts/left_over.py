"""What fitted contacts leave of a stretch: more contacts, contacts that hide two, or nothing."""

from __future__ import annotations

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.impacts.candidates import STRETCH, louder, stretch_noise, strongest
from vinesexp.signals.impacts.overlapping import State

_NARROW = 8  # samples: so many sums are quicker than a running one


class BoxNoise:
    """Boxcar of the template's width over the array, and its noise in every stretch."""

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


def left_over(
    state: State, rest: FloatArray, box: BoxNoise, settings: ImpactSettings
) -> tuple[IntArray, IntArray]:
    """Samples where something still stands out, one for each template length at most.

    First those where a contact may be added, then those too near to one that is there. What
    stands out less than a near one beside it comes of it.
    """
    size = np.abs(box.of(np.where(state.valid, rest, 0.0)))
    limit = np.repeat(settings.threshold * louder(box.noise), STRETCH)[: size.size]
    candidates = np.flatnonzero(size > limit)
    if not candidates.size:
        return candidates, candidates
    allowed = model_errors(state) * (settings.template_error * np.sqrt(box.width))
    candidates = candidates[size[candidates] > limit[candidates] + allowed[candidates]]
    candidates = strongest(candidates, size[candidates], reach=3 * state.template.width + 2)
    if not state.place.size or not candidates.size:
        return candidates, candidates[:0]
    order = np.sort(state.place)
    after = np.searchsorted(order, candidates)
    left = candidates - order[np.maximum(after - 1, 0)]
    right = order[np.minimum(after, order.size - 1)] - candidates
    near = np.minimum(np.abs(left), np.abs(right)) < max(1.0, state.template.width)
    return candidates[~near], candidates[near]


def split(state: State, near: IntArray, tried: list[float]) -> bool:
    """Make two of every contact that does not explain what lies in it; each is tried once."""
    apart = 0.5 * max(1.0, state.template.width)
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


def model_errors(state: State) -> FloatArray:
    """Sum of what every contact may differ from the shape, at each sample."""
    if not state.place.size:
        return np.zeros(state.a.size)
    lags = np.arange(state.template.first, state.template.last + 1)
    index, _, inside = state.windows(lags)
    model_error = state.template.model_error * np.abs(state.height)[:, np.newaxis] * inside
    total = np.bincount(index.ravel(), model_error.ravel(), state.a.size)
    if state.template.rings:  # an impact just before the record would still ring in it
        tail = np.arange(state.template.core[1], state.template.last + 1)
        envelope = np.maximum.accumulate(np.abs(state.template.at(tail * 1.0)[0])[::-1])[::-1]
        n = min(tail.size, total.size)
        total[:n] += np.abs(state.height).max() * envelope[:n]
    return np.asarray(total)
