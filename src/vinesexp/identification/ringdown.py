"""f0 and damping from free decays, by two methods of rising cost.

Log decrement: a straight line through the logarithm of the amplitude. Likelihood: the displacement
itself, slow drift as further linear unknowns, with the law of damping that amplitude and phase of
every period choose (`envelope`). Where the likelihood fails, the envelope stands in for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from vinesexp.arrays import OF_MEDIAN, BoolArray, ComplexArray, FloatArray
from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.identification.damping_law import (
    FORMS,
    NAMES,
    SPRINGS,
    Decay,
    covariance_with,
    decay_of,
    fitted_decay,
    logs_and_phases,
    with_next_terms,
)
from vinesexp.identification.decrement import log_decrement, straight_line, telling_amplitude
from vinesexp.identification.estimate import is_known
from vinesexp.identification.least_squares import Solution
from vinesexp.identification.oscillation import POINTS, fewer
from vinesexp.identification.persistence import CHANCE, OF_PHASE, counts, grown, lasting
from vinesexp.identification.phasors import (
    Phasors,
    decay_window,
    demodulate,
    local_frequencies,
    one_decay,
    standing_out,
    times_of,
    windows,
)
from vinesexp.identification.ringdown_result import RingDown, ring_down_by
from vinesexp.signals.clipping import resolution_of
from vinesexp.signals.means import cycle_amplitudes
from vinesexp.units import COVERAGE_95, LIKELY

__all__ = ["POINTS", "RingDown", "cycle_amplitudes", "fit_ringdown", "ring_down"]


_MISFIT = 0.02  # of the motion: what leaves more is not all of what moves
_APART = 4.0  # standard errors
_SAME_F0, _SAME_ZETA = 1e-3, 0.05  # relative
_DRIVEN = 0.5  # of the motion: what leaves more is no decay that something disturbs
_USUAL = 0.9  # of the periods
_POOR = 0.05  # of the motion, left by a decay: worth a line
_STEADY = 5e-3  # a decay whose amplitude falls by less is a steady drive
_AROUND = 6.0  # times f0: lines of noise that are as strong as those near f0, mostly
_FAINT = 0.3  # of the noise of a window: an amplitude that says nothing
_MORE = 1.05  # times what is known: less is not worth another fit


# The law of damping of a decay, from the amplitude and phase of every period.
#
# Which of viscous, quadratic and Coulomb damping a decay shows, and whether its frequency depends
# on amplitude, is decided by evidence (BIC). The likelihood then fits the record itself with that
# law.
_LAW = 3e-4  # relative
_EVIDENCE = 10.0  # units of BIC that a richer form has to gain: strong evidence
_SELDOM = ("xi", "nu")  # laws of the spring that have to gain as much over one that is more usual
_SPRING = 0.1  # of the frequency, by which laws of the spring that are seldom change it at most
_TURNED = 9e-4  # of the power: a law that leaves more may have lost the phase
_Misfit = Callable[[FloatArray], FloatArray]
#: Evidence, decay, free parameters.
_Tried = tuple[float, Decay, tuple[str, ...]]
#: Parameters that every form has.
_ALWAYS = ("log_A", "phase", "w")


# The best method on a decay: the displacement itself, its slow drift as linear unknowns.
#
# What the fit leaves is looked at: its noise near f0 scales the errors, a line in it is a second
# oscillation, which is then taken out.
_OUTLYING = 6.0  # standard deviations
_MOST_LOST = 0.05  # of the samples: more is no loss of the target, it is a bad start of the fit
_MOST_DRIFT = 24  # cosines
OWN_LINES = 6.0  # widths of a line, or Fourier lines, from its top that are its own
_FEWEST_LINES = 20
_BELOW_HARMONIC = 1.9  # times f0: an oscillation that is no sine has a second harmonic
_BEAT = 5e-3  # of the amplitude: weaker lines are not reported
_SIDE_LINES = 4  # half Fourier lines on each side that a second oscillation may take
STRONG = 8.0  # times the median of the lines around
_ABSORBED, _SKIRT = 1.5, 13.0  # Fourier lines from f0: what a fit takes up; where a skirt shows
_PASSES = 8
_BEGUN = 0.39  # lines: a random walk from zero, at f0 beside its skirt (6.6 times the first line)


def likelihood(
    x: FloatArray, t: FloatArray, p: Phasors, envelope: RingDown, near: NearMode | None = None
) -> RingDown:
    """The form that the envelope chose, fitted to the displacement; drift is linear unknowns.

    So are a mode that is `near`, and a second oscillation, where what is left shows one: then the
    fit is done once more.
    """
    step = float(np.median(np.diff(t)))
    inside = (t >= envelope.window[0]) & (t <= envelope.window[1])
    t, y = t[inside], x[inside]
    start = replace(envelope.decay, start=float(t[0]))
    vector = start.vector()
    # A damping that only widens the errors of the envelope is no part of its law: free, it may
    # give energy. A spring has either sign.
    law = {*OF_PHASE, "log_A", *(name for name in NAMES if getattr(start, name))}
    terms = tuple(name for name in envelope.free if name in law)
    # The decay is started at the first sample instead of the first window's centre.
    back = float(t[0]) - envelope.decay.start
    A = math.exp(vector[0])
    vector[0] -= envelope.decay.rate(A) * back
    vector[1] += vector[2] * back
    noise, drift = max(p.noise, 1e-9 * A), _drift(t, envelope.f0)
    slow = drift if near is None else np.concatenate([drift, near.columns(t)], axis=1)
    kept = _trusted(y, slow, decay_of(vector, start.form, start.start), t, noise, p.w)
    if near is not None:
        near = near.fitted(y[kept], t[kept], drift[kept])
        slow = np.concatenate([drift, near.columns(t)], axis=1)
    fit = _fitted(vector, terms, t, y, slow, kept, noise)
    beat = _beat(_even(fit.rest, t, step), _even(y - fit.rest, t, step), step, envelope)
    if beat is not None:
        rate = envelope.decay.rate(envelope.reference)
        both = np.concatenate([slow, _narrow(t, beat[0], rate)], axis=1)
        fit = _fitted(fit.vector, terms, t, y, both, kept, noise)
    rest = _even(fit.rest, t, step)
    decay = decay_of(fit.vector, start.form, start.start)
    even = np.asarray(t[0] + step * np.arange(rest.size), dtype=np.float64)
    sigma = _noise_at(rest, step, envelope.f0) * _stirred(rest, even, decay)
    sigma /= math.sqrt(float(kept.sum()) / rest.size)
    by = _lasting(rest, even, decay, sigma, round(p.span / step), counts(terms))
    free = with_next_terms(terms, spring=by[1] > 1.0)
    covariance = fit.covariance if free == terms else fit.covariance_with(free)
    covariance = grown(covariance * (sigma / noise) ** 2, free, by)
    found = ring_down_by(
        "likelihood", decay, free, covariance, envelope.reference, fit.left, envelope.window
    )
    return replace(found, beat=beat if near is None else near.seen)


def _even(values: FloatArray, t: FloatArray, step: float) -> FloatArray:
    """Values at uneven times put where they are nearest on an even axis, 0 where there is none.

    For what a fit leaves: of noise and slow motion half a step more or less says nothing.
    """
    place = np.rint((t - t[0]) / step).astype(np.int64)
    return np.asarray(np.bincount(place, values))


def _lasting(
    rest: FloatArray, t: FloatArray, decay: Decay, sigma: float, size: int, fitted: tuple[int, int]
) -> tuple[float, float]:
    """`lasting` of what is left of the samples, in windows of one period."""
    log_A, phase = decay.at(t)
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
    kept: BoolArray, noise: float,
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
    y: FloatArray, slow: FloatArray, decay: Decay, t: FloatArray, noise: float, w: float
) -> BoolArray:
    """Samples that are not those of a sensor that lost its target for a moment.

    A spike stands out from its neighbours; a longer loss from the start's fit.
    """
    log_A, phase = decay.at(t)
    A = np.exp(log_A)
    out = standing_out(y, w * np.diff(t))
    difference = np.where(out, 0.0, y - A * np.cos(phase))
    q = np.linalg.qr(slow)[0]
    rest = np.abs(difference - q @ (q.T @ difference))
    # Times that are off leave more where the motion is larger, which is no loss.
    loud = np.median(A) <= A
    usual = np.maximum(float(np.median(rest)), A * float(np.median(rest[loud] / A[loud])))
    lost = rest > _OUTLYING * np.maximum(noise, OF_MEDIAN * usual)
    return ~(out | lost) if lost.mean() < _MOST_LOST else ~out


def _drift(t: FloatArray, f0: float) -> FloatArray:
    """Constant, slope, bend and slow cosines, all well below f0."""
    span = float(t[-1] - t[0])
    count = min(_MOST_DRIFT, int(2.0 * span * f0 / 8.0))
    phase = (t - t[0]) / span
    columns = [phase**k for k in range(3)]  # they take what does not end level as cosines do
    columns += [np.cos(np.pi * k * phase) for k in range(1, count + 1)]
    return np.stack(columns, axis=1)


def _beat(
    rest: FloatArray, motion: FloatArray, step: float, envelope: RingDown
) -> tuple[float, float] | None:
    """Frequency and relative amplitude of a line in the residual that is not the decay's own.

    What a law of damping leaves lies within a few line widths of f0 and is no second oscillation;
    with a spring that is not straight, of any frequency that the decay goes through.
    """
    f0, zeta = envelope.f0, envelope.zeta
    ends = envelope.amplitude_at(np.array(envelope.window)).tolist()
    through = [envelope.decay.frequency(A) / (2.0 * math.pi) for A in (*ends, envelope.reference)]
    taper = np.hanning(2 * rest.size)[rest.size :]  # a decay is strong at its start
    power = np.abs(np.fft.rfft(rest * taper))
    frequency = np.fft.rfftfreq(rest.size, step)
    own = OWN_LINES * max(1.0 / (rest.size * step), zeta * f0)
    near = (frequency > 0.5 * f0) & (frequency < _BELOW_HARMONIC * f0)
    near &= (frequency < min(through) - own) | (frequency > max(through) + own)
    if near.sum() < _FEWEST_LINES:
        return None
    peak = int(np.flatnonzero(near)[np.argmax(power[near])])
    share = float(power[peak] / np.abs(np.fft.rfft(motion * taper)).max())
    if share < _BEAT or power[peak] < STRONG * np.median(power[near]):
        return None
    return float(frequency[peak]), share


def _noise_at(rest: FloatArray, step: float, f0: float) -> float:
    """Noise per sample as it acts near f0: the residual's spectrum there, not its total.

    Drift and hum far from f0 do not make f0 uncertain; noise near it does.
    """
    power = np.abs(np.fft.rfft(rest)) ** 2 / rest.size
    frequency = np.fft.rfftfreq(rest.size, step)
    near = (frequency > 0.5 * f0) & (frequency < 2.0 * f0)
    n = int(near.sum())
    if n < 10:
        return float(rest.std())
    found = float(power[near].mean()) * n / (n - 2.0)  # of four parameters, two a line
    # Few lines show their own mean badly: those further away raise it by no more than chance.
    around = float(power[(frequency > 0.5 * f0) & (frequency < _AROUND * f0)].mean())
    return math.sqrt(max(found, min(around, found * (1.0 + 2.0 / math.sqrt(n)))))


def _stirred(rest: FloatArray, t: FloatArray, decay: Decay) -> float:
    """By how much noise that drives the oscillator is more than what is seen beside its line.

    A floor that trembles, or wind, makes the oscillator answer: its noise is a line as narrow as
    its own, of which the fit takes up the middle. What is left beside it rises towards f0 as the
    skirt of such a line does, and says how high the middle is. The noise that counts is the mean
    over the spectrum of what f0 moves.
    """
    f0, width = decay.w / (2.0 * math.pi), 1.0 / (t[-1] - t[0])
    f = np.fft.rfftfreq(rest.size, float(t[1] - t[0]))
    apart = np.abs(f - f0) / width
    near = (apart > _ABSORBED) & (apart < _SKIRT)
    far = (apart > _SKIRT) & (f > 0.5 * f0) & (f < 2.0 * f0)
    if near.sum() < _FEWEST_LINES or far.sum() < _FEWEST_LINES:
        return 1.0
    power = np.abs(np.fft.rfft(rest)) ** 2
    flat = float(np.mean(power[far]))
    if np.mean(power[near]) <= flat * (1.0 + CHANCE / math.sqrt(near.sum())):
        return 1.0
    log_A, phase = decay.at(t)
    A = np.exp(log_A)
    half = decay.rate(float(A[0])) / (2.0 * math.pi)
    skirt = 1.0 / ((f - f0) ** 2 + half**2 + (_BEGUN * width) ** 2)
    size = 0.0
    for _ in range(_PASSES):  # a power scatters as itself: weighted so
        weight = skirt[near] / (flat + size * skirt[near]) ** 2
        size = max(float(weight @ (power[near] - flat) / (weight @ skirt[near])), 0.0)
    stirred = size * skirt
    middle = float((t * A**2).sum() / (A**2).sum())
    moved = np.abs(np.fft.rfft((t - middle) * A * np.sin(phase))) ** 2
    return math.sqrt(1.0 + float((moved * stirred).sum() / moved.sum()) / flat)


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
    most = np.array([1.0 / np.abs(p.z).min(), np.ptp(p.t)])  # of 1/A and of time
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
        if np.abs(vector[8:] * most).max() > _SPRING:  # what wanders so far is no spring
            return None
        # The noise inside the windows may miss what differs from window to window (steps of the
        # converter, drift): it may be larger than stated, not smaller, and is what is likeliest.
        left = found.chi2 / n
        evidence = n * (math.log(max(left, 1.0)) + min(left, 1.0)) + cost(free)
        return evidence, decay_of(vector, form, start.start), free

    def cost(free: tuple[str, ...]) -> float:
        """Of parameters: as in BIC; of viscous damping, taken for granted, as in AIC."""
        return sum(2.0 if name == "alpha" else math.log(n) for name in free)

    def settled(misfit: _Misfit) -> tuple[Decay, tuple[str, ...], Solution]:
        _, decay, free = _selected(partial(tried, misfit), least=cost((*_ALWAYS, "alpha")))
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
    return _with_errors(p, decay, free, straight(fine), float(fine[0]))


def _with_errors(
    p: Phasors, decay: Decay, free: tuple[str, ...], misfit: _Misfit, error: float
) -> RingDown:
    """A fitted decay with its covariance, by what it leaves of the phasors and how long that lasts.

    `error` is what `misfit` takes for that of a phasor.
    """
    log_A, phase = decay.at(p.t)
    rest = p.z * np.exp(1j * (p.w * p.t - phase)) - np.exp(log_A)
    left = float(np.linalg.norm(rest))
    noise = left / math.sqrt(max(1, 2 * p.t.size - len(free)))
    by = lasting(rest, np.exp(log_A), noise, fitted=counts(free))
    free = with_next_terms(free, spring=by[1] > 1.0)
    covariance = covariance_with(decay.vector(), free, misfit, span=float(np.ptp(p.t)))
    covariance = grown(covariance * max(1.0, (noise / error) ** 2), free, by)
    residual = left / float(np.linalg.norm(p.z))
    window = (float(p.t[0] - 0.5 * p.span), float(p.t[-1] + 0.5 * p.span))
    told = telling_amplitude(np.exp(log_A), p.t)
    return ring_down_by("envelope", decay, free, covariance, told, residual, window)


def _selected(tried: Callable[[str, tuple[str, ...]], _Tried | None], *, least: float) -> _Tried:
    """The form with the best evidence: viscous, then with one more term and with two.

    Each has to be worth it, and one alone in the place of viscous damping as much as beside it.
    `least` is the evidence of viscous damping that leaves nothing: where it is near that, there is
    nothing to be gained by another form.
    """
    best = tried("viscous", FORMS["viscous"])
    if best and best[0] <= least + _EVIDENCE:
        return best
    best = None
    bent: tuple[str, ...] = ()  # a frequency that depends on amplitude shows whatever the damping
    for count in (0, 1, 2):
        candidates = [
            tried(form, (*terms, *bent))
            for form, terms in FORMS.items()
            if len({*terms} - {"alpha"}) == count
        ]
        richer = min((one for one in candidates if one), key=lambda one: one[0], default=None)
        if richer and not bent:
            terms = tuple(name for name in richer[2] if name not in _ALWAYS)
            for springs in (("kappa",), ("mu",), ("xi",), ("nu",), ("mu", "kappa")):
                candidate = tried(richer[1].form, (*terms, *springs))
                usual = len(springs) <= len(bent) and springs[0] not in _SELDOM
                worth = 0.0 if usual else _EVIDENCE
                if candidate and candidate[0] < richer[0] - worth:
                    richer, bent = candidate, springs
        if best and (richer is None or richer[0] > best[0] - _EVIDENCE):
            break
        best = richer or best
    if best is None:
        raise AnalysisError("the amplitude does not decay; a free decay is expected")
    return best


def _started(start: Decay, terms: tuple[str, ...], p: Phasors) -> Decay:
    """The damping of a decay shared out over the terms of a form; what is no term is zero."""
    A, rate = telling_amplitude(np.abs(p.z), p.t), max(start.alpha, 0.0) / len(terms)
    given = {"alpha": rate, "beta": rate / A, "gamma": rate * A}
    given |= {name: getattr(start, name) for name in SPRINGS}
    own = [given[name] if name in terms else 0.0 for name in NAMES[3:]]
    return decay_of(np.append(start.vector()[:3], own), start.form, start.start)


# A second mode so near the first that a law of damping could take its beats for its own.
#
# Two modes a few line widths apart beat: the amplitude falls fast and slowly in turn, and the phase
# turns with it. Laws of damping and spring follow a beat or two, and f0 was off by up to thirty of
# its errors. Two complex exponentials follow all of them.
_RANGE = 0.35  # of f0, on either side: phasors, one a period, show no more
_WIDTHS = 10.0  # of a line, on either side: farther off it is a line in what a fit leaves
_BEGUN_AT = (0.5, 1.0, 2.0)  # times that of the decay, from which the search begins
_WORTH = 0.5  # of what a law leaves: two modes that leave more are no better
_LEFT = 5e-3  # of the motion: what a law leaves less of is no beat
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
    amplitudes, left = _two_modes(rates, p)
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
        for factor in _BEGUN_AT
        for sign in (-1.0, 1.0)
        for apart in np.arange(step, 2.0 * math.pi * reach, step)
    ]

    def rest(rates: ComplexArray) -> FloatArray:
        one = p.z - _turning(rates, p) @ _two_modes(rates, p)[0]
        return np.concatenate([one.real, one.imag])

    return _least(rest, min(begun, key=lambda rates: _two_modes(rates, p)[1]), span=span)


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


def _turning(rates: ComplexArray, p: Phasors) -> ComplexArray:
    return np.asarray(np.exp(np.outer(p.t - p.t[0], rates)))


def _two_modes(rates: ComplexArray, p: Phasors) -> tuple[ComplexArray, float]:
    """Amplitudes of two modes at the first window, and the share of the motion that they leave."""
    E = _turning(rates, p)
    amplitudes = np.asarray(np.linalg.lstsq(E, p.z, rcond=None)[0], dtype=np.complex128)
    return amplitudes, float(np.linalg.norm(p.z - E @ amplitudes) / np.linalg.norm(p.z))


def fit_ringdown(
    x: FloatArray, *, frequency: float, sample_rate: float | None = None,
    times: FloatArray | None = None,
) -> RingDown:  # fmt: skip
    """The best method on a record as it was sampled.

    Parameters
    ----------
    x : array (n,)
        Displacement, m; NaN where it was not measured.
    frequency : float
        About that of the oscillation, Hz.
    sample_rate : float, optional
        Hz.
    times : array (n,), optional
        In the place of a sample rate, s, rising, even or not.

    Raises
    ------
    AnalysisError
        No free decay of three periods in the record.

    Examples
    --------
    >>> t = (np.arange(20000) + np.random.default_rng(1).uniform(0.0, 1.0, 20000)) / 1000.0
    >>> w0, zeta = 2 * np.pi * 7.862, 0.0065
    >>> x = 0.02 * np.exp(-zeta * w0 * t) * np.cos(w0 * np.sqrt(1 - zeta**2) * t)
    >>> found = fit_ringdown(x, times=t, frequency=7.8)
    >>> round(found.f0, 3), round(found.zeta, 4), round(found.amplitude, 3)
    (7.862, 0.0065, 0.02)
    """
    if times is None:
        if sample_rate is None:
            raise ParameterError("neither sample_rate nor times; give one of them")
        times = np.arange(x.size) / sample_rate
    known = np.isfinite(x)
    x, times = x[known], np.asarray(times, dtype=np.float64)[known]
    coarse, t = fewer(x, times, frequency)
    return ring_down(coarse, t, frequency=frequency, resolution=resolution_of(x))[-1]


def ring_down(
    x: FloatArray, t: FloatArray | float, *, frequency: float, resolution: float = 0.0
) -> list[RingDown]:
    """All methods on one record.

    Parameters
    ----------
    x : array (n,)
        Displacement, m, NaN where it was not measured; means some 24 a period lose nothing.
    t : array (n,) or float
        Their times, s, rising, even or not; or the step between them.
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
    known = np.isfinite(x)
    t, x = times_of(x, t)[known], x[known]

    def seen(frequency: float, **about: Any) -> tuple[Phasors, Phasors]:
        """All windows of the record, and those of the free decay."""
        whole = demodulate(x, t, frequency, **about)
        return whole, kept(whole, resolution)

    whole, phasors = seen(frequency)
    w, rate = (float(v) for v in straight_line(phasors)[:2])
    better = w / (2.0 * math.pi)
    if abs(better / frequency - 1.0) < 0.2:  # once more with the frequency and decay found
        whole, phasors = seen(better, rate=rate)
        local = local_frequencies(phasors, float(t[0]), windows(t, better)[2])
        if local is not None:
            whole, phasors = seen(better, rate=rate, local=local)
    decrement = log_decrement(phasors)
    law = envelope(phasors, decrement.decay)
    if (near := near_mode(phasors, law)) is not None:
        phasors = near.without(phasors)
        law = envelope(phasors, log_decrement(phasors).decay)
    best = _settled(x, t, phasors, law, decrement, near)
    if best.fallen < _STEADY:
        raise AnalysisError(
            f"the amplitude {'falls' if best.fallen >= 0.0 else 'rises'} by "
            f"{100 * abs(best.fallen):.2g} % in {np.ptp(best.window):.3g} s only: the mass is "
            "driven, this is no free decay"
        )
    if (left := min(best.residual, _unexplained(phasors, best.decay))) > _DRIVEN:
        raise AnalysisError(
            f"the best fit of a decay leaves {100 * left:.2g} % of the motion: the mass is driven, "
            "this is no free decay"
        )
    if near is None and (wider := widened(whole, phasors, best, resolution)) is not None:
        with suppress(AnalysisError):
            start = begun_at(best.decay, float(wider.t[0]))
            longer = _settled(x, t, wider, envelope(wider, start), decrement)
            if _agree(longer, best):  # of what stands out of the noise that much is left
                best = replace(longer, residual=best.residual)
    if not _sure(best):
        raise AnalysisError(
            f"no free decay found: zeta = {best.zeta:.2g} +- {COVERAGE_95 * best.zeta_error:.1g}, "
            f"f0 = {best.f0:.4g} +- {COVERAGE_95 * best.f0_error:.1g} Hz over "
            f"{np.ptp(best.window):.3g} s, of which the best fit of a decay leaves "
            f"{100 * best.residual:.2g} %; expected a standard error of zeta of a third of zeta at "
            "most: record more of the decay, and only the decay"
        )
    usually = min(left, _unexplained(phasors, best.decay, of=_USUAL))
    return [decrement, _as_unsure_as_left(best, usually)]


def widened(whole: Phasors, p: Phasors, found: RingDown, resolution: float) -> Phasors | None:
    """The windows that a decay reaches by its own law, where noise alone bounded those fitted.

    The largest amplitude and the first one within the noise are chosen by noise where there is
    much of it. Windows beside the decay that its law explains belong to it.

    Parameters
    ----------
    whole, p : Phasors
        All windows of the record, and those that were fitted.
    found : RingDown
        By them.
    resolution : float
        Step of the converter, m.

    Returns
    -------
    Phasors or None
        None where there is little more to learn.
    """
    model = _modelled(whole, found.decay)
    size = np.abs(model)
    belongs = np.abs(whole.z - model) < _OUTLYING * whole.error
    belongs &= size > max(_FAINT * whole.error, resolution)
    first, last = (int(k) for k in np.searchsorted(whole.t, (p.t[0], p.t[-1])))
    before = np.flatnonzero(~belongs[:first])
    after = np.flatnonzero(~belongs[last + 1 :])
    begin = int(before[-1]) + 1 if before.size else 0
    end = last + 1 + int(after[0]) if after.size else whole.t.size
    told = [
        _information(size[own], whole.t[own]) for own in (slice(begin, end), slice(first, last + 1))
    ]
    if told[0] < _MORE * told[1]:
        return None
    return one_decay(replace(whole, t=whole.t[begin:end], z=whole.z[begin:end]))


def _as_unsure_as_left(found: RingDown, left: float) -> RingDown:
    """A decay whose zeta is off by the share that its law leaves, and f0 by as much of the width.

    As in a sweep: where something else moves too, or no law of damping is that of the decay, f0
    and zeta are those of no oscillator, however well the fit determines them.
    """
    if left < _MISFIT:
        return found
    note = found.note
    if left > _POOR and not note:
        note = (
            f"the best fit of a decay leaves {100.0 * left:.2g} % of the motion: a second mode, a "
            "hand, or damping that follows no law; f0 and zeta are as unsure as that"
        )
    return replace(
        found,
        f0_error=math.hypot(found.f0_error, left * found.zeta * found.f0),
        zeta_error=math.hypot(found.zeta_error, left * found.zeta),
        note=note,
    )


def _unexplained(p: Phasors, decay: Decay, *, of: float = 1.0) -> float:
    """What a decay leaves of the motion in a share of the periods, beyond the chance of noise.

    In those with the least of it: what takes hold of the mass at an end is in the errors by how
    long it lasts.
    """
    rest = np.sort(np.abs(p.z - _modelled(p, decay)) ** 2)[: math.ceil(of * p.t.size)]
    noise = 2.0 * p.error**2 * (rest.size + CHANCE * math.sqrt(rest.size))
    return math.sqrt(max(float(rest.sum()) - noise, 0.0) / float((np.abs(p.z) ** 2).sum()))


def _modelled(p: Phasors, decay: Decay) -> ComplexArray:
    """A decay in the windows of some phasors, continued to where they begin."""
    log_A, phase = begun_at(decay, min(float(p.t[0]), decay.start)).at(p.t)
    return np.asarray(np.exp(log_A + 1j * (phase - p.w * p.t)))


def _information(A: FloatArray, t: FloatArray) -> float:
    """What phasors of amplitudes A say about frequency and damping, for one noise of all."""
    return float((A**2).sum() * np.cov(t, aweights=A**2, ddof=0))


def begun_at(decay: Decay, start: float) -> Decay:
    """The decay with another beginning, at its present rate."""
    back = decay.start - start
    return replace(
        decay,
        log_A=decay.log_A + decay.rate(math.exp(decay.log_A)) * back,
        phase=decay.phase - decay.frequency(math.exp(decay.log_A)) * back,
        w=decay.w * (1.0 - decay.nu * back),
        start=start,
    )


def _sure(found: RingDown) -> bool:
    """Whether the record says that it decays, and at which frequency."""
    return found.zeta > LIKELY * found.zeta_error and is_known(found.f0, found.f0_error)


def _settled(
    x: FloatArray, t: FloatArray, phasors: Phasors, law: RingDown, decrement: RingDown,
    near: NearMode | None = None,
) -> RingDown:  # fmt: skip
    """The likelihood, or what stands in for it where it fails.

    A likelihood that leaves much of the motion and contradicts what amplitude and phase of every
    period say has fitted something else than the decay: then the cheaper methods count, with errors
    that hold all of them; the log decrement is that of all that moves, with a mode that is near.
    """
    others, said = [decrement], "the likelihood fit of this record does not converge"
    try:
        best = likelihood(x, t, phasors, law, near)
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
        "every period, with errors that include all methods; check whether something else moves "
        "too"
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
    """The windows of the free decay: `phasors.decay_window`, across gaps where they allow it."""
    begin, end = decay_window(p, resolution=resolution)
    return one_decay(replace(p, t=p.t[begin:end], z=p.z[begin:end]))
