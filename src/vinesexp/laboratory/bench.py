"""The virtual bench: a rig, and the tests that a scene asks of it. SI throughout.

A weighed ball, a caliper, a ruler, a clock: each is off by a number that nobody knows. A scene that
states these uncertainties (`BenchSheet`) has its truth drawn around the numbers of its sheet, once
for all, from its seed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from vinesexp.excitation import Base, Release, WeakDamping
from vinesexp.laboratory.base_record import BaseRecord
from vinesexp.laboratory.oscilloscope import Oscilloscope, stream
from vinesexp.laboratory.sensors import Sensor, number, numbers_of
from vinesexp.records.campaign.yamltree import Section
from vinesexp.rig import NES, Oscillator, Rig


@dataclass(frozen=True)
class BenchSheet:
    """Standard uncertainties of what is written down; zero: exact.

    Attributes
    ----------
    nes_mass, added_mass : kg. Each ball is off by one draw, and each load, wherever it is used.
    clearance, release : m. Every test is off by draws of its own.
    clock : relative, of the oscilloscope: one draw.
    seed : of the draws, those of sensitivities included; None: that of the scene.
    """

    nes_mass: float = number("mass", "zero", 0.0)
    added_mass: float = number("mass", "zero", 0.0)
    clearance: float = number("displacement", "zero", 0.0)
    release: float = number("displacement", "zero", 0.0)
    clock: float = number("ratio", "zero", 0.0)
    seed: int | None = None

    @property
    def exact(self) -> bool:
        """Whether everything is as written."""
        return not any(getattr(self, name) for name in numbers_of(BenchSheet))

    def off(self, quantity: str, seed: int, *of: str) -> float:
        """How far the truth is from the sheet; `of` names what was drawn.

        Examples
        --------
        >>> sheet = BenchSheet(clearance=5e-5)
        >>> sheet.off("clearance", 1, "b34") == sheet.off("clearance", 1, "b34")
        True
        >>> sheet.off("nes_mass", 1, "ball 1")
        0.0
        """
        error = float(getattr(self, quantity))
        if not error:
            return 0.0
        own = seed if self.seed is None else self.seed
        return error * float(stream(own, " ".join(of), f"sheet {quantity}").standard_normal())


def read_sheet(whole: Section) -> BenchSheet:
    """The section `sheet` of scene.yaml."""
    entry = whole.under("sheet")
    known = numbers_of(BenchSheet)
    entry.refuse_unknown((*known, "seed"))
    found = entry.quantities(known)
    seed = entry.value("seed")
    if seed is not None and not isinstance(seed, int):
        entry.complain("seed", f"found '{seed}', expected a whole number")
        seed = None
    return BenchSheet(**found, seed=seed)


def stated(sheet: BenchSheet) -> list[str]:
    """The section `uncertainties` of campaign.yaml that says the same."""
    if sheet.exact:
        return ["uncertainties: exact"]
    lines = ["uncertainties:"]
    for name, (kind, _) in numbers_of(BenchSheet).items():
        size, unit = {"mass": (1e3, "g"), "displacement": (1e3, "mm"), "ratio": (1e2, "%")}[kind]
        error = size * getattr(sheet, name)
        lines.append(f"  {name}: " + (f"{error:.10g} {unit}" if error else "exact"))
    return lines + [f"  {name}: exact" for name in ("mass", "remounting", "template", "model")]


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
    clearance_minus : tuple of float
        That to the wall of side -1 where it differs; else empty.
    driven : base motion or BaseRecord, optional
        Of the base; of a record the samples are read when the test is performed. None: at rest.
    release : float
        Displacement that the mass is let go from, at rest, m.
    ball_start : tuple of float
        Where each ball lies at rest before: y - x over its clearance to that side, from -1 to +1;
        -1 is the wall of side +1 (x - y = +b).
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
    settle: float = number("time", "zero", 0.0)
    clearance: tuple[float, ...] = ()
    clearance_minus: tuple[float, ...] = ()
    driven: Base | BaseRecord | None = None
    release: float = number("displacement", "signed", 0.0)
    ball_start: tuple[float, ...] = ()
    added_mass: float = number("mass", "zero", 0.0)
    height: float = number("displacement", "", 0.0)
    note: str = ""

    __test__ = False  # not for pytest

    def base(self) -> Base | None:
        """The base motion; None: at rest. A measured one is read from its file here."""
        if isinstance(self.driven, BaseRecord):
            needed = self.settle + self.duration
            return self.driven.measured(needed=needed, record=self.record)
        return self.driven

    def release_state(self) -> Release:
        """The state the rig starts from, everything at rest."""
        minus = self.clearance_minus or self.clearance
        balls = zip(self.clearance, minus, self.ball_start, strict=True)
        y0 = tuple(self.release + p * (b if p < 0.0 else c) for b, c, p in balls)
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
    balls : tuple of NES
        One for all NESs or one for each; their clearances are those of a test.
    damping : WeakDamping
        Of the oscillator beyond c1; none unless the scene asks for it.
    groups : mapping
        Name to tests: what is simulated, and re-simulated, together.
    sheet : Sheet
        How well masses, clearances and releases are known: the truth is drawn around them.
    """

    title: str
    seed: int
    oscillator: Oscillator
    balls: tuple[NES, ...]
    damping: WeakDamping = field(default_factory=WeakDamping)
    groups: Mapping[str, tuple[Test, ...]] = field(default_factory=dict)
    sheet: BenchSheet = field(default_factory=BenchSheet)

    @property
    def tests(self) -> tuple[Test, ...]:
        """All tests, in the order of the file."""
        return tuple(test for group in self.groups.values() for test in group)

    @property
    def measured(self) -> list[str]:
        """Files of measured base motions, relative to the scene."""
        return sorted({t.driven.file for t in self.tests if isinstance(t.driven, BaseRecord)})

    def ball(self, number: int, *, clearance: float, minus: float | None = None) -> NES:
        """NES `number`, counted from 0, set to its clearances, with its true mass."""
        ball = self.balls[number if len(self.balls) > 1 else 0]
        m = ball.m + self.sheet.off("nes_mass", self.seed, f"ball {number + 1}")
        return replace(ball, m=m, b=clearance, b_minus=minus)

    def performed(self, test: Test) -> Test:
        """A test as it really was: clearances, release and load off what the sheet says."""
        if self.sheet.exact:
            return test
        offs = [
            self.sheet.off("clearance", self.seed, test.record, f"nes {i + 1}")
            for i in range(len(test.clearance))
        ]
        clearance, minus = (
            tuple(b + off for b, off in zip(own, offs, strict=False))
            for own in (test.clearance, test.clearance_minus)
        )
        release, load = test.release, test.added_mass
        if release:
            release += self.sheet.off("release", self.seed, test.record)
        if load:
            load += self.sheet.off("added_mass", self.seed, f"{load:.9g} kg")
        return replace(
            test, clearance=clearance, clearance_minus=minus, release=release, added_mass=load
        )

    def rig(self, test: Test) -> Rig:
        """The rig as it stands in one test: added mass on, NESs set to their clearances.

        Of a test as it was `performed`, the true rig.
        """
        loaded = replace(self.oscillator, M=self.oscillator.M + test.added_mass)
        minus = test.clearance_minus or (None,) * len(test.clearance)
        return Rig(
            loaded,
            [
                self.ball(i, clearance=b, minus=c)
                for i, (b, c) in enumerate(zip(test.clearance, minus, strict=True))
            ],
        )

    def truth(self) -> dict[str, float]:
        """What identification should find, by the names of identified.csv; SI.

        Of walls that differ, r is the mean of both; with a slope, that of slow impacts.
        """
        o = self.oscillator
        found = {"f0": o.f0, "zeta": o.zeta, "M": o.M, "c1": o.c1, "k1": o.k1}
        restitutions = [0.5 * (ball.r + ball.restitution(-1)) for ball in self.balls]
        found["r"] = restitutions[0]
        most = max((len(test.clearance) for test in self.tests), default=1)
        if most > 1:
            for i in range(most):
                found[f"r_{i + 1}"] = restitutions[i if len(restitutions) > 1 else 0]
        return found
