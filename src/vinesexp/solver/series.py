"""Power series of the motion of a linear oscillator: any base motion, no tolerance.

Between impacts M x'' + c (x' - x_e') + k (x - x_e) = forces. The Taylor coefficients of x follow
one from the other,

    M (n+1)(n+2) X_(n+2) = k E_n + c (n+1) E_(n+1) - k X_n - c (n+1) X_(n+1),

from those of x_e, E_n, which are known in closed form (chirp, polynomial). A segment of length
h = theta/rate, with `rate` the larger of the system's own rate and that of the base, is cut at
order N: the remainder is below theta^(N+1)/(N+1)! = 2e-18 of the amplitude, less than rounding. So
the motion is exact in double precision and there is no step to choose; `kernel.py` does the same in
closed form where there is one, and each is the test of the other.

Of an oscillator that is not linear, or carries a constant force besides, the recursion has three
terms more, z = x - x_e:

    M (n+1)(n+2) X_(n+2) = ... + F [n = 0] - d q (z'^2)_n - d f [n = 0] - k3 (z^3)_n,

with d the sign of z', quadratic damping q, Coulomb friction f, cubic stiffness k3 and the force F
of balls that rub. The squares and the cube are Cauchy products. These series have a radius of
convergence that is not known beforehand, so a segment also ends where its last two coefficients say
that what is cut off could exceed 5e-18 of the motion; that estimate, not a proof, is what bounds
the error here. It also ends where z' changes its sign, which is a root found like a contact.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import apart, compiled, entry, fused
from vinesexp.solver.search import first_root
from vinesexp.solver.state import (
    ALLOWANCE,
    POLYNOMIAL,
    Parameters,
    Records,
)

# Order of a series; of one that no segment needs to hold for long; of one with products.
ORDER, LOW, HIGH = 20, 12, 30
#: Of a series by its number of coefficients. What is longer than 1.25 rad costs digits.
THETA = np.array(
    [0.0] + [min(1.25, (2e-18 * math.factorial(n)) ** (1.0 / n)) for n in range(1, HIGH + 2)]
)
PER = 1.0 / np.arange(1.0, 42.0)  # 1/(n + 1): a division would be most of a recursion


@compiled
def piece_at(table: FloatArray, t: float) -> int:
    """Number of the piece that holds t; the first before all of them, the last after."""
    low, high = 0, table.shape[0]
    while high - low > 1:
        middle = (low + high) // 2
        if table[middle, 0] <= t:
            low = middle
        else:
            high = middle
    return low


@compiled
def expand_base(kind: int, row: FloatArray, since: float, E: FloatArray) -> float:
    """Taylor coefficients of x_e at `since` seconds into the piece; the rate of its motion,
    rad/s."""
    top = E.shape[0] - 1
    if kind == POLYNOMIAL:
        degree = row.shape[0] - 2
        for n in range(top + 1):
            E[n] = row[n + 1] if n <= degree else 0.0
        for i in range(degree):  # Taylor shift by repeated synthetic division
            for n in range(degree - 1, i - 1, -1):
                E[n] += since * E[n + 1]
        return 0.0
    amplitude, chirp = row[1], row[4]
    omega = row[3] + chirp * since
    if amplitude == 0.0:
        for n in range(top + 1):
            E[n] = 0.0
        return 0.0
    angle = row[2] + (row[3] + 0.5 * chirp * since) * since
    sine, cosine = amplitude * math.sin(angle), amplitude * math.cos(angle)
    sine_old, cosine_old = 0.0, 0.0
    E[0] = sine
    for n in range(top):
        turn, drift = omega * PER[n], chirp * PER[n]
        sine_new = fused(turn, cosine, drift * cosine_old)
        cosine_new = -fused(turn, sine, drift * sine_old)
        sine_old, cosine_old, sine, cosine = sine, cosine, sine_new, cosine_new
        E[n + 1] = sine
    rate: float = abs(omega) + math.sqrt(2.0 * abs(chirp))
    return rate


@compiled
def own_rate(mass: float, c: float, k: float) -> float:
    """Modulus of the largest eigenvalue of the oscillator, 1/s."""
    half, w2 = 0.5 * c / mass, k / mass
    if half * half <= w2:
        return math.sqrt(w2)
    return half + math.sqrt(half * half - w2)


@compiled
def from_power(X: FloatArray, s: float, first: int) -> tuple[float, float]:
    """Sums of X_n s^n and of n X_n s^(n-1) from n = `first` >= 1."""
    total, rate, power = 0.0, 0.0, 1.0
    for n in range(X.shape[0] - 1, first - 1, -1):
        rate, total = fused(rate, s, total), fused(total, s, X[n])
    for _ in range(first - 1):
        power *= s
    return total * power * s, fused(rate, s, first * total) * power


@compiled
def place_at(X: FloatArray, s: float) -> tuple[float, float, float]:
    """The series with its first and second derivative at s."""
    x, v, half = 0.0, 0.0, 0.0
    for n in range(X.shape[0] - 1, -1, -1):
        half, v, x = fused(half, s, v), fused(v, s, x), fused(x, s, X[n])
    return x, v, 2.0 * half


CUT_OFF = 3e-17  # of the motion, the last term: the terms fall by a factor of 7 or more there
AT_REST = 1e-13  # z' over the speeds it is the difference of: no more than their rounding
# rad: a slip that friction ends within this time has ended. Twice `events.REMAINDER`: the sum
# of a chatter may carry the oscillator beyond the end of its slip, where the wall would pull the
# ball; it would leave the wall and chatter again, for ever.
ENDING = 2e-8


@compiled
def is_at_rest(par: Parameters, mass: float, E: FloatArray, X: FloatArray) -> bool:
    """Whether the oscillator moves with the base, so that Coulomb friction may hold it there."""
    if par.coulomb == 0.0:
        return False
    rate = own_rate(mass, par.damping, par.stiffness)
    speed = abs(X[1]) + abs(E[1]) + rate * abs(X[0])
    # A ball that bounces on an oscillator at rest makes it slip for ever shorter times.
    ending = ENDING * par.coulomb / (mass * rate)
    rests: bool = abs(X[1] - E[1]) <= max(AT_REST * speed, ending)
    return rests


@compiled
def spring_force(par: Parameters, E: FloatArray, X: FloatArray) -> float:
    """Force of the spring on the oscillator, N."""
    z = X[0] - E[0]
    force: float = -z * (par.stiffness + par.cubic * z * z)
    return force


@compiled
def moving_way(
    par: Parameters, mass: float, force: float, E: FloatArray, X: FloatArray
) -> tuple[float, bool]:
    """Sign of z' by which friction acts, 0 where it holds; whether z' is zero now."""
    if not is_at_rest(par, mass, E, X):
        return math.copysign(1.0, X[1] - E[1]), False
    excess = force + spring_force(par, E, X) - mass * 2.0 * E[2]
    if abs(excess) <= par.coulomb:
        return 0.0, True
    return math.copysign(1.0, excess), True


@compiled
def fill_linear(
    par: Parameters, mass: float, force: float, E: FloatArray, X: FloatArray
) -> None:  # fmt: skip
    """Coefficients X_2... from X_0, X_1 of a linear oscillator under a constant force."""
    damping, stiffness, more = par.damping / mass, par.stiffness / mass, force / mass
    last, z = X[0] - E[0], X[1] - E[1]
    for n in range(X.shape[0] - 2):
        pull = fused(-stiffness, last, more) * (PER[n] * PER[n + 1])
        here = fused(-damping * PER[n + 1], z, pull)
        X[n + 2], last, z, more = here, z, here - E[n + 2], 0.0


def _recursion(top: int, quadratic: bool, cubic: bool) -> Any:
    """Fill X_2... to order `top` from X_0, X_1 with products of series, written out term by term.

    Loops over products as short as these would take several times as long.
    """

    @intrinsic
    def fill(typing: Any, X: Any, E: Any, damping: Any, stiffness: Any, q: Any, k: Any, more: Any
             ) -> Any:  # fmt: skip
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> None:
            number = context.get_value_type(types.float64)
            X, E = (
                context.make_array(kind)(context, builder, value).data
                for kind, value in zip(signature.args[:2], arguments[:2], strict=True)
            )
            damping, stiffness, q, k, more = (builder.fneg(value) for value in arguments[2:])
            place, fma = context.get_constant, builder.fma

            def at(array: Any, n: int) -> Any:
                return builder.gep(array, [place(types.intp, n)])

            def dot(left: list[Any], right: list[Any]) -> Any:
                """Sum of left_j right_j, those known last at the end."""
                total = number(0.0)
                for a, b in zip(left, right, strict=True):
                    total = fma(a, b, total)
                return total

            def square(series: list[Any]) -> Any:
                """The last coefficient of the square of what is known of a series."""
                n, half = len(series), len(series) // 2
                total = dot(series[:half][::-1], series[n - half :])
                total = builder.fadd(total, total)
                return fma(series[half], series[half], total) if n % 2 else total

            Z = [builder.fsub(builder.load(at(X, n)), builder.load(at(E, n))) for n in (0, 1)]
            S: list[Any] = []
            W: list[Any] = []
            more = builder.fneg(more)
            for n in range(top - 1):
                if quadratic:
                    W.append(builder.fmul(number(n + 1.0), Z[n + 1]))
                    more = fma(q, square(W[1:-1] if n > 0 else W), more)
                    if n == 1:  # 2 W_0 W_n, known last, acts like a damper
                        damping = fma(builder.fadd(W[0], W[0]), q, damping)
                if cubic:
                    S.append(square(Z[: n + 1]))
                    half = n // 2
                    early = dot(S[:half][::-1], Z[n + 1 - half : n + 1])
                    late = dot(S[half:], Z[: n + 1 - half][::-1])
                    more = fma(k, builder.fadd(early, late), more)
                pull = builder.fmul(fma(stiffness, Z[n], more), number(PER[n] * PER[n + 1]))
                here = fma(builder.fmul(damping, number(PER[n + 1])), Z[n + 1], pull)
                builder.store(here, at(X, n + 2))
                Z.append(builder.fsub(here, builder.load(at(E, n + 2))))
                more = number(0.0)

        return types.void(X, E, *[types.float64] * 5), generate

    return fill


fill_quadratic, fill_cubic = _recursion(HIGH, True, False), _recursion(HIGH, False, True)
fill_both, fill_low = _recursion(HIGH, True, True), _recursion(LOW, True, True)


@compiled
def fill_nonlinear(
    par: Parameters, mass: float, force: float, direction: float, E: FloatArray, X: FloatArray
) -> None:
    """Coefficients X_2... from X_0, X_1; `direction` is the sign of z'."""
    quadratic, cubic = direction * par.quadratic / mass, par.cubic / mass
    more = force - direction * par.coulomb
    damping, stiffness = par.damping / mass, par.stiffness / mass
    if cubic == 0.0 and quadratic == 0.0:
        fill_linear(par, mass, more, E, X)
    elif X.shape[0] == LOW + 1:
        fill_low(X, E, damping, stiffness, quadratic, cubic, more / mass)
    elif cubic == 0.0:
        fill_quadratic(X, E, damping, stiffness, quadratic, cubic, more / mass)
    elif quadratic == 0.0:
        fill_cubic(X, E, damping, stiffness, quadratic, cubic, more / mass)
    else:
        fill_both(X, E, damping, stiffness, quadratic, cubic, more / mass)


@compiled
def follow_base(
    par: Parameters, mass: float, pull: float, E: FloatArray, X: FloatArray, P: FloatArray,
    limit: float,
) -> float:  # fmt: skip
    """Series of an oscillator that Coulomb friction holds to the base; how far it does, s.

    `pull` is what the friction has to balance now, all but the inertia.
    """
    for n in range(1, X.shape[0]):
        X[n] = E[n]
    excess = pull - mass * 2.0 * E[2]
    sign = 1.0 if excess >= 0.0 else -1.0
    reach = limit
    for side in (sign, -sign):
        for n in range(X.shape[0] - 2):
            P[n] = side * mass * (n + 1) * (n + 2) * E[n + 2]
        P[0] += par.coulomb - side * pull
        P[X.shape[0] - 2] = P[X.shape[0] - 1] = 0.0
        reach = min(reach, first_root(P, 0, limit))
    return max(reach, 1e-15 * limit)


@compiled
def stiffest(par: Parameters, mass: float, E: FloatArray, X: FloatArray) -> float:
    """Largest stiffness |k1| + 3 |k3| z^2 that the motion can reach with the energy it has, N/m.

    The largest z^2 solves k3 z^4/4 + k1 z^2/2 = H, with both springs taken as stiffening. A
    softening one has lost its force at z^2 = -k1/k3; at four times that nothing brings it back.
    """
    cubic, k = abs(par.cubic), par.stiffness
    if cubic == 0.0:
        return float(k)
    square, speed = (X[0] - E[0]) ** 2, X[1] - E[1]
    if par.cubic * square < -4.0 * k:
        raise OverflowError("the spring gives way")
    H = 0.5 * mass * speed * speed + square * (0.5 * k + 0.25 * cubic * square)
    return float(k + 3.0 * cubic * 4.0 * H / (k + math.sqrt(k * k + 4.0 * cubic * H)))


@apart
def expand(
    par: Parameters, mass: float, force: float, rate: float, x: float, v: float, E: FloatArray,
    X: FloatArray, P: FloatArray | None,
) -> float:  # fmt: skip
    """Fill the series of x at (x, v) under a constant force; how far it holds, s.

    `E` is that of x_e, of a motion as fast as `rate`. `P` is scratch space, as long; None: the
    oscillator is linear, and what it need not know is not compiled.
    """
    X[0], X[1] = x, v
    if P is None:
        fill_linear(par, mass, force, E, X)
        return float(THETA[X.shape[0]] / max(rate, own_rate(mass, par.damping, par.stiffness)))
    return expand_weak(par, mass, force, rate, E, X, P)


@compiled
def expand_weak(
    par: Parameters, mass: float, force: float, rate: float, E: FloatArray, X: FloatArray,
    P: FloatArray,
) -> float:  # fmt: skip
    """`expand` with weak damping and a cubic spring."""
    fastest = max(rate, own_rate(mass, par.damping, stiffest(par, mass, E, X)))
    limit = float(THETA[X.shape[0]] / fastest)
    direction, rests = moving_way(par, mass, force, E, X)
    damped = par.quadratic != 0.0 or par.coulomb != 0.0
    if rests:
        X[1] = E[1]
    if direction == 0.0:
        return follow_base(par, mass, force + spring_force(par, E, X), E, X, P, limit)
    if not damped:
        direction = 0.0
    fill_nonlinear(par, mass, force, direction, E, X)
    reach, top = limit, X.shape[0] - 1
    if damped or par.cubic != 0.0:
        scale = 0.0
        for n in range(6, -1, -1):
            scale = fused(scale, limit, abs(X[n]))
        last = max(abs(X[top]), abs(X[top - 1]) * limit)
        if last > 0.0:
            reach = min(reach, (CUT_OFF * scale / last) ** (1.0 / top))
    if not damped:
        return reach
    for n in range(top):
        P[n] = direction * (n + 1) * (X[n + 1] - E[n + 1])
    P[top] = 0.0
    # The least step keeps the search from standing still; it stays within what counts as at rest.
    return max(min(reach, first_root(P, 1 if rests else 0, reach)), 1e-15 * limit)


@entry
def sample(
    par: Parameters, kind: int, table: FloatArray, events: Records, times: FloatArray,
    pace: float, work: FloatArray, P: FloatArray | None, x: FloatArray, v: FloatArray,
    a: FloatArray,
) -> float:  # fmt: skip
    """x, x', x'' at sorted times; `events`: the log.

    `P` is that of `expand`. Returns inf, or the time at which ALLOWANCE segments lay within `pace`
    seconds, with no event between them.
    """
    E, X = work[0], work[1]
    node, last, spent, mark = 0, events.shape[0] - 1, 0, events[0].time
    t, t_end, reach, piece = events[0].time, events[0].time, 0.0, 0
    here, speed = events[0].x, events[0].v_after
    for i in range(times.shape[0]):
        while times[i] >= t_end:
            if t_end > events[0].time:
                here, speed, _ = place_at(X, t_end - t)
            t = t_end
            while node < last and events[node + 1].time <= t:
                node, spent = node + 1, 0  # what came to a stop has no further event
                here, speed = events[node].x, events[node].v_after
            piece = piece_at(table, t)
            mass, force, since = events[node].mass, events[node].force, t - table[piece, 0]
            rate = expand_base(kind, table[piece], since, E)
            reach = expand(par, mass, force, rate, here, speed, E, X, P)
            t_end = max(t + reach, np.nextafter(t, math.inf))
            if node < last:
                t_end = min(t_end, events[node + 1].time)
            if piece + 1 < table.shape[0]:
                t_end = min(t_end, table[piece + 1, 0])
            spent += 1
            if t > mark + pace:
                spent, mark = 0, t
            elif spent > ALLOWANCE:
                return float(t)
        x[i], v[i], a[i] = place_at(X, times[i] - t)
    return math.inf
