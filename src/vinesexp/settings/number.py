"""One number that steers a stage: default, unit, limits, reason, and where that is measured."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import Field, field
from typing import Any

from vinesexp.errors import ParameterError, nearest
from vinesexp.units import UNITS, parse_quantity

#: Unit in which a setting is written in the documentation, for each quantity with a dimension.
WRITTEN_IN = {"time": "ms", "frequency": "Hz", "displacement": "mm", "velocity": "mm/s"}
_YES = {"yes": True, "true": True, "on": True, "no": False, "false": False, "off": False}


def number(
    default: float, why: str, *, measured: str, low: float, high: float, of: str = ""
) -> Any:
    """Field of a settings class that holds a number.

    Parameters
    ----------
    default, low, high : float
        SI; the least and the largest value that make sense.
    why : str
        What it does and why it has this value.
    measured : str
        Where the reason can be checked: a test, a section of a benchmark page, a source.
    of : str
        A key of `vinesexp.units.UNITS` (``time``: the number is written with a unit of time), or
        in words what a bare number counts (``samples``).
    """
    meta = {"why": why, "measured": measured, "low": low, "high": high, "of": of}
    return field(default=default, metadata=meta)


def choice(default: str, why: str, *, measured: str, words: Iterable[str], own: str = "") -> Any:
    """Field of a settings class that holds one of a few words.

    With `own`, the name of a group of entry points, a word may also be a name in that group or
    ``module:function``.
    """
    meta = {"why": why, "measured": measured, "words": tuple(words), "of": "word", "own": own}
    return field(default=default, metadata=meta)


def switch(default: bool, why: str, *, measured: str) -> Any:
    """Field of a settings class that is yes or no."""
    return field(default=default, metadata={"why": why, "measured": measured, "of": "yes or no"})


def parsed(setting: Field[Any], text: object) -> float | int | bool | str:
    """A person's text as the value of a setting, SI.

    Raises
    ------
    ParameterError
        A missing or wrong unit, a number out of its limits, a word that is not known.

    Examples
    --------
    >>> from dataclasses import fields
    >>> from vinesexp.settings.stages import ImpactSettings
    >>> by_name = {f.name: f for f in fields(ImpactSettings)}
    >>> parsed(by_name["apart"], "2 ms"), parsed(by_name["detector"], "sta_lta")
    (0.002, 'sta_lta')
    """
    meta = setting.metadata
    if isinstance(setting.default, bool):
        answer = _YES.get(str(text).strip().lower())
        if answer is None:
            raise ParameterError(f"found '{text}', expected yes or no")
        return answer
    if isinstance(setting.default, str):
        return _word(setting, str(text).strip())
    quantity = meta["of"] if meta["of"] in UNITS else "ratio"
    value = parse_quantity(str(text).strip(), quantity).value
    if not meta["low"] <= value <= meta["high"]:
        low, high = (written(setting, meta[end]) for end in ("low", "high"))
        raise ParameterError(f"found '{text}', expected {low} to {high}")
    if isinstance(setting.default, int):
        if value != round(value):
            raise ParameterError(f"found '{text}', expected a whole number")
        return round(value)
    return value


def _word(setting: Field[Any], word: str) -> str:
    """A word that the setting knows, or the name of a function of the user's own."""
    words, group = setting.metadata["words"], setting.metadata["own"]
    if word in words:
        return word
    if group and all(part.isidentifier() for part in word.replace(":", ".").split(".")):
        if ":" in word:
            return word
        from importlib.metadata import entry_points  # slow to import

        words = [*words, *(point.name for point in entry_points(group=group))]
        if word in words:
            return word
    own = f"; a function of your own is written as module:function or is an entry point of {group}"
    raise ParameterError(f"found '{word}'; {nearest(word, words)}{own if group else ''}")


def written(setting: Field[Any], value: Any) -> str:
    """A value of a setting as a person would write it: ``3 ms``, ``0.25``, ``yes``."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    quantity = setting.metadata["of"]
    if quantity in WRITTEN_IN:
        unit = WRITTEN_IN[quantity]
        return f"{value / UNITS[quantity][unit]:.6g} {unit}"
    return f"{value:.6g}"
