"""Velocity jumps from the displacement: how much its slope changes at each impact.

Around an impact the displacement is an oscillation, a slow drift and the response to the jump,
dv sin(w (t - t_j))/w after t_j. All of it is linear, so that one projection serves all impacts.
Neighbouring impacts in the window are subtracted with the jumps that the acceleration showed.

What the displacement around an impact is made of: a smooth motion and the response to a jump.

Spikes of an accelerometer that move nothing: somebody knocks the table, a cable slips.

A ball that hits a wall changes the velocity of the mass by the area of its pulse, and the slope of
the displacement by as much. A knock rings in the accelerometer and leaves the displacement alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.records.stored.store import RecordView
from vinesexp.signals.base_motion import ORDER, base_motion
from vinesexp.signals.impacts.detection import Detection
from vinesexp.signals.means import channel_means, coarse_channels, missing_means
from vinesexp.units import LIKELY, SURE

#: Means a period of the displacement: with more of them nothing is gained.
POINTS = 200
_WINDOW = 0.35  # periods on either side of an impact; a longer one would hold the next impacts
#: First guess of the oscillator's damping ratio, its standard error, and by how much of its own
#: frequency the drive may be off.
_DAMPING, _DAMPING_ERROR, _DETUNING_ERROR = 0.01, 0.01, 0.02
#: s, by which a sensor is late at least that may be a low-pass; share of it that is, and its error.
_PROMPT, _LOW_PASS = 1e-5, 0.5
#: Of the time that a half sine lasts, a box that is as wide; share of what the accelerometer shows
#: of it that is no filter's, and its error.
_AS_WIDE, _SOFT = 0.754, (0.5, 0.5)
_SHORTER = (1.0, 0.5, 0.25)  # of the window, at the ends of the record and beside gaps
_LEAST = 6  # points to either side
_AREA = 0.15  # share by which the area of a pulse may be off
_MOST = 64  # impacts in a window: what is more crowded shows no single one of them
_BEFORE = 0.999  # of the sample before, that is taken off where noise walks
_WHITE, _WALKS = 0.4, 0.72  # correlation of neighbours: of white noise at most, of a walk at least
_TOGETHER = 0.08  # periods: contacts nearer to one another are one event to the displacement
_SOONER, _LEAST_R = 0.25, 0.3  # of the time in which a ball of so small an r comes back to a wall


#: Samples from an impact for which is asked how a bend is rounded, alike before and after it; how
#: much, in samples, it may be. A converter takes values or means, and a filter before it rounds
#: more, or less and rings.
ROUNDED = np.array([0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0])
_ROUNDING = 0.2 * np.exp(-ROUNDED / 1.5)
#: Of all jumps of a record alike, where too few samples around an impact show that.
_BLUNT = 0.2
_FINE_ENOUGH = 5  # samples of a mean, in which all this is lost


@dataclass(frozen=True)
class JumpResponse:
    """How the displacement answers a jump: exp(-rate s) sin(w_free s)/w_free.

    `w` is that of the oscillation around it, rad/s; `w_free` (None: the same) and `rate` (1/s) are
    the oscillator's own; `late`, s, is that of the sensor and `low_pass` the share of it that is a
    low-pass of first order, the rest a delay; `lasts`, s, is how long the accelerometer shows a
    contact, and `soft` the share of it (by the bend) that is the contact's own; `rounded` is what
    the samples around a unit jump show more than means over their step would, at `ROUNDED` times
    `sample`, s; `common` is the relative error that they leave to all jumps alike.
    """

    w: float
    w_free: float | None = None
    rate: float = 0.0
    late: float = 0.0
    low_pass: float = 0.0
    lasts: float = 0.0
    soft: float = 0.0
    sample: float = 0.0
    rounded: tuple[float, ...] = ()
    common: float = 0.0

    def bend(self, s: FloatArray, step: float) -> FloatArray:
        """Displacement s after a unit jump of velocity, averaged over `step`."""
        kink = self._mean(s, step)
        if self.soft:
            kink += self.soft * self.by_contact(s, step)
        if self.rounded:
            kink += np.interp(np.abs(s) / self.sample, ROUNDED, self.rounded, right=0.0)
        return kink + self.low_pass * rounded(s, step, self.late) if self.low_pass else kink

    def _mean(self, s: FloatArray, step: float) -> FloatArray:
        w = self.w_free or self.w
        late = np.maximum(s, 0.0)
        value = np.sinc(0.5 * w * step / np.pi) * np.exp(-self.rate * late) * np.sin(w * late) / w
        return np.where(np.abs(s) < 0.5 * step, (s + 0.5 * step) ** 2 / (2.0 * step), value)

    def by_contact(self, s: FloatArray, step: float) -> FloatArray:
        """What a contact that lasts adds to a bend: the jump comes in as many parts."""
        return self._mean(s, math.hypot(step, _AS_WIDE * self.lasts)) - self._mean(s, step)

    def since(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Displacement and velocity s after a unit jump."""
        w = self.w_free or self.w
        fall = np.exp(-self.rate * s)
        x = fall * np.sin(w * s) / w
        return x, fall * np.cos(w * s) - self.rate * x


def rounded(s: FloatArray, step: float, late: float) -> FloatArray:
    """What a low-pass of first order adds to a unit kink, averaged over `step`.

    As late as it makes slow motions, the output is x + late exp(-(s + late)/late) after the kink,
    and begins to bend by as much before it.
    """

    def area(s: FloatArray) -> FloatArray:
        s = np.maximum(s, -late)
        tail = 0.5 - np.exp(-(s + late) / late)
        return np.asarray(0.5 * np.minimum(s, 0.0) ** 2 + late**2 * tail)

    return (area(s + 0.5 * step) - area(s - 0.5 * step)) / step


def smooth(s: FloatArray, w: float, *, full: bool) -> tuple[FloatArray, FloatArray]:
    """What the motion without the jump is made of (drift, oscillation, its slow change); slopes."""
    p, one, c, d = w * s, np.ones_like(s), np.cos(w * s), np.sin(w * s)
    columns = [(one, 0.0 * one), (p, one), (c, -d), (d, c)]
    if full:
        columns += [(p * c, c - p * d), (p * d, d + p * c)]
    values, slopes = (np.stack(each, axis=-1) for each in zip(*columns, strict=True))
    return values, w * slopes


@dataclass(frozen=True)
class SlopeChanges:
    """Displacement and velocity at each impact; NaN where the window is too short.

    Attributes
    ----------
    jump, jump_error : arrays (k,)
        From the displacement alone, m/s.
    alone : array (k,)
        `jump_error` without what all jumps have wrong alike: whether there is a jump at all.
    x, v_before, v_error, v_shared : arrays (k,)
        m, m/s; with the weighted mean of both jumps where `slope_changes` was given errors,
        else with the one above. The velocity after is v_before plus that jump. `v_shared` is what
        may be off alike at all impacts of a wall.
    shift, shift_error : arrays (k,)
        By which the bend of the displacement comes after the time given, s; near that time only.
    """

    jump: FloatArray
    jump_error: FloatArray
    alone: FloatArray
    x: FloatArray
    v_before: FloatArray
    v_error: FloatArray
    v_shared: FloatArray
    shift: FloatArray
    shift_error: FloatArray

    @staticmethod
    def unknown(count: int) -> SlopeChanges:
        """Of so many impacts, of which the displacement shows nothing."""
        return SlopeChanges(*(np.full(count, np.nan) for _ in fields(SlopeChanges)))


@dataclass(frozen=True)
class Coarse:
    """Displacement as block means: `step` s apart, the first centred on `start` s.

    `missing` says which of them the sensor did not show; the values there are no measurement.
    `forced` is what may move the mass beside its sine. By `late`, s, the sensor is late; that may
    be a delay, or a low-pass. Contacts seem to push for `lasts`, s. Each is the mean of so many
    `samples`; 0: of the motion itself.
    """

    values: FloatArray
    step: float
    start: float
    missing: BoolArray | None = None
    forced: tuple[Forced, ...] = ()
    late: float = 0.0
    lasts: float = 0.0
    samples: int = 0

    @property
    def rounds(self) -> bool:
        """Whether the values show how the samples round a bend."""
        return 0 < self.samples < _FINE_ENOUGH

    def moved(self, motion: FloatArray) -> Coarse:
        """The same, which a motion known to some per cent moves beside its sine."""
        return replace(self, forced=(*self.forced, Forced(motion, 1.0, _CALIBRATED)))


@dataclass(frozen=True)
class Forced:
    """A motion of the mass beside its sine, known but for a factor: block means, m.

    `expected` and `error` are that factor, as far as it is known before the displacement.
    """

    motion: FloatArray
    expected: float
    error: float


def coarse_displacement(record: RecordView, frequency: float, *, free: float = 0.0) -> Coarse:
    """The displacement of a record as block means, read by blocks.

    Until `free`, s, the mass is held: it has no motion of its own that could bend.
    """
    k, step, (means,) = coarse_channels(record, frequency, POINTS, "displacement")
    # over a two hundredth of a period a straight line leaves 1e-4 of the motion
    missing = missing_means(record, "displacement", k, bridged=k)
    start = 0.5 * (k - 1) / record.sample_rate
    missing |= start + step * np.arange(means.size) < free
    forced = bent_forces(means, step, frequency=frequency)
    x = Coarse(means, step, start, missing if missing.any() else None, forced, samples=k)
    if "base" not in record.roles:
        return x
    base = channel_means(record, "base", k)
    quantity = record.quantity("base")
    motion = forced_motion(base, step, frequency=frequency, quantity=quantity)
    return x if motion is None else x.moved(motion)


def bent_forces(x: FloatArray, step: float, *, frequency: float) -> tuple[Forced, ...]:
    """What a spring or a damper that is not straight moves the mass by beside its sine.

    A force k2 x^2 + k3 x^3 + c2 v |v| moves it by harmonics, which by their phase at the impacts
    are taken for jumps of velocity, at one wall too large and at the other too small. A base that
    no channel shows may move it by them as well, by the second one in the phase of x v, too.

    Parameters
    ----------
    x : array (n,)
        Displacement, m.
    step : float
        s.
    frequency : float
        Of the oscillation, Hz.

    Returns
    -------
    tuple of Forced
        Their factors are the forces of x^2, x^3, v |v| and x v over that of the straight spring,
        at the largest displacement and velocity.

    Examples
    --------
    >>> t = np.arange(20000) / 1000.0
    >>> _, third, _, _ = bent_forces(8e-3 * np.cos(2 * np.pi * 8.0 * t), 1e-3, frequency=8.0)
    >>> off = third.motion - 8e-3 / 32 * np.cos(2 * np.pi * 24.0 * t)
    >>> bool(np.abs(off[500:-500]).max() < 2e-6)
    True
    """
    x = x - x.mean()
    largest = float(np.abs(x).max())
    if not largest:
        return ()
    v = np.gradient(x)
    v = v / np.abs(v).max()
    bent = ((x / largest) ** 2, (x / largest) ** 3, v * np.abs(v), x / largest * v)
    # turned round at its end it begins as it ends
    found = (
        _answer(-largest * np.append(own, own[::-1]), step, frequency=frequency)[: x.size]
        for own in bent
    )
    return tuple(Forced(motion, 0.0, _STRAIGHT) for motion in found)


def _answer(force: FloatArray, step: float, *, frequency: float, order: int = 0) -> FloatArray:
    """Displacement by a force over the spring's stiffness, well above the oscillator's frequency.

    There it is 1/(1 - (f/f0)^2) of it, nearly whatever the damping; slower motion is smooth beside
    an impact. `order` is the derivative of the force that is given.
    """
    f = np.fft.rfftfreq(force.size, step) / frequency
    above = np.clip((f - _SLOW[0]) / (_SLOW[1] - _SLOW[0]), 0.0, 1.0)
    f = np.maximum(f, _SLOW[0])
    answer = above / (1.0 - f**2) / (2j * math.pi * frequency * f) ** order
    return np.fft.irfft(np.fft.rfft(force) * answer, force.size)


def forced_motion(
    base: FloatArray, step: float, *, frequency: float, quantity: str = "displacement"
) -> FloatArray | None:
    """What a base forces the mass to beside the sine that shakes it: harmonics, a second mode, m.

    Parameters
    ----------
    base : array (n,)
        What its channel measured, SI.
    step : float
        s.
    frequency : float
        Of the oscillation, Hz.
    quantity : str
        ``displacement``, ``velocity`` or ``acceleration``.

    Returns
    -------
    array (n,) or None
        None where the base shows no main sine: it is at rest.

    Examples
    --------
    >>> t = np.arange(20000) / 1000.0
    >>> shaken = np.cos(2 * np.pi * 8.0 * t) + 0.05 * np.cos(2 * np.pi * 24.0 * t)
    >>> forced = forced_motion(1e-3 * shaken, 1e-3, frequency=8.0)
    >>> bool(np.abs(forced + 0.05e-3 / 8.0 * np.cos(2 * np.pi * 24.0 * t)).max() < 5e-9)
    True
    """
    shaken = base_motion(base, step, frequency=frequency, quantity=quantity)
    if shaken is None:
        return None
    t = step * np.arange(base.size)
    phase = 2.0 * math.pi * shaken.frequency * t
    sine = np.stack([np.ones_like(t), t, np.cos(phase), np.sin(phase)], axis=1)
    rest = base - sine @ np.linalg.lstsq(sine, base, rcond=None)[0]
    return _answer(rest, step, frequency=frequency, order=ORDER[quantity])


_SLOW = (1.2, 1.5)  # of the oscillation's frequency: below, a motion is smooth beside an impact
_EACH = 5  # impacts for each force: a few show the mistakes of their own times
_CALIBRATED, _STRAIGHT = 0.05, 0.03  # of a base beside a displacement; of the spring's force


def slope_changes(
    x: Coarse, times: FloatArray, jumps: FloatArray, *, frequency: float,
    jump_errors: FloatArray | None = None,
) -> SlopeChanges:  # fmt: skip
    """Jumps, places and velocities at impacts.

    Parameters
    ----------
    x : Coarse
        Displacement, m.
    times : array (k,)
        Rising; s from the first sample of the record.
    jumps : array (k,)
        m/s, from the acceleration: what neighbours are subtracted with.
    frequency : float
        Of the oscillation, Hz; a few per cent off does no harm.
    jump_errors : array (k,), optional
        With it, places and velocities are computed with the weighted mean of both jumps.

    Examples
    --------
    >>> t = np.arange(4200) / 1e4
    >>> w = 2 * np.pi * 8.0
    >>> motion = 5e-3 * np.cos(w * t) + 0.02 * np.sin(w * np.maximum(t - 0.2, 0)) / w
    >>> x = Coarse(motion.reshape(-1, 7).mean(axis=1), 7e-4, 3e-4)  # means of 7 samples
    >>> found = slope_changes(x, np.array([0.2]), np.array([0.0]), frequency=8.0)
    >>> abs(float(found.jump[0]) - 0.02) < 1e-5
    True
    """
    k = times.size
    late = x.late if x.late > _PROMPT else 0.0
    lasts = x.lasts if x.lasts > x.step else 0.0  # a mean is wider than any other
    response = JumpResponse(2.0 * math.pi * frequency, late=late, lasts=lasts)
    out = SlopeChanges.unknown(k)
    half = max(_LEAST, round(_WINDOW / (frequency * x.step)))
    centre = np.rint((times - x.start) / x.step).astype(np.int64)
    open_ = np.ones(k, dtype=bool)
    forced, walks = np.zeros((2, k)), False
    # with so few samples how they round a bend cannot be told from how large it is
    blunt = x.rounds and half < 3.0 * ROUNDED[-1] / x.samples
    x, least_known = (replace(x, samples=0), _BLUNT) if blunt else (x, 0.0)
    missing = np.zeros(x.values.size) if x.missing is None else x.missing
    gaps = np.append(0.0, np.cumsum(missing))  # means with one before each
    for share in _SHORTER:
        reach = round(half * share)
        if reach < _LEAST:
            break
        fits = open_ & (centre >= reach) & (centre + reach < x.values.size)
        last = np.searchsorted(times, times + reach * x.step, side="right")
        fits &= last - np.searchsorted(times, times - reach * x.step) <= _MOST
        low, high = (np.clip(centre + end, 0, x.values.size) for end in (-reach, reach + 1))
        fits &= gaps[high] == gaps[low]
        chosen = np.flatnonzero(fits)
        for begin in range(0, chosen.size, 4096):
            group = chosen[begin : begin + 4096]
            where = (times, jumps, centre, group, reach, share > 0.3)
            unknown = response.w_free is None
            if unknown:  # the longest windows there are show it
                x, response, forced = _learnt(x, response, where, least_known)
            windows = _windows(x, response, *where)
            walks = _walks(windows) if unknown else walks
            own = windows.differences() if walks else windows
            _solve(own, jumps[group], jump_errors, group, x.step, out)
        open_ &= ~fits
    return replace(out, x=out.x + forced[0], v_before=out.v_before + forced[1])


def nearer(
    jumps: FloatArray, shown: FloatArray, times: FloatArray, *, frequency: float
) -> FloatArray:
    """Jumps that only the displacement shows, a step nearer to those that agree with one another.

    Of three contacts at one place each would take back what both others have, and so on without
    end: a step is as much shorter as others share the window. What cannot be told apart is shared.

    Parameters
    ----------
    jumps, shown : arrays (k,)
        m/s; as each was taken from its neighbours, NaN where not known, and as they are then seen.
    times : array (k,)
        Rising; s.
    frequency : float
        Of the oscillation, Hz.

    Examples
    --------
    >>> at = np.array([0.1, 0.1, 0.1, 0.5])
    >>> nearer(np.zeros(4), np.array([0.03, 0.03, 0.03, 0.01]), at, frequency=8.0).round(6).tolist()
    [0.01, 0.01, 0.01, 0.01]
    """
    reach, own = _WINDOW / frequency, np.arange(times.size)
    first = np.searchsorted(times, times - reach)
    last = np.searchsorted(times, times + reach, side="right")
    sums = np.append(0.0, np.cumsum(times))
    away = sums[last] + sums[first] - 2.0 * sums[own] + (2.0 * own - first - last) * times
    before = np.nan_to_num(jumps)
    return np.asarray(before + (shown - before) / (last - first - away / reach))


def _learnt(
    x: Coarse, response: JumpResponse, where: tuple[Any, ...], least_known: float
) -> tuple[Coarse, JumpResponse, FloatArray]:
    """How the oscillator answers a jump; the displacement less what moves the mass beside its sine.

    And that at the impacts, m and m/s. `where` is what `_windows` takes.
    """
    times, _, centre, group, *_ = where
    enough = len(group) >= _EACH * len(x.forced)
    whole = replace(x, forced=tuple(f for f in x.forced if enough or f.expected))
    x, forced = whole, np.zeros((2, times.size))
    for _ in range(2):  # twice converges
        unsure, windows = least_known, _windows(whole, response, *where)
        if whole.forced:
            x, forced, by_force = _without_forced(whole, times, windows, centre[group])
            unsure, windows = max(unsure, by_force), _windows(x, response, *where)
        response = _refined(windows, response, x, unsure)
    return x, response, forced


def _without_forced(
    x: Coarse, times: FloatArray, windows: _Windows, centre: IntArray
) -> tuple[Coarse, FloatArray, float]:
    """The displacement less what moves the mass beside its sine, and that at the impacts (m, m/s).

    And what not knowing how much it is leaves to all jumps alike, relative.

    As much of each as is expected, within its error and what the displacement shows; where that
    contradicts a base that is expected (another unit, turned round, none at all), as the
    displacement shows. How the oscillator answers a jump is as unknown: a fast decay would seem to
    be a force.
    """
    answer = _Answer.seen(windows, x)
    reach = windows.samples.shape[1] // 2
    grid = centre[:, np.newaxis] + np.arange(-reach, reach + 1)
    left, shares = zip(*(_left(windows, own.motion[grid]) for own in x.forced), strict=True)
    seen = [(answer.weigh * own).ravel() for own in left]
    shapes = np.concatenate([np.stack(seen, axis=1), answer.columns], axis=1)
    expected, error = np.array([(own.expected, own.error) for own in x.forced]).T
    expected, error = np.append(expected, answer.usual - answer.now), np.append(error, answer.error)
    normal = shapes.T @ shapes
    normal += 1e-12 * np.diag(np.maximum(np.diag(normal), 1e-300))
    shown = np.linalg.solve(normal, shapes.T @ answer.rest)
    noise = float((answer.rest - shapes @ shown).std())
    spread = noise * np.sqrt(np.diag(np.linalg.inv(normal)))
    contradicted = (expected != 0.0) & (np.abs(shown - expected) > SURE * spread)
    contradicted[len(x.forced) :] = False
    held = np.where(contradicted, 0.0, (noise / error) ** 2)
    whole_normal = normal + np.diag(held)
    gain = np.linalg.solve(whole_normal, shapes.T @ answer.rest + held * expected)
    all_shares = np.append(shares, answer.shares)
    unsure = noise * math.sqrt(all_shares @ np.linalg.solve(whole_normal, all_shares))
    from scipy.interpolate import CubicSpline

    whole = gain[: len(x.forced)] @ np.stack([own.motion for own in x.forced])
    motion = CubicSpline(x.start + x.step * np.arange(whole.size), whole)
    values = x.values - whole
    at = np.stack([motion(times), motion(times, 1)])
    return replace(x, values=values, forced=()), at, unsure


def _left(windows: _Windows, values: FloatArray) -> tuple[FloatArray, float]:
    """What smooth motion and a jump leave of some values in each window.

    And the jump, over the true one, that they seem to make on average.
    """
    bent, own = _out(windows.bend, windows.q), _out(values, windows.q)
    norm = (bent * bent).sum(axis=1, keepdims=True)
    jump = (bent * own).sum(axis=1, keepdims=True) / norm
    true = (bent * windows.samples).sum(axis=1, keepdims=True) / norm
    share = float((jump * np.sign(true)).mean() / max(np.abs(true).mean(), 1e-300))
    return own - jump * bent, share


def _less_where_odd(rest: FloatArray) -> FloatArray:
    """Weights of windows, by what is left of them.

    One with something else in it (the mass let go, a jump that no impact made) fits far worse than
    the others and counts for less by as much.
    """
    square = (rest**2).mean(axis=1, keepdims=True)
    usual = float(np.median(square))
    return np.asarray(np.sqrt(usual / np.maximum(square, max(usual, 1e-300))))


@dataclass(frozen=True)
class _Windows:
    """Displacement around each impact of a group, neighbours subtracted, and what it is made of."""

    samples: FloatArray
    s: FloatArray  # time since the impact
    offset: FloatArray  # of the impact from the window's centre
    bend: FloatArray
    slope: FloatArray  # of the bend, over time
    place: FloatArray  # what the neighbours did to displacement and velocity at the impact
    velocity: FloatArray
    q: FloatArray
    upper: FloatArray
    response: JumpResponse
    full: bool

    def differences(self) -> _Windows:
        """Each sample less the one before it: noise that walks, as that of an integral, is white.

        All but a thousandth of it, and as much of the first one as this leaves: the place stays.
        """

        def less(values: FloatArray) -> FloatArray:
            first = math.sqrt(1.0 - _BEFORE**2) * values[..., :1]
            rest = values[..., 1:] - _BEFORE * values[..., :-1]
            return np.concatenate([first, rest], axis=-1)

        q, more = np.linalg.qr(less(self.q.T).T)
        return replace(
            self, samples=less(self.samples), bend=less(self.bend), slope=less(self.slope),
            q=q, upper=more @ self.upper,
        )  # fmt: skip


def _windows(
    x: Coarse, response: JumpResponse, times: FloatArray, jumps: FloatArray, centre: IntArray,
    group: IntArray, reach: int, full: bool,
) -> _Windows:  # fmt: skip
    grid = np.arange(-reach, reach + 1)
    local = np.asarray(grid * x.step, dtype=np.float64)
    q, upper = np.linalg.qr(smooth(local, response.w, full=full)[0])
    index = centre[group, np.newaxis] + grid
    others, place, velocity = _neighbours(x, times, jumps, index, group, response)
    samples = x.values[index] - others
    offset = times[group] - (x.start + centre[group] * x.step)
    s = local - offset[:, np.newaxis]
    bend = response.bend(s, x.step)
    slope = np.where(s > 0.0, response.since(np.maximum(s, 0.0))[1], 0.0)
    return _Windows(samples, s, offset, bend, slope, place, velocity, q, upper, response, full)


def _out(values: FloatArray, q: FloatArray) -> FloatArray:
    """Less all that is smooth."""
    return np.asarray(values - (values @ q) @ q.T)


@dataclass(frozen=True)
class _Answer:
    """How what the jumps leave in all windows changes with the oscillator's answer to them.

    `columns` are those of its decay, its free frequency, the share of a low-pass, which is missing
    for a prompt sensor, that of a contact that lasts, and how bends are rounded; `now` are these
    numbers, `usual` and `error` first guesses.
    """

    rest: FloatArray
    weigh: FloatArray
    columns: FloatArray
    shares: FloatArray  # of a unit change, by which it makes all jumps larger
    now: FloatArray
    usual: FloatArray
    error: FloatArray

    @staticmethod
    def seen(windows: _Windows, x: Coarse) -> _Answer:
        response = windows.response
        bent = _out(windows.bend, windows.q)
        norm = (bent * bent).sum(axis=1, keepdims=True)
        samples = _out(windows.samples, windows.q)
        jump = (bent * samples).sum(axis=1, keepdims=True) / norm
        rest = samples - jump * bent
        weigh = _less_where_odd(rest)
        late = np.maximum(windows.s, 0.0)
        w = response.w_free or response.w
        fall = np.exp(-response.rate * late) / w
        by_frequency = late * fall * np.cos(w * late) - fall * np.sin(w * late) / w
        # its change of the answer, now, first guess and error of this
        numbers = [
            (-late * fall * np.sin(w * late), response.rate,
             _DAMPING * response.w, _DAMPING_ERROR * response.w),
            (by_frequency, w, response.w, _DETUNING_ERROR * response.w),
        ]  # fmt: skip
        if response.late:
            by_low_pass = rounded(windows.s, x.step, response.late)
            numbers.append((by_low_pass, response.low_pass, _LOW_PASS, _LOW_PASS))
        if response.lasts:
            by_contact = response.by_contact(windows.s, x.step)
            numbers.append((by_contact, response.soft, *_SOFT))
        if x.rounds:
            errors = _ROUNDING * x.step / x.samples**2
            at, now = (
                np.abs(windows.s) * x.samples / x.step,
                response.rounded or (0.0,) * ROUNDED.size,
            )
            hats = np.eye(ROUNDED.size)
            numbers += [
                (np.interp(at, ROUNDED, hat, right=0.0), own, 0.0, error)
                for hat, own, error in zip(hats, now, errors, strict=True)
            ]
        columns, shares = [], []
        for change, *_ in numbers:
            column = _out(change, windows.q)
            share = (column * bent).sum(axis=1, keepdims=True) / norm
            columns.append((weigh * jump * (column - bent * share)).ravel())
            shares.append(float(share.mean()))
        _, *known = zip(*numbers, strict=True)
        return _Answer(
            (weigh * rest).ravel(), weigh, np.stack(columns, axis=1), np.array(shares),
            *(np.array(each) for each in known),
        )  # fmt: skip


def _refined(windows: _Windows, response: JumpResponse, x: Coarse, unsure: float) -> JumpResponse:
    """The numbers of the answer to a jump, as all windows together show them.

    From wide first guesses; a prompt sensor has no low-pass. `unsure` is what all jumps have wrong
    alike at least.
    """
    one = _Answer.seen(windows, x)
    windows_seen, samples = windows.samples.shape
    freedom = samples - windows.q.shape[1] - 1
    noise = float((one.rest**2).sum()) / (windows_seen * freedom)
    weight = np.diag(noise / one.error**2)
    normal = one.columns.T @ one.columns + weight
    change = np.linalg.solve(normal, one.columns.T @ one.rest + weight @ (one.usual - one.now))
    covariance = noise * np.linalg.inv(normal)
    common = max(float(np.sqrt(one.shares @ covariance @ one.shares)), unsure)
    values = one.now + change
    rate, free, *others = values.tolist()
    share = others.pop(0) if response.late else 0.0
    soft = others.pop(0) if response.lasts else 0.0
    sample = x.step / x.samples if others else 0.0
    # a filter rounds otherwise before a bend than after it: half of what this corrects is unsure
    if others:
        common = math.hypot(common, 0.5 * one.shares[-len(others) :] @ values[-len(others) :])
    return replace(
        response, w_free=free, rate=rate, low_pass=share, soft=soft, sample=sample,
        rounded=tuple(others), common=common,
    )  # fmt: skip


def _solve(
    windows: _Windows, jumps: FloatArray, jump_errors: FloatArray | None, group: IntArray,
    step: float, out: SlopeChanges,
) -> None:  # fmt: skip
    """Fill in `out` for a group."""
    fit = _Fit.of(windows)
    q, upper, bend = windows.q, windows.upper, windows.bend
    jump, rest, norm = fit.jump, fit.rest, fit.norm
    # The noise is the same in all windows; one of them knows it to 1/sqrt(2 n) only.
    square = float(np.median((rest**2).sum(axis=1)))
    noise = math.sqrt(square / (bend.shape[1] - q.shape[1] - 1))
    alone = noise / np.sqrt(norm)
    # An error that all jumps share does not average out: each is given its part of it.
    alike = _repeated(rest, jump)
    shared = np.hypot(windows.response.common * np.abs(jump), alike / np.sqrt(norm))
    error = np.hypot(alone, math.sqrt(jump.size) * shared)
    out.jump[group], out.jump_error[group], out.alone[group] = jump, error, alone
    out.shift[group], out.shift_error[group] = fit.shift, noise / np.sqrt(fit.size)
    best, best_error = jump, error
    if jump_errors is not None:
        best, best_error = weighted(jump, error, jumps, jump_errors[group])
    amplitude = (windows.samples - best[:, np.newaxis] * bend) @ q
    w = windows.response.w
    blurred = np.ones(q.shape[1])  # block means shrink an oscillation a little
    blurred[2:] = np.sinc(0.5 * w * step / np.pi)
    both = smooth(windows.offset, w, full=windows.full)
    for rows, others, value in zip(
        both, (windows.place, windows.velocity), (out.x, out.v_before), strict=True
    ):
        functional = np.linalg.solve(upper.T, (rows / blurred).T).T
        value[group] = (functional * amplitude).sum(axis=1) + others
    per_jump = np.abs((functional * (bend @ q)).sum(axis=1))
    by_sample = np.sqrt((functional**2).sum(axis=1))
    in_jump = alike / np.sqrt(norm) * (best_error / error) ** 2
    out.v_shared[group] = np.hypot(alike * by_sample, per_jump * in_jump)
    out.v_error[group] = np.hypot(noise * by_sample, per_jump * best_error)


class _Fit(NamedTuple):
    """Jumps and shifts (of 1/`norm` and 1/`size` of the noise's variance) in windows.

    And what they leave: the jumps, and both.
    """

    jump: FloatArray
    norm: FloatArray
    rest: FloatArray
    shift: FloatArray
    size: FloatArray
    left: FloatArray

    @staticmethod
    def of(windows: _Windows) -> _Fit:
        bent = _out(windows.bend, windows.q)
        norm = (bent * bent).sum(axis=1)
        jump = (bent * windows.samples).sum(axis=1) / norm
        rest = _out(windows.samples - jump[:, np.newaxis] * windows.bend, windows.q)
        later = _out(-jump[:, np.newaxis] * windows.slope, windows.q)
        later -= ((bent * later).sum(axis=1) / norm)[:, np.newaxis] * bent
        size = np.maximum((later * later).sum(axis=1), 1e-300)
        shift = (later * rest).sum(axis=1) / size
        return _Fit(jump, norm, rest, shift, size, rest - shift[:, np.newaxis] * later)


def _walks(windows: _Windows) -> bool:
    """Whether what is left of windows is noise that walks: as its differences, it is white.

    What repeats, as a model that is not quite right makes it, is neither.
    """
    if len(windows.samples) < _EACH or _beside(_Fit.of(windows)) <= _WALKS:
        return False
    return abs(_beside(_Fit.of(windows.differences()))) < _WHITE


def _beside(fit: _Fit) -> float:
    """Correlation of neighbours in what is left of windows, less what each jump leaves likewise."""
    alike = fit.jump @ fit.left / max(float(fit.jump @ fit.jump), 1e-300)
    left = fit.left - fit.jump[:, np.newaxis] * alike
    left *= _less_where_odd(left)
    return float((left[:, 1:] * left[:, :-1]).sum() / max((left**2).sum(), 1e-300))


def _repeated(rest: FloatArray, jump: FloatArray) -> FloatArray:
    """What is left likewise in all windows of one wall: the white noise that does as much.

    The staircase of a coarse converter, or a model that is not quite right. A motion that repeats
    shows it at each of its impacts alike; noise is not left in their mean. Neighbouring samples lie
    on one step and are off together.
    """
    out = np.zeros(jump.size)
    for wall in (jump > 0.0, jump <= 0.0):
        n = int(wall.sum())
        if n > 1 and rest[wall].any():
            mean = rest[wall].mean(axis=0)
            single = rest[wall].var(axis=0, ddof=1).mean()
            beside = np.correlate(mean, mean, "full")[mean.size - 1 :]
            together = beside[: int(np.argmax(beside <= 0.0))].sum()  # until neighbours are apart
            alone = max(1.0 - single / n / (mean**2).mean(), 0.0)
            out[wall] = math.sqrt(alone * (2.0 * together - beside[0]) / mean.size)
    return out


def weighted(
    a: FloatArray, a_error: FloatArray, b: FloatArray, b_error: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean of two measurements by their variances; one alone where the other is NaN.

    Examples
    --------
    >>> value, error = weighted(np.array([1.0]), np.array([1.0]), np.array([3.0]), np.array([1.0]))
    >>> float(value[0]), round(float(error[0]), 3)
    (2.0, 0.707)
    """
    wa = np.where(np.isfinite(a) & (a_error > 0), 1.0 / a_error**2, 0.0)
    wb = np.where(np.isfinite(b) & (b_error > 0), 1.0 / b_error**2, 0.0)
    total = np.where(wa + wb > 0.0, wa + wb, np.nan)
    value = (wa * np.nan_to_num(a) + wb * np.nan_to_num(b)) / total
    return value, 1.0 / np.sqrt(total)


def _neighbours(
    x: Coarse, times: FloatArray, jumps: FloatArray, index: IntArray, group: IntArray,
    response: JumpResponse,
) -> tuple[FloatArray, FloatArray, FloatArray]:  # fmt: skip
    """What the other impacts in the windows did to the displacement, smooth parts left out.

    Returns
    -------
    total : array (group, samples)
    place, velocity : arrays (group,)
        The same at the windows' own impacts.
    """
    t = x.start + index * x.step
    total = np.zeros(t.shape)
    place, velocity = np.zeros(group.size), np.zeros(group.size)
    for direction in (1, -1):
        for step in range(1, times.size):
            other = group + direction * step
            there = (other >= 0) & (other < times.size)
            other = np.clip(other, 0, times.size - 1)
            there &= (times[other] > t[:, 0]) & (times[other] < t[:, -1])
            if not there.any():
                break
            rows = np.flatnonzero(there)
            s = t[rows] - times[other[rows], np.newaxis]
            total[rows] += jumps[other[rows], np.newaxis] * response.bend(s, x.step)
            if direction < 0:
                since = times[group[rows]] - times[other[rows]]
                moved, speed = response.since(since)
                place[rows] += jumps[other[rows]] * moved
                velocity[rows] += jumps[other[rows]] * speed
    return total, place, velocity


def events_of(times: FloatArray, *, frequency: float) -> IntArray:
    """Number of the event that each contact belongs to: those near one another are one.

    Examples
    --------
    >>> events_of(np.array([0.1, 0.102, 0.16]), frequency=8.0).tolist()
    [0, 0, 1]
    """
    apart = np.diff(times, prepend=times[:1]) > _TOGETHER / frequency
    return np.asarray(np.cumsum(apart), dtype=np.int64)


def joined(found: Detection, x: Coarse, *, frequency: float, clearance: float) -> Detection:
    """Contacts of a single ball that are parts of one longer contact, as one.

    A ball that left a wall comes back to it after 2 r v/a, a being the largest acceleration of the
    mass, and reaches the other one later still. What follows much sooner is the same contact, of a
    wall that is softer than the one whose contacts the template was learnt from. Its area is not
    known: the template is no measure of it.

    Parameters
    ----------
    found : Detection
        In order of time.
    x : Coarse
        Displacement, m.
    frequency : float
        Of the oscillation, Hz.
    clearance : float
        m.

    Returns
    -------
    Detection
        The jump of one that has parts is NaN, and so is its error.
    """
    n = found.time.size
    if n < 2:
        return found
    size = np.abs(found.jump)
    event = events_of(found.time, frequency=frequency)
    usual = float(np.median(np.bincount(event, size)))
    largest = (2.0 * math.pi * frequency) ** 2 * 0.5 * float(np.ptp(x.values))
    # Two impacts a cycle: four clearances, and the mass comes towards the ball.
    speed = 5.0 * clearance * frequency * np.maximum(size[1:], size[:-1]) / max(usual, 1e-300)
    apart = np.diff(found.time) > _SOONER * 2.0 * _LEAST_R * speed / max(largest, 1e-300)
    apart |= np.diff(event) > 0  # a contact of a twelfth of a period is none
    begins = np.flatnonzero(np.append(True, apart))
    if begins.size == n:
        return found
    whole = np.diff(begins, append=n) == 1
    total = np.maximum(np.add.reduceat(size, begins), 1e-300)

    def largest_of(values: FloatArray) -> FloatArray:
        return np.asarray(np.maximum.reduceat(values, begins))

    return replace(
        found,
        time=np.add.reduceat(size * found.time, begins) / total,
        time_error=np.add.reduceat(size * found.time_error, begins) / total,
        jump=np.where(whole, found.jump[begins], np.nan),
        jump_error=np.where(whole, found.jump_error[begins], np.nan),
        peak=largest_of(found.peak),
        strength=largest_of(found.strength),
        confidence=largest_of(found.confidence),
        crowded=~whole | found.crowded[begins],
        clipped=np.logical_or.reduceat(found.clipped, begins),
    )


def unmoved(
    found: Detection, x: Coarse, *, frequency: float, sign: float, lag: float,
) -> BoolArray:  # fmt: skip
    """Which spikes do not move the mass: the displacement would show a jump such as they ask for.

    Spikes within a few milliseconds are of one event, and their jumps add up. Where flights are too
    few to tell impacts from knocks, this tells most of them. Where there are knocks, some come
    within milliseconds of an impact: the displacement bends at one of the spikes of the event.

    Parameters
    ----------
    found : Detection
    x : Coarse
        Displacement, m.
    frequency : float
        Of the oscillation, Hz.
    sign, lag : float
        The acceleration over that of the displacement, by its sign or a factor; s by which the
        displacement is late.
    """
    event = events_of(found.time, frequency=frequency)
    jumps, times = found.jump / sign, found.time + lag
    size = np.maximum(np.bincount(event, np.abs(jumps)), 1e-300)
    at = np.bincount(event, np.abs(jumps) * times) / size
    net = np.asarray(np.bincount(event, jumps), dtype=np.float64)
    seen = slope_changes(x, at, net, frequency=frequency)
    off = np.maximum(np.abs(seen.jump - net), np.abs(np.abs(seen.jump) - size))
    odd = off > LIKELY * _AREA * size
    events, moves = _Events(x, at, frequency), np.ones(size.size, dtype=bool)
    asked, anew = np.zeros(size.size), odd.copy()
    while anew.any():  # without those that are knocks the others are seen better
        knocks = []
        for k in np.flatnonzero(anew).tolist():
            jump, error, _ = events.jump_of(k, at[k], moves)
            still = (jump / error) ** 2
            asked[k] = ((abs(jump) - size[k]) / math.hypot(error, _AREA * size[k])) ** 2
            if still < LIKELY**2 and asked[k] - still > SURE**2:
                knocks.append(k)
        moves[knocks], anew[:] = False, False
        for k in knocks:
            anew[events.around(k)] = True
        anew &= odd & moves
    knocked = ~moves[event]
    if knocked.any():  # and some may have come beside an impact
        for k in np.flatnonzero(moves & (asked > LIKELY**2)).tolist():
            own = np.flatnonzero(event == k)
            left = [events.jump_of(k, times[i], moves)[2] for i in own]
            knocked[np.delete(own, np.argmin(left))] = True
    return np.asarray(knocked)


@dataclass(frozen=True)
class _Events:
    """Times of spikes that the displacement tells apart, s."""

    x: Coarse
    at: FloatArray
    frequency: float

    def around(self, k: int) -> slice:
        """Those in the window of one of them."""
        ends = self.at[k] + np.array([-1.0, 1.0]) * _WINDOW / self.frequency
        return slice(*np.searchsorted(self.at, ends).tolist())

    def jump_of(self, k: int, when: float, moves: BoolArray) -> tuple[float, float, float]:
        """Jump of one of them at a time, by the displacement alone, its error; m/s.

        And the noise that this leaves, m. Its neighbours that move the mass have any jump, too:
        what their spikes say of it may be a knock's.
        """
        x, step = self.x, self.x.step
        centre = round((self.at[k] - x.start) / step)
        half = min(round(_WINDOW / self.frequency / step), centre, x.values.size - 1 - centre)
        inside = np.arange(centre - half, centre + half + 1)
        if x.missing is not None:
            inside = inside[~x.missing[inside]]
        t, near = x.start + step * inside, np.arange(self.at.size)[self.around(k)]
        beside = near[moves[near] & (near != k)]
        w = 2.0 * math.pi * self.frequency
        response = JumpResponse(w, late=x.late if x.late > _PROMPT else 0.0)
        bends = response.bend(t - np.append(when, self.at[beside])[:, np.newaxis], step)
        columns = np.concatenate([bends.T, smooth(t - self.at[k], w, full=True)[0]], axis=1)
        free = t.size - columns.shape[1]
        if free < 1 or not bends[0].any():
            return math.nan, math.nan, math.inf
        by = np.linalg.pinv(columns)  # one that begins at the end of the window bends nothing
        values = by @ x.values[inside]
        left = x.values[inside] - columns @ values
        noise = math.sqrt(float(left @ left) / free)
        return float(values[0]), noise * float(np.linalg.norm(by[0])), noise
