"""The next contact, of a power series or of the closed form, by steps that cannot jump over it.

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
(`clear_between`).

In the closed form a bound S on the fourth derivative of x, which is that of every gap, does the
same: `clear_between`, and from one point alone

    gap(s + d) >= Q(d) = g + g1 d + g2 d^2/2 + g3 d^3/6 - S d^4/24,   S >= |x''''| for d <= reach.

`open_until` proves that Q has no root on [0, d]: a polynomial lies in the convex hull of its
Bernstein coefficients there, so it is positive if all five are.

S: x'''' = f = f_p + f_h with f_p'' = -w^2 f_p and f_h'' = -2 alpha f_h' - w0^2 f_h. The free part
cannot grow: F = sqrt(f_h^2 + f_h'^2/w0^2) never rises. So |f| <= w^4 P + F; and since f'' + w^2 f
is only (w^2 - w0^2) f_h - 2 alpha f_h', also

    |f(s + d)| <= sqrt(f^2 + f'^2/w^2) + d F (|w^2 - w0^2| + 2 alpha w0)/w,

which near resonance, where the two parts nearly cancel, is much sharper. The smaller one is taken.
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import apart, compiled, fused


@compiled
def clear_between(g0: float, r0: float, g1: float, r1: float, h: float, S: float) -> bool:
    """Whether a gap stays open between two points h apart: gaps g >= 0 and their rates r there.

    Between them it differs from the cubic through both by s^2 (h - s)^2/24 times its fourth
    derivative, |.| <= S: by S h^4/384 at most, and by nothing at the ends. The cubic over either
    half lies above its Bernstein coefficients; those but the ends have to be above that.
    """
    first, last = fused(h * (1.0 / 6.0), r0, g0), fused(h * (-1.0 / 6.0), r1, g1)
    middle = fused(h * (1.0 / 12.0), r0 - r1, 0.25 * (g0 + g1))  # half of that of the whole cubic
    least = min(min(first, last), min(fused(0.5, first, middle), fused(0.5, last, middle)))
    return least > S * (h * h) * (h * h) * (1.0 / 384.0)


@compiled
def open_until(g: float, g1: float, g2: float, g3: float, S: float, d: float) -> bool:
    """Whether Q > 0 on (0, d], g >= 0: all Bernstein coefficients positive (the first may be 0)."""
    # The Bernstein coefficients from those of the powers 1, 2, 3 over 4, 12 and 24.
    a1, a2, a3 = 0.25 * d * g1, d * d * (1.0 / 12.0) * g2, d * d * d * (1.0 / 24.0) * g3
    b1 = g + a1
    b2 = fused(2.0, a1, g) + a2
    b3 = fused(3.0, a1, g) + fused(3.0, a2, a3)
    b4 = fused(4.0, a1, g) + fused(6.0, a2, 4.0 * a3) - S * (d * d) * (d * d) * (1.0 / 24.0)
    return b1 > 0.0 and b2 > 0.0 and b3 > 0.0 and b4 > 0.0


EPS = 2.220446049250313e-16
FOURTH = np.array([float(n * (n - 1) * (n - 2) * (n - 3)) for n in range(41)])
#: Steps to a root, which take about ten: no polynomial of a motion needs as many.
MOST = 100_000
TRIES = 30  # of Newton's rule, which takes about five


@apart
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
def most_of_fourth(p: FloatArray, lead: int, limit: float) -> float:
    """A bound on the fourth derivative of p/s^lead in (0, limit]."""
    most = 0.0
    for n in range(p.shape[0] - 1, lead + 3, -1):
        most = fused(most, limit, FOURTH[n - lead] * abs(p[n]))
    return most


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
    fourth = most_of_fourth(p, lead, limit)
    rate = p[lead + 1] if lead < top else 0.0
    value, slope, noise = at(p, lead, limit)
    if value > 0.0:
        if clear_between(p[lead], rate, value, slope, limit, fourth):
            return math.inf
        return 0.0
    # From the parabola at the start, which is all of a short flight, else from the cubic between.
    bend = p[lead + 2] if lead + 1 < top else 0.0
    square = rate * rate - 4.0 * p[lead] * bend
    low, high, s = 0.0, limit, 2.0 * p[lead] / (math.sqrt(max(square, 0.0)) - rate)
    if square < 0.0 or not low < s < high:
        fall = (value - p[lead]) / limit
        c2 = (3.0 * fall - 2.0 * rate - slope) / limit
        c3 = (rate + slope - 2.0 * fall) / (limit * limit)
        s = root_of_cubic(p[lead], rate, c2, c3, limit)
    for _ in range(TRIES):
        value, slope, noise = at(p, lead, s)
        low, high = (s, high) if value > 0.0 else (low, s)
        step = s - value / slope
        if slope < 0.0 and (abs(value) <= 2.0 * EPS * noise or abs(step - s) <= EPS * s):
            return s if clear_between(p[lead], rate, 0.0, slope, s, fourth) else 0.0
        s = step if low < step < high else 0.5 * (low + high)
    return 0.0


@compiled
def root_of_cubic(g0: float, r0: float, c2: float, c3: float, h: float) -> float:
    """About where a gap g0 + r0 s + c2 s^2 + c3 s^3 closes that is open at 0 and not at h."""
    low, high, s = 0.0, h, 0.5 * h
    for _ in range(6):
        value = fused(s, fused(s, fused(s, c3, c2), r0), g0)
        low, high = (s, high) if value > 0.0 else (low, s)
        s -= value / fused(s, fused(s, 3.0 * c3, 2.0 * c2), r0)
        if not low < s < high:
            s = 0.5 * (low + high)
    return s


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
