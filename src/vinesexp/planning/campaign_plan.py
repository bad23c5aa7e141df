"""What a measured campaign should test next, level by level, and what instruments that takes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.clearance.comparison import settled_tests
from vinesexp.clearance.levels import PeriodicLevel
from vinesexp.clearance.optimum import amplitudes_of
from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.design.ensemble import duration_of
from vinesexp.planning.expected_valley import Valley, expected_valley
from vinesexp.planning.next_clearance import TARGET, bracket_of, follow_plan, next_clearance
from vinesexp.records.campaign.uncertainties import Uncertainties
from vinesexp.records.stored.result_columns import IMPACTS
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.tables import read_rows
from vinesexp.results import CampaignResults, Results
from vinesexp.theory.regime_definitions import PERMANENT
from vinesexp.units import counted

#: Scatter of mean amplitudes where no two records or replays show one.
SCATTER = 0.002
_AHEAD = 12  # clearances planned at once


@dataclass(frozen=True)
class LevelPlan:
    """What to test next at one base amplitude.

    Attributes
    ----------
    level : PeriodicLevel
    tested : mapping
        Clearance (m) to mean amplitude (m), of the tests that count for the best clearance.
    left_out : int
        Tests that do not count, because they had not settled.
    valley : Valley or None
        Where the identified rig has its minimum; None where the rig is not known.
    scatter : float
        Relative scatter of the lab's amplitudes.
    target : float
        Relative width of bracket that is aimed at: what was asked, or what the scatter decides.
    next : tuple of float
        Clearances to test next, in order, as far as the expected valley foresees, m.
    bracket : tuple of float or None
        Low, best, high after these tests, m, if the rig is as identified.
    """

    level: PeriodicLevel
    tested: Mapping[float, float]
    left_out: int
    valley: Valley | None
    scatter: float
    target: float
    next: tuple[float, ...]
    bracket: tuple[float, float, float] | None

    @property
    def width_now(self) -> float | None:
        """Relative width of the bracket that is measured; None while it is open."""
        return bracket_of(self.tested).width if self.tested else None

    @property
    def in_words(self) -> str:
        """How many clearances count, and how many tests do not."""
        young = f" (not of {self.left_out} that had not settled)" if self.left_out else ""
        return f"{counted(len(self.tested), 'clearance')} tested{young}"


def plan_levels(results: CampaignResults, *, target: float = TARGET) -> list[LevelPlan]:
    """A plan for every base amplitude that was tested, from the smallest on.

    Raises
    ------
    TableError
        A table of the results is missing or damaged.
    """
    scatter = scatter_of(results)
    return [
        plan_level(results.rig_at(level), level, scatter=scatter, target=target)
        for level in results.periodic
    ]


def plan_level(
    rig: IdentifiedRig, level: PeriodicLevel, *, scatter: float, target: float = TARGET
) -> LevelPlan:
    """The tests that bracket the minimum of one level, if the rig is as identified."""
    settled = settled_tests(level.tests, rig)
    tested, left_out = amplitudes_of(settled), len(level.tests) - len(settled)
    valley = expected_valley(rig, G=level.base.G, frequency=level.frequency)
    if valley is not None:
        target = max(target, valley.narrowest(scatter))
    ahead, bracket = _ahead(tested, valley, target)
    return LevelPlan(level, tested, left_out, valley, scatter, target, ahead, bracket)


def _ahead(
    tested: Mapping[float, float], valley: Valley | None, target: float
) -> tuple[tuple[float, ...], tuple[float, float, float] | None]:
    """The next clearances if the rig is as identified, and the bracket after them."""
    if valley is None or not math.isfinite(target):
        one = next_clearance(tested, expected=None) if len(tested) > 1 else None
        return (() if one is None else (one,)), None
    size = _scale(tested, valley)
    seen = follow_plan(
        lambda b: size * _modelled(valley, b),
        expected=valley.lowest,
        target=target,
        tested=tested,
        most=len(tested) + _AHEAD,
    )
    ahead = tuple(seen)[len(tested) :]
    found = bracket_of(seen)
    if found.low is None or found.high is None:
        return ahead, None
    return ahead, (found.low, found.best, found.high)


def _modelled(valley: Valley, b: float) -> float:
    """Amplitude of the expected valley; beyond its end the amplitude jumps."""
    if b > valley.end:
        return 1.5 * float(valley.amplitude[-1]) * (b / valley.end)
    if b < valley.b[0]:
        return float(valley.amplitude[0] * valley.b[0]) / b
    return float(np.interp(b, valley.b, valley.amplitude))


def _scale(tested: Mapping[float, float], valley: Valley) -> float:
    """Measured over expected amplitude, so that tests done and tests ahead compare."""
    inside = [a / _modelled(valley, b) for b, a in tested.items() if b <= valley.end]
    return float(np.median(inside)) if inside else 1.0


def scatter_of(results: Results) -> float:
    """Relative scatter of the records' mean amplitudes about their replays: the lab's own noise.

    Of records with permanent impacts: others differ from replay to replay, with no noise at all. A
    share that all have in common (a sensitivity) is no scatter. Too few records: `SCATTER`.
    """
    if not ResultPaths(results.folder).replay.is_file():
        return SCATTER
    found = [
        row["deviation"]
        for row in results.rows("replay")
        if row["quantity"].startswith("amplitude")
        and row["deviation"] is not None
        and results.regime_of.get(row["record"]) in PERMANENT
    ]
    if len(found) < 4:
        return SCATTER
    deviations = np.array(found)
    return float(1.4826 * np.median(np.abs(deviations - np.median(deviations))))


@dataclass(frozen=True)
class Needs:
    """What the instruments and the length of the records have to be.

    Attributes
    ----------
    settle, record : float or None
        s to wait after switching on, and to record; None where the rig is not known.
    swing : float
        Largest displacement to expect, m.
    acceleration : float or None
        Largest acceleration that was measured in an impact, m/s^2.
    clipped, sure, impacts : int
        Impacts whose acceleration saturated; that are found again with probability 0.9; all.
    ring_downs : int or None
        Ring-downs on either side of the added mass for M to 0.5 %; None where that cannot be had.
    added : float
        The added mass that this holds for, kg.
    """

    settle: float | None
    record: float | None
    swing: float
    acceleration: float | None
    clipped: int
    sure: int
    impacts: int
    ring_downs: int | None
    added: float


def needs_of(results: CampaignResults, plans: Sequence[LevelPlan]) -> Needs:
    """Lengths, ranges and ring-downs from the identified rig and the impacts that were found."""
    campaign, rig, paths = results.campaign, results.rig, ResultPaths(results.folder)
    rows = [
        row
        for record in campaign.records
        if record.clearance and paths.impacts(record.id).is_file()
        for row in read_rows(paths.impacts(record.id), IMPACTS)
    ]
    peaks = [abs(p) for row in rows if (p := row["peak_acceleration_m_s2"]) is not None]
    swings = [a for row in results.rows("regimes") if (a := row["amplitude_max_m"]) is not None]
    settle = record = None
    frequency = next((f for plan in plans if (f := plan.level.frequency)), None)
    if not rig.missing:
        whole = rig.plain(0.03)
        settle, end = duration_of(whole, frequency or whole.oscillator.f0)
        record = end - settle
    M = rig.values.get("M")
    loads = [record_.added_mass for record_ in campaign.records if record_.added_mass]
    added = max(loads, default=0.1 * M.value if M else 0.0)
    inputs = campaign.known.uncertainties
    ring_downs = None
    if M is not None and added:
        ring_downs = ring_downs_for(0.005, M=M.value, added=added, inputs=inputs)
    return Needs(
        *(settle, record, max(swings, default=0.0), max(peaks, default=None)),
        clipped=sum(row["clipped"] == 1 for row in rows),
        sure=sum((row["confidence"] or 0.0) > 0.9 for row in rows),
        impacts=len(rows),
        ring_downs=ring_downs,
        added=added,
    )


def ring_downs_for(error: float, *, M: float, added: float, inputs: Uncertainties) -> int | None:
    """Ring-downs, each mounted anew, without and with an added mass for M to a relative error.

    With n on either side M = P0 added/(P1 - P0), P = 1/f^2, so its relative error is the added
    mass's own and (1 + M/added) 2 sqrt(2/n) times that of f from mounting to mounting.

    Parameters
    ----------
    error : float
        Relative standard error wanted.
    M, added : float
        kg.
    inputs : Uncertainties
        Of the weighing of the added mass, and of f0 from one mounting to the next.

    Returns
    -------
    int or None
        None where the weighing of the added mass alone exceeds the error.

    Examples
    --------
    >>> ring_downs_for(0.005, M=4.7, added=0.2, inputs=Uncertainties())
    3
    >>> ring_downs_for(0.005, M=4.7, added=0.02, inputs=Uncertainties()) is None
    True
    """
    left = error**2 - (inputs.added_mass.of(added) / added) ** 2
    if left <= 0.0:
        return None
    by_one = (1.0 + M / added) * 2.0 * math.sqrt(2.0) * inputs.remounting.relative
    return max(1, math.ceil(by_one**2 / left))
