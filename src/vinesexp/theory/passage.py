"""Passage through the fold T1: how far below A_1 a decaying motion stays captured.

A release slides down the stable branch and meets the fold with a finite speed, so that the ball
lets go late, by an amplitude of order (eps g)^(2/3) with g the decay rate at the fold: for the
published rig about a third of A_1 (docs/theory.md, 52-53). That is only a few impacts, too few for
the normal form, and the ball then floats for some cycles: so the passage itself is flown, from
impact to impact of the full system, for a handful of captured balls (54).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.theory.manifold import A_1, C_1, loss_parameter, upper_branch

#: First zero of the Airy function Ai, with its sign changed: where the normal form blows up.
_AIRY = 2.338107410459767
#: A flight shorter than this (in 1/w0) is a ball that comes to rest on a wall.
_CHATTER = 0.02
#: No passage takes more flights than this.
_MOST = 4000
_LANES = 24  # balls, started at as many amplitudes
_AFTER = 6.0  # cycles for which a ball is followed that has let go
_POINTS = 240  # amplitudes of a passage


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
    """Ensemble of captured balls flown through the fold until they have let go.

    Attributes
    ----------
    A : ndarray, shape (n,)
        Amplitudes (clearances), falling from above A_1.
    tau1 : ndarray, shape (lanes, n)
        Slow time at which each ball's oscillator has fallen to them; NaN past the lane's end.
    let_go : ndarray, shape (lanes,)
        Amplitude at which each ball lets go.
    end_A, end_tau1 : ndarray, shape (lanes,)
        Where each lane stops: some cycles after letting go, its motion chaotic.
    """

    A: FloatArray
    tau1: FloatArray
    let_go: FloatArray
    end_A: FloatArray
    end_tau1: FloatArray


@lru_cache(maxsize=64)  # b*(level) asks for the same flight once per clearance
def passage(*, eps: float, lam: float, r: float) -> Passage:
    """Fly captured balls from above the fold until they have let go (docs/theory.md, 54).

    The full system (1)-(4) without forcing, from flight to flight: started on the SIM at 24
    amplitudes that share out one half cycle's decay, so that where the impacts fall about the
    fold is averaged over. A ball has let go at its first flight of more than three quarters of
    a cycle; it is followed for six cycles more.

    Raises
    ------
    AnalysisError
        Half a cycle takes more than A_1 itself (a heavy ball, or an elastic one): there is no
        slow decay that matters.

    Examples
    --------
    >>> run = passage(eps=0.00681, lam=1.91, r=0.6)
    >>> bool(run.end_A.max() < A_1(0.6) < run.A[0])
    True
    """
    rates = fold_rates(lam=lam, r=r)
    share = np.pi * eps * rates.g / float(A_1(r))
    if not share < 1.0:
        raise AnalysisError(
            f"release: at T1 half a cycle takes {share:.2g} times the amplitude A_1 (mass ratio "
            f"{eps:.3g}, r = {r:.3g}): no slow decay; simulate this rig instead"
        )
    delay = min(rates.delay(eps), float(A_1(r)))
    start = float(A_1(r)) + 1.5 * delay
    C = upper_branch(start, r=r)
    fall = eps * (
        0.5 * lam * start + 8.0 * float(loss_parameter(r)) * float(C) ** 2 / (np.pi**3 * start)
    )
    offset = (np.arange(_LANES) + 0.5) / _LANES * np.pi
    state = _on_the_manifold(start + fall * offset, r=r, eps=eps)
    zeta = 0.5 * eps * lam
    times, heights = [-offset], [start + fall * offset]
    until, let_go = np.full(_LANES, np.inf), np.full(_LANES, np.nan)
    active = np.ones(_LANES, dtype=bool)
    for _ in range(_MOST):
        flight = next_collision(state, zeta=zeta)
        now = times[-1] + flight
        # ended: followed long enough, or the ball comes to rest on a wall
        active &= (times[-1] < until) & (heights[-1] > 0.05 * start) & (flight > _CHATTER)
        if not active.any():
            break
        lost = active & (flight > 1.5 * np.pi) & np.isinf(until)
        until = np.where(lost, now + 2.0 * np.pi * _AFTER, until)
        let_go = np.where(lost, heights[-1], let_go)
        arrived = fly(state, flight, zeta=zeta)
        left = impact(arrived, eps=eps, r=r)
        height = np.hypot(left[0], 0.5 * (arrived[1] + left[1]))  # amplitude of the mean motion
        state = np.where(active, left, state)
        times.append(np.where(active, now, times[-1]))
        heights.append(np.where(active, height, heights[-1]))
    tau = np.array(times).T
    fallen = np.minimum.accumulate(np.array(heights).T, axis=1)
    A = np.geomspace(start, float(fallen.min()) * (1.0 - 1e-12), _POINTS)
    tau1 = np.array([np.interp(-A, -h, t, right=np.nan) for h, t in zip(fallen, tau, strict=True)])
    return Passage(A, eps * tau1, let_go, fallen[:, -1], eps * tau[:, -1])


def _on_the_manifold(A: FloatArray, *, r: float, eps: float) -> FloatArray:
    """(x, x', y, y') just after an impact on x - y = +1, V = A sin and C on the right branch."""
    C = upper_branch(A, r=r)
    u = 2.0 * C / np.pi
    v = u * (1.0 - r) / (1.0 + r)  # A cos(phi) = Gamma u
    x = 1.0 - C
    return np.array([x, v - eps * u, x - 1.0, u])


def fly(state: FloatArray, t: FloatArray, *, zeta: float) -> FloatArray:
    """State after the free flight t: damped oscillator, free ball."""
    x, v, y, u = state
    wd = np.sqrt(1.0 - zeta * zeta)
    c, s, e = np.cos(wd * t), np.sin(wd * t) / wd, np.exp(-zeta * t)
    return np.array(
        [e * (x * c + (v + zeta * x) * s), e * (v * c - (x + zeta * v) * s), y + u * t, u + 0.0 * t]
    )


def impact(state: FloatArray, *, eps: float, r: float) -> FloatArray:
    """Impact law (3, 4) where the gap is closed; a flight that met no wall is left alone."""
    x, v, y, u = state
    gap, closing = x - y, v - u
    hit = (np.abs(gap) > 1.0 - 1e-6) & (gap * closing > 0.0)
    jump = np.where(hit, (1.0 + r) * closing / (1.0 + eps), 0.0)
    side = np.where(hit, np.sign(gap), 0.0)
    # placed on the wall, so that the next flight starts inside
    return np.array([x, v - eps * jump, np.where(hit, x - side, y), u + jump])


# where a collision is looked for: 48 times a cycle over three cycles
_GRID: FloatArray = np.linspace(np.pi / 24.0, 6.0 * np.pi, 144)


def next_collision(state: FloatArray, *, zeta: float) -> FloatArray:
    """Time to the next |x - y| = 1, at most three cycles; bisection in the first closed step."""
    x, _, y, _ = fly(state[:, :, None], _GRID, zeta=zeta)
    closed = np.abs(x - y) >= 1.0
    met = closed.any(axis=1)
    first = np.where(met, closed.argmax(axis=1), _GRID.size - 1)
    high: FloatArray = np.asarray(_GRID[first], dtype=np.float64)
    low: FloatArray = np.asarray(high - _GRID[0], dtype=np.float64)
    for _ in range(36):
        middle = np.asarray(0.5 * (low + high), dtype=np.float64)
        x, _, y, _ = fly(state, middle, zeta=zeta)
        beyond = np.abs(x - y) >= 1.0
        high = np.where(beyond & met, middle, high)
        low = np.where(beyond | ~met, low, middle)
    flight: FloatArray = np.where(met, low, _GRID[-1])
    return flight
