"""What clearance is best under a base motion as it was recorded: an earthquake, a machine, noise.

There is no settled motion and no orbit: the measures are the peak and the rms of the whole record.
The mass begins at rest and undeflected, wherever the record begins: the zero of a sensor is no
motion of the base.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.design.released import anywhere, judged, motions_from, tried_closer
from vinesexp.design.task import WORTH, OpenRig
from vinesexp.errors import ParameterError
from vinesexp.excitation import Measured, Release
from vinesexp.rig import Rig
from vinesexp.solver.motion import Motion
from vinesexp.solver.simulation import simulate

#: Clearances tried at first, and between neighbours of the best; balls anywhere, and at a wall; and
#: balls anywhere that judge the best anew, in so many lots.
CLEARANCES, CLOSER, STARTS, AT_WALL, FRESH, LOTS = 12, 2, 6, 2, 24, 3
#: Ends of the clearances tried, shares of the peak deflection without a ball.
ENDS = (0.1, 4.0)
#: Points a cycle of the natural frequency at which the motion is looked at, and fewest in all.
PER_CYCLE, FEWEST = 24, 256
#: Samples a cycle of the natural frequency at the least: with fewer, the spline through them is off
#: by more than 1.6 % of what makes the oscillator resonate.
SAMPLED = 4
#: Share of the range of a record within which it is at rest for its first half cycle.
AT_REST = 0.02


@dataclass(frozen=True)
class Driven:
    """What one clearance does under the record, one entry per start of the balls; m.

    Attributes
    ----------
    b : clearance (the largest, of several balls).
    rms, peak : of the deflection x - x_e over the whole record.
    rms_x, peak_x : of x itself.
    impacts : number of them.
    """

    b: float
    rms: FloatArray
    peak: FloatArray
    rms_x: FloatArray
    peak_x: FloatArray
    impacts: FloatArray


@dataclass(frozen=True)
class UnderRecord:
    """Clearances under a recorded base.

    Attributes
    ----------
    duration, rate : of the record, s and Hz. base_rms, base_peak : m, about `rest`.
    rest : where the base is at rest, m; it is taken off. moves : whether the record has no rest at
        its beginning, and `rest` is its mean.
    bare, fixed : without a ball, and with the mass of the balls fixed to the oscillator.
    found : one entry per clearance, sorted; of the best, starts drawn anew.
    tolerance : share of b within which each start had a clearance of its own.
    least_rms, least_peak : index of the clearance with the least median rms, and of that with the
        least 90th percentile of the peak.
    """

    duration: float
    rate: float
    base_rms: float
    base_peak: float
    rest: float
    moves: bool
    tolerance: float
    bare: Driven
    fixed: Driven
    found: list[Driven]
    least_rms: int
    least_peak: int

    @property
    def hopeless(self) -> bool:
        """Whether no clearance takes a twentieth off the rms or the peak, more than mass does."""
        return not self.beats(self.bare) or self.as_fixed

    @property
    def as_fixed(self) -> bool:
        """Whether no clearance takes a twentieth off what the balls leave when fixed."""
        return not self.beats(self.fixed)

    def beats(self, other: Driven) -> bool:
        """Whether a clearance has the rms or the peak of another lower by a twentieth."""
        rms = float(np.median(self.found[self.least_rms].rms))
        peak = float(np.median(self.found[self.least_peak].peak))
        kept = 1.0 - WORTH
        return bool(rms <= kept * other.rms[0] or peak <= kept * other.peak[0])


def under_record(
    open_rig: OpenRig, base: Measured, *, asked: float | None = None, seed: int = 1
) -> UnderRecord:
    """Simulate a recorded base over clearance, balls at rest anywhere and at a wall.

    Parameters
    ----------
    open_rig : OpenRig
        At rest at first; each start has a clearance of its own within the tolerance.
    base : Measured
        Displacement of the base, m.
    asked : float, optional
        A clearance that is tried besides, m.
    seed : int
        Of the ball positions: the same at every clearance.

    Raises
    ------
    ParameterError
        A record that does not move, or of too few samples for the oscillator.
    """
    rest, moves = _rest(base, open_rig.oscillator.f0)
    samples = np.asarray(base.samples) - rest
    base, begin = Measured(samples, base.sample_rate), Release(float(samples[0]))
    rng, n = np.random.default_rng(seed), len(open_rig.masses)

    def drawn(starts: int, at_wall: int) -> list[FloatArray]:
        walls = [np.full(n, side) for side in np.linspace(1.0, -1.0, at_wall)]
        return [*anywhere(n, rng, starts), *walls]

    few = drawn(STARTS, AT_WALL)
    lots = [drawn(FRESH, FRESH * AT_WALL // STARTS) for _ in range(LOTS)]

    def tried(b: float, places: Sequence[FloatArray] = few) -> Driven:
        return _driven(b, motions_from(places, open_rig, b, base, base.duration, x0=begin.x0))

    o, law = open_rig.oscillator, open_rig.damping
    bare, fixed = (
        _driven(0.0, [simulate(Rig(alone), base, begin, base.duration, damping=law)])
        for alone in (o, replace(o, M=o.M + sum(open_rig.masses)))
    )
    marks = [] if asked is None else [asked]
    first = np.concatenate([float(bare.peak[0]) * np.geomspace(*ENDS, CLEARANCES), marks])
    found = tried_closer(first, tried, (_rms, _peak), CLOSER)
    least_rms, least_peak = judged(found, (_rms, _peak), tried, lots)
    return UnderRecord(
        duration=base.duration,
        rate=base.sample_rate,
        base_rms=float(np.sqrt(np.mean(samples**2))),
        base_peak=float(np.abs(samples).max()),
        rest=rest,
        moves=moves,
        tolerance=open_rig.tolerance,
        bare=bare,
        fixed=fixed,
        found=found,
        least_rms=least_rms,
        least_peak=least_peak,
    )


def _rest(base: Measured, f0: float) -> tuple[float, bool]:
    """Where a record has its rest, m, and whether it moves from its first sample on.

    Its rest is what it shows in half a cycle of the natural frequency before it moves, else its
    mean; one that begins at zero is left as it is.
    """
    samples, needed = np.asarray(base.samples), SAMPLED * f0
    extent = float(np.ptp(samples))
    if not extent > 0.0:
        raise ParameterError(
            f"is {1e3 * samples[0]:.4g} mm from its first sample to its last: a base that does not "
            "move has no best clearance; name another column",
            where="base record",
        )
    if base.sample_rate < needed:
        raise ParameterError(
            f"{base.sample_rate:.4g} Hz are too few samples: an oscillator of {f0:.4g} Hz needs "
            f"{needed:.4g} Hz or more, for what moves it near its resonance",
            where="base record",
        )
    first = samples[: max(round(0.5 * base.sample_rate / f0), SAMPLED // 2)]
    moves = bool(np.ptp(first) > AT_REST * extent)
    if samples[0] == 0.0:
        return 0.0, moves
    return float(np.mean(samples if moves else first)), moves


def _rms(one: Driven) -> float:
    return float(np.median(one.rms))


def _peak(one: Driven) -> float:
    return float(np.percentile(one.peak, 90.0))


def _driven(b: float, motions: Iterable[Motion]) -> Driven:
    rows = []
    for motion in motions:
        count = max(int(PER_CYCLE * motion.rig.oscillator.f0 * motion.duration), FEWEST)
        t = np.linspace(0.0, motion.duration, count)
        x, x_e = motion.at(t)[0], motion.base(t)[0]
        z = x - x_e
        rows.append(
            (
                np.sqrt(np.mean(z**2)), np.abs(z).max(), np.sqrt(np.mean(x**2)), np.abs(x).max(),
                len(motion.impacts["time"]),
            )
        )  # fmt: skip
    return Driven(b, *np.array(rows, dtype=np.float64).T)
