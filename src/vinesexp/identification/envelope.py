"""Two rungs on the amplitude and phase of every period: log decrement, and the law of damping.

Which of viscous, quadratic and Coulomb damping a decay shows is decided by evidence (BIC).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError
from vinesexp.identification.damping_law import FORMS, Decay, decay_of, logs_and_phases
from vinesexp.identification.least_squares import gauss_newton
from vinesexp.identification.phasors import Phasors
from vinesexp.identification.ringdown_result import RingDown, rung

FloatArray = NDArray[np.float64]

_LAW = 3e-4  # relative
_EVIDENCE = 10.0  # units of BIC that a richer form has to gain: strong evidence
#: Evidence, decay, free parameters, covariance.
_Tried = tuple[float, Decay, tuple[str, ...], FloatArray]


def straight_line(p: Phasors) -> FloatArray:
    """Frequency, decay rate, log amplitude and phase at the first window, by straight lines."""
    size = np.abs(p.z)
    weight = size / p.error if p.error > 0 else size / size.max()
    log_z = np.log(size) + 1j * np.unwrap(np.angle(p.z))
    basis = np.stack([np.ones(p.t.size), p.t - p.t[0]], axis=1)
    c = np.linalg.lstsq(basis * weight[:, np.newaxis], log_z * weight, rcond=None)[0]
    return np.array([p.w + c[1].imag, -c[1].real, c[0].real, c[0].imag])


def log_decrement(p: Phasors) -> RingDown:
    w, alpha, log_A, phase = straight_line(p)
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
    return rung(
        "log decrement", decay, ("w", "alpha"), covariance, mean_amplitude(p), residual, window
    )


def mean_amplitude(p: Phasors) -> float:
    """The amplitude at which the record speaks loudest: mean of A weighted with A^2."""
    size = np.abs(p.z)
    return float((size**3).sum() / (size**2).sum())


def envelope(p: Phasors, start: Decay) -> RingDown:
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
        vector, covariance, chi2 = gauss_newton(
            _started(start, terms, p).vector(), free, misfit, span=float(p.t[-1] - p.t[0])
        )
        if min(vector[3:6]) < 0.0:  # a damping that gives energy
            return None
        # The noise inside the windows may miss what differs from window to window (steps of the
        # converter, drift): beyond its expectation chi^2 counts by its logarithm only.
        evidence = n * math.log(max(chi2 / n, 1.0)) + len(free) * math.log(n)
        return evidence, decay_of(vector, form, start.start), free, covariance

    _, decay, free, _ = _selected(tried)
    # Which law is settled; its values come from the amplitudes as sure as they are.
    error = np.full(p.t.size, max(p.error, 1e-9 * float(np.abs(p.z).max())))
    vector, covariance, chi2 = gauss_newton(
        decay.vector(), free, misfit, span=float(p.t[-1] - p.t[0])
    )
    decay = decay_of(vector, decay.form, start.start)
    covariance = covariance * max(1.0, chi2 / max(1, n - len(free)))
    rest = misfit(decay.vector()[np.newaxis])[0] * np.tile(error, 2)
    residual = float(np.sqrt((rest**2).sum() / (np.abs(p.z) ** 2).sum()))
    window = (float(p.t[0] - 0.5 * p.span), float(p.t[-1] + 0.5 * p.span))
    return rung("envelope", decay, free, covariance, mean_amplitude(p), residual, window)


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
    A, rate = mean_amplitude(p), max(start.alpha, 0.0) / len(terms)
    given = {"alpha": rate, "beta": rate / A, "gamma": rate * A}
    alpha, beta, gamma = (given[name] if name in terms else 0.0 for name in given)
    return replace(start, alpha=alpha, beta=beta, gamma=gamma)
