"""Numbers with units, as people write them in a campaign file: `4.7 +- 0.05 kg`, `100 mV/g`.

Units are converted here once, at the border; inside the package everything is SI. A unit is
never guessed: a bare number where a unit is due is an error. The letter g is a gram where a
mass is due and standard gravity where an acceleration is due, which is why a general units
library does not serve.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from vinesexp.errors import OtherQuantityError, ParameterError, nearest

STANDARD_GRAVITY = 9.80665  # m/s^2, exact by definition
#: Half width of a 95 % interval in standard errors.
COVERAGE_95 = 1.959963984540054
#: Standard errors from which on something is no chance: where a fit asks once (3 in 1000), where
#: each record is asked (6 in 100,000), and where a campaign is told of a fault (6 in 10 million).
LIKELY, SIGNIFICANT, SURE = 3.0, 4.0, 5.0


def with_error(value: float, half: float, *, sign: str = "+-", digits: int = 2) -> str:
    """A value with what follows its +-: two digits of that, and as many places of the value.

    Examples
    --------
    >>> with_error(14.2971, 0.8932), with_error(11470.3, 68.6), with_error(4.7, 0.0)
    ('14.30 +- 0.89', '11470 +- 69', '4.7')
    """
    if not math.isfinite(half) or half <= 0.0:
        return f"{value:.6g}"
    places = max(digits - 1 - math.floor(math.log10(half) + 1e-9), 0)
    return f"{value:.{places}f} {sign} {half:.{places}f}"


def counted(number: int, what: str) -> str:
    """How many of something, in words.

    Examples
    --------
    >>> counted(1, "record"), counted(3, "clearance")
    ('1 record', '3 clearances')
    """
    return f"{number} {what}{'' if number == 1 else 's'}"


def first_of(words: Sequence[str], most: int) -> str:
    """The first of some words, and how many more there are.

    Examples
    --------
    >>> first_of(["a", "b", "c"], 2), first_of(["a", "b"], 2)
    ('a, b and 1 more', 'a, b')
    """
    more = len(words) - most
    return ", ".join(words[:most]) + (f" and {more} more" if more > 0 else "")


#: Units by what they measure, each with its size in SI.
UNITS: dict[str, dict[str, float]] = {
    "displacement": {
        "m": 1.0,
        "mm": 1e-3,
        "cm": 1e-2,
        "um": 1e-6,
        "µm": 1e-6,
        "nm": 1e-9,
        "in": 0.0254,
        "ft": 0.3048,
        "mil": 2.54e-5,
    },
    "velocity": {
        "m/s": 1.0,
        "mm/s": 1e-3,
        "cm/s": 1e-2,
        "um/s": 1e-6,
        "in/s": 0.0254,
        "ips": 0.0254,
        "ft/s": 0.3048,
    },
    "acceleration": {
        "m/s^2": 1.0,
        "m/s2": 1.0,
        "m/s²": 1.0,
        "mm/s^2": 1e-3,
        "cm/s^2": 1e-2,
        "in/s^2": 0.0254,
        "ft/s^2": 0.3048,
        "g": STANDARD_GRAVITY,
        "mg": 1e-3 * STANDARD_GRAVITY,
    },
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "lbf": 4.4482216152605},
    "pressure": {"Pa": 1.0, "hPa": 1e2, "kPa": 1e3, "MPa": 1e6, "bar": 1e5, "psi": 6894.757293168},
    "mass": {"kg": 1.0, "g": 1e-3, "mg": 1e-6, "lb": 0.45359237, "oz": 0.028349523125},
    "voltage": {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "µV": 1e-6, "kV": 1e3},
    "current": {"A": 1.0},
    "charge": {"C": 1.0, "nC": 1e-9, "pC": 1e-12},
    "time": {
        "s": 1.0,
        "ms": 1e-3,
        "us": 1e-6,
        "µs": 1e-6,
        "ns": 1e-9,
        "min": 60.0,
        "h": 3600.0,
        "day": 86400.0,
    },
    "frequency": {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6, "mHz": 1e-3, "rpm": 1.0 / 60.0},
    "damping": {
        "N s/m": 1.0,
        "Ns/m": 1.0,
        "N*s/m": 1.0,
        "kg/s": 1.0,
        "N s/mm": 1e3,
        "lbf s/in": 4.4482216152605 / 0.0254,
        "lbf s/ft": 4.4482216152605 / 0.3048,
    },
    "quadratic damping": {"N s^2/m^2": 1.0, "N s2/m2": 1.0, "kg/m": 1.0},
    "cubic stiffness": {"N/m^3": 1.0, "N/m3": 1.0, "N/mm^3": 1e9},
    "restitution slope": {"s/m": 1.0, "s/mm": 1e3},
    "stiffness": {
        "N/m": 1.0,
        "kN/m": 1e3,
        "N/mm": 1e3,
        "lbf/in": 4.4482216152605 / 0.0254,
        "lbf/ft": 4.4482216152605 / 0.3048,
    },
    "rate of turn": {"rad/s": 1.0, "deg/s": math.pi / 180.0, "°/s": math.pi / 180.0},
    "magnetic field": {"T": 1.0, "mT": 1e-3, "uT": 1e-6, "µT": 1e-6, "nT": 1e-9},
    "temperature": {"°C": 1.0, "K": 1.0},
    "illuminance": {"lx": 1.0},
    "level": {"dB": 1.0, "dBm": 1.0, "dBV": 1.0},
    "power": {"mW": 1e-3, "kW": 1e3},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0},
    "ratio": {"": 1.0, "1": 1.0, "%": 1e-2},
}

#: Smallest and greatest size, SI, that a rig can have: what is beyond it is a slip of the pen.
_POSSIBLE = {
    "mass": (1e-9, 1e7),
    "damping": (1e-12, 1e12),
    "stiffness": (1e-6, 1e15),
    "displacement": (1e-9, 1e3),
    "velocity": (1e-9, 1e4),
    "acceleration": (1e-9, 1e7),
    "force": (1e-12, 1e9),
    "quadratic damping": (1e-12, 1e12),
    "frequency": (1e-6, 1e7),
}

#: Other ways to write the same letter or power; what bytes of UTF-8 read as Latin 1 leave.
_SPELLINGS = str.maketrans(
    {"µ": "u", "μ": "u", "²": "^2", "·": "*", "⋅": "*", "×": "*", "−": "-", "Â": None}
)
_REWRITTEN = (
    (r"/sec\b", "/s"),
    (r"/s(?:\*\*2|2)$", "/s^2"),
    (r"/\(?s\*s\)?$|/s/s$", "/s^2"),
    (r"^grms$|^g_?n$|^gn$|^g0$|^g['’]s$", "g"),
    (r"^lbs?\b(?=[ */])", "lbf"),
)
_ALL = {unit for table in UNITS.values() for unit in table}

_NUMBER = r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(
    rf"^\s*(?P<value>{_NUMBER})\s*(?:(?:\+-|\+/-|±)\s*(?P<error>{_NUMBER}))?\s*(?P<unit>.*?)\s*$"
)


@dataclass(frozen=True)
class Quantity:
    """A value in SI and its standard uncertainty (0 where none was given)."""

    value: float
    std_error: float = 0.0


def plain_unit(unit: str) -> str:
    """A unit in the spelling of `UNITS`: micro signs as u, raised and bare powers as ``^2``.

    Examples
    --------
    >>> plain_unit("\u03bcm"), plain_unit("m/s**2"), plain_unit("m/sec²"), plain_unit("N·s/m")
    ('um', 'm/s^2', 'm/s^2', 'N*s/m')
    """
    if unit.strip() in _ALL:
        return unit.strip()
    plain = unit.strip().translate(_SPELLINGS)
    if plain in _ALL:
        return plain
    for written, meant in _REWRITTEN:
        plain = re.sub(written, meant, plain)
    if plain not in _ALL and plain.replace("*", " ") in _ALL:
        plain = plain.replace("*", " ")
    return plain


def measured_in(unit: str, quantity: str) -> str:
    """What numbers in a unit measure for a channel: volts and coulombs its output, else itself.

    Examples
    --------
    >>> measured_in("V", "displacement"), measured_in("deg", "displacement")
    ('voltage', 'angle')
    """
    outputs = ("voltage", "charge", "angle", "rate of turn")
    return next((one for one in outputs if unit in UNITS[one]), quantity)


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
    vinesexp.errors.OtherQuantityError: 'V' is a unit of voltage, expected a unit of ...
    """
    known = UNITS[quantity]
    if unit not in known:
        unit = plain_unit(unit)
    if unit in known:
        return known[unit]
    examples = ", ".join(name for name in known if name)
    for other, table in UNITS.items():
        if unit in table and unit:
            raise OtherQuantityError(
                f"'{unit}' is a unit of {other}, expected a unit of {quantity} ({examples})", other
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
    value = _float(match["value"]) * size
    error = abs(_float(match["error"] or "0")) * size
    if not (math.isfinite(value) and math.isfinite(error)):
        raise ParameterError(f"found '{text}', expected a finite number")
    return Quantity(value, error)


_OUTPUTS = {"voltage": "V", "charge": "C"}
_SENSITIVITIES = {
    "displacement": "0.5 V/mm",
    "velocity": "100 mV/(mm/s)",
    "acceleration": "100 mV/g",
}


def parse_sensitivity(text: object, quantity: str) -> tuple[float, str]:
    """Volts (or coulombs) per SI unit of `quantity`, and which of both: V or C.

    As data sheets have it: output per measured unit (``"100 mV/g"``), or what a volt stands for
    (``"25 mm/s/V"``).

    Raises
    ------
    ParameterError
        Neither form, an output that is no voltage or charge, a measured unit of another quantity,
        or a sensitivity of zero.

    Examples
    --------
    >>> parse_sensitivity("0.5 V/mm", "displacement"), parse_sensitivity("2 mm/V", "displacement")
    ((500.0, 'V'), (500.0, 'V'))
    """
    match = _QUANTITY.match(str(text))
    unit = match["unit"] if match else ""
    output, slash, measured = unit.partition("/")
    stands_for, _, last = unit.rpartition("/")
    inverse = any(plain_unit(last.strip()) in UNITS[kind] for kind in _OUTPUTS)
    if inverse:
        output, measured = last, stands_for
    if match is None or not slash:
        raise ParameterError(
            f"found '{text}', expected instrument output per measured unit, "
            f"such as '{_SENSITIVITIES.get(quantity, f'100 mV/{next(iter(UNITS[quantity]))}')}'"
        )
    kind = "charge" if plain_unit(output.strip()) in UNITS["charge"] else "voltage"
    size = unit_size(output.strip(), kind) / unit_size(measured.strip().strip("()"), quantity)
    value = _float(match["value"])
    if value == 0.0 or not math.isfinite(value):
        raise ParameterError(f"found '{text}', expected a sensitivity other than zero")
    return (size / value if inverse else value * size), _OUTPUTS[kind]


_ANSWERS = {
    **dict.fromkeys(("yes", "y", "true", "on", "1"), True),
    **dict.fromkeys(("no", "n", "false", "off", "0"), False),
}


def yes_or_no(text: object) -> bool:
    """An answer as people write it."""
    answer = _ANSWERS.get(str(text).strip().lower())
    if answer is None:
        raise ParameterError(f"found '{text}', expected yes or no")
    return answer


def refuse_impossible(text: object, value: float, quantity: str) -> None:
    """Refuse a size that no rig has; zero, and a quantity without such bounds, pass.

    Examples
    --------
    >>> refuse_impossible("30 mm", 0.03, "displacement")
    >>> refuse_impossible("1e300 m", 1e300, "displacement")
    Traceback (most recent call last):
    vinesexp.errors.ParameterError: found '1e300 m', expected 1e-09 to 1000 m
    """
    low, high = _POSSIBLE.get(quantity, (0.0, math.inf))
    if value != 0.0 and not low <= abs(value) <= high:
        unit = next((name for name, size in UNITS[quantity].items() if size == 1.0), "")
        raise ParameterError(f"found '{text}', expected {low:g} to {high:g} {unit}")


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


def _float(number: str) -> float:
    """A number with decimal point or comma; ``1,000`` may be one or a thousand, and is refused."""
    if re.fullmatch(r"[+-]?[1-9]\d{0,2},\d{3}", number):
        raise ParameterError(
            f"found '{number}', which may be {number.replace(',', '.')} or "
            f"{number.replace(',', '')}; write it with a decimal point"
        )
    return float(number.replace(",", "."))


def last_digit(value: float) -> float:
    """One unit of the last digit that a number was written with.

    Examples
    --------
    >>> last_digit(7.85), last_digit(8.0)
    (0.01, 0.1)
    """
    return float(10.0 ** -len(repr(value).partition(".")[2]))
