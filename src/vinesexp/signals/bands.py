"""Which band each channel of a record keeps: those that its oscillation and its impacts fill."""

from __future__ import annotations

import math
from dataclasses import dataclass

from vinesexp.errors import AnalysisError
from vinesexp.records.store import RecordView
from vinesexp.settings.stages import FilterSettings
from vinesexp.signals.frequency import dominant_frequency
from vinesexp.signals.means import channel_means

Band = tuple[float | None, float | None]

_SPECTRUM = 1 << 19  # points that the oscillator's frequency is looked for in
_LOOKED_AT = ("displacement", "acceleration", "base")
_TOP = 0.475  # of the sample rate: a corner above does nothing but harm
_PERIODS = 3.0  # of the slowest thing that a record without an oscillation keeps


@dataclass(frozen=True)
class Bands:
    """What each channel keeps, and the frequency it follows (None: no oscillation found), Hz."""

    frequency: float | None
    displacement: Band
    acceleration: Band

    def of(self, role: str) -> Band:
        """Of a channel, by its role."""
        return self.acceleration if role == "acceleration" else self.displacement


def default_bands(
    *,
    sample_rate: float,
    frequency: float | None,
    bandpass: tuple[float, float] | None = None,
    duration: float = math.inf,
    settings: FilterSettings | None = None,
    drop: bool = False,
) -> Bands:
    """Bands that follow the oscillator.

    Displacement: a quarter to five times its frequency, or what the user says; nothing beyond the
    Nyquist frequency. Acceleration: everything above twenty times its frequency, but never less
    than the upper 23 of 25 parts of what the sample rate holds; without an oscillation everything
    that three periods fit into. A drop test (`drop`): everything above hum and handling, of every
    channel. `settings` holds these numbers.

    Examples
    --------
    >>> default_bands(sample_rate=1e4, frequency=8.0)
    Bands(frequency=8.0, displacement=(2.0, 40.0), acceleration=(160.0, None))
    >>> default_bands(sample_rate=1e4, frequency=None, duration=1.5).acceleration
    (2.0, None)
    >>> default_bands(sample_rate=50.0, frequency=8.0).displacement
    (2.0, None)
    """
    numbers = FilterSettings() if settings is None else settings
    if drop:
        low = min(numbers.drop_low, numbers.impacts_low_most * sample_rate)
        return Bands(None, (low or None, None), (low or None, None))
    if frequency is None:
        slow = min(max(_PERIODS / duration, numbers.slowest), 0.01 * sample_rate)
        return Bands(None, bandpass or (None, None), (slow or None, None))
    low = max(numbers.motion_low * frequency, 0.5 / duration)
    high = numbers.motion_high * frequency
    motion = (
        min(low, 0.5 * frequency) or None,
        high if high < _TOP * sample_rate else None,
    )
    impacts = min(numbers.impacts_low * frequency, numbers.impacts_low_most * sample_rate)
    return Bands(frequency, bandpass or motion, (impacts, None))


def oscillation_of(record: RecordView) -> float | None:
    """Frequency (Hz) of the oscillator in a record; None where nothing oscillates.

    Of the displacement, else of the acceleration, else of the base: one channel suffices, if it is
    said to be of a rig that oscillates. A drop test has no oscillation: what is heard is the
    ringing of the wall.
    """
    test = record.attributes.get("test")
    if test == "drop":
        return None
    k = max(1, record.n // _SPECTRUM)
    looked_at = _LOOKED_AT if test else _LOOKED_AT[:1]
    for role in (role for role in looked_at if role in record.roles):
        means = channel_means(record, role, k)
        try:
            return dominant_frequency(means, record.sample_rate / k, quantity=record.quantity(role))
        except AnalysisError:
            continue
    return None
