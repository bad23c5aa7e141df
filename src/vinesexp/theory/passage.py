"""Passage through the fold T1: how far below A_1 a decaying motion stays captured.

A release slides down the stable branch and meets the fold with a finite speed, so that the ball
lets go late, by an amplitude of order (eps g)^(2/3) with g the decay rate at the fold: for the
published rig more than a third of A_1 (docs/theory.md, 52-54). The lag is followed by relaxing C
towards the SIM with the rate that the impact map has at the fold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vinesexp.theory.manifold import A_1, C_1, FloatArray, amplitude, loss_parameter, upper_branch

#: First zero of the Airy function Ai, with its sign changed: where the normal form blows up.
_AIRY = 2.338107410459767
#: The ball has let go when its amplitude has fallen to this share of C_1.
_RELEASED = 0.25


@dataclass(frozen=True)
class FoldRates:
    """Normal form at the fold: dc/dtau = -nu (c^2 - (A - A_1)/kappa), dA/dtau = -eps g (52)."""

    nu: float
    kappa: float
    g: float

    def delay(self, eps: float) -> float:
        """Amplitude by which capture outlives A_1: 2.338 (eps g)^(2/3) (kappa/nu^2)^(1/3) (53)."""
        return float(
            _AIRY * (eps * self.g) ** (2.0 / 3.0) * (self.kappa / self.nu**2) ** (1.0 / 3.0)
        )


def fold_rates(*, lam: float, r: float) -> FoldRates:
    """nu from the slope of the impact map's eigenvalue along the SIM, kappa from its curvature.

    Examples
    --------
    >>> rates = fold_rates(lam=1.91, r=0.6)
    >>> round(rates.delay(0.00681), 3)
    0.059
    """
    Gamma = float(loss_parameter(r))
    C, A = float(C_1(r)), float(A_1(r))
    return FoldRates(
        nu=np.pi / (8.0 * Gamma * C**2),
        kappa=1.0 / (2.0 * A * C),
        g=0.5 * lam * A + 8.0 * Gamma * C**2 / (np.pi**3 * A),
    )


@dataclass(frozen=True)
class Passage:
    """Captured motion past the fold: amplitudes (falling), C and elapsed tau1."""

    A: FloatArray
    C: FloatArray
    tau1: FloatArray


def passage(*, eps: float, lam: float, r: float, step: float = 0.2) -> Passage:
    """Follow a captured decay from above the fold until the ball lets go (docs/theory.md, 54).

    dC/dtau = (nu/kappa)(A - A_sim(C)), dA/dtau = -eps (lambda A/2 + 8 Gamma C^2/(pi^3 A)): the
    normal form at the fold, the slow flow away from it. Runge-Kutta 4 in tau.

    Examples
    --------
    >>> run = passage(eps=0.00681, lam=1.91, r=0.6)
    >>> bool(run.A[-1] < A_1(0.6) < run.A[0])
    True
    """
    rates = fold_rates(lam=lam, r=r)
    Gamma, pull = float(loss_parameter(r)), rates.nu / rates.kappa
    k = 8.0 * Gamma / np.pi**3

    def slope(state: FloatArray) -> FloatArray:
        C, A = state
        dA = -eps * (0.5 * lam * A + k * C * abs(C) / A)
        return np.array([pull * (A - np.hypot(1.0 - C, 2.0 * C * Gamma / np.pi)), dA])

    start = float(A_1(r)) + 2.0 * rates.delay(eps)
    state = np.array([float(upper_branch(start, r=r)), start])
    # start with the lag already there: A_sim(C) = A + (dC/dtau)/(-pull)
    lag = (slope(state)[1] / _climb(state[0], r)) / pull
    state[0] = float(upper_branch(start - lag, r=r))
    rows = [np.array(state)]
    h = step / max(1.0, pull)
    released = _RELEASED * float(C_1(r))
    while state[0] > released and state[1] > 0.05 * float(A_1(r)):
        k1 = slope(state)
        k2 = slope(state + 0.5 * h * k1)
        k3 = slope(state + 0.5 * h * k2)
        k4 = slope(state + h * k3)
        state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        rows.append(state)
    C, A = np.array(rows).T
    return Passage(A=A, C=C, tau1=eps * h * np.arange(A.size))


def _climb(C: float, r: float) -> float:
    """dA/dC along the SIM."""
    return float((C / C_1(r) - 1.0) / amplitude(C, r=r))
