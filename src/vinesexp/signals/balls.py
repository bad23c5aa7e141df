"""Which impacts are judged together: those of one ball, or of all where they are not told apart.

The two decay rates of a release with an NES: while the ball is captured, and after it is lost.

While there is one impact on either side in each cycle the amplitude falls fast, down to T1; from
there on the ball hits when it happens to, and the amplitude falls more slowly. The impacts show
when the ball is lost; the amplitude shows how fast it falls on either side of that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.settings.stages import RegimeSettings
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.theory.regime_definitions import activation_spells

#: Clearances that differ by less than this share are alike.
_ALIKE = 0.01


#: Of two balls with like clearances, one with fewer impacts than this share of the other's
#: hits together with it: two impacts at one time are found as one.
_TOGETHER = 0.2


_FEWEST = 4  # cycles that a decay rate is fitted to


@dataclass(frozen=True)
class Series:
    """Impacts that are judged together.

    Attributes
    ----------
    ball : from 1; 0: all balls, which are not told apart.
    clearance : of the ball, m; the largest of all balls where they are not told apart.
    time, side : of its impacts; s on the record's axis.
    """

    ball: int
    clearance: float
    time: FloatArray
    side: FloatArray


def by_ball(impacts: Impacts, clearance: Sequence[float], *, unowned_share: float) -> list[Series]:
    """One series a ball, or one of all impacts.

    Two balls stay together where more than `unowned_share` of the impacts have no owner, and where
    like balls move as one: their impacts then coincide, and all of them go to either.

    Parameters
    ----------
    impacts : Impacts
    clearance : sequence of float
        One-sided, m, one per ball.
    unowned_share : float
        Impacts without an owner that are left out, as a share of all.
    """
    n = len(clearance)
    side = impacts.side.astype(np.float64)
    if n == 1:
        return [Series(1, clearance[0], impacts.time_s, side)]
    own = [impacts.nes == ball for ball in range(1, n + 1)]
    unowned = 1.0 - sum(int(mine.sum()) for mine in own) / max(impacts.n, 1)
    if unowned > unowned_share or _as_one([int(mine.sum()) for mine in own], clearance):
        return [Series(0, max(clearance), impacts.time_s, side)]
    return [
        Series(ball, b, impacts.time_s[mine], side[mine])
        for ball, (b, mine) in enumerate(zip(clearance, own, strict=True), start=1)
    ]


def _as_one(counts: Sequence[int], clearance: Sequence[float]) -> bool:
    """Whether one of two like balls has next to no impacts of its own."""
    return any(
        abs(b - other) <= _ALIKE * other and few < _TOGETHER * many
        for few, b in zip(counts, clearance, strict=True)
        for many, other in zip(counts, clearance, strict=True)
    )


@dataclass(frozen=True)
class Transition:
    """Mean decay rates of the amplitude (1/s), and the amplitude (m) where the ball is lost."""

    rate_before: float
    rate_after: float
    amplitude: float


def transition_of(
    time: FloatArray, amplitude: FloatArray, *, lost: float, settings: RegimeSettings | None = None
) -> Transition | None:
    """Straight lines through the logarithm of the amplitude before and after a time.

    Parameters
    ----------
    time, amplitude : arrays (n,)
        Cycle by cycle, s and m (`cycles.cycle_amplitudes`).
    lost : float
        When the ball is lost, s: end of the first of
        `theory.regime_definitions.activation_spells`.

    Returns
    -------
    Transition or None
        None with fewer than four cycles above 2 % of the largest amplitude on either side.

    Examples
    --------
    >>> t = np.arange(0.0, 10.0, 0.125)
    >>> A = np.where(t < 4.0, np.exp(-0.5 * t), np.exp(-2.0 - 0.3 * (t - 4.0)))
    >>> found = transition_of(t, A, lost=4.0)
    >>> round(found.rate_before, 3), round(found.rate_after, 3), round(found.amplitude, 3)
    (0.5, 0.3, 0.135)
    """
    settings = RegimeSettings() if settings is None else settings
    start = int(np.argmax(amplitude)) if amplitude.size else 0
    t, A = time[start:], amplitude[start:]
    low = np.flatnonzero(~(settings.transition_floor * A[:1] < A))
    t, A = (v[: low[0]] if low.size else v for v in (t, A))
    before = t < lost
    if min(int(before.sum()), int((~before).sum())) < settings.transition_cycles:
        return None
    rates = [-float(np.polyfit(t[part], np.log(A[part]), 1)[0]) for part in (before, ~before)]
    return Transition(rates[0], rates[1], float(np.exp(np.interp(lost, t, np.log(A)))))


def transition_row(
    record: str,
    series: Series,
    decay: tuple[FloatArray, FloatArray],
    *,
    start: float,
    period: float,
) -> dict[str, str | float | None] | None:
    """When one ball of a release is captured and when it is lost, and the amplitudes there.

    The capture is the longest spell of two impacts per cycle; where it ends lies the transition
    point (T1) of this ball. Of several balls each has its own.

    Parameters
    ----------
    record : str
    series : Series
        Impacts of the ball.
    decay : (time, amplitude)
        Cycle by cycle; s on the record's axis, m.
    start, period : float
        First moment of the record, period of the oscillation; s.

    Returns
    -------
    dict or None
        A row of transitions.csv; None for a ball that was never captured.
    """
    spells = activation_spells(series.time, series.side, period=period)
    if not len(spells):
        return None
    begin, end = spells[np.argmax(spells[:, 1] - spells[:, 0])]
    time, amplitude = decay
    captured = (time >= begin) & (time <= end) & (amplitude > 0.0)
    rate = None
    if int(captured.sum()) >= _FEWEST:
        rate = -float(np.polyfit(time[captured], np.log(amplitude[captured]), 1)[0])
    return {
        "record": record,
        "nes": series.ball,
        "clearance_mm": 1e3 * series.clearance,
        "captured_from_s": float(begin - start),
        "captured_until_s": float(end - start),
        "from_m": float(np.interp(begin, time, amplitude)),
        "transition_m": float(np.interp(end, time, amplitude)),
        "decay_rate_1_s": rate,
    }
