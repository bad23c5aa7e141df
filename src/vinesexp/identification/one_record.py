"""What one record tells about the rig: the rungs that its test and its channels allow."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import AnalysisError
from vinesexp.identification.bounces import restitution_of_bounces
from vinesexp.identification.estimate import NOTHING, Estimate, estimates_of, nothing
from vinesexp.identification.halfpower import half_power
from vinesexp.identification.impact_estimates import impact_estimates
from vinesexp.identification.ringdown import POINTS, RingDown, ring_down
from vinesexp.identification.sweep import transmissibility
from vinesexp.records.campaign import Known, Record
from vinesexp.records.store import RecordView, open_record
from vinesexp.signals.channel_agreement import Agreement, agreement_in
from vinesexp.signals.clipping import resolution_of
from vinesexp.signals.impacts.impact_table import Impacts, read_impacts
from vinesexp.signals.means import channel_means

__all__ = ["NOTHING", "estimate_record", "nothing"]

FloatArray = NDArray[np.float64]


def estimate_record(
    record: Record, known: Known, *, measured: Path, conditioned: Path, impacts: Path
) -> list[Estimate]:
    """Everything that one record says about M, c1, k1 and r, and about its own channels.

    Parameters
    ----------
    record : Record
        Its row of records.csv.
    known : Known
        Masses that were weighed.
    measured, conditioned, impacts : Path
        records/<id>.nc, conditioned/<id>.nc, impacts/<id>.csv.

    Returns
    -------
    list of Estimate
        Parameters `f0`, `zeta`, `M`, `r` (with a number for several NESs); `f0_added` and
        `zeta_added` where a mass was added; `damping_linear`, `damping_quadratic`,
        `damping_coulomb`, `stiffening`, `frequency_slope`, `zeta_amplitude` and `beat` of a decay;
        `accelerometer_gain` and `channel_lag` of the channels. A record that gives nothing has one
        entry `nothing` with the reason as its note.
    """
    with open_record(measured) as view, open_record(conditioned) as band:
        if view.refused is not None:
            return []
        try:
            return _by_test(record, known, view, band.attributes, impacts)
        except AnalysisError as error:
            return [nothing(record.id, str(error))]


def _by_test(
    record: Record, known: Known, view: RecordView, conditioned: Mapping[str, Any], impacts: Path
) -> list[Estimate]:
    if record.test == "drop":
        return _drop(record, read_impacts(impacts))
    frequency = conditioned.get("oscillation_hz")
    if frequency is None:
        raise AnalysisError("nothing oscillates in it")
    found: list[Estimate] = []
    agreement = agreement_in(conditioned)
    if agreement is not None:
        found += _agreement(record, agreement)
    if record.test == "ringdown":
        return found + _ringdown(record, view, frequency)
    if record.clearance:
        return found + impact_estimates(record, known, read_impacts(impacts), frequency, agreement)
    if record.test == "sweep":
        return found + _sweep(record, view, frequency)
    return found


def _ringdown(record: Record, view: RecordView, frequency: float) -> list[Estimate]:
    role = "displacement" if "displacement" in view.roles else "acceleration"
    k = max(1, int(view.sample_rate / (POINTS * frequency)))
    resolution = resolution_of(view.read(role, 0, 1 << 16))
    blurred = float(np.sinc(frequency * k / view.sample_rate))  # what block means do to a sine
    rungs = ring_down(
        channel_means(view, role, k) / blurred,
        k / view.sample_rate,
        frequency=frequency,
        resolution=resolution,
    )
    suffix = "_added" if record.added_mass else ""
    found = []
    for rung in rungs:
        found += estimates_of(
            record,
            rung.method,
            [
                (f"f0{suffix}", rung.f0, rung.f0_error, "Hz"),
                (f"zeta{suffix}", rung.zeta, rung.zeta_error, "1"),
            ],
        )
    best = rungs[-1]
    found += estimates_of(record, best.method, _damping(best))
    if best.beat is not None:
        rows = [("beat", best.beat[0], 0.0, "Hz"), ("beat_share", best.beat[1], 0.0, "1")]
        found += estimates_of(record, best.method, rows)
    return found


def _damping(rung: RingDown) -> list[tuple[str, float, float, str]]:
    """The terms of dA/dt = -(gamma + alpha A + beta A^2) that the decay shows."""
    error = np.sqrt(np.diag(rung.covariance))
    names = {
        "alpha": ("damping_linear", "1/s"),
        "beta": ("damping_quadratic", "1/(m s)"),
        "gamma": ("damping_coulomb", "m/s"),
        "mu": ("frequency_slope", "1/m"),
        "kappa": ("stiffening", "1/m^2"),
    }
    rows = [
        (names[name][0], getattr(rung.decay, name), error[i], names[name][1])
        for i, name in enumerate(rung.free)
        if name in names
    ]
    return [
        *rows,
        ("zeta_amplitude", rung.reference, 0.0, "m"),
        ("misfit", rung.residual, 0.0, "1"),
    ]


def _sweep(record: Record, view: RecordView, frequency: float) -> list[Estimate]:
    missing = {"base", "displacement"} - set(view.roles)
    if missing:
        raise AnalysisError(
            f"a sweep without NES gives f0 and zeta only with a {missing.pop()} channel"
        )
    if view.quantity("base") != "displacement":
        raise AnalysisError(
            f"a sweep without NES gives f0 and zeta only where the base channel measures "
            f"displacement; this one measures {view.quantity('base')}"
        )
    k = max(1, int(view.sample_rate / (POINTS * frequency)))
    base, x = channel_means(view, "base", k), channel_means(view, "displacement", k)
    found = transmissibility(
        base, x, k / view.sample_rate, frequency=frequency, swept=record.frequency
    )
    rows = [
        ("f0", found.f0, found.f0_error, "Hz"),
        ("zeta", found.zeta, found.zeta_error, "1"),
        ("base_gain", found.gain, found.gain_error, "1"),
        ("base_lag", found.lag, found.lag_error, "s"),
    ]
    return _half_power(record, base, x, k / view.sample_rate) + estimates_of(record, "sweep", rows)


def _half_power(record: Record, base: FloatArray, x: FloatArray, step: float) -> list[Estimate]:
    """The cheap rung of a sweep, where the record is long enough for it."""
    if record.frequency is None:
        return []
    try:
        found = half_power(base, x, step, swept=record.frequency)
    except AnalysisError:  # the likelihood rung has said what it needs
        return []
    rows = [
        ("f0", found.f0, found.f0_error, "Hz"), ("zeta", found.zeta, found.zeta_error, "1")
    ]  # fmt: skip
    return estimates_of(record, "half power", rows)


def _drop(record: Record, impacts: Impacts) -> list[Estimate]:
    whole = (impacts.clipped == 0) | (impacts.time_error_s < 1e-4)
    found = restitution_of_bounces(impacts.time_s[whole], impacts.time_error_s[whole])
    return estimates_of(record, "drop", [("r", found.r, found.error, "1")])


def _agreement(record: Record, agreement: Agreement) -> list[Estimate]:
    rows = [
        ("accelerometer_gain", agreement.gain, agreement.gain_error, "1"),
        ("channel_lag", agreement.lag, agreement.lag_error, "s"),
    ]
    return estimates_of(record, "channels", rows)
