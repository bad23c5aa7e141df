"""The oscillator's motion as any one channel of a record shows it.

f0 and zeta of a decay need no calibration: whichever of displacement and acceleration was measured
will do. An acceleration near one frequency w is -w^2 times the displacement.
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.identification.phasors import SAMPLES
from vinesexp.records.stored.store import RecordView
from vinesexp.signals.clipping import repeated
from vinesexp.signals.filters import SPECTRUM, dominant_frequency
from vinesexp.signals.means import block_means, channel_means, group_size, missing_means

#: Block means a period: a sine loses 0.3 % of its information there.
POINTS = 24
_PAUSE = 2.0  # times as long as a group lasts
#: Fewer periods than that in a record are drift.
DRIFT = 3.0
_FEWEST = 64  # samples of a part of a record that a line may stand out in


def motion_role(view: RecordView) -> str:
    """The channel that shows the mass's motion: the displacement, else the acceleration.

    Raises
    ------
    AnalysisError
        Neither was recorded.
    """
    for role in ("displacement", "acceleration"):
        if role in view.roles:
            return role
    raise AnalysisError("neither displacement nor acceleration of the mass was recorded")


def displacement_of(view: RecordView, frequency: float) -> tuple[FloatArray, float]:
    """Displacement, m, in block means, and the time between them, s.

    Parameters
    ----------
    view : RecordView
    frequency : float
        About that of the oscillation, Hz.

    Returns
    -------
    array (n,), float
        What block means take from a sine is given back. From an acceleration it is right near
        `frequency` and nowhere else.
    """
    role = motion_role(view)
    k = group_size(view.sample_rate, frequency, points=POINTS)
    one = frequency / view.sample_rate
    x = channel_means(view, role, k) / float(np.sinc(one * k) / np.sinc(one))
    if view.quantity(role) == "acceleration":
        x = -x / (2.0 * math.pi * frequency) ** 2
    return x, k / view.sample_rate


def fewer(x: FloatArray, t: FloatArray, frequency: float) -> tuple[FloatArray, FloatArray]:
    """Means over groups of samples, some 24 a period, and their mean times.

    What means take from a sine is given back. A group with a pause in it is left out. Samples so
    few that none are averaged stay as they are, without those that repeat the one before.

    Examples
    --------
    >>> t = np.arange(1000) / 1000.0
    >>> x, at = fewer(np.cos(2 * np.pi * 4.0 * t), t, 4.0)
    >>> x.size, bool(np.abs(x - np.cos(2 * np.pi * 4.0 * at)).max() < 1e-4)
    (100, True)
    """
    step = float(np.median(np.diff(t))) if t.size > 1 else math.inf
    k = max(1, int(1.0 / (POINTS * frequency * step)))
    if k == 1:
        new = ~repeated(x)
        return x[new], t[new]
    whole = t.size // k * k
    groups = t[:whole].reshape(-1, k)
    dense = groups[:, -1] - groups[:, 0] < _PAUSE * k * step
    at = block_means(t, k)
    left = np.cos(2.0 * math.pi * frequency * (groups - at[:, np.newaxis])).mean(axis=1)
    means: FloatArray = x.mean() + block_means(x - x.mean(), k) / left
    return means[dense], at[dense]


def motion_samples(view: RecordView, frequency: float) -> tuple[FloatArray, FloatArray]:
    """Displacement, m, and its times from the record's start, s, without what was not measured.

    On the true times where the clock is uneven; else in means some 24 a period.
    """
    role = motion_role(view)
    if (measured := view.as_measured(role)) is not None:
        t, x = measured
        x, t = fewer(x, t - view.start, frequency)
        if view.quantity(role) == "acceleration":
            x = -x / (2.0 * math.pi * frequency) ** 2
        return x, t
    x, step = displacement_of(view, frequency)
    k = round(step * view.sample_rate)
    known = ~missing_means(view, role, k)
    if k == 1:
        known &= ~repeated(x)
    return x[known], np.asarray(step * np.flatnonzero(known), dtype=np.float64)


def frequency_of_motion(view: RecordView) -> float:
    """Frequency (Hz) of the strongest oscillation of a channel.

    For records in which no oscillation stands out of its surroundings: decays so short that their
    line is broad. What is over long before the record ends stands out in the part that holds it,
    and a window over the whole record would give that part no weight. Where nothing does, the
    channel's own spectrum counts, not that of its velocity: noise, weighed with the frequency,
    would win over a slow decay.

    Raises
    ------
    AnalysisError
        Nothing moves in the channel, or it is shorter than a few samples.
    """
    role = motion_role(view)
    k = max(1, view.n // SPECTRUM)
    x = channel_means(view, role, k)
    if x.size < 16 or not np.ptp(x) > 0.0:
        raise AnalysisError(f"the {role} does not move: nothing oscillates in it")
    rate = view.sample_rate / k
    begin, n = int(np.argmax(np.abs(x - np.median(x)))), x.size // 2
    while n >= _FEWEST:
        try:
            line = dominant_frequency(x[begin : begin + n], rate, quantity=view.quantity(role))
            if SAMPLES * line <= rate:  # else hum, or its alias
                return line
        except AnalysisError:
            pass
        n //= 2
    size = 1 << (x.size - 1).bit_length()
    spectrum = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(x.size), size))
    f = np.fft.rfftfreq(size, 1.0 / rate)
    first = max(1, math.ceil(DRIFT * size / x.size))
    return float(f[first + int(np.argmax(spectrum[first:]))])
