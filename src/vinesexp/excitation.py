"""What drives a test: base motion (harmonic, sweep) and the release it starts from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from vinesexp.rig import require


@dataclass(frozen=True)
class Harmonic:
    """Base motion x_e = amplitude sin(2 pi frequency t + phase); m, Hz, rad."""

    amplitude: float
    frequency: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        require(
            math.isfinite(self.amplitude) and self.amplitude >= 0,
            "base amplitude",
            self.amplitude,
            "m, zero or above",
        )
        require(
            math.isfinite(self.frequency) and self.frequency > 0,
            "base frequency",
            self.frequency,
            "Hz, above zero",
        )


@dataclass(frozen=True)
class Sweep:
    """Linear sine sweep x_e = amplitude sin(phase + 2 pi (f_start t + (f_end - f_start) t^2/(2 duration)))."""

    amplitude: float
    f_start: float
    f_end: float
    duration: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        require(self.amplitude >= 0, "base amplitude", self.amplitude, "m, zero or above")
        require(self.f_start > 0, "sweep start", self.f_start, "Hz, above zero")
        require(self.f_end > 0, "sweep end", self.f_end, "Hz, above zero")
        require(self.duration > 0, "sweep duration", self.duration, "s, above zero")


@dataclass(frozen=True)
class Release:
    """State at t = 0: x0, v0 of the oscillator, y0, vy0 of each ball (absolute; m, m/s)."""

    x0: float = 0.0
    v0: float = 0.0
    y0: Sequence[float] = field(default=())
    vy0: Sequence[float] = field(default=())
