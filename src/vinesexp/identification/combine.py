"""All records together: one row a method, one `combined` row a parameter.

Records and methods are weighted by their variances. Where they scatter more than their standard
errors allow, the error of the mean grows by that factor (Birge's ratio), and a check says who disagrees.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from vinesexp.identification.estimate import Estimate
from vinesexp.records.campaign import Campaign, Known
from vinesexp.records.checks import Check
from vinesexp.units import Quantity

UNITS = {"f0": "Hz", "zeta": "1", "M": "kg", "c1": "N s/m", "k1": "N/m", "r": "1"}

#: Methods of one parameter that are this many standard errors apart, and this share, disagree.
_APART = 4.0
_APART_SHARE = 0.01

#: Smallest relative standard error that a combined value is given: sensors are not calibrated
#: better, and no record tells.
_HARDLY_BETTER = 1e-6

_HOW_TO_KNOW = {
    "f0": "needs a ring-down or a sweep without NES",
    "zeta": "needs a ring-down or a sweep without NES",
    "M": "needs ring-downs with added masses, or impacts with a known clearance and ball mass, or "
    "`known: mass` in campaign.yaml",
    "c1": "needs M, f0 and zeta",
    "k1": "needs M and f0",
    "r": "needs a drop test, or impacts in a test with one NES and a known clearance",
}


def weighted_mean(estimates: Sequence[Estimate], *, method: str) -> Estimate:
    """Inverse-variance mean of estimates of one parameter, its error grown where they scatter.

    Examples
    --------
    >>> pair = [Estimate("M", 4.6, 0.1, "kg", "a", ("x",)), Estimate("M", 4.8, 0.1, "kg", "a", ("y",))]
    >>> mean = weighted_mean(pair, method="a")
    >>> round(mean.value, 3), round(mean.std_error, 3), mean.records
    (4.7, 0.1, ('x', 'y'))
    """
    values = np.array([estimate.value for estimate in estimates])
    errors = np.array([estimate.std_error for estimate in estimates])
    floor = _HARDLY_BETTER * np.abs(values)
    errors = np.maximum(errors, np.where(floor > 0.0, floor, np.finfo(float).tiny))
    weights = 1.0 / errors**2
    mean = float(weights @ values / weights.sum())
    error = float(1.0 / np.sqrt(weights.sum()))
    if len(values) > 1:
        birge = float(np.sqrt(weights @ (values - mean) ** 2 / (len(values) - 1)))
        error *= max(birge, 1.0)
    records = tuple(dict.fromkeys(id for estimate in estimates for id in estimate.records))
    first = estimates[0]
    return Estimate(first.parameter, mean, error, first.unit, method, records)


def mass_from_added(
    bare: Sequence[Estimate], added: Sequence[Estimate], mass_of: Callable[[str], float]
) -> Estimate | None:
    """M from natural frequencies with and without added masses.

    (2 pi f)^-2 = (M + added)/k1 is a straight line over the added mass; M is its intercept over its
    slope (docs/theory.md, identification).

    Parameters
    ----------
    bare, added : sequences of Estimate
        Frequencies, Hz.
    mass_of : callable
        Record id to the added mass, kg.
    """
    points = [(0.0, estimate) for estimate in bare]
    points += [(mass_of(estimate.records[0]), estimate) for estimate in added]
    loads = np.array([load for load, _ in points])
    if not bare and len(set(loads)) < 2 or not added:
        return None
    frequencies = np.array([estimate.value for _, estimate in points])
    relative = np.array([max(e.std_error / e.value, _HARDLY_BETTER) for _, e in points])
    y = frequencies**-2.0
    weights = 1.0 / (2.0 * relative * y) ** 2
    design = np.stack([np.ones_like(loads), loads], axis=1)
    covariance = np.linalg.inv(design.T @ (weights[:, None] * design))
    intercept, slope = covariance @ design.T @ (weights * y)
    misfit = float(weights @ (y - design @ np.array([intercept, slope])) ** 2)
    if len(points) > 2:
        covariance *= max(misfit / (len(points) - 2), 1.0)
    M = float(intercept / slope)
    gradient = np.array([1.0, -M]) / slope
    error = float(np.sqrt(gradient @ covariance @ gradient))
    records = tuple(id for _, estimate in points for id in estimate.records)
    return Estimate("M", M, error, "kg", "added mass", records)


def combine(
    estimates: Iterable[Estimate], campaign: Campaign
) -> tuple[list[Estimate], list[Check]]:
    """identified.csv and what has to be said about it.

    Parameters
    ----------
    estimates : iterable of Estimate
        Of all records.
    campaign : Campaign
        For added masses and weighed ones.

    Returns
    -------
    rows, checks
        Methods of a parameter first, then its `combined` row. What cannot be known is absent.
    """
    found = list(estimates)
    checks = [
        Check(e.records[0] if e.records else "", e.parameter or e.method, "warning", e.note)
        for e in found
        if e.note
    ]
    found = [e for e in found if math.isfinite(e.value)]
    rows: list[Estimate] = []
    combined: dict[str, Estimate] = {}
    for parameter in ("f0", "zeta", "M", "r"):
        methods = _methods(parameter, found, campaign)
        if methods:
            combined[parameter] = _combined(methods)
            checks += _disagreement(methods)
            rows += [*methods, combined[parameter]]
    for row in _derived(combined):
        rows += [
            row,
            Estimate(row.parameter, row.value, row.std_error, row.unit, "combined", row.records),
        ]
        combined[row.parameter] = row
    rows += _by_method("zeta_small", found)
    for parameter in UNITS:
        if parameter not in combined:
            detail = f"{parameter} cannot be known: {_HOW_TO_KNOW[parameter]}"
            checks.append(Check("", parameter, "warning", detail))
    return rows, checks


def _by_method(parameter: str, found: Sequence[Estimate]) -> list[Estimate]:
    methods = dict.fromkeys(e.method for e in found if e.parameter == parameter)
    return [
        weighted_mean(
            [e for e in found if e.parameter == parameter and e.method == method], method=method
        )
        for method in methods
    ]


def _methods(parameter: str, found: Sequence[Estimate], campaign: Campaign) -> list[Estimate]:
    methods = _by_method(parameter, found)
    if parameter != "M":
        return methods
    bare = [e for e in found if e.parameter == "f0" and e.method == "ring-down"]
    added = [e for e in found if e.parameter == "f0_added"]

    def mass_of(record: str) -> float:
        return campaign.record(record).added_mass or 0.0

    from_added = mass_from_added(bare, added, mass_of) if added else None
    weighed = _weighed(campaign.known)
    return [*filter(None, (from_added, weighed)), *methods]


def _weighed(known: Known) -> Estimate | None:
    mass: Quantity | None = known.mass
    return Estimate("M", mass.value, mass.std_error, "kg", "weighed") if mass else None


def _combined(methods: Sequence[Estimate]) -> Estimate:
    """The mean of all methods; a weighed mass without an uncertainty is taken as it is."""
    exact = [e for e in methods if e.method == "weighed" and e.std_error == 0.0]
    if exact:
        e = exact[0]
        return Estimate(e.parameter, e.value, 0.0, e.unit, "combined", e.records)
    return weighted_mean(methods, method="combined")


def _disagreement(methods: Sequence[Estimate]) -> list[Check]:
    checks = []
    for i, one in enumerate(methods):
        for other in methods[i + 1 :]:
            apart = abs(one.value - other.value)
            error = math.hypot(one.std_error, other.std_error)
            if apart > _APART * error and apart > _APART_SHARE * abs(one.value):
                advice = (
                    "; a wrong clearance, ball mass or added mass in the sheet does this"
                    if one.parameter == "M"
                    else ""
                )
                detail = (
                    f"{one.parameter} by {one.method} is {one.value:.5g}, by {other.method} "
                    f"{other.value:.5g}: {apart / abs(one.value):.1%} apart{advice}"
                )
                checks.append(Check("", one.parameter, "warning", detail))
    return checks


def _derived(combined: dict[str, Estimate]) -> list[Estimate]:
    """k1 = M w0^2 and c1 = 2 zeta w0 M with the errors of their factors."""
    if "M" not in combined or "f0" not in combined:
        return []
    M, f0 = combined["M"], combined["f0"]
    w0 = 2.0 * math.pi * f0.value
    of_M, of_f0 = M.std_error / M.value, f0.std_error / f0.value
    k1 = M.value * w0 * w0
    rows = [
        Estimate(
            *("k1", k1, k1 * math.hypot(of_M, 2.0 * of_f0), "N/m", "M (2 pi f0)^2"),
            records=tuple(dict.fromkeys([*M.records, *f0.records])),
        )
    ]
    if "zeta" in combined:
        zeta = combined["zeta"]
        c1 = 2.0 * zeta.value * w0 * M.value
        of_zeta = zeta.std_error / abs(zeta.value) if zeta.value else 0.0
        error = abs(c1) * math.sqrt(of_M**2 + of_f0**2 + of_zeta**2)
        records = tuple(dict.fromkeys([*M.records, *zeta.records]))
        rows.insert(0, Estimate("c1", c1, error, "N s/m", "2 zeta (2 pi f0) M", records))
    return rows
