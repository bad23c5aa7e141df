"""Names of the response regimes, with definitions that measured and simulated records share.

Everything is judged by the impacts alone: how many fall into a cycle, on which side, how alike the
cycles are, and whether two impacts per cycle come and go. Theory, simulation and records use the
same words. They are those of section 2.2 of the paper; docs/theory.md, section 9, has the sources.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.errors import ParameterError


class Regime(Enum):
    """A response regime; its value is the name used in files and figures."""

    NO_IMPACT = "no impact"
    CHAOS = "chaos"
    MODULATED = "strongly modulated"
    TWO_SYMMETRIC = "two symmetric"
    TWO_ASYMMETRIC = "two asymmetric"
    MORE = "three or more per cycle"
    CHATTER = "chatter"


#: name -> definition, as a report prints it.
REGIMES: dict[str, str] = {
    "no impact": "no ball meets a wall after the transient",
    "chaos": "impacts, but in under a tenth of the cycles (of a release: under half of its first "
    "ones) one on either side",
    "strongly modulated": "of a steady excitation: spells of two impacts per cycle come and go, "
    "three or more of them, or a tenth to nine tenths of the cycles; or their phase swings by 0.03 "
    "of a period or more",
    "two symmetric": "one impact on either side in nine cycles of ten (of a release: in half of "
    "its first ones), half a period apart, in one spell or two, their phase steady",
    "two asymmetric": "the same, unequally spaced",
    "three or more per cycle": "more than two and a half impacts per cycle on the average",
    "chatter": "the ball comes to rest on a wall (ten impacts on one side within half a period)",
}

#: Regimes in which two impacts per cycle are permanent: the smooth side of the valley.
PERMANENT = (Regime.TWO_SYMMETRIC.value, Regime.TWO_ASYMMETRIC.value)

#: Impacts per cycle below which a driven ball lies still: what is found then is noise.
STILL = 0.1

#: Cycles of a steady test from which on they may be called so.
TELLING = 15

#: What the cell of a sweep says in place of a regime: it has several, one after the other.
BY_FREQUENCY = "by frequency"

_BETWEEN_BALLS = " | "

CAPTURED = 0.9  # share of cycles with one impact on either side: permanent
HALF = 0.5  # the same of the first cycles of a release: captured
ESCAPED = 0.1  # share below which there is no capture at all
ASYMMETRY = 0.02  # of a period: two gaps that differ by more are unequal
SWINGS = 0.03  # of a period: impacts whose phase swings by more are not permanent
COME_AND_GO = 3  # spells from which on even nine cycles of ten are not permanent
PAIRED = 0.1  # of a period, by which two gaps may miss it
MANY = 2.5  # impacts per cycle
CHATTER_RUN = 10  # impacts on one side within half a period
#: Impacts that it takes to tell whether their phase swings.
FEWEST = 40
_ENDS = (5.0, 95.0)  # percentiles: a false impact or two do not count
_SETTLES = 0.6  # of the first half's swing: a second half below that is on its way to rest


def of_balls(words: Iterable[str]) -> str:
    """One cell of a table for the words of each ball.

    Examples
    --------
    >>> of_balls(["two symmetric", "chaos"])
    'two symmetric | chaos'
    """
    return _BETWEEN_BALLS.join(words)


def each_ball(cell: str) -> list[str]:
    """The words of each ball in a cell that `of_balls` made; of one ball, the cell itself.

    Examples
    --------
    >>> each_ball("two symmetric | chaos")
    ['two symmetric', 'chaos']
    """
    return cell.split(_BETWEEN_BALLS)


@dataclass(frozen=True)
class Swing:
    """Half the range of the impacts' phase, in periods, in the first and the second half.

    On a periodic orbit every impact comes half a period after the one before. Where the orbit has
    lost its stability the phase swings, at first by little and with every impact still there:
    counting impacts does not show it, and a record may end before the ball is lost again. NaN where
    there are too few impacts.
    """

    first: float = math.nan
    second: float = math.nan

    @property
    def settles(self) -> bool:
        """Whether it dies away: the motion is on its way to a periodic one."""
        return self.second < _SETTLES * self.first

    @property
    def lasting(self) -> float:
        """The swing that stays: of the second half where it settles, else the larger one."""
        return self.second if self.settles else max(self.first, self.second)


#: Of too few impacts.
UNKNOWN = Swing()


@dataclass(frozen=True)
class RegimeCount:
    """What the impacts say: the regime and the numbers it was judged by.

    Attributes
    ----------
    regime : the regime.
    impacts_per_cycle : average.
    captured : share of cycles with exactly one impact on either side.
    asymmetry : difference of the two median gaps in captured cycles over the period (NaN without).
    swing : how far the phase of captured impacts swings (NaN where they are few).
    """

    regime: Regime
    impacts_per_cycle: float
    captured: float
    asymmetry: float
    swing: Swing = UNKNOWN


def regime_of(
    times: ArrayLike,
    sides: ArrayLike,
    *,
    period: float,
    start: float,
    end: float,
    decaying: bool = False,
) -> RegimeCount:
    """Judge the impacts of one ball between `start` and `end`.

    Modulated response is one that comes back: a release passes through its regimes once, so its
    stretch is named after what fills half of it.

    Parameters
    ----------
    times, sides : array_like
        Impact times (s, increasing) and sides (+1, -1).
    period : float
        Of the oscillation, s.
    start, end : float
        The stretch to be judged, s; at least one period long.
    decaying : bool
        The stretch is of a release: never strongly modulated.

    Raises
    ------
    ParameterError
        A stretch shorter than a period.

    Examples
    --------
    >>> t = 0.1 + 0.5 * np.arange(200)
    >>> regime_of(t, (-1.0) ** np.arange(200), period=1.0, start=0.0, end=100.0).regime.value
    'two symmetric'
    """
    if not end - start >= period > 0.0:
        raise ParameterError(
            f"regime: a stretch of {end - start:.6g} s, expected a period ({period:.6g} s) or more"
        )
    t, side = np.asarray(times, dtype=np.float64), np.asarray(sides)
    keep = (t >= start) & (t <= end)
    t, side = t[keep], side[keep]
    cycles = (end - start) / period
    if t.size == 0:
        return RegimeCount(Regime.NO_IMPACT, 0.0, 0.0, float("nan"))
    gaps, paired = _paired_gaps(t, side, period)
    # one impact more, because the stretch cuts a cycle at its ends
    captured = min(0.5 * (int(paired.sum()) + 1) / cycles, 1.0) if paired.any() else 0.0
    asymmetry = float(np.ptp(gaps)) / period if gaps.size == 2 else float("nan")
    per_cycle = t.size / cycles
    swing = swing_of(t, side, paired, period=period)
    if decaying:
        permanent = captured >= HALF
    else:
        recurring = len(activation_spells(t, side, period=period)) >= COME_AND_GO
        # NaN where impacts are few: no swing is shown
        permanent = captured >= CAPTURED and not recurring and not swing.lasting > SWINGS
    if per_cycle <= MANY and permanent:
        regime = Regime.TWO_SYMMETRIC if asymmetry <= ASYMMETRY else Regime.TWO_ASYMMETRIC
    elif per_cycle <= MANY and captured >= ESCAPED and not decaying:
        regime = Regime.MODULATED
    else:
        regime = _irregular(t, side, period, per_cycle)
    return RegimeCount(regime, per_cycle, captured, asymmetry, swing)


def _paired_cycles(t: np.ndarray, side: np.ndarray, period: float) -> BoolArray:
    """Whether the impacts from each one to the next but one are a cycle with one on either side."""
    gap = np.diff(t)
    crosses = side[1:] != side[:-1]
    near = np.abs(gap[:-1] + gap[1:] - period) < PAIRED * period
    return np.asarray(crosses[:-1] & crosses[1:] & near)


def activation_spells(times: ArrayLike, sides: ArrayLike, *, period: float) -> np.ndarray:
    """Stretches of one impact on either side per cycle: when each begins and ends.

    A single odd cycle does not end a spell. In strongly modulated response they come and go; a
    release has one, from capture to where the ball is lost.

    Parameters
    ----------
    times, sides : array_like
        Impact times of one ball (s, increasing) and sides (+1, -1).
    period : float
        Of the oscillation, s.

    Returns
    -------
    array, shape (n, 2)
        Times of first and last impact of each, s; only spells of two cycles or more.

    Examples
    --------
    >>> t = np.concatenate([0.5 * np.arange(20), 30.0 + 0.5 * np.arange(10)])
    >>> activation_spells(t, (-1.0) ** np.arange(30), period=1.0)
    array([[ 0. ,  9.5],
           [30. , 34.5]])
    """
    t, side = np.asarray(times, dtype=np.float64), np.asarray(sides)
    if t.size < 3:
        return np.empty((0, 2))
    cycle = _paired_cycles(t, side, period)
    begins, ends = t[:-2][cycle], t[2:][cycle]
    if not begins.size:
        return np.empty((0, 2))
    apart = begins[1:] - ends[:-1] > 1.5 * period
    first = begins[np.concatenate([[True], apart])]
    last = ends[np.concatenate([apart, [True]])]
    spells = np.stack([first, last], axis=1)
    return np.asarray(spells[spells[:, 1] - spells[:, 0] >= 1.9 * period])


def _paired_gaps(t: np.ndarray, side: np.ndarray, period: float) -> tuple[np.ndarray, BoolArray]:
    """Gaps out of captured cycles as (from +1, from -1) medians, and which impacts bound them.

    Captured: sides alternate, and two gaps together last a period.
    """
    if t.size < 3:
        return np.empty(0), np.zeros(t.size, dtype=bool)
    gap, cycle = np.diff(t), _paired_cycles(t, side, period)
    part = np.zeros(gap.size, dtype=bool)
    part[:-1] |= cycle
    part[1:] |= cycle
    impacts = np.zeros(t.size, dtype=bool)
    impacts[:-1] |= part
    impacts[1:] |= part
    medians = [float(np.median(g)) for s in (1, -1) if (g := gap[part & (side[:-1] == s)]).size]
    return np.array(medians), impacts


def _irregular(t: np.ndarray, side: np.ndarray, period: float, per_cycle: float) -> Regime:
    """Without two impacts per cycle: chatter, more than two, or chaos."""
    n = CHATTER_RUN
    if t.size >= n:
        same = np.lib.stride_tricks.sliding_window_view(side, n)
        within = t[n - 1 :] - t[: t.size - n + 1] < 0.5 * period
        if np.any(within & np.all(same == same[:, :1], axis=1)):
            return Regime.CHATTER
    return Regime.MORE if per_cycle > MANY else Regime.CHAOS


def swing_of(times: FloatArray, sides: np.ndarray, captured: BoolArray, *, period: float) -> Swing:
    """Swing of the phase of captured impacts around a uniform one.

    A phase that drifts in proportion to time or its square is the frequency of the shaker, and two
    sides with phases of their own are an asymmetric orbit: neither is a swing.

    Parameters
    ----------
    times, sides : arrays (n,)
        Of all impacts of one ball, s and +1 or -1.
    captured : bool array (n,)
        Those of cycles with one impact on either side.
    period : float
        Of the oscillation, s.

    Examples
    --------
    >>> n = np.arange(400)
    >>> sides, every = (-1) ** n, np.ones(400, dtype=bool)
    >>> steady = swing_of(0.5 * n, sides, every, period=1.0)
    >>> swings = swing_of(0.5 * n + 0.05 * np.sin(0.2 * n), sides, every, period=1.0)
    >>> steady.lasting < 1e-9, 0.045 < swings.lasting < 0.055, swings.settles
    (True, True, False)
    """
    if captured.sum() < FEWEST:
        return UNKNOWN
    half = 0.5 * period
    number = np.concatenate([[0.0], np.cumsum(np.round(np.diff(times) / half))])[captured]
    t, side = times[captured], sides[captured].astype(np.float64)
    along = (t - t[0]) / max(float(np.ptp(t)), period)
    basis = np.stack([np.ones_like(t), along, along * along, side], axis=1)
    late = t - half * number
    phase = (late - basis @ np.linalg.lstsq(basis, late, rcond=None)[0]) / period
    middle = 0.5 * (t[0] + t[-1])
    return Swing(*(_half_range(phase[part]) for part in (t <= middle, t > middle)))


def _half_range(phase: FloatArray) -> float:
    if not phase.size:
        return math.nan
    low, high = np.percentile(phase, _ENDS)
    return 0.5 * float(high - low)
