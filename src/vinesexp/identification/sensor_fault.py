"""Which sensor is wrong where laser and accelerometer disagree, and what error remains.

M by added masses needs neither sensor's scale: the sensor whose jumps give the same M is
believed, the other is recalibrated by the common factor. Where neither does, or no masses were
added, the displacement is kept and the disagreement becomes part of the errors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from vinesexp.identification.collision_model import collisions_of, fit
from vinesexp.identification.flights import Flights
from vinesexp.identification.jump_ratio import JumpRatio

Cause = Literal["laser gain", "accelerometer gain", "pulse area", "unknown gain", "unknown"]

#: A gain beside the other sensor's is off beyond this many errors, and by more than this.
_SURE, _MATTERS = 5.0, 3e-3
#: What a recalibration by a common factor leaves of the shift that it makes.
_LEFT = 0.1
#: The believed sensor is so many times nearer to the M of added masses.
_NEARER = 4.0


@dataclass(frozen=True)
class Fault:
    """A sensor that is off.

    Attributes
    ----------
    cause : what is wrong: ``pulse area`` covers ringing and templates, ``unknown`` a local mode.
    laser : factor by which the displacement is divided.
    jump : factor by which the accelerometer's jumps are divided; 0: they are left out.
    ratio : accelerometer's jumps over the displacement's.
    r_error, mass_error : what this leaves in r, and in M, relative.
    """

    cause: Cause
    laser: float
    jump: float
    ratio: float
    r_error: float
    mass_error: float


def mended(flights: Flights, fault: Fault | None) -> Flights:
    """Flights as a recalibrated sensor shows them.

    The mean of the velocities before and after an impact is known without the jump, so that a
    wrong jump moves either by half of its error.
    """
    if fault is None:
        return flights
    return recalibrated(flights, laser=fault.laser, jump=fault.jump)


def recalibrated(flights: Flights, *, laser: float, jump: float) -> Flights:
    """Displacement divided by `laser`; jumps of the accelerometer divided by `jump`."""
    f = flights
    middle = 0.5 * (f.v_before + f.v_after) / laser
    dv = f.jump
    if jump > 0.0 and np.isfinite(f.jump_acceleration).all():
        dv = f.jump_acceleration * np.sign((f.jump_acceleration * f.jump).sum()) / jump
    way = 2.0 * f.side * f.clearance
    return replace(
        f,
        v_before=middle - 0.5 * dv,
        v_after=middle + 0.5 * dv,
        jump=dv,
        u_before=(f.u_before + way / f.time_before) / laser - way / f.time_before,
        u_after=(f.u_after - way / f.time_after) / laser + way / f.time_after,
        v_previous=f.v_previous / laser,
        v_next=f.v_next / laser,
    )


def fault_of(
    flights: Sequence[Flights], *, ratio: JumpRatio | None, gain: tuple[float, float] | None,
    prior: tuple[float, float] | None,
) -> Fault | None:  # fmt: skip
    """The fault that the sensors show; None where they agree.

    Parameters
    ----------
    ratio : JumpRatio, optional
        Accelerometer's over displacement's jumps.
    gain : tuple (value, error), optional
        Accelerometer's over displacement's motion at the oscillation.
    prior : tuple (value, error), optional
        ln(M/m) from added masses.
    """
    off = gain is not None and abs(gain[0] - 1.0) > max(_SURE * gain[1], _MATTERS)
    if gain is not None and off:
        same = ratio is None or abs(ratio.ratio / gain[0] - 1.0) < max(5.0 * ratio.error, 0.01)
        if same:
            return _of_gain(flights, gain[0], prior)
    if ratio is None or not ratio.disagrees:
        return None
    return _of_jumps(flights, ratio, prior)


def _result(flights: Sequence[Flights], *, laser: float, jump: float) -> tuple[float, float]:
    """r and ln(M/m) of the plain model under a recalibration."""
    found = fit(collisions_of([recalibrated(f, laser=laser, jump=jump) for f in flights]), ())
    return float(found.values[0]), float(found.values[1])


def _of_gain(flights: Sequence[Flights], gain: float, prior: tuple[float, float] | None) -> Fault:
    """One of two sensitivities is wrong: laser (by 1/gain) or accelerometer (by gain)."""
    r_laser, m_laser = _result(flights, laser=1.0 / gain, jump=1.0)
    r_other, m_other = _result(flights, laser=1.0, jump=gain)
    between_r, between_m = abs(r_laser - r_other), abs(m_laser - m_other)
    if prior is not None:
        miss_laser, miss_other = abs(m_laser - prior[0]), abs(m_other - prior[0])
        clear = max(miss_laser, miss_other) > 4.0 * prior[1]
        if clear and _NEARER * miss_laser < miss_other:
            return Fault("laser gain", 1.0 / gain, 1.0, gain, _LEFT * between_r, _LEFT * between_m)
        if clear and _NEARER * miss_other < miss_laser:
            return Fault(
                "accelerometer gain", 1.0, gain, gain, _LEFT * between_r, _LEFT * between_m
            )
    return Fault("unknown gain", 1.0, gain, gain, between_r, between_m)


def _of_jumps(
    flights: Sequence[Flights], ratio: JumpRatio, prior: tuple[float, float] | None
) -> Fault:
    """The motion agrees and the jumps do not: the pulse, or something that answers it."""
    r_pulse, m_pulse = _result(flights, laser=1.0, jump=1.0)
    r_slope, m_slope = _result(flights, laser=1.0, jump=ratio.ratio)
    between_r, between_m = abs(r_pulse - r_slope), abs(m_pulse - m_slope)
    if prior is not None:
        miss_pulse, miss_slope = abs(m_pulse - prior[0]), abs(m_slope - prior[0])
        if _NEARER * miss_slope < miss_pulse and miss_slope < max(4.0 * prior[1], ratio.error):
            return Fault(
                "pulse area", 1.0, ratio.ratio, ratio.ratio,
                math.hypot(_LEFT * between_r, 0.0), math.hypot(_LEFT * between_m, ratio.error),
            )  # fmt: skip
        # Neither is right: each is off by as much as it misses M.
        share = (miss_slope + miss_pulse) / max(between_m, 1e-9)
        left = between_r * max(1.0, share)
        return Fault("unknown", 1.0, ratio.ratio, ratio.ratio, left, max(between_m, miss_slope))
    return Fault("unknown", 1.0, ratio.ratio, ratio.ratio, between_r, between_m)
