"""The shape that a contact leaves in the record: contact, sensor, sampling and filter in one.

A contact pushes for a time T, roughly as sin^p; the sensor may ring; the oscilloscope takes means
over its sample interval; the highpass takes the slow part away. `Template` is that shape, tabulated
between the samples, so that an impact's time can be found to a fraction of a sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from vinesexp.arrays import FloatArray

#: Table entries a sample: linear interpolation between them is below any noise.
FINE = 32
_SWINGS = 4.0  # of the ringing that may be larger than the first
_WIDE = 80.0  # durations: farther away an undershoot is lost in the noise
_CONTACT = 257  # points across the contact


@dataclass(frozen=True)
class Shape:
    """Parameters of a contact; lengths in samples.

    Attributes
    ----------
    duration : float
        Of the contact.
    power : float
        The push follows sin^power: 1 half sine, 1.5 about Hertz, 2 haversine.
    skew : float
        Zero: symmetric; positive: quick rise, slow fall.
    ring, ring_damping : float
        Frequency of a resonance (cycles a sample; 0: none) and its damping ratio.
    """

    duration: float
    power: float = 1.0
    skew: float = 0.0
    ring: float = 0.0
    ring_damping: float = 0.02

    @property
    def delay(self) -> float:
        """Samples by which the resonance delays slow motions."""
        return self.ring_damping / (math.pi * self.ring) if self.ring else 0.0


@dataclass(frozen=True)
class Template:
    """A template of height 1 as a function of the lag u = (sample - time of impact), in samples.

    Attributes
    ----------
    first : int
        Smallest lag of the table.
    values, slopes : arrays
        Template and its derivative, `FINE` entries a sample.
    area : float
        Momentum: velocity jump of a template of height 1, in sample intervals.
    kept : float
        Share of the momentum that the samples of the core add up to (the rest is undershoot and
        ringing).
    core : (int, int)
        Lags, inclusive, that hold the contact.
    model_error : array
        What single impacts differ from the shape, relative to their height, for each whole lag.
    shape : Shape
    corner : float
        Of the zero-phase highpass that the samples went through, cycles a sample; 0: none.
    learnt_from : int
        Impacts the shape was fitted to; 0: assumed.
    late : float
        Samples from the time of the template to the centre of all its momentum: what a resonance or
        a filter delays slow motions by, which the displacement has to be compared at.
    """

    first: int
    values: FloatArray = field(repr=False)
    slopes: FloatArray = field(repr=False)
    area: float
    kept: float
    core: tuple[int, int]
    model_error: FloatArray = field(repr=False)
    shape: Shape
    corner: float = 0.0
    learnt_from: int = 0
    late: float = 0.0

    @property
    def last(self) -> int:
        return self.first + (self.values.size - 1) // FINE

    @property
    def width(self) -> int:
        """Boxcar that shows it best, samples: about the contact's length at half height."""
        return max(1, round(0.75 * self.shape.duration))

    @property
    def search(self) -> int:
        """How far, in samples, a first guess may lie from the time: on a later swing."""
        swings = math.ceil(_SWINGS / self.shape.ring) if self.rings else 0
        return min(2 * self.width + 1 + swings, 200)

    @property
    def parts(self) -> int:
        """Steps a sample that a search takes: a tenth of a swing, a quarter of a contact each.

        A contact within one sample looks the same wherever it is: no small step leads out of it.
        """
        return max(1, math.ceil(10.0 * self.shape.ring), math.ceil(4.0 / self.shape.duration))

    @property
    def rings(self) -> bool:
        """Whether what follows the contact is more than the contact's own samples can show."""
        return self.shape.ring > 0.0

    def at(self, u: NDArray[Any]) -> tuple[FloatArray, FloatArray]:
        """Template and derivative at lags u; zero beyond the table."""
        place = (u - self.first) * FINE
        whole = np.floor(place)
        part = place - whole
        row = np.clip(whole + 1.0, 0.0, float(self.values.size)).astype(np.int64)
        value, rise, slope, turn = (np.take(table, row) for table in self._table)
        return value + part * rise, slope + part * turn

    @cached_property
    def taken(self) -> FloatArray:
        """What the highpass takes of a sample of height 1, so many samples away on either side."""
        return lowpassed_impulse(
            np.arange(self.last - self.first + 1, dtype=np.float64), self.corner
        )

    @cached_property
    def _table(self) -> list[FloatArray]:
        """Template, its steps, derivative and its steps, with a zero for what lies beyond."""
        v, s, none = self.values, self.slopes, np.zeros(1)
        inner = v[:-1], v[1:] - v[:-1], s[:-1], s[1:] - s[:-1]
        return [np.concatenate([none, table, none]) for table in inner]


def window(
    sample_rate: float, highpass: float | None, duration: float, *, ringing: float
) -> tuple[int, int]:
    """Lags that a template may fill: its undershoot from the highpass before, its ringing after."""
    under = 1.3 / highpass if highpass else 0.0  # the undershoot is down to 1e-3 of itself
    least, most = math.ceil(2.0 * duration) + 2, math.ceil(_WIDE * duration) + 2
    before = min(max(least, math.ceil(under * sample_rate)), most)
    after = min(max(least, math.ceil(max(under, ringing) * sample_rate)), most)
    return -before, after


def template_of(
    shape: Shape, span: tuple[int, int], *, highpass: float | None, dt: float,
    learnt_from: int = 0,
) -> Template:  # fmt: skip
    """Tabulate a shape. Its time is the centre of the contact's momentum.

    Parameters
    ----------
    shape : Shape
    span : (int, int)
        Lags of the table.
    highpass : float or None
        Corner of the zero-phase Butterworth highpass that the samples went through, Hz.
    dt : float
        Sample interval, s.

    Examples
    --------
    >>> template = template_of(Shape(duration=4.0), (-6, 12), highpass=None, dt=1e-4)
    >>> round(template.area, 3), round(float(template.at(np.array([0.0]))[0][0]), 3)
    (2.613, 1.0)
    """
    u = np.arange((span[1] - span[0]) * FINE + 1) / FINE + span[0]
    corner = math.sqrt(2.0) * math.pi * (highpass or 0.0) * dt / FINE
    contact, lost = _contact(shape.duration, shape.power, shape.skew, span, corner)
    momentum = 1.0  # of the contact: it survives the resonance, whose static gain is 1
    values = contact - lost
    if shape.ring > 0.0:
        values = _resonated(contact, shape)
        values = values - (_undershoot(values, corner) if corner else 0.0)
    height = float(np.abs(values).max())
    reach = math.ceil(0.5 * shape.duration * (1.0 + 0.3 * abs(shape.skew)) + 0.5)
    core = (-reach, reach)
    inside = (u >= core[0] - 0.5) & (u < core[1] + 0.5)
    kept = 1.0 - float(lost[inside].sum()) / FINE
    values = values / height
    model_error = 0.1 * neighbourhood(values, span[1] - span[0] + 1)  # until one is learnt
    slopes = np.gradient(values, 1.0 / FINE)
    return Template(
        span[0], values, slopes, momentum / height, kept, core, model_error, shape,
        (highpass or 0.0) * dt, learnt_from, shape.delay,
    )  # fmt: skip


def neighbourhood(values: FloatArray, size: int) -> FloatArray:
    """Largest size of a tabulated template within two samples of each whole lag."""
    padded = np.append(np.abs(values), np.zeros(size * FINE - values.size))
    top = padded.reshape(size, FINE).max(axis=1)
    return np.asarray(maximum_filter1d(top, 5, mode="nearest"))


@lru_cache(maxsize=8)  # a fit changes the resonance alone twice in three times
def _contact(
    duration: float, power: float, skew: float, span: tuple[int, int], corner: float
) -> tuple[FloatArray, FloatArray]:
    """Push of unit momentum about its centre, a mean over each sample; what the highpass takes."""
    u = np.arange((span[1] - span[0]) * FINE + 1) / FINE + span[0]
    phase = np.linspace(0.0, 1.0, _CONTACT)
    push = np.sin(np.pi * phase ** (2.0**-skew)) ** power
    push[-1] = 0.0  # sin(pi) is not zero in floating point; its powers would be NaN
    momentum = np.concatenate([[0.0], np.cumsum(0.5 * (push[1:] + push[:-1]))])
    total = momentum[-1]
    centre = 1.0 - float(np.trapezoid(momentum / total, phase))
    place = (phase - centre) * duration
    risen = np.interp(u + 0.5, place, momentum / total)
    contact = np.asarray(risen - np.interp(u - 0.5, place, momentum / total))
    return contact, _undershoot(contact, corner) if corner else np.zeros(u.size)


def _resonated(values: FloatArray, shape: Shape) -> FloatArray:
    """The template as a resonance shows it (its momentum then comes 2 z/w after the contact's)."""
    from scipy.signal import lfilter  # half a second to import

    w = 2.0 * math.pi * shape.ring / FINE  # rad a step of the table
    z = min(shape.ring_damping, 0.9)
    shrinks, turns = math.exp(-z * w), w * math.sqrt(1.0 - z * z)
    gain = w * w / turns * shrinks * math.sin(turns)
    poles = [1.0, -2.0 * shrinks * math.cos(turns), shrinks * shrinks]
    return np.asarray(lfilter([0.0, gain], poles, values))


def _undershoot(contact: FloatArray, corner: float) -> FloatArray:
    """What the highpass takes of a contact, ringing included, by a recursion either way.

    The impulse response is that of `lowpassed_impulse`; `corner` is its x for one step.
    """
    from scipy.signal import lfilter  # half a second to import

    shrinks = math.exp(-corner)
    numerator = [1.0, shrinks * (math.sin(corner) - math.cos(corner))]
    poles = [1.0, -2.0 * shrinks * math.cos(corner), shrinks * shrinks]
    after = lfilter(numerator, poles, contact)
    before = lfilter(numerator, poles, contact[::-1])[::-1]
    return np.asarray(0.5 * corner * (after + before - contact))


def lowpassed_impulse(t: FloatArray, corner: float) -> FloatArray:
    """What a zero-phase second-order Butterworth highpass takes from a unit impulse, 1/s.

    |H|^2 = f^4/(f^4 + fc^4) forward and backward leaves out fc^4/(f^4 + fc^4), whose impulse
    response is this.
    """
    x = math.sqrt(2.0) * np.pi * corner * np.abs(t)
    return np.asarray(math.sqrt(0.5) * np.pi * corner * np.exp(-x) * (np.cos(x) + np.sin(x)))


def spring_answer(
    template: Template, dt: float, highpass: float | None, frequency: float | None
) -> float:
    """What the measured jump is multiplied by because of the spring.

    After a jump dv the spring decelerates with w0^2 dv t. Highpassed, that ramp is
    w0^2 dv/(2 sqrt(2) wc) high at the contact itself, and adds to its area.
    """
    if not highpass or not frequency:
        return 1.0
    two_pi = 2.0 * np.pi
    height = (two_pi * frequency) ** 2 / (2.0 * np.sqrt(2.0) * two_pi * highpass)
    lags = np.arange(template.core[0], template.core[1] + 1)
    if template.rings:
        value = template.at(lags * 1.0)[0]
        return float(1.0 + height * dt * template.area * value.sum() / (value @ value))
    return float(1.0 + height * dt * lags.size / template.kept)
