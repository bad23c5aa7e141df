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

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.errors import AnalysisError

_BREAKS = 10.0  # robust standard deviations
_MOMENT = 0.2  # of a window: more than this standing out is not a moment, nothing is left out
_MOST_OUTLIERS = 6  # times that the recursion is fitted
_FEWEST = 3  # periods that a decay has to show
_MOVING = 8  # windows that show how a frequency moves
_MOVES = 0.01  # of a frequency: it changes over the decay
#: Of a period that a constant, a slope and a sine are fitted to.
SAMPLES = 6
_BESIDE = 8  # windows beside a gap that show how the phase turns
_FOLLOWED = 2.5  # rad over a gap: less than half a turn is no other number of turns
_ABOVE_NOISE = 3.0  # standard errors of a complex amplitude
_REST = 1e-9  # of the largest amplitude
_ABOVE_STEP = 1.0  # converter steps: below, an amplitude is staircase, not sine


# The free part of a decay: without the hand that let it go, or took the sensor up at the end.
#
# From one period to the next a free oscillation shrinks and turns by nearly the same factor. A
# hand moves a phone, a knock an accelerometer by anything. What is loudest in such a record is no
# release.
_STEADY = 0.15  # by which the factor of one period may differ from that of the next
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
    runs = _steady_runs(z, np.ones(z.size - 1) if periods is None else periods)
    if not runs or _beats(runs, start, end):
        return start, end
    first, last = max(runs, key=lambda run: run[1] - run[0])
    if min(end, last) - max(start, first) < _MISTAKEN * (last - first):
        start, end = first, last
    inside = [run for run in runs if run[0] < end and run[1] > start]
    begins, stops = min(run[0] for run in inside), max(run[1] for run in inside)
    if begins > start + 1:
        start = begins
    if stops < end and np.abs(z[stops:end]).max() > _RISES * np.abs(z[stops - 1]):
        end = stops
    return start, end


def _beats(runs: list[tuple[int, int]], start: int, end: int) -> bool:
    """Whether steady stretches follow one another through the window, as between two modes."""
    inside = [run for run in runs if run[0] < end and run[1] > start]
    covered = sum(min(end, b) - max(start, a) for a, b in inside)
    return len(inside) >= _BEATS and covered > _MISTAKEN * (end - start)


def _steady_runs(z: NDArray[np.complex128], periods: FloatArray) -> list[tuple[int, int]]:
    """Stretches of periods with nearly the same factor from each to the next."""
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = (z[1:] / z[:-1]) ** (1.0 / periods)
        steady = np.abs(np.diff(factor)) < _STEADY
    edges = np.flatnonzero(np.diff(np.concatenate([[0], steady.astype(np.int8), [0]])))
    runs = [(int(a), int(b) + 2) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [run for run in runs if run[1] - run[0] >= _LONG]


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


def demodulate(
    x: FloatArray, step: float, frequency: float, *, rate: float = 0.0,
    local: FloatArray | None = None, lost: BoolArray | None = None,
) -> Phasors:  # fmt: skip
    """Fit constant, slope and a damped sine to consecutive windows of one period.

    Samples that stand out of a window's fit (a sensor that lost its target for a moment) are left
    out of it.

    Parameters
    ----------
    x : array (n,)
        Displacement, m, `step` s apart.
    frequency : float
        About that of the oscillation, Hz.
    rate : float
        Decay within a window, 1/s, as far as it is known.
    local : array (windows,), optional
        Angular frequency in every window, rad/s, where it moves; z still turns relative to
        `frequency`.
    lost : bool array (n,), optional
        Samples that were not measured; windows that lost much of theirs are left out.

    Raises
    ------
    AnalysisError
        Fewer than three windows.

    Examples
    --------
    >>> t = np.arange(2400) / 240.0
    >>> x = 2.0 * np.exp(-0.1 * t) * np.cos(2 * np.pi * 10 * t) + 5.0
    >>> p = demodulate(x, 1 / 240.0, 10.0, rate=0.1)
    >>> bool(abs(abs(p.z[0]) - 2.0 * np.exp(-0.1 * p.t[0])) < 1e-9)
    True
    """
    size = round(1.0 / (frequency * step))
    count = x.size // size if size else 0
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
    s = np.asarray((np.arange(size) - 0.5 * (size - 1)) * step, dtype=np.float64)
    w = 2.0 * math.pi * frequency
    fall: FloatArray = np.exp(-rate * s)
    basis = _basis(s, fall, np.array(w))
    windows = x[: count * size].reshape(count, size)
    inverse = np.asarray(np.linalg.pinv(basis), dtype=np.float64)
    gaps = np.zeros(windows.shape, dtype=bool)
    if lost is not None:
        gaps = lost[: count * size].reshape(count, size)
    fitted, noise = _robust(windows, basis, inverse, w * step, gaps)
    t = np.asarray(((np.arange(count) + 0.5) * size - 0.5) * step, dtype=np.float64)
    if local is not None:
        own = np.linalg.pinv(_basis(s, fall, local)) @ windows[:, :, np.newaxis]
        fitted[:, 2:4] = own[:, 2:4, 0]
    z = (fitted[:, 2] + 1j * fitted[:, 3]) * np.exp(-1j * w * t)
    error = noise * math.sqrt(0.5 * float((inverse[2] ** 2).sum() + (inverse[3] ** 2).sum()))
    seen = gaps.mean(axis=1) < _MOMENT
    if seen.sum() < _FEWEST:
        raise AnalysisError(
            f"{seen.sum()} periods of {frequency:.6g} Hz without a gap in the record, expected "
            f"{_FEWEST} or more"
        )
    return Phasors(t[seen], z[seen], error, noise, w, size * step)


def _basis(s: FloatArray, fall: FloatArray, w: FloatArray) -> FloatArray:
    """Columns fitted to a window (..., n, columns): constant, slope, cosine and sine."""
    turn = w[..., np.newaxis] * s
    columns = [np.ones_like(turn), turn / turn.max(), fall * np.cos(turn), -fall * np.sin(turn)]
    return np.asarray(np.stack(columns, axis=-1), dtype=np.float64)


def local_frequencies(p: Phasors, count: int) -> FloatArray | None:
    """Angular frequency in each of the `count` windows of a record whose frequency moves.

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
    inside = np.clip(np.round(p.t / p.span - 0.5).astype(np.int64), 0, count - 1)
    low, high = 0.5 * p.w, 2.0 * p.w
    return np.clip(np.interp(np.arange(count), inside, found), low, high)


def standing_out(x: FloatArray, turn: float) -> BoolArray:
    """Samples that no smooth decay passes through: a sensor that lost its target for a moment.

    Any decaying sine with a constant obeys x[n+1] + x[n-1] = a x[n] + b x[n-1] + d. A spike breaks
    this for itself and its neighbours, wherever it lies; the three numbers are fitted to the rest.

    Parameters
    ----------
    x : array (n,)
        Evenly sampled, several samples a period.
    turn : float
        About the phase from one sample to the next, rad.

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
    basis = np.stack([x[1:-1], x[:-2], np.ones(x.size - 2)], axis=1)
    values = x[2:] + x[:-2]
    out = np.zeros(values.size, dtype=bool)
    floor = 1e-12 * float(np.abs(x).max())
    c = np.array([2.0 * math.cos(turn), 0.0, 0.0])
    c[2] = np.median(values - basis @ c)
    for _ in range(_MOST_OUTLIERS):
        rest = np.abs(values - basis @ c)
        limit = max(_BREAKS * float(np.median(rest)) / 0.6745, floor)
        new = rest > limit
        if (new == out).all() or new.mean() > _MOMENT:
            break
        out = new
        c = np.linalg.lstsq(basis[~out], values[~out], rcond=None)[0]
    # A step of the slope (the release) breaks it once; a spike at three samples in a row.
    middle = np.concatenate([[False], out, [False]])
    return np.asarray(middle & (np.convolve(middle, np.ones(3), mode="same") > 1.5))


def _robust(
    windows: FloatArray, basis: FloatArray, inverse: FloatArray, turn: float, gaps: BoolArray
) -> tuple[FloatArray, float]:
    """Coefficients of every window, and the noise of a sample in the quieter half of them."""
    count, size = windows.shape
    out = standing_out(windows.ravel(), turn).reshape(windows.shape)
    out &= (out.mean(axis=1) < _MOMENT)[:, np.newaxis]  # else it is no moment
    seen = gaps.mean(axis=1) < _MOMENT
    out |= gaps & seen[:, np.newaxis]
    fitted = windows @ inverse.T
    for i in np.flatnonzero(out.any(axis=1)):
        use = ~out[i]
        fitted[i] = np.linalg.lstsq(basis[use], windows[i, use], rcond=None)[0]
    rest = np.where(out, 0.0, windows - fitted @ basis.T)
    freedom = np.maximum(size - basis.shape[1] - out.sum(axis=1), 1)
    rms = np.sort(np.sqrt((rest**2).sum(axis=1) / freedom)[seen])
    count = max(int(seen.sum()), 1)
    return fitted, float(rms[: max(1, count // 2)].mean())


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
    floor = max(_ABOVE_NOISE * p.error, _ABOVE_STEP * resolution)
    below = np.flatnonzero(size[start:] < floor)
    end = start + int(below[0]) if below.size else size.size
    # Rest is no motion, however steady: before the release, and where only steps are left.
    shown = np.where(size > max(floor, _REST * size.max()), p.z, 0.0)
    start, end = free_part(shown, start, end, np.round(np.diff(p.t) / p.span))
    if end - start < _FEWEST or not size[start] > 0.0:
        raise AnalysisError(
            f"the oscillation stands out of the noise for {end - start} periods, "
            f"expected {_FEWEST} or more"
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
    return float(ends[0]), float(ends[1]), _ABOVE_NOISE / lever
