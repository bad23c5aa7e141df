"""What one record tells about the rig: the methods that its test and its channels allow."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from vinesexp.errors import AnalysisError
from vinesexp.identification.bounces import restitution_of_bounces
from vinesexp.identification.decay_record import estimates_of_decay
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.flights import Flights, flights_of, mass_ratio, restitution
from vinesexp.identification.oscillation import displacement_of, frequency_of_motion
from vinesexp.identification.sweep_record import estimates_of_sweep
from vinesexp.records.campaign import Known, Record
from vinesexp.records.store import RecordView, open_record
from vinesexp.signals.channel_agreement import Agreement, agreement_of
from vinesexp.signals.impacts.find import Impacts, read_impacts

#: Error of r that the model of the displacement around an impact leaves, however many there are.
_SMOOTH = 1e-5
#: Parameter name of a record that gave nothing; its `note` is the reason.
NOTHING = "nothing"


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
        `zeta_added` where a mass was added, the same with `_at` over amplitude;
        `damping_linear`, `damping_quadratic`, `damping_coulomb`, `stiffening`, `frequency_slope`
        and `beat` of a decay; `working_amplitude` of a periodic test; `accelerometer_gain` and
        `channel_lag` of the channels. A record that gives nothing has one entry `nothing` with
        the reason as its note.
    """
    with open_record(measured) as view, open_record(conditioned) as band:
        if view.refused is not None:
            return []
        frequency = band.attributes.get("oscillation_hz")
        try:
            return _by_test(record, known, view, frequency, impacts)
        except AnalysisError as error:
            return [nothing(record.id, str(error))]


def nothing(record: str, reason: str) -> Estimate:
    """The entry of a record that gives nothing."""
    return Estimate(NOTHING, math.nan, math.nan, "", "", (record,), reason)


def _by_test(
    record: Record, known: Known, view: RecordView, frequency: float | None, impacts: Path
) -> list[Estimate]:
    if record.test == "drop":
        return _drop(record, read_impacts(impacts))
    if record.test == "sweep" and not record.clearance:
        return _beside(record, view, frequency)[0] + estimates_of_sweep(record, view, frequency)
    if frequency is None:
        frequency = frequency_of_motion(view)
    found, agreement = _beside(record, view, frequency)
    if record.test == "ringdown":
        return found + estimates_of_decay(record, view, frequency)
    if record.clearance:
        found += _swing(record, view, frequency)
        return found + _impacts(record, known, read_impacts(impacts), frequency, agreement)
    return found


def _beside(
    record: Record, view: RecordView, frequency: float | None
) -> tuple[list[Estimate], Agreement | None]:
    """Acceleration beside displacement, where both were recorded."""
    agreement = agreement_of(view, frequency=frequency) if frequency else None
    return ([] if agreement is None else _agreement(record, agreement)), agreement


def _swing(record: Record, view: RecordView, frequency: float) -> list[Estimate]:
    """Amplitude at which a periodic test works: the effective one, m."""
    if record.test != "periodic" or "displacement" not in view.roles:
        return []
    x = displacement_of(view, frequency)[0]
    return _estimates(
        record, "displacement", [("working_amplitude", math.sqrt(2.0) * float(x.std()), 0.0, "m")]
    )


def _estimates(
    record: Record, method: str, rows: list[tuple[str, float, float, str]]
) -> list[Estimate]:
    return [
        Estimate(name, float(value), float(error), unit, method, (record.id,))
        for name, value, error, unit in rows
    ]


def _drop(record: Record, impacts: Impacts) -> list[Estimate]:
    whole = (impacts.clipped == 0) | (impacts.time_error_s < 1e-4)
    found = restitution_of_bounces(impacts.time_s[whole], impacts.time_error_s[whole])
    return _estimates(record, "drop", [("r", found.r, found.error, "1")])


def _agreement(record: Record, agreement: Agreement) -> list[Estimate]:
    rows = [
        ("accelerometer_gain", agreement.gain, agreement.gain_error, "1"),
        ("channel_lag", agreement.lag, agreement.lag_error, "s"),
    ]
    return _estimates(record, "channels", rows)


def _impacts(
    record: Record, known: Known, impacts: Impacts, frequency: float, agreement: Agreement | None
) -> list[Estimate]:
    found: list[Estimate] = []
    several = len(record.clearance) > 1
    for number, b in enumerate(record.clearance, start=1):
        flights = flights_of(impacts, nes=number, b=b, period=1.0 / frequency)
        name = f"r_{number}" if several else "r"
        mass = known.nes_mass[number - 1].value if len(known.nes_mass) >= number else None
        if mass is None and len(known.nes_mass) == 1:
            mass = known.nes_mass[0].value  # one value for all
        try:
            found += _of_flights(record, flights, impacts, name, mass, frequency, agreement)
        except AnalysisError as error:
            ball = f"ball {number}: " if several else ""
            found.append(nothing(record.id, f"{ball}{error}"))
    return found


def _of_flights(
    record: Record, flights: Flights, impacts: Impacts, name: str, mass: float | None,
    frequency: float, agreement: Agreement | None,
) -> list[Estimate]:  # fmt: skip
    r = restitution(flights)
    # What the lag of the displacement leaves unknown moves all velocities together.
    late = 0.0 if agreement is None else agreement.lag_error
    moved = (2.0 * np.pi * frequency) ** 2 * late * impacts.x_m[flights.index]
    shifted = Flights(
        flights.index, flights.u_before, flights.u_after, flights.v_before + moved,
        flights.v_after + moved, flights.jump, flights.jump_error,
    )  # fmt: skip
    systematic = math.hypot(restitution(shifted).r - r.r, _SMOOTH)
    rows = [
        (name, r.r, math.hypot(r.error, systematic), "1"),
        (f"{name}_scatter", r.scatter, r.scatter / math.sqrt(2.0 * r.count), "1"),
        (f"{name}_slope", r.slope, r.slope_error, "s/m"),
    ]
    if mass is not None:
        ratio = mass_ratio(flights)
        M = mass / ratio.eps
        # Jumps are as uncertain as the accelerometer's gain, seen beside the laser.
        gain = 0.0
        if agreement is not None and abs(abs(agreement.gain) - 1.0) > 3.0 * agreement.gain_error:
            gain = abs(abs(agreement.gain) - 1.0)
        rows.append(("M", M, M * math.hypot(ratio.error / ratio.eps, gain), "kg"))
    return _estimates(record, "impacts", rows)
