"""The base as it moved: amplitude, frequency, harmonics and steadiness from its own channel.

The test log says what the shaker was set to. A base that is 10 % below it moves b_c by 10 %, so the
channel on the base, where there is one, is what predictions use.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

import numpy as np

from vinesexp.arrays import ComplexArray, FloatArray
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.result_columns import BASE
from vinesexp.records.stored.store import RecordView
from vinesexp.signals.means import POINTS, coarse_channels
from vinesexp.signals.steady_part import error_of_mean
from vinesexp.units import SURE

#: Derivatives of displacement that each quantity is: x, iw x, -w^2 x.
ORDER = {"displacement": 0, "velocity": 1, "acceleration": 2}

_CYCLES = 4  # of a window
_FEWEST = 5  # windows
_HARMONICS = (1, 2, 3)
_SETTLED = 4  # passes that the frequency is refined in


@dataclass(frozen=True)
class BaseMotion:
    """How the base of one record moved; in the order of the columns of base.csv.

    Attributes
    ----------
    frequency, frequency_error : Hz.
    amplitude, amplitude_error : of the displacement at that frequency, m; the error is what noise
        and wander leave, without that of the channel's sensitivity.
    harmonic_2, harmonic_3 : displacement at twice and three times the frequency over `amplitude`.
    wander : standard deviation of the amplitude from window to window over its mean, noise apart.
    dip : largest drop of a window below the median, over the median.
    """

    frequency: float
    frequency_error: float
    amplitude: float
    amplitude_error: float
    harmonic_2: float
    harmonic_3: float
    wander: float
    dip: float


def base_motion(
    x: FloatArray, step: float, *, frequency: float, quantity: str = "displacement"
) -> BaseMotion | None:
    """Fit a sine with two harmonics to windows of four cycles.

    Parameters
    ----------
    x : ndarray, shape (n,)
        What the channel measured, SI; a constant and drift do no harm.
    step : float
        s between samples; some 48 a cycle are enough.
    frequency : float
        About that of the base, Hz; within 5 %.
    quantity : str
        ``displacement``, ``velocity`` or ``acceleration``.

    Returns
    -------
    BaseMotion or None
        None for a base at rest, or a record under twenty cycles.

    Examples
    --------
    >>> t = np.arange(20000) / 500.0
    >>> a = -0.25e-3 * (2 * np.pi * 7.87) ** 2 * np.sin(2 * np.pi * 7.87 * t)
    >>> found = base_motion(a, 1 / 500.0, frequency=7.8, quantity="acceleration")
    >>> round(1e3 * found.amplitude, 4), round(found.frequency, 4), found.dip < 1e-3
    (0.25, 7.87, True)
    """
    found = sine_windows(x, step, frequency=frequency, cycles=_CYCLES, fewest=_FEWEST)
    if found is None:
        return None
    level = np.abs(found.first)
    mean = float(level.mean())
    if not mean > SURE * found.noise:  # a dead channel has no noise either
        return None
    order, f = ORDER[quantity], found.frequency
    scale = (2.0 * np.pi * f) ** -order
    shares = [float(abs(h)) / k**order / mean for k, h in zip(_HARMONICS, found.means, strict=True)]
    single = float(level.std(ddof=1)) / math.sqrt(level.size)  # of windows that are independent
    wander = math.sqrt(max(float(level.var(ddof=1)) - found.noise**2, 0.0)) / mean
    return BaseMotion(
        frequency=f,
        frequency_error=found.frequency_error,
        amplitude=scale * mean,
        amplitude_error=scale * float(np.nanmax([single, error_of_mean(level)])),
        harmonic_2=shares[1],
        harmonic_3=shares[2],
        wander=wander,
        dip=max(1.0 - float(level.min() / np.median(level)), 0.0),
    )


@dataclass(frozen=True)
class SineWindows:
    """A sine with two harmonics in windows that follow one another, `every` s.

    Attributes
    ----------
    frequency, frequency_error : Hz.
    first : complex amplitude of the fundamental in each window, and `phase`, rad, counted from a
        sine of the frequency along the record.
    means, noise : of each harmonic over the windows; of a single window's fundamental.
    """

    frequency: float
    frequency_error: float
    every: float
    first: ComplexArray
    phase: FloatArray
    means: ComplexArray
    noise: float


def sine_windows(
    x: FloatArray, step: float, *, frequency: float, cycles: int, fewest: int
) -> SineWindows | None:
    """Fit windows of so many cycles, and refine the frequency; None for too few of them."""
    f = frequency
    for _ in range(_SETTLED):
        size = max(round(cycles / (f * step)), 8)
        count = x.size // size
        if count < fewest:
            return None
        windows = x[: count * size].reshape(count, size)
        found, means, noise = sines_of_windows(windows, step, f)
        # Each window's phase is counted from its own start: turned back to the record's start.
        turned = found[:, 0] * np.exp(-2j * np.pi * f * size * step * np.arange(count))
        phase = np.unwrap(np.angle(turned))
        slope, slope_error = _line(phase)
        turns = 2.0 * np.pi * size * step
        f += slope / turns
        if abs(slope / turns) < 1e-9 * f:
            break
    error = slope_error / turns
    return SineWindows(f, error, size * step, found[:, 0], phase, means, float(noise[0]))


def sines_of_windows(
    windows: FloatArray, step: float, f: float
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Complex amplitudes of each window, their means in phase with the first, and their noise."""
    size = windows.shape[1]
    t = np.arange(size) * step
    columns = [np.ones(size), np.linspace(-1.0, 1.0, size)]
    for k in _HARMONICS:
        columns += [np.cos(2 * np.pi * k * f * t), -np.sin(2 * np.pi * k * f * t)]
    basis = np.stack(columns, axis=1)
    inverse = np.linalg.pinv(basis)
    fitted = windows @ inverse.T
    rest = windows - fitted @ basis.T
    noise = float(rest.std()) * math.sqrt(size / max(size - basis.shape[1], 1))
    z = fitted[:, 2::2] + 1j * fitted[:, 3::2]
    # A harmonic stands still beside the k-th power of the fundamental; noise does not.
    turn = z[:, 0] / np.maximum(np.abs(z[:, 0]), 1e-300)
    means = np.array([(z[:, i] * turn.conj() ** k).mean() for i, k in enumerate(_HARMONICS)])
    spread = noise * np.sqrt(0.5 * ((inverse[2::2] ** 2) + (inverse[3::2] ** 2)).sum(axis=1))
    return z, means, spread


def _line(phase: FloatArray) -> tuple[float, float]:
    """Slope of phases over windows with its standard error, rad a window."""
    n = np.arange(phase.size) - 0.5 * (phase.size - 1)
    slope = float(n @ phase / (n @ n))
    rest = phase - phase.mean() - slope * n
    return slope, float(math.sqrt(rest @ rest / max(phase.size - 2, 1) / (n @ n)))


def base_rows(
    record: Record, *, measured: RecordView, conditioned: RecordView, steady_from: float | None
) -> list[dict[str, str | float | None]]:
    """The row of base.csv of a periodic test; none without a base channel, or for a base at rest.

    Parameters
    ----------
    record : Record
    measured, conditioned : RecordView
        As measured, and bandpassed.
    steady_from : float or None
        Start of the cycles that count, s from the first sample: the base that the mass answers in
        these; None for all.
    """
    frequency = conditioned.oscillation
    if record.test != "periodic" or not frequency or "base" not in measured.roles:
        return []
    counted = base_of(measured, frequency=frequency, begin=steady_from or 0.0)
    found = counted or base_of(measured, frequency=frequency)
    if found is None:
        return []
    return [{"record": record.id, **dict(zip(BASE.names[1:], astuple(found), strict=True))}]


def base_of(view: RecordView, *, frequency: float, begin: float = 0.0) -> BaseMotion | None:
    """Motion of the base in an open record, read by blocks, from `begin`, s, on.

    `frequency` is that of the oscillation, Hz.
    """
    _, step, (x,) = coarse_channels(view, frequency, POINTS, "base")
    left = float(np.sinc(frequency * step))  # by block means
    x = x[round(begin / step) :]
    return base_motion(x / left, step, frequency=frequency, quantity=view.quantity("base"))
