"""Numbers as a person reads them: as many digits as the uncertainty leaves."""

from __future__ import annotations

import math


def with_error(value: float, std_error: float, unit: str = "") -> str:
    """`value ± std_error` with two digits of the error, and as many places of the value.

    Examples
    --------
    >>> with_error(4.70123, 0.0123, "kg")
    '4.701 ± 0.012 kg'
    >>> with_error(11470.3, 35.0, "N/m")
    '11470 ± 35 N/m'
    >>> with_error(0.00651, 0.00001)
    '0.006510 ± 0.000010'
    >>> with_error(0.6, 0.0, "1")
    '0.6'
    """
    shown = "" if unit in ("", "1") else f" {unit}"
    if not math.isfinite(std_error) or std_error <= 0.0:
        return f"{value:.6g}{shown}"
    places = max(1 - math.floor(math.log10(std_error)), 0)
    return f"{value:.{places}f} ± {std_error:.{places}f}{shown}"


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
