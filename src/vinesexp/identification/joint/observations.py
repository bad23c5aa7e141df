"""What a campaign gives the joint model: unknowns with their priors, and blocks of observations."""

from __future__ import annotations

import cmath
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vinesexp.arrays import FloatArray, median_of
from vinesexp.identification.average import weighted_mean, with_scatter
from vinesexp.identification.driven_motion import DrivenMotion
from vinesexp.identification.estimate import (
    F0_INTEGRATED,
    FIRST_SWING,
    IN_RELEASE,
    INTEGRATED,
    LOST,
    SWINGS_AT,
    Estimate,
)
from vinesexp.identification.flights import Flights, flights_of
from vinesexp.identification.joint.collisions import (
    EFFECTS,
    FREE,
    LOCALS,
    SLOWEST,
    Collisions,
    bounced,
    joined,
    near_singles,
    rolls_from,
    with_errors,
    without_chance,
)
from vinesexp.identification.joint.over_amplitude import (
    NO_LAW,
    TERMS,
    WIDTHS,
    Law,
    OfTest,
    law_asked,
    log_of,
    slopes_of,
)
from vinesexp.identification.joint.unknowns import (
    Beliefs,
    Block,
    Local,
    Prior,
    Sum,
    Tempered,
    fit,
)
from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.campaign.uncertainties import Tolerance
from vinesexp.signals.channel_agreement import expected_lead
from vinesexp.signals.impacts.from_integral import ACROSS
from vinesexp.signals.impacts.impact_table import Impacts, typical_lateness
from vinesexp.units import LIKELY, Quantity, last_digit

#: Methods of single records that count; the cheaper ones are shown beside them.
COUNTED = ("likelihood", "envelope", "sweep")
#: Wide enough to say nothing, in logarithms, ratios and m.
_WIDE, _WIDE_R = 10.0, 0.5
#: ln of the mass of an oscillator in a lab, kg, and its spread: parts factors of 1000, no more.
_ORDINARY_M = (math.log(3.0), 2.0)
#: What velocities beside an impact may be off by, as a share of the jump: contact, mount, filter.
_SHARE = 1e-3
#: Of the spring of a contact: nobody knows whether it is that of a ball on a plane or a linear one.
_SPRING = 1.0
#: The same of the jump that the displacement shows.
_READING = 7e-4
#: Lateness of the displacement that no channel shows, s, and as a share of the pulse, whose centre
#: a template finds only so well; records that make a mean of lags.
_LATE, _OF_PULSE, _FEWEST_LAGS = 1e-5, 0.04, 3
#: By which two recorders drift apart in half a record, s, beside the drift that was taken out.
_DRIFT = 1e-4
#: Of the frequency that a generator shows; by which two of one test may differ; relative.
_GENERATOR, _SAME_RATE = 5e-5, 1e-5
#: Power of the speed with which the area of a pulse reads too large: the contact of a fast ball is
#: shorter, and its pulse higher than one template shows it. By how much a record may differ.
_PULSE_POWER, _OWN_PULSE_POWER = 0.05, 0.02
#: By which pulses at one wall may read larger than those at the other: one template finds both.
_UNLIKE_PULSES = 0.1
#: The area of the pulse that a record learns is less sure than its noise alone would make it.
_TEMPLATE = 1e-2
_PULSE = 3.0
#: What the model of the displacement beside an impact leaves in r and in the momentum of a record.
_OWN_R, _OWN_EPS, _OWN_GAIN = 5e-5, 1e-3, 5e-4
#: By which the ratio of two channels differs from one record to another, relative.
_CHANNELS = 3e-4
#: Of a sensor across its axis at most; what differs by more is another range of the amplifier.
_MOST_ACROSS = 0.1
#: Lateness of the base's channel against the displacement, s: filters, converters that take turns.
_BASE_LATE = 3e-4
#: So many times more where the amplitude falls from impact to impact.
_RELEASED = 3.0
#: The same where the displacement is the integral of the acceleration, whose phase is less sure.
_INTEGRATED = 30.0
#: The same of the base that the mass answers to and of its f0 and zeta, relative: harmonics of the
#: base, contacts that last, a motion that is not quite that of one oscillator. A base that its
#: channel shows may differ from test to test by as much as it was stated to.
_OWN_BASE, _OWN_F0, _OWN_ZETA = 2e-3, 3e-5, 5e-3
#: Of f0 by an acceleration that is integrated, relative, beside its gains: times of the pulses.
_F0_INTEGRATED = 5e-4
#: A release swings over that many times the amplitudes of a steady test.
_OVER_RELEASE = 4.0
#: What looks like friction in it, as a share of what drives the mass.
_OWN_PUSH = 3e-3
#: From one channel of a recorder to another, 60 dB.
_CROSSTALK = 1e-3
#: Effects that another record need not have: a floor gets dusty, a cavity is set up anew.
CHANGING = ("friction", "tilt")
_FEWEST = 10  # collisions of a record
_ENOUGH = 150  # more add nothing to what a whole record may be off by
#: Degrees of freedom that the stated errors of a record are worth beside what it leaves.
_WORTH = 4.0
_TINY = 1e-9
_OF_BASE_DRIFT = 0.5  # by which the base of the cycles that count is off, in half drifts of a test
_OF_DRIFT = 1.0  # by which f0 of the tests is off that of a decay, in drifts of its record
_OWN_RELEASE = 3e-3  # by which single releases from one stop differ, relative


@dataclass(frozen=True)
class Observed:
    """A campaign as the joint model sees it.

    Attributes
    ----------
    names : the unknowns.
    beliefs : their priors.
    blocks : observations.
    start : values to start from.
    balls : number of a ball, from 1, to the name of the logarithm of its mass over that stated.
    clearances : (record, number of the ball) to the name of its own error and its stated value, m.
    levels : stated base amplitude, m, to the name of its logarithm's error.
    loads : stated added mass, kg, to the name of its error.
    releases : stated release, m, to the name of its logarithm's error.
    gains : channel (role, setup) to the name of the logarithm of its gain.
    collisions : (record, ball) to the collisions.
    order : ids of the records in the order of records.csv.
    kinds : kind of unknown to its unknowns, each with the record that it belongs to, or "".
    law : f0 and zeta over amplitude, as the ring-downs alone show them.
    cells : record whose stated added mass, or none, others have too, to the name of what its own
        differs by from theirs, kg, and the stated mass: one cell may be wrong, or empty.
    fixed : logarithm of a mass or a length to the fixed part of its error, over what is stated: a
        wrong unit leaves it as it is.
    lost : ids of the records of which impacts are lost.
    """

    names: tuple[str, ...]
    beliefs: Beliefs
    blocks: tuple[Block, ...]
    start: FloatArray
    balls: Mapping[int, str]
    clearances: Mapping[tuple[str, int], tuple[str, float]]
    levels: Mapping[float, str]
    loads: Mapping[float, str]
    releases: Mapping[float, str]
    gains: Mapping[tuple[str, str], str]
    collisions: Mapping[tuple[str, int], Collisions]
    order: tuple[str, ...]
    kinds: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    law: Law = NO_LAW
    cells: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    fixed: Mapping[str, float] = field(default_factory=dict)
    lost: frozenset[str] = frozenset()

    def common(self, own: str) -> str:
        """The unknown of all records beside which one record has its own; empty where none is."""
        of = [one for block in self.blocks for one, _ in block.sums if one.get(own) == 1.0]
        gains = [
            gain for (role, _), gain in self.gains.items()
            if own in self.kinds.get(f"own {role} gain", ())
        ]  # fmt: skip
        return next((name for one in of for name in one if not gains or name in gains), "")

    def local(self, values: FloatArray) -> dict[tuple[str, int], FloatArray]:
        """Local quantities of the collisions of each record and ball, by values of the unknowns."""
        at = dict(zip(self.names, values.tolist(), strict=True))
        flights = (block for block in self.blocks if block.kind == "flights")
        return {
            key: np.array([c + sum(f * at[name] for name, f in sums.items())
                           for sums, c in block.sums])
            for key, block in zip(self.collisions, flights, strict=True)
        }  # fmt: skip

    def mean_of(self, common: str, kind: str, records: Collection[str]) -> dict[str, float]:
        """An unknown of several records with what some have beside it, on average, as a sum."""
        own = [name for name, record in self.kinds.get(kind, {}).items() if record in records]
        return {common: 1.0, **dict.fromkeys(own, 1.0 / max(len(own), 1))}


def off_stated(name: str, stated: float) -> dict[str, float]:
    """By what a clearance, m, differs from the stated one, as a sum of unknowns; `name` its own."""
    return {name: 1.0, "clearance offset": 1.0, "clearance scale": stated}


@dataclass
class _Builder:
    """Collects unknowns and blocks."""

    campaign: Campaign
    law: Law
    follows: Mapping[str, complex]
    shared: Mapping[str, float]
    swings: Mapping[str, float] = field(default_factory=dict)
    near: Mapping[tuple[str, int], FloatArray] = field(default_factory=dict)
    priors: dict[str, Prior] = field(default_factory=dict)
    start: dict[str, float] = field(default_factory=dict)
    blocks: list[Block] = field(default_factory=list)
    balls: dict[int, str] = field(default_factory=dict)
    clearances: dict[tuple[str, int], tuple[str, float]] = field(default_factory=dict)
    levels: dict[float, str] = field(default_factory=dict)
    loads: dict[float, str] = field(default_factory=dict)
    cells: dict[str, tuple[str, float]] = field(default_factory=dict)
    fixed: dict[str, float] = field(default_factory=dict)
    releases: dict[float, str] = field(default_factory=dict)
    gains: dict[tuple[str, str], str] = field(default_factory=dict)
    collisions: dict[tuple[str, int], Collisions] = field(default_factory=dict)
    late: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    bends: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    sums: dict[tuple[str, int], tuple[Sum, ...]] = field(default_factory=dict)
    alone: dict[tuple[str, int], FloatArray] = field(default_factory=dict)
    usual: dict[float, complex] = field(default_factory=dict)
    rolls_from: dict[str, FloatArray] = field(default_factory=dict)
    kinds: dict[str, dict[str, str]] = field(default_factory=dict)

    def add(
        self, kind: str, value: float, error: float, *,
        of: str = "", record: str = "", start: float | None = None,
    ) -> str:  # fmt: skip
        """Name of an unknown: its kind, and what it is `of` where there are several."""
        name = f"{kind}: {of}" if of else kind
        if name not in self.priors:
            self.priors[name] = Prior(value, max(error, _TINY))
            self.start[name] = value if start is None else start
            self.kinds.setdefault(kind, {})[name] = record
        return name

    def own(
        self, kind: str, record: Record, error: float, *, value: float = 0.0, ball: int = 0
    ) -> str:
        """Name of what one record, or one ball in it, has for itself."""
        of = f"{record.id}, ball {ball}" if ball else record.id
        return self.add(kind, value, error, of=of, record=record.id)

    def gain(self, record: Record, role: str) -> str:
        """Logarithm of the gain of a channel; channels of one setup share it."""
        error = getattr(self.campaign.known.uncertainties, role).of(1.0)
        stated = self.campaign.setup_of(record).channels.get(role)
        if stated is not None and stated.gain_error is not None:
            error = stated.gain_error
        key = (role, record.setup)
        self.gains[key] = self.add(f"gain {role}", 0, error, of=record.setup)
        return self.gains[key]

    def own_gain(self, record: Record, role: str) -> dict[str, float]:
        """Logarithm of the gain of a channel in one record, as a sum: a laser may be aimed anew."""
        moves = "displacement" if self.has(record, "displacement") else "acceleration"
        loose = _OWN_GAIN * (self.loose(record) - 1.0) if role == moves else 0.0
        own = self.own(f"own {role} gain", record, loose)
        return {self.gain(record, role): 1.0, own: 1.0}

    def loose(self, record: Record) -> float:
        """How many times less sure the motion beside an impact is than in a steady test."""
        if not self.has(record, "displacement"):
            return _INTEGRATED
        usual = _RELEASED if record.test == "transient" else 1.0
        return max(usual, self.shared.get(record.id, 0.0) / _OWN_R)

    def has(self, record: Record, role: str) -> bool:
        return role in self.campaign.setup_of(record).channels

    def crosstalk(self, record: Record, per: complex) -> dict[str, float]:
        """Share of the mass's motion that the recorder of the base picks up, in phase and ahead.

        The real part of this complex share times a factor. In ring-downs it looks like a base that
        yields, which may be as much of it.
        """
        seen = self.followed(record)
        errors = min(abs(seen.real), _CROSSTALK), min(abs(seen.imag), _CROSSTALK)
        return self._shares("crosstalk", record, errors, per)

    def yields(self, record: Record, per: complex) -> dict[str, float]:
        """Share of the mass's motion by which the base itself follows in the tests, likewise.

        It may be all that the channel shows in ring-downs: a shaker of finite stiffness gives as
        much more or less than in the other tests of its level, whose mean the level is. Decays and
        tests alone do not tell it from crosstalk.
        """
        seen = self.followed(record)
        per -= self.usual.get(record.base_amplitude or 0.0, 0.0)
        return self._shares("yields", record, (abs(seen.real), max(-seen.imag, 0.0)), per)

    def _shares(
        self, kind: str, record: Record, errors: tuple[float, float], per: complex
    ) -> dict[str, float]:
        """A complex share times a factor, by its two parts; none where the base rests."""
        each = zip((kind, f"{kind} ahead"), errors, (per.real, -per.imag), strict=True)
        return {
            self.add(name, 0.0, error, of=record.setup): factor
            for name, error, factor in each if any(errors)
        }  # fmt: skip

    def followed(self, record: Record) -> complex:
        """Share of the mass's motion that the base channel shows in ring-downs of a setup."""
        own = [
            share for id, share in self.follows.items()
            if self.campaign.record(id).setup == record.setup
        ]  # fmt: skip
        return complex(median_of([one.real for one in own]), median_of([one.imag for one in own]))

    def contradicted(self, record: Record, more: float = 0.0) -> float:
        """By which the bends of the displacement surely contradict the lateness by phase, s.

        `more` is an error, s, beside those of both.
        """
        lag, error = self.late.get(record.id, (0.0, _LATE))
        seen, seen_error = self.bends.get(record.id, (lag, 0.0))
        off = abs(seen - lag)
        return off if off > LIKELY * math.hypot(error, seen_error, more) else 0.0

    @property
    def oscillator(self) -> dict[str, float]:
        """f0, Hz, and zeta as the fit begins with them; nothing where no record shows both."""
        if not {"ln_f0", "ln_zeta"} <= self.start.keys():
            return {}
        return {name: math.exp(self.start[f"ln_{name}"]) for name in ("f0", "zeta")}

    def oscillates(self, record: Record) -> float:
        """Frequency of the motion in a record, Hz: f0, or where nothing shows it that of the base.

        A release swings by itself. 0 where nothing is known.
        """
        f0 = self.start.get("ln_f0")
        if f0 is not None:
            return math.exp(f0)
        return float(np.mean(record.frequency or (self.swings.get(record.id, 0.0),)))


def observe(
    found: Sequence[Estimate],
    campaign: Campaign,
    impacts: Mapping[str, Impacts],
    driven: Mapping[str, DrivenMotion],
    near: Mapping[tuple[str, int], FloatArray] | None = None,
) -> Observed:
    """Unknowns, priors and blocks of a campaign.

    Parameters
    ----------
    found : sequence of Estimate
        Of single records.
    campaign : Campaign
    impacts, driven : mapping
        Record id to its impact table, and to its motion between impacts.
    near : mapping, optional
        Local quantities near which the scatter of the collisions of a record and a ball is looked
        at, if these are known from all records together.
    """
    parts = {
        name: {e.records[0]: e.value for e in found if e.parameter == name}
        for name in ("base_follows", "base_follows_ahead")
    }
    follows = {id: complex(*(one[id] for one in parts.values())) for id in parts["base_follows"]}
    shared = {r.id: _shared(r, impacts[r.id]) for r in campaign.records if r.id in impacts}
    swings = {e.records[0]: e.value for e in found if e.parameter == SWINGS_AT}
    b = _Builder(campaign, law_asked(found, campaign), follows, shared, swings, near or {})
    _rig(b, found, driven)
    _decays(b, [e for e in found if e.method != "sweep"])
    _start_mass(b, found)
    _start_law(b)
    b.blocks.clear()
    _decays(b, found)
    _start_tests(b, driven)
    b.late = _lateness(b, found, impacts) | _phases(b, found)
    b.bends = _bends(b, impacts)
    _sensors(b, found, driven)
    for record in sorted(campaign.records, key=lambda one: one.id):
        if record.exclude or record.id not in impacts:
            continue
        _flights(b, record, impacts[record.id], driven.get(record.id))
    _common_of_records(b)
    for k, name in enumerate(("f0", "zeta")):
        b.add(f"driven {name}", 0.0, median_of([one.misfit[k] for one in driven.values()]))
    tests = [r for r in sorted(campaign.records, key=lambda one: one.id) if not r.exclude]
    for level in {r.base_amplitude for r in tests if r.base_amplitude and r.id in driven}:
        own = [r for r in tests if r.base_amplitude == level and r.id in driven]
        b.usual[level] = sum(_picked_up(b, r, driven[r.id])[1] for r in own) / len(own)
    for record in tests:
        _base(b, record, found, driven.get(record.id))
    _without_laser(b, found)
    _in_releases(b, found)
    _clock(b, driven)
    _releases(b, found)
    _share_speed(b)
    _drops(b, found)
    names = tuple(b.priors)
    return Observed(
        names, Beliefs(b.priors), tuple(b.blocks), np.array([b.start[name] for name in names]),
        b.balls, b.clearances, b.levels, b.loads, b.releases, b.gains, b.collisions,
        tuple(record.id for record in campaign.records), b.kinds, b.law, b.cells,
        b.fixed, frozenset(e.records[0] for e in found if e.parameter == LOST),
    )  # fmt: skip


def _common_of_records(b: _Builder) -> None:
    """What all flights show alike: bends of the displacement, r that scatters to one side.

    A coupling turns the phase, and moves no bend; contacts and filters bend it a little before or
    after their middle, in all records.
    """
    width = _OF_PULSE * median_of([pulse for c in b.collisions.values() if (pulse := _pulse_of(c))])
    couplings = b.kinds.get("coupling", {})
    late_of = {id: sums[LOCALS.index("late")][0] for (id, _), sums in b.sums.items()}
    for id, seen in b.bends.items():  # once, of however many balls
        if id in late_of:
            late = {name: share for name, share in late_of[id].items() if name not in couplings}
            late[b.add("bends", 0.0, width)] = 1.0
            b.blocks.append(Block(id, "bends", ((late, 0.0),), _Single(*seen)))
    half = 0.5 * median_of([c.one_sided for c in b.collisions.values()])
    b.add("one-sided", half, abs(half))


@dataclass(frozen=True)
class _Single:
    """One local quantity that was observed with a normal error."""

    value: float
    error: float

    def __call__(self, p: FloatArray) -> Local:
        rest, w = self.value - float(p[0]), self.error**-2
        return np.array([[w]]), np.array([w * rest]), -0.5 * w * rest * rest


def _rig(b: _Builder, found: Sequence[Estimate], driven: Mapping[str, DrivenMotion]) -> None:
    known = b.campaign.known
    inputs = known.uncertainties
    alone = {
        name: [e for e in found if e.parameter == name and e.method in COUNTED]
        for name in ("f0", "zeta", "f0_added", "zeta_added")
    }
    for name in ("f0", "zeta"):
        values = [e.value for e in alone[name]] or [e.value for e in alone[f"{name}_added"]]
        moved = [d.oscillator[name] for d in driven.values()]
        moved += [e.value for e in found if e.parameter == IN_RELEASE[name]]
        values = [v for v in values or moved if v > 0.0]
        if values:
            start = math.log(float(np.median(values)))
            b.add(f"ln_{name}", start, _WIDE)
            b.add(f"amplitude {name}", 0.0, 0.0)
    for term, width in zip(TERMS.values(), WIDTHS, strict=True):
        b.add(term, 0.0, width if term in b.law.free else 0.0)
    b.add("clock", 0.0, inputs.clock.of(1.0))
    if known.mass is not None:
        _weighed(b, "ln_M", known.mass, inputs.mass, value=math.log(known.mass.value))
    else:
        balls = [mass.value for mass in known.nes_mass]
        b.add("ln_M", *_ORDINARY_M, start=math.log(100.0 * balls[0]) if balls else None)
    b.add("load scale", 0.0, 0.0)


def _ball(b: _Builder, number: int) -> tuple[str, float]:
    """Name of ln(m/stated) of a ball, and the stated mass, kg (1 kg where it was not weighed)."""
    masses = b.campaign.known.nes_mass
    inputs = b.campaign.known.uncertainties
    if not masses:
        b.balls[number] = b.add("ln_m", 0.0, _WIDE)
        return b.balls[number], 1.0
    place = min(number, len(masses)) - 1
    of = "" if len(masses) == 1 else str(place + 1)
    b.balls[number] = _weighed(b, "ln_m", masses[place], inputs.nes_mass, of=of)
    return b.balls[number], masses[place].value


def _weighed(
    b: _Builder, kind: str, mass: Quantity, scales: Tolerance, *, value: float = 0.0, of: str = ""
) -> str:
    """Name of the logarithm of a mass that was weighed; an error beside it is in its unit."""
    error = mass.std_error or scales.of(mass.value)
    name = b.add(kind, value, error / mass.value, of=of)
    if error == scales.of(mass.value):
        b.fixed[name] = scales.absolute / mass.value
    return name


def _decays(b: _Builder, found: Sequence[Estimate]) -> None:
    """f0 and zeta of each decay or sweep, with its mounting and its added mass."""
    if "ln_f0" not in b.priors:
        return
    inputs = b.campaign.known.uncertainties
    records = {record.id: record for record in b.campaign.records}
    decaying = {e.records[0] for e in found if e.parameter in ("f0", "f0_added")}
    masses = [records[id].added_mass or 0.0 for id in decaying]
    drifts = {e.records[0]: e.value for e in found if e.parameter == "f0_drift"}
    drift = median_of(list(drifts.values()))
    for kind in ("f0", "zeta"):
        own = [
            e for e in found
            if e.parameter in (kind, f"{kind}_added") and e.method in COUNTED and e.value > 0.0
        ]  # fmt: skip
        mount = inputs.remounting if kind == "f0" else inputs.damping
        for e in own:
            record = records[e.records[0]]
            load = record.added_mass or 0.0
            amplitude, values, covariance = _over_amplitude(e, b.law, mount.of(1.0))
            sums = [
                {f"ln_{kind}": 1.0, f"amplitude {kind}": 1.0,
                 b.add(f"mounting {kind}", 0.0, mount.of(1.0), of=f"{1e3 * load:g} g"): 1.0,
                 b.own(f"own {kind}", record, 0.0): 1.0},
                {"ln_M": 1.0},
                {"load scale": 1.0},
                {b.add("aboard", 0.0, 0.0): 1.0},
            ]  # fmt: skip
            if kind == "f0":
                sums[0]["clock"] = -1.0
                if record.id in drifts:  # the tests may be at any time of it
                    sums[0][b.add("drift f0", 0.0, _OF_DRIFT)] = drift
            if record.id in b.follows:  # freed of all of it, as of a base that yields
                per = 0.5 if kind == "f0" else -0.5j / math.exp(b.start["ln_zeta"])
                sums[0] |= b.crosstalk(record, per)
            if load:
                b.loads[load] = b.add(
                    "load", 0.0, inputs.added_mass.of(load), of=f"{1e3 * load:g} g"
                )
                sums[-1][b.loads[load]] = 1.0
            if any(masses) and masses.count(load) > 1:
                b.cells[record.id] = b.own("own load", record, 0.0), load
                sums[-1][b.cells[record.id][0]] = 1.0
            sums += [
                {"ln_zeta": 1.0} if "ln_zeta" in b.priors else {},
                # a damper warms up: a decay alone tells it from no law over amplitude
                {b.add(f"course {kind}", 0.0, mount.of(1.0)): 1.0},
                *({term: 1.0} for term in TERMS.values()),
            ]
            inverse = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
            look = Decay(kind, values, inverse, load, amplitude, b.law)
            b.blocks.append(
                Block(record.id, "loaded" if load else "decay", tuple((s, 0.0) for s in sums), look)
            )


def _over_amplitude(
    e: Estimate, law: Law, mounting: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Amplitudes, ln f0 or ln zeta there, and their covariance, as one record shows them.

    `mounting` is what a mounting scatters by: of zeta it may change the viscous part alone, or all.
    """
    if e.data is None or not law.free or min(e.data["value"]) <= 0.0:
        e = law.moved(e)
        own = max(e.std_error / e.value, _TINY)
        return np.array([law.amplitude]), np.array([math.log(e.value)]), np.array([[own**2]])
    A, value = np.array(e.data["amplitude"]), np.array(e.data["value"])
    covariance = np.array(e.data["covariance"]) / np.outer(value, value) + _TINY**2 * np.eye(A.size)
    if e.parameter.startswith("zeta") and A.size > 1:
        share = mounting * law.viscous(A)
        covariance += np.outer(share, share)
    return A, np.log(value), covariance


@dataclass(frozen=True)
class Decay:
    """ln f or ln zeta of a decay at some amplitudes; f goes with (M + added)^-1/2."""

    name: str
    values: FloatArray
    information: FloatArray
    load: float
    amplitude: FloatArray
    law: Law

    def __call__(self, p: FloatArray) -> Local:
        unloaded, ln_M, ln_scale, error, ln_zeta, along = p[:6]
        # a wrong unit in the column leaves the error of the scales as it is
        scaled = self.load * math.exp(ln_scale - ln_M)
        share = max(scaled + error * math.exp(-ln_M), -0.9)
        powers = self.law.powers(self.amplitude, added=share)
        over = log_of(self.name, powers, p[6:], math.exp(ln_zeta)).real
        d = -0.5 / (1.0 + share)
        by_law = slopes_of(self.name, powers, p[6:], math.exp(ln_zeta))
        # the square of zeta itself is known far better than f0 needs it
        common = np.tile(
            [1.0, -d * share, d * scaled, d * math.exp(-ln_M), 0.0], (self.values.size, 1)
        )
        course = _course(self.amplitude)
        J = np.column_stack([common, course, by_law])
        rest = self.values - (unloaded - 0.5 * math.log1p(share) + along * course + over)
        weighted = J.T @ self.information
        return weighted @ J, weighted @ rest, -0.5 * float(rest @ self.information @ rest)


def _course(amplitude: FloatArray) -> FloatArray:
    """Time of a decay at some amplitudes, from -1 at the largest to 1 at the smallest."""
    log = np.log(amplitude)
    half = 0.5 * float(np.ptp(log))
    return np.asarray((0.5 * (log.max() + log.min()) - log) / half if half else 0.0 * log)


def _start_law(b: _Builder) -> None:
    """The law as the ring-downs alone show it, and what its range adds to f0 and zeta."""
    if not b.law.free:
        return
    names = tuple(b.priors)
    start = np.array([b.start[name] for name in names])
    data = fit(b.blocks, names, Beliefs(b.priors), start)
    at = dict(zip(names, data.at.tolist(), strict=True))
    b.start |= {term: at[term] for term in TERMS.values()}
    terms = np.array([at[term] for term in TERMS.values()])
    b.law = replace(b.law, terms=terms, zeta=math.exp(at.get("ln_zeta", -math.inf)))
    for name in ("f0", "zeta"):
        spread = b.law.spread(name, b.law.low, b.law.high)
        b.priors[f"amplitude {name}"] = Prior(0.0, max(spread, _TINY))


def _start_mass(b: _Builder, found: Sequence[Estimate]) -> None:
    """Where ln M starts: the line over added masses, else M by the impacts of single records."""
    own = [e for e in found if e.parameter in ("f0", "f0_added") and e.method in COUNTED]
    loads = {record.id: record.added_mass or 0.0 for record in b.campaign.records}
    loaded = np.array([loads.get(e.records[0], 0.0) for e in own])
    by_impacts = [e.value for e in found if e.parameter == "M" and e.method == "impacts"]
    if len(set(loaded.tolist())) > 1:
        slope, offset = np.polyfit(loaded, [1.0 / e.value**2 for e in own], 1)
        if slope > 0.0 and offset > 0.0:
            b.start["ln_M"] = math.log(offset / slope)
    elif by_impacts and b.campaign.known.mass is None:
        b.start["ln_M"] = math.log(float(np.median(by_impacts)))


def _start_tests(b: _Builder, driven: Mapping[str, DrivenMotion]) -> None:
    """Where f0 starts if the tests with a ball show another than the ring-downs: another mass.

    From the f0 of the ring-downs the phase of the base, which turns by a radian within zeta of
    resonance, leads to another solution.
    """
    shown = [w0 for one in driven.values() if (w0 := one.own_rate)]
    if not shown or "aboard" not in b.priors or not b.oscillator:
        return
    off = math.log(float(np.median(shown)) / (2.0 * math.pi)) - b.start["ln_f0"]
    if abs(off) > math.exp(b.start["ln_zeta"]):
        b.start["ln_f0"] += off
        b.start["aboard"] = math.exp(b.start["ln_M"]) * math.expm1(2.0 * off)


def _shared(record: Record, impacts: Impacts) -> float:
    """What the speeds of the mass at all impacts of a wall may be off by, over that of the ball.

    A motion that repeats meets the steps of a coarse converter at the same places.
    """
    off = impacts.v_shared_m_s[np.isfinite(impacts.v_shared_m_s)]
    if off.size < _FEWEST or not record.clearance:
        return 0.0
    flight = float(np.median(np.diff(impacts.time_s)))
    return float(np.median(off)) * flight / (2.0 * max(record.clearance))


def _flights(b: _Builder, record: Record, impacts: Impacts, driven: DrivenMotion | None) -> None:
    """Collisions of every ball of a record."""
    frequency = b.oscillates(record)
    period = 1.0 / frequency if frequency else math.inf
    several = len(record.clearance) > 1
    integrated = not b.has(record, "displacement")
    every = {}
    for number, stated in enumerate(record.clearance, start=1):
        flights = flights_of(impacts, nes=number, b=stated, period=period)
        whole = np.isfinite(flights.v_before + flights.v_previous + flights.v_next + flights.jump)
        every[number] = flights.keep(whole)
    seen = {number: one for number, one in every.items() if one.index.size >= _FEWEST}
    unseen = sum(_ball(b, number)[1] for number in every if seen and number not in seen)
    for number, flights in seen.items():
        stated = record.clearance[number - 1]
        if not several:
            b.rolls_from[record.id] = rolls_from(flights)
        stride = 2 * (flights.index.size // (2 * _ENOUGH)) + 1  # odd: both walls
        flights = flights.keep(np.arange(flights.index.size) % stride == 0)
        base = _base_at(b, flights, impacts, driven)
        omega2 = (2.0 * math.pi * frequency) ** 2
        collisions = collisions_of(flights, impacts, omega2=omega2, base=base)
        _group(b, record, impacts, collisions, number if several else 0, stated, integrated, unseen)


def _base_at(
    b: _Builder, flights: Flights, impacts: Impacts, driven: DrivenMotion | None
) -> FloatArray:
    """Displacement, m, and velocity, m/s, of the base at each impact, the one before, the next."""
    t = impacts.time_s[flights.index]
    when = np.stack([t, t - flights.time_before, t + flights.time_after])
    if driven is None or (base := _phasor(b, driven)) is None:
        return np.zeros((6, t.size))
    return np.concatenate(driven.at(base, when))


def _phasor(b: _Builder, driven: DrivenMotion) -> complex | None:
    """Of the base, m; None where no record shows f0 and zeta."""
    return driven.motion_of_base(**rig) if (rig := b.oscillator) else None


def _coupling(b: _Builder, record: Record) -> str:
    """Name of the corner, 1/s, of a displacement that is AC-coupled as the accelerometer is."""
    return b.add("coupling", 0.0, 0.0, of=record.setup)


def _beside(b: _Builder, record: Record) -> str:
    """Name of the share of the base that a displacement lacks: 1 of a sensor on the table."""
    return b.add("beside", 0.0, 0.0, of=record.setup)


def _lateness(
    b: _Builder, found: Sequence[Estimate], impacts: Mapping[str, Impacts]
) -> dict[str, tuple[float, float]]:
    """Lateness that is left in the displacement of each record, s, and its standard error.

    Each record was read later by the lag that it shows itself. Channels of one setup have one lag,
    and their accelerometer one corner or none, which all records together know better.
    """
    rows = {(e.parameter, e.records[0]): e for e in found if e.method == "channels"}
    left: dict[str, tuple[float, float]] = {}
    for setup in {record.setup for record in b.campaign.records}:
        among = [
            r for r in b.campaign.records
            if r.setup == setup and r.id in impacts and ("phase_lag", r.id) in rows
        ]  # fmt: skip
        if len(among) < _FEWEST_LAGS or not (frequency := max(map(b.oscillates, among))):
            continue
        hit = [record.id for record in among]
        lags = [rows["phase_lag", id] for id in hit]
        lag, error = weighted_mean([e.value for e in lags], [max(e.std_error, _LATE) for e in lags])
        corners = [e for id in hit if (e := rows.get(("accelerometer_corner", id)))]
        if corners:
            corner, corner_error = weighted_mean(
                [e.value for e in corners], [e.std_error for e in corners]
            )
            lead, lead_error = expected_lead(corner, corner_error, frequency=frequency)
            lag, error = lag - lead, math.hypot(error, lead_error)
        read = {id: float(impacts[id].read_later_s[0]) for id in hit if impacts[id].n}
        left |= {id: (lag - later, error) for id, later in read.items()}
    return left


def _bends(b: _Builder, impacts: Mapping[str, Impacts]) -> dict[str, tuple[float, float]]:
    """Lateness of each displacement beside an acceleration as its bends show it, s; its error."""
    both = [
        record.id for record in b.campaign.records
        if b.has(record, "displacement") and b.has(record, "acceleration")
    ]  # fmt: skip
    tables = {id: impacts[id] for id in both if id in impacts}
    found = {id: typical_lateness(one.late_s, one.late_error_s) for id, one in tables.items()}
    return {id: seen for id, seen in found.items() if math.isfinite(seen[0])}


def _phases(b: _Builder, found: Sequence[Estimate]) -> dict[str, tuple[float, float]]:
    """The same of a displacement that is the integral of the acceleration.

    Its sensor's phase at the oscillation, and what it shows of the base across its axis, a quarter
    of a period away from the motion.
    """
    swings = {e.records[0]: e.value for e in found if e.parameter == "working_amplitude"}
    left = {}
    for e in found:
        if e.parameter != INTEGRATED:
            continue
        record = b.campaign.record(e.records[0])
        across = ACROSS * (record.base_amplitude or 0.0) / swings.get(record.id, math.inf)
        if frequency := b.oscillates(record):
            left[record.id] = 0.0, math.hypot(e.value, across) / (2.0 * math.pi * frequency)
    return left


def _group(
    b: _Builder, record: Record, impacts: Impacts, collisions: Collisions, number: int,
    stated: float, integrated: bool, unseen: float,
) -> None:  # fmt: skip
    """Collisions of one ball; of others, `unseen`, kg, nobody knows whether they hit with it."""
    flights = collisions.flights
    inputs = b.campaign.known.uncertainties
    suffix = f"_{number}" if number else ""
    r = b.add(f"r{suffix}", 0.6, _WIDE_R)
    ln_m, mass = _ball(b, max(number, 1))
    role = "acceleration" if integrated else "displacement"
    moved = b.own_gain(record, role)
    pulsed = b.has(record, "acceleration")
    both = pulsed and not integrated
    pulses = b.own_gain(record, "acceleration") if both else {b.gain(record, role): 1.0}
    jumps = {**pulses, _pulse_area(b): 1.0}
    reads = {b.add("jump reading", 0.0, _READING): 1.0}
    # Of what is stated one half of the variance is common to all clearances, one each one's own.
    u = inputs.clearance.of(stated) / math.sqrt(2.0)
    own = b.own("clearance", record, u, ball=number)
    b.clearances[record.id, number] = own, stated
    for name in EFFECTS:
        b.add(name, 0.0, 0.0)
    changing = {name: {b.own(f"own {name}", record, 0.0, ball=number): 1.0} for name in CHANGING}
    loose = b.loose(record)
    momentum = math.hypot(loose * _OWN_EPS, math.log1p(unseen / mass))
    lag, late = _late(b, record, collisions, both=both, integrated=integrated)
    local = {
        "r": {r: 1.0, "one-sided": -1.0,
              b.own("own r", record, loose * _OWN_R, ball=number): 1.0},
        "ln_eps": {ln_m: 1.0, "ln_M": -1.0,
                   b.own("own momentum", record, momentum, ball=number): 1.0},
        "g_x": moved, "g_a": jumps, "reading": reads,
        "share": {b.add("share", 0.0, _SHARE): 1.0},
        "late": late,
        "b": {b.add("clearance scale", 0.0, 0.0): stated,
              b.add("clearance offset", 0.0, u): 1.0, own: 1.0},
        **{name: {name: 1.0, **changing.get(name, {})} for name in EFFECTS},
        "spring": {b.add("spring", 0.0, _SPRING): 1.0},
    }  # fmt: skip
    if not integrated:  # of the displacement's own sensor
        bent = {name: {b.add(name, 0.0, 0.0): 1.0} for name in ("even", "odd")}
        local |= {**bent, "beside": {_beside(b, record): 1.0}}
    if both and record.more_files:
        half = 0.5 * float(np.ptp(impacts.time_s))
        other = b.add("second clock", 0.0, 0.0)
        local["drift"] = {b.own("drift", record, _DRIFT): 1.0, other: half}
    if pulsed:
        local |= _of_pulses(b, record, collisions, ball=number)
    begun = {"r": 0.6, "ln_eps": math.log(mass) - b.start["ln_M"], "late": lag, "b": stated}
    start = np.array([begun.get(name, 0.0) for name in LOCALS])
    start = b.near.get((record.id, number), start)
    error = float(np.median(impacts.time_error_s[flights.index]))
    collisions, b.alone[record.id, number] = with_own_errors(collisions, start, time_error=error)
    _own_sensors(b, record, impacts, collisions, jumps=jumps, reads=reads, ball=number)
    b.collisions[record.id, number] = collisions
    constants = {"ln_eps": math.log(mass), "b": stated}
    b.sums[record.id, number] = tuple(
        (local.get(name, {}), constants.get(name, 0.0)) for name in LOCALS
    )


def _own_sensors(
    b: _Builder, record: Record, impacts: Impacts, collisions: Collisions, *,
    jumps: dict[str, float], reads: dict[str, float], ball: int,
) -> None:  # fmt: skip
    """What the template and the response of one record have wrong, put into the sums of both."""
    flights = collisions.flights
    areas = np.abs(flights.jump_acceleration[np.isfinite(flights.jump_acceleration)])
    if areas.size >= _FEWEST:
        width = _of_template(areas, impacts.jump_acceleration_error_m_s[flights.index], collisions)
        jumps[b.own("own pulse", record, width, ball=ball)] = 1.0
    errors = impacts.jump_displacement_error_m_s[flights.index]
    shown = np.isfinite(flights.jump_displacement) & np.isfinite(errors)
    if shown.sum() >= _FEWEST:
        width = _of_response(np.abs(flights.jump_displacement[shown]), errors[shown], collisions)
        reads[b.own("own reading", record, width, ball=ball)] = 1.0


def _late(
    b: _Builder, record: Record, collisions: Collisions, *, both: bool, integrated: bool
) -> tuple[float, dict[str, float]]:
    """Lateness of the displacement, s, that is expected in a record, and it as a sum of unknowns.

    `both` channels show the impacts, or the displacement is the acceleration `integrated`. The
    phases of the channels are as unsure as the bends of the displacement contradict them.
    """
    lag, error = b.late.get(record.id, (0.0, _LATE))
    late = {b.add("late", 0.0, _LATE): 1.0}
    if both:  # pulses of all records are alike; but each record learns a template of its own
        centre = _OF_PULSE * _pulse_of(collisions)
        error = math.hypot(error, centre, b.contradicted(record, centre))
        late[b.add("centre", 0.0, centre)] = 1.0
    late[b.own("own late", record, error, value=lag)] = 1.0
    leads = record.test == "periodic" and not integrated
    return lag, late | ({_coupling(b, record): -1.0 / collisions.omega2} if leads else {})


def _pulse_of(collisions: Collisions) -> float:
    """How long a pulse lasts, s; 0 where none was believed."""
    pulse = collisions.flights.pulse
    return median_of(pulse[np.isfinite(pulse)])


def _of_pulses(
    b: _Builder, record: Record, collisions: Collisions, *, ball: int
) -> dict[str, dict[str, float]]:
    """How areas and times of pulses go with speed and wall, as sums of unknowns.

    Areas read too large by a power of the speed. A record learns one template for both walls, or
    one for each where it has to: by what pulses at one wall are timed later, s, and read larger
    than those at the other.
    """
    own = b.own("own pulse power", record, _OWN_PULSE_POWER)
    late = b.own("late wall", record, _OF_PULSE * _pulse_of(collisions), ball=ball)
    return {
        "pulse_power": {b.add("pulse power", 0.0, _PULSE_POWER): 1.0, own: 1.0},
        "late_wall": {late: 1.0},
        "pulse_wall": {b.own("pulse wall", record, _UNLIKE_PULSES, ball=ball): 1.0},
    }


def _of_template(areas: FloatArray, errors: FloatArray, c: Collisions) -> float:
    """What the areas of all pulses of a record may be off by alike: one template found them."""
    single, area = float(c.scatter[2]), float(np.median(areas))
    stated = float(np.nanmedian(errors))
    template = math.sqrt(max(stated**2 - single**2, 0.0)) / area  # what is no noise of one
    noise = _PULSE * single / area / math.sqrt(areas.size)
    return math.hypot(noise, max(template, _TEMPLATE))


def _of_response(jumps: FloatArray, errors: FloatArray, c: Collisions) -> float:
    """What all jumps by the displacement may be off by alike: one response to a jump found them.

    Each has its part of it in its error, so that their mean has it whole.
    """
    shared = float(np.median(errors)) ** 2 - float(c.scatter[1]) ** 2
    return math.sqrt(max(shared, 0.0) / jumps.size) / float(np.median(jumps))


def _share_speed(b: _Builder) -> None:
    """Blocks of the flights; r that depends on speed is that at one speed for all records."""
    if not b.collisions:
        return
    speed = float(np.median([c.speed for c in b.collisions.values()]))
    for key, own in b.collisions.items():
        b.collisions[key] = replace(own, speed=speed)
        look = b.collisions[key].look
        factor = _misfit(b.collisions[key], b.alone[key])
        means = int(np.isfinite(own.sigma).sum())
        tempered = Tempered(look, factor)
        b.blocks.append(Block(key[0], "flights", b.sums[key], tempered, means, _BENDS))


#: Information about the local quantities of a record on its own.
_FREE = np.diag(np.array([*FREE.values()]) ** -2)
#: Changes of them up to which flights are as good as straight.
_BENDS = 0.1 * np.array([*FREE.values()])


def _misfit(collisions: Collisions, near: FloatArray) -> float:
    """Mean square of what no ball, contact or sensor explains in a record, of its stated errors.

    A record on its own, its local quantities about `near` as free as any lab could have them: what
    is left is noise that the errors of its means do not hold, and its information is worth as much
    less.
    """
    information, gradient, value = collisions.look(near)
    H = information + _FREE
    # near the best of them: what one more step would gain
    value += 0.5 * float(gradient @ np.linalg.solve(H, gradient))
    held = np.trace(np.linalg.solve(H, information))
    freedom = np.isfinite(collisions.sigma).sum() - held
    return max(1.0, float((_WORTH - 2.0 * value) / (_WORTH + freedom)))


def with_own_errors(
    collisions: Collisions, start: FloatArray, *, time_error: float
) -> tuple[Collisions, FloatArray]:
    """Collisions with the errors that they show at their own r, momentum and effects, and these.

    At another r the bounces of a modulated motion, whose speeds differ, would scatter by that; and
    where a ball rolls, those that are not alike would stand out, and the rest fit something else.
    """
    start = start.copy()
    start[LOCALS.index("r")] = bounced(collisions, start[:, np.newaxis])[0][0]
    at = start
    for _ in range(_ROUGHLY):
        at = near_singles(collisions, at, about=start, prior=_FREE)
    near = with_errors(collisions, at, time_error=time_error)
    for _ in range(_CLOSELY):
        information, gradient, _ = near.look(at)
        at = at + np.linalg.solve(information + _FREE, gradient + _FREE @ (start - at))
    found = with_errors(near, at, time_error=time_error, plain=start)
    return without_chance(found, at), at


#: Steps of a fit of a record on its own, its local quantities as free as in any lab: to single
#: collisions, and to means over those alike. Where the last step would still lead, their scatter
#: does not change.
_ROUGHLY, _CLOSELY = 3, 3


def collisions_of(
    flights: Flights, impacts: Impacts, *, omega2: float, base: FloatArray
) -> Collisions:
    """Collisions of the flights of one ball; their errors are rough until `with_errors`."""
    x = impacts.x_m[flights.index]
    # u = (x - side b - (x_before + side b))/T: what is left of it is the way of the mass
    way = 2.0 * flights.side * flights.clearance
    before = x - (flights.u_before * flights.time_before + way)
    after = x + flights.u_after * flights.time_after - way
    # walls take turns: this is where the mass rests, wherever the sensor has its zero; that of an
    # integrated velocity, whose mean was left out, drifts by as much as the mass moves
    rest = _line(impacts.time_s[flights.index], 0.25 * (before + 2.0 * x + after))
    x, before, after = x - rest, before - rest, after - rest
    jump = flights.jump_acceleration
    both = np.isfinite(jump) & np.isfinite(flights.jump)
    sign = np.sign((jump[both] * flights.jump[both]).sum()) or 1.0
    flights = replace(flights, jump_acceleration=sign * jump)
    speed = flights.speed
    nothing = ~np.isfinite(flights.jump_displacement) & ~np.isfinite(jump)
    by_laser = np.where(nothing, flights.jump, flights.jump_displacement)
    flights = replace(flights, jump_displacement=by_laser)
    known = np.stack([np.isfinite(flights.jump), np.isfinite(by_laser), np.isfinite(jump)])
    # nobody knows with which spin the ball began the first flight of a row
    if (usual := joined(flights)).sum() >= max(_FEWEST, 0.5 * x.size):
        known[0] &= usual
    none = np.zeros((0, x.size))
    first, last = impacts.time_s[[0, -1]]
    course = (2.0 * impacts.time_s[flights.index] - first - last) / (last - first)
    return Collisions(
        flights, x, before, after, omega2, base, course, float(np.median(speed)), known, np.ones(3),
        (none, none, none), np.zeros((3, 0)),
    )  # fmt: skip


def _line(t: FloatArray, y: FloatArray) -> FloatArray:
    """Values at `t` of the line whose slope is the median of all slopes from point to point."""
    i, k = np.triu_indices(t.size, 1)
    slope = float(np.median((y[k] - y[i]) / (t[k] - t[i])))
    return np.asarray(slope * t + np.median(y - slope * t))


def _pulse_area(b: _Builder) -> str:
    """Name of the logarithm by which areas of pulses read too large."""
    return b.add("pulse area", 0.0, b.campaign.known.uncertainties.template.of(1.0))


def _sensors(b: _Builder, found: Sequence[Estimate], driven: Mapping[str, DrivenMotion]) -> None:
    """Accelerometer beside the laser over the oscillation: ratio of their gains.

    A part of this acceleration is the pulses of impacts, whose areas may read too large.

    A motion across the sensor's axis has a part in phase too, about as large as what turns the
    phase: a gain of another test, with other motion across, may differ by as much, whether that
    test shows it by its phase or not. So may ring-downs and driven tests, which have other motions
    across: nobody knows which of them shows the gain. What turns the phase from the lateness that
    bends show, such as tails of pulses, changes the gain by as much.
    """
    across = _apart(b, found)
    for e in found:
        if e.parameter == "accelerometer_across":
            setup = b.campaign.record(e.records[0]).setup
            across[setup] = max(across.get(setup, 0.0), abs(e.value))
    shares = {e.records[0]: e.value for e in found if e.parameter == "pulse_share"}
    for e in found:
        if e.parameter != "accelerometer_gain" or not e.records:
            continue
        record = b.campaign.record(e.records[0])
        if record.exclude or not record.clearance or not e.value:
            continue
        displaced = {name: -factor for name, factor in b.own_gain(record, "displacement").items()}
        area = {_pulse_area(b): shares[record.id]} if record.id in shares else {}
        lacks = {}
        if (moved := driven.get(record.id)) and (base := _phasor(b, moved)) is not None:
            lacks = {_beside(b, record): (base / complex(*moved.swing)).real}
        sums = ({**b.own_gain(record, "acceleration"), **displaced, **area, **lacks}, 0.0)
        turned = 2.0 * math.pi * b.oscillates(record) * b.contradicted(record)
        error = max(e.std_error / abs(e.value), _CHANNELS, across.get(record.setup, 0.0), turned)
        b.blocks.append(
            Block(record.id, "channels", (sums,), _Single(math.log(abs(e.value)), error))
        )


def _apart(b: _Builder, found: Sequence[Estimate]) -> dict[str, float]:
    """Setup to the difference between the gains of its ring-downs and of its driven tests."""
    gains: dict[tuple[str, str], list[float]] = {}
    for e in found:
        if e.parameter == "accelerometer_gain" and e.records and e.value:
            record = b.campaign.record(e.records[0])
            gains.setdefault((record.setup, record.test), []).append(math.log(abs(e.value)))
    middle = {key: float(np.median(own)) for key, own in gains.items()}
    return {
        setup: apart
        for (setup, test), driven in middle.items()
        if test == "periodic"
        and (apart := abs(driven - middle.get((setup, "ringdown"), driven))) < _MOST_ACROSS
    }


def _base(
    b: _Builder, record: Record, found: Sequence[Estimate], driven: DrivenMotion | None
) -> None:
    """Base amplitude of a periodic record: test log, base channel, what the mass answers to."""
    if record.test != "periodic" or not record.base_amplitude:
        return
    level = record.base_amplitude
    inputs = b.campaign.known.uncertainties
    stated = _WIDE if record.shown else inputs.base_amplitude.of(level) / level
    b.levels[level] = b.add("base", 0.0, stated, of=f"{1e3 * level:g} mm")
    if not record.shown:
        b.fixed[b.levels[level]] = inputs.base_amplitude.absolute / level
    here = {b.levels[level]: 1.0}
    picked, per = _picked_up(b, record, driven)
    for e in found:
        if e.parameter == "base_seen" and e.records == (record.id,) and e.value > 0.0:
            half = inputs.base_amplitude.of(level) / level / math.sqrt(2.0)
            differs = math.hypot(_OWN_BASE, half)
            seen = math.log(e.value / level)
            error = max(e.std_error / e.value, 1e-5)
            sums = ({**here, b.gain(record, "base"): 1.0, **b.crosstalk(record, per),
                     **b.yields(record, per), b.own("own base gain", record, 0.0): 1.0,
                     b.own("own base", record, differs): 1.0}, picked.real)  # fmt: skip
            b.blocks.append(Block(record.id, "base channel", (sums,), _Single(seen, error)))
    if driven is None or not (rig := b.oscillator):
        return
    value, error, phase = driven.base(**rig)
    if not value > 4.0 * error:
        return
    local = _answered(b, record, found, driven, here, level=level, phase=phase)
    known = b.rolls_from.get(record.id, np.zeros(0))
    rolls = np.append(known, np.zeros(max(driven.flights - known.size, 0)))
    b.blocks.append(Block(record.id, "base", local, _Answer(driven, _share_of_ball(b), rolls)))


def _answered(
    b: _Builder, record: Record, found: Sequence[Estimate], driven: DrivenMotion,
    base: Mapping[str, float], *, level: float, phase: float,
) -> tuple[Sum, ...]:  # fmt: skip
    """The local quantities of `_Answer` in one test.

    `base` is the unknown of its level, m; `phase` that of the base, rad, with f0 and zeta as known.
    """
    inputs = b.campaign.known.uncertainties
    f0, zeta = b.oscillator.values()
    swing, of, at = _at_swing(b, record, found)
    # what a straight spring and damper do not follow, as a share of the force of the spring
    bent = 2.0 * math.hypot(of["f0"].half, of["zeta"].half * zeta)
    swing = swing or level
    turned, inverted, per = _turned(b, record, found, driven, phase)
    # a ball that rolls is inertia that the mass takes along; one that rubs pulls at it
    eps = _share_of_ball(b)
    drive = (2.0 * math.pi * f0) ** 2 * level
    off = 2.0 * bent * swing / level  # the same of what drives the mass, in any phase
    push = math.hypot(_OWN_PUSH, off)
    turned[b.own("bent phase", record, off)] = 1.0
    inertia = _inertia(f0, zeta, driven.rate)
    turned[_beside(b, record)] = inertia.imag
    for name in ("friction", "rolling", "drag", "viscous"):
        b.add(name, 0.0, 0.0)
    speed = 4.0 * f0 * record.clearance[0] if record.clearance else 0.0  # from wall to wall
    rubs = {"friction": 1.0, b.own("own friction", record, 0.0): 1.0}
    return (
        ({"ln_f0": 1.0, "clock": -1.0, **at["f0"],
          b.add("mounting f0", 0.0, inputs.remounting.of(1.0), of=_place(record)): 1.0,
          b.own("own f0", record, math.hypot(_OWN_F0, bent)): 1.0,
          "driven f0": 1.0, "rolling": -0.5 * eps}, of["f0"].constant),
        ({"ln_zeta": 1.0, **at["zeta"],
          b.add("mounting zeta", 0.0, inputs.damping.of(1.0), of=_place(record)): 1.0,
          b.own("own zeta", record, math.hypot(_OWN_ZETA, bent / zeta)): 1.0,
          "driven zeta": 1.0, "rolling": -0.5 * eps}, of["zeta"].constant),
        ({**base, **b.yields(record, per), **b.own_gain(record, "displacement"),
          _beside(b, record): inertia.real,
          b.own("own base", record, _OWN_BASE): 1.0,
          b.add("drift base", 0.0, _OF_BASE_DRIFT): driven.drift,
          b.own("bent", record, math.hypot(_CHANNELS, off)): 1.0},
         math.log(level)),
        (turned, inverted),
        ({"drag": eps * speed**2, "viscous": eps * speed,
          b.own("own push", record, push * drive): 1.0}, 0.0),
        ({_coupling(b, record): 1.0, b.own("own coupling", record, 0.0): 1.0}, 0.0),
        (rubs, 0.0),
    )  # fmt: skip


def _place(record: Record) -> str:
    """Setting a clearance takes the cavity apart: it is a mounting of its own."""
    return "b = " + ", ".join(f"{1e3 * length:g}" for length in record.clearance) + " mm"


def _at_swing(
    b: _Builder, record: Record, found: Sequence[Estimate]
) -> tuple[float | None, dict[str, OfTest], dict[str, dict[str, float]]]:
    """Amplitude of a test, m, f0 and zeta at it by the law over amplitude, and these as sums."""
    working = (e for e in found if e.parameter == "working_amplitude")
    swing = next((e.value for e in working if e.records[0] == record.id), None)
    of = {name: b.law.of_test(name, swing or b.law.amplitude) for name in ("f0", "zeta")}
    return swing, of, {
        name: {
            b.own(f"amplitude {name}", record, own.error): 1.0,
            b.add(f"increment {name}", 0.0, 1.0): own.half,
            **dict(zip(TERMS.values(), own.slopes.tolist(), strict=True)),
        }
        for name, own in of.items()
    }  # fmt: skip


def _without_laser(b: _Builder, found: Sequence[Estimate]) -> None:
    """f0 in tests whose displacement is the integral of the acceleration.

    What drives the mass is known by the pulses and the base, each with its gain.
    """
    for e in found:
        if e.parameter != F0_INTEGRATED or e.data is None or "ln_f0" not in b.priors:
            continue
        record, by = b.campaign.record(e.records[0]), e.data["by_area"]
        _, of, at = _at_swing(b, record, found)
        bent = 2.0 * of["f0"].half
        remounted = b.campaign.known.uncertainties.remounting.of(1.0)
        gains = {**b.own_gain(record, "acceleration"), _pulse_area(b): 1.0}
        sums = {
            "ln_f0": 1.0, "clock": -1.0, **at["f0"],
            b.add("mounting f0", 0.0, remounted, of=_place(record)): 1.0,
            b.own("own f0", record, math.hypot(_OWN_F0, bent)): 1.0,
            "driven f0": 1.0, b.add("rolling", 0.0, 0.0): -0.5 * _share_of_ball(b),
            b.gain(record, "base"): -by,
            # beside the acceleration: a laser in other records has a delay of its own
            b.add("base late", 0.0, _BASE_LATE, of=f"{record.setup} acceleration".strip()):
                e.data["by_late"],
            **{name: by * one for name, one in gains.items()},
        }  # fmt: skip
        error = math.hypot(e.std_error / e.value, _F0_INTEGRATED)
        own = ((sums, of["f0"].constant),)
        b.blocks.append(Block(record.id, "base", own, _Single(math.log(e.value), error)))


def _in_releases(b: _Builder, found: Sequence[Estimate]) -> None:
    """f0 and zeta of releases by the motion between impacts, each with a mounting of its own.

    What a base that yields makes of them the ring-downs say, or nothing does.
    """
    inputs = b.campaign.known.uncertainties
    mounts = {"f0": (inputs.remounting, _OWN_F0), "zeta": (inputs.damping, _OWN_ZETA)}
    for name, (mount, least) in mounts.items():
        for e in found:
            if e.parameter != IN_RELEASE[name] or f"ln_{name}" not in b.priors:
                continue
            record = b.campaign.record(e.records[0])
            of = b.law.of_test(name, e.amplitude or b.law.amplitude)
            per = 0.5 if name == "f0" else 0.5 / math.exp(b.start["ln_zeta"])
            own = math.hypot(least, per * abs(b.followed(record)), _OVER_RELEASE * of.error)
            sums = {
                f"ln_{name}": 1.0, **dict(zip(TERMS.values(), of.slopes.tolist(), strict=True)),
                b.add(f"mounting {name}", 0.0, mount.of(1.0), of=_place(record)): 1.0,
                b.own(f"own {name}", record, own): 1.0,
                b.add("rolling", 0.0, 0.0): -0.5 * _share_of_ball(b),
            }  # fmt: skip
            if name == "f0":
                sums["clock"] = -1.0
            look = _Single(math.log(e.value), max(e.std_error / e.value, _TINY))
            b.blocks.append(Block(record.id, "release", ((sums, of.constant),), look))


def _turned(
    b: _Builder, record: Record, found: Sequence[Estimate], driven: DrivenMotion, phase: float
) -> tuple[dict[str, float], float, complex]:
    """Phase of the base beside its channel, rad, as unknowns and a constant; `_picked_up`'s slope.

    Without a channel nothing is known of it: `phase` is where it begins.
    """
    picked, per = _picked_up(b, record, driven)
    if not driven.recorded:
        return {b.own("base phase", record, _WIDE, value=phase): 1.0}, 0.0, per
    # the base may be recorded with the displacement, or with a sensor that it is late beside
    lags = [e.value for e in found if e.parameter == "channel_lag"]
    late = b.add("base late", 0.0, math.hypot(_BASE_LATE, median_of(lags)), of=record.setup)
    turned = {
        late: driven.rate, b.own("own base late", record, 0.0): driven.rate,
        **b.crosstalk(record, 1j * per),
    }  # fmt: skip
    return turned, (math.pi if math.cos(phase) < 0.0 else 0.0) - picked.imag, per


def _picked_up(b: _Builder, record: Record, driven: DrivenMotion | None) -> tuple[complex, complex]:
    """Logarithm of what the base's channel shows over the base, and its derivative by what share
    of the mass's motion it picks up.

    No base feeds the decay of a mass: what would is picked up. 0 where the motion was not held
    beside that channel.
    """
    if driven is None or not driven.recorded or not (seen := b.followed(record)):
        return 0j, 0j
    per = complex(*driven.swing) / driven.scale
    left = 1.0 - 1j * max(seen.imag, 0.0) * per
    return -cmath.log(left), per / left


def _inertia(f0: float, zeta: float, rate: float) -> complex:
    """Logarithm of what drives a mass that is seen from the table over what drives it in space.

    From the table it is the inertia of the base, w^2 x_e; in space its spring and damper,
    (w0^2 + 2 i zeta w0 w) x_e.
    """
    w0 = 2.0 * math.pi * f0
    return cmath.log(rate**2 / complex(w0 * w0, 2.0 * zeta * w0 * rate))


def _share_of_ball(b: _Builder) -> float:
    """m/M of the first ball, about; 0 where it was not weighed: nobody knows what it adds."""
    masses = b.campaign.known.nes_mass
    return masses[0].value / math.exp(b.start["ln_M"]) if masses else 0.0


@dataclass(frozen=True)
class _Answer:
    """The mass answers the base: local ln f0, ln zeta, base, phase, push, corner, friction.

    A ball of mass `eps` times M that slides from wall to wall pulls it along. Where the friction is
    more than it `rolls_from`, m/s^2, a ball rolls in a part of its flight, and one that returns to
    the wall it left slides both ways (0): there the friction pulls by no more, nobody knows where.
    """

    driven: DrivenMotion
    eps: float
    rolls_from: FloatArray

    def __call__(self, p: FloatArray) -> Local:
        rub, information = p[6], self.driven.information
        slides = float((rub < self.rolls_from).mean())
        along = float(np.minimum(rub, self.rolls_from).mean())
        model, J = self.driven.driven(np.append(p[:4], p[4] + self.eps * along))
        by_corner = self.driven.by_coupling(model)
        rest = self.driven.values + by_corner * p[5] - model
        J[:, 0] -= 2.0 * model[0] * p[5] * self.driven.by_corner[1]
        J[0, :2] += model[1] * p[5]
        spread = 0.0  # of the density of what is known less well
        if (force := self.eps * (rub - along)) > 0.0:
            share = 0.5 * force / (self.driven.rate**2 * math.hypot(*self.driven.swing))
            S = J * np.array([share, share * math.exp(-p[1]), 0.0, 0.0, force])
            weight = information @ S
            inner = np.eye(5) + S.T @ weight
            information = information - weight @ np.linalg.solve(inner, weight.T)
            spread = float(np.linalg.slogdet(inner)[1])
        J = np.column_stack([J, -by_corner, J[:, 4] * self.eps * slides])
        weighted = J.T @ information
        value = float(rest @ information @ rest) + spread
        return weighted @ J, weighted @ rest, -0.5 * value


def _clock(b: _Builder, driven: Mapping[str, DrivenMotion]) -> None:
    """The frequencies of the base beside those of the test log: one clock beside another.

    Whether recorder or generator is off, no record tells. Each row is rounded to its digits.
    """
    off, rounded = [], []
    for record in b.campaign.records:
        motion, f = driven.get(record.id), record.frequency
        if record.exclude or motion is None or f is None or f[0] != f[1]:
            continue
        off.append(math.log(motion.rate / (2.0 * math.pi * f[0])))
        rounded.append(last_digit(f[0]) / math.sqrt(12.0) / f[0])
    if len(off) < _FEWEST_LAGS:
        return
    middle = float(np.median(off))
    scatter = float(np.median(np.abs(np.array(off) - middle)))
    error = math.hypot(float(np.median(rounded)), scatter, _SAME_RATE)
    names = {b.add("generator", 0.0, _GENERATOR): 1.0, "clock": -1.0}
    b.blocks.append(Block("", "clock", ((names, 0.0),), _Single(middle, error)))


def _releases(b: _Builder, found: Sequence[Estimate]) -> None:
    """Displacement from which the mass was let go: stated, and as the record shows it.

    Of the stated error one half is common to all releases of one stop, one half of each by hand. A
    record that begins with a smaller swing than stated may have begun later: the release may be
    either, and is as unsure as they differ.
    """
    seen = {e.records[0]: e for e in found if e.parameter == "release_seen"}
    error = b.campaign.known.uncertainties.release
    for record in b.campaign.records:
        if record.exclude or record.test != "transient" or not record.release:
            continue
        stated = abs(record.release)
        half = error.of(stated) / stated / math.sqrt(2.0)
        common = _WIDE if record.shown else half
        name = b.add("release", 0.0, common, of=f"{1e3 * stated:g} mm")
        own = b.own("own release", record, max(half, _OWN_RELEASE))
        b.releases[stated], b.fixed[name] = name, error.absolute / stated
        if (e := seen.get(record.id)) is None or not e.value:
            continue
        off, width = math.log(abs(e.value) / stated), e.std_error / abs(e.value)
        if begins_later(e, b.campaign):
            b.priors[name] = replace(b.priors[name], error=max(b.priors[name].error, -off))
            continue
        bend = {b.add("even", 0.0, 0.0): e.value, b.add("odd", 0.0, 0.0): e.value**2}
        sums = ({name: 1.0, **b.own_gain(record, "displacement"), own: 1.0, **bend}, 0.0)
        b.blocks.append(Block(record.id, "release", (sums,), _Single(off, width)))


def begins_later(seen: Estimate, campaign: Campaign) -> bool:
    """Whether a release is seen to begin with a smaller swing than stated, not held before.

    The record begins later, or release_mm is wrong: nobody can tell.
    """
    stated = abs(campaign.record(seen.records[0]).release or 0.0)
    error = campaign.known.uncertainties
    width = math.hypot(seen.std_error, error.release.of(stated), error.displacement.of(stated))
    return seen.method == FIRST_SWING and abs(seen.value) < stated - LIKELY * width


def _drops(b: _Builder, found: Sequence[Estimate]) -> None:
    """r of drop tests: the ball's own, at their speeds, if the ball met walls elsewhere or not.

    Drops that differ by more than their errors are as unsure as they differ, and a few bounces that
    are alike as unsure as r differs from impact to impact between the walls.
    """
    drops = [e for e in found if e.parameter == "r" and e.method == "drop"]
    model = b.campaign.known.uncertainties.model.of(1.0)
    unlike = median_of([c.flights.unlike for c in b.collisions.values()])
    counts = [len(e.data["speeds"]) if e.data else math.inf for e in drops]
    least = [
        max(e.std_error, unlike * (1.0 + e.value) / math.sqrt(count), 1e-6)
        for e, count in zip(drops, counts, strict=True)
    ]
    errors = with_scatter([e.value for e in drops], least)
    for e, error in zip(drops, errors, strict=True):
        name = b.add("r", 0.6, _WIDE_R)
        off = b.add("drop", 0.0, model * e.value)
        terms = {name: 1.0, off: 1.0, **_at_speeds(b, e)}
        b.blocks.append(
            Block(e.records[0], "drop", ((terms, 0.0),), _Single(e.value, float(error)))
        )


def _at_speeds(b: _Builder, drop: Estimate) -> dict[str, float]:
    """By what r of a drop differs from that at the usual speed of the tests, as a sum."""
    if not (b.collisions and drop.data):
        return {}
    usual = next(iter(b.collisions.values())).speed
    faster = np.array(drop.data["speeds"]) / usual
    slope, fade = (b.add(name, 0.0, 0.0) for name in ("slope", "fade"))
    return {
        slope: usual * float(faster.mean() - 1.0),
        fade: usual * float(np.log(np.maximum(faster, SLOWEST)).mean()),
    }
