"""Which impacts of a record its template is learnt from.

Clear ones that stand alone, if there are; else all that are clear, each less what its neighbours
seem to be.

Windows of a record around single impacts, and where in them a template fits best.

Learn the template of a record from its own clean impacts.

Every clean impact samples the same template at another sub-sample shift; a few dozen of them give
duration, form and ringing of the template far below the sample interval. Times and heights of the
impacts are nuisance parameters: they are projected out of every step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d

from vinesexp.arrays import OF_MEDIAN, BoolArray, FloatArray, IntArray
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.impacts.candidates import STRETCH, Grouped, Piece, Spikes
from vinesexp.signals.impacts.matching import Contacts, fit_contacts, less
from vinesexp.signals.impacts.template import Shape, Template, neighbourhood, template_of

FEW = 5  # whole impacts are enough; with fewer, clipped ones help
_AGAIN = 3  # rounds of learning among neighbours
_PROBE = 16  # template lengths in which contacts are counted
_CROWD = 8  # times as many contacts, at most, are fitted to learn from the strongest of them
_ENOUGH = 0.4  # of a contact's samples
_PLACED = 4  # steps to an impact's time
_STEPS = 8
_EVIDENCE = 0.02  # a further parameter has to lower the misfit by this share ...
_NOTICED = 30.0  # ... and by so much chi^2
_SEARCHED = 16  # impacts on which starts are tried
_LONGEST_RING = 4000  # samples
_SHORT = 2.0  # samples: where no boxcar shows the length, there are other starts
_STARTS = (0.4, 2.0, 3.0)
_OUTLYING = 5.0  # standard deviations of a sample from those of the other windows
_OVER = 8.0  # standard deviations of a spectrum averaged over the impacts: something rings
_FEW = 5  # impacts: with fewer only the duration is fitted
_BESIDE = 3  # samples beside the contact in which a filter shows
_FILTERS, _MISFITS = 0.4, 1.5  # damping ratio of a filter; chi^2 a sample that asks for one
_DIES = 0.3  # of its logarithm: what a resonance beyond the samples may lose from one to the next
_NOISY = 4.0  # standard deviations of a moment that noise alone may make
_PLAIN: Sequence[str] = ("duration",)
_FORM: Sequence[str] = ("duration", "power", "skew")
_RESONANT: Sequence[str] = ("duration", "ring", "ring_damping")
_RINGING: Sequence[str] = ("duration", "power", "skew", "ring", "ring_damping")

_LIMITS = {
    "duration": (0.3, 1e6),
    "power": (0.5, 4.0),
    "skew": (-1.5, 1.5),
    "ring": (1e-4, 1.5),
    "ring_damping": (1e-3, 0.9),
}

_NUDGE = {"duration": 1e-2, "power": 1e-2, "skew": 1e-2, "ring": 1e-4, "ring_damping": 1e-3}


@dataclass
class Windows:
    """Windows of n clean impacts and what is believed of each.

    Attributes
    ----------
    samples : array (n, w)
        m/s^2.
    lags : int array (w,)
        Sample minus the sample `whole` of the impact.
    shift : array (n,)
        Time of the impact minus that sample, in samples.
    height, noise : arrays (n,)
        m/s^2.
    good : bool array (n, w)
        False where a sample says nothing of this impact: clipped, missing, or another contact's.
    """

    samples: FloatArray
    lags: IntArray
    shift: FloatArray
    height: FloatArray
    noise: FloatArray
    good: BoolArray


#: Misfit (chi^2), shape, windows with their times.
Fit = tuple[float, Shape, Windows]


def place(windows: Windows, template: Template, *, reach: int) -> Windows:
    """Times and heights for a given template; `reach` > 0 looks for the best whole shift first."""
    shift, height = windows.shift, windows.height
    if reach:
        trials = np.arange(-reach, reach + 1, min(0.5, 1.0 / template.parts))
        shapes = template.at(windows.lags[np.newaxis, :] - trials[:, np.newaxis])[0]
        # By the samples that are known; a shape wholly outside them matches nothing.
        norm = np.sqrt(windows.good @ (shapes**2).T)
        match = (windows.samples * windows.good) @ shapes.T / np.where(norm > 0.0, norm, np.inf)
        shift = trials[np.argmax(np.abs(match), axis=1)]
        height = np.sign(match[np.arange(shift.size), np.argmax(np.abs(match), axis=1)])
    seen = windows.samples * windows.good
    best, explained = shift, np.full(shift.size, -1.0)
    for k in range(_PLACED + 1):
        value, slope = template.at(windows.lags - shift[:, np.newaxis])
        value, slope = value * windows.good, slope * windows.good
        vv, vs, ss = (value * value).sum(1), (value * slope).sum(1), (slope * slope).sum(1)
        v, s = (value * seen).sum(1), (slope * seen).sum(1)
        # Where the template is flat a step may lead away: only what explains more is kept.
        now = v**2 / np.maximum(vv, 1e-300)
        better = now > explained
        best, explained = np.where(better, shift, best), np.where(better, now, explained)
        height = np.where(better & (vv > 0.0), v / np.maximum(vv, 1e-300), height)
        if k == _PLACED:
            break
        # d(sample)/d(shift) = -height slope
        own = np.where(vv > 0.0, v / np.maximum(vv, 1e-300), height)
        down = ss - vs * vs / np.maximum(vv, 1e-300)
        step = -(s - own * vs) / np.where(own * down == 0.0, np.inf, own * down)
        shift = shift + np.clip(step, -0.5, 0.5)
    return replace(windows, shift=best, height=height)


def residual(windows: Windows, template: Template) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Misfit in standard deviations, with template and slope scaled likewise."""
    value, slope = template.at(windows.lags - windows.shift[:, np.newaxis])
    value, slope = value * windows.good, slope * windows.good
    noise = windows.noise[:, np.newaxis]
    height = windows.height[:, np.newaxis] / noise
    samples = windows.samples * windows.good / noise
    return samples - value * height, value * height, slope * height


def projected(x: FloatArray, value: FloatArray, slope: FloatArray) -> FloatArray:
    """x less what each impact's own height and time explain of it."""
    for direction in (value, slope - value * _ratio(slope, value)):
        x = x - direction * _ratio(x, direction)
    return x


def _ratio(x: FloatArray, y: FloatArray) -> FloatArray:
    norm = (y * y).sum(axis=1, keepdims=True)
    return np.asarray((x * y).sum(axis=1, keepdims=True) / np.maximum(norm, 1e-300))


def strongest_neighbour(guesses: Spikes, *, reach: int) -> FloatArray:
    """Strength of the strongest other within `reach` samples; 0 where there is none."""
    index, strength = guesses.index, guesses.strength
    top = np.zeros(index.size)
    for step in range(1, index.size):
        near = index[step:] - index[:-step] <= reach
        if not near.any():
            break
        top[:-step] = np.maximum(top[:-step], np.where(near, strength[step:], 0.0))
        top[step:] = np.maximum(top[step:], np.where(near, strength[:-step], 0.0))
    return top


def learnt_alone(
    grouped: Grouped, guesses: Spikes, span: tuple[int, int], start: Shape, settings: ImpactSettings
) -> Template:
    """The template, from clear impacts that stand alone; `start` itself where there are none."""
    k, first, strength = grouped.k, guesses.index, guesses.strength
    lone = strongest_neighbour(guesses, reach=(span[1] - span[0]) * k) == 0.0
    inside = (first + span[0] * k > 0) & (first + (span[1] + 1) * k < grouped.stream.n)
    usable = np.flatnonzero(lone & inside & (strength > settings.learn_above))
    order = usable[np.argsort(-strength[usable], kind="stable")]
    order = order[order.size // 50 :]  # the very strongest may be something else
    lags = np.arange(span[0], span[1] + 1)
    core = np.abs(lags) <= math.ceil(start.duration)
    whole: list[tuple[Piece, float]] = []  # with their noise
    damaged: list[tuple[Piece, float]] = []
    for i in order[: 4 * settings.learn_from]:
        begin = int(first[i] + span[0] * k)
        piece = grouped.piece(begin, begin + lags.size * k)
        stretch = min(first[i] // STRETCH, guesses.noise.size - 1)
        kind = whole if piece.good.all() else damaged
        if kind is whole or piece.good[core].mean() > _ENOUGH:
            kind.append((piece, float(guesses.noise[stretch] / np.sqrt(k))))
        if len(whole) == settings.learn_from:
            break
    chosen = whole if len(whole) >= FEW else (whole + damaged)[: settings.learn_from]
    highpass = grouped.stream.highpass
    if not chosen:
        return template_of(start, span, highpass=highpass, dt=grouped.dt)
    stack = np.array([piece.a for piece, _ in chosen])
    windows = Windows(
        stack, lags, np.zeros(len(stack)), stack[:, -span[0]],
        np.array([noise for _, noise in chosen]), np.array([piece.good for piece, _ in chosen]),
    )  # fmt: skip
    return learn_template(windows, start, highpass=highpass, dt=grouped.dt)


def learnt_among_neighbours(
    grouped: Grouped, guesses: Spikes, template: Template, settings: ImpactSettings
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
        piece, noise, start = _part(grouped, guesses, *_around(strongest, few, (begin, end)))
        probe = fit_contacts(piece, start, template, noise=noise, settings=settings)
        enough = few * _CROWD * settings.learn_from // max(1, probe.place.size)
        begin, end = _around(strongest, enough // grouped.k * grouped.k, (begin, end))
    piece, noise, start = _part(grouped, guesses, begin, end)
    best, least = template, math.inf
    for _ in range(_AGAIN):
        found = fit_contacts(piece, start, template, noise=noise, settings=settings)
        rest = less(piece.a, found.place, found.height, template)
        left = float((rest[piece.good] ** 2).sum())
        if left >= least:
            break
        best, least = template, left
        windows = _less_neighbours(piece, rest, found, template, noise, settings)
        if windows is None:
            break
        template = learn_template(
            windows, template.shape, highpass=grouped.stream.highpass, dt=grouped.dt
        )
    return best


def _around(centre: int, length: int, within: tuple[int, int]) -> tuple[int, int]:
    """Samples about one of them, no more than there are."""
    begin, end = within
    first = min(max(begin, centre - length // 2), max(begin, end - length))
    return first, min(end, first + length)


def _part(
    grouped: Grouped, guesses: Spikes, begin: int, end: int
) -> tuple[Piece, FloatArray, IntArray]:
    """A piece of the record, its noise, and where contacts are taken to be in it."""
    begin -= begin % grouped.k
    piece = grouped.piece(begin, end)
    here = guesses.index[(guesses.index >= begin) & (guesses.index < end)]
    start = np.unique(np.clip((here - begin) // grouped.k, 0, piece.a.size - 1))
    return piece, grouped.noise(piece), start


def _less_neighbours(
    piece: Piece, rest: FloatArray, found: Contacts, template: Template, noise: FloatArray,
    settings: ImpactSettings,
) -> Windows | None:  # fmt: skip
    """Windows of the strongest contacts, what the others left in them taken off."""
    lags = np.arange(template.first, template.last + 1)
    centre = np.rint(found.place).astype(np.int64)
    whole = (centre + lags[0] >= 0) & (centre + lags[-1] < piece.a.size)
    core = np.clip(centre[:, np.newaxis] + np.arange(*template.core), 0, piece.a.size - 1)
    whole &= piece.good[core].mean(axis=1) > _ENOUGH
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


def learn_template(
    windows: Windows, start: Shape, *, highpass: float | None, dt: float
) -> Template:
    """Fit the shape to the windows: a half sine, then free form, then ringing, by evidence."""
    span = (int(windows.lags[0]), int(windows.lags[-1]))

    def table(shape: Shape) -> Template:
        return template_of(shape, span, highpass=highpass, dt=dt)

    plain = _fit(windows, start, _PLAIN, table)
    if start.duration < _SHORT:
        # Within one sample every contact looks alike: from there no small step leads to a longer
        # one, which then would need two contacts, each within a sample, to be explained.
        others = [_fit(windows, replace(start, duration=d), _PLAIN, table) for d in _STARTS]
        plain = min([plain, *others], key=lambda fit: fit[0])
    best, names = plain, _PLAIN
    if windows.height.size >= _FEW:
        alone = _without_outliers(windows, plain, table)
        best = plain = _fit(alone, plain[1], _PLAIN, table)
        form = _fit(plain[2], plain[1], _FORM, table)
        if _better(form[0], plain[0]):
            best, names = form, _FORM
        ringing = _ringing(alone, start, best, table)
        if ringing is not None and _better(ringing[0], best[0]):
            best, names = ringing, _RINGING if ringing[1].power != 1.0 else _RESONANT
        # What the first guess took for outliers may have been the ringing it did not know.
        best = _fit(_without_outliers(windows, best, table), best[1], names, table)
    _, shape, fitted = best
    whole = (span[0], max(span[1], _ring_down_length(shape)))
    template = template_of(shape, whole, highpass=highpass, dt=dt, learnt_from=fitted.height.size)
    late = template.late + _beside(fitted, template)
    return replace(template, model_error=_model_error(fitted, template), late=late)


def _beside(windows: Windows, template: Template) -> float:
    """Samples by which what the shape lacks about the contact moves the centre of the momentum.

    No shape with a few parameters is that of every filter. What noise may have made counts for
    nothing, and a single impact may be anything.
    """
    if windows.height.size < _FEW:
        return 0.0
    near = windows.good & (np.abs(windows.lags) <= template.core[1] + _BESIDE)
    relative = (windows.noise / windows.height)[:, np.newaxis]
    lever = (windows.lags - windows.shift[:, np.newaxis]) * relative * near
    count = np.maximum(near.sum(axis=0), 1)
    moment = float(((lever * residual(windows, template)[0]).sum(axis=0) / count).sum())
    noise2 = float(((lever**2).sum(axis=0) / count**2).sum())
    return moment * max(0.0, 1.0 - _NOISY**2 * noise2 / max(moment**2, 1e-300)) / template.area


def _without_outliers(windows: Windows, fit: Fit, table: Callable[[Shape], Template]) -> Windows:
    """The windows, placed as in the fit, without samples that another contact has changed.

    What most windows have at the same lag, ringing for one, belongs to the template; what only a
    few have is another contact, wherever it lies in each.
    """
    placed = replace(fit[2], good=windows.good)
    rest = residual(placed, table(fit[1]))[0]
    rest = rest * (windows.noise / placed.height)[:, np.newaxis]
    off = np.abs(rest - np.median(rest, axis=0))
    usual = OF_MEDIAN * np.median(off, axis=0)
    wide = maximum_filter1d(off > _OUTLYING * usual, 3, axis=1, mode="nearest")
    own = np.abs(windows.lags) <= fit[1].duration + 1.0  # there nothing parts the two
    return replace(placed, good=windows.good & (own | ~wide))


def _ring_down_length(shape: Shape) -> int:
    """Samples after which the ringing has shrunk a thousandfold."""
    if not shape.ring:
        return 0
    return min(math.ceil(7.0 / (2.0 * math.pi * shape.ring * shape.ring_damping)), _LONGEST_RING)


def _better(new: float, old: float) -> bool:
    return new < old * (1.0 - _EVIDENCE) and old - new > _NOTICED


def _ringing(
    windows: Windows, start: Shape, plain: Fit, table: Callable[[Shape], Template]
) -> Fit | None:
    """The best shape with ringing; None where nothing rings.

    Contact and ringing imitate one another, so that many starts are tried, on a few impacts and
    without free form; the best goes on with all.
    """
    few = {name: of_each[:_SEARCHED] for name, of_each in vars(windows).items() if name != "lags"}
    starts = _ring_starts(plain, start, table(plain[1]))
    every = [_fit(replace(windows, **few), shape, _RESONANT, table) for shape in starts]
    tried = [found for found in every if _can_be_seen(found[1])]
    if not tried:
        return None
    _, shape, _ = min(tried, key=lambda found: found[0])
    ringing = _fit(windows, shape, _RESONANT, table)
    free = _fit(ringing[2], ringing[1], _RINGING, table)
    best = free if _better(free[0], ringing[0]) and _can_be_seen(free[1]) else ringing
    return best if _can_be_seen(best[1]) else None


def _can_be_seen(shape: Shape) -> bool:
    """Whether samples show a resonance: above half of their rate one that rings on for many."""
    return shape.ring <= 0.5 or 2.0 * math.pi * shape.ring * shape.ring_damping < _DIES


def _ring_starts(plain: Fit, start: Shape, template: Template) -> list[Shape]:
    """Shapes with ringing to try: as a filter, and at the strongest line of what is left after.

    A filter before the sampling is a damped resonance below half of the sample rate; no line shows
    it.
    """
    chi2, _, windows = plain
    filters = [
        Shape(duration=factor * start.duration, ring=ring, ring_damping=_FILTERS)
        for ring in (0.2, 0.4) for factor in (0.5, 1.0)
        if chi2 > _MISFITS * windows.good.sum()
    ]  # fmt: skip
    return [*filters, *_starts_at_line(plain, start, template)]


def _starts_at_line(plain: Fit, start: Shape, template: Template) -> list[Shape]:
    _, shape, windows = plain
    late = residual(windows, template)[0][:, windows.lags > 1.5 * shape.duration + 2.0]
    if late.shape[1] < 12:
        return []
    size = 4 * late.shape[1]
    power = (np.abs(np.fft.rfft(late * np.hanning(late.shape[1]), size)) ** 2).mean(axis=0)
    low = size // 25  # below lies what the highpass left
    peak = low + int(np.argmax(power[low:]))
    if power[peak] < (1.0 + _OVER / math.sqrt(len(late))) * float(np.median(power[low:])):
        return []
    frequency = peak / size
    return [
        Shape(duration=factor * start.duration, ring=ring)
        for ring in (frequency, 1.0 - frequency)  # it may be an alias
        for factor in (0.5, 0.75, 1.0, 1.5, 2.0)
    ]


def _fit(
    windows: Windows, start: Shape, names: Sequence[str], table: Callable[[Shape], Template]
) -> Fit:
    """Gauss-Newton with step halving over the named parameters; chi^2, shape, windows."""

    def placed(shape: Shape, windows: Windows, reach: int) -> tuple[Fit, tuple[FloatArray, ...]]:
        """The windows placed by a shape; misfit, template and slope."""
        template = table(shape)
        moved = place(windows, template, reach=max(reach, template.search) if reach else 0)
        parts = residual(moved, template)
        return (float((parts[0] ** 2).sum()), shape, moved), parts

    best, (rest, value, slope) = placed(start, windows, math.ceil(start.duration) + 2)
    for _ in range(_STEPS):
        chi2, shape, now = best
        columns = []
        for name in names:
            nudged = replace(shape, **{name: getattr(shape, name) + _NUDGE[name]})
            change = residual(now, table(nudged))[0] - rest
            columns.append(projected(-change / _NUDGE[name], value, slope))
        matrix = np.stack([column.ravel() for column in columns], axis=1)
        target = projected(rest, value, slope).ravel()
        step = np.asarray(np.linalg.lstsq(matrix, target, rcond=1e-8)[0], dtype=np.float64)
        for _ in range(5):
            best, parts = placed(_moved(shape, names, step), now, 0)
            if best[0] < chi2:
                break
            step = 0.4 * step
        else:
            return chi2, shape, now
        rest, value, slope = parts
        if chi2 - best[0] < 1e-3 * best[0]:
            break
    return best


def _moved(shape: Shape, names: Sequence[str], step: FloatArray) -> Shape:
    new = {}
    for name, change in zip(names, step, strict=True):
        low, high = _LIMITS[name]
        old = getattr(shape, name)
        most = 0.3 * old if name in ("duration", "ring") else max(0.5, 0.5 * abs(old))
        new[name] = float(np.clip(old + np.clip(change, -most, most), low, high))
    return replace(shape, **new)


def _model_error(windows: Windows, template: Template) -> FloatArray:
    """Spread of single impacts about the shape beyond the noise, relative to the height.

    After the windows, where the template still rings, it falls as the ringing does.
    """
    few = windows.height.size < _FEW
    around = neighbourhood(template.values, template.last - template.first + 1)
    rest = residual(windows, template)[0] * (windows.noise / np.abs(windows.height))[:, np.newaxis]
    expected = float(np.median((windows.noise / windows.height) ** 2))
    # Medians: another contact somewhere in some of the windows is no error of the template.
    spread = (OF_MEDIAN * np.median(np.abs(rest), axis=0)) ** 2
    excess = np.sqrt(np.maximum(spread - expected, 0.0))
    # an impact half a sample off shows its misfit one lag farther
    wide = maximum_filter1d(excess, 3, mode="nearest")
    later = np.maximum.accumulate(around[wide.size - 1 :][::-1])[::-1]
    wide = np.append(wide, wide[-1] * later[1:] / max(float(later[0]), 1e-300))
    return np.asarray(wide + (0.2 if few else 0.01) * around)
