"""f0 and damping from free decays, by three rungs of rising cost.

Log decrement: a straight line through the logarithm of the amplitude. Envelope: amplitude and
phase of every period, the form of the damping chosen by evidence. Likelihood: the displacement
itself, slow drift as further linear unknowns.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError
from vinesexp.identification.decay import FORMS, NAMES, Decay, logs_and_phases, nudged
from vinesexp.identification.phasors import Phasors, decay_window, demodulate, standing_out
from vinesexp.signals.clipping import resolution_of
from vinesexp.signals.condition import fill_gaps
from vinesexp.signals.cycles import cycle_amplitudes
from vinesexp.signals.extension import block_means

__all__ = ["POINTS", "RingDown", "cycle_amplitudes", "fit_ringdown", "ring_down"]

FloatArray = NDArray[np.float64]

#: Block means a period: a sine loses 0.3 % of its information there.
POINTS = 24
_LOOK = 1 << 16  # samples that show the converter's step
_ITERATIONS = 12
_CONVERGED = 1e-4  # standard errors
_OUTLYING = 6.0  # standard deviations
_MOST_LOST = 0.05  # of the samples: more is no loss of the target, it is a bad start of the fit
_MOST_DRIFT = 24  # cosines
_LAW = 3e-4  # relative
_EVIDENCE = 10.0  # units of BIC that a richer form has to gain: strong evidence
#: Evidence, decay, free parameters, covariance.
_Tried = tuple[float, Decay, tuple[str, ...], FloatArray]


@dataclass(frozen=True)
class RingDown:
    """What one decay says.

    Attributes
    ----------
    method : str
        ``log decrement``, ``envelope`` or ``likelihood``.
    f0, f0_error : float
        Undamped natural frequency, Hz, at amplitude `reference`.
    zeta, zeta_error : float
        Equivalent viscous damping ratio at amplitude `reference`.
    reference : float
        m; where the record speaks loudest.
    decay : Decay
        All parameters; `covariance` is of those in `free`.
    residual : float
        rms of the misfit over the rms of the motion.
    window : (float, float)
        What was fitted, s from the first sample.
    """

    method: str
    f0: float
    f0_error: float
    zeta: float
    zeta_error: float
    reference: float
    decay: Decay
    free: tuple[str, ...]
    covariance: FloatArray
    residual: float
    window: tuple[float, float]

    @property
    def start(self) -> float:
        """Beginning of what was fitted, s from the first sample."""
        return self.window[0]

    @property
    def end(self) -> float:
        """End of what was fitted, s from the first sample."""
        return self.window[1]

    @property
    def amplitude(self) -> float:
        """Amplitude at `start`, m."""
        return float(self.amplitude_at(np.array([self.start]))[0])

    def amplitude_at(self, t: FloatArray) -> FloatArray:
        """Fitted amplitude at times t (s from the first sample), m."""
        row = self.decay.vector()[np.newaxis]
        later = np.maximum(t, self.decay.start)
        log_A = logs_and_phases(row, later, start=self.decay.start)[0][0]
        # Less than a window before its first centre, the decay is continued at its first rate.
        early = np.minimum(t - self.decay.start, 0.0)
        return np.asarray(np.exp(log_A - self.decay.rate(math.exp(self.decay.log_A)) * early))


def fit_ringdown(x: FloatArray, *, sample_rate: float, frequency: float) -> RingDown:
    """The likelihood rung on a record as it was sampled; arguments as of `ring_down`.

    Raises
    ------
    AnalysisError
        No free decay of three periods in the record.

    Examples
    --------
    >>> t = np.arange(20000) / 1000.0
    >>> w0, zeta = 2 * np.pi * 7.862, 0.0065
    >>> x = 0.02 * np.exp(-zeta * w0 * t) * np.cos(w0 * np.sqrt(1 - zeta**2) * t)
    >>> found = fit_ringdown(x, sample_rate=1000.0, frequency=7.8)
    >>> round(found.f0, 5), round(found.zeta, 7), round(found.amplitude, 4)
    (7.862, 0.0065, 0.02)
    """
    k = max(1, int(sample_rate / (POINTS * frequency)))
    coarse = block_means(fill_gaps(x), k) / np.sinc(frequency * k / sample_rate)
    return ring_down(
        coarse, k / sample_rate, frequency=frequency, resolution=resolution_of(x[:_LOOK])
    )[-1]


def ring_down(
    x: FloatArray, step: float, *, frequency: float, resolution: float = 0.0
) -> list[RingDown]:
    """All rungs on one record.

    Parameters
    ----------
    x : array (n,)
        Displacement, m; block means some 24 a period lose nothing.
    step : float
        s between them.
    frequency : float
        About that of the oscillation, Hz.
    resolution : float
        Step of the converter, m.

    Returns
    -------
    list of RingDown
        Log decrement, envelope, likelihood.

    Raises
    ------
    AnalysisError
        No free decay of three periods in the record.

    Examples
    --------
    >>> t = np.arange(4000) / 200.0
    >>> x = 1e-2 * np.exp(-0.3 * t) * np.cos(2 * np.pi * 7.9 * t + 0.3)
    >>> x += 1e-5 * np.random.default_rng(0).standard_normal(t.size)
    >>> best = ring_down(x, 1 / 200.0, frequency=7.8)[-1]
    >>> best.decay.form, abs(best.f0 - 7.9009) < 1e-3
    ('viscous', True)
    """
    phasors = _kept(demodulate(x, step, frequency), resolution)
    w, rate = (float(v) for v in _line(phasors)[:2])
    better = w / (2.0 * math.pi)
    if abs(better / frequency - 1.0) < 0.2:  # once more with the frequency and decay found
        phasors = _kept(demodulate(x, step, better, rate=rate), resolution)
    decrement = _log_decrement(phasors)
    envelope = _envelope(phasors, decrement.decay)
    likelihood = _likelihood(x, step, phasors, envelope)
    return [decrement, envelope, likelihood]


def _kept(p: Phasors, resolution: float) -> Phasors:
    begin, end = decay_window(p, resolution=resolution)
    return replace(p, t=p.t[begin:end], z=p.z[begin:end])


def _line(p: Phasors) -> FloatArray:
    """Frequency, decay rate, log amplitude and phase at the first window, by straight lines."""
    size = np.abs(p.z)
    weight = size / p.error if p.error > 0 else size / size.max()
    log_z = np.log(size) + 1j * np.unwrap(np.angle(p.z))
    basis = np.stack([np.ones(p.t.size), p.t - p.t[0]], axis=1)
    c = np.linalg.lstsq(basis * weight[:, np.newaxis], log_z * weight, rcond=None)[0]
    return np.array([p.w + c[1].imag, -c[1].real, c[0].real, c[0].imag])


def _log_decrement(p: Phasors) -> RingDown:
    w, alpha, log_A, phase = _line(p)
    t = p.t - p.t[0]
    fitted = np.exp(log_A - alpha * t + 1j * (phase + (w - p.w) * t))
    rest = p.z / fitted - 1.0
    weight = np.abs(p.z) ** 2
    freedom = max(1, p.t.size - 2)
    spread = float(np.sqrt((weight * rest.real**2).sum() / freedom))
    turned = float(np.sqrt((weight * rest.imag**2).sum() / freedom))
    mean = (weight * t).sum() / weight.sum()
    lever = math.sqrt(float((weight * (t - mean) ** 2).sum()))
    decay = Decay(log_A, phase + p.w * p.t[0], w, alpha=alpha, start=float(p.t[0]))
    covariance = np.diag([turned**2, spread**2]) / lever**2
    residual = float(np.sqrt((np.abs(p.z - fitted) ** 2).sum() / weight.sum()))
    window = (float(p.t[0] - 0.5 * p.span), float(p.t[-1] + 0.5 * p.span))
    return _result(
        "log decrement", decay, ("w", "alpha"), covariance, _mean_amplitude(p), residual, window
    )


def _mean_amplitude(p: Phasors) -> float:
    """The amplitude at which the record speaks loudest: mean of A weighted with A^2."""
    size = np.abs(p.z)
    return float((size**3).sum() / (size**2).sum())


def _result(
    method: str, decay: Decay, free: tuple[str, ...], covariance: FloatArray, amplitude: float,
    residual: float, window: tuple[float, float],
) -> RingDown:  # fmt: skip
    """f0 and zeta with errors: from the damped frequency and the decay rate, both at `amplitude`."""
    rate = decay.rate(amplitude)
    gradient = {"alpha": 1.0, "beta": amplitude, "gamma": 1.0 / amplitude}
    g_rate = np.array([gradient.get(name, 0.0) for name in free])
    w = decay.frequency(amplitude)
    bend = {"w": w / decay.w, "mu": decay.w * amplitude, "kappa": decay.w * amplitude**2}
    g_w = np.array([bend.get(name, 0.0) for name in free])
    # w_d^2 + rate^2 = w0^2, zeta = rate/w0
    w0 = math.hypot(w, rate)
    g_w0 = (w * g_w + rate * g_rate) / w0
    g_zeta = g_rate / w0 - rate / w0**2 * g_w0
    f0_error = math.sqrt(max(float(g_w0 @ covariance @ g_w0), 0.0)) / (2.0 * math.pi)
    zeta_error = math.sqrt(max(float(g_zeta @ covariance @ g_zeta), 0.0))
    return RingDown(
        method, w0 / (2.0 * math.pi), f0_error, rate / w0, zeta_error, amplitude, decay, free,
        covariance, residual, window,
    )  # fmt: skip


def _envelope(p: Phasors, start: Decay) -> RingDown:
    """Best form of damping for amplitude and phase of every period."""
    n = 2 * p.t.size
    # Nothing below three ten-thousandths of the amplitude is worth a law of its own.
    error = np.hypot(p.error, _LAW * np.abs(p.z))

    def misfit(rows: FloatArray) -> FloatArray:
        log_A, phase = logs_and_phases(rows, p.t, start=start.start)
        difference = (np.exp(log_A + 1j * (phase - p.w * p.t)) - p.z) / error
        return np.concatenate([difference.real, difference.imag], axis=1)

    def tried(form: str, terms: tuple[str, ...]) -> _Tried | None:
        if n <= len(terms) + 3:
            return None
        free = ("log_A", "phase", "w", *terms)
        vector, covariance, chi2 = _gauss_newton(
            _started(start, terms, p).vector(), free, misfit, span=float(p.t[-1] - p.t[0])
        )
        if min(vector[3:6]) < 0.0:  # a damping that gives energy
            return None
        # The noise inside the windows may miss what differs from window to window (steps of the
        # converter, drift): beyond its expectation chi^2 counts by its logarithm only.
        evidence = n * math.log(max(chi2 / n, 1.0)) + len(free) * math.log(n)
        scale = max(1.0, chi2 / max(1, n - len(free)))
        return evidence, _decay(vector, form, start.start), free, covariance * scale

    best = _selected(tried)
    _, decay, free, covariance = best
    rest = misfit(decay.vector()[np.newaxis])[0] * np.tile(error, 2)
    residual = float(np.sqrt((rest**2).sum() / (np.abs(p.z) ** 2).sum()))
    window = (float(p.t[0] - 0.5 * p.span), float(p.t[-1] + 0.5 * p.span))
    return _result("envelope", decay, free, covariance, _mean_amplitude(p), residual, window)


def _selected(tried: Callable[[str, tuple[str, ...]], _Tried | None]) -> _Tried:
    """The form with the best evidence: single terms, then more as long as each is worth it."""
    best: _Tried | None = None
    bent: tuple[str, ...] = ()  # a frequency that depends on amplitude shows whatever the damping
    for count in (1, 2, 3):
        richer: _Tried | None = None
        for form, terms in FORMS.items():
            known = set(best[2]) - {"mu", "kappa"} if best else set()
            if len(terms) == count and known <= {"log_A", "phase", "w", *terms}:
                candidate = tried(form, (*terms, *bent))
                if candidate and (richer is None or candidate[0] < richer[0]):
                    richer = candidate
        if richer and not bent:
            terms = tuple(name for name in richer[2] if name not in ("log_A", "phase", "w"))
            for springs in (("kappa",), ("mu",)):
                candidate = tried(richer[1].form, (*terms, *springs))
                if candidate and candidate[0] < richer[0] - (0.0 if bent else _EVIDENCE):
                    richer, bent = candidate, springs
        if richer is None or (best is not None and richer[0] > best[0] - _EVIDENCE):
            break
        best = richer
    if best is None:
        raise AnalysisError("the amplitude does not decay; a free decay is expected")
    return best


def _started(start: Decay, terms: tuple[str, ...], p: Phasors) -> Decay:
    """The straight-line decay shared out over the terms of a form."""
    A, rate = _mean_amplitude(p), max(start.alpha, 0.0) / len(terms)
    given = {"alpha": rate, "beta": rate / A, "gamma": rate * A}
    alpha, beta, gamma = (given[name] if name in terms else 0.0 for name in given)
    return replace(start, alpha=alpha, beta=beta, gamma=gamma)


def _decay(vector: FloatArray, form: str, start: float) -> Decay:
    return Decay(**dict(zip(NAMES, vector.tolist(), strict=True)), start=start, form=form)


def _gauss_newton(
    vector: FloatArray, free: tuple[str, ...], misfit: Callable[[FloatArray], FloatArray], *,
    span: float,
) -> tuple[FloatArray, FloatArray, float]:  # fmt: skip
    """Least squares over the named parameters; vector, covariance of unit noise, chi^2.

    `misfit` takes several parameter sets at once, so that a step costs one integration.
    """
    at = [NAMES.index(name) for name in free]
    damp = 0.0
    rows, changes = nudged(vector, free, span=span)
    values = misfit(rows)
    chi2 = float(values[0] @ values[0])
    for _ in range(_ITERATIONS):
        jacobian = (values[1:] - values[0]).T / changes
        scale = np.sqrt((jacobian**2).sum(axis=0)) + 1e-300
        scaled = jacobian / scale
        normal = scaled.T @ scaled
        step = np.linalg.solve(normal + (damp + 1e-12) * np.eye(len(free)), -scaled.T @ values[0])
        trial = vector.copy()
        trial[at] += step / scale
        new_rows, new_changes = nudged(trial, free, span=span)
        new_values = misfit(new_rows)
        new_chi2 = float(new_values[0] @ new_values[0])
        if new_chi2 <= chi2 * (1.0 + 1e-12):
            vector, rows, changes, values = trial, new_rows, new_changes, new_values
            gained, chi2, damp = chi2 - new_chi2, new_chi2, damp * 0.2
            if gained < 1e-6 * chi2 / max(1, values.shape[1]) or np.abs(step).max() < _CONVERGED:
                break
        else:
            damp = max(10.0 * damp, 1e-3)
            if damp > 1e6:
                break
    jacobian = (values[1:] - values[0]).T / changes
    scale = np.sqrt((jacobian**2).sum(axis=0)) + 1e-300
    normal = (jacobian / scale).T @ (jacobian / scale)
    covariance = np.linalg.pinv(normal, rcond=1e-13) / np.outer(scale, scale)
    return vector, covariance, chi2


def _likelihood(x: FloatArray, step: float, p: Phasors, envelope: RingDown) -> RingDown:
    """The form that the envelope chose, fitted to the displacement; drift is linear unknowns."""
    begin = max(0, math.ceil(envelope.window[0] / step))
    end = min(x.size, math.floor(envelope.window[1] / step) + 1)
    t, y = np.asarray(step * np.arange(begin, end), dtype=np.float64), x[begin:end]
    drift = _drift(t, envelope.f0)
    q = np.linalg.qr(drift)[0]
    start = replace(envelope.decay, start=float(t[0]))
    vector = start.vector()
    # The decay is started at the first sample instead of the first window's centre.
    back = float(t[0]) - envelope.decay.start
    A = math.exp(vector[0])
    vector[0] -= envelope.decay.rate(A) * back
    vector[1] += vector[2] * back
    noise = max(p.noise, 1e-9 * A)
    kept = _trusted(y, q, _decay(vector, start.form, start.start), t, noise, p.w * step)
    if not kept.all():
        q = np.linalg.qr(drift[kept])[0]
    times, projected = t[kept], y[kept] - q @ (q.T @ y[kept])

    def misfit(rows: FloatArray) -> FloatArray:
        log_A, phase = logs_and_phases(rows, times, start=float(t[0]))
        model = np.exp(log_A) * np.cos(phase)
        model -= (model @ q) @ q.T
        return (model - projected) / noise

    free = envelope.free
    vector, covariance, _ = _gauss_newton(vector, free, misfit, span=float(t[-1] - t[0]))
    decay = _decay(vector, envelope.decay.form, float(t[0]))
    rest = np.zeros(t.size)
    rest[kept] = misfit(vector[np.newaxis])[0] * noise
    covariance = covariance * (_noise_at(rest, step, envelope.f0) / noise) ** 2
    residual = float(np.sqrt((rest @ rest) / (projected @ projected)))
    return _result(
        "likelihood", decay, free, covariance, envelope.reference, residual, envelope.window
    )


def _trusted(
    y: FloatArray, q: FloatArray, decay: Decay, t: FloatArray, noise: float, turn: float
) -> NDArray[np.bool_]:
    """Samples that are not those of a sensor that lost its target for a moment.

    A spike stands out from its neighbours; a longer loss from the start's fit.
    """
    log_A, phase = logs_and_phases(decay.vector()[np.newaxis], t, start=decay.start)
    out = standing_out(y, turn)
    difference = np.where(out, 0.0, y - (np.exp(log_A) * np.cos(phase))[0])
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


def _noise_at(rest: FloatArray, step: float, f0: float) -> float:
    """Noise per sample as it acts near f0: the residual's spectrum there, not its total.

    Drift and hum far from f0 do not make f0 uncertain; noise near it does.
    """
    power = np.abs(np.fft.rfft(rest)) ** 2 / rest.size
    frequency = np.fft.rfftfreq(rest.size, step)
    near = (frequency > 0.5 * f0) & (frequency < 2.0 * f0)
    return math.sqrt(float(power[near].mean())) if near.sum() >= 10 else float(rest.std())
