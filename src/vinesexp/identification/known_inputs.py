"""What known inputs contribute to the error of a mean of records."""

from __future__ import annotations

from collections.abc import Sequence

from vinesexp.identification.average import Mean
from vinesexp.identification.estimate import Estimate
from vinesexp.records.campaign import Campaign, Record
from vinesexp.records.uncertainties import Uncertainties


def parts_of_known_inputs(
    value: Estimate, alike: Sequence[Estimate], mean: Mean, campaign: Campaign
) -> dict[str, float]:
    """Contributions to the mean of one method's records, each input's with its sign.

    Parameters
    ----------
    value : Estimate
        The mean.
    alike : sequence of Estimate
        Those that it is the mean of, with the weights of `mean`.
    mean : Mean
    campaign : Campaign
        For clearances, balls and the uncertainties of known inputs.

    Returns
    -------
    dict
        Input to contribution, in the unit of the estimate; those of 0 left out.
    """
    inputs = campaign.known.uncertainties
    if value.parameter == "f0":
        parts = {"clock": value.value * inputs.clock.of(1.0)}
    elif value.method == "impacts":
        parts = {}
        for e, weight in zip(alike, mean.weights, strict=True):
            number = _ball_of(e)
            record = campaign.record(e.records[0])
            clearances = record.clearance
            clearance = clearances[min(number, len(clearances) - 1)]
            here = parts_of_impacts(
                e, clearance=clearance, ball=_ball_error(campaign, number), inputs=inputs,
                laser=not _is_integrated(campaign, record),
            )  # fmt: skip
            for name, part in here.items():
                parts[name] = parts.get(name, 0.0) + float(weight) * part
    elif value.method == "drop":  # a wall that gives, a drop that is not plumb
        parts = {"model: drop": value.value * inputs.model.of(1.0)}
    else:
        parts = {}
    return {name: part for name, part in parts.items() if part}


def _is_integrated(campaign: Campaign, record: Record) -> bool:
    """Whether the accelerometer alone shows how the mass of a record moved."""
    channels = campaign.setup_of(record).channels
    return "acceleration" in channels and "displacement" not in channels


def _ball_of(e: Estimate) -> int:
    return int(e.parameter[2:]) - 1 if is_numbered(e.parameter) else 0


def _ball_error(campaign: Campaign, number: int) -> float:
    """Relative standard uncertainty of a ball's mass; one value stands for all balls."""
    balls = campaign.known.nes_mass
    ball = balls[min(number, len(balls) - 1)] if balls else None
    return ball.std_error / ball.value if ball else 0.0


def parts_of_impacts(
    estimate: Estimate, *, clearance: float, ball: float, inputs: Uncertainties, laser: bool = True
) -> dict[str, float]:
    """What known inputs contribute to M and r from flights between walls at one clearance.

    M = m du/dv: the ball's velocities du scale with the clearance, the jumps dv with the
    accelerometer and the area of the pulse. r is a ratio of velocities relative to the wall, of the
    mass (displacement) and of the ball (clearance): if one of them is off by a share s, r is off
    by (1 - r^2)/2 s (exact for two symmetric impacts a cycle).

    Parameters
    ----------
    estimate : Estimate
        M or r of one record.
    clearance : float
        m.
    ball : float
        Relative standard uncertainty of its mass.
    inputs : Uncertainties
    laser : bool
        Whether a displacement was recorded; else it is the integral of the acceleration.
    """
    value = estimate.value
    setting = inputs.clearance.of(clearance) / clearance
    sensor = "displacement" if laser else "acceleration"
    gain = getattr(inputs, sensor).of(1.0)
    if estimate.parameter == "M":
        return {
            "ball mass": value * ball,
            "clearance": value * setting,
            "acceleration gain": -value * inputs.acceleration.of(1.0),
            "template": -value * inputs.template.of(1.0),
            "model: impacts": value * inputs.model.of(1.0),
        }
    lever = 0.5 * (1.0 - value * value)
    return {
        "clearance": lever * setting,
        f"{sensor} gain": -lever * gain,
        "model: impacts": value * inputs.model.of(1.0),
    }


def is_numbered(parameter: str) -> bool:
    """Whether it is r of one of several balls: ``r_1``."""
    return parameter.startswith("r_") and parameter[2:].isdigit()
