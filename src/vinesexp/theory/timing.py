"""Time to a level and b*(level) with derivatives by every rig value, and their intervals.

The time is tau1(x_m/b, level/b; eps, lambda, r)/(eps w0): by its ends it is differentiated exactly
(the integrand of docs/theory.md, 29), by eps, lambda and r with central differences of fourth
order. b* is where its curve over b has an elbow or a flat bottom, and its derivative is that of
whichever it is (57, 58). A covariance of the rig's values then gives intervals, to which the
scatter of the passage through the fold is added: no value of the rig gives it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.rig import checked
from vinesexp.theory.intervals import OFFSETS, VALUES, WEIGHTS, covariance_of, rig_values, spread
from vinesexp.theory.manifold import A_1
from vinesexp.theory.transient import (
    BestClearance,
    Decaying,
    best_clearance,
    captured_time,
    decay_curve,
    passage,
)
from vinesexp.units import COVERAGE_95, Quantity

#: Names of the derivatives: the rig's values and the release amplitude.
RELEASE_VALUES = (*VALUES, "x_m")
#: Relative steps; wide enough that the flown balls' irregularity stays below a percent.
_STEP = 0.02


def _by_rig(release: Decaying, by_eps: float, by_lam: float, by_r: float) -> dict[str, float]:
    """Chain rule from eps = m/M, lambda = c1/(m w0), r to the rig's values (5)."""
    eps, lam = release.eps, release.lam
    slopes = {
        "M": (-by_eps * eps + 0.5 * by_lam * lam) / release.M,
        "c1": by_lam / (release.m * release.w0),
        "k1": -0.5 * by_lam * lam / release.k1,
        "r": by_r,
        "m": (by_eps * eps - by_lam * lam) / release.m,
    }
    return {name: float(slope) for name, slope in slopes.items()}


def _tau1(eps: float, lam: float, r: float, *, start: float, end: float) -> float:
    curve = decay_curve(eps=eps, lam=lam, r=r, high=start, low=end)
    return float(curve.between(np.asarray(start), np.asarray(end)))


def _steps(release: Decaying) -> FloatArray:
    """Steps of eps, lambda and r; those of r stay below 1, those of lambda cross zero freely."""
    eps, lam, r = release.eps, release.lam, release.r
    # at lambda = 0 the step is of the order of the ball's own damping at the fold
    return np.array([_STEP * eps, _STEP * max(lam, 0.5), min(_STEP * 0.5, 0.4 * (1.0 - r))])


def _moved(release: Decaying, index: int, offset: float, step: float) -> tuple[float, float, float]:
    values = [release.eps, release.lam, release.r]
    values[index] += offset * step
    return values[0], values[1], values[2]


def gradient_time(release: Decaying, *, b: float, level: float) -> tuple[float, dict[str, float]]:
    """Time (s) to `level` and its derivative by M, c1, k1, r, m and x_m, s per SI unit.

    Parameters
    ----------
    release : Decaying
    b, level : float
        Clearance and amplitude to be reached, m.

    Raises
    ------
    AnalysisError
        As `captured_time`; r = 1, from which there is no way up.

    Examples
    --------
    >>> release = Decaying(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6, x_m=0.03)
    >>> t, slopes = gradient_time(release, b=0.05, level=0.015)
    >>> round(t, 3), round(0.01 * slopes["r"], 4), round(1e-3 * slopes["x_m"], 4)  # per 0.01, mm
    (1.264, 0.0132, 0.0716)
    """
    time = float(captured_time(release, b=b, level=level))
    if release.r == 1.0:
        raise AnalysisError("r = 1: the derivative by r is one-sided; give an r below 1")
    eps, lam, r = release.eps, release.lam, release.r
    start, end = release.x_m / b, level / b
    by = np.zeros(3)
    for k, step in enumerate(_steps(release)):
        values = [_tau1(*_moved(release, k, d, step), start=start, end=end) for d in OFFSETS]
        by[k] = float(np.dot(WEIGHTS, values)) / step
    clock = eps * release.w0
    slopes = _by_rig(release, *(by / clock))
    # t = tau1/(eps w0), eps w0 = m sqrt(k1)/M^(3/2)
    slopes["M"] += 1.5 * time / release.M
    slopes["k1"] -= 0.5 * time / release.k1
    slopes["m"] -= time / release.m
    h = 1e-4 * start
    top = [_tau1(eps, lam, r, start=start + d * h, end=end) for d in OFFSETS]
    slopes["x_m"] = float(np.dot(WEIGHTS, top)) / h / (b * clock)
    return time, slopes


def _elbow(eps: float, lam: float, r: float) -> float:
    """Amplitude at which the flown balls let go, on the average (clearances)."""
    run = passage(eps=eps, lam=lam, r=r)
    gone = run.let_go[np.isfinite(run.let_go)]
    if gone.size == 0:
        raise AnalysisError("b*(level): no ball lets go below the fold; no elbow to follow")
    return float(gone.mean())


def gradient_best(
    release: Decaying, *, level: float
) -> tuple[BestClearance, dict[str, float], str]:
    """b*(level), its derivative by every value (m per SI unit) and the kind of optimum.

    The kinds are `let go` (the level is reached as the ball lets go: b* = level/A_let_go, 57),
    `start at T1` (b* = x_m/A_1: a larger cavity would not capture) and `smooth` (58).

    Raises
    ------
    AnalysisError
        The least time lies at an end of the range searched: no optimum, no derivative.

    Examples
    --------
    >>> release = Decaying(M=4.7, c1=3.02, k1=1.147e4, m=0.032, r=0.6, x_m=0.03)
    >>> best, slopes, kind = gradient_best(release, level=0.005)
    >>> kind, slopes["x_m"]
    ('let go', 0.0)
    """
    best = best_clearance(release, level=level)
    eps, lam, r = release.eps, release.lam, release.r
    fold = float(A_1(r))
    if release.x_m / best.b < fold * 1.005:
        h = 1e-4
        slope = (float(A_1(r + h)) - float(A_1(r - h))) / (2.0 * h) if h < r < 1.0 - h else 0.0
        by_r = -best.b * slope / fold
        return (
            best,
            _by_rig(release, 0.0, 0.0, by_r) | {"x_m": best.b / release.x_m},
            "start at T1",
        )
    run = passage(eps=eps, lam=lam, r=r)
    reach = run.let_go[np.isfinite(run.let_go)]
    if reach.size and reach.min() * 0.9 < level / best.b < fold:
        steps = _steps(release)
        by = np.zeros(3)
        for k, step in enumerate(2.0 * steps):  # wider: a let-go amplitude moves in half cycles
            values = [np.log(_elbow(*_moved(release, k, d, step))) for d in OFFSETS]
            by[k] = float(np.dot(WEIGHTS, values)) / step
        return best, _by_rig(release, *(-best.b * by)) | {"x_m": 0.0}, "let go"
    return best, _smooth_optimum(release, best.b, level), "smooth"


def _smooth_optimum(release: Decaying, b: float, level: float) -> dict[str, float]:
    """-t_bp/t_bb, the implicit function theorem at t_b = 0 (58)."""
    h = 0.03 * b

    def slope_and_bend(case: Decaying) -> tuple[float, float]:
        low, middle, high = captured_time(case, b=[b - h, b, b + h], level=level)
        return float(high - low) / (2.0 * h), float(low - 2.0 * middle + high) / h**2

    bend = slope_and_bend(release)[1]
    if not bend > 0.0:
        raise AnalysisError(
            f"b*({1e3 * level:.4g} mm) lies at an end of the range searched: no optimum inside"
        )
    slopes = {}
    for name in RELEASE_VALUES:
        value = getattr(release, name)
        step = 0.01 * (value if value > 0.0 else 1.0)
        up, down = (slope_and_bend(replace(release, **{name: value + d}))[0] for d in (step, -step))
        slopes[name] = -(up - down) / (2.0 * step) / bend
    return slopes


@dataclass(frozen=True)
class ReleasePrediction:
    """A predicted time (s) or clearance b* (m) with its uncertainty.

    Attributes
    ----------
    exact : the value.
    std_error : standard error from those of the rig's values.
    scatter : standard deviation over starts of the ball through the fold (0 on the branch).
    low, high : 95 % interval of both together, not below zero.
    gradient : derivative by each of `RELEASE_VALUES`, SI.
    kind : of b*: `let go`, `start at T1` or `smooth`; empty for a time.
    """

    exact: float
    std_error: float
    scatter: float
    low: float
    high: float
    gradient: Mapping[str, float] = field(default_factory=dict)
    kind: str = ""


def _release(
    x_m: Quantity, values: Mapping[str, Quantity], covariance: ArrayLike | None
) -> tuple[Decaying, FloatArray]:
    """The release and the 6 x 6 covariance of `RELEASE_VALUES`."""
    matrix = np.zeros((6, 6))
    matrix[:5, :5] = covariance_of(values, covariance)
    matrix[5, 5] = float(checked(x_m.std_error, "standard error of x_m", "m, zero or above")) ** 2
    return Decaying(**rig_values(values, VALUES), x_m=float(x_m.value)), matrix


def _prediction(
    value: float, slopes: Mapping[str, float], V: FloatArray, scatter: float, kind: str = ""
) -> ReleasePrediction:
    std_error = spread(slopes, RELEASE_VALUES, V)
    half = COVERAGE_95 * float(np.hypot(std_error, scatter))
    return ReleasePrediction(
        value, std_error, scatter, max(value - half, 0.0), value + half, dict(slopes), kind
    )


def predict_time(
    *,
    x_m: Quantity,
    b: float,
    level: float,
    values: Mapping[str, Quantity],
    covariance: ArrayLike | None = None,
) -> ReleasePrediction:
    """Time (s) of a captured release to `level` with its 95 % interval.

    Parameters
    ----------
    x_m : Quantity
        Release amplitude and its standard error, m.
    b, level : float
        m.
    values, covariance
        As for `vinesexp.theory.intervals.predict_periodic`.

    Examples
    --------
    >>> rig = {"M": Quantity(4.7, 0.05), "c1": Quantity(3.02, 0.1), "k1": Quantity(1.147e4, 120.0),
    ...        "r": Quantity(0.6, 0.01), "m": Quantity(0.032, 1e-5)}
    >>> t = predict_time(x_m=Quantity(0.03, 1e-4), b=0.05, level=0.015, values=rig)
    >>> [round(s, 2) for s in (t.exact, t.low, t.high)]
    [1.26, 1.2, 1.33]
    """
    release, V = _release(x_m, values, covariance)
    time, slopes = gradient_time(release, b=b, level=level)
    eps, lam, r = release.eps, release.lam, release.r
    start, end = np.asarray(release.x_m / b), np.asarray(level / b)
    curve = decay_curve(eps=eps, lam=lam, r=r, high=float(start), low=float(end))
    scatter = float(curve.scatter(start, end)) / (eps * release.w0)
    return _prediction(time, slopes, V, scatter)


def predict_best(
    *,
    x_m: Quantity,
    level: float,
    values: Mapping[str, Quantity],
    covariance: ArrayLike | None = None,
) -> ReleasePrediction:
    """b*(level), m, with its 95 % interval; arguments as for `predict_time`.

    Where b* is set by letting go, the scatter is that of the amplitude at which balls let go.

    Examples
    --------
    >>> rig = {"M": Quantity(4.7, 0.05), "c1": Quantity(3.02, 0.1), "k1": Quantity(1.147e4, 120.0),
    ...        "r": Quantity(0.6, 0.01), "m": Quantity(0.032, 1e-5)}
    >>> best = predict_best(x_m=Quantity(0.03), level=0.005, values=rig)
    >>> 0.03 < best.low < 0.044 < best.exact < best.high < 0.06
    True
    """
    release, V = _release(x_m, values, covariance)
    best, slopes, kind = gradient_best(release, level=level)
    scatter = 0.0
    if kind == "let go":
        eps, lam, r = release.eps, release.lam, release.r
        gone = passage(eps=eps, lam=lam, r=r).let_go
        scatter = best.b * float(np.nanstd(gone) / np.nanmean(gone))
    return _prediction(best.b, slopes, V, scatter, kind)
