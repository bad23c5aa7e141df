"""Fit every contact of a stretch at once: time, height, and what is still unexplained.

All contacts share one template. Each round refines times and heights together (what one
contact leaves under another is subtracted), looks at what remains, and takes up what still
stands out of noise and of the error of the template.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.impacts.candidates import stretch_noise
from vinesexp.signals.impacts.left_over import BoxNoise, left_over, model_errors, split
from vinesexp.signals.impacts.overlapping import (
    State,
    align,
    keep_only,
    less,
    normal_equations,
    seen_lags,
    settle,
)
from vinesexp.signals.impacts.template import Template

_ROUNDS = 8
_QUIETER = 0.7  # times the noise believed before


@dataclass(frozen=True)
class Contacts:
    """Contacts in order of time.

    Attributes
    ----------
    place, place_error : arrays (k,)
        Time in samples from the start of the array, and its standard error.
    height, height_error : arrays (k,)
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
    height_error: FloatArray
    strength: FloatArray
    area: FloatArray
    area_error: FloatArray
    peak: FloatArray
    crowded: BoolArray
    sure: BoolArray


def explained_rest(a: FloatArray, contacts: Contacts, template: Template) -> FloatArray:
    """What fitted contacts leave of an array."""
    return less(a, contacts.place, contacts.height, template)


def fit_contacts(
    a: FloatArray, start: IntArray, template: Template, *,
    noise: FloatArray, settings: ImpactSettings, valid: BoolArray | None = None,
    clipped: BoolArray | None = None, sure: BoolArray | None = None,
) -> Contacts:  # fmt: skip
    """Fit contacts of one shape to an acceleration.

    Parameters
    ----------
    a : array (n,)
        Highpassed acceleration, m/s^2.
    start : int array
        Samples of the contacts to begin with; others are found on the way.
    template : Template
    noise : array
        Of a sample, for every `STRETCH` samples.
    settings : ImpactSettings
    valid : bool array (n,), optional
        False where a sample is clipped or missing.
    clipped : bool array (n,), optional
        True where it is clipped: it then says that the truth is no smaller. A missing one says
        nothing.
    sure : bool array, optional
        False where `start` stands out too little to be kept without the template's help.
    """
    truth = np.ones(a.size, dtype=bool) if valid is None else valid
    beyond = np.zeros(a.size, dtype=bool) if clipped is None else clipped
    place = start.astype(np.float64)
    box = BoxNoise(a, template.width, truth)
    noise = box.at_least(noise)
    known = np.ones(start.size, dtype=bool) if sure is None else sure
    state = State(a, noise, truth, beyond, template, place, a[start].astype(np.float64), known)
    seen = seen_lags(template)
    align(state, seen, reach=template.search)
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
    """Drop contacts that became insignificant or that coincide with a stronger one."""
    if not state.place.size:
        return
    keep_only(state, np.argsort(state.place, kind="stable"))
    _, _, _, vv, _, _ = normal_equations(state, seen)
    norm = float(np.sqrt((state.template.at(seen.astype(np.float64))[0] ** 2).sum()))
    # A contact at the edge or half clipped is judged by what is left of it.
    strength = np.abs(state.height) * np.sqrt(np.maximum(vv, 0.04 * norm**2)) / state.noise_at()
    inside = (state.place > -0.5) & (state.place < state.a.size - 0.5)
    keep = inside & (strength >= 0.8 * threshold)
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
    if not state.place.size:
        none = np.empty(0)
        flags = none.astype(bool)
        return Contacts(none, none, none, none, none, none, none, none, flags, flags)
    noise, template = state.noise_at(), state.template
    _, _, _, vv, vs, ss = normal_equations(state, seen)
    determinant = np.maximum(vv * ss - vs * vs, 1e-300)
    place_error = noise * np.sqrt(vv / determinant)
    height_error = noise * np.sqrt(ss / determinant)
    own_error = template.model_error[
        np.clip(-template.first, 0, template.model_error.size - 1)
    ] * np.abs(state.height)
    index, _, inside = state.windows(np.arange(template.first, template.last + 1))
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
    shape_error = np.abs(template.area) * (height_error + from_others + own_error)
    whole = (inside & state.valid[index]).all(1)
    area_error = np.where(whole, area_error, shape_error)
    peak = np.abs(state.a[index] * inside).max(1)
    gap = np.diff(state.place)
    close = gap < 0.5 * (core.size - 1)
    misfit = np.sqrt((rest**2).mean(1)) > 4.0 * np.hypot(noise, own_error)
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
    ringing the core ends in mid-swing, and the height of the known template shows it better.
    """
    template = state.template
    norm = np.sqrt(np.maximum((template.at(u)[0] ** 2 * use).sum(1), 1e-300))
    if template.rings:
        model_error = template.model_error.max() * np.abs(state.height)
        return template.area * state.height, template.area * np.hypot(noise / norm, model_error)
    area = template.area * state.height + rest.sum(1) / template.kept
    return area, noise * np.sqrt(rest.shape[1]) / template.kept
