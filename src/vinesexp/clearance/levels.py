"""Which tests belong together: those that differ in the clearance of one NES and in nothing else.

A level is a base amplitude of periodic tests, or a release and the amplitude that it is to fall to.
Within a level one number over clearance is to be made small.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from vinesexp.clearance.level_base import LevelBase, base_of_level, found_base
from vinesexp.records.campaign.load import Campaign, Record
from vinesexp.records.stored.tables import number
from vinesexp.theory.regime_definitions import PERMANENT, TELLING, Regime
from vinesexp.theory.steadiness import UNKNOWN, Swing

Rows = Sequence[Mapping[str, str]]
_T = TypeVar("_T")

#: Base amplitudes and releases in records.csv that agree to this share are one level.
_SAME = 1e-6
#: Impacts per cycle below which the ball of a periodic test lies in the middle of its cavity.
_STILL = 0.1


@dataclass(frozen=True)
class Tested:
    """One tested clearance, m, with what is to be made small (m or s) and its regime.

    `value` is None where the release never fell to the level within its record; `swing` is that of
    the phase of its impacts, unknown where they are few; `length` is that of the record, s.
    `waited` is the time from a start at rest, in the record itself, to the first cycle that counts,
    s; infinite where the record begins in motion.
    """

    clearance: float
    value: float | None
    regime: str = ""
    record: str = ""
    swing: Swing = UNKNOWN
    length: float = math.inf
    waited: float = math.inf

    __test__ = False  # not for pytest


@dataclass(frozen=True)
class PeriodicLevel:
    """Periodic tests at one base amplitude: mean amplitude (m) over clearance.

    Attributes
    ----------
    nominal : base amplitude of the sheet, m; it names the level.
    base : amplitude and frequency that predictions use.
    tests : by clearance.
    """

    nominal: float
    base: LevelBase
    tests: tuple[Tested, ...]

    @property
    def G(self) -> float:
        """Base amplitude that predictions use, m."""
        return self.base.G.value

    @property
    def frequency(self) -> float | None:
        """Frequency of the base that predictions use, Hz; None where the tests do not share one."""
        return None if self.base.frequency is None else self.base.frequency.value

    @property
    def name(self) -> str:
        """As in clearances.csv."""
        return f"G = {1e3 * self.nominal:.6g} mm"


@dataclass(frozen=True)
class ReleaseLevel:
    """Releases from x0, m: time (s) until the amplitude is below `target`, m, over clearance."""

    x0: float
    target: float
    tests: tuple[Tested, ...]

    @property
    def name(self) -> str:
        """As in clearances.csv."""
        return f"{1e3 * self.x0:.6g} mm to {1e3 * self.target:.6g} mm"


def periodic_levels(
    campaign: Campaign, regimes: Rows, base: Rows, identified: Rows = ()
) -> list[PeriodicLevel]:
    """Levels of the periodic tests with one NES, small base amplitude first.

    Parameters
    ----------
    campaign : Campaign
    regimes, base, identified : sequences of mappings
        Rows of regimes.csv, base.csv and identified.csv; the last for the base amplitudes found.
    """
    measured = {row["record"]: row for row in base}
    groups: dict[float, list[tuple[Record, Tested]]] = {}
    for record, row in single_nes(campaign, regimes, "periodic"):
        if record.base_amplitude and number(row.get("amplitude_mean_m")) is not None:
            halves = (number(row.get(name, "")) for name in ("swing_first", "swing"))
            tested = Tested(
                record.clearance[0],
                float(row["amplitude_mean_m"]),
                _regime(row),
                record.id,
                Swing(*(math.nan if one is None else one for one in halves)),
                number(row.get("length_s", "")) or math.inf,
                waited(row),
            )
            _group(groups, record.base_amplitude).append((record, tested))
    levels = []
    for G in sorted(groups):
        records, tests = zip(*groups[G], strict=True)
        moved = base_of_level(
            G,
            {record.frequency[0] for record in records if record.frequency},
            [measured[record.id] for record in records if record.id in measured],
            inputs=campaign.known.uncertainties,
            found=found_base(identified, {record.id for record in records}),
        )
        levels.append(PeriodicLevel(G, moved, tuple(sorted(tests, key=lambda t: t.clearance))))
    return levels


def waited(row: Mapping[str, Any]) -> float:
    """`Tested.waited`: the first cycles of a start at rest are below half of the mean."""
    start, since = (number(row.get(name, "")) for name in ("amplitude_start_m", "steady_from_s"))
    if start is None or since is None or start > 0.5 * float(row["amplitude_mean_m"]):
        return math.inf
    return since


def _regime(row: Mapping[str, str]) -> str:
    """The regime of a periodic test; a ball that meets its walls hardly ever is not on any orbit.

    What is found there are a false impact or two, or the last of how the test began. A test of few
    cycles does not tell what is permanent.
    """
    per_cycle = number(row.get("impacts_per_cycle", ""))
    if row["regime"] and per_cycle is not None and per_cycle < _STILL:
        return Regime.NO_IMPACT.value
    cycles = number(row.get("cycles", ""))
    if row["regime"] in PERMANENT and cycles is not None and cycles < TELLING:
        return ""
    return row["regime"]


def release_levels(campaign: Campaign, regimes: Rows, times: Rows) -> list[ReleaseLevel]:
    """Levels of the releases with one NES: by release, then from high to low amplitude.

    Parameters
    ----------
    campaign : Campaign
    regimes, times : sequences of mappings
        Rows of regimes.csv and decay_times.csv.
    """
    reached: dict[str, dict[float, float | None]] = {}
    for row in times:
        reached.setdefault(row["record"], {})[float(row["target_m"])] = number(row["time_s"])
    groups: dict[float, list[tuple[Record, Mapping[str, str]]]] = {}
    for record, row in single_nes(campaign, regimes, "transient"):
        if record.release:
            _group(groups, abs(record.release)).append((record, row))
    levels = []
    for x0 in sorted(groups):
        targets: dict[float, list[Tested]] = {}
        for record, row in groups[x0]:
            for target, time in reached.get(record.id, {}).items():
                tested = Tested(record.clearance[0], time, row["regime"], record.id)
                _group(targets, target).append(tested)
        for target in sorted(targets, reverse=True):
            tests = sorted(targets[target], key=lambda t: t.clearance)
            if any(test.value is not None for test in tests):
                levels.append(ReleaseLevel(x0, target, tuple(tests)))
    return levels


def single_nes(
    campaign: Campaign, regimes: Rows, test: str
) -> Iterable[tuple[Record, Mapping[str, str]]]:
    """Records of one test with exactly one NES, with their rows of regimes.csv."""
    by_id = {record.id: record for record in campaign.records}
    for row in regimes:
        record = by_id.get(row["record"])
        if record and record.test == test and len(record.clearance) == 1 and not record.exclude:
            yield record, row


def _group(groups: dict[float, list[_T]], key: float) -> list[_T]:
    """The list under `key`, or under a key that is the same but for rounding."""
    for known in groups:
        if abs(known - key) <= _SAME * abs(key):
            return groups[known]
    return groups.setdefault(key, [])
