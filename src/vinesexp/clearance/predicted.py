"""Predictions from identified values: b_c and b_t, and the curves that go through them.

The identified k1 and c1 are made from M, f0 and zeta, so their errors go together: intervals are by
the errors of those. Else the error of f0, known to a few parts in a million, would be taken for
that of k1, known to a few in a thousand.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.clearance.levels import LevelBase, PeriodicLevel, Rows
from vinesexp.errors import AnalysisError
from vinesexp.identification.budget import BASE, EFFECT, FREQUENCY, RECORDS, RELEASE
from vinesexp.records.campaign.schema import Known
from vinesexp.rig import NES, RIG_VALUES, Oscillator, Rig
from vinesexp.units import COVERAGE_95, Quantity

if TYPE_CHECKING:
    from vinesexp.identification.joint.whole import RigPosterior
    from vinesexp.theory.intervals import ClearancePrediction


class UnpredictedError(AnalysisError):
    """No prediction, whatever the level: a value is not known, or theory has no such ball."""


#: Why there is none of a ball that neither slides nor rolls all the way.
ROLLS_IN_PART = (
    "the ball slides when it leaves a wall and rolls before it reaches the other; theory and "
    "simulation know balls that slide or roll all the way, so there is no prediction and no replay"
)


@dataclass(frozen=True)
class IdentifiedRig:
    """What is known of the rig for predictions; SI.

    Attributes
    ----------
    values : of those of `RIG_VALUES` that are known.
    f0, zeta : natural frequency, Hz, and damping ratio where identified, at the amplitude of the
        periodic tests.
    balls : what b_c is simulated with where the ball is more than m and r: what each of these moves
        it by, all together.
    rolling : share s of the floor's motion that a ball takes which rolls. It moves as one of mass
        m (1 - s) that slides in a cavity of clearance b/(1 - s) on a mass M + s m: exactly, as the
        ball's place less s times that of the mass, over 1 - s, moves uniformly between the walls.
    joint : how the errors of all these and of the base amplitudes go together, where all records
        were estimated at once.
    stiffens : f0 of small motion, Hz, and kappa, 1/m^2, of a spring whose f0 goes with
        1 + kappa A^2.
    slides : whether the ball slides all the way from wall to wall, or rolls all the way.
    unsimulated : whether the ball has an effect that b_c is not simulated with.
    """

    values: Mapping[str, Quantity]
    f0: Quantity | None = None
    zeta: Quantity | None = None
    balls: tuple[NES, ...] = ()
    rolling: float = 0.0
    joint: RigPosterior | None = None
    stiffens: tuple[float, float] | None = None
    slides: bool = True
    unsimulated: bool = False

    @property
    def missing(self) -> tuple[str, ...]:
        """Values without which nothing periodic can be predicted."""
        return tuple(name for name in RIG_VALUES if name not in self.values)

    @property
    def unpredicted(self) -> str:
        """Why theory says nothing of it, whatever the level; empty where it does."""
        if self.missing:
            return f"it takes {', '.join(self.missing)}, which the records do not give"
        return "" if self.slides else ROLLS_IN_PART

    @property
    def predictable(self) -> bool:
        """Whether theory has such a rig, and every value that it needs is known."""
        return not self.unpredicted

    @property
    def half_period(self) -> float:
        """Of the oscillator, s: times to an amplitude that are closer are alike; 0 if unknown."""
        return 0.5 / self.f0.value if self.f0 else 0.0

    @property
    def numbers(self) -> dict[str, float]:
        """The values of `RIG_VALUES`, all of them known, without their errors."""
        return {name: self.values[name].value for name in RIG_VALUES}

    def plain(self, b: float) -> Rig:
        """The rig with one ball of clearance b, m, as the plain model has it."""
        value = self.numbers
        host = Oscillator(M=value["M"], c1=value["c1"], k1=value["k1"])
        return Rig(host, nes=[NES(m=value["m"], b=b, r=value["r"])])


def identified_rig(
    identified: Rows, known: Known, joint: RigPosterior | None = None
) -> IdentifiedRig:
    """The `combined` rows of identified.csv and the weighed ball.

    With friction, or where a contact lasts, the effective r and mass of the ball take their places:
    with these the plain model moves much as the rig does. b_c is simulated with the ball as it is.
    """
    found = {
        row["parameter"]: Quantity(float(row["value"]), float(row["std_error"] or 0.0))
        for row in identified
        if row["method"] == "combined"
    }
    values: dict[str, Quantity] = {
        name: found[name] for name in ("M", "c1", "k1", "r") if name in found
    }
    if weighed := found.get("m") or next(iter(known.nes_mass), None):
        values["m"] = weighed
    rows = {row["parameter"]: row for row in identified}
    effects = {name: float(rows[name]["value"]) for name in OF_BALL if name in rows}
    balls: tuple[NES, ...] = ()
    if effects and {"r", "m"} <= set(values):
        own = values["r"].value, values["m"].value
        if joint is not None and joint.ball is not None:
            own = joint.ball
        balls = _as_simulated(*own, effects)
    for name, effective in (("r", "r_effective"), ("m", "nes_mass_effective")):
        if effective in rows and name in values:
            row = rows[effective]
            values[name] = Quantity(float(row["value"]), float(row["std_error"] or 0.0))
    if joint is not None and joint.ball is not None:  # with what is too small to be named
        for name in {"r", "m"} & set(values):
            shown = joint.of(name)
            values[name] = values[name] if shown is None else Quantity(*shown)
    rolling = effects.get("rolling", 0.0)
    if rolling and {"M", "m"} <= set(values):
        M, m = values["M"], values["m"]
        values["M"] = Quantity(M.value + rolling * m.value, M.std_error)
        values["m"] = Quantity((1.0 - rolling) * m.value, (1.0 - rolling) * m.std_error)
    spring = [float(rows[name]["value"]) for name in ("f0_small", "stiffening") if name in rows]
    stiffens = (spring[0], spring[1]) if len(spring) == 2 else None
    f0, zeta, slides = found.get("f0"), found.get("zeta"), "rolls_from" not in effects
    unsimulated = bool(_UNSIMULATED & effects.keys())
    return IdentifiedRig(values, f0, zeta, balls, rolling, joint, stiffens, slides, unsimulated)


#: Effects of the ball that the simulation of b_c does not have.
_UNSIMULATED = {"hollow", "drag", "viscous"}


def cubic_stiffness(k1: float, kappa: float) -> float:
    """k3, N/m^3, with which f0 of free motion goes with 1 + kappa A^2: 3/8 k3/k1 = kappa.

    Examples
    --------
    >>> cubic_stiffness(1.2e4, 30.0)
    960000.0
    """
    return 8.0 / 3.0 * k1 * kappa


#: Rows of identified.csv on the ball beyond its mass and r.
OF_BALL = (
    "friction", "tilt", "r_wall_plus", "r_wall_minus", "r_speed_slope", "r_speed",
    "contact_time", "r_effective", "nes_mass_effective", "rolling", "hollow", "drag", "viscous",
    "rolls_from",
)  # fmt: skip


def ball_of(m: float, b: float, r: float, effects: Mapping[str, float]) -> NES:
    """A ball with the effects that were found, all but a pull to the middle, drag and oil.

    Examples
    --------
    >>> ball = ball_of(0.032, 0.03, 0.6, {"r_wall_plus": 0.62, "r_wall_minus": 0.58, "tilt": 0.1})
    >>> round(ball.r, 3), round(ball.r_minus, 3), ball.tilt
    (0.62, 0.58, 0.1)
    """
    # A ball that rolls moves as a lighter one that slides in a longer cavity.
    slides = 1.0 - effects.get("rolling", 0.0)
    slope = effects.get("r_speed_slope", 0.0)
    half = 0.5 * (effects.get("r_wall_plus", 0.0) - effects.get("r_wall_minus", 0.0))
    r = r - slope * effects.get("r_speed", 0.0)
    return NES(
        m=slides * m,
        b=b / slides,
        r=_share(r + half),
        r_minus=_share(r - half) if half else None,
        r_slope=slope,
        friction=max(effects.get("friction", 0.0), 0.0),
        tilt=effects.get("tilt", 0.0),
        contact_time=max(effects.get("contact_time", 0.0), 0.0),
    )


def _share(r: float) -> float:
    return min(max(r, 0.0), 1.0)


def _as_simulated(r: float, m: float, effects: Mapping[str, float]) -> tuple[NES, ...]:
    """The ball as the simulation can have it: friction and a contact that lasts one by one.

    None with a pull to the middle, drag or viscous friction: there the effective r and mass remain.
    """
    if _UNSIMULATED & effects.keys():
        return ()
    ball = ball_of(m, 1.0, r, effects)
    if ball.friction and ball.contact_time:
        lasting = NES(ball.m, ball.b, r, contact_time=ball.contact_time)
        return replace(ball, contact_time=0.0), lasting
    return () if ball == NES(ball.m, ball.b, r) else (ball,)


def end_over_plain(rig: IdentifiedRig, *, G: float, frequency: float | None) -> float:
    """b_c of the ball as it is over that of the plain model with its effective values.

    Raises
    ------
    AnalysisError
        The orbit of a plain ball cannot be followed to that of the ball as it is.
    """
    if not rig.balls or rig.missing:
        return 1.0
    return _end_over_plain(rig.balls, tuple(rig.numbers.items()), G, frequency)


@cache
def _end_over_plain(
    balls: tuple[NES, ...], plain: tuple[tuple[str, float], ...], G: float, frequency: float | None
) -> float:
    from vinesexp.theory.optimal_clearance import b_c_exact
    from vinesexp.theory.simulated_orbit import simulated_end

    values = dict(plain)
    oscillator = Oscillator(values["M"], values["c1"], values["k1"])
    f = frequency or oscillator.f0

    def end_of(m: float, r: float) -> float:
        return float(b_c_exact(G=G, frequency=f, **{**values, "m": m, "r": r}))

    plain_end = end_of(values["m"], values["r"])
    rigs = (Rig(oscillator, [replace(ball, b=plain_end)]) for ball in balls)  # no cavity of 1 m
    end = math.prod(simulated_end(rig, G=G, frequency=f) for rig in rigs)
    for ball in balls[1:]:  # what a second one has moves what the first one gives
        end /= end_of(ball.m, ball.r)
    return end / plain_end


def at_level(rig: IdentifiedRig, levels: Rows, *, G: float) -> IdentifiedRig:
    """The rig with f0, zeta, c1 and k1 of the amplitude at which a level works.

    Parameters
    ----------
    rig : IdentifiedRig
    levels : sequence of mappings
        Rows of level_values.csv; without one of this level the rig stays as it is.
    G : float
        Base amplitude of records.csv, m.
    """
    own = [row for row in levels if abs(1e-3 * float(row["base_amplitude_mm"]) - G) < 1e-6 * G]
    if not own:
        return rig
    row = own[0]
    values = dict(rig.values)
    for name, column in (("c1", "n_s_m"), ("k1", "n_m")):
        if row.get(f"{name}_{column}"):
            pair = row[f"{name}_{column}"], row[f"{name}_error_{column}"]
            values[name] = Quantity(*map(float, pair))
    f0 = Quantity(float(row["f0_hz"]), float(row["f0_error_hz"]))
    zeta = Quantity(float(row["zeta"]), float(row["zeta_error"]))
    return replace(rig, values=values, f0=f0, zeta=zeta)


def in_state(rig: IdentifiedRig, state: str) -> IdentifiedRig:
    """The rig as it was in the tests of one state of it (`RigState`), from the rig of all tests."""
    whole = rig.joint
    own = next((one.rig for one in whole.states if one.name == state), None) if whole else None
    if whole is None or own is None:
        return rig
    sizes = over_whole(whole, own)
    values = {name: _times(one, sizes.get(name, 1.0)) for name, one in rig.values.items()}
    if rig.rolling and {"M", "m"} <= set(values):  # a share of the ball is on the mass
        heavier = values["m"].value - rig.values["m"].value
        values["M"] = replace(
            values["M"], value=values["M"].value + rig.rolling / (1.0 - rig.rolling) * heavier
        )
    balls = rig.balls
    if own.ball is not None and whole.ball is not None:
        more, heavier = own.ball[0] - whole.ball[0], own.ball[1] / whole.ball[1]
        balls = tuple(_other_ball(ball, more, heavier) for ball in balls)
    return replace(
        rig, values=values, balls=balls, joint=own,
        f0=None if rig.f0 is None else _times(rig.f0, sizes["f0"]),
        zeta=None if rig.zeta is None else _times(rig.zeta, sizes["zeta"]),
    )  # fmt: skip


def over_whole(whole: RigPosterior, own: RigPosterior) -> dict[str, float]:
    """Values of the rig of some tests over those of all: f0, zeta, c1, k1, m and r."""
    over = dict(zip(whole.names, (own.values / whole.values).tolist(), strict=True))
    f0, zeta, m, r = (over.get(name, 1.0) for name in ("f0", "zeta", "m", "r"))
    return {"f0": f0, "zeta": zeta, "c1": f0 * zeta, "k1": f0**2, "m": m, "r": r}


def _times(quantity: Quantity, size: float) -> Quantity:
    return Quantity(size * quantity.value, size * quantity.std_error)


def _other_ball(ball: NES, more: float, heavier: float) -> NES:
    """A ball whose r is larger at both walls, and whose mass is another."""
    minus = None if ball.r_minus is None else _share(ball.r_minus + more)
    return replace(ball, m=heavier * ball.m, r=_share(ball.r + more), r_minus=minus)


@dataclass(frozen=True)
class Predicted:
    """A predicted clearance, m: published formula, exact value, its 95 % interval."""

    published: float
    exact: float
    low: float
    high: float
    #: Identified value or input to the standard error of `exact` from it alone, m.
    parts: Mapping[str, float] = field(default_factory=dict)

    def times(self, ratio: float) -> Predicted:
        """All lengths in the same ratio."""
        parts = {name: ratio * part for name, part in self.parts.items()}
        published, exact, low, high = (
            ratio * b for b in (self.published, self.exact, self.low, self.high)
        )
        return Predicted(published, exact, low, high, parts)


def predicted_b_c(rig: IdentifiedRig, *, base: LevelBase, level: float) -> Predicted:
    """b_c for the base of a level; the errors of the base are part of the interval.

    Without a frequency that the tests share, the oscillator's own is taken. `level` is the base
    amplitude as stated, m, by which the joint errors are known.

    Raises
    ------
    UnpredictedError
        A value is not known, or theory has no such ball.
    AnalysisError
        There is no stable orbit at any clearance.
    """
    from vinesexp.identification.joint.whole import base_at
    from vinesexp.theory.intervals import predict_periodic
    from vinesexp.theory.optimal_clearance import b_c_exact

    _require(rig, RIG_VALUES)
    G, f = base.G.value, base.frequency
    at = None if f is None else f.value
    found = predict_periodic(G=G, values=rig.values, frequency=at)

    def moved(G: float, frequency: float | None, **other: float) -> float:
        return float(b_c_exact(G=G, frequency=frequency, **rig.numbers | other)) - found.exact

    by = {name: found.gradient[name] * rig.values[name].value for name in RIG_VALUES}
    name = base_at(level)
    gradient = {
        "M": by["M"] + by["c1"] + by["k1"],
        "f0": by["c1"] + 2.0 * by["k1"],
        "zeta": by["c1"],
        "r": found.gradient["r"],
        "m": by["m"],
        name: moved(G * (1.0 + _STEP), at) / _STEP,
    }
    more = {}
    if rig.joint is not None and name not in rig.joint.names:  # only the test log knows the base
        more[BASE] = abs(moved(G + base.G.std_error, at))
    if f is not None:
        more[FREQUENCY] = abs(moved(G, f.value + f.std_error))
    if rig.unsimulated and rig.joint is not None and rig.joint.ball is not None:
        r, m = rig.joint.ball  # of magnets b_c was beyond that with their own r
        more[EFFECT] = abs(moved(G, at, r=r, m=(1.0 - rig.rolling) * m))
    plain = _with_errors(found, rig, gradient, more)
    slides = plain.times(end_over_plain(rig, G=G, frequency=at))
    # One that rolls moves so in a shorter cavity.
    return replace(slides, published=plain.published).times(1.0 - rig.rolling)


_STEP = 1e-3  # of G, for its derivative


def _with_errors(
    found: ClearancePrediction,
    rig: IdentifiedRig,
    gradient: Mapping[str, float],
    more: Mapping[str, float],
) -> Predicted:
    """A clearance whose interval holds how the errors of everything it depends on go together.

    Parameters
    ----------
    gradient : mapping
        Its derivatives by the logarithms of what the joint model knows, by r itself.
    more : mapping
        Contributions of what that model does not know, m.
    """
    joint = rig.joint
    if joint is None:
        raise AnalysisError("no prediction without the joint errors of the identified values")
    variance = joint.part(gradient)
    # At the amplitude of a level f0 and zeta are less sure than over all of them together.
    for key, quantity in (("f0", rig.f0), ("zeta", rig.zeta)):
        whole = joint.of(key)
        if quantity is not None and whole is not None:
            wider = (quantity.std_error / quantity.value) ** 2 - (whole[1] / whole[0]) ** 2
            variance += max(wider, 0.0) * gradient.get(key, 0.0) ** 2
    parts = {
        label: math.sqrt(max(joint.part(gradient, covariance), 0.0))
        for label, covariance in joint.parts.items()
    }
    parts = {label: part for label, part in parts.items() if part > 1e-3 * math.sqrt(variance)}
    inputs = math.hypot(*parts.values()) if parts else 0.0
    if inputs > math.sqrt(variance):
        parts = {label: part * math.sqrt(variance) / inputs for label, part in parts.items()}
    rest = math.sqrt(max(variance - sum(part**2 for part in parts.values()), 0.0))
    half = COVERAGE_95 * math.hypot(math.sqrt(variance), *more.values())
    return Predicted(
        found.published,
        found.exact,
        max(found.exact - half, 0.0),
        found.exact + half,
        {**parts, RECORDS: rest, **more},
    )


def predicted_b_t(rig: IdentifiedRig, *, release: Quantity) -> Predicted:
    """b_t for a release, m; UnpredictedError where r is not known."""
    from vinesexp.theory.intervals import predict_transient

    _require(rig, ("r",))
    found = predict_transient(x0=release.value, values=rig.values)
    # b_t is in proportion to the release.
    more = found.exact * release.std_error / release.value if release.value else 0.0
    gradient = {"r": found.gradient["r"]}
    return _with_errors(found, rig, gradient, {RELEASE: more}).times(1.0 - rig.rolling)


def _require(rig: IdentifiedRig, names: Sequence[str]) -> None:
    if missing := [name for name in names if name not in rig.values]:
        raise UnpredictedError(f"no prediction without {', '.join(missing)}")
    if not rig.slides:
        raise UnpredictedError(ROLLS_IN_PART)


# Curves that go through the predictions: amplitude and decay time over clearance.
if TYPE_CHECKING:
    from vinesexp.theory.orbits import Reduced


def end_of_orbit(rig: IdentifiedRig, *, G: float, frequency: float | None) -> float:
    """b_c without its error, m.

    Raises
    ------
    AnalysisError
        A value is not known, or there is no stable orbit at any clearance.
    """
    from vinesexp.theory.optimal_clearance import b_c_exact

    _require(rig, RIG_VALUES)
    plain = float(b_c_exact(G=G, frequency=frequency, **rig.numbers))
    return (1.0 - rig.rolling) * end_over_plain(rig, G=G, frequency=frequency) * plain


def amplitude_curve(
    rig: IdentifiedRig,
    *,
    G: float,
    frequency: float | None,
    low: float | None = None,
    high: float = math.inf,
) -> tuple[FloatArray, FloatArray]:
    """Predicted swing of the mass over clearance, m, in permanent two impacts per cycle.

    Half the swing of the exact symmetric orbit over one period, which is what the amplitude of a
    record is, from `low` (half of b_c) up to the exact b_c; empty where that is below `low` or
    unknown. Of a ball that is more than m and r it is the curve of the plain model, stretched to
    its b_c.
    """
    from vinesexp.theory.orbits import Reduced

    end = 0.0
    with suppress(AnalysisError):
        end = end_of_orbit(rig, G=G, frequency=frequency)
    low = 0.5 * end if low is None else low
    if end <= low:
        return np.empty(0), np.empty(0)
    b = np.linspace(low, min(high, end), 60)
    stretch = (1.0 - rig.rolling) * end_over_plain(rig, G=G, frequency=frequency)
    p = Reduced.of_rig(frequency=frequency, **rig.numbers)
    return b, G * orbit_swing(b / stretch / G, p)


def expected_amplitude(rig: IdentifiedRig, level: PeriodicLevel) -> Callable[[float], float] | None:
    """Clearance, m, to the amplitude of the exact orbit, m, over the tests of a level.

    None where it is not known.
    """
    low = min((test.clearance for test in level.tests), default=None)
    b, swing = amplitude_curve(rig, G=level.G, frequency=level.frequency, low=low)
    return partial(np.interp, xp=b, fp=swing) if b.size and np.isfinite(swing).all() else None


def predicted_lowest(rig: IdentifiedRig, *, G: float, frequency: float | None) -> float | None:
    """Clearance of the smallest swing on the exact orbit, m: a little below b_c.

    None where it cannot be known, or where the swing still falls at b_c.
    """
    b, swing = amplitude_curve(rig, G=G, frequency=frequency)
    if not np.all(np.isfinite(swing)) or not b.size:
        return None
    if (i := int(np.argmin(swing))) in (0, b.size - 1):
        return None
    a0, a1, a2 = swing[i - 1 : i + 2]
    return float(b[i] + 0.5 * (b[1] - b[0]) * (a0 - a2) / (a0 - 2.0 * a1 + a2))


def swing_beside_orbit(
    rig: IdentifiedRig, *, G: float, frequency: float | None
) -> tuple[float, float] | None:
    """Swing on the orbit a little below b_c, and that to which the rig may come there instead, m.

    A spring that stiffens turns its resonance towards a base below it: beside the small motion that
    b_c is of there may be a large one, with two impacts per cycle up to another clearance. By
    simulation with that spring, from rest and from a pull. None where both starts come to the
    orbit, the spring is too straight, or one that softens would not hold the mass.
    """
    from vinesexp.excitation import Harmonic, Release
    from vinesexp.solver.simulation import simulate

    if rig.stiffens is None or rig.missing or rig.f0 is None or rig.zeta is None:
        return None
    b, swing = amplitude_curve(rig, G=G, frequency=frequency)
    if not b.size:
        return None
    at = int(np.argmin(np.abs(b - _BELOW * b[-1])))
    f0, kappa = rig.stiffens
    plain = rig.plain(float(b[at]))
    k1 = plain.oscillator.k1 * (f0 / rig.f0.value) ** 2  # which is at the amplitude of f0
    host = replace(plain.oscillator, k1=k1, k3=cubic_stiffness(k1, kappa))
    whole = replace(plain, oscillator=host)
    f = frequency or f0
    lasts = _SETTLED / (2.0 * math.pi * rig.f0.value * rig.zeta.value)
    largest = 0.0
    for x in (0.0, _PULLED * float(b[at])):
        start = Release(x0=x, v0=0.0, y0=(x - _AT_WALL * float(b[at]),), vy0=(0.0,))
        try:
            motion = simulate(whole, Harmonic(G, f), start, duration=lasts + _LATE / f)
        except AnalysisError:  # beyond the largest force of such a spring
            return None
        late = motion.at(np.linspace(lasts, lasts + _LATE / f, 100 * _LATE))[0]
        largest = max(largest, 0.5 * float(np.ptp(late)))
    # A resonance that is turned by less than half its width is that of a straight spring, beside
    # which a ball that is lost and captured again may swing as far.
    turned = abs(kappa) * largest**2 > rig.zeta.value
    return (float(swing[at]), largest) if turned and largest > _LARGER * swing[at] else None


_BELOW, _LARGER = 0.95, 1.5  # of b_c; of the orbit's swing
_SETTLED, _LATE = 8.0, 10  # decay times of the oscillator; cycles
_PULLED, _AT_WALL = 0.4, 0.99  # of the clearance


def orbit_swing(b: FloatArray, p: Reduced) -> FloatArray:
    """Largest |x| on the exact orbit at clearance b, both in units of G; NaN where it is not."""
    from vinesexp.theory.floquet import swing_of
    from vinesexp.theory.orbits import amplitudes_at, family

    C = amplitudes_at(b, p)[1]
    swing = swing_of(family(np.where(np.isnan(C), 1.0, C), p))
    return np.where(np.isnan(C), np.nan, swing)


def decay_curves(
    rig: IdentifiedRig, *, x0: float, targets: Sequence[float], clearances: FloatArray
) -> FloatArray | None:
    """Predicted time for a captured ball to bring the release x0 down to each target.

    All at once, since the decay that they share is what takes time.

    Parameters
    ----------
    rig : IdentifiedRig
    x0 : float
        Release, m.
    targets : sequence of float
        Amplitudes to be reached, m.
    clearances : ndarray, shape (n,)
        m.

    Returns
    -------
    ndarray, shape (len(targets), n), or None
        s; None where the rig is not `predictable` or a target lies above the release.
    """
    from vinesexp.theory.transient import Decaying, captured_time

    if not (rig.predictable and targets):
        return None
    with suppress(AnalysisError):
        release = Decaying(x_m=x0, **rig.numbers)
        b = clearances / (1.0 - rig.rolling)
        return captured_time(release, b=b, level=np.asarray(targets)[:, None])
    return None
