"""f0 and damping from free decays, by two methods of rising cost.

Log decrement: a straight line through the logarithm of the amplitude. Likelihood: the displacement
itself, slow drift as further linear unknowns, with the law of damping that amplitude and phase of
every period choose (`envelope`). Where the likelihood fails, the envelope stands in for it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError
from vinesexp.identification.decrement import log_decrement, straight_line
from vinesexp.identification.envelope import envelope
from vinesexp.identification.estimate import is_known
from vinesexp.identification.likelihood import likelihood
from vinesexp.identification.oscillation import POINTS
from vinesexp.identification.phasors import Phasors, decay_window, demodulate
from vinesexp.identification.ringdown_result import RingDown
from vinesexp.signals.clipping import resolution_of
from vinesexp.signals.cycles import cycle_amplitudes
from vinesexp.signals.means import block_means, fill_gaps

__all__ = ["POINTS", "RingDown", "cycle_amplitudes", "fit_ringdown", "ring_down"]

FloatArray = NDArray[np.float64]

_UNSURE = 0.25  # standard error of the amplitude, relative, from which on there is no decay
_UNSURE_STAND_IN = 0.05  # the same where only amplitudes and phases of the periods say so
_MISFIT = 0.02  # of the motion: a likelihood that leaves more has to agree with the envelope
_DRIVEN = 0.5  # of the motion, and of its amplitude period by period: it is not a decay that moves
_APART = 4.0  # standard errors
_SAME_F0, _SAME_ZETA = 1e-3, 0.05  # relative
_PARTS = 5  # of a record that are left out in turn
_STEADY = 5e-3  # a decay whose amplitude falls by less is a steady drive
_STEADY_ERRORS = 3.0  # standard errors that zeta has to stand above zero
_LOOK = 1 << 16  # samples that show the converter's step


def fit_ringdown(x: FloatArray, *, sample_rate: float, frequency: float) -> RingDown:
    """The best method on a record as it was sampled; arguments as of `ring_down`.

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
    """All methods on one record.

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
        Log decrement, and last the one that counts: likelihood, or where that fails envelope.

    Raises
    ------
    AnalysisError
        No free decay of three periods in the record, none that stands out, or a steady drive.

    Examples
    --------
    >>> t = np.arange(4000) / 200.0
    >>> x = 1e-2 * np.exp(-0.3 * t) * np.cos(2 * np.pi * 7.9 * t + 0.3)
    >>> x += 1e-5 * np.random.default_rng(0).standard_normal(t.size)
    >>> best = ring_down(x, 1 / 200.0, frequency=7.8)[-1]
    >>> best.decay.form, abs(best.f0 - 7.9009) < 1e-3
    ('viscous', True)
    """
    phasors = kept(demodulate(x, step, frequency), resolution)
    w, rate = (float(v) for v in straight_line(phasors)[:2])
    better = w / (2.0 * math.pi)
    if abs(better / frequency - 1.0) < 0.2:  # once more with the frequency and decay found
        phasors = kept(demodulate(x, step, better, rate=rate), resolution)
    decrement = log_decrement(phasors)
    best = _settled(x, step, phasors, envelope(phasors, decrement.decay), decrement)
    sure = best.zeta > _STEADY_ERRORS * best.at(best.reference).zeta_error
    if best.fallen < _STEADY or not sure:
        raise AnalysisError(
            f"the amplitude {'falls' if best.fallen >= 0.0 else 'rises'} by "
            f"{100 * abs(best.fallen):.2g} % in {best.end - best.start:.3g} s only: "
            "a steady drive, no free decay"
        )
    if not is_known(best.f0, best.f0_error):
        raise AnalysisError(
            f"the frequency of the decay is not known: {best.f0:.4g} +- {best.f0_error:.2g} Hz, "
            "expected an error of half of it at most; record more periods"
        )
    return [decrement, best]


def _settled(
    x: FloatArray, step: float, phasors: Phasors, law: RingDown, decrement: RingDown
) -> RingDown:
    """The likelihood, or what stands in for it where it fails; nobody else chooses.

    A likelihood that leaves much of the motion and contradicts what amplitude and phase of every
    period say has fitted something else than the decay: then the cheaper methods count, with errors
    that hold all of them.
    """
    try:
        best = likelihood(x, step, phasors, law)
    except (AnalysisError, np.linalg.LinAlgError, ValueError):
        best = replace(law, covariance=np.full_like(law.covariance, np.inf), residual=math.inf)
    failed = not best.unsure < _UNSURE
    if failed and not law.unsure < _UNSURE_STAND_IN:
        raise AnalysisError(
            f"no free decay stands out: its amplitude is known to {100 * best.unsure:.0f} % only, "
            f"expected {100 * _UNSURE:.0f} % or better"
        )
    if not failed and best.residual < _MISFIT:
        return best
    if min(best.residual, law.residual) > _DRIVEN:
        raise AnalysisError(
            f"the best decay leaves {100 * law.residual:.2g} % of the amplitudes of the periods: "
            "something drives it, no free decay"
        )
    f0_error, zeta_error = _by_parts(phasors, decrement, law)
    if not failed and _agree(best, law):
        note = (
            f"the best decay leaves {100 * best.residual:.2g} % of the motion; the errors of f0 "
            "and zeta are widened to what leaving out a part of the record changes"
        )
        if f0_error < best.f0_error and zeta_error < best.zeta_error:
            return best
        return _widened(best, f0_error, zeta_error, note)
    why = (
        f"the likelihood leaves {100 * best.residual:.2g} % of the motion and gives f0 = "
        f"{best.f0:.5g} Hz, zeta = {best.zeta:.3g}"
        if math.isfinite(best.residual) and not failed
        else "the likelihood does not settle on this record"
    )
    others = [decrement] if failed else [decrement, best]
    f0_error = max(f0_error, *(abs(law.f0 - other.f0) for other in others))
    zeta_error = max(zeta_error, *(abs(law.zeta - other.zeta) for other in others))
    note = (
        f"{why}; f0 = {law.f0:.5g} Hz and zeta = {law.zeta:.3g} are taken from the amplitude of "
        "every period, with errors that hold all methods: look whether something else moves too"
    )
    return _widened(law, f0_error, zeta_error, note)


def _widened(found: RingDown, f0_error: float, zeta_error: float, note: str) -> RingDown:
    return replace(
        found, f0_error=max(found.f0_error, f0_error), zeta_error=max(found.zeta_error, zeta_error),
        note=note,
    )  # fmt: skip


def _by_parts(p: Phasors, decrement: RingDown, law: RingDown) -> tuple[float, float]:
    """Errors of f0 and zeta by leaving out one fifth of the record after another (jackknife)."""
    found = []
    for part in np.array_split(np.arange(p.t.size), _PARTS):
        kept_ones = np.setdiff1d(np.arange(p.t.size), part)
        if not part.size or kept_ones.size < _PARTS:
            continue
        try:
            rest = replace(p, t=p.t[kept_ones], z=p.z[kept_ones])
            found.append(envelope(rest, decrement.decay).at(law.reference))
        except (AnalysisError, np.linalg.LinAlgError, ValueError):
            continue
    if len(found) < 2:
        return 0.0, 0.0
    grow = (len(found) - 1) / math.sqrt(len(found))  # of a jackknife's standard deviation
    return (
        grow * float(np.std([one.f0 for one in found], ddof=1)),
        grow * float(np.std([one.zeta for one in found], ddof=1)),
    )


def _agree(a: RingDown, b: RingDown) -> bool:
    """Whether two methods give the same f0 and zeta, within their errors or what matters."""
    f0 = max(_APART * math.hypot(a.f0_error, b.f0_error), _SAME_F0 * b.f0)
    zeta = max(_APART * math.hypot(a.zeta_error, b.zeta_error), _SAME_ZETA * b.zeta)
    return abs(a.f0 - b.f0) < f0 and abs(a.zeta - b.zeta) < zeta


def kept(p: Phasors, resolution: float) -> Phasors:
    """The windows of the free decay: `phasors.decay_window`."""
    begin, end = decay_window(p, resolution=resolution)
    return replace(p, t=p.t[begin:end], z=p.z[begin:end])
