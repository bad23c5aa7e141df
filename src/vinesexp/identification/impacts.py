"""Mass and restitution from the impacts themselves (docs/theory.md, identification).

While the ball flies freely its speed follows from where it was at two impacts, y = x -+ b, and
when. So x(t), the times and sides of impacts and the clearance give the ball's speed before and
after each impact, and with it

    r = -(x'_after - y'_after)/(x'_before - y'_before)
    M = -m (y'_after - y'_before)/(x'_after - x'_before)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_FEWEST = 5
_HALF_WINDOW = 8e-3  # s: long enough for 1e-4 m/s, short enough for a cubic
_WEAK = 0.2  # of the median approach: weaker impacts add noise, not knowledge
_OUTLIER = 5.0  # scaled median deviations: a flight with an impact that was not found


@dataclass(frozen=True)
class ImpactFit:
    """What the impacts of one record tell.

    Attributes
    ----------
    r, r_error : restitution and standard error.
    mass_ratio, mass_ratio_error : m/M, from momentum.
    r_scatter : standard deviation of r between impacts.
    r_slope : change of r per m/s of approach speed.
    used : impacts.
    """

    r: float
    r_error: float
    mass_ratio: float
    mass_ratio_error: float
    r_scatter: float
    r_slope: float
    used: int


def ball_speeds(times: Floats, sides: Ints, x: Floats, *, clearance: float) -> Floats:
    """Speed of the ball in the flight from each impact to the next, m/s; shape (n - 1,).

    Examples
    --------
    >>> ball_speeds(np.array([0.0, 0.1]), np.array([1, -1]), np.array([0.0, 0.0]), clearance=0.01)
    array([0.2])
    """
    y = x - sides * clearance
    return np.asarray(np.diff(y) / np.diff(times))


def state_at_impacts(
    displacement: Floats, *, sample_rate: float, start: float, times: Floats, jumps: Floats
) -> tuple[Floats, Floats]:
    """Displacement and mean velocity of the oscillator at impacts, from the samples around each.

    A cubic with the known kink is fitted within 8 ms on either side; NaN where that reaches beyond
    the record or another impact falls into it.

    Parameters
    ----------
    displacement : ndarray
        Unfiltered, m: a filter would round the kink.
    sample_rate, start : float
        Hz; time of the first sample, s.
    times, jumps : ndarray, shape (n,)
        s; m/s.

    Examples
    --------
    >>> t = np.arange(1000) / 1000.0
    >>> x, v = state_at_impacts(2.0 * t + 0.1 * np.abs(t - 0.5), sample_rate=1000.0, start=0.0,
    ...                         times=np.array([0.5]), jumps=np.array([0.2]))
    >>> x.round(9), v.round(9)
    (array([1.]), array([2.]))
    """
    half = max(round(_HALF_WINDOW * sample_rate), 4)
    centre = np.round((times - start) * sample_rate).astype(np.int64)
    inside = (centre >= half) & (centre < len(displacement) - half)
    apart = np.diff(times, prepend=-np.inf, append=np.inf)
    alone = np.minimum(apart[:-1], apart[1:]) > half / sample_rate
    usable = np.flatnonzero(inside & alone)
    x, v = np.full(len(times), np.nan), np.full(len(times), np.nan)
    if usable.size:
        rows = centre[usable, None] + np.arange(-half, half + 1)
        late = rows / sample_rate + start - times[usable, None]
        scaled = late * sample_rate / half
        samples = displacement[rows] - 0.5 * jumps[usable, None] * np.abs(late)
        basis = scaled[..., None] ** np.arange(4)
        normal = np.einsum("nij,nik->njk", basis, basis)
        right = np.einsum("nij,ni->nj", basis, samples)
        found = np.linalg.solve(normal, right[..., None])[..., 0]
        x[usable], v[usable] = found[:, 0], found[:, 1] * sample_rate / half
    return x, v


def fit_impacts(
    times: Floats, sides: Ints, x: Floats, v: Floats, jumps: Floats, *, clearance: float
) -> ImpactFit:
    """Restitution and mass ratio from the impacts of one NES.

    Parameters
    ----------
    times, sides : ndarray, shape (n,)
        s; +1 where x - y = +b.
    x, v : ndarray, shape (n,)
        At each impact: displacement, m, and mean of the velocities before and after, m/s.
    jumps : ndarray, shape (n,)
        Velocity jump of the oscillator, m/s.
    clearance : float
        b, m.

    Raises
    ------
    AnalysisError
        Fewer than five impacts between two flights each.
    """
    if len(times) < _FEWEST + 2:
        raise AnalysisError(f"{len(times)} impacts, expected {_FEWEST + 2} or more")
    speeds = ball_speeds(times, sides, x, clearance=clearance)
    inner = slice(1, -1)
    before = v[inner] - 0.5 * jumps[inner] - speeds[:-1]
    after = v[inner] + 0.5 * jumps[inner] - speeds[1:]
    approach = before * sides[inner]
    ratio = -after / np.where(before == 0.0, np.inf, before)
    momentum = -jumps[inner] / np.where(np.diff(speeds) == 0.0, np.inf, np.diff(speeds))
    good = np.isfinite(ratio) & np.isfinite(momentum) & (approach > 0.0)
    if good.any():
        good &= approach > _WEAK * float(np.median(approach[good]))
    for values in (ratio, momentum):
        good &= _inliers(values, good)
    if int(good.sum()) < _FEWEST:
        raise AnalysisError(
            f"{int(good.sum())} impacts between two complete flights, expected {_FEWEST} or more"
        )
    r, r_error, scatter = _weighted(ratio[good], approach[good] ** 2)
    q, q_error, _ = _weighted(momentum[good], np.diff(speeds)[good] ** 2)
    return ImpactFit(
        r=r,
        r_error=r_error,
        mass_ratio=q,
        mass_ratio_error=q_error,
        r_scatter=scatter,
        r_slope=_slope(approach[good], ratio[good]),
        used=int(good.sum()),
    )


def _inliers(values: Floats, good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    if not good.any():
        return good
    centre = np.median(values[good])
    spread = 1.4826 * np.median(np.abs(values[good] - centre))
    return np.asarray(np.abs(values - centre) <= _OUTLIER * max(spread, 1e-6 * abs(centre)))


def _weighted(values: Floats, weights: Floats) -> tuple[float, float, float]:
    """Weighted mean, its standard error, and the weighted scatter."""
    total = float(weights.sum())
    mean = float(weights @ values) / total
    effective = total**2 / float(weights @ weights)
    scatter = float(np.sqrt(weights @ (values - mean) ** 2 / total))
    return mean, scatter / float(np.sqrt(max(effective - 1.0, 1.0))), scatter


def _slope(x: Floats, y: Floats) -> float:
    spread = x - x.mean()
    square = float(spread @ spread)
    return float(spread @ (y - y.mean())) / square if square > 0.0 else 0.0
