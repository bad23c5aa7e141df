"""A campaign before it is simulated: what was done, and what the sheet says was done; SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from benchmarks.robustness.rig import Body, Drive, Sensors

#: Defaults of `uncertainties` in campaign.yaml (docs/campaign.md): shares, kg, m.
DEFAULTS: Mapping[str, float] = {
    "displacement": 0.01,
    "template": 0.005,
    "base": 0.01,
    "base_amplitude": 0.02,
    "acceleration": 0.02,
    "nes_mass": 0.3e-3,
    "added_mass": 0.3e-3,
    "clearance": 0.05e-3,
    "release": 0.2e-3,
    "clock": 5e-5,
    "remounting": 1e-4,
    "mounting_damping": 0.01,
}


@dataclass(frozen=True)
class Test:
    """One record.

    Attributes
    ----------
    kind : ringdown, periodic, transient or drop.
    body : the rig as it was in this test: mounting, wear, drift.
    drive : base motion.
    b : clearance, m; None without a ball.
    load : mass screwed on, kg.
    release : the mass is let go from here, m.
    stuck : the ball sticks to its cavity.
    held : s that the record shows of the mass held before its release.
    typed : cells of records.csv, in its units.
    damage : what happens to the samples: (what, how much), see `damage.py`.
    """

    name: str
    kind: str
    body: Body
    seconds: float
    drive: Drive = field(default_factory=Drive)
    b: float | None = None
    load: float = 0.0
    release: float = 0.0
    stuck: bool = False
    held: float = 0.0
    typed: Mapping[str, float] = field(default_factory=dict)
    sensors: Sensors = field(default_factory=Sensors)
    damage: tuple[tuple[str, float], ...] = ()

    def says(self, **cells: float) -> Test:
        """With other cells in the sheet."""
        return replace(self, typed={**self.typed, **cells})

    def suffers(self, what: str, much: float = 0.0) -> Test:
        """With its samples damaged once more."""
        return replace(self, damage=(*self.damage, (what, much)))


@dataclass(frozen=True)
class Scene:
    """A campaign.

    Attributes
    ----------
    body : the rig: the middle of its mountings, at the middle of the campaign.
    ball : typed, kg.
    stated : uncertainties written in campaign.yaml; without them the defaults hold.
    causes : keys of `causes.CAUSES` that are there.
    family : plain, effects, unknown (beside the effects one that the package has no model of) or
        the name of a mistake.
    clock : true rate of the recorder over the one it states, less 1.
    """

    name: str
    seed: int
    body: Body
    tests: tuple[Test, ...]
    ball: float
    guess: float
    stated: Mapping[str, float] = field(default_factory=dict)
    causes: frozenset[str] = frozenset()
    family: str = "plain"
    clock: float = 0.0

    def periodic(self) -> list[Test]:
        """The periodic tests, in their order."""
        return [test for test in self.tests if test.kind == "periodic"]

    def mapped(self, change, kinds: str = "ringdown periodic transient drop") -> Scene:
        """With `change(test)` in the place of every test of these kinds."""
        tests = tuple(change(t) if t.kind in kinds.split() else t for t in self.tests)
        return replace(self, tests=tests)

    def with_bodies(self, change) -> Scene:
        """With another body, in every test and of the rig: `change(body)`."""
        moved = self.mapped(lambda t: replace(t, body=change(t.body)))
        return replace(moved, body=change(self.body))

    def with_sensors(self, **changes: object) -> Scene:
        """With other sensors in every test."""
        return self.mapped(lambda t: replace(t, sensors=replace(t.sensors, **changes)))
