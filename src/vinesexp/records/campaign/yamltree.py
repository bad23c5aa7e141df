"""YAML with the line of every key, no key twice, and scalars left as the person wrote them.

The usual YAML types would turn `no` into False and `10_000` into a number before anybody saw
the missing unit; here a scalar stays text, but for plain integers (column numbers).
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from vinesexp.records.campaign.problems import Problems

_LARGEST = 1 << 20  # characters
_MOST = 20_000  # keys and values
_DEEPEST = 20  # levels
#: A title or a note of one line, unquoted, in which a colon stands before a blank.
_WORDS = re.compile(
    r"^(title:|notes:)[ \t]+([^\s'\"|>&*!\[{#%@`][^\n#]*:[ \t][^\n#]*?)[ \t]*([ \t]#[^\n]*)?$",
    re.MULTILINE,
)


@dataclass
class Section:
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


def read_yaml(file: Path, problems: Problems) -> Section | None:
    """The top mapping of `file`, or None with the reason in `problems`."""
    import yaml

    try:
        if file.exists() and not file.is_file():
            problems.add("is not a regular file")
            return None
        text = _with_plain_texts(file.read_text(encoding="utf-8-sig"))
        if not _is_modest(text, problems, yaml):
            return None
        node = yaml.compose(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except FileNotFoundError:
        problems.add("is missing; docs/campaign.md says what it holds")
        return None
    except (OSError, UnicodeDecodeError) as error:
        problems.add(f"cannot be read ({_reason(error)}); save it as UTF-8 text")
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
        problems.add(
            "is empty; docs/campaign.md says what it holds"
            if node is None
            else "holds no 'key: value' pairs"
        )
        return None
    top: Section = _build(node, "", problems, yaml)
    return top


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
    depth = deepest = count = 0
    if len(text) <= _LARGEST:
        for event in yaml.parse(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            deepest, count = max(depth, deepest), count + 1
            if isinstance(event, yaml.AliasEvent):
                line = f"line {event.start_mark.line + 1}"
                problems.add("an alias (*name); write the value itself, or in quotes", where=line)
                return False
            if deepest > _DEEPEST or count > _MOST:
                break
    if len(text) > _LARGEST or deepest > _DEEPEST or count > _MOST:
        problems.add(
            f"is larger than any description (more than {_LARGEST >> 20} MB, {_MOST} entries or "
            f"{_DEEPEST} levels); docs/campaign.md says what it holds"
        )
        return False
    return True


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or getattr(error, "reason", None) or str(error)


def _build(node: Any, path: str, problems: Problems, yaml: Any) -> Any:
    if isinstance(node, yaml.MappingNode):
        section = Section(path)
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
