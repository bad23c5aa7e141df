"""A sweep described over its frequency: bands of permanent, modulated and inactive response.

A ball that keeps two impacts per cycle over many cycles is permanent there; shorter spells that
follow one another are modulated response; elsewhere the ball hits when it happens to, and takes
little. Each ball has bands of its own. Edges are those of this sweep: one that goes the other way,
or faster, has others.

Frequency of a sweep over time, counted in cycles of the base.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.stored.store import RecordView
from vinesexp.settings.stages import RegimeSettings
from vinesexp.signals.balls import Series
from vinesexp.theory.regime_definitions import activation_spells

PERMANENT, MODULATED, INACTIVE = "permanent", "modulated", "inactive"


_BLOCK = 1 << 20  # samples read at once


_SPAN = 16  # cycles that a frequency is the mean of


_APART = 0.5  # of a period: crossings closer than this are noise


@dataclass(frozen=True)
class Swept:
    """Cycles of the base, each at its time.

    Attributes
    ----------
    time : upward zero crossings, s on the record's axis: one a cycle.
    """

    time: FloatArray

    @property
    def cycles(self) -> int:
        """How many whole cycles there are."""
        return max(self.time.size - 1, 0)

    def count(self, time: FloatArray) -> FloatArray:
        """Cycles of the base since its first crossing, at each time."""
        return np.interp(time, self.time, np.arange(self.time.size, dtype=np.float64))

    def at(self, cycle: FloatArray) -> FloatArray:
        """Time of each cycle, s."""
        return np.interp(cycle, np.arange(self.time.size, dtype=np.float64), self.time)

    def frequency(self, cycle: FloatArray) -> FloatArray:
        """Frequency (Hz) at each cycle, a mean over 16 of them.

        Examples
        --------
        >>> t = np.arange(200) / 8.0
        >>> Swept(t).frequency(np.array([50.0, 120.0]))
        array([8., 8.])
        """
        span = min(_SPAN, max(self.cycles, 1))
        middle = np.arange(self.time.size - span) + 0.5 * span
        mean = span / (self.time[span:] - self.time[:-span])
        return np.interp(cycle, middle, mean)


def swept(view: RecordView, frequency: float) -> Swept | None:
    """Cycles of a conditioned sweep, from its base or, without one, from the mass.

    Returns
    -------
    Swept or None
        None where fewer than 32 cycles are seen.
    """
    role = "base" if "base" in view.roles else "displacement"
    times: list[FloatArray] = []
    for begin in range(0, view.n - 1, _BLOCK):
        x = view.read(role, begin, min(begin + _BLOCK + 1, view.n))
        up = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
        times.append((begin + up + x[up] / (x[up] - x[up + 1])) / view.sample_rate)
    found = view.start + np.concatenate(times) if times else np.empty(0)
    if found.size > 1:
        found = found[np.concatenate([[True], np.diff(found) > _APART / frequency])]
    return Swept(found) if found.size > 2 * _SPAN else None


@dataclass(frozen=True)
class Band:
    """One band: its response, first and last cycle, and how many spells it holds."""

    response: str
    begin: float
    end: float
    spells: int


def bands_of(spells: FloatArray, cycles: float, *, permanent: float, gap: float) -> list[Band]:
    """Bands from the spells of two impacts per cycle, all counted in cycles.

    Parameters
    ----------
    spells : ndarray, shape (n, 2)
        First and last cycle of each (`theory.regime_definitions.activation_spells`).
    cycles : float
        Of the whole sweep.
    permanent, gap : float
        Cycles that a permanent spell lasts; that spells of one modulated band may lie apart.

    Examples
    --------
    >>> spells = np.array([[100.0, 110.0], [120.0, 130.0], [140.0, 300.0], [500.0, 503.0]])
    >>> bands = bands_of(spells, 600.0, permanent=40, gap=40)
    >>> [(one.response, one.end) for one in bands]
    [('inactive', 100.0), ('modulated', 140.0), ('permanent', 300.0), ('inactive', 600.0)]
    """
    active: list[Band] = []
    for begin, end in spells:
        if end - begin >= permanent:
            active.append(Band(PERMANENT, float(begin), float(end), 1))
        elif active and active[-1].response == MODULATED and begin - active[-1].end <= gap:
            last = active[-1]
            active[-1] = Band(MODULATED, last.begin, float(end), last.spells + 1)
        else:
            active.append(Band(MODULATED, float(begin), float(end), 1))
    # a spell alone is chance: what is modulated comes back
    active = [one for one in active if one.response == PERMANENT or one.spells > 1]
    found: list[Band] = []
    at = 0.0
    for one in active:
        touching = bool(found) and one.begin - at <= gap
        if touching and one.response == PERMANENT != found[-1].response:
            last = found[-1]
            found[-1] = Band(last.response, last.begin, one.begin, last.spells)
        elif touching and one.response == MODULATED:
            one = Band(MODULATED, at, one.end, one.spells)
        elif one.begin > at:
            found.append(Band(INACTIVE, at, one.begin, 0))
        found.append(one)
        at = one.end
    if cycles > at:
        found.append(Band(INACTIVE, at, cycles, 0))
    return found


def band_rows(
    record: str,
    series: Sequence[Series],
    base: Swept,
    decay: tuple[FloatArray, FloatArray],
    settings: RegimeSettings,
) -> list[dict[str, str | float | None]]:
    """Rows of bands.csv: every band of every ball of one sweep.

    Parameters
    ----------
    record : str
        Its id.
    series : sequence of Series
        Impacts, ball by ball.
    base : Swept
    decay : (time, amplitude)
        Cycle by cycle; s on the record's axis, m.
    settings : RegimeSettings
    """
    rows: list[dict[str, str | float | None]] = []
    time, amplitude = decay
    for one in series:
        spells = activation_spells(base.count(one.time), one.side, period=1.0)
        for band in bands_of(
            spells,
            float(base.cycles),
            permanent=settings.permanent_cycles,
            gap=settings.modulation_gap,
        ):
            ends = np.array([band.begin, band.end])
            (begin, end), (low, high) = base.at(ends), base.frequency(ends)
            inside = amplitude[(time >= begin) & (time <= end)]
            rows.append(
                {
                    "record": record,
                    "nes": one.ball,
                    "response": band.response,
                    "from_hz": float(low),
                    "to_hz": float(high),
                    "from_s": float(begin),
                    "to_s": float(end),
                    "spells": band.spells,
                    "impacts_per_cycle": float(((one.time >= begin) & (one.time <= end)).sum())
                    / (band.end - band.begin),
                    "amplitude_mean_m": float(inside.mean()) if inside.size else None,
                    "amplitude_max_m": float(inside.max()) if inside.size else None,
                }
            )
    return rows


def largest_running_mean(
    base: Swept, decay: tuple[FloatArray, FloatArray], *, width: float
) -> float | None:
    """Largest mean of the amplitude over a window of `width` Hz, m; None for a shorter sweep.

    Modulated response swings within a frequency that a reader sees as one point of a curve: its
    running mean is what a response curve drawn by hand or by slow averaging shows.
    """
    time, amplitude = decay
    f = base.frequency(base.count(time))
    if f.size < 2 or abs(f[-1] - f[0]) < width:
        return None
    samples = max(round(width * (f.size - 1) / abs(float(f[-1] - f[0]))), 1)
    means = np.convolve(amplitude, np.ones(samples) / samples, mode="valid")
    return float(means.max()) if means.size else None
