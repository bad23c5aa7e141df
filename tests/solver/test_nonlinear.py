"""Power series of an oscillator that is not linear, against the recursion as it is written."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from numba import njit

from vinesexp.solver import series
from vinesexp.solver.series import HIGH, LOW
from vinesexp.solver.state import Parameters

M, C, K, FORCE = 4.7, 3.02, 1.147e4, 0.3


@njit
def fill(par, direction, E, X):
    """The function of the loop, which only compiled code can call."""
    series.fill_nonlinear(par, M, FORCE, direction, E, X)


def by_the_book(par, direction, E, x, v):
    """Coefficients in 30 digits: sums over all products, in the order of the equation."""
    _, c, k, q, f, k3 = par
    X, E = [mp.mpf(x), mp.mpf(v)], [mp.mpf(e) for e in E]
    for n in range(len(E) - 2):
        z = [a - e for a, e in zip(X, E, strict=False)]
        slope = [(i + 1) * z[i + 1] for i in range(n + 1)]
        square = [sum(z[i] * z[j - i] for i in range(j + 1)) for j in range(n + 1)]
        pull = -c * slope[n] - k * z[n] - k3 * sum(square[i] * z[n - i] for i in range(n + 1))
        pull -= direction * q * sum(slope[i] * slope[n - i] for i in range(n + 1))
        if n == 0:
            pull += FORCE - direction * f
        X.append(pull / (M * (n + 1) * (n + 2)))
    return X


@pytest.mark.long
@pytest.mark.parametrize("top", [LOW, HIGH])
@pytest.mark.parametrize("k3", [0.0, 3e5, -2e6])
@pytest.mark.parametrize(("q", "direction"), [(0.0, 1.0), (0.5, 1.0), (40.0, -1.0)])
def test_products_that_are_written_out_are_those_of_the_recursion(top, k3, q, direction):
    par = Parameters(M, C, K, q, 0.05, k3)
    w = 50.0
    E = 0.25e-3 * np.array([w**n / mp.factorial(n) * [0.6, 0.8][n % 2] for n in range(top + 1)])
    E = E.astype(float) * np.resize([1.0, 1.0, -1.0, -1.0], top + 1)
    X = np.zeros(top + 1)
    X[:2] = 0.008, 0.3
    fill(par, direction, E, X)
    with mp.workdps(30):
        exact = np.array([float(a) for a in by_the_book(par, direction, E, *X[:2])])
    reach = 1.0 / w
    sizes = np.abs(exact) * reach ** np.arange(top + 1.0)
    off = np.abs(X - exact) * reach ** np.arange(top + 1.0)
    assert off.max() < 1e-15 * sizes.max()
    assert np.abs(X / exact - 1.0).max() < 1e-10
