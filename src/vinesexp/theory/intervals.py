"""b_c, b_t and b*(level) with derivatives by every rig value, and their intervals (delta method).

b* is where the time to the level over b has an elbow or a flat bottom (docs/theory.md, 57, 58); how
it moves with a value is a difference. To its interval the scatter of the passage through the fold
is added: no value of the rig gives it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vinesexp.errors import ParameterError, nearest
from vinesexp.rig import RIG_VALUES, ZERO_OR_ABOVE, checked
from vinesexp.theory.boundaries import end_of_permanent_response, loss_of, stable_range
from vinesexp.theory.manifold import A_1, loss_parameter
from vinesexp.theory.optimal_clearance import (
    b_c_published,
    b_t_exact,
    b_t_published,
    release_amplitude,
)
from vinesexp.theory.orbits import Reduced, reduced
from vinesexp.theory.transient import (
    Decaying,
    best_clearance,
    passage,
)
from vinesexp.units import COVERAGE_95, Quantity

#: Share of a value, either way, between which the change of b*(level) is taken.
_APART = 0.06


# Derivatives of b_c with respect to every rig value: central differences of fourth order, of the
# whole solution, which is exact to rounding (docs/theory.md, 46).
_STEP = 1e-3  # relative
_OFFSETS = np.array([-2.0, -1.0, 1.0, 2.0])
_WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0


def gradient_exact(
    *, G: float, frequency: float | None = None, **values: float
) -> tuple[float, dict[str, float]]:
    """Exact b_c and its derivative by each rig value, m per SI unit.

    Parameters
    ----------
    G : float
        Base amplitude, m.
    frequency : float, optional
        Hz; the oscillator's own (moving with M and k1) where None.
    **values : float
        M, c1, k1, r and m, SI.

    Raises
    ------
    ParameterError, AnalysisError
        As for `vinesexp.theory.optimal_clearance.b_c_exact`.
    """
    p = Reduced.of_rig(frequency=frequency, **values)
    rig = {name: values[name] for name in RIG_VALUES}
    steps = _STEP * np.array([_scale(name, rig, p, frequency) for name in rig])
    # axes: value, which of them is moved, offset
    moved = np.eye(len(rig))[:, :, None] * steps[:, None] * _OFFSETS
    points = np.array(list(rig.values()))[:, None, None] + moved
    # Unchecked: a step may leave r <= 1 or c1 >= 0 by a hair. The solution is smooth across those
    # ends, so a central difference there is still right.
    around = reduced(**dict(zip(rig, points, strict=True)), frequency=frequency)
    ends = stable_range(Reduced(**{k: np.asarray(v) for k, v in around.items()})).b_high
    slopes = G * (ends @ _WEIGHTS) / steps
    b_c = G * float(end_of_permanent_response(p).b_high)
    return b_c, dict(zip(rig, map(float, slopes), strict=True))


def _scale(name: str, rig: dict[str, float], p: Reduced, frequency: float | None) -> float:
    """Size of a step in one rig value: its own, but for r (order 1) and c1 = 0 (of sqrt(k1 M)).

    At a fixed frequency M and k1 move the detuning, in which the response changes over a width of
    `near`, and over Omega far below resonance, where the oscillator turns many times between two
    impacts; the step has to stay well inside both. With r beyond 1 impacts must still take energy.
    """
    near = abs(float(p.Omega) - 1.0) + float(p.zeta) + float(p.eps)
    if name in ("M", "k1") and frequency is not None:
        return rig[name] * min(2.0 * near, float(p.Omega), 1.0)
    if name == "r":
        return min(0.1, 100.0 * float(loss_of(p)))
    if name == "c1":
        return max(rig["c1"], 1e-3 * float(np.sqrt(rig["k1"] * rig["M"])))
    return rig[name]


@dataclass(frozen=True)
class ClearancePrediction:
    """A predicted clearance with its uncertainty; m.

    Attributes
    ----------
    published, exact : the paper's formula and the exact value.
    std_error : standard error of `exact`, from those of the rig's values.
    low, high : its 95 % interval, not below zero.
    gradient : d exact/d value for each of `RIG_VALUES`, SI.
    """

    published: float
    exact: float
    std_error: float
    low: float
    high: float
    gradient: Mapping[str, float]


def rig_values(values: Mapping[str, Quantity], needed: tuple[str, ...]) -> dict[str, float]:
    """The numbers of the values needed; ParameterError where one is missing or unknown."""
    missing = [name for name in needed if name not in values]
    if missing:
        raise ParameterError(
            f"rig values missing: {', '.join(missing)}; given: {', '.join(values) or 'none'}"
        )
    for name in values:
        if name not in RIG_VALUES:
            raise ParameterError(f"unknown rig value '{name}'; {nearest(name, RIG_VALUES)}")
    return {name: float(values[name].value) for name in needed}


def _errors(values: Mapping[str, Quantity]) -> dict[str, float]:
    """Standard errors of the rig's values, 0 where none is given; those without meaning refused."""
    errors = {name: values[name].std_error if name in values else 0.0 for name in RIG_VALUES}
    checked(list(errors.values()), "standard error", "", ZERO_OR_ABOVE)
    return errors


def _prediction(
    published: float, exact: float, slopes: Mapping[str, float], values: Mapping[str, Quantity]
) -> ClearancePrediction:
    """By the delta method; the errors of the values are independent."""
    parts = [slopes[name] * error for name, error in _errors(values).items()]
    std_error = float(np.linalg.norm(parts))
    half = COVERAGE_95 * std_error
    return ClearancePrediction(
        published, exact, std_error, max(exact - half, 0.0), exact + half, slopes
    )


def predict_periodic(
    *,
    G: float,
    values: Mapping[str, Quantity],
    frequency: float | None = None,
) -> ClearancePrediction:
    """b_c with its 95 % interval from rig values and their uncertainty.

    Parameters
    ----------
    G : float
        Base amplitude, m.
    values : mapping
        `Quantity` (SI value, standard error) of each of M, c1, k1, r, m.
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
    rig = rig_values(values, RIG_VALUES)
    exact, slopes = gradient_exact(G=G, frequency=frequency, **rig)
    eps, w0 = rig["m"] / rig["M"], np.sqrt(rig["k1"] / rig["M"])
    published = b_c_published(G=G, eps=eps, lam=rig["c1"] / (rig["m"] * w0), r=rig["r"])
    return _prediction(float(published), exact, slopes, values)


def predict_transient(
    *, x0: float, v0: float = 0.0, values: Mapping[str, Quantity]
) -> ClearancePrediction:
    """b_t with its 95 % interval from rig values and their uncertainty.

    Parameters
    ----------
    x0, v0 : float
        Release, m and m/s.
    values : mapping
        As for `predict_periodic`; only r is needed, and M and k1 too where v0 is not zero.

    Examples
    --------
    >>> b_t = predict_transient(x0=0.03, values={"r": Quantity(0.6, 0.02)})
    >>> [round(1e3 * b, 2) for b in (b_t.published, b_t.exact, b_t.low, b_t.high)]
    [50.0, 40.98, 40.31, 41.65]
    """
    rig = rig_values(values, ("M", "k1", "r") if v0 else ("r",))
    M, k1, r = rig.get("M", 1.0), rig.get("k1", 1.0), rig["r"]
    x_m = float(release_amplitude(x0=x0, v0=v0, M=M, k1=k1))
    exact, published = float(b_t_exact(x_m=x_m, r=r)), float(b_t_published(x_m=x_m))
    Gamma = float(loss_parameter(r))
    # d ln A_2/d Gamma = pi^2 Gamma/(4 + pi^2 Gamma^2);  d Gamma/d r = -2/(1 + r)^2
    by_r = exact * np.pi**2 * Gamma / (4.0 + (np.pi * Gamma) ** 2) * 2.0 / (1.0 + r) ** 2
    kinetic = 0.5 * v0 * v0 * M / k1 / x_m**2 if x_m > 0.0 else 0.0  # d ln x_m/d ln M
    share = {"M": kinetic / M, "c1": 0.0, "k1": -kinetic / k1, "r": 0.0, "m": 0.0}
    slopes = {name: exact * s for name, s in share.items()} | {"r": by_r}
    return _prediction(published, exact, slopes, values)


# The clearance that is fastest to a level of a release, with its interval.


def _slope(release: Decaying, name: str, level: float) -> float:
    """Change of b*(level) with one value, m per SI unit, between _APART below and above it.

    A let-go amplitude moves in half cycles, so that what is closer together shows less.
    """
    value = float(getattr(release, name))
    # without damping the step is of the order of the ball's own at the fold
    size = max(value, 0.5 * release.m * release.w0) if name == "c1" else value
    step = min(_APART * size, 0.8 * (1.0 - value)) if name == "r" else _APART * size
    ends = max(value - step, 0.0), value + step
    b = [best_clearance(replace(release, **{name: end}), level=level).b for end in ends]
    return (b[1] - b[0]) / (ends[1] - ends[0])


def _scatter(release: Decaying, b: float, level: float) -> float:
    """Standard deviation of b*(level) over where the ball is at the start, m.

    Where the level is reached as the ball lets go: that of the amplitudes at which it does (57).
    """
    gone = passage(eps=release.eps, lam=release.lam, r=release.r).let_go
    gone, fold = gone[np.isfinite(gone)], float(A_1(release.r))
    lets_go = gone.size > 0 and 0.9 * gone.min() < level / b < fold
    if not lets_go or release.x_m / b < 1.005 * fold:
        return 0.0
    return b * float(gone.std() / gone.mean())


def predict_best(*, x_m: Quantity, level: float, values: Mapping[str, Quantity]) -> Quantity:
    """b*(level), m, with its standard error: of the values, and of where the ball is at the start.

    Parameters
    ----------
    x_m : Quantity
        Amplitude of the release, m.
    level : float
        Amplitude to be reached, m.
    values : mapping
        M, c1, k1, r, m with their standard errors.

    Raises
    ------
    ParameterError, AnalysisError
        A value is missing; there is no such clearance.
    """
    release = Decaying(**rig_values(values, RIG_VALUES), x_m=float(x_m.value))
    _errors(values)  # refuses those without meaning
    best = best_clearance(release, level=level)
    errors = [(name, one.std_error) for name, one in [*values.items(), ("x_m", x_m)]]
    parts = [_slope(release, name, level) * error for name, error in errors if error > 0.0]
    return Quantity(best.b, float(np.linalg.norm([*parts, _scatter(release, best.b, level)])))
