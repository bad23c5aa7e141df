"""A second mode so near the first that a law of damping could take its beats for its own.

Two modes a few line widths apart beat: the amplitude falls fast and slowly in turn, and the phase
turns with it. Laws of damping and spring follow a beat or two, and f0 was off by up to thirty of
its errors. Two complex exponentials follow all of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from vinesexp.arrays import ComplexArray, FloatArray
from vinesexp.identification.phasors import Phasors
from vinesexp.identification.ringdown_result import RingDown

_RANGE = 0.35  # of f0, on either side: phasors, one a period, show no more
_WIDTHS = 10.0  # of a line, on either side: farther off it is a line in what a fit leaves
_RATES = (0.5, 1.0, 2.0)  # times that of the decay, from which the search begins
_WORTH = 0.5  # of what a law leaves: two modes that leave more are no better
_LEFT = 5e-3  # of the motion: what a law leaves less of is no beat
_EVIDENCE = 10.0  # units of BIC that a second mode has to gain: strong evidence
_UNKNOWNS = 8  # of two modes: amplitude, phase, frequency and rate of each
_LEAST = 0.02  # of the amplitude of the first: a weaker second mode is no reason for its law


@dataclass(frozen=True)
class NearMode:
    """The weaker of two modes, each of x = Re(amplitude exp(rate (t - start))).

    Attributes
    ----------
    rates : complex array (2,)
        Of the stronger one and its own, 1/s: how fast it falls, less than 0, and how it turns.
    amplitudes : complex array (2,)
        m.
    start : float
        s.
    """

    rates: ComplexArray
    amplitudes: ComplexArray
    start: float

    @property
    def seen(self) -> tuple[float, float]:
        """Its frequency, Hz, and its amplitude over that of the stronger one at the start."""
        share = np.abs(self.amplitudes[1] / self.amplitudes[0])
        return float(self.rates[1].imag) / (2.0 * math.pi), float(share)

    def without(self, p: Phasors) -> Phasors:
        """Phasors that it is taken out of."""
        own = self.amplitudes[1] * np.exp(self.rates[1] * (p.t - self.start) - 1j * p.w * p.t)
        return replace(p, z=p.z - own)

    def columns(self, t: FloatArray) -> FloatArray:
        """Columns that hold it, and any of slightly another frequency and rate."""
        s = t - t[0]
        own = np.exp(self.rates[1] * s)
        later = own * s / max(float(s[-1]), 1e-300)
        return np.stack([own.real, own.imag, later.real, later.imag], axis=1)

    def fitted(self, x: FloatArray, t: FloatArray, slow: FloatArray) -> NearMode:
        """The two modes fitted to samples, with columns of what moves slowly."""
        q = np.linalg.qr(slow)[0]
        fast = x - q @ (q.T @ x)

        def columns(rates: ComplexArray) -> FloatArray:
            modes = np.exp(np.outer(t - self.start, rates))
            both = np.concatenate([modes.real, -modes.imag], axis=1)
            return np.asarray(both - q @ (q.T @ both))

        def rest(rates: ComplexArray) -> FloatArray:
            X = columns(rates)
            return np.asarray(fast - X @ np.linalg.lstsq(X, fast, rcond=None)[0])

        rates = _least(rest, self.rates, span=float(np.ptp(t)))
        parts = np.linalg.lstsq(columns(rates), fast, rcond=None)[0]
        return replace(self, rates=rates, amplitudes=parts[:2] + 1j * parts[2:4])


def near_mode(p: Phasors, law: RingDown) -> NearMode | None:
    """The weaker of two modes, where two explain a decay far better than any law of one does.

    Parameters
    ----------
    p : Phasors
        Of the free decay.
    law : RingDown
        The best law of one mode.

    Examples
    --------
    >>> from vinesexp.identification.phasors import demodulate
    >>> from vinesexp.identification.ringdown import envelope, log_decrement
    >>> t = np.arange(0.0, 40.0, 0.02)
    >>> x = sum(A * np.exp((2j * np.pi * f - 0.25) * t).real for A, f in ((1.0, 1.0), (0.2, 1.1)))
    >>> p = demodulate(x, t, 1.0, rate=0.25)
    >>> found = near_mode(p, envelope(p, log_decrement(p).decay))
    >>> [round(value, 1) for value in found.seen]
    [1.1, 0.2]
    """
    n, span = 2 * p.t.size, float(np.ptp(p.t))
    noise = math.sqrt(n) * p.error / float(np.linalg.norm(p.z))
    if law.residual < max(_LEFT, noise / _WORTH) or n <= _UNKNOWNS + 3:
        return None
    rates = _two_rates(p, law)
    amplitudes, left = _with(rates, p)
    gained = 2.0 * n * math.log(max(law.residual, noise) / max(left, noise))
    worth = _EVIDENCE + (_UNKNOWNS - len(law.free)) * math.log(n)
    if left > _WORTH * law.residual or gained < worth or rates.real.max() >= 0.0:
        return None
    power = np.abs(amplitudes) ** 2 * np.expm1(2.0 * rates.real * span) / rates.real
    order = np.argsort(-power)
    start = float(p.t[0])
    amplitudes = amplitudes * np.exp(1j * p.w * start)
    found = NearMode(rates[order] + 1j * p.w, amplitudes[order], start)
    apart = abs(rates[0].imag - rates[1].imag)
    if apart < max(math.pi / span, -float(rates.real.max())) or found.seen[1] < _LEAST:
        return None
    return found


def _two_rates(p: Phasors, law: RingDown) -> ComplexArray:
    """Complex rates of the two modes that leave least, relative to the phasors' frequency."""
    span, f0 = float(np.ptp(p.t)), law.f0
    rate, step = max(2.0 * math.pi * f0 * law.zeta, 1e-3 / span), math.pi / span
    first = complex(-rate, 2.0 * math.pi * f0 - p.w)
    reach = min(_RANGE * f0, _WIDTHS * max(1.0 / span, law.zeta * f0))
    begun = [
        np.array([first, complex(-factor * rate, first.imag + sign * apart)])
        for factor in _RATES
        for sign in (-1.0, 1.0)
        for apart in np.arange(step, 2.0 * math.pi * reach, step)
    ]

    def rest(rates: ComplexArray) -> FloatArray:
        one = p.z - _modes(rates, p) @ _with(rates, p)[0]
        return np.concatenate([one.real, one.imag])

    return _least(rest, min(begun, key=lambda rates: _with(rates, p)[1]), span=span)


def _least(
    rest: Callable[[ComplexArray], FloatArray], begun: ComplexArray, *, span: float
) -> ComplexArray:
    """Two complex rates that leave least."""
    scale = np.repeat([max(-float(begun[0].real), 1e-3 / span), math.pi / span], 2)
    found = least_squares(
        lambda values: rest(values[:2] + 1j * values[2:]),
        np.concatenate([begun.real, begun.imag]), x_scale=scale,
    ).x  # fmt: skip
    return np.asarray(found[:2] + 1j * found[2:])


def _modes(rates: ComplexArray, p: Phasors) -> ComplexArray:
    return np.asarray(np.exp(np.outer(p.t - p.t[0], rates)))


def _with(rates: ComplexArray, p: Phasors) -> tuple[ComplexArray, float]:
    """Amplitudes of two modes at the first window, and the share of the motion that they leave."""
    E = _modes(rates, p)
    amplitudes = np.asarray(np.linalg.lstsq(E, p.z, rcond=None)[0], dtype=np.complex128)
    return amplitudes, float(np.linalg.norm(p.z - E @ amplitudes) / np.linalg.norm(p.z))
