"""Place and velocity of the mass at its impacts where the accelerometer alone shows its motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.errors import AnalysisError
from vinesexp.records.store import RecordView
from vinesexp.settings.stages import SlopeSettings
from vinesexp.signals.impacts.detection import Detection
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.signals.impacts.slopes import Coarse, SlopeChanges, slope_changes
from vinesexp.signals.integrated_motion import IntegratedMotion, integrated_motion

_CUT = 0.02  # share of impacts beyond the sensor's range that spoils its integral
_CONTRADICT = 0.1  # by which areas of pulses and slopes of the integral may differ
_FEWEST = 10  # impacts
_EXACT = 1e-12  # m/s: error of a jump that is taken as it is
#: Share of the base's acceleration that an ordinary accelerometer shows across its axis.
ACROSS = 0.03


def may_be_integrated(record: RecordView, test: str, clearance: Sequence[float]) -> bool:
    """Whether a record is one whose displacement is looked for in its acceleration.

    A steady drive with one ball: a release begins with a step that no band-limited integral holds.
    """
    return test == "periodic" and len(clearance) == 1 and "displacement" not in record.roles


def slopes_of_integral(
    record: RecordView, found: Detection, *, frequency: float, settings: SlopeSettings
) -> SlopeChanges | None:
    """Place and velocity at each impact; None where the acceleration cannot show them.

    They are those of one sensor: its jumps are no second witness, and left out.
    """
    try:
        motion = motion_at_impacts(
            record, found.time, found.jump, found.clipped, frequency=frequency
        )
    except AnalysisError:
        return None
    slopes = _slopes(motion, found.time, found.jump, settings)
    if not abs(_ratio(slopes.jump, found.jump) - 1.0) < _CONTRADICT:
        return None
    unknown = np.full(found.time.size, np.nan)
    good = motion.within(found.time)
    return replace(
        slopes, jump=unknown, jump_error=unknown,
        x=np.where(good, slopes.x, np.nan), v_before=np.where(good, slopes.v_before, np.nan),
    )  # fmt: skip


def motion_at_impacts(
    record: RecordView, times: FloatArray, jumps: FloatArray, clipped: IntArray | BoolArray, *,
    frequency: float,
) -> IntegratedMotion:  # fmt: skip
    """The integrated motion of a record with impacts.

    Raises
    ------
    AnalysisError
        Too few impacts, an accelerometer beyond its range at many of them, or a motion that
        cannot be known; with the reason.
    """
    if times.size < _FEWEST:
        raise AnalysisError(f"{times.size} impacts found, expected {_FEWEST} or more")
    cut = float(np.mean(clipped != 0))
    if cut > _CUT:
        raise AnalysisError(
            f"the accelerometer is beyond its range at {cut:.0%} of the impacts: no displacement "
            "by integration"
        )
    return integrated_motion(record, times, jumps, frequency=frequency)


def _slopes(
    motion: IntegratedMotion, times: FloatArray, jumps: FloatArray, settings: SlopeSettings
) -> SlopeChanges:
    """Place and velocity with the jumps as the pulses show them."""
    coarse = Coarse(motion.x, motion.step, motion.start)
    return slope_changes(
        coarse, times, jumps, frequency=motion.frequency,
        jump_errors=np.full(times.size, _EXACT), settings=settings,
    )  # fmt: skip


def _ratio(slopes: FloatArray, pulses: FloatArray) -> float:
    """Slope changes over areas of pulses, robustly."""
    known = np.isfinite(slopes) & (np.abs(pulses) > 0.5 * np.median(np.abs(pulses)))
    return float(np.median(slopes[known] / pulses[known])) if known.any() else np.nan


@dataclass(frozen=True)
class Integrated:
    """A table of impacts whose places and velocities come from the acceleration.

    Attributes
    ----------
    motion : IntegratedMotion
    alternatives : tuple of Impacts
        The same table with each thing that the sensor leaves unknown off by its standard error:
        the phase at the oscillation, what it shows across its axis, the area of its pulses.
    """

    motion: IntegratedMotion
    alternatives: tuple[Impacts, ...]


def integrated_impacts(record: RecordView, impacts: Impacts, *, frequency: float) -> Integrated:
    """What remains unknown of a table that `slopes_of_integral` gave its places.

    Parameters
    ----------
    record : RecordView
    impacts : Impacts
    frequency : float
        Of the oscillation, Hz.

    Raises
    ------
    AnalysisError
        The acceleration does not show the displacement, and why.
    """
    times, jumps = impacts.time_s - record.start, impacts.jump_acceleration_m_s
    motion = motion_at_impacts(record, times, jumps, impacts.clipped, frequency=frequency)
    ratio = _ratio(_slopes(motion, times, jumps, SlopeSettings()).jump, jumps)
    if not abs(ratio - 1.0) < _CONTRADICT:
        raise AnalysisError(
            f"the pulses of the impacts have {1.0 / ratio:.3g} times the area that the motion "
            "after them shows: no displacement by integration of this acceleration"
        )
    turn = 2.0 * np.pi * frequency
    late = motion.phase_error / turn
    x, v, jump = impacts.x_m, impacts.v_before_m_s, impacts.velocity_jump_m_s
    middle = v + 0.5 * jump
    base_x, base_v = motion.base_at(times)
    return Integrated(motion, (
        replace(impacts, x_m=x + late * middle, v_before_m_s=v - late * turn**2 * x),
        replace(impacts, x_m=x + ACROSS * base_x, v_before_m_s=v + ACROSS * base_v),
        replace(impacts, v_before_m_s=middle - 0.5 * ratio * jump, velocity_jump_m_s=ratio * jump),
    ))  # fmt: skip
