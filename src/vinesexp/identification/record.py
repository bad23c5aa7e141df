"""What one record tells about the rig: the rungs that its kind of test allows."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError
from vinesexp.identification.drop import restitution_from_bounces
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.impacts import fit_impacts, state_at_impacts
from vinesexp.identification.lag import channel_lag
from vinesexp.identification.ringdown import damping_law, fit_ringdown
from vinesexp.identification.sweep import fit_transmissibility
from vinesexp.records.campaign import Known, Record
from vinesexp.records.store import RecordView, open_record

Floats = NDArray[np.float64]

#: Samples of one channel that are read for a fit; longer records are read to here.
_MOST = 30_000_000
#: Evidence (difference of BIC) from which another law of damping is believed: very strong.
_BELIEVED = 10.0
#: Misfit of the exponential, as a share, below which the law of damping does not matter.
_NEGLIGIBLE = 0.005


def estimate_record(
    record: Record, known: Known, *, measured: Path, conditioned: Path, impacts: Path
) -> list[Estimate]:
    """All estimates that one record allows; empty for a record that was refused.

    Parameters
    ----------
    record : Record
    known : Known
        Weighed masses.
    measured, conditioned : Path
        records/<id>.nc and conditioned/<id>.nc.
    impacts : Path
        impacts/<id>.csv.

    Returns
    -------
    list of Estimate
        A method that fails is left out; its reason is an estimate of NaN with a note.
    """
    with open_record(conditioned) as view:
        frequency = view.attributes.get("oscillation_hz")
    with open_record(measured) as view:
        if view.refused is not None:
            return []
        try:
            return list(_estimates(record, known, view, frequency, impacts))
        except AnalysisError as error:
            return [Estimate("", np.nan, np.nan, "", record.test, (record.id,), str(error))]


def _estimates(
    record: Record, known: Known, view: RecordView, frequency: float | None, impacts: Path
) -> Iterator[Estimate]:
    if record.test == "ringdown" and "displacement" in view.roles:
        yield from _from_ringdown(record, view, frequency)
    elif record.test == "sweep" and not record.clearance and record.frequency is not None:
        if {"base", "displacement"} <= set(view.roles):
            yield from _from_sweep(record, view, record.frequency)
    elif record.test == "drop":
        found = restitution_from_bounces(_column(impacts, "time_s"))
        yield Estimate("r", found.r, found.r_error, "1", "drops", (record.id,))
    elif (
        len(record.clearance) == 1
        and record.test in ("periodic", "transient")
        and "displacement" in view.roles
    ):
        yield from _from_impacts(record, known, view, frequency, impacts)


def _from_ringdown(record: Record, view: RecordView, frequency: float | None) -> Iterator[Estimate]:
    if frequency is None:
        raise AnalysisError("no oscillation found in the displacement")
    x = view.read("displacement", 0, _MOST)
    found = fit_ringdown(x, sample_rate=view.sample_rate, frequency=frequency)
    ids = (record.id,)
    if record.added_mass:
        yield Estimate("f0_added", found.f0, found.f0_error, "Hz", "ring-down", ids)
        return
    note = ""
    try:
        law = damping_law(x, sample_rate=view.sample_rate, ringdown=found)
    except AnalysisError:
        law = None
    if law and law.evidence > _BELIEVED and law.residual_exponential > _NEGLIGIBLE:
        note = (
            f"damping depends on amplitude: {law.name} leaves {law.residual:.1%} of the envelope, "
            f"an exponential {law.residual_exponential:.1%}; zeta is that of the amplitudes "
            f"from {1e3 * found.amplitude:.3g} mm down"
        )
        yield Estimate(
            "zeta_small", law.zeta, law.zeta_error, "1", f"ring-down envelope, {law.name}", ids
        )
    yield Estimate("f0", found.f0, found.f0_error, "Hz", "ring-down", ids)
    yield Estimate("zeta", found.zeta, found.zeta_error, "1", "ring-down", ids, note)


def _from_sweep(record: Record, view: RecordView, band: tuple[float, float]) -> Iterator[Estimate]:
    found = fit_transmissibility(
        view.read("base", 0, _MOST),
        view.read("displacement", 0, _MOST),
        sample_rate=view.sample_rate,
        band=(min(band), max(band)),
    )
    ids = (record.id,)
    yield Estimate("f0", found.f0, found.f0_error, "Hz", "sweep transmissibility", ids)
    yield Estimate("zeta", found.zeta, found.zeta_error, "1", "sweep transmissibility", ids)


def _from_impacts(
    record: Record, known: Known, view: RecordView, frequency: float | None, impacts: Path
) -> Iterator[Estimate]:
    times, jumps = _column(impacts, "time_s"), _column(impacts, "velocity_jump_m_s")
    sides = _column(impacts, "side").astype(np.int64)
    displacement = view.read("displacement", 0, _MOST)
    x, v = state_at_impacts(
        displacement,
        sample_rate=view.sample_rate,
        start=view.start - _lag(view, displacement, frequency),
        times=times,
        jumps=jumps,
    )
    found = fit_impacts(times, sides, x, v, jumps, clearance=record.clearance[0])
    ids = (record.id,)
    yield Estimate("r", found.r, found.r_error, "1", "impacts", ids)
    if known.nes_mass:
        m = known.nes_mass[0]
        M = m.value / found.mass_ratio
        share = np.hypot(found.mass_ratio_error / found.mass_ratio, m.std_error / m.value)
        yield Estimate("M", M, float(M * share), "kg", "momentum at impacts", ids)


def _lag(view: RecordView, displacement: Floats, frequency: float | None) -> float:
    """How late the displacement is behind the acceleration that timed the impacts, s."""
    if "acceleration" not in view.roles or frequency is None:
        return 0.0
    acceleration = view.read("acceleration", 0, _MOST)
    try:
        found = channel_lag(
            acceleration, displacement, sample_rate=view.sample_rate, frequency=frequency
        )
    except AnalysisError:
        return 0.0
    return found.lag if found.lag_error < 1.0 / view.sample_rate else 0.0


def _column(path: Path, name: str) -> Floats:
    with path.open(encoding="utf-8", newline="") as stream:
        return np.array([float(row[name] or "nan") for row in csv.DictReader(stream)])
