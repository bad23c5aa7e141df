"""Which base amplitude to believe where the channel on the base contradicts the sheet.

The mass decides: what its motion between impacts shows of the base (`identification.base_felt`)
needs neither. Where it agrees with neither it is taken with an error that reaches the nearer one;
where it was not to be had, the error holds both.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal

from vinesexp.identification.base_felt import BASE_FELT
from vinesexp.units import COVERAGE_95, Quantity

#: What an amplitude is from; `open` where channel and sheet exclude one another and neither wins.
Believed = Literal["channel", "sheet", "open"]

#: Standard errors within which the motion of the mass agrees with an amplitude.
_AGREES = 3.0
#: Share by which it must miss what channel and sheet both say: jumps that are off move it too.
_MISSES = 0.1


def felt_of(identified: Sequence[Mapping[str, str]], records: set[str]) -> Quantity | None:
    """The base as the mass felt it, m, of a level with these records; from identified.csv."""
    for row in identified:
        if row["parameter"] == BASE_FELT and records & set(row["records"].split(";")):
            return Quantity(float(row["value"]), float(row["std_error"] or 0.0))
    return None


def believed(
    sheet: Quantity, channel: Quantity, felt: Quantity | None
) -> tuple[Quantity, Believed]:
    """Amplitude of a level whose base channel contradicts the sheet, m.

    Examples
    --------
    >>> sheet, felt = Quantity(0.25e-3, 5e-6), Quantity(0.252e-3, 5e-6)
    >>> believed(sheet, Quantity(0.5e-3, 5e-6), felt)[1]
    'sheet'
    >>> believed(sheet, Quantity(0.225e-3, 2e-6), Quantity(0.226e-3, 5e-6))[1]
    'channel'
    >>> G, of = believed(sheet, Quantity(0.5e-3, 5e-6), None)
    >>> round(1e3 * G.std_error, 3), of
    (0.128, 'open')
    """
    if felt is not None and _agrees(felt, channel):
        return channel, "channel"
    if felt is not None and _agrees(felt, sheet):
        return sheet, "sheet"
    if felt is None:
        return widened_to(channel, sheet), "open"
    nearer = min((channel, sheet), key=lambda one: abs(math.log(one.value / felt.value)))
    return widened_to(felt, nearer), "open"


def widened_to(value: Quantity, other: Quantity) -> Quantity:
    """A value whose 95 % interval holds another one too."""
    apart = abs(other.value - value.value)
    return Quantity(value.value, math.hypot(value.std_error, apart / COVERAGE_95))


def contradicts(felt: Quantity, stated: Quantity) -> bool:
    """Whether the mass moved as by another base amplitude than a stated one."""
    error = math.hypot(felt.std_error / felt.value, stated.std_error / stated.value)
    return abs(math.log(felt.value / stated.value)) > _AGREES * error


def denies(felt: Quantity, amplitude: Quantity) -> bool:
    """Whether the mass moved by another base than the one that channel and sheet agree on."""
    if abs(math.log(felt.value / amplitude.value)) < _MISSES:
        return False
    return contradicts(felt, amplitude)


def _agrees(felt: Quantity, amplitude: Quantity) -> bool:
    return abs(math.log(amplitude.value / felt.value)) < _AGREES * felt.std_error / felt.value
