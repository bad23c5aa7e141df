"""Impacts of a record: when, which ball, which wall, how hard. One table a record.

Time and jump come from the acceleration, jump and place also from the displacement; the two
jumps are combined by their variances. Nothing here knows the masses.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from itertools import combinations, product
from operator import attrgetter
from pathlib import Path

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray, IntArray, each_array
from vinesexp.records.stored.store import RecordView, open_record
from vinesexp.settings.stages import ChannelSettings, ImpactSettings, Settings
from vinesexp.signals.channel_agreement import Agreement, agreement_in
from vinesexp.signals.clipping import range_in, read_unstuck, resolution_in
from vinesexp.signals.free_from import freed
from vinesexp.signals.impacts.bends import detect_bends, without_steady
from vinesexp.signals.impacts.candidates import Stream
from vinesexp.signals.impacts.detection import Detection, detection_at
from vinesexp.signals.impacts.detectors import detect
from vinesexp.signals.impacts.from_integral import may_be_integrated, slopes_of_integral
from vinesexp.signals.impacts.impact_table import (
    Impacts,
    no_impacts,
    typical_lateness,
    write_impacts,
)
from vinesexp.signals.impacts.one_ball import of_the_ball
from vinesexp.signals.impacts.onsets import detect_onsets, ring_time
from vinesexp.signals.impacts.slopes import (
    POINTS,
    Coarse,
    SlopeChanges,
    coarse_displacement,
    joined,
    nearer,
    slope_changes,
    unmoved,
    weighted,
)
from vinesexp.signals.means import group_size, missing_means
from vinesexp.units import LIKELY, SIGNIFICANT, SURE, first_of

_AS_BY_DEFAULT = Settings()
_ONE_KNOCK, _SHOWN = 0.02, 8  # s between two knocks; times that are named
_FEW = 0.02  # spikes that are no impacts, over those that are
#: Channels of a drop test, the best first.
_HEARD = ("acceleration", "sound", "displacement", "base")

#: What checks.csv says of a record: check, outcome, detail.
Said = tuple[str, str, str]


class Remarks(list[Said]):
    """What checks.csv says of the impacts of a record."""

    #: Some impacts are not found: samples are too few for their pulses, or lack there.
    lost = False

    def some_lost(self, check: str, detail: str) -> None:
        """Say why some impacts are not found."""
        self.lost = True
        self.append((check, "warning", detail))


# Which ball hit: by what each of several balls can have done.
#
# A ball that hit a wall flies on with a velocity that follows from the impact itself, y' =
# x'_after + r rho, so that its next place is known to a fraction of a millimetre: either the next
# impact lies where this ball meets a wall, or it was another's. The size of the jump, -mu rho, is
# used too. Many histories are carried along and weighed (a beam search); r and mu are learnt from
# the flights of each ball, in a few passes, from starts in which each ball has an r of its own.
# Equal balls in equal cavities bear their numbers by continuity only.
#: Spread of r and relative spread of mu that are allowed in each pass.
_PASSES = ((0.15, 0.5), (0.04, 0.15), (0.012, 0.05), (0.003, 0.02))
_FIRST_R, _SAME_R = (0.4, 0.65, 0.85), 0.1  # of each ball; of two that r does not distinguish
#: Impacts along which starts are tried; those that are followed to their ends; balls of which each
#: may begin with an r of its own.
_TRIAL, _ENDS, _EACH_ITS_OWN = 70, 12, 4
#: Of a history's log weight: what real balls, which follow no law exactly, may add to a wrong one.
_BETTER = 10.0
_HISTORIES, _SETTLED = 48, 6  # that are followed; impacts after which a label is final
_UNSEEN = 0.02  # of the impacts: the ball had one before that was not seen
_PLACE_ERROR = 2e-4  # m: of the displacement at an impact, with drift and lag
_SPEED_ERROR = 2e-3  # m/s: the least of a ball between impacts
_FLIGHTS = 8  # of a ball, at least, from which its r is estimated


@dataclass(frozen=True)
class _Rig:
    """What is believed of the balls: clearance, restitution, jump over relative velocity, mass.

    `weighed`: masses are stated, so that they say how differently the balls strike.
    """

    b: FloatArray
    r: FloatArray
    mu: FloatArray
    r_spread: float
    mu_spread: float
    mass: FloatArray
    weighed: bool

    @cached_property
    def alike(self) -> bool:
        """Whether nothing but their history distinguishes them."""
        each = np.ptp([self.b, self.mass / self.mass.mean(), self.r], axis=1)
        return bool(np.all(each < [1e-9, 1e-9, _SAME_R]))


@dataclass(frozen=True)
class _History:
    """Whose each impact is, from 0, and how probable that is, by what is believed of the balls.

    `comes`: whether it was to come there; else it had an impact before that was not seen.
    """

    ball: IntArray
    confidence: FloatArray
    comes: BoolArray
    weight: float
    rig: _Rig


@dataclass
class _Beam:
    """Histories: for each and each ball the last impact and the velocity since; log weights."""

    time: FloatArray  # (histories, balls)
    place: FloatArray
    velocity: FloatArray
    spread: FloatArray  # of the velocity; infinite: lost
    weight: FloatArray  # (histories,)
    labels: IntArray  # (histories, impacts)
    comes: BoolArray  # whether that ball was to come there

    def at(self, chosen: IntArray) -> _Beam:
        """A copy of the chosen histories."""
        return each_array(lambda values: values[chosen], self)


def attribute(
    impacts: Impacts, *, clearance: Sequence[float], nes_mass: Sequence[float] = (),
    frequency: float | None = None,
) -> Impacts:  # fmt: skip
    """Fill `nes` and `nes_confidence` of an impact table.

    Parameters
    ----------
    impacts : Impacts
        With places and velocities where the displacement gave them.
    clearance : sequence of float
        One-sided clearance of each ball, m.
    nes_mass : sequence of float
        kg: how differently two balls strike.
    frequency : float, optional
        Of the oscillation, Hz; without it several balls are not distinguished.

    Returns
    -------
    Impacts
        `nes` from 1; 0 with confidence 0 where it is not known. `unseen_before` where the ball
        was not to come there.
    """
    n = impacts.n
    if len(clearance) <= 1:
        return replace(impacts, nes=np.ones(n, dtype=np.int64), nes_confidence=np.ones(n))
    known = np.flatnonzero(np.isfinite(impacts.x_m) & np.isfinite(impacts.v_before_m_s))
    nes, confidence, unseen = np.zeros(n, dtype=np.int64), np.zeros(n), np.zeros(n, dtype=np.int64)
    if frequency and known.size >= 2:
        found = _labelled(impacts, known, np.array(clearance), nes_mass, frequency)
        nes[known], confidence[known] = found.ball + 1, found.confidence
        unseen[known] = ~found.comes
    return replace(impacts, nes=nes, nes_confidence=confidence, unseen_before=unseen)


def _labelled(
    impacts: Impacts, known: IntArray, b: FloatArray, nes_mass: Sequence[float], frequency: float
) -> _History:
    """The most probable of all histories, and the probabilities of its balls.

    Every other history counts against a label with its own probability, above all the best one
    with balls exchanged: unlike balls may explain nearly as well what they did not do.
    """
    few = known[:_TRIAL]
    starts = _starts(impacts, known, b, nes_mass, frequency)
    weight = attrgetter("weight")
    tried = sorted((_search(impacts, few, rig) for rig in starts), key=weight)[-_ENDS:]
    first = max((_followed(impacts, few, one) for one in tried), key=weight)
    found = [_followed(impacts, known, _search(impacts, known, first.rig), 1)]
    for i, k in combinations(range(b.size), 2):
        rig = found[0].rig
        if (b[i], rig.mass[i]) == (b[k], rig.mass[k]):
            continue
        order = np.arange(b.size)
        order[[i, k]] = k, i
        given = replace(rig, r=rig.r[order], mu=rig.mu[order])
        rig = _learnt(impacts, known, order[found[0].ball], given, _PASSES[1])
        found.append(_followed(impacts, known, _search(impacts, known, rig), 1))
    best = max(found, key=weight)
    weights = np.exp([(one.weight - best.weight) / _BETTER for one in found])
    same = [np.where(one.ball == best.ball, one.confidence, 0.0) for one in found]
    return replace(best, confidence=weights @ np.array(same) / weights.sum())


def _starts(
    impacts: Impacts, known: IntArray, b: FloatArray, nes_mass: Sequence[float], frequency: float
) -> list[_Rig]:
    """What may be believed at first: each ball of a restitution of its own, any the one that hits
    most often, two times a cycle."""
    stated = len(nes_mass) == b.size
    mass = np.array(nes_mass if stated else np.ones(b.size), dtype=np.float64)
    jump = float(np.median(np.abs(impacts.velocity_jump_m_s[known])))
    equal = [
        (i, k) for i, k in combinations(range(b.size), 2) if b[i] == b[k] and mass[i] == mass[k]
    ]
    starts = []
    alike = [(one,) * b.size for one in _FIRST_R]
    for r in product(_FIRST_R, repeat=b.size) if b.size <= _EACH_ITS_OWN else alike:
        if any(r[i] > r[k] for i, k in equal):  # the same with numbers exchanged
            continue
        share = mass * (1.0 + np.array(r))  # of the momentum that a unit of relative velocity gives
        # at speed 4 b f, relative velocity a quarter more: a place to begin
        for scale in np.unique(jump / (5.0 * b * frequency * share)):
            starts.append(_Rig(b, np.array(r), scale * share, *_PASSES[0], mass, stated))
    return starts


def _followed(impacts: Impacts, known: IntArray, found: _History, passed: int = 0) -> _History:
    """The most probable history, from one of which r and mu are learnt anew in passes."""
    for spreads in _PASSES[passed + 1 :]:
        again = _search(impacts, known, _learnt(impacts, known, found.ball, found.rig, spreads))
        if again.weight < found.weight:  # real balls need not be as regular as that
            break
        found = again
    return found


def _search(impacts: Impacts, known: IntArray, rig: _Rig) -> _History:
    """The most probable history of a rig."""
    t, x = impacts.time_s[known], impacts.x_m[known]
    v, jump = impacts.v_before_m_s[known], impacts.velocity_jump_m_s[known]
    side = impacts.side[known].astype(np.float64)
    balls, n = rig.b.size, known.size
    nothing = np.zeros((1, balls))
    labels = np.zeros((1, n), dtype=np.int64)
    beam = _Beam(nothing, nothing, nothing, nothing + np.inf, np.zeros(1), labels, labels > 0)
    confidence = np.zeros(n)
    for j in range(n + _SETTLED):
        if j < n:
            beam = _advanced(beam, rig, j, t[j], x[j], v[j], jump[j], side[j])
        if j >= _SETTLED:
            _settle(beam, j - _SETTLED, confidence)
    best = int(np.argmax(beam.weight))
    own = beam.labels[best].copy(), confidence, beam.comes[best].copy()
    return _History(*own, float(beam.weight[best]), rig)


def _settle(beam: _Beam, j: int, confidence: FloatArray) -> None:
    """Probability, among all histories, of the label that the best one gives impact j."""
    weight = np.exp(beam.weight - beam.weight.max())
    best = beam.labels[int(np.argmax(weight)), j]
    confidence[j] = float(weight[beam.labels[:, j] == best].sum() / weight.sum())


def _advanced(
    beam: _Beam, rig: _Rig, j: int, t: float, x: float, v: float, jump: float, side: float,
) -> _Beam:  # fmt: skip
    """Every history continued by every ball, the most likely kept."""
    wall = x - side * rig.b  # where each ball would be
    flown = t - beam.time
    expected = beam.place + beam.velocity * flown
    lost = ~np.isfinite(beam.spread)
    place_error = np.hypot(_PLACE_ERROR, np.where(lost, 0.0, beam.spread) * flown)
    off = (expected - wall) / place_error
    uniform = 1.0 / (2.0 * rig.b)
    normal = np.exp(-0.5 * np.minimum(off**2, 1e3)) / (place_error * math.sqrt(2.0 * math.pi))
    fits = np.where(lost, uniform, (1.0 - _UNSEEN) * normal + _UNSEEN * uniform)

    inlier = ~lost & (np.abs(off) < 4.0)
    before = np.where(inlier, (wall - beam.place) / np.maximum(flown, 1e-9), 0.0)
    rho = np.where(inlier, v - before, -jump / rig.mu)
    size = -rig.mu * rho
    spread = np.hypot(rig.mu_spread * np.abs(size), 2e-4)
    strikes = np.exp(-0.5 * np.minimum(((jump - size) / spread) ** 2, 1e3)) / spread
    strikes = np.where(inlier, strikes, 1.0 / max(abs(jump), 1e-4))
    score = np.log(fits + 1e-300) + np.log(0.98 * strikes + 0.02 / max(abs(jump), 1e-4))

    # A ball that should have left its cavity by now hit something unseen: it is lost.
    outside = np.abs(x - expected) - rig.b > 4.0 * place_error
    gone = outside & ~lost
    score = score + np.log(_UNSEEN) * (gone.sum(axis=1, keepdims=True) - gone)
    total = beam.weight[:, np.newaxis] + score
    order = np.argsort(-total, axis=None, kind="stable")[:_HISTORIES]
    parent, ball = np.unravel_index(order, total.shape)

    after = v + jump + rig.r[ball] * rho[parent, ball]
    from_jump = rig.mu_spread * np.where(inlier[parent, ball], 0.0, rig.r[ball])
    new_spread = np.abs(rho[parent, ball]) * np.hypot(rig.r_spread, from_jump) + _SPEED_ERROR
    rows = np.arange(order.size)
    new = beam.at(parent)
    new.weight, new.spread = total[parent, ball], np.where(gone, np.inf, beam.spread)[parent]
    new.time[rows, ball], new.place[rows, ball] = t, wall[ball]
    new.velocity[rows, ball], new.spread[rows, ball] = after, new_spread
    new.labels[:, j], new.comes[:, j] = ball, inlier[parent, ball]
    return _without_twins(new) if rig.alike else new


def _without_twins(beam: _Beam) -> _Beam:
    """Of histories that differ in the numbers of equal balls only, the likelier one."""
    when = np.where(np.isfinite(beam.spread), beam.time, -np.inf)
    order = np.lexsort((np.arange(when.shape[0]), *np.sort(when, axis=1).T))
    rows = np.sort(when, axis=1)[order]
    new = np.concatenate([[True], (rows[1:] != rows[:-1]).any(axis=1)])
    return beam.at(np.sort(order[new]))  # histories stand in the order of their weight


def _learnt(
    impacts: Impacts, known: IntArray, labels: IntArray, rig: _Rig, spreads: tuple[float, float]
) -> _Rig:
    """r and mu of each ball from its flights: medians bear a share of wrong labels."""
    r, mu, flights = rig.r.copy(), rig.mu.copy(), np.zeros(rig.b.size)
    for ball in range(rig.b.size):
        own = known[labels == ball]
        t, side = impacts.time_s[own], impacts.side[own]
        y = impacts.x_m[own] - side * rig.b[ball]
        u = np.diff(y) / np.diff(t)
        crosses = side[1:] != side[:-1]
        inner = np.flatnonzero(crosses[1:] & crosses[:-1]) + 1
        if inner.size < _FLIGHTS:
            continue
        v, jump = impacts.v_before_m_s[own][inner], impacts.velocity_jump_m_s[own][inner]
        rho = v - u[inner - 1]
        r[ball] = float(np.clip(np.median(-(v + jump - u[inner]) / rho), 0.0, 1.0))
        mu[ball] = float(np.median(-jump / rho))
        flights[ball] = inner.size
    if rig.weighed and flights.any():
        share = rig.mass * (1.0 + r)
        mu = share * float(flights @ (mu / share) / flights.sum())
    return replace(rig, r=r, mu=mu, r_spread=spreads[0], mu_spread=spreads[1])


def impacts_of_record(
    record_nc: Path, conditioned_nc: Path, out_csv: Path, *,
    clearance: Sequence[float] = (), nes_mass: Sequence[float] = (), test: str = "periodic",
    settings: Settings = _AS_BY_DEFAULT, said: Remarks | None = None,
) -> Impacts:  # fmt: skip
    """Find the impacts of one record and write them.

    Parameters
    ----------
    record_nc, conditioned_nc : Path
        records/<id>.nc and conditioned/<id>.nc.
    out_csv : Path
        impacts/<id>.csv.
    clearance : sequence of float
        One-sided clearance of each NES, m. Without NES there is nothing to find, except in a
        drop test.
    nes_mass : sequence of float
        kg, where known: helps to distinguish two balls.
    test : str
        A drop test has impacts without an oscillation.
    settings : Settings, optional
    said : Remarks, optional
        Gets what checks.csv says of what was left out.

    Returns
    -------
    Impacts
    """
    said = Remarks() if said is None else said
    with open_record(Path(record_nc)) as record, open_record(Path(conditioned_nc)) as conditioned:
        impacts = no_impacts()
        if record.refused is None and test == "drop":
            impacts = find_drop(record, conditioned, settings)
        elif record.refused is None and clearance:
            impacts = _struck(record, conditioned, clearance, nes_mass, test, settings, said)
    write_impacts(out_csv, impacts)
    return impacts


def _struck(
    record: RecordView, conditioned: RecordView, clearance: Sequence[float],
    nes_mass: Sequence[float], test: str, settings: Settings, said: Remarks,
) -> Impacts:  # fmt: skip
    """Impacts of balls in an open record; none where no channel of the mass shows them."""
    motion, sign, role = conditioned.oscillation, 1.0, "acceleration"
    found, slopes, late = detection_at(np.empty(0)), None, 0.0
    if role in record.roles:
        found, slopes, sign, late = _by_pulses(
            record, conditioned, motion, clearance, test, settings, said
        )
    shown = "displacement" in record.roles and settings.slopes.use
    # a mount that rings hides the spikes, and few samples a period hide some of them; an
    # accelerometer that shows a release would show impacts
    hides = not found.time.size or _slow(conditioned, settings)
    if shown and motion and hides and slopes is not _NONE:
        own: list[Said] = []
        bends = _where_it_bends(record, motion, clearance, own, free=freed(conditioned))
        if not found.time.size or bends[0].time.size > found.time.size:
            (found, slopes), late, role = bends, 0.0, "displacement"
            said += own
    if motion and role in record.roles:
        _look_for_gaps(record, role, motion, said, contact=settings.impacts.contact)
    impacts = _table(found, slopes, sign=sign, start=record.start, late=late)
    return attribute(impacts, clearance=clearance, nes_mass=nes_mass, frequency=motion)


_MANY_WITH_GAPS = 0.1  # of the cycles


def _detected(
    stream: Stream, settings: ImpactSettings, *, frequency: float | None, balls: int
) -> Detection:
    """Contacts of an acceleration.

    Two balls that hit one after the other, again and again, look like a contact that rings: of
    templates for contacts more or less apart that one is right which leaves least of its contacts.
    """

    def left(found: Detection) -> float:
        return float(found.template.model_error.max()) if found.template else math.inf

    usual = settings.apart
    aparts = (usual, usual / 3.0, min(usual, settings.contact)) if balls > 1 else (usual,)
    tried = (detect(stream, replace(settings, apart=one), frequency=frequency) for one in aparts)
    return min(tried, key=left)


def _look_for_gaps(
    record: RecordView, role: str, frequency: float, said: Remarks, *, contact: float
) -> None:
    """What checks.csv says of a channel with gaps in many cycles, in which impacts are looked for.

    What is found beside gaps is a ball that hits more seldom than it does. No gap hides one that is
    shorter than a `contact`, s, or than the means of a displacement.
    """
    rate = record.sample_rate
    mean = group_size(rate, frequency, points=POINTS)
    least = mean if role == "displacement" else round(contact * rate)
    cycles = missing_means(record, role, round(rate / frequency), bridged=least)
    share = float(cycles.mean()) if cycles.size else 0.0
    if share > _MANY_WITH_GAPS:
        detail = (
            f"the {role}, in which impacts are looked for, has gaps in {share:.0%} of the cycles, "
            "and no impact is found in a gap: how often the ball hits is not known. The test has "
            "no regime unless two impacts per cycle last beside the gaps"
        )
        said.some_lost("impacts in gaps", detail)


#: Slopes of the displacement at impacts, fitted anew when some of them are left out.
_Fit = Callable[[Detection], SlopeChanges | None]


def _by_pulses(
    record: RecordView, conditioned: RecordView, motion: float | None, clearance: Sequence[float],
    test: str, settings: Settings, said: Remarks,
) -> tuple[Detection, SlopeChanges | None, float, float]:  # fmt: skip
    """Impacts by the acceleration, held against the displacement; its sign and scale beside it.

    And by how much later the displacement is read, s.
    """
    stream = stream_of_channel(record, conditioned, "acceleration", settings.channels)
    found = _detected(stream, settings.impacts, frequency=motion, balls=len(clearance))
    free = freed(conditioned)
    if free and motion and found.time.size:
        step = _step_of_release(record, free=free, frequency=motion)
        found = found.keep(~_let_go(found, step=step, free=free, frequency=motion))
        if not found.time.size:
            return found, _NONE, 1.0, 0.0
    if not (settings.slopes.use and motion and found.time.size):
        return found, None, 1.0, 0.0
    if "displacement" not in record.roles:
        if not may_be_integrated(record, test, clearance):
            return found, None, 1.0, 0.0
        integral = partial(slopes_of_integral, record, frequency=motion)
        found, slopes, _ = _of_the_ball(found, integral, clearance)
        return found, slopes, 1.0, 0.0
    x = coarse_displacement(record, motion, free=free)
    sign, lag = _beside(agreement_in(conditioned.attributes), settings)
    x = replace(x, late=max(lag, 0.0), lasts=found.lasts)
    if "base" not in record.roles:
        own = replace(found, jump=found.jump / sign)
        rest, steady = without_steady(x, own, frequency=motion, driven=not free)
        if steady:
            said.append(("second motion", "warning", _second_in_words(x, rest)))
            x = x.moved(x.values - rest.values)
    knocked = np.zeros(found.time.size, dtype=bool)
    if len(clearance) == 1:
        knocked = unmoved(found, x, frequency=motion, sign=sign, lag=lag)
    doubtful, found = found.keep(knocked), found.keep(~knocked)
    if len(clearance) == 1:
        found = joined(found, x, frequency=motion, clearance=clearance[0])
    fit = partial(_slopes, x=x, sign=sign, lag=lag, frequency=motion)
    found, slopes, others = _of_the_ball(found, fit, clearance, sign=sign, doubtful=doubtful)
    if others.size:
        outcome = "warning" if others.size > max(_FEW * found.time.size, 2.0) else "ok"
        said.append(("knocks", outcome, _others_in_words(others, record.start)))
    if slopes is not None and _unresolved(found.jump, slopes):
        said.some_lost("aliased", _UNRESOLVED)
        found, slopes = _by_displacement(found, slopes, x, frequency=motion, lag=lag)
    elif slopes is not None:
        if _slow(conditioned, settings) or (stream.highpass or 0.0) * found.lasts > _TAKEN:
            unknown = np.full(found.time.size, np.nan)
            found = replace(found, jump=unknown, jump_error=unknown)
            slopes = fit(found)
        slopes, lag = _where_it_is_late(
            slopes, lag, lambda at: _slopes(found, x=x, sign=sign, lag=at, frequency=motion)
        )
    return found, slopes, sign, lag


def _slow(conditioned: RecordView, settings: Settings) -> bool:
    """Whether so few samples are taken that the highpass takes the pulses along with the motion.

    Their times are known, their areas are not: those are mostly what the highpass took.
    """
    usual = settings.filter.impacts_low_most * conditioned.sample_rate
    return float(conditioned.attributes.get("acceleration_low_hz", 0.0)) > (1.0 + _TINY) * usual


_TINY = 1e-6
#: Of a period of the highpass, from which on it leaves so little of a contact's area that its shape
#: says what the rest is.
_TAKEN = 0.3
#: Of an accelerometer that shows the release and nothing else.
_NONE = SlopeChanges.unknown(0)

#: s about the release in which a sensor and its filters ring, and how large this is at most over
#: the step of the acceleration; share of a cycle in which the mass does not yet move.
_STEP_RINGS, _STEP_SHOWS, _NOT_YET = 8e-3, 1.2, 1.0 / 16.0


def _let_go(found: Detection, *, step: float, free: float, frequency: float) -> BoolArray:
    """Which spikes are of a mass that is held, or of its release: it steps to its acceleration.

    It does not move yet, so that no ball can hit it as hard as this `step`, m/s^2.
    """
    after = found.time - free
    soon = np.abs(after) < min(_STEP_RINGS, _NOT_YET / frequency)
    return np.asarray(np.where(soon, np.abs(found.peak) < _STEP_SHOWS * step, after < 0.0))


def _step_of_release(record: RecordView, *, free: float, frequency: float) -> float:
    """Amplitude of the acceleration in the first cycle, m/s^2."""
    first, count = (round(t * record.sample_rate) for t in (free, 1.0 / frequency))
    cycle = record.read("acceleration", first, first + count)
    turned = cycle * np.exp(-2j * np.pi * np.arange(cycle.size) / count)
    return float(2.0 * abs(np.nanmean(turned)))


def _where_it_is_late(
    slopes: SlopeChanges, lag: float, at: Callable[[float], SlopeChanges]
) -> tuple[SlopeChanges, float]:
    """Slopes read `at` the lag, s, that the bends of the displacement surely show, and this.

    Too early or too late by a hundredth of the window a jump is read a per cent too small. A bend
    shows how late it is only from near by: hence step by step.
    """
    for _ in range(_TURNS):
        mean, error = typical_lateness(slopes.shift, slopes.shift_error)
        if not abs(mean) > LIKELY * error:
            break
        lag += mean
        slopes = at(lag)
    return slopes, lag


def _slopes(
    found: Detection, *, x: Coarse, sign: float, lag: float, frequency: float
) -> SlopeChanges:  # fmt: skip
    """What the displacement shows at the impacts that the pulses show."""
    jumps, parts = found.jump / sign, np.isnan(found.jump)
    errors = np.where(parts, np.inf, found.jump_error / abs(sign))
    for _ in range(3 if parts.any() else 1):  # of those that only the displacement shows
        slopes = slope_changes(
            x, found.time + lag, np.nan_to_num(jumps), frequency=frequency, jump_errors=errors,
        )  # fmt: skip
        told = slopes.jump[parts], found.time[parts]
        jumps[parts] = nearer(jumps[parts], *told, frequency=frequency)
    return slopes


def _of_the_ball(
    found: Detection, fit: _Fit, clearance: Sequence[float], *, sign: float = 1.0,
    doubtful: Detection | None = None,
) -> tuple[Detection, SlopeChanges | None, FloatArray]:  # fmt: skip
    """The impacts of a single ball, the slopes there, and the times of spikes that are none.

    Of the doubtful ones those are impacts that its flights ask for.
    """
    doubt = np.zeros(found.time.size, dtype=bool)
    if doubtful is not None:
        found, doubt = found.beside(doubtful)
    slopes, others = _seen(found, fit, doubt), [np.empty(0)]
    while slopes is not None and found.time.size:
        kept = ~doubt
        if len(clearance) == 1:
            jump, error = _jumps(found, slopes, sign)
            shown = of_the_ball(
                found.time, slopes.x, slopes.v_before, jump, error,
                clearance=clearance[0], doubtful=doubt,
            )  # fmt: skip
            kept = kept if shown is None else shown
        if kept.all():
            break
        others.append(found.time[~kept])
        found, doubt = found.keep(kept), doubt[kept]
        slopes = _seen(found, fit, doubt)
    if doubt.any():  # as impacts they are found
        slopes = fit(found)
    return found, slopes, np.sort(np.concatenate(others))


def _seen(found: Detection, fit: _Fit, doubt: BoolArray) -> SlopeChanges | None:
    """Slopes at all impacts; at sure ones as if no other were there: it may be a knock."""
    slopes = fit(found)
    sure = fit(found.keep(~doubt)) if doubt.any() else None
    if slopes is None or sure is None:
        return slopes
    for field in fields(slopes):
        getattr(slopes, field.name)[~doubt] = getattr(sure, field.name)
    return slopes


def _where_it_bends(
    record: RecordView, frequency: float, clearance: Sequence[float],
    said: list[Said], *, free: float,
) -> tuple[Detection, SlopeChanges]:  # fmt: skip
    """Impacts by the displacement alone: bends that are surely there, once all are fitted.

    The mass is held until `free`, s.
    """
    x = coarse_displacement(record, frequency, free=free)
    steps = resolution_in(record, "displacement")
    samples = round(x.step * record.sample_rate)
    x = replace(x, samples=0)  # how bends are rounded is asked when it is known where they are
    resolution, start = steps / math.sqrt(samples), x
    driven, found = "base" in record.roles and not free, detection_at(np.empty(0))
    for turn in range(_TURNS):
        x, steady = without_steady(x, found, frequency=frequency, driven=driven)
        if turn and not steady:
            break
        found = detect_bends(x, frequency=frequency, resolution=resolution)
    if x is not start:
        said.append(("second motion", "warning", _second_in_words(start, x)))
    fastest = 2.0 * math.pi * frequency * float(np.ptp(x.values))
    jumps, left, bent = found.jump, _SETTLES, found.time.size
    while found.time.size:
        slopes = slope_changes(x, found.time, jumps, frequency=frequency)
        found, slopes = _by_displacement(found, slopes, x, frequency=frequency, lag=0.0)
        size = np.abs(slopes.jump)
        sure: BoolArray = (size > _SURE_BEND * slopes.alone) & (size < fastest)
        kept: BoolArray | None = sure
        if sure.all() and len(clearance) == 1:
            kept = of_the_ball(
                found.time, slopes.x, slopes.v_before, slopes.jump, slopes.alone,
                clearance=clearance[0],
            )  # fmt: skip
        moves: BoolArray = np.abs(slopes.jump - jumps) > slopes.alone
        if kept is None:
            break
        if not kept.all() or (left and moves.any()):  # neighbours settle by turns
            left -= int(kept.all())
            found, jumps = found.keep(kept), slopes.jump[kept]
        else:
            x = replace(x, samples=samples)
            return found, slope_changes(x, found.time, slopes.jump, frequency=frequency)
    if bent > _MANY_BENDS:
        said.append(("impacts", "warning", _NO_FLIGHTS))
    return detection_at(np.empty(0)), _NONE


def _second_in_words(x: Coarse, rest: Coarse) -> str:
    """What checks.csv says of a steady oscillation beside that of the mass, which `rest` lacks."""
    motion = x.values - rest.values
    line = np.argmax(np.abs(np.fft.rfft(motion))) / (motion.size * x.step)
    size = 1e6 * math.sqrt(2.0) * float(np.std(motion))
    return (
        f"the displacement also oscillates by {size:.2g} um, above all at {line:.0f} Hz, from "
        "beginning to end; no ball makes that, and it is subtracted where impacts bend it. "
        "Another mode or the floor moves the target, or the sensor shakes"
    )


_NO_FLIGHTS = (
    "the displacement bends, but not as a ball that flies from wall to wall makes it: noise hides "
    "most of its impacts, another mode or a harmonic moves the target, or the sensor shakes; no "
    "impact is taken from it. Put an accelerometer on the mass"
)
_SURE_BEND = 6.0  # standard errors of a jump
_SETTLES, _MANY_BENDS = 5, 10  # times that all jumps are looked at again; bends that say something


def count_impacts(record: RecordView, conditioned: RecordView, settings: Settings) -> int:
    """Impacts in an acceleration, whatever the row says of a ball; none where nothing shows them.

    For a record whose row has no clearance: impacts that are there say that a cell is missing.
    """
    if "acceleration" not in record.roles:
        return 0
    stream = stream_of_channel(record, conditioned, "acceleration", settings.channels)
    return int(detect(stream, settings.impacts, frequency=conditioned.oscillation).time.size)


def struck(record: RecordView, conditioned: RecordView, settings: Settings) -> tuple[int, float]:
    """Cycles with impacts in a decay that is said to have no ball, and the energy that they take.

    As a share of the largest kinetic energy of the mass: the sum of velocity jumps times its
    velocity. Only the displacement tells impacts from a mode that rings, whose spikes move nothing.
    In the first half of the decay, where a ball hits most; at its end a hand may take the mass up.
    """
    frequency, free = conditioned.oscillation, freed(conditioned)
    if not frequency or "displacement" not in record.roles:
        return 0, 0.0
    x = coarse_displacement(record, frequency, free=free)
    if "acceleration" in record.roles:
        stream = stream_of_channel(record, conditioned, "acceleration", settings.channels)
        found = detect(stream, settings.impacts, frequency=frequency)
        sign, lag = _beside(agreement_in(conditioned.attributes), settings)
        found = found.keep(~unmoved(found, x, frequency=frequency, sign=sign, lag=lag))
        slopes = _slopes(found, x=x, sign=sign, lag=lag, frequency=frequency)
    else:
        found, slopes = _where_it_bends(record, frequency, (), [], free=free)
    half = 0.5 * (free + conditioned.n / conditioned.sample_rate)
    own = np.isfinite(slopes.jump) & (found.time > free) & (found.time < half)
    speed = np.gradient(x.values, x.step)
    at = np.interp(found.time[own], x.start + x.step * np.arange(speed.size), speed)
    cycles = np.unique(np.floor(found.time[own] * frequency)).size
    most = 0.5 * float(np.nanmax(speed**2))
    taken, error = -float(slopes.jump[own] @ at), float(np.linalg.norm(slopes.alone[own] * at))
    # Steps of a sensor that pass for impacts give as often as they take: a ball takes more.
    chance = float(np.linalg.norm(slopes.jump[own] * at))
    return cycles, taken / most if taken > max(SIGNIFICANT * error, chance) else 0.0


def find_drop(record: RecordView, conditioned: RecordView, settings: Settings) -> Impacts:
    """Hits of a dropped ball, in whichever channel there is: only times matter.

    Short contacts are found by their template; hits that ring for long, by their onsets.
    """
    role = next((role for role in _HEARD if role in record.roles), None)
    if role is None:
        return no_impacts()
    stream = stream_of_channel(record, conditioned, role, settings.channels)
    if ring_time(stream, settings.impacts, settings.drop) > settings.drop.ring:
        found = detect_onsets(stream, settings.impacts, settings.drop)
    else:
        found = detect(stream, settings.impacts)
    return attribute(_table(found, None, sign=1.0, start=record.start), clearance=())


def stream_of_channel(
    record: RecordView, conditioned: RecordView, role: str, settings: ChannelSettings
) -> Stream:
    """The highpassed channel of a record, with what its sensor could not show left out."""
    limits = range_in(conditioned.attributes, role)
    kind = "acceleration" if role == "acceleration" else "displacement"

    def read(begin: int, end: int) -> FloatArray:
        raw = read_unstuck(record, role, limits, begin, end, stuck=settings.stuck)
        return np.where(np.isfinite(raw), conditioned.read(role, begin, end), np.nan)

    def clipped(begin: int, end: int) -> BoolArray:
        return limits.beyond(record.read(role, begin, end))

    return Stream(
        read, conditioned.n, conditioned.sample_rate,
        highpass=conditioned.attributes.get(f"{kind}_low_hz"),
        noise_floor=0.5 * limits.resolution, clipped=clipped if limits.clips else None,
    )  # fmt: skip


def _beside(agreement: Agreement | None, settings: Settings) -> tuple[float, float]:
    """Acceleration over that of the displacement, and by how much the latter is late, s.

    A sign; a factor as well where it is no matter of a calibration: a wrong unit, a decimal point.
    """
    sign, lag = 1.0, 0.0
    sure = settings.channels.gain_sure
    if agreement is not None and abs(agreement.gain) > sure * agreement.gain_error:
        near = 1.0 / _CALIBRATED < abs(agreement.gain) < _CALIBRATED
        sign = math.copysign(1.0 if near else abs(agreement.gain), agreement.gain)
        if agreement.lag_error < settings.channels.lag_known:
            lag = agreement.lag
    return sign, lag


def _others_in_words(times: FloatArray, start: float) -> str:
    """What checks.csv says of spikes that are no impacts of the ball."""
    apart = np.diff(times, prepend=-np.inf) > _ONE_KNOCK
    shown = first_of([f"{start + t:.3f}" for t in times[apart]], _SHOWN)
    return (
        f"{times.size} spike{'s' * (times.size > 1)} of the acceleration at {shown} s "
        f"{'are no impacts' if times.size > 1 else 'is no impact'} of the ball: it was on its way "
        "from wall to wall, or the mass does not move there. Left out. Small ones may be slow "
        "impacts; else look for knocks on the table or on the sensor's cable, a mount that rings, "
        "or friction in the guide of the mass"
    )


#: What checks.csv says of an accelerometer whose pulses are no measure of jumps.
_UNRESOLVED = (
    "the areas of the accelerometer's pulses do not agree with the jumps of velocity that the "
    "displacement shows, so that the jumps are those of the displacement alone. Either the sensor "
    "was sampled too slowly for them, without a filter before (aliased), or its filter is slower "
    "than they are, or it is loose, or contacts that last overlap"
)
_CALIBRATED = 1.2  # a sensitivity may be off by as much
_CUT_UP = 0.05  # of the contacts of either wall, that are in parts
_SCATTERS = 0.2  # of a pulse's area about the jump of the displacement; good sensors have 0.03
_FEWEST = 10  # jumps


def _unresolved(pulses: FloatArray, slopes: SlopeChanges) -> bool:
    """Whether areas of pulses scatter about the jumps that the displacement shows by a fifth.

    Off by as much, all alike, they may be a local mode's, which the displacement shows wrong, too.
    Only jumps that it surely shows count. Contacts in parts (NaN) are a soft wall where they are at
    one wall, else pulses that scatter.
    """
    jumps = slopes.jump
    known, parts = np.abs(jumps) > SURE * slopes.alone, np.isnan(pulses)
    walls = [parts[known & (side * jumps > 0.0)] for side in (1.0, -1.0)]
    cut = min(float(own.mean()) if own.size else 0.0 for own in walls)
    both = known & (~parts | (cut > _CUT_UP))
    if both.sum() < _FEWEST:
        return False
    if parts[both].all():
        return True
    ratio = pulses[both] / jumps[both]
    middle = float(np.nanmedian(ratio))
    scatter = np.where(parts[both], np.inf, np.abs(ratio / middle - 1.0))
    return bool(np.median(scatter) > _SCATTERS)


def _by_displacement(
    found: Detection, slopes: SlopeChanges, x: Coarse, *, frequency: float, lag: float,
) -> tuple[Detection, SlopeChanges]:  # fmt: skip
    """Times and jumps as the displacement shows them, of impacts that the pulses only announce."""
    unknown = np.full(found.time.size, np.nan)
    time, error, jumps = found.time, found.time_error, slopes.jump
    for _ in range(_TURNS):
        # a line knows no more, nor who of two is first; NaN: not shown
        gap = np.diff(time, prepend=-np.inf, append=np.inf)
        near = np.minimum(_ANNOUNCED * x.step, 0.5 * np.minimum(gap[:-1], gap[1:]))
        shown = np.abs(slopes.shift) < near
        time = time + np.where(shown, slopes.shift, 0.0)
        error = np.where(shown, slopes.shift_error, error)
        slopes = slope_changes(x, time + lag, np.nan_to_num(jumps), frequency=frequency)
        jumps = nearer(jumps, slopes.jump, time, frequency=frequency)
    found = replace(found, time=time, time_error=error, jump=unknown, jump_error=unknown)
    return found, slopes


_TURNS = 4
_ANNOUNCED = 4.0  # means: what tells of an impact is as near to it


def _jumps(found: Detection, slopes: SlopeChanges, sign: float) -> tuple[FloatArray, FloatArray]:
    """Jumps by both sensors."""
    return weighted(found.jump / sign, found.jump_error / abs(sign), slopes.jump, slopes.jump_error)


def _table(
    found: Detection, slopes: SlopeChanges | None, *, sign: float, start: float, late: float = 0.0
) -> Impacts:
    n = found.time.size
    unknown = np.full(n, np.nan)
    slopes = slopes or SlopeChanges.unknown(n)
    jump, error = _jumps(found, slopes, sign)
    return Impacts(
        time_s=start + found.time,
        nes=np.zeros(n, dtype=np.int64),
        side=-np.sign(np.nan_to_num(jump)).astype(np.int64),
        velocity_jump_m_s=jump,
        peak_acceleration_m_s2=found.peak,
        confidence=found.confidence,
        time_error_s=found.time_error,
        velocity_jump_error_m_s=error,
        jump_acceleration_m_s=found.jump,
        jump_acceleration_error_m_s=found.jump_error,
        jump_displacement_m_s=slopes.jump,
        jump_displacement_error_m_s=slopes.jump_error,
        x_m=slopes.x,
        v_before_m_s=slopes.v_before,
        v_error_m_s=slopes.v_error,
        v_shared_m_s=slopes.v_shared,
        read_later_s=np.full(n, late),
        late_s=slopes.shift,
        late_error_s=slopes.shift_error,
        nes_confidence=unknown,
        unseen_before=np.zeros(n, dtype=np.int64),
        crowded=found.crowded.astype(np.int64),
        clipped=found.clipped.astype(np.int64),
    )
