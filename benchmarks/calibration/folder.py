"""A scene as a campaign folder, and its truth beside it."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import h5py
import numpy as np
from benchmarks.calibration.damage import damaged
from benchmarks.calibration.scene import Scene, Test
from benchmarks.robustness.measuring import measured
from benchmarks.robustness.motion import STEP, FloatArray, move
from benchmarks.robustness.motion import Path as Motion
from scipy.interpolate import CubicSpline

_BEFORE = 4.0  # s at rest before a release, for a slow corner of the accelerometer
_SETTLE = 110.0  # cycles of a periodic test before its record begins
_PULLED, _OF_CLEARANCE = 0.010, 0.4  # start of a periodic test
_GRAVITY = 9.80665
_CELLS = ("clearance_mm", "base_amplitude_mm", "frequency_hz", "added_mass_g", "release_mm")
_CHANNELS = {
    "base": ("displacement", "m"),
    "displacement": ("displacement", "m"),
    "acceleration": ("acceleration", "m/s^2"),
}
_UNITS = {  # how a stated uncertainty is written: factor and unit
    "displacement": (100.0, "%"), "base": (100.0, "%"), "acceleration": (100.0, "%"),
    "nes_mass": (1e3, "g"), "added_mass": (1e3, "g"), "clearance": (1e3, "mm"),
    "release": (1e3, "mm"), "clock": (100.0, "%"), "remounting": (100.0, "%"),
}  # fmt: skip


@dataclass(frozen=True)
class Moved:
    """What a test truly did: amplitude of the mass (m), speeds at impacts (m/s)."""

    amplitude: float
    speeds: FloatArray


def write_campaign(scene: Scene, folder: Path) -> dict[str, Moved]:
    """campaign.yaml, records.csv, raw/ and truth.json; what every test did, by its name."""
    (folder / "raw").mkdir(parents=True, exist_ok=True)
    moved = {}
    for number, test in enumerate(scene.tests):
        rng = np.random.default_rng([scene.seed, 2029, number])
        path, start = _moved(test)
        sensors = test.sensors
        damage = dict(test.damage)
        record = partial(
            measured, sensors=sensors, start=start, rng=rng, frequency=test.drive.frequency or 8.0
        )
        channels = record(path)
        if second := damage.pop("second clock", 0.0):
            own = record(_by_clock(path, second, start))
            channels["acceleration"] = own["acceleration"] / (1.0 + second)
        channels, rate = damaged(channels, sensors.rate, damage, rng)
        _write(folder / "raw", test, channels, rate * (1.0 + scene.clock))
        late = path.x[round(start / STEP) :]
        moved[test.name] = Moved(math.sqrt(2.0) * float(late.std()), path.speed)
    rows = [",".join(("record", "file", "test", *_CELLS)), *(_row(t) for t in scene.tests)]
    (folder / "records.csv").write_text("\n".join([*rows, ""]), encoding="utf-8")
    (folder / "campaign.yaml").write_text(_description(scene), encoding="utf-8")
    return moved


def _description(scene: Scene) -> str:
    sensors = scene.tests[0].sensors
    shown = {"base": sensors.base, "displacement": sensors.laser,
             "acceleration": sensors.accelerometer}  # fmt: skip
    lines = [f'title: "{scene.name}"', f"known: {{nes_mass: {1e3 * scene.ball:.6g} g}}"]
    lines.append("channels:")
    for role, (quantity, unit) in _CHANNELS.items():
        if role == "displacement" and sensors.vibrometer:
            quantity, unit = "velocity", "m/s"
        if shown[role]:
            optional = ", optional: yes" if role == "base" else ""
            lines.append(
                f"  {role}: {{column: {role}, quantity: {quantity}, unit: {unit}{optional}}}"
            )
    if scene.stated:
        lines.append("uncertainties:")
        for name, value in scene.stated.items():
            factor, unit = _UNITS[name]
            lines.append(f"  {name}: {factor * value:.4g} {unit}")
    return "\n".join([*lines, ""])


def _row(test: Test) -> str:
    cells = [f"{test.typed[name]:.7g}" if name in test.typed else "" for name in _CELLS]
    files = [f"raw/{test.name}.h5"]
    if any(what == "second clock" for what, _ in test.damage):
        files.append(f"raw/{test.name}_second.h5")
    return ",".join([test.name, ";".join(files), test.kind, *cells])


def _write(raw: Path, test: Test, channels: dict[str, FloatArray], rate: float) -> None:
    """One file, or two where the acceleration has a recorder of its own."""
    parts = {test.name: channels}
    if any(what == "second clock" for what, _ in test.damage):
        first = {role: x for role, x in channels.items() if role != "acceleration"}
        parts = {
            test.name: first,
            f"{test.name}_second": {"acceleration": channels["acceleration"]},
        }
    for name, own in parts.items():
        with h5py.File(raw / f"{name}.h5", "w") as file:
            file.attrs["sample_rate_hz"] = rate
            for role, values in own.items():
                file.create_dataset(role, data=values.astype(np.float32))


def _moved(test: Test) -> tuple[Motion, float]:
    """The motion and the time in it at which the record begins, s."""
    if test.kind == "drop":
        return _dropped(test), 0.0
    body, b, load = test.body, test.b, test.load
    if test.stuck:
        b, load = None, load + body.m
    if test.kind == "periodic":
        settle = round(_SETTLE / test.drive.frequency, 3)
        out = min(_PULLED, _OF_CLEARANCE * (test.b or 0.02))
        path = move(body, test.drive, b=b, seconds=settle + test.seconds, x0=out, added=load)
        return path, settle
    path = move(body, test.drive, b=b, seconds=test.seconds, x0=test.release, added=load)
    wait = round(_BEFORE / STEP)
    rest = np.zeros(wait)
    held = Motion(
        np.concatenate([np.full(wait, path.x[0]), path.x]), np.concatenate([rest, path.v]),
        np.concatenate([rest, path.base]), path.time + _BEFORE, path.side, path.jump, path.speed,
    )  # fmt: skip
    return held, _BEFORE - test.held


def _by_clock(path: Motion, ratio: float, start: float) -> Motion:
    """A motion as a recorder sees it whose seconds are longer by `ratio`, from `start` on."""
    t = STEP * np.arange(path.v.size)
    own = start + (t - start) * (1.0 + ratio)
    jumped = np.concatenate([[0.0], np.cumsum(path.jump)])
    smooth = path.v - jumped[np.searchsorted(path.time, t, side="right")]
    seen = CubicSpline(t, smooth)(np.minimum(own, t[-1]))
    seen += jumped[np.searchsorted(path.time, own, side="right")]
    return replace(path, v=seen, time=start + (path.time - start) / (1.0 + ratio))


def _dropped(test: Test) -> Motion:
    """A ball dropped on the wall +1, the mass on a bench that gives the momentum back unseen."""
    body = replace(test.body, r_slope=0.0)
    n = round(test.seconds / STEP) + 1
    speeds = [math.sqrt(2.0 * _GRAVITY * test.release)]
    times = [0.15]
    chance = np.random.default_rng([round(1e6 * test.release), 37])
    each: list[float] = []
    while times[-1] < test.seconds and speeds[-1] > 2e-3:
        each.append(body.r * (1.0 + body.scatter * float(chance.standard_normal())))
        speeds.append(speeds[-1] * each[-1])
        times.append(times[-1] + 2.0 * speeds[-1] / _GRAVITY + body.contact)
    speed = np.array(speeds)
    jumps = (1.0 + np.array([*each, body.r])) * speed * body.m / body.M
    v = np.concatenate([[0.0], np.cumsum(jumps)])
    v = v[np.searchsorted(times, STEP * np.arange(n), side="right")]
    rest = np.zeros(n)
    return Motion(rest, v, rest, np.array(times), np.ones(speed.size), jumps, speed)


def write_truth(path: Path, truth: dict[str, object]) -> None:
    """truth.json beside the campaign; no step of the package reads it."""
    path.write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
