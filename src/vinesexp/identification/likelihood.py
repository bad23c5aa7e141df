"""The best method on a decay: the displacement itself, its slow drift as linear unknowns.

What the fit leaves is looked at: its noise near f0 scales the errors, a line in it is a second
oscillation, which is then taken out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from vinesexp.identification.damping_law import (
    Decay,
    covariance_with,
    decay_of,
    fitted_decay,
    logs_and_phases,
    with_next_terms,
)
from vinesexp.identification.persistence import counts, grown, lasting
from vinesexp.identification.phasors import Phasors, standing_out
from vinesexp.identification.ringdown_result import RingDown, ring_down_by

FloatArray = NDArray[np.float64]

_OUTLYING = 6.0  # standard deviations
_MOST_LOST = 0.05  # of the samples: more is no loss of the target, it is a bad start of the fit
_MOST_DRIFT = 24  # cosines
_OWN_LINES = 6.0  # line widths or Fourier lines from f0 that are the decay's own
_FEWEST_LINES = 20
_BEAT = 5e-3  # of the amplitude: weaker lines are not reported
_SIDE_LINES = 4  # half Fourier lines on each side that a second oscillation may take
_STRONG = 8.0  # times the median of the lines around


def likelihood(x: FloatArray, step: float, p: Phasors, envelope: RingDown) -> RingDown:
    """The form that the envelope chose, fitted to the displacement; drift is linear unknowns.

    So is a second oscillation, where what is left shows one: then the fit is done once more.
    """
    begin = max(0, math.ceil(envelope.window[0] / step))
    end = min(x.size, math.floor(envelope.window[1] / step) + 1)
    t, y = np.asarray(step * np.arange(begin, end), dtype=np.float64), x[begin:end]
    start = replace(envelope.decay, start=float(t[0]))
    vector = start.vector()
    # The decay is started at the first sample instead of the first window's centre.
    back = float(t[0]) - envelope.decay.start
    A = math.exp(vector[0])
    vector[0] -= envelope.decay.rate(A) * back
    vector[1] += vector[2] * back
    noise, slow = max(p.noise, 1e-9 * A), _drift(t, envelope.f0)
    kept = _trusted(y, slow, decay_of(vector, start.form, start.start), t, noise, p.w * step)
    fit = _fitted(vector, envelope.free, t, y, slow, kept, noise)
    beat = _beat(fit.rest, y - fit.rest, step, envelope.f0, envelope.zeta)
    if beat is not None:
        rate = envelope.decay.rate(envelope.reference)
        both = np.concatenate([slow, _narrow(t, beat[0], rate)], axis=1)
        fit = _fitted(fit.vector, envelope.free, t, y, both, kept, noise)
    sigma = _noise_at(fit.rest, step, envelope.f0)
    decay = decay_of(fit.vector, start.form, start.start)
    by = _lasting(fit.rest, t, decay, sigma, round(p.span / step), counts(envelope.free))
    free = with_next_terms(envelope.free, by[0] > 1.0, by[1] > 1.0)
    covariance = fit.covariance if free == envelope.free else fit.covariance_with(free)
    covariance = grown(covariance * (sigma / noise) ** 2, free, by)
    found = ring_down_by(
        "likelihood", decay, free, covariance, envelope.reference, fit.left, envelope.window
    )
    return replace(found, beat=beat)


def _lasting(
    rest: FloatArray, t: FloatArray, decay: Decay, sigma: float, size: int, fitted: tuple[int, int]
) -> tuple[float, float]:
    """`lasting` of what is left of the samples, in windows of one period."""
    log_A, phase = (
        one[0] for one in logs_and_phases(decay.vector()[np.newaxis], t, start=decay.start)
    )
    count = t.size // size
    along = (2.0 * rest * np.exp(-1j * phase))[: count * size].reshape(count, size).mean(axis=1)
    A = np.exp(log_A)[: count * size].reshape(count, size).mean(axis=1)
    return lasting(along, A, sigma * math.sqrt(2.0 / size), fitted=fitted)


@dataclass(frozen=True)
class _Fit:
    """Parameters, covariance for the assumed noise, residual (0 where not kept), its share."""

    vector: FloatArray
    covariance: FloatArray
    covariance_with: Callable[[tuple[str, ...]], FloatArray]
    rest: FloatArray
    left: float


def _fitted(
    vector: FloatArray, free: tuple[str, ...], t: FloatArray, y: FloatArray, linear: FloatArray,
    kept: NDArray[np.bool_], noise: float,
) -> _Fit:  # fmt: skip
    """Least squares with the columns of `linear` as further unknowns, projected out."""
    q = np.linalg.qr(linear[kept])[0]
    times, projected = t[kept], y[kept] - q @ (q.T @ y[kept])

    def misfit(rows: FloatArray) -> FloatArray:
        log_A, phase = logs_and_phases(rows, times, start=float(t[0]))
        model = np.exp(log_A) * np.cos(phase)
        model -= (model @ q) @ q.T
        return (model - projected) / noise

    span = float(t[-1] - t[0])
    vector, found = fitted_decay(vector, free, misfit, span=span)
    rest = np.zeros(t.size)
    rest[kept] = misfit(vector[np.newaxis])[0] * noise
    left = float(np.sqrt((rest @ rest) / (projected @ projected)))
    more = partial(covariance_with, vector, misfit=misfit, span=span)
    return _Fit(vector, found.covariance, more, rest, left)


def _narrow(t: FloatArray, frequency: float, rate: float) -> FloatArray:
    """Columns that hold any oscillation near a frequency that decays much as the first does."""
    span = float(t[-1] - t[0])
    fall = np.exp(-rate * (t - t[0]))
    columns = []
    for k in range(-_SIDE_LINES, _SIDE_LINES + 1):
        phase = 2.0 * math.pi * (frequency + 0.5 * k / span) * (t - t[0])
        columns += [fall * np.cos(phase), fall * np.sin(phase)]
    return np.stack(columns, axis=1)


def _trusted(
    y: FloatArray, slow: FloatArray, decay: Decay, t: FloatArray, noise: float, turn: float
) -> NDArray[np.bool_]:
    """Samples that are not those of a sensor that lost its target for a moment.

    A spike stands out from its neighbours; a longer loss from the start's fit.
    """
    log_A, phase = logs_and_phases(decay.vector()[np.newaxis], t, start=decay.start)
    out = standing_out(y, turn)
    difference = np.where(out, 0.0, y - (np.exp(log_A) * np.cos(phase))[0])
    q = np.linalg.qr(slow)[0]
    rest = np.abs(difference - q @ (q.T @ difference))
    lost = rest > _OUTLYING * max(noise, float(np.median(rest)) / 0.6745)
    return ~(out | lost) if lost.mean() < _MOST_LOST else ~out


def _drift(t: FloatArray, f0: float) -> FloatArray:
    """Constant, slope and slow cosines, all well below f0."""
    span = float(t[-1] - t[0])
    count = min(_MOST_DRIFT, int(2.0 * span * f0 / 8.0))
    phase = (t - t[0]) / span
    columns = [np.ones_like(t), phase, *(np.cos(np.pi * k * phase) for k in range(1, count + 1))]
    return np.stack(columns, axis=1)


def _beat(
    rest: FloatArray, motion: FloatArray, step: float, f0: float, zeta: float
) -> tuple[float, float] | None:
    """Frequency and relative amplitude of a line in the residual that is not the decay's own.

    What a law of damping leaves lies within a few line widths of f0 and is no second oscillation.
    """
    taper = np.hanning(2 * rest.size)[rest.size :]  # a decay is strong at its start
    power = np.abs(np.fft.rfft(rest * taper))
    frequency = np.fft.rfftfreq(rest.size, step)
    own = max(_OWN_LINES / (rest.size * step), _OWN_LINES * zeta * f0)
    near = (frequency > 0.5 * f0) & (frequency < 2.0 * f0) & (np.abs(frequency - f0) > own)
    if near.sum() < _FEWEST_LINES:
        return None
    peak = int(np.flatnonzero(near)[np.argmax(power[near])])
    share = float(power[peak] / np.abs(np.fft.rfft(motion * taper)).max())
    if share < _BEAT or power[peak] < _STRONG * np.median(power[near]):
        return None
    return float(frequency[peak]), share


def _noise_at(rest: FloatArray, step: float, f0: float) -> float:
    """Noise per sample as it acts near f0: the residual's spectrum there, not its total.

    Drift and hum far from f0 do not make f0 uncertain; noise near it does.
    """
    power = np.abs(np.fft.rfft(rest)) ** 2 / rest.size
    frequency = np.fft.rfftfreq(rest.size, step)
    near = (frequency > 0.5 * f0) & (frequency < 2.0 * f0)
    return math.sqrt(float(power[near].mean())) if near.sum() >= 10 else float(rest.std())
