"""The base at one level of periodic tests: as measured where it was, else as the test log says.

Where they differ the joint model of the campaign decides; predictions use what it found.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vinesexp.records.campaign.uncertainties import Uncertainties
from vinesexp.records.stored.checks import Check
from vinesexp.units import COVERAGE_95, Quantity

Rows = Sequence[Mapping[str, str]]

#: A frequency that nobody measured is as good as the generator's clock and its display: twice the
#: relative error of the instrument's clock.
GENERATOR = 2.0
#: Relative error of a generator's display, which rounds whatever its clock is good for.
DISPLAY_ERROR = 1e-4
#: Standard errors from which on measured and sheet differ.
DIFFERS = 3.0
#: Shares from which on the base is worth a warning: harmonics, wander, dip.
HARMONICS, WANDER, DIP = 0.03, 0.02, 0.05
_STEADY = 2e-4  # of the frequency: its error where the phase follows no straight line


@dataclass(frozen=True)
class LevelBase:
    """Base motion of a level.

    Attributes
    ----------
    G : amplitude, m, with its standard error.
    frequency : Hz; None where the tests do not share one.
    measured : number of records that have a base channel; 0: all is from the test log.
    """

    G: Quantity
    frequency: Quantity | None
    measured: int = 0


def found_base(identified: Rows, records: set[str]) -> Quantity | None:
    """Base amplitude of a level with these records as all records show it, m; identified.csv."""
    for row in identified:
        if row["parameter"] == "base_amplitude" and records & set(row["records"].split(";")):
            return Quantity(float(row["value"]), float(row["std_error"] or 0.0))
    return None


def base_of_level(
    nominal: float,
    frequencies: set[float],
    rows: Rows,
    *,
    inputs: Uncertainties,
    found: Quantity | None = None,
) -> LevelBase:
    """Base of a level: its amplitude as all records show it, else of the channel or the test log.

    Parameters
    ----------
    nominal : float
        Base amplitude of the test log, m.
    frequencies : set of float
        Those of the test log, Hz.
    rows : sequence of mappings
        Of base.csv, of the level's records.
    inputs : Uncertainties
        Of the base channel's sensitivity and of the clock.
    found : Quantity, optional
        The amplitude that the joint model found, m (`found_base`).

    Examples
    --------
    >>> base = base_of_level(0.25e-3, {7.86}, [], inputs=Uncertainties())
    >>> base.G.std_error, base.frequency.value, base.measured
    (5e-06, 7.86, 0)
    """
    stated = frequencies.pop() if len(frequencies) == 1 else None
    if not rows:
        at = None if stated is None else Quantity(stated, GENERATOR * inputs.clock.of(stated))
        return LevelBase(found or Quantity(nominal, inputs.base_amplitude.of(nominal)), at)
    gain, clock = inputs.base.of(1.0), inputs.clock.of(1.0)
    G, noise = _mean([(float(r["amplitude_m"]), float(r["amplitude_error_m"])) for r in rows])
    f, f_noise = _mean([(float(r["frequency_hz"]), float(r["frequency_error_hz"])) for r in rows])
    # Tests at different frequencies have no prediction of their own: none is drawn for their mean.
    shared = _spread([float(r["frequency_hz"]) for r in rows]) < 1e-3 * f
    return LevelBase(
        found or Quantity(G, math.hypot(noise, gain * G)),
        Quantity(f, math.hypot(f_noise, clock * f)) if shared else None,
        len(rows),
    )


def _mean(pairs: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Mean, and what scatter from record to record and the errors of each leave of it."""
    values = [value for value, _ in pairs]
    centre = sum(values) / len(values)
    scatter = math.sqrt(sum((v - centre) ** 2 for v in values) / len(values))
    return centre, math.hypot(scatter, max(error for _, error in pairs))


def _spread(values: Sequence[float]) -> float:
    return max(values) - min(values)


def base_checks(name: str, frequencies: set[float], base: LevelBase, rows: Rows) -> list[Check]:
    """Where the base did not do what the test log says, or was no steady sine.

    Parameters
    ----------
    name : str
        Of the level.
    frequencies : set of float
        Of the test log, Hz.
    base : LevelBase
    rows : sequence of mappings
        Of base.csv, of the level's records.
    """
    checks: list[Check] = []
    if not rows:
        return checks
    if len(frequencies) == 1 and base.frequency is not None:
        sheet, found = next(iter(frequencies)), base.frequency
        allowed = math.hypot(found.std_error, DISPLAY_ERROR * sheet)
        if abs(found.value - sheet) > DIFFERS * allowed:
            checks.append(
                Check("", "base frequency", "warning",
                      f"{name}: the base channel shows {found.value:.6g} Hz, the test log says "
                      f"{sheet:.6g} Hz; predictions use what was measured; check frequency_hz and "
                      "the sample rate")
            )  # fmt: skip
    return checks + [check for row in rows for check in _steadiness(row)]


def _steadiness(row: Mapping[str, str]) -> list[Check]:
    harmonics = math.hypot(float(row["harmonic_2"]), float(row["harmonic_3"]))
    wander, dip = float(row["wander"]), float(row["dip"])
    words = []
    if harmonics > HARMONICS:
        words.append(f"harmonics of {100 * harmonics:.2g} %")
    if wander > WANDER:
        words.append(f"an amplitude that wanders by {100 * wander:.2g} %")
    if dip > DIP:
        words.append(f"a dip of {100 * dip:.2g} %")
    frequency, error = float(row["frequency_hz"]), float(row["frequency_error_hz"])
    if error > _STEADY * frequency:
        words.append(f"a frequency that is steady to {COVERAGE_95 * error:.1g} Hz only")
    if not words:
        return []
    detail = f"the base moved with {', '.join(words)}; predictions are for a steady sine"
    return [Check(row["record"], "base motion", "warning", detail)]
