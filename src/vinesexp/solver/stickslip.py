"""Balls that rub on the floor of their cavity: who is held, who slides, and until when.

A ball that slides has the constant acceleration A = tilt + mu g d, d = `WAY` the sign of x' - y':
the floor drags it along, and it drags the oscillator back with m mu g d. So between events the gap
to a wall is the polynomial of x with another second coefficient, and `search.py` finds its first
root as before: a step that cannot pass a root of it exists whatever its coefficients are. The same
search finds where x' - y' comes to zero, which ends the segment, because there the force turns
about. No segment holds more than one direction of any force, so no contact can hide in one.

A ball at rest on the floor is held as long as the force that this takes lies within its bounds,
with p = x'' - tilt the force over m:

    on the floor |p| <= mu g;    at the wall of side S also S p > mu g: the wall pushes.

When several balls are at rest, or the oscillator is held to its base by Coulomb friction, what one
does changes x'' for the others. With every bound inserted, M x'' + sum m clip(p, low, high) = rest
of the forces; the left side grows with x'', so there is exactly one x'' (`acceleration`). Forces
that hold and forces that slide meet where p is at a bound: x'' is continuous there, a slip begins
with x'' - y'' = 0 and opens like the third power of time, and a ball that has just slipped cannot
be caught at once, because x''' keeps its sign (its value is multiplied by (M + m)/M).
"""

from __future__ import annotations

import math

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import compiled
from vinesexp.solver.search import first_root
from vinesexp.solver.state import (
    FREE,
    MASS,
    RELEASED,
    RESTING,
    RHO,
    ROOT,
    RUB,
    SIDE,
    STATE,
    STUCK,
    TILT,
    TURN,
    WALL,
    WAY,
    A,
    D,
)


@compiled
def is_held(balls: FloatArray, i: int) -> bool:
    """Whether the ball moves with the oscillator."""
    held: bool = balls[i, STATE] == RESTING or balls[i, STATE] == STUCK
    return held


@compiled
def may_hold(balls: FloatArray, i: int) -> bool:
    """Whether the ball is at rest on its floor or at a wall, so that it may be held there."""
    if is_held(balls, i):
        return True
    at_rest = balls[i, STATE] == FREE and balls[i, RHO] == 0.0
    waits: bool = at_rest and (balls[i, D] <= 0.0 or balls[i, RUB] > 0.0)
    return waits


@compiled
def bounds(balls: FloatArray, i: int) -> tuple[float, float]:
    """Least and largest p = x'' - tilt at which the ball is held."""
    low, high = -balls[i, RUB], balls[i, RUB]
    if balls[i, D] <= 0.0:
        if balls[i, SIDE] > 0.0:
            high = math.inf
        else:
            low = -math.inf
    return low, high


@compiled
def holding_force(balls: FloatArray, a: float) -> float:
    """Sum of m clip(p, low, high) over the balls that may be held, at x'' = a."""
    total = 0.0
    for i in range(balls.shape[0]):
        if may_hold(balls, i):
            low, high = bounds(balls, i)
            total += balls[i, MASS] * min(max(a - balls[i, TILT], low), high)
    return total


@compiled
def acceleration(balls: FloatArray, M: float, force: float) -> float:
    """x'' under a force, with every ball at rest held or giving way as its bounds say."""
    below, above = -math.inf, math.inf
    for i in range(balls.shape[0]):
        if may_hold(balls, i):
            low, high = bounds(balls, i)
            for bound in (low, high):
                a = balls[i, TILT] + bound
                if math.isinf(a):
                    continue
                if M * a + holding_force(balls, a) <= force:
                    below = max(below, a)
                else:
                    above = min(above, a)
    # Between these two breakpoints the same balls are held, and x'' follows from them.
    mass, rest = M, force
    for i in range(balls.shape[0]):
        if may_hold(balls, i):
            low, high = bounds(balls, i)
            if balls[i, TILT] + low >= above:
                rest -= balls[i, MASS] * low
            elif balls[i, TILT] + high <= below:
                rest -= balls[i, MASS] * high
            else:
                mass += balls[i, MASS]
                rest += balls[i, MASS] * balls[i, TILT]
    return rest / mass


@compiled
def loads(balls: FloatArray) -> tuple[float, float]:
    """Force of the balls on the oscillator and mass of those held; fills in A of all others."""
    force, mass = 0.0, 0.0
    for i in range(balls.shape[0]):
        if is_held(balls, i):
            mass += balls[i, MASS]
            force += balls[i, MASS] * balls[i, TILT]
            balls[i, A] = 0.0
        else:
            drag = balls[i, RUB] * balls[i, WAY]
            balls[i, A] = balls[i, TILT] + drag
            force -= balls[i, MASS] * drag
    return force, mass


@compiled
def next_stop(balls: FloatArray, X: FloatArray, P: FloatArray, limit: float) -> float:
    """First time in (0, limit] at which a sliding ball comes to rest on its floor; fills TURN."""
    first, top = math.inf, X.shape[0] - 1
    for i in range(balls.shape[0]):
        balls[i, TURN] = math.inf
        if is_held(balls, i) or balls[i, RUB] == 0.0:
            continue
        way = balls[i, WAY]
        for n in range(1, top):
            P[n] = way * (n + 1) * X[n + 1]
        P[0], P[top] = way * balls[i, RHO], 0.0
        P[1] -= way * balls[i, A]
        lead = 0
        if balls[i, STATE] == RELEASED:  # x' - y' and x'' - y'' are zero by definition
            P[0] = P[1] = 0.0
            lead = 2
        elif balls[i, RHO] == 0.0:
            lead = 1
        balls[i, TURN] = first_root(P, lead, limit)
        first = min(first, balls[i, TURN])
    return first


@compiled
def next_slip(balls: FloatArray, X: FloatArray, P: FloatArray, limit: float, noise: float) -> float:
    """First time in (0, limit] at which a held ball reaches a bound; fills ROOT, and WALL with +-1.

    `noise` is the rounding error of x''. Where p is that close to a bound and moves away from it,
    the ball has just been caught.
    """
    first, top = math.inf, X.shape[0] - 1
    for i in range(balls.shape[0]):
        if not is_held(balls, i):
            continue
        balls[i, ROOT] = math.inf
        low, high = bounds(balls, i)
        for end in (-1.0, 1.0):
            bound = low if end < 0.0 else high
            if math.isinf(bound):
                continue
            for n in range(top - 1):
                P[n] = -end * (n + 1) * (n + 2) * X[n + 2]
            P[top - 1] = P[top] = 0.0
            P[0] += end * (bound + balls[i, TILT])
            if abs(P[0]) <= noise:
                P[0] = 0.0
            root = first_root(P, 0, limit)
            if root < balls[i, ROOT]:
                balls[i, ROOT], balls[i, WALL] = root, end
        first = min(first, balls[i, ROOT])
    return first
