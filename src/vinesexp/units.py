"""Numbers with units, as people write them in a campaign file: `4.7 +- 0.05 kg`, `100 mV/g`.

Units are converted here once, at the border; inside the package everything is SI. A unit is
never guessed: a bare number where a unit is due is an error. The letter g is a gram where a
mass is due and standard gravity where an acceleration is due, which is why a general units
library does not serve.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from vinesexp.errors import ParameterError, nearest

STANDARD_GRAVITY = 9.80665  # m/s^2, exact by definition
#: Half width of a 95 % interval in standard errors.
COVERAGE_95 = 1.959963984540054

#: Units by what they measure, each with its size in SI.
UNITS: dict[str, dict[str, float]] = {
    "displacement": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "µm": 1e-6, "in": 0.0254},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2},
    "acceleration": {
        "m/s^2": 1.0,
        "m/s2": 1.0,
        "m/s²": 1.0,
        "mm/s^2": 1e-3,
        "g": STANDARD_GRAVITY,
        "mg": 1e-3 * STANDARD_GRAVITY,
    },
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "lbf": 4.4482216152605},
    "mass": {"kg": 1.0, "g": 1e-3, "mg": 1e-6},
    "voltage": {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "µV": 1e-6},
    "charge": {"C": 1.0, "pC": 1e-12},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0},
    "frequency": {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6, "mHz": 1e-3, "rpm": 1.0 / 60.0},
    "damping": {"N s/m": 1.0, "Ns/m": 1.0, "N*s/m": 1.0, "kg/s": 1.0},
    "quadratic damping": {"N s^2/m^2": 1.0, "N s2/m2": 1.0, "kg/m": 1.0},
    "stiffness": {"N/m": 1.0, "kN/m": 1e3, "N/mm": 1e3},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0},
    "ratio": {"": 1.0, "1": 1.0, "%": 1e-2},
}

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(
    rf"^\s*(?P<value>{_NUMBER})\s*(?:(?:\+-|\+/-|±)\s*(?P<error>{_NUMBER}))?\s*(?P<unit>.*?)\s*$"
)


@dataclass(frozen=True)
class Quantity:
    """A value in SI and its standard uncertainty (0 where none was given)."""

    value: float
    std_error: float = 0.0


def unit_size(unit: str, quantity: str) -> float:
    """Size of one `unit` in SI, refused unless it measures `quantity`.

    Parameters
    ----------
    unit : str
        As written by a person: ``mm``, ``g``, ``m/s^2``.
    quantity : str
        A key of `UNITS`: what the unit has to measure.

    Raises
    ------
    ParameterError
        Unknown unit, or a unit of another quantity.

    Examples
    --------
    >>> unit_size("g", "mass"), unit_size("g", "acceleration")
    (0.001, 9.80665)
    >>> unit_size("V", "displacement")
    Traceback (most recent call last):
    vinesexp.errors.ParameterError: 'V' is a unit of voltage, expected a unit of displacement ...
    """
    known = UNITS[quantity]
    if unit in known:
        return known[unit]
    examples = ", ".join(name for name in known if name)
    for other, table in UNITS.items():
        if unit in table and unit:
            raise ParameterError(
                f"'{unit}' is a unit of {other}, expected a unit of {quantity} ({examples})"
            )
    if not unit:
        raise ParameterError(f"the unit is missing, expected a unit of {quantity} ({examples})")
    raise ParameterError(
        f"unknown unit '{unit}', expected a unit of {quantity}; {nearest(unit, known)}"
    )


def parse_quantity(text: object, quantity: str) -> Quantity:
    """Read ``"4.7 +- 0.05 kg"`` as a value in SI with its standard uncertainty.

    Examples
    --------
    >>> parse_quantity("4.7 +- 0.05 kg", "mass")
    Quantity(value=4.7, std_error=0.05)
    >>> parse_quantity("0.25 mm", "displacement").value
    0.00025
    """
    match = _QUANTITY.match(str(text))
    if match is None:
        raise ParameterError(
            f"found '{text}', expected a number with a unit of {quantity}, "
            f"such as '1 {next(iter(UNITS[quantity]))}'"
        )
    size = unit_size(match["unit"], quantity)
    value = float(match["value"]) * size
    error = abs(float(match["error"] or 0.0)) * size
    if not (math.isfinite(value) and math.isfinite(error)):
        raise ParameterError(f"found '{text}', expected a finite number")
    return Quantity(value, error)


def parse_sensitivity(text: object, quantity: str) -> float:
    """Volts (or coulombs) per SI unit of `quantity`, from ``"100 mV/g"`` or ``"0.5 V/mm"``.

    Raises
    ------
    ParameterError
        No ``output/measured`` form, an output that is no voltage or charge, a measured unit of
        another quantity, or a sensitivity of zero.

    Examples
    --------
    >>> round(parse_sensitivity("100 mV/g", "acceleration"), 6)
    0.010197
    >>> parse_sensitivity("0.5 V/mm", "displacement")
    500.0
    """
    match = _QUANTITY.match(str(text))
    output, slash, measured = (match["unit"] if match else "").partition("/")
    if match is None or not slash:
        raise ParameterError(
            f"found '{text}', expected instrument output per measured unit, "
            f"such as '100 mV/{next(iter(UNITS[quantity]))}'"
        )
    measured = measured.strip().strip("()")
    kind = "charge" if output.strip() in UNITS["charge"] else "voltage"
    size = unit_size(output.strip(), kind) / unit_size(measured, quantity)
    value = float(match["value"]) * size
    if value == 0.0 or not math.isfinite(value):
        raise ParameterError(f"found '{text}', expected a sensitivity other than zero")
    return value


def relative_error(text: object) -> float | None:
    """Relative standard uncertainty that a value states; None where it states none.

    Examples
    --------
    >>> relative_error("40 +- 2 mV/mm"), relative_error("40 mV/mm")
    (0.05, None)
    """
    match = _QUANTITY.match(str(text))
    if match is None or match["error"] is None or not float(match["value"]):
        return None
    return abs(float(match["error"]) / float(match["value"]))
