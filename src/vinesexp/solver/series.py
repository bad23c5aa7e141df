"""Power series of the motion of a linear oscillator: any base motion, no tolerance.

Between impacts M x'' + c (x' - x_e') + k (x - x_e) = forces. The Taylor coefficients of x follow
one from the other,

    M (n+1)(n+2) X_(n+2) = k E_n + c (n+1) E_(n+1) - k X_n - c (n+1) X_(n+1),

from those of x_e, E_n, which are known in closed form (chirp, polynomial). A segment of length
h = theta/rate, with `rate` the larger of the system's own rate and that of the base, is cut at
order N: the remainder is below theta^(N+1)/(N+1)! = 2e-18 of the amplitude, less than rounding. So
the motion is exact in double precision and there is no step to choose; `kernel.py` does the same in
closed form where there is one, and each is the test of the other.
"""

from __future__ import annotations

import math

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.solver.compiled import compiled, fused

# Order of a series; of one that no segment needs to hold for long; of one with products.
ORDER, LOW, HIGH = 20, 12, 30
#: Of a series by its number of coefficients. What is longer than 1.25 rad costs digits.
THETA = np.array(
    [0.0] + [min(1.25, (2e-18 * math.factorial(n)) ** (1.0 / n)) for n in range(1, HIGH + 2)]
)
PER = 1.0 / np.arange(1.0, 42.0)  # 1/(n + 1): a division would be most of a recursion

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
def expand(
    par: FloatArray, mass: float, kind: int, table: FloatArray, piece: int, since: float,
    x: float, v: float, E: FloatArray, X: FloatArray,
) -> float:  # fmt: skip
    """Fill the series of x_e and x at (x, v); how far it holds within the piece, s."""
    rate = expand_base(kind, table[piece], since, E)
    c, k = par[P_C], par[P_K]
    X[0], X[1] = x, v
    damping, stiffness = c / mass, k / mass
    for n in range(X.shape[0] - 2):
        pull = stiffness * (PER[n] * PER[n + 1]) * (E[n] - X[n])
        X[n + 2] = fused(damping * PER[n + 1], E[n + 1] - X[n + 1], pull)
    return float(THETA[X.shape[0]] / max(rate, own_rate(mass, c, k)))


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
