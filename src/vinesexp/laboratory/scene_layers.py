"""Keys looked up through layers of a YAML file: record before group before scene.

A mistake is reported at the line where the value in force was written.
"""

from __future__ import annotations

from typing import Any

from vinesexp.errors import ParameterError
from vinesexp.records.campaign.channel_section import refuse_unknown
from vinesexp.records.campaign.problems import Problems
from vinesexp.records.campaign.yamltree import Section
from vinesexp.units import parse_quantity


class Layers:
    """Sections of one meaning, the most particular first.

    Parameters
    ----------
    sections : tuple of Section
    problems : Problems
        Where mistakes go.
    """

    def __init__(self, sections: tuple[Section, ...], problems: Problems) -> None:
        self.sections = sections
        self.problems = problems

    def over(self, other: Layers) -> Layers:
        """These sections before those of `other`."""
        return Layers((*self.sections, *other.sections), self.problems)

    def under(self, key: str) -> Layers:
        """The sections under `key` of every layer that has one."""
        found = []
        for section in self.sections:
            value = section.values.get(key)
            if isinstance(value, Section):
                found.append(value)
            elif value is not None:
                self.problems.add(
                    f"found '{value}', expected 'name: value' pairs", where=section.where(key)
                )
        return Layers(tuple(found), self.problems)

    def names(self) -> tuple[str, ...]:
        """Keys of all layers, the most general layer's first, each once."""
        return tuple(dict.fromkeys(k for s in reversed(self.sections) for k in s.values))

    def refuse_unknown(self, known: tuple[str, ...]) -> None:
        """Note every key that nobody reads."""
        for section in self.sections:
            refuse_unknown(section, known, self.problems)

    def _holder(self, key: str) -> Section | None:
        return next((s for s in self.sections if s.values.get(key) is not None), None)

    def value(self, key: str) -> Any:
        """The value in force, as the person wrote it; None where nobody did."""
        holder = self._holder(key)
        return None if holder is None else holder.values[key]

    def text(self, key: str) -> str | None:
        """The value in force as text."""
        value = self.value(key)
        return None if value is None else str(value)

    def where(self, key: str) -> str:
        """Line and key of the value in force, or of where it should stand."""
        holder = self._holder(key) or (self.sections[0] if self.sections else None)
        return f"key {key}" if holder is None else holder.where(key)

    def complain(self, key: str, problem: str) -> None:
        """Note a mistake at `key`."""
        self.problems.add(problem, where=self.where(key))

    def quantity(
        self,
        key: str,
        kind: str,
        *,
        needed: bool = False,
        zero: bool = False,
        signed: bool = False,
    ) -> float | None:
        """One number with its unit, in SI; above zero unless `zero` or `signed` allow more."""
        value = self.value(key)
        if value is None:
            if needed:
                self.complain(key, f"is missing; expected a {kind} with its unit")
            return None
        with self.problems.at(self.where(key)):
            return self._checked(value, kind, zero, signed)
        return None

    def lengthy(
        self,
        key: str,
        kind: str,
        *,
        needed: bool = False,
        zero: bool = False,
        signed: bool = False,
        default: tuple[float, ...] = (),
    ) -> tuple[float, ...]:
        """One number with its unit or a list of them, in SI."""
        value = self.value(key)
        if value is None:
            if needed:
                self.complain(key, f"is missing; expected a {kind} with its unit, or a list")
            return default
        found = []
        for item in value if isinstance(value, list) else [value]:
            with self.problems.at(self.where(key)):
                found.append(self._checked(item, kind, zero, signed))
        return tuple(found) or default

    def whole(self, key: str, *, low: int, high: int, default: int) -> int:
        """A whole number from low to high."""
        value = self.value(key)
        if value is None:
            return default
        if not isinstance(value, int) or not low <= value <= high:
            self.complain(key, f"found '{value}', expected a whole number from {low} to {high}")
            return default
        return value

    @staticmethod
    def _checked(text: object, kind: str, zero: bool, signed: bool) -> float:
        value = parse_quantity(text, kind).value
        if not signed and (value < 0.0 or (value == 0.0 and not zero)):
            raise ParameterError(
                f"found '{text}', expected a {kind} {'of zero or more' if zero else 'above zero'}"
            )
        return value
