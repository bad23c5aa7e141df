"""A release simulated over clearance: times to a level, capture, energy taken, pumping time.

The measures go by their names in the literature. *Pumping time*: how long targeted energy transfer
lasts, from the release until the ball leaves the resonance capture (Dekemele and others, Nonlinear
Dyn. 2018, 10.1007/s11071-018-4190-5). *Energy dissipated by the NES*: the share of the energy at
the release that its impacts have taken (Vakakis and others, Springer 2008).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.excitation import Release, WeakDamping
from vinesexp.rig import NES, Oscillator, Rig
from vinesexp.solver.motion import Motion
from vinesexp.solver.simulation import simulate
from vinesexp.theory.regime_definitions import activation_spells

#: Clearances tried, and ball positions at each.
CLEARANCES, STARTS = 15, 12
#: Ends of the clearances tried, shares of the release amplitude.
ENDS = (0.25, 4.0)
#: A start is captured when its largest ball makes this share of two impacts a cycle from the third
#: to the tenth cycle.
CAPTURED = 0.9
#: A release is followed for this many times 1/(zeta w0), and at most for so many cycles.
FOLLOWED, LONGEST = 3.5, 600.0
_PER_CYCLE = 8
#: No damping beyond c1.
VISCOUS = WeakDamping()


@dataclass(frozen=True)
class Fall:
    """Releases at one clearance, one entry per ball position; s, shares.

    Attributes
    ----------
    b : clearance (the largest, of several balls), m.
    times : to fall for good below each level; infinite where it never does; shape (starts, levels).
    captured : whether the ball is captured from the start.
    dissipated : share of the energy at the release that impacts have taken at the end.
    pumping : pumping time; 0 where the ball was never captured.
    left : share of the energy that is left when the pumping ends; 1 where it never began.
    """

    b: float
    times: FloatArray
    captured: FloatArray
    dissipated: FloatArray
    pumping: FloatArray
    left: FloatArray

    @property
    def share(self) -> float:
        """Share of starts that are captured."""
        return float(self.captured.mean())


@dataclass(frozen=True)
class Falls:
    """Releases over clearance.

    Attributes
    ----------
    levels : m.
    found : one entry per clearance tried.
    fastest : for each level the clearance of least median time over all starts, as its index.
    asked : index of a clearance that was asked for, if any.
    """

    levels: tuple[float, ...]
    found: list[Fall]
    fastest: tuple[int, ...]
    asked: int | None = None


def released(
    oscillator: Oscillator,
    balls: Sequence[tuple[float, float, float]],
    *,
    x0: float,
    v0: float,
    levels: Sequence[float],
    marks: Sequence[float] = (),
    asked: float | None = None,
    friction: float = 0.0,
    damping: WeakDamping = VISCOUS,
    seed: int = 1,
) -> Falls:
    """Simulate releases with balls at rest anywhere in their cavities.

    Parameters
    ----------
    oscillator : Oscillator
    balls : sequence of (m, r, ratio)
        Mass (kg), restitution and clearance over the largest, of each NES.
    x0, v0 : float
        m, m/s.
    levels : sequence of float
        Amplitudes to be reached, m.
    marks : sequence of float
        Clearances that theory suggests, m: tried besides.
    asked : float, optional
        One of them that the answer has to show, m.
    friction : float
        Deceleration mu g of the balls on their floors, m/s^2.
    damping : WeakDamping
        Of the oscillator beyond c1.
    seed : int
        Of the ball positions: the same at every clearance.
    """
    x_m = float(np.hypot(x0, v0 / oscillator.w0))
    tried = np.unique(np.concatenate([x_m * np.geomspace(*ENDS, CLEARANCES), list(marks)]))
    places = np.random.default_rng(seed).uniform(-0.999, 0.999, (STARTS, len(balls)))
    places[0] = 0.999  # at the wall that pushes a ball released with the mass
    decay = max(oscillator.zeta, 1e-9) * oscillator.w0
    duration = min(FOLLOWED / decay, LONGEST / oscillator.f0)
    found = []
    for b in tried:
        nes = [NES(m=m, b=float(b) * part, r=r, friction=friction) for m, r, part in balls]
        motions = [
            simulate(
                Rig(oscillator, nes),
                None,
                Release(x0, v0, [x0 + float(u) * n.b for u, n in zip(place, nes, strict=True)]),
                duration=duration,
                damping=damping,
            )
            for place in places
        ]
        found.append(_fall(float(b), motions, levels))
    medians = np.array([np.median(one.times, axis=0) for one in found])
    fastest = tuple(int(i) for i in np.argmin(medians, axis=0))
    mine = None if asked is None else int(np.argmin(np.abs(tried - asked)))
    return Falls(tuple(levels), found, fastest, mine)


def _fall(b: float, motions: Sequence[Motion], levels: Sequence[float]) -> Fall:
    rows = [_measures(motion, levels) for motion in motions]
    times, captured, dissipated, pumping, left = zip(*rows, strict=True)
    return Fall(
        b=b, times=np.array(times), captured=np.array(captured, dtype=np.float64),
        dissipated=np.array(dissipated), pumping=np.array(pumping), left=np.array(left),
    )  # fmt: skip


def _measures(
    motion: Motion, levels: Sequence[float]
) -> tuple[list[float], bool, float, float, float]:
    """Times to the levels, captured, energy dissipated by impacts, pumping time, energy left."""
    o, i = motion.rig.oscillator, motion.impacts
    t = np.arange(0.0, motion.duration, 1.0 / (_PER_CYCLE * o.f0))
    x, v = motion.at(t)
    amplitude = np.hypot(x, v / o.w0)
    above = [np.flatnonzero(amplitude > level) for level in levels]
    later = np.append(t, np.inf)
    times = [float(later[over[-1] + 1]) if over.size else 0.0 for over in above]
    mass = np.array([nes.m for nes in motion.rig.nes])[i["nes"]]
    reduced = mass * o.M / (mass + o.M)
    before, after = i["v_before"] - i["vy_before"], i["v_after"] - i["vy_after"]
    start = 0.5 * o.k1 * motion.release.x0**2 + 0.5 * o.M * motion.release.v0**2
    dissipated = float(np.sum(0.5 * reduced * (before**2 - after**2)) / start)
    own = i["nes"] == int(np.argmax([nes.b for nes in motion.rig.nes]))
    cycles = i["time"][own] * o.f0
    captured = bool(((cycles > 2.0) & (cycles < 10.0)).sum() >= CAPTURED * 16.0)
    spells = activation_spells(i["time"][own], i["side"][own], period=1.0 / o.f0)
    if not len(spells):
        return times, captured, dissipated, 0.0, 1.0
    end = float(spells[np.argmax(spells[:, 1] - spells[:, 0]), 1])
    left = float(np.interp(end, t, amplitude) / amplitude[0]) ** 2
    return times, captured, dissipated, end, left
