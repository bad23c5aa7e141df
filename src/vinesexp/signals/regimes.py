"""The regime of a record, by the definitions that theory and simulation use, and its amplitudes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.records.campaign import Record
from vinesexp.records.store import RecordView, open_record
from vinesexp.signals.cycles import cycles_from, time_to_level
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.signals.transition import transition_of
from vinesexp.signals.visibility import could_be_seen
from vinesexp.theory.regime_definitions import activation_spells, regime_of

#: Amplitudes of a release that times are reported for, as shares of the release.
LEVELS = (0.5, 0.25, 0.15, 0.1)


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
        ``captured`` (share of cycles with one impact on either side), ``spells`` and
        ``spell_mean_s`` (of such cycles in a row), and for a release ``captured_until_s``,
        ``decay_rate_captured_1_s``, ``decay_rate_after_1_s`` and ``transition_m`` (amplitude where
        the ball is lost). None or absent where it cannot be known: a record that could not show
        impacts, for its noise or its sampling, has no regime.
    """
    row = unknown_regime(record)
    with open_record(conditioned) as view:
        frequency = view.attributes.get("oscillation_hz")
        if view.refused is not None or "displacement" not in view.roles or not frequency:
            return row
        time, amplitude = _amplitudes(view, float(frequency))
        length = view.n / view.sample_rate
        start = view.start
    if amplitude.size == 0:
        return row
    begin = record.settings.regimes.settling * length if record.test == "periodic" else 0.0
    steady = amplitude[time >= begin]
    row["amplitude_mean_m"] = float(steady.mean())
    row["amplitude_max_m"] = float(steady.max())
    if record.clearance and _seen(record, measured, conditioned, impacts, length * frequency):
        end = length
        if record.test == "transient":
            end = min(record.settings.regimes.first_cycles / float(frequency), length)
        row |= _regimes(
            record, impacts, period=1.0 / float(frequency), begin=start + begin, end=start + end
        )
        row |= _spells(record, impacts, 1.0 / float(frequency), start, (time, amplitude))
    return row


def _seen(
    record: Record, measured: Path, conditioned: Path, impacts: Impacts, cycles: float
) -> bool:
    """Whether the record would show impacts if there were any: what is not seen is unknown."""
    if impacts.n > record.settings.regimes.seen_share * cycles:
        return True
    with open_record(measured) as raw, open_record(conditioned) as view:
        return could_be_seen(
            raw,
            view,
            clearance=min(record.clearance),
            frequency=float(view.attributes["oscillation_hz"]),
            settings=record.settings,
        )


def unknown_regime(record: Record) -> dict[str, str | float | None]:
    """The row of regimes.csv of a record of which nothing is known."""
    columns = ("regime", "impacts_per_cycle", "amplitude_mean_m", "amplitude_max_m", "captured")
    return {"record": record.id, **dict.fromkeys(columns)}


def decay_times(record: Record, *, conditioned: Path) -> list[dict[str, str | float | None]]:
    """Rows of decay_times.csv: when a release has fallen to each share of it in `LEVELS`.

    Parameters
    ----------
    record : Record
    conditioned : Path
        conditioned/<id>.nc.

    Returns
    -------
    list of dict
        ``record``, ``target_m`` and ``time_s`` (None: not reached within the record); none for a
        record that is no release.
    """
    if record.test != "transient" or not record.release:
        return []
    with open_record(conditioned) as view:
        frequency = view.attributes.get("oscillation_hz")
        if view.refused is not None or "displacement" not in view.roles or not frequency:
            return []
        time, amplitude = _amplitudes(view, float(frequency))
    rows: list[dict[str, str | float | None]] = []
    for share in LEVELS if amplitude.size else ():
        target = share * abs(record.release)
        reached = time_to_level(time, amplitude, target)
        time_s = reached if math.isfinite(reached) else None
        rows.append({"record": record.id, "target_m": target, "time_s": time_s})
    return rows


def _amplitudes(view: RecordView, frequency: float) -> tuple[FloatArray, FloatArray]:
    return cycles_from(partial(view.read, "displacement"), view.n, view.sample_rate, frequency)


def _regimes(
    record: Record, impacts: Impacts, *, period: float, begin: float, end: float
) -> dict[str, str | float | None]:
    """Regime of each ball, and of all impacts together where the ball is not known."""
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


def _spells(
    record: Record,
    impacts: Impacts,
    period: float,
    view_start: float,
    decay: tuple[FloatArray, FloatArray],
) -> Row:
    """Activation spells of a single ball: number and length; of a release, what its end divides."""
    if len(record.clearance) != 1:
        return {}
    spells = activation_spells(impacts.time_s, impacts.side, period=period)
    row: dict[str, str | float | None] = {"spells": float(len(spells))}
    if not len(spells):
        return row
    row["spell_mean_s"] = float(np.mean(spells[:, 1] - spells[:, 0]))
    if record.test == "transient":
        lost = float(spells[0, 1] - view_start)
        row["captured_until_s"] = lost
        found = transition_of(*decay, lost=lost, settings=record.settings.regimes)
        if found is not None:
            row["decay_rate_captured_1_s"] = found.rate_before
            row["decay_rate_after_1_s"] = found.rate_after
            row["transition_m"] = found.amplitude
    return row
