"""Power series of the oscillator's motion: any base motion, any damping, no tolerance.

Between impacts M x'' + c (x' - x_e') + k (x - x_e) = forces. The Taylor coefficients of x follow
one from the other,

    M (n+1)(n+2) X_(n+2) = k E_n + c (n+1) E_(n+1) - k X_n - c (n+1) X_(n+1)  (- weak damping),

from those of x_e, E_n, which are known in closed form (chirp, polynomial). A segment of length
h = THETA/rate, with `rate` the larger of the system's own rate and that of the base, is cut at
order N: the remainder is below THETA^(N+1)/(N+1)! = 2e-18 of the amplitude, less than rounding. So
the motion is exact in double precision and there is no step to choose; `kernel.py` does the same in
closed form where there is one, and each is the test of the other.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vinesexp.solver.compiled import compiled
from vinesexp.solver.search import first_root

FloatArray = NDArray[np.float64]

ORDER = 20
THETA = 1.25

# Oscillator parameters in one array: mass, viscous, stiffness, quadratic, Coulomb, cubic stiffness.
P_M, P_C, P_K, P_QUADRATIC, P_COULOMB, P_CUBIC = 0, 1, 2, 3, 4, 5

# Base motion as a table: one row a piece. Chirp: start, amplitude, phase, omega, chirp rate.
# Polynomial: start, then the coefficients of x_e in time since the start.
CHIRP, POLYNOMIAL = 0, 1


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
        sine_new = (omega * cosine + chirp * cosine_old) / (n + 1)
        cosine_new = -(omega * sine + chirp * sine_old) / (n + 1)
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
def fill_series(
    par: FloatArray, mass: float, direction: float, E: FloatArray, X: FloatArray
) -> None:
    """Coefficients X_2... from X_0, X_1; `direction` is the sign of x' - x_e' (0: linear)."""
    c, k = par[P_C], par[P_K]
    quadratic = direction * par[P_QUADRATIC]
    for n in range(X.shape[0] - 2):
        force = k * (E[n] - X[n]) + c * (n + 1) * (E[n + 1] - X[n + 1])
        if direction != 0.0:
            if n == 0:
                force -= direction * par[P_COULOMB]
            square = 0.0
            for j in range(n + 1):
                square += (
                    (j + 1) * (X[j + 1] - E[j + 1]) * (n - j + 1) * (X[n - j + 1] - E[n - j + 1])
                )
            force -= quadratic * square
        X[n + 2] = force / (mass * (n + 1) * (n + 2))


@compiled
def expand_weakly_nonlinear(
    par: FloatArray, mass: float, E: FloatArray, X: FloatArray, limit: float
) -> float:
    """Series with quadratic and Coulomb damping up to where x' - x_e' changes its sign.

    Returns how far the series holds. Where the relative velocity is zero to rounding the force
    decides: it moves on to the side the force pulls to, or friction holds it to the base.
    """
    P = np.empty(X.shape[0])
    z1 = X[1] - E[1]
    direction = math.copysign(1.0, z1)
    at_rest = abs(z1) <= 1e-13 * (
        abs(X[1]) + abs(E[1]) + own_rate(mass, par[P_C], par[P_K]) * abs(X[0])
    )
    if at_rest:
        X[1] = E[1]
        # Force that friction has to balance for the mass to follow the base.
        pull = par[P_K] * (E[0] - X[0]) - mass * 2.0 * E[2]
        if abs(pull) <= par[P_COULOMB]:
            for n in range(1, X.shape[0]):
                X[n] = E[n]
            sign = 1.0 if pull >= 0.0 else -1.0
            reach = limit
            for side in (sign, -sign):
                for n in range(X.shape[0] - 2):
                    P[n] = side * mass * (n + 1) * (n + 2) * E[n + 2]
                P[0] += par[P_COULOMB] - side * par[P_K] * (E[0] - X[0])
                P[X.shape[0] - 2] = P[X.shape[0] - 1] = 0.0
                reach = min(reach, first_root(P, 0, limit))
            return max(reach, 1e-15 * limit)
        direction = math.copysign(1.0, pull)
    fill_series(par, mass, direction, E, X)
    scale = abs(X[0]) + abs(X[1]) * limit + abs(X[2]) * limit * limit
    top = X.shape[0] - 1
    last = max(abs(X[top]), abs(X[top - 1]) * limit)
    reach = limit
    if last > 0.0:
        reach = min(reach, (1e-18 * scale / last) ** (1.0 / top))
    for n in range(top):
        P[n] = direction * (n + 1) * (X[n + 1] - E[n + 1])
    P[top] = 0.0
    # The least step keeps the search from standing still; it stays within what counts as at rest.
    return max(min(reach, first_root(P, 1 if at_rest else 0, reach)), 1e-15 * limit)


@compiled
def expand(
    par: FloatArray, mass: float, kind: int, table: FloatArray, piece: int, since: float,
    x: float, v: float, E: FloatArray, X: FloatArray,
) -> float:  # fmt: skip
    """Fill the series of x_e and x at (x, v); how far it holds within the piece, s."""
    rate = expand_base(kind, table[piece], since, E)
    X[0], X[1] = x, v
    limit = THETA / max(rate, own_rate(mass, par[P_C], par[P_K]))
    if par[P_QUADRATIC] != 0.0 or par[P_COULOMB] != 0.0:
        return expand_weakly_nonlinear(par, mass, E, X, limit)
    fill_series(par, mass, 0.0, E, X)
    return limit


@compiled
def value(X: FloatArray, s: float, first: int) -> float:
    """Sum of X_n s^(n) from n = `first`."""
    total = 0.0
    for n in range(X.shape[0] - 1, first - 1, -1):
        total = total * s + X[n]
    return total * s**first


@compiled
def slope(X: FloatArray, s: float, first: int) -> float:
    """Sum of n X_n s^(n-1) from n = `first`."""
    total = 0.0
    for n in range(X.shape[0] - 1, first - 1, -1):
        total = total * s + n * X[n]
    return total * s ** (first - 1)


@compiled
def curvature(X: FloatArray, s: float) -> float:
    """Second derivative of the series at s."""
    total = 0.0
    for n in range(X.shape[0] - 1, 1, -1):
        total = total * s + n * (n - 1) * X[n]
    return total
