"""Detectors of impacts by name: the learnt template, and the usual ways beside it.

A detector takes a stream, the settings, and the oscillator's frequency where it is known, and
gives a `Detection`. `settings: impacts: detector:` in campaign.yaml chooses one, or names a
function of the user's own: ``module:function``, or an entry point of the group
``vinesexp.detectors`` (docs/how-to/detector.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import entry_points
from typing import Protocol, cast

from vinesexp.errors import ParameterError
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.impacts.detection import Detection, detect_by_template
from vinesexp.signals.impacts.fixed_contact import (
    Find,
    detect_by_average_ratio,
    detect_by_function,
    detect_by_matched_filter,
    detect_by_peaks,
)
from vinesexp.signals.impacts.stream import Stream


class Detector(Protocol):
    """Finds the impacts in an acceleration."""

    def __call__(
        self, stream: Stream, settings: ImpactSettings, *, frequency: float | None = None
    ) -> Detection: ...


#: By the names that `vinesexp.settings.stages.DETECTORS` allows.
BY_NAME: Mapping[str, Detector] = {
    "template": detect_by_template,
    "find_peaks": detect_by_peaks,
    "sta_lta": detect_by_average_ratio,
    "matched_filter": detect_by_matched_filter,
}


def detect(
    stream: Stream, settings: ImpactSettings, *, frequency: float | None = None
) -> Detection:
    """What the detector of the settings finds.

    Raises
    ------
    ParameterError
        There is no such function.
    """
    if settings.detector in BY_NAME:
        return BY_NAME[settings.detector](stream, settings, frequency=frequency)
    own = _imported(settings.detector)
    return detect_by_function(own, stream, settings, frequency=frequency)


#: Functions that were handed over in this process, by the name that the settings have.
_HANDED_OVER: dict[str, Find] = {}


def hand_over(find: Find) -> str:
    """A name under which `detect` finds a function, for `vinesexp.analyse`."""
    name = f"{find.__module__}:{getattr(find, '__name__', 'function').strip('<>')}"
    _HANDED_OVER[name] = find
    return name


def _imported(name: str) -> Find:
    if name in _HANDED_OVER:
        return _HANDED_OVER[name]
    try:
        for point in entry_points(group="vinesexp.detectors", name=name):
            return cast(Find, point.load())
        module, _, function = name.partition(":")
        return cast(Find, getattr(import_module(module), function))
    except (ImportError, AttributeError, ValueError) as error:
        raise ParameterError(
            f"detector {name} cannot be imported ({error}); install its package in the environment "
            "that runs vinesexp, or add its folder to PYTHONPATH",
            where="impacts.detector",
        ) from None
