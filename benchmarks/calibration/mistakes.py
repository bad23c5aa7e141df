"""Mistakes that people make, one or two a campaign, on rigs without effects.

One half is open: the package may be tuned with it. The other is held back: it is looked at when
nothing is changed any more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from benchmarks.calibration.draw import over_records, plain, warmed, worn
from benchmarks.calibration.scene import Scene, Test

_KINDS = ("ringdown", "periodic", "transient", "drop")
_BALLS = "periodic transient"
_SEEDS = 10_000  # of the rigs: none that a campaign of the other family has
_AND = " + "

Change = Callable[[Scene, np.random.Generator], Scene]


@dataclass(frozen=True)
class Mistake:
    """A mistake by name, the causes that it is (keys of `causes.CAUSES`), and how it is made."""

    name: str
    causes: frozenset[str]
    make: Change
    held: bool


def mistakes(which: str = "all") -> list[Mistake]:
    """All mistakes, or the ``open`` or the ``held`` ones."""
    return [m for m in _ALL if which == "all" or m.held == (which == "held")]


def two_mistakes(seed: int) -> str:
    """The names of two mistakes that a seed draws, one after the other."""
    drawn = np.random.default_rng([seed, 29]).choice(len(_ALL), size=2, replace=False)
    return _AND.join(_ALL[k].name for k in drawn)


def parts_of(name: str) -> list[str]:
    """The mistakes of a campaign by its name."""
    return name.split(_AND)


def mistaken(name: str, seed: int) -> Scene:
    """The campaign of a mistake, or of two."""
    return _made(name, seed, _plain(seed))


def small(name: str, seed: int) -> Scene:
    """The same with two ring-downs, one load, four periodic tests and one release."""
    return _made(name, seed, few(_plain(seed)))


def few(scene: Scene) -> Scene:
    """Two ring-downs, one load, four periodic tests and one release of a campaign."""
    own = {kind: [t for t in scene.tests if t.kind == kind] for kind in _KINDS}
    bare = [t for t in own["ringdown"] if not t.load][:2]
    loaded = [t for t in own["ringdown"] if t.load][-1:]
    kept = [*bare, *loaded, *own["periodic"][:4], *own["transient"][:1]]
    return replace(scene, tests=tuple(kept))


def _plain(seed: int) -> Scene:
    return plain(_SEEDS + seed).with_sensors(base=True)


def _made(name: str, seed: int, scene: Scene) -> Scene:
    made = [next(m for m in _ALL if m.name == one) for one in parts_of(name)]
    for mistake in made:
        scene = mistake.make(scene, np.random.default_rng([seed, 23]))
    family = "two mistakes" if len(made) > 1 else f"{'held' if made[0].held else 'open'} mistake"
    causes = frozenset[str]().union(*(mistake.causes for mistake in made))
    return replace(scene, name=name, seed=seed, causes=causes, family=family)


def _typed(column: str, change: Callable[[float], float], kinds: str) -> Change:
    """A column of the sheet that is wrong throughout."""

    def make(scene: Scene, rng: np.random.Generator) -> Scene:
        def say(test: Test) -> Test:
            if column not in test.typed:
                return test
            return test.says(**{column: change(test.typed[column])})

        return scene.mapped(say, kinds)

    return make


def _all_clearances(change: Callable[[float], float]) -> Change:
    return _typed("clearance_mm", change, "periodic transient")


def _diameter(scene: Scene, rng: np.random.Generator) -> Scene:
    across = float(rng.choice([8.0, 10.0, 12.7, 20.0]))
    return _all_clearances(lambda b: b + across)(scene, rng)


def _exchanged(scene: Scene, rng: np.random.Generator) -> Scene:
    tests = scene.periodic()
    one, other = tests[0].name, tests[len(tests) // 2].name
    b = {t.name: t.typed["clearance_mm"] for t in tests}
    b[one], b[other] = b[other], b[one]
    return scene.mapped(lambda t: t.says(clearance_mm=b[t.name]), "periodic")


def _one_clearance(scene: Scene, rng: np.random.Generator) -> Scene:
    wrong = scene.periodic()[int(rng.integers(4))].name
    off = float(rng.uniform(1.0, 3.0) * rng.choice([-1.0, 1.0]))
    return scene.mapped(
        lambda t: t.says(clearance_mm=t.typed["clearance_mm"] + off) if t.name == wrong else t,
        "periodic",
    )


def _one_load(scene: Scene, rng: np.random.Generator) -> Scene:
    wrong = next(t.name for t in scene.tests if t.load)
    return scene.mapped(
        lambda t: t.says(added_mass_g=t.typed["added_mass_g"] + 25.0) if t.name == wrong else t
    )


def _no_base_channel(factor: float) -> Change:
    def make(scene: Scene, rng: np.random.Generator) -> Scene:
        typed = _typed("base_amplitude_mm", lambda G: float(f"{factor * G:.4g}"), "periodic")
        return typed(scene.with_sensors(base=False), rng)

    return make


def _gain(**factors: float) -> Change:
    """Channels in other units than the sheet says."""

    def make(scene: Scene, rng: np.random.Generator) -> Scene:
        own = scene.tests[0].sensors
        return scene.with_sensors(**{n: factor * getattr(own, n) for n, factor in factors.items()})

    return make


def _suffer(what: str, much: float, *, some: bool = False, kinds: str = "periodic") -> Change:
    """Damage to all tests of some kinds, or to one of them."""

    def make(scene: Scene, rng: np.random.Generator) -> Scene:
        only = scene.periodic()[1].name
        return scene.mapped(
            lambda t: t.suffers(what, much) if not some or t.name == only else t, kinds
        )

    return make


def _stuck(scene: Scene, rng: np.random.Generator) -> Scene:
    only = scene.periodic()[int(rng.integers(1, 4))].name
    return scene.mapped(lambda t: replace(t, stuck=t.name == only), "periodic")


def _short(scene: Scene, rng: np.random.Generator) -> Scene:
    return scene.mapped(lambda t: replace(t, seconds=1.5), "periodic transient")


def _held(scene: Scene, rng: np.random.Generator) -> Scene:
    return scene.mapped(
        lambda t: replace(t, held=float(rng.uniform(0.3, 0.8))), "ringdown transient"
    )


def _drifting_gain(scene: Scene, rng: np.random.Generator) -> Scene:
    total = float(rng.uniform(0.02, 0.05))
    return over_records(
        scene,
        lambda t, at: replace(
            t, sensors=replace(t.sensors, laser_gain=t.sensors.laser_gain * (1.0 + total * at))
        ),
    )


def _changed_r(scene: Scene, rng: np.random.Generator) -> Scene:
    less = float(rng.uniform(0.03, 0.08))
    return over_records(
        scene,
        lambda t, at: replace(t, body=replace(t.body, r=t.body.r - (less if at > 0.15 else 0.0))),
    )


def _changed_f0(scene: Scene, rng: np.random.Generator) -> Scene:
    share = float(rng.uniform(0.003, 0.008))
    return over_records(
        scene,
        lambda t, at: replace(
            t, body=replace(t.body, k1=t.body.k1 * (1.0 - (share if at > -0.1 else 0.0)) ** 2)
        ),
    )


def _ringing(scene: Scene, rng: np.random.Generator) -> Scene:
    return scene.with_sensors(ring=1700.0, ring_damping=0.02)


def _long_contact(scene: Scene, rng: np.random.Generator) -> Scene:
    return scene.with_bodies(lambda body: replace(body, contact=1.7e-3))


def _vibrometer(**changes: object) -> Change:
    """A velocity in the place of the displacement."""
    return lambda scene, rng: scene.with_sensors(vibrometer=True, **changes)


def _aliased(scene: Scene, rng: np.random.Generator) -> Scene:
    ringing = scene.with_sensors(rate=1e4, ring=float(rng.uniform(1900.0, 2600.0)),
                                 ring_damping=0.02)  # fmt: skip
    return ringing.mapped(lambda t: t.suffers("aliased", 10.0))


def _filtered(scene: Scene, rng: np.random.Generator) -> Scene:
    steel = {"contact": 3e-4, "shorter": 0.2}  # seconds at the working speed; Hertz
    short = scene.with_sensors(rate=1e4).with_bodies(lambda body: replace(body, **steel))
    return short.mapped(lambda t: t.suffers("filtered", 2.0))


def _set_up_anew(scene: Scene, rng: np.random.Generator) -> Scene:
    """The cavity slopes from the middle of the periodic tests on."""
    slope = float(rng.uniform(0.08, 0.2) * rng.choice([-1.0, 1.0]))
    return _later(scene, lambda t: replace(t, body=replace(t.body, tilt=slope)))


def _later(scene: Scene, change: Callable[[Test], Test]) -> Scene:
    """With a change from the middle of the periodic tests on; what follows them has it too."""
    first = scene.periodic()[len(scene.periodic()) // 2].name
    names = [t.name for t in scene.tests]
    late = set(names[names.index(first) :])
    return scene.mapped(lambda t: change(t) if t.name in late else t, _BALLS)


def _dusty(scene: Scene, rng: np.random.Generator) -> Scene:
    """Friction of the ball is another one in each test."""
    return scene.mapped(
        lambda t: replace(t, body=replace(t.body, friction=float(rng.uniform(0.02, 0.4)))), _BALLS
    )


def _aimed_anew(scene: Scene, rng: np.random.Generator) -> Scene:
    """The laser reads less from the middle of the periodic tests on."""
    share = float(rng.uniform(0.94, 0.97))

    def seen(t: Test) -> Test:
        return replace(t, sensors=replace(t.sensors, laser_gain=share * t.sensors.laser_gain))

    return _later(scene, seen)


def _loads_exchanged(scene: Scene, rng: np.random.Generator) -> Scene:
    loads = {t.name: t.typed["added_mass_g"] for t in scene.tests if t.load}
    turned = dict(zip(loads, [*list(loads.values())[1:], *list(loads.values())[:1]], strict=True))
    return scene.mapped(
        lambda t: t.says(added_mass_g=turned[t.name]) if t.name in turned else t, "ringdown"
    )


def _one_base(scene: Scene, rng: np.random.Generator) -> Scene:
    """The shaker was set lower in one test."""
    other, share = scene.periodic()[1].name, float(rng.uniform(0.75, 0.9))

    def shaken(t: Test) -> Test:
        drive = replace(t.drive, amplitude=share * t.drive.amplitude)
        return replace(t, drive=drive) if t.name == other else t

    return scene.mapped(shaken, "periodic")


def _rough_base(scene: Scene, rng: np.random.Generator) -> Scene:
    """Nothing controls the shaker: its base channel shows another amplitude in each test."""

    def shaken(t: Test) -> Test:
        amplitude = t.drive.amplitude * (1.0 + 0.01 * float(rng.standard_normal()))
        return replace(t, drive=replace(t.drive, amplitude=amplitude))

    return scene.mapped(shaken, "periodic").with_sensors(base=True)


def _rough_mountings(scene: Scene, rng: np.random.Generator) -> Scene:
    """f0 and damping of each mounting scatter five times as much as anybody stated."""
    drawn: dict[tuple[float | None, ...], tuple[float, float]] = {}

    def mounted(t: Test) -> Test:
        key = t.typed.get("added_mass_g"), t.typed.get("clearance_mm")
        own = float(5e-4 * rng.standard_normal()), float(0.05 * rng.standard_normal())
        f0, zeta = (1.0 + off for off in drawn.setdefault(key, own))
        return replace(t, body=replace(t.body, k1=t.body.k1 * f0**2, c1=t.body.c1 * f0 * zeta))

    return scene.mapped(mounted, "ringdown periodic transient")


def _unstated(scene: Scene, rng: np.random.Generator) -> Scene:
    """Nobody wrote down how far the base moved, nor from where the mass was let go."""
    left = {"base_amplitude_mm", "release_mm"}
    return scene.mapped(
        lambda t: replace(t, typed={k: v for k, v in t.typed.items() if k not in left})
    )


def _aboard(scene: Scene, rng: np.random.Generator) -> Scene:
    """The ball lay in its cavity while the mass rang down."""
    return scene.mapped(lambda t: replace(t, load=t.load + t.body.m), "ringdown")


def _another_ball(scene: Scene, rng: np.random.Generator) -> Scene:
    share = float(rng.uniform(1.05, 1.15))
    return over_records(
        scene,
        lambda t, at: replace(t, body=replace(t.body, m=t.body.m * (share if at > 0.15 else 1.0))),
    )


def _ball(scene: Scene, rng: np.random.Generator) -> Scene:
    return replace(scene, ball=scene.ball * float(rng.choice([0.8, 1.25])))


def _every(name: str, causes: str, make: Change, *, held: bool = False) -> Mistake:
    return Mistake(name, frozenset(c for c in causes.split("|") if c), make, held)


_ALL = [
    _every("2b typed for b", "twice", _all_clearances(lambda b: 2.0 * b)),
    _every("ball diameter added to all clearances", "diameter", _diameter),
    _every("two rows exchanged", "rows exchanged", _exchanged),
    _every("r wears", "wear", lambda s, rng: worn(s, float(rng.uniform(0.05, 0.1)))),
    _every("second recorder 0.1 % off", "second clock",
           _suffer("second clock", 1e-3, kinds=_BALLS)),
    _every("55 samples lost", "lost samples", _suffer("lost", 55.0, some=True)),
    _every("contact rings at 1.7 kHz", "contact rings", _ringing),
    _every("contact of 1.7 ms", "contact", _long_contact),
    _every("base typed peak to peak, no base channel", "base amplitude", _no_base_channel(2.0)),
    _every("base typed as rms, no base channel", "base amplitude", _no_base_channel(0.70711)),
    _every("added mass in kg", "added mass",
           _typed("added_mass_g", lambda m: 1e-3 * m, "ringdown")),
    _every("added masses typed as totals", "added mass",
           lambda s, rng: _typed("added_mass_g", lambda m: m + 1e3 * s.body.M, "ringdown")(s, rng)),
    _every("ball mass in kg", "ball mass", lambda s, rng: replace(s, ball=1000.0 * s.ball)),
    _every("ball stuck in a test", "stuck", _stuck),
    _every("records of 1.5 s", "short", _short),
    _every("knocks", "knocks", _suffer("knocks", 6.0, kinds=_BALLS)),
    _every("aliased accelerometer", "alias", _aliased),
    _every("short contacts, filtered before sampling", "contact", _filtered),
    _every("vibrometer, AC-coupled", "", _vibrometer(laser_corner=0.3)),
    _every("vibrometer alone", "", _vibrometer(accelerometer=False, base=False)),
    _every("held before release", "", _held),
    _every("laser loses its target 40 times", "dropouts", _suffer("dropouts", 40.0, kinds=_BALLS)),
    _every("release typed 1.2 times", "release",
           _typed("release_mm", lambda x: 1.2 * x, "transient")),
    _every("cavity set up anew, with a slope", "tilt|change", _set_up_anew),
    _every("floor more or less dusty", "friction|stuck", _dusty),
    _every("laser aimed anew", "drift of gain", _aimed_anew),
    _every("another base amplitude in one test", "base amplitude", _one_base),
    _every("base amplitude 1 % another in each test", "", _rough_base),
    _every("mountings five times as rough as stated", "", _rough_mountings),
    _every("added masses exchanged", "added mass", _loads_exchanged),
    _every("base channel five times", "base scale", _gain(base_gain=5.0)),
    _every("base amplitude and release not written down", "", _unstated),
    _every("ball in its cavity in the ring-downs", "aboard", _aboard),
    _every("another ball after a record", "ball mass|change", _another_ball),
    _every("one clearance wrong", "clearance", _one_clearance, held=True),
    _every("displacement in inches", "displacement scale", _gain(laser_gain=1 / 25.4), held=True),
    _every("displacement ten times", "displacement scale", _gain(laser_gain=10.0), held=True),
    _every("acceleration in g", "acceleration scale", _gain(accelerometer_gain=1 / 9.80665),
           held=True),
    _every("base channel a thousand times", "base scale", _gain(base_gain=1e3), held=True),
    _every("spring warms", "drift of f0",
           lambda s, rng: warmed(s, float(rng.uniform(0.004, 0.01))), held=True),
    _every("laser gain drifts", "drift of gain", _drifting_gain, held=True),
    _every("r changes after a record", "change", _changed_r, held=True),
    _every("f0 changes after a record", "change", _changed_f0, held=True),
    _every("accelerometer upside down", "inverted", _suffer("inverted acceleration", 0.0,
           kinds="ringdown periodic transient drop"), held=True),
    _every("laser sees the other side", "inverted", _suffer("inverted displacement", 0.0,
           kinds="ringdown periodic transient"), held=True),
    _every("accelerometer and base alone", "",
           lambda s, rng: s.with_sensors(laser=False), held=True),
    _every("samples of the accelerometer lost", "lost samples",
           _suffer("lost one", 40.0, some=True), held=True),
    _every("one added mass 25 g off", "added mass", _one_load, held=True),
    _every("ball weighed wrong", "ball mass", _ball, held=True),
    _every("clearances in cm", "twice|clearance", _all_clearances(lambda b: 0.1 * b), held=True),
    _every("base typed peak to peak, with base channel", "base amplitude",
           _typed("base_amplitude_mm", lambda G: 2.0 * G, "periodic"), held=True),
    _every("recorder 0.1 % off in a test", "second clock",
           _suffer("second clock", -1e-3, some=True), held=True),
]  # fmt: skip
