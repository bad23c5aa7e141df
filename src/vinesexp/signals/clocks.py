"""Lost samples and clocks that differ: what is wrong with the time of a record, before any rig.

The base of a periodic test is a steady sine, so that its phase is a straight line over time; the
acceleration is the second derivative of the displacement, so that the lag between the two is one
number. A step of either is samples that a recorder lost, in all channels or in one; a slope of the
lag is a second recorder with a clock of its own. What it takes for a fault follows from the scatter
of the phase itself, so that a base that wanders hides what it would hide from anyone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from scipy import ndimage
from scipy.special import stdtrit

from vinesexp.arrays import (
    OF_MEDIAN,
    BoolArray,
    ComplexArray,
    FloatArray,
    median_of,
    runs_of,
    spread_of,
)
from vinesexp.records.campaign.schema import RELEASES, Record
from vinesexp.records.instrument.timebase import Resampler
from vinesexp.records.stored.checks import Check
from vinesexp.records.stored.store import FROM_REST, RECORDERS, RecordView
from vinesexp.signals.base_motion import sine_windows, sines_of_windows
from vinesexp.signals.channel_agreement import (
    ABOVE_IT,
    AT_IT,
    FINE_POINTS,
    lines_between,
    parts_of,
    second_derivative_beside,
)
from vinesexp.signals.corrections import Correction, correct, samples_of
from vinesexp.signals.free_from import free_sample
from vinesexp.signals.means import BLOCK, POINTS, coarse_channels, fill_gaps
from vinesexp.units import SURE

#: Tests whose motion shows the clock of a recorder.
MENDED = ("periodic", *RELEASES)

_FEWEST = 12  # windows
_COHERENT, _FEWEST_LINES = 0.7, 3  # lines; alike
_LAG_CYCLES = 4  # of a window of the lag; the next begins half of it later
_FALSE_ALARMS = 1e-6  # of records without a fault in which one is found, were the scatter normal
_WHOLE = 0.25  # samples by which a step may be less than one and still be a lost one
_DRIFTS = 1.0  # samples over the record that a second clock is worth
_MOST = 8  # faults of one record that are looked for
_EXACT = 1e-6  # rad: no phase is known better
_ALIKE = 0.3  # rad: error of a phase up to which two channels move together
_SHOWS = (0.5, 12.0)  # of the oscillation: where two recorders are compared
_EDGE = 1.0  # periods at the ends of a record, over which a filter fades in
_OVERLAP = 0.5  # of the record, that two recorders share at least
_MOVE_ALIKE, _AS_GOOD = 0.8, 1.5  # correlation; times what the best shift leaves
_NEARLY = 0.97  # correlation of a motion that repeats, of which samples were lost
_SAME_MOTION = 1e-5  # of the correlation: a cycle that differs by less is the same
_TOGETHER = 0.04  # periods: less may be a lag, or a filter
_STARTED = "start of recorders"  # check
_LONG = 0.5  # periods: a motion is not known across a longer gap
_JUMP, _STANDS_OUT = 8, 3.0  # samples beside a jump; times the largest elsewhere
_MOST_SAMPLES = 60_000_000  # of a record


@dataclass(frozen=True)
class Course:
    """A phase (rad) or lag (s) over time, from windows that begin `every` s apart.

    A moment lies in `shared` windows: so many show a step as a mixture. `weight` (1 by default) is
    one over the error of each value, in any unit. `beside`, (n, k): what else it may follow.
    """

    time: FloatArray
    value: FloatArray
    every: float
    shared: int = 1
    weight: FloatArray | None = None
    beside: FloatArray | None = None


@dataclass(frozen=True)
class Law:
    """The straight line with one step that a series follows, and how far it is known.

    Attributes
    ----------
    slope, slope_error : of the series, a second.
    step, step_error : of the series; 0 where there is none.
    at : s, middle of the window in which it steps.
    straight : whether a slope without a step explains the series better than a step without slope.
    sure : standard errors from which on either is no chance.
    """

    slope: float
    slope_error: float
    step: float
    step_error: float
    at: float
    straight: bool
    sure: float

    @property
    def steps(self) -> bool:
        """Whether there is a step."""
        return abs(self.step) > self.sure * self.step_error

    @property
    def slopes(self) -> bool:
        """Whether there is a slope."""
        return abs(self.slope) > self.sure * self.slope_error


def law_of(series: Course | None) -> Law | None:
    """A straight line with at most one step through a series; None where it is too short.

    Errors are those of the scatter about the law, with as many independent windows as the
    scatter has; the step is looked for everywhere, which `sure` allows for.

    Examples
    --------
    >>> t = np.arange(60.0)
    >>> y = 1e-3 * np.random.default_rng(0).standard_normal(60) + np.where(t > 40, 0.1, 0.0)
    >>> law = law_of(Course(t, y, 1.0))
    >>> law.steps, law.slopes, 40.0 <= law.at <= 41.0, abs(law.step - 0.1) < 2e-3
    (True, False, True, True)
    """
    if series is None or series.time.size < _FEWEST:
        return None
    t, y, n = series.time, series.value, series.time.size
    s = (t - t.mean()) / (t[-1] - t[0])
    weight = np.ones(n) if series.weight is None else series.weight / np.median(series.weight)
    columns = np.stack([np.ones(n), s], axis=1)
    if series.beside is not None and n > _FEWEST + 2 * series.beside.shape[1]:
        columns = np.column_stack([columns, _scaled(series.beside)])
    best = _with_step(columns, y, weight, series.shared)
    step, step_error, at = best.step, best.error, best.at
    solved, error = best.solved, best.errors
    if step and abs(solved[1]) <= best.sure * error[1]:
        # a motion that swells and falls makes a slope and a step back, and neither is sure
        level = _with_step(np.delete(columns, 1, axis=1), y, weight, series.shared)
        step, step_error, at = level.step, level.error, level.at
    if not step:
        weighed = columns * weight[:, np.newaxis]
        solved = np.asarray(np.linalg.lstsq(weighed, weight * y, rcond=None)[0], dtype=np.float64)
        error = _errors(weighed, weight * y - weighed @ solved)[0]
    length = float(t[-1] - t[0])
    y_own = best.columns @ best.solved + best.rest
    return Law(
        float(solved[1]) / length, float(error[1]) / length, step, step_error,
        float(t[at : at + series.shared].mean()),
        _left(best.columns[:, :-1], y_own) < _left(np.delete(best.columns, 1, axis=1), y_own),
        best.sure,
    )  # fmt: skip


@dataclass(frozen=True)
class _Stepped:
    """A law with its best step.

    Attributes
    ----------
    columns, solved, rest, errors : least squares without the windows of the step.
    step, error : 0 where the step is not sure; its standard error.
    at : window.
    sure : standard errors from which on it is no chance.
    """

    columns: FloatArray
    solved: FloatArray
    rest: FloatArray
    errors: FloatArray
    step: float
    error: float
    at: int
    sure: float


def _with_step(columns: FloatArray, y: FloatArray, weight: FloatArray, mixed: int) -> _Stepped:
    """The step, in one of all windows, with which these columns leave least of a series."""
    n = y.size
    index = np.arange(n)

    def stepped(i: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The law with a step in windows i to i + mixed: its columns, values, what it leaves."""
        keep = (index < i) | (index >= i + mixed)  # those of the step show a mixture
        own = (np.column_stack([columns, index >= i]) * weight[:, np.newaxis])[keep]
        wanted = (weight * y)[keep]
        solved = np.asarray(np.linalg.lstsq(own, wanted, rcond=None)[0], dtype=np.float64)
        return own, solved, np.asarray(wanted - own @ solved)

    tried = [stepped(i) for i in range(2, n - 2 - mixed)]
    best = int(np.argmin([float(rest @ rest) for _, _, rest in tried]))
    own, solved, rest = tried[best]
    errors, freedom = _errors(own, rest)
    sure = -float(stdtrit(freedom, 0.5 * _FALSE_ALARMS / n))
    # A step stands out beside what the series does from one window to the next anyway, too.
    later, before = slice(1 + mixed, None), slice(-1 - mixed)
    moves = (y[later] - y[before]) * np.minimum(weight[later], weight[before])
    step, error = float(solved[-1]), float(errors[-1])
    # And it is there, from one window to the next: a base that yields to a mass that starts from
    # rest turns its phase by as much, in the course of the start.
    apart = y - columns @ solved[:-1]
    there = float(apart[best + 2 + mixed] - apart[best + 1])
    least = sure * max(error, spread_of(moves) / math.sqrt(2.0))
    if abs(step) <= least or abs(there - step) > 0.5 * abs(step):
        step = 0.0
    return _Stepped(own, solved, rest, errors, step, error, best + 2, sure)


def _scaled(columns: FloatArray) -> FloatArray:
    """Without their means, of size one; those that do not change are left out."""
    off = columns - columns.mean(axis=0)
    size = off.std(axis=0)
    return np.asarray(off[:, size > 0.0] / size[size > 0.0])


def _left(columns: FloatArray, y: FloatArray) -> float:
    """Sum of squares that least squares leave."""
    rest = y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]
    return float(rest @ rest)


def _errors(columns: FloatArray, rest: FloatArray) -> tuple[FloatArray, float]:
    """Standard errors of least squares, the scatter of neighbours being alike.

    And the degrees of freedom that they are known by.
    """
    n, free = columns.shape[0], columns.shape[0] - columns.shape[1]
    variance = float(rest @ rest) / max(free, 1)
    alike = 1.0
    for lag in range(1, n // 4):
        rho = float(rest[lag:] @ rest[:-lag]) / max(float(rest @ rest), 1e-300)
        if rho < 2.0 / math.sqrt(n):
            break
        alike += 2.0 * rho
    error = np.sqrt(variance * alike * np.diag(np.linalg.inv(columns.T @ columns)))
    return np.asarray(error), max(free / alike, 1.0)


def drive_phase(x: FloatArray, step: float, *, frequency: float) -> tuple[Course, float] | None:
    """Phase of a driven channel, cycle by cycle, and the frequency that it is counted from.

    While a base starts or stops, its phase is as unsure as its amplitude changes.

    Parameters
    ----------
    x : array (n,)
        `step` s apart, some 48 a cycle.
    step, frequency : float
        s, Hz; of the drive, within a per cent.

    Returns
    -------
    Course (rad) and float (Hz), or None for a record under 12 cycles, or a channel at rest.
    """
    found = sine_windows(x, step, frequency=frequency, cycles=1, fewest=_FEWEST)
    if found is None or not float(np.median(np.abs(found.first))) > SURE * found.noise:
        return None
    middle = found.every * (np.arange(found.phase.size) + 0.5)
    level = np.abs(found.first)
    unsure = np.hypot(found.noise, np.gradient(level))
    weight = level / np.maximum(unsure, _EXACT * level.max())
    return Course(np.asarray(middle), found.phase, found.every, weight=weight), found.frequency


def lag_over_time(a: FloatArray, x: FloatArray, step: float, *, frequency: float) -> Course | None:
    """Lag of a displacement behind an acceleration (s), window by window of four cycles.

    Windows in which the two do not move together are left out. A filter of one channel (an AC
    coupling, a mount) turns the phase of a motion whose size or frequency changes: that is no
    clock, and stands beside the lag.
    """
    size = round(_LAG_CYCLES / (frequency * step))
    n = min(a.size, x.size)
    a, x = parts_of(a[:n], size), parts_of(x[:n], size)
    if len(a) < _FEWEST:
        return None
    near, w = lines_between(size, step, AT_IT, frequency)
    A, X = second_derivative_beside(a, x, step, w, near)
    power = (np.abs(X) ** 2).sum(axis=1)
    ratio = (A * X.conj()).sum(axis=1) / np.maximum(power, 1e-300)
    error = _error_of_phase(ratio, np.maximum(np.sqrt(power), 1e-300))
    good = error < _ALIKE
    if good.sum() < _FEWEST:
        return None
    sign = np.sign(float(np.median(ratio[good].real))) or 1.0
    lag = np.unwrap(np.angle(sign * ratio[good])) / (2.0 * math.pi * frequency)
    middle = np.asarray((max(size // 2, 1) * np.flatnonzero(good) + 0.5 * size) * step)
    changes = _changes(A, a, near)[good]
    beside = np.stack([changes.real, changes.imag], axis=1)
    return Course(middle, lag, 0.5 * size * step, shared=2, weight=1.0 / error[good], beside=beside)


def _changes(A: ComplexArray, a: FloatArray, near: BoolArray) -> ComplexArray:
    """How much the motion of each window changes within it: 0 where it stays the same.

    A filter H makes H X + i H' T of the lines X, T being those by the slope of the taper.
    """
    size = a.shape[1]
    slope = np.sin(2.0 * np.pi * (np.arange(size) + 0.5) / size)
    T = np.fft.rfft((a - a.mean(axis=1, keepdims=True)) * slope)[:, near]
    power = (np.abs(A) ** 2).sum(axis=1)
    return np.asarray((T * A.conj()).sum(axis=1) / np.maximum(power, 1e-300))


def _error_of_phase(ratio: ComplexArray, size: FloatArray) -> FloatArray:
    """Standard error of the phase of each ratio, rad, by how much neighbours differ.

    Noise counts for more where the motion is small, as a decay is at its end; other disturbances
    do not. The half of the windows that moves most shows these, the other half the noise. Nowhere
    is the error less than the scatter there: a mass that rubs comes to rest sooner than it decays.
    """
    turned = np.abs(np.angle(ratio[2:] * ratio[:-2].conj()))  # neighbours share samples
    both = np.hypot(1.0 / size[2:], 1.0 / size[:-2])
    large = both <= np.median(both)
    noise = OF_MEDIAN * median_of((turned / both)[~large])
    seen = OF_MEDIAN * float(np.median(turned[large])) / math.sqrt(2.0)
    by_noise = noise * float(np.median(both[large])) / math.sqrt(2.0)
    always = math.sqrt(max(seen**2 - by_noise**2, 1e-18))
    there = ndimage.median_filter(turned, _SCATTER_OF, mode="nearest")
    scatter = OF_MEDIAN / math.sqrt(2.0) * np.pad(there, 1, mode="edge")
    return np.asarray(np.maximum(np.hypot(always, noise / size), scatter))


_SCATTER_OF = 7  # windows in a row, of which one step moves two


def fault_of(
    view: RecordView, record: Record, frequency: float, *, together: bool = False
) -> Correction | None:
    """The most certain fault of a record's clocks, as what mends it.

    Parameters
    ----------
    view : RecordView
    record : Record
        Its row: id and test. The base of a periodic test moves as a steady sine; a decay has no
        phase that is known beforehand.
    frequency : float
        Of the drive, or of the oscillation, Hz.
    together : bool
        Whether its recorders were laid over one another already.
    """
    driven = record.test == "periodic" and "base" in view.roles
    looked_for = (
        _long_gaps, *[_start_of_recorders] * (not together),
        *(_driven_part, _lost_by_all) * driven, _between_channels, _jump,
    )  # fmt: skip
    found = (look(view, record, frequency) for look in looked_for)
    return next((one for one in found if one is not None), None)


def _kept(
    view: RecordView, record: Record, begin: int, end: int, seen: str, *,
    late: str = "", count: int = 0, ordinary: bool = False, from_rest: bool = False,
) -> Correction:  # fmt: skip
    """The samples `begin` to `end` alone, the longest part of a record that is whole.

    Parameters
    ----------
    seen : what shows that the rest is not to be used, in words.
    late : the channel that alone lost samples before it ('' where none), by `count` samples.
    ordinary : the rest is another test, and nothing is wrong with the recorder.
    from_rest : before it nothing moved.
    """
    span = f"from {view.moment(begin)} to {view.moment(end - 1)}"
    check = Check(
        record.id, "clock", "warning",
        f"{seen}; only the longest part, {span}, is used. Look at the recorder",
    )  # fmt: skip
    if ordinary:
        detail = f"{seen}: only the part in which it has its amplitude, {span}, is used"
        check = Check(record.id, "base motion", "ok", detail)
    # Of the part after it the channels stand beside one another again, to a sample or two.
    streams = {
        role: samples_of(view, role, begin + count * (role != late), end) for role in view.roles
    }
    known = {FROM_REST: 1} if from_rest else {}
    return Correction([check], streams, float(view.time(begin, begin + 1)[0]), attributes=known)


def _long_gaps(view: RecordView, record: Record, frequency: float) -> Correction | None:
    """The longest part without a gap of some channel that is too long to be filled."""
    lost = np.concatenate([
        np.any([~np.isfinite(x) for x in blocks], axis=0)
        for blocks in zip(*(samples_of(view, role) for role in view.roles), strict=True)
    ])  # fmt: skip
    limit = _LONG * view.sample_rate / frequency
    gaps = [gap for gap in runs_of(lost) if gap[1] - gap[0] > limit]
    ends, begins = [*(gap[0] for gap in gaps), view.n], [0, *(gap[1] for gap in gaps)]
    longest = max(zip(begins, ends, strict=True), key=lambda part: part[1] - part[0])
    times = "once" if len(gaps) == 1 else f"{len(gaps)} times"
    seen = f"a channel shows nothing for longer than half a period of the motion, {times}"
    return _kept(view, record, *longest, seen) if gaps else None


def _driven_part(view: RecordView, record: Record, frequency: float) -> Correction | None:
    """The part of a record in which the base moves, of a shaker that is switched within it."""
    k, step, (base,) = coarse_channels(view, frequency, POINTS, "base")
    size = round(1.0 / (frequency * step))
    windows = base[: base.size // size * size].reshape(-1, size)
    if len(windows) < _FEWEST:
        return None
    moved = np.abs(sines_of_windows(windows, step, frequency)[0][:, 0])
    moves = moved > _STILL * float(np.quantile(moved, 0.9))
    if not moves.any():  # a channel that is off
        return None
    full = moved > _STARTS * float(np.median(moved[moves]))

    def left_out(way: int) -> int:
        """Cycles at one end; that in which a shaker is switched is left out, too."""
        return 0 if moves[::way][0] else 1 + int(np.argmax(full[::way]))

    begin, end = left_out(1), len(windows) - left_out(-1)
    if (begin, end) == (0, len(windows)) or end - begin < _FEWEST:
        return None
    last = view.n if end == len(windows) else end * size * k
    seen = "the base stands still, starts or stops within the record"
    return _kept(
        view, record, begin * size * k, last, seen, ordinary=True, from_rest=begin > 0
    )  # fmt: skip


#: Of its usual amplitude, below which a base is at rest, or starts or stops.
_STILL, _STARTS = 0.1, 0.9


def _start_of_recorders(view: RecordView, record: Record, frequency: float) -> Correction | None:
    """How late the recorder of the displacement stands beside that of the acceleration.

    Both show the velocity of the mass. Of a motion that repeats, the shift by the fewest periods
    counts: the others are as good.
    """
    groups = [one.split(",") for one in str(view.attributes.get(RECORDERS, "")).split(";")]
    own = next((tuple(one) for one in groups if "displacement" in one), ())
    if not own or "acceleration" in own or "acceleration" not in view.roles:
        return None
    k, step, (a, x) = coarse_channels(view, frequency, FINE_POINTS, "acceleration", "displacement")
    v_a = _velocity(a, step, frequency, -1)
    # A steady motion of two clocks is most alike where the least of it overlaps.
    law, t = law_of(lag_over_time(a, x, step, frequency=frequency)), step * np.arange(x.size)
    slopes = [law.slope] if law is not None and law.slopes and law.straight else []
    tried = (np.interp(t, (1.0 - slope) * t, x) for slope in (*slopes, 0.0))
    near = _TOGETHER / (step * frequency)
    shifts = (_best_shift(v_a, _velocity(one, step, frequency, 1), near=near) for one in tried)
    best, shift, others = max(shifts, key=lambda one: one[0])
    if best < _MOVE_ALIKE or abs(shift) * step * frequency <= _TOGETHER:
        return None
    samples = shift * k  # by which the first come late
    periods = ", or whole periods of it more or less, as it repeats" if others else ""
    detail = (
        f"the recorders of {' and '.join(own)} and of the acceleration did not start together: the "
        f"motion comes {samples / view.sample_rate:+.4g} s later in the first{periods}; they are "
        "aligned by the motion. Start both with one trigger"
    )
    first, n = max(-samples, 0), view.n - abs(samples)
    begins = {role: first + samples * (role in own) for role in view.roles}
    streams = {role: samples_of(view, role, i, i + n) for role, i in begins.items()}
    start = float(view.time(first, first + 1)[0])
    return Correction([Check(record.id, _STARTED, "warning", detail)], streams, start)


def _best_shift(v_a: FloatArray, v_x: FloatArray, *, near: float) -> tuple[float, int, bool]:
    """How alike two records of one motion are at most, where, and whether elsewhere as well.

    Of the shifts by which the second comes later at which they are, in samples, the smallest. A
    motion that repeats and is nearly as alike `near` no shift has none: of samples that were lost
    in one of the two, parts are more alike whole periods apart.
    """
    n = v_a.size
    late = np.arange(-int(_OVERLAP * n), int(_OVERLAP * n) + 1)
    size = 1 << (2 * n - 1).bit_length()
    both = np.fft.irfft(np.fft.rfft(v_x, size) * np.fft.rfft(v_a, size).conj(), size)[late]
    # By the power that each of the two has where they overlap.
    power_a, power_x = (np.concatenate([[0.0], np.cumsum(v**2)]) for v in (v_a, v_x))
    begin, end = np.maximum(late, 0), np.minimum(n + late, n)
    shared = (power_x[end] - power_x[begin]) * (power_a[end - late] - power_a[begin - late])
    alike = both / np.sqrt(np.maximum(shared, 1e-12 * power_a[-1] * power_x[-1] + 1e-300))
    # Peaks between samples: a period is no whole number of them.
    top = 1 + np.flatnonzero((alike[1:-1] >= alike[:-2]) & (alike[1:-1] > alike[2:]))
    below, above = alike[top - 1], alike[top + 1]
    bend = np.minimum(below - 2.0 * alike[top] + above, -1e-300)
    high = alike[top] - (below - above) ** 2 / (8.0 * bend)
    best = float(high.max(initial=0.0))
    good = top[1.0 - high <= _AS_GOOD * (1.0 - best) + _SAME_MOTION]
    several = good.size > 1
    at_hand = top[(np.abs(late[top]) <= near) & (high > _NEARLY)]
    good = at_hand if several and at_hand.size else good
    shift = int(late[good[np.argmin(np.abs(late[good]))]]) if good.size else 0
    return best, shift, several


def _velocity(y: FloatArray, step: float, frequency: float, order: int) -> FloatArray:
    """Velocity of the mass by a channel, differentiated `order` times, without its ends."""
    edge = round(_EDGE / (frequency * step))
    inside = np.minimum(np.arange(y.size), np.arange(y.size)[::-1])
    f = np.fft.rfftfreq(y.size, step)
    seen = (f > _SHOWS[0] * frequency) & (f < _SHOWS[1] * frequency)
    turn = np.where(seen, (2j * math.pi * np.where(seen, f, 1.0)) ** order, 0.0)
    tapered = (y - y.mean()) * np.minimum(1.0, inside / edge)
    return np.fft.irfft(np.fft.rfft(tapered) * turn, y.size)[2 * edge : y.size - 2 * edge]


def _between_channels(view: RecordView, record: Record, frequency: float) -> Correction | None:
    """What the lag between acceleration and displacement shows."""
    if not {"acceleration", "displacement"} <= set(view.roles):
        return None
    # Impacts must not alias into the means.
    k, step, (a, x) = coarse_channels(view, frequency, FINE_POINTS, "acceleration", "displacement")
    free = free_sample(view, frequency=frequency) // k
    law = law_of(lag_over_time(a[free:], x[free:], step, frequency=frequency))
    if law is None:
        return None
    rate, length = view.sample_rate, view.n / view.sample_rate
    steps = law.steps and abs(law.step) * rate > 1.0 - _WHOLE
    if steps and not _delays(a[free:], x[free:], step, frequency, law):
        return None
    drifts = law.slopes and (law.straight or steps) and abs(law.slope) * length * rate > _DRIFTS
    if steps and not drifts:  # of two clocks what is lost shows when they are one
        # A displacement that comes earlier beside the acceleration has lost samples.
        role = "displacement" if law.step < 0.0 else "acceleration"
        seen = f"its lag beside the other channels steps by {1e3 * abs(law.step):.3g} ms"
        at, reach = free * k + law.at * rate, _LAG_CYCLES * rate / frequency
        return _lost_at(view, record, at, reach, seen, role, round(abs(law.step) * rate))
    if not drifts:
        return None
    role = _of_its_own(view, frequency, law.slope)
    detail = (
        f"{role} comes from a recorder whose clock differs by {100.0 * law.slope:+.4g} +- "
        f"{100.0 * law.slope_error:.1g} % from that of the other channels: the lag between "
        f"acceleration and displacement drifts by {1e3 * law.slope * length:.3g} ms over the "
        "record; it is brought to their clock"
    )
    check = Check(record.id, "clock", "warning", detail)
    # Polynomials through samples do not follow an impact, so the acceleration keeps its own.
    moved = [one for one in view.roles if (one == role) == (role == "displacement")]
    streams = {one: _on_clock(view, one, 1.0 - law.slope) for one in moved}
    own = rate * (1.0 - law.slope) if role == "acceleration" else None
    return Correction([check], streams, sample_rate=own)


def _delays(a: FloatArray, x: FloatArray, step: float, frequency: float, law: Law) -> bool:
    """Whether the lag steps above the oscillation as well, or nothing moves there to show it.

    Lost samples turn the phase of each line by w times the step. A sensor whose spikes leave a
    tail, or one that moves across its axis, turns that of the oscillation as its motion changes.
    """
    size = round(_LAG_CYCLES / (frequency * step))
    n = min(a.size, x.size)
    above, w = lines_between(size, step, ABOVE_IT, frequency)
    a, x = (parts_of(y[:n], size) for y in (a, x))
    A, X = second_derivative_beside(a, x, step, w, above)
    middle = (max(size // 2, 1) * np.arange(len(A)) + 0.5 * size) * step
    cross = A * X.conj() * np.exp(-1j * law.slope * w * middle[:, np.newaxis])  # of one clock
    apart = 0.5 * size * step  # a window across the step shows a mixture
    parts = [cross[middle < law.at - apart], cross[middle > law.at + apart]]
    sums = [part.sum(axis=0) for part in parts]
    sizes = [np.maximum(np.abs(part).sum(axis=0), 1e-300) for part in parts]
    both = np.minimum(*(np.abs(one) / of for one, of in zip(sums, sizes, strict=True)))
    if (both > _COHERENT).sum() < _FEWEST_LINES:
        return True
    turned = np.angle(sums[1] * sums[0].conj())
    weight = np.where(both > _COHERENT, np.minimum(*np.abs(sums)), 0.0)
    return float(weight @ np.cos(turned - w * law.step)) > float(weight @ np.cos(turned))


def _lost_at(
    view: RecordView, record: Record, at: float, reach: float, seen: str, role: str = "",
    count: int = 0,
) -> Correction:  # fmt: skip
    """The longer part of a record of which samples are lost within `reach` of one."""
    first, last = max(round(at - reach), 1), min(round(at + reach), view.n - 1)
    seen = f"{role or 'all channels'}: samples are lost at {view.moment(round(at))}, where {seen}"
    if view.n - last > first:
        return _kept(view, record, last, view.n, seen, late=role, count=count)
    return _kept(view, record, 0, first, seen)


def _lost_by_all(view: RecordView, record: Record, frequency: float) -> Correction | None:
    """Samples that all channels lost: a step in the phase of the base, of a sample or more."""
    _, step, (base,) = coarse_channels(view, frequency, POINTS, "base")
    found = drive_phase(base, step, frequency=frequency)
    law = None if found is None else law_of(found[0])
    if found is None or law is None or not law.steps:
        return None
    rate = view.sample_rate
    period = rate / (found[1] + law.slope / (2.0 * math.pi))
    # A whole period more cannot be seen, and samples do not come twice.
    count = (law.step / (2.0 * math.pi) * period) % period
    if not 1.0 - _WHOLE < count < period - (1.0 - _WHOLE):
        return None
    seen = f"the phase of the drive steps by {abs(law.step):.3g} rad"
    return _lost_at(view, record, law.at * rate, 1.5 * found[0].every * rate, seen)


def _jump(view: RecordView, record: Record, frequency: float) -> Correction | None:
    """Where a displacement jumps and goes on about the same middle: nothing that moves does.

    The parabolas through a few samples before and after each sample part there by several times
    more than anywhere else, and by as much where they are drawn through three times as many: an
    impact bends the motion, and a wrong sample is alone. A sensor that was moved has another
    middle afterwards.
    """
    if "displacement" not in view.roles:
        return None
    n, period = min(view.n, _MOST_SAMPLES), round(view.sample_rate / frequency)
    if n < 8 * period or period < 12 * _JUMP:
        return None

    def read(begin: int, end: int) -> FloatArray:
        return fill_gaps(view.read("displacement", max(begin, 0), min(end, n)))

    def parting(begin: int, end: int, m: int) -> FloatArray:
        first = begin - max(begin - 2 * period, 0)
        return _parting(read(begin - 2 * period, end + 2 * period), m)[first:][: end - begin]

    blocks = [(begin, min(begin + BLOCK, n)) for begin in range(0, n, BLOCK)]
    place, size = 0, 0.0
    for begin, end in blocks:
        near = parting(begin, end, _JUMP)
        top = int(np.argmax(np.abs(near)))
        if abs(near[top]) > abs(size):
            place, size = begin + top, float(near[top])
    far = float(parting(place, place + 1, 3 * _JUMP)[0])
    if abs(far - size) > 0.3 * abs(size) or min(place, n - place) < 2 * period:
        return None
    sides = (place - 2 * period, place), (place, place + 2 * period)
    middle = [float(read(*own).mean()) for own in sides]
    if abs(middle[1] - middle[0]) > 0.5 * abs(size):
        return None
    for begin, end in blocks:
        elsewhere = np.abs(np.arange(begin, end) - place) > 2 * _JUMP
        largest = np.abs(parting(begin, end, _JUMP)[elsewhere]).max(initial=0.0)
        if abs(size) < _STANDS_OUT * largest:
            return None
    seen = "the displacement jumps and continues around the same mean"
    return _lost_at(view, record, place, 0.0, seen)


def _parting(x: FloatArray, m: int) -> FloatArray:
    """Parabola through the m samples from each on, at it, less that through the m before it."""

    def weights(ahead: int) -> FloatArray:
        s = np.arange(ahead, m + ahead) / m
        return np.asarray(np.linalg.pinv(np.stack([np.ones(m), s, s * s], axis=1))[0])

    after = np.convolve(x, weights(0)[::-1], mode="valid")[m:]
    before = np.convolve(x, weights(1), mode="valid")[: after.size]
    out = np.zeros(x.size)
    out[m : m + after.size] = after - before
    return out


def _of_its_own(view: RecordView, frequency: float, ratio: float) -> str:
    """Which of acceleration and displacement has a clock of its own: the one apart from the base.

    Files say which channels one recorder has. Without a base channel the displacement is believed.
    """
    if "base" not in view.roles:
        return "acceleration"
    for one in str(view.attributes.get(RECORDERS, "")).split(";"):
        if "base" in one.split(",") and len(one.split(",")) == 2:
            return "acceleration" if "displacement" in one else "displacement"
    _, step, both = coarse_channels(view, frequency, POINTS, "base", "displacement")
    base, moved = (drive_phase(x, step, frequency=frequency) for x in both)
    if base is None or moved is None:
        return "acceleration"
    slopes = [
        (np.polyfit(series.time, series.value, 1)[0] / (2.0 * math.pi) + f) / base[1] - 1.0
        for series, f in (base, moved)
    ]
    apart = slopes[1] - slopes[0]
    # The lag of the displacement grows with `ratio` where its own clock is slow by as much.
    return "displacement" if abs(apart + ratio) < abs(apart) else "acceleration"


def mend_clocks(path: Path, record: Record) -> list[Check]:
    """Look for lost samples and second clocks in a stored record, and mend what is certain.

    Where samples are lost the longer part is kept; a channel of another recorder is brought onto
    the clock of the others.

    Parameters
    ----------
    path : Path
        records/<id>.nc; written anew where something is mended.
    record : Record
        Its row: id, test and frequency.

    Returns
    -------
    list of Check
        A warning for each fault.
    """
    checks: list[Check] = []
    for _ in range(_MOST):
        together = any(check.check == _STARTED for check in checks)
        find = partial(fault_of, together=together)
        found = [one for one in correct(path, record, find, even=False) if one not in checks]
        if not found:
            break
        checks += found
    return checks


def _on_clock(view: RecordView, role: str, interval: float) -> Iterator[FloatArray]:
    """A channel at the times of another recorder, of which its own samples are `interval` apart."""
    resampler = Resampler(0.0, 1.0, min(int((view.n - 1) * interval) + 1, view.n))
    uneven = (
        (interval * np.arange(first, first + x.size, dtype=np.float64), x[:, np.newaxis])
        for first, x in view.blocks(role)
    )
    for block in resampler.blocks(uneven):
        yield block[:, 0]
