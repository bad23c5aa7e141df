"""Numbers as a person reads them: as many digits as the uncertainty leaves."""

from __future__ import annotations

import math

_SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


def with_error(value: float, std_error: float, unit: str = "") -> str:
    """`value ± std_error` with two digits of the error, and as many places of the value.

    Small numbers are written in thousandths or millionths: nobody counts zeros.

    Examples
    --------
    >>> with_error(4.70123, 0.0123, "kg")
    '4.701 ± 0.012 kg'
    >>> with_error(11470.3, 35.0, "N/m")
    '11470 ± 35 N/m'
    >>> with_error(0.00651, 0.00001)
    '(6.510 ± 0.010)·10⁻³'
    >>> with_error(0.6, 0.0, "1")
    '0.6'
    """
    return _written(value, std_error, unit, digits=2)


def _written(value: float, std_error: float, unit: str, *, digits: int) -> str:
    """With so many digits of the error."""
    shown = "" if unit in ("", "1") else f" {unit}"
    if not math.isfinite(std_error) or std_error <= 0.0:
        return f"{value:.6g}{shown}"
    power = 0
    if 0.0 < abs(value) < 0.02:
        power = 3 * math.ceil(-math.log10(abs(value)) / 3.0)
    value, std_error = value * 10.0**power, std_error * 10.0**power
    places = max(digits - 1 - math.floor(math.log10(std_error) + 1e-9), 0)
    text = f"{value:.{places}f} ± {std_error:.{places}f}"
    return f"({text})·10⁻{str(power).translate(_SUPERSCRIPTS)}{shown}" if power else text + shown


def in_brief(value: float, std_error: float, unit: str = "") -> str:
    """As `with_error`, for a line read at a glance: five digits of the value at the most.

    An error below the last digit that is left is written as one of that digit.

    Examples
    --------
    >>> in_brief(4.698919, 0.0012556, "kg"), in_brief(0.600001544, 5.86e-06)
    ('4.6989 ± 0.0013 kg', '0.60000 ± 0.00001')
    >>> in_brief(0.00650347, 2.9e-8), in_brief(11468.07, 3.1, "N/m"), in_brief(0.0, 0.001)
    ('(6.5035 ± 0.0001)·10⁻³', '11468 ± 3 N/m', '0.0000 ± 0.0010')
    """
    if not math.isfinite(std_error) or std_error <= 0.0 or value == 0.0:
        return with_error(value, std_error, unit)
    least = 10.0 ** (math.floor(math.log10(abs(value))) - 4)
    if std_error >= 10.0 * least:
        return with_error(value, std_error, unit)
    return _written(value, max(round(std_error / least), 1) * least, unit, digits=1)


def millimetres(text: str | None) -> str:
    """A length of a table, mm, to three digits; a dash where there is none.

    Examples
    --------
    >>> millimetres("33.9678"), millimetres("34"), millimetres("2.3456"), millimetres("")
    ('34.0', '34.0', '2.35', '–')
    """
    return f"{float(text):#.3g}".removesuffix(".") if text else "–"


def outwards(low: float | None, high: float | None) -> tuple[str, str]:
    """Ends of a bracket, mm, to three digits: rounded away from what they enclose.

    Examples
    --------
    >>> outwards(33.4412, 34.0588), outwards(26.0, 28.0), outwards(None, 9.946)
    (('33.4', '34.1'), ('26', '28'), ('', '9.95'))
    """

    def cut(value: float | None, way: int) -> str:
        if value is None or value == 0.0:
            return "" if value is None else "0"
        unit = 10.0 ** (math.floor(math.log10(abs(value))) - 2)
        steps = round(value / unit, 6)  # what is a whole number of units but for rounding stays
        return f"{unit * (math.ceil(steps) if way > 0 else math.floor(steps)):.6g}"

    return cut(low, -1), cut(high, 1)


def significant(text: str | None, *, factor: float = 1.0, digits: int = 3) -> str:
    """A number of a table times `factor`, to some digits; a dash where there is none.

    Examples
    --------
    >>> significant("0.0051283", factor=1e3), significant("")
    ('5.13', '–')
    """
    if not text:
        return "–"
    value = factor * float(text)
    return f"{value:.{digits}g}" if math.isfinite(value) else "–"


def with_interval(value: float, low: float, high: float) -> str:
    """A length in mm and the half width of its 95 % interval, to the digits that the latter has.

    Four digits of the value at the most; an interval that is smaller than the last is not written.

    Examples
    --------
    >>> with_interval(33.914, 33.892, 33.937), with_interval(33.9, 32.94, 34.9)
    ('33.91 ± 0.02', '33.9 ± 1.0')
    >>> with_interval(27.3174, 27.3173, 27.3174), with_interval(2.3456, 2.3403, 2.3509)
    ('27.32', '2.346 ± 0.005')
    """
    half = 0.5 * (high - low)
    most = 3 - math.floor(math.log10(abs(value))) if value else 2
    if half < 0.5 * 10.0**-most:
        return f"{value:.{max(most, 0)}f}"
    places = max(min(math.ceil(-math.log10(half)), most), 1)
    return f"{value:.{places}f} ± {half:.{places}f}"
