"""What measured and replayed motion are compared by: the same functions for both."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.replay.motions import Replayed
from vinesexp.signals.means import cycle_amplitudes, time_to_level
from vinesexp.signals.steady_part import steady_part
from vinesexp.theory.regime_definitions import BY_FREQUENCY, activation_spells, regime_of

_POINTS = 40  # a cycle: a swing is known to 0.3 %
_SETTLING = 0.2  # of a periodic record, left out as in regimes.csv
_FIRST_CYCLES = 12  # of a release: what it starts with, as in regimes.csv
_STEADY = 0.05  # standard deviation of the amplitude over its mean
_FALLEN = 0.25  # of the first cycle: the decay time is until here


@dataclass(frozen=True)
class Measures:
    """Numbers of one stretch of a replay; NaN and empty where a test has none.

    Attributes
    ----------
    start : of the replay.
    amplitude, largest : mean and largest half swing of a cycle, m.
    impacts_per_cycle, regime, spells : as in regimes.csv.
    decay_time : s until the amplitude stays below a quarter of that of the first cycle.
    cycles : time from the beginning (s) and half swing (m) of each cycle.
    steady : whether the amplitude stays the same from cycle to cycle (`is_steady`).
    """

    start: str
    amplitude: float
    impacts_per_cycle: float
    regime: str
    spells: float
    decay_time: float
    cycles: tuple[FloatArray, FloatArray]
    largest: float = math.nan
    steady: bool = True


def is_steady(time: FloatArray, amplitude: FloatArray, length: float) -> bool:
    """Whether amplitudes of cycles scatter by less than a twentieth, after the first fifth.

    Examples
    --------
    >>> t = np.arange(100.0)
    >>> is_steady(t, np.ones(100), 100.0), is_steady(t, 1.0 + 0.3 * np.sin(t), 100.0)
    (True, False)
    """
    judged = amplitude[time >= _SETTLING * length]
    return judged.size < 2 or float(judged.std()) < _STEADY * float(judged.mean())


def decay_time(time: FloatArray, amplitude: FloatArray) -> float:
    """When the amplitude has fallen to a quarter of that of its largest cycle, s from there.

    Examples
    --------
    >>> t = np.arange(100) / 10.0
    >>> bool(abs(decay_time(t, np.exp(-t)) - np.log(4.0)) < 0.01)
    True
    """
    if amplitude.size < 2:
        return float("nan")
    first = int(np.argmax(amplitude))
    level = _FALLEN * float(amplitude[first])
    return time_to_level(time[first:], amplitude[first:], level) - float(time[first])


def measures_of(
    replayed: Replayed, *, test: str, frequency: float, apart: bool = True
) -> list[Measures]:
    """The numbers of one replay, of each stretch of it that is as long as the record.

    Parameters
    ----------
    replayed : Replayed
    test : str
    frequency : float
        By which cycles are counted, Hz: that of the record.
    apart : bool
        Whether each ball has a regime of its own; else all impacts are judged together, as in a
        record whose impacts could not be attributed.
    """
    return [_of_stretch(replayed, begin, test, frequency, apart) for begin in replayed.begins]


def _of_stretch(
    replayed: Replayed, begin: float, test: str, frequency: float, apart: bool
) -> Measures:
    rate = _POINTS * frequency
    n = int(replayed.length * rate)
    x, _ = replayed.motion.at(begin + np.arange(n) / rate)
    time, amplitude = cycle_amplitudes(x, rate, frequency)
    settling = _SETTLING * replayed.length if test == "periodic" else 0.0
    steady = amplitude[time >= settling]
    if test == "periodic" and steady.size and (first := steady_part(steady).first):
        settling = float(time[time >= settling][first]) - 0.5 / frequency
        steady = steady[first:]
    mean = float(steady.mean()) if steady.size else float("nan")
    driven = test in ("periodic", "sweep")
    fallen = float("nan") if driven else decay_time(time, amplitude)
    largest = float(steady.max()) if steady.size else float("nan")
    per_cycle, regime, spells = float("nan"), "", float("nan")
    if replayed.motion.rig.nes:
        end = replayed.length
        if test == "transient":
            end = min(_FIRST_CYCLES / frequency, end)
        stretch = begin + settling, begin + end
        per_cycle, regime = _regime(replayed, stretch, 1.0 / frequency, apart, test)
        spells = _spells(replayed, begin, 1.0 / frequency)
    cycles = time, amplitude
    still = is_steady(time, amplitude, replayed.length)
    return Measures(replayed.start, mean, per_cycle, regime, spells, fallen, cycles, largest, still)


def _regime(
    replayed: Replayed, stretch: tuple[float, float], period: float, apart: bool, test: str
) -> tuple[float, str]:
    """Impacts per cycle of all balls together, and the regime of each."""
    start, end = stretch
    if end - start < period:
        return float("nan"), ""
    hits = replayed.motion.impacts
    balls = range(len(replayed.motion.rig.nes))
    chosen = [hits["nes"] == ball for ball in balls] if apart else [hits["nes"] >= 0]
    counts = [
        regime_of(
            *(hits["time"][own], hits["side"][own]),
            period=period, start=start, end=end, decaying=test == "transient",
        )
        for own in chosen
    ]  # fmt: skip
    words = " | ".join(count.regime.value for count in counts)
    words = BY_FREQUENCY if test == "sweep" else words
    return sum(count.impacts_per_cycle for count in counts), words


def _spells(replayed: Replayed, begin: float, period: float) -> float:
    """Number of activation spells of a single ball in a stretch; NaN for several."""
    if len(replayed.motion.rig.nes) != 1:
        return float("nan")
    hits = replayed.motion.impacts
    inside = (hits["time"] >= begin) & (hits["time"] <= begin + replayed.length)
    return float(len(activation_spells(hits["time"][inside], hits["side"][inside], period=period)))
