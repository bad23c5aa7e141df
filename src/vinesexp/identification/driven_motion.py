"""What the motion of the mass across its impacts says of the oscillator and of its base.

Between impacts the mass is a linear oscillator on a moving base,

    x'' + 2 zeta w0 x' + w0^2 x = w0^2 x_e + 2 zeta w0 x_e' + constant,

and an impact changes its velocity, by an unknown jump, but not its place. Multiplied by a function
phi that vanishes at both ends of its support, with its derivative, and at every impact within, and
integrated by parts flight by flight, no derivative of a measured signal is left and no jump. Such
functions are polynomials of one flight, and one of two flights around each impact. Their equations
are linear in w0^2, 2 zeta w0 and the base in phase and in quadrature; they are solved for all four
at once. Where the motion repeats from cycle to cycle they fix two combinations of the four, and
the decays the others; where it is modulated they fix all. No ball, no clearance and no M enters.

The impacts' times may be late against the displacement, by one lag for a record, which is fitted,
and by some scatter, which counts as noise beside that of the samples: generalised least squares.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from scipy.linalg import solve_triangular
from scipy.ndimage import uniform_filter1d

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.errors import RecordError
from vinesexp.identification.estimate import is_known
from vinesexp.records.stored.store import RecordView
from vinesexp.signals.base_motion import base_motion
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.signals.means import channel_means, group_size, missing_means
from vinesexp.units import SURE

#: Name of the estimate whose data is a `DrivenMotion`.
DRIVEN = "driven"

_POINTS = 1000  # block means a period at most
_FEWEST = 20  # flights
#: Flights by which the end of a release is judged; starts from which it is.
_LATE, _STARTS = 9, 12
_ARRAYS = ("values", "information", "by_corner")
_SOUGHT = 5  # w0^2, 2 zeta w0, the base and its quadrature, friction
_KNOWN, _BASE = [0, 1, 4], slice(2, 4)  # of these: those that decays know, the base
_WANDERS = 3.0  # periods: slower, the integral of the displacement is that of its drift
_KNOWN_RATE = 0.3  # rad that the phase of a base that was not recorded may turn in a record
_GROWS = 0.1  # of its amplitude, by which it may grow or fall from the middle to the end
_HARMONICS, _DISTORTED = (2, 3), 0.02  # of a base that was not recorded; their usual share of it
_MODULATED = 2e-4  # error of f0, relative, from which on it is that of a motion that repeats
_TURNS = 3  # of the fit: scatter of the times and, where it is not recorded, the base's frequency
_TINY = 1e-12
_CHANCE = 2.0  # times what scatter makes of a kind of equations on average: one of ten has more
_DAMPED = 0.02  # 2 zeta of an oscillator as there are
_SHORTEST, _LONGEST = 0.12, 1.2  # periods; in longer ones an impact was missed
_OUTSIDE, _PASSES = 3.0, 8
_CHUNK = 40  # flights whose equations are weighted together
_LAG = 1e-5  # s: scatter of the times of impacts to begin with
_LAGS = tuple((1e-7 * 1.5 ** np.arange(22)).tolist())
_MEDIAN = 0.4549  # of the square of a normal deviate
_DRIFTS, _MOST_DRIFTS = 16, 24  # flights for each cosine of the displacement's drift
_GREGORY = (-1.0 / 8.0, 1.0 / 6.0, -1.0 / 24.0)  # added to the trapezoidal rule: cubics are exact
_FAR = 0.03  # share of the stated frequency within which that of an unseen base is looked for
_INSIDE = 4  # functions of one flight; then the halves of those around its two impacts
_OF_HALF_SINE = 0.25 - 2.0 / math.pi**2  # of its length squared: the variance of its push
_BUMP = Polynomial([0.0, 1.0, -1.0]) ** 2
_SHAPES = (
    *(16.0 * _BUMP * Polynomial([-0.5, 1.0]) ** p for p in range(_INSIDE)),
    Polynomial([0.0, 0.0, -1.0, 1.0]),  # slope 1 at the end
    Polynomial([0.0, 1.0, -2.0, 1.0]),  # slope 1 at the beginning
)


def _coefficients(shapes: Sequence[Polynomial]) -> FloatArray:
    return np.array([np.pad(s.coef, (0, 8 - s.coef.size)) for s in shapes])


_VALUES = tuple(_coefficients([s.deriv(k) if k else s for s in _SHAPES]) for k in range(3))
_HILBERT = 1.0 / (np.arange(8)[:, None] + np.arange(8) + 1.0)  # integrals of powers times powers


@dataclass(frozen=True)
class DrivenMotion:
    """What the motion of the mass says of w0^2, 2 zeta w0 and the base, as a normal distribution.

    Attributes
    ----------
    values : array (5,)
        w0^2 (1/s^2), 2 zeta w0 (1/s), what drives the mass, w0^2 x_e + 2 zeta w0 x_e', in units
        of `scale`, in phase with the base's channel and a quarter of a period ahead of it, and
        the acceleration of the mass by the friction of the ball, m/s^2.
    information : array (5, 5)
        Inverse of their covariance, from what each flight leaves.
    rate : float
        Angular frequency of the base, rad/s.
    scale : float
        m; amplitude of the base as its channel shows it; 1 where none was recorded, whose phase is
        then not known.
    recorded : bool
    flights : int
    middle : float
        Time in the record, s, at which the base's channel, or a cosine where none was recorded, has
        `phase`, rad.
    swing : (float, float)
        Displacement at this rate, in phase with that channel and a quarter of a period ahead, m.
    by_corner : array (2, 5)
        What an AC coupling of the displacement with a corner of 1/s changes the values by: a first
        part, and one for each 1/s^2 of w0^2.
    rate_error : float
        Standard error of `rate` where no base was recorded, rad/s, as the flights leave it.
    misfit : (float, float)
        By which all f0 and zeta of such tests may be off alike, relative: kinds of equations, of
        which each should ask for one oscillator, ask for others.
    grows : (float, float)
        By what share the amplitude of a base that was not recorded grows from the middle of the
        record to its end, and its error.
    """

    values: FloatArray
    information: FloatArray
    rate: float
    scale: float
    recorded: bool
    flights: int
    middle: float
    phase: float
    swing: tuple[float, float]
    by_corner: FloatArray
    rate_error: float = 0.0
    misfit: tuple[float, float] = (0.0, 0.0)
    grows: tuple[float, float] = (0.0, 0.0)

    @property
    def oscillator(self) -> dict[str, float]:
        """f0, Hz, and zeta, where nothing else says them; 0 for what the motion does not show."""
        w0 = math.sqrt(max(float(self.values[0]), 0.0))
        return {
            "f0": w0 / (2.0 * math.pi), "zeta": 0.5 * float(self.values[1]) / w0 if w0 else 0.0
        }  # fmt: skip

    @property
    def drift(self) -> float:
        """By what share the base surely grows in half of the record; 0 where that is not sure."""
        grows, error = self.grows
        return grows if abs(grows) > SURE * error else 0.0

    @property
    def own_rate(self) -> float:
        """Angular frequency of the oscillator, rad/s, if this motion alone shows it; else 0."""
        held = self.information[0, 1:] @ np.linalg.pinv(self.information[1:, 1:])
        left = float(self.information[0, 0] - held @ self.information[1:, 0])
        known = left > (2.0 * _MODULATED * float(self.values[0])) ** -2
        return math.sqrt(float(self.values[0])) if known else 0.0

    def driven(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The five for ln f0, ln zeta, ln of the base's amplitude, its phase, the friction.

        And their derivatives, shape (5, 5).
        """
        f0, zeta, G, phase = math.exp(p[0]), math.exp(p[1]), math.exp(p[2]) / self.scale, p[3]
        w0 = 2.0 * math.pi * f0
        a, b = w0 * w0, 2.0 * zeta * w0
        turn = G * complex(math.cos(phase), math.sin(phase))
        c = turn * complex(a, b * self.rate)
        by_f0 = turn * complex(2.0 * a, b * self.rate)
        by_zeta = turn * complex(0.0, b * self.rate)
        J = np.array(
            [
                [2.0 * a, 0.0, 0.0, 0.0, 0.0],
                [b, b, 0.0, 0.0, 0.0],
                [by_f0.real, by_zeta.real, c.real, -c.imag, 0.0],
                [by_f0.imag, by_zeta.imag, c.imag, c.real, 0.0],
                [0.0, 0.0, 0.0, 0.0, 1.0],
            ]
        )
        return np.array([a, b, c.real, c.imag, p[4]]), J

    def by_coupling(self, five: FloatArray) -> FloatArray:
        """What an AC coupling with a corner of 1/s changes the five by.

        Of x = y + w_c (integral of y) a damper c leaves c w_c in the spring.
        """
        changes = self.by_corner[0] + five[0] * self.by_corner[1]
        changes[0] -= five[1]
        return np.asarray(changes)

    def base(self, *, f0: float, zeta: float) -> tuple[float, float, float]:
        """Amplitude of the base on the scale of the displacement, its error, m; its phase, rad.

        For an oscillator of this `f0`, Hz, and `zeta`, and a ball without friction.
        """
        w0 = 2.0 * math.pi * f0
        inner = self.information[_BASE, _BASE]
        q = _base_of(self.values, self.information, np.array([w0 * w0, 2.0 * zeta * w0, 0.0]))
        size = float(np.hypot(*q))
        error = math.sqrt(max(float(q @ np.linalg.solve(inner, q)), 0.0)) / max(size, 1e-300)
        per = complex(w0 * w0, 2.0 * zeta * w0 * self.rate)
        phase = math.atan2(q[1], q[0]) - math.atan2(per.imag, per.real)
        return size / abs(per) * self.scale, error / abs(per) * self.scale, phase

    def motion_of_base(self, *, f0: float, zeta: float) -> complex:
        """Phasor of the base, m, beside its channel: as recorded, else as the mass answers it."""
        size, _, phase = self.base(f0=f0, zeta=zeta)
        if self.recorded:
            return complex(math.copysign(self.scale, math.cos(phase)))
        return size * complex(math.cos(phase), math.sin(phase))

    def at(self, base: complex, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Displacement, m, and velocity, m/s, of a base of this phasor at some times, s."""
        wave = base * np.exp(1j * (self.rate * (time - self.middle) + self.phase))
        return wave.real, -self.rate * wave.imag

    def as_lists(self) -> dict[str, Any]:
        """For a file of JSON; `driven_from` reads it."""
        return {
            **asdict(self), **{name: getattr(self, name).tolist() for name in _ARRAYS}
        }  # fmt: skip


def _base_of(values: FloatArray, information: FloatArray, known: FloatArray) -> FloatArray:
    """What drives the mass, in phase and ahead, where w0^2, 2 zeta w0 and friction are known."""
    inner, across = information[_BASE, _BASE], information[_BASE][:, _KNOWN]
    return values[_BASE] - np.linalg.solve(inner, across @ (known - values[_KNOWN]))


def driven_from(lists: Mapping[str, Any]) -> DrivenMotion:
    """What `DrivenMotion.as_lists` made.

    Raises
    ------
    RecordError
        It is of another version, or damaged.
    """
    try:
        arrays = {name: np.array(lists[name], dtype=np.float64) for name in _ARRAYS}
        return DrivenMotion(**{**lists, **arrays})
    except (KeyError, TypeError, ValueError) as error:
        raise RecordError(
            f"the motion of the mass in the estimates of a record cannot be read ({error}); run "
            "the estimate step again"
        ) from None


def driven_motion(
    view: RecordView, impacts: Impacts, *, frequency: float, stated: float | None = None,
    late: float = 0.0, amplitude: float | None = None,
) -> DrivenMotion | None:  # fmt: skip
    """Fit the equation of motion to all flights of a periodic record.

    Parameters
    ----------
    view : RecordView
        With a displacement; the base, where it was recorded as a displacement, is taken as it
        moved, else as a sine of unknown amplitude and phase.
    impacts : Impacts
        Of all balls.
    frequency : float
        Of the oscillation, Hz.
    stated : float, optional
        Frequency of the base by the test log, Hz.
    late : float
        By which the displacement is known to come after the impacts, s; what is left is fitted.
    amplitude : float, optional
        Of the base in the cycles that count, m, by its channel; else that over all of the record.

    Returns
    -------
    DrivenMotion or None
        None where there are too few flights.
    """
    k, x, flights = _displaced(view, impacts, frequency, late)
    if flights is None:
        return None
    step = flights.step
    near = stated if stated and abs(stated / frequency - 1.0) < _FAR else frequency
    if "base" in view.roles and view.quantity("base") == "displacement":
        e = channel_means(view, "base", k)[: x.size]
        moved = base_motion(e, step, frequency=near)
        if moved is None:
            return None
        return _fitted(flights, x, e - e.mean(), moved.frequency, amplitude or moved.amplitude)
    swing = base_motion(x, step, frequency=near)
    about = {near} if swing is None else {near, swing.frequency}
    close = [f for f in sorted(about) if abs(f / near - 1.0) < _FAR]
    return _fitted(flights, x, None, _unseen_base(flights, x, close), 1.0)


def _displaced(
    view: RecordView, impacts: Impacts, frequency: float, late: float
) -> tuple[int, FloatArray, _Flights | None]:
    """Samples of a mean, means of the displacement around their middle, and their flights."""
    k = group_size(view.sample_rate, frequency, points=_POINTS)
    step = k / view.sample_rate
    x = channel_means(view, "displacement", k)
    begin = view.start - late + 0.5 * (step - 1.0 / view.sample_rate)
    missing = missing_means(view, "displacement", k)
    return k, x - x.mean(), _flights(impacts, missing, begin, step, period=1.0 / frequency)


@dataclass(frozen=True)
class FreeMotion:
    """f0, Hz, and zeta by the flights of a release, their standard errors; the amplitude, m."""

    f0: float
    f0_error: float
    zeta: float
    zeta_error: float
    amplitude: float


def free_motion(
    view: RecordView, impacts: Impacts, *, frequency: float, late: float = 0.0
) -> FreeMotion | None:
    """Fit the equation of motion to all flights of a release, whose base is at rest.

    Parameters
    ----------
    view, impacts, frequency, late : see `driven_motion`

    Returns
    -------
    FreeMotion or None
        None where there are too few flights, they do not show one damper to the end, or its
        damping is not known.
    """
    _, x, flights = _displaced(view, impacts, frequency, late)
    if flights is None or not x.any():
        return None
    moments, n = flights.moments(x), flights.length.size
    starts = np.unique(np.linspace(0, n - _LATE, _STARTS).astype(np.int64))
    fits = {int(first): _freely(flights, moments, frequency, int(first)) for first in starts}
    known = {first: fit for first, fit in fits.items() if fit is not None}
    for first, (p, covariance, count) in known.items():
        later = [fit for start, fit in known.items() if start > first]
        apart = [np.abs(other[0] - p) / np.sqrt(np.diag(other[1])) for other in later]
        if count >= _FEWEST and (p > 0.0).all() and later and np.max(apart) < SURE:
            f0, zeta = _relative(p, covariance)
            if not is_known(1.0, zeta):  # noise has a frequency, too
                return None
            w0 = math.sqrt(p[0])
            swings = x[flights.low[flights.first[first]] : flights.low[-1]]
            return FreeMotion(
                w0 / (2.0 * math.pi), f0 * w0 / (2.0 * math.pi), 0.5 * float(p[1]) / w0,
                zeta * 0.5 * float(p[1]) / w0, math.sqrt(2.0) * float(swings.std()),
            )  # fmt: skip
    return None


def _freely(
    flights: _Flights, moments: FloatArray, frequency: float, first: int
) -> tuple[FloatArray, FloatArray, int] | None:
    """w0^2 and 2 zeta w0 by the flights from one on, their covariance, and how many count.

    No base drives the mass; None where too few of the flights agree.
    """
    rows = _consistent(flights, moments, [], frequency, first=first, fewest=_LATE)
    if rows is None:
        return None
    along, lag = rows.of(moments), _LAG
    rubbed = -rows.of(flights.rubbing())[:, 0]
    touch = 0.5 * rows.of(flights.touching())[:, 0]
    others = [touch, rubbed, *rows.of(flights.drift()).T, rows.jump]
    design = np.stack([along[:, 0], -along[:, 1], *others], axis=1)
    y, touching, count = touch - along[:, 2], np.eye(1, design.shape[1], 2), len(design)
    for _ in range(_TURNS):
        white = rows.whitener(lag)(np.column_stack([design, y]))
        A, rest = np.vstack([white[:, :-1], touching]), np.append(white[:, -1], 0.0)
        size = np.sqrt((A**2).sum(axis=0))
        size = np.where(size > 0.0, size, 1.0)
        p, left = _without_outliers(A, rest, size, rows.flight)
        lag = _scatter_of_times(rows, y - design @ p)
    own, left = _apart(A[:, :2], A[:, 2:] / size[2:])[:count], left[:count]
    kept = A[:count].any(axis=1)
    counted = np.unique(rows.flight[kept]).size
    if counted < _LATE:
        return None
    covariance = np.linalg.pinv(_of_scatter(own, left, rows)[0])
    # few flights hardly show their scatter: what that of all of them makes of it at least
    usual = float(left @ left) / np.count_nonzero(kept) * np.linalg.pinv(own.T @ own)
    more = np.sqrt(np.maximum(np.diag(usual) / np.diag(covariance), 1.0))
    return p[:2], covariance * np.outer(more, more), counted


@dataclass(frozen=True)
class _Flights:
    """Samples of all flights side by side, and what weighs them in integrals over a flight.

    Attributes
    ----------
    first : array (flights + 1,), where the nodes of each flight begin.
    low, share : array (nodes,), sample before a node and how far to the next.
    weight : array (nodes,), s; of Gregory's rule.
    powers : array (8, nodes), of the part of the flight that has passed.
    length : array (flights,), s.
    jump, push : arrays (flights,)
        Of the velocity at the impact that ends a flight and at the one that begins it, m/s.
    lasts : float
        Variance of the times at which a contact pushes, about its middle, s^2.
    joined : bool array (flights,), whether the next flight begins where this one ends.
    begin, step : s; of the first sample, between samples.
    """

    first: IntArray
    low: IntArray
    share: FloatArray
    weight: FloatArray
    powers: FloatArray
    length: FloatArray
    jump: FloatArray
    push: FloatArray
    lasts: float
    joined: BoolArray
    begin: float
    step: float

    def moments(self, y: FloatArray) -> FloatArray:
        """Integrals of phi y, phi' y, phi'' y for each flight; shape (flights, functions, 3)."""
        at = (1.0 - self.share) * y[self.low] + self.share * y[self.low + 1]
        plain = np.add.reduceat(self.powers * (self.weight * at), self.first[:-1], axis=1)
        parts = [plain.T @ c.T * self.length[:, None] ** -k for k, c in enumerate(_VALUES)]
        found = np.stack(parts, axis=-1)
        found[:, _INSIDE:] *= self.length[:, None, None]
        return found

    def drift(self) -> FloatArray:
        """Integrals of phi times a constant and slow cosines; shape (flights, functions, n)."""
        plain = self.length[:, None] * (_VALUES[0] @ (1.0 / np.arange(1.0, 9.0)))
        plain[:, _INSIDE:] *= self.length[:, None]
        slow = np.arange(1 + min(len(self.length) // _DRIFTS, _MOST_DRIFTS))
        past = (np.cumsum(self.length) - 0.5 * self.length) / self.length.sum()
        return np.asarray(plain[..., None] * np.cos(np.pi * slow * past[:, None, None]))

    def rubbing(self) -> FloatArray:
        """Integrals of phi times the direction of a ball's flight; shape (flights, functions, 1).

        It left the wall that it pushed: friction on its floor takes the mass along.
        """
        return np.asarray(-np.sign(self.push)[:, None, None] * self.drift()[..., :1])

    def touching(self) -> FloatArray:
        """Integrals of phi times what contacts push before and after their middle; as `rubbing`.

        phi is 0 in the middle, and bends from there: phi'' over 2, for one half of the contact.
        That of contacts as long as their pulses. Filters and mounts make pulses longer, so a fit
        takes half of it, give or take that half.
        """
        bends = np.stack([_VALUES[2][:, 0], _VALUES[2].sum(axis=1)])  # where a flight begins, ends
        found = 0.25 * self.lasts * np.stack([self.push, self.jump], axis=1) @ bends
        found /= self.length[:, None] ** 2
        found[:, _INSIDE:] *= self.length[:, None]
        return np.asarray(found[..., None])

    def noise(self, w: float) -> FloatArray:
        """Products of phi'' + w^2 phi, integrated: covariance of moments of white noise."""
        T = self.length[:, None, None]
        L = _VALUES[2] / T**2 + w * w * _VALUES[0]
        L[:, _INSIDE:] *= T
        return np.asarray(T * (L @ _HILBERT @ L.transpose(0, 2, 1)) * self.step)


def _flights(
    impacts: Impacts, missing: BoolArray, begin: float, step: float, *, period: float
) -> _Flights | None:
    """Flights between neighbouring impacts that are no longer than one can be and miss nothing."""
    times, jumps = impacts.time_s, np.nan_to_num(impacts.velocity_jump_m_s)
    start, end = times[:-1], times[1:]
    good = (end - start > _SHORTEST * period) & (end - start < _LONGEST * period)
    good &= (start > begin) & (end < begin + (missing.size - 1) * step)
    good &= end - start > 12.0 * step
    lost = np.cumsum(np.append(0, missing))
    first, last = (
        np.clip(((when - begin) / step).astype(np.int64), 0, missing.size - 2)
        for when in (start, end)
    )
    good &= lost[first] == lost[last + 2]
    own = np.flatnonzero(good)
    if own.size < _FEWEST:
        return None
    at = (np.stack([start, end])[:, own] - begin) / step
    inner = np.floor(at[1]).astype(np.int64) - np.ceil(at[0]).astype(np.int64) + 1
    first = np.concatenate([[0], np.cumsum(inner + 2)])
    flight = np.repeat(np.arange(own.size), inner + 2)
    place = np.arange(first[-1]) - first[flight]
    node = np.ceil(at[0])[flight] + place - 1.0
    node = np.clip(node, at[0][flight], at[1][flight])
    edge = np.diff(node)
    edge[first[1:-1] - 1] = 0.0
    weight = 0.5 * step * (np.append(edge, 0.0) + np.insert(edge, 0, 0.0))
    for i, gregory in enumerate(_GREGORY, start=1):  # the samples between: third order
        weight[first[:-1] + i] += gregory * step
        weight[first[1:] - 1 - i] += gregory * step
    # beyond the last sample of a flight the motion goes straight on: an impact is a corner
    low = np.clip(np.floor(node), np.ceil(at[0])[flight], np.floor(at[1])[flight] - 1.0)
    tau = (node - at[0][flight]) / (at[1] - at[0])[flight]
    powers = np.cumprod(np.vstack([np.ones_like(tau), np.tile(tau, (7, 1))]), axis=0)
    joined = np.append(np.diff(own) == 1, False)
    pulses = impacts.pulses[np.isfinite(impacts.pulses)]
    lasts = _OF_HALF_SINE * float(np.median(pulses)) ** 2 if pulses.size else 0.0
    return _Flights(
        first, low.astype(np.int64), node - low, weight, powers, (end - start)[own],
        jumps[1:][own], jumps[:-1][own], lasts, joined, begin, step,
    )  # fmt: skip


@dataclass(frozen=True)
class _Rows:
    """Equations of flights that count: rows of moments, summed over flights by `sums`.

    Attributes
    ----------
    sums : arrays (rows, 6 flights), one for each chunk of flights.
    own : arrays (flights,), which flights each chunk holds.
    noise : arrays (rows, rows), covariance of each chunk's rows by the noise of the samples.
    jump : array (all rows,), of the velocity at the impact in the middle of a row, m/s, or 0.
    flight : array (all rows,), the flight that a row is counted with.
    kind : array (all rows,), number of its function, by either wall.
    """

    sums: tuple[FloatArray, ...]
    own: tuple[IntArray, ...]
    noise: tuple[FloatArray, ...]
    jump: FloatArray
    flight: IntArray
    kind: IntArray

    def of(self, moments: FloatArray) -> FloatArray:
        """Moments (flights, functions, ...) summed to rows."""
        shape = (-1, *moments.shape[2:])
        return np.concatenate(
            [
                np.tensordot(B, moments[own].reshape(shape), 1)
                for B, own in zip(self.sums, self.own, strict=True)
            ]
        )

    def whitener(self, lag: float) -> Callable[[FloatArray], FloatArray]:
        """Makes rows whose noise is that of the samples and a scatter of the impacts' times, s."""
        begins = np.cumsum([0, *map(len, self.noise)])
        factors = [
            np.linalg.cholesky(N + np.diag((lag * self.jump[begin : begin + len(N)]) ** 2))
            for N, begin in zip(self.noise, begins, strict=False)
        ]

        def white(rows: FloatArray) -> FloatArray:
            parts = np.split(rows, begins[1:-1])
            return np.concatenate(
                [
                    solve_triangular(C, part, lower=True, check_finite=False)
                    for C, part in zip(factors, parts, strict=True)
                ]
            )

        return white


def _rows(flights: _Flights, kept: BoolArray, noise: FloatArray) -> _Rows:
    """Equations of the flights kept: four inside each, one across each impact between two."""
    sums, chunks, covariances, jumps, of_flight, kinds = [], [], [], [], [], []
    walls = (flights.push > 0.0).astype(np.int64) * (_INSIDE + 1)
    for begin in range(0, kept.size, _CHUNK):
        own = begin + np.flatnonzero(kept[begin : begin + _CHUNK])
        n = own.size
        if not n:
            continue
        across = np.flatnonzero((np.diff(own) == 1) & flights.joined[own[:-1]])
        B = np.zeros((_INSIDE * n + across.size, 6 * n))
        inside = np.arange(_INSIDE * n)
        B[inside, 6 * (inside // _INSIDE) + inside % _INSIDE] = 1.0
        row = _INSIDE * n + np.arange(across.size)
        B[row, 6 * across + _INSIDE] = 1.0
        B[row, 6 * (across + 1) + _INSIDE + 1] = 1.0
        whole = np.zeros((n, 6, n, 6))
        whole[np.arange(n), :, np.arange(n), :] = noise[own]
        sums.append(B)
        chunks.append(own)
        covariances.append(B @ whole.reshape(6 * n, 6 * n) @ B.T)
        jumps.append(np.concatenate([np.zeros(_INSIDE * n), flights.jump[own[across]]]))
        of_flight.append(np.concatenate([np.repeat(own, _INSIDE), own[across]]))
        kinds.append(np.concatenate([inside % _INSIDE, np.full(across.size, _INSIDE)]))
    flight = np.concatenate(of_flight)
    return _Rows(tuple(sums), tuple(chunks), tuple(covariances), np.concatenate(jumps), flight,
                 np.concatenate(kinds) + walls[flight])  # fmt: skip


def _fitted(
    flights: _Flights, x: FloatArray, e: FloatArray | None, frequency: float, scale: float
) -> DrivenMotion | None:
    """Regress x'' on x, x', base and quadrature, friction, a constant that drifts and a lag.

    Where the base was not recorded its frequency is fitted too, and its harmonics.
    """
    # from the middle of the record: its frequency turns the base's phase as little as can be
    w, middle = 2.0 * math.pi * frequency, 0.5 * (x.size - 1)
    t = flights.step * (np.arange(x.size, dtype=np.float64) - middle)
    waves: list[FloatArray] = [np.cos(w * t), -np.sin(w * t)]
    rest_of_base: list[FloatArray] = []
    phase = 0.0
    if e is not None:
        waves, rest_of_base = _parts(e, w * t, round(2.0 * math.pi / (w * flights.step)))
        phase = float(np.angle(_phasor(waves[0], w * t)))
    moments, base = flights.moments(x), [flights.moments(wave) for wave in waves]
    rows = _consistent(flights, moments, base, frequency)
    if rows is None:
        return None
    # x'' + w0^2 x + 2 zeta w0 x' = w0^2 x_e + 2 zeta w0 x_e', integrated by parts
    along, rubbed = rows.of(moments), -rows.of(flights.rubbing())[:, 0]
    others = [*rows.of(flights.drift()).T, rows.jump]
    touch = 0.5 * rows.of(flights.touching())[:, 0]
    y = touch - along[:, 2]
    # AC coupling with a corner of w_c leaves y of x = y + w_c (integral of y)
    integral = rows.of(flights.moments(_integral(x, flights.step, w)))
    coupled = np.stack([-along[:, 1], integral[:, 0]], axis=1)
    found: _Solved | None = None
    turned = grows = 0.0, 0.0
    turning: list[FloatArray] = []  # the mass follows what the base does, no noise of its sensor
    for one in rest_of_base:
        here = rows.of(flights.moments(one))
        turning += [-w * w * here[:, 0], _DAMPED * w * here[:, 1]]
    for _ in range(_TURNS):
        driven = [rows.of(one) for one in base]
        ahead = -driven[0][:, 1] / w if e is not None else driven[1][:, 0]
        sought = [along[:, 0], -along[:, 1], -driven[0][:, 0], -ahead, rubbed]
        design = np.stack([*sought, *turning, touch, *others], axis=1)
        lag = _LAG if found is None else found.lag
        found = _solved(rows, design, y, coupled, lag, w, held=len(turning) + 1)
        if found is None:
            return None
        if e is None:
            per = _KNOWN_RATE / float(np.ptp(t))
            if turning:
                turned, grows = found.coefficient(0, per), found.coefficient(1, _GROWS)
                w += turned[0]
            waves = [np.cos(w * t), -np.sin(w * t)]
            base = [flights.moments(wave) for wave in waves]
            c, s = _ordinary(found, w)
            later = (c * waves[1] - s * waves[0]) * t * per
            larger = (c * waves[0] + s * waves[1]) * (_GROWS / t[-1]) * t
            size = _DISTORTED * math.hypot(c, s)
            harmonics = [size * turn(k * w * t) for k in _HARMONICS for turn in (np.cos, np.sin)]
            turning = [-rows.of(flights.moments(one))[:, 0] for one in (later, larger, *harmonics)]
    assert found is not None
    swing = _phasor(x, w * t + phase)
    return DrivenMotion(
        found.values, found.information, w, scale, e is not None, found.flights,
        flights.begin + middle * flights.step, phase, (swing.real, swing.imag),
        found.by_corner, turned[1], found.misfit, grows,
    )  # fmt: skip


def _integral(x: FloatArray, step: float, w: float) -> FloatArray:
    """Of a displacement over time, without its drift."""
    total = (np.cumsum(x) - 0.5 * x) * step
    wanders = min(_WANDERS * 2.0 * math.pi / (w * step), 0.5 * x.size)
    return total - _slower(total, round(wanders))


def _phasor(y: FloatArray, turn: FloatArray) -> complex:
    """Of the part of a motion that goes with a wave of this phase, rad."""
    window = np.hanning(y.size)
    return complex(2.0 * (y * window) @ np.exp(-1j * turn) / window.sum())


def _parts(
    e: FloatArray, turn: FloatArray, period: int
) -> tuple[list[FloatArray], list[FloatArray]]:
    """A base channel as its sine, of phase `turn`; and what else may be motion, or noise.

    Only the sine is known to be a motion: noise that counts as one says anything of f0 and zeta.
    The rest: what is slower, what is faster, and what another frequency of the sine would change.
    """
    slow = _slower(e, period)
    waves = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    c, s = np.linalg.lstsq(waves, e - slow, rcond=None)[0]
    sine, ahead = waves @ [c, s], waves @ [s, -c]
    return [sine], [slow, e - slow - sine, ahead * turn * (_KNOWN_RATE / np.ptp(turn))]


def _slower(e: FloatArray, period: int) -> FloatArray:
    """What is slower than a sine of so many samples; held constant in the first and last period."""
    slow = uniform_filter1d(uniform_filter1d(e, period), period)
    slow[:period], slow[-period:] = slow[period], slow[-period - 1]
    return np.asarray(slow)


def _ordinary(found: _Solved, w: float) -> FloatArray:
    """The base and its quadrature by an oscillator as there are: near resonance, lightly damped."""
    mean = np.array([w * w, 0.0, 0.0, 0.0, 0.0])
    prior = np.diag([(0.05 * w * w) ** -2, (_DAMPED * w) ** -2, 0.0, 0.0, 1.0])  # friction: 1 m/s^2
    H = found.information + prior
    return np.asarray(np.linalg.solve(H, found.information @ found.values + prior @ mean)[_BASE])


@dataclass(frozen=True)
class _Solved:
    """Values sought, the information about them, by which f0 and zeta may be off, relative; what a
    corner changes them by; scatter of the impacts' times; and, for a number and a unit, one of the
    coefficients that are held, with its error.
    """

    values: FloatArray
    information: FloatArray
    misfit: tuple[float, float]
    by_corner: FloatArray
    lag: float
    flights: int
    coefficient: Callable[[int, float], tuple[float, float]]


def _solved(
    rows: _Rows, design: FloatArray, y: FloatArray, coupled: FloatArray, lag: float, w: float, *,
    held: int,
) -> _Solved | None:  # fmt: skip
    """Generalised least squares; what each flight leaves, with its weight, is the scatter.

    Of the columns after those sought, `held` ones have coefficients of 0 +- 1.
    """
    white = rows.whitener(lag)(np.column_stack([design, coupled, y]))
    A, rest = white[:, : design.shape[1]], white[:, -1]
    q = np.vstack([white[:, design.shape[1] : -1], np.zeros((held, 2))])
    count = len(A)
    A = np.vstack([A, np.eye(held, A.shape[1], _SOUGHT)])
    rest = np.append(rest, np.zeros(held))
    size = np.sqrt((A**2).sum(axis=0))
    if not np.all(size[:_SOUGHT] > 0.0):
        return None
    size = np.where(size > 0.0, size, 1.0)
    p, left = _without_outliers(A, rest, size, rows.flight)
    # what drift, lag and frequency can stand for says nothing of the five
    others = A[:, _SOUGHT:] / size[_SOUGHT:]
    own = _apart(A[:, :_SOUGHT], others)
    information, kinds = _of_scatter(own[:count], left[:count], rows)
    values = p[:_SOUGHT]
    misfit = _relative(values, kinds)
    by_corner = -(np.linalg.lstsq(A / size, q, rcond=1e-12)[0].T / size)[:, :_SOUGHT]
    if _repeats(values, information):
        misfit = 0.0, 0.0  # it says nothing of f0 and zeta
        values, information = _of_base(own, left, values, rows, w)
        q = _apart(q, others)
        by_corner = np.zeros((2, _SOUGHT))
        by_corner[:, _BASE] = -np.linalg.lstsq(own[:, _BASE], q, rcond=1e-12)[0].T
    times = _scatter_of_times(rows, y - design @ p)
    flights = len(np.unique(rows.flight))

    def coefficient(number: int, unit: float) -> tuple[float, float]:
        k = _SOUGHT + number
        error = _error_of(k, A / size, left, rows) / float(size[k])
        return unit * float(p[k]), unit * error

    return _Solved(values, information, misfit, by_corner, times, flights, coefficient)


def _apart(values: FloatArray, others: FloatArray) -> FloatArray:
    """What is left of columns when others explain of them what they can."""
    return np.asarray(values - others @ np.linalg.lstsq(others, values, rcond=1e-12)[0])


def _error_of(column: int, A: FloatArray, left: FloatArray, rows: _Rows) -> float:
    """Standard error of one coefficient by what each flight leaves."""
    others = np.delete(A, column, axis=1)
    own = _apart(A[:, column], others)
    count = rows.flight.size
    known = float(_of_scatter(own[:count, np.newaxis], left[:count], rows)[0][0, 0])
    return 1.0 / math.sqrt(max(known, _TINY))


def _relative(values: FloatArray, covariance: FloatArray) -> tuple[float, float]:
    """Standard errors of ln f0 and ln zeta by the covariance of the five."""
    by_f0 = 0.5 / values[0]
    slopes = np.array([[by_f0, 0.0], [-by_f0, 1.0 / values[1]]])
    variances = ((slopes @ covariance[:2, :2]) * slopes).sum(axis=1)
    f0, zeta = np.sqrt(np.maximum(variances, 0.0)).tolist()
    return f0, zeta


def _without_outliers(
    A: FloatArray, y: FloatArray, size: FloatArray, flight: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Least squares, and what it leaves, without flights that stand out: they lose their rows.

    An impact whose time is that of a knock stands out across it, and nowhere else.
    """
    rows_of = np.maximum(np.bincount(flight), 1)
    there = np.bincount(flight) > 0
    kept = np.ones(len(y), dtype=bool)
    for _ in range(_PASSES):
        p = np.linalg.lstsq(A / size, y, rcond=1e-12)[0] / size
        left = y - A @ p
        norm = np.sqrt(np.bincount(flight, left[: flight.size] ** 2) / rows_of)
        new = kept.copy()
        usual = float(np.median(norm[there & (norm > 0.0)])) if norm.any() else 0.0
        new[: flight.size] &= (norm < _OUTSIDE * usual + 1e-30)[flight]
        if (new == kept).all():
            break
        kept = new
        A[~kept], y[~kept] = 0.0, 0.0
    return p, left


def _of_scatter(
    columns: FloatArray, left: FloatArray, rows: _Rows
) -> tuple[FloatArray, FloatArray]:
    """Information about coefficients, by what each flight leaves, with its weight.

    And by what each kind of function leaves of all flights, beyond what their scatter may make of
    it: where a second mode rings after each impact, every kind asks for another oscillator, however
    many flights there are. That part of the covariance by itself is the second value.
    """
    unit = np.sqrt((columns**2).sum(axis=0))
    columns = columns / unit
    each = columns * left[:, np.newaxis]
    scores = np.zeros((int(rows.flight.max()) + 1, unit.size))
    np.add.at(scores, rows.flight, each)
    H, S = columns.T @ columns, scores.T @ scores
    S, K = S + _TINY * np.trace(S) * np.eye(unit.size), np.zeros_like(S)
    for kind in np.unique(rows.kind):
        own = each[rows.kind == kind]
        score, scatter = own.sum(axis=0), own.T @ own
        if not np.trace(scatter) > 0.0:  # none of them counts
            continue
        scatter += _TINY * np.trace(scatter) * np.eye(unit.size)
        chance = float(score @ np.linalg.solve(scatter, score)) / unit.size
        K += max(1.0 - _CHANCE / max(chance, 1e-300), 0.0) * np.outer(score, score)
    flights = len(np.unique(rows.flight))
    information = H @ np.linalg.solve(S + K, H)
    share = max(flights - unit.size - 1, 1) / flights
    back = np.linalg.pinv(H) / np.outer(unit, unit)
    return (
        np.asarray(information * unit[:, np.newaxis] * unit * share),
        np.asarray(back @ (K * np.outer(unit, unit)) @ back),
    )


def _repeats(values: FloatArray, information: FloatArray) -> bool:
    """Whether the motion is too much the same from cycle to cycle to say f0 by itself."""
    across = information[_BASE][:, _KNOWN]
    inner = information[np.ix_(_KNOWN, _KNOWN)]
    inner = inner - across.T @ np.linalg.solve(information[_BASE, _BASE], across)
    scale = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    covariance = np.linalg.pinv(inner / np.outer(scale, scale)) / np.outer(scale, scale)
    error = math.sqrt(max(float(covariance[0, 0]), 0.0))
    return not error < 2.0 * _MODULATED * abs(float(values[0]))


def _of_base(
    own: FloatArray, left: FloatArray, values: FloatArray, rows: _Rows, w: float
) -> tuple[FloatArray, FloatArray]:
    """The base for a given oscillator, and no more: what a motion that repeats can say.

    What it seems to say of f0 and zeta is what no oscillator explains (contacts that last,
    harmonics, other modes), and no scatter shows it. Taken at an oscillator as there are: near
    resonance, lightly damped.
    """
    known = np.array([w * w, _DAMPED * w, 0.0])
    count, base, others = rows.flight.size, own[:, _BASE], own[:, _KNOWN]
    asked = left + base @ values[_BASE] + others @ (values[_KNOWN] - known)
    by_known = np.linalg.lstsq(base, others, rcond=1e-12)[0]  # what one more takes from the base
    found = np.linalg.lstsq(base, asked, rcond=1e-12)[0]
    inner = _of_scatter(base[:count], (asked - base @ found)[:count], rows)[0]
    values, information = np.zeros(_SOUGHT), np.zeros((_SOUGHT, _SOUGHT))
    values[_BASE], values[_KNOWN] = found, known
    information[_BASE, _BASE] = inner
    information[_BASE, _KNOWN] = inner @ by_known
    information[_KNOWN, _BASE] = information[_BASE, _KNOWN].T
    information[np.ix_(_KNOWN, _KNOWN)] = by_known.T @ inner @ by_known
    return values, information


def _scatter_of_times(rows: _Rows, rest: FloatArray) -> float:
    """Standard deviation of the times of impacts, s, by what is left across them."""
    across = np.abs(rows.jump) > 0.0
    if across.sum() < _FEWEST // 2:
        return _LAG
    off = rest[across]
    by_noise = np.concatenate([np.diag(N) for N in rows.noise])[across]
    for lag in _LAGS:
        if np.median(off**2 / (by_noise + (lag * rows.jump[across]) ** 2)) < _MEDIAN:
            break
    return float(lag)


def _consistent(
    flights: _Flights, moments: FloatArray, driven: Sequence[FloatArray], near: float,
    *, first: int = 0, fewest: int = _FEWEST,
) -> _Rows | None:  # fmt: skip
    """Equations of the flights that one oscillator explains: in others an impact was missed."""
    inside = slice(0, _INSIDE)
    gram = flights.noise(2.0 * math.pi * near)
    factor = np.linalg.cholesky(gram[:, inside, inside])
    kept = there = np.arange(len(moments)) >= first
    for _ in range(_PASSES):
        rest = _free_fit(
            moments[:, inside], [e[:, inside] for e in driven], flights.drift()[:, inside], kept
        )
        white = np.linalg.solve(factor, rest[..., np.newaxis])[..., 0]
        norm = np.sqrt((white**2).sum(axis=1))
        new = there & (norm < _OUTSIDE * float(np.median(norm[kept])) + 1e-30)
        if (new == kept).all():
            break
        kept = new
    if kept.sum() < fewest:
        return None
    density = float(np.median(white[kept] ** 2)) / _MEDIAN
    return _rows(flights, kept, max(density, 1e-30) * gram)


def _free_fit(
    x: FloatArray, drive: Sequence[FloatArray], drift: FloatArray, kept: BoolArray
) -> FloatArray:
    """What least squares with w0 and zeta unknown as well leave of each flight."""
    design = np.stack(
        [x[..., 0], x[..., 1], *(e[..., 0] for e in drive), *np.moveaxis(drift, -1, 0)], axis=-1
    )
    A, y = design[kept].reshape(-1, design.shape[-1]), x[kept][..., 2].reshape(-1)
    size = np.maximum(np.sqrt((A**2).sum(axis=0)), 1e-300)
    p = np.linalg.lstsq(A / size, y, rcond=1e-10)[0] / size
    return np.asarray(x[..., 2] - design @ p)


def _unseen_base(flights: _Flights, x: FloatArray, about: Sequence[float]) -> float:
    """Frequency of the sine that explains the flights best, near `about`, Hz."""
    t = flights.begin + flights.step * np.arange(x.size)
    moments = flights.moments(x)
    kept: list[tuple[_Rows, Callable[[FloatArray], FloatArray]] | None] = []

    def waves(f: float) -> list[FloatArray]:
        return [np.cos(2.0 * math.pi * f * t), np.sin(2.0 * math.pi * f * t)]

    def misfit(f: float) -> float:
        driven = [flights.moments(e) for e in waves(f)]
        if not kept:  # of the first frequency: the others are near
            rows = _consistent(flights, moments, driven, f)
            kept.append(None if rows is None else (rows, rows.whitener(10.0 * _LAG)))
        if kept[0] is None:
            return 0.0
        own, whiten = kept[0]
        every = [*own.of(moments).T, *(own.of(e)[:, 0] for e in driven),
                 *own.of(flights.drift()).T, own.jump]  # fmt: skip
        white = whiten(np.stack(every, axis=1))
        y, A = white[:, 2], white[:, [0, 1, *range(3, white.shape[1])]]
        A = A / np.maximum(np.sqrt((A**2).sum(axis=0)), 1e-300)
        p = np.linalg.lstsq(A, y, rcond=1e-10)[0]
        if p[1] < 0.0:  # no damper drives the mass: without one
            A = np.delete(A, 1, axis=1)
            p = np.linalg.lstsq(A, y, rcond=1e-10)[0]
        return float(np.abs(y - A @ p).sum())

    reach = 1.0 / (x.size * flights.step)
    best, found = list(about), math.inf
    for width, count in ((0.5, 5), (0.1, 5)):
        tried = np.unique(np.add.outer(best, reach * np.linspace(-width, width, count)).ravel())
        values = [misfit(float(f)) for f in tried]
        if min(values) < found:
            found = min(values)
            best = [float(tried[int(np.argmin(values))])]
    return best[0]
