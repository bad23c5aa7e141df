"""Numbers as a person reads them: as many digits as the uncertainty leaves.

What follows a ± is half of a 95 % interval everywhere a person reads it (coverage factor k = 2, to
be exact 1.96); tables keep standard errors, under that name.
"""

from __future__ import annotations

import math

from vinesexp.units import COVERAGE_95, with_error

_SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


def plus_minus(value: float, std_error: float, unit: str = "") -> str:
    """`value ± half of its 95 % interval` from a standard error: two digits, and as many places of
    the value.

    Small numbers are written in thousandths or millionths: nobody counts zeros.

    Examples
    --------
    >>> plus_minus(4.70123, 0.0123, "kg")
    '4.701 ± 0.024 kg'
    >>> plus_minus(11470.3, 35.0, "N/m")
    '11470 ± 69 N/m'
    >>> plus_minus(0.00651, 0.00001)
    '(6.510 ± 0.020)·10⁻³'
    >>> plus_minus(0.6, 0.0, "1"), plus_minus(0.00014, 0.5, "Hz")
    ('0.6', '0.00 ± 0.98 Hz')
    """
    return _written(value, COVERAGE_95 * std_error, unit, digits=2)


def _written(value: float, half: float, unit: str, *, digits: int) -> str:
    """With so many digits of what follows the ±."""
    shown = "" if unit in ("", "1") else f" {unit}"
    if not math.isfinite(half) or half <= 0.0:
        return f"{value:.6g}{shown}"
    power = 0
    if 0.0 < (size := max(abs(value), half)) < 0.02:
        power = 3 * math.ceil(-math.log10(size) / 3.0)
    value, half = value * 10.0**power, half * 10.0**power
    text = with_error(value, half, sign="±", digits=digits)
    return f"({text})·10⁻{str(power).translate(_SUPERSCRIPTS)}{shown}" if power else text + shown


def difference(value: float, std_error: float, unit: str) -> str:
    """A difference with its sign; a ratio (unit 1) in percent.

    Examples
    --------
    >>> difference(0.312, 0.021, "mm"), difference(-0.0123, 0.002, "1"), difference(0.5, 0.0, "g")
    ('+0.312 ± 0.041 mm', '-1.23 ± 0.39 %', '+0.5 g')
    """
    if unit == "1":
        value, std_error, unit = 100.0 * value, 100.0 * std_error, "%"
    half = COVERAGE_95 * std_error
    if not math.isfinite(half) or half <= 0.0:
        return f"{value:+z.3g} {unit}"
    places = max(1 - math.floor(math.log10(half) + 1e-9), 0)
    return f"{value:+z.{places}f} ± {half:.{places}f} {unit}"


def percent(share: float, places: int = 1, *, sign: str = "+") -> str:
    """A share in percent; one that the last place would hide as what it is below.

    Parameters
    ----------
    share : float
    places : int
        Behind the point.
    sign : ``+`` or ``-``
        Whether a positive share has its sign.

    Examples
    --------
    >>> percent(-0.0331), percent(0.6914, 0), percent(-0.0003), percent(0.0)
    ('-3.3 %', '+69 %', 'less than 0.1 %', '0 %')
    """
    if abs(100.0 * share) >= 0.5 * 10.0**-places:
        return f"{100.0 * share:{sign}.{places}f} %"
    return f"less than {10.0**-places:g} %" if share else "0 %"


def plus_minus_brief(value: float, std_error: float, unit: str = "") -> str:
    """As `plus_minus`, for a line read at a glance: five digits of the value at the most.

    A half width below the last digit that is left is written as one of that digit.

    Examples
    --------
    >>> plus_minus_brief(4.698919, 0.0012556, "kg"), plus_minus_brief(0.600001544, 5.86e-06)
    ('4.6989 ± 0.0025 kg', '0.60000 ± 0.00001')
    >>> plus_minus_brief(0.00650347, 2.9e-8), plus_minus_brief(0.0, 0.001)
    ('(6.5035 ± 0.0001)·10⁻³', '(0.0 ± 2.0)·10⁻³')
    """
    if not math.isfinite(std_error) or std_error <= 0.0 or value == 0.0:
        return plus_minus(value, std_error, unit)
    half = COVERAGE_95 * std_error
    least = 10.0 ** (math.floor(math.log10(abs(value))) - 4)
    if half >= 10.0 * least:
        return plus_minus(value, std_error, unit)
    return _written(value, max(round(half / least), 1) * least, unit, digits=1)


def rounded(value: float) -> str:
    """A number to go by, such as a time to wait: whole from ten on, below to two digits.

    Examples
    --------
    >>> rounded(0.0341), rounded(6.23), rounded(123.4)
    ('0.034', '6.2', '123')
    """
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def millimetres(value: float | None) -> str:
    """A length of a table, mm, to three digits; a dash where there is none.

    Examples
    --------
    >>> millimetres(33.9678), millimetres(34.0), millimetres(2.3456), millimetres(None)
    ('34.0', '34.0', '2.35', '–')
    """
    return "–" if value is None else f"{value:#.3g}".removesuffix(".")


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


def significant(value: float | str | None, *, factor: float = 1.0, digits: int = 3) -> str:
    """A number of a table times `factor`, to some digits; a dash where there is none.

    Examples
    --------
    >>> significant(0.0051283, factor=1e3), significant(None)
    ('5.13', '–')
    """
    if value is None or isinstance(value, str):
        return "–"
    return f"{factor * value:.{digits}g}" if math.isfinite(value) else "–"


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
