"""M from ring-downs with added mass: the one that sinks the frequency by as much."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vinesexp.identification.average import DISAGREES, MATTERS, student_95
from vinesexp.identification.budget import Source
from vinesexp.identification.estimate import Estimate
from vinesexp.records.checks import Check
from vinesexp.records.uncertainties import EXACT, Uncertainties
from vinesexp.units import COVERAGE_95

FloatArray = NDArray[np.float64]

_METHODS = ("likelihood", "envelope")  # of a ring-down, that count
_TELLING = 4  # different loads from which on a wrong one can be named


def added_mass(
    found: Sequence[Estimate], loads: Mapping[str, float], inputs: Uncertainties = EXACT
) -> tuple[Source | None, list[Check]]:
    """M from 1/w^2 = (M + added)/k1, a straight line over the added mass.

    Ring-downs with one load share its weighing and its mounting: generalised least squares with
    the covariance that this makes.

    Parameters
    ----------
    found : sequence of Estimate
        With `f0` of ring-downs without and `f0_added` of those with added mass.
    loads : mapping
        Record id to added mass, kg.
    inputs : Uncertainties
        Of the added masses and of their mounting.

    Returns
    -------
    Source or None
        None with fewer than two different masses.
    list of Check
        A ring-down that lies off the line.
    """
    used = [e for e in found if e.parameter in ("f0", "f0_added") and e.method in _METHODS]
    loaded = np.array([loads.get(e.records[0], 0.0) for e in used])
    if len(set(loaded.tolist())) < 2:
        return None, []
    f = np.array([e.value for e in used])
    period = 1.0 / (2.0 * math.pi * f) ** 2
    error = 2.0 * period * np.array([e.std_error for e in used]) / f
    basis = np.stack([np.ones(len(used)), loaded], axis=1)
    slope = float(_line(basis, period, np.diag(error**2))[0][1])
    mounting, weighing = _of_loads(loaded, period, slope, inputs)
    shared = np.zeros((len(used), len(used)))
    for part in (*mounting.values(), *weighing.values()):
        shared += np.outer(part, part)
    # What scatters beyond all that is known of is taken for an error of single ring-downs.
    scatter = period * _scatter(basis, period, np.diag(error**2) + shared)
    covariance = np.diag(error**2 + scatter**2) + shared
    c, gain = _line(basis, period, covariance)
    M = float(c[0] / c[1])
    by_period = np.array([1.0 / c[1], -M / c[1]]) @ gain  # dM/d(period) of each ring-down
    few = student_95(max(1, len(used) - 2)) / COVERAGE_95
    by_records = math.sqrt(float(by_period**2 @ (error**2 + (few * scatter) ** 2)))
    value = Estimate(
        "M", M, by_records, "kg", "added mass", tuple(e.records[0] for e in used)
    )  # fmt: skip
    parts = {
        f"{name}: {1e3 * load:g} g": float(by_period @ part)
        for name, group in (("remounting", mounting), ("added mass", weighing))
        for load, part in group.items()
        if part.any()
    }
    alone = np.sqrt(error**2 + np.diag(shared))
    return Source(value, parts), _off_the_line(used, loaded, period, alone)


def _of_loads(
    loaded: FloatArray, period: FloatArray, slope: float, inputs: Uncertainties
) -> tuple[dict[float, FloatArray], dict[float, FloatArray]]:
    """Errors of the squared periods that ring-downs of one load share: mounting, weighing."""
    mounting, weighing = {}, {}
    for load in dict.fromkeys(loaded.tolist()):
        own = loaded == load
        mounting[load] = np.where(own, 2.0 * period * inputs.remounting.of(1.0), 0.0)
        if load:
            weighing[load] = np.where(own, -slope * inputs.added_mass.of(load), 0.0)
    return mounting, weighing


def _scatter(basis: FloatArray, period: FloatArray, covariance: FloatArray) -> float:
    """Relative scatter of single squared periods off the line, by the method of Mandel and Paule.

    0 where chi^2 is no larger than it is by chance once in twenty times.
    """
    freedom = period.size - 2

    def chi2(scatter: float) -> float:
        whole = covariance + np.diag((scatter * period) ** 2)
        rest = period - basis @ _line(basis, period, whole)[0]
        unit = np.sqrt(np.diag(whole))
        return float(rest / unit @ np.linalg.solve(whole / np.outer(unit, unit), rest / unit))

    if freedom <= 0 or chi2(0.0) <= freedom + 1.64 * math.sqrt(2.0 * freedom) + 1.0:
        return 0.0
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if chi2(middle) > freedom else (low, middle)
    return 0.5 * (low + high)


def _line(
    basis: FloatArray, values: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Coefficients by generalised least squares, and their derivatives by the values."""
    unit = np.sqrt(np.diag(covariance))
    root = np.linalg.cholesky(covariance / np.outer(unit, unit))
    weighted = np.linalg.solve(root, basis / unit[:, np.newaxis])
    scale = np.sqrt((weighted**2).sum(axis=0))
    gain = np.linalg.pinv(weighted / scale) / scale[:, np.newaxis]
    gain = np.asarray(gain @ np.linalg.inv(root) / unit)
    return gain @ values, gain


def _off_the_line(
    used: Sequence[Estimate], loaded: FloatArray, period: FloatArray, error: FloatArray
) -> list[Check]:
    """The ring-down that disagrees with the line through the others, where it can be named."""
    worst: tuple[float, int, float] | None = None
    for i in range(len(used)):
        others = np.delete(np.arange(len(used)), i)
        if len(set(loaded[others].tolist())) < 2 or others.size < 3:
            continue
        basis = np.stack([np.ones(others.size), loaded[others]], axis=1)
        c, gain = _line(basis, period[others], np.diag(error[others] ** 2))
        covariance = (gain * error[others] ** 2) @ gain.T
        here = np.array([1.0, loaded[i]])
        apart = float(period[i] - here @ c)
        pull = abs(apart) / math.hypot(error[i], math.sqrt(here @ covariance @ here))
        relative = 0.5 * abs(apart) / period[i]
        if pull > DISAGREES and relative > 0.5 * MATTERS and (worst is None or pull > worst[0]):
            worst = (pull, i, relative)
    if worst is None:
        return []
    pull, i, relative = worst
    if len(set(loaded.tolist())) < _TELLING:  # leaving out any one would mend it
        detail = (
            f"f0 of the ring-downs with {len(set(loaded.tolist()))} different loads misses a line "
            f"over the added mass by {100 * relative:.2g} % ({pull:.1f} standard errors): one of "
            "added_mass_g is wrong; a further load would show which"
        )
        return [Check("", "added mass", "warning", detail)]
    detail = (
        f"f0 = {used[i].value:.5g} Hz with {1e3 * loaded[i]:g} g added lies {100 * relative:.2g} % "
        f"off the line of the other ring-downs ({pull:.1f} standard errors): check added_mass_g"
    )
    return [Check(used[i].records[0], "added mass", "warning", detail)]
