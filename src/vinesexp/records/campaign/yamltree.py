"""YAML with the line of every key, no key twice, and scalars left as the person wrote them.

The usual YAML types would turn `no` into False and `10_000` into a number before anybody saw
the missing unit; here a scalar stays text, but for plain integers (column numbers). A key is looked
up through layers: of a scene in the record before its group, and a mistake is noted at the line
where the value in force was written.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Collection, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from typing import Any, TypedDict, TypeVar, Unpack

from vinesexp.errors import ParameterError, nearest
from vinesexp.records.campaign.problems import Problems
from vinesexp.units import parse_quantity, yes_or_no

T = TypeVar("T")

_LARGEST = 1 << 18  # characters
_DEEPEST = 20  # levels
#: A title or a note of one line, unquoted, in which a colon stands before a blank.
_WORDS = re.compile(
    r"^(title:|notes:)[ \t]+([^\s'\"|>&*!\[{#%@`][^\n#]*:[ \t][^\n#]*?)[ \t]*([ \t]#[^\n]*)?$",
    re.MULTILINE,
)


@dataclass
class Pairs:
    """A mapping of the file: its place (``channels.base``), values, and the line of each key."""

    path: str = ""
    values: dict[str, Any] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)

    def __str__(self) -> str:
        """What a message calls it where a single value was expected."""
        return f"{{{', '.join(self.values)}}}"

    __repr__ = __str__

    def where(self, key: str) -> str:
        """Line and full key, for a message."""
        full = f"{self.path}.{key}" if self.path else key
        return f"line {self.lines[key]}, key {full}" if key in self.lines else f"key {full}"


class May(TypedDict, total=False):
    """What a number may be, and whether it has to be there."""

    needed: bool
    zero: bool
    signed: bool


@dataclass(frozen=True)
class Section:
    """Mappings of one meaning, the most particular first; false where there is none.

    Parameters
    ----------
    layers : tuple of Pairs
    problems : Problems
        Where mistakes go.
    place : str
        Where the section stands, for a message.
    """

    layers: tuple[Pairs, ...]
    problems: Problems
    place: str = ""

    def __bool__(self) -> bool:
        return bool(self.layers)

    def over(self, other: Section) -> Section:
        """These mappings before those of `other`."""
        return replace(self, layers=(*self.layers, *other.layers))

    def under(self, key: str, *, more: str = "") -> Section:
        """The mappings under `key` of every layer that has one; `more` ends the message."""
        found = []
        for layer in self.layers:
            value = layer.values.get(key)
            if isinstance(value, Pairs):
                found.append(value)
            elif value is not None:
                expected = f"found '{value}', expected 'name: value' pairs{more}"
                self.problems.add(expected, where=layer.where(key))
        return Section(tuple(found), self.problems, self.where(key))

    def names(self) -> tuple[str, ...]:
        """Keys of all layers, the most general layer's first, each once."""
        return tuple(dict.fromkeys(k for one in reversed(self.layers) for k in one.values))

    def refuse_unknown(self, known: Collection[str]) -> None:
        """Note every key that is not among the known ones, with the nearest of them."""
        for layer in self.layers:
            for key in layer.values:
                if key not in known:
                    words = f"unknown key '{key}'; {nearest(key, known)}"
                    self.problems.add(words, where=layer.where(key))

    def _holder(self, key: str) -> Pairs | None:
        return next((one for one in self.layers if one.values.get(key) is not None), None)

    def value(self, key: str) -> Any:
        """The value in force, as the person wrote it; None where nobody did."""
        holder = self._holder(key)
        return None if holder is None else holder.values[key]

    def text(self, key: str) -> str | None:
        """The value in force as text."""
        value = self.value(key)
        return None if value is None else str(value)

    def listed(self, key: str) -> list[Any]:
        """The value in force as a list, which one value alone makes too."""
        value = self.value(key)
        return value if isinstance(value, list) else [] if value is None else [value]

    def where(self, key: str) -> str:
        """Line and key of the value in force, or of where it should stand."""
        holder = self._holder(key) or (self.layers[0] if self.layers else None)
        return f"key {key}" if holder is None else holder.where(key)

    def complain(self, key: str, problem: str) -> None:
        """Note a mistake at `key`."""
        self.problems.add(problem, where=self.where(key))

    def lacks(self, key: str, problem: str) -> None:
        """Note a mistake at `key`, or at the section itself where nobody gave the key."""
        given = self.value(key) is not None
        self.problems.add(problem, where=self.where(key) if given else self.place)

    def at(self, key: str) -> AbstractContextManager[None, bool]:
        """Turn a ParameterError inside into a mistake noted at `key`, and go on after it."""
        return self.problems.at(self.where(key))

    def read(self, key: str, convert: Callable[[Any], T], default: T) -> T:
        """What `convert` makes of the value; the default of none, or of a mistake, which is noted.

        A mistake is a ParameterError.
        """
        if self.value(key) is not None:
            with self.at(key):
                return convert(self.value(key))
        return default

    def quantity(self, key: str, kind: str, **may: Unpack[May]) -> float | None:
        """One number with its unit, in SI; above zero unless `zero` or `signed` allow more."""
        if self.value(key) is None and may.get("needed"):
            self.complain(key, f"is missing; expected a {kind} with its unit")
        return self.read(key, lambda value: _checked(value, kind, may), None)

    def quantities(self, table: Mapping[str, tuple[str, str]]) -> dict[str, float]:
        """Those numbers of a table that are given, SI: key to kind, and what it may be."""
        found = {}
        for key, (kind, may) in table.items():
            value = self.quantity(key, kind, **dict.fromkeys(may.split(), True))
            if value is not None:
                found[key] = value
        return found

    def lengthy(self, key: str, kind: str, **may: Unpack[May]) -> tuple[float, ...]:
        """One number with its unit or a list of them, in SI."""
        if may.get("needed") and self.value(key) is None:
            self.complain(key, f"is missing; expected a {kind} with its unit, or a list")
        found = []
        for item in self.listed(key):
            with self.at(key):
                found.append(_checked(item, kind, may))
        return tuple(found)

    def whole(self, key: str, *, low: int, high: int, default: int) -> int:
        """A whole number from low to high."""
        value = self.value(key)
        if value is None:
            return default
        if not isinstance(value, int) or not low <= value <= high:
            self.complain(key, f"found '{value}', expected a whole number from {low} to {high}")
            return default
        return value

    def answer(self, key: str) -> bool:
        """Yes or no; no where nobody answers."""
        return self.read(key, yes_or_no, False)


def _checked(text: object, kind: str, may: May) -> float:
    value = parse_quantity(text, kind).value
    if not may.get("signed") and (value < 0.0 or (value == 0.0 and not may.get("zero"))):
        least = "of zero or more" if may.get("zero") else "above zero"
        raise ParameterError(f"found '{text}', expected a {kind} {least}")
    return value


def read_yaml(problems: Problems) -> Section | None:
    """The top mapping of a file, or None with the reason in `problems`."""
    import yaml

    if (content := problems.content()) is None:
        return None
    try:
        decoded = content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
        text = _with_plain_texts(decoded)
        if not _is_modest(text, problems, yaml):
            return None
        node = yaml.compose(text, Loader=_loader(yaml))
    except UnicodeDecodeError as error:
        problems.add(f"cannot be read ({error.reason}); save it as UTF-8 text")
        return None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        what = getattr(error, "problem", None) or "not readable as YAML"
        problems.add(
            f"{what}; put values that contain ':' '#' or '*' in quotes",
            where=f"line {mark.line + 1}, column {mark.column + 1}" if mark else None,
        )
        return None
    if not isinstance(node, yaml.MappingNode):
        found = "is empty" if node is None else "holds no 'key: value' pairs"
        problems.add(f"{found}; docs/campaign.md says what it holds")
        return None
    return Section((_build(node, "", problems, yaml),), problems)


def _loader(yaml: Any) -> Any:
    return getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def _with_plain_texts(text: str) -> str:
    """The description with the words of a person in quotes where YAML would take them apart.

    Examples
    --------
    >>> print(_with_plain_texts("title: Shaker: summer  # the second"))
    title: "Shaker: summer" # the second
    >>> print(_with_plain_texts("title: Shaker # look: summer"))
    title: Shaker # look: summer
    >>> print(_with_plain_texts("title: 'Shaker: summer'"))
    title: 'Shaker: summer'
    """
    return _WORDS.sub(lambda m: f"{m[1]} {json.dumps(m[2], ensure_ascii=False)}{m[3] or ''}", text)


def _is_modest(text: str, problems: Problems, yaml: Any) -> bool:
    """Whether a description is of a size that a person writes: aliases can swell without end."""
    depth, modest = 0, len(text) <= _LARGEST
    for event in yaml.parse(text, Loader=_loader(yaml)) if modest else ():
        if isinstance(event, yaml.AliasEvent):
            line = f"line {event.start_mark.line + 1}"
            problems.add("an alias (*name); write the value itself, or in quotes", where=line)
            return False
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        modest = modest and depth <= _DEEPEST
    if not modest:
        problems.add(
            f"is larger than any description (more than {_LARGEST >> 10} kB or {_DEEPEST} levels); "
            "docs/campaign.md says what it holds"
        )
    return modest


def _build(node: Any, path: str, problems: Problems, yaml: Any) -> Any:
    if isinstance(node, yaml.MappingNode):
        section = Pairs(path)
        for key_node, value_node in node.value:
            line = key_node.start_mark.line + 1
            if not isinstance(key_node, yaml.ScalarNode):
                problems.add(
                    "a key that is a list or braces; a key is one word", where=f"line {line}"
                )
                continue
            key = str(key_node.value)
            full = f"{path}.{key}" if path else key
            if key in section.values:
                problems.add(
                    f"given twice, first in line {section.lines[key]}; remove one",
                    where=f"line {line}, key {full}",
                )
                continue
            section.lines[key] = line
            section.values[key] = _build(value_node, full, problems, yaml)
        return section
    if isinstance(node, yaml.SequenceNode):
        return [_build(item, path, problems, yaml) for item in node.value]
    if node.tag == "tag:yaml.org,2002:null":
        return None
    if node.tag == "tag:yaml.org,2002:int" and node.value.isdigit() and len(node.value) < 10:
        return int(node.value)
    return str(node.value)
