"""What a signal does, relative to the others of its file: how rough, how steady, how loud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.proposal.survey import ColumnView, FileView

_CYCLES = 3  # in a record of an oscillation
_DOUBLED = 0.06  # by which a frequency may be off twice another
_SEGMENTS = 6  # of a record, over which coherence is taken
_COHERENT = 0.9
_SKIRT = 3  # Fourier lines that drift and window fill
_FEWEST = 6  # lines that show how a ratio goes with frequency
_APART = 1.5  # times the lowest of them that the highest is
_SLOPE, _TURN = 0.5, 0.15  # by which power, and phase in half turns, may be off
_LONG, _BRIEF = 200, 50  # samples that show a pulse; its share of a record is one over this
_HOLDS, _ONE_WAY = 0.9, 0.5  # of the power that is in it; how much more of it is on one side


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
    doubled : bool
        It moves at twice the common frequency: the other coordinate of a swing.
    """

    rough: float
    steady: float
    quiet: bool
    doubled: bool = False


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
    rough = high / strong if strong > 0.0 else 0.0
    doubled = abs(column.peak()[0] / common - 2.0) < _DOUBLED
    return Traits(rough, _unsteadiness(column.finite), quiet, doubled)


@dataclass(frozen=True)
class Derivative:
    """How one channel follows another over the frequencies that both show.

    Parameters
    ----------
    power : float
        Of the frequency by which their ratio grows: 2 for acceleration over displacement.
    phase : float
        Of the ratio, rad.
    low, high : float
        The frequencies, Hz (cycles a sample without a rate).
    """

    power: float
    phase: float
    low: float
    high: float

    @property
    def is_second(self) -> bool:
        """Whether it is -w^2 times the other, of either sign of a sensor."""
        turned = abs(abs(np.angle(np.exp(1j * self.phase))) / np.pi)
        return abs(self.power - 2.0) < _SLOPE and min(turned, 1.0 - turned) < _TURN


def derivative_of(first: ColumnView, other: ColumnView) -> Derivative | None:
    """The law by which `first` follows `other`; None where too little of both is coherent.

    One line alone tells nothing of the power: frequencies that stand apart by half are asked for.
    """
    from scipy import signal

    n = min(len(first.values), len(other.values))
    a, x = (np.nan_to_num(one.values[:n] - np.nanmean(one.values[:n])) for one in (first, other))
    size = min(max(n // _SEGMENTS, 64), 1 << 14)
    if n < 2 * size:
        return None
    rate = float(first.rate or 1.0)
    options = {"fs": rate, "nperseg": size, "window": "hann"}
    f, across = signal.csd(x, a, **options)
    with np.errstate(divide="ignore", invalid="ignore"):
        own_x, own_a = signal.welch(x, **options)[1], signal.welch(a, **options)[1]
        coherent = np.abs(across) ** 2 / (own_x * own_a) > _COHERENT
    coherent[:_SKIRT] = False
    chosen = np.flatnonzero(coherent)
    if len(chosen) < _FEWEST or f[chosen[-1]] < _APART * f[chosen[0]]:
        return None
    ratio = across[chosen] / own_x[chosen]
    slope = np.polyfit(np.log(f[chosen]), np.log(np.abs(ratio)), 1)[0]
    mean = np.angle(np.sum(ratio / np.abs(ratio)))
    return Derivative(float(slope), float(mean), float(f[chosen[0]]), float(f[chosen[-1]]))


def is_pulse(column: ColumnView) -> bool:
    """Whether a channel rests but for moments, as the force of a hammer does.

    Examples
    --------
    >>> t = np.arange(4000.0)
    >>> hit = 250.0 * np.exp(-(((t - 300.0) / 4.0) ** 2)) + 0.1 * np.sin(t)
    >>> is_pulse(ColumnView(0, "", None, "signal", hit, None))
    True
    >>> is_pulse(ColumnView(0, "", None, "signal", np.exp(-t / 500.0) * np.cos(t), None))
    False
    """
    x = column.finite - np.median(column.finite)
    if len(x) < _LONG:
        return False
    power = np.sort(x**2)[::-1]
    brief = power[: max(len(x) // _BRIEF, 3)].sum()
    one_way = abs(float(x.max() + x.min())) > _ONE_WAY * float(np.ptp(x))
    at_rest = int(np.argmax(np.abs(x))) > len(x) // _LONG  # what falls from its start is no blow
    return bool(brief > _HOLDS * power.sum() and one_way and at_rest)


def duration(column: ColumnView) -> int:
    """Samples that hold nine tenths of a signal's power."""
    x = column.finite - np.median(column.finite)
    power = np.cumsum(np.sort(x**2)[::-1])
    return int(np.searchsorted(power, _HOLDS * power[-1])) + 1 if len(power) else 0


def common_frequency(file: FileView) -> float:
    """Frequency of the strongest motion that most signals of a file share, Hz."""
    peaks = sorted(column.peak()[0] for column in file.signals)
    return peaks[(len(peaks) - 1) // 2] if peaks else 0.0  # of two that differ, the lower


def envelope(values: FloatArray, pieces: int = 24) -> FloatArray:
    """Rms of equal pieces of a signal about its mean; of every sample where there are fewer."""
    x, pieces = values - values.mean(), min(pieces, len(values))
    return np.array([float(np.sqrt(np.mean(part**2))) for part in np.array_split(x, pieces)])


def _unsteadiness(values: FloatArray) -> float:
    if len(values) < 200:
        return 0.0
    levels = envelope(values)
    mean = float(levels.mean())
    return float(levels.std()) / mean if mean > 0.0 else 0.0


def stands_out(column: ColumnView) -> bool:
    """Whether one oscillation of some cycles stands out of all else in a signal."""
    _, amplitudes = column.spectrum()
    if len(amplitudes) < 8:
        return False
    if int(np.argmax(amplitudes[1:])) + 1 < _CYCLES:
        return False  # a slope, not an oscillation
    return float(amplitudes[1:].max()) > 40.0 * float(np.median(amplitudes))
