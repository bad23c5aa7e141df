"""Reading one key of campaign.yaml: sections, answers, quantities. Mistakes are noted."""

from __future__ import annotations

from vinesexp.errors import ParameterError, nearest
from vinesexp.records.problems import Problems
from vinesexp.records.yamltree import Section
from vinesexp.units import Quantity, parse_quantity

_YES = {"yes": True, "true": True, "on": True, "no": False, "false": False, "off": False}


def refuse_unknown(section: Section, known: tuple[str, ...], problems: Problems) -> None:
    """Note every key that is not among the known ones, with the nearest of them."""
    for key in section.values:
        if key not in known:
            problems.add(f"unknown key '{key}'; {nearest(key, known)}", where=section.where(key))


def subsection(parent: Section, key: str, problems: Problems) -> Section | None:
    """The mapping under `key`, or None where it is absent or something else."""
    value = parent.values.get(key)
    if value is None or isinstance(value, Section):
        return value
    problems.add(f"found '{value}', expected 'name: value' pairs", where=parent.where(key))
    return None


def yes_or_no(section: Section, key: str, problems: Problems) -> bool:
    """The answer under `key`; no where it is absent."""
    value = section.values.get(key)
    if value is None:
        return False
    answer = _YES.get(str(value).lower())
    if answer is None:
        problems.add(f"found '{value}', expected yes or no", where=section.where(key))
    return bool(answer)


def positive(section: Section, key: str, quantity: str, problems: Problems) -> float | None:
    """A value above zero in SI, or None where it is absent or wrong."""
    if section.values.get(key) is None:
        return None
    with problems.at(section.where(key)):
        return above_zero(section.values[key], quantity).value
    return None


def above_zero(text: object, quantity: str) -> Quantity:
    """Read a quantity; ParameterError where it is not above zero."""
    found = parse_quantity(text, quantity)
    if found.value <= 0.0:
        raise ParameterError(f"found '{text}', expected a {quantity} above zero")
    return found
