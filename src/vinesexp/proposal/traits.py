"""What a signal does, relative to the others of its file: how rough, how steady, how loud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vinesexp.proposal.survey import ColumnView, FileView
from vinesexp.records.readers import Floats


@dataclass(frozen=True)
class Traits:
    """What a signal does, relative to the others of its file.

    Parameters
    ----------
    rough : float
        Strength between 3 and 30 times the common frequency over that at it.
    steady : float
        Variation of the amplitude along the record: 0 for a steady motion.
    quiet : bool
        No motion stands out of the noise at the common frequency.
    """

    rough: float
    steady: float
    quiet: bool


def traits_of(file: FileView, column: ColumnView) -> Traits:
    """What a signal does, about the frequency that moves most of the file's signals."""
    common = common_frequency(file)
    frequencies, amplitudes = column.spectrum()
    if common <= 0.0 or len(amplitudes) < 8:
        return Traits(0.0, 0.0, True)
    near = (frequencies > 0.7 * common) & (frequencies < 1.4 * common)
    above = (frequencies > 3.0 * common) & (frequencies < 30.0 * common)
    strong = float(np.sqrt(np.sum(amplitudes[near] ** 2)))
    high = float(np.sqrt(np.sum(amplitudes[above] ** 2)))
    floor = float(np.median(amplitudes))
    quiet = not near.any() or float(amplitudes[near].max()) < 20.0 * floor
    return Traits(high / strong if strong > 0.0 else 0.0, _unsteadiness(column.finite), quiet)


def common_frequency(file: FileView) -> float:
    """Frequency of the strongest motion that most signals of a file share, Hz."""
    peaks = [column.peak()[0] for column in file.signals]
    return float(np.median(peaks)) if peaks else 0.0


def envelope(values: Floats, pieces: int = 24) -> Floats:
    """Rms of equal pieces of a signal about its mean."""
    x = values - values.mean()
    return np.array([float(np.sqrt(np.mean(part**2))) for part in np.array_split(x, pieces)])


def _unsteadiness(values: Floats) -> float:
    if len(values) < 200:
        return 0.0
    levels = envelope(values)
    mean = float(levels.mean())
    return float(levels.std()) / mean if mean > 0.0 else 0.0
