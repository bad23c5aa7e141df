"""Acceleration beside displacement: do they agree in sign, size and time?

Whatever the mass does, impacts included, its acceleration is the second derivative of its
displacement: A(w) = -w^2 X(w). Near the oscillation both are far above their noise, so that the
ratio gives the accelerometer's gain beside the laser's, a wrong sign, and the lag of one channel,
each to a small fraction of what a single impact would.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.store import RecordView
from vinesexp.signals.channel_phase import PhaseLaw, phase_law, second_derivative_beside
from vinesexp.signals.means import channel_means

_POINTS = 40  # a period
_FINER = 400  # a period, where impacts are looked at: they alias into what is coarser
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
    corner, corner_error : float
        Below which an AC-coupled accelerometer loses the motion, Hz; 0 where it shows none, NaN
        where the record cannot part a corner from a lag.
    across, across_error : float
        Phase by which the acceleration is behind at the oscillation and nowhere else, rad: of a
        sensor that shows motion across its axis. 0 where it shows none.
    """

    gain: float
    gain_error: float
    lag: float
    lag_error: float
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
    acceleration: FloatArray, displacement: FloatArray, step: float, *, frequency: float
) -> Agreement | None:
    """Compare two channels of one record; None where the record is too short for it.

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
    A, Y = second_derivative_beside(acceleration[:n], displacement[:n], step, w, near)
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
    return Agreement(gain, error, lag, error / (abs(gain) * middle))


def agreement_of(record: RecordView, *, frequency: float) -> Agreement | None:
    """Compare the two channels of a record; None where one is missing."""
    if not {"acceleration", "displacement"} <= set(record.roles):
        return None
    k = max(1, int(record.sample_rate / (_POINTS * frequency)))
    found = compare_channels(*_means(record, k), k / record.sample_rate, frequency=frequency)
    if found is None:
        return None
    k = max(1, int(record.sample_rate / (_FINER * frequency)))
    law = phase_law(
        *_means(record, k), k / record.sample_rate, frequency=frequency,
        lag=found.lag, lag_error=found.lag_error,
    )  # fmt: skip
    if law is None:  # one frequency cannot part a lag from a corner
        return replace(found, lag_error=math.hypot(found.lag_error, found.lag))
    return _with_corner(found, law, frequency)


def _means(record: RecordView, k: int) -> tuple[FloatArray, FloatArray]:
    return channel_means(record, "acceleration", k), channel_means(record, "displacement", k)


def _with_corner(found: Agreement, law: PhaseLaw, frequency: float) -> Agreement:
    """What the phase over all frequencies says of the phase at one.

    A corner that is there takes its part of the phase and of the gain; the lag is then that of all
    frequencies. Without one the oscillation alone knows the lag better.
    """
    if law.only_at_oscillation:
        w = 2.0 * math.pi * frequency
        error = math.hypot(found.lag_error, law.above_error)
        return replace(
            found, lag=law.above, lag_error=law.above_error,
            corner=0.0, corner_error=law.corner_error,
            across=w * (law.above - found.lag), across_error=w * error,
        )  # fmt: skip
    if not law.has_corner:
        return replace(found, corner=0.0, corner_error=law.corner_error)
    held = 1.0 / math.hypot(1.0, law.corner / frequency)
    return Agreement(
        found.gain / held, found.gain_error / held, law.lag, law.lag_error,
        law.corner, law.corner_error,
    )  # fmt: skip
