"""The virtual bench: a rig, and the tests that a scene asks of it. SI throughout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from vinesexp.excitation import Base, Harmonic, Release, SteppedSweep, Sweep, WeakDamping
from vinesexp.laboratory.base_record import BaseRecord
from vinesexp.laboratory.oscilloscope import Oscilloscope
from vinesexp.laboratory.sensors import Sensor
from vinesexp.rig import NES, Oscillator, Rig


@dataclass(frozen=True)
class Test:
    """One test, and how it is recorded.

    Parameters
    ----------
    record : str
        Its id; the raw file and the truth go by it.
    kind : str
        ``ringdown``, ``sweep``, ``periodic``, ``transient`` or ``drop``.
    duration : float
        Of the record, s.
    settle : float
        How long the rig has run when the record begins, s.
    clearance : tuple of float
        One-sided clearance of each NES, m.
    base_amplitude, frequency : float, (start, end)
        m, Hz; of the base motion; of a stepped sweep its first and last frequency.
    steps : SteppedSweep, optional
        The base motion where the frequency dwells.
    base_record : BaseRecord, optional
        The base motion where it was measured.
    release : float
        Displacement that the mass is let go from, at rest, m.
    ball_start : tuple of float
        Where each ball lies at rest before: y - x over its clearance, from -1 to +1; -1 is the
        wall of side +1 (x - y = +b).
    added_mass, height : float
        Fixed to the mass, kg; of a dropped ball over the wall, m.
    sensors : mapping
        Role to sensor, in the order of the channels.
    oscilloscope : Oscilloscope
    note : str
        For the table of records.
    """

    record: str
    kind: str
    duration: float
    sensors: Mapping[str, Sensor]
    oscilloscope: Oscilloscope
    settle: float = 0.0
    clearance: tuple[float, ...] = ()
    base_amplitude: float = 0.0
    frequency: tuple[float, float] | None = None
    steps: SteppedSweep | None = None
    base_record: BaseRecord | None = None
    release: float = 0.0
    ball_start: tuple[float, ...] = ()
    added_mass: float = 0.0
    height: float = 0.0
    note: str = ""

    __test__ = False  # not for pytest

    def base(self) -> Base | None:
        """The base motion; None: at rest. A measured one is read from its file here."""
        if self.base_record is not None:
            needed = self.settle + self.duration
            return self.base_record.measured(needed=needed, record=self.record)
        if self.steps is not None:
            return self.steps
        if self.frequency is None:
            return None
        start, end = self.frequency
        if self.kind == "sweep":
            return Sweep(self.base_amplitude, start, end, duration=self.duration)
        return Harmonic(self.base_amplitude, start)

    def release_state(self) -> Release:
        """The state the rig starts from, everything at rest."""
        balls = zip(self.clearance, self.ball_start, strict=True)
        y0 = tuple(self.release + place * b for b, place in balls)
        return Release(x0=self.release, v0=0.0, y0=y0, vy0=(0.0,) * len(y0))


@dataclass(frozen=True)
class Scene:
    """A simulated campaign, understood.

    Parameters
    ----------
    title : str
    seed : int
        Of everything random.
    oscillator : Oscillator
    balls : tuple of (m, r)
        Mass, kg, and restitution; one for all NESs or one for each.
    damping : WeakDamping
        Of the oscillator beyond c1; none unless the scene asks for it.
    groups : mapping
        Name to tests: what is simulated, and re-simulated, together.
    """

    title: str
    seed: int
    oscillator: Oscillator
    balls: tuple[tuple[float, float], ...]
    damping: WeakDamping = field(default_factory=WeakDamping)
    groups: Mapping[str, tuple[Test, ...]] = field(default_factory=dict)

    @property
    def tests(self) -> tuple[Test, ...]:
        """All tests, in the order of the file."""
        return tuple(test for group in self.groups.values() for test in group)

    def ball(self, number: int, *, clearance: float) -> NES:
        """NES `number`, counted from 0, set to a clearance."""
        m, r = self.balls[number if len(self.balls) > 1 else 0]
        return NES(m=m, b=clearance, r=r)

    def rig(self, test: Test) -> Rig:
        """The rig as it stands in one test: added mass on, NESs set to their clearances."""
        o = self.oscillator
        loaded = Oscillator(M=o.M + test.added_mass, c1=o.c1, k1=o.k1)
        return Rig(loaded, [self.ball(i, clearance=b) for i, b in enumerate(test.clearance)])

    def truth(self) -> dict[str, float]:
        """What identification should find, by the names of identified.csv; SI."""
        o = self.oscillator
        found = {"f0": o.f0, "zeta": o.zeta, "M": o.M, "c1": o.c1, "k1": o.k1}
        restitutions = [r for _, r in self.balls]
        found["r"] = restitutions[0]
        most = max((len(test.clearance) for test in self.tests), default=1)
        if most > 1:
            for i in range(most):
                found[f"r_{i + 1}"] = restitutions[i if len(restitutions) > 1 else 0]
        return found
