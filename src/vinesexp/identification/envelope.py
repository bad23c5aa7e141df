"""The law of damping of a decay, from the amplitude and phase of every period.

Which of viscous, quadratic and Coulomb damping a decay shows, and whether its frequency depends on
amplitude, is decided by evidence (BIC). The likelihood then fits the record itself with that law.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError
from vinesexp.identification.damping_law import (
    FORMS,
    Decay,
    covariance_with,
    decay_of,
    fitted_decay,
    logs_and_phases,
    with_next_terms,
)
from vinesexp.identification.decrement import mean_amplitude
from vinesexp.identification.least_squares import Solution
from vinesexp.identification.persistence import counts, grown, lasting
from vinesexp.identification.phasors import Phasors
from vinesexp.identification.ringdown_result import RingDown, ring_down_by

FloatArray = NDArray[np.float64]

_LAW = 3e-4  # relative
_EVIDENCE = 10.0  # units of BIC that a richer form has to gain: strong evidence
_TURNED = 9e-4  # of the power: a law that leaves more may have lost the phase
_Misfit = Callable[[FloatArray], FloatArray]
#: Evidence, decay, free parameters.
_Tried = tuple[float, Decay, tuple[str, ...]]
#: Parameters that every form has.
_ALWAYS = ("log_A", "phase", "w")


def envelope(p: Phasors, start: Decay) -> RingDown:
    """Best form of damping for amplitude and phase of every period.

    Its values are a start for the likelihood and stand in for it where that fails.

    Parameters
    ----------
    p : Phasors
        Of the free decay (`phasors.decay_window`).
    start : Decay
        By the log decrement.

    Raises
    ------
    AnalysisError
        The amplitude grows.
    """
    n = 2 * p.t.size
    # Nothing below three ten-thousandths of the amplitude is worth a law of its own.
    coarse = np.hypot(p.error, _LAW * np.abs(p.z))
    # Which law is settled; its values come from the amplitudes as sure as they are.
    fine = np.full(p.t.size, max(p.error, 1e-9 * float(np.abs(p.z).max())))
    size = np.log(np.abs(p.z))
    turned = np.unwrap(np.angle(p.z)) + p.w * p.t  # followed from each period to the next

    def followed(rows: FloatArray) -> FloatArray:
        """Along and across every phasor: a phase that is turns away still leads back to it."""
        log_A, phase = logs_and_phases(rows, p.t, start=start.start)
        weight = np.abs(p.z) / coarse
        return np.concatenate([(log_A - size) * weight, (phase - turned) * weight], axis=1)

    def straight(error: FloatArray) -> _Misfit:
        def misfit(rows: FloatArray) -> FloatArray:
            log_A, phase = logs_and_phases(rows, p.t, start=start.start)
            difference = (np.exp(log_A + 1j * (phase - p.w * p.t)) - p.z) / error
            return np.concatenate([difference.real, difference.imag], axis=1)

        return misfit

    def tried(misfit: _Misfit, form: str, terms: tuple[str, ...]) -> _Tried | None:
        if n <= len(terms) + 3:
            return None
        free = (*_ALWAYS, *terms)
        vector, found = fitted_decay(
            _started(start, terms, p).vector(), free, misfit, span=float(p.t[-1] - p.t[0])
        )
        if min(vector[3:6]) < 0.0:  # a damping that gives energy
            return None
        # The noise inside the windows may miss what differs from window to window (steps of the
        # converter, drift): beyond its expectation chi^2 counts by its logarithm only.
        evidence = n * math.log(max(found.chi2 / n, 1.0)) + len(free) * math.log(n)
        return evidence, decay_of(vector, form, start.start), free

    def settled(misfit: _Misfit) -> tuple[Decay, tuple[str, ...], Solution]:
        _, decay, free = _selected(partial(tried, misfit), least=4 * math.log(n))
        vector, found = fitted_decay(
            decay.vector(), free, straight(fine), span=float(p.t[-1] - p.t[0])
        )
        return decay_of(vector, decay.form, start.start), free, found

    found = None
    with suppress(AnalysisError):
        decay, free, found = settled(straight(coarse))
    if found is None or found.chi2 * fine[0] ** 2 > _TURNED * float((np.abs(p.z) ** 2).sum()):
        # The phase may have turned away from every start: followed, it leads back.
        other = settled(followed)
        if found is None or other[2].chi2 < found.chi2:
            decay, free, found = other
    log_A, phase = (
        one[0] for one in logs_and_phases(decay.vector()[np.newaxis], p.t, start=start.start)
    )
    rest = p.z * np.exp(1j * (p.w * p.t - phase)) - np.exp(log_A)
    left = float(np.linalg.norm(rest))
    noise = left / math.sqrt(max(1, n - len(free)))
    by = lasting(rest, np.exp(log_A), noise, fitted=counts(free))
    free = with_next_terms(free, by[0] > 1.0, by[1] > 1.0)
    covariance = covariance_with(decay.vector(), free, straight(fine), span=float(np.ptp(p.t)))
    covariance = grown(covariance * max(1.0, (noise / float(fine[0])) ** 2), free, by)
    residual = left / float(np.linalg.norm(p.z))
    window = (float(p.t[0] - 0.5 * p.span), float(p.t[-1] + 0.5 * p.span))
    return ring_down_by("envelope", decay, free, covariance, mean_amplitude(p), residual, window)


def _selected(tried: Callable[[str, tuple[str, ...]], _Tried | None], *, least: float) -> _Tried:
    """The form with the best evidence: single terms, then more as long as each is worth it.

    `least` is the evidence of one term that leaves nothing: where viscous damping has it, there
    is nothing to be gained by another form.
    """
    best = tried("viscous", FORMS["viscous"])
    if best and best[0] <= least * (1.0 + 1e-12):
        return best
    best = None
    bent: tuple[str, ...] = ()  # a frequency that depends on amplitude shows whatever the damping
    for count in (1, 2, 3):
        richer: _Tried | None = None
        for form, terms in FORMS.items():
            known: set[str] = set(best[2]) - {"mu", "kappa"} if best else set()
            if len(terms) == count and known <= {*_ALWAYS, *terms}:
                candidate = tried(form, (*terms, *bent))
                if candidate and (richer is None or candidate[0] < richer[0]):
                    richer = candidate
        if richer and not bent:
            terms = tuple(name for name in richer[2] if name not in _ALWAYS)
            for springs in (("kappa",), ("mu",), ("mu", "kappa")):
                candidate = tried(richer[1].form, (*terms, *springs))
                worth = _EVIDENCE if len(springs) > len(bent) else 0.0
                if candidate and candidate[0] < richer[0] - worth:
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
