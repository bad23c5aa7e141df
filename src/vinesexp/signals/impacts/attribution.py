"""Which ball hit: by what each of several balls can have done.

A ball that hit a wall flies on with a velocity that follows from the impact itself,
y' = x'_after + r rho, so that its next place is known to a fraction of a millimetre: either the
next impact lies where this ball meets a wall, or it was another's. The size of the jump,
-mu rho, is used too. Many histories are carried along and weighed (a beam search); r and mu are
learnt from the impacts that are certain, in a few passes. Equal balls in equal cavities bear their
numbers by continuity only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vinesexp.arrays import FloatArray, IntArray
from vinesexp.settings.stages import AttributionSettings
from vinesexp.signals.impacts.impact_table import Impacts

#: Spread of r and relative spread of mu that are allowed in each pass.
_PASSES = ((0.15, 0.5), (0.04, 0.15), (0.012, 0.05), (0.003, 0.02))
_FIRST_R = (0.45, 0.65, 0.85)


@dataclass(frozen=True)
class _Rig:
    """What is believed of the balls: clearance, restitution, jump over relative velocity.

    `alike`: nothing but their history distinguishes them.
    """

    b: FloatArray
    r: FloatArray
    mu: FloatArray
    r_spread: float
    mu_spread: float
    alike: bool


@dataclass
class _Beam:
    """Histories: for each and each ball the last impact and the velocity since; log weights."""

    time: FloatArray  # (histories, balls)
    place: FloatArray
    velocity: FloatArray
    spread: FloatArray  # of the velocity; infinite: lost
    weight: FloatArray  # (histories,)
    labels: IntArray  # (histories, impacts)


def attribute(
    impacts: Impacts, *, clearance: Sequence[float], nes_mass: Sequence[float] = (),
    frequency: float | None = None, settings: AttributionSettings | None = None,
) -> Impacts:  # fmt: skip
    """Fill `nes` and `nes_confidence` of an impact table.

    Parameters
    ----------
    impacts : Impacts
        With places and velocities where the displacement gave them.
    clearance : sequence of float
        One-sided clearance of each ball, m.
    nes_mass : sequence of float
        kg: how differently two balls strike.
    frequency : float, optional
        Of the oscillation, Hz; without it several balls are not distinguished.

    Returns
    -------
    Impacts
        `nes` from 1; 0 with confidence 0 where it is not known.
    """
    n = impacts.n
    if len(clearance) <= 1:
        return replace(impacts, nes=np.ones(n, dtype=np.int64), nes_confidence=np.ones(n))
    known = np.flatnonzero(np.isfinite(impacts.x_m) & np.isfinite(impacts.v_before_m_s))
    nes, confidence = np.zeros(n, dtype=np.int64), np.zeros(n)
    if frequency and known.size >= 2:
        nes[known], confidence[known] = _labelled(
            impacts, known, np.array(clearance), _relative_masses(nes_mass, len(clearance)),
            frequency, settings or AttributionSettings(),
        )  # fmt: skip
    return replace(impacts, nes=nes, nes_confidence=confidence)


def _relative_masses(nes_mass: Sequence[float], count: int) -> FloatArray:
    given = np.array(nes_mass if len(nes_mass) == count else [1.0] * count)
    return np.asarray(given / given.mean())


def _labelled(
    impacts: Impacts,
    known: IntArray,
    b: FloatArray,
    mass: FloatArray,
    frequency: float,
    settings: AttributionSettings,
) -> tuple[IntArray, FloatArray]:
    """Labels (from 1) and their probabilities, r and mu learnt in passes."""
    jump = np.abs(impacts.velocity_jump_m_s[known])
    # Two impacts a cycle at speed 4 b f, relative velocity a quarter more: a place to begin.
    mu = float(np.median(jump)) / (5.0 * float(b.mean()) * frequency) * mass
    alike = bool(np.ptp(b) < 1e-9 and np.ptp(mass) < 1e-9)
    starts = [_Rig(b, np.full(b.size, r), mu, *_PASSES[0], alike=alike) for r in _FIRST_R]
    found = [_search(impacts, known, rig, settings) for rig in starts]
    best = max(range(len(found)), key=lambda i: found[i][2])
    rig, (labels, confidence, weight) = starts[best], found[best]
    for spreads in _PASSES[1:]:
        closer = _learnt(impacts, known, labels, confidence, rig, spreads, settings)
        again = _search(impacts, known, closer, settings)
        if again[2] < weight:  # real balls need not be as regular as that
            break
        rig, (labels, confidence, weight) = closer, again
    return labels + 1, confidence


def _search(
    impacts: Impacts, known: IntArray, rig: _Rig, settings: AttributionSettings
) -> tuple[IntArray, FloatArray, float]:
    """Best history: label of each impact (from 0), its probability, and the log weight."""
    t, x = impacts.time_s[known], impacts.x_m[known]
    v, jump = impacts.v_before_m_s[known], impacts.velocity_jump_m_s[known]
    side = impacts.side[known].astype(np.float64)
    balls, n = rig.b.size, known.size
    lost = np.full((1, balls), np.inf)
    nothing = np.zeros((1, balls))
    beam = _Beam(nothing, nothing, nothing, lost, np.zeros(1), np.zeros((1, n), dtype=np.int64))
    confidence = np.zeros(n)
    lag = settings.settled_after
    for j in range(n):
        beam = _advanced(beam, rig, j, t[j], x[j], v[j], jump[j], side[j], settings)
        if j >= lag:
            _settle(beam, j - lag, confidence)
    for j in range(max(0, n - lag), n):
        _settle(beam, j, confidence)
    best = int(np.argmax(beam.weight))
    return beam.labels[best].copy(), confidence, float(beam.weight[best])


def _settle(beam: _Beam, j: int, confidence: FloatArray) -> None:
    """Probability, among all histories, of the label that the best one gives impact j."""
    weight = np.exp(beam.weight - beam.weight.max())
    best = beam.labels[int(np.argmax(weight)), j]
    confidence[j] = float(weight[beam.labels[:, j] == best].sum() / weight.sum())


def _advanced(
    beam: _Beam, rig: _Rig, j: int, t: float, x: float, v: float, jump: float, side: float,
    settings: AttributionSettings,
) -> _Beam:  # fmt: skip
    """Every history continued by every ball, the most likely kept."""
    unseen = settings.unseen
    wall = x - side * rig.b  # where each ball would be
    flown = t - beam.time
    expected = beam.place + beam.velocity * flown
    lost = ~np.isfinite(beam.spread)
    place_error = np.hypot(settings.place_error, np.where(lost, 0.0, beam.spread) * flown)
    off = (expected - wall) / place_error
    uniform = 1.0 / (2.0 * rig.b)
    normal = np.exp(-0.5 * np.minimum(off**2, 1e3)) / (place_error * math.sqrt(2.0 * math.pi))
    fits = np.where(lost, uniform, (1.0 - unseen) * normal + unseen * uniform)

    inlier = ~lost & (np.abs(off) < 4.0)
    before = np.where(inlier, (wall - beam.place) / np.maximum(flown, 1e-9), 0.0)
    rho = np.where(inlier, v - before, -jump / rig.mu)
    closing = side * rho > 0.0
    size = -rig.mu * rho
    spread = np.hypot(rig.mu_spread * np.abs(size), 2e-4)
    strikes = np.exp(-0.5 * np.minimum(((jump - size) / spread) ** 2, 1e3)) / spread
    strikes = np.where(inlier, strikes, 1.0 / max(abs(jump), 1e-4))
    score = np.log(fits + 1e-300) + np.log(0.98 * strikes + 0.02 / max(abs(jump), 1e-4))
    score = np.where(closing, score, -700.0)

    # A ball that should have left its cavity by now hit something unseen: it is lost.
    outside = np.abs(x - expected) - rig.b > 4.0 * place_error
    gone = outside & ~lost
    score = score + np.log(unseen) * (gone.sum(axis=1, keepdims=True) - gone)
    total = beam.weight[:, np.newaxis] + score
    if rig.alike:  # with all lost, numbers may be given anew: one history is enough
        total[lost.all(axis=1), 1:] = -np.inf
    order = np.argsort(-total, axis=None, kind="stable")[: settings.histories]
    parent, ball = np.unravel_index(order, total.shape)

    after = v + jump + rig.r[ball] * rho[parent, ball]
    from_jump = rig.mu_spread * np.where(inlier[parent, ball], 0.0, rig.r[ball])
    new_spread = (
        np.abs(rho[parent, ball]) * np.hypot(rig.r_spread, from_jump) + settings.speed_error
    )
    rows = np.arange(order.size)
    new = _Beam(
        beam.time[parent].copy(), beam.place[parent].copy(), beam.velocity[parent].copy(),
        np.where(gone, np.inf, beam.spread)[parent], total[parent, ball],
        beam.labels[parent].copy(),
    )  # fmt: skip
    new.time[rows, ball], new.place[rows, ball] = t, wall[ball]
    new.velocity[rows, ball], new.spread[rows, ball] = after, new_spread
    new.labels[:, j] = ball
    return _without_twins(new) if rig.alike else new


def _without_twins(beam: _Beam) -> _Beam:
    """Of histories that differ in the numbers of equal balls only, the likelier one."""
    when = np.where(np.isfinite(beam.spread), beam.time, -np.inf)
    order = np.lexsort((np.arange(when.shape[0]), *np.sort(when, axis=1).T))
    rows = np.sort(when, axis=1)[order]
    new = np.concatenate([[True], (rows[1:] != rows[:-1]).any(axis=1)])
    keep = np.sort(order[new])  # histories stand in the order of their weight
    return _Beam(
        beam.time[keep], beam.place[keep], beam.velocity[keep], beam.spread[keep],
        beam.weight[keep], beam.labels[keep],
    )  # fmt: skip


def _learnt(
    impacts: Impacts, known: IntArray, labels: IntArray, confidence: FloatArray, rig: _Rig,
    spreads: tuple[float, float], settings: AttributionSettings,
) -> _Rig:  # fmt: skip
    """r and mu of each ball from flights between impacts that are certain."""
    r, mu = rig.r.copy(), rig.mu.copy()
    for ball in range(rig.b.size):
        own = known[labels == ball]
        sure = confidence[labels == ball] > 0.9
        if sure.mean() < 0.5:  # medians bear a share of wrong labels
            sure[:] = True
        t, side = impacts.time_s[own], impacts.side[own]
        y = impacts.x_m[own] - side * rig.b[ball]
        u = np.diff(y) / np.diff(t)
        crosses = (side[1:] != side[:-1]) & sure[1:] & sure[:-1]
        inner = np.flatnonzero(crosses[1:] & crosses[:-1]) + 1
        if inner.size < settings.flights:
            continue
        v, jump = impacts.v_before_m_s[own][inner], impacts.velocity_jump_m_s[own][inner]
        rho = v - u[inner - 1]
        r[ball] = float(np.clip(np.median(-(v + jump - u[inner]) / rho), 0.0, 1.0))
        mu[ball] = float(np.median(-jump / rho))
    mu = np.where(mu > 0.0, mu, rig.mu)
    if rig.alike:
        r, mu = np.full_like(r, r.mean()), np.full_like(mu, mu.mean())
    return _Rig(rig.b, r, mu, *spreads, alike=rig.alike)
