"""Whether a signal is that of a bouncing ball: onsets whose distances shrink by one ratio."""

from __future__ import annotations

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.identification.bounces import Bounces, drops_of
from vinesexp.settings.stages import Settings
from vinesexp.signals.bands import default_bands
from vinesexp.signals.filters import butterworth, zero_phase
from vinesexp.signals.impacts.onsets import detect_onsets
from vinesexp.signals.impacts.stream import Stream

_SHRINKS = 0.03  # standard error of r from which on shrinking flights may be chance
_FEWEST = 5  # hits: any four distances shrink in one order of 24


def bounces_heard(values: FloatArray, sample_rate: float) -> Bounces | None:
    """The longest series of bounces in a signal of any unit, or None where it is something else.

    Parameters
    ----------
    values : array (n,)
        A microphone's or an accelerometer's samples.
    sample_rate : float
        Hz.

    Examples
    --------
    >>> t = np.arange(20000) / 1e4
    >>> hits = 0.1 + 0.4 * np.cumsum(0.8 ** np.arange(7))
    >>> x = sum(k * (t > s) * np.exp(-200 * (t - s).clip(0)) * np.sin(9e3 * (t - s))
    ...         for s, k in zip(hits, 0.8 ** np.arange(7)))
    >>> noise = 1e-3 * np.random.default_rng(0).standard_normal(t.size)
    >>> found = bounces_heard(x + noise, 1e4)
    >>> found is not None and abs(found.r - 0.8) < 0.01
    True
    >>> bounces_heard(np.sin(50 * t), 1e4) is None
    True
    """
    settings = Settings()
    # Hits that are told apart take that long, all together.
    if values.size < max(100.0, (_FEWEST - 2) * settings.drop.rest * sample_rate):
        return None
    low, _ = default_bands(sample_rate=sample_rate, frequency=None, drop=True).displacement
    band = butterworth(sample_rate, low=low, high=None)
    filtered = zero_phase(np.asarray(values - values.mean(), dtype=np.float64), band)
    stream = Stream(lambda begin, end: filtered[begin:end], filtered.size, sample_rate, low)
    hits = detect_onsets(stream, settings.impacts, settings.drop)
    try:
        drops = drops_of(hits.time, hits.time_error)
    except AnalysisError:
        return None
    found = drops[0]
    # Among many hits, as of somebody who walks, a few shrink in order by chance.
    if 2 * sum(one.count for one in drops) < hits.time.size:
        return None
    # Four hits and no other are a ball of a low r; four of more may be chance.
    enough = _FEWEST - 1 if found.count == hits.time.size else _FEWEST
    sure = found.count >= enough and found.error < _SHRINKS and found.r < 1.0 - found.error
    return found if sure else None
