"""scene.yaml, read strictly: rig, sensors, oscilloscope, and the tests in their groups.

What a group says holds for all its tests; what a record says holds for it alone. Sensors and
oscilloscope can be changed for a group or a record key by key, which is how a fault is asked for.
All mistakes of the file are collected, each with its line and key.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from vinesexp.errors import ParameterError, nearest
from vinesexp.excitation import WeakDamping
from vinesexp.laboratory.bench import Scene, Test
from vinesexp.laboratory.scene_balls import read_balls
from vinesexp.laboratory.scene_base import read_base
from vinesexp.laboratory.scene_layers import Layers, refuse_unknown
from vinesexp.laboratory.scene_sensors import read_oscilloscope, read_sensors
from vinesexp.laboratory.sheet import read_sheet
from vinesexp.records.problems import Problems
from vinesexp.records.yamltree import read_yaml
from vinesexp.rig import NES, Oscillator
from vinesexp.units import parse_quantity

KEYS = ("title", "seed", "rig", "sheet", "sensors", "oscilloscope", "groups")
RIG_KEYS = (
    "mass",
    "damping",
    "quadratic_damping",
    "coulomb_damping",
    "stiffness",
    "cubic_stiffness",
    "nes_mass",
    "restitution",
    "restitution_minus",
    "restitution_slope",
    "friction",
    "tilt",
    "contact_time",
)
#: Keys of a record; a group takes them too, and `records`.
TEST_KEYS = (
    "test",
    "duration",
    "settle",
    "clearance",
    "clearance_minus",
    "base_amplitude",
    "frequency",
    "dwell",
    "base_record",
    "release",
    "ball_start",
    "added_mass",
    "height",
    "note",
    "sensors",
    "oscilloscope",
)
DRIVEN = ("base_amplitude", "frequency", "base_record")
#: What each test needs and what it can have besides; clearance brings ball_start along, and a
#: driven test has base_amplitude and frequency, or base_record.
NEEDED = {
    "ringdown": ("release",),
    "sweep": (),
    "periodic": ("clearance",),
    "transient": ("release", "clearance"),
    "drop": ("height",),
}
ALLOWED = {
    "ringdown": ("added_mass",),
    "sweep": (*DRIVEN, "dwell", "clearance", "clearance_minus", "ball_start"),
    "periodic": (*DRIVEN, "clearance_minus", "ball_start", "settle"),
    "transient": ("clearance_minus", "ball_start"),
    "drop": (),
}
Balls = tuple[NES, ...]

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")
_WALLS = {"wall +1": -1.0, "wall -1": 1.0, "middle": 0.0}


def read_scene(file: Path, problems: Problems) -> Scene | None:
    """Understand scene.yaml; what is wrong goes to `problems`, and the scene is None then."""
    top = read_yaml(file, problems)
    if top is None:
        return None
    refuse_unknown(top, KEYS, problems)
    whole = Layers((top,), problems)
    rig = whole.under("rig")
    rig.refuse_unknown(RIG_KEYS)
    oscillator = _oscillator(rig)
    damping = WeakDamping(
        quadratic=rig.quantity("quadratic_damping", "quadratic damping", zero=True) or 0.0,
        coulomb=rig.quantity("coulomb_damping", "force", zero=True) or 0.0,
    )
    balls = read_balls(rig)
    for ball in balls:
        if oscillator is not None and ball.m > oscillator.M:
            rig.complain(
                "nes_mass", f"{ball.m:g} kg is more than the mass {oscillator.M:g} kg that the "
                "ball is to calm; write grams as 'g'"
            )  # fmt: skip
    seed = top.values.get("seed")
    if not isinstance(seed, int):
        problems.add(f"found '{seed}', expected a whole number", where=top.where("seed"))
    sheet = read_sheet(whole)
    known_seed = seed if isinstance(seed, int) else 0
    clock = sheet.off("clock", known_seed, "oscilloscope")
    drawn = known_seed if sheet.seed is None else sheet.seed
    groups = dict(_groups(whole, balls, drawn, clock))
    _refuse_twice(groups, whole)
    if problems.found or oscillator is None or not isinstance(seed, int):
        return None
    title = str(top.values.get("title") or file.resolve().parent.name)
    return Scene(title, seed, oscillator, balls, damping, groups, sheet)


def _oscillator(rig: Layers) -> Oscillator | None:
    M = rig.quantity("mass", "mass", needed=True)
    c1 = rig.quantity("damping", "damping", needed=True, zero=True)
    k1 = rig.quantity("stiffness", "stiffness", needed=True)
    k3 = rig.quantity("cubic_stiffness", "cubic stiffness", signed=True) or 0.0
    return None if M is None or c1 is None or k1 is None else Oscillator(M=M, c1=c1, k1=k1, k3=k3)


def _groups(
    whole: Layers, balls: Balls, seed: int, clock: float
) -> Iterator[tuple[str, tuple[Test, ...]]]:
    groups = whole.under("groups")
    if not groups.names():
        whole.complain("groups", "no groups of tests; each has 'records'")
    for name in groups.names():
        group = groups.under(name)
        if not _NAME.fullmatch(name):
            groups.complain(name, "a group's name has letters, digits and _ . + - only")
        group.refuse_unknown((*TEST_KEYS, "records"))
        records = group.under("records")
        if not records.names():
            groups.complain(name, "has no records; give each a name under 'records'")
        tests = []
        for record in records.names():
            entry = records.under(record)
            entry.refuse_unknown(TEST_KEYS)
            tests.append(_test(record, entry.over(group), whole, balls, seed))
        yield name, tuple(_with_clock(test, clock) for test in tests if test is not None)


def _with_clock(test: Test, error: float) -> Test:
    """The test on an oscilloscope whose clock is off by what its sheet leaves open."""
    if not error:
        return test
    scope = test.oscilloscope
    return replace(test, oscilloscope=replace(scope, clock_error=scope.clock_error + error))


def _test(name: str, entry: Layers, whole: Layers, balls: Balls, seed: int) -> Test | None:
    before = len(entry.problems.found)
    kind = entry.text("test")
    if kind not in NEEDED:
        found = "no test" if kind is None else f"found '{kind}'"
        entry.complain("test", f"{found}; {nearest(str(kind), NEEDED)}")
        return None
    if not _NAME.fullmatch(name):
        entry.complain("test", f"the record name '{name}' can be no file's name")
    _refuse_unused(kind, entry)
    needed = NEEDED[kind]
    clearance = entry.lengthy("clearance", "displacement", needed="clearance" in needed)
    _require_balls(kind, entry, len(clearance), len(balls))
    base = read_base(entry, driven="base_record" in ALLOWED[kind], sweep=kind == "sweep")
    duration = entry.quantity("duration", "time", needed=base.steps is None)
    if duration is None and base.steps is not None:
        duration = base.steps.duration
    release = entry.quantity("release", "displacement", needed="release" in needed, signed=True)
    height = entry.quantity("height", "displacement", needed="height" in needed)
    minus = _clearance_minus(entry, len(clearance))
    start = _ball_start(entry, clearance, minus or clearance)
    sensors = read_sensors(entry.under("sensors").over(whole.under("sensors")), seed)
    scope = read_oscilloscope(entry.under("oscilloscope").over(whole.under("oscilloscope")))
    settle = entry.quantity("settle", "time", zero=True) or 0.0
    added_mass = entry.quantity("added_mass", "mass", zero=True) or 0.0
    if len(entry.problems.found) > before or scope is None or duration is None:
        return None
    return Test(
        record=name,
        kind=kind,
        duration=duration,
        sensors=sensors,
        oscilloscope=scope,
        settle=settle,
        clearance=clearance,
        clearance_minus=minus,
        base_amplitude=base.amplitude,
        frequency=base.frequency,
        steps=base.steps,
        base_record=base.record,
        release=release or 0.0,
        ball_start=start,
        added_mass=added_mass,
        height=height or 0.0,
        note=entry.text("note") or "",
    )


def _refuse_unused(kind: str, entry: Layers) -> None:
    """A key that this kind of test has no use for is a mistake, not a decoration."""
    always = ("test", "duration", "note", "sensors", "oscilloscope", "records")
    for key in entry.names():
        if key in TEST_KEYS and key not in (*always, *NEEDED[kind], *ALLOWED[kind]):
            entry.complain(key, f"a {kind} test has no use for '{key}'; remove it")


def _require_balls(kind: str, entry: Layers, wanted: int, there: int) -> None:
    """One ball under `rig` stands for as many alike as a test has clearances."""
    if (wanted or kind == "drop") and not there:
        entry.complain("clearance", "no ball; give nes_mass and restitution under 'rig'")
    elif 1 < there < wanted:
        entry.complain("clearance", f"{wanted} clearances for {there} balls under 'rig'")


def _clearance_minus(entry: Layers, balls: int) -> tuple[float, ...]:
    """Clearance of each ball to its wall of side -1; empty where the walls are alike."""
    minus = entry.lengthy("clearance_minus", "displacement")
    if minus and len(minus) != balls:
        entry.complain("clearance_minus", f"{len(minus)} for {balls} clearances; give one for each")
        return ()
    return minus


def _ball_start(
    entry: Layers, clearance: tuple[float, ...], minus: tuple[float, ...]
) -> tuple[float, ...]:
    """y - x over b of each ball: a wall, the middle, or a length from where both walls are b."""
    if not clearance:
        return ()
    given = entry.value("ball_start")
    if given is None:
        entry.complain(
            "ball_start", "say where the balls lie at the start: wall +1, wall -1, middle or 5 mm"
        )
        return ()
    words = given if isinstance(given, list) else [given] * len(clearance)
    if len(words) != len(clearance):
        entry.complain("ball_start", f"{len(words)} places for {len(clearance)} balls")
        return ()
    found = []
    for word, b, c in zip(words, clearance, minus, strict=True):
        with entry.problems.at(entry.where("ball_start")):
            place = _WALLS.get(str(word))
            if place is None:
                place = parse_quantity(word, "displacement").value
                place /= b if place < 0.0 else c
            elif word == "middle" and c != b:
                place = 0.5 * (c - b) / max(b, c)
            if abs(place) > 1.0:
                wall = 1e3 * (b if place < 0.0 else c)
                raise ParameterError(f"found '{word}', outside the cavity of clearance {wall:g} mm")
            found.append(place)
    return tuple(found)


def _refuse_twice(groups: dict[str, tuple[Test, ...]], whole: Layers) -> None:
    seen: dict[str, str] = {}
    for group, tests in groups.items():
        for test in tests:
            key = test.record.lower()
            if key in seen:
                whole.complain(
                    "groups", f"record '{test.record}' is in group {seen[key]} and in {group}"
                )
            seen[key] = group
