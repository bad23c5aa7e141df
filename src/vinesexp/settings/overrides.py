"""Settings that a person changes: `impacts.threshold = 7`, checked, and shown where changed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import Field, fields, replace
from typing import Any

from vinesexp.errors import ParameterError, nearest
from vinesexp.settings.stages import Settings, parsed, written

STAGES = tuple(stage.name for stage in fields(Settings))


def numbers_of(stage: str) -> tuple[Field[Any], ...]:
    """The settings of a stage."""
    return fields(getattr(Settings(), stage))


def every_setting() -> Iterator[tuple[str, Field[Any]]]:
    """Stage and setting, of all."""
    for stage in STAGES:
        for setting in numbers_of(stage):
            yield stage, setting


def changed(settings: Settings, stage: str, name: str, text: object) -> Settings:
    """The settings with one number given by a person.

    Raises
    ------
    ParameterError
        No such stage or setting (the nearest one is named), or no value for it.

    Examples
    --------
    >>> changed(Settings(), "impacts", "threshold", "7").impacts.threshold
    7.0
    >>> changed(Settings(), "impacts", "treshold", "7")
    Traceback (most recent call last):
    vinesexp.errors.ParameterError: unknown setting 'treshold'; did you mean 'threshold'?
    """
    if stage not in STAGES:
        raise ParameterError(f"unknown stage '{stage}'; {nearest(stage, STAGES)}")
    known = {setting.name: setting for setting in numbers_of(stage)}
    if name not in known:
        raise ParameterError(f"unknown setting '{name}'; {nearest(name, known)}")
    old = getattr(settings, stage)
    return replace(settings, **{stage: replace(old, **{name: parsed(known[name], text)})})


def changed_by_text(settings: Settings, text: str) -> Settings:
    """The settings with changes written in one line, several parted by ``|``.

    Examples
    --------
    >>> found = changed_by_text(Settings(), "impacts.threshold = 7 | regimes.settling = 0.1")
    >>> differences(found)
    ('impacts.threshold = 7', 'regimes.settling = 0.1')
    """
    for part in text.split("|"):
        key, equals, value = part.partition("=")
        stage, dot, name = key.strip().partition(".")
        if not (equals and dot and value.strip()):
            raise ParameterError(
                f"found '{part.strip()}', expected stage.setting = value, such as "
                "'impacts.threshold = 7'; several are parted by |"
            )
        settings = changed(settings, stage.strip(), name.strip(), value.strip())
    return settings


def differences(settings: Settings, base: Settings | None = None) -> tuple[str, ...]:
    """What differs from `base` (the defaults), as a person would write it."""
    base = Settings() if base is None else base
    found = []
    for stage, setting in every_setting():
        new, old = (getattr(getattr(s, stage), setting.name) for s in (settings, base))
        if new != old:
            found.append(f"{stage}.{setting.name} = {written(setting, new)}")
    return tuple(found)
