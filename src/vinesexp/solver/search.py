"""First root of a power series, by steps that provably cannot jump over it.

Let p be the gap to a wall on [0, S], p(0) >= 0. With K >= |p''| on [0, S], Taylor's theorem gives
for every s in the interval and every step d

    p(s + d) >= p(s) + p'(s) d - K d^2/2.

The right side is positive up to its own root d* = 2 p / (-p' + sqrt(p'^2 + 2 K p)), so p has no
root in (s, s + d*): the step to s + d* cannot skip one. As p falls to zero with p' < 0 the parabola
becomes the tangent, so the steps converge quadratically, and always from the side where the ball is
still free: the search needs no bracket, sees two roots in one step as easily as one, and a gap that
touches zero and opens again (a graze) costs more steps but is never passed over.

A flight starts where a contact ended, so p(0) = 0 itself, a root that must not be found again: the
exact zeros at the front of the series are divided out first (p/s has the same other roots). Nothing
is restarted "a little later", so the next contact may come as soon as it likes.

These steps are the last resort. Mostly p is clear of zero between its two ends, or up to the root
that Newton's rule finds, and that is proved from its values and slopes there
(`walls.clear_between`).
"""

from __future__ import annotations

import math

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import compiled
from vinesexp.solver.fused import fused
from vinesexp.solver.walls import clear_between

EPS = 2.220446049250313e-16
#: Steps to a root, which take about ten: no polynomial of a motion needs as many.
MOST = 100_000
TRIES = 30  # of Newton's rule, which takes about five


@compiled
def first_root(p: FloatArray, lead: int, limit: float) -> float:
    """First root in (0, limit] of p_lead s^lead + p_(lead+1) s^(lead+1) + ...; inf if there is
    none.

    Only a root at which p falls through (or touches) zero counts: p > 0 before it. A series
    that starts below zero by rounding has its root at 0 if it falls, and none before it has risen.
    """
    if limit <= 0.0:
        return math.inf
    top = p.shape[0] - 1
    while lead < top and p[lead] == 0.0:
        lead += 1
    # Cheap proof that there is none: the positive first term outweighs all that could pull down.
    power, pull = 1.0, 0.0
    for n in range(lead + 1, top + 1):
        power *= limit
        pull = fused(min(p[n], 0.0), power, pull)
    if p[lead] > -pull:
        return math.inf
    if p[lead] < 0.0 or (p[lead] == 0.0 and pull < 0.0):
        return 0.0
    root = guessed_root(p, lead, limit)
    if root > 0.0:
        return root
    return certain_root(p, lead, limit)


@compiled
def at(p: FloatArray, lead: int, s: float) -> tuple[float, float, float]:
    """p/s^lead at s, its slope, and the sum of its terms without their signs."""
    top = p.shape[0] - 1
    value, slope, noise = p[top], 0.0, abs(p[top])
    for n in range(top - 1, lead - 1, -1):
        slope, value = fused(slope, s, value), fused(value, s, p[n])
        noise = fused(noise, s, abs(p[n]))
    return value, slope, noise


@compiled
def guessed_root(p: FloatArray, lead: int, limit: float) -> float:
    """The root that Newton's rule finds, if it is proved to be the first; inf: there is none.

    0: nothing is proved.
    """
    top = p.shape[0] - 1
    fourth, power = 0.0, 1.0
    for n in range(lead + 4, top + 1):
        k = n - lead
        fourth = fused(k * (k - 1) * (k - 2) * (k - 3) * power, abs(p[n]), fourth)
        power *= limit
    rate = p[lead + 1] if lead < top else 0.0
    value, slope, noise = at(p, lead, limit)
    if value > 0.0:
        if clear_between(p[lead], rate, value, slope, limit, fourth):
            return math.inf
        return 0.0
    # From the parabola at the start, which is all of a short flight, else from the chord.
    bend = p[lead + 2] if lead + 1 < top else 0.0
    square = rate * rate - 4.0 * p[lead] * bend
    low, high, s = 0.0, limit, 2.0 * p[lead] / (math.sqrt(max(square, 0.0)) - rate)
    if square < 0.0 or not low < s < high:
        s = limit * p[lead] / (p[lead] - value)
    for _ in range(TRIES):
        value, slope, noise = at(p, lead, s)
        low, high = (s, high) if value > 0.0 else (low, s)
        step = s - value / slope
        if slope < 0.0 and (abs(value) <= 2.0 * EPS * noise or abs(step - s) <= EPS * s):
            return s if clear_between(p[lead], rate, 0.0, slope, s, fourth) else 0.0
        s = step if low < step < high else 0.5 * (low + high)
    return 0.0


@compiled
def certain_root(p: FloatArray, lead: int, limit: float) -> float:
    """`first_root` by steps that cannot pass it."""
    top = p.shape[0] - 1
    power, curvature = 1.0, 0.0
    for n in range(lead + 2, top + 1):
        k = n - lead
        curvature += k * (k - 1) * abs(p[n]) * power
        power *= limit
    s = 0.0
    for _ in range(MOST):
        value, slope, noise = at(p, lead, s)
        if slope < 0.0:
            if value <= 2.0 * EPS * noise:
                return s
            step = 2.0 * value / (-slope + math.sqrt(slope * slope + 2.0 * curvature * value))
        elif curvature > 0.0:
            value = max(value, EPS * noise)
            step = (slope + math.sqrt(slope * slope + 2.0 * curvature * value)) / curvature
        else:
            return math.inf
        if not s + step <= limit:
            return math.inf
        if step <= EPS * s:
            return s
        s += step
    raise ArithmeticError("the search for a contact does not end")
