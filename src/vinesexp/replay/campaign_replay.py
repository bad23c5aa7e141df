"""The replay of a campaign: each record beside its replays."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.clearance.levels import LevelBase, Rows, base_of_level, found_base
from vinesexp.clearance.predicted import (
    OF_BALL,
    ROLLS_IN_PART,
    ball_of,
    cubic_stiffness,
    over_whole,
)
from vinesexp.errors import AnalysisError
from vinesexp.excitation import WeakDamping
from vinesexp.identification.flights import flights_of
from vinesexp.records.campaign.schema import RELEASES, Campaign, Record
from vinesexp.records.campaign.uncertainties import EXACT
from vinesexp.records.stored.result_columns import reading_of_metre
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.records.stored.tables import Row, Value
from vinesexp.replay.motions import (
    TESTS,
    BaseSamples,
    Begun,
    base_samples,
    begun,
    drive_of,
    released,
    replays,
)
from vinesexp.replay.replay_table import (
    Compared,
    Measures,
    compared,
    decay_time,
    is_steady,
    measures_of,
)
from vinesexp.rig import NES, Oscillator, Rig
from vinesexp.signals.free_from import freed
from vinesexp.signals.impacts.impact_table import Impacts, read_impacts
from vinesexp.signals.means import cycle_amplitudes, free_cycles
from vinesexp.theory.regime_definitions import Regime, each_ball

if TYPE_CHECKING:
    from vinesexp.identification.joint.whole import RigPosterior

_MOST = 60_000_000  # samples of a record
_LONGEST = 300.0  # s of a record that are replayed
_LATER = 0.2, 0.6  # of a record: between them a test is replayed from there as well
#: Share by which every clearance is unknown, however well it was measured.
_LEAST_OFF = 3e-3
#: Standard uncertainties by which a clearance is moved where a record is near a change of regime.
_OFF = 2.0
_MOST_OFF = 0.5  # of a clearance: beyond it is another cavity
#: Clearances that are tried one after the other, as shares of it. Of a strongly modulated motion
#: one start in a hundred may move as the record does.
_BESIDE = (1.0, -1.0, 0.5, -0.5, 0.25, -0.25, 0.75, -0.75)


# The rig that records are replayed with: the identified values, and the effects that were chosen.
#
# Friction, tilt, walls that differ, r over speed and a clearance off the test log come from the
# impacts; quadratic and Coulomb damping and a spring that stiffens from the ring-downs. What no
# record shows is absent, and a rig without effects is the plain one.
#: Rows of identified.csv on damping and spring.
OF_OSCILLATOR = (
    "damping_linear", "damping_quadratic", "damping_coulomb", "stiffening", "f0_small",
)  # fmt: skip


@dataclass(frozen=True)
class Model:
    """What is known of the rig.

    Attributes
    ----------
    values : ``M``, ``c1``, ``k1`` and, where there are balls, ``r`` or ``r_1``, ``r_2``; SI.
    masses : of the balls, kg; a single one holds for all.
    effects : of `OF_BALL` and `OF_OSCILLATOR`, those that were chosen.
    """

    values: Mapping[str, float]
    masses: tuple[float, ...]
    effects: Mapping[str, float] = field(default_factory=dict)

    @property
    def plain(self) -> Model:
        """The same without effects."""
        return Model(self.values, self.masses)

    @property
    def damping(self) -> WeakDamping:
        """Forces of the oscillator's damping beyond c1.

        dA/dt = -(gamma + beta A^2) is of the forces pi M w gamma/2 and 3 pi M beta/(4 w) u |u|.
        """
        if "damping_linear" not in self.effects or not {"M", "k1"} <= set(self.values):
            return WeakDamping()
        M = self.values["M"]
        w = math.sqrt(self.values["k1"] / M)
        return WeakDamping(
            quadratic=0.75 * math.pi * M * self.effects.get("damping_quadratic", 0.0) / w,
            coulomb=0.5 * math.pi * M * w * self.effects.get("damping_coulomb", 0.0),
        )


def identified_model(identified: Rows, masses: tuple[float, ...]) -> Model:
    """From the rows of identified.csv, and the masses of balls as they were found.

    Examples
    --------
    >>> rows = [{"parameter": "r", "value": "0.6", "method": "combined"},
    ...         {"parameter": "friction", "value": "0.3", "method": "impacts"}]
    >>> identified_model(rows, (0.032,)).effects
    {'friction': 0.3}
    """
    values, effects = {}, {}
    for row in identified:
        if row["method"] == "combined":
            values[row["parameter"]] = float(row["value"])
        elif row["parameter"] in (*OF_BALL, *OF_OSCILLATOR):
            effects[row["parameter"]] = float(row["value"])
    weighed = (values["m"],) if "m" in values else ()
    return Model(values, masses or weighed, effects)


def model_of(record: Record, model: Model, joint: RigPosterior | None) -> Model:
    """The rig of one test, where the joint model holds the tests to be of several (`RigState`)."""
    states = joint.states if joint is not None else ()
    own = next((one.rig for one in states if record.id in one.records), None)
    if joint is None or own is None:
        return model
    by = over_whole(joint, own)
    sizes = by | {"damping_linear": by["c1"], "f0_small": by["f0"], "r_effective": by["r"],
                  "nes_mass_effective": by["m"]}  # fmt: skip
    values, effects = (
        {name: value * sizes.get(name, 1.0) for name, value in of.items()}
        for of in (model.values, model.effects)
    )
    return Model(values, tuple(mass * by["m"] for mass in model.masses), effects)


def rig_of(record: Record, model: Model, share: float = 0.0) -> Rig:
    """The rig as it was in one test: its added mass, its balls and cavities, longer by a share.

    Raises
    ------
    AnalysisError
        A value is not known.
    """
    values = model.values
    missing = [name for name in ("M", "c1", "k1") if name not in values]
    balls = []
    for i, b in enumerate(record.clearance):
        r = values.get(f"r_{i + 1}", values.get("r"))
        if r is None or not model.masses:
            missing += ["r"] * (r is None) + ["m"] * (not model.masses)
            break
        mass = model.masses[i] if len(model.masses) > i else model.masses[0]
        balls.append(_ball(mass, (1.0 + share) * b, r, model.effects))
    if missing:
        raise AnalysisError(f"no replay without {', '.join(missing)}")
    if balls and "rolls_from" in model.effects:
        raise AnalysisError(ROLLS_IN_PART)
    return Rig(_oscillator(record, model), nes=balls)


def _oscillator(record: Record, model: Model) -> Oscillator:
    """Spring and damper of small motion; what grows with amplitude comes on top."""
    M, c1, k1 = (model.values[name] for name in ("M", "c1", "k1"))
    of, k3 = model.effects, 0.0
    if "damping_linear" in of:
        c1 = 2.0 * M * of["damping_linear"]
    if "f0_small" in of:
        k1 = M * (2.0 * math.pi * of["f0_small"]) ** 2
        k3 = cubic_stiffness(k1, of.get("stiffening", 0.0))
    taken = of.get("rolling", 0.0) * sum(model.masses[:1]) if record.clearance else 0.0
    return Oscillator(M=M + taken + (record.added_mass or 0.0), c1=c1, k1=k1, k3=k3)


def _ball(m: float, b: float, r: float, of: Mapping[str, float]) -> NES:
    """A ball with the effects that were chosen; the others by effective values."""
    if {"contact_time", "hollow", "drag", "viscous"} & of.keys() and "r_effective" in of:
        r, m = of["r_effective"], of.get("nes_mass_effective", m)
        return replace(ball_of(m, b, r, of), friction=0.0, contact_time=0.0)
    return ball_of(m, b, r, of)


@dataclass(frozen=True)
class Recorded:
    """What one record shows: amplitude cycle by cycle, how it began, and its base.

    Attributes
    ----------
    frequency, length : Hz, s.
    time, amplitude : of each cycle, from where the mass is free: the first sample, or where a hold
        before a release ends.
    x0, v0 : of the mass there, m and m/s.
    base : from the base channel, where it measures displacement.
    states : of mass and balls near the beginning, as the impacts show them.
    unlike : by what share of it the impulse of one impact differs from that of the next.
    """

    frequency: float
    length: float
    time: FloatArray
    amplitude: FloatArray
    x0: float
    v0: float
    base: BaseSamples | None
    states: tuple[Begun, ...]
    unlike: float


def replay_campaign(
    campaign: Campaign, *, identified: Rows, regimes: Rows, base: Rows, inputs: Rows = (),
    joint: RigPosterior | None = None, paths: ResultPaths,
) -> tuple[list[Compared], list[dict[str, Value]]]:  # fmt: skip
    """Replay every record that can be.

    Parameters
    ----------
    campaign : Campaign
    identified, regimes, base, inputs : sequences of mappings
        Rows of identified.csv, regimes.csv, base.csv and inputs.csv.
    joint : RigPosterior, optional
        For the rig of each test, where they are of several.
    paths : ResultPaths
        Where the channels are, measured and bandpassed.

    Returns
    -------
    rows : list of Compared
        Of replay.csv.
    cycles : list of dict
        Of replay_cycles.csv: amplitude of each cycle, measured and replayed.
    """
    model = identified_model(identified, tuple(m.value for m in campaign.known.nes_mass))
    by_id = {row["record"]: row for row in regimes}
    bases = {row["record"]: row for row in base}
    rows: list[Compared] = []
    cycles: list[dict[str, Value]] = []
    for record in campaign.records:
        if record.test not in TESTS or record.exclude or record.id not in by_id:
            continue
        record = _as_begun(record, by_id[record.id])
        seen = _seen(paths, record, reading_of_metre(campaign, record, inputs))
        if seen is None:
            continue
        own = _base(record, bases, identified)
        try:
            rig = model_of(record, model, joint)
            found, of_record = _beside(campaign, record, rig, own, seen, by_id[record.id])
        except AnalysisError:
            continue
        rows += of_record
        regime = by_id[record.id].get("regime", "")
        alike = [one for one in found if one.regime == regime]
        cycles += _cycles(record, seen, alike or found)
    return rows, cycles


def _as_begun(record: Record, row: Row) -> Record:
    """A release from the amplitude with which its free motion begins, whatever the hand did."""
    if not record.release or not row.get("begins_m"):
        return record
    return replace(record, release=record.release * row["begins_m"] / row["released_m"])


def _beside(
    campaign: Campaign, record: Record, model: Model, base: LevelBase | None, seen: Recorded,
    row: Row,
) -> tuple[list[Measures], list[Compared]]:  # fmt: skip
    """Replays of a record and the rows of replay.csv.

    Near a change of regime, and where a wall just reaches the ball, a clearance that is off by what
    nobody can know leads to another motion, and so do impacts of which no two are alike: where the
    rig does not replay it, clearances to either side are tried, with an r that scatters as in the
    record, until one does.
    """
    apart = len(each_ball(row["regime"])) > 1 or len(record.clearance) < 2
    decay = float("nan")
    if record.test in RELEASES:
        decay = decay_time(seen.time, seen.amplitude)
    steady = is_steady(seen.time, seen.amplitude, seen.length)
    still = row["regime"] == Regime.NO_IMPACT.value
    again = partial(
        _replayed, record, model, base, seen, apart, still=still, settles=row.get("steady_from_s")
    )
    found = again()
    rows = compared(record, row, decay, found, steady=steady)
    if record.test == "ringdown" or len(record.clearance) != 1 or not _fails(rows):
        return found, rows
    off = _OFF * math.hypot(
        _LEAST_OFF,
        campaign.known.uncertainties.clearance.of(record.clearance[0]) / record.clearance[0],
        campaign.known.uncertainties.base.of(1.0),
    )
    off = min(off, _MOST_OFF)
    near = list(found)
    for share in _BESIDE:
        near += again(share=share * off)
        beside = compared(record, row, decay, near, steady=steady, near=True)
        if not _fails(beside):
            return near, beside
    return found, rows


def _fails(rows: Sequence[Compared]) -> bool:
    return any(row.decisive and row.outcome == "differs" for row in rows)


def _seen(paths: ResultPaths, record: Record, reads: float) -> Recorded | None:
    """What a record shows, m; its displacement reads so much for 1 m."""
    with open_record(paths.conditioned(record.id)) as view:
        frequency = view.attributes.get("oscillation_hz")
        if view.refused is not None or "displacement" not in view.roles or not frequency:
            return None
        f, rate = float(frequency), view.sample_rate
        # A mass that was held before its release is compared from where it is free.
        free = round(freed(view) * rate)
        x = view.read("displacement", free, free + _MOST) / reads
        time, amplitude = cycle_amplitudes(x, rate, f)
        length = (view.n - free) / rate
        if record.test in RELEASES and (whole := free_cycles(amplitude)) < amplitude.size:
            time, amplitude, length = time[:whole], amplitude[:whole], float(time[whole - 1])
        begins = view.start + free / rate
    known = np.isfinite(amplitude)
    if not known.any():
        return None
    base = None
    if record.test in ("periodic", "sweep"):
        with open_record(paths.record(record.id)) as view:
            base = base_samples(view, frequency=f)
    x0, v0 = _beginning(x[: max(int(rate / f), 8)], rate, f)
    states: list[Begun | None] = []
    unlike = 0.0
    if record.clearance:
        impacts = read_impacts(paths.impacts(record.id))
        unlike = flights_of(impacts, nes=1, b=record.clearance[0] * reads, period=1.0 / f).unlike
        places, speeds = impacts.x_m / reads, impacts.v_before_m_s / reads
        impacts = replace(impacts, time_s=impacts.time_s - begins, x_m=places, v_before_m_s=speeds)
        if record.test == "periodic":
            states = _begun(impacts, record.clearance, x0, v0)
        elif record.test == "sweep":
            states = [released(impacts, record.clearance, x0=x0, v0=v0)]
        else:
            let_go = _from(record, amplitude[known], x0)
            states = _let_go(impacts, record.clearance, let_go, 1.0 / f)
    shown = tuple(state for state in states if state is not None)
    cycles = time[known], amplitude[known]
    return Recorded(f, min(length, _LONGEST), *cycles, x0, v0, base, shown, unlike)


def _begun(
    impacts: Impacts, clearance: Sequence[float], x0: float, v0: float
) -> list[Begun | None]:
    """How a periodic test begins, and how it goes on.

    How long a ball floats that was hardly met is not known well enough.
    """
    first = begun(impacts, clearance) or released(impacts, clearance, x0=x0, v0=v0)
    return [first, begun(impacts, clearance, between=_LATER)]


def _let_go(
    impacts: Impacts, clearance: Sequence[float], x0: float, period: float
) -> list[Begun | None]:
    """How a release begins, whose decay is counted from its first cycle."""
    first = begun(impacts, clearance)
    early = first if first is not None and first.time < period else None
    return [early, released(impacts, clearance, x0=x0)]


def _from(record: Record, amplitude: FloatArray, begins: float) -> float:
    """Place from which a mass was let go, m: the sheet's, on the side where the record begins."""
    return math.copysign(abs(record.release or float(amplitude.max())), begins)


def _beginning(x: FloatArray, rate: float, frequency: float) -> tuple[float, float]:
    """Place and velocity at the first sample, by the sine through the first cycle."""
    x = x[np.isfinite(x)]
    if x.size < 8:
        return 0.0, 0.0
    w = 2.0 * math.pi * frequency
    t = np.arange(x.size) / rate
    columns = np.stack([np.cos(w * t), np.sin(w * t)], axis=1)
    place, speed = np.linalg.lstsq(columns, x, rcond=None)[0]
    return float(place), float(w * speed)


def _base(record: Record, bases: Mapping[str, Row], identified: Rows) -> LevelBase | None:
    """The base of one periodic test: as measured, else as the test log says."""
    if record.test != "periodic" or not record.base_amplitude:
        return None
    own = bases.get(record.id)
    frequencies = {record.frequency[0]} if record.frequency else set()
    return base_of_level(
        record.base_amplitude,
        frequencies,
        [own] if own is not None else [],
        inputs=EXACT,
        found=found_base(identified, {record.id}),
    )


def _replayed(
    record: Record, model: Model, base: LevelBase | None, seen: Recorded, apart: bool, *,
    still: bool, settles: float | None = None, share: float = 0.0,
) -> list[Measures]:  # fmt: skip
    """Numbers of all replays, of cavities that are longer by a share; there r scatters."""
    rig, plain = (rig_of(record, one, share) for one in (model, model.plain))
    if share:
        rig = replace(rig, nes=[_unlike(nes, seen.unlike) for nes in rig.nes])
    drive = drive_of(record, plain, base=base, samples=seen.base, length=seen.length)
    x0, v0 = 0.0, 0.0
    if record.test == "sweep":
        x0, v0 = seen.x0, seen.v0
    elif record.test != "periodic":
        x0 = _from(record, seen.amplitude, seen.x0)
    frequency = seen.frequency
    if drive.base is not None and base is not None and base.frequency is not None:
        frequency = base.frequency.value
    stretches = replays(
        rig, drive, plain=plain, x0=x0, v0=v0, damping=model.damping, states=seen.states,
        still=still,
    )  # fmt: skip
    found = [
        measures_of(one, test=record.test, frequency=frequency, apart=apart, settles=settles)
        for one in stretches
    ]
    if not share:
        return found
    words = f"clearance {100.0 * abs(share):.2g} % {'larger' if share > 0.0 else 'smaller'}"
    return [replace(one, start=words) for one in found]


def _unlike(nes: NES, unlike: float) -> NES:
    """A ball whose impulses, in proportion to 1 + r, differ by a share from impact to impact."""
    return replace(nes, r_scatter=unlike * (1.0 + nes.r) / max(nes.r, 1e-9))


def _cycles(record: Record, motion: Recorded, found: Sequence[Measures]) -> list[dict[str, Value]]:
    """Amplitude over time, measured and over the replays of its regime on the same cycles."""
    replayed = np.array([np.interp(motion.time, *one.cycles, np.nan, np.nan) for one in found])
    shown = np.isfinite(replayed).any(axis=0)
    over = (of(replayed[:, shown], axis=0) for of in (np.nanmedian, np.nanmin, np.nanmax))
    columns = (motion.time[shown], motion.amplitude[shown], *over)
    names = ("time_s", "measured_m", "replayed_m", "replayed_low_m", "replayed_high_m")
    return [
        {"record": record.id, **dict(zip(names, map(float, row), strict=True))}
        for row in zip(*columns, strict=True)
    ]
