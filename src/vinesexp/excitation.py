"""What drives a test: base motion, the release it starts from, and weakly nonlinear damping."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import as_floats, several
from vinesexp.errors import ParameterError
from vinesexp.rig import ABOVE_ZERO, FINITE, ZERO_OR_ABOVE, Checked, Kind, checked_number

_AMPLITUDE = ("base amplitude", "m", ZERO_OR_ABOVE)
_FREQUENCY = ("base frequency", "Hz", ABOVE_ZERO)
_PHASE = ("base phase", "", FINITE)
_DWELL = ("dwell", "s", ABOVE_ZERO)


def _check_each(thing: object, field: str, kind: Kind) -> None:
    """Make a field of a frozen dataclass a tuple of numbers, of one number, too."""
    values = tuple(checked_number(one, *kind) for one in several(getattr(thing, field)))
    object.__setattr__(thing, field, values)


@dataclass(frozen=True)
class Harmonic(Checked):
    """Base motion x_e = amplitude sin(2 pi frequency t + phase); m, Hz, rad."""

    amplitude: Annotated[float, _AMPLITUDE]
    frequency: Annotated[float, _FREQUENCY]
    phase: Annotated[float, _PHASE] = 0.0


@dataclass(frozen=True)
class Sweep(Checked):
    """Linear sine sweep of the base, f_start to f_end (Hz) in `duration` seconds.

    x_e = amplitude sin(phase + 2 pi (f_start t + (f_end - f_start) t^2/(2 duration))). After its
    duration the base goes on at f_end.
    """

    amplitude: Annotated[float, _AMPLITUDE]
    f_start: Annotated[float, ("sweep start", "Hz", ABOVE_ZERO)]
    f_end: Annotated[float, ("sweep end", "Hz", ABOVE_ZERO)]
    duration: Annotated[float, ("sweep duration", "s", ABOVE_ZERO)]
    phase: Annotated[float, _PHASE] = 0.0


@dataclass(frozen=True)
class SteppedSweep(Checked):
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

    amplitude: Annotated[float, _AMPLITUDE]
    frequencies: Sequence[float]
    dwell: float | Sequence[float]
    phase: Annotated[float, _PHASE] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_each(self, "frequencies", _FREQUENCY)
        if not self.frequencies:
            raise ParameterError("frequencies is empty: give at least one, in Hz")
        if np.ndim(self.dwell) == 0:
            object.__setattr__(self, "dwell", checked_number(self.dwell, *_DWELL))
        else:
            _check_each(self, "dwell", _DWELL)
        if len(self.dwells) != len(self.frequencies):
            raise ParameterError(
                f"dwell has {len(self.dwells)} times, expected {len(self.frequencies)}: one for "
                "each frequency, or one number for all"
            )

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
class Measured(Checked):
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
    sample_rate: Annotated[float, ("sample rate", "Hz", ABOVE_ZERO)]

    def __post_init__(self) -> None:
        super().__post_init__()
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
class WeakDamping(Checked):
    """Damping beyond c1: friction force -(quadratic u |u| + coulomb sign(u)), u = x' - x_e'.

    Parameters
    ----------
    quadratic : float
        N s^2/m^2, >= 0.
    coulomb : float
        N, >= 0. The oscillator can stick to the base; it moves when the force exceeds this value.
    """

    quadratic: Annotated[float, ("quadratic damping", "", ZERO_OR_ABOVE)] = 0.0
    coulomb: Annotated[float, ("Coulomb", "", ZERO_OR_ABOVE)] = 0.0


@dataclass(frozen=True)
class Release(Checked):
    """State at t = 0: x0, v0 of the oscillator, y0, vy0 of each ball (absolute; m, m/s).

    Left empty, y0 puts every ball in the centre of its cavity and vy0 at rest.
    """

    x0: Annotated[float, ("x0", "", FINITE)] = 0.0
    v0: Annotated[float, ("v0", "", FINITE)] = 0.0
    y0: Sequence[float] = field(default=())
    vy0: Sequence[float] = field(default=())

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("y0", "vy0"):
            _check_each(self, name, (name, "", FINITE))
