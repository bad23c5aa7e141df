"""From a simulated motion to the samples of an oscilloscope, in physical units."""

from __future__ import annotations

import math

import numpy as np
from benchmarks.robustness.motion import STEP, FloatArray, Path
from benchmarks.robustness.rig import Sensors
from scipy.signal import bilinear, lfilter

_EVERY = 2  # steps a sample at 10 kHz
_RATE = 1.0 / (_EVERY * STEP)
_TABLE = 2e-6  # s: of the tabulated answer of the sensor to one contact
_REACH = 0.03  # s


def measured(
    path: Path, sensors: Sensors, *, start: float, rng: np.random.Generator,
    frequency: float = 7.862,
) -> dict[str, FloatArray]:  # fmt: skip
    """Channels from `start` s on at the sensors' rate.

    Parameters
    ----------
    path : Path
        Motion since long before `start`, so that an accelerometer's slow corner has settled.
    """
    x = path.x[::_EVERY].copy()
    a = _smooth_acceleration(path, x.size)
    if sensors.cross_axis:
        late = round(_RATE / (4.0 * frequency))
        a = a + sensors.cross_axis * np.concatenate([np.zeros(late), a[:-late]])
    a = a + _pulses(path, sensors, x.size)
    if sensors.mode is not None:
        place, extra = _local_mode(path, sensors, x.size)
        x += place
        a += extra
    a = _coupled(a, sensors.corner)
    first = round(start * _RATE)
    drift = 5e-5 * np.sin(2.0 * math.pi * np.arange(x.size) / _RATE / 70.0 + rng.uniform(0, 6.28))
    mains = np.sin(2.0 * math.pi * 50.0 * np.arange(x.size) / _RATE)
    hum = sensors.hum * mains
    true = {
        "base": (path.base[::_EVERY], sensors.base_hum * mains, 2e-6, sensors.base_gain),
        "displacement": (
            _delayed(x, sensors), drift + 6e-6 * hum + 1e-3 * sensors.offset, 6e-6,
            sensors.laser_gain,
        ) if not sensors.vibrometer else (
            _coupled(path.v[::_EVERY], sensors.laser_corner), 1e-2 * sensors.offset, 3e-4,
            sensors.laser_gain,
        ),
        "acceleration": (a, 0.3 * hum + 10.0 * sensors.offset, 0.3, sensors.accelerometer_gain),
    }  # fmt: skip
    if not sensors.base:
        del true["base"]
    if not sensors.laser:
        del true["displacement"]
    if not sensors.accelerometer:
        del true["acceleration"]
    group = round(_RATE / sensors.rate)
    channels = {}
    for role, (values, more, noise, gain) in true.items():  # a wrong unit is that of all of it
        noisy = (values + more)[first:]
        noisy = gain * (noisy + sensors.noise * noise * rng.standard_normal(noisy.size))
        n = noisy.size // group * group
        shown = noisy[:n].reshape(-1, group).mean(axis=1)
        limit = {"acceleration": sensors.limit, "displacement": sensors.laser_limit}.get(role)
        if limit is not None:
            shown = np.clip(shown, -limit, limit)
        channels[role] = _in_steps(shown, sensors.bits)
    return channels


def _coupled(values: FloatArray, corner: float | None) -> FloatArray:
    """Behind an AC coupling."""
    if corner is None:
        return values
    w = 2.0 * math.pi * corner
    return np.asarray(lfilter(*bilinear([1.0, 0.0], [1.0, w], _RATE), values))


def _delayed(x: FloatArray, sensors: Sensors) -> FloatArray:
    """The laser's own delay and low-pass."""
    if sensors.low_pass is not None:
        w = 2.0 * math.pi * sensors.low_pass
        at_rest = x[0]
        x = at_rest + lfilter(*bilinear([w], [1.0, w], _RATE), x - at_rest)
    late = round(sensors.late * _RATE)
    return np.concatenate([np.full(late, x[0]), x[: x.size - late]]) if late else x


def _in_steps(values: FloatArray, bits: int | None) -> FloatArray:
    """As a converter shows them whose range is a third wider than the signal."""
    if bits is None:
        return values
    step = 2.0 * 1.33 * max(float(np.abs(values).max()), 1e-12) / 2**bits
    return np.asarray(step * np.round(values / step))


def _answer(sensors: Sensors) -> tuple[FloatArray, FloatArray]:
    """Share of a jump that the sensor has shown, over the time since the impact."""
    t = np.arange(-0.5 * sensors.pulse, _reach(sensors), _TABLE)
    push = np.where(t < 0.5 * sensors.pulse, np.cos(np.pi * t / sensors.pulse), 0.0)
    push *= 0.5 * np.pi / sensors.pulse
    if sensors.ring is not None:
        w = 2.0 * math.pi * sensors.ring
        low = bilinear([w * w], [1.0, 2.0 * sensors.ring_damping * w, w * w], 1.0 / _TABLE)
        push = lfilter(*low, push)
    shown = np.cumsum(push) * _TABLE
    return t + 0.5 * _TABLE, shown / (1.0 if sensors.ring else shown[-1])


def _reach(sensors: Sensors) -> float:
    """Time after an impact for which the sensor shows it, s: until a ringing is lost in noise."""
    if sensors.ring is None:
        return _REACH
    return max(_REACH, math.log(1e5) / (2.0 * math.pi * sensors.ring * sensors.ring_damping))


def _smooth_acceleration(path: Path, n: int) -> FloatArray:
    """Mean acceleration over each sample's interval, without the instantaneous impacts."""
    v = path.v[1::_EVERY].copy()
    edges = STEP * (1 + _EVERY * np.arange(v.size))
    jumped = np.concatenate([[0.0], np.cumsum(path.jump)])
    v -= jumped[np.searchsorted(path.time, edges, side="right")]
    a = np.zeros(n)
    a[1 : v.size] = np.diff(v) * _RATE
    a[0], a[v.size :] = a[1], a[v.size - 1]
    return a


def _pulses(path: Path, sensors: Sensors, n: int) -> FloatArray:
    """What the sensor shows of the impacts."""
    a = np.zeros(n)
    at, shown = _answer(sensors)
    width = int(_reach(sensors) * _RATE)
    for time, jump in zip(path.time, path.jump, strict=True):
        first = max(1, int((time - sensors.pulse) * _RATE))
        index = np.arange(first, min(n, first + width))
        if index.size < 2:
            continue
        edges = (np.append(index, index[-1] + 1) - 0.5) / _RATE - time
        share = np.interp(edges, at, shown, left=0.0)
        a[index] += sensors.pulse_area * jump * np.diff(share) * _RATE
    return a


def _local_mode(path: Path, sensors: Sensors, n: int) -> tuple[FloatArray, FloatArray]:
    """Displacement and acceleration that a mode struck by each impact adds."""
    assert sensors.mode is not None
    w = 2.0 * math.pi * sensors.mode
    pole = complex(-sensors.mode_damping * w, w * math.sqrt(1.0 - sensors.mode_damping**2))
    half = 0.5 / _RATE
    size = 2 * n
    struck = np.zeros(size, dtype=complex)
    first = np.ceil(path.time / half).astype(np.int64)
    inside = first < size
    np.add.at(
        struck, first[inside],
        path.jump[inside] * np.exp(pole * (first[inside] * half - path.time[inside])),
    )  # fmt: skip
    z = lfilter([1.0], [1.0, -np.exp(pole * half)], struck)
    q, speed = z.imag / pole.imag, (pole * z).imag / pole.imag
    jumped = np.concatenate([[0.0], np.cumsum(path.jump)])
    smooth = (
        speed[1::2] - jumped[np.searchsorted(path.time, half * (1 + 2 * np.arange(n)), "right")]
    )
    a = np.zeros(n)
    a[1:] = np.diff(smooth) * _RATE
    a += _pulses(path, sensors, n)
    return sensors.mode_share * q[::2], sensors.mode_share * a
