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
from vinesexp.identification.phasors import (
    Phasors,
    decay_window,
    demodulate,
    local_frequencies,
)
from vinesexp.identification.ringdown_result import RingDown
from vinesexp.signals.clipping import resolution_of
from vinesexp.signals.cycles import cycle_amplitudes
from vinesexp.signals.means import block_means, fill_gaps
from vinesexp.units import COVERAGE_95

__all__ = ["POINTS", "RingDown", "cycle_amplitudes", "fit_ringdown", "ring_down"]

FloatArray = NDArray[np.float64]

_MISFIT = 0.02  # of the motion: a likelihood that leaves more has to agree with the envelope
_APART = 4.0  # standard errors
_SAME_F0, _SAME_ZETA = 1e-3, 0.05  # relative
_DRIVEN = 0.5  # of the motion: what leaves more is no decay that something disturbs
_STEADY = 5e-3  # a decay whose amplitude falls by less is a steady drive
_SURE = 3.0  # standard errors that zeta has to stand above zero
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
        whole = demodulate(x, step, better, rate=rate)
        phasors = kept(whole, resolution)
        local = local_frequencies(phasors, whole.t.size)
        if local is not None:
            phasors = kept(demodulate(x, step, better, rate=rate, local=local), resolution)
    decrement = log_decrement(phasors)
    best = _settled(x, step, phasors, envelope(phasors, decrement.decay), decrement)
    if best.fallen < _STEADY:
        raise AnalysisError(
            f"the amplitude {'falls' if best.fallen >= 0.0 else 'rises'} by "
            f"{100 * abs(best.fallen):.2g} % in {best.end - best.start:.3g} s only: "
            "a steady drive, no free decay"
        )
    if best.residual > _DRIVEN:
        raise AnalysisError(
            f"the best decay leaves {100 * best.residual:.2g} % of the motion: something drives "
            "it, no free decay"
        )
    if not _sure(best):
        raise AnalysisError(
            f"no free decay stands out: zeta = {best.zeta:.2g} +- "
            f"{COVERAGE_95 * best.zeta_error:.1g}, f0 = {best.f0:.4g} +- "
            f"{COVERAGE_95 * best.f0_error:.1g} Hz over {best.end - best.start:.3g} s, of which "
            f"the best decay leaves {100 * best.residual:.2g} %; expected a standard error of zeta "
            "of a third of it at most: record more of the decay, or nothing but the decay"
        )
    return [decrement, best]


def _sure(found: RingDown) -> bool:
    """Whether the record says that it decays, and at which frequency."""
    return found.zeta > _SURE * found.zeta_error and is_known(found.f0, found.f0_error)


def _settled(
    x: FloatArray, step: float, phasors: Phasors, law: RingDown, decrement: RingDown
) -> RingDown:
    """The likelihood, or what stands in for it where it fails.

    A likelihood that leaves much of the motion and contradicts what amplitude and phase of every
    period say has fitted something else than the decay: then the cheaper methods count, with errors
    that hold all of them.
    """
    others, said = [decrement], "the likelihood does not settle on this record"
    try:
        best = likelihood(x, step, phasors, law)
        if _sure(best):
            if best.residual < _MISFIT or _agree(best, law):
                return best
            others.append(best)
            said = (
                f"the likelihood leaves {100 * best.residual:.2g} % of the motion and gives f0 = "
                f"{best.f0:.5g} Hz, zeta = {best.zeta:.3g}"
            )
    except (AnalysisError, np.linalg.LinAlgError, ValueError):
        pass
    note = (
        f"{said}; f0 = {law.f0:.5g} Hz and zeta = {law.zeta:.3g} are taken from the amplitude of "
        "every period, with errors that hold all methods: look whether something else moves too"
    )
    return replace(
        law,
        f0_error=max(law.f0_error, *(abs(law.f0 - other.f0) for other in others)),
        zeta_error=max(law.zeta_error, *(abs(law.zeta - other.zeta) for other in others)),
        note=note,
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
