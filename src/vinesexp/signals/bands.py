"""Which band each channel of a record keeps: those that its oscillation and its impacts fill.

Where a record oscillates: the one number that the default bands follow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.fft import next_fast_len

from vinesexp.arrays import FloatArray
from vinesexp.errors import AnalysisError
from vinesexp.records.stored.store import RecordView
from vinesexp.settings.stages import FilterSettings
from vinesexp.signals.means import channel_means

Band = tuple[float | None, float | None]
_SPECTRUM = 1 << 19  # points that the oscillator's frequency is looked for in
_LOOKED_AT = ("displacement", "acceleration", "base")
_TOP = 0.475  # of the sample rate: a corner above does nothing but harm
_PERIODS = 3.0  # of the slowest thing that a record without an oscillation keeps

#: Power of a line over the median around it that noise does not reach: of a million lines of white
#: noise the largest is ln(1e6)/ln(2) = 20 medians high.
_STANDS_OUT = 60.0
_AROUND = 4.0  # a line is compared with those from a quarter to four times its frequency
_OWN = 1.3  # what lies closer than this factor may be the peak's own skirt
_LOBE = 3  # lines of the untapered spectrum that a Hann window smears one over
_FEWEST = 4  # lines that a median is taken of
_FINEST = 2.5  # samples a period: a peak closer to the Nyquist frequency may be an alias
_SHARE = 0.01  # of the velocity that the oscillation holds, in an acceleration
_TRIED = 2000  # peaks that are looked at, the strongest first

#: Power of the frequency that turns each quantity into velocity.
TO_VELOCITY = {"displacement": 1, "velocity": 0, "acceleration": -1}


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


def dominant_frequency(
    x: FloatArray, sample_rate: float, *, quantity: str = "displacement"
) -> float:
    """Frequency of the strongest oscillation, drift and noise put aside.

    Of the lines of the Hann-windowed spectrum that stand out of the lines around them, the one with
    the largest velocity. Drift is strong in displacement and weak in velocity; noise has no line
    that is much stronger than its neighbours. Good to a few hundredths of 1/duration; a place
    to start from, not an estimate of f0.

    Parameters
    ----------
    x : array
        Any unit.
    sample_rate : float
        Hz.
    quantity : str
        What x is, a key of `TO_VELOCITY`.

    Returns
    -------
    float
        Hz.

    Raises
    ------
    AnalysisError
        Fewer than 16 samples, nothing moves, or nothing stands out of the noise.

    Examples
    --------
    >>> t = np.arange(3000) / 100.0
    >>> x = 5.0 + 0.3 * t + np.cos(2 * np.pi * 1.226 * t)
    >>> abs(dominant_frequency(x, 100.0) - 1.226) < 0.003
    True
    """
    n = x.size
    if n < 16:
        raise AnalysisError(f"{n} samples, expected at least 16 to find an oscillation in")
    ramp = np.linspace(-1.0, 1.0, n)
    centred = x - x.mean()
    centred -= ramp * (centred @ ramp / (ramp @ ramp))
    if not np.any(np.abs(centred) > 1e-12 * np.abs(x).max()):
        raise AnalysisError("nothing moves in it; there is no oscillation to follow")
    size = next_fast_len(n, real=True)
    power = np.abs(np.fft.rfft(centred * np.hanning(n), size)) ** 2
    line = np.maximum(np.arange(power.size), 1)
    velocity = power * line.astype(np.float64) ** (2 * TO_VELOCITY[quantity])
    # Less than one and a half periods in the record is drift, not oscillation.
    first = min(math.ceil(1.5 * size / n), power.size - 2)
    last = min(power.size - 1, math.ceil(size / _FINEST))
    peak = _strongest_that_stands_out(power, velocity, first, last, lobe=_LOBE * size / n)
    if peak is not None and quantity != "displacement":
        band = slice(math.floor(0.9 * peak), math.ceil(1.1 * peak) + 1)
        if velocity[band].sum() < _SHARE * velocity[first:last].sum():
            peak = None  # a line of hum in a record of other things
    if peak is None:
        raise AnalysisError("no oscillation stands out of its noise")
    here = np.log(velocity[max(peak - 1, 0) : peak + 2] + np.finfo(float).tiny)
    bend = here[0] - 2.0 * here[1] + here[2]
    shift = 0.5 * (here[0] - here[2]) / bend if bend < 0.0 else 0.0
    return float((peak + min(max(shift, -0.5), 0.5)) * sample_rate / size)


def _strongest_that_stands_out(
    power: FloatArray, velocity: FloatArray, first: int, last: int, *, lobe: float
) -> int | None:
    """Line of largest velocity among the local peaks that stand out; None where none does."""
    inner = np.arange(max(first, 1), min(last, power.size - 1))
    top = (velocity[inner] >= velocity[inner - 1]) & (velocity[inner] >= velocity[inner + 1])
    peaks = inner[top]
    for peak in peaks[np.argsort(-velocity[peaks], kind="stable")][:_TRIED]:
        if _stands_out(power[peak] / _STANDS_OUT, _around(power, int(peak), lobe)):
            return int(peak)
    return None


def _stands_out(limit: float, sides: list[FloatArray]) -> bool:
    """Whether the median of every side lies below a limit, and there is a side.

    Where fewer than half of the lines do, which is quick to count, the median cannot.
    """
    if any(2 * np.count_nonzero(side <= limit) < side.size for side in sides):
        return False
    return bool(sides) and all(float(np.median(side)) < limit for side in sides)


def _around(power: FloatArray, peak: int, lobe: float) -> list[FloatArray]:
    """The lines below and above a peak, without its own skirt; sides of too few are left out."""
    skirt = max(lobe, (_OWN - 1.0) * peak)
    below = power[math.ceil(peak / _AROUND) : max(0, math.floor(peak - skirt))]
    above = power[math.ceil(peak + skirt) : math.ceil(_AROUND * peak + 4.0 * lobe)]
    return [side for side in (below, above) if side.size >= _FEWEST]
