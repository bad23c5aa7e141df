"""M and r from impacts: between walls the ball flies freely, so its velocity is known.

At an impact the ball is at y = x - side b. Between two impacts of one ball it flies straight,

    u_j = (y_{j+1} - y_j)/(t_{j+1} - t_j),

so it gives and takes the momentum m (u_j - u_{j-1}), and the mass M (x'_after - x'_before):
M = -m du/dx', r = -(x'_after - u_j)/(x'_before - u_{j-1}) (docs/theory.md: what identifies what).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray, IntArray, median_of, spread_of
from vinesexp.errors import AnalysisError
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.units import SIGNIFICANT

_FEWEST = 10  # impacts with a flight before and after
_CERTAIN = 0.9  # that an impact is one, and of this ball
_APART = 0.02  # periods to the nearest other impact: a pair disturbs each other's jump
_WALLS_DIFFER = 1e-3  # in r: from there on the mean of the walls is r, however often each is hit
_LONGEST = 0.9  # periods: a longer flight may hide an impact


@dataclass(frozen=True)
class Flights:
    """Impacts that have a free flight before and after.

    Attributes
    ----------
    index : int array (n,)
        Rows of the impact table.
    u_before, u_after : arrays (n,)
        Ball's velocity, m/s.
    v_before, v_after : arrays (n,)
        Oscillator's velocity, m/s.
    jump, jump_error : arrays (n,)
        Of the oscillator's velocity, m/s.
    side : array (n,)
        +1 where x - y = +b.
    time_before, time_after : arrays (n,)
        How long the flights last, s.
    v_previous, v_next : arrays (n,)
        Oscillator's velocity where the flight before began and where the one after ends, m/s.
    jump_acceleration, jump_displacement : arrays (n,)
        What either channel says of the jump, m/s; NaN where it says nothing.
    clearance : array (n,)
        In the test log, m.
    pulse : array (n,)
        How long a half-sine of this area and peak lasts, s; NaN without an accelerometer.
    """

    index: IntArray
    u_before: FloatArray
    u_after: FloatArray
    v_before: FloatArray
    v_after: FloatArray
    jump: FloatArray
    jump_error: FloatArray
    side: FloatArray
    time_before: FloatArray
    time_after: FloatArray
    v_previous: FloatArray
    v_next: FloatArray
    jump_acceleration: FloatArray
    jump_displacement: FloatArray
    clearance: FloatArray
    pulse: FloatArray

    @cached_property
    def speed(self) -> FloatArray:
        """Relative speed of each impact, by the stated clearance, m/s."""
        return np.asarray(np.abs(self.v_before - self.u_before))

    @property
    def unlike(self) -> float:
        """By what share of it the impulse of one impact differs from that of the next, by its r.

        0 of few impacts.
        """
        before = self.v_before - self.u_before
        r = (self.u_after - self.v_after)[before != 0.0] / before[before != 0.0]
        r = np.clip(r[np.isfinite(r)], 0.0, 1.0)  # of another clearance, it is anything
        return float(spread_of(r) / (1.0 + median_of(r))) if r.size >= _FEWEST else 0.0

    def keep(self, chosen: NDArray[np.bool_]) -> Flights:
        return Flights(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))


def flights_of(impacts: Impacts, *, nes: int, b: float, period: float) -> Flights:
    """Free flights of one ball from wall to wall.

    Parameters
    ----------
    impacts : Impacts
    nes : int
        Number of the ball, from 1.
    b : float
        Its clearance, m.
    period : float
        Of the oscillation, s: flights longer than 0.9 of it may hide an impact that was missed.
    """
    own = np.flatnonzero((impacts.nes == nes) & (np.nan_to_num(impacts.nes_confidence) >= _CERTAIN))
    t, x = impacts.time_s[own], impacts.x_m[own]
    side = impacts.side[own]
    y = x - side * b
    dt = np.diff(t)
    sure = (
        (impacts.confidence[own] > _CERTAIN)
        & np.isfinite(x)
        & (impacts.crowded[own] == 0)
        & (impacts.clipped[own] == 0)
    )
    gap = np.diff(impacts.time_s, prepend=-np.inf, append=np.inf)
    sure &= np.minimum(gap[:-1], gap[1:])[own] > _APART * period
    crosses = (side[1:] != side[:-1]) & (dt < _LONGEST * period) & sure[1:] & sure[:-1]
    crosses &= impacts.unseen_before[own][1:] == 0
    # A ball that bounces on one wall, lower each time, may rest there unseen and leave later.
    jump = np.abs(impacts.velocity_jump_m_s[own])
    next_jump = jump[1:-1] ** 2 / np.maximum(jump[:-2], 1e-300)
    crosses[1:] &= (side[1:-1] != side[:-2]) | (next_jump >= np.min(jump, initial=np.inf))
    # Impacts of unknown origin in between may have been this ball's.
    others = np.flatnonzero(
        (impacts.nes != nes) & ~(np.nan_to_num(impacts.nes_confidence) >= _CERTAIN)
    )
    if others.size:
        between = np.searchsorted(impacts.time_s[others], t)
        crosses &= between[1:] == between[:-1]
    u = np.divide(np.diff(y), dt, out=np.full(dt.size, np.nan), where=dt > 0.0)
    inner = np.flatnonzero(crosses[1:] & crosses[:-1]) + 1
    rows = own[inner]
    v = impacts.v_before_m_s[rows]
    jump = impacts.velocity_jump_m_s[rows]
    before, after = own[inner - 1], own[inner + 1]
    return Flights(
        index=rows,
        u_before=u[inner - 1],
        u_after=u[inner],
        v_before=v,
        v_after=v + jump,
        jump=jump,
        jump_error=impacts.velocity_jump_error_m_s[rows],
        side=side[inner].astype(np.float64),
        time_before=dt[inner - 1],
        time_after=dt[inner],
        v_previous=impacts.v_before_m_s[before] + impacts.velocity_jump_m_s[before],
        v_next=impacts.v_before_m_s[after],
        jump_acceleration=_shown(impacts.jump_acceleration_m_s[rows]),
        jump_displacement=_shown(impacts.jump_displacement_m_s[rows]),
        clearance=np.full(rows.size, b),
        pulse=impacts.pulses[rows],
    )


def _shown(jumps: FloatArray) -> FloatArray:
    """Jumps of one channel; NaN where it shows none: an impact without a jump is no impact."""
    return np.where(jumps == 0.0, np.nan, jumps)


@dataclass(frozen=True)
class MassRatio:
    """eps = m/M of the ball that hits, its standard error, and the impacts used."""

    eps: float
    error: float
    count: int


def mass_ratio(flights: Flights) -> MassRatio:
    """Slope of the oscillator's jumps over the ball's, robustly.

    Raises
    ------
    AnalysisError
        Fewer than ten impacts with free flights before and after.
    """
    _require(flights)
    du, dv = flights.u_after - flights.u_before, flights.jump
    weight = 1.0 / flights.jump_error**2
    keep = np.ones(du.size, dtype=bool)
    slope = error = 0.0
    for _ in range(5):
        w = weight * keep
        slope = float((w * du * dv).sum() / (w * du * du).sum())
        rest = (dv - slope * du) / flights.jump_error
        middle = np.median(rest[keep])  # not 0 where something speeds the ball up as it flies
        freedom = max(1, int(keep.sum()) - 1)
        scale = max(1.0, float((rest[keep] ** 2).sum()) / freedom)
        error = float(np.sqrt(scale / (w * du * du).sum()))
        new = np.abs(rest - middle) < SIGNIFICANT * max(1.0, spread_of(rest[keep]))
        if (new == keep).all():
            break
        keep = new
    return MassRatio(-slope, error, int(keep.sum()))


@dataclass(frozen=True)
class Restitution:
    """r: mean of both walls, its standard error, scatter of single impacts.

    Attributes
    ----------
    r, error : float
    scatter : float
        Standard deviation from impact to impact, around each wall's own mean.
    walls : tuple of float
        r at the walls +1 and -1; NaN where a wall was not hit.
    count : int
    """

    r: float
    error: float
    scatter: float
    walls: tuple[float, float]
    count: int


def restitution(flights: Flights) -> Restitution:
    """Relative velocity after over before, averaged robustly over the impacts of each wall.

    An impact is an outlier among those of its own wall: two walls of different r are no outliers.

    Raises
    ------
    AnalysisError
        Fewer than ten impacts with free flights before and after.
    """
    _require(flights)
    before = flights.v_before - flights.u_before
    after = flights.v_after - flights.u_after
    keep = _alike(-after / before, flights.side)
    shared = (flights.u_after[:-1] == flights.u_before[1:]) & keep[:-1] & keep[1:]
    before, after, side = np.abs(before[keep]), np.abs(after[keep]), flights.side[keep]
    walls = tuple(_ratio(after[side == s], before[side == s]) for s in (1.0, -1.0))
    # Errors of speed are the same for all: least squares of after over before.
    value = _ratio(after, before)
    own = np.where(side > 0.0, walls[0], walls[1])
    if abs(walls[0] - walls[1]) > _WALLS_DIFFER:
        value = 0.5 * (walls[0] + walls[1])
    else:
        own = np.full(before.size, value)
    rest = after - own * before
    freedom = max(1, before.size - 1)
    # The flight between two impacts enters both: their misfits go together.
    parts = np.zeros(keep.size)
    parts[keep] = before * rest
    alone = float((parts**2).sum())
    together = alone + 2.0 * float((parts[:-1] * parts[1:])[shared].sum())
    variance = max(together, 0.5 * alone) * before.size / freedom
    error = float(np.sqrt(variance) / (before**2).sum())
    single = rest / before
    return Restitution(
        value, error, float(single.std(ddof=1)), (walls[0], walls[1]), before.size
    )  # fmt: skip


def _alike(r: FloatArray, side: FloatArray) -> NDArray[np.bool_]:
    """Impacts that are no outliers among those of their wall."""
    keep = np.zeros(r.size, dtype=bool)
    for wall in (1.0, -1.0):
        own = side == wall
        if own.any():
            off = np.abs(r[own] - np.median(r[own]))
            keep[own] = off <= SIGNIFICANT * max(spread_of(r[own]), 1e-12)
    return keep


def _ratio(after: FloatArray, before: FloatArray) -> float:
    return float((after * before).sum() / (before * before).sum()) if before.size else np.nan


def _require(flights: Flights) -> None:
    if flights.index.size < _FEWEST:
        found = f"{flights.index.size} impact{'s' * (flights.index.size != 1)}"
        raise AnalysisError(
            f"{found} with a free flight before and after, expected {_FEWEST} or more"
        )
