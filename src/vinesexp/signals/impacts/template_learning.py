"""Which impacts of a record its pulse is learnt from.

Clear ones that stand alone, if there are; else all that are clear, each less what its neighbours
seem to be.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.signals.impacts.candidates import STRETCH, Spikes, stretch_noise
from vinesexp.signals.impacts.matching import explained_rest, fit_contacts
from vinesexp.signals.impacts.template import Pulse, Shape, pulse_of
from vinesexp.signals.impacts.template_fit import Windows, learn_pulse

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

#: Samples handled at once: a quarter of a million, which a cache holds.
CHUNK = 16 * STRETCH
FEW = 5  # whole impacts are enough; with fewer, clipped ones help
_LEARN = 80  # impacts the pulse is learnt from
_AGAIN = 3  # rounds of learning among neighbours
_ENOUGH = 0.4  # of a contact's samples
_CLEAR = 7.0  # strength of an impact to learn from


@dataclass(frozen=True)
class Piece:
    """Samples (means of groups where the pulse is long), which are good, and which clipped."""

    a: FloatArray
    good: BoolArray
    clipped: BoolArray


def strongest_neighbour(index: IntArray, strength: FloatArray, *, reach: int) -> FloatArray:
    """Strength of the strongest other within `reach` samples; 0 where there is none."""
    top = np.zeros(index.size)
    for step in range(1, index.size):
        near = index[step:] - index[:-step] <= reach
        if not near.any():
            break
        top[:-step] = np.maximum(top[:-step], np.where(near, strength[step:], 0.0))
        top[step:] = np.maximum(top[step:], np.where(near, strength[:-step], 0.0))
    return top


def learnt_alone(
    coarse: Callable[[int, int], Piece], n: int, k: int,
    first: IntArray, strength: FloatArray, spikes: Spikes, span: tuple[int, int],
    start: Shape, highpass: float | None, dt: float,
) -> Pulse:  # fmt: skip
    """The pulse, from up to `_LEARN` clear impacts that stand alone."""
    reach = (span[1] - span[0]) * k
    alone = strongest_neighbour(first, strength, reach=reach) == 0.0
    inside = (first + span[0] * k > 0) & (first + (span[1] + 1) * k < n)
    usable = np.flatnonzero(alone & inside & (strength > _CLEAR))
    order = usable[np.argsort(-strength[usable], kind="stable")]
    order = order[order.size // 50 :]  # the very strongest may be something else
    lags = np.arange(span[0], span[1] + 1)
    core = np.abs(lags) <= math.ceil(start.duration)
    whole: list[tuple[Piece, float]] = []
    damaged: list[tuple[Piece, float]] = []
    for i in order[: 4 * _LEARN]:
        begin = first[i] + span[0] * k
        piece = coarse(int(begin), int(begin) + lags.size * k)
        stretch = min(first[i] // STRETCH, spikes.noise.size - 1)
        kind = whole if piece.good.all() else damaged
        if kind is whole or piece.good[core].mean() > _ENOUGH:
            kind.append((piece, float(spikes.noise[stretch] / np.sqrt(k))))
        if len(whole) == _LEARN:
            break
    chosen = whole if len(whole) >= FEW else (whole + damaged)[:_LEARN]
    if not chosen:
        return pulse_of(start, span, highpass=highpass, dt=dt)
    stack = np.array([piece.a for piece, _ in chosen])
    windows = Windows(
        stack, lags, np.zeros(len(stack)), stack[:, -span[0]],
        np.array([noise for _, noise in chosen]), np.array([piece.good for piece, _ in chosen]),
    )  # fmt: skip
    pulse, _ = learn_pulse(windows, start, highpass=highpass, dt=dt)
    return pulse


def learnt_in_company(
    coarse: Callable[[int, int], Piece], n: int, k: int,
    first: IntArray, strength: FloatArray, pulse: Pulse, threshold: float, noise_floor: float,
    highpass: float | None, dt: float,
) -> Pulse:  # fmt: skip
    """The pulse where hardly an impact stands alone: each less what its neighbours seem to be.

    From the chunk with the strongest impact; again as long as the pulse explains more, as better
    neighbours make a better pulse.
    """
    size = CHUNK // k * k
    begin = int(first[np.argmax(strength)]) // size * size
    piece = coarse(begin, min(n, begin + size))
    noise = stretch_noise(np.where(piece.good, piece.a, np.nan), noise_floor / np.sqrt(k))
    lags = np.arange(pulse.first, pulse.last + 1)
    best, least = pulse, math.inf
    for _ in range(_AGAIN):
        here = (first >= begin) & (first < begin + size)
        start = np.unique(np.clip((first[here] - begin) // k, 0, piece.a.size - 1))
        found = fit_contacts(
            piece.a, start, pulse, noise=noise, threshold=threshold,
            valid=piece.good, clipped=piece.clipped,
        )  # fmt: skip
        rest = explained_rest(piece.a, found, pulse)
        left = float((rest[piece.good] ** 2).sum())
        if left >= least:
            break
        best, least = pulse, left
        centre = np.rint(found.place).astype(np.int64)
        whole = (centre + lags[0] >= 0) & (centre + lags[-1] < piece.a.size)
        whole &= found.strength > _CLEAR
        chosen = np.flatnonzero(whole)[np.argsort(-found.strength[whole], kind="stable")][:_LEARN]
        if chosen.size < FEW:
            break
        index = centre[chosen, np.newaxis] + lags
        own = (
            found.height[chosen, np.newaxis] * pulse.at(index - found.place[chosen, np.newaxis])[0]
        )
        alone = rest[index] + own
        at = np.minimum(centre[chosen] // STRETCH, noise.size - 1)
        windows = Windows(
            alone, lags, found.place[chosen] - centre[chosen], found.height[chosen], noise[at],
            piece.good[index],
        )  # fmt: skip
        pulse, _ = learn_pulse(windows, pulse.shape, highpass=highpass, dt=dt)
    return best
