"""Free release: how long the amplitude takes to reach a level, and the clearance that is fastest.

A captured ball takes the mean power P(A) from the oscillator, so that the time to a level is one
quadrature, dtau1 = -A dA/(lambda A^2/2 + P(A)); on the stable branch it is the closed form of
`decay`, past the fold the ball holds on for a while (`passage`), then its motion is chaotic and P
is that of the shaken box (docs/theory.md, 26-29). An untouched ball leaves the bare decay. So
there is no single best clearance for a release: it is a curve b*(level) with a capture rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legval2d
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.rig import checked
from vinesexp.theory.manifold import A_1, A_2, loss_parameter, upper_branch
from vinesexp.theory.passage import passage

# A ball in a box shaken by A sin(tau): the mean power it takes, captured, chaotic or past T2.
#
# This is the order-eps^0 problem itself, run instead of solved: no mass ratio, lengths in
# clearances. Averaging the impact losses over time gives P(A) per unit ball mass for every
# amplitude, also below T1 where the motion is chaotic and no closed form exists (docs/theory.md,
# 27, 28). On the stable branch P must come out as 8 Gamma C^2/pi^3, which the tests hold it to.
#: Amplitudes to which the box was run: shares of A_1 below it, clearances above.
LOWEST_BELOW, HIGHEST_BELOW, HIGHEST = 0.1, 0.85, 2.5
#: Share of the way from A_2 to HIGHEST over which the excess past T2 sets in.
RISE = 0.1
_POINTS = 2000  # of a curve of slow time over amplitude, on the branch and in chaos
# Legendre coefficients over (place, 2 r - 1), from benchmarks.box_power
_BELOW = np.array(
    [
        [-0.4324, 0.3298, -0.6927],
        [0.167, 1.1587, 0.7928],
        [-0.4661, -0.2407, -0.1969],
        [0.0306, 0.1636, 0.6852],
    ]
)
_PAST = np.array(
    [
        [0.0586, 0.1846, 0.0025, 0.0713],
        [-0.0753, 0.0193, -0.0511, 0.0547],
        [0.0244, 0.0585, -0.0236, -0.0361],
        [-0.0031, -0.014, -0.0198, -0.0546],
    ]
)


def captured_power(A: ArrayLike, *, r: float) -> FloatArray:
    """8 Gamma C^2/pi^3 on the right branch, from the fold up (docs/theory.md, 17)."""
    C = upper_branch(A, r=r)
    power: FloatArray = 8.0 * loss_parameter(r) * C**2 / np.pi**3
    return power


def ball_power(A: ArrayLike, *, r: float) -> FloatArray:
    """P(A) of a captured ball: closed form from T1 to T2, the box as it ran below and above.

    Below T1 a fit of log(P/A^3) over A/A_1 and r, past T2 one of P over the closed form, both
    smooth in r so that predictions have derivatives. The runs scatter about the first by a factor
    1.5 to 2 (a box below T1 locks into one motion or another), about the second by 3 %
    (`benchmarks.box_power`; docs/theory.md, 27, 28). Beyond the fitted range P goes as A^3
    downwards and A^2 upwards.

    Parameters
    ----------
    A : array_like
        Amplitude in clearances, > 0.
    r : float
        Restitution, in [0, 1).

    Examples
    --------
    >>> round(float(ball_power(0.5, r=0.6)), 5)
    0.13451
    """
    height = checked(A, "amplitude A", "a number above zero", closed=False)
    fold, breaking = float(A_1(r)), float(A_2(r))
    power = captured_power(np.maximum(height, fold), r=r)
    if np.any(height < fold):
        place = np.clip(height / (HIGHEST_BELOW * fold), LOWEST_BELOW / HIGHEST_BELOW, 1.0)
        below = np.exp(legval2d(2.0 * place - 1.0, np.full_like(place, 2.0 * r - 1.0), _BELOW))
        power = np.where(height < fold, height**3 * below, power)
    if np.any(height > breaking):
        place = np.clip((height - breaking) / (HIGHEST - breaking), 0.0, 1.0)
        past = legval2d(2.0 * place - 1.0, np.full_like(place, 2.0 * r - 1.0), _PAST)
        power = np.where(
            height > breaking, power * np.exp((1.0 - np.exp(-place / RISE)) * past), power
        )
    return power


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

    @property
    def eps(self) -> float:
        """Mass ratio m/M."""
        return self.m / self.M

    @property
    def lam(self) -> float:
        """Reduced damping c1/(m w0)."""
        return self.c1 / (self.m * self.w0)


def bare_time(release: Decaying, *, level: float) -> float:
    """Time (s) to a level without a ball: ln(x_m/level)/(zeta w0); infinite without damping."""
    _reachable(release, level)
    rate = 0.5 * release.c1 / release.M
    return float(np.log(release.x_m / level) / rate) if rate > 0.0 else float("inf")


def _reachable(release: Decaying, level: ArrayLike) -> None:
    high = float(np.max(checked(level, "level", "m, above zero", closed=False)))
    if high > release.x_m:
        raise AnalysisError(
            f"level {1e3 * high:.6g} mm is above the release amplitude {1e3 * release.x_m:.6g} mm"
        )


@dataclass(frozen=True)
class DecayCurve:
    """Slow time tau1 against amplitude for a captured ball, then for one that has let go.

    Attributes
    ----------
    A, tau1 : captured branch followed by chaos, amplitudes falling; mean over the passage.
    spread : standard deviation of tau1 over the balls that were flown through the fold.
    chaos_A, chaos_tau1 : chaos alone, for releases that start below A_1.
    fold : A_1.
    """

    A: FloatArray
    tau1: FloatArray
    spread: FloatArray
    chaos_A: FloatArray
    chaos_tau1: FloatArray
    fold: float

    def between(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """tau1 from `start` to `end` (clearances, arrays alike)."""
        captured = np.interp(-end, -self.A, self.tau1) - np.interp(-start, -self.A, self.tau1)
        chaotic = np.interp(-end, -self.chaos_A, self.chaos_tau1) - np.interp(
            -start, -self.chaos_A, self.chaos_tau1
        )
        return np.where(start >= self.fold, captured, chaotic)

    def scatter(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Standard deviation of tau1 over starts, of captured releases; zero on the branch."""
        return np.where(start >= self.fold, np.interp(-end, -self.A, self.spread), 0.0)


def _elapsed(A: FloatArray, *, lam: float, r: float) -> FloatArray:
    """Cumulative tau1 along falling amplitudes by the trapezoidal rule in log A (27)."""
    rate = A**2 / (0.5 * lam * A**2 + ball_power(A, r=r))
    steps = 0.5 * (rate[1:] + rate[:-1]) * np.log(A[:-1] / A[1:])
    return np.concatenate([[0.0], np.cumsum(steps)])


def decay_curve(*, eps: float, lam: float, r: float, high: float, low: float) -> DecayCurve:
    """Slow time against amplitude from `high` down to `low` (clearances), docs/theory.md (26-29).

    Above T2 with the power of the shaken box, on the stable branch with that of the SIM, through
    the fold as the mean of balls flown through it (`passage`), below it in chaos.
    """
    fold = float(A_1(r))
    run = passage(eps=eps, lam=lam, r=r)
    top = max(high, run.A[0]) * (1.0 + 1e-12)
    upper = np.geomspace(top, run.A[0], _POINTS)
    breaking = float(A_2(r))
    if top > breaking > run.A[0]:
        upper = np.sort(np.append(upper, breaking))[::-1]
    first = _elapsed(upper, lam=lam, r=r)
    floor = min(low, run.A[-1]) * (1.0 - 1e-9)
    below = np.concatenate([run.A, np.geomspace(run.A[-1], floor, _POINTS // 4)[1:]])
    chaos = np.geomspace(fold * (1.0 - 1e-12), min(low, fold, floor), _POINTS)
    chaos_tau1 = _elapsed(chaos, lam=lam, r=r)

    def drifting(A: FloatArray) -> FloatArray:
        return np.interp(-A, -chaos, chaos_tau1)

    lanes = np.full((run.end_A.size, below.size), np.nan)
    lanes[:, : run.A.size] = run.tau1
    after = run.end_tau1[:, None] + drifting(below) - drifting(run.end_A)[:, None]
    lanes = first[-1] + np.where(np.isnan(lanes), after, lanes)
    return DecayCurve(
        A=np.concatenate([upper, below[1:]]),
        tau1=np.concatenate([first, lanes.mean(axis=0)[1:]]),
        spread=np.concatenate([np.zeros_like(first), lanes.std(axis=0)[1:]]),
        chaos_A=chaos,
        chaos_tau1=chaos_tau1,
        fold=fold,
    )


def captured_time(release: Decaying, *, b: ArrayLike, level: ArrayLike) -> FloatArray:
    """Time (s) for a captured ball of clearance b to bring the amplitude down to `level` (29).

    Parameters
    ----------
    release : Decaying
    b : array_like
        Clearances, m, > 0.
    level : array_like
        Amplitudes to be reached, m, in (0, x_m]; broadcast against b.

    Returns
    -------
    ndarray

    Raises
    ------
    AnalysisError
        A level above the release; r = 1 or 0 where the shaken box takes no mean power.

    Examples
    --------
    >>> release = Decaying(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6, x_m=0.03)
    >>> round(float(captured_time(release, b=0.05, level=0.015)), 3)
    1.264
    """
    _reachable(release, level)
    clearance, target = np.broadcast_arrays(
        checked(b, "clearance b", "m, above zero", closed=False), np.asarray(level, dtype=float)
    )
    eps, lam = release.eps, release.lam
    if release.r == 1.0:  # elastic: the ball takes nothing on the average
        if lam == 0.0:
            raise AnalysisError("r = 1 without damping keeps its energy for ever")
        return np.log(release.x_m / target) * 2.0 / (lam * eps * release.w0)
    start, end = release.x_m / clearance, target / clearance
    curve = decay_curve(
        eps=eps, lam=lam, r=release.r, high=float(start.max()), low=float(end.min())
    )
    return curve.between(start, end) / (eps * release.w0)


def capture_rate(*, x_m: ArrayLike, b: ArrayLike) -> FloatArray:
    """Share of balls, at rest anywhere in the cavity, that a wall meets at all: min(1, x_m/b).

    Released at +x_m, the walls reach a ball at rest at y0 only if y0 > b - x_m; else the oscillator
    decays as if bare (docs/theory.md, 26). An upper bound of the share that 1:1 resonance captures.

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
        Clearances between which to look, m; where None from x_m/4 to x_m/A_1, above
        which nothing is captured (at most 40 x_m).

    Examples
    --------
    >>> release = Decaying(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6, x_m=0.03)
    >>> best = best_clearance(release, level=0.005)
    >>> 0.04 < best.b < 0.055
    True
    """
    ends = (low or 0.25 * release.x_m, high or release.x_m / max(float(A_1(release.r)), 1.0 / 40.0))
    for _ in range(4):  # the slope changes at both transitions: narrowing grids, no derivative
        grid = np.geomspace(*ends, 41)
        times = captured_time(release, b=grid, level=level)
        i = int(times.argmin())
        ends = (float(grid[max(i - 2, 0)]), float(grid[min(i + 2, 40)]))
    b = float(grid[i])
    return BestClearance(b, float(times[i]), float(capture_rate(x_m=release.x_m, b=b)))
