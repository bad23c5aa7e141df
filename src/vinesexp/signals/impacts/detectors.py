"""Detectors of impacts by name: the learnt template, and the usual ways beside it.

A detector takes a stream, the settings, and the oscillator's frequency where it is known, and
gives a `Detection`. `settings: impacts: detector:` in campaign.yaml chooses one.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.impacts.detection import Detection, detect_by_template
from vinesexp.signals.impacts.fixed_contact import (
    detect_by_average_ratio,
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
    """What the detector of the settings finds."""
    return BY_NAME[settings.detector](stream, settings, frequency=frequency)
