"""Free release: how long the amplitude takes to reach a level, and the clearance that is fastest.

A captured ball takes the mean power P(A) from the oscillator, so that the time to a level is one
quadrature, dtau1 = -A dA/(lambda A^2/2 + P(A)); on the stable branch it is the closed form of
`decay`, past the fold the ball holds on for a while (`passage`), then its motion is chaotic and P
is that of the shaken box (docs/theory.md, 26-29). An untouched ball leaves the bare decay. So
there is no single best clearance for a release: it is a curve b*(level) with a capture rate.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Annotated

import numpy as np
from numpy.polynomial.legendre import legval2d
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.excitation import Release
from vinesexp.rig import ABOVE_ZERO, NES, OF_RIG, Checked, Oscillator, Rig, checked
from vinesexp.solver.simulation import simulate
from vinesexp.theory.manifold import A_1, A_2, C_1, loss_parameter, upper_branch

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
    height = checked(A, "amplitude A", "", ABOVE_ZERO)
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
class Decaying(Checked):
    """A release: rig values (SI), amplitude x_m (m) it starts with."""

    M: Annotated[float, OF_RIG["M"]]
    c1: Annotated[float, OF_RIG["c1"]]
    k1: Annotated[float, OF_RIG["k1"]]
    m: Annotated[float, OF_RIG["m"]]
    r: Annotated[float, OF_RIG["r"]]
    x_m: Annotated[float, ("release amplitude x_m", "m", ABOVE_ZERO)]

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
    high = float(np.max(checked(level, "level", "m", ABOVE_ZERO)))
    if high > release.x_m:
        raise AnalysisError(
            f"level {1e3 * high:.6g} mm is above the release amplitude {1e3 * release.x_m:.6g} mm"
        )


# The passage through the fold T1: how far below A_1 a decaying motion stays captured.
#
# A release slides down the stable branch and meets the fold with a finite speed, so that the ball
# lets go late, by an amplitude of order (eps g)^(2/3) with g the decay rate at the fold: for the
# published rig about a third of A_1 (docs/theory.md, 52-53). That is only a few impacts, too few
# for the normal form, and the ball then floats for some cycles: so the passage itself is flown,
# from impact to impact of the full system, for a handful of captured balls (54).
#: First zero of the Airy function Ai, with its sign changed: where the normal form blows up.
_AIRY = 2.338107410459767
#: A flight shorter than this (in 1/w0) is a ball that comes to rest on a wall.
_CHATTER = 0.02
#: Of a longer flight the amplitude is looked at every so often (1/w0): three cycles.
_FLOATS = 6.0 * np.pi
_LANES = 24  # balls, started at as many amplitudes
_AFTER = 6.0  # cycles for which a ball is followed that has let go
_LEVELS = 240  # amplitudes of a passage


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
    begin = start + fall * offset
    rig = Rig(Oscillator(M=1.0, c1=eps * lam, k1=1.0), [NES(m=eps, b=1.0, r=r)])
    # a captured ball falls at least as fast as at T1: by then it has let go
    falls = min(float(begin.max()), 12.0 * delay)
    lasts = falls / (eps * rates.g) + 4.0 * np.pi * _AFTER
    states = _on_the_manifold(begin, r=r, eps=eps).T
    lanes = [_flown(rig, one, lasts, 0.05 * start) for one in states]
    fallen, let_go = [lane[1] for lane in lanes], np.array([lane[2] for lane in lanes])
    times = [lane[0] - late for lane, late in zip(lanes, offset, strict=True)]
    end_A, end = (np.array([one[-1] for one in every]) for every in (fallen, times))
    A = np.geomspace(start, float(end_A.min()) * (1.0 - 1e-12), _LEVELS)
    tau = [np.interp(-A, -h, t, right=np.nan) for h, t in zip(fallen, times, strict=True)]
    return Passage(A, eps * np.array(tau), let_go, end_A, eps * end)


def _flown(
    rig: Rig, state: FloatArray, lasts: float, least: float
) -> tuple[FloatArray, FloatArray, float]:
    """Impacts of one ball from a state just after one until some cycles after it has let go.

    Their times, the amplitudes down to which the mass has fallen, none far below the `least`, and
    the one at which the ball let go.
    """
    x, v, y, u = map(float, state)
    motion = simulate(rig, None, Release(x, v, (y,), (u,)), duration=lasts)
    hits = motion.impacts
    swing = np.hypot(hits["x"], 0.5 * (hits["v_before"] + hits["v_after"]))  # of the mean motion
    ends = np.concatenate([[0.0], hits["time"], [lasts]])
    floats = np.concatenate([np.arange(t, end, _FLOATS)[1:] for t, end in pairwise(ends)])
    time = np.concatenate([ends[:-1], floats])
    height = np.concatenate([[np.hypot(x, v + rig.eps * u)], swing, np.hypot(*motion.at(floats))])
    order = np.argsort(time)
    time, height = time[order], height[order]
    flight = np.diff(time)
    lost = np.flatnonzero(flight > 1.5 * np.pi)[:1]
    until = time[lost + 1] + 2.0 * np.pi * _AFTER if lost.size else np.inf
    # followed long enough, or the ball comes to rest on a wall
    over = (time >= until) | (height <= least)
    over[:-1] |= flight <= _CHATTER
    end = int(np.argmax(over)) + 1 if over.any() else time.size
    let_go = float(height[lost[0]]) if lost.size else float("nan")
    return time[:end], np.minimum.accumulate(height[:end]), let_go


def _on_the_manifold(A: FloatArray, *, r: float, eps: float) -> FloatArray:
    """(x, x', y, y') just after an impact on x - y = +1, V = A sin and C on the right branch."""
    C = upper_branch(A, r=r)
    u = 2.0 * C / np.pi
    v = u * (1.0 - r) / (1.0 + r)  # A cos(phi) = Gamma u
    x = 1.0 - C
    return np.array([x, v - eps * u, x - 1.0, u])


def _elapsed(A: FloatArray, *, lam: float, r: float) -> FloatArray:
    """Cumulative tau1 along falling amplitudes by the trapezoidal rule in log A (27)."""
    rate = A**2 / (0.5 * lam * A**2 + ball_power(A, r=r))
    steps = 0.5 * (rate[1:] + rate[:-1]) * np.log(A[:-1] / A[1:])
    return np.concatenate([[0.0], np.cumsum(steps)])


def decay_curves(
    *, eps: float, lam: float, r: float, high: float, low: float
) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """Falling amplitudes from `high` to `low` (clearances) with their slow times, of a captured
    ball that then lets go, and of one in chaos from A_1 on (docs/theory.md, 26-29).

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
    A, tau1 = np.concatenate([upper, below[1:]]), np.concatenate([first, lanes.mean(axis=0)[1:]])
    return (A, tau1), (chaos, chaos_tau1)


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
        checked(b, "clearance b", "m", ABOVE_ZERO), np.asarray(level, dtype=float)
    )
    eps, lam = release.eps, release.lam
    if release.r == 1.0:  # elastic: the ball takes nothing on the average
        if lam == 0.0:
            raise AnalysisError("a ball of r = 1 without damping never loses energy")
        return np.log(release.x_m / target) * 2.0 / (lam * eps * release.w0)
    start, end = release.x_m / clearance, target / clearance
    curves = decay_curves(
        eps=eps, lam=lam, r=release.r, high=float(start.max()), low=float(end.min())
    )
    captured, chaotic = (np.interp(-end, -A, t) - np.interp(-start, -A, t) for A, t in curves)
    tau1 = np.where(start >= float(A_1(release.r)), captured, chaotic)
    return np.asarray(tau1 / (eps * release.w0))


def capture_rate(*, x_m: ArrayLike, b: ArrayLike) -> FloatArray:
    """Share of balls, at rest anywhere in the cavity, that a wall meets at all: min(1, x_m/b).

    Released at +x_m, the walls reach a ball at rest at y0 only if y0 > b - x_m; else the oscillator
    decays as if bare (docs/theory.md, 26). An upper bound of the share that 1:1 resonance captures.

    Examples
    --------
    >>> float(capture_rate(x_m=0.02, b=0.04))
    0.5
    """
    length = checked(b, "clearance b", "m", ABOVE_ZERO)
    return np.minimum(1.0, np.asarray(x_m, dtype=np.float64) / length)


@dataclass(frozen=True)
class BestClearance:
    """b*(level): the fastest clearance (m), its time (s), the share of starts it can catch."""

    b: float
    time: float
    capture_rate: float


def best_clearance(release: Decaying, *, level: float) -> BestClearance:
    """Clearance that brings a captured release to `level` soonest, b*(level).

    From x_m/4 to x_m/A_1, above which nothing is captured (at most 40 x_m).

    Parameters
    ----------
    release : Decaying
    level : float
        m.

    Examples
    --------
    >>> release = Decaying(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6, x_m=0.03)
    >>> best = best_clearance(release, level=0.005)
    >>> 0.04 < best.b < 0.055
    True
    """
    ends = 0.25 * release.x_m, release.x_m / max(float(A_1(release.r)), 1.0 / 40.0)
    for _ in range(4):  # the slope changes at both transitions: narrowing grids, no derivative
        grid = np.geomspace(*ends, 41)
        times = captured_time(release, b=grid, level=level)
        i = int(times.argmin())
        ends = (float(grid[max(i - 2, 0)]), float(grid[min(i + 2, 40)]))
    b = float(grid[i])
    return BestClearance(b, float(times[i]), float(capture_rate(x_m=release.x_m, b=b)))
