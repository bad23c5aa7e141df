"""What the page of one record draws: channels as measured and conditioned, impacts, cycles.

It depends on the record's own files alone, so that adding a record to a campaign leaves the others'
as they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.figures.collect.impacts_per_cycle import impacts_per_cycle
from vinesexp.record_pages.all_samples import CHUNK, chunks_of
from vinesexp.record_pages.packing import exact, packed
from vinesexp.record_pages.spectrum import phase_plane, spectrum
from vinesexp.record_pages.zoom_levels import SHORT, part_size, read_channel
from vinesexp.records.result_columns import DECAY
from vinesexp.records.result_paths import ResultPaths
from vinesexp.records.store import RecordView, open_record
from vinesexp.records.tables import read_rows
from vinesexp.signals.cycles import cycles_from
from vinesexp.signals.impacts.impact_table import Impacts, read_impacts
from vinesexp.signals.means import fill_gaps
from vinesexp.units import COVERAGE_95

#: How a quantity is shown: unit, and its size in SI.
SHOWN = {
    "displacement": ("mm", 1e-3),
    "velocity": ("mm/s", 1e-3),
    "acceleration": ("m/s²", 1.0),
    "sound": ("1", 1.0),
}
_MOST_IMPACTS = 20_000
_MOST_CYCLES = 20_000


def traces_of(id: str, *, test: str, balls: int, paths: ResultPaths) -> dict[str, Any]:
    """Everything that is drawn of one record.

    Parameters
    ----------
    id, test : str
        The record and its kind of test.
    balls : int
        How many were in it.
    paths : ResultPaths

    Returns
    -------
    dict
        Ready to be written as JSON. A record that was refused has no channels.
    """
    impacts = read_impacts(paths.impacts(id))
    with open_record(paths.record(id)) as measured, open_record(paths.conditioned(id)) as filtered:
        if measured.refused is not None or not measured.n:
            return {"channels": []}
        attributes = filtered.attributes
        frequency = 0.0 if test == "drop" else float(attributes.get("oscillation_hz") or 0.0)
        found = _timing(measured, frequency) | {
            "impacts": _impacts(impacts),
            "strips": _strips(impacts, measured, frequency=frequency, balls=balls),
            "channels": _channels(measured, filtered, frequency=frequency),
            "cycles": _cycles(filtered, frequency),
            "spectra": _spectra(measured),
            "phase": phase_plane(filtered, frequency),
            "decay": _decay(paths.decay(id)),
        }
        size = part_size(measured.n, measured.sample_rate, frequency)
        return found | {"part": size, "chunk": CHUNK if size > 1 else 0}


def samples_of(id: str, *, paths: ResultPaths) -> Iterator[dict[str, Any]]:
    """Every sample of a record, a million at a time; none of one whose overview has them all."""
    with open_record(paths.record(id)) as measured, open_record(paths.conditioned(id)) as filtered:
        if measured.refused is not None or measured.n <= SHORT:
            return
        views = {"measured": measured}
        if filtered.refused is None and filtered.n == measured.n:
            views["bandpassed"] = filtered
        units = {
            role: SHOWN.get(view.quantity(role), ("SI", 1.0))[1]
            for view in views.values()
            for role in view.roles
        }
        yield from chunks_of(views, units)


def _timing(view: RecordView, frequency: float) -> dict[str, Any]:
    return {
        "start": view.start,
        "rate": view.sample_rate,
        "samples": view.n,
        "frequency": frequency,
    }


def _channels(
    measured: RecordView, filtered: RecordView, *, frequency: float
) -> list[dict[str, Any]]:
    """Each channel as it was measured, and bandpassed where that was done."""
    size = part_size(measured.n, measured.sample_rate, frequency)
    found = []
    for kind, view in (("measured", measured), ("bandpassed", filtered)):
        if view.refused is not None or view.n != measured.n:
            continue
        for role in sorted(view.roles, key=_place):
            unit, factor = SHOWN.get(view.quantity(role), ("SI", 1.0))
            level = read_channel(view, role, size)
            channel: dict[str, Any] = {"role": role, "kind": kind, "unit": unit}
            channel["low"] = packed(level.low / factor)
            if size > 1:
                channel["high"] = packed(level.high / factor)
            found.append(channel)
    return found


def _spectra(view: RecordView) -> list[dict[str, Any]]:
    """The spectrum of each channel as it was measured."""
    found = []
    for role in sorted(view.roles, key=_place):
        unit, factor = SHOWN.get(view.quantity(role), ("SI", 1.0))
        one = spectrum(partial(_shown_samples, view, role, factor), view.n, view.sample_rate)
        if one["sections"]:
            found.append({"role": role, "unit": unit, **one})
    return found


def _shown_samples(view: RecordView, role: str, factor: float, begin: int, end: int) -> FloatArray:
    samples: FloatArray = fill_gaps(view.read(role, begin, end)) / factor
    return samples


def _place(role: str) -> int:
    order = ("displacement", "acceleration", "base")
    return order.index(role) if role in order else len(order)


def _impacts(impacts: Impacts) -> dict[str, Any]:
    shown = slice(0, _MOST_IMPACTS)
    return {
        "count": impacts.n,
        "time": exact(impacts.time_s[shown]),
        "nes": impacts.nes[shown].tolist(),
        "side": impacts.side[shown].tolist(),
        "jump": packed(impacts.velocity_jump_m_s[shown]),
        "error": packed(COVERAGE_95 * impacts.velocity_jump_error_m_s[shown]),
        "confidence": packed(impacts.confidence[shown]),
        "crowded": np.flatnonzero(impacts.crowded[shown]).tolist(),
        "clipped": np.flatnonzero(impacts.clipped[shown]).tolist(),
    }


def _strips(
    impacts: Impacts, view: RecordView, *, frequency: float, balls: int
) -> list[dict[str, Any]]:
    """Impacts in each cycle, a strip a ball; impacts of unknown balls have their own."""
    if not frequency or not impacts.n:
        return []
    several = balls > 1
    strips = []
    for ball in sorted(set(impacts.nes.tolist())) if several else [None]:
        own = impacts.time_s if ball is None else impacts.time_s[impacts.nes == ball]
        counts = impacts_per_cycle(
            own, frequency=frequency, start=view.start, length=view.n / view.sample_rate
        )
        name = "" if ball is None else f"ball {ball}" if ball else "ball not known"
        strips.append({"name": name, "counts": counts[:_MOST_CYCLES].astype(int).tolist()})
    return strips


def _cycles(view: RecordView, frequency: float) -> dict[str, Any] | None:
    """Half the swing of each cycle, mm."""
    if view.refused is not None or not frequency or "displacement" not in view.roles:
        return None
    time, swing = cycles_from(
        lambda begin, end: view.read("displacement", begin, end),
        view.n,
        view.sample_rate,
        frequency,
    )
    step = max(-(-time.size // _MOST_CYCLES), 1)
    return {"time": exact(view.start + time[::step]), "amplitude": packed(1e3 * swing[::step])}


def _decay(path: Path) -> dict[str, Any] | None:
    """Amplitude of a ring-down beside what was identified from it, mm."""
    rows = read_rows(path, DECAY) if path.is_file() else []
    if not rows:
        return None
    column = {name: np.array([float(row[name] or "nan") for row in rows]) for name in DECAY.names}
    return {
        "time": exact(column["time_s"]),
        "amplitude": packed(1e3 * column["amplitude_m"]),
        "law": packed(1e3 * column["law_m"]),
        "viscous": packed(1e3 * column["viscous_m"]),
    }
