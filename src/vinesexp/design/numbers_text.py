"""How the answer of `design` writes lengths and shares."""

from __future__ import annotations


def mm(length: float) -> str:
    """A length (m) in mm: three decimals, three digits where these would say nothing.

    Examples
    --------
    >>> mm(0.0339234), mm(2.177e-7), mm(0.0)
    ('33.923', '0.000218', '0.000')
    """
    value = 1e3 * length
    return f"{value:.3f}" if value == 0.0 or abs(value) >= 0.1 else f"{value:.3g}"


def percent(share: float) -> str:
    """A share in whole percent, never minus zero.

    Examples
    --------
    >>> percent(0.726), percent(-0.001)
    ('73 %', '0 %')
    """
    return f"{round(100.0 * share) + 0:d} %"
