"""The cells of records.csv, each read strictly; ParameterError says what was expected."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from vinesexp.errors import ParameterError, nearest
from vinesexp.records.schema import MOST_BALLS, TESTS
from vinesexp.units import refuse_impossible

_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)  # Windows devices
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_YES = {"": False, "no": False, "n": False, "false": False, "0": False}
_YES |= {"yes": True, "y": True, "true": True, "1": True}


def read_number(text: str, comma: bool) -> float:
    """A number without a unit; decimal commas where `comma` allows them."""
    plain = text.strip()
    if "," in plain:
        if not comma:
            raise ParameterError(
                f"found '{text}', expected a number with a decimal point (a comma parts the "
                "columns of this table)"
            )
        plain = plain.replace(",", ".")
    if not _NUMBER.fullmatch(plain) or not math.isfinite(float(plain)):
        raise ParameterError(f"found '{text}', expected a number without a unit")
    return float(plain)


def read_size(text: str, number: Callable[[str], float], quantity: str) -> float:
    """A length in mm or a mass in g as SI, refused where no rig has that size."""
    value = number(text) / 1e3
    refuse_impossible(text, value, quantity)
    return value


def read_least(text: str, number: Callable[[str], float], quantity: str) -> float:
    """As `read_size`, of zero or above."""
    value = read_size(text, number, quantity)
    if value < 0.0:
        raise ParameterError(f"found '{text}', expected zero or above")
    return value


def read_clearance(text: str, number: Callable[[str], float], n_masses: int) -> tuple[float, ...]:
    """Clearances in m, one for each NES."""
    values = tuple(read_size(part, number, "displacement") for part in text.split(";"))
    if any(value <= 0.0 for value in values):
        raise ParameterError(
            f"found '{text}', expected clearances above zero (empty: NES removed or blocked)"
        )
    if len(values) > MOST_BALLS:
        raise ParameterError(
            f"{len(values)} clearances; the impacts of more than {MOST_BALLS} balls cannot be told "
            "apart: write exclude: yes, or the clearances of the balls that matter"
        )
    if 1 < n_masses < len(values):
        raise ParameterError(
            f"{len(values)} clearances, but campaign.yaml gives {n_masses} masses under "
            "known.nes_mass; give one mass for all or one for each"
        )
    return values


def read_frequency(text: str, number: Callable[[str], float]) -> tuple[float, float]:
    """A frequency or a range, Hz."""
    parts = [number(part) for part in text.split(":")]
    if len(parts) > 2 or any(part <= 0.0 for part in parts):
        raise ParameterError(
            f"found '{text}', expected a frequency above zero or a range such as 7.2:8.4"
        )
    for part in parts:
        refuse_impossible(text, part, "frequency")
    return parts[0], parts[-1]


def read_id(text: str) -> str:
    """A name that can be a file's."""
    if not _ID.fullmatch(text) or text.endswith(".") or _RESERVED.fullmatch(text):
        raise ParameterError(
            f"found '{text}', expected a name of letters, digits and _ . + - that can be a "
            "file's name"
        )
    if len(text) > 100:
        raise ParameterError(f"the name has {len(text)} characters, expected at most 100")
    return text


def read_test(text: str) -> str:
    """One of the tests there are."""
    if text not in TESTS:
        close = nearest(text, TESTS)
        raise ParameterError(f"unknown test '{text}'; {close}")
    return text


def read_exclude(text: str) -> bool:
    """Yes or no."""
    answer = _YES.get(text.lower())
    if answer is None:
        raise ParameterError(f"found '{text}', expected yes or no (the reason goes to note)")
    return answer


def read_setup(text: str, setups: tuple[str, ...]) -> str:
    """The name of one of the setups."""
    if text not in setups:
        hint = nearest(text, setups) if setups else "campaign.yaml has no 'setups'"
        raise ParameterError(f"unknown setup '{text}'; {hint}")
    return text
