"""What the impacts of one record give: r and M, from flights between the walls."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vinesexp.errors import AnalysisError
from vinesexp.identification.estimate import Estimate, estimates_of, nothing
from vinesexp.identification.flights import Flights, flights_of, mass_ratio, restitution
from vinesexp.records.campaign import Known, Record
from vinesexp.signals.channel_agreement import Agreement
from vinesexp.signals.impacts.from_integral import Integrated
from vinesexp.signals.impacts.impact_table import Impacts

#: Error of r that the model of the displacement around an impact leaves, however many there are.
_SMOOTH = 1e-5
#: The same where the displacement is integrated: what moves it may leave one r as it is by chance.
_SMOOTH_INTEGRATED = 5e-4


def impact_estimates(
    record: Record, known: Known, impacts: Impacts, frequency: float, agreement: Agreement | None,
    integrated: Integrated | None = None,
) -> list[Estimate]:  # fmt: skip
    """r of each ball, and M where the ball is weighed.

    Parameters
    ----------
    record : Record
        With its clearances.
    known : Known
        Weighed balls.
    impacts : Impacts
    frequency : float
        Of the oscillation, Hz.
    agreement : Agreement, optional
        Of acceleration and displacement: their gain and lag enter the errors.
    integrated : Integrated, optional
        Where the displacement is the integral of the acceleration: what that leaves unknown.

    Returns
    -------
    list of Estimate
        `r`, `r_scatter`, `r_slope` and `M`, numbered for several balls; or `nothing` with the
        reason.
    """
    found: list[Estimate] = []
    several = len(record.clearance) > 1
    for number, b in enumerate(record.clearance, start=1):
        flights = flights_of(impacts, nes=number, b=b, period=1.0 / frequency)
        name = f"r_{number}" if several else "r"
        mass = known.nes_mass[number - 1].value if len(known.nes_mass) >= number else None
        if mass is None and len(known.nes_mass) == 1:
            mass = known.nes_mass[0].value  # one value for all
        try:
            late = 0.0 if agreement is None else agreement.lag_error
            others = [_moved_together(flights, impacts, late=late, frequency=frequency)]
            if integrated is not None:
                others += [
                    flights_of(other, nes=number, b=b, period=1.0 / frequency)
                    for other in integrated.alternatives
                ]
            smooth = _SMOOTH if integrated is None else _SMOOTH_INTEGRATED
            found += _of_flights(
                record, flights, others, name, mass, agreement=agreement, smooth=smooth
            )
        except AnalysisError as error:
            ball = f"ball {number}: " if several else ""
            found.append(nothing(record.id, f"{ball}{error}"))
    return found


def _moved_together(
    flights: Flights, impacts: Impacts, *, late: float, frequency: float
) -> Flights:
    """What the lag of the displacement leaves unknown moves all velocities together."""
    moved = (2.0 * np.pi * frequency) ** 2 * late * impacts.x_m[flights.index]
    return replace(flights, v_before=flights.v_before + moved, v_after=flights.v_after + moved)


def _of_flights(
    record: Record, flights: Flights, others: Sequence[Flights], name: str, mass: float | None,
    *, agreement: Agreement | None, smooth: float,
) -> list[Estimate]:  # fmt: skip
    """`others`: the flights with something off by its standard error, that moves all alike."""
    r = restitution(flights)
    systematic = math.hypot(*(restitution(other).r - r.r for other in others), smooth)
    rows = [
        (name, r.r, math.hypot(r.error, systematic), "1"),
        (f"{name}_scatter", r.scatter, r.scatter / math.sqrt(2.0 * r.count), "1"),
    ]
    if math.isfinite(r.slope):
        rows.append((f"{name}_slope", r.slope, r.slope_error, "s/m"))
    if mass is not None:
        ratio = mass_ratio(flights)
        M = mass / ratio.eps
        # Jumps are as uncertain as the accelerometer's gain, seen beside the laser.
        gain = 0.0
        if agreement is not None and abs(abs(agreement.gain) - 1.0) > 3.0 * agreement.gain_error:
            gain = abs(abs(agreement.gain) - 1.0)
        moved = [mass_ratio(other).eps / ratio.eps - 1.0 for other in others[1:]]
        rows.append(("M", M, M * math.hypot(ratio.error / ratio.eps, gain, *moved), "kg"))
    return estimates_of(record, "impacts", rows)
