"""f0 and zeta from base and mass motion without impacts: the transmissibility, fitted as it is.

Over a finite record the Fourier sums obey, exactly but for sampling,

    X D e^(j w lag) = N X_e + (j w) p + q,   N = w0^2 + 2 j zeta w0 w,   D = N - w^2,

where p and q are two real numbers that carry the state at both ends: no steady state, no window and
no particular sweep is assumed. The lag between the two channels is fitted too: 30 us of it would
move f0 by twenty standard errors. Only bins in which the base moved are used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError
from vinesexp.identification.least_squares import gauss_newton

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_MARGIN = 0.04  # of the band on either side, where the response still rings
_FEWEST_BINS = 8


@dataclass(frozen=True)
class Transmissibility:
    """Natural frequency and damping from base to mass.

    Attributes
    ----------
    f0, zeta : undamped natural frequency, Hz; damping ratio.
    f0_error, zeta_error : standard errors.
    lag : of the displacement behind the base, s.
    residual : rms of what the fit leaves over rms of the response, in the band.
    """

    f0: float
    zeta: float
    f0_error: float
    zeta_error: float
    lag: float
    residual: float


def fourier_sums(x: Floats, *, sample_rate: float, band: tuple[float, float]) -> Complex:
    """Integral of x e^(-j w t) over the record by the trapezoidal rule, at the bins in `band`.

    Bins are multiples of one over the record's length from first to last sample.
    """
    n = len(x) - 1
    looped = np.array(x[:n])
    looped[0] = 0.5 * (x[0] + x[n])  # e^(-j w t) is the same at both ends
    first, last = (math.ceil(edge * n / sample_rate) for edge in band)
    spectrum = np.fft.rfft(looped)[first:last]
    return np.asarray(spectrum / sample_rate)


def fit_transmissibility(
    base: Floats,
    displacement: Floats,
    *,
    sample_rate: float,
    band: tuple[float, float],
    frequency: float | None = None,
) -> Transmissibility:
    """Fit f0 and zeta to base and displacement of a record without impacts.

    Parameters
    ----------
    base, displacement : ndarray, shape (n,)
        In the same unit.
    sample_rate : float
        Hz.
    band : (low, high)
        Frequencies that the base went through, Hz.
    frequency : float, optional
        First guess; else where the displacement is largest.

    Raises
    ------
    AnalysisError
        Too short a record for the band, or no resonance in it.
    """
    wide = (band[0] * (1.0 - _MARGIN), band[1] * (1.0 + _MARGIN))
    n = len(displacement) - 1
    X = fourier_sums(displacement, sample_rate=sample_rate, band=wide)
    X_e = fourier_sums(base, sample_rate=sample_rate, band=wide)
    first = math.ceil(wide[0] * n / sample_rate)
    w = 2.0 * math.pi * (first + np.arange(X.size)) * sample_rate / n
    if X.size < _FEWEST_BINS:
        raise AnalysisError(
            f"{X.size} frequencies between {wide[0]:.4g} and {wide[1]:.4g} Hz, expected "
            f"{_FEWEST_BINS} or more: the record is too short"
        )
    w_guess = 2.0 * math.pi * frequency if frequency else float(w[np.argmax(np.abs(X))])
    start = np.array([w_guess, 0.01, 0.0, 0.0, 0.0])
    start[3:] = _state_terms(w, X, X_e, start)
    data = np.concatenate([X.real, X.imag])
    found, covariance, residual = gauss_newton(lambda p: _model(w, X_e, p), data, start)
    if not wide[0] < found[0] / (2.0 * math.pi) < wide[1] or found[1] <= 0.0:
        raise AnalysisError(
            f"no resonance between {wide[0]:.4g} and {wide[1]:.4g} Hz in the response"
        )
    errors = np.sqrt(np.diag(covariance) * float(residual @ residual) / (data.size - start.size))
    return Transmissibility(
        f0=float(found[0]) / (2.0 * math.pi),
        zeta=float(found[1]),
        f0_error=float(errors[0]) / (2.0 * math.pi),
        zeta_error=float(errors[1]),
        lag=float(found[2]),
        residual=float(np.linalg.norm(residual) / np.linalg.norm(data)),
    )


def _parts(w: Floats, p: Floats) -> tuple[Complex, Complex]:
    N = p[0] ** 2 + 2j * p[1] * p[0] * w
    return N, N - w * w


def _state_terms(w: Floats, X: Complex, X_e: Complex, p: Floats) -> Floats:
    """p and q of the module's equation for given w0 and zeta, by linear least squares."""
    N, D = _parts(w, p)
    rest = X - N * X_e / D
    columns = np.stack([1j * w / D, 1.0 / D], axis=1)
    stacked = np.concatenate([columns.real, columns.imag])
    right = np.concatenate([rest.real, rest.imag])
    return np.asarray(np.linalg.lstsq(stacked, right, rcond=None)[0])


def _model(w: Floats, X_e: Complex, p: Floats) -> tuple[Floats, Floats]:
    N, D = _parts(w, p)
    late = np.exp(-1j * w * p[2])
    X = (N * X_e + 1j * w * p[3] + p[4]) / D
    by_w0 = 2.0 * p[0] + 2j * p[1] * w
    by_zeta = 2j * p[0] * w
    columns = np.stack(
        [by_w0 * (X_e - X) / D, by_zeta * (X_e - X) / D, -1j * w * X, 1j * w / D, 1.0 / D], axis=1
    )
    X, columns = late * X, late[:, None] * columns
    return (
        np.concatenate([X.real, X.imag]),
        np.concatenate([columns.real, columns.imag]),
    )
