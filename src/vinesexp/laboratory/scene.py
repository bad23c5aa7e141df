"""A scene: scene.yaml to instrument files and their truth, test by test.

A test depends on nothing but what `text_of` says. Truth goes to its own folder, which no step of
the analysis reads.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from itertools import chain
from pathlib import Path
from typing import Any, TypeVar

from vinesexp.errors import CampaignError, ParameterError, nearest
from vinesexp.excitation import Base, Harmonic, SteppedSweep, Sweep, WeakDamping
from vinesexp.laboratory.base_record import BaseRecord, read_base_record
from vinesexp.laboratory.bench import Scene, Test, read_sheet
from vinesexp.laboratory.instrument_files import FORMATS, TEXT_STYLES
from vinesexp.laboratory.oscilloscope import Oscilloscope, stream
from vinesexp.laboratory.sensors import Accelerometer, Laser, LocalMode, Sensor, numbers_of
from vinesexp.records.campaign.problems import Problems, raise_first
from vinesexp.records.campaign.schema import MOTIONS
from vinesexp.records.campaign.yamltree import Pairs, Section, read_yaml
from vinesexp.rig import NES, Oscillator
from vinesexp.units import parse_quantity, parse_sensitivity

# scene.yaml, read strictly: rig, sensors, oscilloscope, and the tests in their groups.
#
# What a group says holds for all its tests; what a record says holds for it alone. Sensors and
# oscilloscope can be changed for a group or a record key by key, which is how a fault is asked
# for. All mistakes of the file are collected, each with its line and key.
KEYS = ("title", "seed", "rig", "sheet", "sensors", "oscilloscope", "groups")
#: Key of a ball to the kind of its number, and what it may be beside above zero.
BALL = {
    "restitution": ("ratio", "zero"),
    "restitution_minus": ("ratio", "zero"),
    "restitution_slope": ("restitution slope", "signed"),
    "restitution_scatter": ("ratio", "zero"),
    "friction": ("acceleration", "zero"),
    "tilt": ("acceleration", "signed"),
    "contact_time": ("time", "zero"),
}
#: The same of the oscillator.
HOST = {
    "mass": ("mass", "needed"),
    "damping": ("damping", "needed zero"),
    "stiffness": ("stiffness", "needed"),
    "cubic_stiffness": ("cubic stiffness", "signed"),
}
WEAK = {
    "quadratic_damping": ("quadratic damping", "zero"),
    "coulomb_damping": ("force", "zero"),
}
RIG_KEYS = (*HOST, *WEAK, "nes_mass", *BALL)
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
_ALWAYS = ("test", "duration", "note", "sensors", "oscilloscope")
#: Keys of a record; a group takes them too, and `records`.
TEST_KEYS = tuple(dict.fromkeys(chain(_ALWAYS, *NEEDED.values(), *ALLOWED.values())))
Balls = tuple[NES, ...]
T = TypeVar("T")

#: Keys that `Oscillator`, `WeakDamping` or `NES` have under another name.
_FIELDS = {
    **{"mass": "M", "damping": "c1", "stiffness": "k1", "cubic_stiffness": "k3"},
    **{"quadratic_damping": "quadratic", "coulomb_damping": "coulomb"},
    **{"restitution": "r", "restitution_minus": "r_minus"},
    **{"restitution_slope": "r_slope", "restitution_scatter": "r_scatter"},
}
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")
_WALLS = {"wall +1": -1.0, "wall -1": 1.0, "middle": 0.0}

# The base motion that a record of a scene asks for: one frequency, a sweep, steps, or a file.
STEP_KEYS = ("start", "stop", "step")
MOST_STEPS = 10_000

# Sensors and oscilloscope as scene.yaml describes them; a fault not asked for is absent.
GAIN = {"gain_error": ("ratio", "signed"), "gain_uncertainty": ("ratio", "zero")}
COMMON_KEYS = ("sensitivity", *GAIN, "mode")
OSCILLOSCOPE_KEYS = tuple(field.name for field in fields(Oscilloscope))


def read_sensors(layers: Section, seed: int) -> dict[str, Sensor]:
    """Role to sensor; a role that nobody mentions has no sensor."""
    layers.refuse_unknown(MOTIONS)
    found: dict[str, Sensor] = {}
    for role in MOTIONS:
        if entry := layers.under(role):
            shaken = role == "acceleration"
            make, kind = (Accelerometer, role) if shaken else (Laser, "displacement")
            if (values := _sensor(entry, kind, numbers_of(make, kind), role, seed)) is not None:
                found[role] = make(**values)
    if not found:
        layers.complain("sensors", "no sensors; give at least 'displacement'")
    return found


def _sensor(
    entry: Section, kind: str, table: Mapping[str, tuple[str, str]], role: str, seed: int
) -> dict[str, Any] | None:
    """What is said of a sensor; None where it is wrong or what it needs is missing.

    A gain that is stated with its uncertainty alone is drawn, one for the role in the whole scene.
    """
    before = len(entry.problems.found)
    entry.refuse_unknown((*COMMON_KEYS, *table))
    values: dict[str, Any] = {**entry.quantities(table), "mode": _mode(entry)}
    if entry.value("sensitivity") is None:
        entry.complain("sensitivity", "is missing; such as '40 mV/mm' or '20 mV/g'")
    else:
        with entry.at("sensitivity"):
            values["sensitivity"], _ = parse_sensitivity(entry.value("sensitivity"), kind)
    if values.get("ring_damping", 0.0) >= 1.0:
        entry.complain("ring_damping", "expected below 1: an overdamped mounting does not ring")
    gain = entry.quantities(GAIN)
    stated, error = gain.get("gain_uncertainty", 0.0), gain.get("gain_error")
    if error is None:
        error = stated * float(stream(seed, role, "gain").standard_normal()) if stated else 0.0
    if error <= -1.0:
        entry.complain("gain_error", "expected more than -100 %: such a sensor shows nothing")
    values |= {"gain": 1.0 + error, "gain_uncertainty": stated}
    return values if len(entry.problems.found) == before else None


def _mode(entry: Section) -> LocalMode | None:
    """A local mode of the structure; None where there is none."""
    mode = entry.under("mode")
    if not mode:
        return None
    known = numbers_of(LocalMode)
    mode.refuse_unknown(known)
    found = mode.quantities(known)
    if found.get("damping", 0.0) >= 1.0:
        mode.complain("damping", "expected below 1: an overdamped mode does not oscillate")
    return LocalMode(**found) if {"frequency", "share"} <= set(found) else None


def read_oscilloscope(layers: Section, clock: float) -> Oscilloscope | None:
    """The oscilloscope, its clock off by what the sheet leaves open; None where it is wrong."""
    layers.refuse_unknown(OSCILLOSCOPE_KEYS)
    before = len(layers.problems.found)
    values = {"sample_rate": 1.0, "clock_error": 0.0, **layers.quantities(numbers_of(Oscilloscope))}
    values["clock_error"] += clock
    form = layers.text("format") or "oscilloscope-csv"
    if form not in FORMATS:
        layers.complain("format", f"unknown format '{form}'; {nearest(form, FORMATS)}")
    skew = layers.under("skew")
    skew.refuse_unknown(MOTIONS)
    scope = Oscilloscope(
        bits=layers.whole("bits", low=2, high=16, default=14),
        format=form,
        skew=skew.quantities(dict.fromkeys(MOTIONS, ("time", "signed"))),
        dropped_samples=layers.whole("dropped_samples", low=0, high=10**6, default=0),
        **values,
    )
    if scope.dropped_samples and form not in TEXT_STYLES:
        known = ", ".join(TEXT_STYLES)
        said = f"format {form} states no times, so they would go unnoticed; choose one of {known}"
        layers.complain("dropped_samples", said)
    return scope if len(layers.problems.found) == before else None


def read_base(entry: Section, kind: str, duration: float | None) -> Base | BaseRecord | None:
    """The base motion of one record of a scene; its mistakes are noted, and None then."""
    if "base_record" not in ALLOWED[kind]:
        return None
    if entry.value("base_record") is not None:
        for key in ("base_amplitude", "frequency", "dwell"):
            if entry.value(key) is not None:
                entry.complain(key, f"the base moves as base_record says; remove '{key}'")
        return read_base_record(entry.under("base_record"))
    amplitude = entry.quantity("base_amplitude", "displacement", needed=True)
    sweep = kind == "sweep"
    if sweep and entry.value("dwell") is not None:
        return _steps(entry, amplitude or 0.0)
    expected = "expected one frequency; [start, end] is for a sweep"
    if sweep:
        expected = "expected [start, end] of a sweep; more need 'dwell'"
    if isinstance(entry.value("frequency"), Pairs):
        entry.complain("frequency", expected)
        return None
    frequency = entry.lengthy("frequency", "frequency", needed=True)
    if frequency and len(frequency) != (2 if sweep else 1):
        entry.complain("frequency", expected)
    elif frequency and amplitude and not sweep:
        return Harmonic(amplitude, frequency[0])
    elif frequency and amplitude and duration:
        return Sweep(amplitude, frequency[0], frequency[1], duration)
    return None


def _steps(entry: Section, amplitude: float) -> SteppedSweep | None:
    """The stepped sweep that `dwell` makes of `frequency`."""
    frequencies = _frequencies(entry)
    dwell = entry.lengthy("dwell", "time")
    if not frequencies or not dwell:
        return None
    each = _for_each(entry, "dwell", dwell, len(frequencies), "frequencies")
    return SteppedSweep(amplitude, frequencies, each) if each else None


def _for_each(
    entry: Section, key: str, values: Sequence[T], count: int, what: str
) -> tuple[T, ...]:
    """A value for each, of one for all or one for each; empty where they are others: a mistake."""
    if len(values) not in (1, count) or not count:
        said = f"{len(values)} values for {count} {what}; give one for each, or one for all"
        entry.complain(key, said)
        return ()
    return tuple(values) * (count if len(values) == 1 else 1)


def _frequencies(entry: Section) -> tuple[float, ...]:
    """A list of frequencies, or start, stop (included) and step."""
    if not isinstance(entry.value("frequency"), Pairs):
        return entry.lengthy("frequency", "frequency", needed=True)
    span = entry.under("frequency")
    span.refuse_unknown(STEP_KEYS)
    start, stop, step = (span.quantity(key, "frequency", needed=True) for key in STEP_KEYS)
    if start is None or stop is None or step is None:
        return ()
    # A last step that falls short of `stop` by rounding alone is a whole one.
    count = math.floor(abs(stop - start) / step * (1.0 + 1e-9) + 1e-9)
    if count >= MOST_STEPS:
        span.complain("step", f"makes {count + 1} steps, expected at most {MOST_STEPS}")
        return ()
    sign = 1.0 if stop >= start else -1.0
    return tuple(start + sign * n * step for n in range(count + 1))


# The balls of a scene: mass, restitution wall by wall and over speed, friction, tilt.
def read_balls(rig: Section) -> tuple[NES, ...]:
    """The balls under `rig`: one that stands for all, or each; empty where there is none.

    Every key has one value for all balls, or a list of one for each. Their clearances are those of
    the tests; until then they are 1 m.
    """
    masses = rig.lengthy("nes_mass", "mass")
    values = {
        key: rig.lengthy(key, kind, needed=key == "restitution" and bool(masses), **{may: True})
        for key, (kind, may) in BALL.items()
    }
    if any(values["contact_time"]) and any(values["friction"]):
        rig.complain("contact_time", "contacts that last and friction are not simulated together")
        return ()
    for key in ("restitution", "restitution_minus"):
        for r in values[key]:
            if r > 1.0:
                rig.complain(key, f"found {r:g}, expected a number from 0 to 1")
                return ()
    if not masses or not values["restitution"]:
        for key, found in values.items():
            if found and key != "restitution":
                rig.complain(key, "there is no ball; give nes_mass and restitution")
        return ()
    given = {"nes_mass": masses, **{key: found for key, found in values.items() if found}}
    n = max(map(len, given.values()))
    each = {key: _for_each(rig, key, found, n, "balls") for key, found in given.items()}
    if not all(each.values()):
        return ()
    masses = each.pop("nes_mass")
    return tuple(
        NES(m=masses[i], b=1.0, **_named({key: found[i] for key, found in each.items()}))
        for i in range(n)
    )


def _named(values: Mapping[str, float]) -> dict[str, float]:
    """Values of keys by the names of the fields that they are of."""
    return {_FIELDS.get(key, key): value for key, value in values.items()}


def read_scene(file: Path, problems: Problems) -> Scene | None:
    """Understand scene.yaml; what is wrong goes to `problems`, and the scene is None then."""
    whole = read_yaml(problems)
    if whole is None:
        return None
    whole.refuse_unknown(KEYS)
    rig = whole.under("rig")
    rig.refuse_unknown(RIG_KEYS)
    host, weak = rig.quantities(HOST), rig.quantities(WEAK)
    balls = read_balls(rig)
    for ball in balls:
        if ball.m > host.get("mass", math.inf):
            rig.complain(
                "nes_mass",
                f"{ball.m:g} kg is more than the mass {host['mass']:g} kg that the "
                "ball is to calm; write grams as 'g'",
            )
    seed = whole.value("seed")
    if not isinstance(seed, int):
        whole.complain("seed", f"found '{seed}', expected a whole number")
    sheet = read_sheet(whole)
    known_seed = seed if isinstance(seed, int) else 0
    clock = sheet.off("clock", known_seed, "oscilloscope")
    drawn = known_seed if sheet.seed is None else sheet.seed
    groups = dict(_groups(whole, balls, drawn, clock))
    if problems.found or not isinstance(seed, int):
        return None
    oscillator, damping = Oscillator(**_named(host)), WeakDamping(**_named(weak))
    title = whole.text("title") or file.resolve().parent.name
    return Scene(title, seed, oscillator, balls, damping, groups, sheet)


def _groups(
    whole: Section, balls: Balls, seed: int, clock: float
) -> Iterator[tuple[str, tuple[Test, ...]]]:
    groups = whole.under("groups")
    if not groups.names():
        whole.complain("groups", "no groups of tests; each has 'records'")
    seen: dict[str, str] = {}
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
            if (other := seen.setdefault(record.lower(), name)) != name:
                whole.complain("groups", f"record '{record}' is in group {other} and in {name}")
            tests.append(_test(record, entry.over(group), whole, balls, seed, clock))
        yield name, tuple(test for test in tests if test is not None)


def _test(
    name: str, entry: Section, whole: Section, balls: Balls, seed: int, clock: float
) -> Test | None:
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
    stepped = kind == "sweep" and entry.value("dwell") is not None
    duration = entry.quantity("duration", "time", needed=not stepped)
    base = read_base(entry, kind, duration)
    if duration is None and isinstance(base, SteppedSweep):
        duration = base.duration
    known = numbers_of(Test).items()
    values = entry.quantities({
        key: (of, f"{may} needed" if key in needed else may) for key, (of, may) in known
    })  # fmt: skip
    minus = entry.lengthy("clearance_minus", "displacement")
    minus = minus and _for_each(entry, "clearance_minus", minus, len(clearance), "clearances")
    start = _ball_start(entry, clearance, minus or clearance)
    sensors = read_sensors(entry.under("sensors").over(whole.under("sensors")), seed)
    described = entry.under("oscilloscope").over(whole.under("oscilloscope"))
    scope = read_oscilloscope(described, clock)
    if len(entry.problems.found) > before or scope is None or duration is None:
        return None
    note = entry.text("note") or ""
    return Test(
        record=name, kind=kind, duration=duration, sensors=sensors, oscilloscope=scope,
        clearance=clearance, clearance_minus=minus, driven=base, ball_start=start, note=note,
        **values,
    )  # fmt: skip


def _refuse_unused(kind: str, entry: Section) -> None:
    """A key that this kind of test has no use for is a mistake, not a decoration."""
    for key in entry.names():
        if key in TEST_KEYS and key not in (*_ALWAYS, *NEEDED[kind], *ALLOWED[kind]):
            entry.complain(key, f"a {kind} test has no use for '{key}'; remove it")


def _require_balls(kind: str, entry: Section, wanted: int, there: int) -> None:
    """One ball under `rig` stands for as many alike as a test has clearances."""
    if (wanted or kind == "drop") and not there:
        entry.complain("clearance", "no ball; give nes_mass and restitution under 'rig'")
    elif 1 < there < wanted:
        entry.complain("clearance", f"{wanted} clearances for {there} balls under 'rig'")


def _ball_start(
    entry: Section, clearance: tuple[float, ...], minus: tuple[float, ...]
) -> tuple[float, ...]:
    """y - x over b of each ball: a wall, the middle, or a length from where both walls are b."""
    if not clearance:
        return ()
    if entry.value("ball_start") is None:
        entry.complain(
            "ball_start", "say where the balls lie at the start: wall +1, wall -1, middle or 5 mm"
        )
        return ()
    words = _for_each(entry, "ball_start", entry.listed("ball_start"), len(clearance), "balls")
    if not words:
        return ()
    found = []
    for word, b, c in zip(words, clearance, minus, strict=True):
        with entry.at("ball_start"):
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


def load_scene(path: Path) -> Scene:
    """Understand scene.yaml (docs/scenes.md), or say in one line what is wrong with it.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    Scene
        Everything in SI.

    Raises
    ------
    CampaignError
        The first mistake with line and key, and how many more there are.
    """
    problems = Problems(Path(path))
    scene = read_scene(Path(path), problems)
    raise_first(list({str(problem): problem for problem in problems.found}.values()))
    assert scene is not None  # or there are problems
    return scene


def raw_file(test: Test) -> Path:
    """Instrument file of a test, relative to the campaign folder."""
    return Path("raw") / f"{test.record}{FORMATS[test.oscilloscope.format][0]}"


def truth_file(test: Test) -> Path:
    """True impacts of a test, relative to the campaign folder."""
    return Path("truth") / f"{test.record}.csv"


def text_of(scene: Scene, test: Test) -> str:
    """All that the files of a test depend on, as one text: rig, seed, the test with its sensors."""
    rig = scene.oscillator, scene.damping, scene.balls
    return repr((scene.seed, *rig, scene.sheet, replace(test, note="")))


def simulate_test(scene: Scene, test: Test, folder: Path) -> list[Path]:
    """Simulate one test; its raw file and its truth, in `raw` and `truth` of a campaign folder."""
    from vinesexp.laboratory.experiment import perform

    raw, truth = folder / raw_file(test), folder / truth_file(test)
    for file in (raw, truth):
        file.parent.mkdir(parents=True, exist_ok=True)
    perform(scene, test, raw=raw, truth=truth)
    return [raw, truth]


def simulate_group(scene: Scene, group: str, folder: Path) -> list[Path]:
    """Simulate the tests of a group and write their raw files and truth.

    Parameters
    ----------
    scene : Scene
    group : str
        One of `Scene.groups`.
    folder : Path
        The campaign folder; `raw` and `truth` are made in it.

    Returns
    -------
    list of Path
        The raw files.

    Raises
    ------
    CampaignError
        No such group.
    """
    if group not in scene.groups:
        raise CampaignError(f"no group '{group}' in the scene; {nearest(group, scene.groups)}")
    return [simulate_test(scene, test, folder)[0] for test in scene.groups[group]]
