"""f0 and damping from free decays, by three rungs of rising cost.

Log decrement: a straight line through the logarithm of the amplitude. Envelope: amplitude and
phase of every period, the form of the damping chosen by evidence. Likelihood: the displacement
itself, slow drift as further linear unknowns.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError
from vinesexp.identification.envelope import envelope, log_decrement, straight_line
from vinesexp.identification.likelihood import likelihood
from vinesexp.identification.phasors import Phasors, decay_window, demodulate
from vinesexp.identification.ringdown_result import RingDown
from vinesexp.signals.clipping import resolution_of
from vinesexp.signals.cycles import cycle_amplitudes
from vinesexp.signals.means import block_means, fill_gaps

__all__ = ["POINTS", "RingDown", "cycle_amplitudes", "fit_ringdown", "ring_down"]

FloatArray = NDArray[np.float64]

#: Block means a period: a sine loses 0.3 % of its information there.
POINTS = 24
_UNSURE = 0.25  # standard error of the amplitude, relative, from which on there is no decay
_LOOK = 1 << 16  # samples that show the converter's step


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
        No free decay of three periods in the record, or none that stands out.

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
    law = envelope(phasors, decrement.decay)
    best = likelihood(x, step, phasors, law)
    unsure = math.sqrt(float(best.covariance[best.free.index("log_A")][best.free.index("log_A")]))
    if not unsure < _UNSURE:
        raise AnalysisError(
            f"no free decay stands out: its amplitude is known to {100 * unsure:.0f} % only, "
            f"expected {100 * _UNSURE:.0f} % or better"
        )
    return [decrement, law, best]


def kept(p: Phasors, resolution: float) -> Phasors:
    """The windows of the free decay: `phasors.decay_window`."""
    begin, end = decay_window(p, resolution=resolution)
    return replace(p, t=p.t[begin:end], z=p.z[begin:end])
