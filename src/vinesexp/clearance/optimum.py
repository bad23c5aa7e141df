"""The best clearance that was measured: where the amplitude is smallest, and how sure that is.

Over clearance the mean amplitude of a periodic test is a kinked valley: it falls slowly while two
impacts per cycle are permanent, and jumps up where strong modulation sets in. The clearances
between which that happens bracket the optimum; no curve is fitted across the kink.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from vinesexp.errors import AnalysisError

#: Regimes in which impacts are permanent: the left slope of the valley.
PERMANENT = ("two symmetric", "two asymmetric", "three or more per cycle")

#: Clearances of one level that it takes to have one between two others.
FEWEST = 3


@dataclass(frozen=True)
class Tested:
    """One tested clearance, m, with what is to be made small (m or s) and its regime."""

    clearance: float
    value: float
    regime: str = ""
    record: str = ""

    __test__ = False  # not for pytest


@dataclass(frozen=True)
class Optimum:
    """The best clearance tested, m, between the clearances that bound the true one.

    Attributes
    ----------
    clearance : the tested clearance with the smallest value.
    low, high : tested clearances that bracket the optimum.
    value : the smallest value.
    at_edge : the smallest value is at the end of what was tested: the optimum may lie beyond.
    """

    clearance: float
    low: float
    high: float
    value: float
    at_edge: bool


def bracketed_minimum(tests: Sequence[Tested]) -> Optimum:
    """Smallest value over tested clearances, bracketed by its neighbours.

    Repeated clearances are averaged.

    Raises
    ------
    AnalysisError
        Fewer than three different clearances.

    Examples
    --------
    >>> valley = [Tested(0.02, 3.0), Tested(0.03, 1.0), Tested(0.04, 2.0)]
    >>> bracketed_minimum(valley)
    Optimum(clearance=0.03, low=0.02, high=0.04, value=1.0, at_edge=False)
    """
    by_clearance: dict[float, list[float]] = {}
    for test in tests:
        by_clearance.setdefault(test.clearance, []).append(test.value)
    clearances = sorted(by_clearance)
    if len(clearances) < FEWEST:
        raise AnalysisError(
            f"{len(clearances)} clearances tested, expected {FEWEST} or more to bracket the best"
        )
    values = [sum(by_clearance[b]) / len(by_clearance[b]) for b in clearances]
    best = min(range(len(values)), key=values.__getitem__)
    return Optimum(
        clearance=clearances[best],
        low=clearances[max(best - 1, 0)],
        high=clearances[min(best + 1, len(clearances) - 1)],
        value=values[best],
        at_edge=best in (0, len(clearances) - 1),
    )


def kinked_valley(tests: Sequence[Tested]) -> Optimum:
    """Optimum of periodic tests: the smallest amplitude, its bracket narrowed by the regimes.

    The optimum is the kink, so it cannot lie left of the largest clearance whose impacts are
    still permanent if the amplitude there is the smallest of the permanent ones, nor right of the
    smallest clearance at which they no longer are.

    Examples
    --------
    >>> tests = [Tested(0.030, 5.7, "two symmetric"), Tested(0.033, 5.1, "two symmetric"),
    ...          Tested(0.034, 5.3, "strongly modulated"), Tested(0.036, 7.3, "strongly modulated")]
    >>> best = kinked_valley(tests)
    >>> best.clearance, best.low, best.high
    (0.033, 0.033, 0.034)
    """
    optimum = bracketed_minimum(tests)
    permanent = [test for test in tests if test.regime in PERMANENT]
    modulated = [test.clearance for test in tests if test.regime not in PERMANENT]
    low, high = optimum.low, optimum.high
    if permanent:
        last = max(permanent, key=lambda test: test.clearance)
        if last.value <= min(test.value for test in permanent):
            low = max(low, min(last.clearance, optimum.clearance))
    beyond = [b for b in modulated if b >= max((t.clearance for t in permanent), default=0.0)]
    if beyond:
        high = max(min(high, min(beyond)), optimum.clearance)
    return Optimum(optimum.clearance, low, high, optimum.value, optimum.at_edge)
