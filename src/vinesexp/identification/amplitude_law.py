"""One law of damping and stiffness for the rig, and f0 and zeta at the amplitude of each level.

Each ring-down has f0 and zeta over amplitude. What they have in common is the law

    zeta w = gamma/A + alpha + beta A,        f0 = f (1 + kappa A^2)

with which records are replayed, and f0 and zeta where the mass swings at one base amplitude, which
the prediction for that level takes. Both pass through the combined values at their amplitude.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.identification.estimate import Estimate, is_known
from vinesexp.identification.least_squares import covariance_of
from vinesexp.identification.working_amplitude import (
    AROUND,
    Curve,
    curves_of,
    spread_over,
    swing_of_levels,
)
from vinesexp.records.campaign.load import Campaign
from vinesexp.records.stored.result_columns import LEVEL_VALUES
from vinesexp.records.stored.tables import Value, write_rows

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
