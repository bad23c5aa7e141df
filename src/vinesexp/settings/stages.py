"""The numbers that steer the stages, a class a stage. Change them in campaign.yaml or records.csv.

Numbers that only serve a computation (block sizes, iterations) stay beside their code.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import Field, dataclass, field, fields, replace
from functools import lru_cache
from typing import Any

from vinesexp.errors import ParameterError, nearest
from vinesexp.units import UNITS, parse_quantity, yes_or_no

#: Detectors of impacts by name (`vinesexp.signals.impacts.detectors`).
DETECTORS = ("template", "find_peaks", "sta_lta", "matched_filter")

_TABLE = "docs/benchmarks/impacts.md, halved and doubled"
_ABLATION = "docs/benchmarks/impacts.md, effect of each part"
_CONDITION = "tests/signals/test_condition.py"
_DROP = "tests/hard_cases/test_drop_records.py"
_FOLLOWED = "tests/signals/impacts/test_soft_contacts.py"
_FIND = "tests/signals/impacts/test_find.py"


#: Unit in which a setting is written in the documentation, for each quantity with a dimension.
WRITTEN_IN = {"time": "ms", "frequency": "Hz", "displacement": "mm", "velocity": "mm/s"}


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
        return yes_or_no(text)
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


# A table: what a number is and why, then where that is measured and its limits.
# fmt: off
@dataclass(frozen=True)
class FilterSettings:
    """Bands that displacement, base and acceleration keep."""

    order: int = number(
        2, "order of the Butterworth filter in each direction; a higher one rings longer",
        measured="tests/signals/test_filtering_and_detection.py", low=1, high=4, of="poles",
    )
    motion_low: float = number(
        0.25, "lower edge for displacement and base; below it is drift of laser and table",
        measured=_CONDITION, low=0.0, high=0.9, of="oscillator's frequency",
    )
    motion_high: float = number(
        5.0, "upper edge; harmonics up to the fifth hold the slope changes at impacts",
        measured=_CONDITION, low=1.1, high=1000.0, of="oscillator's frequency",
    )
    impacts_low: float = number(
        20.0, "lower edge for the acceleration; removes the motion, keeps a contact of 0.4 ms",
        measured=_CONDITION, low=1.0, high=1000.0, of="oscillator's frequency",
    )
    impacts_low_content: float = number(
        0.6, "nor above this share of the frequency below which half of what impacts leave lies",
        measured=_FOLLOWED, low=0.01, high=10.0, of="that frequency",
    )
    impacts_low_soft: float = number(
        7.0, "unless it would be below this: less of the motion is removed",
        measured=_FOLLOWED, low=1.0, high=1000.0, of="oscillator's frequency",
    )
    impacts_low_most: float = number(
        0.04, "the lower edge for the acceleration is not above this share of the sample rate",
        measured="docs/benchmarks/impacts.md, by sample rate", low=0.001, high=0.4,
        of="sample rate",
    )
    impacts_low_least: float = number(
        3.0, "unless it would be below this: the motion itself would be taken for impacts",
        measured="tests/signals/impacts/test_slow_sampling.py", low=1.0, high=20.0,
        of="oscillator's frequency",
    )
    slowest: float = number(
        0.5, "lower edge in a record without oscillation; below it is drift of the sensor",
        measured="tests/signals/test_real_shocks.py", low=0.0, high=1e4, of="frequency",
    )

    drop_low: float = number(
        100.0, "lower edge in a drop test; below it are hum, handling and the bench",
        measured=_DROP, low=0.0, high=1e5, of="frequency",
    )


@dataclass(frozen=True)
class ChannelSettings:
    """When a channel is trusted: the ends of its range, its gain and lag against another."""

    stuck: float = number(
        5e-3, "a sensor at the end of its range for longer is stuck; contacts are shorter",
        measured="tests/hard_cases/test_impacts.py", low=1e-5, high=10.0, of="time",
    )
    piled: float = number(
        4.0, "clipped: the outermost level has this many times the samples of the next levels",
        measured=_FIND, low=1.5, high=1000.0, of="ratio",
    )
    gain_sure: float = number(
        5.0, "the sign of the acceleration is corrected if its gain is this many errors from 0",
        measured=_FIND, low=1.0, high=100.0, of="standard errors",
    )
    lag_known: float = number(
        2e-4, "a lag between the channels with a larger error is not corrected",
        measured=_FIND, low=0.0, high=1.0, of="time",
    )


@dataclass(frozen=True)
class ImpactSettings:
    """How impacts are found in the acceleration."""

    detector: str = choice(
        "template", "how impacts are found: a learnt template, a usual detector, or "
        "a function of your own (docs/how-to/detector.md)",
        measured="docs/benchmarks/impacts.md", words=DETECTORS, own="vinesexp.detectors",
    )
    threshold: float = number(
        6.0, "height of an impact over the noise; noise alone reaches it once in 5e8 samples",
        measured="docs/benchmarks/impacts.md, by signal to noise", low=2.0, high=1000.0,
        of="standard deviations",
    )
    faint: float = number(
        0.7, "candidates above this share of the threshold are compared with the template",
        measured=_TABLE, low=0.3, high=1.0, of="threshold",
    )
    apart: float = number(
        3e-3, "first guesses closer than this are one contact and its ringing",
        measured=_TABLE, low=1e-5, high=1.0, of="time",
    )
    learn: bool = switch(True, "fit the template to the record's own impacts", measured=_ABLATION)
    learn_from: int = number(
        80, "impacts that the template is learnt from; its error is below the noise of one",
        measured=_TABLE, low=5, high=10000, of="impacts",
    )
    learn_above: float = number(
        7.0, "height of an impact to learn from", measured=_TABLE, low=3.0, high=1000.0,
        of="standard deviations",
    )
    split: bool = switch(
        True, "look for a second contact in the remainder of overlapping ones", measured=_ABLATION
    )
    contact: float = number(
        4e-4, "length of a contact (half a sine) for detectors that do not learn it",
        measured="docs/benchmarks/impacts.md", low=1e-6, high=0.1, of="time",
    )
    short_average: float = number(
        5e-4, "sta_lta: window of the short average", measured="docs/benchmarks/impacts.md",
        low=1e-6, high=0.1, of="time",
    )
    long_average: float = number(
        20e-3, "sta_lta: window of the long average", measured="docs/benchmarks/impacts.md",
        low=1e-5, high=10.0, of="time",
    )
    ratio: float = number(
        4.0, "sta_lta: ratio of short to long average of the amplitude at an impact",
        measured="docs/benchmarks/impacts.md", low=1.0, high=100.0, of="long average",
    )


@dataclass(frozen=True)
class DropSettings:
    """Drop tests with hits that ring for longer than a template."""

    ring: float = number(
        8e-3, "hits that ring longer (to a tenth) are found by their onsets, not by a template",
        measured=_DROP, low=0.0, high=10.0, of="time",
    )
    window: float = number(
        1e-3, "window of the level; shorter than a flight, longer than a period of the ringing",
        measured=_DROP, low=1e-5, high=0.1, of="time",
    )
    rest: float = number(
        20e-3, "an onset is above the largest level of this time before it",
        measured=_DROP, low=1e-3, high=10.0, of="time",
    )
    rise: float = number(
        3.0, "factor by which an onset is above that level; beats of the ringing are not",
        measured=_DROP, low=1.1, high=1000.0, of="level before",
    )


@dataclass(frozen=True)
class SlopeSettings:
    """Velocity jumps from the displacement."""

    use: bool = switch(
        True, "use the slope changes of the displacement for the jumps", measured=_ABLATION
    )


@dataclass(frozen=True)
class RegimeSettings:
    """Which part of a record shows its regime."""

    settling: float = number(
        0.2, "first share of a periodic record that is left out as its start",
        measured="docs/signals.md", low=0.0, high=0.95, of="record",
    )
    waited: float = number(
        0.0, "time for which the base moved before the record began, which the record cannot show",
        measured="tests/clearance/test_levels.py", low=0.0, high=1e6, of="time",
    )
    first_cycles: int = number(
        12, "first cycles of a release, which give its first regime",
        measured="docs/signals.md", low=2, high=10000, of="cycles",
    )
    unowned_share: float = number(
        0.05, "balls are judged separately up to this share of impacts without a known ball",
        measured="docs/signals.md", low=0.0, high=1.0, of="impacts",
    )
    permanent_cycles: int = number(
        40, "a spell of a sweep of this length is permanent two impacts per cycle",
        measured="docs/signals.md", low=5, high=100000, of="cycles",
    )
    modulation_gap: int = number(
        40, "shorter spells of a sweep with smaller gaps are one modulated band",
        measured="docs/signals.md", low=2, high=100000, of="cycles",
    )
    smallest_ball: float = number(
        1e-3, "no regime if impacts of a ball this light (mass times 1 + r) would not be seen",
        measured="tests/signals/test_visibility.py", low=1e-6, high=1.0,
        of="mass of the oscillator",
    )
    seen_share: float = number(
        0.2, "impacts can be seen if at least this many are found",
        measured="tests/signals/test_visibility.py", low=0.0, high=10.0, of="impacts a cycle",
    )
# fmt: on


@dataclass(frozen=True, repr=False)
class Settings:
    """All stages; what is not given has its default."""

    filter: FilterSettings = field(default_factory=FilterSettings)
    channels: ChannelSettings = field(default_factory=ChannelSettings)
    impacts: ImpactSettings = field(default_factory=ImpactSettings)
    drop: DropSettings = field(default_factory=DropSettings)
    slopes: SlopeSettings = field(default_factory=SlopeSettings)
    regimes: RegimeSettings = field(default_factory=RegimeSettings)

    def __repr__(self) -> str:
        """What differs from the defaults: steps depend on this text."""
        return _changes(self)


@lru_cache(maxsize=256)  # thousands of records share a few settings
def _changes(settings: Settings) -> str:
    changes = (f"{stage}.{s.name}={new!r}" for stage, s, new in changes_of(settings, Settings()))
    return f"Settings({', '.join(changes)})"


# Settings that a person changes: `impacts.threshold = 7`, checked, and shown where changed.
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
    changes = changes_of(settings, Settings() if base is None else base)
    return tuple(f"{stage}.{one.name} = {written(one, new)}" for stage, one, new in changes)


def changes_of(settings: Settings, base: Settings) -> Iterator[tuple[str, Field[Any], Any]]:
    """Stage, setting and value of everything that differs from `base`."""
    for stage, setting in every_setting():
        new, old = (getattr(getattr(s, stage), setting.name) for s in (settings, base))
        if new != old:
            yield stage, setting, new
