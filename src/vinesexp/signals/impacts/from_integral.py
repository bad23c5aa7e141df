"""Place and velocity of the mass at its impacts where the accelerometer alone shows its motion.

The mass's displacement by integrating its accelerometer, where no laser shows it.

Between two frequencies nothing is lost: X = -A/w^2. What lies below the oscillation is left out,
so that offset and slow drift of the sensor do not count; free flights need differences of x alone.
What a sensor does to the phase at the oscillation does count. An AC coupling leads by atan(fc/f),
and shows above the oscillation, where the impacts and the base alone drive the mass:

    a + d (v - v_e) + s (x - x_e) = sum of jumps dv_j delta(t - t_j)

with d and s as the record itself shows them at its oscillation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vinesexp.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vinesexp.errors import AnalysisError
from vinesexp.records.stored.store import RecordView
from vinesexp.signals.base_motion import ORDER
from vinesexp.signals.channel_agreement import (
    ABOVE_IT,
    AT_IT,
    FINE_POINTS,
    PhaseLaw,
    law_of_lines,
    lines_between,
    lines_of_pulses,
    parts_of,
)
from vinesexp.signals.impacts.detection import Detection
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.signals.impacts.slopes import Coarse, SlopeChanges, slope_changes
from vinesexp.signals.means import coarse_channels
from vinesexp.units import SURE

_CUT = 0.02  # share of impacts beyond the sensor's range that spoils its integral
_CONTRADICT = 0.1  # by which areas of pulses and slopes of the integral may differ
_FEWEST = 10  # impacts
_EXACT = 1e-12  # m/s: error of a jump that is taken as it is

#: Share of the base's acceleration that an ordinary accelerometer shows across its axis.
ACROSS = 0.03
_LOW = (0.25, 0.5)  # of the oscillation: nothing below the first, everything above the second
_EDGE = 6.0  # periods at either end that the band's lower edge spoils
_CYCLES, _FEWEST_CYCLES = 12.0, 6.0  # periods in a segment: in short records fewer
_SEGMENTS = 5.0  # whole ones that a record holds at least
_ENOUGH = 100  # segments that the corner is looked for in
_PASSES = 3
_NEAREST = 0.25  # of the oscillation: a corner above is too near
_UNSURE = 0.02  # rad at the oscillation: a phase that is known less well is not known
_DRIFT = 0.1  # of the motion, between 0.3 and 0.6 of its frequency
_DRIFT_BAND = (0.3, 0.6)


def may_be_integrated(record: RecordView, test: str, clearance: Sequence[float]) -> bool:
    """Whether a record is one whose displacement is looked for in its acceleration.

    A steady drive with one ball: a release begins with a step that no band-limited integral holds.
    """
    return test == "periodic" and len(clearance) == 1 and "displacement" not in record.roles


def slopes_of_integral(
    record: RecordView, found: Detection, *, frequency: float
) -> SlopeChanges | None:
    """Place and velocity at each impact; None where the acceleration cannot show them.

    They are those of one sensor: its jumps are no second witness, and left out.
    """
    try:
        motion, slopes, _ = _at_impacts(record, found.time, found.jump, found.clipped, frequency)
    except AnalysisError:
        return None
    unknown = np.full(found.time.size, np.nan)
    good = motion.within(found.time)
    return replace(
        slopes, jump=unknown, jump_error=unknown, shift=unknown, shift_error=unknown,
        x=np.where(good, slopes.x, np.nan), v_before=np.where(good, slopes.v_before, np.nan),
    )  # fmt: skip


def _at_impacts(
    record: RecordView, times: FloatArray, jumps: FloatArray, clipped: IntArray | BoolArray,
    frequency: float,
) -> tuple[IntegratedMotion, SlopeChanges, float]:  # fmt: skip
    """The integrated motion, its slopes at impacts whose jumps are as the pulses show them.

    And by how much the slopes change over the areas of the pulses.

    Raises
    ------
    AnalysisError
        Too few impacts, an accelerometer beyond its range at many of them, a motion that cannot be
        known, or that contradicts the pulses; with the reason.
    """
    if times.size < _FEWEST:
        raise AnalysisError(f"{times.size} impacts found, expected {_FEWEST} or more")
    cut = float(np.mean(clipped != 0))
    if cut > _CUT:
        raise AnalysisError(
            f"the accelerometer is beyond its range at {cut:.0%} of the impacts: no displacement "
            "by integration"
        )
    motion = integrated_motion(record, times, jumps, frequency=frequency)
    exact = np.full(times.size, _EXACT)
    slopes = slope_changes(motion.x, times, jumps, frequency=frequency, jump_errors=exact)
    known = np.isfinite(slopes.jump) & (np.abs(jumps) > 0.5 * np.median(np.abs(jumps)))
    ratio = float(np.median(slopes.jump[known] / jumps[known])) if known.any() else math.nan
    if not abs(ratio - 1.0) < _CONTRADICT:
        raise AnalysisError(
            f"the pulses of the impacts have {1.0 / (ratio or math.nan):.3g} times the area that "
            "the motion after them shows: no displacement by integration of this acceleration"
        )
    return motion, slopes, ratio


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
    motion, _, ratio = _at_impacts(record, times, jumps, impacts.clipped, frequency)
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


@dataclass(frozen=True)
class OwnFrequency:
    """f0 of the mass in a test, by what impacts and base do to its motion at the oscillation.

    Attributes
    ----------
    value, error : Hz
        The error is that of the scatter along the record.
    by_area : float
        Relative change where the areas of pulses are larger by 1, or the base smaller.
    by_late : float
        Relative change where the base's channel is later, 1/s.
    """

    value: float
    error: float
    by_area: float
    by_late: float


@dataclass(frozen=True)
class IntegratedMotion:
    """The mass's displacement from its acceleration, and the base's, on one time axis.

    Attributes
    ----------
    x : Coarse
        Of the mass, m, without what is slower than a quarter of the oscillation.
    base_x, base_v : arrays (n,)
        Of the base, in the same band.
    frequency : float
        Hz.
    law : PhaseLaw
        AC corner of the sensor, which is corrected, and what of its phase remains unknown.
    own : OwnFrequency
        f0 of the mass; its damping is as unsure as the phase.
    """

    x: Coarse
    base_x: FloatArray
    base_v: FloatArray
    frequency: float
    law: PhaseLaw
    own: OwnFrequency

    @property
    def phase_error(self) -> float:
        """Standard error of the phase at the oscillation, rad."""
        turn = 2.0 * math.pi * self.frequency
        lag = turn * math.hypot(self.law.lag, self.law.lag_error)
        return math.hypot(lag, self.law.corner_error / self.frequency)

    def within(self, times: FloatArray) -> BoolArray:
        """Times that the ends of the record do not spoil."""
        edge, end = _EDGE / self.frequency, self.x.start + self.x.step * self.x.values.size
        return (times > edge) & (times < end - edge)

    def base_at(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Displacement and velocity of the base, m and m/s."""
        axis = self.x.start + self.x.step * np.arange(self.x.values.size)
        return np.interp(times, axis, self.base_x), np.interp(times, axis, self.base_v)


def integrated_motion(
    record: RecordView, times: FloatArray, jumps: FloatArray, *, frequency: float
) -> IntegratedMotion:
    """Integrate the acceleration of a driven record twice, in the band of its oscillation.

    Parameters
    ----------
    record : RecordView
        With acceleration and base.
    times, jumps : arrays (k,)
        Impacts: s from the first sample, and change of the mass's velocity, m/s.
    frequency : float
        Of the oscillation, Hz.

    Raises
    ------
    AnalysisError
        It cannot be done well enough, and why.
    """
    if "base" not in record.roles:
        raise AnalysisError(
            "the displacement was not recorded, and the acceleration cannot take its place: "
            "without a channel of the base the phase error of the sensor cannot be found"
        )
    if record.sample_rate < 2.5 * ABOVE_IT[1] * frequency:
        raise AnalysisError("sampled too slowly for a displacement from the acceleration")
    k, step, (a, base) = coarse_channels(record, frequency, FINE_POINTS, "acceleration", "base")
    periods = a.size * step * frequency
    cycles = min(_CYCLES, (periods - 2.0 * _EDGE) / _SEGMENTS)
    if cycles < _FEWEST_CYCLES:
        raise AnalysisError(
            f"{periods:.0f} periods are too few for a displacement from the acceleration, "
            f"expected {2.0 * _EDGE + _SEGMENTS * _FEWEST_CYCLES:.0f} or more"
        )
    start = 0.5 * (k - 1) / record.sample_rate
    x_e, v_e, _ = _integrated(base, step, frequency, ORDER[record.quantity("base")])
    corner = 0.0
    for _ in range(_PASSES):
        x, v, a_band = _integrated(a, step, frequency, 2, corner=corner)
        law, own = _law(
            (a_band, v - v_e, x - x_e, v_e), _integrated(a, step, frequency, 2)[2],
            times - start, jumps, step=step, frequency=frequency, cycles=cycles,
        )  # fmt: skip
        corner = law.corner
        if not -0.5 * frequency < corner < _NEAREST * frequency:
            raise AnalysisError(_near_corner(corner, frequency))
    found = IntegratedMotion(Coarse(x, step, start), x_e, v_e, frequency, law, own)
    _require_known(found)
    return found


def _near_corner(corner: float, frequency: float) -> str:
    if corner > 0.0:
        return (
            f"the accelerometer is AC-coupled (a corner near {corner:.2g} Hz), too near the "
            f"oscillation at {frequency:.3g} Hz for a displacement by integration"
        )
    return (
        "the phase of the accelerometer over frequency does not fit an AC coupling, as impacts and "
        "base show it: no displacement by integration. Check the sensitivity of the base"
    )


def _require_known(found: IntegratedMotion) -> None:
    """Refuse a motion whose phase or zero is not known well enough."""
    if found.phase_error > _UNSURE:
        raise AnalysisError(
            "the phase of the accelerometer at the oscillation is not known well enough "
            f"({math.degrees(found.phase_error):.2g} degrees) for a displacement by integration"
        )
    if found.law.corner < -SURE * found.law.corner_error:
        raise AnalysisError(_near_corner(found.law.corner, found.frequency))
    share = _slow_share(found)
    if share > _DRIFT:
        raise AnalysisError(
            f"the zero of the accelerometer drifts: {share:.0%} of its double integral is slower "
            "than the oscillation; no displacement by integration"
        )


def _slow_share(found: IntegratedMotion) -> float:
    """Rms of the motion somewhat slower than the oscillation, over that of all motion."""
    step = found.x.step
    edge = round(_EDGE / (found.frequency * step))
    x = found.x.values[edge:-edge]
    power = np.abs(np.fft.rfft(x * np.hanning(x.size))) ** 2
    f = np.fft.rfftfreq(x.size, step) / found.frequency
    slow = (f > _DRIFT_BAND[0]) & (f < _DRIFT_BAND[1])
    return math.sqrt(float(power[slow].sum()) / max(float(power.sum()), 1e-300))


def _integrated(
    values: FloatArray, step: float, frequency: float, order: int, *, corner: float = 0.0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Displacement, velocity, acceleration from the derivative of this order, band-limited.

    `corner`: Hz of an AC coupling that is undone.
    """
    n = values.size
    size = n + round(_EDGE / (frequency * step))
    f = np.fft.rfftfreq(size, step)
    ramp = np.clip((f / frequency - _LOW[0]) / (_LOW[1] - _LOW[0]), 0.0, 1.0)
    iw = 2j * np.pi * np.maximum(f, f[1])
    spectrum = np.fft.rfft(values - values.mean(), size) * np.sin(0.5 * np.pi * ramp) ** 2
    spectrum *= 1.0 + 2.0 * np.pi * corner / iw
    x, v, a = (np.fft.irfft(spectrum * iw ** (m - order), size)[:n] for m in range(3))
    return x, v, a


def _law(
    motion: tuple[FloatArray, FloatArray, FloatArray, FloatArray], measured: FloatArray,
    times: FloatArray, jumps: FloatArray, *, step: float, frequency: float, cycles: float,
) -> tuple[PhaseLaw, OwnFrequency]:  # fmt: skip
    """Phase of the measured acceleration beside what impacts and base do to the mass; its f0.

    Parameters
    ----------
    motion : acceleration of the mass, its velocity and displacement against the base, and the
        velocity of the base
    measured : the acceleration with whatever the sensor did to its phase
    times, jumps : impacts, on the axis of the arrays
    """
    size = round(cycles / (frequency * step))
    edge = round(_EDGE / (frequency * step))
    taper = 0.5 - 0.5 * np.cos(2.0 * np.pi * (np.arange(size) + 0.5) / size)

    def lines(values: FloatArray, used: BoolArray) -> ComplexArray:
        """Of shape (segments, lines)."""
        segments = parts_of(values[edge : values.size - edge], size)[:_ENOUGH]
        return np.fft.rfft(segments * taper)[:, used]

    def moved(used: BoolArray, w: FloatArray) -> tuple[ComplexArray, ...]:
        """The motions, and what impacts do to the first."""
        a, v, x, v_e = (lines(values, used) for values in motion)
        begins = edge + size // 2 * np.arange(len(a))
        struck = [lines_of_pulses(times - i * step, jumps, step, size, w) for i in begins]
        return a, v, x, v_e, np.stack(struck)

    at_it = moved(*lines_between(size, step, AT_IT, frequency))
    a, v, x, v_e, struck = (one.ravel() for one in at_it)
    d, s, own = _oscillator(v, x, a, struck, v_e)
    above, w = lines_between(size, step, ABOVE_IT, frequency)
    _, v, x, _, struck = moved(above, w)
    law = law_of_lines(lines(measured, above), struck - d * v - s * x, w, frequency=frequency)
    if law is None:
        raise AnalysisError(
            "the record does not show whether the accelerometer is AC-coupled: no displacement by "
            "integration"
        )
    return law, own


def _oscillator(
    v: ComplexArray, x: ComplexArray, a: ComplexArray, struck: ComplexArray, v_e: ComplexArray
) -> tuple[float, float, OwnFrequency]:
    """d and s of the equation of motion by lines at the oscillation, and f0 by s.

    A base that is shown late by a time lacks `v_e` times it: of its place, where the spring acts;
    what this makes of the damper's part is 2 zeta of that.
    """

    def real(lines: ComplexArray) -> FloatArray:
        return np.concatenate([lines.real, lines.imag])

    A, y = real(np.stack([v, x], axis=1)), real(np.stack([struck - a, struck, v_e], axis=1))
    size = np.linalg.norm(A, axis=0)
    solved = np.linalg.lstsq(A / size, y)[0] / size[:, None]
    (d, *_), (s, by_area, lacks) = solved.tolist()
    left = y[:, 0] - A @ solved[:, 0]
    variance = float(left @ left) / left.size * float(np.linalg.inv(A.T @ A)[1, 1])
    if not s > 0.0:
        return d, s, OwnFrequency(math.nan, math.nan, 0.0, 0.0)
    f0 = math.sqrt(s) / (2.0 * math.pi)
    # segments overlap by half
    error = 0.5 * f0 * math.sqrt(2.0 * variance) / s
    return d, s, OwnFrequency(f0, error, 0.5 * by_area / s, -0.5 * lacks)
