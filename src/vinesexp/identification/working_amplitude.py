"""f0 and zeta at the amplitude at which the predictions work.

Where damping or spring depend on amplitude, ring-downs from 20 mm say nothing direct about periodic
tests of 5 mm. Each ring-down has f0 and zeta over amplitude (`decay_record`); they are read where
the mass swings in the periodic tests with the smallest amplitude, which is where b_c is, and the
range over the base amplitudes that were tested enters the error. What all ring-downs have in common
is one law of damping and stiffness, with which records are replayed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.identification.estimate import Estimate, is_known
from vinesexp.identification.least_squares import covariance_of
from vinesexp.records.campaign.schema import Campaign
from vinesexp.records.stored.checks import Check, Outcome
from vinesexp.records.stored.result_columns import LEVEL_VALUES
from vinesexp.records.stored.tables import Value, write_rows

#: Amplitudes around the smallest one tested at which the optimum may work.
AROUND = (0.8, 1.25)
_SHIFT_UNSURE = 0.3  # of the shift of a sweep: its resonance has all amplitudes up to its own
_FEW = 1e-9  # relative: a curve that varies by less is flat
_SIGNIFICANT = 4.0  # standard errors that f0 has to change by
_STRONG = 0.03  # of zeta: beyond, a warning
_SAME, _LOWER = 0.05, 0.5  # of an amplitude
_LEAST_CHANGE = 1e-4  # of f0 that is reported


# One law of damping and stiffness for the rig, and f0 and zeta at the amplitude of each level.
#
# Each ring-down has f0 and zeta over amplitude. What they have in common is the law
#
#   zeta w = gamma/A + alpha + beta A,        f0 = f (1 + kappa A^2)
#
# with which records are replayed, and f0 and zeta where the mass swings at one base amplitude,
# which the prediction for that level takes. Both pass through the combined values at their
# amplitude.
#: Method of the rows of identified.csv that hold the law.
METHOD = "ring-downs"
_SLIP = "frequency_slope"  # f0 in proportion to A: no spring force does that
_TERMS = ("damping_coulomb", "damping_linear", "damping_quadratic")
_UNITS = ("m/s", "1/s", "1/(m s)")
_TINY = 1e-12


@dataclass(frozen=True)
class LevelValues:
    """f0 and zeta at the amplitude of one base amplitude of the periodic tests.

    Attributes
    ----------
    base_amplitude : of records.csv, m.
    amplitude : of the mass, m: the least mean amplitude of its tests.
    f0, zeta : Estimate
        With the error of the combined values and what the range around the amplitude adds.
    """

    base_amplitude: float
    amplitude: float
    f0: Estimate
    zeta: Estimate


def law_rows(found: Sequence[Estimate], f0: Estimate, zeta: Estimate, amplitude: float
             ) -> list[Estimate]:  # fmt: skip
    """The law as rows of identified.csv: damping terms, stiffening, and f0 of small motion.

    Parameters
    ----------
    found : sequence of Estimate
        Of all records.
    f0, zeta : Estimate
        Combined, at `amplitude` (m).

    Returns
    -------
    list of Estimate
        ``damping_linear``, ``damping_quadratic``, ``damping_coulomb``, ``stiffening`` and
        ``f0_small``; only those of nonzero terms.
    """
    curves = curves_of(found)
    terms = {e.parameter for e in found}
    rows: list[Estimate] = []
    zetas = _of(curves, "zeta")
    if zetas and not all(curve.flat for curve in zetas):
        rows += _damping(zetas, _rates(curves, f0), f0, zeta, amplitude)
    f0s = _of(curves, "f0")
    if f0s and not all(curve.flat for curve in f0s) and _SLIP not in terms:
        rows += _stiffness(f0s, f0, amplitude)
    records = tuple(dict.fromkeys(record for record, name in curves if name == "zeta"))
    return [Estimate(e.parameter, e.value, e.std_error, e.unit, METHOD, records) for e in rows]


def level_values(
    found: Sequence[Estimate], campaign: Campaign, f0: Estimate, zeta: Estimate, amplitude: float,
    alone: dict[str, float],
) -> list[LevelValues]:  # fmt: skip
    """f0 and zeta of each level, from the combined ones at `amplitude` (m).

    Parameters
    ----------
    alone : dict
        Standard errors of the combined `f0` and `zeta` without what the range of amplitudes adds.
    """
    curves = curves_of(found)
    levels = []
    for base, swing in swing_of_levels(found, campaign).items():
        low, high = (share * swing for share in AROUND)
        moved = []
        for value in (f0, zeta):
            own = _of(curves, value.parameter)
            shift = _mean([c.at(swing)[0] - c.at(amplitude)[0] for c in own])
            spread = _mean([spread_over(c, low, high) for c in own])
            error = math.hypot(alone[value.parameter], spread)
            moved.append(
                Estimate(
                    value.parameter, value.value + shift, error, value.unit, value.method,
                    value.records, amplitude=swing,
                )
            )  # fmt: skip
        levels.append(LevelValues(base, swing, *moved))
    return levels


def level_rows(levels: Sequence[LevelValues], M: Estimate | None) -> list[dict[str, Value]]:
    """Rows of level_values.csv; c1 and k1 where M is known.

    Examples
    --------
    >>> f0 = Estimate("f0", 7.862, 1e-4, "Hz", "combined")
    >>> level = LevelValues(2.5e-4, 5e-3, f0, Estimate("zeta", 0.0065, 1e-5, "1", "combined"))
    >>> (row,) = level_rows([level], Estimate("M", 4.7, 0.01, "kg", "combined"))
    >>> round(row["k1_n_m"]), round(row["c1_n_s_m"], 2), row["base_amplitude_mm"]
    (11469, 3.02, 0.25)
    """
    rows: list[dict[str, Value]] = []
    for level in levels:
        f0, zeta = level.f0, level.zeta
        row: dict[str, Value] = {
            "base_amplitude_mm": 1e3 * level.base_amplitude,
            "amplitude_m": level.amplitude,
            "f0_hz": f0.value,
            "f0_error_hz": f0.std_error,
            "zeta": zeta.value,
            "zeta_error": zeta.std_error,
        }
        if M is not None:
            w = 2.0 * math.pi * f0.value
            shares = [e.std_error / abs(e.value) for e in (M, f0, zeta)]
            k1, c1 = M.value * w * w, 2.0 * M.value * zeta.value * w
            row["c1_n_s_m"], row["c1_error_n_s_m"] = c1, c1 * math.hypot(*shares)
            row["k1_n_m"] = k1
            row["k1_error_n_m"] = k1 * math.hypot(shares[0], 2.0 * shares[1])
        rows.append(row)
    return rows


def write_levels(path: Path, levels: Sequence[LevelValues], rows: Sequence[Estimate]) -> None:
    """level_values.csv; `rows` of identified.csv, for M."""
    M = next((e for e in rows if e.parameter == "M" and e.method == "combined"), None)
    write_rows(path, LEVEL_VALUES, level_rows(levels, M))


def _of(curves: dict[tuple[str, str], Curve], parameter: str) -> list[Curve]:
    return [curve for (_, name), curve in curves.items() if name == parameter]


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else 0.0


def _rates(curves: dict[tuple[str, str], Curve], f0: Estimate) -> FloatArray:
    """Angular frequency at each point of the damping of all records, rad/s."""
    parts = []
    for (record, name), curve in curves.items():
        if name == "zeta":
            own = curves.get((record, "f0"))
            f = [own.at(A)[0] if own else f0.value for A in curve.amplitude]
            parts.append(2.0 * math.pi * np.array(f))
    return np.concatenate(parts)


def _damping(
    curves: Sequence[Curve], w: FloatArray, f0: Estimate, zeta: Estimate, amplitude: float
) -> list[Estimate]:
    """gamma, alpha, beta >= 0 of the decay rates, the linear one such that zeta is the combined."""
    from scipy.optimize import nnls

    A, ratio, ratio_error = _joined(curves)
    rate, error = w * ratio, w * ratio_error
    weighted = np.stack([1.0 / A, np.ones_like(A), A], axis=1) / error[:, None]
    scale = np.linalg.norm(weighted, axis=0)
    # Points of one record lie on one law: as many of them are independent as it has terms.
    repeats = max(1.0, A.size / (len(curves) * 3))
    used = [0, 1, 2]
    while True:
        columns = weighted[:, used] / scale[used]
        values, errors = np.zeros(3), np.full(3, np.inf)
        values[used] = nnls(columns, rate / error)[0] / scale[used]
        errors[used] = np.sqrt(repeats * np.diag(covariance_of(columns))) / scale[used]
        unsure = [i for i in used if i != 1 and not is_known(values[i], errors[i])]
        if not unsure:
            break
        used.remove(max(unsure, key=lambda i: errors[i] / max(values[i], _TINY)))
    there = 2.0 * math.pi * f0.value * zeta.value
    values[1] = max(there - values[0] / amplitude - values[2] * amplitude, 0.0)
    return [
        Estimate(_TERMS[i], float(values[i]), float(errors[i]), _UNITS[i], METHOD) for i in used
    ]


def _stiffness(curves: Sequence[Curve], f0: Estimate, amplitude: float) -> list[Estimate]:
    """kappa of f0 = f (1 + kappa A^2), and f such that f0 is the combined one at `amplitude`."""
    A, value, error = _joined(curves)
    most = float(A.max())
    columns = np.stack([np.ones_like(A), (A / most) ** 2], axis=1) / error[:, None]
    solved = np.linalg.lstsq(columns, value / error, rcond=None)[0]
    kappa = float(solved[1] / solved[0]) / most**2
    repeats = max(1.0, A.size / (len(curves) * 2))
    spread = math.sqrt(repeats * float(covariance_of(columns)[1, 1])) / most**2
    if not is_known(kappa, spread / abs(float(solved[0]))):
        return []
    small = f0.value / (1.0 + kappa * amplitude**2)
    return [
        Estimate("stiffening", kappa, spread / abs(float(solved[0])), "1/m^2", METHOD),
        Estimate("f0_small", small, f0.std_error, "Hz", METHOD),
    ]


def _joined(curves: Sequence[Curve]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Amplitudes, values and errors of all records one after the other."""
    names = ("amplitude", "value", "error")
    A, value, error = (np.concatenate([getattr(c, name) for c in curves]) for name in names)
    return A, value, np.maximum(error, _TINY * np.abs(value) + 1e-300)


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
