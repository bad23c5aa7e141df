"""f0 and zeta at the amplitude at which the predictions work.

Where damping or spring depend on amplitude, ring-downs from 20 mm say nothing direct about periodic
tests of 5 mm. Each ring-down has f0 and zeta over amplitude (`decay_record`); they are read where
the mass swings in the periodic tests with the smallest amplitude, which is where b_c is, and the
range over the base amplitudes that were tested enters the error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vinesexp.identification.estimate import Estimate
from vinesexp.records.campaign.load import Campaign
from vinesexp.records.stored.checks import Check, Outcome

#: Amplitudes around the smallest one tested at which the optimum may work.
AROUND = (0.8, 1.25)
_SHIFT_UNSURE = 0.3  # of the shift of a sweep: its resonance has all amplitudes up to its own
_FEW = 1e-9  # relative: a curve that varies by less is flat
_SIGNIFICANT = 4.0  # standard errors that f0 has to change by
_STRONG = 0.03  # of zeta: beyond, a warning
_SAME, _LOWER = 0.05, 0.5  # of an amplitude
_LEAST_CHANGE = 1e-4  # of f0 that is reported


@dataclass(frozen=True)
class Working:
    """Estimates at the working amplitude, and what their dependence adds to the errors.

    Attributes
    ----------
    estimates : list of Estimate
        f0 and zeta of records moved there; everything else as it was.
    amplitude : float or None
        m; None where no ring-down depends on amplitude or no test says where to work.
    spread : dict
        `f0`, `zeta`: standard uncertainty from the range of amplitudes.
    tests : dict
        (record, `f0` or `zeta`) to what the amplitude of a test adds to the logarithm
        (`_of_test`).
    checks : list of Check
    """

    estimates: list[Estimate]
    amplitude: float | None
    spread: dict[str, float]
    tests: dict[tuple[str, str], tuple[float, float, float]]
    checks: list[Check]


@dataclass(frozen=True)
class Curve:
    """One parameter of one record over amplitude."""

    amplitude: np.ndarray
    value: np.ndarray
    error: np.ndarray

    def at(self, amplitude: float) -> tuple[float, float]:
        """Value by the cubic through four points over log amplitude, error by a straight line."""
        log, points = math.log(amplitude), np.log(self.amplitude)
        log = min(max(log, float(points[0])), float(points[-1]))
        error = float(np.interp(log, points, self.error))
        if self.flat:
            return float(self.value[0]), error
        first = min(max(int(np.searchsorted(points, log)) - 2, 0), max(points.size - 4, 0))
        near = slice(first, first + 4)
        gaps = points[near] - log
        weights = [
            math.prod(-other / (own - other) for k, other in enumerate(gaps) if k != i)
            for i, own in enumerate(gaps)
        ]
        return float(np.dot(weights, self.value[near])), error

    @property
    def flat(self) -> bool:
        return float(np.ptp(self.value)) <= _FEW * abs(float(self.value[0]))


def at_working_amplitude(found: Sequence[Estimate], campaign: Campaign) -> Working:
    """Move f0 and zeta of all records to the amplitude of the periodic tests.

    Parameters
    ----------
    found : sequence of Estimate
        Of all records.
    campaign : Campaign
        For the base amplitudes that belong together.
    """
    kept = [e for e in found if not e.parameter.endswith("_at")]
    curves = curves_of(found)
    if all(curve.flat for curve in curves.values()):
        return Working(kept, None, {}, {}, [])
    low, high = _range(found, campaign, curves)
    amplitude = math.sqrt(low * high)
    moved = [_moved(e, curves, amplitude) for e in kept]
    spread = {}
    for name in ("f0", "zeta"):
        own = [curve for (_, parameter), curve in curves.items() if parameter == name]
        if own:
            spread[name] = float(np.mean([spread_over(curve, low, high) for curve in own]))
    tests = {}
    for e in found:
        if e.parameter == "working_amplitude":
            for name in ("f0", "zeta"):
                own = [curve for (_, parameter), curve in curves.items() if parameter == name]
                if own:
                    tests[e.records[0], name] = _of_test(own, e.value, amplitude)
    return Working(moved, amplitude, spread, tests, _said(found, curves, amplitude))


def _of_test(curves: Sequence[Curve], swing: float, amplitude: float) -> tuple[float, float, float]:
    """What a test that works at `swing` adds to ln f0 or ln zeta at `amplitude`.

    A steady motion shows v(A), the modulation of one the increment v + A dv/dA: the mean of both,
    half their difference, which is as unsure in all tests alike, and the error of one test's own.
    """
    shifts, halves, errors = [], [], []
    for curve in curves:
        low, here, high = (curve.at(share * swing)[0] for share in (AROUND[0], 1.0, AROUND[1]))
        increment = (high - low) / math.log(AROUND[1] / AROUND[0])
        shifts.append(math.log((here + 0.5 * increment) / curve.at(amplitude)[0]))
        halves.append(0.5 * increment / here)
        errors.append(abs(high - low) / math.sqrt(12.0) / here)
    return float(np.mean(shifts)), float(np.mean(halves)), float(np.mean(errors))


def spread_over(curve: Curve, low: float, high: float) -> float:
    """Standard uncertainty of a value that depends on amplitude.

    Any amplitude of the range is equally likely; and whether an orbit is stable is decided by what
    changes with amplitude (the increment v + A dv/dA), which is as far off again.
    """
    values = [curve.at(a)[0] for a in np.geomspace(low, high, 9)]
    increment = (values[-1] - values[0]) / math.log(high / low) if high > low else 0.0
    return math.hypot(float(np.ptp(values)) / math.sqrt(12.0), increment / math.sqrt(3.0))


def curves_of(found: Sequence[Estimate]) -> dict[tuple[str, str], Curve]:
    """(record, parameter) to its values over amplitude."""
    points: dict[tuple[str, str], list[Estimate]] = {}
    for e in found:
        if e.parameter.endswith("_at") and e.amplitude:
            points.setdefault((e.records[0], e.parameter.removesuffix("_at")), []).append(e)
    return {
        key: Curve(*(np.array(column) for column in zip(*_sorted(own), strict=True)))
        for key, own in points.items()
    }


def _sorted(own: Sequence[Estimate]) -> list[tuple[float, float, float]]:
    return sorted((e.amplitude or 0.0, e.value, e.std_error) for e in own)


def swing_of_levels(found: Sequence[Estimate], campaign: Campaign) -> dict[float, float]:
    """Base amplitude of the periodic tests with one NES to the least amplitude of the mass, m."""
    swing = {e.records[0]: e.value for e in found if e.parameter == "working_amplitude"}
    levels: dict[float, float] = {}
    for record in campaign.records:
        if record.id in swing and record.base_amplitude and len(record.clearance) == 1:
            least = levels.get(record.base_amplitude, math.inf)
            levels[record.base_amplitude] = min(least, swing[record.id])
    return levels


def _range(
    found: Sequence[Estimate], campaign: Campaign, curves: dict[tuple[str, str], Curve]
) -> tuple[float, float]:
    """Amplitudes at which the periodic tests work; else those of the releases, or ring-downs."""
    levels = swing_of_levels(found, campaign)
    if levels:
        return AROUND[0] * min(levels.values()), AROUND[1] * max(levels.values())
    releases = [abs(r.release) for r in campaign.records if r.test == "transient" and r.release]
    if releases:
        return 0.5 * min(releases), max(releases)
    held = [
        e.amplitude
        for e in found
        if e.parameter == "f0" and e.amplitude and (e.records[0], "f0") in curves
    ]
    middle = float(np.exp(np.mean(np.log(held)))) if held else 1e-3
    return middle, middle


def _moved(e: Estimate, curves: dict[tuple[str, str], Curve], amplitude: float) -> Estimate:
    """An estimate at another amplitude, by its own record or, for a sweep, by the ring-downs."""
    curve = curves.get((e.records[0], e.parameter)) if e.records else None
    if curve is not None and e.method in ("likelihood", "envelope"):
        value, error = curve.at(amplitude)
        return replace(e, value=value, std_error=error, amplitude=amplitude)
    if e.method != "sweep" or e.parameter not in ("f0", "zeta") or not e.amplitude:
        return e
    others = [curve for (_, parameter), curve in curves.items() if parameter == e.parameter]
    if not others:
        return e
    shift = float(np.mean([c.at(amplitude)[0] - c.at(e.amplitude)[0] for c in others]))
    error = math.hypot(e.std_error, _SHIFT_UNSURE * shift)
    return replace(e, value=e.value + shift, std_error=error, amplitude=amplitude)


def _said(
    found: Sequence[Estimate], curves: dict[tuple[str, str], Curve], amplitude: float
) -> list[Check]:
    """What depends on amplitude, over the range that the ring-downs show."""
    words = {"damping_quadratic": "quadratic", "damping_coulomb": "Coulomb"}
    terms = dict.fromkeys(words[e.parameter] for e in found if e.parameter in words)
    checks = []
    for (record, name), curve in curves.items():
        own = [e.amplitude for e in found if e.records == (record,) and e.parameter == name]
        top = max((a for a in own if a), default=0.0)
        if curve.flat or not top:
            continue
        if name == "zeta" and abs(top / amplitude - 1.0) < _SAME:
            top = _LOWER * amplitude  # what it is used at is the largest that there is
        there, here = curve.at(top), curve.at(amplitude)
        change = there[0] - here[0]
        outcome: Outcome = "warning" if abs(change) > _STRONG * here[0] else "ok"
        if name == "zeta" and terms:
            detail = (
                f"damping depends on amplitude ({' and '.join(terms)} part): zeta = "
                f"{here[0]:.4g} at {1e3 * amplitude:.3g} mm, where it is used, and {there[0]:.4g} "
                f"at {1e3 * top:.3g} mm"
            )
            checks.append(Check(record, "damping", outcome, detail))
        big = abs(change) > max(_SIGNIFICANT * max(there[1], here[1]), _LEAST_CHANGE * here[0])
        if name == "f0" and big:
            stiff = "stiffens" if change * (top - amplitude) > 0.0 else "softens"
            detail = (
                f"the spring {stiff}: f0 = {here[0]:.6g} Hz at {1e3 * amplitude:.3g} mm, where it "
                f"is used, and {there[0]:.6g} Hz at {1e3 * top:.3g} mm"
            )
            checks.append(Check(record, "spring", "warning", detail))
    return checks
