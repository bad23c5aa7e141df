"""Which spikes of a record are impacts of its one ball: those between which it can have flown.

A ball flies straight from wall to wall, so that two impacts in a row and the clearance say how
fast it arrives, and the mass must jump in proportion to that. Friction of the mass's guide where it
turns, a knock on the table, a mount that rings: each makes spikes at times at which the ball was at
no wall. Left out, they make the flights around them straight again; that tells them from an impact,
however large or small they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray, IntArray

_LARGE = 0.3  # of the largest jumps: from these the law is learnt
_FEWEST = 12  # of them
_SCATTER = 0.1  # of a jump about the law, while it is learnt
_ANY_CLEARANCE = 0.3  # of the usual jump, that another clearance than the stated one may explain
_STEPS = 30
_TINY = 1e-6
_OWN, _LEAST = 0.1, 0.05  # of a jump, and of the usual one: what friction, tilt, rolling make of it
_CAP = 8.0  # cost of a flight that the law does not explain, and of a spike that is left out
_CAP_OF_DOUBTFUL = 1.0  # of a spike that does not seem to move the mass
_AT_AN_END = 7.5  # of a spike before the first impact or after the last: one flight speaks for it
_UNKNOWN = 3.0  # the same where place or velocity are not known
_SKIPS = 8  # spikes in a row that are no impacts
_CONSISTENT = 0.6  # of the flights that are left


@dataclass(frozen=True)
class _Law:
    """Jump of the mass over the relative velocity, with its sign; clearance, m; usual jump, m/s."""

    share: float
    clearance: float
    usual: float


def of_the_ball(
    time: FloatArray, x: FloatArray, v_before: FloatArray, jump: FloatArray,
    jump_error: FloatArray, *, clearance: float, doubtful: BoolArray | None = None,
) -> BoolArray | None:  # fmt: skip
    """Which spikes are impacts of the ball: where they are too few to tell, all not doubtful.

    None where they are many and no law of flights holds, or they push the mass the way it moves: a
    ball takes its energy from the mass, whatever its clearance.

    The most probable subset: each flight costs what it misses the law of momentum by, each spike
    that is left out as much as a flight that nothing explains.

    Parameters
    ----------
    time : array (n,)
        s, in order.
    x, v_before : arrays (n,)
        Of the mass at each, m and m/s; NaN where not known.
    jump, jump_error : arrays (n,)
        Of its velocity, m/s.
    clearance : float
        As stated, m; another one is found where flights ask for it.
    doubtful : bool array (n,), optional
        Where the mass does not seem to move. A ball that bounces at one wall and is carried by it
        afterwards makes such spikes: its small jumps go over into a steady push. They say nothing
        of the law, and are left out for less.

    Examples
    --------
    A mass at rest, a ball of a hundredth of it at 1 m/s, and a spike in the middle of a flight.

    >>> t = np.sort(np.append(np.arange(20) * 0.05, 0.512))
    >>> jump = np.where(np.arange(21) % 2, 0.02, -0.02); jump[11] = 0.001; jump[12:] *= -1
    >>> none = np.zeros(21)
    >>> kept = of_the_ball(t, none, none, jump, none, clearance=0.025)
    >>> np.flatnonzero(~kept).tolist()
    [11]
    """
    n = time.size
    given = _Spikes(time, x, v_before, jump, jump_error, -np.sign(jump))
    doubt = np.zeros(n, dtype=bool) if doubtful is None else doubtful
    known = np.isfinite(x + v_before + jump) & ~doubt
    least = _LARGE * np.quantile(np.abs(jump[known]), 0.9) if known.any() else 0.0
    large = np.flatnonzero(known & (np.abs(jump) >= least))
    if large.size < _FEWEST:
        return ~doubt
    laws = (_law(given, large, clearance, free) for free in (0.0, _ANY_CLEARANCE))
    out = np.where(doubt, _CAP_OF_DOUBTFUL, _CAP)
    found = [_flown(given, law, out) for law in laws if law is not None]
    _, kept, explained = min(found, key=lambda one: one[0], default=(0.0, None, 0))
    if kept is None or explained < max(_FEWEST, _CONSISTENT * kept.sum()):
        return None
    return kept if np.nansum((jump * v_before)[kept]) <= 0.0 else None


@dataclass(frozen=True)
class _Spikes:
    """What is known of each spike."""

    time: FloatArray
    x: FloatArray
    v_before: FloatArray
    jump: FloatArray
    error: FloatArray
    side: FloatArray

    def of(self, i: IntArray, j: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Of flights from i to j: relative velocity at the end if the cavity had no length, what
        one of 1 m would add, and the jump at the end."""
        T = self.time[j] - self.time[i]
        flat = self.v_before[j] - (self.x[j] - self.x[i]) / T
        return flat, (self.side[j] - self.side[i]) / T, self.jump[j]


def _flown(given: _Spikes, law: _Law, out: FloatArray) -> tuple[float, BoolArray, int]:
    """The most probable subset: its cost, which spikes, and how many flights the law explains.

    `out` is what each costs that is left out.
    """
    n = given.time.size
    cost = np.full((n, _SKIPS + 1), np.inf)  # of the flight to each from those before it
    for back in range(1, min(_SKIPS + 2, n)):
        j = np.arange(back, n)
        flat, across, jump = given.of(j - back, j)
        asked = law.share * (flat + law.clearance * across)
        size = np.maximum(np.abs(jump), np.abs(asked))
        error = np.hypot(_OWN * size, np.maximum(_LEAST * law.usual, given.error[j]))
        off = 0.5 * ((jump + asked) / error) ** 2
        cost[j, back - 1] = np.where(np.isfinite(off), np.minimum(off, _CAP), _UNKNOWN)
    least, kept = _cheapest(cost, out)
    own = np.flatnonzero(kept)
    return least, kept, int((cost[own[1:], np.diff(own) - 1] < 0.5 * _CAP).sum())


def _law(given: _Spikes, large: IntArray, clearance: float, any_clearance: float) -> _Law | None:
    """What the large jumps that follow one another have in common; None where nothing.

    The clearance is the stated one, or another one where `any_clearance` is above zero.
    """
    flat, across, jump = given.of(large[:-1], large[1:])
    usual = float(np.median(np.abs(jump)))
    columns = -np.stack([flat + clearance * across, across], axis=1)
    held = [0.0, float(np.sqrt(np.mean(across**2))) / (max(any_clearance, _TINY) * usual)]
    weight = np.ones(jump.size)
    for _ in range(_STEPS):
        rows = np.vstack([columns * (weight / (_SCATTER * usual))[:, np.newaxis], held])
        wanted = np.append(jump * weight / (_SCATTER * usual), 0.0)
        share, more = np.linalg.lstsq(rows, wanted, rcond=None)[0]
        off = jump - columns @ [share, more]
        weight = 1.0 / np.hypot(1.0, off / (_SCATTER * usual))
    if not share > 0.0 or not clearance + more / share > 0.0:
        return None
    return _Law(float(share), clearance + float(more / share), usual)


def _cheapest(cost: FloatArray, out: FloatArray) -> tuple[float, BoolArray]:
    """The least cost of a subset, and this subset.

    `cost` (n, back - 1) is that of flights, `out` that of each spike that is left out.
    """
    n, most = cost.shape
    before_each = np.append(0.0, np.cumsum(out))
    total, before = np.empty(n), np.full(n, -1)
    for j in range(n):
        total[j] = _AT_AN_END * j  # as the first impact
        back = min(most, j)
        if back:
            between = before_each[j] - before_each[j - back + 1 : j + 1][::-1]
            ways = total[j - back : j][::-1] + cost[j, :back] + between
            best = int(np.argmin(ways))
            if ways[best] <= total[j]:
                total[j], before[j] = ways[best], j - 1 - best
    ends = total + _AT_AN_END * (n - 1 - np.arange(n))
    kept = np.zeros(n, dtype=bool)
    at = n - 1 - int(np.argmin(ends[::-1]))
    while at >= 0:
        kept[at] = True
        at = before[at]
    return float(ends.min()), kept
