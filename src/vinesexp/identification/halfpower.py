"""f0 and zeta from the width of a resonance: the cheapest method on a sweep.

Where the transmissibility has its peak, and where it has fallen to 1/sqrt(2) of it. For a base that
moves, peak and width of a lightly damped oscillator are f0 and 2 zeta f0 to first order in zeta.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError

FloatArray = NDArray[np.float64]

_SMEARED = 0.5  # of a line: error of peak and width, however quiet the record
_LINES_A_WIDTH = 6.0  # Fourier lines that the half-power width has to hold


@dataclass(frozen=True)
class HalfPower:
    """f0 (Hz) and zeta with their standard errors."""

    f0: float
    f0_error: float
    zeta: float
    zeta_error: float


def half_power(
    base: FloatArray, x: FloatArray, step: float, *, swept: tuple[float, float]
) -> HalfPower:
    """Read peak and half-power width off the ratio of two spectra.

    Parameters
    ----------
    base, x : arrays (n,)
        m, `step` s apart.
    swept : (low, high)
        Frequencies that the base went through, Hz.

    Returns
    -------
    HalfPower
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
    taper = np.hanning(x.size)
    f = np.fft.rfftfreq(x.size, step)
    chosen = (f > low) & (f < high)
    X = np.fft.rfft((x - x.mean()) * taper)[chosen]
    B = np.fft.rfft((base - base.mean()) * taper)[chosen]
    f = f[chosen]
    if f.size < 3 * _LINES_A_WIDTH:
        raise AnalysisError(
            f"{f.size} Fourier lines from {low:.4g} to {high:.4g} Hz; record a longer sweep"
        )
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
    basis = np.stack([np.ones(u.size), u, u * u], axis=1)
    c, covariance = _fitted(basis, level[part])
    found = _read(c, covariance, f0=float(f[top]), width=float(f[right] - f[left]))
    # The taper smears each line over its neighbours; peak and f0 differ in the second order.
    smeared = _SMEARED * float(f[1] - f[0])
    return HalfPower(
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


def _fitted(basis: FloatArray, level: FloatArray) -> tuple[FloatArray, FloatArray]:
    inverse = np.linalg.inv(basis.T @ basis)
    c = inverse @ (basis.T @ level)
    rest = level - basis @ c
    # Tapered lines are not independent: half as many count.
    return c, inverse * float(rest @ rest) / max(1, level.size - 3) * 2.0


def _read(c: FloatArray, covariance: FloatArray, *, f0: float, width: float) -> HalfPower:
    """Vertex and half-width at twice the lowest level, in lines of width `width` around f0."""

    def values(c: FloatArray) -> FloatArray:
        middle = -0.5 * c[1] / c[2]
        lowest = max(c[0] + 0.5 * c[1] * middle, 1e-300)
        peak = f0 + middle * width
        return np.array([peak, 0.5 * 2.0 * math.sqrt(lowest / c[2]) * width / peak])

    if c[2] <= 0.0 or c[0] - 0.25 * c[1] ** 2 / c[2] <= 0.0:
        raise AnalysisError("no resonance peak in the sweep")
    found = values(c)
    steps = 1e-6 * np.abs(c).max() * np.eye(3)
    slopes = np.stack([(values(c + s) - found) / s.max() for s in steps], axis=1)
    spread = np.sqrt(np.diag(slopes @ covariance @ slopes.T))
    return HalfPower(float(found[0]), float(spread[0]), float(found[1]), float(spread[1]))
