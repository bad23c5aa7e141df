"""Fit every contact of a stretch at once: time, height, and what is still unexplained.

All contacts share one template. Each round refines times and heights together (what one
contact leaves under another is subtracted), looks at what remains, and takes up what still
stands out of noise and of the error of the template.

Contacts that share an array, refined together: times and heights by Gauss-Newton.

What one contact leaves under another is subtracted; contacts that overlap are moved together, all
others each for itself.

What fitted contacts leave of a stretch: more contacts, contacts that hide two, or nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import toeplitz

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.impacts.candidates import STRETCH, Piece, louder, stretch_noise, strongest
from vinesexp.signals.impacts.template import Template

_ROUNDS = 8
_QUIETER = 0.7  # times the noise believed before
_STEPS = 5  # Gauss-Newton steps a round, at most
_STEPS_CLIPPED = 40  # where each step changes what the samples are
_WORSE = 3  # steps that fit no better than the best, after which none will
_STILL = 1e-3  # samples: a smaller step changes nothing
_QUIET = 0.1  # of the noise: a smaller change of what is given back changes nothing
_MOST = 4.0  # of the largest sample of a contact: its height, where others take from it
_TOGETHER = 16  # contacts of a chain that are moved at once
_SEEN = 0.03  # a lag counts in the fit where the template exceeds this share of its peak
_RINGS = 0.5  # of its peak: ringing that overlaps the next contact
_SPREADS = 3.0  # of the template, above which a remainder is a new contact


@dataclass(frozen=True)
class Contacts:
    """Contacts in order of time.

    Attributes
    ----------
    place, place_error : arrays (k,)
        Time in samples from the start of the array, and its standard error.
    height : array (k,)
        Of the template, m/s^2.
    strength : array (k,)
        Height over its standard error, the template error of stronger neighbours included.
    area : array (k,)
        Velocity jump in units of (m/s^2 samples): multiply by the sample interval.
    area_error : array (k,)
    peak : array (k,)
        Largest sample of the contact, m/s^2.
    crowded : bool array (k,)
        Another contact overlaps this one's core, or something in it is left unexplained.
    sure : bool array (k,)
        It stood out before the template was known.
    """

    place: FloatArray
    place_error: FloatArray
    height: FloatArray
    strength: FloatArray
    area: FloatArray
    area_error: FloatArray
    peak: FloatArray
    crowded: BoolArray
    sure: BoolArray


def fit_contacts(
    piece: Piece, start: IntArray, template: Template, *,
    noise: FloatArray, settings: ImpactSettings, sure: BoolArray | None = None,
) -> Contacts:  # fmt: skip
    """Fit contacts of one shape to an acceleration.

    Parameters
    ----------
    piece : Piece
        Highpassed acceleration, m/s^2. A clipped sample says that the truth is no smaller, one that
        is missing says nothing.
    start : int array
        Samples of the contacts to begin with; others are found on the way.
    template : Template
    noise : array
        Of a sample, for every `STRETCH` samples.
    settings : ImpactSettings
    sure : bool array, optional
        False where `start` stands out too little to be kept without the template's help.
    """
    box = BoxNoise(piece.a, template.width, piece.good)
    known = np.ones(start.size, dtype=bool) if sure is None else sure
    place, height = start.astype(np.float64), piece.a[start].astype(np.float64)
    noise = box.at_least(noise)
    state = State(piece.a, noise, piece.good, piece.clipped, template, place, height, known)
    seen = seen_lags(template)
    align_in_turn(state, seen, reach=template.search)
    tried: list[float] = []
    for _ in range(_ROUNDS):
        settle(state, seen)
        _merge(state, settings.threshold, seen)
        rest = state.residual()
        more, near = left_over(state, rest, box, settings)
        two = settings.split and split(state, near, tried)
        if not more.size and not two and not _quieter(state, rest, box):
            break
        state.place = np.concatenate([state.place, more.astype(np.float64)])
        state.height = np.concatenate([state.height, rest[more]])
        state.sure = np.append(state.sure, np.ones(more.size, dtype=bool))
    else:
        settle(state, seen)
        _merge(state, settings.threshold, seen)
    return _finished(state, seen)


def _quieter(state: State, rest: FloatArray, box: BoxNoise) -> bool:
    """Take the noise from what the contacts leave, where they themselves had passed for noise."""
    single = stretch_noise(np.where(state.valid, rest, np.nan))
    if not (single < _QUIETER * state.noise).any():
        return False
    again = BoxNoise(rest, box.width, state.valid)
    noise = again.at_least(single)
    if not (noise < _QUIETER * state.noise).any():
        return False
    state.noise = np.minimum(state.noise, noise)
    box.noise = np.minimum(box.noise, again.noise)
    return True


def _merge(state: State, threshold: float, seen: IntArray) -> None:
    """Drop contacts that became insignificant, coincide with a stronger one, or led away.

    Contacts of opposite signs beside one another may grow without end, each less the other: what
    is far larger than anything that the samples show is none.
    """
    keep_only(state, np.argsort(state.place, kind="stable"))
    index, _, _, vv, _, ss = normal_equations(state, seen)
    possible = np.abs(state.height) < _MOST * np.abs(state.a[index]).max(axis=1, initial=0.0)
    possible |= state.clipped[index].any(axis=1)
    norm = float(np.sqrt((state.template.at(seen.astype(np.float64))[0] ** 2).sum()))
    # A contact at the edge or half clipped is judged by what is left of it.
    strength = np.abs(state.height) * np.sqrt(np.maximum(vv, 0.04 * norm**2)) / state.noise_at()
    inside = (state.place > -0.5) & (state.place < state.a.size - 0.5)
    keep = inside & possible & (ss > 0.0) & (strength >= 0.8 * threshold)  # some of it was seen
    keep_only(state, keep)
    while state.place.size > 1:
        close = np.flatnonzero(np.diff(state.place) < 0.75 * state.template.width)
        if not close.size:
            break
        weaker = np.where(
            np.abs(state.height[close]) < np.abs(state.height[close + 1]), close, close + 1
        )
        keep = np.ones(state.place.size, dtype=bool)
        keep[weaker] = False
        keep_only(state, keep)


def _finished(state: State, seen: IntArray) -> Contacts:
    noise, template = state.noise_at(), state.template
    _, value, slope, vv, vs, ss = normal_equations(state, seen)
    determinant = np.maximum(vv * ss - vs * vs, 1e-300)
    place_error = noise * np.sqrt(vv / determinant)
    height_error = noise * np.sqrt(ss / determinant)
    own_error = template.model_error[
        np.clip(-template.first, 0, template.model_error.size - 1)
    ] * np.abs(state.height)
    around = model_errors(state)[
        np.clip(np.rint(state.place).astype(np.int64), 0, state.a.size - 1)
    ]
    from_others = np.maximum(around - own_error, 0.0)
    strength = np.abs(state.height) / np.hypot(height_error, from_others)
    if template.shape.duration < 1.5:  # within one sample nothing shows where it lies
        place_error = np.hypot(place_error, 0.2)

    core = np.arange(template.core[0], template.core[1] + 1)
    index, u, inside = state.windows(core)
    rest = state.residual()[index] * (inside & state.valid[index])
    area, area_error = _areas(state, u, rest, inside & state.valid[index], noise)
    whole = (inside & state.valid[index]).all(1)
    if not whole.all():
        # The height of a contact that is seen in part is what the shape makes of that part.
        weight = np.abs(ss[:, np.newaxis] * value - vs[:, np.newaxis] * slope)
        by_shape = weight @ template.model_error[seen - template.first] / determinant
        by_shape *= np.abs(state.height)
        of_part = np.abs(template.area) * (height_error + from_others + by_shape)
        area_error = np.where(whole, area_error, of_part)
    peak = np.abs(state.a[index] * inside).max(1)
    gap = np.diff(state.place)
    close = gap < 0.5 * (core.size - 1)
    left = np.sqrt((rest**2).mean(1))
    of_shape = template.model_error[
        np.clip(core - template.first, 0, template.model_error.size - 1)
    ]
    usual = np.sqrt((of_shape**2).mean()) * np.abs(state.height)
    misfit = left > 4.0 * np.hypot(noise, usual)
    crowded = np.append(close, False) | np.append(False, close) | misfit
    # what a shape leaves moves the contact as noise of this size would
    place_error = place_error * np.maximum(left / noise, 1.0)
    return Contacts(
        state.place, place_error, state.height, strength, area, area_error, peak,
        crowded, state.sure,
    )  # fmt: skip


def _areas(
    state: State, u: FloatArray, rest: FloatArray, use: BoolArray, noise: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Velocity jumps, in sample intervals.

    Without ringing the core's samples are added up, whatever the form of this very contact; with
    ringing the core ends in mid-swing, and the height of the known template shows it better.
    """
    template = state.template
    norm = np.sqrt(np.maximum((template.at(u)[0] ** 2 * use).sum(1), 1e-300))
    if template.rings:
        model_error = template.model_error.max() * np.abs(state.height)
        return template.area * state.height, template.area * np.hypot(noise / norm, model_error)
    area = template.area * state.height + rest.sum(1) / template.kept
    return area, noise * np.sqrt(rest.shape[1]) / template.kept


@dataclass
class State:
    """What is being refined: the array, its noise, what may be believed, and the contacts."""

    a: FloatArray
    noise: FloatArray
    valid: BoolArray
    clipped: BoolArray
    template: Template
    place: FloatArray
    height: FloatArray
    sure: BoolArray
    given: FloatArray | float = 0.0  # to the samples beside clipped ones, m/s^2

    def windows(self, lags: IntArray) -> tuple[IntArray, FloatArray, BoolArray]:
        """Sample index, lag, and whether there is a sample, for every contact."""
        index = np.rint(self.place).astype(np.int64)[:, np.newaxis] + lags
        u = index - self.place[:, np.newaxis]
        inside = (index >= 0) & (index < self.a.size)
        return np.clip(index, 0, self.a.size - 1), u, inside

    def noise_at(self) -> FloatArray:
        stretch = np.clip(self.place, 0, self.a.size - 1).astype(np.int64) // STRETCH
        return self.noise[np.minimum(stretch, self.noise.size - 1)]

    def residual(self) -> FloatArray:
        """The array less all contacts."""
        return less(self.a, self.place, self.height, self.template)

    def misfit(self) -> float:
        """Squares of what the contacts leave of known samples, and lack at clipped ones."""
        rest = self.residual()
        counts = self.valid | (self.clipped & (rest * self.a > 0.0))
        return float(rest[counts] @ rest[counts])

    def become(self, other: State) -> None:
        """Take over what another state of the same array has found."""
        self.a, self.given = other.a, other.given
        self.place, self.height, self.sure = other.place, other.height, other.sure

    def give_back(self) -> float:
        """Lower what is beside clipped samples as the highpass would; return the change, m/s^2.

        A clipped sample lacks what its contact reaches beyond the limit. The highpass lowers what
        is around a contact by a share of its area: where that is clipped by too little, for
        milliseconds and by many times the noise.
        """
        over = np.flatnonzero(self.clipped)
        if not over.size or not self.template.corner:
            return 0.0
        rest, sign = self.residual()[over], np.sign(self.a[over])
        lacking = np.maximum(-rest * sign, 0.0) * sign
        lags = np.arange(self.template.first, self.template.last + 1)
        index = over[:, np.newaxis] + lags
        inside = (index >= 0) & (index < self.a.size)
        lowered = (lacking[:, np.newaxis] * self.template.taken[np.abs(lags)])[inside]
        given = -np.bincount(index[inside], lowered, self.a.size).astype(np.float64, copy=False)
        change, self.given = given - self.given, given
        self.a = self.a + change
        return float(np.abs(change).max())


def less(a: FloatArray, place: FloatArray, height: FloatArray, template: Template) -> FloatArray:
    """The array less contacts of given places (samples) and heights."""
    lags = np.arange(template.first, template.last + 1)
    index = np.rint(place).astype(np.int64)[:, np.newaxis] + lags
    model = template.at(index - place[:, np.newaxis])[0]
    model *= height[:, np.newaxis]
    if index.min(initial=0) < 0 or index.max(initial=0) >= a.size:
        model *= (index >= 0) & (index < a.size)
        index = np.clip(index, 0, a.size - 1)
    return a - np.bincount(index.ravel(), model.ravel(), a.size)


def settle(state: State, seen: IntArray) -> None:
    """Gauss-Newton until nothing moves that matters, or steps fit no better than before.

    Where much is clipped, what is given back for one contact moves all the others: steps may lead
    away without end.
    """
    clipped = bool(state.clipped.any())
    best, least, worse = replace(state), math.inf, 0
    for _ in range(_STEPS_CLIPPED if clipped else _STEPS):
        moved, given = _refine(state, seen), state.give_back()
        left = state.misfit() if clipped else 0.0
        if left < least or not clipped:
            best, least, worse = replace(state), left, 0
        else:
            worse += 1
        if worse == _WORSE or (moved < _STILL and given < _QUIET * float(state.noise.min())):
            break
    state.become(best)


def seen_lags(template: Template, share: float = _SEEN) -> IntArray:
    """Lags between which the template is more than a share of its height."""
    lags = np.arange(template.first, template.last + 1)
    size = np.maximum(np.abs(template.at(lags - 0.5)[0]), np.abs(template.at(lags + 0.5)[0]))
    size = np.maximum(size, np.abs(template.at(lags.astype(np.float64))[0]))
    big = lags[size > share]
    return np.arange(big[0], big[-1] + 1)


def normal_equations(
    state: State, seen: IntArray, *, also: BoolArray | None = None
) -> tuple[IntArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Sample index, template, time derivative and the 2 x 2 normal equations of every contact."""
    index, u, inside = state.windows(seen)
    value, slope = state.template.at(u)
    slope *= -state.height[:, np.newaxis]
    counts = state.valid if also is None else state.valid | also
    use = inside & counts[index]
    beyond = state.clipped[index] & ~use & inside
    if beyond.any() and state.template.corner:
        taken = toeplitz(state.template.taken[: seen.size])
        value, slope = value + (value * beyond) @ taken, slope + (slope * beyond) @ taken
    if not use.all():
        value, slope = value * use, slope * use
    vv, vs, ss = ((value * value).sum(1), (value * slope).sum(1), (slope * slope).sum(1))
    return index, value, slope, vv, vs, ss


def align(state: State, seen: IntArray, *, reach: int) -> None:
    """Move every contact to where the template fits best within `reach` samples.

    A first guess may sit on the second swing of a ringing, from where small steps do not lead back.
    """
    wide = np.arange(seen[0] - reach, seen[-1] + reach + 1)
    index, _, inside = state.windows(wide)
    known = state.valid[index] | state.clipped[index]
    samples = np.where(inside & known, state.a[index], 0.0)
    views = np.lib.stride_tricks.sliding_window_view(samples, seen.size, axis=1)
    parts = state.template.parts
    top = np.zeros(len(samples))
    place, height = np.rint(state.place), state.height
    for part in np.arange(parts) / parts:
        shape = state.template.at(seen - part)[0]
        norm = float(shape @ shape)
        match = views @ shape / np.sqrt(norm)
        best = np.argmax(np.abs(match), axis=1)
        value = match[np.arange(best.size), best]
        better = np.abs(value) > top
        top = np.where(better, np.abs(value), top)
        place = np.where(better, np.rint(state.place) + best - reach + part, place)
        height = np.where(better, value / np.sqrt(norm), height)
    state.place, state.height = place, height


def align_in_turn(state: State, seen: IntArray, *, reach: int) -> None:
    """`align`, where contacts lie in the ringing of one another the strongest first.

    Each is placed on what the stronger ones have left: all would else move to the strongest.
    """
    order = np.argsort(state.place, kind="stable")
    keep_only(state, order)
    apart = np.diff(state.place) > reach + seen[-1] - seen[0]
    chains = np.split(np.arange(order.size), np.flatnonzero(apart) + 1)
    alone = np.array([c.size < 2 or not state.template.rings for c in chains], dtype=bool)
    whole = np.repeat(alone, [c.size for c in chains])
    every = replace(state)
    align(every, seen, reach=reach)
    state.place = np.where(whole, every.place, state.place)
    state.height = np.where(whole, every.height, state.height)
    for chain in (c for c, one in zip(chains, alone, strict=True) if not one):
        first = max(int(state.place[chain[0]]) - reach + int(seen[0]) - 1, 0)
        rest = state.a[first : int(state.place[chain[-1]]) + reach + int(seen[-1]) + 2].copy()
        end = first + rest.size
        waiting = list(chain)
        while waiting:
            part = replace(
                state, a=rest, place=state.place[waiting] - first, height=state.height[waiting],
                valid=state.valid[first:end], clipped=state.clipped[first:end],
                sure=state.sure[waiting],
            )  # fmt: skip
            align(part, seen, reach=reach)
            best = int(np.argmax(np.abs(part.height)))
            own = slice(best, best + 1)
            rest = less(rest, part.place[own], part.height[own], state.template)
            i = waiting.pop(best)
            state.place[i], state.height[i] = part.place[best] + first, part.height[best]


def _refine(state: State, seen: IntArray) -> float:
    """One Gauss-Newton step of all times and heights; each keeps within half a sample.

    Contacts that overlap are moved together, all others each for itself. Returns the largest move.
    """
    rest = state.residual()
    short = state.clipped & (rest * state.a > 0.0)  # the fit does not even reach the limit
    index, value, slope, vv, vs, ss = normal_equations(state, seen, also=short)
    window = rest[index]
    right_v, right_s = (value * window).sum(1), (slope * window).sum(1)
    determinant = vv * ss - vs * vs
    good = determinant > 1e-9 * vv * ss
    safe = np.where(good, determinant, 1.0)
    height_step = np.where(good, (ss * right_v - vs * right_s) / safe, 0.0)
    place_step = np.where(good, (vv * right_s - vs * right_v) / safe, 0.0)
    for chain in _overlapping(state):
        # The work grows as the cube of their number. Parts of a long chain come one after the
        # other, each with what the ones before it have left.
        for group in np.array_split(chain, -(-chain.size // _TOGETHER)):
            columns, low = _columns(index[group], value[group], slope[group])
            left = rest[low : low + columns.shape[1]]
            step = np.linalg.lstsq(columns.T, left, rcond=1e-4)[0]
            height_step[group], place_step[group] = step[: group.size], step[group.size :]
            if group.size < chain.size:
                left -= step @ columns
    state.height = state.height + height_step
    state.place = state.place + np.clip(place_step, -0.5, 0.5)
    return float(np.abs(place_step).max(initial=0.0))


def _overlapping(state: State) -> list[IntArray]:
    """Groups of contacts, each so close to the next that their cores or their ringing overlap.

    Moved each for itself, contacts in the ringing of one another take the same rest several times.
    """
    order = np.argsort(state.place, kind="stable")
    template = state.template
    length = max(template.core[1] - template.core[0], int(seen_lags(template, _RINGS)[-1]))
    linked = np.diff(state.place[order]) < length
    if not linked.any():
        return []
    groups = np.split(order, np.flatnonzero(~linked) + 1)
    return [group for group in groups if group.size > 1]


def _columns(index: IntArray, value: FloatArray, slope: FloatArray) -> tuple[FloatArray, int]:
    """Templates and derivatives of contacts that share samples, and the first sample."""
    low, high = int(index.min()), int(index.max()) + 1
    both = np.concatenate([value, slope])
    rows = np.arange(len(both))[:, np.newaxis] * (high - low)
    flat = rows + np.concatenate([index, index]) - low
    size = len(both) * (high - low)
    columns: FloatArray = np.bincount(flat.ravel(), both.ravel(), size).astype(
        np.float64, copy=False
    )
    return columns.reshape(len(both), high - low), low


def keep_only(state: State, which: IntArray | BoolArray) -> None:
    """Keep chosen contacts, in the order in which they are chosen."""
    state.place, state.height = state.place[which], state.height[which]
    state.sure = state.sure[which]


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
        lead, count, out = (self.width - 1) // 2, a.size - self.width + 1, np.zeros_like(a)
        if count > 0:
            total = np.append(0.0, np.cumsum(a))
            sums = total[self.width :] - total[: -self.width]
            out[lead : lead + count] = sums / np.sqrt(self.width)
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
    allowed = model_errors(state) * (_SPREADS * np.sqrt(box.width))
    candidates = candidates[size[candidates] > limit[candidates] + allowed[candidates]]
    reach = 3 * state.template.width + 2
    candidates = candidates[strongest(candidates, size[candidates], reach=reach)]
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
    lags = np.arange(state.template.first, state.template.last + 1)
    index, _, inside = state.windows(lags)
    model_error = state.template.model_error * np.abs(state.height)[:, np.newaxis] * inside
    total = np.bincount(index.ravel(), model_error.ravel(), state.a.size).astype(np.float64)
    if state.template.rings:  # an impact just before the record would still ring in it
        tail = np.arange(state.template.core[1], state.template.last + 1)
        envelope = np.maximum.accumulate(np.abs(state.template.at(tail * 1.0)[0])[::-1])[::-1]
        n = min(tail.size, total.size)
        total[:n] += np.abs(state.height).max(initial=0.0) * envelope[:n]
    return np.asarray(total)
