"""What a person writes for a map or for basins: rig values, two of them or one as a range."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from vinesexp.design import inputs as design
from vinesexp.design.inputs import Option, ends_of, read_identified, read_options
from vinesexp.errors import ParameterError
from vinesexp.rig import Oscillator
from vinesexp.units import Quantity, parse_quantity

#: Every value of a rig and its excitation; those with a range in their note may be an axis.
_NOTES = {
    **{"M": "", "c1": "", "k1": "", "b": " or '5:60 mm'", "frequency": " or '7.2:8.4 Hz'"},
    **{"G": " or '0.05:0.4 mm'", "m": " or '10:60 g'", "r": " or '0.3:0.9'"},
}
_KNOWN = {option.symbol: option for option in design.OPTIONS}
OPTIONS = tuple(replace(_KNOWN[symbol], note=note) for symbol, note in _NOTES.items())
#: Digits of a number of cells.
MOST_DIGITS = 6
_MAY_VARY = {option.symbol for option in OPTIONS if option.note}

Ends = tuple[float, float]


def gather_values(
    texts: Mapping[str, str | None], identified: Path | None = None
) -> tuple[dict[str, float], dict[str, Ends]]:
    """Values and ranges (SI) of what was written; an option wins over the file.

    Parameters
    ----------
    texts : mapping
        For each symbol what was written for it, None for nothing.
    identified : path, optional
        An identified.csv, or the results folder it is in.

    Raises
    ------
    ParameterError
        A value that cannot be read or cannot be, or one that is missing (the frequency is the
        natural one by default); all that is missing in one line.
    """
    values: dict[str, float] = {}
    if identified is not None:
        values |= {name: one.value for name, one in read_identified(identified).items()}
    read = read_options(OPTIONS, texts, _read)
    ranges = {symbol: (q[0].value, q[-1].value) for symbol, q in read.items() if len(q) > 1}
    values |= {symbol: q[0].value for symbol, q in read.items()}
    values = {symbol: value for symbol, value in values.items() if symbol not in ranges}
    missing = [
        f"{option.flag} '{option.example}'"
        for option in OPTIONS
        if option.symbol not in (*values, *ranges, "frequency")
    ]
    if missing:
        raise ParameterError(f"values are missing: give {', '.join(missing)}")
    if "frequency" not in (*values, *ranges):
        values["frequency"] = Oscillator(M=values["M"], c1=values["c1"], k1=values["k1"]).f0
    return values, ranges


def _read(text: str, option: Option) -> tuple[Quantity, ...]:
    """One value, or the two ends of a range."""
    if ";" in text:
        raise ParameterError(
            f"found a list, '{text}': maps and basins are of one ball. `vinesexp design` takes "
            "several, with --clearance for clearances that are given"
        )
    if ":" in text and option.symbol not in _MAY_VARY:
        raise ParameterError(f"found the range '{text}', expected one value")
    found = []
    for one in ends_of(text) if ":" in text else (text,):
        found.append(parse_quantity(one, option.quantity))
        _refuse_outside(one.strip(), found[-1].value, option)
    if not found[0].value < found[-1].value and ":" in text:
        raise ParameterError(f"found the range '{text}', expected from a smaller to a larger value")
    return tuple(found)


def _refuse_outside(text: str, value: float, option: Option) -> None:
    if option.symbol == "r" and not 0.0 <= value < 1.0:
        raise ParameterError(f"found '{text}', expected a restitution from 0 to below 1")
    if option.symbol != "r" and not value > 0.0 and option.symbol != "c1":
        raise ParameterError(f"found '{text}', expected a value above 0")


def cells_of(text: str, axes: int) -> tuple[int, ...]:
    """Number of values along each axis, from '40' or '60x40'.

    Examples
    --------
    >>> cells_of("60x40", 2), cells_of("30", 2)
    ((60, 40), (30, 30))
    """
    words = re.split("[x×]", text.lower())
    found = [re.fullmatch(rf"\s*0*([0-9]{{1,{MOST_DIGITS}}})\s*", word) for word in words]
    numbers = tuple(int(one[1]) for one in found if one) * (axes if len(words) == 1 else 1)
    if len(numbers) != axes or not all(found):
        example = "40" if axes == 1 else "40 or 60x40"
        expected = f"{example}, less than 10^{MOST_DIGITS} along an axis"
        raise ParameterError(f"found '{shortened(text)}', expected {expected}", where="--cells")
    if min(numbers) < 2:
        raise ParameterError(f"found '{text}', expected 2 or more along an axis", where="--cells")
    return numbers


def shortened(text: str) -> str:
    """A text for a message: what is longer than a line is cut."""
    return text if len(text) <= 60 else f"{text[:50]}... ({len(text)} characters)"


def along(ends: Ends, n: int) -> tuple[float, ...]:
    """n evenly spaced values from end to end."""
    return tuple(np.linspace(*ends, n).tolist())
