"""The regime of a record, by the definitions that theory and simulation use, and its amplitudes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vinesexp.records.campaign import Record
from vinesexp.records.store import RecordView, open_record
from vinesexp.signals.cycles import cycle_amplitudes, time_to_level
from vinesexp.signals.impacts import Impacts
from vinesexp.theory.regimes import regime_of

Floats = NDArray[np.float64]

#: Levels of a release that times are told for, as shares of the release.
LEVELS = (0.5, 0.25, 0.15, 0.1)

_SETTLING = 0.2  # of a periodic record, left out: the start is not yet the response
_FIRST_CYCLES = 12  # of a release: what it starts with
_MOST = 60_000_000  # samples

Row = Mapping[str, str | float | None]


def regime_of_record(
    record: Record, *, measured: Path, conditioned: Path, impacts: Impacts
) -> dict[str, str | float | None]:
    """One row of regimes.csv.

    Parameters
    ----------
    record : Record
    measured, conditioned : Path
        records/<id>.nc and conditioned/<id>.nc.
    impacts : Impacts
        Of the record.

    Returns
    -------
    dict
        ``record``, ``regime``, ``impacts_per_cycle``, ``amplitude_mean_m``, ``amplitude_max_m``,
        ``captured`` (share of cycles with one impact on either side), and for a release
        ``time_to_<level>mm_s`` and ``captured_until_s``. None where it cannot be told.
    """
    row: dict[str, str | float | None] = {
        "record": record.id,
        "regime": None,
        "impacts_per_cycle": None,
        "amplitude_mean_m": None,
        "amplitude_max_m": None,
        "captured": None,
    }
    with open_record(conditioned) as view:
        frequency = view.attributes.get("oscillation_hz")
        if view.refused is not None or "displacement" not in view.roles or not frequency:
            return row
        time, amplitude = _amplitudes(view, float(frequency))
        length = view.n / view.sample_rate
        start = view.start
    if amplitude.size == 0:
        return row
    begin = _SETTLING * length if record.test == "periodic" else 0.0
    steady = amplitude[time >= begin]
    row["amplitude_mean_m"] = float(steady.mean())
    row["amplitude_max_m"] = float(steady.max())
    if record.clearance:
        end = length
        if record.test == "transient":
            end = min(_FIRST_CYCLES / float(frequency), length)
        row |= _regimes(
            record, impacts, period=1.0 / float(frequency), begin=start + begin, end=start + end
        )
    if record.test == "transient" and record.release:
        for share in LEVELS:
            level = share * record.release
            reached = time_to_level(time, amplitude, level)
            name = f"time_to_{1e3 * level:.4g}mm_s"
            row[name] = reached if math.isfinite(reached) else None
        row["captured_until_s"] = _captured_until(impacts, 1.0 / float(frequency), start)
    return row


def _amplitudes(view: RecordView, frequency: float) -> tuple[Floats, Floats]:
    return cycle_amplitudes(view.read("displacement", 0, _MOST), view.sample_rate, frequency)


def _regimes(
    record: Record, impacts: Impacts, *, period: float, begin: float, end: float
) -> dict[str, str | float | None]:
    """Regime of each ball, and of all impacts together where the ball cannot be told."""
    if end - begin < period:
        return {}
    n = len(record.clearance)
    apart = n > 1 and bool(np.all(impacts.nes > 0))
    chosen = [impacts.nes == ball for ball in range(1, n + 1)] if apart else [impacts.nes >= 0]
    counts = [
        regime_of(impacts.time_s[mine], impacts.side[mine], period=period, start=begin, end=end)
        for mine in chosen
    ]
    return {
        "regime": " | ".join(count.regime.value for count in counts),
        "impacts_per_cycle": sum(count.impacts_per_cycle for count in counts),
        "captured": min(count.captured for count in counts),
    }


def _captured_until(impacts: Impacts, period: float, start: float) -> float | None:
    """End of the first unbroken spell of one impact on either side per cycle, s from the start."""
    t, side = impacts.time_s, impacts.side
    if t.size < 3:
        return None
    gap = np.diff(t)
    paired = (side[1:-1] != side[:-2]) & (side[2:] != side[1:-1])
    paired &= np.abs(gap[:-1] + gap[1:] - period) < 0.1 * period
    first = np.flatnonzero(paired)
    if first.size == 0:
        return None
    broken = np.flatnonzero(~paired[first[0] :])
    last = first[0] + int(broken[0]) if broken.size else paired.size
    return float(t[last] - start)
