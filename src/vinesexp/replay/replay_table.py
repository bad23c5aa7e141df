"""replay.csv: every record beside its replays, number by number, and where they differ.

Replays fall into groups by their regime. A record is compared with the nearest: which start it had
is unknown, and motions that have not settled bear this name or that. Measured and replayed motion
are compared by the same functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.result_columns import REPLAY, REPLAY_CYCLES
from vinesexp.records.stored.tables import Row, Value, write_rows
from vinesexp.replay.motions import AS_RECORDED, Replayed
from vinesexp.signals.means import cycle_amplitudes, time_to_level
from vinesexp.signals.steady_part import steady_after
from vinesexp.theory.regime_definitions import (
    BY_FREQUENCY,
    STILL,
    Regime,
    activation_spells,
    of_balls,
    regime_of,
)

#: Unit of each number, and the share by which a measured one may miss its replays: clearances are
#: known no better.
NUMBERS = {
    "amplitude": ("m", 0.03),
    "largest amplitude": ("m", 0.05),
    "impacts per cycle": ("1", 0.05),
    "decay time": ("s", 0.05),
    "spells": ("1", 0.3),
}
#: Standard deviations that come on top: over the replays of one regime, and of the measured number
#: where it is the mean of a motion whose amplitude varies.
SCATTER = 3.0
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
_POINTS = 40  # a cycle: a swing is known to 0.3 %
_SETTLING = 0.2  # of a periodic record, left out as in regimes.csv
_FIRST_CYCLES = 12  # of a release: what it starts with, as in regimes.csv
_STEADY = 0.05  # standard deviation of the amplitude over its mean
_FALLEN = 0.25  # of the first cycle: the decay time is until here


@dataclass(frozen=True)
class Measures:
    """Numbers of one stretch of a replay; NaN and empty where a test has none.

    Attributes
    ----------
    start : of the replay.
    amplitude, largest : mean and largest half swing of a cycle, m.
    impacts_per_cycle, regime, spells : as in regimes.csv.
    decay_time : s until the amplitude stays below a quarter of that of the first cycle.
    cycles : time from the beginning of the record (s) and half swing (m) of each cycle.
    steady : whether the amplitude stays the same from cycle to cycle (`is_steady`).
    """

    start: str
    amplitude: float
    impacts_per_cycle: float
    regime: str
    spells: float
    decay_time: float
    cycles: tuple[FloatArray, FloatArray]
    largest: float = math.nan
    steady: bool = True


def is_steady(time: FloatArray, amplitude: FloatArray, length: float) -> bool:
    """Whether amplitudes of cycles scatter by less than a twentieth, after the first fifth.

    Examples
    --------
    >>> t = np.arange(100.0)
    >>> is_steady(t, np.ones(100), 100.0), is_steady(t, 1.0 + 0.3 * np.sin(t), 100.0)
    (True, False)
    """
    judged = amplitude[time >= _SETTLING * length]
    return judged.size < 2 or float(judged.std()) < _STEADY * float(judged.mean())


def decay_time(time: FloatArray, amplitude: FloatArray) -> float:
    """When the amplitude has fallen to a quarter of that of its largest cycle, s from there.

    Examples
    --------
    >>> t = np.arange(100) / 10.0
    >>> bool(abs(decay_time(t, np.exp(-t)) - np.log(4.0)) < 0.01)
    True
    """
    if amplitude.size < 2:
        return float("nan")
    first = int(np.argmax(amplitude))
    level = _FALLEN * float(amplitude[first])
    return time_to_level(time[first:], amplitude[first:], level) - float(time[first])


def measures_of(
    replayed: Replayed,
    *,
    test: str,
    frequency: float,
    apart: bool = True,
    settles: float | None = None,
) -> Measures:
    """The numbers of one stretch of a replay.

    Parameters
    ----------
    replayed : Replayed
    test : str
    frequency : float
        By which cycles are counted, Hz: that of the record.
    apart : bool
        Whether each ball has a regime of its own; else all impacts are judged together, as in a
        record whose impacts could not be attributed.
    settles : float, optional
        When the record's own response begins (`steady_from_s` of regimes.csv), s: where a replay
        begins as the record did, the same cycles of both count.
    """
    rate, begin = _POINTS * frequency, replayed.begin
    n = int(replayed.length * rate)
    x, _ = replayed.motion.at(begin + np.arange(n) / rate)
    time, amplitude = cycle_amplitudes(x, rate, frequency)
    settling = _SETTLING * replayed.length if test == "periodic" else 0.0
    if settles is not None and replayed.start == AS_RECORDED:
        settling = max(settles - replayed.since, 0.0)
    elif test == "periodic" and (time >= settling).any():
        _, settling = steady_after(settling, time, amplitude, period=1.0 / frequency)
    steady = amplitude[time >= settling]
    mean = float(steady.mean()) if steady.size else float("nan")
    driven = test in ("periodic", "sweep")
    fallen = float("nan") if driven else decay_time(time, amplitude)
    largest = float(steady.max()) if steady.size else float("nan")
    per_cycle, regime, spells = float("nan"), "", float("nan")
    if replayed.motion.rig.nes:
        end = replayed.length
        if test == "transient":
            end = min(_FIRST_CYCLES / frequency, end)
        stretch = begin + settling, begin + end
        per_cycle, regime = _regimes(replayed, stretch, 1.0 / frequency, apart, test)
        spells = _spells(replayed, 1.0 / frequency)
    cycles = replayed.since + time, amplitude
    still = is_steady(time, amplitude, replayed.length)
    return Measures(replayed.start, mean, per_cycle, regime, spells, fallen, cycles, largest, still)


def _regimes(
    replayed: Replayed, stretch: tuple[float, float], period: float, apart: bool, test: str
) -> tuple[float, str]:
    """Impacts per cycle of all balls together, and the regime of each."""
    start, end = stretch
    if end - start < period:
        return float("nan"), ""
    hits = replayed.motion.impacts
    balls = range(len(replayed.motion.rig.nes))
    chosen = [hits["nes"] == ball for ball in balls] if apart else [hits["nes"] >= 0]
    counts = [
        regime_of(
            *(hits["time"][own], hits["side"][own]),
            period=period, start=start, end=end, decaying=test == "transient",
        )
        for own in chosen
    ]  # fmt: skip
    words = of_balls(count.regime.value for count in counts)
    words = BY_FREQUENCY if test == "sweep" else words
    return sum(count.impacts_per_cycle for count in counts), words


def _spells(replayed: Replayed, period: float) -> float:
    """Number of activation spells of a single ball in a stretch; NaN for several."""
    if len(replayed.motion.rig.nes) != 1:
        return float("nan")
    hits, begin = replayed.motion.impacts, replayed.begin
    inside = (hits["time"] >= begin) & (hits["time"] <= begin + replayed.length)
    return float(len(activation_spells(hits["time"][inside], hits["side"][inside], period=period)))


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
    still = per_cycle is not None and per_cycle < STILL and len(record.clearance) == 1
    regime = _NO_IMPACT if still and row["regime"] else row.get("regime", "")
    moving = bool(per_cycle) and not still
    groups = _groups(record, found, steady=steady, moving=moving, whole=near)
    decisive = DECISIVE[record.test]

    def of(
        quantity: str,
        measured: float | None,
        value: Callable[[Measures], float],
        error: float | None = None,
    ) -> Compared:
        values = [[v for one in own if math.isfinite(v := value(one))] for own in groups]
        values = [v for v in values if v]
        row = _number(record.id, quantity, measured, error or 0.0, values, near)
        row = replace(row, decisive=quantity in decisive)
        each = [(one.start, value(one)) for one in found]
        return replace(row, starts=_moving_so(row, each) if row.outcome == "ok" else "")

    rows = []
    if record.test in ("periodic", "sweep"):
        error = row.get("amplitude_error_m")
        rows.append(of("amplitude", row["amplitude_mean_m"], lambda m: m.amplitude, error))
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
    record: Record, found: Sequence[Measures], *, steady: bool, moving: bool, whole: bool
) -> list[list[Measures]]:
    """Replays that are alike; without those whose ball rests where the record's did not.

    Periodic replays are alike by their regime; motions whose amplitude varies are one distribution,
    which a record whose own varies is of, and no other. One that begins as the record shows alone
    how a steady one got there. A release depends on where the ball lay: each replay is its own. A
    sweep goes through many regimes: its replays are one distribution.
    """
    meeting = [one for one in found if one.impacts_per_cycle >= STILL]
    if moving and meeting:
        found = meeting
    if record.test == "sweep" or whole:
        return [list(found)]
    if record.test != "periodic":
        return [[one] for one in found]
    groups: dict[str, list[Measures]] = {}
    for i, one in enumerate(found):
        name = one.regime if one.steady else _VARYING
        if steady and one.start == AS_RECORDED:
            name = f"{AS_RECORDED}, {i}"
        groups.setdefault(name, []).append(one)
    alike = [own for name, own in groups.items() if (name != _VARYING) == steady]
    return alike or list(groups.values())


def _number(
    record: str,
    quantity: str,
    measured: float | None,
    error: float,
    groups: Sequence[Sequence[float]],
    near: bool,
) -> Compared:
    unit, tolerance = NUMBERS[quantity]
    if not groups:
        return Compared(record, quantity, unit, measured, None, None, None, None, "not replayed")
    nearest = min(groups, key=lambda own: abs(float(np.mean(own)) - (measured or 0.0)))
    centre, low, high = float(np.mean(nearest)), min(nearest), max(nearest)
    if measured is None:
        return Compared(record, quantity, unit, None, centre, low, high, None, "not measured")
    allowed = SCATTER * math.hypot(float(np.std(nearest)), error)
    allowed += tolerance * abs(centre)
    if quantity == "spells":
        allowed = max(allowed, _FEW_SPELLS)
    off = abs(measured - centre)
    if near:
        allowed, off = tolerance * abs(centre), max(low - measured, measured - high, 0.0)
    outcome = "differs" if off > allowed else "ok"
    # However much starts differ: what none of them is near is no replay.
    least = min(abs(measured - one) for one in nearest)
    if quantity != "spells" and least > _HALF * abs(measured):
        outcome = "differs"
    deviation = measured / centre - 1.0 if centre else None
    return Compared(record, quantity, unit, measured, centre, low, high, deviation, outcome)


def _moving_so(row: Compared, each: Sequence[tuple[str, float]]) -> str:
    """Which share of the starts moves as the record does, where not all do."""
    if not isinstance(row.measured, float) or row.quantity == "spells":
        return ""
    near = NUMBERS[row.quantity][1] * abs(row.measured)
    near = max(near, 0.5 * ((row.high or 0.0) - (row.low or 0.0)))
    alike = {start: False for start, _ in each}
    for start, v in each:
        alike[start] |= math.isfinite(v) and abs(v - row.measured) <= near
    n = sum(alike.values())
    return "" if n == len(alike) else f"{n} of {len(alike)} starts move so"


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
    alike = not steady and any(not m.steady and m.impacts_per_cycle >= STILL for m in found)
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
        off = "; ".join(_in_words(r) for r in own)
        detail = f"the identified rig does not reproduce this record: {off}"
        checks.append(Check(record, "replay", "warning", detail))
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
