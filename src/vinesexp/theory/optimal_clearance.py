"""Optimal clearances: b_c for periodic excitation, b_t for a release, published and exact.

`b_c` ends permanent two impacts per cycle; `b_t` starts a decay at the symmetry breaking T2. The
published formulas are the paper's (36) and (37); the exact values are the Neimark-Sacker end of
the periodic orbit and T2 in closed form. `predict_periodic` and `predict_transient` carry the
uncertainty of the rig's values to an interval.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.errors import ParameterError, nearest
from vinesexp.rig import RIG_VALUES, checked
from vinesexp.theory.manifold import A_2, FloatArray, loss_parameter
from vinesexp.theory.orbits import Reduced
from vinesexp.units import COVERAGE_95, Quantity

#: The amplitude at T2 that the paper reads off its figure 2; the exact one is `manifold.A_2(r)`.
PUBLISHED_A_2 = 0.6
#: Rig values that a prediction depends on, in the order of every gradient and covariance.
VALUES = RIG_VALUES


def b_c_published(*, G: ArrayLike, eps: ArrayLike, lam: ArrayLike, r: ArrayLike) -> FloatArray:
    """Published optimal clearance under base motion of amplitude G: equation (36) of the paper.

    b_c = G S^(3/2)/(2 (eps lambda Gamma S + 4 pi eps)), S = pi^2 + 4 Gamma^2
    (docs/theory.md, 42). Whole arrays at once; no approximation of its own.

    Parameters
    ----------
    G : array_like
        Base amplitude, m (the result has its unit), >= 0.
    eps : array_like
        Mass ratio m/M, > 0.
    lam : array_like
        Reduced damping c1/(eps M w0), >= 0.
    r : array_like
        Restitution, in [0, 1].

    Raises
    ------
    ParameterError
        A value without meaning.

    Examples
    --------
    >>> eps, lam = 0.032 / 4.7, 3.02 / (0.032 * (1.147e4 / 4.7) ** 0.5)
    >>> round(float(1e3 * b_c_published(G=0.25e-3, eps=eps, lam=lam, r=0.6)), 3)
    33.968
    """
    base = checked(G, "base amplitude G", "m, zero or above")
    ratio = checked(eps, "mass ratio eps", "a number above zero", closed=False)
    damping = checked(lam, "reduced damping lambda", "a number, zero or above")
    Gamma = loss_parameter(r)
    S = np.pi**2 + 4.0 * Gamma * Gamma
    result: FloatArray = 0.5 * base * S * np.sqrt(S) / (ratio * (damping * Gamma * S + 4.0 * np.pi))
    return result


def b_c_exact(
    *,
    G: ArrayLike,
    M: ArrayLike,
    c1: ArrayLike,
    k1: ArrayLike,
    m: ArrayLike,
    r: ArrayLike,
    frequency: ArrayLike | None = None,
) -> FloatArray:
    """Exact end of permanent two impacts per cycle: the largest clearance with a stable orbit.

    A Neimark-Sacker point of the exact symmetric orbit (a saddle-node where the damping is
    large), found from the Floquet multipliers of the full system (docs/theory.md, 38-41).

    Parameters
    ----------
    G : array_like
        Base amplitude, m, >= 0.
    M, c1, k1, m, r : array_like
        Rig, SI.
    frequency : array_like, optional
        Hz; the oscillator's own frequency where None.

    Returns
    -------
    ndarray
        Clearance, m.

    Raises
    ------
    ParameterError, AnalysisError
        A value without meaning; no stable orbit at any clearance.

    Examples
    --------
    >>> round(float(1e3 * b_c_exact(G=0.25e-3, M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6)), 3)
    33.923
    """
    from vinesexp.theory.boundaries import end_of_permanent_response

    base = checked(G, "base amplitude G", "m, zero or above")
    p = Reduced.of_rig(M=M, c1=c1, k1=k1, m=m, r=r, frequency=frequency)
    return base * end_of_permanent_response(p).b_high


def b_t_published(*, x_m: ArrayLike) -> FloatArray:
    """Published optimal clearance for a release: x_m/0.6, equation (37) of the paper.

    Examples
    --------
    >>> round(float(1e3 * b_t_published(x_m=0.03)), 2)
    50.0
    """
    return checked(x_m, "release amplitude x_m", "m, zero or above") / PUBLISHED_A_2


def b_t_exact(*, x_m: ArrayLike, r: ArrayLike) -> FloatArray:
    """Clearance at which a release of amplitude x_m starts exactly at T2: x_m/A_2(r).

    A_2 in closed form from the impact map's eigenvalue -1 (docs/theory.md, 14, 43).

    Examples
    --------
    >>> round(float(1e3 * b_t_exact(x_m=0.03, r=0.6)), 2)
    40.98
    """
    clearance: FloatArray = checked(x_m, "release amplitude x_m", "m, zero or above") / A_2(r)
    return clearance


def release_amplitude(
    *, x0: ArrayLike, v0: ArrayLike = 0.0, M: ArrayLike = 1.0, k1: ArrayLike = 1.0
) -> FloatArray:
    """x_m = hypot(x0, v0/w0), the amplitude that a release stores (docs/theory.md, 43); m, m/s."""
    mass = checked(M, "mass M", "kg, above zero", closed=False)
    stiffness = checked(k1, "stiffness k1", "N/m, above zero", closed=False)
    x_m: FloatArray = np.hypot(x0, np.asarray(v0) * np.sqrt(mass / stiffness))
    return checked(x_m, "release amplitude x_m", "a finite number")


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
    from vinesexp.theory.sensitivity import gradient_exact, gradient_published

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
