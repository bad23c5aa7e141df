"""What ball and contact do beyond the model, as corrections of flights between the walls.

The mean speed of a flight is known from where and when it began and ended. The speeds at its ends
differ from it by what the ball meets on its way, each effect in its own way:

    rubbing on the floor, mu g     the ball arrives slower and had left faster by mu g T/2
    tilt, an acceleration g_t      + g_t T/2 at the end, - g_t T/2 at the beginning
    clearance b + d                2 d/T more between walls, at both ends
    contact of duration tau        the way took T - tau: tau/T of the relative speed more
    rolling without slip, s        + s (v - mean v of the mass) at either end

A collision then gives two equations: relative speed after over before is r of that wall at that
speed; and M times the jump of the oscillator is -m times that of the ball.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vinesexp.identification.flights import Flights
from vinesexp.identification.least_squares import least_squares

FloatArray = NDArray[np.float64]

#: Effects in the order of their price, with their units. Walls differ by `r_wall_difference`.
EFFECTS = {
    "r_wall_difference": "1",
    "r_speed_slope": "s/m",
    "friction": "m/s^2",
    "clearance_offset": "m",
    "contact_time": "s",
    "tilt": "m/s^2",
    "rolling": "1",
}
#: No rig is farther from the model than this: keeps what the records cannot show within bounds.
_WIDEST = {
    "r_wall_difference": 0.5,
    "r_speed_slope": 0.5,
    "friction": 3.0,
    "clearance_offset": 5e-3,
    "contact_time": 5e-3,
    "tilt": 3.0,
    "rolling": 0.5,
}
_WIDEST_R, _WIDEST_LN = 0.5, 3.0
#: Effects that cannot be negative.
POSITIVE = ("friction", "contact_time", "rolling")
#: Error of a record's r that the model of the displacement around an impact leaves.
_FLOOR_R = 4e-5
#: The same of its mass ratio, relative.
_FLOOR_M = 3e-4
_FAR = 30.0  # of ln(M/m): no rig is that far from one
_START = (0.6, 5.0)  # r, ln(M/m)
_TINY = 1e-12


@dataclass(frozen=True)
class Collisions:
    """Collisions of one ball in several records.

    Attributes
    ----------
    flights : Flights
        Of all records, one after the other.
    record : int array (n,)
        Which record each is from.
    working_speed : float
        m/s; where r depends on speed, the r that is reported is the one at it.
    sigma_r, sigma_jump : arrays (n,)
        Standard errors of the two equations, m/s, record-wide ones included.
    """

    flights: Flights
    record: NDArray[np.int64]
    working_speed: float
    sigma_r: FloatArray
    sigma_jump: FloatArray


@dataclass(frozen=True)
class Fit:
    """A model fitted to collisions.

    Attributes
    ----------
    effects : tuple of str
    values, covariance : arrays (2 + effects,)
        r, ln(M/m), then the effects.
    chi2 : float
    scale : float
        Chi-squared of the records' means over their number less that of parameters, at least 1.
    """

    effects: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    chi2: float
    scale: float

    def of(self, effect: str) -> tuple[float, float]:
        """Value and standard error of an effect."""
        i = 2 + self.effects.index(effect)
        return float(self.values[i]), float(np.sqrt(max(self.covariance[i, i], 0.0)))


def fit(
    collisions: Collisions, effects: Sequence[str], *, prior: tuple[float, float] | None = None
) -> Fit:
    """Least squares of both equations over all collisions.

    Parameters
    ----------
    collisions : Collisions
    effects : sequence of str
        Of `EFFECTS`; the others are taken as absent.
    prior : tuple (value, error), optional
        ln(M/m) from elsewhere.
    """
    start = np.zeros(2 + len(effects))
    start[:2] = _START

    def problem(p: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        if not abs(p[1]) < _FAR:
            return None
        rest, jacobian = _weighted(collisions, effects, p, prior)
        return (rest, jacobian) if np.isfinite(jacobian).all() else None

    found = least_squares(problem, start)
    rest, _ = _weighted(collisions, effects, found.values, prior)
    scale = _scale(collisions, rest, start.size)
    return Fit(tuple(effects), found.values, found.covariance, found.chi2, scale)


def _scale(collisions: Collisions, rest: FloatArray, parameters: int) -> float:
    """How much more the means of records and walls scatter than single collisions let expect."""
    n = collisions.record.size
    wall = 2 * collisions.record + (collisions.flights.side > 0.0)
    total, groups = 0.0, 0
    for part in (rest[:n], rest[n : 2 * n]):
        count = np.bincount(wall)
        sums = np.bincount(wall, weights=part)
        total += float((sums[count > 0] ** 2 / count[count > 0]).sum())
        groups += int((count > 0).sum())
    return max(1.0, total / max(1, groups - parameters))


def _weighted(
    c: Collisions, effects: Sequence[str], p: FloatArray, prior: tuple[float, float] | None
) -> tuple[FloatArray, FloatArray]:
    """Residuals over their errors and the derivatives."""
    rest = _rest(c, effects, p)
    columns = []
    for i in range(p.size):
        name = effects[i - 2] if i >= 2 else ""
        step = {"clearance_offset": 1e-6, "contact_time": 1e-6}.get(name, 1e-5)
        moved = p.copy()
        moved[i] += step
        columns.append((_rest(c, effects, moved) - rest) / step)
    jacobian = np.stack(columns, axis=1)
    centre = np.array([_START[0], _START[1], *([0.0] * len(effects))])
    width = np.array([_WIDEST_R, _WIDEST_LN, *(_WIDEST[name] for name in effects)])
    if prior is not None:
        centre[1], width[1] = prior
    return (
        np.concatenate([rest, (p - centre) / width]),
        np.concatenate([jacobian, np.diag(1.0 / width)]),
    )


def _rest(c: Collisions, effects: Sequence[str], p: FloatArray) -> FloatArray:
    f = c.flights
    of = dict(zip(effects, p[2:], strict=True))
    u_before, u_after = corrected(f, of)
    before, after = f.v_before - u_before, f.v_after - u_after
    r = p[0] + 0.5 * of.get("r_wall_difference", 0.0) * f.side
    r = r + of.get("r_speed_slope", 0.0) * (np.abs(before) - c.working_speed)
    bounce = (after + r * before) / c.sigma_r
    momentum = (f.jump + np.exp(-p[1]) * (u_after - u_before)) / c.sigma_jump
    return np.concatenate([bounce, momentum])


def corrected(f: Flights, effects: dict[str, float]) -> tuple[FloatArray, FloatArray]:
    """Velocities of the ball just before and just after each impact, with these effects, m/s."""
    rub, offset = effects.get("friction", 0.0), effects.get("clearance_offset", 0.0)
    tilt, contact = effects.get("tilt", 0.0), effects.get("contact_time", 0.0)
    before = f.u_before + 0.5 * (rub * f.side + tilt) * f.time_before
    after = f.u_after + 0.5 * (rub * f.side - tilt) * f.time_after
    before = before - 2.0 * f.side * offset / f.time_before
    after = after + 2.0 * f.side * offset / f.time_after
    if contact:
        carried_before = f.u_before - 0.5 * (f.v_previous + f.v_before)
        carried_after = f.u_after - 0.5 * (f.v_after + f.v_next)
        before = before + contact * carried_before / f.time_before
        after = after + contact * carried_after / f.time_after
    if rolling := effects.get("rolling", 0.0):
        # The floor takes the ball along by a share of the change of its own velocity.
        way = 2.0 * f.side * f.clearance
        before = before + rolling * (f.v_before - f.u_before - way / f.time_before)
        after = after + rolling * (f.v_after - f.u_after + way / f.time_after)
    return before, after


def collisions_of(
    flights: Sequence[Flights], *, r_error: float = 0.0, mass_error: float = 0.0
) -> Collisions:
    """Collisions of all records with the errors that their own scatter shows.

    What scatters around the richest model is chance; to it comes what a whole record may be off by.

    Parameters
    ----------
    flights : sequence of Flights
        One for each record.
    r_error, mass_error : float
        What the sensors leave unknown of r, and of the momentum, relative.
    """
    floors = max(_FLOOR_R, r_error), max(_FLOOR_M, mass_error)
    joined = Flights(
        *(
            np.concatenate([getattr(f, name) for f in flights])
            for name in Flights.__dataclass_fields__
        )
    )
    record = np.concatenate([np.full(f.index.size, i) for i, f in enumerate(flights)])
    speed = np.abs(joined.v_before - joined.u_before)
    ones = np.ones(record.size)
    first = Collisions(joined, record, float(np.median(speed)), ones, joined.jump_error)
    richest = fit(first, tuple(EFFECTS))
    rest = _rest(first, richest.effects, richest.values)
    sigma_r, sigma_jump = np.empty(record.size), np.empty(record.size)
    for i in range(len(flights)):
        own = np.flatnonzero(record == i)
        if not own.size:
            continue
        for part, sigma, floor, size in (
            (rest[own], sigma_r, floors[0], speed[own]),
            (rest[record.size + own] * joined.jump_error[own], sigma_jump, floors[1],
             np.abs(joined.jump[own])),
        ):  # fmt: skip
            chance = 1.4826 * float(np.median(np.abs(part - np.median(part)))) + _TINY
            sigma[own] = np.hypot(chance, np.sqrt(own.size) * floor * size)
    return Collisions(joined, record, first.working_speed, sigma_r, sigma_jump)
