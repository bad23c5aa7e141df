"""The replay of a campaign: each record beside its replays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vinesexp.clearance.level_base import LevelBase, base_of_level
from vinesexp.errors import AnalysisError
from vinesexp.records.campaign import Campaign, Record
from vinesexp.records.store import open_record
from vinesexp.records.tables import Value
from vinesexp.records.uncertainties import EXACT
from vinesexp.replay.measures import Measures, decay_time, measures_of
from vinesexp.replay.motions import TESTS, replays, rig_of
from vinesexp.replay.replay_table import Compared, compared
from vinesexp.rig import Rig
from vinesexp.signals.cycles import cycle_amplitudes

Floats = NDArray[np.float64]
Rows = Sequence[Mapping[str, str]]

_MOST = 60_000_000  # samples of a record
_LONGEST = 300.0  # s of a record that are replayed


@dataclass(frozen=True)
class Measured:
    """Amplitude of one record, cycle by cycle: frequency, length, times and half swings."""

    frequency: float
    length: float
    time: Floats
    amplitude: Floats


def replay_campaign(
    campaign: Campaign,
    *,
    identified: Rows,
    regimes: Rows,
    base: Rows,
    conditioned: Mapping[str, Path],
) -> tuple[list[Compared], list[dict[str, Value]]]:
    """Replay every record that can be.

    Parameters
    ----------
    campaign : Campaign
    identified, regimes, base : sequences of mappings
        Rows of identified.csv, regimes.csv and base.csv.
    conditioned : mapping
        Record id to its bandpassed channels.

    Returns
    -------
    rows : list of Compared
        Of replay.csv.
    cycles : list of dict
        Of replay_cycles.csv: amplitude of each cycle, measured and replayed.
    """
    values = {
        row["parameter"]: float(row["value"]) for row in identified if row["method"] == "combined"
    }
    masses = tuple(mass.value for mass in campaign.known.nes_mass)
    by_id = {row["record"]: row for row in regimes}
    bases = {row["record"]: row for row in base}
    rows: list[Compared] = []
    cycles: list[dict[str, Value]] = []
    for record in campaign.records:
        if record.test not in TESTS or record.exclude or record.id not in by_id:
            continue
        motion = _measured(conditioned[record.id])
        if motion is None:
            continue
        try:
            apart = " | " in by_id[record.id]["regime"] or len(record.clearance) < 2
            rig = rig_of(record, values, masses)
            found = _replayed(record, rig, _base(campaign, record, bases), motion, apart)
        except AnalysisError:
            continue
        decay = float("nan")
        if record.test != "periodic":
            decay = decay_time(motion.time, motion.amplitude)
        rows += compared(record, by_id[record.id], decay, found)
        regime = by_id[record.id].get("regime", "")
        alike = [one for one in found if one.regime == regime]
        cycles += _cycles(record, motion, alike or found)
    return rows, cycles


def _measured(path: Path) -> Measured | None:
    with open_record(path) as view:
        frequency = view.attributes.get("oscillation_hz")
        if view.refused is not None or "displacement" not in view.roles or not frequency:
            return None
        f = float(frequency)
        time, amplitude = cycle_amplitudes(view.read("displacement", 0, _MOST), view.sample_rate, f)
        length = view.n / view.sample_rate
    known = np.isfinite(amplitude)
    if not known.any():
        return None
    return Measured(f, min(length, _LONGEST), time[known], amplitude[known])


def _base(
    campaign: Campaign, record: Record, bases: Mapping[str, Mapping[str, str]]
) -> LevelBase | None:
    """The base of one record: as measured, else as the sheet says."""
    if record.test != "periodic" or not record.base_amplitude:
        return None
    own = bases.get(record.id)
    frequencies = {record.frequency[0]} if record.frequency else set()
    return base_of_level(
        record.base_amplitude, frequencies, [own] if own is not None else [], inputs=EXACT
    )


def _replayed(
    record: Record, rig: Rig, base: LevelBase | None, motion: Measured, apart: bool
) -> list[Measures]:
    release = abs(record.release) if record.release else float(motion.amplitude.max())
    frequency = motion.frequency
    if base is not None and base.frequency is not None:
        frequency = base.frequency.value
    return [
        measures
        for one in replays(record, rig, base=base, release=release, length=motion.length)
        for measures in measures_of(one, test=record.test, frequency=frequency, apart=apart)
    ]


def _cycles(record: Record, motion: Measured, found: Sequence[Measures]) -> list[dict[str, Value]]:
    """Amplitude over time, measured and over the replays of its regime on the same cycles."""
    n = min(motion.time.size, *(one.cycles[0].size for one in found))
    replayed = np.array([one.cycles[1][:n] for one in found])
    columns = (motion.time[:n], motion.amplitude[:n], *(
        getattr(np, kind)(replayed, axis=0) for kind in ("median", "min", "max")
    ))  # fmt: skip
    names = ("time_s", "measured_m", "replayed_m", "replayed_low_m", "replayed_high_m")
    return [
        {"record": record.id, **dict(zip(names, map(float, row), strict=True))}
        for row in zip(*columns, strict=True)
    ]
