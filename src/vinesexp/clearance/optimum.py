"""The best clearance that was measured, bracketed by the clearances that were tried.

Over clearance the mean amplitude of a periodic test is a valley with a jump: it falls ever more
slowly while two impacts per cycle are permanent, and jumps up where strong modulation sets in. So
two things are measured: where the amplitude is lowest, on the smooth side and never beyond the
jump; and between which tried clearances the jump lies, from the regimes. b_c predicts the jump.

What lies at the edge of what was tried is a bound, not a value.

A release has no single best clearance: each amplitude to be reached has its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from vinesexp.clearance.levels import Tested
from vinesexp.errors import AnalysisError
from vinesexp.theory.regime_definitions import PERMANENT
from vinesexp.theory.regime_definitions import SWINGS as LOSES_THE_BALL
from vinesexp.units import counted

#: Regime of a record in which no impact was found: the ball may rest, or was not seen.
UNSEEN = "no impact"

#: What the edge of what was tried leaves open: the optimum lies at the clearance or below, at it or
#: above, or anywhere.
Bound = Literal["", "at most", "at least", "open"]

#: Swing of the impacts' phase, in periods and over that of the other tests, that leaves it open
#: whether two impacts per cycle are permanent.
_SWINGS, _UNUSUAL = 0.003, 3.0

#: Different clearances that it takes to have one between two others.
FEWEST = 3


@dataclass(frozen=True)
class Optimum:
    """A measured clearance, m, between tried clearances that bracket it.

    Attributes
    ----------
    clearance : the estimate; where `bound` is set, the tried clearance that was best.
    low, high : tried clearances on either side; None where nothing was tried beyond.
    bound : ``at most`` where the best is the smallest that was tried (the optimum may be smaller),
        ``at least`` where it is the largest, ``open`` where both ends are equally good.
    records : ids of the records it came from.
    """

    clearance: float
    low: float | None
    high: float | None
    bound: Bound = ""
    records: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Point:
    """All tests at one clearance: mean value, and whether impacts are permanent in all of them.

    `permanent` is None where no test of them shows a regime.
    """

    clearance: float
    value: float
    permanent: bool | None


def _points(tests: Sequence[Tested]) -> list[_Point]:
    """Tests by clearance; repeats are averaged, as the mean of a level is what counts."""
    found = []
    for clearance in sorted({test.clearance for test in tests}):
        mine = [test for test in tests if test.clearance == clearance]
        values = [test.value for test in mine if test.value is not None]
        if values:
            regimes = [test.regime for test in mine if test.regime]
            permanent = all(regime in PERMANENT for regime in regimes) if regimes else None
            found.append(_Point(clearance, sum(values) / len(values), permanent))
    if len(found) < FEWEST:
        tried = counted(len(found), "clearance")
        raise AnalysisError(f"{tried} tried, expected {FEWEST} or more to have one between two")
    return found


def lowest_amplitude(tests: Sequence[Tested]) -> Optimum:
    """Clearance of lowest mean amplitude in periodic tests at one base amplitude.

    The vertex of the parabola through the lowest point and its neighbours on the smooth side of
    the valley, nowhere beyond the last tried clearance whose impacts are permanent: no curve is
    drawn across the jump. Bracketed by the tried clearances next to the lowest point, which is
    all that a valley of one minimum guarantees.

    Parameters
    ----------
    tests : sequence of Tested
        Mean amplitude, m.

    Raises
    ------
    AnalysisError
        Fewer than three different clearances.

    Examples
    --------
    >>> valley = [Tested(0.030, 5.7, "two symmetric"), Tested(0.032, 5.2, "two symmetric"),
    ...           Tested(0.034, 5.3, "two symmetric"), Tested(0.036, 7.3, "strongly modulated")]
    >>> best = lowest_amplitude(valley)
    >>> round(best.clearance, 4), best.low, best.high, best.bound
    (0.0327, 0.03, 0.034, '')
    """
    points = _points(tests)
    best = min(range(len(points)), key=lambda i: points[i].value)
    low, high = max(best - 1, 0), min(best + 1, len(points) - 1)
    bound: Bound = "at most" if best == 0 else "at least" if best == len(points) - 1 else ""
    return Optimum(
        clearance=points[best].clearance if bound else _vertex(points, best),
        low=None if best == 0 else points[low].clearance,
        high=None if bound == "at least" else points[high].clearance,
        bound=bound,
        records=_records(tests),
    )


def widened(optimum: Optimum, of: Callable[[float], float]) -> Optimum:
    """The bracket by as much wider as the tried clearances are uncertain.

    Parameters
    ----------
    optimum : Optimum
    of : callable
        Half a 95 % interval of a clearance, m.

    Examples
    --------
    >>> wide = widened(Optimum(0.0335, 0.033, 0.034), lambda b: 1e-4)
    >>> round(wide.low, 4), round(wide.high, 4)
    (0.0329, 0.0341)
    """
    low, high = optimum.low, optimum.high
    return replace(
        optimum,
        low=None if low is None else low - of(low),
        high=None if high is None else high + of(high),
    )


def _records(tests: Sequence[Tested]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(test.record for test in tests if test.record))


def _vertex(points: Sequence[_Point], best: int) -> float:
    """Vertex of the parabola on the smooth side of the lowest point, or the point itself."""
    at = points[best].clearance
    if not points[best].permanent:
        return at
    last = best + 1 if best + 1 < len(points) and points[best + 1].permanent else best
    three = points[last - 2 : last + 1] if last >= 2 else []
    if len(three) < 3 or not all(point.permanent for point in three):
        return at
    (b1, a1), (b2, a2), (b3, a3) = ((p.clearance, p.value) for p in three)
    left, right = (a2 - a1) / (b2 - b1), (a3 - a2) / (b3 - b2)
    if right <= left:  # not convex: scatter, no valley
        return at
    vertex = 0.5 * (b1 + b2) - left * (b3 - b1) / 2.0 / (right - left)
    return min(max(vertex, points[max(best - 1, 0)].clearance), three[-1].clearance)


def end_of_permanent(tests: Sequence[Tested]) -> Optimum:
    """Where permanent two impacts per cycle end: between the tried clearances around the jump.

    The lower bound is the largest clearance up to which every test is permanent, the upper one the
    smallest from which none is; the estimate is their middle. Permanent at all of them, or at none,
    is a bound. A test without a found impact says nothing: what was not seen is unknown. Nor does
    one of two impacts per cycle whose phase swings without dying away (`swings`): near its end the
    orbit takes longer to be lost than a record lasts. For the same reason a test whose amplitude
    still moves has no regime here (`levels.periodic_levels`).

    Raises
    ------
    AnalysisError
        Impacts were found at fewer than three different clearances.

    Examples
    --------
    >>> tests = [Tested(0.030, 5.7, "two symmetric"), Tested(0.033, 5.1, "two symmetric"),
    ...          Tested(0.034, 5.3, "strongly modulated"), Tested(0.036, 7.3, "chatter")]
    >>> end = end_of_permanent(tests)
    >>> round(end.clearance, 4), end.low, end.high
    (0.0335, 0.033, 0.034)
    """
    seen = [test for test in tests if test.regime and test.regime != UNSEEN]
    if not seen:
        raise AnalysisError(
            "none of these tests shows how often the ball hits: it did not reach its walls, or the "
            "impacts were not seen (noise, slow sampling, a weak or missing accelerometer); the "
            "end of two impacts per cycle is unknown"
        )
    points, records = _points(seen), _records(seen)
    undecided = {test.clearance for test in swings(seen)}
    if len(points) - len(undecided) >= 1:
        points = [point for point in points if point.clearance not in undecided]
    tried = [point.clearance for point in points]
    permanent = [bool(point.permanent) for point in points]
    first = permanent.index(False) if False in permanent else len(tried)
    last = max((i for i, stays in enumerate(permanent) if stays), default=-1)
    low = tried[first - 1] if first else None
    high = tried[last + 1] if last + 1 < len(tried) else None
    if low is not None and high is not None:
        return Optimum(0.5 * (low + high), low, high, records=records)
    bound: Bound = "at least" if low is not None else "at most" if high is not None else "open"
    at = low if low is not None else high if high is not None else tried[0]
    return Optimum(at, low, high, bound=bound, records=records)


def swings(tests: Sequence[Tested]) -> list[Tested]:
    """Tests of permanent impacts whose phase swings more than that of the others, and stays so.

    What all of them share is the shaker's. A swing that dies away is the start of the test, unless
    it was so large that the ball was lost and caught again: it may be lost again.

    Examples
    --------
    >>> from vinesexp.theory.regime_definitions import PERMANENT
    >>> from vinesexp.theory.regime_definitions import Swing
    >>> steady, swinging = Swing(1e-4, 1e-4), Swing(0.016, 0.016)
    >>> tests = [Tested(0.030, 5.7, "two symmetric", "a", steady),
    ...          Tested(0.034, 5.3, "two symmetric", "b", swinging)]
    >>> [test.record for test in swings(tests)]
    ['b']
    """
    known = [t for t in tests if t.regime in PERMANENT and math.isfinite(t.swing.lasting)]
    if not known:
        return []
    usual = sorted(test.swing.lasting for test in known)[(len(known) - 1) // 2]
    least = max(_SWINGS, _UNUSUAL * usual)
    return [
        test
        for test in known
        if test.swing.lasting > least
        and not (test.swing.settles and test.swing.first <= LOSES_THE_BALL)
    ]


def fastest(tests: Sequence[Tested], *, resolution: float) -> Optimum:
    """Clearance whose release falls to a level first.

    Amplitude is known once a cycle at best, so times closer than `resolution` are ties. The bracket
    goes from the tried clearance before the first tie to the one after the last.

    Parameters
    ----------
    tests : sequence of Tested
        Time, s; None where the level was not reached (such a clearance cannot be the fastest).
    resolution : float
        s; half a period of the oscillator.

    Raises
    ------
    AnalysisError
        Fewer than three different clearances whose release reached the level.

    Examples
    --------
    >>> tests = [Tested(0.02, 3.3), Tested(0.03, 2.8), Tested(0.036, 2.83), Tested(0.04, 3.1)]
    >>> best = fastest(tests, resolution=0.06)
    >>> best.clearance, best.low, best.high
    (0.03, 0.02, 0.04)
    """
    points = _points(tests)
    tried = sorted({test.clearance for test in tests})
    best = min(points, key=lambda point: point.value)
    ties = [point.clearance for point in points if point.value <= best.value + resolution]
    first, last = tried.index(min(ties)), tried.index(max(ties))
    ends = first == 0, last == len(tried) - 1
    bounds: dict[tuple[bool, bool], Bound] = {
        (False, False): "",
        (True, False): "at most",
        (False, True): "at least",
        (True, True): "open",
    }
    return Optimum(
        clearance=best.clearance,
        low=None if ends[0] else tried[first - 1],
        high=None if ends[1] else tried[last + 1],
        bound=bounds[ends],
        records=_records(tests),
    )
