"""The base as the mass answers it: its amplitude from the motion between impacts.

From one impact to the next the mass is a linear oscillator on a moving base,

    x'' + 2 zeta w0 x' + w0^2 x = w0^2 x_e + 2 zeta w0 x_e' + constant.

Multiplied by a function phi that vanishes with two derivatives at both ends of a flight, and
integrated by parts, no derivative of a measured signal is left. Each flight gives equations that
are linear in the base and the constant for given w0 and zeta, which the decays know better; the
result is kept as a function of these. No ball, no clearance and no M enters, and how the mass
started each flight does not matter.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from vinesexp.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vinesexp.records.store import RecordView
from vinesexp.signals.base_motion import base_motion
from vinesexp.signals.means import channel_means, missing_means

#: Name of the estimate whose data is a `DrivenMotion`.
DRIVEN = "driven"

_POINTS = 200  # block means a period
_SETTLED = 2e-3  # s after an impact that are left out: contact and sensor ring
_FEWEST = 20  # flights
_SHORTEST, _LONGEST = 0.12, 1.2  # periods; in longer ones an impact was missed
_POWERS = 3  # test functions a flight
_BUMP = 5  # order to which they vanish at the ends
_OUTSIDE, _PASSES = 5.0, 4
_FAR = 0.03  # share of the stated frequency within which that of an unseen base is looked for


@dataclass(frozen=True)
class DrivenMotion:
    """What the motion between impacts says of the base, for any f0 and zeta of the oscillator.

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

    def base(self, *, f0: float, zeta: float) -> tuple[float, float]:
        """Amplitude of the base's sine on the scale of the displacement, and its error, m."""
        w = 2.0 * math.pi * f0
        v = np.array([1.0, w * w, -2.0 * zeta * w])
        through = np.linalg.inv(np.eye(len(self.parts)) - 2.0 * zeta / w * self.turned)
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
    view: RecordView, times: FloatArray, *, frequency: float, stated: float | None = None
) -> DrivenMotion | None:
    """Fit the equation of motion to all flights of a periodic record.

    Parameters
    ----------
    view : RecordView
        With a displacement; the base, where it was recorded as a displacement, is taken as it
        moved, else as a sine of unknown amplitude and phase.
    times : array (n,)
        Of the impacts of all balls, s.
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
    spans = _spans(times, step, x.size, period=1.0 / frequency, trim=_SETTLED + step)
    lost = np.cumsum(np.append(0, missing_means(view, "displacement", k)))
    spans = [(first, last) for first, last in spans if lost[first] == lost[last]]
    if len(spans) < _FEWEST:
        return None
    near = stated or frequency
    moments = _moments(x - x.mean(), spans, step)
    if "base" in view.roles and view.quantity("base") == "displacement":
        e = channel_means(view, "base", k)[: x.size]
        moved = base_motion(e, step, frequency=near)
        if moved is None:
            return None
        return _fitted(moments, [_moments(e - e.mean(), spans, step)], near, moved.amplitude)
    swing = base_motion(x, step, frequency=near)
    about = {near} if swing is None else {near, swing.frequency}
    close = [f for f in sorted(about) if abs(f / near - 1.0) < _FAR]
    wave = _unseen_base(moments, spans, step, close, x.size * step)
    return _fitted(moments, [wave.real, wave.imag], near, 1.0)


def _spans(
    times: FloatArray, step: float, n: int, *, period: float, trim: float
) -> list[tuple[int, int]]:
    """First sample and the one after the last of each flight."""
    found = []
    for begin, end in pairwise(times.tolist()):
        if _SHORTEST * period < end - begin < _LONGEST * period:
            first, last = math.ceil((begin + trim) / step), math.floor((end - trim) / step)
            if 0 <= first < last - 12 and last < n:
                found.append((first, last))
    return found


@lru_cache(maxsize=4096)
def _functions(n: int, step: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """phi, phi', phi'' of a flight of n samples at their midpoints, each of shape (3, n).

    phi = (tau (1 - tau))^5 (tau - 1/2)^p: with fewer vanishing derivatives at the ends the midpoint
    rule would be a per cent off.
    """
    tau = (np.arange(n) + 0.5) / n
    length = n * step
    rows = []
    for p in range(_POWERS):
        bump = np.polynomial.Polynomial([0.0, 1.0, -1.0]) ** _BUMP
        poly = bump * np.polynomial.Polynomial([-0.5, 1.0]) ** p
        first, second = poly.deriv(), poly.deriv(2)
        rows.append((poly(tau), first(tau) / length, second(tau) / length**2))
    phi, d1, d2 = (np.array(part) for part in zip(*rows, strict=True))
    weight = 1.0 / np.sqrt((d2**2).sum(axis=1))
    return phi * weight[:, None], d1 * weight[:, None], d2 * weight[:, None]


def _moments(y: FloatArray, spans: list[tuple[int, int]], step: float) -> FloatArray:
    """Integrals of phi y, phi' y, phi'' y and phi for each flight; shape (flights, powers, 4)."""
    out = np.empty((len(spans), _POWERS, 4))
    for n, own, first in _by_length(spans):
        phi, d1, d2 = _functions(n, step)
        pieces = y[first[:, np.newaxis] + np.arange(n)]
        for k, functions in enumerate((phi, d1, d2)):
            out[own, :, k] = pieces @ functions.T
        out[own, :, 3] = phi.sum(axis=1)
    return out


def _moments_of_wave(w: float, spans: list[tuple[int, int]], step: float) -> ComplexArray:
    """The same of exp(i w t): flights of one length differ by their phase alone."""
    out = np.empty((len(spans), _POWERS, 4), dtype=np.complex128)
    for n, own, first in _by_length(spans):
        phi, d1, d2 = _functions(n, step)
        wave = np.exp(1j * w * (np.arange(n) + 0.5) * step)
        turn = np.exp(1j * w * first * step)[:, np.newaxis]
        for k, functions in enumerate((phi, d1, d2)):
            out[own, :, k] = turn * (functions @ wave)
        out[own, :, 3] = phi.sum(axis=1)
    return out


def _by_length(spans: list[tuple[int, int]]) -> Iterator[tuple[int, IntArray, IntArray]]:
    """Flights of one number of samples: that number, which flights, their first samples."""
    first, last = np.array(spans).T
    for n in np.unique(last - first):
        own = np.flatnonzero(last - first == n)
        yield int(n), own, first[own]


def _fitted(
    x: FloatArray, drive: list[FloatArray], near: float, scale: float
) -> DrivenMotion | None:
    """Regress both sides of the equation of motion on the base and a constant, flight by flight.

    Equations of one flight share its noise: their scatter is taken flight by flight.
    """
    kept = _consistent(x, drive, near)
    if kept.sum() < _FEWEST:
        return None
    design = np.stack([*(e[..., 0] for e in drive), x[..., 3]], axis=-1)[kept]
    # x'' + w0^2 x + 2 zeta w0 x' = w0^2 x_e + 2 zeta w0 x_e', integrated by parts
    sides = np.stack([x[..., 2], x[..., 0], x[..., 1]], axis=-1)[kept]
    A = design.reshape(-1, design.shape[-1])
    size = np.sqrt((A**2).sum(axis=0))
    if not np.all(size > 0.0):
        return None
    bread = np.linalg.pinv((A / size).T @ (A / size)) / np.outer(size, size)
    p = bread @ A.T @ sides.reshape(-1, 3)
    rest = sides - np.einsum("fpk,ks->fps", design, p)
    scores = np.einsum("kl,fpl,fps->fks", bread, design, rest)[:, : len(drive)]
    scatter = np.einsum("fia,fjb->iajb", scores, scores) * kept.sum() / max(kept.sum() - 2, 1)
    speeds = np.stack([e[..., 1] for e in drive], axis=-1)[kept].reshape(A.shape[0], -1)
    turned = (bread @ A.T @ speeds)[: len(drive)]
    return DrivenMotion(p[: len(drive)], scatter, turned, scale, int(kept.sum()))


def _consistent(x: FloatArray, drive: list[FloatArray], near: float) -> BoolArray:
    """Flights that one oscillator explains: those with an impact that was missed are not."""
    kept = np.ones(x.shape[0], dtype=bool)
    for _ in range(_PASSES):
        rest = _free_fit(x, drive, kept)[1]
        norm = np.sqrt((rest**2).sum(axis=1))
        new = norm < _OUTSIDE * float(np.median(norm[kept])) + 1e-30
        if (new == kept).all():
            break
        kept = new
    return kept


def _free_fit(
    x: FloatArray, drive: list[FloatArray], kept: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Least squares with w0 and zeta unknown as well, and what it leaves of each flight."""
    design = np.stack([x[..., 0], x[..., 1], *(e[..., 0] for e in drive), x[..., 3]], axis=-1)
    A, y = design[kept].reshape(-1, design.shape[-1]), x[kept][..., 2].reshape(-1)
    size = np.maximum(np.sqrt((A**2).sum(axis=0)), 1e-300)
    p = np.linalg.lstsq(A / size, y, rcond=1e-10)[0] / size
    return p, x[..., 2] - design @ p


def _unseen_base(
    x: FloatArray, spans: list[tuple[int, int]], step: float, about: Sequence[float], length: float
) -> ComplexArray:
    """Moments of the sine that explains the flights best, its frequency near one of `about`."""
    every = np.ones(x.shape[0], dtype=bool)

    def wave(f: float) -> ComplexArray:
        return _moments_of_wave(2.0 * math.pi * f, spans, step)

    def misfit(f: float) -> float:
        found = wave(f)
        rest = _free_fit(x, [found.real, found.imag], every)[1]
        return float(np.median((rest**2).sum(axis=1)))

    best, reach = list(about), 1.0 / length
    for width, count in ((8, 17), (1, 9), (0.25, 5)):
        tried = np.add.outer(best, 0.25 * reach * np.linspace(-width, width, count)).ravel()
        best = [float(tried[int(np.argmin([misfit(float(f)) for f in tried]))])]
    return wave(best[0])
