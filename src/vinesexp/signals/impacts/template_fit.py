"""Learn the pulse of a record from its own clean impacts.

Every clean impact samples the same pulse at another sub-sample shift; a few dozen of them give
duration, form and ringing of the pulse far below the sample interval. Times and heights of the
impacts are nuisance parameters: they are projected out of every step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vinesexp.signals.impacts.template import Pulse, Shape, neighbourhood, pulse_of

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_STEPS = 8
_EVIDENCE = 0.02  # a further parameter has to lower the misfit by this share ...
_NOTICED = 30.0  # ... and by so much chi^2
_SEARCHED = 16  # impacts on which starts are tried
_LONGEST_RING = 4000  # samples
_SHORT, _SHORTER = 2.0, 0.4  # samples: where no boxcar tells the length, a second start
_PLACED = 4  # steps to an impact's time
_STRANGE = 5.0  # standard deviations of a sample from those of the other windows
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
    lags: NDArray[np.int64]
    shift: FloatArray
    height: FloatArray
    noise: FloatArray
    good: BoolArray

    def keep(self, chosen: NDArray[np.bool_]) -> Windows:
        return Windows(
            self.samples[chosen], self.lags, self.shift[chosen], self.height[chosen],
            self.noise[chosen], self.good[chosen],
        )  # fmt: skip


#: Misfit (chi^2), shape, windows with their times.
Fit = tuple[float, Shape, Windows]


def learn_pulse(
    windows: Windows, start: Shape, *, highpass: float | None, dt: float
) -> tuple[Pulse, Windows]:
    """Fit the shape to the windows: a half sine, then free form, then ringing, by evidence.

    Returns
    -------
    Pulse, Windows
        The pulse with its doubt, and the windows with refined times.
    """
    span = (int(windows.lags[0]), int(windows.lags[-1]))

    def table(shape: Shape) -> Pulse:
        return pulse_of(shape, span, highpass=highpass, dt=dt)

    plain = _fit(windows, start, _PLAIN, table)
    if start.duration < _SHORT:
        shorter = _fit(windows, replace(start, duration=_SHORTER), _PLAIN, table)
        plain = min(plain, shorter, key=lambda fit: fit[0])
    best, names = plain, _PLAIN
    if windows.height.size >= _FEW:
        alone = _without_strangers(windows, plain, table)
        best = plain = _fit(alone, plain[1], _PLAIN, table)
        form = _fit(plain[2], plain[1], _FORM, table)
        if _better(form[0], plain[0]):
            best, names = form, _FORM
        rung = _ringing(alone, start, best, table)
        if rung is not None and _better(rung[0], best[0]):
            best, names = rung, _RINGING if rung[1].power != 1.0 else _RESONANT
        # What the first guess took for strangers may have been the ringing it did not know.
        best = _fit(_without_strangers(windows, best, table), best[1], names, table)
    _, shape, fitted = best
    shapes = table(shape)
    doubt = _doubt(fitted, shapes, span)
    whole = (span[0], max(span[1], _rung_out(shape)))
    doubt = np.append(doubt, np.full(whole[1] - span[1], doubt[-1]))
    pulse = pulse_of(
        shape, whole, highpass=highpass, dt=dt, doubt=doubt, learnt_from=fitted.height.size
    )
    return pulse, fitted


def _without_strangers(windows: Windows, fit: Fit, table: Callable[[Shape], Pulse]) -> Windows:
    """The windows, placed as in the fit, without samples that another contact has changed.

    What most windows have at the same lag, ringing for one, belongs to the pulse; what only a few
    have is another contact, wherever it lies in each.
    """
    placed = replace(fit[2], good=windows.good)
    rest = _residual(placed, table(fit[1]))[0]
    rest = rest * (windows.noise / placed.height)[:, np.newaxis]
    off = np.abs(rest - np.median(rest, axis=0))
    usual = np.median(off, axis=0) / MEDIAN_OF_NORMAL
    strange: BoolArray = off > _STRANGE * usual
    wide = strange.copy()
    wide[:, 1:] |= strange[:, :-1]
    wide[:, :-1] |= strange[:, 1:]
    own = np.abs(windows.lags) <= fit[1].duration + 1.0  # there nothing parts the two
    return replace(placed, good=windows.good & (own | ~wide))


def _rung_out(shape: Shape) -> int:
    """Samples after which the ringing has shrunk a thousandfold."""
    if not shape.ring:
        return 0
    return min(math.ceil(7.0 / (2.0 * math.pi * shape.ring * shape.ring_damping)), _LONGEST_RING)


def _better(new: float, old: float) -> bool:
    return new < old * (1.0 - _EVIDENCE) and old - new > _NOTICED


def _ringing(
    windows: Windows, start: Shape, plain: Fit, table: Callable[[Shape], Pulse]
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
    rung = _fit(windows, shape, _RESONANT, table)
    free = _fit(rung[2], rung[1], _RINGING, table)
    return free if _better(free[0], rung[0]) else rung


def _ring_starts(plain: Fit, start: Shape, pulse: Pulse) -> list[Shape]:
    """Shapes with ringing to try: at the strongest line of what the pulse leaves after it."""
    _, shape, windows = plain
    late = _residual(windows, pulse)[0][:, windows.lags > 1.5 * shape.duration + 2.0]
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
    windows: Windows, start: Shape, names: Sequence[str], table: Callable[[Shape], Pulse]
) -> Fit:
    """Gauss-Newton with step halving over the named parameters; chi^2, shape, windows."""
    first = table(start)
    shape, now = (
        start,
        place(windows, first, reach=max(math.ceil(start.duration) + 2, first.search)),
    )
    rest, value, slope = _residual(now, table(shape))
    chi2 = float((rest**2).sum())
    for _ in range(_STEPS):
        columns = []
        for name in names:
            nudged = replace(shape, **{name: getattr(shape, name) + _NUDGE[name]})
            change = _residual(now, table(nudged))[0] - rest
            columns.append(_projected(-change / _NUDGE[name], value, slope))
        matrix = np.stack([column.ravel() for column in columns], axis=1)
        target = _projected(rest, value, slope).ravel()
        step = np.asarray(np.linalg.lstsq(matrix, target, rcond=1e-8)[0], dtype=np.float64)
        factor, improved = 1.0, False
        for _ in range(5):
            trial = _moved(shape, names, factor * step)
            pulse = table(trial)
            placed = place(now, pulse, reach=0)
            new_rest, new_value, new_slope = _residual(placed, pulse)
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


def place(windows: Windows, pulse: Pulse, *, reach: int) -> Windows:
    """Times and heights for a given pulse; `reach` > 0 looks for the best whole shift first."""
    shift, height = windows.shift, windows.height
    if reach:
        trials = np.arange(-reach, reach + 1, min(0.5, 1.0 / pulse.parts))
        shapes = pulse.at(windows.lags[np.newaxis, :] - trials[:, np.newaxis])[0]
        # By the samples that are known; a shape wholly outside them matches nothing.
        norm = np.sqrt(windows.good @ (shapes**2).T)
        match = (windows.samples * windows.good) @ shapes.T / np.where(norm > 0.0, norm, np.inf)
        shift = trials[np.argmax(np.abs(match), axis=1)]
        height = np.sign(match[np.arange(shift.size), np.argmax(np.abs(match), axis=1)])
    seen = windows.samples * windows.good
    best, explained = shift, np.full(shift.size, -1.0)
    for k in range(_PLACED + 1):
        value, slope = pulse.at(windows.lags - shift[:, np.newaxis])
        value, slope = value * windows.good, slope * windows.good
        vv, vs, ss = (value * value).sum(1), (value * slope).sum(1), (slope * slope).sum(1)
        v, s = (value * seen).sum(1), (slope * seen).sum(1)
        # Where the pulse is flat a step may lead away: only what explains more is kept.
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


def _residual(windows: Windows, pulse: Pulse) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Misfit in standard deviations, with pulse and slope scaled likewise."""
    value, slope = pulse.at(windows.lags - windows.shift[:, np.newaxis])
    value, slope = value * windows.good, slope * windows.good
    noise = windows.noise[:, np.newaxis]
    height = windows.height[:, np.newaxis] / noise
    samples = windows.samples * windows.good / noise
    return samples - value * height, value * height, slope * height


def _projected(x: FloatArray, value: FloatArray, slope: FloatArray) -> FloatArray:
    """x less what each impact's own height and time explain of it."""
    for direction in (value, slope - value * _ratio(slope, value)):
        x = x - direction * _ratio(x, direction)
    return x


def _ratio(x: FloatArray, y: FloatArray) -> FloatArray:
    norm = (y * y).sum(axis=1, keepdims=True)
    return np.asarray((x * y).sum(axis=1, keepdims=True) / np.maximum(norm, 1e-300))


def _doubt(windows: Windows, pulse: Pulse, span: tuple[int, int]) -> FloatArray:
    """Spread of single impacts about the shape beyond the noise, relative to the height."""
    size = span[1] - span[0] + 1
    few = windows.height.size < _FEW
    floor = (0.2 if few else 0.01) * neighbourhood(pulse.values, size)
    rest = _residual(windows, pulse)[0] * (windows.noise / np.abs(windows.height))[:, np.newaxis]
    expected = float(np.median((windows.noise / windows.height) ** 2))
    # Medians: another contact somewhere in some of the windows is no doubt about the shape.
    spread = (np.median(np.abs(rest), axis=0) / MEDIAN_OF_NORMAL) ** 2
    excess = np.sqrt(np.maximum(spread - expected, 0.0))
    wide = excess.copy()  # an impact half a sample off shows its misfit one lag farther
    wide[1:] = np.maximum(wide[1:], excess[:-1])
    wide[:-1] = np.maximum(wide[:-1], excess[1:])
    return np.asarray(wide + floor)
