"""b_c and b_t with their 95 % intervals, from rig values and their uncertainty (delta method)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.errors import ParameterError, nearest
from vinesexp.rig import RIG_VALUES, checked
from vinesexp.theory.manifold import loss_parameter
from vinesexp.theory.optimal_clearance import b_t_exact, b_t_published, release_amplitude
from vinesexp.theory.sensitivity import gradient_exact, gradient_published
from vinesexp.units import COVERAGE_95, Quantity

#: Rig values that a prediction depends on, in the order of every gradient and covariance.
VALUES = RIG_VALUES


@dataclass(frozen=True)
class ClearancePrediction:
    """A predicted clearance with its uncertainty; m.

    Attributes
    ----------
    published, exact : the paper's formula and the exact value.
    std_error : standard error of `exact`, from those of the rig's values.
    low, high : its 95 % interval, not below zero.
    gradient : d exact/d value for each of `VALUES`, SI.
    gradient_published : the same of `published`.
    """

    published: float
    exact: float
    std_error: float
    low: float
    high: float
    gradient: Mapping[str, float] = field(default_factory=dict)
    gradient_published: Mapping[str, float] = field(default_factory=dict)


def rig_values(values: Mapping[str, Quantity], needed: tuple[str, ...]) -> dict[str, float]:
    """The numbers of the values needed; ParameterError where one is missing or unknown."""
    missing = [name for name in needed if name not in values]
    if missing:
        raise ParameterError(
            f"rig values missing: {', '.join(missing)}; given: {', '.join(values) or 'none'}"
        )
    for name in values:
        if name not in VALUES:
            raise ParameterError(f"unknown rig value '{name}'; {nearest(name, VALUES)}")
    return {name: float(values[name].value) for name in needed}


def covariance_of(values: Mapping[str, Quantity], covariance: ArrayLike | None) -> FloatArray:
    """5 x 5 covariance in the order of `VALUES`: the one given, else independent standard errors.

    Raises
    ------
    ParameterError
        A matrix of another shape, not symmetric, or with a negative variance.
    """
    if covariance is None:
        errors = [values[n].std_error if n in values else 0.0 for n in VALUES]
        return np.diag(np.square(checked(errors, "standard error", "a number, zero or above")))
    matrix = np.asarray(covariance, dtype=np.float64)
    if matrix.shape != (len(VALUES), len(VALUES)):
        raise ParameterError(
            f"covariance of shape {matrix.shape}: expected 5 x 5 in the order {', '.join(VALUES)}"
        )
    scale = np.sqrt(np.abs(np.diag(matrix)))
    if not np.all(np.isfinite(matrix)) or np.any(np.diag(matrix) < 0.0):
        raise ParameterError("covariance: expected finite numbers and variances not below zero")
    if np.any(np.abs(matrix - matrix.T) > 1e-9 * np.outer(scale, scale)):
        raise ParameterError("covariance: expected a symmetric matrix")
    return matrix


def _prediction(
    published: float,
    exact: float,
    slopes: Mapping[str, float],
    slopes_published: Mapping[str, float],
    covariance: FloatArray,
) -> ClearancePrediction:
    """Delta method: std_error^2 = g' V g."""
    g = np.array([slopes[name] for name in VALUES])
    std_error = float(np.sqrt(max(g @ covariance @ g, 0.0)))
    return ClearancePrediction(
        published=published,
        exact=exact,
        std_error=std_error,
        low=max(exact - COVERAGE_95 * std_error, 0.0),
        high=exact + COVERAGE_95 * std_error,
        gradient=dict(slopes),
        gradient_published=dict(slopes_published),
    )


def predict_periodic(
    *,
    G: float,
    values: Mapping[str, Quantity],
    covariance: ArrayLike | None = None,
    frequency: float | None = None,
) -> ClearancePrediction:
    """b_c with its 95 % interval from rig values and their uncertainty.

    Parameters
    ----------
    G : float
        Base amplitude, m.
    values : mapping
        `Quantity` (SI value, standard error) of each of M, c1, k1, r, m.
    covariance : array_like, shape (5, 5), optional
        In the order of `VALUES`; replaces the independent standard errors of `values`.
    frequency : float, optional
        Hz; the oscillator's own frequency (which moves with M and k1) where None.

    Raises
    ------
    ParameterError, AnalysisError

    Examples
    --------
    >>> rig = {"M": Quantity(4.7, 0.05), "c1": Quantity(3.02, 0.1), "k1": Quantity(1.147e4, 120.0),
    ...        "r": Quantity(0.6, 0.01), "m": Quantity(0.032, 1e-5)}
    >>> b_c = predict_periodic(G=0.25e-3, values=rig)
    >>> [round(1e3 * b, 2) for b in (b_c.published, b_c.exact, b_c.low, b_c.high)]
    [33.97, 33.92, 32.94, 34.9]
    """
    rig = rig_values(values, VALUES)
    matrix = covariance_of(values, covariance)
    exact, slopes = gradient_exact(G=G, frequency=frequency, **rig)
    published, slopes_published = gradient_published(G=G, **rig)
    return _prediction(published, exact, slopes, slopes_published, matrix)


def predict_transient(
    *,
    x0: float,
    v0: float = 0.0,
    values: Mapping[str, Quantity],
    covariance: ArrayLike | None = None,
) -> ClearancePrediction:
    """b_t with its 95 % interval from rig values and their uncertainty.

    Parameters
    ----------
    x0, v0 : float
        Release, m and m/s.
    values, covariance
        As for `predict_periodic`; only r is needed, and M and k1 too where v0 is not zero.

    Examples
    --------
    >>> b_t = predict_transient(x0=0.03, values={"r": Quantity(0.6, 0.02)})
    >>> [round(1e3 * b, 2) for b in (b_t.published, b_t.exact, b_t.low, b_t.high)]
    [50.0, 40.98, 40.31, 41.65]
    """
    rig = rig_values(values, ("M", "k1", "r") if v0 else ("r",))
    M, k1, r = rig.get("M", 1.0), rig.get("k1", 1.0), rig["r"]
    matrix = covariance_of(values, covariance)
    x_m = float(release_amplitude(x0=x0, v0=v0, M=M, k1=k1))
    exact, published = float(b_t_exact(x_m=x_m, r=r)), float(b_t_published(x_m=x_m))
    Gamma = float(loss_parameter(r))
    # d ln A_2/d Gamma = pi^2 Gamma/(4 + pi^2 Gamma^2);  d Gamma/d r = -2/(1 + r)^2
    by_r = exact * np.pi**2 * Gamma / (4.0 + (np.pi * Gamma) ** 2) * 2.0 / (1.0 + r) ** 2
    kinetic = 0.5 * v0 * v0 * M / k1 / x_m**2 if x_m > 0.0 else 0.0  # d ln x_m/d ln M
    share = {"M": kinetic / M, "c1": 0.0, "k1": -kinetic / k1, "r": 0.0, "m": 0.0}
    slopes_published = {name: published * s for name, s in share.items()}
    slopes = {name: exact * s for name, s in share.items()} | {"r": by_r}
    return _prediction(published, exact, slopes, slopes_published, matrix)
