"""Windows of a record around single impacts, and where in them a template fits best."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.signals.impacts.template import Template

_PLACED = 4  # steps to an impact's time


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

    def keep(self, chosen: BoolArray) -> Windows:
        return Windows(
            self.samples[chosen], self.lags, self.shift[chosen], self.height[chosen],
            self.noise[chosen], self.good[chosen],
        )  # fmt: skip


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
