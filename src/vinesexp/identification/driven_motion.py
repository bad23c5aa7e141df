"""The base as the mass answers it: its amplitude from the motion of the mass, across impacts.

Between impacts the mass is a linear oscillator on a moving base,

    x'' + 2 zeta w0 x' + w0^2 x = w0^2 x_e + 2 zeta w0 x_e' + constant,

and an impact changes its velocity, by an unknown jump, but not its place. Multiplied by a function
phi that vanishes at both ends of its support, with its derivative, and at every impact within, and
integrated by parts flight by flight, no derivative of a measured signal is left and no jump. Such
functions are polynomials of one flight, and one of two flights around each impact. Their equations
are linear in the base and the constant for given w0 and zeta, which the decays know better; the
result is kept as a function of these. No ball, no clearance and no M enters.

The impacts' times may be late against the displacement, by one lag for a record, which is fitted,
and by some scatter, which counts as noise beside that of the samples: generalised least squares.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from vinesexp.arrays import BoolArray, FloatArray, IntArray
from vinesexp.records.store import RecordView
from vinesexp.signals.base_motion import base_motion
from vinesexp.signals.impacts.impact_table import Impacts
from vinesexp.signals.means import channel_means, missing_means

#: Name of the estimate whose data is a `DrivenMotion`.
DRIVEN = "driven"

_POINTS = 1000  # block means a period at most
_FEWEST = 20  # flights
_SHORTEST, _LONGEST = 0.12, 1.2  # periods; in longer ones an impact was missed
_OUTSIDE, _PASSES = 5.0, 4
_CHUNK = 40  # flights whose equations are weighted together
_LAG = 1e-5  # s: scatter of the times of impacts to begin with
_LAGS = tuple((1e-7 * 1.5 ** np.arange(22)).tolist())
_MEDIAN = 0.4549  # of the square of a normal deviate
_DRIFTS, _MOST_DRIFTS = 16, 24  # flights for each cosine of the displacement's drift
_GREGORY = (-1.0 / 8.0, 1.0 / 6.0, -1.0 / 24.0)  # added to the trapezoidal rule: cubics are exact
_FAR = 0.03  # share of the stated frequency within which that of an unseen base is looked for
_INSIDE = 4  # functions of one flight; then the halves of those around its two impacts
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
    """What the motion of the mass says of the base, for any f0 and zeta of the oscillator.

    With v = (1, w0^2, -2 zeta w0) the parts of the base, times w0^2, are ``parts @ v`` but for the
    share that its velocity adds through the damper (`turned`).

    Attributes
    ----------
    parts : array (n, 3)
        One row where the base was recorded, cosine and sine where it was not; m/s^2, m, m/s.
    scatter : array (n, 3, n, 3)
        Their covariance, from what each flight leaves.
    turned : array (n, n)
        s; moments of the base's velocity as those of the base.
    scale : float
        m; amplitude of the recorded base that a part of 1 stands for.
    flights : int
    """

    parts: FloatArray
    scatter: FloatArray
    turned: FloatArray
    scale: float
    flights: int

    def base(self, *, f0: float, zeta: float, late: float = 0.0) -> tuple[float, float]:
        """Amplitude of the base's sine on the scale of the displacement, and its error, m.

        The channel of a recorded base may be `late` by some s: its velocity makes up for it.
        """
        w = 2.0 * math.pi * f0
        v = np.array([1.0, w * w, -2.0 * zeta * w])
        ahead = 2.0 * zeta / w + (late if len(self.parts) == 1 else 0.0)
        through = np.linalg.inv(np.eye(len(self.parts)) - ahead * self.turned)
        q = through @ self.parts @ v
        size = float(np.hypot.reduce(q))
        covariance = np.einsum("iajb,a,b->ij", self.scatter, v, v)
        covariance = through @ covariance @ through.T
        error = math.sqrt(max(float(q @ covariance @ q), 0.0)) / max(size, 1e-300)
        return size / (w * w) * self.scale, error / (w * w) * self.scale

    def as_lists(self) -> dict[str, Any]:
        """For a file of JSON; `driven_from` reads it."""
        return {
            "parts": self.parts.tolist(), "scatter": self.scatter.tolist(),
            "turned": self.turned.tolist(), "scale": self.scale, "flights": self.flights,
        }  # fmt: skip


def driven_from(lists: Mapping[str, Any]) -> DrivenMotion:
    """What `DrivenMotion.as_lists` made."""
    parts, scatter, turned = (np.array(lists[name]) for name in ("parts", "scatter", "turned"))
    return DrivenMotion(parts, scatter, turned, lists["scale"], lists["flights"])


def driven_motion(
    view: RecordView, impacts: Impacts, *, frequency: float, stated: float | None = None
) -> DrivenMotion | None:
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

    Returns
    -------
    DrivenMotion or None
        None where there are too few flights.
    """
    k = max(1, int(view.sample_rate / (_POINTS * frequency)))
    step = k / view.sample_rate
    x = channel_means(view, "displacement", k)
    x = x - x.mean()
    begin = view.start + 0.5 * (step - 1.0 / view.sample_rate)
    missing = missing_means(view, "displacement", k)
    flights = _flights(impacts, missing, begin, step, period=1.0 / frequency)
    if flights is None:
        return None
    near = stated or frequency
    if "base" in view.roles and view.quantity("base") == "displacement":
        e = channel_means(view, "base", k)[: x.size]
        moved = base_motion(e, step, frequency=near)
        if moved is None:
            return None
        return _fitted(flights, x, [e - e.mean()], near, moved.amplitude)
    swing = base_motion(x, step, frequency=near)
    about = {near} if swing is None else {near, swing.frequency}
    close = [f for f in sorted(about) if abs(f / near - 1.0) < _FAR]
    return _fitted(flights, x, _unseen_base(flights, x, close), near, 1.0)


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
    jump : array (flights,), of the velocity at the impact that ends a flight, m/s.
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
    return _Flights(
        first, low.astype(np.int64), node - low, weight, powers, (end - start)[own],
        jumps[1:][own], joined, begin, step,
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
    """

    sums: tuple[FloatArray, ...]
    own: tuple[IntArray, ...]
    noise: tuple[FloatArray, ...]
    jump: FloatArray
    flight: IntArray

    def of(self, moments: FloatArray) -> FloatArray:
        """Moments (flights, functions, ...) summed to rows."""
        shape = (-1, *moments.shape[2:])
        return np.concatenate(
            [
                np.tensordot(B, moments[own].reshape(shape), 1)
                for B, own in zip(self.sums, self.own, strict=True)
            ]
        )

    def white(self, rows: FloatArray, lag: float) -> FloatArray:
        """Rows whose noise is that of the samples and a scatter of the impacts' times, s."""
        found, begin = [], 0
        for N in self.noise:
            own = slice(begin, begin + len(N))
            C = np.linalg.cholesky(N + np.diag((lag * self.jump[own]) ** 2))
            found.append(np.linalg.solve(C, rows[own]))
            begin = own.stop
        return np.concatenate(found)


def _rows(flights: _Flights, kept: BoolArray, noise: FloatArray) -> _Rows:
    """Equations of the flights kept: four inside each, one across each impact between two."""
    sums, chunks, covariances, jumps, of_flight = [], [], [], [], []
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
    return _Rows(tuple(sums), tuple(chunks), tuple(covariances), np.concatenate(jumps),
                 np.concatenate(of_flight))  # fmt: skip


def _fitted(
    flights: _Flights, x: FloatArray, drive: Sequence[FloatArray], near: float, scale: float
) -> DrivenMotion | None:
    """Regress both sides of the equation of motion on the base, a constant and a lag.

    What each flight leaves, with the weight that it has, is the scatter.
    """
    moments = flights.moments(x)
    driven = [flights.moments(e) for e in drive]
    rows = _consistent(flights, moments, driven, near)
    if rows is None:
        return None
    # x'' + w0^2 x + 2 zeta w0 x' = w0^2 x_e + 2 zeta w0 x_e', integrated by parts
    sides = rows.of(moments)[:, [2, 0, 1]]
    speeds = np.stack([rows.of(e)[:, 1] for e in driven], axis=1)
    design = np.stack(
        [*(rows.of(e)[:, 0] for e in driven), *rows.of(flights.drift()).T, rows.jump], axis=1
    )
    n, m, lag = len(drive), design.shape[1], _LAG
    for _ in range(2):
        white = rows.white(np.hstack([design, sides, speeds]), lag)
        A, y = white[:, :m], white[:, m : m + 3]
        size = np.sqrt((A**2).sum(axis=0))
        if not np.all(size[:n] > 0.0):
            return None
        size = np.where(size > 0.0, size, 1.0)
        solver = np.linalg.pinv(A / size) / size[:, None]
        p = solver @ y
        lag = _scatter_of_times(rows, sides - design @ p, near)
    scores = np.zeros((rows.flight.max() + 1, n, 3))
    np.add.at(scores, rows.flight, np.einsum("kr,rs->rks", solver[:n], y - A @ p))
    scatter = np.einsum("fia,fjb->iajb", scores, scores)
    return DrivenMotion(
        p[:n], scatter, (solver @ white[:, m + 3 :])[:n], scale, len(np.unique(rows.flight))
    )


def _scatter_of_times(rows: _Rows, rest: FloatArray, near: float) -> float:
    """Standard deviation of the times of impacts, s, by what is left across them."""
    across = np.abs(rows.jump) > 0.0
    if across.sum() < _FEWEST // 2:
        return _LAG
    off = (rest @ np.array([1.0, (2.0 * math.pi * near) ** 2, 0.0]))[across]
    by_noise = np.concatenate([np.diag(N) for N in rows.noise])[across]
    for lag in _LAGS:
        if np.median(off**2 / (by_noise + (lag * rows.jump[across]) ** 2)) < _MEDIAN:
            break
    return float(lag)


def _consistent(
    flights: _Flights, moments: FloatArray, driven: Sequence[FloatArray], near: float
) -> _Rows | None:
    """Equations of the flights that one oscillator explains: in others an impact was missed."""
    inside = slice(0, _INSIDE)
    gram = flights.noise(2.0 * math.pi * near)
    factor = np.linalg.cholesky(gram[:, inside, inside])
    kept = np.ones(len(moments), dtype=bool)
    for _ in range(_PASSES):
        rest = _free_fit(
            moments[:, inside], [e[:, inside] for e in driven], flights.drift()[:, inside], kept
        )
        white = np.linalg.solve(factor, rest[..., np.newaxis])[..., 0]
        norm = np.sqrt((white**2).sum(axis=1))
        new = norm < _OUTSIDE * float(np.median(norm[kept])) + 1e-30
        if (new == kept).all():
            break
        kept = new
    if kept.sum() < _FEWEST:
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


def _unseen_base(flights: _Flights, x: FloatArray, about: Sequence[float]) -> list[FloatArray]:
    """The sine and its quadrature that explain the flights best, their frequency near `about`."""
    t = flights.begin + flights.step * np.arange(x.size)
    moments = flights.moments(x)
    rows: dict[float, _Rows | None] = {}

    def waves(f: float) -> list[FloatArray]:
        return [np.cos(2.0 * math.pi * f * t), np.sin(2.0 * math.pi * f * t)]

    def misfit(f: float) -> float:
        driven = [flights.moments(e) for e in waves(f)]
        if not rows:
            rows[f] = _consistent(flights, moments, driven, f)
        own = next(iter(rows.values()))
        if own is None:
            return 0.0
        every = [*own.of(moments).T, *(own.of(e)[:, 0] for e in driven),
                 *own.of(flights.drift()).T, own.jump]  # fmt: skip
        white = own.white(np.stack(every, axis=1), 10.0 * _LAG)
        y, A = white[:, 2], white[:, [0, 1, *range(3, white.shape[1])]]
        A = A / np.maximum(np.sqrt((A**2).sum(axis=0)), 1e-300)
        return float((np.abs(y - A @ np.linalg.lstsq(A, y, rcond=1e-10)[0])).sum())

    reach = 1.0 / (x.size * flights.step)
    best, found = list(about), math.inf
    for width, count in ((2.0, 9), (0.4, 5), (0.1, 5)):
        tried = np.unique(np.add.outer(best, reach * np.linspace(-width, width, count)).ravel())
        values = [misfit(float(f)) for f in tried]
        if min(values) < found:
            found = min(values)
            best = [float(tried[int(np.argmin(values))])]
    return waves(best[0])
