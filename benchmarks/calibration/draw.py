"""Campaigns drawn at random: rigs, plans, sheets, sensors, effects; everything by its seed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from benchmarks.calibration.scene import DEFAULTS, Scene, Test
from benchmarks.robustness.rig import Body, Drive, Sensors

from vinesexp.theory.optimal_clearance import b_c_exact

_GRAVITY = 9.80665
_SCATTERS = 0.06  # of its mean, from one impact to the next, r at most
#: Of the clearance that theory expects to be the end of two impacts per cycle.
_SHARES = (0.86, 0.92, 0.96, 0.985, 1.02, 1.08)


def campaign(seed: int) -> Scene:
    """Campaign number `seed`: half are plain, a quarter has effects, one unknown ones."""
    kind = ("plain", "effects", "plain", "unknown")[seed % 4]
    # no ball bounces twice alike
    scatter = float(np.random.default_rng([seed, 31]).uniform(0.0, _SCATTERS))
    scene = plain(seed).with_bodies(lambda body: replace(body, scatter=scatter))
    rng = np.random.default_rng([seed, 19])
    if kind == "plain":
        return scene
    if kind == "effects":
        return with_known(scene, rng, 1 + int(rng.integers(2)))
    return with_unknown(with_known(scene, rng, int(rng.integers(2))), rng)


def plain(seed: int, *, table_2: bool = False) -> Scene:
    """A campaign on a rig that is the model, scattered by what is stated of it."""
    rng = np.random.default_rng([seed, 7])
    body, G, frequency, guess = _rig(rng, table_2=table_2)
    known, stated = _uncertainties(rng)
    pulse_area = 1.0 + known["template"] * np.random.default_rng([seed, 29]).standard_normal()
    sensors = replace(_sensors(rng, known), pulse_area=pulse_area)
    length = float(np.clip(50.0 / frequency, 6.0, 9.0))
    mounted: dict[object, Body] = {}

    def mounting(key: object) -> Body:
        """f0 and damping of one mounting, which all tests made with it share."""
        if key not in mounted:
            f0 = 1.0 + known["remounting"] * rng.standard_normal()
            zeta = 1.0 + known["mounting_damping"] * rng.standard_normal()
            mounted[key] = replace(body, k1=body.k1 * f0**2, c1=body.c1 * f0 * zeta)
        return mounted[key]

    # Clearances: of the allowed error a common length, a common scale and one of each setting.
    common, scale, own = (known["clearance"] * share for share in (0.6, 0.4, 0.69))
    common, scale = common * rng.standard_normal(), scale * rng.standard_normal() / guess

    def clearance(typed: float) -> float:
        """True clearance of a setting that is typed as this many mm."""
        return 1e-3 * typed * (1.0 + scale) + common + own * rng.standard_normal()

    held = bool(rng.random() < 0.4)

    def hold() -> float:
        return float(rng.uniform(0.2, 0.8)) if held else 0.0

    tests: list[Test] = []
    high = float(f"{0.6e3 * guess:.2g}")
    for number, release in enumerate((high, 0.7 * high), start=1):
        typed = float(f"{release:.3g}")
        tests.append(
            Test(f"ring_{number}", "ringdown", mounting(0.0), length, release=_off(rng, typed),
                 held=hold(), typed={"release_mm": typed})
        )  # fmt: skip
    loads = [float(round(share * 1e3 * body.M)) for share in (0.06, 0.12, 0.2)]
    for load in loads[: 2 + int(rng.random() < 0.5)]:
        true = 1e-3 * load + known["added_mass"] * rng.standard_normal()
        tests.append(
            Test(f"added_{load:g}g", "ringdown", mounting(load), length, load=true,
                 release=_off(rng, high), held=hold(),
                 typed={"added_mass_g": load, "release_mm": high})
        )  # fmt: skip
    levels = (1.0,) if rng.random() < 0.75 else (1.0, 0.7)
    for level in levels:
        nominal = float(f"{level * G:.4g}")
        true_G = nominal * (1.0 + known["base_amplitude"] * rng.standard_normal())
        shares = _SHARES if len(levels) == 1 else _SHARES[::2]
        for share in shares:
            b = round(1e3 * share * guess * level, 1)
            tests.append(
                Test(f"p{'' if level == 1.0 else 'low'}_b{b:g}", "periodic", mounting(("b", b)),
                     length, Drive(true_G, frequency), b=clearance(b),
                     typed={"clearance_mm": b, "base_amplitude_mm": 1e3 * nominal,
                            "frequency_hz": frequency})
            )  # fmt: skip
    for share in (0.7, 0.9)[: 1 + int(rng.random() < 0.6)]:
        b = round(1e3 * share * guess, 1)
        tests.append(
            Test(f"release_b{b:g}", "transient", mounting(("b", b)), length, b=clearance(b),
                 release=high * 1e-3 + known["release"] * rng.standard_normal(), held=hold(),
                 typed={"clearance_mm": b, "release_mm": high})
        )  # fmt: skip
    if rng.random() < 0.25:
        tests.append(Test("drop_1", "drop", body, 1.6, release=float(rng.uniform(0.05, 0.12))))
    typed_ball = 1e-3 * float(f"{1e3 * body.m:.4g}")
    true_ball = typed_ball + known["nes_mass"] * rng.standard_normal()
    scene = Scene(
        f"campaign {seed}", seed, replace(body, m=true_ball),
        tuple(replace(t, body=replace(t.body, m=true_ball), sensors=sensors) for t in tests),
        typed_ball, guess, stated, clock=known["clock"] * rng.standard_normal(),
    )  # fmt: skip
    return scene


def _off(rng: np.random.Generator, millimetres: float) -> float:
    """A release by hand: of a ring-down nothing depends on it."""
    return 1e-3 * millimetres + 0.3e-3 * float(rng.standard_normal())


def _rig(rng: np.random.Generator, *, table_2: bool) -> tuple[Body, float, float, float]:
    """Rig, base amplitude, its frequency, and about where two impacts per cycle end."""
    if table_2:
        body, f0, b_c = Body(), math.sqrt(1.147e4 / 4.7) / (2.0 * math.pi), 33.9
    else:
        M = float(np.exp(rng.uniform(math.log(1.0), math.log(12.0))))
        f0 = float(np.exp(rng.uniform(math.log(5.0), math.log(9.5))))
        eps = float(rng.uniform(0.006, 0.02))
        zeta = float(np.exp(rng.uniform(math.log(2e-3), math.log(9e-3))))
        w = 2.0 * math.pi * f0
        body = Body(
            M=M, c1=2.0 * zeta * w * M, k1=M * w * w, m=eps * M, r=float(rng.uniform(0.45, 0.8))
        )
        b_c = float(rng.uniform(14.0, 36.0))
    unit = float(b_c_exact(G=1e-4, M=body.M, c1=body.c1, k1=body.k1, r=body.r, m=body.m))
    G = float(f"{1e-4 * b_c * 1e-3 / unit:.3g}")
    frequency = float(f"{f0 * (1.0 + 5e-4 * rng.standard_normal()):.4f}")
    true = b_c_exact(G=G, M=body.M, c1=body.c1, k1=body.k1, r=body.r, m=body.m, frequency=frequency)
    return body, G, frequency, float(true)


def _uncertainties(rng: np.random.Generator) -> tuple[dict[str, float], dict[str, float]]:
    """How much everything scatters, and what of this the sheet states: half state it."""
    known = dict(DEFAULTS)
    if rng.random() < 0.5:
        return known, {}
    stated = {
        "displacement": float(rng.uniform(0.002, 0.02)),
        "base": float(rng.uniform(0.003, 0.02)),
        "acceleration": float(rng.uniform(0.01, 0.04)),
        "clearance": float(rng.uniform(0.02, 0.15)) * 1e-3,
        "added_mass": float(rng.uniform(0.1, 1.0)) * 1e-3,
        "nes_mass": float(rng.uniform(0.05, 0.3)) * 1e-3,
        "remounting": float(rng.uniform(5e-5, 3e-4)),
    }
    stated = {name: float(f"{value:.2g}") for name, value in stated.items()}
    return known | stated, stated


def _sensors(rng: np.random.Generator, known: dict[str, float]) -> Sensors:
    """Gains off by what is stated; a mount that rings, an AC corner, noise, converters."""
    return Sensors(
        rate=1e4 if rng.random() < 0.3 else 5e3,
        pulse=float(rng.uniform(3e-4, 6e-4)),
        ring=float(rng.uniform(1800.0, 3500.0)) if rng.random() < 0.5 else None,
        ring_damping=float(rng.uniform(0.03, 0.08)),
        corner=float(rng.uniform(0.03, 0.3)) if rng.random() < 0.4 else None,
        laser_gain=1.0 + known["displacement"] * rng.standard_normal(),
        accelerometer_gain=1.0 + known["acceleration"] * rng.standard_normal(),
        base_gain=1.0 + known["base"] * rng.standard_normal(),
        noise=float(np.exp(rng.uniform(math.log(0.5), math.log(2.5)))),
        late=float(rng.choice([0.0, 0.0, 1e-4])),
        offset=float(rng.uniform(-0.5, 0.5)),
        bits=int(rng.choice([12, 14, 16])),
        base=bool(rng.random() < 0.85),
    )


def with_known(scene: Scene, rng: np.random.Generator, count: int) -> Scene:
    """So many effects that the package has a model of."""
    for name in rng.choice(list(KNOWN), size=count, replace=False):
        if {str(name), *scene.causes} >= {"contact", "speed"}:
            continue  # a spring with a dashpot has one r at any speed
        scene = KNOWN[name](scene, rng)
        scene = replace(scene, causes=scene.causes | {str(name)})
    return replace(scene, family="effects") if count else scene


def with_unknown(scene: Scene, rng: np.random.Generator) -> Scene:
    """One effect that the package has no model of."""
    name = str(rng.choice(list(UNKNOWN)))
    return replace(UNKNOWN[name](scene, rng), causes=scene.causes | {name}, family="unknown")


def _body(**draw):
    """An effect that changes the body: values drawn between limits, or made of the body."""

    def change(scene: Scene, rng: np.random.Generator) -> Scene:
        drawn = {
            name: limits(scene, rng) if callable(limits) else float(rng.uniform(*limits))
            for name, limits in draw.items()
        }
        return scene.with_bodies(lambda body: replace(body, **drawn))

    return change


def _walls(scene: Scene, rng: np.random.Generator) -> Scene:
    half = float(rng.uniform(0.01, 0.04) * rng.choice([-1.0, 1.0]))
    return scene.with_bodies(lambda b: replace(b, r=b.r + half, r_minus=b.r - half))


def _damping(scene: Scene, rng: np.random.Generator) -> Scene:
    """Part of the damping becomes quadratic and Coulomb friction, where the mass swings."""
    b, amplitude = scene.body, 0.15 * scene.guess
    w = math.sqrt(b.k1 / b.M)
    quadratic, coulomb = rng.uniform(0.05, 0.3), rng.uniform(0.0, 0.15)
    extra = {
        "quadratic": quadratic * b.c1 * 3.0 * math.pi / (8.0 * w * amplitude),
        "coulomb": coulomb * b.c1 * math.pi * w * amplitude / 4.0,
    }
    return scene.with_bodies(lambda body: replace(body, **extra))


def _cubic(scene: Scene, rng: np.random.Generator) -> Scene:
    share = float(rng.uniform(0.003, 0.02) * rng.choice([-1.0, 1.0]))
    strength = share * scene.body.k1 / (0.75 * (0.6 * scene.guess) ** 2)
    return scene.with_bodies(lambda body: replace(body, cubic=strength))


KNOWN = {
    "friction": _body(friction=(0.03, 0.5)),
    "tilt": _body(tilt=lambda _, rng: float(rng.uniform(0.02, 0.2) * rng.choice([-1.0, 1.0]))),
    "walls": _walls,
    "speed": _body(r_slope=(-0.12, -0.02)),
    "contact": _body(contact=(0.3e-3, 1.7e-3)),
    "rolling": _body(roll=(0.05, 2.0 / 7.0)),
    "damping": _damping,
    "spring": _cubic,
    "cross-axis": lambda scene, rng: scene.with_sensors(cross_axis=float(rng.uniform(0.01, 0.05))),
    "delay": lambda scene, rng: scene.with_sensors(late=float(rng.choice([3e-4, 1e-3, 2e-3]))),
}


def _second(multiple: float):
    def change(scene: Scene, rng: np.random.Generator) -> Scene:
        share = float(rng.uniform(0.02, 0.1))

        def shaken(test: Test) -> Test:
            drive = replace(test.drive, second_share=share,
                            second_frequency=multiple * test.drive.frequency)  # fmt: skip
            return replace(test, drive=drive)

        return scene.mapped(shaken, "periodic")

    return change


def over_records(scene: Scene, change) -> Scene:
    """`change(test, place)` of every test, place from -1/2 to 1/2 along the campaign."""
    places = np.linspace(-0.5, 0.5, len(scene.tests))
    pairs = zip(scene.tests, places, strict=True)
    return replace(scene, tests=tuple(change(test, float(at)) for test, at in pairs))


def worn(scene: Scene, total: float) -> Scene:
    """r falls by `total` from the first record to the last."""
    return over_records(
        scene, lambda t, at: replace(t, body=replace(t.body, r=t.body.r - total * at))
    )


def warmed(scene: Scene, total: float) -> Scene:
    """f0 falls by the share `total` from the first record to the last."""
    return over_records(
        scene,
        lambda t, at: replace(t, body=replace(t.body, k1=t.body.k1 * (1.0 - total * at) ** 2)),
    )


def _one_of(what: str, low: float, high: float, *, share: float = 1.0):
    """Damage to the samples of some tests with a ball."""

    def change(scene: Scene, rng: np.random.Generator) -> Scene:
        much = float(rng.uniform(low, high))
        kept = {t.name for t in scene.tests if t.b and rng.random() < share}
        kept |= {scene.periodic()[1].name}
        return scene.mapped(lambda t: t.suffers(what, much) if t.name in kept else t)

    return change


def _second_clock(scene: Scene, rng: np.random.Generator) -> Scene:
    ratio = float(rng.choice([-1.0, 1.0]) * rng.uniform(3e-4, 1e-3))
    return scene.mapped(lambda t: t.suffers("second clock", ratio))


UNKNOWN = {
    "contact rings": lambda scene, rng: scene.with_sensors(
        ring=float(rng.uniform(700.0, 1700.0)), ring_damping=float(rng.uniform(0.015, 0.04))
    ),
    "local mode": lambda scene, rng: scene.with_sensors(
        mode=float(rng.uniform(60.0, 160.0)), mode_share=float(rng.uniform(0.03, 0.25))
    ),
    "second harmonic": _second(2.0),
    "third harmonic": _second(3.0),
    "wear": lambda scene, rng: worn(scene, float(rng.uniform(0.02, 0.06))),
    "drift of f0": lambda scene, rng: warmed(scene, float(rng.uniform(1e-3, 4e-3))),
    "second clock": _second_clock,
    "lost samples": _one_of("lost", 20.0, 120.0, share=0.2),
    "magnet": _body(pull=(5.0, 25.0)),
    "knocks": _one_of("knocks", 3.0, 10.0, share=0.4),
}
