"""Which tests belong together: those that differ in the clearance of one NES and in nothing else.

A level is a base amplitude of periodic tests, or a release and the amplitude that it is to fall to.
Within a level one number over clearance is to be made small. Its base is as measured where it was,
else as the test log says; where they differ the joint model of the campaign decides, and
predictions use what it found. `as_found` does the same for lengths and masses.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean, median, median_low
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.campaign.uncertainties import Uncertainties
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.result_columns import BASE_OF_ONE, Verdict
from vinesexp.records.stored.tables import Row
from vinesexp.theory.regime_definitions import PERMANENT, STILL, TELLING, UNKNOWN, Regime, Swing
from vinesexp.units import COVERAGE_95, Quantity, last_digit

if TYPE_CHECKING:
    from vinesexp.identification.joint.whole import RigState

Rows = Sequence[Row]

#: Share of cycles with two impacts: all of them, but for one that an end of the record cuts.
_EVERY_CYCLE = 0.99
#: Error of a mean amplitude, relative, that only an amplitude on its way has.
_MOVES = 0.02
#: A frequency that nobody measured is as good as the generator's clock and its display: twice the
#: relative error of the instrument's clock.
GENERATOR = 2.0
#: Relative error of a generator's display, which rounds whatever its clock is good for.
DISPLAY_ERROR = 1e-4
#: Standard errors from which on measured and sheet differ.
DIFFERS = 3.0
#: Shares from which on the base is worth a warning: harmonics, wander, dip.
HARMONICS, WANDER, DIP = 0.03, 0.02, 0.05
_STEADY = 2e-4  # of the frequency: its error where the phase follows no straight line


@dataclass(frozen=True)
class Tested:
    """One tested clearance, m, with what is to be made small (m or s) and its regime.

    `value` is None where the release never fell to the level within its record; `swing` is that of
    the phase of its impacts, unknown where they are few; `length` is that of the record with what
    the base moved before it, s.
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
class LevelBase:
    """Base motion of a level.

    Attributes
    ----------
    G : amplitude, m, with its standard error.
    frequency : Hz; None where the tests do not share one.
    scatter : standard deviation of the amplitude from test to test over G, as the base channel
        shows it; b_c of each test goes with its own.
    """

    G: Quantity
    frequency: Quantity | None
    scatter: float = 0.0


@dataclass(frozen=True)
class PeriodicLevel:
    """Periodic tests at one base amplitude: mean amplitude (m) over clearance.

    Attributes
    ----------
    nominal : base amplitude of the sheet, m; it names the level.
    base : amplitude and frequency that predictions use.
    tests : by clearance.
    state : of the rig of these tests (`RigState`); empty where all tests are of one rig.
    """

    nominal: float
    base: LevelBase
    tests: tuple[Tested, ...]
    state: str = ""

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
        return f"G = {1e3 * self.nominal:.6g} mm{of_state(self.state)}"


@dataclass(frozen=True)
class ReleaseLevel:
    """Releases from x0, m: time (s) until the amplitude is below `target`, m, over clearance.

    `x0` is that of the test log and names the level; `release` is what predictions use, m. `state`
    is that of the rig, as of a `PeriodicLevel`.
    """

    x0: float
    target: float
    tests: tuple[Tested, ...]
    release: Quantity
    state: str = ""

    @property
    def name(self) -> str:
        """As in clearances.csv."""
        return f"{1e3 * self.x0:.6g} mm to {1e3 * self.target:.6g} mm{of_state(self.state)}"


def of_state(state: str) -> str:
    """What follows the name of what holds for tests of one state of the rig alone."""
    return f", {state}" if state else ""


#: Name of the state of the rig, and the rows of the records that are of it.
_Parts = Iterable[tuple[str, Rows]]


def _by_rig(regimes: Rows, states: Sequence[RigState]) -> _Parts:
    """Rows of the tests of one rig each, as the joint model has them."""
    if not states:
        return [("", regimes)]
    parts = [(state.name, frozenset(state.records)) for state in states]
    return [(name, [row for row in regimes if row["record"] in ids]) for name, ids in parts]


def periodic_levels(
    campaign: Campaign,
    regimes: Rows,
    base: Rows,
    identified: Rows = (),
    states: Sequence[RigState] = (),
) -> list[PeriodicLevel]:
    """Levels of the periodic tests with one NES, small base amplitude first.

    Parameters
    ----------
    campaign : Campaign
    regimes, base, identified : sequences of mappings
        Rows of regimes.csv, base.csv and identified.csv; the last for the base amplitudes found.
    states : sequence of RigState
        Tests of different ones are in different levels; those of the first come first.
    """
    return [
        level
        for state, rows in _by_rig(regimes, states)
        for level in _of_one_rig(campaign, rows, base, identified, state)
    ]


def _of_one_rig(
    campaign: Campaign, regimes: Rows, base: Rows, identified: Rows, state: str
) -> Iterator[PeriodicLevel]:
    measured = {row["record"]: row for row in base}
    groups: dict[float, list[tuple[Record, Tested]]] = {}
    for record, row in single_nes(campaign, regimes, "periodic"):
        if record.base_amplitude and row.get("amplitude_mean_m") is not None:
            halves = (row.get(name) for name in ("swing_first", "swing"))
            tested = Tested(
                record.clearance[0],
                row["amplitude_mean_m"],
                _regime(row),
                record.id,
                Swing(*(math.nan if one is None else one for one in halves)),
                _length(record, row),
                row.get("waited_s") or math.inf,
            )
            groups.setdefault(record.base_amplitude, []).append((record, tested))
    for values in _close(sorted(groups), _ONE_BASE):
        G = median_low(values)
        records, tests = zip(*(one for value in values for one in groups[value]), strict=True)
        moved = base_of_level(
            G,
            {record.frequency[0] for record in records if record.frequency},
            [measured[record.id] for record in records if record.id in measured],
            inputs=campaign.known.uncertainties,
            found=found_base(identified, {record.id for record in records}),
        )
        yield PeriodicLevel(G, moved, tuple(sorted(tests, key=lambda t: t.clearance)), state)


def _length(record: Record, row: Row) -> float:
    """s of a record, with what the base is said to have moved before it begins in motion."""
    before = 0.0 if row.get("waited_s") else record.settings.regimes.waited
    return before + (row.get("length_s") or math.inf)


def _regime(row: Row) -> str:
    """The regime of a periodic test; a ball that meets its walls hardly ever is not on any orbit.

    What is found there are a false impact or two, or the last of how the test began. A test of few
    cycles does not tell what is permanent, nor does one whose amplitude still moves: on an orbit it
    is constant. Nor does one with two impacts in every cycle whose phase swings: they may be lost
    or come to rest.
    """
    regime: str = row["regime"]
    if regime and _still(row):
        return Regime.NO_IMPACT.value
    cycles = row.get("cycles")
    if regime == Regime.MODULATED.value and (row.get("captured") or 0.0) >= _EVERY_CYCLE:
        return ""
    if regime not in PERMANENT:
        return regime
    moves = (row.get("amplitude_error_m") or 0.0) > _MOVES * row["amplitude_mean_m"]
    return "" if moves or (cycles is not None and cycles < TELLING) else regime


def _still(row: Row) -> bool:
    """Whether the ball met its walls hardly ever: a false impact or two are no motion of it."""
    per_cycle = row.get("impacts_per_cycle")
    return row["regime"] == Regime.NO_IMPACT.value or (per_cycle is not None and per_cycle < STILL)


def release_levels(
    campaign: Campaign,
    regimes: Rows,
    times: Rows,
    identified: Rows = (),
    states: Sequence[RigState] = (),
) -> list[ReleaseLevel]:
    """Levels of the releases with one NES: by release, then from high to low amplitude.

    Times of one level are counted from one amplitude, the mean of its releases, which b_t is of
    too: by hand releases scatter by per cent, and a ball takes off a constant amount a cycle.

    Parameters
    ----------
    campaign : Campaign
    regimes, times, identified : sequences of mappings
        Rows of regimes.csv, decay_times.csv and identified.csv; the last for the releases found.
    states : sequence of RigState
        As in `periodic_levels`.
    """
    reached: dict[str, dict[float, float | None]] = {}
    for row in times:
        reached.setdefault(row["record"], {})[float(row["target_m"])] = row["time_s"]
    levels = []
    for state, x0, group in (
        (state, *one)
        for state, rows in _by_rig(regimes, states)
        for one in _by_release(single_nes(campaign, rows, "transient"))
    ):
        release = _mean_release(campaign, [record for record, _ in group], identified)
        # the sensor shows how much farther out each began than the others, or the sheet does
        shown = all(row.get("begins_m") for _, row in group)
        starts = [row["begins_m"] if shown else abs(record.release or x0) for record, row in group]
        common = fmean(starts)
        if shown:
            release = _as_begun(release, [row for _, row in group])
        named = next(record.id for record, _ in group if abs(record.release or 0.0) == x0)
        for target in sorted(reached.get(named, {}), reverse=True):
            tests = [
                Tested(record.clearance[0], time, row["regime"], record.id)
                for (record, row), start in zip(group, starts, strict=True)
                if (fell := reached.get(record.id)) is not None
                for time in [_time_from(common, fell, start, target)]
            ]
            tests.sort(key=lambda test: test.clearance)
            if any(test.value is not None for test in tests):
                levels.append(ReleaseLevel(x0, target, tuple(tests), release, state))
    return levels


def _mean_release(campaign: Campaign, records: Sequence[Record], identified: Rows) -> Quantity:
    """Mean of the releases of a level as the records show them, else as they were typed, m.

    Their errors are mostly one: that of the sensor, or of the ruler.
    """
    each = []
    for record in records:
        typed = abs(record.release or 0.0)
        stated = Quantity(typed, campaign.known.uncertainties.release.of(typed))
        each.append(found_length("release", identified, {record.id}) or stated)
    return Quantity(fmean(q.value for q in each), fmean(q.std_error for q in each))


def _as_begun(release: Quantity, rows: Rows) -> Quantity:
    """The amplitude with which releases begin, where a hand pushed the mass or went along, m."""
    shares = [row["begins_m"] / row["released_m"] for row in rows]
    if all(share == 1.0 for share in shares):
        return release
    share = sum(row["begins_m"] for row in rows) / sum(row["released_m"] for row in rows)
    error = median(row["begins_error_m"] / row["begins_m"] for row in rows)
    scatter = float(np.std(shares, ddof=1)) / math.sqrt(len(shares)) if len(shares) > 1 else 0.0
    relative = math.hypot(release.std_error / release.value, error, scatter)
    return Quantity(release.value * share, release.value * share * relative)


#: Neighbouring values that differ by less than this share are one, as somebody read it: base
#: amplitudes, and releases by hand.
_ONE_BASE, _ONE_RELEASE = 0.02, 0.05


def _close(values: Sequence[float], share: float) -> list[list[float]]:
    """Sorted values in groups of close ones."""
    groups: list[list[float]] = []
    for value in values:
        if groups and value <= groups[-1][-1] * (1.0 + share):
            groups[-1].append(value)
        else:
            groups.append([value])
    return groups


def _by_release(
    records: Iterable[tuple[Record, Row]],
) -> Iterable[tuple[float, list[tuple[Record, Row]]]]:
    """Releases of one height, m, and their records, small ones first.

    A ball that never met a wall shows nothing of its clearance.
    """
    let_go: dict[float, list[tuple[Record, Row]]] = {}
    for record, row in records:
        if record.release and not _still(row):
            let_go.setdefault(abs(record.release), []).append((record, row))
    for values in _close(sorted(let_go), _ONE_RELEASE):
        group = [one for value in values for one in let_go[value]]
        yield median_low(abs(record.release or 0.0) for record, _ in group), group


def _time_from(
    common: float, fell: Mapping[float, float | None], start: float, target: float
) -> float | None:
    """Time to fall to a target, s, as if the release had begun at a `common` amplitude, m.

    In between the amplitude falls by straight lines. None if the target is not reached.
    """
    known = sorted(((a, t) for a, t in fell.items() if t is not None and a < start), reverse=True)
    amplitude, time = np.array([(start, 0.0), *known]).T
    if amplitude.size < 2 or target < amplitude[-1] * (1.0 - _ONE_RELEASE):
        return None

    def at(a: float) -> float:
        i = int(np.clip(np.searchsorted(-amplitude, -a), 1, amplitude.size - 1))
        slope = (time[i] - time[i - 1]) / (amplitude[i] - amplitude[i - 1])
        return float(time[i] + slope * (a - amplitude[i]))

    return at(target) - at(common)


def single_nes(campaign: Campaign, regimes: Rows, test: str) -> Iterable[tuple[Record, Row]]:
    """Records of one test with exactly one NES, with their rows of regimes.csv."""
    by_id = {record.id: record for record in campaign.records}
    for row in regimes:
        record = by_id.get(row["record"])
        if record and record.test == test and len(record.clearance) == 1 and not record.exclude:
            yield record, row


def found_length(what: str, identified: Rows, records: set[str]) -> Quantity | None:
    """``base_amplitude`` or ``release`` of these records as all show it, m; identified.csv."""
    for row in identified:
        if row["parameter"] == what and records & set(row["records"].split(";")):
            return Quantity(float(row["value"]), float(row["std_error"] or 0.0))
    return None


def found_base(identified: Rows, records: set[str]) -> tuple[Quantity | None, Quantity | None]:
    """Amplitude, m, and frequency, Hz, of the base of these records as the mass answers it."""
    amplitude, frequency = (
        found_length(f"base_{what}", identified, records) for what in ("amplitude", "frequency")
    )
    return amplitude, frequency


def base_of_level(
    nominal: float,
    frequencies: set[float],
    rows: Rows,
    *,
    inputs: Uncertainties,
    found: tuple[Quantity | None, Quantity | None] = (None, None),
) -> LevelBase:
    """Base of a level: its amplitude as all records show it, else of the channel or the test log.

    Its frequency as the channel shows it; as the mass answers it where there is none.

    Parameters
    ----------
    nominal : float
        Base amplitude of the test log, m.
    frequencies : set of float
        Those of the test log, Hz.
    rows : sequence of mappings
        Of base.csv, of the level's records.
    inputs : Uncertainties
        Of the base channel's sensitivity and of the clock.
    found : (Quantity or None, Quantity or None)
        Amplitude, m, and frequency, Hz, that the joint model found (`found_base`).

    Examples
    --------
    >>> base = base_of_level(0.25e-3, {7.86}, [], inputs=Uncertainties())
    >>> base.G.std_error, base.frequency.value
    (5e-06, 7.86)
    """
    amplitude, frequency = found
    if not rows:
        if frequencies and _one(frequencies):
            f, spread = _mean([(one, 0.0) for one in frequencies])
            stated = Quantity(f, math.hypot(GENERATOR * inputs.clock.of(f), spread))
            frequency = _both(frequency, stated)
        amplitude = amplitude or Quantity(nominal, inputs.base_amplitude.of(nominal))
        return LevelBase(amplitude, frequency)
    gain, clock = inputs.base.of(1.0), inputs.clock.of(1.0)
    G, noise = _mean([(r["amplitude_m"], r["amplitude_error_m"]) for r in rows])
    f, f_noise = _mean([(r["frequency_hz"], r["frequency_error_hz"]) for r in rows])
    # Tests at different frequencies have no prediction of their own: none is drawn for their mean.
    shared = _one([r["frequency_hz"] for r in rows])
    scatter = float(np.std([r["amplitude_m"] for r in rows], ddof=1)) if len(rows) > 1 else 0.0
    return LevelBase(
        amplitude or Quantity(G, math.hypot(noise, gain * G)),
        Quantity(f, math.hypot(f_noise, clock * f)) if shared else None,
        scatter / G if G else 0.0,
    )


def _both(shown: Quantity | None, stated: Quantity) -> Quantity:
    """What a record shows and the test log states, by their errors; else what the record shows."""
    if shown is None or not shown.std_error:
        return shown or stated
    rounded = last_digit(stated.value) / math.sqrt(12.0)
    typed = math.hypot(stated.std_error or 0.0, DISPLAY_ERROR * stated.value, rounded)
    errors = np.array([shown.std_error, typed])
    if abs(shown.value - stated.value) > DIFFERS * math.hypot(*errors):
        return shown
    weights = errors**-2
    mean = float(np.average([shown.value, stated.value], weights=weights))
    return Quantity(mean, float(weights.sum()) ** -0.5)


def _one(frequencies: Iterable[float]) -> bool:
    """Whether tests were made at one frequency, as far as it was held or read."""
    each = list(frequencies)
    return max(each) - min(each) < 1e-3 * max(each)


def _mean(pairs: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Mean, and what scatter from record to record and the errors of each leave of it."""
    values = [value for value, _ in pairs]
    centre = sum(values) / len(values)
    scatter = math.sqrt(sum((v - centre) ** 2 for v in values) / len(values))
    return centre, math.hypot(scatter, max(error for _, error in pairs))


def base_checks(name: str, frequencies: set[float], base: LevelBase, rows: Rows) -> list[Check]:
    """Where the base did not do what the test log says, or was no steady sine.

    Parameters
    ----------
    name : str
        Of the level.
    frequencies : set of float
        Of the test log, Hz.
    base : LevelBase
    rows : sequence of mappings
        Of base.csv, of the level's records.
    """
    checks: list[Check] = []
    each = [row["frequency_hz"] for row in rows] or sorted(frequencies)
    if base.frequency is None and len(each) > 1:
        detail = (
            f"{name}: its tests were made at {min(each):.6g} to {max(each):.6g} Hz; b_c depends on "
            "the frequency and is predicted for resonance. Compare tests of one frequency"
        )
        checks.append(Check("", "base frequency", "warning", detail))
    if len(frequencies) == 1 and base.frequency is not None:
        sheet, found = next(iter(frequencies)), base.frequency
        allowed = math.hypot(found.std_error, DISPLAY_ERROR * sheet)
        if abs(found.value - sheet) > DIFFERS * allowed:
            detail = (
                f"{name}: the {'base channel' if rows else 'mass'} shows {found.value:.6g} Hz, the "
                f"test log says {sheet:.6g} Hz; predictions use what was measured; check "
                "frequency_hz and the sample rate"
            )
            checks.append(Check("", "base frequency", "warning", detail))
    return checks + [check for row in rows for check in _steadiness(row)]


def _steadiness(row: Row) -> list[Check]:
    harmonics = math.hypot(row["harmonic_2"], row["harmonic_3"])
    wander, dip = row["wander"], row["dip"]
    words = []
    if harmonics > HARMONICS:
        words.append(f"harmonics of {100 * harmonics:.2g} %")
    if wander > WANDER:
        words.append(f"an amplitude that varies by {100 * wander:.2g} %")
    if dip > DIP:
        words.append(f"a dip of {100 * dip:.2g} %")
    frequency, error = row["frequency_hz"], row["frequency_error_hz"]
    if error > _STEADY * frequency:
        words.append(f"a frequency that is steady to {COVERAGE_95 * error:.1g} Hz only")
    if not words:
        return []
    detail = f"the base moved with {', '.join(words)}; predictions are for a steady sine"
    return [Check(row["record"], "base motion", "warning", detail)]


def as_found(campaign: Campaign, inputs: Sequence[Row]) -> Campaign:
    """The campaign with the clearances and added masses of inputs.csv whose verdict is ``off``.

    Balls have the masses that all records show: to 2 % most are weighed no better than that.

    Base amplitudes of levels stay, since they name the levels; what predictions take for them is in
    identified.csv. A test of another amplitude than its level's gets its own, and one of which
    records.csv states no base amplitude or release that which its records show.

    Parameters
    ----------
    campaign : Campaign
    inputs : sequence of mappings
        Rows of inputs.csv.

    Examples
    --------
    >>> from pathlib import Path
    >>> from vinesexp.records.campaign.schema import Known
    >>> b34 = Record("b34", Path("a.csv"), "periodic", (0.068,))
    >>> whole = Campaign(Path(), "", "", Known(), {}, None, None, None, (b34,))
    >>> row = {"item": "clearance", "record": "b34", "found": "34", "verdict": "off"}
    >>> as_found(whole, [row]).records[0].clearance
    (0.034,)
    """
    rows = [
        row for row in inputs
        if row["verdict"] == Verdict.OFF.value or row["item"] in ("base_amplitude", "release")
    ]  # fmt: skip
    records = tuple(_found(record, rows) for record in campaign.records)
    weighed = [row for row in inputs if row["item"].startswith("nes_mass") and row["found"]]
    if len(weighed) != len(campaign.known.nes_mass):
        return replace(campaign, records=records)
    balls = (
        Quantity(1e-3 * float(row["found"]), 1e-3 * float(row["found_error"] or 0.0))
        for row in weighed
    )
    return replace(campaign, records=records, known=replace(campaign.known, nes_mass=tuple(balls)))


def _found(record: Record, rows: Sequence[Row]) -> Record:
    clearance = list(record.clearance)
    for row in rows:
        if record.id not in row["record"].split(";"):
            continue
        found = 1e-3 * float(f"{float(row['found']):.4g}")  # it names a level
        stated = 1e-3 * float(row["stated"]) if row.get("stated") else found
        if row["item"] == "release":
            record = replace(record, release=record.release or stated)
        elif row["item"] == "base_amplitude":
            record = replace(record, base_amplitude=record.base_amplitude or stated)
        elif row["item"] == BASE_OF_ONE:  # it is a level of its own
            record = replace(record, base_amplitude=found)
        elif row["item"] == "added_mass":
            record = replace(record, added_mass=1e-3 * float(row["found"]))
        elif row["item"].startswith("clearance"):
            number = row["item"].removeprefix("clearance").removeprefix(" of ball ")
            clearance[int(number or 1) - 1] = 1e-3 * float(row["found"])
    return replace(record, clearance=tuple(clearance))
