"""Impacts of all records held against one another, before anything is combined.

Accelerometer against laser, wall against wall, record against record, speed against speed. Where
they agree, the estimates of the single records stand as they are. Where they do not, the cause is
named, and one estimate for all records takes their place, with an error that holds what the
sources show.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.identification.addedmass import added_mass
from vinesexp.identification.collision_evidence import Evidence, weigh
from vinesexp.identification.collision_model import EFFECTS, Collisions, collisions_of, fit
from vinesexp.identification.collision_words import effect_checks, ratio_check, sensor_check
from vinesexp.identification.estimate import Estimate
from vinesexp.identification.flights import Flights, flights_of
from vinesexp.identification.jump_ratio import common_ratio, ratio_of
from vinesexp.identification.sensor_fault import Fault, fault_of, mended
from vinesexp.records.campaign import Campaign
from vinesexp.records.checks import Check
from vinesexp.signals.impacts.impact_table import Impacts

METHOD = "impacts"
_FEWEST = 10
#: Collisions of a record; more add nothing to what a whole record may be off by.
_ENOUGH = 150
#: Relative error of M by added masses below which no scale in a lab goes.
_SCALES = 3e-3
#: Second harmonic of the base from which on it is felt, and the relative error of r and of the
#: momentum of a whole record that it makes, over itself.
_HARMONIC, _OF_HARMONIC = 0.01, 0.02
#: Relative error of r by that of the phase of all velocities, 1/rad.
_OF_PHASE = 0.35
#: Share by which M of added masses and of impacts differ that no effect of a ball explains.
_NO_EFFECT = 0.15
#: The nominal period, s, where nothing gives f0: only flights too long to be one are left out.
_NO_PERIOD = math.inf


@dataclass(frozen=True)
class Consistent:
    """Estimates that can be combined, what else the impacts show, and what is to be said.

    Attributes
    ----------
    estimates : list of Estimate
        Of all records; r and M of impacts replaced by one each where the records disagree.
    effects : list of Estimate
        Rows of identified.csv on ball, walls and contact.
    checks : list of Check
    """

    estimates: list[Estimate]
    effects: list[Estimate]
    checks: list[Check]


def consistent_impacts(
    found: Sequence[Estimate], campaign: Campaign, impacts: Mapping[str, Impacts]
) -> Consistent:
    """Hold the impacts of a campaign against one another.

    Parameters
    ----------
    found : sequence of Estimate
        Of all records (`identification.one_record.estimate_record`).
    campaign : Campaign
    impacts : mapping
        Record id to its impact table; only tests with one ball are looked at.
    """
    flights = _flights(found, campaign, impacts)
    if not flights:
        return Consistent(list(found), [], [])
    ids = tuple(record.id for record in campaign.records if record.id in flights)
    prior = _prior(found, campaign)
    ratios = [one for one in map(ratio_of, flights.values()) if one is not None]
    ratio = common_ratio(ratios)
    gain = _gain(found, ids)
    fault = fault_of(list(flights.values()), ratio=ratio, gain=gain, prior=prior)
    shaken = _shaken(found, ids)
    collisions = collisions_of(
        [mended(f, fault) for f in flights.values()],
        r_error=math.hypot(fault.r_error if fault else 0.0, shaken),
        mass_error=math.hypot(fault.mass_error if fault else 0.0, shaken),
    )
    evidence = weigh(collisions, prior=_credible(prior, collisions))
    effects = [*_effect_rows(evidence, ids), *_effective_rows(evidence, found, campaign, ids)]
    if "r_speed_slope" in evidence.best.effects:  # the speed at which r holds
        effects.append(Estimate("r_speed", collisions.working_speed, 0.0, "m/s", METHOD, ids))
    if ratio is not None:
        effects.append(Estimate("jump_ratio", ratio.ratio, ratio.error, "1", METHOD, ids))
    checks = [*effect_checks(evidence), *ratio_check(ratio, fault), *sensor_check(fault)]
    if fault is None and not evidence.best.effects:
        return Consistent(list(found), effects, checks)
    return Consistent(_replaced(found, campaign, evidence, fault, ids), effects, checks)


def _flights(
    found: Sequence[Estimate], campaign: Campaign, impacts: Mapping[str, Impacts]
) -> dict[str, Flights]:
    """Of every record with one ball that shows enough of them.

    In the order of their names: fits of many effects carry the last digits of a sum further.
    """
    f0 = sorted(e.value for e in found if e.parameter == "f0")
    flights = {}
    for record in sorted(campaign.records, key=lambda one: one.id):
        if record.id not in impacts or len(record.clearance) != 1 or record.exclude:
            continue
        frequency = f0[len(f0) // 2] if f0 else np.mean(record.frequency or (0.0,))
        period = 1.0 / float(frequency) if frequency else _NO_PERIOD
        own = flights_of(impacts[record.id], nes=1, b=record.clearance[0], period=period)
        own = own.keep(_whole(own))
        if own.index.size >= _FEWEST:
            # Every second one would be of one wall.
            flights[record.id] = own.keep(np.arange(own.index.size) % _stride(own.index.size) == 0)
    return flights


def _whole(flights: Flights) -> NDArray[np.bool_]:
    """Where everything is known."""
    total = flights.v_before + flights.v_previous + flights.v_next + flights.jump
    return np.asarray(np.isfinite(total))


def _stride(n: int) -> int:
    """An odd number: what is left of n collisions is enough, and of both walls."""
    return 2 * (n // (2 * _ENOUGH)) + 1


def _prior(found: Sequence[Estimate], campaign: Campaign) -> tuple[float, float] | None:
    """ln(M/m) from added masses and the weighed ball."""
    if not campaign.known.nes_mass:
        return None
    loads = {record.id: record.added_mass or 0.0 for record in campaign.records}
    source, _ = added_mass(found, loads, campaign.known.uncertainties)
    if source is None:
        return None
    M = source.total
    ball = campaign.known.nes_mass[0]
    error = math.hypot(M.std_error / M.value, _SCALES, ball.std_error / ball.value)
    return math.log(M.value / ball.value), error


def _credible(
    prior: tuple[float, float] | None, collisions: Collisions
) -> tuple[float, float] | None:
    """The ratio by added masses, unless the impacts are farther from it than any effect explains.

    A ball or masses that were weighed wrong would else ask for effects that are not there.
    """
    if prior is None or abs(fit(collisions, ()).values[1] - prior[0]) > _NO_EFFECT:
        return None
    return prior


def _gain(found: Sequence[Estimate], ids: Sequence[str]) -> tuple[float, float] | None:
    """Accelerometer's gain beside the laser's over the oscillation: median and its error."""
    own = [e for e in found if e.parameter == "accelerometer_gain" and e.records[0] in ids]
    if not own:
        return None
    values = np.abs([e.value for e in own])
    spread = 1.4826 * float(np.median(np.abs(values - np.median(values))))
    error = math.hypot(spread, float(np.median([e.std_error for e in own])))
    return float(np.median(values)), error / math.sqrt(len(own))


def _shaken(found: Sequence[Estimate], ids: Sequence[str]) -> float:
    """What a base that is no sine leaves unknown of a record's r and momentum, relative.

    Velocities at impacts are read off a displacement of one frequency. Where that is the integral
    of the acceleration, its phase turns them all alike.
    """
    turned = [e.value for e in found if e.parameter == "integrated_phase" and e.records[0] in ids]
    shares = [e.value for e in found if e.parameter == "base_harmonic" and e.records[0] in ids]
    largest = max(shares, default=0.0)
    distorted = _OF_HARMONIC * largest if largest > _HARMONIC else 0.0
    return math.hypot(distorted, _OF_PHASE * max(turned, default=0.0))


def _effect_rows(evidence: Evidence, ids: tuple[str, ...]) -> list[Estimate]:
    """Chosen effects as estimates; walls that differ as one r each."""
    rows = []
    for name in evidence.best.effects:
        value, error = evidence.best.of(name)
        if name == "r_wall_difference":
            for wall, sign in (("plus", 0.5), ("minus", -0.5)):
                own = math.hypot(0.5 * error, evidence.r_error)
                rows.append(
                    Estimate(f"r_wall_{wall}", evidence.r + sign * value, own, "1", METHOD, ids)
                )
        else:
            rows.append(Estimate(name, value, error, EFFECTS[name], METHOD, ids))
    return rows


def _effective_rows(
    evidence: Evidence, found: Sequence[Estimate], campaign: Campaign, ids: tuple[str, ...]
) -> list[Estimate]:
    """r and mass of the ball with which the model moves as the rig does: what b_c takes."""
    if evidence.effective is None:
        return []
    (r, r_error), (ln_ratio, ln_error) = evidence.effective
    rows = [Estimate("r_effective", r, r_error, "1", METHOD, ids)]
    prior = _prior(found, campaign)
    if prior is not None and "contact_time" in evidence.best.effects:
        ball = campaign.known.nes_mass[0].value
        share = math.exp(prior[0] - ln_ratio)
        # Whether it is the contact or the sheet, the motion is that of this mass.
        error = ball * math.hypot(share * ln_error, 0.15 * (share - 1.0))
        rows.append(Estimate("nes_mass_effective", ball * share, error, "kg", METHOD, ids))
    return rows


def _replaced(
    found: Sequence[Estimate], campaign: Campaign, evidence: Evidence, fault: Fault | None,
    ids: tuple[str, ...],
) -> list[Estimate]:  # fmt: skip
    """One r and one M of all records with one ball, in the place of those of the single ones."""
    kept = [
        e
        for e in found
        if not (e.method == METHOD and e.parameter in ("r", "M") and set(e.records) <= set(ids))
    ]
    r_error = math.hypot(evidence.r_error, fault.r_error if fault else 0.0)
    kept.append(Estimate("r", evidence.r, r_error, "1", METHOD, ids))
    if any(e.parameter == "M" and e.method == METHOD for e in found):
        M = campaign.known.nes_mass[0].value * math.exp(evidence.ln_ratio)
        relative = math.hypot(evidence.ln_ratio_error, fault.mass_error if fault else 0.0)
        kept.append(Estimate("M", M, M * relative, "kg", METHOD, ids))
    return kept
