"""Contacts that share an array, refined together: times and heights by Gauss-Newton.

What one contact leaves under another is subtracted; contacts that overlap are moved together, all
others each for itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.signals.impacts.candidates import STRETCH
from vinesexp.signals.impacts.template import Template

_STEPS = 5  # Gauss-Newton steps a round, at most
_STILL = 1e-3  # samples: a smaller step changes nothing
_TOGETHER = 16  # contacts of a chain that are moved at once
_SEEN = 0.03  # a lag counts in the fit where the template exceeds this share of its peak


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


def less(a: FloatArray, place: FloatArray, height: FloatArray, template: Template) -> FloatArray:
    """The array less contacts of given places (samples) and heights."""
    if not place.size:
        return a.copy()
    lags = np.arange(template.first, template.last + 1)
    centre = np.rint(place)
    index = centre.astype(np.int64)[:, np.newaxis] + lags
    model = template.around(place - centre, lags)[0]
    model *= height[:, np.newaxis]
    if index.min() < 0 or index.max() >= a.size:
        model *= (index >= 0) & (index < a.size)
        index = np.clip(index, 0, a.size - 1)
    return a - np.bincount(index.ravel(), model.ravel(), a.size)


def settle(state: State, seen: IntArray) -> None:
    """Gauss-Newton until nothing moves that matters."""
    for _ in range(_STEPS):
        if _refine(state, seen) < _STILL:
            break


def seen_lags(template: Template) -> IntArray:
    """Lags between which the template is more than a few per cent of its height."""
    lags = np.arange(template.first, template.last + 1)
    size = np.maximum(np.abs(template.at(lags - 0.5)[0]), np.abs(template.at(lags + 0.5)[0]))
    size = np.maximum(size, np.abs(template.at(lags.astype(np.float64))[0]))
    big = lags[size > _SEEN]
    return np.arange(big[0], big[-1] + 1)


def normal_equations(
    state: State, seen: IntArray, *, also: BoolArray | None = None
) -> tuple[IntArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Sample index, template, time derivative and the 2 x 2 normal equations of every contact."""
    index, _, inside = state.windows(seen)
    value, slope = state.template.around(state.place - np.rint(state.place), seen)
    slope *= -state.height[:, np.newaxis]
    counts = state.valid if also is None else state.valid | also
    use = inside & counts[index]
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


def _refine(state: State, seen: IntArray) -> float:
    """One Gauss-Newton step of all times and heights; each keeps within half a sample.

    Contacts that overlap are moved together, all others each for itself. Returns the largest move.
    """
    if not state.place.size:
        return 0.0
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
    return float(np.abs(place_step).max())


def _overlapping(state: State) -> list[IntArray]:
    """Groups of contacts, each closer to the next than their cores are long."""
    order = np.argsort(state.place, kind="stable")
    linked = np.diff(state.place[order]) < state.template.core[1] - state.template.core[0]
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
