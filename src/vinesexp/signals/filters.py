"""Zero-phase Butterworth filters in bounded memory.

A filter that runs forward and then backward shifts nothing in time: its response is |H|^2. That is
what is multiplied here, transform by transform of overlapping stretches, each with as much on
either side as the filter remembers. `scipy.signal.sosfiltfilt`, which needs the whole record, does
the same in time and is its test.

Each channel of a record keeps the band that its oscillation or its impacts fill (`default_bands`);
the one number that these follow is where the record oscillates (`oscillation_of`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.fft import next_fast_len

from vinesexp.arrays import ComplexArray, FloatArray, IntArray, usually_held
from vinesexp.errors import AnalysisError, ParameterError
from vinesexp.records.stored.store import RecordView
from vinesexp.settings.stages import FilterSettings
from vinesexp.signals.means import channel_means

Band = tuple[float | None, float | None]
_AS_BY_DEFAULT = FilterSettings()
SPECTRUM = 1 << 19  # points that the oscillator's frequency is looked for in
_LOOKED_AT = ("displacement", "acceleration", "base")
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
_REPEATED = 0.25  # of the power of a line: what it may repeat; steps add up to 2.5 times of it
#: Cycles of a window, and windows, in which impacts are looked for above so many times f0; what is
#: narrower than so many times f0 either side is a line; noise is up to so many times its least.
_CYCLES, _WINDOWS, _ABOVE_MOTION, _LONE, _AS_EVERYWHERE = 4.0, 100, 4.5, 2.5, 1.5
_TAPER = 0.35875, -0.48829, 0.14128, -0.01168  # Blackman and Harris: a steady motion ends beside it
_LOW_MOST = 0.2  # of the sample rate: a pulse needs what is above

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
    settings: FilterSettings = _AS_BY_DEFAULT,
    drop: bool = False,
    content: float = math.inf,
) -> Bands:
    """Bands that follow the oscillator.

    Displacement: a quarter to five times its frequency, or what the user says; nothing beyond the
    Nyquist frequency. Acceleration: everything above twenty times its frequency, or above 0.6
    of the frequency `content` below which half of what impacts leave lies, if this is less and more
    than seven times its frequency; but never less than the upper 23 of 25 parts of what the sample
    rate holds, unless these begin below three times its frequency; without an oscillation
    everything that three periods fit into. A drop test (`drop`): everything above hum and handling,
    of every channel. `settings` holds these numbers.

    Examples
    --------
    >>> default_bands(sample_rate=1e4, frequency=8.0)
    Bands(frequency=8.0, displacement=(2.0, 40.0), acceleration=(160.0, None))
    >>> default_bands(sample_rate=1e4, frequency=None, duration=1.5).acceleration
    (2.0, None)
    >>> default_bands(sample_rate=280.0, frequency=8.0).acceleration
    (24.0, None)
    >>> default_bands(sample_rate=1e4, frequency=16.0, content=450.0).acceleration
    (270.0, None)
    >>> default_bands(sample_rate=50.0, frequency=8.0).displacement
    (2.0, None)
    """
    if drop:
        low = min(settings.drop_low, settings.impacts_low_most * sample_rate)
        return Bands(None, (low or None, None), (low or None, None))
    if frequency is None:
        slow = min(max(_PERIODS / duration, settings.slowest), 0.01 * sample_rate)
        return Bands(None, bandpass or (None, None), (slow or None, None))
    low = max(settings.motion_low * frequency, 0.5 / duration)
    high = settings.motion_high * frequency
    held = high < 0.5 * _TOP * sample_rate
    motion = min(low, 0.5 * frequency) or None, high if held else None
    soft = max(settings.impacts_low_soft * frequency, settings.impacts_low_content * content)
    impacts = min(settings.impacts_low * frequency, soft, settings.impacts_low_most * sample_rate)
    # slow sampling: with less of the motion taken away it would be taken for impacts itself
    impacts = max(impacts, min(settings.impacts_low_least * frequency, _LOW_MOST * sample_rate))
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
    looked_at = _LOOKED_AT if test else _LOOKED_AT[:1]
    lines = (line_of(record, role) for role in looked_at if role in record.roles)
    return next((line for line in lines if line is not None), None)


def content_of_impacts(record: RecordView, frequency: float) -> float:
    """Frequency below which half of what impacts leave of the acceleration lies, Hz.

    Soft contacts end below a few hundred Hz, and a mount rings at its own frequency. Lines that
    stand alone (hum, a harmonic) do not count, and what is as everywhere is noise. Infinite where
    the test has no ball, or the acceleration shows nothing else.

    Parameters
    ----------
    record : RecordView
    frequency : float
        Of the oscillation, Hz.
    """
    from scipy.ndimage import median_filter  # half a second to import

    n = round(_CYCLES * record.sample_rate / frequency)
    if "acceleration" not in record.roles or "clearance_m" not in record.attributes:
        return math.inf
    starts = np.arange(0, record.n - n, max(n // 2, (record.n - n) // _WINDOWS))
    t = 2.0 * math.pi * np.arange(n) / n
    taper = sum(a * np.cos(k * t) for k, a in enumerate(_TAPER))
    windows = (record.read("acceleration", int(i), int(i) + n) for i in starts)
    spectra = [np.abs(np.fft.rfft((a - a.mean()) * taper)) ** 2 for a in windows if _known(a)]
    f = np.fft.rfftfreq(n, 1.0 / record.sample_rate)
    above = f > _ABOVE_MOTION * frequency
    if len(spectra) < _FEWEST or not above.any():
        return math.inf
    around = 2 * math.ceil(_LONE * _CYCLES) + 1
    power = median_filter(np.mean(spectra, axis=0), around, mode="nearest")[above]
    own = np.maximum(power - _AS_EVERYWHERE * float(np.quantile(power, 0.05)), 0.0).cumsum()
    return float(f[above][np.searchsorted(own, 0.5 * own[-1])]) if own[-1] else math.inf


def _known(x: FloatArray) -> bool:
    return bool(np.isfinite(x).all())


def line_of(record: RecordView, role: str) -> float | None:
    """Frequency (Hz) of the strongest oscillation of one channel; None where it shows none."""
    # the steps of a sensor of its own rate are no oscillation
    k = max(1, record.n // SPECTRUM, usually_held(record.read(role, 0, SPECTRUM)))
    means = channel_means(record, role, k)
    try:
        return dominant_frequency(means, record.sample_rate / k, quantity=record.quantity(role))
    except AnalysisError:
        return None


def dominant_frequency(
    x: FloatArray, sample_rate: float, *, quantity: str = "displacement"
) -> float:
    """Frequency of the strongest oscillation, drift and noise put aside.

    Of the lines of the Hann-windowed spectrum that stand out of the lines around them, the one with
    the largest velocity, or the lowest that has half as much: a sensor that holds its value repeats
    the motion with its velocity beside every multiple of its own rate. Drift is strong in
    displacement and weak in velocity; noise has no line that is much stronger than its neighbours.
    Good to a few hundredths of 1/duration; a place to start from, not an estimate of f0.

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
        raise AnalysisError("it shows no motion, so there is no oscillation to follow")
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
        raise AnalysisError("no oscillation is above its noise")
    here = np.log(velocity[max(peak - 1, 0) : peak + 2] + np.finfo(float).tiny)
    bend = here[0] - 2.0 * here[1] + here[2]
    shift = 0.5 * (here[0] - here[2]) / bend if bend < 0.0 else 0.0
    return float((peak + min(max(shift, -0.5), 0.5)) * sample_rate / size)


def _strongest_that_stands_out(
    power: FloatArray, velocity: FloatArray, first: int, last: int, *, lobe: float
) -> int | None:
    """Lowest of the strong local peaks that stand out; None where none does."""
    inner = np.arange(max(first, 1), min(last, power.size - 1))
    top = (velocity[inner] >= velocity[inner - 1]) & (velocity[inner] >= velocity[inner + 1])
    peaks = inner[top]

    def first_of(some: IntArray) -> int | None:
        for peak in some:
            if _stands_out(power[peak] / _STANDS_OUT, _around(power, int(peak), lobe)):
                return int(peak)
        return None

    found = first_of(peaks[np.argsort(-velocity[peaks], kind="stable")][:_TRIED])
    if found is None:
        return None
    return first_of(peaks[velocity[peaks] >= _REPEATED * velocity[found]])


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


#: What a filter remembers from farther away than one settling time, relative.
_SETTLED = 1e-10
#: Above this share of the Nyquist frequency an upper corner does nothing but harm.
_TOP = 0.95
_NOTHING = np.empty(0)
_SHORTEST = 1 << 17  # samples transformed at once, where the record has them


@dataclass(frozen=True)
class Butterworth:
    """A band with corners `low` and `high` in Hz (None: open on that side).

    What passes may be integrated twice (`twice`), which takes a lower corner: -1/w^2 has no phase.
    """

    sample_rate: float
    low: float | None
    high: float | None
    order: int = 2
    twice: bool = False

    def zpk(self) -> tuple[ComplexArray, ComplexArray, float]:
        """Zeros, poles and gain of one direction in the z plane."""
        from scipy.signal import butter  # half a second to import

        kind, corners = "bandpass", np.array([self.low or 0.0, self.high or 0.0])
        if not corners.all():
            kind, corners = "lowpass" if self.high else "highpass", corners.max()
        z, p, k = butter(self.order, corners, kind, output="zpk", fs=self.sample_rate)
        return z, p, float(k)

    def gain(self, n: int) -> FloatArray:
        """Response of both directions together at the Fourier frequencies of n samples.

        Examples
        --------
        >>> gain = Butterworth(100.0, low=10.0, high=None).gain(100)
        >>> round(float(gain[10]), 3), float(gain[0])  # the corner, and a constant
        (0.5, 0.0)
        """
        from scipy.signal import freqz_zpk

        w, answer = freqz_zpk(*self.zpk(), worN=2.0 * np.pi * np.arange(n // 2 + 1) / n)
        gain = np.abs(answer) ** 2
        if not self.twice:
            return np.asarray(gain)
        return np.append(0.0, -gain[1:] / (self.sample_rate * w[1:]) ** 2)


def butterworth(
    sample_rate: float, *, low: float | None, high: float | None, order: int = 2
) -> Butterworth | None:
    """A Butterworth band; None where nothing is to be filtered.

    Parameters
    ----------
    sample_rate : float
        Hz.
    low, high : float or None
        Corners (-3 dB; -6 dB after both directions), Hz; None: open on that side. An upper
        corner above 0.95 of the Nyquist frequency is left out.
    order : int
        Of each corner.

    Raises
    ------
    ParameterError
        A lower corner that is not below the upper one and below the Nyquist frequency.

    Examples
    --------
    >>> butterworth(1e4, low=2.0, high=40.0).order
    2
    >>> butterworth(1e4, low=None, high=6e3) is None
    True
    """
    nyquist = 0.5 * sample_rate
    if high is not None and high >= _TOP * nyquist:
        high = None
    ceiling = nyquist if high is None else high
    if low is not None and not 0.0 < low < ceiling:
        raise ParameterError(
            f"bandpass: lower corner {low:.6g} Hz, expected above 0 and below {ceiling:.6g} Hz "
            f"(sample rate {sample_rate:.6g} Hz)"
        )
    if low is None and high is None:
        return None
    return Butterworth(sample_rate, low, high, order)


def settling_samples(band: Butterworth, *, remains: float = _SETTLED) -> int:
    """Samples after which what the filter remembers has shrunk to `remains`.

    Examples
    --------
    >>> settling_samples(butterworth(1e4, low=2.0, high=None)) / 1e4 < 4.0
    True
    """
    poles = np.abs(band.zpk()[1])
    slowest = min(float(poles.max()), 1.0 - 1e-12)
    # Both directions meet: n p^n, and an octave of amplitude more for each pair of poles.
    target = math.log(remains) - math.ceil(poles.size / 2) * math.log(2.0) - 2.0
    return math.ceil(target / math.log(slowest))


def zero_phase_blocks(
    blocks: Iterable[FloatArray], band: Butterworth, *, before: FloatArray, after: FloatArray
) -> Iterator[FloatArray]:
    """Filter a record given by blocks, without phase.

    Parameters
    ----------
    blocks : iterable of arrays
        Consecutive stretches of the record.
    band : Butterworth
    before, after : arrays
        What is taken to lie before the first and after the last sample (`condition.continued_sine`,
        `condition.continued_line`); beyond that, the end value stands.

    Yields
    ------
    array
        Consecutive stretches of the filtered record, all in all as long as the blocks. Blocks
        need not be those of the input.
    """
    margin = settling_samples(band)
    size = 1 << (max(_SHORTEST, 3 * margin) - 1).bit_length()
    held, pending = np.empty(0), 0  # the margin before, then samples not yet given out
    for block in blocks:
        if not held.size:
            held = _stretched(before[::-1], block[0], margin)[::-1]
        held = np.concatenate([held, block])
        pending += block.size
        while pending >= size - margin:  # a margin of it is what comes after
            ready = size - 2 * margin
            yield _through(held[:size], _gain(band, size))[margin : margin + ready]
            held, pending = held[ready:], pending - ready
    if pending:
        whole = np.concatenate([held, _stretched(after, held[-1], margin)])
        n = next_fast_len(whole.size, real=True)
        padded = np.concatenate([whole, np.full(n - whole.size, whole[-1])])
        yield _through(padded, _gain(band, n))[margin : margin + pending]


@lru_cache(maxsize=2)  # channels of a record share it
def _gain(band: Butterworth, n: int) -> FloatArray:
    return band.gain(n)


def _through(x: FloatArray, gain: FloatArray) -> FloatArray:
    return np.fft.irfft(np.fft.rfft(x) * gain, x.size)


def _stretched(extension: FloatArray, value: float, length: int) -> FloatArray:
    """An extension behind a value, as long as the margin: its far end goes on."""
    known = np.append(value, extension[:length])
    return np.pad(known, (0, length + 1 - known.size), mode="edge")[1:]


def zero_phase(x: FloatArray, band: Butterworth | None) -> FloatArray:
    """Filter one array without phase, its end values standing beyond it (`zero_phase_blocks`).

    Examples
    --------
    >>> t = np.arange(4000) / 1e3
    >>> x = np.cos(2 * np.pi * 8.0 * t) + 3.0
    >>> y = zero_phase(x, butterworth(1e3, low=1.0, high=60.0))
    >>> bool(np.abs(y - (x - 3.0))[1500:2500].max() < 2e-3)
    True
    """
    if band is None or not x.size:
        return x.copy()
    return np.concatenate(list(zero_phase_blocks([x], band, before=_NOTHING, after=_NOTHING)))
