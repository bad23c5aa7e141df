"""Hits that ring for longer than any template: each is one onset, however long it rings.

For drop tests, by a microphone or any other sensor: only times matter. An onset is where
the level rises well above all of the last moments; what rings, beats and fades after it does not.
The time is that of Maeda's criterion: the sample that divides the record around an onset into two
stretches that differ most.

References
----------
Maeda, N., Zisin 38 (1985) 365-379: Akaike's information criterion without an autoregressive model.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtr

from vinesexp.arrays import FloatArray, IntArray
from vinesexp.settings.stages import DropSettings, ImpactSettings
from vinesexp.signals.impacts.candidates import CHUNK, Stream
from vinesexp.signals.impacts.detection import Detection, detection_at

_QUIET = 0.1  # share of the record that is taken as quiet
_EDGE = 5  # samples that Maeda's criterion keeps on either side
_LEAST = 16  # samples of a window: the level of noise is then known to a sixth
_PRECURSOR = 0.2  # of the highest level: what the highpass shows before a hit is less
_BEFORE = 4  # steps before an onset that its time is looked for in
_FADED = 0.1  # of the highest level: a hit has rung down


def detect_onsets(stream: Stream, settings: ImpactSettings, drop: DropSettings) -> Detection:
    """One impact for each onset of ringing in a stream; jumps are not known.

    Parameters
    ----------
    stream : Stream
        Any unit: an onset stands out of what was before it.
    settings : ImpactSettings
        Its threshold, in standard deviations of the quiet parts.
    drop : DropSettings
    """
    level, step, noise = levels(stream, drop)
    starts, tops = onsets(level, noise, step, threshold=settings.threshold, drop=drop)
    if not starts.size:
        return detection_at(np.empty(0))
    hop = round(step * stream.sample_rate)
    # The zero-phase highpass rings before a strong hit, too: that is left out.
    clear = [
        i + int(np.argmax(level[i : k + 1] > _PRECURSOR * level[k]))
        for i, k in zip(starts, tops, strict=True)
    ]
    picked = [_picked(stream, i, int(k), hop) for i, k in zip(clear, tops, strict=True)]
    time, error = (np.array(values) for values in zip(*picked, strict=True))
    strength = level[tops] / noise
    return detection_at(
        time, time_error=error, peak=level[tops],
        strength=strength, confidence=ndtr(strength - settings.threshold),
    )  # fmt: skip


def ring_time(stream: Stream, settings: ImpactSettings, drop: DropSettings) -> float:
    """How long hits are louder than a tenth of their level, s: median of the clear ones."""
    level, step, noise = levels(stream, drop)
    starts, tops = onsets(level, noise, step, threshold=settings.threshold, drop=drop)
    ends = [*starts[1:], level.size][: starts.size]
    times = [
        step * float((level[top:end] > _FADED * level[top]).sum() - 1)
        for top, end in zip(tops, ends, strict=True)
        if level[top] * _FADED >= 2.0 * noise
    ]
    return float(np.median(times)) if times else 0.0


def levels(stream: Stream, drop: DropSettings) -> tuple[FloatArray, float, float]:
    """Root mean squares of short windows, their distance (s), and that of the quiet parts."""
    hop = max(_LEAST // 2, round(0.5 * drop.window * stream.sample_rate))
    size = max(CHUNK // hop, 1) * hop
    squares = []
    for begin in range(0, stream.n, size):
        a = np.nan_to_num(stream.read(begin, min(stream.n, begin + size)))
        whole = a[: a.size // hop * hop].reshape(-1, hop)
        squares.append((whole * whole).mean(axis=1))
    half = np.concatenate(squares) if squares else np.empty(0)
    level = np.sqrt(0.5 * (half[:-1] + half[1:]))  # windows of two halves, one half apart
    if not level.size:
        return level, hop / stream.sample_rate, 1e-300
    quiet = float(np.sort(level)[int(_QUIET * level.size)])
    floor = stream.noise_floor if stream.noise_floor > 0.0 else 1e-6 * float(level.max())
    return level, hop / stream.sample_rate, max(quiet, floor, 1e-300)


def onsets(
    level: FloatArray, noise: float, step: float, *, threshold: float, drop: DropSettings
) -> tuple[IntArray, IntArray]:
    """First window of each onset, and the highest one of its hit.

    Examples
    --------
    >>> level = np.full(400, 0.01)
    >>> for start in (50, 250): level[start:] += 10.0 * np.exp(-np.arange(400 - start) / 30.0)
    >>> onsets(level, 0.01, 5e-4, threshold=6.0, drop=DropSettings())[0].tolist()
    [50, 250]
    """
    none = np.empty(0, dtype=np.int64)
    back = max(2, round(drop.rest / step))
    if level.size <= back + 2:
        return none, none
    # Highest level of the last moments; the two windows that share samples with this one left out.
    padded = np.concatenate([np.full(back, noise), level])
    before = np.lib.stride_tricks.sliding_window_view(padded, back - 1).max(axis=1)[: level.size]
    rises = (level > drop.rise * before) & (level > threshold * noise)
    index = np.flatnonzero(rises)
    starts = index[np.diff(index, prepend=-(10**9)) > back]  # a rise that goes on is one
    ends = np.minimum(np.append(starts[1:], level.size), starts + back)
    tops = [i + int(np.argmax(level[i:k])) for i, k in zip(starts, ends, strict=True)]
    return starts.astype(np.int64), np.array(tops, dtype=np.int64)


def _picked(stream: Stream, start: int, top: int, hop: int) -> tuple[float, float]:
    """Time of an onset and its standard error, s, by Maeda's criterion."""
    before = max(0, (start - _BEFORE) * hop)
    end = min(stream.n, (top + 2) * hop)
    x = np.nan_to_num(stream.read(before, end))
    rate = stream.sample_rate
    if x.size < 4 * _EDGE:
        return start * hop / rate, hop / rate
    k = np.arange(_EDGE, x.size - _EDGE)
    total, squares = np.cumsum(x), np.cumsum(x * x)
    tiny = 1e-12 * float(squares[-1]) / x.size + 1e-300
    first = squares[k - 1] / k - (total[k - 1] / k) ** 2
    rest = x.size - k
    second = (squares[-1] - squares[k - 1]) / rest - ((total[-1] - total[k - 1]) / rest) ** 2
    score = k * np.log(np.maximum(first, tiny)) + rest * np.log(np.maximum(second, tiny))
    weight = np.exp(-0.5 * (score - score.min()))
    weight /= weight.sum()
    mean = float(weight @ k)
    spread = math.sqrt(float(weight @ (k - mean) ** 2))
    return (before + mean) / rate, math.hypot(spread, 0.5) / rate
