"""What a record of a sweep without NES gives: f0 and zeta from base and mass."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len
from scipy.ndimage import uniform_filter1d

from vinesexp.arrays import ComplexArray, FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.identification.estimate import Estimate, estimates_of
from vinesexp.identification.least_squares import least_squares
from vinesexp.identification.oscillation import POINTS, motion_role
from vinesexp.identification.ringdown_result import Oscillation
from vinesexp.records.campaign.schema import Record
from vinesexp.records.stored.store import RecordView
from vinesexp.signals.base_motion import ORDER
from vinesexp.signals.means import channel_means, group_size
from vinesexp.units import LIKELY

_NEIGHBOURS = 4  # Fourier lines on each side that a ratio of spectra is smoothed over
_MOVED = 0.01  # of the base's strongest line
_COHERENT = 0.5  # coherence of base and mass; of noise alone it is 1 over the lines smoothed


# f0 and zeta from the width of a resonance: the cheapest method on a sweep.
#
# Where the transmissibility has its peak, and where it has fallen to 1/sqrt(2) of it. For a base
# that moves, peak and width of a lightly damped oscillator are f0 and 2 zeta f0 to first order in
# zeta.
_SMEARED = 0.5  # of a line: error of peak and width, however quiet the record
_LINES_A_WIDTH = 6.0  # Fourier lines that the half-power width has to hold


# f0 and zeta from the base's motion and the mass's, without impacts: any excitation will do.
#
# Between the Fourier transforms X and B of mass and base stands the transmissibility
#
#   (w0^2 - w^2 + 2 i zeta w0 w) X = g exp(-i w lag) (w0^2 + 2 i zeta w0 w) B + T(w)
#
# where T, a real polynomial in i w, is what the record cut off at both ends; g and lag are those
# of the channels. Both X and B are noisy: maximum likelihood weighs each line with the noise that
# passes through the equation to it. Only lines near the resonance are used, so that drift and hum
# stay out.

_TRANSIENT = 4  # coefficients of T
_MOVES = 20.0  # times the noise that the strongest line of the base has to be
_LINES = 12  # fewest
_FAR = 3.0  # times the highest line of the fit: from there on a spectrum holds noise only
_ENOUGH = 50  # lines that a level of noise is taken from
_BAND = (0.75, 1.25)  # of the resonance
_CYCLES = 4.0  # over which the largest amplitude of a sweep is a mean
_BENT = 0.05  # of the motion, left by a linear oscillator: worth a line
_STILL = "the base does not move near the resonance; a sweep is expected"


@dataclass(frozen=True)
class Transmissibility:
    """Result of a sweep.

    Attributes
    ----------
    f0, f0_error : float
        Hz.
    zeta, zeta_error : float
    gain, gain_error : float
        Displacement over base far below resonance: 1 if both are calibrated.
    lag, lag_error : float
        By which the displacement comes late beside the base, s.
    chi2 : float
        Misfit over its expectation.
    lines : int
        Fourier lines used.
    left : float
        What a linear oscillator leaves of the motion beyond noise, as a share of it.
    """

    f0: float
    f0_error: float
    zeta: float
    zeta_error: float
    gain: float
    gain_error: float
    lag: float
    lag_error: float
    chi2: float
    lines: int
    left: float


def transmissibility(
    base: FloatArray, x: FloatArray, step: float, *, frequency: float,
    swept: tuple[float, float] | None = None, powers: tuple[int, int] = (0, 0),
) -> Transmissibility:  # fmt: skip
    """Fit the oscillator to base and displacement.

    Parameters
    ----------
    base, x : arrays (n,)
        m, on the same time axis.
    step : float
        s.
    frequency : float
        About f0, Hz.
    swept : (low, high), optional
        Frequencies that the base went through, Hz; lines outside carry nothing.
    powers : (int, int)
        Of w/w0 by which the spectra of x and of the base are divided to be displacements: 2 for
        an acceleration over -w0^2.

    Raises
    ------
    AnalysisError
        Fewer than 12 Fourier lines near the resonance, or a base that does not move there.

    Examples
    --------
    >>> dt, n, f0, zeta = 0.005, 12000, 7.9, 0.02
    >>> t = dt * np.arange(n)
    >>> b = 1e-4 * np.sin(np.pi * t / 60) * np.sin(2 * np.pi * (7.0 * t + 0.015 * t * t))
    >>> w = 2 * np.pi * np.fft.rfftfreq(n, dt); w0 = 2 * np.pi * f0
    >>> H = (w0**2 + 2j * zeta * w0 * w) / (w0**2 - w**2 + 2j * zeta * w0 * w)
    >>> x = np.fft.irfft(H * np.fft.rfft(b), n)
    >>> found = transmissibility(b, x, dt, frequency=7.5)
    >>> round(found.f0, 6), round(found.zeta, 6), round(found.gain, 6)
    (7.9, 0.02, 1.0)
    """
    low, high = _BAND[0] * frequency, _BAND[1] * frequency
    if swept is not None:
        low, high = max(low, 0.97 * min(swept)), min(high, 1.03 * max(swept))
    n = next((k for k in range(x.size, 0, -1) if next_fast_len(k, real=True) == k), 1)
    f = np.asarray(np.fft.rfftfreq(n, step), dtype=np.float64)
    chosen = (f >= low) & (f <= high)
    if int(chosen.sum()) < _LINES:
        raise AnalysisError(
            f"{int(chosen.sum())} Fourier lines from {low:.4g} to {high:.4g} Hz, expected "
            f"{_LINES} or more; record a longer sweep through the resonance"
        )
    x, base = x[:n] - x[:n].mean(), base[:n] - base[:n].mean()
    X, B = np.fft.rfft(x), np.fft.rfft(base)
    noise_x, noise_b = (_line_noise(y, f, chosen, swept) for y in (x, base))
    bend_x, bend_b = (_to_displacement(f[chosen] / frequency, power) for power in powers)
    lines = _Lines(
        2.0 * math.pi * f[chosen], X[chosen] * bend_x, B[chosen] * bend_b,
        noise_x * np.abs(bend_x), noise_b * np.abs(bend_b),
    )  # fmt: skip
    if not (np.abs(lines.B) > _MOVES * lines.noise_b).any():
        raise AnalysisError(_STILL)
    return _solved(lines, 2.0 * math.pi * frequency)


def _to_displacement(ratio: FloatArray, power: int) -> ComplexArray:
    """What spectra are multiplied by: a velocity runs a quarter of a period ahead, too."""
    turn = -1j if power == 1 else 1.0 + 0.0j
    return np.asarray(turn * ratio ** -float(power), dtype=np.complex128)


def _line_noise(
    x: FloatArray, f: FloatArray, chosen: NDArray[np.bool_], swept: tuple[float, float] | None
) -> float:
    """Standard error of real and imaginary part of a line: from the quietest lines elsewhere.

    White noise is the same there as near the resonance. Far above the resonance and above what the
    base went through there is nothing else; where the record holds no such lines, the quietest
    part of the others counts. Tapered, since what the cut at both ends spreads over all lines is
    no noise: the fit allows for it.
    """
    taper = 1.0 - np.cos(2.0 * np.pi * (np.arange(x.size) + 0.5) / x.size)
    spectrum = np.abs(np.fft.rfft(x * taper / math.sqrt(1.5)))  # rms 1: the same noise as without
    last = f[chosen][-1]
    above = f > max(_FAR * last, 1.2 * max(swept) if swept else 0.0)
    # median of a Rayleigh variable: sqrt(2 ln 2) of one part's deviation
    one = math.sqrt(2.0 * math.log(2.0))
    if int(above.sum()) > _ENOUGH:
        return float(np.median(spectrum[above])) / one
    rest = spectrum[~chosen][1:]
    parts = [part for part in np.array_split(rest, max(1, rest.size // _ENOUGH)) if part.size]
    if not parts:
        return 0.0
    return float(min(np.median(part) for part in parts)) / one


@dataclass(frozen=True)
class _Lines:
    w: FloatArray
    X: ComplexArray
    B: ComplexArray
    noise_x: FloatArray
    noise_b: FloatArray


def _parts(p: FloatArray, lines: _Lines) -> tuple[ComplexArray, ComplexArray]:
    """Denominator and numerator (with gain and lag) at parameters (w0, zeta, gain, lag)."""
    w0, zeta, gain, lag = p
    s = 2j * zeta * w0 * lines.w
    return w0 * w0 - lines.w**2 + s, gain * np.exp(-1j * lines.w * lag) * (w0 * w0 + s)


def _weighted(p: FloatArray, lines: _Lines) -> tuple[ComplexArray, FloatArray]:
    """Equation error of every line and its standard deviation."""
    D, N = _parts(p, lines)
    sigma = np.sqrt((lines.noise_x * np.abs(D)) ** 2 + (lines.noise_b * np.abs(N)) ** 2)
    return D * lines.X - N * lines.B, np.maximum(sigma, 1e-300)


def _stack(z: ComplexArray) -> FloatArray:
    return np.concatenate([z.real, z.imag])


def _solved(lines: _Lines, start: float) -> Transmissibility:
    centre, half = float(lines.w.mean()), float(np.ptp(lines.w)) / 2.0 or 1.0
    # T(w) = sum of real c_k (i w)^k: in a shifted real basis, the same span and well conditioned.
    u = (lines.w - centre) / half
    powers = [u**k for k in range(_TRANSIENT)]
    transient = np.stack(
        [*(power * (1.0 + 0j) for power in powers), *(power * 1j for power in powers)], axis=1
    )
    peak = float(lines.w[np.argmax(np.abs(lines.X))])

    def problem(p: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        # The transient's polynomial could swallow a resonance outside the band: kept inside.
        inside = 0.7 * lines.w[0] < p[0] < 1.4 * lines.w[-1] and p[1] > 0.0
        return _misfit(p, lines, transient) if inside else None

    best = min(
        (
            least_squares(problem, np.array([w0, zeta, 1.0, 0.0]))
            for w0 in (start, peak)
            for zeta in (0.003, 0.02)
        ),
        key=lambda found: found.chi2,
    )
    p = best.values
    freedom = max(1, 2 * lines.w.size - 4 - transient.shape[1])
    chi2 = best.chi2 / freedom
    left = _share_left(p, lines, transient)
    # What is not that of a linear oscillator moves the resonance by as much of its width, at most.
    error = np.sqrt(np.diag(best.covariance) * max(1.0, chi2))
    error = np.hypot(error, left * np.array([p[0] * p[1], p[1], p[2], 0.0]))
    two_pi = 2.0 * math.pi
    return Transmissibility(
        float(p[0]) / two_pi, float(error[0]) / two_pi, float(p[1]), float(error[1]),
        float(p[2]), float(error[2]), float(p[3]), float(error[3]), chi2, lines.w.size, left,
    )  # fmt: skip


def _share_left(p: FloatArray, lines: _Lines, transient: ComplexArray) -> float:
    """What the fit surely leaves of the motion of the mass beyond noise, as a share of it."""
    error, sigma = _weighted(p, lines)
    left = _without(error / sigma, transient / sigma[:, np.newaxis]).reshape(2, -1)
    noise = (sigma / np.abs(_parts(p, lines)[0])) ** 2  # of either part of a line, squared
    beyond = float(((left**2).sum(axis=0) - 2.0) @ noise)
    sure = beyond - LIKELY * 2.0 * float(np.linalg.norm(noise))
    return math.sqrt(max(sure, 0.0) / float((np.abs(lines.X) ** 2).sum()))


def _without(z: ComplexArray, columns: ComplexArray) -> FloatArray:
    """Real and imaginary parts of z with real multiples of the columns projected out."""
    q = np.linalg.qr(np.concatenate([columns.real, columns.imag]))[0]
    r = _stack(z)
    return np.asarray(r - q @ (q.T @ r))


def _misfit(p: FloatArray, lines: _Lines, transient: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """The weighted misfit with T projected out, and its derivatives at the present weights."""
    error, sigma = _weighted(p, lines)
    basis = transient / sigma[:, np.newaxis]

    def out(z: ComplexArray) -> FloatArray:
        return _without(z / sigma, basis)

    changes = np.array([1e-7 * p[0], 1e-7, 1e-6, 1e-6 / p[0]])
    columns = []
    for k, change in enumerate(changes):
        moved = p.copy()
        moved[k] += change
        columns.append(out((_weighted(moved, lines)[0] - error) / change))
    return out(error), np.stack(columns, axis=1)


def half_power(
    base: FloatArray, x: FloatArray, step: float, *, swept: tuple[float, float]
) -> Oscillation:
    """Read peak and half-power width off the ratio of two spectra.

    Parameters
    ----------
    base, x : arrays (n,)
        m, `step` s apart.
    swept : (low, high)
        Frequencies that the base went through, Hz.

    Returns
    -------
    Oscillation
        The errors hold half a Fourier line besides the scatter of the curve that is read.

    Raises
    ------
    AnalysisError
        The curve does not fall to 1/sqrt(2) on both sides, or too few Fourier lines are in between.

    Examples
    --------
    >>> dt, n, f0, zeta = 0.005, 40000, 7.9, 0.01
    >>> t = dt * np.arange(n)
    >>> b = 1e-4 * np.sin(np.pi * t / 200) * np.sin(2 * np.pi * (7.2 * t + 0.0035 * t * t))
    >>> w = 2 * np.pi * np.fft.rfftfreq(n, dt); w0 = 2 * np.pi * f0
    >>> H = (w0**2 + 2j * zeta * w0 * w) / (w0**2 - w**2 + 2j * zeta * w0 * w)
    >>> found = half_power(b, np.fft.irfft(H * np.fft.rfft(b), n), dt, swept=(7.2, 8.6))
    >>> abs(found.f0 - 7.9) < 0.002, abs(found.zeta - 0.01) < 0.0002
    (True, True)
    """
    low, high = min(swept), max(swept)
    lines = np.fft.rfftfreq(max(x.size, 1), step)
    chosen = (lines > low) & (lines < high)
    f = lines[chosen]
    if f.size < 3 * _LINES_A_WIDTH:
        raise AnalysisError(
            f"{f.size} Fourier lines from {low:.4g} to {high:.4g} Hz; record a longer sweep"
        )
    taper = np.hanning(x.size)
    X = np.fft.rfft((x - x.mean()) * taper)[chosen]
    B = np.fft.rfft((base - base.mean()) * taper)[chosen]
    rounding = base.size * np.finfo(np.float64).eps * np.abs(base).max()
    if not np.abs(B).max() > rounding:
        raise AnalysisError(_STILL)
    gain = np.abs(X) / np.maximum(np.abs(B), 1e-6 * np.abs(B).max())
    # Near a peak 1/gain^2 is a parabola of the frequency: fitted, not read, it averages the noise.
    level = 1.0 / gain**2
    top = int(np.argmax(gain))
    left, right = _crossing(level, top, -1), _crossing(level, top, 1)
    if right - left < _LINES_A_WIDTH:
        raise AnalysisError(
            f"the resonance is {right - left} Fourier lines wide, expected {_LINES_A_WIDTH:g} or "
            "more; record a longer sweep"
        )
    part = slice(left, right + 1)
    u = (f[part] - f[top]) / (f[right] - f[left])
    c, covariance = np.polyfit(u, level[part], 2, cov=True)
    # Tapered lines are not independent: half as many count.
    found = _read(c, 2.0 * covariance, f0=float(f[top]), width=float(f[right] - f[left]))
    # The taper smears each line over its neighbours; peak and f0 differ in the second order.
    smeared = _SMEARED * float(f[1] - f[0])
    return Oscillation(
        found.f0, math.hypot(found.f0_error, smeared, found.zeta**2 * found.f0),
        found.zeta, math.hypot(found.zeta_error, smeared / found.f0),
    )  # fmt: skip


def _crossing(level: FloatArray, top: int, way: int) -> int:
    """Index where the level has doubled, on one side of the peak."""
    i = top
    while 0 < i < level.size - 1 and level[i] < 2.0 * level[top]:
        i += way
    if level[i] < 2.0 * level[top]:
        raise AnalysisError(
            "the sweep ends before the resonance has fallen to half of its power; sweep wider"
        )
    return i


def _read(c: FloatArray, covariance: FloatArray, *, f0: float, width: float) -> Oscillation:
    """Vertex and half-width at twice the lowest level, in lines of width `width` around f0."""

    def values(c: FloatArray) -> FloatArray:
        middle = -0.5 * c[1] / c[0]
        lowest = max(c[2] + 0.5 * c[1] * middle, 1e-300)
        peak = f0 + middle * width
        return np.array([peak, math.sqrt(lowest / c[0]) * width / peak])

    if c[0] <= 0.0 or c[2] - 0.25 * c[1] ** 2 / c[0] <= 0.0:
        raise AnalysisError("no resonance peak in the sweep")
    found = values(c)
    steps = 1e-6 * np.abs(c).max() * np.eye(3)
    slopes = np.stack([(values(c + s) - found) / s.max() for s in steps], axis=1)
    spread = np.sqrt(np.diag(slopes @ covariance @ slopes.T))
    return Oscillation(float(found[0]), float(spread[0]), float(found[1]), float(spread[1]))


def estimates_of_sweep(record: Record, view: RecordView, frequency: float | None) -> list[Estimate]:
    """f0, zeta, and gain and lag of the mass's channel against the base's.

    The mass's motion may be a displacement or an acceleration, and so may the base's: near the
    resonance one is the other times -w^2.

    Parameters
    ----------
    record : Record
        With the range of the sweep, where it is known.
    view : RecordView
        What was measured.
    frequency : float or None
        About f0, Hz, where something is known; the middle of a wide sweep is not.

    Raises
    ------
    AnalysisError
        No base channel, or no resonance in the sweep.
    """
    if "base" not in view.roles:
        raise AnalysisError("a sweep without NES gives f0 and zeta only with a base channel")
    role = motion_role(view)
    swept = record.frequency
    f0 = _resonance(view, role, swept, frequency)
    k = group_size(view.sample_rate, f0, points=POINTS)
    step = k / view.sample_rate
    base, x = channel_means(view, "base", k), channel_means(view, role, k)
    x -= x.mean()
    if view.quantity(role) != view.quantity("base"):
        to_motion = -1.0 / (2.0 * math.pi * f0) ** 2
        x = x * to_motion if view.quantity(role) == "acceleration" else x
        base = base * to_motion if view.quantity("base") == "acceleration" else base
        base = base / (2.0 * math.pi * f0) if view.quantity("base") == "velocity" else base
    found = transmissibility(
        base, x, step, frequency=f0, swept=swept,
        powers=_powers(view.quantity(role), view.quantity("base")),
    )  # fmt: skip
    largest = math.sqrt(2.0 * float(uniform_filter1d(x**2, round(_CYCLES / (f0 * step))).max()))
    if view.quantity(role) == "acceleration" == view.quantity("base"):
        largest /= (2.0 * math.pi * f0) ** 2
    rows = [
        ("f0", found.f0, found.f0_error, "Hz"),
        ("zeta", found.zeta, found.zeta_error, "1"),
        ("base_gain", found.gain, found.gain_error, "1"),
        ("base_lag", found.lag, found.lag_error, "s"),
    ]
    bent = _is_bent(found.left) if found.left > _BENT else ""
    return _by_half_power(record, base, x, step) + [
        Estimate(
            name, value, error, unit, "sweep", (record.id,), amplitude=largest,
            note=bent if name == "f0" else "",
        )
        for name, value, error, unit in rows
    ]  # fmt: skip


def _is_bent(left: float) -> str:
    """What checks.csv says of a resonance that is not that of a linear oscillator."""
    return (
        f"a linear oscillator leaves {100.0 * left:.2g} % of the motion in this sweep: damping or "
        "stiffness depends on the amplitude (friction, a spring that is not straight), or the base "
        "was not all that moved the mass; f0, zeta and the height of the resonance are as unsure. "
        "Ring-downs show how they depend on it"
    )


def _powers(mass: str, base: str) -> tuple[int, int]:
    """Power of w/w0 by which the spectra of mass and base are divided to be displacements."""
    return (0, 0) if mass == base else (ORDER[mass], ORDER[base])


def _resonance(
    view: RecordView, role: str, swept: tuple[float, float] | None, frequency: float | None
) -> float:
    """Where the mass answers the base most, Hz."""
    if swept is None and frequency is not None:
        return frequency
    low, high = (min(swept), max(swept)) if swept else (0.0, view.sample_rate / POINTS)
    k = group_size(view.sample_rate, high, points=POINTS)
    base, x = channel_means(view, "base", k), channel_means(view, role, k)
    taper = np.hanning(x.size)
    X, B = (np.fft.rfft((y - y.mean()) * taper) for y in (x, base))
    f = np.fft.rfftfreq(x.size, k / view.sample_rate)
    near = (f >= low) & (f <= high) & (f > 0.0)
    kernel = np.ones(2 * _NEIGHBOURS + 1)
    if near.sum() < kernel.size:
        return 0.5 * (low + high) if frequency is None else frequency
    power, own = (np.convolve(np.abs(Y[near]) ** 2, kernel, "same") for Y in (B, X))
    answer = np.abs(np.convolve(X[near] * B[near].conj(), kernel, "same"))
    coherent = answer**2 > _COHERENT * power * own  # where the base excites nothing it is not
    if swept is None:  # nor does it below what it was swept over, where drift is coherent too
        coherent &= power > _MOVED**2 * power.max()
    bend = f[near] ** float(ORDER[view.quantity("base")] - ORDER[view.quantity(role)])
    ratio = np.where(coherent, bend * answer / np.maximum(power, 1e-300), 0.0)
    return float(f[near][int(np.argmax(ratio))])


def _by_half_power(record: Record, base: FloatArray, x: FloatArray, step: float) -> list[Estimate]:
    """The cheap method, where the record is long enough for it."""
    if record.frequency is None:
        return []
    try:
        found = half_power(base, x, step, swept=record.frequency)
    except AnalysisError:  # the likelihood has said what it needs
        return []
    rows = [
        ("f0", found.f0, found.f0_error, "Hz"), ("zeta", found.zeta, found.zeta_error, "1")
    ]  # fmt: skip
    return estimates_of(record, "half power", rows)
