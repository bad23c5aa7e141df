"""Which clearance to test next, so that the lowest amplitude is bracketed in few tests.

Over clearance the mean amplitude is a valley with one minimum (`vinesexp.clearance.optimum`). The
neighbours of the lowest tested clearance, and of those no higher than tests scatter, bracket it.
The first test goes where the identified rig has its minimum, the next ones a step to either side;
where the lowest is still at the edge, the step doubles, and a wide gap is halved.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from vinesexp.clearance.optimum import TIE

#: Width of the bracket over the clearance that a plan aims at.
TARGET = 0.02
#: Share of half the target by which a step falls short of it: a cavity is never set exactly.
SHORT = 0.95


@dataclass(frozen=True)
class Bracket:
    """The lowest tested clearance and its tested neighbours, m; None: nothing tried beyond.

    `first` and `last` are the ends of those that may be the lowest: neighbours are beside these.
    """

    low: float | None
    best: float
    high: float | None
    first: float
    last: float

    @property
    def width(self) -> float | None:
        """Relative width; None while one side is open."""
        if self.low is None or self.high is None:
            return None
        return (self.high - self.low) / self.best


def bracket_of(tested: Mapping[float, float], *, scatter: float = 0.0) -> Bracket:
    """Bracket of the lowest amplitude among tested clearances, as `lowest_amplitude` finds it.

    Parameters
    ----------
    tested : mapping
        Clearance (m) to mean amplitude (m); not empty.
    scatter : float
        Of amplitudes from test to test, relative.

    Examples
    --------
    >>> bracket_of({0.030: 5.7, 0.032: 5.2, 0.034: 5.3})
    Bracket(low=0.03, best=0.032, high=0.034, first=0.032, last=0.032)
    """
    best = min(sorted(tested), key=tested.__getitem__)
    most = tested[best] * (1.0 + TIE * math.sqrt(2.0) * scatter)
    alike = [b for b in tested if tested[b] <= most]
    first, last = min(alike), max(alike)
    return Bracket(
        max((b for b in tested if b < first), default=None),
        best,
        min((b for b in tested if b > last), default=None),
        first,
        last,
    )


def next_clearance(
    tested: Mapping[float, float], *, expected: float | None, target: float = TARGET,
    scatter: float = 0.0,
) -> float | None:  # fmt: skip
    """The clearance to test next; None where the bracket is narrow enough.

    Parameters
    ----------
    tested : mapping
        Clearance (m) to mean amplitude (m); may be empty.
    expected : float or None
        Where the identified rig has its minimum, m.
    target : float
        Relative width of bracket to reach.
    scatter : float
        As of `bracket_of`.

    Raises
    ------
    ValueError
        Nothing is tested and nothing expected.

    Examples
    --------
    >>> tested = {}
    >>> for _ in range(9):
    ...     b = next_clearance(tested, expected=0.0335)
    ...     if b is None: break
    ...     tested[b] = (b - 0.033) ** 2
    >>> len(tested), round(bracket_of(tested).width, 3)
    (4, 0.019)
    """
    if not tested:
        if expected is None:
            raise ValueError("no clearance was tested and none is predicted")
        return expected
    found = bracket_of(tested, scatter=scatter)
    step = 0.5 * SHORT * target * found.best
    below = None if found.low is None else found.best - found.low
    above = None if found.high is None else found.high - found.best
    reach = 0.5 * target * found.best * (1.0 + 1e-9)
    alike = {-1.0: found.best - found.first, 1.0: found.last - found.best}
    sides = [
        (side, gap) for side, gap in ((-1.0, below), (1.0, above))
        if gap is None or (gap > reach and gap - alike[side] > step)
    ]  # fmt: skip
    if not sides:
        return None
    toward = 0.0 if expected is None else expected - found.best

    def urgency(side: tuple[float, float | None]) -> tuple[bool, float]:
        """An open side before a wide one; of two alike, the one that the minimum is expected on."""
        return side[1] is None, side[0] * toward

    side, gap = max(sides, key=urgency)
    if gap is not None:
        into = _into(gap, step, None if expected is None else side * toward)
        if into < alike[side] + 0.25 * step:  # a test there did not differ
            into = alike[side] + min(step, 0.5 * (gap - alike[side]))
        return found.best + side * into
    other = above if side < 0.0 else below
    # The lowest at the edge of several: it fell all the way here, so go further.
    stride = step if other is None or len(tested) < 4 else max(step, 2.0 * other)
    if expected is not None and side * toward > 1.5 * step:
        stride = max(step, side * toward)  # the minimum is expected beyond: go there
    return found.best + side * min(max(stride, alike[side] + step), 0.5 * found.best)


def _into(gap: float, step: float, ahead: float | None) -> float:
    """How far to go into a gap beside the lowest; the minimum is expected `ahead` of it.

    Expected near the lowest: one step, which ends it if that is right. Expected in the gap: there.
    Expected elsewhere, although the lowest is here: the expectation is off, and half is safest.
    """
    if ahead is not None and -0.5 * step <= ahead <= step:
        return step
    if ahead is not None and step < ahead < gap - 0.5 * step:
        return ahead
    return max(step, 0.5 * gap)


def follow_plan(
    amplitude: Callable[[float], float],
    *,
    expected: float,
    target: float = TARGET,
    scatter: float = 0.0,
    tested: Mapping[float, float] | None = None,
    most: int = 40,
) -> dict[float, float]:
    """Follow the plan on a rig that is known as a function, until the bracket is reached.

    Parameters
    ----------
    amplitude : callable
        Clearance (m) to mean amplitude (m), as a test would measure it.
    expected : float
        Where the minimum is expected, m.
    scatter : float
        As of `bracket_of`.
    tested : mapping, optional
        What is there already, as is returned.
    most : int
        Tests after which to give up, those that are there included.

    Returns
    -------
    dict
        Every test: clearance to amplitude, in the order of the tests.
    """
    seen = dict(tested or {})
    while len(seen) < most:
        b = next_clearance(seen, expected=expected, target=target, scatter=scatter)
        if b is None:
            break
        seen[b] = amplitude(b)
    return seen
