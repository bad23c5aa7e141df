"""The oscilloscope: volts of several channels to the codes of its converter.

A record is acquired in blocks; only the codes (two bytes a sample) are kept. Random numbers
come from streams named by seed, record, channel and purpose: adding a record, a channel or a
fault changes no other number.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray, IntArray
from vinesexp.laboratory.sensors import (
    Accelerometer,
    Drop,
    Laser,
    Sensor,
    accelerometer_volts,
    laser_volts,
    number,
    slow_drift,
)

if TYPE_CHECKING:
    from vinesexp.solver.motion import Motion

#: Samples made at once: a few MB, and seldom enough that finding its place costs a motion little.
_BLOCK = 1 << 17


@dataclass(frozen=True)
class Oscilloscope:
    """How channels become a file.

    Parameters
    ----------
    sample_rate : float
        Hz, as the file will say.
    bits : int
        Of the converter, at most 16.
    full_scale : float
        The converter spans -full_scale to +full_scale, V; beyond, it clips.
    format : str
        Export format, a name of `vinesexp.laboratory.instrument_files.FORMATS`.
    skew : mapping of str to float
        Role to delay: that channel is sampled so many seconds late.
    clock_error : float
        Relative: the true sample interval is (1 + clock_error)/sample_rate.
    dropped_samples : int
        So many samples, at random places, are missing in the file.
    """

    sample_rate: float = number("frequency", "needed")
    bits: int = 14
    full_scale: float = number("voltage", "", 1.0)
    format: str = "oscilloscope-csv"
    skew: Mapping[str, float] = field(default_factory=dict)
    clock_error: float = number("ratio", "signed", 0.0)
    dropped_samples: int = 0

    @property
    def step(self) -> float:
        """Volts of one code."""
        return float(2.0 * self.full_scale / 2**self.bits)


@dataclass(frozen=True)
class Capture:
    """What the oscilloscope holds in memory when it exports.

    Parameters
    ----------
    names : tuple of str
        Channel names: CH1, CH2, ...
    codes : int16 array (channels, samples)
    ticks : int64 array (samples,) or None
        Number of each sample on the scope's clock where some are missing; None: 0, 1, 2, ...
    scope : Oscilloscope
    """

    names: tuple[str, ...]
    codes: NDArray[np.int16]
    ticks: IntArray | None
    scope: Oscilloscope


def stream(seed: int, *words: str) -> np.random.Generator:
    """The generator of one purpose, the same for the same words and independent of all others.

    Examples
    --------
    >>> a, b = stream(1, "rd", "base"), stream(1, "rd", "base")
    >>> bool(a.random() == b.random()), bool(a.random() == stream(2, "rd", "base").random())
    (True, False)
    """
    digest = hashlib.sha256("\0".join(words).encode()).digest()[:16]
    entropy = [seed, int.from_bytes(digest, "little")]
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(entropy)))


def quantised(volts: FloatArray, scope: Oscilloscope) -> NDArray[np.int16]:
    """Converter codes: rounded to the nearest, clipped at the ends of the range.

    Examples
    --------
    >>> quantised(np.array([0.0, 0.4, 3.0]), Oscilloscope(1e4, bits=2, full_scale=1.0)).tolist()
    [0, 1, 1]
    """
    half = 2 ** (scope.bits - 1)
    codes = np.rint(volts / scope.step)
    np.clip(codes, -half, half - 1, out=codes)
    return codes.astype(np.int16)


def acquire(
    motion: Motion | Drop,
    sensors: Mapping[str, Sensor],
    scope: Oscilloscope,
    *,
    start: float,
    duration: float,
    seed: int,
    record: str,
) -> Capture:
    """Record `motion` from `start` for `duration` seconds.

    Parameters
    ----------
    motion : Motion or Drop
        Exact motion, from t = 0 to start + duration at least.
    sensors : mapping
        Role (`base`, `displacement`, `acceleration`) to sensor, in the order of the channels.
    scope : Oscilloscope
    start, duration : float
        s.
    seed, record
        What the random streams derive from.

    Returns
    -------
    Capture
    """
    n = round(duration * scope.sample_rate)
    dt = (1.0 + scope.clock_error) / scope.sample_rate
    signals = _signals(motion, until=start + duration)
    times = np.asarray(motion.impacts["time"], dtype=np.float64)
    jumps = np.asarray(motion.impacts["v_after"] - motion.impacts["v_before"], dtype=np.float64)
    codes = np.empty((len(sensors), n), dtype=np.int16)
    for row, (role, sensor) in zip(codes, sensors.items(), strict=True):
        noise = stream(seed, record, role, "noise")
        drift = _drift(sensor, start, duration, stream(seed, record, role, "drift"))
        late = start + scope.skew.get(role, 0.0)
        for first in range(0, n, _BLOCK):
            t: FloatArray = late + dt * np.arange(first, min(n, first + _BLOCK), dtype=np.float64)
            options: Any = {"dt": dt, "noise": noise, "jumps": jumps}
            if isinstance(sensor, Accelerometer):
                moves = signals["base velocity"]
                volts = accelerometer_volts(
                    sensor, signals[role], t, times=times, base_velocity=moves, **options
                )
            else:
                assert isinstance(sensor, Laser)
                shaken = times if role == "displacement" else times[:0]
                volts = laser_volts(sensor, signals[role], t, drift=drift, times=shaken, **options)
            row[first : first + t.size] = quantised(volts, scope)
    names = tuple(f"CH{number}" for number in range(1, len(sensors) + 1))
    return _with_samples_dropped(Capture(names, codes, None, scope), seed=seed, record=record)


def _signals(
    motion: Motion | Drop, *, until: float
) -> dict[str, Callable[[FloatArray], FloatArray]]:
    """What each role measures; a late or slow clock that runs past the end sees the end value."""

    def inside(t: FloatArray) -> FloatArray:
        return np.clip(t, 0.0, until)

    return {
        "base": lambda t: motion.base(inside(t))[0],
        "base velocity": lambda t: motion.base(inside(t))[1],
        "displacement": lambda t: motion.at(inside(t))[0],
        "acceleration": lambda t: motion.acceleration(inside(t)),
    }


def _drift(
    sensor: Sensor, start: float, span: float, random: np.random.Generator
) -> Callable[[FloatArray], FloatArray] | None:
    if not isinstance(sensor, Laser) or not sensor.drift:
        return None
    wander = slow_drift(sensor.drift, shortest_period=sensor.drift_time, span=span, stream=random)
    return lambda t: wander(t - start)


def _with_samples_dropped(trace: Capture, *, seed: int, record: str) -> Capture:
    """The trace without the samples that the scope lost; first and last always stay."""
    count = trace.scope.dropped_samples
    n = trace.codes.shape[1]
    if not count:
        return trace
    random = stream(seed, record, "dropped samples")
    lost = 1 + random.choice(n - 2, size=count, replace=False)
    kept = np.delete(np.arange(n), lost)
    return Capture(trace.names, np.ascontiguousarray(trace.codes[:, kept]), kept, trace.scope)
