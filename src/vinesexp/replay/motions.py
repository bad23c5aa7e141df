"""A record simulated again from several starts.

Nobody measures where the ball was when a record began, and some motions depend on it. So a record
is replayed from several starts, each with its name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from vinesexp.errors import AnalysisError
from vinesexp.excitation import Harmonic, Release, WeakDamping
from vinesexp.replay.drives import Drive
from vinesexp.rig import Rig

if TYPE_CHECKING:
    from vinesexp.solver.motion import Motion

#: Tests that are replayed.
TESTS = ("periodic", "transient", "ringdown", "sweep")
ON_ORBIT = "on the orbit"
#: Starts of the ball in a test whose base moves: place in clearances from the middle, speed in
#: clearances a radian of the oscillator.
BALL_STARTS = {
    "ball at wall +1": (0.999, 0.0),
    "ball at wall -1": (-0.999, 0.0),
    "ball moving up": (0.1, 0.6),
    "ball moving down": (-0.3, -1.1),
}
#: More of them where the base is taken as measured, whose record cannot go on: chaotic motion needs
#: several draws.
MORE_STARTS = {
    f"ball moving, {n}": (math.sin(2.4 * n), 1.2 * math.cos(1.7 * n)) for n in range(1, 9)
}
#: With friction a ball may lie in the middle while the mass swings under it.
AT_REST = {"ball in the middle": (0.0, 0.0)}
#: In a release the ball rests anywhere in its cavity.
_PLACES = 12
RELEASE_STARTS = {
    f"ball at {place:+.2f} b": (place, 0.0)
    for place in (0.999 * (2 * i / (_PLACES - 1) - 1) for i in range(_PLACES))
}


@dataclass(frozen=True)
class Replayed:
    """One replay: how it started, the motion, and the stretches of it that are the record, s."""

    start: str
    motion: Motion
    begins: tuple[float, ...]
    length: float


def replays(
    rig: Rig,
    drive: Drive,
    *,
    plain: Rig,
    x0: float = 0.0,
    v0: float = 0.0,
    damping: WeakDamping | None = None,
) -> list[Replayed]:
    """Simulate a record from every start.

    Parameters
    ----------
    rig : Rig
    drive : Drive
    plain : Rig
        The nearest one without effects, whose orbit of two impacts per cycle is known.
    x0, v0 : float
        Of the mass where the replay begins: m, m/s.
    damping : WeakDamping, optional
        Of the oscillator, beside c1.
    """
    from vinesexp.solver.simulation import simulate

    w0 = 2.0 * math.pi * rig.oscillator.f0
    found = []
    for name, (place, speed) in _starts(rig, drive).items():
        # Two balls start apart, so that they do not move as one.
        signs = [(-1) ** i for i in range(len(rig.nes))]
        state = Release(
            x0,
            v0,
            [x0 + sign * place * ball.b for sign, ball in zip(signs, rig.nes, strict=True)],
            [v0 + sign * speed * w0 * ball.b for sign, ball in zip(signs, rig.nes, strict=True)],
        )
        duration = drive.begins[-1] + drive.length
        motion = simulate(rig, drive.base, state, duration=duration, damping=damping)
        found.append(Replayed(name, motion, drive.begins, drive.length))
    if drive.sine is not None and len(rig.nes) == 1:
        found += _on_orbit(rig, plain, drive.sine, drive.length, damping)
    return found


def _starts(rig: Rig, drive: Drive) -> Mapping[str, tuple[float, float]]:
    if not rig.nes:
        return {"released": (0.0, 0.0)}
    if drive.base is None:
        return RELEASE_STARTS
    starts = dict(BALL_STARTS)
    if any(ball.rubs for ball in rig.nes):
        starts |= AT_REST
    if len(drive.begins) == 1 and drive.begins[0] > 0.0:
        starts |= MORE_STARTS
    return starts


def with_other_clearance(rig: Rig, share: float) -> Rig:
    """The rig with its cavities longer by a share."""
    return replace(rig, nes=[replace(ball, b=(1.0 + share) * ball.b) for ball in rig.nes])


def _on_orbit(
    rig: Rig, plain: Rig, sine: Harmonic, length: float, damping: WeakDamping | None
) -> list[Replayed]:
    """A replay that starts on the stable orbit of two impacts per cycle, where there is one."""
    from vinesexp.solver.simulation import simulate
    from vinesexp.theory.rig_orbits import symmetric_orbits

    oscillator, ball = plain.oscillator, plain.nes[0]
    try:
        orbits = symmetric_orbits(
            G=sine.amplitude, b=ball.b, M=oscillator.M, c1=oscillator.c1, k1=oscillator.k1,
            m=ball.m, r=ball.r, frequency=sine.frequency,
        )  # fmt: skip
    except AnalysisError:
        return []
    for orbit in orbits:
        if orbit.stable and orbit.admissible:
            y = orbit.x - min(ball.b, rig.nes[0].b)  # at the wall, and within the cavity
            state = Release(orbit.x, orbit.v_after, [y], [orbit.u])
            moved = Harmonic(sine.amplitude, sine.frequency, orbit.phase)
            motion = simulate(rig, moved, state, duration=length, damping=damping)
            return [Replayed(ON_ORBIT, motion, (0.0,), length)]
    return []
