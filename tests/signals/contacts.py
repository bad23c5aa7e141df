"""Contacts and slopes of signals that are held in memory."""

from __future__ import annotations

import numpy as np
from benchmarks.streams import stream_of

from vinesexp.arrays import BoolArray, FloatArray
from vinesexp.settings.stages import ImpactSettings
from vinesexp.signals.impacts.detection import Detection, detect_by_template
from vinesexp.signals.impacts.slopes import POINTS, Coarse
from vinesexp.signals.means import block_means, group_size


def detect_contacts(
    a: FloatArray, rate: float, *, highpass: float | None, clipped: BoolArray | None = None,
    settings: ImpactSettings | None = None,
) -> Detection:  # fmt: skip
    """Every contact in an acceleration."""
    stream = stream_of(a, rate, highpass=highpass, clipped=clipped)
    return detect_by_template(stream, settings or ImpactSettings())


def coarsen(x: FloatArray, rate: float, frequency: float) -> Coarse:
    """Means of the displacement over as many samples as the frequency (Hz) allows."""
    k = group_size(rate, frequency, points=POINTS)
    return Coarse(block_means(x, k), k / rate, 0.5 * (k - 1) / rate)


def struck(
    t: FloatArray, times: FloatArray, jumps: FloatArray, *, w: float, alpha: float = 0.0
) -> FloatArray:
    """Displacement of an oscillator that is struck at sorted `times`, by jumps of its velocity.

    It turns with `w` and decays with `alpha` (1/s). All who have struck before add up to one decay.
    """
    turn = -alpha + 1j * w
    so_far = np.append(0.0, np.cumsum(jumps * np.exp(-turn * times)))
    found: FloatArray = (so_far[np.searchsorted(times, t)] * np.exp(turn * t)).imag / w
    return found
