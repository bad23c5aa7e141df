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
    shown = "" if unit in ("", "1") else f" {unit}"
    if not math.isfinite(std_error) or std_error <= 0.0:
        return f"{value:.6g}{shown}"
    power = 0
    if 0.0 < abs(value) < 0.02:
        power = 3 * math.ceil(-math.log10(abs(value)) / 3.0)
    value, std_error = value * 10.0**power, std_error * 10.0**power
    places = max(1 - math.floor(math.log10(std_error)), 0)
    text = f"{value:.{places}f} ± {std_error:.{places}f}"
    return f"({text})·10⁻{str(power).translate(_SUPERSCRIPTS)}{shown}" if power else text + shown


def millimetres(text: str | None) -> str:
    """A length of a table, mm, to a tenth; a dash where there is none.

    Examples
    --------
    >>> millimetres("33.9678"), millimetres("34"), millimetres("")
    ('34.0', '34.0', '–')
    """
    return f"{float(text):.1f}" if text else "–"


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
    """A length in mm and the half width of its 95 % interval, to a hundredth or a tenth.

    Examples
    --------
    >>> with_interval(33.914, 33.892, 33.937), with_interval(33.9, 32.94, 34.9)
    ('33.91 ± 0.02', '33.9 ± 1.0')
    >>> with_interval(27.3174, 27.3173, 27.3174)
    '27.32'
    """
    half = 0.5 * (high - low)
    if half < 0.005:
        return f"{value:.2f}"
    places = 2 if half < 0.1 else 1
    return f"{value:.{places}f} ± {half:.{places}f}"
