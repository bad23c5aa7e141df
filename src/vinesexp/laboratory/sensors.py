"""Sensors: the exact motion of the rig turned into volts, as a data sheet describes them.

A sensor does to the motion only what the scene asks for: what is left at its default changes
nothing. Everything is a function of the sample times, so that a record is made in blocks and an
hour of it needs no more memory than a second. What an instrument adds at random comes from a
generator that the caller derives from seed, record and channel.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray

#: A one-pole filter forgets its past to below a rounding error after this many time constants.
_FORGOTTEN = 37.0

# Contacts as an accelerometer shows them: half-sine pulses of the exact momentum.
#
# What is known exactly is how much of the velocity jump has been shown until a time; a sample is
# the difference of that over its interval, so that no momentum falls between two samples.
#: A ringing below this share of the pulse is lost in 24 bits; the window of a pulse ends there.
_RUNG_OUT = 1e-9

# A local mode: a resonance of the structure near the sensor that answers every impact.
#
# The sensor does not see the rigid mass alone but x + q, with q the coordinate of a mode that an
# impact excites as it excites the mass, times a share p:
#
#   q'' + 2 z w q' + w^2 q = p a_contact,    shown: x'' + q'' (accelerometer), x + q (laser).
#
# So an accelerometer shows (1 + p) times the jump at first and takes p of it back within a period
# of the mode. Everything is in closed form; a response is followed until 1e-6 of it is left.
#: A response below this share of its beginning has rung out.
RUNG_OUT = 1e-6
#: Numbers evaluated at a time: bounds the memory where many impacts ring for long.
_AT_ONCE = 2_000_000


def number(kind: str, may: str = "", default: Any = MISSING) -> Any:
    """A field that scene.yaml states: its kind, and what it may be besides above zero.

    Without a kind it is of the quantity that the sensor measures.
    """
    return field(default=default, metadata={"number": (kind, may)})


def numbers_of(what: type, own: str = "") -> dict[str, tuple[str, str]]:
    """Key to kind and what it may be, of each `number` of a dataclass; `own`: what it measures."""
    stated = {one.name: one.metadata["number"] for one in fields(what) if one.metadata}
    return {name: (kind or own, may) for name, (kind, may) in stated.items()}


@dataclass(frozen=True)
class LocalMode:
    """A local mode as one sensor shows it.

    Parameters
    ----------
    frequency : float
        Hz.
    share : float
        p: its response to an impact over that of the rigid mass.
    damping : float
        Damping ratio, below 1.
    """

    frequency: float = number("frequency", "needed")
    share: float = number("ratio", "needed signed")
    damping: float = number("ratio", "", 0.02)

    @property
    def lasts(self) -> float:
        """Time after which a response has rung out, s."""
        return math.log(1.0 / RUNG_OUT) / (2.0 * math.pi * self.damping * self.frequency)


def modal_velocity(t: FloatArray, mode: LocalMode, *, duration: float) -> FloatArray:
    """q' over the velocity jump of the mass, t after the beginning of a half-sine contact.

    The half-sine on [0, T] gives the mass the velocity g(t) + g(t - T), g = (1 - cos(pi t/T))/2;
    q' is that after H(s) = p s^2/(s^2 + 2 z w s + w^2), from rest.

    Examples
    --------
    >>> mode = LocalMode(frequency=100.0, share=0.3)
    >>> modal_velocity(np.array([0.0, 4e-4, 1.0]), mode, duration=4e-4).round(3).tolist()
    [0.0, 0.296, 0.0]
    """
    W, w = math.pi / duration, 2.0 * math.pi * mode.frequency
    H = -W * W / complex(w * w - W * W, 2.0 * mode.damping * w * W)
    return mode.share * _after_contact(t, H, 0.0, w=w, damping=mode.damping, duration=duration)


def _after_contact(
    t: FloatArray, H: complex, H_0: float, *, w: float, damping: float, duration: float
) -> FloatArray:
    """Response from rest to the velocity that a half-sine contact gives the mass.

    H and H_0 are the transfer function of a resonance at the frequency of the half-sine and at 0:
    from (H_0 - Re(H exp(iWt)))/2 the free ringing takes its start value and slope away.
    """
    W, decay, wd = math.pi / duration, damping * w, w * math.sqrt(1.0 - damping**2)
    A = H.real - H_0
    B = (decay * A - W * H.imag) / wd

    def response(s: FloatArray) -> FloatArray:
        s = np.maximum(s, 0.0)
        forced = H_0 - H.real * np.cos(W * s) + H.imag * np.sin(W * s)
        free = np.exp(-decay * s) * (A * np.cos(wd * s) + B * np.sin(wd * s))
        return np.asarray(0.5 * (forced + free))

    return response(t) + response(t - duration)


def modal_place(t: FloatArray, mode: LocalMode) -> FloatArray:
    """q over the velocity jump of the mass, t after an impact without duration, s."""
    w = 2.0 * math.pi * mode.frequency
    wd = w * math.sqrt(1.0 - mode.damping**2)
    s = np.maximum(t, 0.0)
    return mode.share / wd * np.exp(-mode.damping * w * s) * np.sin(wd * s)


def modal_displacement(
    mode: LocalMode, t: FloatArray, *, times: FloatArray, jumps: FloatArray
) -> FloatArray:
    """q of all impacts at the sorted times t, m."""
    found = np.zeros(t.size)
    first = np.searchsorted(t, times)
    last = np.searchsorted(t, times + mode.lasts)
    for k in np.flatnonzero(last > first):
        here = slice(first[k], last[k])
        found[here] += jumps[k] * modal_place(t[here] - times[k], mode)
    return found


class Grid(TypedDict):
    """Time of sample 0 and sample interval, s; number of samples."""

    start: float
    dt: float
    n: int


def modal_acceleration(
    mode: LocalMode, *, times: FloatArray, jumps: FloatArray, duration: float, **grid: Unpack[Grid]
) -> FloatArray:
    """q'' of all impacts, averaged over each of the n sample intervals, m/s^2.

    Parameters are those of `sensors.contact_acceleration`.
    """

    def gained(late: FloatArray) -> FloatArray:
        return modal_velocity(late, mode, duration=duration)

    lasts = duration + mode.lasts
    return averaged_over_samples(gained, times, jumps, duration=duration, lasts=lasts, **grid)


def averaged_over_samples(
    gained: Callable[[FloatArray], FloatArray],
    times: FloatArray,
    jumps: FloatArray,
    *,
    duration: float,
    lasts: float,
    **grid: Unpack[Grid],
) -> FloatArray:
    """Mean acceleration in each of n sample intervals, of contacts centred on their times.

    Parameters
    ----------
    gained : callable
        Velocity over the jump of the impact, at times (impacts, edges) after its contact begins.
    lasts : float
        s after the beginning of a contact for which it is followed.

    Others are those of `sensors.contact_acceleration`.
    """
    start, dt, n = grid["start"], grid["dt"], grid["n"]
    found = np.zeros(n)
    width = math.ceil(lasts / dt) + 2
    # first sample interval that the contact reaches into
    first = np.floor((times - 0.5 * duration - start) / dt + 0.5).astype(np.int64)
    inside = np.flatnonzero((first < n) & (first + width > 0))
    step = max(1, _AT_ONCE // width)
    for begin in range(0, inside.size, step):
        chosen = inside[begin : begin + step]
        index = first[chosen, np.newaxis] + np.arange(width + 1)
        edges = start + (index - 0.5) * dt - (times[chosen, np.newaxis] - 0.5 * duration)
        mean = np.diff(gained(edges), axis=1) * (jumps[chosen, np.newaxis] / dt)
        sample = index[:, :-1]
        here = (sample >= 0) & (sample < n)
        found += np.bincount(sample[here], weights=mean[here], minlength=n)
    return found


def pulse_momentum(
    t: FloatArray, *, duration: float, ring: float | None, ring_damping: float
) -> FloatArray:
    """Share of the velocity jump that the sensor has shown until t after the contact begins.

    The half-sine (pi/(2 T)) sin(pi t/T) on [0, T] integrates to g0(t) + g0(t - T) with
    g0(t) = (1 - cos(pi t/T))/2 for t > 0; a resonance H(s) = w^2/(s^2 + 2 z w s + w^2) turns g0
    into its response to that input from rest. H(0) = 1: the momentum stays exact.

    Parameters
    ----------
    t : array
        s after the beginning of the contact.
    duration, ring, ring_damping
        T in s; the resonance, Hz, and its damping ratio below 1.

    Returns
    -------
    array
        0 before the contact, 1 long after it.

    Examples
    --------
    >>> t = np.array([-1e-4, 0.0, 2e-4, 4e-4, 1.0])
    >>> pulse_momentum(t, duration=4e-4, ring=None, ring_damping=0.0).round(12).tolist()
    [0.0, 0.0, 0.5, 1.0, 1.0]
    """
    W = math.pi / duration
    if ring is None:
        # sin^2 keeps the first instants of the contact to full relative precision
        return np.asarray(np.sin(0.5 * W * np.clip(t, 0.0, duration)) ** 2)
    w = 2.0 * math.pi * ring
    H = w * w / complex(w * w - W * W, 2.0 * ring_damping * w * W)
    return _after_contact(t, H, 1.0, w=w, damping=ring_damping, duration=duration)


def contact_acceleration(
    times: FloatArray,
    jumps: FloatArray,
    *,
    duration: float,
    ring: float | None,
    ring_damping: float,
    **grid: Unpack[Grid],
) -> FloatArray:
    """Acceleration of the impacts, averaged over each sample interval.

    Sample k is the mean over start + (k -+ 1/2) dt, so that the samples times dt add up to the
    velocity jumps exactly, however few samples a pulse spans and wherever it falls between them.

    Parameters
    ----------
    times, jumps : array (k,)
        Impact times, s, rising, and jumps of the oscillator's velocity, m/s.
    duration, ring, ring_damping
        As of `pulse_momentum`; each contact is centred on its impact time.
    start, dt, n
        Time of sample 0 and sample interval, s; number of samples.

    Returns
    -------
    array (n,)
        m/s^2.

    Examples
    --------
    >>> a = contact_acceleration(
    ...     np.array([0.01]), np.array([-0.02]), duration=4e-4, ring=None, ring_damping=0.0,
    ...     start=0.0, dt=1e-4, n=200)
    >>> round(float(a.sum() * 1e-4), 15), int(np.argmin(a))
    (-0.02, 100)
    """
    tail = 0.0
    if ring is not None:
        tail = math.log(1.0 / _RUNG_OUT) / (ring_damping * 2.0 * math.pi * ring)

    def gained(late: FloatArray) -> FloatArray:
        share = pulse_momentum(late, duration=duration, ring=ring, ring_damping=ring_damping)
        share[:, 0], share[:, -1] = 0.0, 1.0  # what the window cuts off stays in its last sample
        return share

    lasts = duration + tail
    return averaged_over_samples(gained, times, jumps, duration=duration, lasts=lasts, **grid)


@dataclass(frozen=True)
class Drop:
    """The motion of a drop test; what a sensor asks of a `vinesexp.Motion`.

    Parameters
    ----------
    impacts : mapping
        Arrays `time, nes, side, x, v_before, v_after, vy_before, vy_after`, SI. The wall is
        that of side +1, below the ball; speeds are upwards.
    """

    impacts: Mapping[str, NDArray[Any]]

    def at(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The mass rests, as the base does."""
        return np.zeros_like(t), np.zeros_like(t)

    base = at

    def acceleration(self, t: FloatArray) -> FloatArray:
        """None between impacts."""
        return np.zeros_like(t)


@dataclass(frozen=True)
class Sensor:
    """What all sensors have.

    Parameters
    ----------
    sensitivity : float
        V per SI unit.
    offset : float
        V at zero, as the data sheet says.
    noise : float
        White noise, rms.
    bias : float
        Error of the zero that nobody knows.
    range : float or None
        It measures from -range to +range and says the end value beyond.
    gain, gain_uncertainty : float
        True gain over that of the data sheet; relative standard uncertainty that the sheet states.
    mode : Mode, optional
        A local mode of the structure that it shows besides the motion of the mass.
    """

    sensitivity: float
    offset: float = number("voltage", "signed", 0.0)
    noise: float = number("", "zero", 0.0)
    bias: float = number("", "signed", 0.0)
    range: float | None = number("", "", None)
    gain: float = 1.0
    gain_uncertainty: float = 0.0
    mode: LocalMode | None = None


@dataclass(frozen=True, kw_only=True)
class Laser(Sensor):
    """Contactless displacement sensor.

    Parameters
    ----------
    drift, drift_time : float
        Slow wander of the zero: m rms, and the shortest period in it, s.
    bandwidth : float or None
        Corner (-3 dB) of its first-order low-pass, Hz; None: as fast as the motion.
    """

    drift: float = number("displacement", "zero", 0.0)
    drift_time: float = number("time", "", 60.0)
    bandwidth: float | None = number("frequency", "", None)


@dataclass(frozen=True, kw_only=True)
class Accelerometer(Sensor):
    """Accelerometer on the mass; an impact is a half-sine pulse of the exact momentum.

    Parameters
    ----------
    pulse : float
        Duration of a contact, s; the pulse is centred on the impact time of the rigid model,
        so that outside the contact the motion is that of the model.
    ring, ring_damping : float or None, float
        Mounted resonance (Hz, damping ratio) that every pulse excites; None: none.
    ac_corner : float or None
        Corner of its AC coupling, Hz; None: it shows constant acceleration too.
    cross_axis : float
        Share of the base's acceleration that it shows besides its own.
    """

    pulse: float = number("time", "needed")
    ring: float | None = number("frequency", "", None)
    ring_damping: float = number("ratio", "", 0.02)
    ac_corner: float | None = number("frequency", "", None)
    cross_axis: float = number("ratio", "signed", 0.0)


def _one_pole(
    signal: Callable[[FloatArray], FloatArray], t: FloatArray, dt: float, corner: float
) -> tuple[FloatArray, FloatArray]:
    """A signal at the evenly spaced times t, and after a first-order low-pass of a corner (Hz).

    The signal is taken as linear between samples; the filter's memory is evaluated anew from
    the signal before t[0], so that blocks fit together without a seam.
    """
    from scipy.signal import lfilter

    q = 2.0 * math.pi * corner * dt
    taps = math.ceil(_FORGOTTEN / q) + 1
    values = signal(np.concatenate([t[0] - dt * np.arange(taps, 0, -1), t]))
    # The low-pass answers a straight line over one interval with these weights of its two ends.
    forgotten = math.exp(-q)
    mean = -math.expm1(-q) / q
    slow = lfilter([1.0 - mean, mean - forgotten], [1.0, -forgotten], values)
    return values[taps:], np.asarray(slow[taps:])


def low_passed(
    signal: Callable[[FloatArray], FloatArray], t: FloatArray, *, dt: float, bandwidth: float
) -> FloatArray:
    """`signal` after a first-order low-pass, at the evenly spaced times t.

    Parameters
    ----------
    signal : callable
        Times (s) to values; asked also before t[0].
    bandwidth : float
        Corner frequency, Hz.

    Examples
    --------
    >>> t = np.arange(4) * 1e-4
    >>> low_passed(lambda t: 2.0 * t, t, dt=1e-4, bandwidth=1e4).round(9).tolist()
    [-3.1831e-05, 0.000168169, 0.000368169, 0.000568169]
    """
    return _one_pole(signal, t, dt, bandwidth)[1]


def high_passed(
    signal: Callable[[FloatArray], FloatArray], t: FloatArray, *, dt: float, corner: float
) -> FloatArray:
    """`signal` after the AC coupling of a converter: a first-order high-pass of a corner (Hz).

    Before t = 0 there was no signal: the mass was held.

    Examples
    --------
    >>> t = np.arange(5) * 0.1
    >>> high_passed(np.ones_like, t, dt=0.1, corner=0.5).round(3).tolist()
    [0.858, 0.627, 0.458, 0.334, 0.244]
    """

    def let_go(t: FloatArray) -> FloatArray:
        return np.where(t >= -1e-9 * dt, signal(t), 0.0)

    values, slow = _one_pole(let_go, t, dt, corner)
    return values - slow


def slow_drift(
    rms: float, *, shortest_period: float, span: float, stream: np.random.Generator
) -> Callable[[FloatArray], FloatArray]:
    """A wander of the stated rms: eight sines of random phase and random period.

    Periods lie between one and four times the shortest.

    Returns
    -------
    callable
        Times in [0, span] to drift. Linear between knots 1/200 of the shortest period apart,
        which is within 1.3e-4 of the sines' amplitude.
    """
    periods = shortest_period * stream.uniform(1.0, 4.0, 8)
    phases = stream.uniform(0.0, 2.0 * math.pi, 8)
    knots = np.linspace(0.0, span, math.ceil(200.0 * span / shortest_period) + 2)
    waves = np.sin(2.0 * math.pi * knots[:, np.newaxis] / periods + phases)
    values = 0.5 * rms * waves.sum(axis=1)  # eight sines of amplitude a: rms 2 a
    return lambda t: np.asarray(np.interp(t, knots, values))


def laser_volts(
    laser: Laser,
    position: Callable[[FloatArray], FloatArray],
    t: FloatArray,
    *,
    dt: float,
    noise: np.random.Generator,
    drift: Callable[[FloatArray], FloatArray] | None = None,
    times: FloatArray | None = None,
    jumps: FloatArray | None = None,
) -> FloatArray:
    """Volts of a laser on `position` (times to m) at the evenly spaced times t.

    Order as in the instrument: motion and local mode, bandwidth, zero (bias, drift), noise, range,
    volts. `times` and `jumps` of the impacts are needed for a local mode alone.
    """
    seen, mode = position, laser.mode
    if mode is not None and times is not None and jumps is not None:
        at, by = times, jumps

        def seen(t: FloatArray) -> FloatArray:
            return position(t) + modal_displacement(mode, t, times=at, jumps=by)

    if laser.bandwidth is None:
        shown = seen(t).astype(np.float64, copy=True)
    else:
        shown = low_passed(seen, t, dt=dt, bandwidth=laser.bandwidth)
    if drift is not None:
        shown += drift(t)
    return _volts(laser, shown, noise)


def accelerometer_volts(
    accelerometer: Accelerometer,
    acceleration: Callable[[FloatArray], FloatArray],
    t: FloatArray,
    *,
    times: FloatArray,
    jumps: FloatArray,
    dt: float,
    noise: np.random.Generator,
    base_velocity: Callable[[FloatArray], FloatArray] | None = None,
) -> FloatArray:
    """Volts of an accelerometer at the evenly spaced times t.

    Parameters
    ----------
    acceleration : callable
        Times to acceleration between impacts, m/s^2.
    times, jumps : array (k,)
        Impact times, s, rising, and velocity jumps, m/s.
    base_velocity : callable, optional
        Times to x_e', m/s: needed for cross-axis sensitivity alone.
    """
    pulse, mode = accelerometer.pulse, accelerometer.mode

    def sensed(t: FloatArray) -> FloatArray:
        """What moves it, m/s^2: the mass, its contacts, the structure, the base."""
        shown = acceleration(t).astype(np.float64, copy=True)
        grid = Grid(start=float(t[0]), dt=dt, n=t.size)
        ring, damping = accelerometer.ring, accelerometer.ring_damping
        shown += contact_acceleration(
            times, jumps, duration=pulse, ring=ring, ring_damping=damping, **grid
        )
        if mode is not None:
            shown += modal_acceleration(mode, times=times, jumps=jumps, duration=pulse, **grid)
        if accelerometer.cross_axis and base_velocity is not None:
            gained = base_velocity(t + 0.5 * dt) - base_velocity(t - 0.5 * dt)
            shown += accelerometer.cross_axis / dt * gained
        return shown

    if accelerometer.ac_corner is None:
        return _volts(accelerometer, sensed(t), noise)
    shown = high_passed(sensed, t, dt=dt, corner=accelerometer.ac_corner)
    return _volts(accelerometer, shown, noise)


def _volts(sensor: Sensor, shown: FloatArray, noise: np.random.Generator) -> FloatArray:
    """What is common to all sensors, in place: bias, noise, range, sensitivity, offset."""
    if sensor.bias:
        shown += sensor.bias
    if sensor.noise:
        shown += sensor.noise * noise.standard_normal(shown.size)
    if sensor.range is not None:
        np.clip(shown, -sensor.range, sensor.range, out=shown)
    shown *= sensor.sensitivity
    if sensor.gain != 1.0:
        shown *= sensor.gain
    if sensor.offset:
        shown += sensor.offset
    return shown
