"""The best clearance that was measured, bracketed by the clearances that were tried.

Over clearance the mean amplitude of a periodic test is a kinked valley: it falls ever more slowly
while two impacts per cycle are permanent, and jumps up where strong modulation sets in. So two
things are measured: where the amplitude is lowest, on the smooth side and never beyond the kink;
and between which tried clearances the kink lies, from the regimes. b_c predicts the kink.

A release has no single best clearance: each amplitude to be reached has its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from vinesexp.clearance.levels import Tested
from vinesexp.errors import AnalysisError

#: Regimes in which impacts are permanent: the smooth side of the valley.
PERMANENT = ("two symmetric", "two asymmetric")

#: Different clearances that it takes to have one between two others.
FEWEST = 3


@dataclass(frozen=True)
class Optimum:
    """A measured clearance, m, between tried clearances that bracket it.

    Attributes
    ----------
    clearance : the estimate.
    low, high : tried clearances on either side.
    value : the smallest value that was measured (m or s); None where none belongs to it.
    at_edge : the smallest value is at the end of what was tried: the optimum may lie beyond.
    """

    clearance: float
    low: float
    high: float
    value: float | None = None
    at_edge: bool = False


@dataclass(frozen=True)
class _Point:
    """All tests at one clearance: mean value, and whether impacts are permanent in all of them."""

    clearance: float
    value: float
    permanent: bool


def _points(tests: Sequence[Tested]) -> list[_Point]:
    """Tests by clearance; repeats are averaged, as the mean of a level is what counts."""
    found = []
    for clearance in sorted({test.clearance for test in tests}):
        mine = [test for test in tests if test.clearance == clearance]
        values = [test.value for test in mine if test.value is not None]
        if values:
            permanent = all(test.regime in PERMANENT for test in mine)
            found.append(_Point(clearance, sum(values) / len(values), permanent))
    if len(found) < FEWEST:
        raise AnalysisError(
            f"{len(found)} clearances tried, expected {FEWEST} or more to have one between two"
        )
    return found


def lowest_amplitude(tests: Sequence[Tested]) -> Optimum:
    """Clearance of lowest mean amplitude in periodic tests at one base amplitude.

    The vertex of the parabola through the lowest point and its neighbours on the smooth side of
    the valley, nowhere beyond the last tried clearance whose impacts are permanent: no curve is
    drawn across the kink. Bracketed by the tried clearances next to the lowest point, which is
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
    >>> round(best.clearance, 4), best.low, best.high, best.at_edge
    (0.0327, 0.03, 0.034, False)
    """
    points = _points(tests)
    best = min(range(len(points)), key=lambda i: points[i].value)
    low, high = max(best - 1, 0), min(best + 1, len(points) - 1)
    return Optimum(
        clearance=_vertex(points, best),
        low=points[low].clearance,
        high=points[high].clearance,
        value=points[best].value,
        at_edge=best in (0, len(points) - 1),
    )


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
    """Where permanent two impacts per cycle end: between the tried clearances around the kink.

    The lower bound is the largest clearance up to which every test is permanent, the upper one the
    smallest from which none is; the estimate is their middle.

    Raises
    ------
    AnalysisError
        Fewer than three different clearances; impacts permanent at none of them, or at all.

    Examples
    --------
    >>> tests = [Tested(0.030, 5.7, "two symmetric"), Tested(0.033, 5.1, "two symmetric"),
    ...          Tested(0.034, 5.3, "strongly modulated"), Tested(0.036, 7.3, "chatter")]
    >>> end = end_of_permanent(tests)
    >>> round(end.clearance, 4), end.low, end.high
    (0.0335, 0.033, 0.034)
    """
    points = _points(tests)
    permanent = [point.permanent for point in points]
    if not any(permanent):
        raise AnalysisError(
            f"two impacts per cycle are permanent at no tried clearance "
            f"({_span(points)}); try smaller ones"
        )
    if all(permanent):
        raise AnalysisError(
            f"two impacts per cycle are permanent at every tried clearance "
            f"({_span(points)}); try larger ones"
        )
    last = max(i for i, stays in enumerate(permanent) if stays)
    first = permanent.index(False)
    if last + 1 == len(points):
        raise AnalysisError(
            f"two impacts per cycle are permanent at the largest tried clearance "
            f"({1e3 * points[-1].clearance:.4g} mm); try larger ones"
        )
    if first == 0:
        raise AnalysisError(
            f"two impacts per cycle are not permanent at the smallest tried clearance "
            f"({1e3 * points[0].clearance:.4g} mm); try smaller ones"
        )
    low, high = points[first - 1].clearance, points[last + 1].clearance
    return Optimum(0.5 * (low + high), low, high)


def _span(points: Sequence[_Point]) -> str:
    return f"{1e3 * points[0].clearance:.4g} to {1e3 * points[-1].clearance:.4g} mm"


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
        low=tried[max(first - 1, 0)],
        high=tried[min(last + 1, len(tried) - 1)],
        value=best.value,
        at_edge=first == 0 or last == len(tried) - 1,
    )
