"""The detectors of the package on records of the benchmark, filtered as a campaign's are."""

from __future__ import annotations

import math

import numpy as np
from benchmarks.detection_scenes import FloatArray, Record
from benchmarks.streams import stream_of

from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.condition import continued_line
from vinesexp.signals.filters import butterworth, settling_samples, zero_phase_blocks
from vinesexp.signals.impacts.detectors import detect

LOW = 157.24  # Hz: twenty times the oscillator's frequency, as `signals.condition` takes it


def highpassed(record: Record) -> tuple[FloatArray, float]:
    """The acceleration as `signals.condition` filters it, and the corner."""
    rate = record.scene.rate
    low = min(LOW, 0.04 * rate)
    band = butterworth(rate, low=low, high=None)
    assert band is not None
    pad, length = settling_samples(band, remains=1e-5), max(8, math.ceil(0.01 * rate))
    before = continued_line(record.a[:length][::-1], pad, length=length)[::-1]
    after = continued_line(record.a[-length:], pad, length=length)
    filtered = zero_phase_blocks([record.a], band, before=before, after=after)
    return np.concatenate(list(filtered)), low


def found_by(record: Record, settings: ImpactSettings) -> FloatArray:
    """Times of the impacts that the detector of the settings finds."""
    a, low = highpassed(record)
    clipped = record.clipped if record.clipped.any() else None
    stream = stream_of(a, record.scene.rate, highpass=low, clipped=clipped)
    return detect(stream, settings).time
