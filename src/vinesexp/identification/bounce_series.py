"""Series of bounces among the hits of a record: flights that shrink alike, by more than chance.

Between drops a microphone hears steps, speech and things put down. Four hits of those, too, may
follow one another in shrinking distances; among thirty hits some do. So a series counts only where
so good an agreement is unlikely among all that was heard.
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.arrays import FloatArray

_ALIKE = 0.25  # by which the ratios of successive flights may differ from their median, relative
_LEAST_RATIO = 0.2  # below it the difference is counted from this
#: Logarithms of the distances of hits that are no bounces scatter over such a range.
_RANGE = 1.5
_EXACT = 0.005  # no flight of a real ball agrees better with the others, relative


def series_of_flights(times: FloatArray) -> list[slice]:
    """Stretches of hits whose flights shrink alike, the longest first; no hit is in two.

    A missed bounce makes one flight far too long: the series ends there.

    Parameters
    ----------
    times : array (n,)
        Of the hits, rising, s.

    Returns
    -------
    list of slice
        Of two flights or more.

    Examples
    --------
    >>> first = 0.5 * np.concatenate([[0.0], np.cumsum(0.8 ** np.arange(5))])
    >>> second = 4.0 + 0.4 * np.concatenate([[0.0], np.cumsum(0.5 ** np.arange(4))])
    >>> series_of_flights(np.concatenate([first, second]))
    [slice(0, 6, None), slice(6, 11, None)]
    """
    flights = np.diff(times)
    found = [
        (end - begin, slice(begin, end + 1))
        for begin in range(flights.size)
        if (end := _end_of_run(flights, begin)) - begin >= 2
    ]
    kept: list[slice] = []
    taken = np.zeros(times.size, dtype=bool)
    for _, one in sorted(found, key=lambda pair: (-pair[0], pair[1].start)):
        if not taken[one].any():
            taken[one] = True
            kept.append(one)
    return kept


def _end_of_run(flights: FloatArray, begin: int) -> int:
    """One past the last flight of the run that begins with a flight."""
    ratios: list[float] = []
    end = begin + 1
    while end < flights.size:
        ratio = float(flights[end] / flights[end - 1]) if flights[end - 1] > 0.0 else math.inf
        usual = float(np.median(ratios)) if ratios else ratio
        if ratio >= 1.0 or abs(ratio - usual) > _ALIKE * max(usual, _LEAST_RATIO):
            break
        ratios.append(ratio)
        end += 1
    return end


def chance_of_series(flights: FloatArray, others: int) -> float:
    """Probability that as many other hits hold flights which shrink as evenly by chance.

    Logarithms of even flights lie on a straight line. Each beyond the second may miss it; by chance
    it does so anywhere within the range of all distances.

    Parameters
    ----------
    flights : array (n,)
        s.
    others : int
        Hits of the record that belong to no bounces; 0: the record holds the series alone.

    Examples
    --------
    >>> even = 0.5 * 0.8 ** np.arange(6)
    >>> chance_of_series(even, 30) < 1e-6, chance_of_series(np.array([0.5, 0.33, 0.25]), 30) > 0.5
    (True, True)
    """
    freedom = flights.size - 2
    if freedom < 1 or not others:
        return 0.0 if freedom > 0 else 1.0
    k = np.arange(flights.size)
    logs = np.log(flights)
    rest = logs - np.polyval(np.polyfit(k, logs, 1), k)
    miss = max(float(np.sqrt((rest**2).sum())), _EXACT * math.sqrt(freedom)) / _RANGE
    # Volume of the ball of this radius in as many dimensions as flights can miss.
    volume = math.pi ** (0.5 * freedom) / math.gamma(0.5 * freedom + 1.0)
    return float(min(1.0, others * volume * miss**freedom))
