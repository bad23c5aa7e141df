"""Acceleration beside displacement: do they agree in sign, size and time?

Whatever the mass does, impacts included, its acceleration is the second derivative of its
displacement: A(w) = -w^2 X(w). Near the oscillation both are far above their noise, so that the
ratio gives the accelerometer's gain beside the laser's, a wrong sign, and the lag of one channel,
each to a small fraction of what a single impact would.

A delay between two channels, distinguished from the AC coupling of one of them.

At a single frequency both are a phase. Over frequency a delay grows as w lag, and the lead of an
AC-coupled sensor, one pole at the corner fc, falls as atan(fc/f). Impacts give the mass motion far
above its oscillation, where the two part.

An accelerometer that shows some of a motion across its axis is neither: it is late or early at the
oscillation and at no other frequency. Taken for a delay it would move every impact.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np
from scipy import special

from vinesexp.arrays import BoolArray, ComplexArray, FloatArray
from vinesexp.errors import RecordError
from vinesexp.records.stored.store import RecordView
from vinesexp.signals.means import coarse_channels
from vinesexp.units import SURE

#: Means a period where there are impacts: their harmonics alias into what is coarser.
FINE_POINTS = 400
#: Of the oscillation: lines that are its own, and those above it that impacts fill.
AT_IT, ABOVE_IT = (0.8, 1.2), (1.6, 12.0)
_CYCLES = (5.0, 12.0)  # periods in a segment, as the record allows: lines are f0 over these wide
_FEWEST = 8  # segments
_GROUPS = 8  # of segments, each left out in turn
_TOPS = 3  # lines of which a top is the highest; between tops the oscillation leaks in
_LINES = 2  # tops, fewest
_COHERENT = 0.5  # squared coherence that a line must have
_AS_LARGE = 1.5  # times the usual ratio of the channels: lines beyond are not the mass's motion
#: Of the oscillation, from where on exchanged channels are told apart; ln of how near to their law.
_TOLD_APART, _EXCHANGED = 1.9, math.log(2.0)
_TURNED, _OUTLYING = 0.1, 5.0  # rad; times the usual distance from the usual lag
_USUAL = 0.1  # of the oscillation: mean of the corners of AC-coupled sensors
_STEPS = 20
_NOTHING = 100.0  # times the usual corner: an error that says nothing
_FITS = 10.0  # mean square misfit of a corner, over that of a phase at the oscillation alone
_ACROSS = 0.01  # of the ratio at the oscillation
_ROOT = math.sqrt(2.0 * math.pi)
_MOST_TURNED = 1.5  # rad
_QUARTER = 0.2  # relative: of a quarter of a period, and of the size of a velocity
#: Rad between channels of one motion; what no sensor's lag or corner makes.
_STEP, _NO_STEP = 0.1, 0.5

#: What the forms of contact and sensor leave in records without a corner, in periods and in f0.
_LAG_FLOOR, _CORNER_FLOOR = 1e-4, 5e-4
_MOST_SHARED = 0.3  # of the phase at the oscillation, shared by the lines above, if it is its own


#: Lines of the acceleration and of the displacement's second derivative in many segments, and where
#: they lie, rad/s.
Lines = tuple[ComplexArray, ComplexArray, FloatArray]


@dataclass(frozen=True)
class Agreement:
    """Acceleration over second derivative of displacement.

    Attributes
    ----------
    gain, gain_error : float
        1 where both are calibrated; negative where one channel has the wrong sign.
    lag, lag_error : float
        By which the displacement comes late beside the acceleration, s.
    phase_lag, phase_lag_error : float
        The phase at the oscillation taken for a lag, as if there were no corner, s.
    corner, corner_error : float
        Below which an AC-coupled accelerometer loses the motion, Hz; NaN where the record cannot
        part a corner from a lag.
    across, across_error : float
        Phase by which the acceleration is behind at the oscillation and nowhere else, rad: of a
        sensor that shows motion across its axis. 0 where it shows none.
    """

    gain: float
    gain_error: float
    lag: float
    lag_error: float
    phase_lag: float = math.nan
    phase_lag_error: float = math.nan
    corner: float = math.nan
    corner_error: float = math.nan
    across: float = 0.0
    across_error: float = 0.0

    def as_attributes(self) -> dict[str, object]:
        """For the attributes of a file; `agreement_in` reads them."""
        return {f"agreement_{name}": value for name, value in asdict(self).items()}


def agreement_in(attributes: Mapping[str, Any]) -> Agreement | None:
    """The agreement that was written into a file's attributes; None where there is none."""
    names = [field.name for field in fields(Agreement)]
    if any(f"agreement_{name}" not in attributes for name in names):
        return None
    return Agreement(*(float(attributes[f"agreement_{name}"]) for name in names))


def compare_channels(
    acceleration: FloatArray, displacement: FloatArray, step: float, *, frequency: float,
    corner: float = 0.0,
) -> Agreement | None:  # fmt: skip
    """Compare two channels of one record; None where the record is too short for it.

    Parameters
    ----------
    acceleration, displacement : arrays (n,)
        m/s^2 and m, on the same time axis, `step` s apart (means over the same samples).
    frequency : float
        Of the oscillation, Hz.
    corner : float
        Of an AC-coupled accelerometer, Hz: what it takes from the acceleration is given back.

    Examples
    --------
    >>> t = np.arange(4000) / 400.0
    >>> w = 2 * np.pi * 8.0
    >>> found = compare_channels(
    ...     2.0 * np.sin(w * t), -2.0 / w**2 * np.sin(w * (t - 1e-4)), 1 / 400.0, frequency=8.0)
    >>> round(found.gain, 6), round(found.lag, 7)
    (1.0, 0.0001)
    """
    n = min(acceleration.size, displacement.size)
    if n * step * frequency < 8.0:
        return None
    near, w = lines_between(n, step, AT_IT, frequency)
    A, Y = second_derivative_beside(acceleration[:n], displacement[:n], step, w, near)
    A = A * (1.0 - 2j * math.pi * corner / w)
    power = float((np.abs(Y) ** 2).sum())
    if power == 0.0 or near.sum() < 4:
        return None
    # A lag turns the ratio by w lag; sign first, then gain and lag together.
    ratio = complex((A * Y.conj()).sum() / power)
    sign = -1.0 if ratio.real < 0.0 else 1.0
    middle = float((w * np.abs(Y) ** 2).sum() / power)
    lag = math.atan2(sign * ratio.imag, sign * ratio.real) / middle
    turned = Y * np.exp(1j * w * lag)
    gain = float((A * turned.conj()).real.sum() / power)
    rest = A - gain * turned
    # Hann: neighbouring lines share 1.5 times the noise of independent ones.
    error = math.sqrt(1.5 * float((np.abs(rest) ** 2).mean()) * 0.5 / power)
    if gain == 0.0:  # a channel that is as good as dead agrees with nothing
        return None
    lag_error = error / (abs(gain) * middle)
    return Agreement(gain, error, lag, lag_error, lag, lag_error)


def pulse_share(
    record: RecordView, times: FloatArray, jumps: FloatArray, *, frequency: float
) -> float:
    """Share of the acceleration at the oscillation that is made of the pulses of impacts.

    Where a contact or a mount rings, so that areas of pulses read too large by a share p, the gain
    of the acceleration beside the displacement reads too large by this share times p.

    Parameters
    ----------
    record : RecordView
        With a displacement.
    times : array (k,)
        Of the impacts, on the record's own axis, s.
    jumps : array (k,)
        Of the velocity, m/s.
    frequency : float
        Of the oscillation, Hz.
    """
    k, step, (x,) = coarse_channels(record, frequency, FINE_POINTS, "displacement")
    near, w = lines_between(x.size, step, AT_IT, frequency)
    X = second_derivative_beside(x, x, step, w, near)[1]
    power = float((np.abs(X) ** 2).sum())
    since = times - record.start - 0.5 * (k - 1) / record.sample_rate
    pulses = lines_of_pulses(since, jumps, step, x.size, w)
    return float((pulses * X.conj()).real.sum()) / max(power, 1e-300)


def lines_of_pulses(
    times: FloatArray, jumps: FloatArray, step: float, size: int, w: FloatArray
) -> ComplexArray:
    """Tapered transform of the impacts within `size` samples from time 0 on, as an acceleration."""
    inside = (times > -0.5 * step) & (times < (size - 0.5) * step)
    t = times[inside]
    taper = 0.5 - 0.5 * np.cos(2.0 * math.pi * (t / step + 0.5) / size)
    return np.asarray(np.exp(-1j * np.outer(w, t)) @ (taper * jumps[inside] / step))


def agreement_of(record: RecordView, *, frequency: float) -> Agreement | None:
    """Compare the two channels of a record; None where one is missing.

    Raises
    ------
    RecordError
        The displacement is a velocity.
    """
    if not {"acceleration", "displacement"} <= set(record.roles):
        return None
    means = _means(record, frequency)
    found = compare_channels(*means, frequency=frequency)
    _refuse_base(record, found, frequency)
    if found is None:
        return None
    turned, velocity = 4.0 * frequency * abs(found.lag), 2.0 * math.pi * frequency * abs(found.gain)
    if abs(turned - 1.0) < _QUARTER and abs(math.log(velocity)) < _QUARTER:
        raise RecordError(
            "the displacement is a quarter of a period from the acceleration, and as large as its "
            "integral: the channel shows a velocity; write quantity: velocity in campaign.yaml"
        )
    lines = _lines(*means, frequency=frequency)
    _refuse_exchanged(found, lines, frequency)
    law = _law_beside(found, lines, frequency)
    if law is None:  # one frequency cannot part a lag from a corner, which takes of the gain too
        error = math.hypot(found.lag_error, found.lag)
        turned = min(2.0 * math.pi * frequency * abs(found.lag), _MOST_TURNED)
        lost = abs(found.gain) * (1.0 / math.cos(turned) - 1.0)
        return replace(found, lag_error=error, phase_lag_error=error,
                       gain_error=math.hypot(found.gain_error, lost))  # fmt: skip
    if law.has_corner:
        without = compare_channels(*means, frequency=frequency, corner=law.corner)
        if without is not None:
            found = replace(found, gain=without.gain, gain_error=without.gain_error)
    return _with_corner(found, law, frequency)


def _refuse_base(record: RecordView, found: Agreement | None, frequency: float) -> None:
    """Refuse a record whose acceleration is that of its base channel, and not of the displacement.

    Raises
    ------
    RecordError
        Base and displacement are exchanged, or the accelerometer is on the base.
    """
    if "base" not in record.roles or record.quantity("base") != "displacement":
        return
    means = _means(record, frequency, beside="base")
    base = compare_channels(*means, frequency=frequency)
    if base is None or not _in_step(base, _STEP, frequency) or not _oscillates(means, frequency):
        return
    alike = abs(math.log(abs(base.gain))) < _QUARTER
    own = found is not None and _in_step(found, _NO_STEP, frequency)
    if found is None or not own or (alike and abs(math.log(abs(found.gain))) > math.log(2.0)):
        raise RecordError(
            "the acceleration is the second derivative of the base channel, not of the "
            "displacement: base and displacement are exchanged in this record, or the "
            "accelerometer is on the base; correct the channels"
        )


def _oscillates(means: tuple[FloatArray, FloatArray, float], frequency: float) -> bool:
    """Whether an acceleration is most of all an oscillation, and no train of pulses.

    What impacts give a mass that is driven at its resonance is, at that frequency, what the base
    gives it: where a converter is so coarse that it shows the pulses alone, these are in step with
    the base.
    """
    a, other, step = means
    power = []
    for band in (AT_IT, ABOVE_IT):
        near, w = lines_between(a.size, step, band, frequency)
        A, _ = second_derivative_beside(a, other, step, w, near)
        power.append(float((np.abs(A) ** 2).sum()))
    return power[0] > power[1]


def _refuse_exchanged(found: Agreement, lines: Lines | None, frequency: float) -> None:
    """Refuse a record whose displacement is the second derivative of its acceleration.

    At the oscillation alone each is the other by a factor. Where the mass moves above it, the
    ratio of a line to that at the oscillation is 1, or (f0/f)^4 for exchanged channels.

    Raises
    ------
    RecordError
        The two are exchanged.
    """
    if lines is None:
        return
    A, X, w = lines
    cross, power_x, _, use = _coherent(A, X)
    use &= w > 2.0 * math.pi * _TOLD_APART * frequency
    if use.sum() < _LINES:
        return
    ratio = np.log(np.abs(cross[use]) / power_x[use] / abs(found.gain))
    exchanged = ratio + 4.0 * np.log(w[use] / (2.0 * math.pi * frequency))
    if float(np.median(np.abs(exchanged))) < _EXCHANGED:
        raise RecordError(
            "the displacement is the second derivative of the acceleration: the two channels are "
            "exchanged in this record; exchange their columns in campaign.yaml"
        )


def _in_step(found: Agreement, most: float, frequency: float) -> bool:
    """Whether two channels show one motion, by any gain and at most so late, rad."""
    sure = found.gain_error < _QUARTER * abs(found.gain)
    return sure and 2.0 * math.pi * frequency * abs(found.lag) < most


def law_in(record: RecordView, *, frequency: float) -> PhaseLaw | None:
    """What the channels of a record say of each other over frequency; None where one is missing."""
    if not {"acceleration", "displacement"} <= set(record.roles):
        return None
    means = _means(record, frequency)
    found = compare_channels(*means, frequency=frequency)
    if found is None:
        return None
    return _law_beside(found, _lines(*means, frequency=frequency), frequency)


def _law_beside(found: Agreement, lines: Lines | None, frequency: float) -> PhaseLaw | None:
    """The law of all segments, as unsure as it is without some of them: jackknife.

    The release of a mass, or one blow, fills all lines of one segment, and is one witness.
    """
    if lines is None:
        return None
    A, X, w = lines
    own = (found.lag, found.lag_error, found.gain)
    law = law_of_lines(A, X, w, frequency=frequency, own=own)
    group = np.arange(len(A)) * _GROUPS // len(A)
    without = [
        law and law_of_lines(A[group != k], X[group != k], w, frequency=frequency, own=own)
        for k in range(_GROUPS)
    ]
    known = [one for one in without if one is not None]
    if law is None or len(known) < _GROUPS:
        return None

    def error(name: str) -> float:
        scatter = float(np.std([getattr(one, name) for one in known]))
        return max(float(getattr(law, f"{name}_error")), math.sqrt(_GROUPS - 1.0) * scatter)

    return replace(
        law, lag_error=error("lag"), corner_error=error("corner"), above_error=error("above"),
        spread_error=error("spread"),
    )  # fmt: skip


def _means(
    record: RecordView, frequency: float, beside: str = "displacement"
) -> tuple[FloatArray, FloatArray, float]:
    """Means of the acceleration and of another channel, and s between them."""
    _, step, (a, x) = coarse_channels(record, frequency, FINE_POINTS, "acceleration", beside)
    return a, x, step


def _with_corner(found: Agreement, law: PhaseLaw, frequency: float) -> Agreement:
    """What the phase over all frequencies says of the phase at one.

    A corner takes its part of the phase at the oscillation, which alone knows the lag best.
    """
    if law.only_at_oscillation:
        w = 2.0 * math.pi * frequency
        error = math.hypot(found.lag_error, law.above_error)
        return replace(
            found, lag=law.above, lag_error=law.above_error,
            phase_lag=law.above, phase_lag_error=law.above_error,
            across=w * (law.above - found.lag), across_error=w * error,
        )  # fmt: skip
    lead, error = expected_lead(law.corner, law.corner_error, frequency=frequency)
    return replace(
        found, lag=found.lag - lead, lag_error=math.hypot(found.lag_error, error),
        corner=law.corner, corner_error=law.corner_error,
    )  # fmt: skip


def expected_lead(corner: float, error: float, *, frequency: float) -> tuple[float, float]:
    """By how much a sensor leads at the oscillation, as a time (s) and its standard error.

    Three kinds of sensor are as likely: one without a corner, one that is AC-coupled with a corner
    of about a tenth of the oscillation's `frequency`, Hz, and one that shows some of a
    motion across its axis, which leads or comes late by about 0.01 rad. The mean is over all three
    by what was found: `corner` and its `error`, Hz.

    Examples
    --------
    >>> lead, error = expected_lead(0.05, 0.001, frequency=8.0)
    >>> round(2 * np.pi * 8.0**2 * lead, 4), round(2 * np.pi * 8.0**2 * error, 4)
    (0.05, 0.001)
    >>> lead, error = expected_lead(-0.5, 0.25, frequency=8.0)  # that no corner makes
    >>> abs(lead) < 1e-4
    True
    >>> lead, error = expected_lead(-1.5, 877.0, frequency=8.0)  # nothing is known
    >>> abs(lead) < error
    True
    """
    usual, across = _USUAL * frequency, _ACROSS * frequency
    # What says nothing of a corner says no less than this; digits cancel beyond.
    most = _NOTHING * usual
    corner, error = corner * min(most / error, 1.0), min(error, most)
    both = math.hypot(error, across)
    share = (across / both) ** 2
    # below an exponential prior a normal law stays one, moved, and ends at zero
    z = corner / error - error / usual
    inside = float(special.log_ndtr(z))
    ends = math.sqrt(2.0 / math.pi) / float(special.erfcx(-z / math.sqrt(2.0)))
    log_odds = np.array([
        -0.5 * (corner / error) ** 2 - math.log(_ROOT * error),
        inside - corner / usual + 0.5 * (error / usual) ** 2 - math.log(usual),
        -0.5 * (corner / both) ** 2 - math.log(_ROOT * both),
    ])  # fmt: skip
    means = np.array([0.0, error * (z + ends), share * corner])
    variances = np.array([0.0, error**2 * (1.0 - ends * (z + ends)), share * error**2])
    odds = np.exp(log_odds - log_odds.max())
    odds = odds / odds.sum()
    mean = float(odds @ means)
    spread = math.sqrt(max(float(odds @ (variances + (means - mean) ** 2)), 0.0))
    share, turn = mean / frequency, 2.0 * math.pi * frequency
    return math.atan(share) / turn, spread / (1.0 + share**2) / (turn * frequency)


@dataclass(frozen=True)
class PhaseLaw:
    """Lag of the displacement (s) and corner of the acceleration (Hz), with standard errors.

    Attributes
    ----------
    own, own_error : the phase at the oscillation taken for a lag, s.
    above, above_error : lag of the lines above the oscillation alone, s.
    misfit : of a corner and a lag, mean square over that of a lag of the lines above.
    gain : acceleration over second derivative of the displacement, of slow lines.
    spread, spread_error : s^2, by which the displacement is slower than the acceleration: variance
        of the times over which it is the mean; negative where the acceleration is the slower one.
    """

    lag: float
    lag_error: float
    corner: float
    corner_error: float
    own: float = math.nan
    own_error: float = math.nan
    above: float = math.nan
    above_error: float = math.nan
    misfit: float = 1.0
    gain: float = math.nan
    spread: float = 0.0
    spread_error: float = math.inf

    @property
    def has_corner(self) -> bool:
        """Whether the acceleration is surely AC-coupled."""
        return self.corner > SURE * self.corner_error and self.misfit < _FITS

    @property
    def only_at_oscillation(self) -> bool:
        """Whether the channels are apart at the oscillation and together above it."""
        apart = SURE * math.hypot(self.own_error, self.above_error)
        small = abs(self.above) < _MOST_SHARED * abs(self.own)
        return (
            not self.has_corner
            and abs(self.own - self.above) > apart
            and (small or self.corner < -SURE * self.corner_error)
        )


def _lines(
    acceleration: FloatArray, displacement: FloatArray, step: float, *, frequency: float
) -> Lines | None:
    """Lines above the oscillation of both channels in many segments, and where they lie, rad/s."""
    n = min(acceleration.size, displacement.size)
    periods = 2.0 * n * step * frequency / (_FEWEST + 1.5)
    size = round(min(max(periods, _CYCLES[0]), _CYCLES[1]) / (frequency * step))
    if size < 16 or len(parts_of(acceleration[:n], size)) < _FEWEST:
        return None
    band = ABOVE_IT[0], min(ABOVE_IT[1], 0.4 / step / frequency)
    near, w = lines_between(size, step, band, frequency)
    if near.sum() < _LINES:
        return None
    a, x = (parts_of(y[:n], size) for y in (acceleration, displacement))
    return *second_derivative_beside(a, x, step, w, near), w


def _coherent(
    A: ComplexArray, X: ComplexArray
) -> tuple[ComplexArray, FloatArray, FloatArray, BoolArray]:
    """Cross spectrum, power of X, squared coherence; tops at which the channels are one motion."""
    cross = (A * X.conj()).sum(axis=0)
    power_a, power_x = (np.abs(A) ** 2).sum(axis=0), (np.abs(X) ** 2).sum(axis=0)
    coherence = np.abs(cross) ** 2 / np.maximum(power_a * power_x, 1e-300)
    tops = np.lib.stride_tricks.sliding_window_view(np.pad(power_a, _TOPS), 2 * _TOPS + 1)
    return cross, power_x, coherence, (coherence > _COHERENT) & (power_a == tops.max(axis=1))


def law_of_lines(
    A: ComplexArray, X: ComplexArray, w: FloatArray, *, frequency: float,
    own: tuple[float, float, float] | None = None,
) -> PhaseLaw | None:  # fmt: skip
    """Lag and corner from the lines of many segments.

    Parameters
    ----------
    A, X : complex arrays (segments, lines)
        Of the acceleration, and of what it is held beside.
    w : array (lines,)
        rad/s, evenly spaced.
    frequency : float
        Of the oscillation, Hz.
    own : tuple (value, error, gain), optional
        The phase at the oscillation, taken for a lag of X, s, and the ratio there, with its sign.

    Returns
    -------
    PhaseLaw or None
        None where too few lines stand out.
    """
    lag, lag_error = (0.0, math.nan) if own is None else own[:2]
    cross, power_x, coherence, use = _coherent(A, X)
    cross = cross * np.exp(-1j * w * lag)  # of a late channel: no phase wraps
    if use.sum() < _LINES:
        return None
    if own is not None:  # two channels of one motion
        use &= _of_the_mass(cross / np.maximum(power_x, 1e-300), w, use, usual=abs(own[2]))
    # Halves overlap: independent segments are about 0.9 of them.
    error = np.sqrt((1.0 - coherence[use]) / (2.0 * coherence[use] * 0.9 * A.shape[0]) + 1e-14)
    # by the oscillation: lines above it may have turned by more than a quarter
    real = (cross.real / np.maximum(power_x, 1e-300))[use].sum() if own is None else own[2]
    sign = -1.0 if real < 0.0 else 1.0
    phase = np.angle(sign * cross[use])
    if not use.any():
        return None
    turn = 2.0 * math.pi * frequency
    known = ([], [], []) if own is None else ([turn], [0.0], [turn * lag_error])
    law = _fitted(*(np.append(a, b) for a, b in zip((w[use], phase, error), known, strict=True)))
    if law is None or law.corner > frequency:  # which no sensor of this motion has
        return None
    above, above_error, misfit = _straight(w[use], phase, error)
    floor = _LAG_FLOOR / frequency
    # a mean over times of variance s^2 leaves exp(-(w s)^2/2) of a line
    ratio = np.abs(cross) / np.maximum(power_x, 1e-300)
    size, w2 = np.log(ratio[use]), w[use] ** 2
    if own is not None:  # motion across the accelerometer's axis is in phase, too
        more = (math.log(abs(own[2])), turn**2, _ACROSS)
        size, w2, error = map(np.append, (size, w2, error), more)
    line = np.stack([np.ones(size.size), 0.5 * w2], axis=1) / error[:, np.newaxis]
    covariance = np.linalg.pinv(line.T @ line)
    level, spread = covariance @ (line.T @ (size / error))
    rest = size / error - line @ np.array([level, spread])
    scale = max(1.0, float(rest @ rest) / max(1, size.size - 2))
    return replace(
        law,
        gain=sign * math.exp(level),
        spread=float(spread),
        spread_error=math.sqrt(scale * covariance[1, 1]),
        lag=lag + law.lag,
        lag_error=math.hypot(law.lag_error, floor),
        corner_error=math.hypot(law.corner_error, _CORNER_FLOOR * frequency),
        own=math.nan if own is None else lag,
        own_error=lag_error,
        above=lag + above,
        above_error=math.hypot(above_error, floor),
        misfit=law.misfit / misfit,
    )


def _of_the_mass(ratio: ComplexArray, w: FloatArray, use: BoolArray, *, usual: float) -> BoolArray:
    """Lines whose ratio of the channels is near the usual one, and as late as that of most lines.

    Hum that both channels pick up is coherent, too; so is a mode of the sensor's mount.
    """
    size = np.abs(ratio)
    near = use & (size < _AS_LARGE * usual) & (size * _AS_LARGE > usual)
    if not near.any():
        return near
    turned = ratio * np.sign(float(np.median(ratio.real[near])) or 1.0)
    late = float(np.median(np.angle(turned[near]) / w[near]))
    off = np.abs(np.angle(turned * np.exp(-1j * w * late)))
    return np.asarray(near & (off < max(_TURNED, _OUTLYING * float(np.median(off[near])))))


def lines_between(
    n: int, step: float, band: tuple[float, float], frequency: float
) -> tuple[BoolArray, FloatArray]:
    """Fourier lines of n samples between two multiples of a frequency (Hz): which, and rad/s."""
    f = np.fft.rfftfreq(n, step)
    near = (f > band[0] * frequency) & (f < band[1] * frequency)
    return near, np.asarray(2.0 * math.pi * f[near], dtype=np.float64)


def parts_of(x: FloatArray, size: int) -> FloatArray:
    """Stretches of so many samples, each beginning half of one later; shape (parts, size).

    Examples
    --------
    >>> parts_of(np.arange(7.0), 4)
    array([[0., 1., 2., 3.],
           [2., 3., 4., 5.]])
    """
    if x.size < size:
        return np.empty((0, size))
    return np.lib.stride_tricks.sliding_window_view(x, size)[:: max(size // 2, 1)]


def second_derivative_beside(
    a: FloatArray, x: FloatArray, step: float, w: FloatArray, near: BoolArray
) -> tuple[ComplexArray, ComplexArray]:
    """Tapered transforms of a and of x'', along the last axis. The latter by parts:

    the integral of p exp(-iwt) x'' is that of (p'' - 2iw p' - w^2 p) exp(-iwt) x, exactly, as the
    taper p and its slope vanish at both ends. So a decay or a swell does no harm.
    """
    n = a.shape[-1]
    phase = 2.0 * np.pi * (np.arange(n) + 0.5) / n
    rate = 2.0 * np.pi / (n * step)
    taper, slope = 0.5 - 0.5 * np.cos(phase), 0.5 * rate * np.sin(phase)
    bend = 0.5 * rate**2 * np.cos(phase)
    a, x = (y - y.mean(axis=-1, keepdims=True) for y in (a, x))
    A = np.fft.rfft(a * taper)[..., near]
    X, X1, X2 = (np.fft.rfft(x * window)[..., near] for window in (taper, slope, bend))
    return A, X2 - 2j * w * X1 - w**2 * X


def _straight(w: FloatArray, phase: FloatArray, error: FloatArray) -> tuple[float, float, float]:
    """Weighted slope of phase = w lag, its error, which grows with the misfit, and the misfit."""
    weight = (w / error) ** 2
    slope = float((weight * phase / w).sum() / weight.sum())
    rest = (phase - w * slope) / error
    scale = max(1.0, float(rest @ rest) / max(1, w.size - 1))
    return slope, math.sqrt(scale / float(weight.sum())), scale


def _fitted(w: FloatArray, phase: FloatArray, error: FloatArray) -> PhaseLaw | None:
    """Weighted Gauss-Newton on phase = w lag + atan(wc/w); errors grow with the misfit."""
    p = np.zeros(2)  # lag, and corner in rad/s
    for _ in range(_STEPS):
        model = w * p[0] + np.arctan(p[1] / w)
        rest = (np.angle(np.exp(1j * (phase - model)))) / error
        columns = np.stack([w, w / (w * w + p[1] ** 2)], axis=1) / error[:, np.newaxis]
        change = np.linalg.lstsq(columns, rest, rcond=None)[0]
        p = p + change
        p[1] = max(p[1], -0.2 * float(w.min()))
        if abs(change[1]) < 1e-9 * float(w.min()):
            break
    matrix = columns.T @ columns
    if np.linalg.cond(matrix / np.outer(np.sqrt(np.diag(matrix)), np.sqrt(np.diag(matrix)))) > 1e8:
        return None
    chi2 = float(rest @ rest)
    scale = max(1.0, chi2 / max(1, w.size - 2))
    errors = np.sqrt(scale * np.diag(np.linalg.inv(matrix)))
    turn = 2.0 * math.pi
    corner = float(p[1] / turn), float(errors[1] / turn)
    return PhaseLaw(float(p[0]), float(errors[0]), *corner, misfit=scale)
