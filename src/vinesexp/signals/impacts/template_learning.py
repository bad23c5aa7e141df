"""Which impacts of a record its template is learnt from.

Clear ones that stand alone, if there are; else all that are clear, each less what its neighbours
seem to be.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.impacts.candidates import STRETCH, Spikes, stretch_noise
from vinesexp.signals.impacts.matching import Contacts, explained_rest, fit_contacts
from vinesexp.signals.impacts.stream import Grouped, Piece
from vinesexp.signals.impacts.template import Shape, Template, template_of
from vinesexp.signals.impacts.template_fit import learn_template
from vinesexp.signals.impacts.template_windows import Windows

FEW = 5  # whole impacts are enough; with fewer, clipped ones help
_AGAIN = 3  # rounds of learning among neighbours
_PROBE = 16  # template lengths in which contacts are counted
_CROWD = 8  # times as many contacts, at most, are fitted to learn from the strongest of them
_ENOUGH = 0.4  # of a contact's samples


@dataclass(frozen=True)
class Guesses:
    """Samples where contacts are taken to be before any fit, and their strengths."""

    index: IntArray
    strength: FloatArray

    @property
    def pair(self) -> tuple[IntArray, FloatArray]:
        return self.index, self.strength

    def keep(self, chosen: BoolArray) -> Guesses:
        """Those that are chosen."""
        return Guesses(self.index[chosen], self.strength[chosen])


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
    grouped: Grouped, guesses: Guesses, spikes: Spikes, span: tuple[int, int], start: Shape,
    settings: ImpactSettings,
) -> Template:  # fmt: skip
    """The template, from clear impacts that stand alone; `start` itself where there are none."""
    chosen = _alone(grouped, guesses, spikes, span, start, settings)
    highpass = grouped.stream.highpass
    if not chosen:
        return template_of(start, span, highpass=highpass, dt=grouped.dt)
    lags = np.arange(span[0], span[1] + 1)
    stack = np.array([piece.a for piece, _ in chosen])
    windows = Windows(
        stack, lags, np.zeros(len(stack)), stack[:, -span[0]],
        np.array([noise for _, noise in chosen]), np.array([piece.good for piece, _ in chosen]),
    )  # fmt: skip
    template, _ = learn_template(windows, start, highpass=highpass, dt=grouped.dt)
    return template


def _alone(
    grouped: Grouped, guesses: Guesses, spikes: Spikes, span: tuple[int, int], start: Shape,
    settings: ImpactSettings,
) -> list[tuple[Piece, float]]:  # fmt: skip
    """Windows of clear impacts without a neighbour, each with its noise; whole ones preferred."""
    k, first, strength = grouped.k, guesses.index, guesses.strength
    lone = strongest_neighbour(first, strength, reach=(span[1] - span[0]) * k) == 0.0
    inside = (first + span[0] * k > 0) & (first + (span[1] + 1) * k < grouped.stream.n)
    usable = np.flatnonzero(lone & inside & (strength > settings.learn_above))
    order = usable[np.argsort(-strength[usable], kind="stable")]
    order = order[order.size // 50 :]  # the very strongest may be something else
    lags = np.arange(span[0], span[1] + 1)
    core = np.abs(lags) <= math.ceil(start.duration)
    whole: list[tuple[Piece, float]] = []
    damaged: list[tuple[Piece, float]] = []
    for i in order[: 4 * settings.learn_from]:
        begin = int(first[i] + span[0] * k)
        piece = grouped.piece(begin, begin + lags.size * k)
        stretch = min(first[i] // STRETCH, spikes.noise.size - 1)
        kind = whole if piece.good.all() else damaged
        if kind is whole or piece.good[core].mean() > _ENOUGH:
            kind.append((piece, float(spikes.noise[stretch] / np.sqrt(k))))
        if len(whole) == settings.learn_from:
            break
    return whole if len(whole) >= FEW else (whole + damaged)[: settings.learn_from]


def learnt_among_neighbours(
    grouped: Grouped, guesses: Guesses, template: Template, settings: ImpactSettings
) -> Template:
    """The template where hardly an impact stands alone: each less what its neighbours seem to be.

    From the chunk with the strongest impact, or less where contacts are many: each is as dear to
    fit as any, and more of them teach no more. Again as long as the template explains more, as
    better neighbours make a better template.
    """
    strongest = int(guesses.index[np.argmax(guesses.strength)])
    begin = strongest // grouped.chunk * grouped.chunk
    end = min(grouped.stream.n, begin + grouped.chunk)
    few = _PROBE * (template.last - template.first) * grouped.k
    if end - begin > 2 * few:
        probe = _part(grouped, guesses, *_around(strongest, few, (begin, end)))
        count = max(1, _fitted(probe, template, settings).place.size)
        enough = few * _CROWD * settings.learn_from // count
        begin, end = _around(strongest, enough // grouped.k * grouped.k, (begin, end))
    part = _part(grouped, guesses, begin, end)
    piece, noise, _ = part
    best, least = template, math.inf
    for _ in range(_AGAIN):
        found = _fitted(part, template, settings)
        rest = explained_rest(piece.a, found, template)
        left = float((rest[piece.good] ** 2).sum())
        if left >= least:
            break
        best, least = template, left
        windows = _less_neighbours(piece, rest, found, template, noise, settings)
        if windows is None:
            break
        template, _ = learn_template(
            windows, template.shape, highpass=grouped.stream.highpass, dt=grouped.dt
        )
    return best


def _around(centre: int, length: int, within: tuple[int, int]) -> tuple[int, int]:
    """Samples about one of them, no more than there are."""
    begin, end = within
    first = min(max(begin, centre - length // 2), max(begin, end - length))
    return first, min(end, first + length)


def _part(
    grouped: Grouped, guesses: Guesses, begin: int, end: int
) -> tuple[Piece, FloatArray, IntArray]:
    """A piece of the record, its noise, and where contacts are taken to be in it."""
    begin -= begin % grouped.k
    piece = grouped.piece(begin, end)
    noise = stretch_noise(np.where(piece.good, piece.a, np.nan), grouped.noise_floor)
    here = guesses.index[(guesses.index >= begin) & (guesses.index < end)]
    start = np.unique(np.clip((here - begin) // grouped.k, 0, piece.a.size - 1))
    return piece, noise, start


def _fitted(
    part: tuple[Piece, FloatArray, IntArray], template: Template, settings: ImpactSettings
) -> Contacts:
    piece, noise, start = part
    return fit_contacts(
        piece.a, start, template, noise=noise, settings=settings,
        valid=piece.good, clipped=piece.clipped,
    )  # fmt: skip


def _less_neighbours(
    piece: Piece, rest: FloatArray, found: Contacts, template: Template, noise: FloatArray,
    settings: ImpactSettings,
) -> Windows | None:  # fmt: skip
    """Windows of the strongest contacts, what the others left in them taken off."""
    lags = np.arange(template.first, template.last + 1)
    centre = np.rint(found.place).astype(np.int64)
    whole = (centre + lags[0] >= 0) & (centre + lags[-1] < piece.a.size)
    whole &= found.strength > settings.learn_above
    order = np.argsort(-found.strength[whole], kind="stable")
    chosen = np.flatnonzero(whole)[order][: settings.learn_from]
    if chosen.size < FEW:
        return None
    index = centre[chosen, np.newaxis] + lags
    shape = template.at(index - found.place[chosen, np.newaxis])[0]
    alone = rest[index] + found.height[chosen, np.newaxis] * shape
    at = np.minimum(centre[chosen] // STRETCH, noise.size - 1)
    return Windows(
        alone, lags, found.place[chosen] - centre[chosen], found.height[chosen], noise[at],
        piece.good[index],
    )  # fmt: skip
