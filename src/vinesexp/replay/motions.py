"""A record simulated again: the identified rig, the base as measured, and several starts.

Nobody measures where the ball was when a record began, and some motions depend on it. So a record
is replayed from several starts, each with its name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vinesexp.clearance.level_base import LevelBase
from vinesexp.errors import AnalysisError
from vinesexp.excitation import Harmonic, Release
from vinesexp.records.schema import Record
from vinesexp.rig import NES, Oscillator, Rig

if TYPE_CHECKING:
    from vinesexp.solver.motion import Motion

#: Tests that are replayed.
TESTS = ("periodic", "transient", "ringdown")
ON_ORBIT = "on the orbit"
#: Starts of the ball in a periodic test whose oscillator is at rest: place in clearances from the
#: middle, speed in clearances a radian of the oscillator.
BALL_STARTS = {
    "ball at wall +1": (0.999, 0.0),
    "ball at wall -1": (-0.999, 0.0),
    "ball moving up": (0.1, 0.6),
    "ball moving down": (-0.3, -1.1),
}
#: In a release the ball rests anywhere in its cavity.
_PLACES = 12
RELEASE_STARTS = {
    f"ball at {place:+.2f} b": (place, 0.0)
    for place in (0.999 * (2 * i / (_PLACES - 1) - 1) for i in range(_PLACES))
}

_SETTLES = 5.0  # decay times of the oscillator before a periodic replay is judged
_FEWEST_CYCLES = 40
#: A periodic replay goes on for this many lengths of the record: where motion is chaotic, a record
#: is one draw of many.
WINDOWS = 3


@dataclass(frozen=True)
class Replayed:
    """One replay: how it started, the motion, and the stretches of it that are the record, s."""

    start: str
    motion: Motion
    begins: tuple[float, ...]
    length: float


def rig_of(record: Record, values: Mapping[str, float], masses: tuple[float, ...]) -> Rig:
    """The identified rig as it was in one test: its added mass, its balls and clearances.

    Parameters
    ----------
    record : Record
    values : mapping
        ``M``, ``c1``, ``k1`` and, where there are balls, ``r`` or ``r_1``, ``r_2``; SI.
    masses : tuple of float
        Of the balls, kg; a single one holds for all.

    Raises
    ------
    AnalysisError
        A value is not known.
    """
    needed = ["M", "c1", "k1"]
    missing = [name for name in needed if name not in values]
    balls = []
    for i, b in enumerate(record.clearance):
        r = values.get(f"r_{i + 1}", values.get("r"))
        if r is None or not masses:
            missing += ["r"] * (r is None) + ["m"] * (not masses)
            break
        balls.append(NES(m=masses[i] if len(masses) > i else masses[0], b=b, r=r))
    if missing:
        raise AnalysisError(f"no replay without {', '.join(missing)}")
    M = values["M"] + (record.added_mass or 0.0)
    return Rig(Oscillator(M=M, c1=values["c1"], k1=values["k1"]), nes=balls)


def replays(
    record: Record, rig: Rig, *, base: LevelBase | None, release: float, length: float
) -> list[Replayed]:
    """Simulate a record from every start.

    Parameters
    ----------
    record : Record
        Of one of `TESTS`.
    rig : Rig
    base : LevelBase or None
        Of a periodic test.
    release : float
        m; of the others.
    length : float
        Of the record, s.
    """
    from vinesexp.solver.simulation import simulate

    drive, settle = None, 0.0
    if record.test == "periodic":
        if base is None or base.frequency is None:
            raise AnalysisError("no replay without amplitude and frequency of the base")
        decay = 1.0 / (rig.oscillator.zeta * 2.0 * math.pi * rig.oscillator.f0)
        settle = max(_SETTLES * decay, _FEWEST_CYCLES / base.frequency.value)
        drive = Harmonic(base.G.value, base.frequency.value)
        release = 0.0
    w0 = 2.0 * math.pi * rig.oscillator.f0
    begins = tuple(settle + i * length for i in range(WINDOWS if drive else 1))
    found = []
    starts = {"released": (0.0, 0.0)}
    if rig.nes:
        starts = BALL_STARTS if drive else RELEASE_STARTS
    for name, (place, speed) in starts.items():
        # Two balls start apart, so that they do not move as one.
        signs = [(-1) ** i for i in range(len(rig.nes))]
        state = Release(
            release,
            0.0,
            [release + sign * place * ball.b for sign, ball in zip(signs, rig.nes, strict=True)],
            [sign * speed * w0 * ball.b for sign, ball in zip(signs, rig.nes, strict=True)],
        )
        motion = simulate(rig, drive, state, duration=begins[-1] + length)
        found.append(Replayed(name, motion, begins, length))
    if drive is not None and len(rig.nes) == 1:
        found += _on_orbit(rig, drive, length)
    return found


def _on_orbit(rig: Rig, drive: Harmonic, length: float) -> list[Replayed]:
    """A replay that starts on the stable orbit of two impacts per cycle, where there is one."""
    from vinesexp.solver.simulation import simulate
    from vinesexp.theory.rig_orbits import symmetric_orbits

    oscillator, ball = rig.oscillator, rig.nes[0]
    try:
        orbits = symmetric_orbits(
            G=drive.amplitude, b=ball.b, M=oscillator.M, c1=oscillator.c1, k1=oscillator.k1,
            m=ball.m, r=ball.r, frequency=drive.frequency,
        )  # fmt: skip
    except AnalysisError:
        return []
    for orbit in orbits:
        if orbit.stable and orbit.admissible:
            state = Release(orbit.x, orbit.v_after, [orbit.x - ball.b], [orbit.u])
            moved = Harmonic(drive.amplitude, drive.frequency, orbit.phase)
            motion = simulate(rig, moved, state, duration=length)
            return [Replayed(ON_ORBIT, motion, (0.0,), length)]
    return []
