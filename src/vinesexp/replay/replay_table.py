"""replay.csv: every record beside its replays, number by number, and where they differ.

Replays fall into groups by their regime. A record is compared with the group of its own regime
where there is one, else with the nearest: which start it had is unknown.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.result_columns import REPLAY, REPLAY_CYCLES
from vinesexp.records.stored.tables import Row, Value, write_rows
from vinesexp.replay.measures import Measures
from vinesexp.theory.regime_definitions import Regime

#: Shares by which a measured number may miss its replays: clearances are known no better.
TOLERANCE = {
    "amplitude": 0.03,
    "largest amplitude": 0.05,
    "impacts per cycle": 0.05,
    "decay time": 0.05,
    "spells": 0.3,
}
#: Standard deviations over the replays of one regime that come on top.
SCATTER = 3.0
_UNITS = {
    "amplitude": "m",
    "largest amplitude": "m",
    "impacts per cycle": "1",
    "decay time": "s",
    "spells": "1",
}
#: Impacts per cycle below which a ball lies still: what is found then is noise.
_STILL = 0.1
_NO_IMPACT = Regime.NO_IMPACT.value
_VARYING = "amplitude varies"
_NAMED = 5  # starts: more are counted
_AND = "; "  # between regimes in one cell
_HALF = 0.5  # of a number: what misses by more is no replay, however starts scatter
_FEW_SPELLS = 3.0  # that a short record may have more or less
#: Numbers that decide whether a record is replayed, by test; the others are shown.
DECISIVE = {
    "periodic": ("amplitude", "regime"),
    "transient": ("decay time",),
    "ringdown": ("decay time",),
    "sweep": ("amplitude",),
}


@dataclass(frozen=True)
class Compared:
    """One row of replay.csv.

    Attributes
    ----------
    measured, replayed : as in the table; of several replays the mean.
    low, high : smallest and largest of the replays that it is compared with.
    deviation : measured over replayed, minus one; None for words.
    outcome : ``ok``, ``differs``, ``not measured`` or ``not replayed``.
    starts : where starts give different regimes, which gives which; where not all of them move as
        the record does, how many do.
    decisive : whether a difference says that the rig does not replay the record.
    """

    record: str
    quantity: str
    unit: str
    measured: str | float | None
    replayed: str | float | None
    low: float | None
    high: float | None
    deviation: float | None
    outcome: str
    starts: str = ""
    decisive: bool = False

    def as_row(self) -> dict[str, Value]:
        """As a row of replay.csv."""
        return {name: value for name, value in vars(self).items() if name != "decisive"}


def compared(
    record: Record,
    row: Row,
    decay: float,
    found: Sequence[Measures],
    *,
    steady: bool = True,
    near: bool = False,
) -> list[Compared]:
    """Rows of one record.

    Parameters
    ----------
    record : Record
    row : mapping
        Its row of regimes.csv.
    decay : float
        Measured decay time, s; NaN where there is none.
    found : sequence of Measures
        Of all replays.
    steady : bool
        Whether the amplitude of the record stays the same from cycle to cycle.
    near : bool
        The replays are of clearances within what nobody can know: a record replayed lies in the
        range of all of them.
    """
    per_cycle = row.get("impacts_per_cycle")
    still = per_cycle is not None and per_cycle < _STILL and len(record.clearance) == 1
    regime = _NO_IMPACT if still and row["regime"] else row.get("regime", "")
    moving = bool(per_cycle) and not still
    groups = _groups(record, regime if steady else _VARYING, found, moving=moving, whole=near)
    decisive = DECISIVE[record.test]

    def of(quantity: str, measured: float | None, value: Callable[[Measures], float]) -> Compared:
        values = [[v for one in own if math.isfinite(v := value(one))] for own in groups]
        values = [v for v in values if v]
        row = _number(record.id, quantity, measured, values, quantity in decisive, near)
        each = [(one.start, value(one)) for one in found]
        return replace(row, starts=_moving_so(row, each) if row.outcome == "ok" else "")

    rows = []
    if record.test in ("periodic", "sweep"):
        rows.append(of("amplitude", row["amplitude_mean_m"], lambda m: m.amplitude))
    if record.test == "sweep":
        rows.append(of("largest amplitude", row["amplitude_max_m"], lambda m: m.largest))
    elif record.test != "periodic":
        measured = decay if math.isfinite(decay) else None
        rows.append(of("decay time", measured, lambda m: m.decay_time))
    if record.clearance:
        rows.append(of("impacts per cycle", per_cycle, lambda m: m.impacts_per_cycle))
        rows.append(_regime(record.id, regime, found, "regime" in decisive, steady))
    if len(record.clearance) == 1:
        rows.append(of("spells", row.get("spells"), lambda m: m.spells))
    return rows


def _groups(
    record: Record, regime: str, found: Sequence[Measures], *, moving: bool, whole: bool
) -> list[list[Measures]]:
    """Replays that are alike; without those whose ball rests where the record's did not.

    Periodic replays are alike by their regime, and those of the record's own count alone where
    there are any; motions whose amplitude varies are one distribution, since where it is chaotic
    a record may bear this name or that. A release depends on where the ball lay: each replay is
    its own. A sweep goes through many regimes: its replays are one distribution.
    """
    meeting = [one for one in found if one.impacts_per_cycle >= _STILL]
    if moving and meeting:
        found = meeting
    if record.test == "sweep" or whole:
        return [list(found)]
    if record.test != "periodic":
        return [[one] for one in found]
    by_regime: dict[str, list[Measures]] = {}
    for one in found:
        by_regime.setdefault(one.regime if one.steady else _VARYING, []).append(one)
    own = by_regime.get(regime)
    return [own] if own else list(by_regime.values())


def _number(
    record: str,
    quantity: str,
    measured: float | None,
    groups: Sequence[Sequence[float]],
    decisive: bool,
    near: bool,
) -> Compared:
    unit = _UNITS[quantity]
    if not groups:
        return Compared(record, quantity, unit, measured, None, None, None, None, "not replayed")
    nearest = min(groups, key=lambda own: abs(float(np.mean(own)) - (measured or 0.0)))
    centre, low, high = float(np.mean(nearest)), min(nearest), max(nearest)
    if measured is None:
        return Compared(record, quantity, unit, None, centre, low, high, None, "not measured")
    allowed = SCATTER * float(np.std(nearest)) + TOLERANCE[quantity] * abs(centre)
    if quantity == "spells":
        allowed = max(allowed, _FEW_SPELLS)
    off = abs(measured - centre)
    if near:
        allowed, off = TOLERANCE[quantity] * abs(centre), max(low - measured, measured - high, 0.0)
    outcome = "differs" if off > allowed else "ok"
    # However much starts differ: what none of them is near is no replay.
    least = min(abs(measured - one) for one in nearest)
    if quantity != "spells" and least > _HALF * abs(measured):
        outcome = "differs"
    deviation = measured / centre - 1.0 if centre else None
    return Compared(
        record, quantity, unit, measured, centre, low, high, deviation, outcome, "", decisive
    )


def _moving_so(row: Compared, each: Sequence[tuple[str, float]]) -> str:
    """Which share of the starts moves as the record does, where not all do."""
    if not isinstance(row.measured, float) or row.quantity == "spells":
        return ""
    near = TOLERANCE[row.quantity] * abs(row.measured)
    near = max(near, 0.5 * ((row.high or 0.0) - (row.low or 0.0)))
    known = {start: [v for name, v in each if name == start and math.isfinite(v)]
             for start, _ in each}  # fmt: skip
    alike = [start for start, values in known.items()
             if any(abs(v - row.measured) <= near for v in values)]  # fmt: skip
    return "" if len(alike) == len(known) else f"{len(alike)} of {len(known)} starts move so"


def _regime(
    record: str, measured: str, found: Sequence[Measures], decisive: bool, steady: bool
) -> Compared:
    """Whether a replay has the record's regime; motions that vary bear this name or that."""
    by_regime: dict[str, list[str]] = {}
    for one in found:
        by_regime.setdefault(one.regime, []).append(one.start)
    starts = ""
    if len(by_regime) > 1:
        named = {regime: list(dict.fromkeys(names)) for regime, names in by_regime.items()}
        total = len({one.start for one in found})
        starts = _AND.join(
            f"{regime}: {', '.join(names)}"
            if total <= _NAMED
            else f"{regime}: {len(names)} of {total} starts"
            for regime, names in named.items()
        )
    alike = not steady and any(not m.steady and m.impacts_per_cycle >= _STILL for m in found)
    same = measured in by_regime or alike
    outcome = "not measured" if not measured else "ok" if same else "differs"
    words = _AND.join(by_regime)
    return Compared(
        *(record, "regime", "", measured or None, words, None, None, None, outcome, starts),
        decisive=decisive,
    )


def regimes_of(row: Row) -> set[str]:
    """The regimes of all replays of a record, from its row of the quantity ``regime``."""
    return set(str(row["replayed"]).split(_AND))


def write_replay(
    table: Path, cycles_table: Path, rows: Sequence[Compared], cycles: Sequence[Mapping[str, Value]]
) -> None:
    """replay.csv and replay_cycles.csv."""
    write_rows(table, REPLAY, [row.as_row() for row in rows])
    write_rows(cycles_table, REPLAY_CYCLES, cycles)


def replay_checks(rows: Sequence[Compared]) -> list[Check]:
    """One warning for each record that its own rig does not replay."""
    checks = []
    for record in dict.fromkeys(row.record for row in rows):
        own = [r for r in rows if r.record == record and r.outcome == "differs"]
        if not any(r.decisive for r in own):
            continue
        detail = "; ".join(_in_words(r) for r in own)
        checks.append(
            Check(record, "replay", "warning",
                  f"the identified rig does not move as this record: {detail}")
        )  # fmt: skip
    return checks


def _in_words(row: Compared) -> str:
    if row.quantity == "regime":
        return f"regime {row.measured}, replayed {row.replayed}"
    size, unit = (1e3, " mm") if row.unit == "m" else (1.0, " s" if row.unit == "s" else "")
    assert isinstance(row.measured, float)
    assert row.low is not None
    assert row.high is not None
    low, high = (f"{size * value:.3g}" for value in (row.low, row.high))
    span = low if low == high else f"{low} to {high}"
    return f"{row.quantity} {size * row.measured:.3g}{unit}, replayed {span}{unit}"
