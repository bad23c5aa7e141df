"""Collisions of one ball in one record as observations of the joint model.

At each impact two laws hold: relative speed after over before is r, and the mass gains the momentum
that the ball loses. The ball's speeds are those of its flights between the walls, and every effect
of ball and contact moves them in its own way:

    friction on the floor, mu g    the ball arrives slower and had left faster by mu g T/2; its spin
                                   grows, and from where a solid ball rolls it takes 2/7 of the
                                   acceleration of the mass
    tilt, an acceleration g_t      + g_t T/2 at the end, - g_t T/2 at the beginning
    clearance                      2 b/T more between walls, at both ends
    contact of duration tau        the way took T - tau: tau/T of the relative speed more; and the
                                   spring moves the mass on by 0.6 (1 - r) tau x'' while they touch;
                                   a ball on a plane touches it for tau (u/u0)^-1/5 (Hertz), on a
                                   linear spring for tau at any speed: `spring` is which
    pad, of duration                the contact with one wall lasts half of it longer, with the
                                   other half of it shorter
    rolling, a share s             + s (v - mean v of the mass) at either end
    hollow floor, kappa (y - x)    the ball arrives and had left slower by kappa b T/6, and by what
                                   the mass moves in between
    speed u of an impact           r + slope (u - u0); or, with fade, what begins as r + fade u0
                                   ln(u/u0), as r of metals and plastics, and stays between 0 and 1
                                   as r/(1 - r) goes with a power of u: the first power is a wall
                                   with a damper (Hunt and Crossley), whose slow balls lose nothing
    course of a record             r and friction may change from its first impact to its last, as
                                   a ball warms up or its floor gets dusty: `course r` and
                                   `course friction` are half of the change
    drag, kappa w |w|              the air in a narrow cavity slows a ball of relative speed w:
                                   by kappa times the mean of w^2 t over the flight slower at the
                                   end, of w^2 (T - t) faster at the beginning
    viscous, nu w                  so does a film of oil, by nu times the mean of w t

A contact is a spring with a dashpot. Its impulse has its centroid r/(1 + r) of it after it begins,
with the r of this impact: there the motions before and after meet if they are continued.

The sensors move them too: gains of displacement and acceleration, a common lateness of the
displacement and a drift of it from the middle of the record to its ends, impacts with one wall that
are timed late and whose pulses read larger, as one template finds unlike pulses, slopes whose
change reads off by a share, areas of pulses that go with a power of the speed, as faster balls
touch shorter, velocities on either side of an impact off by a share of the jump, a displacement
x + even x^2 + odd x^3 in the place of x, as lasers near the ends of their range show it, and
x - beside x_e, as a sensor on the table shows it (beside = 1).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import OF_MEDIAN, BoolArray, FloatArray, IntArray, median_of, spread_of
from vinesexp.identification.flights import Flights
from vinesexp.identification.joint.unknowns import IMAGINARY, Local

#: Real, or complex with derivatives as imaginary parts.
Numbers = NDArray[Any]
#: By how much the next impact is later, as a share of the flight to it, and the velocities of the
#: mass at an impact are read faster, as a share of the ball's usual speed.
Chance = tuple[float, float]
#: Duration of a flight, s, and place, m, and velocity, m/s, of the mass where it ends.
End = tuple[FloatArray, FloatArray, FloatArray]

#: Local quantities of the collisions of a record, in order, and how free a lab leaves each of them
#: in a record on its own.
FREE = {
    "r": 0.5, "ln_eps": 0.3, "g_x": 0.05, "g_a": 0.1, "reading": 0.01, "share": 0.01, "late": 3e-4,
    "b": 1e-3, "wall": 0.05, "slope": 0.05, "fade": 0.05, "friction": 0.3, "tilt": 0.3,
    "contact": 1.5e-3, "rolling": 0.4, "hollow": 10.0, "drag": 0.1, "pad": 1e-3, "course r": 0.01,
    "course friction": 0.1, "viscous": 0.3, "even": 0.5, "odd": 50.0, "beside": 1.0,
    "spring": 1.0, "drift": 1e-4, "pulse_power": 0.1, "late_wall": 1e-4, "pulse_wall": 0.1,
}  # fmt: skip
LOCALS = tuple(FREE)
#: Effects of ball and contact among them.
EFFECTS = LOCALS[LOCALS.index("wall") : LOCALS.index("viscous") + 1]
#: Of (1 - r) tau times the acceleration of the mass, for a spring with a dashpot as the contact.
_DURING = 0.6
#: Power of the speed with which a contact lasts, and by what it may be another: -1/5 of a ball on a
#: plane (Hertz), 0 of a linear spring; a damper makes contacts of fast balls longer.
_LONGER = -0.1, 0.15
_FLIES = 0.25  # share of the time between two impacts that the ball flies at least
_LOSES = (0.05, 0.95)  # restitutions at the usual speed between which r follows a curve over it
_FREEDOM = 4.0  # of Student's distribution: how much an outlier counts
#: Scale of the Student distribution nearest to a normal one, over the deviation of that.
_OF_NORMAL = 0.831
_STRAIGHTENED = 3  # steps towards what a bent reading stands for, each some per cent of the last
_SETTLED = 30  # steps towards that scale, each of which leaves less than half of what is off
_TINY = 1e-9
_MOST = 3.0  # times what chance leaves on average
_LITTLE = 1e-5  # less than anything bends in, more than rounding
#: Of the usual speed: slower collisions, which noise may turn, count as this one.
SLOWEST = 0.02
_LEAST, _APART_AT_MOST = 0.4, 8  # of the variance of independent collisions; of their number
_PARTS = 3  # groups by the duration of a flight, before and after
_APART = 60.0  # errors of a time that durations have to differ by to be parted
_STANDS_OUT = 8.0  # times what the collisions of a wall usually differ by
_ANY_R = (0.05, 1.0)
_FEWEST, _MANY, _FOLDS = 10, 60, 5
_SINGLE, _WEIGHED = 120, 2  # collisions of a first fit to single ones; times they are weighed
#: Of a solid ball: m R^2 over its moment of inertia. Steps towards where it begins to roll.
_SPIN, _UNTIL = 2.5, 16
_STEPS = 16  # of a flight in which a floor may overtake a ball
_EDGES = np.linspace(0.0, 1.0, _STEPS + 1)
_AS_GOOD = 1e-6  # m/s: a velocity as good as the one before
#: Over its speed: what a ball that rolled to a wall slips by when it leaves, 1 + r about.
_SLIPS = 1.5
#: Places and weights of Gauss in a flight: exact up to the square of a parabola times a line.
_GAUSS = ((0.5 - math.sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + math.sqrt(0.15), 5 / 18))
_READ = (7e-5, 5e-4, 3e-4)  # of speed and jump: what reading velocities beside an impact leaves


@dataclass(frozen=True)
class Collisions:
    """Collisions of one ball in one record with the errors that their own scatter shows.

    Attributes
    ----------
    flights : Flights
    x, x_before, x_after : arrays (n,)
        Displacement from rest at the impact, at the one before, at the one after, m.
    omega2 : float
        Square of the circular frequency of the motion, 1/s^2.
    base : array (6, n)
        Displacement of the base at these three times, m, and its velocity, m/s; 0 where it rests.
    course : array (n,)
        Time of the impact, from -1 at the first of the record to 1 at the last.
    speed : float
        m/s; r is that at this relative speed where it depends on it.
    known : bool array (3, n)
        Where there is a bounce, a momentum by displacement, a momentum by acceleration.
    scatter : array (3,)
        Of single collisions, m/s.
    means : arrays (groups, n), three of them
        Weights that make means over collisions alike of each equation.
    sigma : array (3, groups)
        Standard errors of these means, m/s; infinite where there is none.
    about : array (29,)
        Local quantities near which these were looked at.
    shared, own : arrays (29, means), (29,)
        What the derivatives of the means, over their errors, share with what these leave there;
        what the slope of the log-likelihood would have of that.
    one_sided : float
        What the mean r is above that of these means: where r scatters to one side, those for which
        an outlier counts less are not quite means.
    """

    flights: Flights
    x: FloatArray
    x_before: FloatArray
    x_after: FloatArray
    omega2: float
    base: FloatArray
    course: FloatArray
    speed: float
    known: BoolArray
    scatter: FloatArray
    means: tuple[FloatArray, FloatArray, FloatArray]
    sigma: FloatArray
    about: FloatArray = field(default_factory=lambda: np.zeros(len(LOCALS)))
    shared: FloatArray = field(default_factory=lambda: np.zeros((len(LOCALS), 1)))
    own: FloatArray = field(default_factory=lambda: np.zeros(len(LOCALS)))
    one_sided: float = 0.0

    def rest(self, p: Numbers, chance: Chance = (0.0, 0.0)) -> Numbers:
        """Residuals of the three equations, m/s, shape (3, ..., n); p has shape (29, ..., 1).

        Real, or complex with derivatives as imaginary parts. Columns of `p` may differ in these, in
        r and in friction. As they would be by another `chance`.
        """
        f, of = self.flights, dict(zip(LOCALS, p, strict=True))
        later, faster = chance
        more = later * f.time_after
        end = (
            f.time_after + more, self.x_after + more * f.v_next,
            f.v_next - more * self.omega2 * self.x_after,
        )  # fmt: skip
        contact = of["contact"] + 0.5 * of["pad"] * f.side
        r = of["r"] + of["course r"] * self.course
        rub = of["friction"] + of["course friction"] * self.course
        places, velocities, ways, jumps, reads = self._shown(of, end, faster)
        v_previous, v_before, v_after, v_next = velocities
        T_before, T_after, s = f.time_before, end[0], f.side
        per_before, per_after, across = 1.0 / T_before, 1.0 / T_after, 2.0 * s * of["b"]
        # the walls take turns: a flight lasts longer if one's impacts come late, the next shorter
        apart = of["late_wall"] * s
        u_before = (ways[0] - across) * per_before * (1.0 - apart * per_before)
        u_after = (ways[1] + across) * per_after * (1.0 + apart * per_after)
        rolled_before = v_before - u_before - across * per_before
        rolled_after = v_after - u_after + across * per_after
        pulled = [-self.omega2 * place for place in places]
        first = _Flight(s * of["b"], ways[0], T_before, (v_previous, v_before), pulled[:2])
        last = _Flight(-s * of["b"], ways[1], T_after, (v_after, v_next), pulled[1:])
        pulls = of["tilt"], of["hollow"], of["drag"], of["viscous"]
        _, slowed, spin = first.rubbed(rub, joined=self._joined)
        ends = first.pulled(pulls)[1] + slowed
        begins = last.pulled(pulls)[0] + last.rubbed(rub, spin)[0]
        law = r + 0.5 * of["wall"] * s, of["slope"], of["fade"]
        lasts, longer_before, longer_after = self._touched(
            (contact, of["spring"]), law, (u_before, u_after), velocities, pulled, T_after
        )
        u_before = u_before + ends + longer_before + of["rolling"] * rolled_before
        u_after = u_after - begins + longer_after + of["rolling"] * rolled_after
        before, after = v_before - u_before, v_after - u_after
        speed = before * np.sign(before.real)
        own_r = self._restitution(law, speed / self.speed)
        # the spring moves the mass on while they touch
        moved = _DURING * (1.0 - own_r) * lasts * self.omega2 * places[1]
        gained = np.exp(of["ln_eps"]) * (u_after - u_before)
        # in the units of the readings, whose noise it is: a gain of zero would else explain all, or
        # a ball that goes along with the mass: nothing is left of it to bounce
        plain = self._plain_speed / speed.mean(axis=-1, keepdims=True)
        by_laser, by_pulse = (
            (jump + gained) * read for jump, read in zip(jumps, reads, strict=True)
        )
        return np.stack([(after + own_r * before - moved) * plain, by_laser, by_pulse])

    def _shown(
        self, of: Mapping[str, Numbers], end: End, faster: float
    ) -> tuple[Sequence[Numbers], ...]:
        """What the sensors show of the mass, freed of their errors, local quantities by name.

        Returns
        -------
        places : at the impact before, at this one, at the next, m.
        velocities : after the impact before, before and after this one, before the next, m/s.
        ways : from the impact before, and to the next, m.
        jumps : of the velocity, by displacement and by acceleration, m/s.
        reads : what these two sensors show for 1 m/s.
        """
        f = self.flights
        even, odd, beside = of["even"], of["odd"], of["beside"]
        late, own = of["late"] + of["drift"] * self.course, 0.5 * of["late_wall"] * f.side
        scale, bent = np.exp(-of["g_x"]), even.real.any() or odd.real.any()

        def straight(x: FloatArray, base: FloatArray) -> tuple[Numbers, Numbers]:
            """A place in space, and what the bend and the gain of the sensor make of a velocity."""
            true: Numbers = x
            for _ in range(_STRAIGHTENED if bent else 1):  # no bend, but for its derivative
                true = x / (1.0 + (even + odd * true) * true)
            slower = scale / (1.0 + (2.0 * even + 3.0 * odd * true) * true)
            return scale * true + beside * base, slower

        x, here = straight(self.x, self.base[0])
        x_before, there = straight(self.x_before, self.base[1])
        x_after, then = straight(end[1], self.base[2])
        v_previous = there * f.v_previous + beside * self.base[4]
        v_next = then * end[2] + beside * self.base[5]
        middle = f.v_before + 0.5 * f.jump + faster * self.speed
        middle = here * middle + beside * self.base[3]
        ways = (
            x - x_before + late * (middle - v_previous) + own * (middle + v_previous),
            x_after - x + late * (v_next - middle) - own * (v_next + middle),
        )
        unlike = of["pulse_power"] * self._faster + 0.5 * of["pulse_wall"] * f.side
        reads = np.exp(of["g_x"]) * np.exp(of["reading"]), np.exp(of["g_a"] + unlike)
        by_laser = here * f.jump_displacement * np.exp(-of["reading"])
        by_pulse = f.jump_acceleration / reads[1]
        of_laser, of_pulse = self._weights(np.exp(of["g_x"]), np.exp(of["g_a"]))
        jump = np.where(of_laser > 0.0, by_laser, 0.0) * of_laser
        jump = jump + np.where(of_pulse > 0.0, by_pulse, 0.0) * of_pulse
        middle = middle - (late + own) * self.omega2 * x + of["share"] * jump
        velocities = v_previous, middle - 0.5 * jump, middle + 0.5 * jump, v_next
        return (x_before, x, x_after), velocities, ways, (by_laser, by_pulse), reads

    def _restitution(self, law: Sequence[Numbers], faster: Numbers) -> Numbers:
        """r of each impact, by r of its wall at the usual speed and how it goes with the speed."""
        r, slope, fade = law
        if not (slope.real.any() or fade.real.any()):  # no law has no derivative but its own
            faster = faster.real
        faster = _within(faster, SLOWEST, math.inf)
        along = self.speed * fade * np.log(faster)
        if fade.real.any():
            at = _within(r, *_LOSES)
            # ln(r/(1 - r)) goes with the logarithm of the speed
            logit = np.log(at / (1.0 - at)) + along / (at * (1.0 - at))
            along = 0.5 + 0.5 * np.tanh(0.5 * logit) - at
        return np.asarray(r + self.speed * slope * (faster - 1.0) + along)

    def _touched(
        self,
        touches: Sequence[Numbers],
        law: Sequence[Numbers],
        u: Sequence[Numbers],
        v: Sequence[Numbers],
        a: Sequence[Numbers],
        T_after: FloatArray,
    ) -> tuple[Numbers, Numbers, Numbers]:
        """How long each contact lasts, s, and by what the ball is faster before and after, m/s.

        It leaves the wall when the contact ends, with which the mass went on from the centroid of
        the impulse, r/(1 + r) of a contact after its beginning; and it comes to the next as soon.
        """
        contact, spring = touches
        if not contact.real.any():  # a contact of no duration has no derivative but its own
            spring = spring.real
            law, u, v, a = ([part.real for part in parts] for parts in (law, u, v, a))
        faster = np.maximum(np.abs((v[1] - u[0]).real) / self.speed, SLOWEST)
        r = _within(self._restitution(law, faster), *_ANY_R)
        lasts = contact * faster ** (_LONGER[0] + _LONGER[1] * np.tanh(spring))
        ends, begins = lasts * r / (1.0 + r), lasts / (1.0 + r)
        begun = np.where(self._joined, np.roll(begins, 1, axis=-1), begins)
        ended = np.where(np.roll(self._joined, -1), np.roll(ends, -1, axis=-1), ends)

        def longer(k: int, T: FloatArray, start: Numbers, end: Numbers) -> Numbers:
            way = start * (u[k] - v[2 * k] - 0.5 * a[k] * start)
            way = way + end * (u[k] - v[2 * k + 1] + 0.5 * a[k + 1] * end)
            free = T - start - end
            return np.asarray(way / np.where(free.real > _FLIES * T, free, _FLIES * T))

        before = longer(0, self.flights.time_before, begun, ends)
        return lasts, before, longer(1, T_after, begins, ended)

    def keep(self, chosen: BoolArray) -> Collisions:
        """Some of them, with no means yet."""
        own = (self.x[chosen], self.x_before[chosen], self.x_after[chosen])
        none = np.zeros((0, int(chosen.sum())))
        return Collisions(
            self.flights.keep(chosen), *own, self.omega2, self.base[:, chosen],
            self.course[chosen], self.speed, self.known[:, chosen], self.scatter,
            (none, none, none), np.zeros((3, 0)),
        )  # fmt: skip

    @cached_property
    def _joined(self) -> BoolArray:
        return joined(self.flights)

    @cached_property
    def _plain_speed(self) -> float:
        """Mean relative speed of the ball by the stated clearance and no effect, m/s."""
        return float(self.flights.speed.mean())

    @cached_property
    def _faster(self) -> FloatArray:
        """Logarithm of the speed of each impact, by the stated clearance, over the usual one."""
        return np.log(np.maximum(self.flights.speed / self.speed, SLOWEST))

    def _weights(self, *gains: Numbers) -> tuple[FloatArray, FloatArray]:
        """Weights of laser and accelerometer in the jump, by the scatter of their momentum, m/s.

        `scatter` is one of the readings, which are true values times these `gains`.
        """
        of_laser, of_pulse = (
            known * (_first(gain) / scatter) ** 2
            for known, gain, scatter in zip(self.known[1:], gains, self.scatter[1:], strict=True)
        )
        whole = of_laser + of_pulse
        return of_laser / whole, of_pulse / whole

    def look(self, p: FloatArray) -> Local:
        """Information about the local quantities, gradient and log-likelihood.

        By derivatives that are not of what the same collisions happen to leave (`without_chance`).
        """
        slopes, rest = self.line(p)
        value, J = self.meant(rest), self.meant(slopes)
        square = float(value @ value) - 2.0 * float(self.own @ (p - self.about))
        gradient, J = self.own - J @ value, J - self.shared
        return J @ J.T, gradient, -0.5 * square

    def meant(self, each: FloatArray) -> FloatArray:
        """Means of each equation, shape (3, ..., n), over collisions alike, over their errors."""
        means = [part @ m.T for m, part in zip(self.means, each, strict=True)]
        sigma = self.sigma.ravel()
        return np.asarray((np.concatenate(means, axis=-1) / sigma)[..., np.isfinite(sigma)])

    def line(self, p: FloatArray, chance: Chance = (0.0, 0.0)) -> tuple[FloatArray, FloatArray]:
        """Derivatives of `rest` by the local quantities, shape (3, 29, n), and it; 0 if unknown."""
        moved = p[:, np.newaxis] + 1j * IMAGINARY * np.eye(p.size)  # each in its own column
        rest = self.rest(moved[..., np.newaxis], chance)
        rest = np.where(self.known[:, np.newaxis], rest, 0.0)
        return rest.imag / IMAGINARY, rest[:, 0].real


@dataclass(frozen=True)
class _Flight:
    """Flights from `begin` beside the mass to the other side.

    The mass goes its `way` by a curve with the velocities and accelerations of both ends.
    """

    begin: Numbers
    way: Numbers
    T: FloatArray
    v: Sequence[Numbers]
    a: Sequence[Numbers]

    @cached_property
    def _powers(self) -> tuple[Numbers, ...]:
        """Coefficients of the place of the mass over the first to fifth power of the time."""
        a, b = self.v[0] * self.T, 0.5 * self.a[0] * self.T**2
        x, v = self.way - a - b, self.v[1] * self.T - a - 2.0 * b
        w = 0.5 * self.a[1] * self.T**2 - b
        return a, b, 10.0 * x - 4.0 * v + w, 7.0 * v - 15.0 * x - 2.0 * w, 6.0 * x - 3.0 * v + w

    def mass(self, s: Numbers | FloatArray | float) -> tuple[Numbers, Numbers]:
        """Place from where it began, m, and velocity of the mass after a share s of the time."""
        a, b, c, d, e = self._powers
        x = s * (a + s * (b + s * (c + s * (d + s * e))))
        v = a + s * (2.0 * b + s * (3.0 * c + s * (4.0 * d + s * (5.0 * e))))
        return x, v * (1.0 / self.T)

    @cached_property
    def mean(self) -> Numbers:
        """Mean velocity of the ball, m/s."""
        return (self.way - 2.0 * self.begin) * (1.0 / self.T)

    @property
    def real(self) -> _Flight:
        """The same without derivatives, in which alone columns differ."""

        v, a = ([_first(one) for one in ends] for ends in (self.v, self.a))
        return _Flight(_first(self.begin), _first(self.way), self.T, v, a)

    def pulled(self, pulls: tuple[Numbers, ...]) -> tuple[Numbers, Numbers]:
        """By how much a ball is slower than its mean at the beginning, faster at the end.

        First order in tilt, hollow, drag and viscous friction: the ball goes straight.
        """
        tilt, hollow, drag, viscous = pulls
        # a pull of nothing has no derivative but its own
        at = self if any(pull.real.any() for pull in pulls) else self.real
        side = np.sign(at.begin.real)
        dragged, oiled, off = ([0.0 * at.way] * 2 for _ in range(3))
        for s, weight in _GAUSS:
            x, v = at.mass(s)
            speed = (v - at.mean) * side
            place = at.begin * (1.0 - 2.0 * s) + at.way * s - x
            for end, share in enumerate((weight * (1.0 - s), weight * s)):
                dragged[end] = dragged[end] + share * side * speed**2
                oiled[end] = oiled[end] + share * side * speed
                off[end] = off[end] + share * place
        at_begin, at_end = (
            self.T * (0.5 * tilt + drag * a + viscous * c - hollow * b)
            for a, c, b in zip(dragged, oiled, off, strict=True)
        )
        return at_begin, at_end

    def rubbed(
        self, rub: Numbers, turns: Numbers | None = None, joined: BoolArray | bool = False
    ) -> tuple[Numbers, Numbers, Numbers]:
        """The same of a solid ball that slides on the floor until it rolls, and its spin then.

        Sliding it is slowed by `rub`, and its surface turns by 5/2 of it faster; it slips by what
        it goes past the floor and what its surface `turns` against this, m/s. Rolling it takes 2/7
        of the floor's own acceleration. A floor that overtakes it rubs it the other way. Without
        `turns` a flight begins with the spin with which the one before it in the row ended, if
        these are `joined`; else with that of a steady motion, which ends with as much the other way
        round.
        """
        side, mean, lost = np.sign(self.begin.real), self.mean, rub * self.T
        begun = 0.5 * lost * _SPIN if turns is None else turns
        at_begin, slides, v = 0.5 * lost * side, rub.real > 0.0, self.v[1]
        for _ in range(_UNTIL):
            along, late, overtaken = self._ways(rub, begun + side * at_begin)
            slips = begun + side * (v - mean + at_begin)  # while it slides, and the mass goes on
            was, at_begin, at_end = at_begin, lost * side * (along - late), lost * side * late
            ended, steady = lost * along * _SPIN - begun, 0.5 * lost * along * _SPIN
            until = slips / np.where(slides, (1.0 + _SPIN) * lost, 1.0)
            rolls = slides & ~overtaken & (until.real < 1.0)
            if rolls.any():
                until = np.where(rolls, until * (until.real > 0.0), 1.0)
                x, v = self.mass(until)
                left, taken = (self.way - x) / self.T, 1.0 / (1.0 + _SPIN)
                slowed = lost * side * until
                begins = slowed * (1.0 - 0.5 * until) + taken * (left - v * (1.0 - until))
                ends = slowed * 0.5 * until + taken * (self.v[1] - v * until - left)
                at_begin, at_end = np.where(rolls, (begins, ends), (at_begin, at_end))
                arrives = side * (self.v[1] - mean - at_end)
                ended, steady = np.where(rolls, arrives, (ended, steady))
            elif not overtaken.any():
                break
            if turns is None:
                begun = np.where(joined, np.roll(ended, 1, axis=-1), steady)
            if np.abs((at_begin - was).real).max() < _AS_GOOD:
                break
        return at_begin, at_end, ended

    @cached_property
    def _passes(self) -> FloatArray:
        """By what the ball passes the mass at the edges of steps, m/s; columns do not differ."""
        at = self.real
        v = at.mass(_EDGES.reshape(-1, *[1] * np.ndim(at.mean)))[1]
        passes = np.sign(at.begin) * (v - at.mean)
        return np.asarray(passes.reshape(_EDGES.size, -1, self.T.size)[:, 0])

    def _ways(self, rub: Numbers, begun: Numbers) -> tuple[FloatArray, FloatArray, BoolArray]:
        """How long the floor rubs a ball back less how long on, in flights; the moment of this from
        their start on; and whether it overtakes the ball, faster than friction takes this along.

        In a step of a flight the floor has a constant acceleration. Where the slip ends in it,
        friction is what keeps the ball from slipping, or all of it the other way round.
        """
        rub, begun = (_first(one) if np.iscomplexobj(one) else one for one in (rub, begun))
        whole = np.maximum((1.0 + _SPIN) * rub * self.T, 1e-9)  # of none, the way of very little
        overtaken = np.zeros(np.broadcast_shapes(whole.shape, begun.shape), dtype=bool)
        along, late = np.ones(overtaken.shape), np.full(overtaken.shape, 0.5)
        least = [one.reshape(-1, self.T.size).min(axis=0) for one in (begun, -whole)]
        own = np.flatnonzero((self._passes + least[0] + least[1] * _EDGES[:, None] < 0.0).any(0))
        if not own.size:
            return along, late, overtaken
        edges, passes = (one.reshape(_EDGES.size, *[1] * (begun.ndim - 1), -1)
                         for one in (_EDGES, self._passes[:, own]))  # fmt: skip
        most, gains = whole[..., own] / _STEPS, np.diff(passes, axis=0)
        slips = begun[..., own] + passes[0]
        ahead = begun[..., own] + passes - whole[..., own] * edges
        leaves = ((ahead[:-1] >= 0.0) & (ahead[1:] < 0.0) & (-gains > most)).any(axis=0)
        if not leaves.any():
            return along, late, overtaken
        taken = []
        for gain in gains:
            way = np.where(slips < 0.0, -most, most)
            until = slips / np.where(way == gain, np.inf, way - gain)
            until = np.where((until >= 0.0) & (until < 1.0), until, 1.0)
            taken.append(way * until + np.clip(gain, -most, most) * (1.0 - until))
            slips = slips + gain - taken[-1]
        share = np.stack(taken) / whole[..., own]
        overtaken[..., own] = leaves
        along[..., own] = np.where(leaves, share.sum(axis=0), 1.0)
        moment = (share * (edges[:-1] + 0.5 / _STEPS)).sum(axis=0)
        late[..., own] = np.where(leaves, moment, 0.5)
        return along, late, overtaken


def _first(one: Numbers) -> Numbers:
    """The first column without its derivatives, in which alone columns differ."""
    return one.real[:1] if one.ndim > 1 else one.real


def _within(values: Numbers, low: float, high: float) -> Numbers:
    """Limited by their real parts; at a limit nothing has a derivative."""
    return np.where(values.real < low, low, np.where(values.real > high, high, values))


def joined(f: Flights) -> BoolArray:
    """Whether the flight before an impact is the one after the impact before it in the row."""
    return np.append(False, f.time_before[1:] == f.time_after[:-1])


def rolls_from(f: Flights) -> FloatArray:
    """Friction, m/s^2, from which on a solid ball rolls before it reaches the other wall.

    One that rolled to a wall slips by 1 + r of its speed when it leaves.
    """
    return _SLIPS / (1.0 + _SPIN) * f.speed / f.time_before


def with_errors(
    c: Collisions, p: FloatArray, *, time_error: float, plain: FloatArray | None = None
) -> Collisions:
    """The collisions averaged over those alike, with the errors that their scatter shows.

    Measured quantities stand on both sides of each law, so that single collisions that differ by
    noise alone would be fitted by whatever goes with that noise. Means over collisions that are
    alike hold true differences only. Outliers count less, by Student's distribution; neighbours
    share a flight, which changes what a mean is worth.

    Parameters
    ----------
    c : Collisions
    p : array (29,)
        Local quantities near which the scatter is looked at.
    time_error : float
        Standard error of the time of an impact, s.
    plain : array (29,), optional
        The same for the bounces of a record in which hardly two are alike, where `p` may go through
        all of them.
    """
    rest = np.where(c.known, c.rest(p[:, np.newaxis]), np.nan)
    groups = _alike(c, time_error, by_durations=not _echoes(c, rest[0]))
    count = int(groups.max()) + 1
    if plain is not None and _pairs(groups[c.known[0]]).sum() < _FEWEST:
        rest[0] = np.where(c.known[0], c.rest(plain[:, np.newaxis])[0], np.nan)
    member = groups[np.newaxis, :] == np.arange(count)[:, np.newaxis]
    means, sigma, scatter, one_sided = [], np.full((3, count), np.inf), np.ones(3), 0.0
    # each in the units in which its equation is
    jumps = np.stack([c.flights.jump_displacement, c.flights.jump_acceleration])
    sizes = c.flights.speed, *np.where(c.known[1:], np.abs(jumps), 0.0)
    for k, part in enumerate(rest):
        good = np.isfinite(part) & ~_stands_out(part, c.flights.side)
        if good.sum() < _FEWEST:
            means.append(np.zeros(member.shape))
            continue
        centre = np.array([median_of(part[own & good]) for own in member])[groups]
        off = np.where(good, part - centre, 0.0)
        scatter[k] = _scatter(part[good], groups[good]) + _TINY
        weight = np.where(good, (_FREEDOM + 1.0) / (_FREEDOM + (off / scatter[k]) ** 2), 0.0)
        if k == 0:
            lost = off * np.sign(c.flights.v_before - c.flights.u_before)  # of the relative speed
            more = lost.sum() / good.sum() - weight @ lost / weight.sum()
            one_sided = float(-more / c.flights.speed[good].mean())
        own = member * weight
        total = own.sum(axis=1)
        means.append(own / np.maximum(total, 1e-300)[:, np.newaxis])
        variance = _of_sums(own, np.where(good, off / scatter[k], 0.0))
        used = (member & good).sum(axis=1) > 0
        single = scatter[k] * np.sqrt(variance) / np.maximum(total, 1e-300)
        floor = _READ[k] * (member @ sizes[k]) / member.sum(axis=1)
        sigma[k] = np.where(used, np.hypot(single, floor), np.inf)
    return replace(
        c, scatter=scatter, means=(means[0], means[1], means[2]), sigma=sigma, one_sided=one_sided
    )


def without_chance(c: Collisions, p: FloatArray) -> Collisions:
    """The same with what derivatives of mean bounces share with the chance of their impacts.

    A ball that leaves a wall faster than usual also reaches the other one earlier, and a velocity
    that is read wrong bends the way of the mass: what a bounce leaves goes with its derivatives, by
    as much as these change with either over what the rest does. Products of means have it in a
    share of one over their number, times as many groups as there are: as much, in errors, however
    small the scatter is. A concave floor was 5 errors off in a record of 180 collisions.
    """
    (slopes, *_), rest = c.line(p)
    mean, time = c.means[0], c.flights.time_after
    group, used = mean.argmax(axis=0), mean.any(axis=0)
    off, late = (np.where(used, y - (mean @ y)[group], 0.0) for y in (rest[0], time))
    weight = used / (_FREEDOM + (off / c.scatter[0]) ** 2)
    shares, changes = [], []
    for chance in ((_LITTLE, 0.0), (0.0, _LITTLE)):
        (moved, *_), left = c.line(p, chance)
        change = left[0] - rest[0]
        shares.append((moved - slopes) @ (weight * change) / max(weight @ change**2, 1e-300))
        changes.append(change / _LITTLE)
    # of what they leave, how much the time of the next impact shows
    shown = (weight * changes[0] * late / time) @ off / max(weight @ off**2, 1e-300)
    shown = min(max(float(shown), 0.0), 1.0)
    by_chance, count = c.meant(rest), int(np.isfinite(c.sigma[0]).sum())
    by_chance[count:] = 0.0
    # where they leave much more than chance does, the rest is no chance
    by_chance *= min(1.0, math.sqrt(_MOST * count / max(float(by_chance @ by_chance), 1e-300)))
    shared = np.outer(shown * shares[0] + (1.0 - shown) * shares[1], by_chance)
    return replace(c, about=p, shared=shared, own=shared @ by_chance)


def near_singles(
    c: Collisions, p: FloatArray, *, about: FloatArray, prior: FloatArray
) -> FloatArray:
    """Local quantities nearest to the single collisions, by the line near `p`; outliers count less.

    Parameters
    ----------
    c : Collisions
    p, about : arrays (29,)
        Where the line is; what is expected.
    prior : array (29, 29)
        Information about what is expected.
    """
    every = 2 * math.ceil(c.x.size / _SINGLE)
    # of many, pairs of neighbours spread over the record
    c = c.keep(np.arange(c.x.size) % max(every, 2) < 2)
    slopes, rest = c.line(p)
    at, known = p, c.known.copy()
    known[0] &= ~_stands_out(np.where(known[0], rest[0], np.nan), c.flights.side)
    for _ in range(_WEIGHED):
        left = np.where(known, rest + (at - p) @ slopes, np.nan)
        scale = np.array([OF_MEDIAN * median_of(np.abs(own[np.isfinite(own)])) for own in left])
        scale = scale[:, np.newaxis] + _TINY
        weight = (_FREEDOM + 1.0) / (_FREEDOM + (left / scale) ** 2) / scale**2
        weighed = slopes * np.where(known, weight, 0.0)[:, np.newaxis]
        information = np.einsum("ein,ekn->ik", weighed, slopes) + prior
        gradient = prior @ about + np.einsum("ein,en->i", weighed, p @ slopes - rest)
        at = np.linalg.solve(information, gradient)
    return at


def _scatter(rest: FloatArray, groups: IntArray) -> float:
    """Standard deviation of single collisions about those alike, by differences of two in turn.

    Of a group of one or two, which its own mean follows, nothing but a difference says it. Where
    hardly two are alike, of two that are nearly. The most probable scale of Student's distribution:
    of thirty collisions the median of the differences is less than half of the truth in one record
    of a hundred.
    """
    order = np.argsort(groups, kind="stable")
    alike = _pairs(groups)
    if alike.sum() < _FEWEST:
        alike[:] = True
    half = 0.5 * np.diff(rest[order])[alike] ** 2
    scale2 = float(half.mean()) if half.size else 0.0
    for _ in range(_SETTLED if scale2 else 0):
        scale2 = float(((_FREEDOM + 1.0) * half / (_FREEDOM + half / scale2)).mean())
    return math.sqrt(scale2) / _OF_NORMAL


def _pairs(groups: IntArray) -> BoolArray:
    """Whether one and the next, in the order of their groups, are alike."""
    return np.asarray(np.diff(np.sort(groups)) == 0)


def _stands_out(rest: FloatArray, side: FloatArray) -> BoolArray:
    """Collisions far from all others at their wall: an edge hit, or a flight over a missed impact.

    In a group of three of which two are such, none of them is an outlier.
    """
    out = np.zeros(rest.size, dtype=bool)
    for wall in (side > 0.0, side <= 0.0):
        own = rest[wall & np.isfinite(rest)]
        out |= wall & (np.abs(rest - median_of(own)) > _STANDS_OUT * spread_of(own))
    return out


def bounced(c: Collisions, p: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Median of the restitutions of single collisions, and their scatter, for each column of `p`.

    All else is as there; columns differ in friction.
    """
    at = np.stack([p, p], axis=-1)
    at[LOCALS.index("r")] = 0.0, 1.0
    after, both = np.moveaxis(c.rest(at[..., np.newaxis])[0], 1, 0)
    single = [
        -a[known] / (b - a)[known]
        for a, b in zip(after, both, strict=True) if (known := c.known[0] & (b != a)).size
    ]  # fmt: skip
    middle = np.clip([median_of(r) for r in single], *_ANY_R)
    return middle, np.array([median_of(np.abs(r - m)) for r, m in zip(single, middle, strict=True)])


_ECHO, _LAGS = 5.0, (2, 3, 4)  # standard errors; impacts apart, that share no flight


def _echoes(c: Collisions, rest: FloatArray) -> bool:
    """Whether what r is at an impact goes with what it was some impacts before.

    A ball that turns by a part of a turn an impact, and is not the same all round. How long a
    flight lasts then says what r will be.
    """
    known = np.isfinite(rest)
    if known.sum() < _FEWEST:
        return False
    speed = c.flights.v_before - c.flights.u_before
    laws = np.stack([np.ones(rest.size), c.flights.side, speed, np.abs(speed)])  # another mean r
    z = np.where(known, rest, 0.0)
    z -= known * (np.linalg.lstsq(laws[:, known].T, z[known], rcond=None)[0] @ laws)
    wide = OF_MEDIAN * median_of(np.abs(z[known]))
    z = np.clip(z, -3.0 * wide, 3.0 * wide)
    least = _ECHO * float(z @ z) / math.sqrt(known.sum())
    return any(abs(float(z[:-lag] @ z[lag:])) > least > 0.0 for lag in _LAGS)


def _alike(c: Collisions, time_error: float, *, by_durations: bool) -> IntArray:
    """Number of the group of each collision: one wall, flights of like duration.

    Durations part collisions only where they differ by much more than their errors. How long the
    flight after an impact lasts depends on what this impact did: parted by it, impacts whose r
    happens to be small would be in one group. So they are parted by the duration to be expected,
    and only among those for which one law told what to expect.
    """
    label = (c.flights.side > 0.0).astype(np.int64)
    count = label.size
    fold = np.arange(count) // 2 % _FOLDS  # of two, since neighbours share a flight
    expected = np.empty(count)
    for k in range(_FOLDS):
        expected[fold == k] = _expected(c, fold == k)
    parted = ((c.flights.time_before, np.zeros(count)), (expected, fold))
    for durations, among in parted if by_durations else ():
        low, high = np.percentile(durations, [5.0, 95.0])
        parts = int(np.clip((high - low) / (_APART * max(time_error, 1e-9)), 1, _PARTS))
        label = label * _PARTS
        for k in np.unique(among):
            own = among == k
            edges = np.quantile(durations[own], np.arange(1, parts) / parts)
            label[own] += np.searchsorted(edges, durations[own])
    if count > _MANY:  # what changes along a record shows in its halves
        label = 2 * label + (c.course > 0.0)
    return np.asarray(np.unique(label, return_inverse=True)[1], dtype=np.int64)


def _expected(c: Collisions, own: BoolArray) -> FloatArray:
    """Duration of the flight after some impacts, by what was so before them, s.

    A law of where the mass was at this impact and at the one before, and of how long the ball took,
    learnt from the other impacts: learnt from these it would go with what they did.
    """
    f = c.flights
    known = np.stack([f.side * c.x, f.side * c.x_before, f.time_before], axis=1)
    spread = np.maximum(np.ptp(known, axis=0), 1e-300)
    Z = np.column_stack([np.ones(own.size), (known - known.mean(axis=0)) / spread])
    if own.size > _MANY:
        Z = np.column_stack([Z, *(Z[:, i] * Z[:, k] for i in (1, 2, 3) for k in range(i, 4))])
    return np.asarray(Z[own] @ np.linalg.lstsq(Z[~own], f.time_after[~own], rcond=None)[0])


def _of_sums(own: FloatArray, z: FloatArray) -> FloatArray:
    """Variances of weighted sums (rows) of residuals, by what residuals some impacts apart share.

    Neighbours share a flight; a clock that drifts moves the impacts of one wall one way and those
    of the other the other way. As if each were for itself where there are too few to tell. What
    changes along a record moves collisions farther apart than neighbours are.
    """
    wide = max(1.0, OF_MEDIAN * median_of(np.abs(z[z != 0.0])))
    alone = wide**2 * (own**2).sum(axis=1)
    z = np.clip(z / wide, -4.0, 4.0)
    power, lags = float(z @ z), z.size // _APART_AT_MOST
    if np.count_nonzero(z) < _FEWEST or not power:
        return np.asarray(alone)
    shared = alone.copy()
    for lag in range(1, lags + 1):
        rho = wide**2 * (1.0 - lag / (lags + 1.0)) * float(z[:-lag] @ z[lag:]) / power
        shared += 2.0 * rho * (own[:, :-lag] * own[:, lag:]).sum(axis=1)
    return np.asarray(np.maximum(shared, _LEAST * alone))
