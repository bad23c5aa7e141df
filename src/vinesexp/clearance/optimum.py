"""The best clearance that was measured, bracketed by the clearances that were tried.

Over clearance the mean amplitude of a periodic test is a valley with a jump: it falls ever more
slowly while two impacts per cycle are permanent, and jumps up where strong modulation sets in. So
two things are measured: where the amplitude is lowest, on the smooth side and never beyond the
jump; and between which tried clearances the jump lies, from the regimes. b_c predicts the jump.

No test is repeated exactly: the amplitude is G times a function of b/G, so that where it falls with
b, it goes with more than G. Clearances whose values differ by no more than tests scatter are ties,
and the optimum lies anywhere between the tried clearances on either side of all of them.

What lies at the edge of what was tried is a bound, not a value.

A release has no single best clearance: each amplitude to be reached has its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import dropwhile
from typing import Literal

import numpy as np

from vinesexp.clearance.levels import Tested
from vinesexp.errors import AnalysisError
from vinesexp.theory.regime_definitions import PERMANENT, Regime
from vinesexp.theory.regime_definitions import SWINGS as LOSES_THE_BALL
from vinesexp.units import counted

#: Regime of a record in which no impact was found: the ball may rest, or was not seen.
UNSEEN = "no impact"

#: What the edge of what was tried leaves open: the optimum lies at the clearance or below, at it or
#: above, or anywhere.
Bound = Literal["", "at most", "at least", "open"]

#: Regimes of a cavity that is too narrow for two impacts per cycle.
_OFTEN = (Regime.MORE.value, Regime.CHATTER.value)

#: Swing of the impacts' phase, in periods and over that of the other tests, that leaves it open
#: whether two impacts per cycle are permanent.
_SWINGS, _UNUSUAL = 0.003, 3.0

#: Different clearances that it takes to have one between two others.
FEWEST = 3

#: Relative scatter of mean amplitudes from test to test before any shows it, worth one difference.
SCATTER = 0.002
#: Standard errors of a difference within which two values are alike.
TIE = 2.0


@dataclass(frozen=True)
class Optimum:
    """A measured clearance, m, between tried clearances that bracket it.

    Attributes
    ----------
    clearance : the estimate; where `bound` is set, the tried clearance that was best.
    low, high : tried clearances on either side; None where none beyond bounds it.
    records : ids of the records it came from.
    alike : tried clearances whose values are the best, or no worse than tests scatter.
    scatter : of the values from test to test, relative; 0 where it was not looked for.
    """

    clearance: float
    low: float | None
    high: float | None
    records: tuple[str, ...] = ()
    alike: tuple[float, ...] = ()
    scatter: float = 0.0

    @property
    def bound(self) -> Bound:
        """``at most`` where the optimum may be smaller than all that was tried, ``at least`` where
        it may be larger, ``open`` where it may be either.
        """
        if self.low is None:
            return "open" if self.high is None else "at most"
        return "at least" if self.high is None else ""


@dataclass(frozen=True)
class _Point:
    """All tests at one clearance: where impacts are permanent in some, the values of those.

    `permanent` is whether they are in any: the others began beside that motion. It is None where no
    test shows a regime.
    """

    clearance: float
    values: tuple[float, ...]
    permanent: bool | None
    often: bool = False  # the ball hits more often than twice a cycle

    @property
    def value(self) -> float:
        return sum(self.values) / len(self.values)

    @property
    def lost(self) -> bool:
        """Two impacts per cycle did not last, from wherever these tests began."""
        return self.permanent is False and not self.often


def _points(tests: Sequence[Tested], *, fewest: int = FEWEST) -> list[_Point]:
    """Tests by clearance; repeats are averaged, as the mean of a level is what counts."""
    found = []
    for clearance in sorted({test.clearance for test in tests}):
        own = [t for t in tests if t.clearance == clearance and t.value is not None]
        regimes = [test.regime for test in own if test.regime]
        stay = [test for test in own if test.regime in PERMANENT]
        values = tuple(test.value for test in stay or own if test.value is not None)
        if values:
            often = any(regime in _OFTEN for regime in regimes)
            permanent = bool(stay) if regimes else None
            found.append(_Point(clearance, values, permanent, often))
    if len(found) < fewest:
        tried = counted(len(found), "clearance")
        raise AnalysisError(f"{tried} tried, expected {fewest} or more to have one between two")
    return found


def amplitudes_of(tests: Sequence[Tested]) -> dict[float, float]:
    """Clearance (m) to the amplitude (m) that `lowest_amplitude` compares, however few there are.

    Examples
    --------
    >>> amplitudes_of([Tested(0.03, 5e-3, "two symmetric"), Tested(0.03, 9e-3, "no impact")])
    {0.03: 0.005}
    """
    return {point.clearance: point.value for point in _points(tests, fewest=0)}


def lowest_amplitude(
    tests: Sequence[Tested],
    *,
    b_c: float | None = None,
    expected: Callable[[float], float] | None = None,
) -> Optimum:
    """Clearance of lowest mean amplitude in periodic tests at one base amplitude.

    The vertex of the parabola through the lowest points and their neighbours on the smooth side of
    the valley, nowhere beyond the last tried clearance whose impacts are permanent: no curve is
    drawn across the jump. Bracketed by the tried clearances next to the lowest point and to those
    no higher than tests scatter (`scatter_of`), which is all that a valley of one minimum
    guarantees. A test that lost two impacts per cycle where they can last began beside that motion,
    and bounds nothing; where all are lost, the valley lies below.

    Parameters
    ----------
    tests : sequence of Tested
        Mean amplitude, m.
    b_c : float, optional
        Clearance up to which two impacts per cycle surely can last, m.
    expected : callable, optional
        Clearance, m, to a predicted amplitude: about it the scatter of the tests is known best, be
        it as wrong as it may.

    Raises
    ------
    AnalysisError
        Fewer than three different clearances, or no test with an impact.

    Examples
    --------
    >>> valley = [Tested(0.030, 5.7, "two symmetric"), Tested(0.032, 5.2, "two symmetric"),
    ...           Tested(0.034, 5.3, "two symmetric"), Tested(0.036, 7.3, "strongly modulated")]
    >>> best = lowest_amplitude(valley)
    >>> round(best.clearance, 4), best.low, best.high, best.bound
    (0.0327, 0.03, 0.034, '')
    """
    points = _points(tests)
    if all(test.regime == UNSEEN for test in tests):
        raise AnalysisError(
            "none of these tests shows an impact: the ball did not reach its walls, and the mass "
            "moved as without it; begin tests with the ball at a wall, or with a larger motion"
        )
    best = min(points, key=lambda point: point.value)
    like = [point for point in points if point.permanent is best.permanent]
    scatter = _scatter(like, expected)
    alike = [p for p in like if p.value <= best.value * (1.0 + TIE * _apart(p, best, scatter))]
    first, last = points.index(alike[0]), points.index(alike[-1])
    below = [point for point in points[:first] if not point.lost]  # the smooth side
    above = [p for p in points[last + 1 :] if not (p.lost and p.clearance < (b_c or 0.0))]
    found = Optimum(
        clearance=best.clearance,
        low=below[-1].clearance if below else None,
        high=above[0].clearance if above else None,
        records=_records(tests),
        alike=tuple(point.clearance for point in alike),
        scatter=scatter,
    )
    if found.bound or not best.permanent:
        return found
    vertex = _vertex(like, best, alike)
    return replace(found, clearance=float(np.clip(vertex, found.low, found.high)))


def scatter_of(tests: Sequence[Tested], expected: Callable[[float], float] | None = None) -> float:
    """Relative scatter of mean amplitudes from test to test, of two impacts per cycle that last.

    Parameters
    ----------
    tests, expected
        As of `lowest_amplitude`.

    Examples
    --------
    >>> tests = [Tested(0.03 + k * 1e-3, 5.0 + 0.1 * (-1) ** k, "two symmetric") for k in range(9)]
    >>> round(scatter_of(tests), 3), scatter_of(tests[:3])
    (0.033, 0.002)
    """
    return _scatter([p for p in _points(tests, fewest=0) if p.permanent], expected)


def _scatter(points: Sequence[_Point], expected: Callable[[float], float] | None) -> float:
    """The same of the means at clearances on a smooth curve.

    Repeated tests show it, and so does what four neighbours leave of a parabola: their third
    divided difference. It is taken of the amplitude over the one that is expected, or over the
    clearance, which bend little. Of few tests the scatter is near `SCATTER`.
    """
    over = expected or float
    points = [point for point in points if point.value > 0.0]  # of no motion there is no share
    squares, count = SCATTER**2, 1
    for point in points:
        squares += sum((value / point.value - 1.0) ** 2 for value in point.values)
        count += len(point.values) - 1
    for four in zip(points, points[1:], points[2:], points[3:], strict=False):
        apart = [math.prod(a.clearance - b.clearance for b in four if b is not a) for a in four]
        parts = [p.value / over(p.clearance) / way for p, way in zip(four, apart, strict=True)]
        each = (part / math.sqrt(len(p.values)) for part, p in zip(parts, four, strict=True))
        squares += (sum(parts) / math.hypot(*each)) ** 2
        count += 1
    return math.sqrt(squares / count)


def _apart(a: _Point, b: _Point, scatter: float) -> float:
    """Standard error of the difference between two mean values, relative."""
    return scatter * math.sqrt(1.0 / len(a.values) + 1.0 / len(b.values))


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


def _vertex(points: Sequence[_Point], best: _Point, alike: Sequence[_Point]) -> float:
    """Vertex of the parabola through those alike and their neighbours, or the lowest itself.

    `points` are all whose impacts are permanent: nothing lies beyond the last of them.
    """
    before, end = points.index(alike[0]) - 1, min(points.index(alike[-1]) + 1, len(points) - 1)
    used = points[max(min(before, end - 2), 0) : end + 1]
    if len(used) < 3:
        return best.clearance
    b = np.array([point.clearance for point in used])
    of = b - b.mean()
    curvature, slope, _ = np.polyfit(of, [point.value for point in used], 2)
    if curvature <= 0.0:  # scatter, no valley
        return best.clearance
    return float(min(b.mean() - 0.5 * slope / curvature, b[-1]))


def end_of_permanent(tests: Sequence[Tested]) -> Optimum:
    """Where permanent two impacts per cycle end: between the tried clearances around the jump.

    The lower bound is the largest clearance at which a test is permanent, the upper one the next at
    which none is; the estimate is their middle. Permanent at the largest, or at none, is a bound. A
    test without a found impact says nothing: what was not seen is unknown. Nor does
    one of two impacts per cycle whose phase swings without dying away (`swings`): near its end the
    orbit takes longer to be lost than a record lasts. For the same reason a test whose amplitude
    still moves has no regime here (`levels.periodic_levels`). In a narrow cavity the ball hits more
    often than twice a cycle: below all permanent ones that is the other end of two impacts.

    Raises
    ------
    AnalysisError
        Impacts were found at fewer than three different clearances, or nowhere as few as two a
        cycle.

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
    records, undecided = _records(seen), set(swings(seen))
    points = _points(seen)  # as many were tried
    if decided := [test for test in seen if test not in undecided]:
        points = _points(decided, fewest=1)
    points = list(dropwhile(lambda one: one.often and not one.permanent, points))
    if not points:
        raise AnalysisError(
            "in all of these tests the ball hits more often than twice a cycle: try larger ones"
        )
    last = max((i for i, point in enumerate(points) if point.permanent), default=-1)
    low = points[last].clearance if last >= 0 else None
    high = points[last + 1].clearance if last + 1 < len(points) else None
    middle = [b for b in (low, high) if b is not None]
    return Optimum(sum(middle) / len(middle), low, high, records=records)


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
    return Optimum(
        clearance=best.clearance,
        low=tried[first - 1] if first else None,
        high=tried[last + 1] if last + 1 < len(tried) else None,
        records=_records(tests),
    )
