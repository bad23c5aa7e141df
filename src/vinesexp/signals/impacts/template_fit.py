"""Learn the template of a record from its own clean impacts.

Every clean impact samples the same template at another sub-sample shift; a few dozen of them give
duration, form and ringing of the template far below the sample interval. Times and heights of the
impacts are nuisance parameters: they are projected out of every step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.signals.impacts.template import Shape, Template, neighbourhood, template_of
from vinesexp.signals.impacts.template_windows import Windows, place, projected, residual

_STEPS = 8
_EVIDENCE = 0.02  # a further parameter has to lower the misfit by this share ...
_NOTICED = 30.0  # ... and by so much chi^2
_SEARCHED = 16  # impacts on which starts are tried
_LONGEST_RING = 4000  # samples
_SHORT = 2.0  # samples: where no boxcar shows the length, there are other starts
_STARTS = (0.4, 2.0, 3.0)
_OUTLYING = 5.0  # standard deviations of a sample from those of the other windows
_OVER = 8.0  # standard deviations of a spectrum averaged over the impacts: something rings
MEDIAN_OF_NORMAL = 0.6745  # of the absolute value, in standard deviations
_FEW = 5  # impacts: with fewer only the duration is fitted
_PLAIN: Sequence[str] = ("duration",)
_FORM: Sequence[str] = ("duration", "power", "skew")
_RESONANT: Sequence[str] = ("duration", "ring", "ring_damping")
_RINGING: Sequence[str] = ("duration", "power", "skew", "ring", "ring_damping")
_LIMITS = {
    "duration": (0.3, 1e6),
    "power": (0.5, 4.0),
    "skew": (-1.5, 1.5),
    "ring": (1e-4, 1.5),
    "ring_damping": (1e-3, 0.6),
}
_NUDGE = {"duration": 1e-2, "power": 1e-2, "skew": 1e-2, "ring": 1e-4, "ring_damping": 1e-3}


#: Misfit (chi^2), shape, windows with their times.
Fit = tuple[float, Shape, Windows]


def learn_template(
    windows: Windows, start: Shape, *, highpass: float | None, dt: float
) -> tuple[Template, Windows]:
    """Fit the shape to the windows: a half sine, then free form, then ringing, by evidence.

    Returns
    -------
    Template, Windows
        The template with its error, and the windows with refined times.
    """
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
    shapes = table(shape)
    model_error = _model_error(fitted, shapes, span)
    whole = (span[0], max(span[1], _ring_down_length(shape)))
    model_error = np.append(model_error, np.full(whole[1] - span[1], model_error[-1]))
    template = template_of(
        shape,
        whole,
        highpass=highpass,
        dt=dt,
        model_error=model_error,
        learnt_from=fitted.height.size,
    )
    return template, fitted


def _without_outliers(windows: Windows, fit: Fit, table: Callable[[Shape], Template]) -> Windows:
    """The windows, placed as in the fit, without samples that another contact has changed.

    What most windows have at the same lag, ringing for one, belongs to the template; what only a
    few have is another contact, wherever it lies in each.
    """
    placed = replace(fit[2], good=windows.good)
    rest = residual(placed, table(fit[1]))[0]
    rest = rest * (windows.noise / placed.height)[:, np.newaxis]
    off = np.abs(rest - np.median(rest, axis=0))
    usual = np.median(off, axis=0) / MEDIAN_OF_NORMAL
    outlying: BoolArray = off > _OUTLYING * usual
    wide = outlying.copy()
    wide[:, 1:] |= outlying[:, :-1]
    wide[:, :-1] |= outlying[:, 1:]
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
    few = windows.keep(np.arange(windows.height.size) < _SEARCHED)
    starts = _ring_starts(plain, start, table(plain[1]))
    tried = [_fit(few, shape, _RESONANT, table) for shape in starts]
    if not tried:
        return None
    _, shape, _ = min(tried, key=lambda found: found[0])
    ringing = _fit(windows, shape, _RESONANT, table)
    free = _fit(ringing[2], ringing[1], _RINGING, table)
    return free if _better(free[0], ringing[0]) else ringing


def _ring_starts(plain: Fit, start: Shape, template: Template) -> list[Shape]:
    """Shapes with ringing to try: at the strongest line of what the template leaves after it."""
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
    first = table(start)
    shape, now = (
        start,
        place(windows, first, reach=max(math.ceil(start.duration) + 2, first.search)),
    )
    rest, value, slope = residual(now, table(shape))
    chi2 = float((rest**2).sum())
    for _ in range(_STEPS):
        columns = []
        for name in names:
            nudged = replace(shape, **{name: getattr(shape, name) + _NUDGE[name]})
            change = residual(now, table(nudged))[0] - rest
            columns.append(projected(-change / _NUDGE[name], value, slope))
        matrix = np.stack([column.ravel() for column in columns], axis=1)
        target = projected(rest, value, slope).ravel()
        step = np.asarray(np.linalg.lstsq(matrix, target, rcond=1e-8)[0], dtype=np.float64)
        factor, improved = 1.0, False
        for _ in range(5):
            trial = _moved(shape, names, factor * step)
            template = table(trial)
            placed = place(now, template, reach=0)
            new_rest, new_value, new_slope = residual(placed, template)
            new_chi2 = float((new_rest**2).sum())
            if new_chi2 < chi2:
                improved = True
                break
            factor *= 0.4
        if not improved:
            break
        gained = chi2 - new_chi2
        shape, now, rest, value, slope, chi2 = (
            trial,
            placed,
            new_rest,
            new_value,
            new_slope,
            new_chi2,
        )
        if gained < 1e-3 * chi2:
            break
    return chi2, shape, now


def _moved(shape: Shape, names: Sequence[str], step: FloatArray) -> Shape:
    new = {}
    for name, change in zip(names, step, strict=True):
        low, high = _LIMITS[name]
        old = getattr(shape, name)
        most = 0.3 * old if name in ("duration", "ring") else max(0.5, 0.5 * abs(old))
        new[name] = float(np.clip(old + np.clip(change, -most, most), low, high))
    return replace(shape, **new)


def _model_error(windows: Windows, template: Template, span: tuple[int, int]) -> FloatArray:
    """Spread of single impacts about the shape beyond the noise, relative to the height."""
    size = span[1] - span[0] + 1
    few = windows.height.size < _FEW
    floor = (0.2 if few else 0.01) * neighbourhood(template.values, size)
    rest = residual(windows, template)[0] * (windows.noise / np.abs(windows.height))[:, np.newaxis]
    expected = float(np.median((windows.noise / windows.height) ** 2))
    # Medians: another contact somewhere in some of the windows is no error of the template.
    spread = (np.median(np.abs(rest), axis=0) / MEDIAN_OF_NORMAL) ** 2
    excess = np.sqrt(np.maximum(spread - expected, 0.0))
    wide = excess.copy()  # an impact half a sample off shows its misfit one lag farther
    wide[1:] = np.maximum(wide[1:], excess[:-1])
    wide[:-1] = np.maximum(wide[:-1], excess[1:])
    return np.asarray(wide + floor)
