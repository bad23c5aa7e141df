"""What lies beyond the ends of a record, as a zero-phase filter has to imagine it.

A record is cut out of a motion that went on. Mirrored samples bend an oscillation at the edge,
and a highpass turns the bend into a swing of the first cycle. So the oscillation at the edge is
continued instead: one damped sine and a constant, fitted to the last periods
(docs/signals.md compares the ways).
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.signals.means import block_means, fill_gaps

#: Periods at the edge that the sine is fitted to.
_PERIODS = 3.0
#: Points a period that the fit is made on: enough for a sine, few enough to cost nothing.
_POINTS = 24
#: The continued sine grows at most so much over its whole length.
_GROWTH = 2.0


def continued_sine(edge: FloatArray, n: int, *, sample_rate: float, frequency: float) -> FloatArray:
    """Continue the oscillation at the end of `edge` for n samples.

    Parameters
    ----------
    edge : array
        The last periods of the record (all of a shorter one), newest sample last. For what came
        before a record give its first periods turned round, and turn the answer round.
    n : int
        Samples wanted.
    sample_rate, frequency : float
        Hz; about where the oscillation is.

    Returns
    -------
    array (n,)
        Constant plus damped sine; the constant alone where the edge is too short for a sine.

    Examples
    --------
    >>> t = np.arange(1500) / 1e3
    >>> x = 2.0 + np.exp(-0.3 * t) * np.cos(2 * np.pi * 7.9 * t)
    >>> y = continued_sine(x[:1000], 500, sample_rate=1e3, frequency=7.0)
    >>> bool(np.abs(y - x[1000:]).max() < 0.01)
    True
    """
    wanted = min(edge.size, math.ceil(_PERIODS * sample_rate / frequency))
    piece = edge[edge.size - wanted :]
    k = max(1, int(sample_rate / (frequency * _POINTS)))
    coarse = block_means(piece[piece.size % k :], k)  # groups end at the newest sample
    step = k / sample_rate
    if coarse.size < 8 or coarse.size * step * frequency < 0.8:
        return np.full(n, coarse.mean() if coarse.size else edge.mean())
    s = _pole(coarse, step, 2.0 * math.pi * frequency, n / sample_rate)
    t = step * (np.arange(coarse.size) - coarse.size + 0.5)  # newest sample ends at 0
    wave = np.exp(s * t)
    basis = np.stack([np.ones(t.size), wave.real, wave.imag], axis=1)
    constant, a, b = np.linalg.lstsq(basis, coarse, rcond=None)[0]
    ahead = np.exp(s * ((np.arange(n) + 0.5) / sample_rate))
    return np.asarray(constant + a * ahead.real + b * ahead.imag)


def _pole(x: FloatArray, step: float, near: float, span: float) -> complex:
    """Decay and angular frequency of the sine in x: linear prediction, kept near `near`."""
    centre = x - x.mean()
    # x[i-l] + x[i+l] = c x[i] + d, l about a quarter period: a long baseline beats the noise.
    lag = max(1, round(0.25 * 2.0 * math.pi / (near * step)))
    if centre.size < 2 * lag + 6:
        return complex(0.0, near)
    middle = centre[lag:-lag]
    basis = np.stack([middle, np.ones(middle.size)], axis=1)
    c = np.linalg.lstsq(basis, centre[: -2 * lag] + centre[2 * lag :], rcond=None)[0][0]
    omega = math.acos(min(max(0.5 * c, -1.0), 1.0)) / (lag * step)
    if not 0.6 * near < omega < 1.7 * near:
        omega = near
    half = centre.size // 2
    first, second = np.std(centre[:half]), np.std(centre[half:])
    rate = 0.0
    if first > 0.0 and second > 0.0:
        rate = math.log(second / first) / (half * step)
    limit = math.log(_GROWTH) / max(span, step)
    return _refined(x, step, complex(min(max(rate, -limit), limit), omega), limit)


def _refined(x: FloatArray, step: float, s: complex, limit: float) -> complex:
    """A few steps of least squares on the pole, amplitudes and constant projected out."""
    t = step * (np.arange(x.size) - x.size + 0.5)
    start = s
    for _ in range(4):
        wave = np.exp(s * t)
        basis = np.stack([np.ones(t.size), wave.real, wave.imag], axis=1)
        q = np.linalg.qr(basis)[0]
        c = np.linalg.lstsq(basis, x, rcond=None)[0]
        rest = x - basis @ c
        change = t * np.stack(
            [c[1] * wave.real + c[2] * wave.imag, c[2] * wave.real - c[1] * wave.imag]
        )
        columns = (change - (change @ q) @ q.T).T
        d = np.linalg.lstsq(columns, rest, rcond=1e-6)[0]
        omega = s.imag + float(d[1])
        if not 0.7 * start.imag < omega < 1.4 * start.imag:
            return start
        s = complex(min(max(s.real + float(d[0]), -limit), limit), omega)
    return s


def continued_line(edge: FloatArray, n: int, *, length: int) -> FloatArray:
    """Continue the trend of the last `length` samples of `edge`, whatever spikes are in it.

    For an acceleration: a spike at the very edge neither is mirrored nor tilts the line, because
    its two points are medians.

    Examples
    --------
    >>> x = np.arange(100.0); x[-1] = 1e6
    >>> continued_line(x, 3, length=40).round().tolist()
    [100.0, 101.0, 102.0]
    """
    piece = edge[max(0, edge.size - length) :]
    half = piece.size // 2
    if half < 4:
        return np.full(n, np.median(piece))
    early, late = piece[piece.size - 2 * half : piece.size - half], piece[piece.size - half :]
    older, newer = float(np.median(early)), float(np.median(late))
    slope = (newer - older) / half
    # The median of a ramp of `half` samples stands (half - 1)/2 before its last one.
    at_end = newer + slope * 0.5 * (half - 1)
    ahead = np.minimum(np.arange(1, n + 1), half)  # no farther than the line was seen
    return np.asarray(at_end + slope * ahead)


def bridge_gaps(x: FloatArray, *, length: int) -> FloatArray:
    """An acceleration with its gaps bridged, whatever spikes stand at their edges.

    Gaps shorter than a tenth of `length` samples are interpolated; a longer one goes from the
    trend before it to the trend after it (`continued_line` of `length` samples).

    Examples
    --------
    >>> x = np.zeros(100); x[39] = 50.0; x[40:60] = np.nan
    >>> bool(np.abs(bridge_gaps(x, length=20)[40:60]).max() < 1e-9)
    True
    """
    bad = ~np.isfinite(x)
    if not bad.any() or bad.all():
        return fill_gaps(x)
    filled = fill_gaps(x).copy()
    edges = np.flatnonzero(np.diff(bad.astype(np.int8), prepend=0, append=0))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        if end - begin <= length // 10:
            continue
        before, after = filled[max(0, begin - length) : begin], x[end : end + length]
        after = after[np.isfinite(after)]
        left = continued_line(before, 1, length=length)[0] if before.size else None
        right = continued_line(after[::-1], 1, length=length)[0] if after.size else None
        left, right = left if left is not None else right, right if right is not None else left
        filled[begin:end] = np.linspace(left, right, end - begin)  # type: ignore[arg-type]
    return filled
