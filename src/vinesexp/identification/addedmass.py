"""M from ring-downs with added mass: the one that sinks the frequency by as much."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from vinesexp.identification.average import DISAGREES, MATTERS
from vinesexp.identification.estimate import Estimate
from vinesexp.records.checks import Check

_METHODS = ("likelihood", "envelope")  # of a ring-down, that count
_TELLING = 4  # different loads from which on a wrong one can be named


def added_mass(
    found: Sequence[Estimate], loads: Mapping[str, float]
) -> tuple[Estimate | None, list[Check]]:
    """M from 1/w^2 = (M + added)/k1, a straight line over the added mass.

    Parameters
    ----------
    found : sequence of Estimate
        With `f0` of ring-downs without and `f0_added` of those with added mass.
    loads : mapping
        Record id to added mass, kg.

    Returns
    -------
    Estimate or None
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
    # As sure as the fits are; what screwing a mass on moves shows in the scatter off the line.
    error = 2.0 * period * np.array([e.std_error for e in used]) / f
    basis = np.stack([np.ones(len(used)), loaded], axis=1)
    c, covariance = _line(basis, period, error)
    rest = (period - basis @ c) / error
    freedom = len(used) - 2
    if freedom > 0:
        chi2 = float(rest @ rest)
        if chi2 > freedom + 1.64 * math.sqrt(2.0 * freedom) + 1.0:
            covariance = covariance * (chi2 / freedom)
    M = c[0] / c[1]
    gradient = np.array([1.0 / c[1], -M / c[1]])
    value = Estimate(
        "M", float(M), float(math.sqrt(gradient @ covariance @ gradient)), "kg", "added mass",
        tuple(e.records[0] for e in used),
    )  # fmt: skip
    return value, _off_the_line(used, loaded, period, error)


def mass_from_added(
    bare: Sequence[Estimate], added: Sequence[Estimate], mass_of: Callable[[str], float]
) -> Estimate | None:
    """M from frequencies without and with added masses; None with fewer than two different ones.

    Parameters
    ----------
    bare, added : sequences of Estimate
        Natural frequencies, Hz, by whatever method.
    mass_of : callable
        Record id to added mass, kg.
    """
    both = [
        replace(e, parameter=name, method=_METHODS[0])
        for name, group in (("f0", bare), ("f0_added", added))
        for e in group
    ]
    return added_mass(both, {e.records[0]: mass_of(e.records[0]) for e in both})[0]


def _line(
    basis: np.ndarray, values: np.ndarray, error: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    weighted = basis / error[:, np.newaxis]
    scale = np.sqrt((weighted**2).sum(axis=0))
    normal = np.linalg.inv((weighted / scale).T @ (weighted / scale)) / np.outer(scale, scale)
    return normal @ (weighted.T @ (values / error)), normal


def _off_the_line(
    used: Sequence[Estimate], loaded: np.ndarray, period: np.ndarray, error: np.ndarray
) -> list[Check]:
    """The ring-down that disagrees with the line through the others, where it can be named."""
    worst: tuple[float, int, float] | None = None
    for i in range(len(used)):
        others = np.delete(np.arange(len(used)), i)
        if len(set(loaded[others].tolist())) < 2 or others.size < 3:
            continue
        basis = np.stack([np.ones(others.size), loaded[others]], axis=1)
        c, covariance = _line(basis, period[others], error[others])
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
            "added_mass_g is wrong; a further load would tell which"
        )
        return [Check("", "added mass", "warning", detail)]
    detail = (
        f"f0 = {used[i].value:.5g} Hz with {1e3 * loaded[i]:g} g added lies {100 * relative:.2g} % "
        f"off the line of the other ring-downs ({pull:.1f} standard errors): check added_mass_g"
    )
    return [Check(used[i].records[0], "added mass", "warning", detail)]
