"""What one record says about the rig: the methods that its test and its channels allow."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.errors import AnalysisError
from vinesexp.identification.bounces import bounces_of
from vinesexp.identification.decay_record import estimates_of_decay
from vinesexp.identification.driven_motion import DRIVEN, driven_motion, free_motion
from vinesexp.identification.estimate import (
    F0_INTEGRATED,
    FIRST_SWING,
    HELD,
    IN_RELEASE,
    INTEGRATED,
    LOST,
    NOTHING,
    SWINGS_AT,
    Estimate,
    estimates_of,
    nothing,
)
from vinesexp.identification.flights import Flights, flights_of, mass_ratio, restitution
from vinesexp.identification.oscillation import POINTS, displacement_of, frequency_of_motion
from vinesexp.identification.phasors import SAMPLES
from vinesexp.identification.sweep_record import estimates_of_sweep
from vinesexp.records.campaign.schema import Known, Record
from vinesexp.records.stored.refusal import is_of_the_machine, reason_of
from vinesexp.records.stored.store import RecordView, open_record
from vinesexp.records.stored.tables import Row
from vinesexp.signals.channel_agreement import Agreement, agreement_in, pulse_share
from vinesexp.signals.impacts.from_integral import Integrated, integrated_impacts, may_be_integrated
from vinesexp.signals.impacts.impact_table import Impacts, read_impacts
from vinesexp.signals.means import channel_means, group_size

__all__ = ["NOTHING", "estimate_record", "nothing"]

_SEEN = 1 << 16  # samples of a channel by which copies are known


# What the impacts of one record give: r and M, from flights between the walls.
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
        `r`, `r_scatter` and `M`, numbered for several balls; or `nothing` with the
        reason.
    """
    found: list[Estimate] = []
    several, masses = len(record.clearance) > 1, known.nes_mass
    for number, b in enumerate(record.clearance, start=1):
        flights = flights_of(impacts, nes=number, b=b, period=1.0 / frequency)
        name = f"r_{number}" if several else "r"
        # one mass for each ball, or one for all
        mass = masses[min(number, len(masses)) - 1].value if masses else None
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


def estimate_record(
    record: Record, known: Known, *, measured: Path, conditioned: Path, impacts: Path,
    shown: Mapping[str, Any],
) -> list[Estimate]:  # fmt: skip
    """Everything that one record says about M, c1, k1 and r, and about its own channels.

    Parameters
    ----------
    record : Record
        Its row of records.csv.
    known : Known
        Masses that were weighed.
    measured, conditioned, impacts : Path
        records/<id>.nc, conditioned/<id>.nc, impacts/<id>.csv.
    shown : mapping
        What the impacts step shows of the record: ``base`` and ``release``, as
        `signals.regimes.rows_or_refuse` has them.

    Returns
    -------
    list of Estimate
        Parameters `f0`, `zeta`, `M`, `r` (with a number for several NESs); `f0_added` and
        `zeta_added` where a mass was added, the same with `_at` over amplitude;
        `damping_linear`, `damping_quadratic`, `damping_coulomb`, `stiffening`, `frequency_slope`,
        `frequency_inverse`, `f0_drift` and `beat` of a decay; `working_amplitude`, `base_seen`,
        `base_frequency` and `driven` of a periodic test; `release_seen`, `release_f0` and
        `release_zeta` of a release;
        `accelerometer_gain` and `channel_lag` of the channels, `pulse_share` of the impacts in
        that gain, `accelerometer_corner` of one that
        is AC-coupled, `accelerometer_across` of one that shows motion across its axis;
        `integrated_phase` and `integrated_f0` where the displacement is the integral of the
        acceleration; `content`,
        a digest of the samples as its note. A record that gives nothing has
        an entry `nothing` with the reason as its note.
    """
    with open_record(measured) as view, open_record(conditioned) as band:
        if view.refused is not None or band.refused is not None:
            return []
        content = _content(record, view)
        try:
            return [content, *_by_test(record, known, view, band, impacts, shown)]
        except AnalysisError as error:
            return [content, nothing(record.id, str(error))]
        except Exception as error:  # one record that nobody foresaw must not stop the others
            if is_of_the_machine(error):
                raise
            return [
                content,
                nothing(record.id, reason_of(error, log=f"logs/estimate/{record.id}.log")),
            ]


def _content(record: Record, view: RecordView) -> Estimate:
    """A digest of the first samples of all channels: copies of a record are it is counted once."""
    digest = hashlib.sha256(f"{view.n} {view.sample_rate}".encode())
    for role in sorted(view.roles):
        digest.update(role.encode() + view.read(role, 0, _SEEN).tobytes())
    return Estimate(
        "content", float(view.n), 0.0, "1", "samples", (record.id,), digest.hexdigest()[:32]
    )


def _by_test(
    record: Record, known: Known, view: RecordView, band: RecordView, impacts: Path,
    shown: Mapping[str, Any],
) -> list[Estimate]:  # fmt: skip
    if record.test == "drop":
        return _drop(record, read_impacts(impacts))
    agreement = agreement_in(band.attributes)
    found = [] if agreement is None else _agreement(record, agreement)
    frequency = band.attributes.get("oscillation_hz")
    if record.test == "sweep" and not record.clearance:
        return found + estimates_of_sweep(record, view, frequency)
    # A line too fast to follow is hum, or its alias; a slow decay is too broad a line to stand out.
    fast = record.test == "ringdown" and view.sample_rate < SAMPLES * (frequency or 0.0)
    if frequency is None or (fast and record.frequency is None):
        frequency = frequency_of_motion(view)
    if record.test == "ringdown":
        if (ball := _a_ball(shown.get("struck", {}))) is not None:
            return [*found, nothing(record.id, ball)]
        return found + estimates_of_decay(record, view, frequency)
    if record.clearance:
        table = read_impacts(impacts)
        if table.n:
            found += _swing(record, view, band, frequency)
        found += _released(record, shown.get("release", ()))
        base = next(iter(shown.get("base", ())), None)
        whole = all(row["regime"] is not None for row in shown.get("regime", ()))
        found += _driven(record, view, table if whole else None, frequency, agreement, base)
        if whole and record.test == "transient":
            found += _free(record, view, table, frequency, agreement)
        if not whole:
            found.append(Estimate(LOST, float(table.n), 0.0, "1", "impacts", (record.id,)))
        if not whole and len(record.clearance) > 1:
            return [*found, nothing(record.id, _LOST)]
        if agreement is not None and table.n:
            share = pulse_share(
                view, table.time_s, np.nan_to_num(table.velocity_jump_m_s), frequency=frequency
            )
            found += estimates_of(record, "channels", [("pulse_share", share, 0.0, "1")])
        if "displacement" in view.roles or not table.n:
            return found + impact_estimates(record, known, table, frequency, agreement)
        return found + _without_laser(record, known, view, table, frequency)
    return found


def _a_ball(struck: Mapping[str, float]) -> str | None:
    """Why a ring-down has no f0 and zeta of its own: a ball took part in it."""
    cycles, share = struck.get("cycles", 0), struck.get("share", 0.0)
    if cycles < _FEW_CYCLES or not share > _TAKEN:
        return None
    return (
        f"impacts in {cycles:g} cycles take {share:.0%} of the energy of the mass: a ball was in "
        "its cavity, and f0 and zeta are not those of the mass alone. State its clearance_mm, and "
        "transient as the test; for f0 and zeta record a decay without it"
    )


_LOST = (
    "how often the balls hit is not known: impacts of one ball that were not found are in the "
    "flights of the others, so that r and M by them are not given"
)
#: Cycles with impacts that are no knocks of a hand, and share of the energy that they take.
_FEW_CYCLES, _TAKEN = 5, 0.1


def _without_laser(
    record: Record, known: Known, view: RecordView, impacts: Impacts, frequency: float
) -> list[Estimate]:
    """r and M where the acceleration alone shows how the mass moves, or why not."""
    if not may_be_integrated(view, record.test, record.clearance):
        return [
            nothing(
                record.id,
                f"{impacts.n} impacts found; M and r by their flights need the displacement of the "
                "mass at each: it was not recorded, and is integrated from the acceleration only "
                "in a periodic test with one ball",
            )
        ]
    try:
        integrated = integrated_impacts(view, impacts, frequency=frequency)
    except AnalysisError as error:
        return [nothing(record.id, f"{impacts.n} impacts found; no M and r by flights: {error}")]
    law, phase = integrated.motion.law, integrated.motion.phase_error
    note = (
        "the displacement of the mass is the integral of its acceleration: M and r by flights "
        "depend on this one sensor, whose phase at the oscillation is known to "
        f"{math.degrees(phase):.2g} degrees"
    )
    rows = [Estimate(INTEGRATED, phase, 0.0, "rad", "channels", (record.id,), note)]
    if law.has_corner:
        corner = ("accelerometer_corner", law.corner, law.corner_error, "Hz")
        rows += estimates_of(record, "channels", [corner])
    if math.isfinite((own := integrated.motion.own).value):
        rows.append(
            Estimate(F0_INTEGRATED, own.value, own.error, "Hz", "motion of the mass", (record.id,),
                     data={"by_area": own.by_area, "by_late": own.by_late})
        )  # fmt: skip
    return rows + impact_estimates(record, known, impacts, frequency, None, integrated)


def _swing(record: Record, view: RecordView, band: RecordView, frequency: float) -> list[Estimate]:
    """Amplitude at which a periodic test with impacts works: the effective one, m.

    Of a release, about how fast it swings, Hz: where nothing else shows f0, its flights need it.
    """
    if record.test == "transient":
        return estimates_of(record, "channels", [(SWINGS_AT, frequency, 0.0, "Hz")])
    if record.test != "periodic":
        return []
    if "displacement" in view.roles:
        x = displacement_of(view, frequency)[0]
    elif "displacement" in band.roles:  # of the accelerometer, without its pulses
        x = channel_means(
            band, "displacement", group_size(view.sample_rate, frequency, points=POINTS)
        )
    else:
        return []
    return estimates_of(
        record, "displacement", [("working_amplitude", math.sqrt(2.0) * float(x.std()), 0.0, "m")]
    )


def _released(record: Record, seen: Sequence[Row]) -> list[Estimate]:
    """Displacement from which the mass was let go, m with its sign, where the record shows it."""
    return [
        one
        for row in seen
        for one in estimates_of(
            record, HELD if row["held"] else FIRST_SWING,
            [("release_seen", row["x"], row["error"], "m")],
        )
    ]  # fmt: skip


def _free(
    record: Record, view: RecordView, impacts: Impacts, frequency: float,
    agreement: Agreement | None,
) -> list[Estimate]:  # fmt: skip
    """f0 and zeta of a release, as the mass moves between its impacts."""
    if "displacement" not in view.roles:
        return []
    late = 0.0 if agreement is None else agreement.lag
    motion = free_motion(view, impacts, frequency=frequency, late=late)
    if motion is None:
        return []
    values = {
        "f0": (motion.f0, motion.f0_error, "Hz"), "zeta": (motion.zeta, motion.zeta_error, "1")
    }  # fmt: skip
    return [
        Estimate(IN_RELEASE[name], value, error, unit, "motion of the mass", (record.id,),
                 amplitude=motion.amplitude)
        for name, (value, error, unit) in values.items()
    ]  # fmt: skip


def _driven(
    record: Record, view: RecordView, impacts: Impacts | None, frequency: float,
    agreement: Agreement | None, base: Row | None,
) -> list[Estimate]:  # fmt: skip
    """The base of a periodic test: as its channel shows it, and as the mass answers it.

    Where `impacts` are not all known (None), what those not found take from the mass would be
    damping.
    """
    if record.test != "periodic":
        return []
    found, amplitude = [], None
    if base is not None:
        amplitude = base["amplitude_m"]
        rows = [
            ("base_seen", amplitude, base["amplitude_error_m"], "m"),
            ("base_frequency", base["frequency_hz"], base["frequency_error_hz"], "Hz"),
        ]
        found += estimates_of(record, "base channel", rows)
    if impacts is not None and "displacement" in view.roles:
        stated = sum(record.frequency) / 2.0 if record.frequency else None
        late = 0.0 if agreement is None else agreement.lag
        motion = driven_motion(
            view, impacts, frequency=frequency, stated=stated, late=late, amplitude=amplitude
        )
        if motion is not None:
            count = float(motion.flights)
            found.append(
                Estimate(DRIVEN, count, 0.0, "1", "motion of the mass", (record.id,),
                         data=motion.as_lists())
            )  # fmt: skip
    return found


def _drop(record: Record, impacts: Impacts) -> list[Estimate]:
    found, note = bounces_of(impacts), ""
    if found.power:
        fast, slow = found.range
        note = (
            f"r goes from {fast:.3g} at {found.speeds.max():.2g} m/s to {slow:.3g} at "
            f"{found.speeds.min():.2g} m/s (its "
            "speed, the air or the spin of the ball): the error of r holds this range. Drop it "
            "from where it hits as fast as in the tests"
        )
    speeds = {"speeds": found.speeds.tolist()}
    return [Estimate("r", found.r, found.error, "1", "drop", (record.id,), note, data=speeds)]


def _agreement(record: Record, agreement: Agreement) -> list[Estimate]:
    rows = [
        ("accelerometer_gain", agreement.gain, agreement.gain_error, "1"),
        ("channel_lag", agreement.lag, agreement.lag_error, "s"),
        ("phase_lag", agreement.phase_lag, agreement.phase_lag_error, "s"),
    ]
    if math.isfinite(agreement.corner):
        rows.append(("accelerometer_corner", agreement.corner, agreement.corner_error, "Hz"))
    if agreement.across:
        rows.append(("accelerometer_across", agreement.across, agreement.across_error, "1"))
    return estimates_of(record, "channels", rows)
