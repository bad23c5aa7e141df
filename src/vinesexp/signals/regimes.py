"""What one record shows, as rows of the tables of all records: `rows_or_refuse`.

The regime, by the definitions that theory and simulation use, of each ball, or of all together
where they are not told apart; amplitudes; bands of a sweep; and where a release loses its ball.

What was not seen need not be absent: a record sampled too slowly, or too noisy, shows no impact
whatever the ball does. What a ball of the given clearance would do at least is compared with what
the acceleration could show.

While there is one impact on either side in each cycle of a release the amplitude falls fast, down
to T1; from there on the ball hits when it happens to, and the amplitude falls more slowly. The
impacts show when the ball is lost; the amplitude shows how fast it falls on either side of that.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.records.campaign.missing_cells import WITH_BALL
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.refusal import refused_where_it_fails, require_conditioned
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import FROM_REST, RecordView, open_record
from vinesexp.settings.stages import RegimeSettings, Settings
from vinesexp.signals.base_motion import base_rows
from vinesexp.signals.free_from import LetGo, freed, let_go
from vinesexp.signals.impacts.candidates import STRETCH, noise_of
from vinesexp.signals.impacts.find import Remarks, Said, count_impacts, impacts_of_record, struck
from vinesexp.signals.impacts.impact_table import Impacts, no_impacts, write_impacts
from vinesexp.signals.means import cycles_from, free_cycles, time_to_level
from vinesexp.signals.steady_part import SteadyPart, from_rest, steady_after
from vinesexp.theory.regime_definitions import (
    BY_FREQUENCY,
    STILL,
    TELLING,
    Swing,
    activation_spells,
    each_ball,
    of_balls,
    regime_of,
)
from vinesexp.theory.regime_definitions import PERMANENT as TWO_PER_CYCLE
from vinesexp.units import COVERAGE_95

#: Clearances that differ by less than this share are alike.
_ALIKE = 0.01

#: Of two balls with like clearances, one with fewer impacts than this share of the other's
#: hits together with it: two impacts at one time are found as one.
_TOGETHER = 0.2
_FEWEST, _FLOOR = 4, 0.02  # cycles that a decay rate is of; largest amplitude, below which is noise
#: A row of a table: column to value.
Row = dict[str, str | float | None]


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


def transition_row(
    record: str, series: Series, decay: tuple[FloatArray, FloatArray], *,
    start: float, period: float,
) -> Row | None:  # fmt: skip
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
        A row of transitions.csv; None for a ball that was never captured. Decay rates are slopes
        of straight lines through the logarithm of the amplitude, and None for too few cycles.
    """
    time, amplitude = decay
    free = series.time >= time[0] - 0.5 * period  # the middle of the first cycle
    spells = activation_spells(series.time[free], series.side[free], period=period)
    if not len(spells):
        return None
    begin, end = spells[np.argmax(spells[:, 1] - spells[:, 0])]
    seen = amplitude > _FLOOR * np.max(amplitude, initial=0.0)

    def rate(of: BoolArray) -> float | None:
        if int(of.sum()) < _FEWEST:
            return None
        return -float(np.polyfit(time[of], np.log(amplitude[of]), 1)[0])

    return {
        "record": record,
        "nes": series.ball,
        "clearance_mm": 1e3 * series.clearance,
        "captured_from_s": float(begin - start),
        "captured_until_s": float(end - start),
        "from_m": float(np.interp(begin, time, amplitude)),
        "transition_m": float(np.interp(end, time, amplitude)),
        "decay_rate_1_s": rate((time >= begin) & (time <= end) & (amplitude > 0.0)),
        "decay_rate_after_1_s": rate((time > end) & seen),
    }


#: Amplitudes of a release that times are reported for, as shares of the release.
LEVELS = (0.5, 0.25, 0.15, 0.1)

#: Frequency over which the amplitude of a sweep is averaged, Hz.
RUNNING = 0.1
_STRETCHES = 40  # of the record, in which the noise is taken

# A sweep described over its frequency: bands of permanent, modulated and inactive response.
#
# A ball that keeps two impacts per cycle over many cycles is permanent there; shorter spells that
# follow one another are modulated response; elsewhere the ball hits when it happens to, and takes
# little. Each ball has bands of its own. Edges are those of this sweep: one that goes the other
# way, or faster, has others.
#
# Frequency of a sweep over time, counted in cycles of the base.
PERMANENT, MODULATED, INACTIVE = "permanent", "modulated", "inactive"
_SPAN = 16  # cycles that a frequency is the mean of
_APART = 0.5  # of a period: crossings closer than this are noise


@dataclass(frozen=True)
class Swept:
    """Cycles of the base, each at its time.

    Attributes
    ----------
    time : upward zero crossings, s on the record's axis: one a cycle.
    """

    time: FloatArray

    @property
    def cycles(self) -> int:
        """How many whole cycles there are."""
        return max(self.time.size - 1, 0)

    def count(self, time: FloatArray) -> FloatArray:
        """Cycles of the base since its first crossing, at each time."""
        return np.interp(time, self.time, np.arange(self.time.size, dtype=np.float64))

    def at(self, cycle: FloatArray) -> FloatArray:
        """Time of each cycle, s."""
        return np.interp(cycle, np.arange(self.time.size, dtype=np.float64), self.time)

    def frequency(self, cycle: FloatArray) -> FloatArray:
        """Frequency (Hz) at each cycle, a mean over 16 of them.

        Examples
        --------
        >>> t = np.arange(200) / 8.0
        >>> Swept(t).frequency(np.array([50.0, 120.0]))
        array([8., 8.])
        """
        span = min(_SPAN, max(self.cycles, 1))
        middle = np.arange(self.time.size - span) + 0.5 * span
        mean = span / (self.time[span:] - self.time[:-span])
        return np.interp(cycle, middle, mean)


def swept(view: RecordView, frequency: float) -> Swept | None:
    """Cycles of a conditioned sweep, from its base or, without one, from the mass.

    Returns
    -------
    Swept or None
        None where fewer than 32 cycles are seen.
    """
    role = "base" if "base" in view.roles else "displacement"
    times: list[FloatArray] = []
    for begin, x in view.blocks(role, more=1):
        up = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
        times.append((begin + up + x[up] / (x[up] - x[up + 1])) / view.sample_rate)
    found = view.start + np.concatenate(times) if times else np.empty(0)
    if found.size > 1:
        found = found[np.concatenate([[True], np.diff(found) > _APART / frequency])]
    return Swept(found) if found.size > 2 * _SPAN else None


@dataclass(frozen=True)
class Band:
    """One band: its response, first and last cycle, and how many spells it holds."""

    response: str
    begin: float
    end: float
    spells: int


def bands_of(spells: FloatArray, cycles: float, *, permanent: float, gap: float) -> list[Band]:
    """Bands from the spells of two impacts per cycle, all counted in cycles.

    Parameters
    ----------
    spells : ndarray, shape (n, 2)
        First and last cycle of each (`theory.regime_definitions.activation_spells`).
    cycles : float
        Of the whole sweep.
    permanent, gap : float
        Cycles that a permanent spell lasts; that spells of one modulated band may lie apart.

    Examples
    --------
    >>> spells = np.array([[100.0, 110.0], [120.0, 130.0], [140.0, 300.0], [500.0, 503.0]])
    >>> bands = bands_of(spells, 600.0, permanent=40, gap=40)
    >>> [(one.response, one.end) for one in bands]
    [('inactive', 100.0), ('modulated', 140.0), ('permanent', 300.0), ('inactive', 600.0)]
    """
    active: list[Band] = []
    for begin, end in spells:
        if end - begin >= permanent:
            active.append(Band(PERMANENT, float(begin), float(end), 1))
        elif active and active[-1].response == MODULATED and begin - active[-1].end <= gap:
            last = active[-1]
            active[-1] = Band(MODULATED, last.begin, float(end), last.spells + 1)
        else:
            active.append(Band(MODULATED, float(begin), float(end), 1))
    # a spell alone is chance: what is modulated comes back
    active = [one for one in active if one.response == PERMANENT or one.spells > 1]
    found: list[Band] = []
    at = 0.0
    for one in active:
        touching = bool(found) and one.begin - at <= gap
        if touching and one.response == PERMANENT != found[-1].response:
            last = found[-1]
            found[-1] = Band(last.response, last.begin, one.begin, last.spells)
        elif touching and one.response == MODULATED:
            one = Band(MODULATED, at, one.end, one.spells)
        elif one.begin > at:
            found.append(Band(INACTIVE, at, one.begin, 0))
        found.append(one)
        at = one.end
    if cycles > at:
        found.append(Band(INACTIVE, at, cycles, 0))
    return found


def band_rows(
    record: str, series: Sequence[Series], base: Swept, decay: tuple[FloatArray, FloatArray],
    settings: RegimeSettings,
) -> list[Row]:  # fmt: skip
    """Rows of bands.csv: every band of every ball of one sweep.

    Parameters
    ----------
    record : str
        Its id.
    series : sequence of Series
        Impacts, ball by ball.
    base : Swept
    decay : (time, amplitude)
        Cycle by cycle; s on the record's axis, m.
    settings : RegimeSettings
    """
    rows: list[Row] = []
    time, amplitude = decay
    limits = {"permanent": settings.permanent_cycles, "gap": settings.modulation_gap}
    for one in series:
        spells = activation_spells(base.count(one.time), one.side, period=1.0)
        for band in bands_of(spells, float(base.cycles), **limits):
            ends = np.array([band.begin, band.end])
            (begin, end), (low, high) = base.at(ends), base.frequency(ends)
            inside = amplitude[(time >= begin) & (time <= end)]
            rows.append(
                {
                    "record": record,
                    "nes": one.ball,
                    "response": band.response,
                    "from_hz": float(low),
                    "to_hz": float(high),
                    "from_s": float(begin),
                    "to_s": float(end),
                    "spells": band.spells,
                    "impacts_per_cycle": float(((one.time >= begin) & (one.time <= end)).sum())
                    / (band.end - band.begin),
                    "amplitude_mean_m": float(inside.mean()) if inside.size else None,
                    "amplitude_max_m": float(inside.max()) if inside.size else None,
                }
            )
    return rows


def largest_running_mean(
    base: Swept, decay: tuple[FloatArray, FloatArray], *, width: float
) -> float | None:
    """Largest mean of the amplitude over a window of `width` Hz, m; None for a shorter sweep.

    Modulated response swings within a frequency that a reader sees as one point of a curve: its
    running mean is what a response curve drawn by hand or by slow averaging shows.
    """
    time, amplitude = decay
    f = base.frequency(base.count(time))
    if f.size < 2 or abs(f[-1] - f[0]) < width:
        return None
    samples = max(round(width * (f.size - 1) / abs(float(f[-1] - f[0]))), 1)
    means = np.convolve(amplitude, np.ones(samples) / samples, mode="valid")
    return float(means.max()) if means.size else None


def shown_by_record(
    record: Record, *, conditioned: RecordView, impacts: Impacts, lost: bool = False
) -> dict[str, list[Any]]:
    """Regime and amplitude of a record; of a sweep its bands, of a release where balls are lost.

    Parameters
    ----------
    record : Record
    conditioned : RecordView
        Bandpassed.
    impacts : Impacts
        Of the record.
    lost : bool
        Some of its impacts are not found: samples are too few for their pulses, or lack there.

    Returns
    -------
    dict
        Rows by table: ``regime`` (the row of regimes.csv), ``bands``, ``transitions``, ``times``
        (of decay_times.csv: how long after it was let go a release has fallen to `LEVELS`; None:
        not within the record); and ``checks``, what checks.csv says of how the test began.
        In the first ``regime`` (one word a ball; of a sweep `BY_FREQUENCY`), ``impacts_per_cycle``
        of all balls and ``impacts_per_cycle_each``, ``amplitude_mean_m`` (of a periodic test with
        ``amplitude_error_m``, over ``cycles`` from ``steady_from_s`` on, and with
        ``waited_s`` of a start from rest), ``amplitude_max_m``,
        ``length_s``, of a sweep ``amplitude_running_max_m``, ``captured`` (share of cycles with one
        impact on either side), ``swing_first`` and ``swing`` (of their phase, in periods, in either
        half), ``spells`` and ``spell_mean_s`` (of such cycles in a row). None or absent where it
        cannot be known: a record that could not show impacts, for its noise or its sampling, has no
        regime.
    """
    row = unknown_regime(record)
    checks: list[Said] = []
    shown: dict[str, list[Any]] = {
        "regime": [row], "bands": [], "transitions": [], "times": [], "checks": checks
    }  # fmt: skip
    if "displacement" not in conditioned.roles or not conditioned.oscillation:
        return shown
    motion, stopped = _motion_of(record, conditioned, conditioned.oscillation)
    checks += stopped
    shown["times"] = _decay_times(record, motion)
    if motion.time.size == 0:
        return shown
    row["length_s"] = motion.length
    begin = motion.free
    if record.test == "periodic":
        begin = record.settings.regimes.settling * motion.length
    if not np.any(motion.time >= begin):
        return shown
    if record.test == "periodic":
        begin, how = _settled(record, conditioned, impacts, motion, begin, row)
        checks += how
    counted = motion.amplitude[motion.time >= begin]
    row |= {
        "cycles": float(counted.size), "amplitude_mean_m": float(counted.mean()),
        "amplitude_max_m": float(counted.max()),
    }  # fmt: skip
    base = swept(conditioned, conditioned.oscillation) if record.test == "sweep" else None
    if base is not None:
        row["amplitude_running_max_m"] = largest_running_mean(base, motion.decay, width=RUNNING)
    if not record.clearance:
        return shown
    if record.test == "periodic" and counted.size < TELLING:
        checks.append(_too_short(counted.size))
    if not _seen(record, conditioned, impacts, conditioned.oscillation):
        checks += [_NOTHING_SEEN] if not impacts.n and record.test != "sweep" else []
        return shown
    settings = record.settings.regimes
    series = by_ball(impacts, record.clearance, unowned_share=settings.unowned_share)
    end = motion.length
    if record.test == "transient":
        end = min(begin + settings.first_cycles * motion.period, end)
    span = motion.start + begin, motion.start + end
    found = _regimes(record, series, period=motion.period, span=span)
    lasting = all(word in TWO_PER_CYCLE for word in each_ball(str(found.get("regime", ""))))
    few = settings.seen_share * (end - begin) / motion.period  # of which nothing is to be told
    hidden = _some_hidden(impacts, *span, fewest=few)
    if not lasting and (hidden or lost):
        checks += [_SOME_HIDDEN] if hidden else []
        return shown
    row |= found | _spells(record, impacts, motion.period)
    per_cycle = row["impacts_per_cycle"]
    if isinstance(per_cycle, float) and per_cycle < STILL and record.test != "sweep":
        checks.append(_did_not_work(min(record.clearance), float(counted.max())))
    if base is not None:
        shown["bands"] = band_rows(record.id, series, base, motion.decay, settings)
    elif record.test == "transient":
        moments = {"start": motion.start, "period": motion.period}
        every = (transition_row(record.id, one, motion.decay, **moments) for one in series)
        shown["transitions"] = [one for one in every if one is not None]
    return shown


def _stopped(time: float, amplitude: float) -> Said:
    """What checks.csv says of a release that a hand ends."""
    detail = (
        f"the mass stops within two cycles at {time:.4g} s, where it swings by "
        f"{1e3 * amplitude:.3g} mm: a hand took it. The decay did not reach the amplitudes below; "
        "record longer before you stop it"
    )
    return "release", "warning", detail


#: A start that moves the mean by less is not worth a line.
_WORTH_A_LINE = 0.01


#: Cycles of a constant amplitude, within this share, at the end of a record from which on a ball
#: that was lost before is caught for good.
_CAUGHT, _CONSTANT = 40, 0.03


def _settled(
    record: Record, view: RecordView, impacts: Impacts, motion: _Motion, begin: float, row: Row
) -> tuple[float, Iterator[Said]]:
    """When the response of a periodic test begins, s, and what is said of it; fills in its row."""
    begin = _caught(impacts, record, motion, begin)
    steady, begin = steady_after(begin, motion.time, motion.amplitude, period=motion.period)
    at_rest = bool(view.attributes.get(FROM_REST)) or from_rest(motion.amplitude)
    row["amplitude_error_m"] = steady.error if math.isfinite(steady.error) else None
    row["steady_from_s"] = begin
    row["waited_s"] = begin if at_rest else None
    return begin, _how_it_began(steady, begin)


def _caught(impacts: Impacts, record: Record, motion: _Motion, begin: float) -> float:
    """When the motion begins in which a test ends, s: that is its response, what was before is not.

    A ball that comes and goes is caught at last, and keeps two impacts per cycle at one amplitude
    to the end of the record. In strongly modulated motion the amplitude never stays.
    """
    counted = impacts.time_s >= motion.start + begin
    hits = impacts.time_s[counted], impacts.side[counted]
    spells = activation_spells(*hits, period=motion.period)
    if len(record.clearance) != 1 or len(spells) < 2:
        return begin
    time, amplitude = motion.time, motion.amplitude
    final = float(np.median(amplitude[-_CAUGHT:]))
    moving = np.flatnonzero(np.abs(amplitude - final) > _CONSTANT * final)
    first = int(moving[-1]) + 1 if moving.size else 0
    if amplitude.size - first < _CAUGHT or motion.start + time[first] < spells[-1, 0]:
        return begin
    return max(begin, float(time[first]))


def _how_it_began(steady: SteadyPart, begin: float) -> Iterator[Said]:
    """What checks.csv says of a start that was left out, and of a response that did not settle."""
    counted = steady.first + steady.cycles
    moved = (steady.start - steady.mean) * steady.first / counted if steady.first else 0.0
    if steady.drifts:
        first, last = (f"{1e3 * end:.3g}" for end in steady.ends)
        detail = (
            f"the amplitude has not settled: {first} mm in the first half of the counted cycles, "
            f"{last} mm in the second; wait longer before recording, or record longer"
        )
        yield "start of the test", "warning", detail
    elif abs(moved) >= _WORTH_A_LINE * steady.mean:
        detail = (
            f"the first {begin:.3g} s are the start of the test and are left out: with them the "
            f"mean amplitude would be {1e3 * (steady.mean + moved):.3g} mm instead of "
            f"{1e3 * steady.mean:.3g} mm"
        )
        yield "start of the test", "ok", detail


def _too_short(cycles: int) -> Said:
    return "length of the test", "warning", (
        f"too short: {cycles} cycles after the start of the test, of {TELLING} that are needed to "
        "see whether two impacts per cycle last; the test does not count for their end; record "
        "longer"
    )  # fmt: skip


def _did_not_work(b: float, amplitude: float) -> Said:
    return "ball", "warning", (
        "no impact: the ball is stuck, or no wall reaches it (the mass swings by "
        f"{1e3 * amplitude:.3g} mm, the clearance is {1e3 * b:.3g} mm); the test shows nothing of "
        "the NES. Free the ball, or start it with a push; where the mass hardly swings, look at "
        "its guide"
    )  # fmt: skip


_NOTHING_SEEN: Said = "ball", "warning", (
    "no impact was found: the ball did not move, or those of a light ball are lost in the "
    "noise or the sampling of this record; the test shows nothing of the NES"
)  # fmt: skip


_SOME_HIDDEN: Said = "ball", "warning", (
    "the impacts that were found are hardly larger than the smallest that stand clear of the noise "
    "of this record, so others are lost in it: how often the ball hits is not known, and the test "
    "has no regime; record the acceleration too, or a displacement with less noise"
)  # fmt: skip

#: A repetition would find an impact again with less than this probability: it is near the limit of
#: what the record shows. As many as this share of all, of more than this share of the usual jump,
#: and others like them are below it.
_UNSURE, _MANY_UNSURE, _AS_LARGE = 0.95, 0.1, 0.5


def _some_hidden(impacts: Impacts, begin: float, end: float, *, fewest: float) -> bool:
    """Whether as many of a span are near the limit of what is found that others are below it."""
    own = (impacts.time_s >= begin) & (impacts.time_s <= end)
    jump, unsure = np.abs(impacts.velocity_jump_m_s[own]), impacts.confidence[own] < _UNSURE
    if unsure.size <= fewest or unsure.sum() <= _MANY_UNSURE * unsure.size:
        return False
    return bool(np.median(jump[unsure]) > _AS_LARGE * np.median(jump))


def _seen(record: Record, view: RecordView, impacts: Impacts, frequency: float) -> bool:
    """Whether the record would show impacts if there were any: what is not seen is unknown."""
    cycles = view.n / view.sample_rate * frequency
    if impacts.n > record.settings.regimes.seen_share * cycles:
        return True
    # A ball that crosses its cavity twice a cycle flies at 4 b f or faster; dv = eps (1 + r) rho.
    slowest = 4.0 * min(record.clearance) * frequency
    return smallest_jump(view, record.settings) < record.settings.regimes.smallest_ball * slowest


def unknown_regime(record: Record) -> Row:
    """The row of regimes.csv of a record of which nothing is known."""
    columns = ("regime", "impacts_per_cycle", "amplitude_mean_m", "amplitude_max_m", "captured")
    return {"record": record.id, **dict.fromkeys(columns)}


def _decay_times(record: Record, motion: _Motion) -> list[Row]:
    """Rows of decay_times.csv: how long after it was let go a release has fallen to `LEVELS`."""
    if record.test != "transient" or not np.isfinite(motion.amplitude).any():
        return []
    # a release that was not written down, or is in another unit than the displacement, has round
    # levels, which others by the same hand share
    seen, release = float(np.nanmax(motion.amplitude)), abs(record.release or 0.0)
    if not 0.0 < LEVELS[-1] * release < seen:
        release = float(f"{seen:.2g}")
    targets = [share * release for share in LEVELS]
    since = motion.time - motion.free
    reached = [time_to_level(since, motion.amplitude, target) for target in targets]
    return [
        {"record": record.id, "target_m": target, "time_s": t if math.isfinite(t) else None}
        for target, t in zip(targets, reached, strict=True)
    ]


@dataclass(frozen=True)
class _Motion:
    """The mass from when it is free until a hand stops it.

    Attributes
    ----------
    time, amplitude : middle of each cycle, s from the first sample, and its half swing, m.
    period : s, of the oscillation.
    start, length : s, first moment of the record on its axis, and how long it lasts.
    free : s from the first sample, until when the mass is held.
    """

    time: FloatArray
    amplitude: FloatArray
    period: float
    start: float
    length: float
    free: float

    @property
    def decay(self) -> tuple[FloatArray, FloatArray]:
        """Cycle by cycle: s on the record's axis, m."""
        return self.start + self.time, self.amplitude


def _motion_of(record: Record, view: RecordView, frequency: float) -> tuple[_Motion, list[Said]]:
    """The motion of a record, and what is said of its end."""
    first = freed(view)
    free = round(first * view.sample_rate)

    def read(begin: int, end: int) -> FloatArray:
        return view.read("displacement", free + begin, free + end)

    time, amplitude = cycles_from(read, view.n - free, view.sample_rate, frequency)
    time, whole = first + time, free_cycles(amplitude)
    stopped = record.test == "transient" and whole < amplitude.size
    if stopped:
        time, amplitude = time[:whole], amplitude[:whole]
    said = [_stopped(float(time[-1]), float(amplitude[-1]))] if stopped else []
    length = view.n / view.sample_rate
    return _Motion(time, amplitude, 1.0 / frequency, view.start, length, first), said


def _regimes(
    record: Record, series: Sequence[Series], *, period: float, span: tuple[float, float]
) -> Row:
    """Regime of each ball, and of all impacts together where the ball is not known."""
    begin, end = span
    if end - begin < period:
        return {}
    counts = [
        regime_of(
            *(one.time, one.side), period=period, start=begin, end=end,
            decaying=record.test == "transient",
        )
        for one in series
    ]  # fmt: skip
    words = of_balls(count.regime.value for count in counts)
    return {
        "regime": BY_FREQUENCY if record.test == "sweep" else words,
        "impacts_per_cycle": sum(count.impacts_per_cycle for count in counts),
        "impacts_per_cycle_each": of_balls(f"{count.impacts_per_cycle:.2f}" for count in counts),
        "captured": min(count.captured for count in counts),
        **_swing([count.swing for count in counts if math.isfinite(count.swing.lasting)]),
    }


def _swing(known: list[Swing]) -> Row:
    """That of the ball that swings most; nothing where impacts are too few."""
    most = max(known, key=lambda swing: swing.lasting, default=None)
    return {} if most is None else {"swing_first": most.first, "swing": most.second}


def _spells(record: Record, impacts: Impacts, period: float) -> Row:
    """Number and mean length of the activation spells of a single ball."""
    if len(record.clearance) != 1:
        return {}
    spells = activation_spells(impacts.time_s, impacts.side, period=period)
    lengths = spells[:, 1] - spells[:, 0]
    mean = {"spell_mean_s": float(lengths.mean())} if lengths.size else {}
    return {"spells": float(lengths.size), **mean}


def smallest_jump(conditioned: RecordView, settings: Settings) -> float:
    """Smallest velocity jump (m/s) that the acceleration shows; infinite without one.

    A contact of length T or of one sample, whichever is longer, has to reach the threshold.
    """
    if "acceleration" not in conditioned.roles or conditioned.n < 2:
        return math.inf
    starts = np.linspace(0, max(0, conditioned.n - STRETCH), _STRETCHES).astype(np.int64)
    noise = float(
        np.median([noise_of(conditioned.read("acceleration", i, i + STRETCH)) for i in starts])
    )
    samples = max(1.0, settings.impacts.contact * conditioned.sample_rate)
    # Half a sine of n samples and height 1 has the area 2 n/pi and the norm sqrt(n/2).
    area, norm = 2.0 * samples / math.pi, math.sqrt(samples / 2)
    return settings.impacts.threshold * noise * area / norm / conditioned.sample_rate


def rows_or_refuse(
    record: Record, nes_mass: Sequence[float], *, paths: ResultPaths, strict: bool
) -> tuple[Impacts, dict[str, Any]]:
    """Find the impacts of a record and write what it shows; the reason where it cannot be done.

    Parameters
    ----------
    record : Record
    nes_mass : sequence of float
        kg, of the balls, as far as they are known.
    paths : ResultPaths
    strict : bool
        Raise a `RecordError` instead.
    """
    measured, conditioned = paths.record(record.id), paths.conditioned(record.id)
    impacts, said = no_impacts(), Remarks()
    rows: dict[str, Any] = {}

    def leave(reason: str) -> None:
        write_impacts(paths.impacts(record.id), impacts)
        none: dict[str, Any] = {
            name: [] for name in ("bands", "transitions", "times", "base", "release")
        }
        rows.update({"regime": [unknown_regime(record)], **none, "refused": reason})

    with refused_where_it_fails("impacts", record.id, leave, strict=strict):
        require_conditioned(measured, conditioned)
        impacts = impacts_of_record(
            measured, conditioned, paths.impacts(record.id),
            clearance=record.clearance, nes_mass=nes_mass, test=record.test,
            settings=record.settings, said=said,
        )  # fmt: skip
        with open_record(measured) as raw, open_record(conditioned) as view:
            rows.update(shown_by_record(record, conditioned=view, impacts=impacts, lost=said.lost))
            counted = rows["regime"][0].get("steady_from_s")
            out_at = let_go(raw, view, impacts) if record.test == "transient" else None
            if out_at is not None:
                rows["regime"][0] |= _begins(out_at)
                said += _pushed(out_at)
            rows.update(
                release=[] if out_at is None else [asdict(out_at)],
                base=base_rows(record, measured=raw, conditioned=view, steady_from=counted),
                evidence=_evidence(record, raw, view),
                struck=_struck(record, raw, view),
            )
        rows["checks"] += said
    out = paths.regime(record.id)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return impacts, rows


def _begins(out_at: LetGo) -> Row:
    """Columns of regimes.csv of a release: how far out, and with which amplitude it begins."""
    return {
        "released_m": abs(out_at.x),
        "begins_m": out_at.amplitude,
        "begins_error_m": out_at.amplitude_error,
    }


def _pushed(out_at: LetGo) -> Iterator[Said]:
    """What checks.csv says of a release in which a hand did more than let go."""
    if abs(out_at.x) == out_at.amplitude:
        return
    more = out_at.amplitude > abs(out_at.x)
    hand = "pushed the mass" if more else "went along with the mass, or held it back"
    yield (
        "release", "ok",
        f"let go {1e3 * abs(out_at.x):.4g} mm from rest, the free motion begins with an amplitude "
        f"of {1e3 * out_at.amplitude:.4g} +- {1e3 * COVERAGE_95 * out_at.amplitude_error:.2g} mm: "
        f"the hand {hand}; decay times and b_t are of this amplitude",
    )  # fmt: skip


def _struck(record: Record, measured: RecordView, conditioned: RecordView) -> dict[str, float]:
    """In how many cycles a ring-down without ball is hit, and what share of its energy goes."""
    if record.clearance or record.test != "ringdown" or measured.refused is not None:
        return {}
    cycles, share = struck(measured, conditioned, record.settings)
    return {"cycles": cycles, "share": share}


def _evidence(record: Record, measured: RecordView, conditioned: RecordView) -> dict[str, Any]:
    """What the record shows of cells that its row leaves empty (`missing_cells.py`)."""
    shown: dict[str, Any] = {"frequency": conditioned.oscillation}
    if not record.clearance and record.test in WITH_BALL and measured.refused is None:
        shown["impacts"] = count_impacts(measured, conditioned, record.settings)
    return shown
