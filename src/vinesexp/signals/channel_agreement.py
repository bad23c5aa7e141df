"""Acceleration beside displacement: do they agree in sign, size and time?

Whatever the mass does, impacts included, its acceleration is the second derivative of its
displacement: A(w) = -w^2 X(w). Near the oscillation both are far above their noise, so that the
ratio tells the accelerometer's gain beside the laser's, a wrong sign, and the lag of one channel,
each to a small fraction of what a single impact would.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.records.store import RecordView
from vinesexp.signals.means import channel_means

_POINTS = 40  # a period
_BAND = (0.8, 1.2)  # of the oscillation


@dataclass(frozen=True)
class Agreement:
    """Acceleration over second derivative of displacement.

    Attributes
    ----------
    gain, gain_error : float
        1 where both are calibrated; negative where one channel has the wrong sign.
    lag, lag_error : float
        By which the displacement comes late beside the acceleration, s.
    """

    gain: float
    gain_error: float
    lag: float
    lag_error: float

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
    acceleration: FloatArray, displacement: FloatArray, step: float, *, frequency: float
) -> Agreement | None:
    """Compare two channels of one record; None where the record is too short to tell.

    Parameters
    ----------
    acceleration, displacement : arrays (n,)
        m/s^2 and m, on the same time axis, `step` s apart (means over the same samples).
    frequency : float
        Of the oscillation, Hz.

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
    f = np.fft.rfftfreq(n, step)
    near = (f > _BAND[0] * frequency) & (f < _BAND[1] * frequency)
    w = np.asarray(2.0 * math.pi * f[near], dtype=np.float64)
    A, Y = _both(acceleration[:n], displacement[:n], step, w, near)
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
    return Agreement(gain, error, lag, error / (abs(gain) * middle))


def _both(
    a: FloatArray, x: FloatArray, step: float, w: FloatArray, near: BoolArray
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Tapered transforms of a and of x''. The latter without derivatives of x: by parts,

    the integral of p exp(-iwt) x'' is that of (p'' - 2iw p' - w^2 p) exp(-iwt) x, exactly, as the
    taper p and its slope vanish at both ends. So a decay or a swell does no harm.
    """
    n = a.size
    phase = 2.0 * np.pi * (np.arange(n) + 0.5) / n
    rate = 2.0 * np.pi / (n * step)
    taper, slope, bend = (
        0.5 - 0.5 * np.cos(phase),
        0.5 * rate * np.sin(phase),
        0.5 * rate**2 * np.cos(phase),
    )
    x = x - x.mean()
    A = np.fft.rfft((a - a.mean()) * taper)[near]
    X, X1, X2 = (np.fft.rfft(x * window)[near] for window in (taper, slope, bend))
    return A, X2 - 2j * w * X1 - w**2 * X


def agreement_of(record: RecordView, *, frequency: float) -> Agreement | None:
    """Compare the two channels of a record; None where one is missing."""
    if not {"acceleration", "displacement"} <= set(record.roles):
        return None
    k = max(1, int(record.sample_rate / (_POINTS * frequency)))
    acceleration, displacement = (
        channel_means(record, role, k) for role in ("acceleration", "displacement")
    )
    return compare_channels(acceleration, displacement, k / record.sample_rate, frequency=frequency)
