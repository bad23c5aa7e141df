"""Free release: how long the amplitude takes to reach a level, and the clearance that is fastest.

A captured ball takes the mean power P(A) from the oscillator, so that the time to a level is one
quadrature, dtau1 = -A dA/(lambda A^2/2 + P(A)); on the stable branch it is the closed form of
`decay`, below T1 the ball's motion is chaotic and P is that of the shaken box (docs/theory.md,
26-29). An untouched ball leaves the bare decay. So there is no single best clearance for a
release: it is a curve b*(level) with a capture rate.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.errors import AnalysisError
from vinesexp.rig import checked
from vinesexp.theory.manifold import FloatArray
from vinesexp.theory.shaken_box import ball_power


@dataclass(frozen=True)
class Decaying:
    """A release: rig values (SI), amplitude x_m (m) it starts with."""

    M: float
    c1: float
    k1: float
    m: float
    r: float
    x_m: float

    def __post_init__(self) -> None:
        checked(self.M, "mass M", "kg, above zero", closed=False)
        checked(self.c1, "damping c1", "N s/m, zero or above")
        checked(self.k1, "stiffness k1", "N/m, above zero", closed=False)
        checked(self.m, "ball mass m", "kg, above zero", closed=False)
        checked(self.r, "restitution r", "a number from 0 to 1", high=1.0)
        checked(self.x_m, "release amplitude x_m", "m, above zero", closed=False)

    @property
    def w0(self) -> float:
        """Angular frequency, rad/s."""
        return float(np.sqrt(self.k1 / self.M))


def bare_time(release: Decaying, *, level: float) -> float:
    """Time (s) to a level without a ball: ln(x_m/level)/(zeta w0); infinite without damping."""
    _reachable(release, level)
    rate = 0.5 * release.c1 / release.M
    return float(np.log(release.x_m / level) / rate) if rate > 0.0 else float("inf")


def _reachable(release: Decaying, level: float) -> None:
    checked(level, "level", "m, above zero", closed=False)
    if level > release.x_m:
        raise AnalysisError(
            f"level {1e3 * level:.6g} mm is above the release amplitude {1e3 * release.x_m:.6g} mm"
        )


def time_to_level(
    release: Decaying, *, b: ArrayLike, level: float, points: int = 400
) -> FloatArray:
    """Time (s) for a captured ball of clearance b to bring the amplitude down to `level` (29).

    Parameters
    ----------
    release : Decaying
    b : array_like
        Clearances, m, > 0.
    level : float
        Amplitude to be reached, m, in (0, x_m].
    points : int
        Of the quadrature (trapezoid in ln A, split at T1 where P jumps).

    Returns
    -------
    ndarray, like b

    Raises
    ------
    AnalysisError
        A level above the release; r = 1 without damping, which never decays.

    Examples
    --------
    >>> release = Decaying(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6, x_m=0.03)
    >>> round(float(time_to_level(release, b=0.05, level=0.015)), 3)
    1.264
    """
    _reachable(release, level)
    if release.r == 1.0:
        return np.full(np.shape(b), bare_time(release, level=level))
    clearance = checked(b, "clearance b", "m, above zero", closed=False)
    flat = clearance.ravel()
    times = np.array([_time(release, float(one), level, points) for one in flat])
    return times.reshape(clearance.shape)


def _time(release: Decaying, b: float, level: float, points: int) -> float:
    from vinesexp.theory.manifold import A_1, A_2

    eps = release.m / release.M
    lam = release.c1 / (release.m * release.w0)
    start, end = release.x_m / b, level / b
    marks = [start]
    marks += [mark for mark in (float(A_2(release.r)), float(A_1(release.r))) if end < mark < start]
    marks.append(end)
    tau1 = 0.0
    for high, low in itertools.pairwise(marks):
        # half-open at T1: the captured side above, the chaotic one below
        inner = np.array([1.0 - 1e-12, *np.ones(points - 2), 1.0 + 1e-12])
        A = np.geomspace(high, low, points) * inner
        integrand = A**2 / (0.5 * lam * A**2 + ball_power(A, r=release.r))
        tau1 += float(np.trapezoid(integrand, -np.log(A)))
    return tau1 / (eps * release.w0)


def capture_rate(*, x_m: ArrayLike, b: ArrayLike) -> FloatArray:
    """Share of balls, at rest anywhere in the cavity, that a wall meets at all: min(1, x_m/b).

    A ball that rests nearer to the middle than b - x_m is never touched and the oscillator decays
    as if bare (docs/theory.md, 26): an upper bound of the share captured by the 1:1 resonance.

    Examples
    --------
    >>> float(capture_rate(x_m=0.02, b=0.04))
    0.5
    """
    length = checked(b, "clearance b", "m, above zero", closed=False)
    return np.minimum(1.0, np.asarray(x_m, dtype=np.float64) / length)


@dataclass(frozen=True)
class BestClearance:
    """b*(level): the fastest clearance (m), its time (s), the share of starts it can catch."""

    b: float
    time: float
    capture_rate: float


def best_clearance(
    release: Decaying, *, level: float, low: float | None = None, high: float | None = None
) -> BestClearance:
    """Clearance that brings a captured release to `level` soonest, b*(level).

    Parameters
    ----------
    release : Decaying
    level : float
        m.
    low, high : float, optional
        Clearances between which to look, m; x_m/4 to 6 x_m where None.

    Examples
    --------
    >>> release = Decaying(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6, x_m=0.03)
    >>> best = best_clearance(release, level=0.005)
    >>> 0.03 < best.b < 0.05
    True
    """
    ends = (low or 0.25 * release.x_m, high or 6.0 * release.x_m)
    for _ in range(4):  # the curve has kinks at both transitions: narrowing grids, no derivative
        grid = np.geomspace(*ends, 41)
        times = time_to_level(release, b=grid, level=level)
        i = int(times.argmin())
        ends = (float(grid[max(i - 2, 0)]), float(grid[min(i + 2, 40)]))
    b = float(grid[i])
    return BestClearance(b, float(times[i]), float(capture_rate(x_m=release.x_m, b=b)))
