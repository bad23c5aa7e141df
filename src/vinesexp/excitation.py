"""What drives a test: base motion, the release it starts from, and weakly nonlinear damping."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import as_floats, as_number, make_numbers, several
from vinesexp.errors import ParameterError
from vinesexp.rig import require


def _require_finite(name: str, value: float) -> None:
    require(math.isfinite(value), name, value, "a finite number")


def _require_amplitude(value: float) -> None:
    require(math.isfinite(value) and value >= 0, "base amplitude", value, "m, zero or above")


def _require_above_zero(name: str, value: float, unit: str) -> None:
    require(math.isfinite(value) and value > 0, name, value, f"{unit}, above zero")


def _make_tuple(thing: object, name: str) -> None:
    """Make a field of a frozen dataclass a tuple of floats, of one number, too."""
    values = tuple(as_number(one, name) for one in several(getattr(thing, name)))
    object.__setattr__(thing, name, values)


@dataclass(frozen=True)
class Harmonic:
    """Base motion x_e = amplitude sin(2 pi frequency t + phase); m, Hz, rad."""

    amplitude: float
    frequency: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        names = {"amplitude": "base amplitude", "frequency": "base frequency"}
        make_numbers(self, **names, phase="base phase")
        _require_amplitude(self.amplitude)
        _require_above_zero("base frequency", self.frequency, "Hz")
        _require_finite("base phase", self.phase)


@dataclass(frozen=True)
class Sweep:
    """Linear sine sweep of the base, f_start to f_end (Hz) in `duration` seconds.

    x_e = amplitude sin(phase + 2 pi (f_start t + (f_end - f_start) t^2/(2 duration))). After its
    duration the base goes on at f_end.
    """

    amplitude: float
    f_start: float
    f_end: float
    duration: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        names = {"amplitude": "base amplitude", "f_start": "sweep start", "f_end": "sweep end"}
        make_numbers(self, **names, duration="sweep duration", phase="base phase")
        _require_amplitude(self.amplitude)
        _require_above_zero("sweep start", self.f_start, "Hz")
        _require_above_zero("sweep end", self.f_end, "Hz")
        _require_above_zero("sweep duration", self.duration, "s")
        _require_finite("base phase", self.phase)


@dataclass(frozen=True)
class SteppedSweep:
    """Sine motion of the base that dwells on one frequency (Hz) after the other, phase continuous.

    Each frequency lasts `dwell` seconds (one time for all, or one for each); the last goes on.

    Raises
    ------
    ParameterError
        No frequency, one that is not above zero, or not as many times as frequencies.

    Examples
    --------
    >>> SteppedSweep(amplitude=0.25e-3, frequencies=[7.2, 7.8, 8.4], dwell=20.0).duration
    60.0
    >>> SteppedSweep(amplitude=0.25e-3, frequencies=[7.2, 7.8], dwell=[30.0, 10.0]).starts
    (0.0, 30.0)
    """

    amplitude: float
    frequencies: Sequence[float]
    dwell: float | Sequence[float]
    phase: float = 0.0

    def __post_init__(self) -> None:
        make_numbers(self, amplitude="base amplitude", phase="base phase")
        _make_tuple(self, "frequencies")
        if not self.frequencies:
            raise ParameterError("frequencies is empty: give at least one, in Hz")
        if np.ndim(self.dwell) == 0:
            make_numbers(self, dwell="dwell")
        else:
            _make_tuple(self, "dwell")
        if len(self.dwells) != len(self.frequencies):
            raise ParameterError(
                f"dwell has {len(self.dwells)} times, expected {len(self.frequencies)}: one for "
                "each frequency, or one number for all"
            )
        _require_amplitude(self.amplitude)
        for dwell in self.dwells:
            _require_above_zero("dwell", dwell, "s")
        _require_finite("base phase", self.phase)
        for frequency in self.frequencies:
            _require_above_zero("base frequency", frequency, "Hz")

    @property
    def dwells(self) -> tuple[float, ...]:
        """Time spent on each frequency, s."""
        if isinstance(self.dwell, float | int):
            return (float(self.dwell),) * len(self.frequencies)
        return tuple(self.dwell)

    @property
    def starts(self) -> tuple[float, ...]:
        """When each frequency begins, s."""
        return tuple(math.fsum(self.dwells[:n]) for n in range(len(self.frequencies)))

    @property
    def duration(self) -> float:
        """Length of the whole sweep, s."""
        return math.fsum(self.dwells)


@dataclass(frozen=True, eq=False)  # a record is the same only as itself
class Measured:
    """A measured base record: samples of x_e (m) from t = 0 at `sample_rate` (Hz).

    Between samples x_e is their quintic spline (four continuous derivatives), to which the response
    is then exact. For a motion sampled at n points a cycle the spline is off by about (2/n)^6 of
    the amplitude: 1e-9 at 64 points. The samples have to be band-limited to well below half their
    rate.

    Raises
    ------
    ParameterError
        Fewer than 6 samples, a sample that is not finite, a rate not above zero.
    """

    samples: ArrayLike
    sample_rate: float

    def __post_init__(self) -> None:
        make_numbers(self, sample_rate="sample rate")
        _require_above_zero("sample rate", self.sample_rate, "Hz")
        array = as_floats(self.samples, "base record").copy()
        if array.ndim != 1 or array.size < 6:
            raise ParameterError(
                f"base record of shape {array.shape}: expected one channel of at least 6 samples"
            )
        if not np.isfinite(array).all():
            first = int(np.argmin(np.isfinite(array)))
            raise ParameterError(
                f"base record, sample {first}: {array[first]}: expected a finite number; "
                "cut or repair the record"
            )
        array.setflags(write=False)
        object.__setattr__(self, "samples", array)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, s."""
        return (np.size(self.samples) - 1) / self.sample_rate


Base = Harmonic | Sweep | SteppedSweep | Measured


@dataclass(frozen=True)
class WeakDamping:
    """Damping beyond c1: friction force -(quadratic u |u| + coulomb sign(u)), u = x' - x_e'.

    Parameters
    ----------
    quadratic : float
        N s^2/m^2, >= 0.
    coulomb : float
        N, >= 0. The oscillator can stick to the base; it moves when the force exceeds this value.
    """

    quadratic: float = 0.0
    coulomb: float = 0.0

    def __post_init__(self) -> None:
        make_numbers(self, quadratic="quadratic damping", coulomb="Coulomb")
        for name, value in (("quadratic damping", self.quadratic), ("Coulomb", self.coulomb)):
            require(math.isfinite(value) and value >= 0, name, value, "a number, zero or above")


@dataclass(frozen=True)
class Release:
    """State at t = 0: x0, v0 of the oscillator, y0, vy0 of each ball (absolute; m, m/s).

    Left empty, y0 puts every ball in the centre of its cavity and vy0 at rest.
    """

    x0: float = 0.0
    v0: float = 0.0
    y0: Sequence[float] = field(default=())
    vy0: Sequence[float] = field(default=())

    def __post_init__(self) -> None:
        make_numbers(self, x0="x0", v0="v0")
        _make_tuple(self, "y0")
        _make_tuple(self, "vy0")
        for name, value in (("x0", self.x0), ("v0", self.v0)):
            _require_finite(name, value)
        for name, values in (("y0", self.y0), ("vy0", self.vy0)):
            for value in values:
                _require_finite(name, value)
