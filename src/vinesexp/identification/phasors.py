"""Demodulation: a decaying oscillation as one complex amplitude a period, and where to fit it.

Everything a record says about f0 and damping near its oscillation is in these few hundred
numbers; choosing the stretch to fit, the form of the damping and the start values is done on them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from vinesexp.arrays import OF_MEDIAN, BoolArray, FloatArray, runs_of
from vinesexp.errors import AnalysisError
from vinesexp.units import LIKELY

_BREAKS = 10.0  # robust standard deviations
_MOMENT = 0.2  # of a window: more than this standing out is not a moment, nothing is left out
_UNSURE = 3.0  # times the usual error: a window that holds too few samples
_SEEN = 5  # samples of a window at least
_NEAR = 2.5  # rad between the neighbours of a sample: beyond, they do not tell where it should be
_MOST_OUTLIERS = 6  # times that the recursion is fitted
_FEWEST = 3  # periods that a decay has to show
_MOVING = 8  # windows that show how a frequency moves
_MOVES = 0.01  # of a frequency: it changes over the decay
#: Of a period that a constant, a slope and a sine are fitted to.
SAMPLES = 6
_BESIDE = 8  # windows beside a gap that show how the phase turns
_FOLLOWED = 2.5  # rad over a gap: less than half a turn is no other number of turns
_REST = 1e-9  # of the largest amplitude
_ABOVE_STEP = 1.0  # converter steps: below, an amplitude is staircase, not sine


# The free part of a decay: without the hand that let it go, or took the sensor up at the end.
#
# From one period to the next a free oscillation shrinks and turns by nearly the same factor. A
# hand moves a phone, a knock an accelerometer by anything. What is loudest in such a record is no
# release.
_STEADY = 0.15  # by which the factor of one period may differ from that of the next, at most
_LEAST, _MANY = 0.02, 8.0  # the same at least; times by which it usually does
_AROUND = 15  # periods over which it usually does
_REST_CHANGE = 10.0  # of a factor from or to rest: never steady
_ENDS = 3  # periods at either end of a stretch that show its factor there
_LONG = 6  # periods of a free stretch
_MISTAKEN = 0.5  # of the free stretch: a window that holds less of it begins with something else
_BEATS = 3  # steady stretches between which a second mode turns the phase
_RISES = 2.0  # times that no free decay becomes larger again


def free_part(
    z: NDArray[np.complex128], start: int, end: int, periods: FloatArray | None = None
) -> tuple[int, int]:
    """The window of a decay, without what a hand did before or after it.

    Parameters
    ----------
    z : complex array (n,)
        Amplitude of every period.
    start, end : int
        From the largest amplitude to where it has died into noise.
    periods : array (n - 1,), optional
        From each to the next, where some are missing.

    Returns
    -------
    tuple of int
        The same window where nothing speaks against it.

    Examples
    --------
    >>> z = 5.0 * 0.97 ** np.arange(60) * np.exp(0.1j * np.arange(60))
    >>> z[55:] = [20.0, -70.0j, 50.0, 90.0j, -10.0]  # taken up at its end
    >>> free_part(z, 58, 60)
    (0, 55)
    """
    factor, change, near = _factors(z, np.ones(z.size - 1) if periods is None else periods)
    runs = _steady_runs(change, near)
    if not runs or _beats(runs, start, end):
        return start, end
    first, last = max(runs, key=lambda run: run[1] - run[0])
    if min(end, last) - max(start, first) < _MISTAKEN * (last - first):
        start, end = first, last
    inside = [run for run in runs if run[0] < end and run[1] > start]
    # a hand that goes along, or brakes, has its own factor: what does not go on as the longest
    # stretch is another motion
    longest = inside.index(max(inside, key=lambda run: min(end, run[1]) - max(start, run[0])))
    goes_on = [
        abs(np.median(factor[b[0] : b[0] + _ENDS]) - np.median(factor[a[1] - 1 - _ENDS : a[1] - 1]))
        < near[min(b[0], near.size - 1)]
        for a, b in pairwise(inside)
    ]
    before = [i for i in range(longest) if not goes_on[i]]
    after = [i for i in range(longest, len(goes_on)) if not goes_on[i]]
    begins = inside[before[-1] + 1][0] if before else inside[0][0]
    stops = inside[after[0]][1] if after else inside[-1][1]
    if begins > start + 1:
        start = begins
    if stops < end and (after or np.abs(z[stops:end]).max() > _RISES * np.abs(z[stops - 1])):
        end = stops
    return start, end


def _beats(runs: list[tuple[int, int]], start: int, end: int) -> bool:
    """Whether steady stretches follow one another through the window, as between two modes."""
    inside = [run for run in runs if run[0] < end and run[1] > start]
    covered = sum(min(end, b) - max(start, a) for a, b in inside)
    return len(inside) >= _BEATS and covered > _MISTAKEN * (end - start)


def _factors(
    z: NDArray[np.complex128], periods: FloatArray
) -> tuple[NDArray[np.complex128], FloatArray, FloatArray]:
    """Factor from each period to the next, how two neighbours differ, and how they may."""
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = (z[1:] / z[:-1]) ** (1.0 / periods)
        change = np.nan_to_num(np.abs(np.diff(factor)), nan=_REST_CHANGE, posinf=_REST_CHANGE)
    usual = median_filter(change, _AROUND, mode="nearest") if change.size else change
    return factor, change, np.clip(_MANY * usual, _LEAST, _STEADY)


def _steady_runs(change: FloatArray, near: FloatArray) -> list[tuple[int, int]]:
    """Stretches of periods with nearly the same factor from each to the next."""
    return [(a, b + 2) for a, b in runs_of(change < near) if b + 2 - a >= _LONG]


@dataclass(frozen=True)
class Phasors:
    """Complex amplitudes z of x = Re(z exp(i w t)), one a window.

    Attributes
    ----------
    t : array (n,)
        Centre of each window, s.
    z : complex array (n,)
        m.
    error : float
        Standard error of real and imaginary part, m.
    noise : float
        Standard deviation of a sample, m.
    w : float
        rad/s.
    span : float
        Length of a window, s.
    """

    t: FloatArray
    z: NDArray[np.complex128]
    error: float
    noise: float
    w: float
    span: float


def times_of(x: FloatArray, t: FloatArray | float) -> FloatArray:
    """Times of samples (s) that are given as such, or by the step from one to the next."""
    return np.asarray(t * np.arange(x.size) if np.ndim(t) == 0 else t, dtype=np.float64)


def windows(t: FloatArray, frequency: float) -> tuple[int, float, int]:
    """Samples in a period, its length in whole steps (s), and the periods in a record.

    Raises
    ------
    AnalysisError
        Too few of either.
    """
    step = float(np.median(np.diff(t))) if t.size > 1 else math.inf
    size = round(1.0 / (frequency * step))
    count = int((t[-1] - t[0] + step) / (size * step) + 1e-6) if size else 0
    if size < SAMPLES:
        raise AnalysisError(
            f"{1.0 / (frequency * step):.3g} samples in a period of {frequency:.6g} Hz, expected "
            f"{SAMPLES} or more to see it decay; sample faster, or give frequency_hz if the rig "
            "oscillates at another frequency"
        )
    if count < _FEWEST:
        raise AnalysisError(
            f"{count} periods of {frequency:.6g} Hz in the record, expected {_FEWEST} or more"
        )
    return size, size * step, count


def demodulate(
    x: FloatArray, t: FloatArray | float, frequency: float, *, rate: float = 0.0,
    local: FloatArray | None = None,
) -> Phasors:  # fmt: skip
    """Fit constant, slope and a damped sine to consecutive windows of one period.

    Samples that stand out (a sensor that lost its target for a moment) are left out, and windows
    that hold too few samples to say much.

    Parameters
    ----------
    x : array (n,)
        Displacement, m.
    t : array (n,) or float
        Its times, s, rising, even or not; or the step between them.
    frequency : float
        About that of the oscillation, Hz.
    rate : float
        Decay within a window, 1/s, as far as it is known.
    local : array (windows,), optional
        Angular frequency in every window, rad/s, where it moves; z still turns relative to
        `frequency`.

    Raises
    ------
    AnalysisError
        Fewer than three windows.

    Examples
    --------
    >>> t = np.sort(np.random.default_rng(0).uniform(0.0, 10.0, 2400))
    >>> x = 2.0 * np.exp(-0.1 * t) * np.cos(2 * np.pi * 10 * t) + 5.0
    >>> p = demodulate(x, t, 10.0, rate=0.1)
    >>> bool(abs(abs(p.z[0]) - 2.0 * np.exp(-0.1 * p.t[0])) < 1e-9)
    True
    """
    times = times_of(x, t)
    size, span, count = windows(times, frequency)
    step, w = span / size, 2.0 * math.pi * frequency
    window = np.floor((times - times[0]) / span + 1e-6).astype(np.int64)
    x, times, window = (one[window < count] for one in (x, times, window))
    centre = np.asarray(times[0] + (np.arange(count) + 0.5) * span - 0.5 * step, dtype=np.float64)
    s = times - centre[window]
    turn = (w if local is None else local[window]) * s
    fall = np.exp(-rate * s)
    basis = np.stack(
        [np.ones_like(s), s / (0.5 * span), fall * np.cos(turn), -fall * np.sin(turn)], axis=1
    )
    out = standing_out(x, w * np.diff(times))
    held = np.bincount(window, minlength=count)
    share = np.bincount(window, out, minlength=count) / np.maximum(held, 1)
    use = ~out | (share > _MOMENT)[window]  # else it is no moment
    fitted, inverse, noise = _fitted(x, basis, window, use, size, count)
    z = (fitted[:, 2] + 1j * fitted[:, 3]) * np.exp(-1j * w * centre)
    unsure = np.sqrt(0.5 * (inverse[:, 2, 2] + inverse[:, 3, 3]))
    seen = np.bincount(window[use], minlength=count) >= _SEEN
    usual = float(np.median(unsure[seen])) if seen.any() else 0.0
    seen &= unsure < _UNSURE * usual
    if seen.sum() < _FEWEST:
        raise AnalysisError(
            f"{seen.sum()} periods of {frequency:.6g} Hz without a gap in the record, expected "
            f"{_FEWEST} or more"
        )
    return Phasors(centre[seen], z[seen], noise * usual, noise, w, span)


def _fitted(
    x: FloatArray, basis: FloatArray, window: NDArray[np.int64], use: BoolArray, size: int,
    count: int,
) -> tuple[FloatArray, FloatArray, float]:  # fmt: skip
    """Coefficients of every window and their covariances for a noise of 1; the noise of a sample.

    The noise is that in the quieter half of the windows.
    """
    columns = basis.shape[1]
    known, own = basis[use], window[use]
    middle = float(x.mean())

    def sums(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(own, values, minlength=count), dtype=np.float64)

    normal = np.array([[sums(a * b) for b in known.T] for a in known.T]).transpose(2, 0, 1)
    right = np.stack([sums(a * (x[use] - middle)) for a in known.T], axis=1)
    # A window without samples has a covariance that says so.
    inverse = np.asarray(np.linalg.inv(normal + 1e-13 * size * np.eye(columns)), dtype=np.float64)
    fitted = np.einsum("nij,nj->ni", inverse, right)
    fitted += np.einsum("nij,nj->ni", inverse, right - np.einsum("nij,nj->ni", normal, fitted))
    rest = x[use] - middle - (known * fitted[own]).sum(axis=1)
    n = sums(np.ones(own.size))
    rms = np.sort(np.sqrt(sums(rest**2) / np.maximum(n - columns, 1))[n > columns])
    fitted[:, 0] += middle
    return fitted, inverse, float(rms[: max(1, rms.size // 2)].mean()) if rms.size else 0.0


def local_frequencies(p: Phasors, start: float, count: int) -> FloatArray | None:
    """Angular frequency in each of the `count` windows from `start` on, where it moves.

    From the phase of the windows that hold the decay, over amplitude (a straight line and a
    square); None where it moves by less than a hundredth.
    """
    if p.t.size < _MOVING:
        return None
    size = np.abs(p.z)
    w = p.w + np.diff(np.unwrap(np.angle(p.z))) / np.diff(p.t)
    middle = np.sqrt(size[1:] * size[:-1])
    law = np.polyfit(middle / size.max(), w, 2, w=middle)
    found = np.polyval(law, size / size.max())
    if np.ptp(found) < _MOVES * p.w:
        return None
    inside = np.clip(np.round((p.t - start) / p.span - 0.5).astype(np.int64), 0, count - 1)
    low, high = 0.5 * p.w, 2.0 * p.w
    return np.clip(np.interp(np.arange(count), inside, found), low, high)


def standing_out(x: FloatArray, turn: FloatArray | float) -> BoolArray:
    """Samples that no smooth decay passes through: a sensor that lost its target for a moment.

    A sine about d obeys x[n-1] sin(q) + x[n+1] sin(p) = x[n] sin(p + q), all without d, where the
    phase turns by p to sample n and by q from it. Damping adds a share of x[n-1]. A spike breaks
    this for itself and its neighbours, wherever it lies; three numbers are fitted to the rest.

    Parameters
    ----------
    x : array (n,)
        Several samples a period.
    turn : array (n - 1,) or float
        About the phase from each sample to the next, rad.

    Returns
    -------
    bool array (n,)

    Examples
    --------
    >>> x = np.cos(0.3 * np.arange(200))
    >>> x[50] += 3.0
    >>> np.flatnonzero(standing_out(x, 0.31))
    array([49, 50, 51])
    """
    turns = np.broadcast_to(turn, (x.size - 1,))
    before, after = turns[:-1], turns[1:]
    p, q, both = np.sin(before), np.sin(after), np.sin(before + after)
    near = before + after < _NEAR
    scale = np.where(near, 0.5 * (p + q), 1.0)
    basis = np.stack([x[1:-1] * both, x[:-2] * scale, p + q - both], axis=1) / scale[:, np.newaxis]
    values = (x[:-2] * q + x[2:] * p) / scale
    out = np.zeros(values.size, dtype=bool)
    if not near.any():
        return np.zeros(x.size, dtype=bool)
    floor = 1e-12 * float(np.abs(x).max())
    c = np.array([1.0, 0.0, 0.0])
    c[2] = np.median((values - basis[:, 0])[near]) / np.median(basis[near, 2])
    for _ in range(_MOST_OUTLIERS):
        rest = np.abs(values - basis @ c)
        limit = max(_BREAKS * OF_MEDIAN * float(np.median(rest[near])), floor)
        new = near & (rest > limit)
        if (new == out).all() or new.mean() > _MOMENT:
            break
        out = new
        c = np.linalg.lstsq(basis[near & ~out], values[near & ~out], rcond=None)[0]
    # A step of the slope (the release) breaks it once; a spike at three samples in a row.
    middle = np.concatenate([[False], out, [False]])
    return np.asarray(middle & (np.convolve(middle, np.ones(3), mode="same") > 1.5))


def decay_window(p: Phasors, *, resolution: float = 0.0) -> tuple[int, int]:
    """First and last-plus-one window of the free decay.

    It begins with the largest amplitude (what came before was the release, or waiting for it) and
    ends where the amplitude has died into noise or into the converter's steps; without what a hand
    did before or after.

    Parameters
    ----------
    p : Phasors
    resolution : float
        Step of the converter, m.

    Raises
    ------
    AnalysisError
        Nothing stands out, or it does not decay for three windows.
    """
    size = np.abs(p.z)
    start = int(np.argmax(size))
    # A window that the release falls into is partly at rest: its amplitude is too small,
    # and the next one is the largest; one more is left out if it still disagrees.
    floor = max(LIKELY * p.error, _ABOVE_STEP * resolution)
    below = np.flatnonzero(size[start:] < floor)
    end = start + int(below[0]) if below.size else size.size
    # Rest is no motion, however steady: before the release, and where only steps are left.
    shown = np.where(size > max(floor, _REST * size.max()), p.z, 0.0)
    start, end = free_part(shown, start, end, np.round(np.diff(p.t) / p.span))
    if end - start < _FEWEST or not size[start] > 0.0:
        raise AnalysisError(
            f"the oscillation is above the noise for {end - start} periods, expected {_FEWEST} or "
            "more"
        )
    return start, end


def one_decay(p: Phasors) -> Phasors:
    """The phasors on both sides of gaps as one decay where the phase can be followed across.

    The phase turns over a gap by as much as the frequencies beside it say. Where these leave open
    how often it went round, the part of the record with most motion counts alone.

    Examples
    --------
    >>> t = np.concatenate([np.arange(40.0), np.arange(50.0, 90.0)]) + 0.5
    >>> p = Phasors(t, np.exp((0.05j - 0.01) * t), 1e-4, 1e-4, 2.0 * np.pi, 1.0)
    >>> one_decay(p).t.size, one_decay(replace(p, z=p.z * np.exp(0.4j * t))).t.size
    (80, 40)
    """
    breaks = np.flatnonzero(np.diff(p.t) > 1.5 * p.span) + 1
    if not breaks.size:
        return p
    edges = [0, *breaks.tolist(), p.t.size]
    slopes = [_turning(p, a, b) for a, b in pairwise(edges)]
    parts = [[0, edges[1]]]
    for k, b in enumerate(edges[2:]):
        at = edges[k + 1]
        gap = float(p.t[at] - p.t[at - 1])
        (_, before, error), (after, _, other) = slopes[k], slopes[k + 1]
        turn = 0.5 * (before + after) * gap
        unsure = (math.hypot(error, other) + 0.25 * abs(after - before)) * gap
        if abs(turn) + unsure < _FOLLOWED:
            parts[-1][1] = b
        else:
            parts.append([at, b])
    a, b = max(parts, key=lambda part: float((np.abs(p.z[part[0] : part[1]]) ** 2).sum()))
    return replace(p, t=p.t[a:b], z=p.z[a:b])


def _turning(p: Phasors, begin: int, end: int) -> tuple[float, float, float]:
    """How fast the phase turns at both ends of a stretch, rad/s, and the error of either."""
    ends = []
    for own in (slice(begin, min(begin + _BESIDE, end)), slice(max(end - _BESIDE, begin), end)):
        t, z = p.t[own], p.z[own]
        if t.size < _FEWEST:
            return 0.0, 0.0, math.inf
        sure = np.abs(z) / max(p.error, 1e-12 * float(np.abs(z).max()))
        ends.append(np.polyfit(t - t.mean(), np.unwrap(np.angle(z)), 1, w=sure)[0])
        lever = math.sqrt(float((sure**2 * (t - t.mean()) ** 2).sum()))
    return float(ends[0]), float(ends[1]), LIKELY / lever
