"""Natural frequency and damping from a free decay: a ladder from counting to likelihood.

1. Log decrement: cycle amplitudes and zero crossings. Nearly free, for a first guess.
2. Likelihood: x = e^(-s t)(a cos wt + b sin wt) + slow drift, all at once. With white noise this
   is the maximum-likelihood estimate, and its covariance is the Cramer-Rao bound; noise of
   another colour is taken at its density around the natural frequency.
3. Law of damping: the envelope under viscous, viscous + quadratic, and viscous + Coulomb damping;
   the evidence (Bayesian information criterion) says which of them the decay shows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError
from vinesexp.identification.least_squares import gauss_newton

Floats = NDArray[np.float64]

_SAMPLES_PER_CYCLE = 40  # after averaging: the sinusoid loses 0.1 % of its amplitude, no phase
_FADED = 0.02  # of the largest amplitude: where the fit ends
_DRIFT_TERMS = 4  # polynomial of third degree
_FEWEST_CYCLES = 3


@dataclass(frozen=True)
class RingDown:
    """Free decay of one mode.

    Attributes
    ----------
    f0, zeta : undamped natural frequency, Hz; damping ratio.
    f0_error, zeta_error : standard errors.
    amplitude : at the start of the fit, m.
    start, end : of the fit, s from the first sample.
    residual : rms of what the fit leaves over rms of the decay.
    log_decrement : damping ratio by the first rung.
    """

    f0: float
    zeta: float
    f0_error: float
    zeta_error: float
    amplitude: float
    start: float
    end: float
    residual: float
    log_decrement: float


@dataclass(frozen=True)
class DampingLaw:
    """The envelope's law: dA/dt = -s A - q A^2 - k, with the terms that the evidence asks for.

    Attributes
    ----------
    name : ``viscous``, ``viscous + quadratic`` or ``viscous + Coulomb``.
    zeta : damping ratio of the viscous part.
    zeta_error : its standard error.
    extra : q (1/(m s)) or k (m/s); 0 for viscous.
    residual : rms misfit of the envelope over its rms, of this law.
    residual_exponential : the same of the exponential.
    evidence : difference of BIC in favour of this law over the exponential.
    """

    name: str
    zeta: float
    zeta_error: float
    extra: float
    residual: float
    residual_exponential: float
    evidence: float


def cycle_amplitudes(x: Floats, sample_rate: float, frequency: float) -> tuple[Floats, Floats]:
    """Middle time (s from the first sample) and half swing of each cycle.

    Examples
    --------
    >>> t = np.arange(1000) / 1000.0
    >>> _, a = cycle_amplitudes(np.sin(2 * np.pi * 10.0 * t), 1000.0, 10.0)
    >>> bool(np.all(np.abs(a - 1.0) < 1e-3)), len(a)
    (True, 10)
    """
    length = sample_rate / frequency
    edges = np.round(np.arange(0.0, len(x) + 1e-9, length)).astype(int)
    edges = edges[edges <= len(x)]
    if len(edges) < 2:
        return np.empty(0), np.empty(0)
    whole = x[: edges[-1]]
    high = np.maximum.reduceat(whole, edges[:-1])
    low = np.minimum.reduceat(whole, edges[:-1])
    return 0.5 * (edges[:-1] + edges[1:]) / sample_rate, 0.5 * (high - low)


def decay_window(x: Floats, sample_rate: float, frequency: float) -> tuple[int, int]:
    """Samples from the cycle of largest swing to where the swing has faded into the floor.

    The floor is the median swing of the last tenth of the record, where that is small.

    Raises
    ------
    AnalysisError
        Fewer than three cycles of decay.
    """
    time, swing = cycle_amplitudes(x, sample_rate, frequency)
    if swing.size < _FEWEST_CYCLES:
        raise AnalysisError(
            f"{swing.size} cycles at {frequency:.4g} Hz, expected {_FEWEST_CYCLES} or more"
        )
    peak = int(np.argmax(swing >= 0.97 * swing.max()))
    floor = float(np.median(swing[-max(swing.size // 10, 3) :]))
    level = _FADED * swing.max()
    if floor < 0.2 * swing.max():
        level = max(level, 2.0 * floor)
    faded = np.flatnonzero(swing[peak:] < level)
    last = peak + int(faded[0]) if faded.size else swing.size
    if last - peak < _FEWEST_CYCLES:
        raise AnalysisError(
            f"the decay lasts {last - peak} cycles, expected {_FEWEST_CYCLES} or more"
        )
    half = 0.5 / frequency
    begin = max(round((time[peak] - half) * sample_rate), 0)
    # A release within the cycle is not yet a free decay: begin at the first extreme after it.
    cycle = x[begin : begin + math.ceil(sample_rate / frequency)]
    if peak > 0:
        begin += int(np.argmax(np.abs(cycle - np.median(x))))
    return begin, min(round((time[last - 1] + half) * sample_rate), len(x))


def fit_ringdown(x: Floats, *, sample_rate: float, frequency: float) -> RingDown:
    """Identify f0 and zeta from the displacement of a free decay (unfiltered).

    Parameters
    ----------
    x : ndarray, shape (n,)
        Displacement in any unit; a constant and a slow drift do no harm.
    sample_rate : float
        Hz.
    frequency : float
        First guess of the natural frequency, Hz, to a few percent.

    Raises
    ------
    AnalysisError
        No decay of three cycles or more.

    Examples
    --------
    >>> t = np.arange(20000) / 1000.0
    >>> x = 0.02 * np.exp(-0.0065 * 2 * np.pi * 7.862 * t) * np.cos(2 * np.pi * 7.862 * t)
    >>> found = fit_ringdown(x, sample_rate=1000.0, frequency=7.8)
    >>> round(found.f0, 3), round(found.zeta, 5)
    (7.862, 0.0065)
    """
    begin, end = decay_window(x, sample_rate, frequency)
    k = max(int(sample_rate / (_SAMPLES_PER_CYCLE * frequency)), 1)
    y = _averages(x[begin:end], k)
    rate = sample_rate / k
    t = np.arange(y.size) / rate
    w = 2.0 * math.pi * _spectral_peak(y, rate, frequency)
    times, swing = cycle_amplitudes(y - y.mean(), rate, w / (2.0 * math.pi))
    slope = _decay_rate(times, swing)
    start = np.concatenate([[w, slope], _linear_part(t, y, w, slope)])
    found, covariance, residual = gauss_newton(lambda p: _decay_model(t, p), y, start)
    w, s = float(found[0]), float(found[1])
    variance = _noise_variance(residual, rate, w / (2.0 * math.pi))
    w0 = math.hypot(w, s)
    errors = variance * covariance[:2, :2]
    to_f0 = np.array([w, s]) / (2.0 * math.pi * w0)
    to_zeta = np.array([-s * w, w * w]) / w0**3
    return RingDown(
        f0=w0 / (2.0 * math.pi),
        zeta=s / w0,
        f0_error=float(np.sqrt(to_f0 @ errors @ to_f0)),
        zeta_error=float(np.sqrt(to_zeta @ errors @ to_zeta)),
        amplitude=float(np.hypot(found[2], found[3])),
        start=begin / sample_rate,
        end=end / sample_rate,
        residual=float(np.std(residual) / np.std(y)),
        log_decrement=slope / math.hypot(w, slope),
    )


def damping_law(x: Floats, *, sample_rate: float, ringdown: RingDown) -> DampingLaw:
    """Which law of damping the envelope shows, by evidence.

    The envelope comes from a sinusoid fitted to each cycle, so that noise averages out.

    Examples
    --------
    >>> t = np.arange(20000) / 1000.0
    >>> x = 0.02 / (1.0 + 0.5 * t) * np.cos(2 * np.pi * 7.862 * t)
    >>> x += np.random.default_rng(1).normal(0.0, 1e-5, t.size)
    >>> found = fit_ringdown(x, sample_rate=1000.0, frequency=7.8)
    >>> damping_law(x, sample_rate=1000.0, ringdown=found).name
    'viscous + quadratic'
    """
    w0 = 2.0 * math.pi * ringdown.f0
    segment = x[round(ringdown.start * sample_rate) : round(ringdown.end * sample_rate)]
    time, envelope = _envelope(segment, sample_rate, w0)
    if time.size < 6:
        raise AnalysisError("fewer than six cycles: the law of damping cannot be told")
    s, A0 = ringdown.zeta * w0, float(envelope[0])
    laws = {
        "viscous": np.array([A0, s]),
        "viscous + quadratic": np.array([A0, 0.7 * s, 0.6 * s / A0]),
        "viscous + Coulomb": np.array([A0, 0.7 * s, 0.1 * s * A0]),
    }
    fits = {}
    for name, start in laws.items():
        try:
            fits[name] = _fit_law(name, time, envelope, start)
        except AnalysisError:
            continue
    if "viscous" not in fits:
        raise AnalysisError("the envelope is no decay")
    chosen = min(fits, key=lambda name: fits[name][3])
    found, covariance, misfit, bic = fits[chosen]
    scale = float(np.sqrt(np.mean(envelope**2)))
    variance = misfit**2 * time.size / max(time.size - found.size, 1)
    return DampingLaw(
        name=chosen,
        zeta=float(found[1]) / w0,
        zeta_error=float(np.sqrt(variance * covariance[1, 1])) / w0,
        extra=float(found[2]) if found.size > 2 else 0.0,
        residual=misfit / scale,
        residual_exponential=fits["viscous"][2] / scale,
        evidence=fits["viscous"][3] - bic,
    )


def _fit_law(
    name: str, time: Floats, envelope: Floats, start: Floats
) -> tuple[Floats, Floats, float, float]:
    found, covariance, residual = gauss_newton(
        lambda p: _law_with_jacobian(name, time, p), envelope, start
    )
    if found.size > 2 and found[2] < 0.0:
        raise AnalysisError("a law that feeds energy in")
    misfit = float(np.sqrt(np.mean(residual**2)))
    bic = time.size * math.log(max(misfit, 1e-300) ** 2) + found.size * math.log(time.size)
    return found, covariance, misfit, bic


def _law_with_jacobian(name: str, t: Floats, p: Floats) -> tuple[Floats, Floats]:
    value = _law(name, t, p)
    steps = 1e-6 * np.maximum(np.abs(p), 1e-9)
    columns = []
    for i, h in enumerate(steps):
        shift = np.zeros_like(p)
        shift[i] = h
        columns.append((_law(name, t, p + shift) - _law(name, t, p - shift)) / (2.0 * h))
    return value, np.stack(columns, axis=1)


def _law(name: str, t: Floats, p: Floats) -> Floats:
    """Envelope under a law, from A0 at t = 0; smooth through s = 0."""
    A0, s = p[0], p[1]
    lived = _lived_time(s, t)  # (1 - e^(-s t))/s
    if name == "viscous":
        return np.asarray(A0 * np.exp(-s * t))
    if name == "viscous + quadratic":
        return np.asarray(A0 * np.exp(-s * t) / np.maximum(1.0 + p[2] * A0 * lived, 1e-9))
    return np.asarray(np.maximum(A0 * np.exp(-s * t) - p[2] * lived, 0.0))


def _lived_time(s: float, t: Floats) -> Floats:
    if abs(s) * float(t[-1]) < 1e-8:
        return t
    return np.asarray(-np.expm1(-s * t) / s)


def _envelope(x: Floats, sample_rate: float, w0: float) -> tuple[Floats, Floats]:
    """Time and amplitude of the sinusoid fitted to each cycle (with a straight line under it)."""
    n = round(2.0 * math.pi / w0 * sample_rate)
    cycles = len(x) // n
    local = np.arange(n) / sample_rate
    basis = np.stack([np.cos(w0 * local), np.sin(w0 * local), np.ones(n), local], axis=1)
    parts = np.linalg.lstsq(basis, x[: cycles * n].reshape(cycles, n).T, rcond=None)[0]
    return (np.arange(cycles) + 0.5) * n / sample_rate, np.hypot(parts[0], parts[1])


def _averages(x: Floats, k: int) -> Floats:
    return np.asarray(x[: len(x) // k * k].reshape(-1, k).mean(axis=1))


def _spectral_peak(y: Floats, rate: float, frequency: float) -> float:
    """The strongest line within a fifth of `frequency`, Hz, from a zero-padded spectrum."""
    n = 8 * y.size
    window = np.hanning(y.size)
    spectrum = np.abs(np.fft.rfft((y - y.mean()) * window, n))
    grid = np.arange(spectrum.size) * rate / n
    near = np.flatnonzero(np.abs(grid - frequency) < 0.2 * frequency)
    return float(grid[near[np.argmax(spectrum[near])]]) if near.size else frequency


def _decay_rate(time: Floats, swing: Floats) -> float:
    """Slope of the logarithm of the swing, weighted by the swing squared; 1/s, above zero."""
    good = swing > 0.0
    t, log, weight = time[good], np.log(swing[good]), swing[good] ** 2
    centre = np.average(t, weights=weight)
    slope = np.sum(weight * (t - centre) * log) / np.sum(weight * (t - centre) ** 2)
    return max(-float(slope), 1e-6 / float(time[-1] - time[0] + 1e-12))


def _decay_basis(t: Floats, w: float, s: float) -> Floats:
    fade = np.exp(-s * t)
    u = 2.0 * t / t[-1] - 1.0
    drift = np.polynomial.legendre.legvander(u, _DRIFT_TERMS - 1)
    return np.column_stack([fade * np.cos(w * t), fade * np.sin(w * t), drift])


def _linear_part(t: Floats, y: Floats, w: float, s: float) -> Floats:
    return np.asarray(np.linalg.lstsq(_decay_basis(t, w, s), y, rcond=None)[0])


def _decay_model(t: Floats, p: Floats) -> tuple[Floats, Floats]:
    basis = _decay_basis(t, p[0], p[1])
    a, b = p[2], p[3]
    by_w = t * (b * basis[:, 0] - a * basis[:, 1])
    by_s = -t * (a * basis[:, 0] + b * basis[:, 1])
    return basis @ p[2:], np.column_stack([by_w, by_s, basis])


def _noise_variance(residual: Floats, rate: float, frequency: float) -> float:
    """Variance of the white noise that would be as dense around `frequency` as this residual.

    Never less than the residual's own where that is white: the larger of the two is taken, since
    a mode that is not quite linear leaves its misfit on its own frequency.
    """
    n = residual.size
    power = np.abs(np.fft.rfft(residual)) ** 2 / n
    grid = np.arange(power.size) * rate / n
    near = (grid > 0.7 * frequency) & (grid < 1.3 * frequency)
    around = float(np.mean(power[near])) if np.any(near) else 0.0
    return max(around, float(np.var(residual)))
